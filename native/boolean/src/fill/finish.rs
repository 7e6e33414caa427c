//! Finishing a fill: the topological search takes irregular vertices out, smoothing makes the quads square (3.5, 4.2).

use super::{Declined, Fill, Region};
use mesh::Monitor;
use quadrangulate::improve::{ImproveOptions, NEAREST, QuadPatch, Setting, improve};
use surface::smooth::{Constraint, SmoothOptions};

/// Plans thought through for all irregular vertices of a region together, about: bounds the time of large regions.
const PLANS: usize = 40_000;

/// How hard to search: deep enough to take out most of the irregular vertices that can go.
fn search(quads: usize) -> ImproveOptions {
    let budget = (PLANS / quads.max(1)).clamp(40, 600);
    let smooth = SmoothOptions { sweeps: 10, worst_sweeps: 15, ..SmoothOptions::default() };
    ImproveOptions { depth: 2, passes: 3, budget, smooth, ..ImproveOptions::default() }
}

/// Improves a fill. The rim and all lines stay.
///
/// # Errors
/// [`Declined`] when the fill is not a manifold, or the caller cancels.
pub fn finish(region: &Region, fill: &Fill, monitor: &Monitor) -> Result<Fill, Declined> {
    finish_with(region, fill, &search(fill.quads.len()), monitor)
}

/// Smooths a fill and leaves its connections alone.
///
/// # Errors
/// As [`finish`].
pub fn smooth(region: &Region, fill: &Fill, monitor: &Monitor) -> Result<Fill, Declined> {
    finish_with(region, fill, &ImproveOptions { depth: 0, ..search(fill.quads.len()) }, monitor)
}

fn finish_with(region: &Region, fill: &Fill, options: &ImproveOptions, monitor: &Monitor) -> Result<Fill, Declined> {
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
    let setting =
        Setting { features: &features, outside: &outside, chains: &[], surfaces: &[&region.under], slack: NEAREST };
    let better = improve(start, &setting, options, monitor)
        .map_err(|error| monitor.check().map_or_else(Declined::Cancelled, |()| Declined::Because(error.to_string())))?;
    Ok(Fill { positions: better.patch.positions[region.rim_count..].to_vec(), quads: better.patch.quads })
}

#[cfg(test)]
#[path = "finish_tests.rs"]
mod tests;
