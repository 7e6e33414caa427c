use super::*;
use crate::build::BaseOptions;
use crate::{LayoutOptions, Options, Size, retopologize};
use mesh::Aabb;
use testkit::{oracle, shapes};

fn options(plane: Plane) -> Options {
    Options {
        base: BaseOptions { vertices: 30, ..BaseOptions::default() },
        layout: LayoutOptions { size: Size::TargetFaces(600), ..LayoutOptions::default() },
        symmetry: Some(Symmetry { plane, tolerance: f64::INFINITY }),
        templates: vec![],
    }
}

fn symmetric(mesh: &PolygonMesh, features: &Features, plane: Plane) -> Output {
    retopologize(mesh, features, &options(plane), &Monitor::new()).unwrap()
}

/// The result is its own mirror image, by index, and vertices mirrored to themselves lie in the plane.
fn judge(found: &Output, plane: Plane) {
    let mesh = &found.mesh;
    let normal = plane.normal.normalize();
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let tolerance = 1e-9 * bounds.low.distance(bounds.high);
    assert_eq!(found.mirror.len(), mesh.vertex_count());
    for (v, &w) in found.mirror.iter().enumerate() {
        assert_eq!(found.mirror[w as usize], v as u32);
        let p = mesh.positions[v];
        let image = p - normal * (2.0 * (p - plane.point).dot(normal));
        assert!(mesh.positions[w as usize].distance(image) < tolerance, "vertex {v}");
    }
    let cycle = |mut face: Vec<u32>| {
        let first = (0..face.len()).min_by_key(|&k| face[k]).unwrap();
        face.rotate_left(first);
        face
    };
    let faces: BTreeSet<Vec<u32>> = mesh.faces().map(|face| cycle(face.to_vec())).collect();
    for face in mesh.faces() {
        let image = face.iter().rev().map(|&v| found.mirror[v as usize]).collect();
        assert!(face.len() == 4 && faces.contains(&cycle(image)), "every face has its mirror image");
    }
    assert_eq!(found.corner_source.len(), mesh.corner_verts().len());
    assert_eq!(found.report.inverted, 0);
}

/// Every corner's source lies near it: on its own side of the plane.
fn judge_sources(input: &PolygonMesh, found: &Output) {
    let far = 0.02 * Aabb::of(input.positions.iter().copied()).diagonal();
    for (corner, source) in found.corner_source.iter().enumerate() {
        let at = found.mesh.positions[found.mesh.corner_verts()[corner] as usize];
        let of = source.corners.map(|c| input.positions[input.corner_verts()[c as usize] as usize]);
        let from: DVec3 = of.iter().zip(source.weights).map(|(&p, weight)| p * weight).sum();
        assert!(from.distance(at) < far, "corner {corner}: {from} for {at}");
        assert!(input.face(source.face as usize).contains(&input.corner_verts()[source.corners[0] as usize]));
    }
}

const SIDE: Plane = Plane { point: DVec3::ZERO, normal: DVec3::X };

#[test]
fn a_cut_ball_and_torus_keep_their_topology() {
    for (mesh, plane) in [
        (shapes::triangulated(&shapes::sphere(6)), SIDE),
        // The plane runs through no vertex.
        (shapes::triangulated(&shapes::sphere(6)), Plane { point: DVec3::ZERO, normal: DVec3::new(0.3, -2.0, 0.5) }),
        (shapes::torus(2.0, 0.7, 30, 14), SIDE),
        (shapes::triangulated(&shapes::torus(2.0, 0.7, 30, 14)), Plane { normal: DVec3::new(0.0, 0.1, 1.0), ..SIDE }),
    ] {
        let found = symmetric(&mesh, &Features::default(), plane);
        judge(&found, plane);
        // A torus is not symmetric about the tilted plane: the far side is then no longer where it was.
        if found.report.symmetry_deviation.unwrap() < 0.01 {
            judge_sources(&mesh, &found);
        }
        oracle::closed_manifold(&found.mesh).unwrap();
        oracle::closed_manifold(&found.base).unwrap();
        assert_eq!(oracle::euler(&found.mesh), oracle::euler(&mesh));
        assert_eq!(oracle::euler(&found.base), oracle::euler(&mesh));
        assert!((oracle::area(&found.mesh) / oracle::area(&mesh) - 1.0).abs() < 0.06);
        assert!(found.feature_edges.is_empty(), "the cut is no feature");
    }
}

/// Its edges between faces that turn by a right angle.
fn creases(mesh: &PolygonMesh) -> Features {
    let (triangles, _) = TriangleMesh::from_polygons(mesh);
    let topology = Topology::of_triangles(&triangles);
    let sharp = |h: &u32| {
        let [a, b] = [*h, topology.twin[*h as usize]].map(|h| triangles.area_normal(h as usize / 3));
        a.angle_between(b) > 1.0
    };
    let edges = topology.edges().filter(sharp).map(|h| sorted(topology.from(h), topology.to(h))).collect();
    Features { edges, vertices: vec![] }
}

