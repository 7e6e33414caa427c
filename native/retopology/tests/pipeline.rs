//! The whole way to quads on generated surfaces, judged from the definitions.

use glam::DVec2;
use mesh::{DVec3, Monitor, PolygonMesh, Topology, scaled_jacobian};
use rayon::prelude::*;
use retopology::features::Features;
use retopology::{LayoutOptions, Options, Output, Size, retopologize};
use std::f64::consts::{PI, TAU};
use testkit::oracle;
use testkit::random::Random;

mod generated;
use generated::{marked_shape, punched_block, sharp};

/// Meshes generated; more by hand with `QUADLOOM_MESHES`.
const MESHES: u64 = 200;

/// What the quads owe to any surface: `Err` says what does not hold; else the quads that are turned over.
fn judge(mesh: &PolygonMesh, made: &PolygonMesh) -> Result<usize, String> {
    let check = |holds: bool, what: &str| if holds { Ok(()) } else { Err(what.to_owned()) };
    check(made.is_pure_quad(), "all faces are quads")?;
    check(oracle::euler(made) == oracle::euler(mesh), "Euler characteristic")?;
    check(oracle::components(made) == oracle::components(mesh), "components")?;
    let borders = |mesh: &PolygonMesh| Topology::of(mesh).border_loops().len();
    check(borders(made) == borders(mesh), "borders")?;
    let defects = mesh::check(made, &Monitor::new()).map_err(|error| error.to_string())?;
    check(defects.manifold(), "manifold")?;
    let edges = (0..made.face_count()).flat_map(|f| {
        let p: Vec<DVec3> = made.face_points(f).collect();
        (0..4).map(move |k| p[k].distance(p[(k + 1) % 4]))
    });
    check(edges.fold(f64::INFINITY, f64::min) > 0.0, "no edge of no length")?;
    let turned = |f: &usize| {
        let p: Vec<DVec3> = made.face_points(*f).collect();
        scaled_jacobian([p[0], p[1], p[2], p[3]]) <= 0.0
    };
    Ok((0..made.face_count()).filter(turned).count())
}

#[test]
fn generated_surfaces_become_valid_quads() {
    let meshes = std::env::var("QUADLOOM_MESHES").map_or(MESHES, |count| count.parse().expect("a number"));
    let run = |seed: u64| {
        let mut random = Random::new(seed);
        let (kind, n, marks) = (seed as u32 % 5, 1 + (seed / 5) as i32 % 3, (seed / 15) as u32 % 3);
        let rough = random.between(0.0, 0.2);
        let (mesh, features) = marked_shape(kind, n, marks, rough, &mut random);
        let mut options = Options::default();
        options.base.vertices = 20 + random.index(40) as u32;
        options.layout.size = Size::TargetFaces(250 + random.index(250));
        let made = retopologize(&mesh, &features, &options, &Monitor::new()).map_err(|error| error.to_string());
        (seed, made.and_then(|made| judge(&mesh, &made.mesh)))
    };
    let judged: Vec<(u64, Result<usize, String>)> = (0..meshes).into_par_iter().map(run).collect();
    let invalid: Vec<_> = judged.iter().filter(|(_, found)| found.is_err()).collect();
    assert!(invalid.is_empty(), "{invalid:?}");
    let turned: Vec<_> = judged.iter().filter(|(_, found)| *found != Ok(0)).collect();
    println!("{} of {meshes} have turned quads", turned.len());
    assert!(turned.len() as u64 * 10 <= meshes, "{} of {meshes} have turned quads: {turned:?}", turned.len());
}

