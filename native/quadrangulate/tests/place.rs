//! Fillings placed on polygons, flat and bent: quads come out upright, on the surface, and better than unoptimised.

use glam::{DVec2, DVec3};
use mesh::{Monitor, scaled_jacobian};
use quadrangulate::{DiskSurface, Filler, PlaceError, fill_loop, place};
use std::f64::consts::TAU;

/// A star-shaped polygon triangulated in rings around its centre, with its flat positions.
struct Sheet {
    flat: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    border: Vec<u32>,
    corners: Vec<usize>,
}

impl Sheet {
    /// `outline`: the corners; every side gets `segments` edges, and so does the way to the centre.
    fn new(outline: &[DVec2], segments: usize) -> Self {
        let ring: Vec<DVec2> = (0..outline.len())
            .flat_map(|k| {
                let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
                (0..segments).map(move |s| a.lerp(b, s as f64 / segments as f64))
            })
            .collect();
        let m = ring.len() as u32;
        let mut flat = vec![DVec2::ZERO];
        let mut triangles: Vec<[u32; 3]> = (0..m).map(|k| [0, 1 + k, 1 + (k + 1) % m]).collect();
        for r in 1..=segments as u32 {
            flat.extend(ring.iter().map(|&p| p * f64::from(r) / segments as f64));
            if r > 1 {
                let (inside, outside) = (1 + (r - 2) * m, 1 + (r - 1) * m);
                for k in 0..m {
                    let next = (k + 1) % m;
                    triangles.push([inside + k, outside + k, outside + next]);
                    triangles.push([inside + k, outside + next, inside + next]);
                }
            }
        }
        let border = (flat.len() as u32 - m..flat.len() as u32).collect();
        Self { flat, triangles, border, corners: (0..outline.len()).map(|k| k * segments).collect() }
    }

    /// Side points at equal distances.
    fn border_points(outline: &[DVec2], sides: &[u32]) -> Vec<DVec2> {
        let side = |k: usize| (outline[k], outline[(k + 1) % outline.len()], sides[k]);
        (0..sides.len())
            .flat_map(|k| {
                let (a, b, n) = side(k);
                (0..n).map(move |s| a.lerp(b, f64::from(s) / f64::from(n)))
            })
            .collect()
    }
}

fn bend(p: DVec2) -> DVec3 {
    p.extend(0.2 * (p.x * 1.5).sin() + 0.15 * p.y * p.y)
}

fn worst_and_mean(quads: &[[u32; 4]], positions: &[DVec3]) -> (f64, f64) {
    let shape: Vec<f64> = quads
        .iter()
        .map(|q| {
            let p = q.map(|v| positions[v as usize]);
            // The sheet faces up; a quad that does not is inverted.
            let up = (p[2] - p[0]).cross(p[3] - p[1]).z.signum();
            up * scaled_jacobian(p)
        })
        .collect();
    (shape.iter().copied().fold(1.0, f64::min), shape.iter().sum::<f64>() / shape.len() as f64)
}

#[test]
fn random_polygons_get_upright_quads() {
    let mut state = 11u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    let (mut worsts, mut means, mut plain_worsts) = (vec![], vec![], vec![]);
    let mut filler = Filler::new();
    for round in 0..60 {
        let n = 3 + round % 4;
        let outline: Vec<DVec2> = (0..n)
            .map(|k| DVec2::from_angle(TAU * (k as f64 + 0.3 * random()) / n as f64) * (0.85 + 0.3 * random()))
            .collect();
        let mut sides: Vec<u32> = (0..n)
            .map(|k| (outline[k].distance(outline[(k + 1) % n]) / 0.17 * (0.9 + 0.2 * random())).round() as u32)
            .collect();
        sides[0] += sides.iter().sum::<u32>() % 2;
        let sheet = Sheet::new(&outline, 10);
        let positions: Vec<DVec3> = sheet.flat.iter().map(|&p| bend(p)).collect();
        let surface = DiskSurface {
            positions: &positions,
            triangles: &sheet.triangles,
            border: &sheet.border,
            corners: &sheet.corners,
        };
        let border: Vec<DVec3> = Sheet::border_points(&outline, &sides).into_iter().map(bend).collect();
        let filling = filler.fill(&sides).unwrap();
        let run = |flat| place(&filling, &sides, &border, &surface, flat, &Monitor::new()).unwrap();
        let placed = run(Some(&sheet.flat));
        assert_eq!(placed[..border.len()], border, "the border stays");
        for p in &placed[border.len()..] {
            assert!((p.z - bend(p.truncate()).z).abs() < 5e-3, "on the surface");
        }
        let (worst, mean) = worst_and_mean(&filling.quads, &placed);
        let (plain, _) = worst_and_mean(&filling.quads, &run(None));
        assert!(worst > 0.15 && worst > plain - 0.25, "{sides:?} {:?}: {worst} from {plain}", filling.method);
        worsts.push(worst);
        means.push(mean);
        plain_worsts.push(plain);
    }
    let average = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let least = |v: &[f64]| v.iter().copied().fold(1.0, f64::min);
    println!(
        "scaled Jacobian: least {:.2} on average, {:.2} at worst; mean {:.2}; pulled back only {:.2}, {:.2}",
        average(&worsts),
        least(&worsts),
        average(&means),
        average(&plain_worsts),
        least(&plain_worsts)
    );
    assert!(average(&worsts) > average(&plain_worsts) && average(&means) > 0.88);
}

