//! Sharp edges found by their dihedral angle.
//!
//! Raw detection on organic scans gives hundreds of crumbs. So edges over a high angle start curves, edges over a lower one
//! continue them (hysteresis, as Canny did for images, 1986), and what stays shorter than a minimum length is dropped.
//! Daniels et al. 2011, section 7 and Fig. 10, combine such edges with the artist's; so does this.

use crate::base_error::RetopologyError;
use mesh::{Topology, TriangleMesh, sorted};
use std::collections::BTreeSet;

/// What counts as a sharp curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectOptions {
    /// Curves start at edges whose faces turn by more than this, radians, 0 to pi. Default: 40 degrees.
    pub start_angle: f64,
    /// They go on over edges that turn by more than this, radians, 0 to `start_angle`. Default: 25 degrees.
    pub continue_angle: f64,
    /// Shorter ones are dropped, fraction of the bounding-box diagonal, 0 to 1. Default: 0.04.
    pub min_length: f64,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self { start_angle: 40_f64.to_radians(), continue_angle: 25_f64.to_radians(), min_length: 0.04 }
    }
}

/// Sharp edges that are not `marked` yet, as vertex pairs in a fixed order. The mesh must lie in a unit box, as
/// [`crate::input::normalised`] leaves it. O(n log n).
///
/// # Errors
/// [`RetopologyError::BadOption`].
pub fn sharp_edges(
    mesh: &TriangleMesh,
    topology: &Topology,
    marked: &[[u32; 2]],
    options: &DetectOptions,
) -> Result<Vec<[u32; 2]>, RetopologyError> {
    let bad = |option, expected| Err(RetopologyError::BadOption { option, expected });
    if !(0.0..=std::f64::consts::PI).contains(&options.start_angle) {
        return bad("start_angle", "0 to pi radians");
    }
    if !(0.0..=options.start_angle).contains(&options.continue_angle) {
        return bad("continue_angle", "0 to start_angle");
    }
    if !(0.0..=1.0).contains(&options.min_length) {
        return bad("min_length", "0 to 1");
    }
    // The angle between the faces of each inner edge, where both have an area.
    let turns: Vec<(f64, [u32; 2])> = topology
        .edges()
        .filter(|&h| !topology.is_border(h))
        .filter_map(|h| {
            let [a, b] = [h, topology.twin[h as usize]].map(|h| mesh.area_normal(h as usize / 3));
            let turn = a.angle_between(b);
            (turn > options.continue_angle).then(|| (turn, sorted(topology.from(h), topology.to(h))))
        })
        .collect();
    let marked: BTreeSet<[u32; 2]> = marked.iter().map(|&[a, b]| sorted(a, b)).collect();
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (k, (_, ends)) in turns.iter().enumerate() {
        ends.iter().for_each(|&v| around[v as usize].push(k));
    }
    let mut seen = vec![false; turns.len()];
    let mut found = Vec::new();
    for first in 0..turns.len() {
        if seen[first] || turns[first].0 <= options.start_angle {
            continue;
        }
        seen[first] = true;
        let (mut curve, mut next) = (vec![first], 0);
        while next < curve.len() {
            for v in turns[curve[next]].1 {
                for &k in &around[v as usize] {
                    if !seen[k] {
                        seen[k] = true;
                        curve.push(k);
                    }
                }
            }
            next += 1;
        }
        let length: f64 = curve.iter().map(|&k| turns[k].1.map(|v| mesh.positions[v as usize])).map(|[a, b]| a.distance(b)).sum();
        if length >= options.min_length {
            found.extend(curve.into_iter().map(|k| turns[k].1).filter(|ends| !marked.contains(ends)));
        }
    }
    found.sort_unstable();
    Ok(found)
}
