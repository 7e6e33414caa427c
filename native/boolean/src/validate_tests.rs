//! Every complaint, provoked by a mesh broken in one way. The sound mesh is two cubes apart from each other, all of whose
//! faces count as new.

use super::*;
use crate::Operation;
use crate::polychord::Strips;
use crate::test_setting::TestSetting;
use mesh::NONE;
use std::collections::BTreeMap;
use testkit::shapes;

const SIDE: u32 = 4;

fn cubes() -> [PolygonMesh; 2] {
    let cube = shapes::cuboid(DVec3::ONE, SIDE);
    let other = shapes::transformed(&cube, glam::DMat3::IDENTITY, DVec3::X * 2.0);
    [cube, other]
}

/// A vertex in the middle of the side of the first cube that faces away from the second.
fn middle(mesh: &PolygonMesh) -> usize {
    mesh.positions.iter().position(|p| *p == DVec3::new(-0.5, 0.0, 0.0)).expect("an even number of quads a side")
}

/// What `validate` says when the result is the two cubes after `change`.
fn verdict(change: impl FnOnce(&mut Vec<DVec3>, &mut Vec<[u32; 4]>)) -> Verdict {
    let [a, b] = cubes();
    let mut setting = TestSetting::new(&a, &b, Operation::Union);
    // All of the surface is band.
    setting.kept = setting.kept.map(|kept| vec![false; kept.len()]);
    let options = crate::Options::default();
    let band = crate::band::extract(&setting.inputs, &setting.cut, &setting.kept, &Strips::default(), &options);
    let both = shapes::joined(&[a.clone(), b.clone()]);
    let mut positions = both.positions.clone();
    let mut faces: Vec<[u32; 4]> = both.faces().map(|f| [f[0], f[1], f[2], f[3]]).collect();
    change(&mut positions, &mut faces);
    let stitched = Stitched {
        face_source: vec![[-1, -1]; faces.len()],
        face_region: vec![0; faces.len()],
        piece_source: BTreeMap::new(),
        band_vertex: vec![NONE; band.surface.positions.len()],
        mesh: PolygonMesh::from_polygons(positions, &faces).expect("indices in range"),
    };
    validate(&stitched, &setting.cut, &band, setting.diagonal, &Monitor::new()).expect("not cancelled")
}

#[test]
fn the_surface_itself_is_valid() {
    let sound = verdict(|_, _| {});
    assert!(sound.is_valid(), "{}", sound.complaints());
    assert_eq!(sound.complaints(), "");
    assert_eq!((sound.irregular, sound.inverted.len(), sound.intersecting.len()), (16, 0, 0));
    assert!((sound.jacobian_min - 1.0).abs() < 1e-12 && (sound.jacobian_mean - 1.0).abs() < 1e-12);
    assert_eq!(sound.spots, []);
    assert!(sound.distance < 1e-12 && sound.volume_error < 1e-12 && sound.score() < 1e-12);
}

#[test]
fn an_open_edge() {
    let open = verdict(|_, faces| faces.truncate(faces.len() - 1));
    assert_eq!(open.topology.as_deref(), Some("4 open or non-manifold edges"));
    assert!(!open.is_valid() && open.score() == f64::INFINITY);
}

#[test]
fn a_face_that_is_turned_over() {
    let turned = verdict(|_, faces| faces[3].reverse());
    assert!(turned.topology.expect("a complaint").contains("open or non-manifold edges"));
}

#[test]
fn a_pinched_vertex() {
    let pinched = verdict(|positions, faces| {
        // A corner of the second cube is moved onto one of the first and merged with it.
        let per_cube = positions.len() / 2;
        let corner = |x: f64| positions.iter().position(|p| *p == DVec3::new(x, 0.5, 0.5)).expect("a corner") as u32;
        let (keep, gone) = (corner(0.5), corner(1.5));
        assert!((gone as usize) >= per_cube);
        faces.iter_mut().flatten().filter(|v| **v == gone).for_each(|v| *v = keep);
    });
    assert_eq!(pinched.topology.as_deref(), Some("1 vertices where the surface touches itself"));
}

#[test]
fn a_missing_component() {
    let one = verdict(|_, faces| faces.truncate(faces.len() / 2));
    assert_eq!(one.topology.as_deref(), Some("Euler characteristic 2 in 1 pieces, where the exact boolean has 4 in 2"));
}

#[test]
fn inverted_quads() {
    let quad = 1.0 / f64::from(SIDE);
    let bad = verdict(|positions, _| {
        // Within the plane, past the opposite corner of one of its quads.
        let v = middle(&cubes()[0]);
        positions[v] += DVec3::new(0.0, 1.2 * quad, 1.2 * quad);
    });
    assert_eq!(bad.topology, None);
    assert!(!bad.inverted.is_empty() && bad.jacobian_min < 0.0 && !bad.is_valid());
    assert!(bad.complaints().contains(&format!("{} inverted quads", bad.inverted.len())));
    assert!(bad.score() >= bad.inverted.len() as f64);
    // All that is wrong is near the vertex that was moved.
    assert!(bad.spots.len() >= bad.inverted.len());
    assert!(bad.spots.iter().all(|p| p.distance(DVec3::new(-0.5, 0.0, 0.0)) < 2.5 * quad), "{:?}", bad.spots);
}

#[test]
fn faces_that_intersect() {
    let bad = verdict(|positions, _| {
        let v = middle(&cubes()[0]);
        positions[v].x = 0.6;
    });
    // The four quads at the vertex poke through the opposite side.
    assert!(!bad.intersecting.is_empty());
    let at_vertex: Vec<u32> = {
        let cube = &cubes()[0];
        (0..cube.face_count() as u32).filter(|&f| cube.face(f as usize).contains(&(middle(cube) as u32))).collect()
    };
    assert!(bad.intersecting.iter().all(|pair| pair.iter().any(|f| at_vertex.contains(f))), "{:?}", bad.intersecting);
    assert!(bad.complaints().contains("pairs of intersecting faces"));
}

#[test]
fn too_far_away() {
    let diagonal = DVec3::new(3.0, 1.0, 1.0).length();
    let out = |part: f64| {
        verdict(|positions, _| {
            let v = middle(&cubes()[0]);
            positions[v].x -= part * diagonal;
        })
    };
    let bad = out(0.02);
    assert!((bad.distance - 0.02).abs() < 1e-9, "{}", bad.distance);
    assert_eq!(bad.spots, [DVec3::new(-0.5 - 0.02 * diagonal, 0.0, 0.0)]);
    assert!(!bad.is_valid() && bad.complaints().starts_with("2.00% of the diagonal away"), "{}", bad.complaints());
    assert!(out(0.005).is_valid());
}

#[test]
fn volume_lost() {
    let shrink = |factor: f64| verdict(|positions, _| positions.iter_mut().for_each(|p| p.z *= factor));
    let bad = shrink(0.985);
    assert!((bad.volume_error - 0.015).abs() < 1e-9, "{}", bad.volume_error);
    assert!(bad.distance < 0.009 && !bad.is_valid());
    assert_eq!(bad.spots, [], "it is lost everywhere");
    assert_eq!(bad.complaints(), "1.50% of the volume lost or won");
    assert!(shrink(0.995).is_valid());
}
