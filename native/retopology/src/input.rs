//! The check of the input surface, and its move into a unit box where tolerances mean the same for every scale.

use crate::base_error::RetopologyError;
use mesh::{Aabb, DVec3, Topology, TriangleMesh};

/// How the working copy of the surface lies in the scene: `scene = origin + scale * working`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Centre of the surface's bounding box, scene units.
    pub origin: DVec3,
    /// Its diagonal, scene units.
    pub scale: f64,
}

impl Placement {
    /// A working point in the scene.
    pub fn to_scene(self, working: DVec3) -> DVec3 {
        self.origin + working * self.scale
    }

    /// A point of the scene in the working copy.
    pub fn to_working(self, scene: DVec3) -> DVec3 {
        (scene - self.origin) / self.scale
    }
}

/// Checks that the surface is one the method can work on: an oriented manifold, open or closed, of any number of
/// components, with finite positions. Unused vertices, and triangles without area, are allowed. O(n log n).
///
/// # Errors
/// Every variant of [`RetopologyError`] about the mesh, with all elements concerned.
pub fn check(mesh: &TriangleMesh) -> Result<Topology, RetopologyError> {
    if mesh.triangles.is_empty() {
        return Err(RetopologyError::Empty);
    }
    let vertices = mesh.positions.len();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(RetopologyError::VertexOutOfRange { triangle: triangle as u32, vertex, vertices });
        }
    }
    let bad: Vec<u32> = (0..vertices as u32).filter(|&v| !mesh.positions[v as usize].is_finite()).collect();
    if !bad.is_empty() {
        return Err(RetopologyError::NotFinite { vertices: bad });
    }
    let repeats = |&t: &u32| {
        let [a, b, c] = mesh.triangles[t as usize];
        a == b || b == c || c == a
    };
    let triangles: Vec<u32> = (0..mesh.triangles.len() as u32).filter(repeats).collect();
    if !triangles.is_empty() {
        return Err(RetopologyError::RepeatedCorners { triangles });
    }
    let corners = |t: u32| {
        let mut corners = mesh.triangles[t as usize];
        corners.sort_unstable();
        corners
    };
    let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    order.sort_by_key(|&t| (corners(t), t));
    let pairs: Vec<[u32; 2]> =
        order.windows(2).filter(|w| corners(w[0]) == corners(w[1])).map(|w| [w[0], w[1]]).collect();
    if !pairs.is_empty() {
        return Err(RetopologyError::DuplicateTriangles { pairs });
    }
    check_edges(mesh)?;
    let topology = Topology::of_triangles(mesh);
    check_fans(mesh, &topology)?;
    Ok(topology)
}

fn check_edges(mesh: &TriangleMesh) -> Result<(), RetopologyError> {
    // Each side of a triangle: the edge, and whether the triangle runs along it upwards.
    let mut sides: Vec<([u32; 2], bool)> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| (mesh::sorted(a, b), a < b))
        .collect();
    sides.sort_unstable();
    let (mut crowded, mut misoriented) = (Vec::new(), Vec::new());
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        match edge {
            [a, b] if a.1 == b.1 => misoriented.push(a.0),
            [_] | [_, _] => {}
            _ => crowded.push(edge[0].0),
        }
    }
    if !crowded.is_empty() {
        return Err(RetopologyError::NonManifoldEdges { edges: crowded });
    }
    if !misoriented.is_empty() {
        return Err(RetopologyError::MisorientedEdges { edges: misoriented });
    }
    Ok(())
}

fn check_fans(mesh: &TriangleMesh, topology: &Topology) -> Result<(), RetopologyError> {
    let mut uses = vec![0_usize; mesh.positions.len()];
    for &v in mesh.triangles.iter().flatten() {
        uses[v as usize] += 1;
    }
    let split = |&v: &u32| topology.around(v).take(uses[v as usize] + 1).count() != uses[v as usize];
    let vertices: Vec<u32> = (0..mesh.positions.len() as u32).filter(split).collect();
    if vertices.is_empty() { Ok(()) } else { Err(RetopologyError::NonManifoldVertices { vertices }) }
}

