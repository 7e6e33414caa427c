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

/// Smooths within `radius` (scene units, along the surface) of the curve; returns how many kept faces moved. Costs O(k c)
/// for the k vertices within the radius and the c edges of the curve, plus O(n) to find them.
///
/// # Errors
/// [`Cancelled`].
pub fn blend(stitched: &mut Stitched, curve: &[[u32; 2]], radius: f64, monitor: &Monitor) -> Result<usize, Cancelled> {
    let (mut triangles, _) = TriangleMesh::from_polygons(&stitched.mesh);
    let topology = Topology::of_triangles(&triangles);
    let mut sources = curve.as_flattened().to_vec();
    sources.sort_unstable();
    sources.dedup();
    let mut distance = distance_field(&triangles, &topology, &sources, radius, monitor)?;
    // Between two fronts the field is too low by a part of an edge; no way along the surface is shorter than the straight one.
    let at = |v: u32| triangles.positions[v as usize];
    for (v, distance) in distance.iter_mut().enumerate().filter(|(_, distance)| distance.is_finite()) {
        let p = triangles.positions[v];
        let straight = curve.iter().map(|&[a, b]| {
            let (a, along) = (at(a), at(b) - at(a));
            let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            p.distance(a + t * along)
        });
        *distance = distance.max(straight.fold(f64::INFINITY, f64::min));
    }
    let weight = blend_weights(&distance, radius);
    laplacian_blend(&mut triangles, &weight, STEPS, monitor)?;
    stitched.mesh.positions = triangles.positions;
    let moved = |f: usize| stitched.mesh.face(f).iter().any(|&v| weight[v as usize] > 0.0);
    Ok((0..stitched.mesh.face_count()).filter(|&f| stitched.face_source[f][0] >= 0 && moved(f)).count())
}
