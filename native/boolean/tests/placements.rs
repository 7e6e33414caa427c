//! Random placements of random quad meshes: closed in, closed out. Every property is recomputed with oracles that share
//! no code with the boolean: the test kit's topology and volume, and the exact boolean's own surface for reference.

use boolean::{BooleanError, Filler, Layout, Operation, Options, Output, Regroup, boolean};
use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh, self_intersections};
use proptest::prelude::*;
use std::collections::BTreeSet;
use testkit::{oracle, random, shapes};

const OPERATIONS: [Operation; 3] = [Operation::Union, Operation::Intersection, Operation::Difference];

/// Small closed quad meshes of several genera and shapes.
fn shape(k: usize) -> PolygonMesh {
    match k {
        0 => shapes::sphere(6),
        1 => shapes::cuboid(DVec3::new(1.0, 1.3, 0.8), 6),
        2 => shapes::torus(1.0, 0.4, 24, 12),
        _ => shapes::cylinder(0.6, 1.8, 5, 8),
    }
}

fn run(a: &PolygonMesh, b: &PolygonMesh, operation: Operation, options: &Options) -> Result<Output, BooleanError> {
    boolean(a, b, operation, options, &Monitor::new())
}

fn points(mesh: &PolygonMesh, face: usize) -> BTreeSet<[u64; 3]> {
    mesh.face_points(face).map(|p| p.to_array().map(f64::to_bits)).collect()
}

