//! The blend of section 4.2 on a finished boolean.

use boolean::{Operation, Options, boolean};
use mesh::{DVec3, Monitor, PolygonMesh, scaled_jacobian};
use testkit::shapes;

fn jacobians(mesh: &PolygonMesh) -> Vec<f64> {
    (0..mesh.face_count())
        .map(|f| scaled_jacobian(std::array::from_fn(|k| mesh.face_points(f).nth(k).expect("a quad"))))
        .collect()
}

#[test]
fn a_blend_rounds_the_seam_leaves_the_rest_alone_and_spreads_what_it_moved_evenly() {
    let a = shapes::sphere(10);
    let b = shapes::transformed(&a, glam::DMat3::IDENTITY * 0.8, DVec3::new(1.1, 0.05, 0.02));
    let radius = 0.35;
    let result = |blend_radius| {
        let options = Options { blend_radius, ..Options::default() };
        boolean(&a, &b, Operation::Union, &options, &Monitor::new()).expect("two spheres")
    };
    let (sharp, soft) = (result(0.0), result(radius));
    assert_eq!(sharp.mesh.corner_verts(), soft.mesh.corner_verts(), "a blend moves vertices, nothing else");

    let seam: Vec<DVec3> =
        sharp.intersection_edges.iter().flatten().map(|&v| sharp.mesh.positions[v as usize]).collect();
    for (p, q) in sharp.mesh.positions.iter().zip(&soft.mesh.positions) {
        // The seam's edges are short: its vertices stand for it, half an edge of tolerance.
        if seam.iter().all(|s| s.distance(*p) > radius + 0.1) {
            assert_eq!(p, q);
        }
    }
    // The seam runs in a groove: it moves outwards, away from the axis through both centres.
    let height = |mesh: &PolygonMesh| {
        let of = |&v: &u32| mesh.positions[v as usize].reject_from(DVec3::new(1.1, 0.05, 0.02)).length();
        sharp.intersection_edges.iter().flatten().map(of).sum::<f64>() / seam.len() as f64
    };
    assert!(height(&soft.mesh) > height(&sharp.mesh) + 0.02, "{} {}", height(&soft.mesh), height(&sharp.mesh));

    let moved: Vec<usize> = (0..soft.mesh.face_count())
        .filter(|&f| {
            soft.mesh.face(f).iter().any(|&v| sharp.mesh.positions[v as usize] != soft.mesh.positions[v as usize])
        })
        .collect();
    let shape = |mesh: &PolygonMesh| {
        let all = jacobians(mesh);
        let of_moved = moved.iter().map(|&f| all[f]);
        (of_moved.clone().fold(1.0, f64::min), of_moved.sum::<f64>() / moved.len() as f64)
    };
    let ((_, before), (worst, mean)) = (shape(&sharp.mesh), shape(&soft.mesh));
    assert!(worst > 0.3 && mean > before - 0.01, "worst {worst}, mean {mean} after {before}");
}
