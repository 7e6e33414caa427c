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
        for &v in ends {
            around[v as usize].push(k);
        }
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
        let length: f64 =
            curve.iter().map(|&k| turns[k].1.map(|v| mesh.positions[v as usize])).map(|[a, b]| a.distance(b)).sum();
        if length >= options.min_length {
            found.extend(curve.into_iter().map(|k| turns[k].1).filter(|ends| !marked.contains(ends)));
        }
    }
    found.sort_unstable();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::DVec3;

    /// A strip bent along its middle line by an angle that grows from `low` to `high` degrees along it.
    fn bent_strip(low: f64, high: f64) -> (TriangleMesh, Topology) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for k in 0..=20_u32 {
            let y = f64::from(k) / 20.0;
            let angle = (low + (high - low) * y).to_radians();
            let far = DVec3::new(0.3 * angle.cos(), y, 0.3 * angle.sin());
            positions.extend([DVec3::new(-0.3, y, 0.0), DVec3::new(0.0, y, 0.0), far]);
        }
        for k in 0..20 {
            for a in [3 * k, 3 * k + 1] {
                triangles.extend([[a, a + 1, a + 4], [a, a + 4, a + 3]]);
            }
        }
        let mesh = TriangleMesh { positions, triangles };
        let topology = Topology::of_triangles(&mesh);
        (mesh, topology)
    }

    #[test]
    fn curves_go_on_below_the_angle_they_start_at() {
        let (mesh, topology) = bent_strip(20.0, 60.0);
        let found =
            |options: &DetectOptions, marked: &[[u32; 2]]| sharp_edges(&mesh, &topology, marked, options).unwrap();
        let options = DetectOptions::default();
        let ridge = found(&options, &[]);
        assert!(ridge.iter().flatten().all(|v| v % 3 == 1), "the middle line and nothing else");
        let strict = found(&DetectOptions { continue_angle: options.start_angle, ..options }, &[]);
        // The angle rises by two degrees an edge: from 25 the curve goes on, from 40 it starts.
        assert!(
            (16..=18).contains(&ridge.len()) && (9..=11).contains(&strict.len()),
            "{} {}",
            ridge.len(),
            strict.len()
        );
        assert_eq!(found(&options, &ridge[3..5]).len(), ridge.len() - 2);
        assert!(found(&DetectOptions { min_length: 0.95, ..options }, &[]).is_empty(), "too short");
        let (mesh, topology) = bent_strip(20.0, 39.0);
        assert!(sharp_edges(&mesh, &topology, &[], &options).unwrap().is_empty(), "never starts");
        let bad = DetectOptions { continue_angle: 1.0, ..options };
        assert!(matches!(sharp_edges(&mesh, &topology, &[], &bad), Err(RetopologyError::BadOption { .. })));
    }
}
