//! Blending (section 4.2): smooths the surface near the intersection curve, on request.
//!
//! Deviation: the paper smooths the triangles before meshing and the quads afterwards; here the finished quads are
//! smoothed, so that the curve stays an edge loop and every vertex outside the radius keeps its exact place. Then they are
//! evened out along the blended surface, as in the paper; its last Laplacian step would undo that, and is left out.

use crate::Cancelled;
use crate::stitch::Stitched;
use mesh::{DVec3, Monitor, Topology, TriangleMesh};
use surface::closest::ClosestPoint;
use surface::geodesic::distance_field;
use surface::smooth::{Constraint, Patch, SmoothOptions, smooth_quads};
use surface::smooth_blend::{blend_weights, laplacian_blend};
use surface::smooth_star::{Reference, SurfacePoint};

/// Steps of the smoothing.
const STEPS: usize = 10;

/// The surface after blending, which quads are evened out on.
#[derive(Debug)]
struct Blended {
    surface: TriangleMesh,
    closest: ClosestPoint,
}

impl Reference for Blended {
    fn project_near(&self, point: DVec3, under: &mut u32) -> SurfacePoint {
        let hit = self.closest.project_near(point, *under);
        *under = hit.triangle;
        let normal = self.surface.area_normal(hit.triangle as usize).normalize_or_zero();
        SurfacePoint { point: hit.point, normal }
    }
}

/// Smooths within `radius` (scene units, along the surface) of the curve; returns how many kept faces moved. Costs O(n) to
/// find the vertices within the radius, and some milliseconds for a hundred of them.
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
    let line = TriangleMesh {
        positions: triangles.positions.clone(),
        triangles: curve.iter().map(|&[a, b]| [a, b, b]).collect(),
    };
    let line = ClosestPoint::new(&line);
    for (&p, distance) in triangles.positions.iter().zip(&mut distance).filter(|(_, distance)| distance.is_finite()) {
        *distance = distance.max(line.project(p).distance);
    }
    let weight = blend_weights(&distance, radius);
    laplacian_blend(&mut triangles, &weight, STEPS, monitor)?;
    let mut positions = triangles.positions.clone();
    redistribute(stitched, triangles, &weight, &mut positions, monitor)?;
    stitched.mesh.positions = positions;
    let moved = |f: usize| stitched.mesh.face(f).iter().any(|&v| weight[v as usize] > 0.0);
    Ok((0..stitched.mesh.face_count()).filter(|&f| stitched.face_source[f][0] >= 0 && moved(f)).count())
}

/// Evens out the quads within the radius along the blended surface.
fn redistribute(
    stitched: &Stitched,
    surface: TriangleMesh,
    weight: &[f64],
    positions: &mut [DVec3],
    monitor: &Monitor,
) -> Result<(), Cancelled> {
    let is_near = |f: &usize| stitched.mesh.face(*f).iter().any(|&v| weight[v as usize] > 0.0);
    let quads: Vec<[u32; 4]> = (0..stitched.mesh.face_count())
        .filter(is_near)
        .map(|f| std::array::from_fn(|k| stitched.mesh.face(f)[k]))
        .collect();
    let closest = ClosestPoint::new(&surface);
    let patch = Patch {
        quads: &quads,
        surface_of: &vec![0; quads.len()],
        constraints: &weight
            .iter()
            .map(|&w| if w > 0.0 { Constraint::Free } else { Constraint::Fixed })
            .collect::<Vec<_>>(),
        chains: &[],
        surfaces: &[&Blended { surface, closest }],
    };
    // The arrays fit together: only a cancel can stop it.
    smooth_quads(patch, positions, &SmoothOptions::default(), monitor).map(drop).or_else(|_| monitor.check())
}
