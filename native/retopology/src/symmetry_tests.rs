use super::*;
use mesh::sorted;
use testkit::{oracle, shapes};

fn symmetric(mesh: &PolygonMesh, features: &Features, plane: Plane) -> Symmetric {
    let (triangles, _) = TriangleMesh::from_polygons(mesh);
    let options = LayoutOptions { size: Size::TargetFaces(600), ..LayoutOptions::default() };
    let coarse = BaseOptions { vertices: 30, ..BaseOptions::default() };
    symmetric_quads(&triangles, features, plane, &coarse, &options, &Monitor::new()).unwrap()
}

/// The result is its own mirror image, by index, and vertices mirrored to themselves lie in the plane.
fn judge(found: &Symmetric, plane: Plane) {
    let mesh = &found.quads.mesh;
    let normal = plane.normal.normalize();
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let tolerance = 1e-9 * bounds.low.distance(bounds.high);
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
    assert_eq!(found.quads.source.len(), mesh.vertex_count());
    assert_eq!(found.quads.report.inverted, 0);
}

const SIDE: Plane = Plane { point: DVec3::ZERO, normal: DVec3::X };

#[test]
fn a_cut_ball_and_torus_keep_their_topology() {
    for (mesh, plane) in [
        (shapes::triangulated(&shapes::sphere(6)), SIDE),
        // The plane runs through no vertex.
        (shapes::triangulated(&shapes::sphere(6)), Plane { point: DVec3::ZERO, normal: DVec3::new(0.3, -2.0, 0.5) }),
        (shapes::triangulated(&shapes::torus(2.0, 0.7, 30, 14)), SIDE),
        (shapes::triangulated(&shapes::torus(2.0, 0.7, 30, 14)), Plane { normal: DVec3::new(0.0, 0.1, 1.0), ..SIDE }),
    ] {
        let found = symmetric(&mesh, &Features::default(), plane);
        judge(&found, plane);
        oracle::closed_manifold(&found.quads.mesh).unwrap();
        oracle::closed_manifold(&found.base_mesh).unwrap();
        assert_eq!(oracle::euler(&found.quads.mesh), oracle::euler(&mesh));
        assert_eq!(oracle::euler(&found.base_mesh), oracle::euler(&mesh));
        assert!((oracle::area(&found.quads.mesh) / oracle::area(&mesh) - 1.0).abs() < 0.06);
    }
}

#[test]
fn features_go_on_across_the_plane_and_are_mirrored() {
    // All edges of a box: twelve creases, four of them across the plane.
    let mesh = shapes::triangulated(&shapes::cuboid(DVec3::new(2.0, 1.0, 1.0), 5));
    let (triangles, _) = TriangleMesh::from_polygons(&mesh);
    let topology = mesh::Topology::of_triangles(&triangles);
    let sharp = |h: &u32| {
        let [a, b] = [*h, topology.twin[*h as usize]].map(|h| triangles.area_normal(h as usize / 3));
        a.angle_between(b) > 1.0
    };
    let edges: Vec<[u32; 2]> =
        topology.edges().filter(sharp).map(|h| sorted(topology.from(h), topology.to(h))).collect();
    let features = Features { edges, vertices: vec![] };
    let found = symmetric(&mesh, &features, SIDE);
    judge(&found, SIDE);
    let at = |v: u32| found.quads.mesh.positions[v as usize];
    let length: f64 = found.quads.feature_edges.iter().map(|edge| at(edge.ends[0]).distance(at(edge.ends[1]))).sum();
    assert!((length - 16.0).abs() < 1e-6, "{length}");
    assert!(found.deviation < 1e-9);
    let box_area = 10.0;
    assert!((oracle::area(&found.quads.mesh) - box_area).abs() < 1e-6);
}

#[test]
fn the_kept_side_decides_and_an_empty_one_is_refused() {
    let mesh = shapes::triangulated(&shapes::cuboid(DVec3::new(2.0, 1.0, 1.0), 4));
    let plane = Plane { point: DVec3::X * 0.3, normal: DVec3::X };
    let kept = symmetric(&mesh, &Features::default(), plane);
    judge(&kept, plane);
    assert!(
        (kept.deviation - 0.6).abs() < 1e-6,
        "the far end lies 1.3 off the plane, the near one 0.7: {}",
        kept.deviation
    );
    let (triangles, _) = TriangleMesh::from_polygons(&mesh);
    let refused = |plane: Plane| {
        let (coarse, options) = (BaseOptions::default(), LayoutOptions::default());
        symmetric_quads(&triangles, &Features::default(), plane, &coarse, &options, &Monitor::new()).unwrap_err()
    };
    assert!(matches!(refused(Plane { point: DVec3::X * 3.0, normal: DVec3::X }), SymmetryError::NothingKept));
    assert!(matches!(refused(Plane { point: DVec3::ZERO, normal: DVec3::ZERO }), SymmetryError::BadPlane));
}

#[test]
fn an_open_surface_keeps_its_border() {
    let mesh = shapes::triangulated(&shapes::sheet(6, 5));
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let plane = Plane { point: bounds.low.midpoint(bounds.high), normal: DVec3::Y };
    let found = symmetric(&mesh, &Features::default(), plane);
    judge(&found, plane);
    assert_eq!(oracle::euler(&found.quads.mesh), 1);
    assert_eq!(oracle::components(&found.quads.mesh), 1);
    assert!((oracle::area(&found.quads.mesh) - oracle::area(&mesh)).abs() < 1e-6 * oracle::area(&mesh));
}