#[test]
fn the_coarsest_layout_of_a_block_with_holes_has_few_patches() {
    let block = punched_block(5, 3, &[(1, 1), (3, 1)].into(), 2);
    let mut options = Options::default();
    options.layout.size = Size::TargetFaces(1000);
    let patches = |irregularity: f64| {
        let mut options = options.clone();
        options.layout.irregularity = irregularity;
        let made = retopologize(&block, &sharp(&block), &options, &Monitor::new()).unwrap();
        assert_eq!(judge(&block, &made.mesh), Ok(0));
        made.report.base_complex
    };
    let (even, coarse) = (patches(20.0), patches(f64::INFINITY));
    assert!(coarse <= 200 && coarse < even, "{coarse} of {even}");
}

#[test]
fn fewer_irregular_vertices_at_the_same_features() {
    let block = punched_block(5, 3, &[(1, 1), (3, 1)].into(), 2);
    let torus = testkit::shapes::torus(3.0, 1.0, 60, 30);
    // Of the block's, 24 are its corners.
    for (name, mesh, features, most) in
        [("block", &block, sharp(&block), 0.85), ("torus", &torus, Features::default(), 0.5)]
    {
        let make = |improve: bool| {
            let mut options = Options::default();
            options.layout = LayoutOptions { size: Size::TargetFaces(1500), improve, ..options.layout };
            let made = retopologize(mesh, &features, &options, &Monitor::new()).unwrap();
            assert_eq!(judge(mesh, &made.mesh), Ok(0), "{name}");
            made
        };
        let [laid, improved] = [false, true].map(make);
        let irregular = |made: &Output| {
            let topology = Topology::of(&made.mesh);
            (0..made.mesh.vertex_count() as u32).filter(|&v| topology.around(v).count() != 4).count()
        };
        let (before, after) = (irregular(&laid), irregular(&improved));
        println!("{name}: {before} to {after} irregular vertices");
        assert!(after as f64 <= most * before as f64, "{name}: {before} to {after} irregular vertices");
        assert_eq!(laid.feature_edges.len(), improved.feature_edges.len(), "{name}");
        assert!(improved.report.features_reproduced > 0.99, "{name}");
        let faces = improved.mesh.face_count() as f64 / 1500.0;
        assert!((faces - 1.0).abs() < 0.05, "{name}: {faces}");
    }
}

#[test]
fn a_thin_wall_without_features_is_not_folded() {
    // A pipe with a wall thinner than a quad is long, its rims round: the middle of a quad may be nearer to the other side of the wall.
    let ring = testkit::shapes::torus(1.0, 0.04, 96, 64);
    let pipe = ring.with_positions(ring.positions.iter().map(|p| DVec3::new(p.x, p.y, 50.0 * p.z)).collect());
    let options = Options {
        layout: LayoutOptions { size: Size::TargetFaces(600), ..LayoutOptions::default() },
        ..Options::default()
    };
    let made = retopologize(&pipe, &Features::default(), &options, &Monitor::new()).unwrap();
    assert_eq!(judge(&pipe, &made.mesh), Ok(0));
    assert_eq!(made.report.inverted, 0);
    assert!(made.report.scaled_jacobian_min > 0.1, "{}", made.report.scaled_jacobian_min);
}

#[test]
fn painted_sizes_are_realised_between_features() {
    // A sheet with holes, whose right end wants edges a quarter as long as its left one; the holes hold counts up.
    let block = punched_block(9, 3, &[(1, 1), (3, 1), (5, 1), (7, 1)].into(), 2);
    let [left, right] = [f64::min, f64::max].map(|pick| block.positions.iter().map(|p| p.x).reduce(pick).unwrap());
    let along = |p: &DVec3| (p.x - left) / (right - left);
    let mut options = Options::default();
    options.layout.size = Size::TargetFaces(3000);
    options.layout.density =
        block.positions.iter().map(|p| 4_f64.powf(-(3.0 * along(p) - 1.0).clamp(0.0, 1.0))).collect();
    let made = retopologize(&block, &sharp(&block), &options, &Monitor::new()).unwrap();
    assert_eq!(judge(&block, &made.mesh), Ok(0));
    let faces = made.mesh.face_count() as f64;
    assert!((faces / 3000.0 - 1.0).abs() < 0.02, "{faces} quads");
    let mean_area = |from: f64, to: f64| {
        let areas: Vec<f64> = (0..made.mesh.face_count())
            .map(|f| made.mesh.face_points(f).collect::<Vec<_>>())
            .filter(|p| p.iter().all(|p| (from..=to).contains(&along(p))))
            .map(|p| (p[2] - p[0]).cross(p[3] - p[1]).length() / 2.0)
            .collect();
        areas.iter().sum::<f64>() / areas.len() as f64
    };
    let contrast = (mean_area(-0.01, 1.0 / 3.0) / mean_area(2.0 / 3.0, 1.01)).sqrt();
    assert!((3.0..5.0).contains(&contrast), "edges differ by {contrast}");
}

