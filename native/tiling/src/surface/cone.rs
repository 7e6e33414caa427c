//! Patches with one irregular vertex inside: cones.
//!
//! A patch whose corners leave a defect of 30 or 60 degrees closes after a turn by that much about a point, which is always a
//! point of the exact plane, since 1 less a twelfth or sixth root of unity is a unit of its ring. Slit from the
//! outline to that point, the patch is flat. So it is a patch of section 4.1 that meets itself along the slit, and
//! polyhedra whose faces have such defects (5.1: the decagons of b3D) need not be divided.

use crate::plane::Point;
use crate::tile::Tiling;
use crate::tilings::find_tiling;
use crate::{Boundary, Certificate, Options, TilingError};
use mesh::Monitor;
use num_bigint::BigUint;

/// Most edges of a slit.
const LONGEST: usize = 5;

/// The tiling of an outline, slit open where that was needed.
#[derive(Debug, Clone)]
pub(super) struct Filling {
    pub tiling: Tiling,
    /// The outline as it was filled, from its corner `start` on; with a slit, that comes last, in and out.
    pub boundary: Boundary,
    pub start: usize,
    /// Edges of the slit, each of which is there twice; 0 for a flat patch.
    pub slit: usize,
    /// How many tilings there were to choose from, where that is known.
    pub count: Option<BigUint>,
}

/// Fills a cone, given its boundary code and its defect; `None` when no slit of a few edges admits a tiling.
pub(super) fn fill_cone(
    code: &[u8],
    defect: i32,
    seed: u64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<Filling>, TilingError> {
    let n = code.len();
    for start in 0..n {
        let mut directions = vec![0u8];
        for k in 1..n {
            directions.push((directions[k - 1] + 18 - code[(start + k) % n]) % 12);
        }
        let end = directions.iter().fold(Point::ORIGIN, |p, &d| p + Point::unit(d));
        let tip = tip(end, defect as u8);
        for length in 1..=LONGEST {
            for path in paths(tip, length) {
                monitor.check()?;
                // Into the slit as the other border sees it, turned by the defect, and out again.
                let into = path.iter().map(|&d| (d + 12 - defect as u8) % 12);
                let out = path.iter().rev().map(|&d| (d + 6) % 12);
                let all: Vec<u8> = directions.iter().copied().chain(into).chain(out).collect();
                let slit_code: Vec<u8> =
                    (0..all.len()).map(|k| (18 + all[(k + all.len() - 1) % all.len()] - all[k]) % 12).collect();
                // The tip has nearly a full turn.
                if slit_code[n + length] != 12 - defect as u8 {
                    continue;
                }
                let Ok(boundary) = Boundary::new(&slit_code) else { continue };
                if Certificate::new(boundary.directions()).refutes() {
                    continue;
                }
                if let Some(tiling) = find_tiling(&boundary, seed, options, monitor)? {
                    return Ok(Some(Filling { tiling, boundary, start, slit: length, count: None }));
                }
            }
        }
    }
    Ok(None)
}

/// The fixed point of a turn by -30 or -60 degrees that takes the origin to `end`.
fn tip(end: Point, defect: u8) -> Point {
    if defect == 2 {
        return end.turned(10);
    }
    // 1 / (1 - 1/z) is half of 1 + 1/z + ... + 1/z^5, whose coordinates are even.
    let sum = (0..6).fold(Point::ORIGIN, |sum, k| sum + end.turned((12 - k) % 12));
    Point(sum.0.map(|x| x / 2))
}

/// Paths of so many edges from the origin to a point, none turning by more than 90 degrees from the straight way.
fn paths(to: Point, length: usize) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    let mut open = vec![(Vec::new(), Point::ORIGIN)];
    while let Some((path, at)) = open.pop() {
        let left = length - path.len();
        if left == 0 {
            if at == to {
                found.push(path);
            }
            continue;
        }
        for direction in 0..12 {
            let next = at + Point::unit(direction);
            let [x, y] = (to - next).position();
            if x.hypot(y) <= (left - 1) as f64 + 1e-9 {
                let mut longer: Vec<u8> = path.clone();
                longer.push(direction);
                open.push((longer, next));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tip_stays_where_it_is() {
        for defect in [1u8, 2] {
            for direction in 0..12 {
                let end = Point::unit(direction) + Point::unit((direction + 1) % 12) + Point::unit(4);
                let tip = tip(end, defect);
                assert_eq!(end + tip.turned(12 - defect), tip);
            }
        }
    }

    #[test]
    fn a_decagon_is_a_cupola_with_a_pyramid_on_it() {
        let filled = fill_cone(&[5; 10], 2, 0, &Options::default(), &Monitor::new()).expect("not cancelled");
        let tiling = filled.expect("a tiling").tiling;
        assert_eq!([crate::Kind::Triangle, crate::Kind::Square].map(|kind| tiling.count(kind)), [10, 5]);
    }
}
