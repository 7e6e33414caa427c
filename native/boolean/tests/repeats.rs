//! Same input, same bytes: twenty repeats, on one thread and on two in turn, give the same result down to the last bit and
//! the same report but for the seconds.

use boolean::{Operation, Options, Output, Report, boolean};
use mesh::{DVec3, Monitor, PolygonMesh};
use std::collections::BTreeMap;
use testkit::{fixture, random, shapes};

const REPEATS: usize = 20;

/// Everything in an output, floating-point numbers as bits.
#[derive(Debug, PartialEq)]
struct Bytes {
    positions: Vec<[u64; 3]>,
    corners: Vec<u32>,
    face_source: Vec<[i32; 2]>,
    corner_source: Vec<(u8, u32, [u64; 4])>,
    intersection_edges: Vec<[u32; 2]>,
    report: String,
}

fn bytes(output: &Output) -> Bytes {
    let report = Report { seconds: BTreeMap::new(), ..output.report.clone() };
    Bytes {
        positions: output.mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect(),
        corners: output.mesh.corner_verts().to_vec(),
        face_source: output.face_source.clone(),
        corner_source: output.corner_source.iter().map(|c| (c.mesh, c.face, c.weights.map(f64::to_bits))).collect(),
        intersection_edges: output.intersection_edges.clone(),
        // Debug writes as many digits of a number as tell it from every other.
        report: format!("{report:?}"),
    }
}

fn assert_repeats(a: &PolygonMesh, b: &PolygonMesh, operation: Operation) {
    let options = Options::default();
    let pools = [1, 2].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool"));
    let run = |k: usize| {
        let made = pools[k % 2].install(|| boolean(a, b, operation, &options, &Monitor::new()));
        bytes(&made.expect("a result"))
    };
    let first = run(0);
    for k in 1..REPEATS {
        // Not assert_eq: nobody can read two meshes.
        assert!(run(k) == first, "repeat {k} differs");
    }
}

#[test]
fn shipped_meshes() {
    let a = fixture("spot_quad");
    let b = random::placement(&a, &fixture("lagrange_cube_edge_sharp"), 35);
    assert_repeats(&a, &b, Operation::Difference);
}

/// Several regions and creases, which are filled side by side.
#[test]
fn a_torus_through_a_cube() {
    let a = shapes::cuboid(DVec3::ONE * 1.4, 7);
    let b = random::placement(&a, &shapes::torus(1.0, 0.4, 24, 12), 5);
    assert_repeats(&a, &b, Operation::Union);
}
