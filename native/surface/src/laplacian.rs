//! The cotangent Laplacian of a triangle surface, sane on bad triangles.
//!
//! Weights come from the intrinsic Delaunay triangulation, where none is negative, so that harmonic functions obey the
//! maximum principle whatever the input triangles look like. Marked edges are never flipped: a field does not leak across
//! a curve on which it is prescribed.
//!
//! Source: Bobenko and Springborn, "A discrete Laplace-Beltrami operator for simplicial surfaces", 2007; used for Daniels et
//! al. 2011, section 4.1.

use crate::intrinsic::Intrinsic;
use mesh::{Cancelled, Monitor, NONE, Topology, TriangleMesh};

/// Weights are kept above this, so that no vertex comes loose, and below its inverse.
const LEAST_WEIGHT: f64 = 1e-7;

/// An edge of the Laplacian: the two vertices and their weight, half the sum of the cotangents opposite.
pub type WeightedEdge = (u32, u32, f64);

/// Cotangent weights over the constrained intrinsic Delaunay triangulation, one entry an edge; dimensionless. `fixed` marks
/// half-edges (either one of an edge) that are kept. O(n) in practice.
///
/// # Errors
/// [`Cancelled`].
pub fn cotangent_weights(
    mesh: &TriangleMesh,
    topology: &Topology,
    fixed: &[bool],
    monitor: &Monitor,
) -> Result<Vec<WeightedEdge>, Cancelled> {
    let mut triangulation = Intrinsic::new(mesh, topology);
    let mut kept = vec![false; triangulation.length.len()];
    for (h, _) in fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
        kept[triangulation.edge[h] as usize] = true;
    }
    triangulation.make_delaunay(&kept, monitor)?;
    let mut weights = Vec::with_capacity(triangulation.length.len());
    for h in 0..triangulation.twin.len() as u32 {
        let t = triangulation.twin[h as usize];
        if t != NONE && t < h {
            continue;
        }
        let across = if t == NONE { 0.0 } else { triangulation.cotangent_opposite(t) };
        let weight = 0.5 * (triangulation.cotangent_opposite(h) + across);
        // An edge from a vertex to itself has no gradient.
        if triangulation.from(h) != triangulation.to(h) {
            weights.push((triangulation.from(h), triangulation.to(h), weight.clamp(LEAST_WEIGHT, 1.0 / LEAST_WEIGHT)));
        }
    }
    Ok(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::grid;
    use glam::DVec3;

    #[test]
    fn linear_functions_on_a_sheared_plane_are_harmonic_and_no_weight_is_negative() {
        // Angles up to 160 degrees: plain cotangent weights are negative here.
        let mesh = grid(14, 14, |x, y| DVec3::new(x + 2.0 * y, 0.6 * y, 0.0));
        let topology = Topology::of_triangles(&mesh);
        let weights = cotangent_weights(&mesh, &topology, &vec![false; topology.len()], &Monitor::new()).unwrap();
        let mut sums = vec![0.0; mesh.positions.len()];
        for &(a, b, weight) in &weights {
            assert!(weight > 0.0);
            let value = |v: u32| mesh.positions[v as usize].dot(DVec3::new(0.3, -1.1, 0.0));
            sums[a as usize] += weight * (value(b) - value(a));
            sums[b as usize] += weight * (value(a) - value(b));
        }
        for (v, sum) in sums.into_iter().enumerate() {
            assert!(topology.is_border_vertex(v as u32) || sum.abs() < 1e-5, "vertex {v}: {sum}");
        }
    }
}
