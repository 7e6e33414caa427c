//! Draws fillings of regular polygons as one SVG: `cargo run -p quadloom-quadrangulate --example draw_patches > patches.svg`.
//! Arguments are side counts, as in `4,4,4,4 3,3,6`; without any a gallery is drawn. Red: too few quads, blue: too many.

use glam::{DVec2, DVec3};
use mesh::Monitor;
use quadrangulate::{DiskSurface, Filler, PatchTopology, place};
use std::error::Error;
use std::f64::consts::TAU;

const GALLERY: &str = "6 3,5 2,8 4,4,6 3,4,9 5,5,5,5 3,4,7,6 5,4,6,7 3,3,9,3 4,4,4,4,4 2,5,6,3,4 1,4,5,4,4 4,4,4,4,4,4 3,5,4,6,3,5 \
    1,2,1,4 1,1,6,6 1,3,5,2,6,3 4,4,4,4,4,4,4 3,3,3,3,3,3,3,3 1,2,5,3,2,6,4,1";
const CELL: f64 = 260.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut asked: Vec<String> = std::env::args().skip(1).collect();
    if asked.is_empty() {
        asked = GALLERY.split_whitespace().map(String::from).collect();
    }
    let columns = 5;
    let rows = asked.len().div_ceil(columns);
    println!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" font-family="sans-serif" font-size="12">"#,
        CELL * columns as f64,
        CELL * rows as f64
    );
    println!(r##"<rect width="100%" height="100%" fill="#fff"/>"##);
    for (k, text) in asked.iter().enumerate() {
        let sides = text.split(',').map(str::parse).collect::<Result<Vec<u32>, _>>()?;
        let patch = Filler::new().fill(&sides)?;
        let positions = on_polygon(&patch, &sides)?;
        let origin = DVec2::new((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5) * CELL;
        draw(&patch, &sides, &positions, origin);
    }
    println!("</svg>");
    Ok(())
}

/// Positions on the regular polygon; a circle for fewer than three sides.
fn on_polygon(patch: &PatchTopology, sides: &[u32]) -> Result<Vec<DVec3>, Box<dyn Error>> {
    let n = sides.len();
    let rim = |side: usize, t: f64| {
        let corner = |k: usize| DVec2::from_angle(TAU * k as f64 / n as f64);
        if n < 3 {
            DVec2::from_angle(TAU * (side as f64 + t) / n as f64)
        } else {
            corner(side).lerp(corner(side + 1), t)
        }
    };
    let points = |count: &dyn Fn(usize) -> usize| -> Vec<DVec3> {
        (0..n).flat_map(|s| (0..count(s)).map(move |k| rim(s, k as f64 / count(s) as f64).extend(0.0))).collect()
    };
    let (segments, rings) = (24, 24u32);
    let ring = points(&|_| segments);
    let m = ring.len() as u32;
    let mut vertices = vec![DVec3::ZERO];
    let mut triangles: Vec<[u32; 3]> = (0..m).map(|k| [0, 1 + k, 1 + (k + 1) % m]).collect();
    for r in 1..=rings {
        vertices.extend(ring.iter().map(|&p| p * f64::from(r) / f64::from(rings)));
        let (inside, outside) = (1 + r.saturating_sub(2) * m, 1 + (r - 1) * m);
        for k in (0..m).filter(|_| r > 1) {
            let next = (k + 1) % m;
            triangles.push([inside + k, outside + k, outside + next]);
            triangles.push([inside + k, outside + next, inside + next]);
        }
    }
    let border: Vec<u32> = (vertices.len() as u32 - m..vertices.len() as u32).collect();
    let corners: Vec<usize> = (0..n).map(|k| k * segments).collect();
    let flat: Vec<DVec2> = vertices.iter().map(|p| p.truncate()).collect();
    let surface = DiskSurface { positions: &vertices, triangles: &triangles, border: &border, corners: &corners };
    Ok(place(patch, sides, &points(&|s| sides[s] as usize), &surface, Some(&flat), &Monitor::new())?)
}

fn draw(patch: &PatchTopology, sides: &[u32], positions: &[DVec3], origin: DVec2) {
    let at = |v: u32| {
        let p = positions[v as usize];
        origin + DVec2::new(p.x, -p.y) * CELL * 0.42
    };
    for q in &patch.quads {
        let points: Vec<String> = q.iter().map(|&v| format!("{:.1},{:.1}", at(v).x, at(v).y)).collect();
        println!(r##"<polygon points="{}" fill="#eef2f6" stroke="#456" stroke-width="0.8"/>"##, points.join(" "));
    }
    let mut count = vec![0i32; patch.vertex_count];
    patch.quads.iter().flatten().for_each(|&v| count[v as usize] += 1);
    let mut wanted = vec![4; patch.vertex_count];
    wanted[..patch.border.len()].fill(2);
    let mut passed = 0;
    for side in sides {
        wanted[passed as usize] = 1;
        passed += side;
    }
    for v in 0..patch.vertex_count {
        let colour = match count[v] - wanted[v] {
            0 if wanted[v] == 1 => "#222",
            0 => continue,
            off if off < 0 => "#d33",
            _ => "#36d",
        };
        let p = at(v as u32);
        println!(r#"<circle cx="{:.1}" cy="{:.1}" r="3.5" fill="{colour}"/>"#, p.x, p.y);
    }
    let label = origin + DVec2::new(-0.48, 0.48) * CELL;
    println!(r#"<text x="{}" y="{}">{sides:?} {:?}</text>"#, label.x, label.y, patch.method);
}
