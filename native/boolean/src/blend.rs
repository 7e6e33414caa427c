//! Blending (section 4.2): smooths the surface near the intersection curve, on request.
//!
//! Deviation: the paper smooths the triangles before meshing and the quads afterwards; here the finished quads are
//! smoothed, so that the curve stays an edge loop and every vertex outside the radius keeps its exact place.

use crate::Cancelled;
use crate::stitch::Stitched;
use mesh::{Monitor, Topology, TriangleMesh};
use surface::geodesic::distance_field;
use surface::smooth_blend::{blend_weights, laplacian_blend};

/// Steps of the smoothing.
const STEPS: usize = 10;

/// Smooths within `radius` (scene units, along the surface) of the curve; returns how many kept faces moved. Costs O(k)
/// for the k vertices within the radius, plus O(n) to find them.
///
/// # Errors
/// [`Cancelled`].
pub fn blend(stitched: &mut Stitched, curve: &[[u32; 2]], radius: f64, monitor: &Monitor) -> Result<usize, Cancelled> {
    let (mut triangles, _) = TriangleMesh::from_polygons(&stitched.mesh);
    let topology = Topology::of_triangles(&triangles);
    let mut sources = curve.as_flattened().to_vec();
    sources.sort_unstable();
    sources.dedup();
    let distance = distance_field(&triangles, &topology, &sources, radius, monitor)?;
    let weight = blend_weights(&distance, radius);
    laplacian_blend(&mut triangles, &weight, STEPS, monitor)?;
    stitched.mesh.positions = triangles.positions;
    let moved = |f: usize| stitched.mesh.face(f).iter().any(|&v| weight[v as usize] > 0.0);
    Ok((0..stitched.mesh.face_count()).filter(|&f| stitched.face_source[f][0] >= 0 && moved(f)).count())
}
