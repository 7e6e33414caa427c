//! Patch layouts of plane and curved regions, judged by recomputing their topology. Set `QUADLOOM_PICTURES` to a folder to
//! draw them as SVG.

use glam::{DVec2, DVec3};
use mesh::{Monitor, Topology, TriangleMesh};
use quadrangulate::layout::{LayoutError, LayoutOptions, PatchLayout, SubSideKind, trace_layout};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::fmt::Write;
use testkit::plane_region::{circle, plane_region, subdivided};

fn flat(p: DVec2) -> DVec3 {
    p.extend(0.0)
}

fn dome(p: DVec2) -> DVec3 {
    p.extend(1.2 * (-0.25 * p.length_squared()).exp())
}

fn layout_of(mesh: &TriangleMesh) -> Result<PatchLayout, LayoutError> {
    trace_layout(mesh, &[], &LayoutOptions::default(), &Monitor::new())
}

fn euler_characteristic(triangles: &[[u32; 3]]) -> i32 {
    let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    let edges: BTreeSet<[u32; 2]> =
        triangles.iter().flat_map(|t| (0..3).map(|k| sorted(t[k], t[(k + 1) % 3]))).collect();
    vertices.len() as i32 - edges.len() as i32 + triangles.len() as i32
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Checks everything a layout promises, from its arrays alone.
fn check(input: &TriangleMesh, layout: &PatchLayout) {
    let mesh = &layout.mesh;
    assert_eq!(mesh.positions[..input.positions.len()], input.positions[..], "given vertices stay");
    let area = |m: &TriangleMesh| (0..m.triangles.len()).map(|t| m.area_normal(t).length() / 2.0).sum::<f64>();
    assert!((area(mesh) - area(input)).abs() < 1e-9 * area(input), "the surface is only refined");
    assert_eq!(euler_characteristic(&mesh.triangles), euler_characteristic(&input.triangles));
    let border = |m: &TriangleMesh| -> BTreeSet<[u32; 2]> {
        let topology = Topology::of_triangles(m);
        (0..topology.len() as u32).filter(|&h| topology.is_border(h)).map(|h| [topology.from(h), topology.to(h)]).collect()
    };
    assert_eq!(border(mesh), border(input), "the border keeps its edges");

    let mut owner = vec![u32::MAX; mesh.triangles.len()];
    let mut uses = vec![0; layout.sub_sides.len()];
    for (p, patch) in layout.patches.iter().enumerate() {
        for &t in &patch.triangles {
            assert_eq!(owner[t as usize], u32::MAX);
            owner[t as usize] = p as u32;
        }
        let triangles: Vec<[u32; 3]> = patch.triangles.iter().map(|&t| mesh.triangles[t as usize]).collect();
        assert_eq!(euler_characteristic(&triangles), 1, "patch {p} is a disk");
        assert!((3..=6).contains(&patch.sides.len()), "patch {p} has {} sides", patch.sides.len());
        assert_eq!(patch.sides.len(), patch.corners.len());
        // The sides, joined, are the border of the triangles, in its direction and without repeats.
        let part = TriangleMesh { positions: mesh.positions.clone(), triangles };
        let mut walked = BTreeSet::new();
        let mut starts = BTreeSet::new();
        for side in 0..patch.sides.len() {
            let path = layout.side_path(p, side);
            assert_eq!(path.last(), Some(&patch.corners[(side + 1) % patch.corners.len()]));
            walked.extend(path.windows(2).map(|w| [w[0], w[1]]));
            assert!(path[1..].iter().all(|&v| starts.insert(v)), "patch {p} meets itself");
            patch.sides[side].iter().for_each(|&sub| uses[sub as usize] += 1);
        }
        assert_eq!(walked, border(&part));
    }
    assert!(owner.iter().all(|&p| p != u32::MAX));
    for (sub, count) in layout.sub_sides.iter().zip(uses) {
        assert_eq!(count, if sub.kind == SubSideKind::Border { 1 } else { 2 });
        let on_border = border(input).iter().map(|e| sorted(e[0], e[1])).collect::<BTreeSet<_>>();
        for w in sub.vertices.windows(2) {
            assert_eq!(on_border.contains(&sorted(w[0], w[1])), sub.kind == SubSideKind::Border);
        }
    }
}

/// Draws a layout seen from above.
fn draw(name: &str, layout: &PatchLayout) {
    let Ok(folder) = std::env::var("QUADLOOM_PICTURES") else { return };
    let at = |v: u32| layout.mesh.positions[v as usize].truncate();
    let points = || layout.mesh.positions.iter().map(|p| p.truncate());
    let (low, high) = points().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let scale = 900.0 / (high - low).max_element();
    let place = |p: DVec2| DVec2::new(p.x - low.x, high.y - p.y) * scale + 10.0;
    let mut svg = format!("<svg xmlns='http://www.w3.org/2000/svg' width='920' height='{}'>", (high.y - low.y) * scale + 20.0);
    for (k, patch) in layout.patches.iter().enumerate() {
        let hue = (k as f64 * 0.618_034).fract() * TAU;
        let colour = [0.0, TAU / 3.0, 2.0 * TAU / 3.0].map(|phase| 195 + (55.0 * (hue + phase).cos()) as i32);
        for &t in &patch.triangles {
            let p = layout.mesh.triangles[t as usize].map(|v| place(at(v)));
            let _ = write!(
                svg,
                "<polygon points='{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}' fill='rgb({},{},{})' stroke='rgb(170,170,170)' stroke-width='0.4'/>",
                p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y, colour[0], colour[1], colour[2]
            );
        }
    }
    for sub in &layout.sub_sides {
        let path: Vec<String> = sub.vertices.iter().map(|&v| place(at(v))).map(|p| format!("{:.1},{:.1}", p.x, p.y)).collect();
        let colour = if sub.kind == SubSideKind::Border { "black" } else { "rgb(200,0,0)" };
        let _ = write!(svg, "<polyline points='{}' fill='none' stroke='{colour}' stroke-width='2'/>", path.join(" "));
        let p = place(at(sub.vertices[0]));
        let _ = write!(svg, "<circle cx='{:.1}' cy='{:.1}' r='4' fill='{colour}'/>", p.x, p.y);
    }
    svg.push_str("</svg>");
    std::fs::write(format!("{folder}/{name}.svg"), svg).expect("the picture folder exists");
}

fn polygon(corners: &[(f64, f64)], edge: f64) -> Vec<DVec2> {
    subdivided(&corners.iter().map(|&c| DVec2::from(c)).collect::<Vec<_>>(), edge)
}

fn shapes() -> BTreeMap<&'static str, TriangleMesh> {
    let l_shape = polygon(&[(0., 0.), (4., 0.), (4., 2.), (2., 2.), (2., 4.), (0., 4.)], 0.4);
    let hole = polygon(&[(1.5, 1.5), (3., 1.5), (3., 3.), (1.5, 3.)], 0.4);
    let outer = polygon(&[(0., 0.), (5., 0.), (5., 4.5), (0., 4.5)], 0.4);
    let pants = [circle(DVec2::ZERO, 3.0, 48), circle(DVec2::new(1.3, 0.2), 0.7, 13), circle(DVec2::new(-1.3, 0.), 0.6, 11)];
    let star: Vec<DVec2> =
        (0..10).map(|k| [3.0, 1.5][k % 2] * DVec2::from_angle(TAU * k as f64 / 10.0)).collect();
    let tube = |p: DVec2| DVec3::new(p.x.cos(), p.x.sin(), p.y);
    let strip = |angle: DVec2| 2.0 * DVec2::from_angle(angle.x) * (1.0 + angle.y);
    let _ = (tube, strip);
    let staircase = polygon(&[(0., 0.), (5., 0.), (5., 1.), (4., 1.), (4., 2.), (3., 2.), (3., 3.), (2., 3.), (2., 4.), (0., 4.)], 0.5);
    [
        ("l_shape", plane_region(&[l_shape.clone()], flat)),
        ("l_shape_curved", plane_region(&[l_shape], dome)),
        ("annulus", plane_region(&[circle(DVec2::ZERO, 2.0, 40), circle(DVec2::ZERO, 1.2, 30)], flat)),
        ("annulus_curved", plane_region(&[circle(DVec2::ZERO, 2.0, 31), circle(DVec2::new(0.2, 0.), 1.0, 17)], dome)),
        ("square_hole", plane_region(&[outer.clone(), hole], flat)),
        ("round_hole", plane_region(&[outer, circle(DVec2::new(2.2, 2.4), 1.0, 16)], dome)),
        ("pants", plane_region(&pants, flat)),
        ("pants_curved", plane_region(&pants, dome)),
        ("disk", plane_region(&[circle(DVec2::ZERO, 2.0, 32)], dome)),
        ("star", plane_region(&[subdivided(&star, 0.35)], flat)),
        ("staircase", plane_region(&[staircase], flat)),
        ("octagon", plane_region(&[subdivided(&circle(DVec2::ZERO, 2.0, 8), 0.4)], flat)),
    ]
    .into()
}

#[test]
fn shapes_become_patches() {
    for (name, mesh) in shapes() {
        let start = std::time::Instant::now();
        match layout_of(&mesh) {
            Ok(layout) => {
                draw(name, &layout);
                check(&mesh, &layout);
                eprintln!("{name}: {} triangles, {} patches, {} flattened, {:?}", mesh.triangles.len(), layout.patches.len(), layout.flattened.len(), start.elapsed());
            }
            Err(error) => panic!("{name}: {error}"),
        }
    }
}
