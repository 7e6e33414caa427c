//! The filler that takes any region: triangles at the target size, paired into quads by perfect matching.
//!
//! Not in the paper. Pairing triangles by a maximum-weight perfect matching follows J.-F. Remacle et al., `Blossom-Quad`,
//! IJNME 89, 2012. A perfect matching exists in practice once no inner edge joins two rim vertices, which the remesher
//! sees to; where none exists, the region is declined.

use super::{Declined, Fill, Region};
use mesh::{DVec3, Monitor, NONE, Topology, TriangleMesh};
use solve::matching::perfect_matching;
use std::f64::consts::FRAC_PI_2;
use surface::remesh::{RemeshOptions, remesh};

/// Two equilateral triangles of this edge length make a quad as large as a unit square.
pub const TRIANGLE_EDGE: f64 = 1.0746;

/// Weight of a perfect square in the matching.
const BEST_WEIGHT: f64 = 1000.0;

/// Fills a region. Costs O(n) for the remeshing and typically O(n log n), at worst O(n^3), for the matching of n
/// triangles.
///
/// # Errors
/// [`Declined`] when remeshing fails or some triangle cannot be paired.
pub fn fill(region: &Region, scale: f64, monitor: &Monitor) -> Result<Fill, Declined> {
    let size: Vec<f64> = region.size.iter().map(|s| s * scale * TRIANGLE_EDGE).collect();
    let options = RemeshOptions { split_chords: true, ..RemeshOptions::default() };
    let made =
        remesh(&region.surface, &region.inner_lines, &size, &options, monitor).map_err(|e| because(monitor, &e))?;
    let quads = pair(&made.mesh, &made.vertex, region, monitor)?;

    // Rim vertices keep their numbers, the others follow in the remesher's order.
    let mut number = vec![NONE; made.mesh.positions.len()];
    for (k, &v) in made.vertex[..region.rim_count].iter().enumerate() {
        number[v as usize] = k as u32;
    }
    let mut positions = Vec::new();
    for (v, slot) in number.iter_mut().enumerate() {
        if *slot == NONE {
            *slot = (region.rim_count + positions.len()) as u32;
            positions.push(made.mesh.positions[v]);
        }
    }
    Ok(Fill { positions, quads: quads.into_iter().map(|q| q.map(|v| number[v as usize])).collect() })
}

/// An error as a reason to decline, or the cancellation that caused it.
pub fn because(monitor: &Monitor, reason: &impl std::fmt::Display) -> Declined {
    match monitor.check() {
        Err(cancelled) => cancelled.into(),
        Ok(()) => Declined::Because(reason.to_string()),
    }
}

fn pair(mesh: &TriangleMesh, vertex: &[u32], region: &Region, monitor: &Monitor) -> Result<Vec<[u32; 4]>, Declined> {
    let topology = Topology::of_triangles(mesh);
    let mut lines: Vec<[u32; 2]> =
        region.inner_lines.iter().map(|l| l.map(|v| vertex[v as usize])).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    lines.sort_unstable();
    // The quad over an inner half-edge: its own triangle's apex, its start, the other apex, its end.
    let quad = |h: u32| {
        let o = topology.twin[h as usize];
        [
            topology.to(topology.next[h as usize]),
            topology.from(h),
            topology.to(topology.next[o as usize]),
            topology.to(h),
        ]
    };
    let inner: Vec<u32> = topology
        .edges()
        .filter(|&h| {
            let (a, b) = (topology.from(h), topology.to(h));
            !topology.is_border(h) && lines.binary_search(&[a.min(b), a.max(b)]).is_err()
        })
        .collect();
    let edges: Vec<(u32, u32, i32)> = inner
        .iter()
        .map(|&h| {
            let points = quad(h).map(|v| mesh.positions[v as usize]);
            (h / 3, topology.twin[h as usize] / 3, (BEST_WEIGHT * squareness(points)).round() as i32)
        })
        .collect();
    let partner =
        perfect_matching(mesh.triangles.len(), &edges, &|| monitor.is_cancelled()).map_err(|e| because(monitor, &e))?;
    Ok(inner.into_iter().filter(|&h| partner[(h / 3) as usize] == topology.twin[h as usize] / 3).map(quad).collect())
}

/// 1 for four right angles, 0 when an angle reaches 0 or 180 degrees (Remacle et al. 2012, eq. 1), less what the quad
/// is bent along its diagonal.
fn squareness(p: [DVec3; 4]) -> f64 {
    let worst = (0..4)
        .map(|k| {
            let forward = (p[(k + 1) % 4] - p[k]).normalize_or_zero();
            let backward = (p[(k + 3) % 4] - p[k]).normalize_or_zero();
            (FRAC_PI_2 - forward.dot(backward).clamp(-1.0, 1.0).acos()).abs()
        })
        .fold(0.0, f64::max);
    let [n, m] = [(p[1] - p[0]).cross(p[3] - p[0]), (p[3] - p[2]).cross(p[1] - p[2])].map(DVec3::normalize_or_zero);
    ((1.0 - worst / FRAC_PI_2) * n.dot(m).max(0.0)).clamp(0.0, 1.0)
}
