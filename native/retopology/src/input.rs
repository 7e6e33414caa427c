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
            [_] => {}
            [a, b] if a.1 == b.1 => misoriented.push(a.0),
            [_, _] => {}
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
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let bounds = Aabb::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]));
    let origin = bounds.low.midpoint(bounds.high);
    // Halved first: the box of a huge mesh may be wider than the largest number.
    let diagonal = 2.0 * (bounds.high / 2.0 - bounds.low / 2.0).length();
    let scale = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
    let positions = mesh.positions.iter().zip(&used).map(|(&p, &used)| {
        if used { (p - origin) / scale } else { DVec3::ZERO }
    });
    (TriangleMesh { positions: positions.collect(), triangles: mesh.triangles.clone() }, Placement { origin, scale })
}