#[test]
fn a_loop_without_corners_is_placed() {
    let outline: Vec<DVec2> = (0..12).map(|k| DVec2::from_angle(TAU * f64::from(k) / 12.0)).collect();
    let mut sheet = Sheet::new(&outline, 4);
    sheet.corners.clear();
    let positions: Vec<DVec3> = sheet.flat.iter().map(|p| p.extend(0.0)).collect();
    let surface =
        DiskSurface { positions: &positions, triangles: &sheet.triangles, border: &sheet.border, corners: &[] };
    let border: Vec<DVec3> = outline.iter().map(|p| p.extend(0.0)).collect();
    let filling = fill_loop(12).unwrap();
    let placed = place(&filling, &[12], &border, &surface, Some(&sheet.flat), &Monitor::new()).unwrap();
    assert!(worst_and_mean(&filling.quads, &placed).0 > 0.3);
}

#[test]
fn wrong_inputs_say_why() {
    let outline: Vec<DVec2> = (0..4).map(|k| DVec2::from_angle(TAU * f64::from(k) / 4.0)).collect();
    let sheet = Sheet::new(&outline, 2);
    let positions: Vec<DVec3> = sheet.flat.iter().map(|p| p.extend(0.0)).collect();
    let filling = quadrangulate::fill_disk(&[2, 2, 2, 2]).unwrap();
    let border: Vec<DVec3> = Sheet::border_points(&outline, &[2; 4]).into_iter().map(|p| p.extend(0.0)).collect();
    let run = |border_loop: &[u32], corners: &[usize], sides: &[u32], triangles: &[[u32; 3]]| {
        let surface = DiskSurface { positions: &positions, triangles, border: border_loop, corners };
        place(&filling, sides, &border, &surface, None, &Monitor::new())
    };
    let backwards: Vec<u32> = sheet.border.iter().rev().copied().collect();
    assert!(run(&sheet.border, &sheet.corners, &[2; 4], &sheet.triangles).is_ok());
    assert!(matches!(run(&backwards, &sheet.corners, &[2; 4], &sheet.triangles), Err(PlaceError::NotADisk { .. })));
    let holed = &sheet.triangles[1..];
    assert!(matches!(run(&sheet.border, &sheet.corners, &[2; 4], holed), Err(PlaceError::NotADisk { .. })));
    assert!(matches!(
        run(&sheet.border, &[0, 4, 3, 6], &[2; 4], &sheet.triangles),
        Err(PlaceError::Corner { corner: 1 })
    ));
    assert!(matches!(run(&sheet.border, &sheet.corners, &[4; 4], &sheet.triangles), Err(PlaceError::Count { .. })));
    let stopped = Monitor::new();
    stopped.cancel();
    let surface = DiskSurface {
        positions: &positions,
        triangles: &sheet.triangles,
        border: &sheet.border,
        corners: &sheet.corners,
    };
    let result = place(&filling, &[2; 4], &border, &surface, None, &stopped);
    assert!(matches!(result, Err(PlaceError::Cancelled(_))));
}