#[test]
fn features_go_on_across_the_plane_and_are_mirrored() {
    // All edges of a box: twelve creases, four of them across the plane.
    let mesh = shapes::triangulated(&shapes::cuboid(DVec3::new(2.0, 1.0, 1.0), 5));
    let features = creases(&mesh);
    let found = symmetric(&mesh, &features, SIDE);
    judge(&found, SIDE);
    judge_sources(&mesh, &found);
    let at = |v: u32| found.mesh.positions[v as usize];
    let length: f64 = found.feature_edges.iter().map(|edge| at(edge.ends[0]).distance(at(edge.ends[1]))).sum();
    assert!((length - 16.0).abs() < 1e-6, "{length}");
    assert!((found.report.feature_length - 16.0).abs() < 1e-9);
    let chains: BTreeSet<u32> = found.feature_edges.iter().map(|edge| edge.chain).collect();
    assert_eq!(chains.len(), 12, "a chain across the plane is one");
    let marked: BTreeSet<[u32; 2]> = features.edges.iter().copied().collect();
    for edge in &found.feature_edges {
        assert!(edge.kind == FeatureKind::Marked && marked.contains(&edge.input_edge));
        let [p, q] = edge.input_edge.map(|v| mesh.positions[v as usize]);
        let middle = at(edge.ends[0]).midpoint(at(edge.ends[1]));
        assert!(crate::sources::distance_to_segment(middle, p, q) < 1e-9, "the mark of its own side");
    }
    assert!(found.report.symmetry_deviation.unwrap() < 1e-9);
    let box_area = 10.0;
    assert!((oracle::area(&found.mesh) - box_area).abs() < 1e-6);
}

#[test]
fn the_kept_side_decides_and_an_empty_one_is_refused() {
    let mesh = shapes::triangulated(&shapes::cuboid(DVec3::new(2.0, 1.0, 1.0), 4));
    let plane = Plane { point: DVec3::X * 0.3, normal: DVec3::X };
    let kept = symmetric(&mesh, &Features::default(), plane);
    judge(&kept, plane);
    let deviation = kept.report.symmetry_deviation.unwrap();
    assert!((deviation - 0.6).abs() < 1e-6, "the far end lies 1.3 off the plane, the near one 0.7: {deviation}");
    let refused =
        |plane: Plane| retopologize(&mesh, &Features::default(), &options(plane), &Monitor::new()).unwrap_err();
    let nothing = refused(Plane { point: DVec3::X * 3.0, normal: DVec3::X });
    assert!(matches!(nothing, RetopologizeError::Invalid { code: "nothing_kept", .. }));
    assert!(matches!(refused(Plane { point: DVec3::ZERO, normal: DVec3::ZERO }), RetopologizeError::Option(_)));
}

#[test]
fn what_is_not_symmetric_is_named() {
    let mut mesh = shapes::triangulated(&shapes::cuboid(DVec3::new(2.0, 1.0, 1.0), 4));
    let strict = |mesh: &PolygonMesh, features: &Features| {
        let symmetry = Some(Symmetry { plane: SIDE, tolerance: Symmetry::TOLERANCE });
        retopologize(mesh, features, &Options { symmetry, ..options(SIDE) }, &Monitor::new())
    };
    let mut features = creases(&mesh);
    assert!(strict(&mesh, &features).is_ok());
    // A crease that lies wholly on one side loses its marks there.
    let lost = |edge: &[u32; 2]| edge.iter().all(|&v| mesh.positions[v as usize].x > 0.999);
    let (gone, left): (Vec<[u32; 2]>, Vec<[u32; 2]>) = features.edges.iter().partition(|edge| lost(edge));
    features.edges = left;
    let Err(RetopologizeError::Feature { code: "features_not_symmetric", elements, .. }) = strict(&mesh, &features)
    else {
        panic!("marks on one side only")
    };
    let named = &elements["edges"];
    assert_eq!(named.len(), 2 * gone.len(), "those of the other side, as many");
    assert!(named.iter().all(|&v| mesh.positions[v as usize].x < -0.999));
    let corner = (0..mesh.vertex_count()).find(|&v| mesh.positions[v].min_element() > 0.4).unwrap();
    mesh.positions[corner] += DVec3::splat(0.2);
    let Err(RetopologizeError::Invalid { code: "not_symmetric", elements, .. }) = strict(&mesh, &Features::default())
    else {
        panic!("a corner that sticks out")
    };
    assert_eq!(elements["verts"].len(), 1 + usize::from(elements["verts"].len() == 2));
    assert!(elements["verts"].contains(&(corner as u32)));
}

#[test]
fn an_open_surface_keeps_its_border() {
    let mesh = shapes::triangulated(&shapes::sheet(6, 5));
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let plane = Plane { point: bounds.low.midpoint(bounds.high), normal: DVec3::Y };
    let found = symmetric(&mesh, &Features::default(), plane);
    judge(&found, plane);
    assert_eq!(oracle::euler(&found.mesh), 1);
    assert_eq!(oracle::components(&found.mesh), 1);
    assert!((oracle::area(&found.mesh) - oracle::area(&mesh)).abs() < 1e-6 * oracle::area(&mesh));
}
