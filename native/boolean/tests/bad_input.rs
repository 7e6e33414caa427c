//! Bad input: each kind has its own code and names exactly its elements. And what looks bad but is not: tiny, huge and far
//! away objects, voids, loose vertices.

use boolean::{BooleanError, Elements, Filler, Operation, Options, Output, boolean};
use glam::{DMat3, EulerRot};
use mesh::{DVec3, Monitor, PolygonMesh};
use testkit::{oracle, shapes};

fn run(a: &PolygonMesh, b: &PolygonMesh, options: &Options) -> Result<Output, BooleanError> {
    boolean(a, b, Operation::Union, options, &Monitor::new())
}

/// A sphere, and a turned cube through its side.
fn pair() -> [PolygonMesh; 2] {
    let turn = DMat3::from_euler(EulerRot::XYZ, 0.3, 0.2, 0.1);
    [shapes::sphere(6), shapes::transformed(&shapes::cuboid(DVec3::ONE, 4), turn, DVec3::new(0.8, 0.1, 0.05))]
}

/// As A and as B, `bad` is refused with this code and these elements.
#[track_caller]
fn assert_refused(bad: &PolygonMesh, wanted: &str, kind: &'static str, mut elements: Vec<u32>) {
    elements.sort_unstable();
    let [good, _] = pair();
    for (position, a, b) in [(0, bad, &good), (1, &good, bad)] {
        match run(a, b, &Options::default()) {
            Err(BooleanError::Invalid { input, code, sentence, elements: mut found }) => {
                assert_eq!((input, code), (position, wanted), "{sentence}");
                assert!(sentence.contains(';'), "no remedy: {sentence}");
                // Edges are flat pairs: their order says which vertices belong together.
                if kind != "edges" {
                    found.get_mut(kind).expect(kind).sort_unstable();
                }
                assert_eq!(found, Elements::from([(kind, elements.clone())]), "{sentence}");
            }
            other => panic!("{other:?}"),
        }
    }
}

/// A sphere with some faces replaced.
fn with_faces(change: impl FnOnce(&mut Vec<Vec<u32>>)) -> PolygonMesh {
    let good = shapes::sphere(4);
    let mut faces: Vec<Vec<u32>> = good.faces().map(<[u32]>::to_vec).collect();
    change(&mut faces);
    PolygonMesh::from_polygons(good.positions, faces).expect("indices in range")
}

fn moved(mesh: &PolygonMesh, by: DVec3) -> PolygonMesh {
    shapes::transformed(mesh, DMat3::IDENTITY, by)
}

fn all_faces(mesh: &PolygonMesh) -> Vec<u32> {
    (0..mesh.face_count() as u32).collect()
}

fn all_verts(mesh: &PolygonMesh) -> Vec<u32> {
    (0..mesh.vertex_count() as u32).collect()
}

#[test]
fn no_faces() {
    assert_refused(&PolygonMesh::default(), "empty", "faces", vec![]);
}

#[test]
fn coordinates_that_are_no_numbers() {
    let mut bad = shapes::sphere(4);
    bad.positions[3].x = f64::NAN;
    bad.positions[5].y = f64::NEG_INFINITY;
    assert_refused(&bad, "not_finite", "verts", vec![3, 5]);
}

#[test]
fn triangles_and_ngons() {
    let last = shapes::sphere(4).face_count() as u32;
    let bad = with_faces(|faces| {
        let quad = faces.remove(7);
        faces.extend([vec![quad[0], quad[1], quad[2]], vec![quad[2], quad[3], quad[0]]]);
    });
    assert_refused(&bad, "not_quads", "faces", vec![last - 1, last]);
}

#[test]
fn a_face_that_names_a_vertex_twice() {
    assert_refused(&with_faces(|faces| faces[5][2] = faces[5][0]), "degenerate", "faces", vec![5]);
}

#[test]
fn a_face_that_lies_on_another() {
    let last = shapes::sphere(4).face_count() as u32;
    assert_refused(&with_faces(|faces| faces.push(faces[2].clone())), "duplicate", "faces", vec![last]);
    // A whole shell twice, nothing merged.
    let good = shapes::sphere(3);
    let doubled = shapes::joined(&[good.clone(), good.clone()]);
    let second = all_faces(&good).iter().map(|f| f + good.face_count() as u32).collect();
    assert_refused(&doubled, "duplicate", "faces", second);
}

