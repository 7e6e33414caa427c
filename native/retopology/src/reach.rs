//! The points of the surface that stick out of its quads: fingertips, horns, the apex of a cone.
//!
//! Not in the paper. Projection puts the quads' vertices on the surface, but says nothing of the surface between them: rows of
//! quads slip off a tip one after the other, and no closest point ever leads back to it.

use crate::base::Base;
use mesh::{DVec3, Monitor, NONE};
use rayon::prelude::*;
use surface::closest::ClosestPoint;

/// Points looked up between two looks at the monitor.
const BATCH: usize = 4096;

/// Points of the surface off rails further than `error` from the quads, with a surface triangle at each: the farthest first, no two
/// within `spacing`; only those of base triangles that `are_new`. O(surface vertices · log quads).
pub(crate) fn missed(
    base: &Base,
    are_new: &[bool],
    on_rail: &dyn Fn(usize) -> bool,
    positions: &[DVec3],
    quads: &[[u32; 4]],
    [error, spacing]: [f64; 2],
    monitor: &Monitor,
) -> Result<Vec<(DVec3, u32)>, mesh::Cancelled> {
    let closest = ClosestPoint::of_quads(positions, quads.iter().copied());
    let mut triangle_at = vec![NONE; base.surface.positions.len()];
    let owned = base.surface.triangles.iter().zip(&base.owner).enumerate();
    for (t, (corners, _)) in owned.filter(|(_, (_, owner))| are_new[**owner as usize]) {
        for &v in corners {
            triangle_at[v as usize] = t as u32;
        }
    }
    for (_, edge) in base.edges.iter().enumerate().filter(|(e, _)| on_rail(*e)) {
        for &v in &edge.path {
            triangle_at[v as usize] = NONE;
        }
    }
    let used: Vec<usize> = (0..triangle_at.len()).filter(|&v| triangle_at[v] != NONE).collect();
    let mut far = Vec::new();
    for batch in used.chunks(BATCH) {
        monitor.check()?;
        let off = |&v: &usize| {
            let point = base.surface.positions[v];
            (closest.project(point).point.distance(point), v)
        };
        far.par_extend(batch.par_iter().map(off).filter(|(distance, _)| *distance > error));
    }
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut found: Vec<(DVec3, u32)> = Vec::new();
    for (_, v) in far {
        let point = base.surface.positions[v];
        if found.iter().all(|(other, _)| other.distance(point) > spacing) {
            found.push((point, triangle_at[v]));
        }
    }
    Ok(found)
}
