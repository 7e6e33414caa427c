//! Areas add up, nothing is turned over, and every edge has two triangles.

use super::{Triangulated, triangulate};
use mesh::{DVec3, PolygonMesh, sorted};
use std::collections::BTreeMap;

fn plane(corners: &[(f64, f64)]) -> PolygonMesh {
    let points = corners.iter().map(|&(x, y)| DVec3::new(x, y, 3.0)).collect();
    let face: Vec<u32> = (0..corners.len() as u32).collect();
    PolygonMesh::from_polygons(points, [face]).expect("one face")
}

/// Area by the trapezoid rule.
fn area(corners: &[(f64, f64)]) -> f64 {
    (0..corners.len())
        .map(|k| (corners[k], corners[(k + 1) % corners.len()]))
        .map(|((x, y), (u, v))| (x - u) * (y + v) / 2.0)
        .sum()
}

fn check(made: &Triangulated, expected: f64) {
    let areas: Vec<f64> = (0..made.mesh.triangles.len()).map(|t| made.mesh.area_normal(t).z / 2.0).collect();
    assert!(areas.iter().all(|&a| a > 1e-12 * expected), "{areas:?}");
    assert!((areas.iter().sum::<f64>() - expected).abs() < 1e-12 * expected, "{areas:?}");
    assert_eq!(made.face.len(), areas.len());
    assert_eq!(made.corners.len(), areas.len());
}

#[test]
fn concave_faces_are_covered_once() {
    let star: Vec<(f64, f64)> = (0..30)
        .map(|k| (f64::from(k) * std::f64::consts::TAU / 30.0, if k % 2 == 0 { 1.0 } else { 0.3 }))
        .map(|(angle, r)| (r * angle.cos(), r * angle.sin()))
        .collect();
    let comb = vec![
        (0.0, 0.0),
        (5.0, 0.0),
        (5.0, 2.0),
        (4.0, 2.0),
        (4.0, 1.0),
        (3.0, 1.0),
        (3.0, 2.0),
        (2.0, 2.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (0.0, 2.0),
    ];
    let arrow = vec![(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.8, 1.0)];
    // Many corners on one line, as below a row of smaller faces.
    let lined: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k) * 0.1, 0.0)).chain([(1.9, 1.0), (0.0, 1.0)]).collect();
    for corners in [star, comb, arrow, lined] {
        let made = triangulate(&plane(&corners));
        assert_eq!(made.mesh.triangles.len(), corners.len() - 2);
        check(&made, area(&corners));
    }
}

#[test]
fn two_quads_round_a_vertex_do_not_share_their_diagonal() {
    // Vertex 4 has two edges only; both quads are shorter along 0-2.
    let points = [(0.0, 0.0), (1.0, -2.0), (2.0, 0.0), (1.0, 2.0), (1.0, 0.1)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let mesh = PolygonMesh::from_polygons(points.to_vec(), [[0, 1, 2, 4], [0, 4, 2, 3]]).expect("two faces");
    let made = triangulate(&mesh);
    check(&made, 4.0);
    let mut uses = BTreeMap::new();
    for t in &made.mesh.triangles {
        (0..3).for_each(|k| *uses.entry(sorted(t[k], t[(k + 1) % 3])).or_insert(0) += 1);
    }
    assert!(uses.values().all(|&n| n <= 2), "{uses:?}");
    for (t, corners) in made.corners.iter().enumerate() {
        let range = mesh.face_corners(made.face[t] as usize);
        assert!(corners.iter().all(|&c| range.contains(&(c as usize))));
    }
}

#[test]
fn a_diagonal_that_is_an_edge_elsewhere_is_halved() {
    // A strip folded so that the edge 0-2 belongs to a triangle, while both diagonals of the quad are wanted.
    let points = [(0.0, 0.0, 0.0), (1.0, -3.0, 0.0), (2.0, 0.0, 0.0), (1.0, 3.0, 0.0), (1.0, 0.0, 5.0)];
    let points = points.map(|(x, y, z)| DVec3::new(x, y, z)).to_vec();
    let mesh = PolygonMesh::from_polygons(points, [vec![0, 1, 2, 3], vec![0, 2, 4]]).expect("two faces");
    let made = triangulate(&mesh);
    assert_eq!(made.halves, vec![[0, 2]]);
    assert_eq!(made.mesh.triangles.len(), 5);
    assert_eq!(made.spread(&[1.0, 2.0, 4.0, 8.0, 16.0])[5], 2.0);
    assert!(made.spread(&[]).is_empty());
}