#[test]
fn an_edge_of_three_faces() {
    let good = shapes::sphere(4);
    let [a, b] = [good.face(0)[0], good.face(0)[1]];
    let mut positions = good.positions.clone();
    let first = positions.len() as u32;
    positions.extend([good.positions[a as usize] * 1.5, good.positions[b as usize] * 1.5]);
    let mut faces: Vec<Vec<u32>> = good.faces().map(<[u32]>::to_vec).collect();
    faces.push(vec![a, b, first + 1, first]);
    let bad = PolygonMesh::from_polygons(positions, faces).expect("indices in range");
    assert_refused(&bad, "non_manifold", "edges", vec![a, b]);
}

#[test]
fn a_hole() {
    let ring = shapes::sphere(4).face(9).to_vec();
    let mut edges: Vec<[u32; 2]> = (0..4).map(|k| mesh::sorted(ring[k], ring[(k + 1) % 4])).collect();
    edges.sort_unstable();
    let bad = with_faces(|faces| drop(faces.remove(9)));
    match run(&bad, &pair()[1], &Options::default()) {
        Err(BooleanError::Invalid { code: "open", elements, .. }) => {
            assert_eq!(elements["edges"].as_chunks().0, edges);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_flipped_face() {
    let ring = shapes::sphere(4).face(9).to_vec();
    let mut edges: Vec<[u32; 2]> = (0..4).map(|k| mesh::sorted(ring[k], ring[(k + 1) % 4])).collect();
    edges.sort_unstable();
    match run(&with_faces(|faces| faces[9].reverse()), &pair()[1], &Options::default()) {
        Err(BooleanError::Invalid { code: "misoriented", elements, .. }) => {
            assert_eq!(elements["edges"].as_chunks().0, edges);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn two_parts_that_share_a_vertex() {
    let cube = shapes::cuboid(DVec3::ONE, 2);
    let high = (0..cube.vertex_count()).find(|&v| cube.positions[v] == DVec3::splat(0.5)).expect("a corner") as u32;
    let low = (0..cube.vertex_count()).find(|&v| cube.positions[v] == DVec3::splat(-0.5)).expect("a corner") as u32;
    let both = shapes::joined(&[cube.clone(), moved(&cube, DVec3::ONE)]);
    let merge = |v: u32| if v == low + cube.vertex_count() as u32 { high } else { v };
    let faces: Vec<Vec<u32>> = both.faces().map(|f| f.iter().map(|&v| merge(v)).collect()).collect();
    let bad = PolygonMesh::from_polygons(both.positions.clone(), faces).expect("indices in range");
    assert_refused(&bad, "non_manifold_vertex", "verts", vec![high]);
}

#[test]
fn a_face_without_area() {
    let mut bad = shapes::cuboid(DVec3::ONE, 2);
    let face = bad.face(11).to_vec();
    // On a line through two corners, at unlike places; nothing is rounded.
    let (p, q) = (bad.positions[face[0] as usize], bad.positions[face[2] as usize]);
    bad.positions[face[1] as usize] = p.midpoint(q);
    bad.positions[face[3] as usize] = p.midpoint(p.midpoint(q));
    assert_refused(&bad, "zero_area", "faces", vec![11]);
}

#[test]
fn a_part_that_faces_the_wrong_way() {
    let good = shapes::sphere(3);
    let all = all_faces(&good);
    let shifted: Vec<u32> = all.iter().map(|f| f + good.face_count() as u32).collect();
    assert_refused(&shapes::reversed(&good), "inside_out", "faces", all);
    let inner = good.scaled(0.4);
    // A shell in another has to bound a void, and a body in a void has to be one.
    assert_refused(&shapes::joined(&[good.clone(), inner.clone()]), "inside_out", "faces", shifted);
    let innermost = shapes::reversed(&good.scaled(0.2));
    let third = all_faces(&good).iter().map(|f| f + 2 * good.face_count() as u32).collect();
    assert_refused(&shapes::joined(&[good, shapes::reversed(&inner), innermost]), "inside_out", "faces", third);
}

#[test]
fn faces_that_intersect() {
    let good = shapes::cuboid(DVec3::ONE, 1);
    let crossing = shapes::joined(&[good.clone(), moved(&good.scaled(0.5), DVec3::new(0.5, 0.01, 0.02))]);
    // The side that is pierced, and the four sides of the small cube that pierce it.
    let side = (0..6).find(|&f| good.face_points(f).all(|p| p.x > 0.0)).expect("a side") as u32;
    let piercing =
        (0..6).filter(|&f| !good.face_points(f).all(|p| p.x > 0.0) && !good.face_points(f).all(|p| p.x < 0.0));
    let elements = std::iter::once(side).chain(piercing.map(|f| f as u32 + 6)).collect();
    assert_refused(&crossing, "self_intersecting", "faces", elements);
}

/// The distance between floating-point numbers is a large part of the object.
#[test]
fn too_small_for_where_it_is() {
    let good = shapes::sphere(4);
    assert_refused(&moved(&good.scaled(1e-12), DVec3::ONE), "too_small", "verts", all_verts(&good));
    // Beside a far larger object, too.
    assert_refused(&good.scaled(1e-12), "too_small", "verts", all_verts(&good));
    assert_refused(&good.scaled(1e-200), "too_small", "verts", all_verts(&good));
    let far = moved(&good, DVec3::splat(1e10));
    match run(&far, &far.clone(), &Options::default()) {
        Err(BooleanError::Invalid { input: 0, code: "too_small", elements, .. }) => {
            assert_eq!(elements["verts"], all_verts(&good));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn any_scale_works_when_both_objects_have_it() {
    let [a, b] = pair();
    let options = Options { blend_radius: 0.05, ..Options::default() };
    let once = run(&a, &b, &options).expect("a result");
    for exponent in [-1000, -300, -40, 40, 300, 1000] {
        let scale = 2f64.powi(exponent);
        let options = Options { blend_radius: 0.05 * scale, ..Options::default() };
        let scaled = run(&a.scaled(scale), &b.scaled(scale), &options).expect("a result");
        assert_eq!(scaled.mesh, once.mesh.scaled(scale), "2^{exponent}");
    }
}

#[test]
fn far_from_the_origin_and_unlike_sizes_work() {
    let [a, b] = pair();
    let on_a_face = a.face_points(100).sum::<DVec3>() / 4.0;
    let small = |scale| moved(&b.scaled(scale), on_a_face - scale * DVec3::new(0.8, 0.1, 0.05));
    let far = |distance| [&a, &b].map(|mesh| moved(mesh, DVec3::splat(distance)));
    let placements = [far(1e3), far(1e6), far(1e8), [a.clone(), small(1e-2)], [small(1e-5), a.clone()]];
    for [a, b] in placements {
        let output = run(&a, &b, &Options::default()).expect("a result");
        assert_eq!(oracle::closed_manifold(&output.mesh), Ok(()));
        assert_eq!(oracle::euler(&output.mesh), 2);
        assert_eq!(output.report.warnings, Vec::<String>::new());
    }
}

#[test]
fn voids_and_loose_vertices_are_no_defects() {
    let [a, b] = pair();
    let mut hollow = shapes::joined(&[a.clone(), shapes::reversed(&a.scaled(0.6))]);
    let output = run(&hollow, &b, &Options::default()).expect("a result");
    assert_eq!(oracle::closed_manifold(&output.mesh), Ok(()));
    assert_eq!(oracle::components(&output.mesh), 2, "the cube reaches into the void");
    hollow.positions.push(DVec3::new(0.1, 5e20, 0.2));
    assert_eq!(run(&hollow, &b, &Options::default()).expect("a result").mesh, output.mesh);
}

/// A filler that takes annuli only, on a region that is none: the error names the faces under that region.
#[test]
fn a_region_that_cannot_be_filled_names_its_faces() {
    let a = shapes::cuboid(DVec3::ONE * 2.0, 8);
    let small = shapes::transformed(&shapes::sphere(2), DMat3::IDENTITY * 0.3, DVec3::new(1.01, 0.03, 0.02));
    // All of the small sphere outside of the cube is remade: a disk.
    let options = Options { filler: Filler::Rings, ..Options::default() };
    match run(&a, &small, &options) {
        Err(BooleanError::Infeasible { code, sentence, elements: [of_a, of_b] }) => {
            assert_eq!(code, "no_fill", "{sentence}");
            assert_eq!(of_a, Elements::new(), "{sentence}");
            let outside = |f: &u32| small.face_points(*f as usize).any(|p| p.x > 1.0);
            let wanted: Vec<u32> = all_faces(&small).into_iter().filter(outside).collect();
            assert_eq!(of_b, Elements::from([("faces", wanted)]), "{sentence}");
        }
        other => panic!("{other:?}"),
    }
}