/// A ring of height 0.3 about the z axis with round notches in its outside, whose rims have small fillets; and the edges of its rims.
fn notched_ring(notches: u32, arc: u32) -> (PolygonMesh, Features) {
    let (radius, cut) = (0.07, 0.008);
    let mut outline: Vec<DVec2> = Vec::new();
    for notch in 0..notches {
        let out = DVec2::from_angle(TAU * f64::from(notch) / f64::from(notches));
        let (along, middle) = (out.perp(), out * (1.0 - 0.5 * radius));
        let half: Vec<DVec2> = (0..=arc)
            .map(|k| DVec2::from_angle(PI * f64::from(k) / f64::from(arc)))
            .map(|at| middle - radius * (at.x * along + at.y * out))
            .collect();
        // A bit further apart than the notch is wide, so that every point of the outline is seen from the middle.
        let (first, last) = (half[0] + cut * (out - 0.2 * along), half[half.len() - 1] + cut * (out + 0.2 * along));
        let fillet = |from: DVec2, corner: DVec2, to: DVec2| {
            [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|t| from.lerp(corner, t).lerp(corner.lerp(to, t), t))
        };
        outline.extend(fillet(first - cut * along, first, half[0]));
        outline.extend(&half);
        let end = last + cut * along;
        outline.extend(fillet(half[half.len() - 1], last, end).into_iter().skip(1).chain([end]));
    }
    let n = outline.len();
    let inside = |p: &DVec2| 0.6 * p.normalize();
    let rings = [0.0, 0.3].map(|z| outline.iter().map(move |p| p.extend(z)).collect::<Vec<_>>());
    let holes = [0.3, 0.0].map(|z| outline.iter().map(|p| inside(p).extend(z)).collect::<Vec<_>>());
    let positions = [&rings[0][..], &rings[1], &holes[0], &holes[1]].concat();
    let at = |ring: usize, k: usize| (ring % 4 * n + k % n) as u32;
    let faces = (0..4).flat_map(|ring| (0..n).map(move |k| (ring, k)));
    let faces = faces.flat_map(|(ring, k)| {
        let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
        [[a, b, c], [a, c, d]]
    });
    let edges = (0..4).flat_map(|ring| (0..n).map(move |k| (ring, k)));
    let edges = edges.map(|(ring, k)| [at(ring, k), at(ring, k + 1)]).collect();
    (PolygonMesh::from_polygons(positions, faces).unwrap(), Features { edges, vertices: vec![] })
}

#[test]
fn round_notches_with_small_fillets_leave_rows_of_square_quads() {
    let (mesh, features) = notched_ring(24, 20);
    let made = retopologize(&mesh, &features, &Options::default(), &Monitor::new()).unwrap();
    assert_eq!(judge(&mesh, &made.mesh), Ok(0));
    let report = made.report;
    println!("{} irregular vertices, angles off by {}", report.irregular_vertices, report.angle_deviation);
    // 96 of them are corners.
    assert!(report.irregular_vertices < 240, "{}", report.irregular_vertices);
    assert!(report.angle_deviation < 8.0, "{}", report.angle_deviation);
}