/// The surface moved into a box of diagonal 1 about the origin. Unused vertices are put at the origin.
pub fn normalised(mesh: &TriangleMesh) -> (TriangleMesh, Placement) {
    let mut used = vec![false; mesh.positions.len()];
    for &v in mesh.triangles.iter().flatten() {
        used[v as usize] = true;
    }
    let bounds = Aabb::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]));
    let origin = bounds.low.midpoint(bounds.high);
    // Halved and divided first: the box of a huge mesh may be wider than the largest number, and squares overflow sooner.
    let half = bounds.high / 2.0 - bounds.low / 2.0;
    let longest = half.max_element();
    let scale = if longest > 0.0 { 2.0 * longest * (half / longest).length() } else { 1.0 };
    let positions =
        mesh.positions.iter().zip(&used).map(|(&p, &used)| if used { (p - origin) / scale } else { DVec3::ZERO });
    (TriangleMesh { positions: positions.collect(), triangles: mesh.triangles.clone() }, Placement { origin, scale })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_of(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), RetopologyError> {
        let positions = positions.iter().map(|&p| p.into()).collect();
        check(&TriangleMesh { positions, triangles: triangles.to_vec() }).map(|_| ())
    }

    const POINTS: [[f64; 3]; 5] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]];

    #[test]
    fn every_defect_is_named() {
        assert_eq!(check_of(&POINTS, &[]), Err(RetopologyError::Empty));
        let range = RetopologyError::VertexOutOfRange { triangle: 1, vertex: 5, vertices: 5 };
        assert_eq!(check_of(&POINTS, &[[0, 1, 2], [0, 5, 1]]), Err(range));
        let mut points = POINTS;
        points[4][1] = f64::NAN;
        assert_eq!(check_of(&points, &[[0, 1, 2]]), Err(RetopologyError::NotFinite { vertices: vec![4] }));
        let repeated = RetopologyError::RepeatedCorners { triangles: vec![1] };
        assert_eq!(check_of(&POINTS, &[[0, 1, 2], [3, 3, 1]]), Err(repeated));
        let duplicate = RetopologyError::DuplicateTriangles { pairs: vec![[0, 2]] };
        assert_eq!(check_of(&POINTS, &[[0, 1, 2], [2, 1, 3], [1, 0, 2]]), Err(duplicate));
        let crowded = RetopologyError::NonManifoldEdges { edges: vec![[0, 1]] };
        assert_eq!(check_of(&POINTS, &[[0, 1, 2], [1, 0, 3], [1, 0, 4]]), Err(crowded));
        let turned = RetopologyError::MisorientedEdges { edges: vec![[0, 1]] };
        assert_eq!(check_of(&POINTS, &[[0, 1, 2], [0, 1, 3]]), Err(turned));
        let points = [POINTS.as_slice(), &[[2., 2., 2.], [3., 3., 1.]]].concat();
        let touching = RetopologyError::NonManifoldVertices { vertices: vec![0] };
        assert_eq!(check_of(&points, &[[0, 1, 2], [0, 5, 6]]), Err(touching));
        assert_eq!(check_of(&points, &[[0, 1, 2], [1, 0, 3]]), Ok(()), "open, with unused vertices");
    }

    #[test]
    fn the_working_box_has_diagonal_one_at_any_scale() {
        for scale in [1e-200, 1.0, 1e200] {
            let mesh = TriangleMesh {
                positions: POINTS.iter().map(|&p| DVec3::from(p) * scale + DVec3::splat(scale)).collect(),
                triangles: vec![[0, 1, 2], [0, 3, 4]],
            };
            let (working, placement) = normalised(&mesh);
            let bounds = Aabb::of(working.positions.iter().copied());
            assert!((bounds.low.distance(bounds.high) - 1.0).abs() < 1e-12);
            for (&p, &q) in mesh.positions.iter().zip(&working.positions) {
                assert!(p.distance(placement.to_scene(q)) <= 1e-12 * scale);
            }
        }
    }
}
