//! Finishing a fill: the topological search takes irregular vertices out, smoothing makes the quads square (3.5, 4.2).

use super::{Declined, Fill, Region};
use mesh::Monitor;
use quadrangulate::improve::{ImproveOptions, QuadPatch, Setting, improve};
use surface::smooth::{Constraint, SmoothOptions};

/// How hard to search: deep enough to take out most of the irregular vertices that can go, in tens of milliseconds.
const SEARCH: ImproveOptions = ImproveOptions {
    depth: 3,
    floor: 0.3,
    passes: 4,
    budget: 1500,
    smooth: SmoothOptions { sweeps: 10, worst_sweeps: 15, target: 0.6, keep_aspect: 0.5 },
};

/// Improves a fill. The rim and all lines stay.
///
/// # Errors
/// [`Declined`] when the fill is not a manifold, or the caller cancels.
pub fn finish(region: &Region, fill: &Fill, monitor: &Monitor) -> Result<Fill, Declined> {
    let positions = region.points(fill);
    let count = positions.len();
    let start = QuadPatch {
        surface_of: vec![0; fill.quads.len()],
        quads: fill.quads.clone(),
        constraints: (0..count)
            .map(|v| if v < region.rim_count { Constraint::Fixed } else { Constraint::Free })
            .collect(),
        positions,
    };
    let mut outside = region.outside.clone();
    outside.resize(count, 0);
    let mut features = region.inner_lines.clone();
    features.extend(&region.line_edges);
    let setting = Setting { features: &features, outside: &outside, chains: &[], surfaces: &[&region.under] };
    let better = improve(start, &setting, &SEARCH, monitor).map_err(|error| {
        monitor.check().map_or_else(Declined::Cancelled, |()| Declined::Because(error.to_string()))
    })?;
    Ok(Fill { positions: better.patch.positions[region.rim_count..].to_vec(), quads: better.patch.quads })
}