/// What every result must satisfy, whatever went in.
fn assert_sound(a: &PolygonMesh, b: &PolygonMesh, output: &Output) {
    let mesh = &output.mesh;
    assert!(mesh.is_pure_quad());
    oracle::closed_manifold(mesh).expect("closed and manifold");
    assert_eq!(output.face_source.len(), mesh.face_count());
    assert_eq!(output.corner_source.len(), mesh.corner_verts().len());
    for (f, &[m, g]) in output.face_source.iter().enumerate() {
        if m >= 0 {
            // A kept face is its source, corner for corner, bit for bit.
            assert_eq!(points(mesh, f), points([a, b][m as usize], g as usize));
        }
    }
    for source in &output.corner_source {
        let sum: f64 = source.weights.iter().sum();
        assert!((sum - 1.0).abs() < 1e-9 && source.weights.iter().all(|w| (0.0..=1.0).contains(w)));
        assert!((source.face as usize) < [a, b][source.mesh as usize].face_count());
    }
    for &[p, q] in &output.intersection_edges {
        assert!(
            mesh.faces().any(|f| (0..4).any(|k| f[k] == p && f[(k + 1) % 4] == q)),
            "an edge of the curve is no edge of the mesh"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 36, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn random_placements_stay_closed_and_pure(a in 0..4_usize, b in 0..4_usize, o in 0..3_usize, seed in 0..1_000_000_u64) {
        let (a, b) = (shape(a), shape(b));
        let b = random::placement(&a, &b, seed);
        match run(&a, &b, OPERATIONS[o], &Options::default()) {
            Ok(output) => assert_sound(&a, &b, &output),
            Err(BooleanError::Empty(_)) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// A sphere through the side of a cube: one curve, no surprises. Volumes of the three results must add up.
#[test]
fn volumes_of_the_three_operations_add_up() {
    let a = shapes::cuboid(DVec3::ONE * 2.0, 10);
    let b = shapes::transformed(&shapes::sphere(8), glam::DMat3::IDENTITY * 0.7, DVec3::new(1.05, 0.13, 0.07));
    let [union, intersection, difference] =
        OPERATIONS.map(|o| oracle::volume(&run(&a, &b, o, &Options::default()).expect("a result").mesh));
    let (va, vb) = (oracle::volume(&a), oracle::volume(&b));
    assert!((union + intersection - va - vb).abs() < 0.01 * va, "{union} + {intersection} is not {va} + {vb}");
    assert!((difference + intersection - va).abs() < 0.01 * va, "{difference} + {intersection} is not {va}");
}

#[test]
fn every_choice_of_filler_layout_and_regrouping_gives_a_sound_result() {
    let a = shapes::cuboid(DVec3::ONE * 2.0, 10);
    let b = shapes::transformed(&shapes::sphere(8), glam::DMat3::IDENTITY * 0.7, DVec3::new(1.05, 0.13, 0.07));
    for filler in [Filler::Auto, Filler::Patches, Filler::Matching] {
        let output = run(&a, &b, Operation::Union, &Options { filler, ..Options::default() }).expect("a result");
        assert_sound(&a, &b, &output);
    }
    for layout in [Layout::Separatrices, Layout::Motorcycle] {
        let options = Options { layout, regroup: Regroup::Rectangles, ..Options::default() };
        assert_sound(&a, &b, &run(&a, &b, Operation::Difference, &options).expect("a result"));
    }
}

#[test]
fn quads_beyond_the_retraction_distance_are_kept_and_a_wider_one_keeps_fewer() {
    let a = shapes::cuboid(DVec3::ONE * 2.0, 12);
    let b = shapes::transformed(&shapes::sphere(8), glam::DMat3::IDENTITY * 0.5, DVec3::new(1.0, 0.1, 0.05));
    let kept = |retraction_distance| {
        let options = Options { retraction_distance, ..Options::default() };
        run(&a, &b, Operation::Union, &options).expect("a result").report.faces_kept
    };
    let (near, far) = (kept(1.0), kept(3.0));
    assert!(near > far, "{near} kept at distance 1, {far} at distance 3");
    assert!(near as f64 > 0.75 * a.face_count() as f64);
}

#[test]
fn a_flawless_result_has_no_self_intersection() {
    let a = shapes::sphere(8);
    let b = shapes::transformed(&a, glam::DMat3::IDENTITY, DVec3::new(0.9, 0.2, 0.1));
    let output = run(&a, &b, Operation::Union, &Options::default()).expect("a result");
    assert_sound(&a, &b, &output);
    let (triangles, _) = TriangleMesh::from_polygons(&output.mesh);
    assert_eq!(self_intersections(&triangles, &Monitor::new()).expect("not cancelled"), Vec::<[u32; 2]>::new());
    assert_eq!(oracle::euler(&output.mesh), 2);
    assert_eq!(output.report.curves, 1);
}

#[test]
fn empty_results_and_bad_options_are_errors_with_a_sentence() {
    let a = shapes::sphere(4);
    let far = shapes::transformed(&a, glam::DMat3::IDENTITY, DVec3::splat(10.0));
    let small = shapes::transformed(&a, glam::DMat3::IDENTITY * 0.3, DVec3::ZERO);
    let options = Options::default();
    assert!(matches!(run(&a, &far, Operation::Intersection, &options), Err(BooleanError::Empty(_))));
    assert!(matches!(run(&small, &a, Operation::Difference, &options), Err(BooleanError::Empty(_))));
    // Nothing is cut: both come back whole.
    let apart = run(&a, &far, Operation::Union, &options).expect("two pieces");
    assert_eq!(apart.report.faces_kept, 2 * a.face_count());
    for bad in [
        Options { alpha: 1.5, ..Options::default() },
        Options { retraction_distance: -1.0, ..Options::default() },
        Options { sharp_angle: f64::NAN, ..Options::default() },
        Options { feature_edges: [vec![[0, 99_999]], vec![]], ..Options::default() },
    ] {
        assert!(matches!(run(&a, &far, Operation::Union, &bad), Err(BooleanError::Option(_))), "{bad:?}");
    }
}

#[test]
fn a_cancelled_monitor_stops_the_boolean() {
    let a = shapes::sphere(8);
    let b = random::placement(&a, &a, 3);
    let monitor = Monitor::new();
    monitor.cancel();
    assert!(matches!(
        boolean(&a, &b, Operation::Union, &Options::default(), &monitor),
        Err(BooleanError::Cancelled(_))
    ));
}
