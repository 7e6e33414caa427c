//! The smallest change of an outline that lets it be tiled (section 6, Fig. 23 right).
//!
//! Where no tiling exists, thin rhombi (30 degrees) among the tiles often help; pushed to the border, each of them is an
//! exchange of two neighbouring edges whose directions differ by 30 degrees, at a corner of 150 or 210 degrees, and the
//! outline without them can be tiled. An exchange changes the certificate's defect by one, so at least |defect| are
//! needed, and their number has the defect's parity.
//!
//! Deviation: the paper adds the rhombus to the integer programme and moves rhombi outwards by their cost. Here the
//! exchanges themselves are searched, fewest first; rhombi that cannot leave the inside are not found.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::options::Options;
use crate::tilings::is_tileable;
use mesh::Monitor;
use std::collections::BTreeSet;

/// Outlines looked at, and those of them searched for a tiling, before the search gives up.
const MOST_OUTLINES: usize = 200_000;
const MOST_SEARCHES: usize = 2_000;

/// An outline that can be tiled, and how it came about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repair {
    /// The changed outline, its corners counted as before.
    pub boundary: Boundary,
    /// The corners at which the two edges were exchanged, in order; each moves by a thin rhombus's short diagonal.
    pub corners: Vec<u32>,
}

/// The fewest exchanges of neighbouring edges that make an outline tileable; none when it is already. `None` when up to
/// |defect| + 2 exchanges do not help, or too many were tried.
///
/// # Errors
/// [`TilingError::Memory`], [`TilingError::Cancelled`]. Costs O(n) for each of at most 200,000 outlines, and a search for
/// a tiling for at most 2,000 of them, which the certificate lets pass.
pub fn repair(boundary: &Boundary, options: &Options, monitor: &Monitor) -> Result<Option<Repair>, TilingError> {
    let defect = Certificate::new(boundary.directions()).defect.unsigned_abs() as usize;
    let mut search = Search { options, monitor, looked: 0, searched: 0, seen: BTreeSet::new() };
    for exchanges in [defect, defect + 2] {
        search.seen.clear();
        monitor.stage("repair", 0.0)?;
        if let Some(found) = search.exchange(boundary.code(), exchanges, &mut Vec::new())? {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

struct Search<'a> {
    options: &'a Options,
    monitor: &'a Monitor,
    looked: usize,
    searched: usize,
    /// Outlines met: exchanges far apart commute.
    seen: BTreeSet<Vec<u8>>,
}

impl Search<'_> {
    fn exchange(&mut self, code: &[u8], left: usize, done: &mut Vec<u32>) -> Result<Option<Repair>, TilingError> {
        self.monitor.check()?;
        self.looked += 1;
        if self.looked > MOST_OUTLINES || self.searched > MOST_SEARCHES || !self.seen.insert(code.to_vec()) {
            return Ok(None);
        }
        let certificate = Certificate::new(&directions(code));
        if certificate.defect.unsigned_abs() as usize > left {
            return Ok(None);
        }
        if left == 0 {
            let Ok(boundary) = Boundary::new(code) else { return Ok(None) };
            if certificate.refutes() {
                return Ok(None);
            }
            self.searched += 1;
            let found = is_tileable(&boundary, self.options, self.monitor)?;
            return Ok(found.then(|| Repair { boundary, corners: done.clone() }));
        }
        for corner in 0..code.len() {
            if let Some(changed) = exchanged(code, corner) {
                done.push(corner as u32);
                let found = self.exchange(&changed, left - 1, done)?;
                if found.is_some() {
                    return Ok(found);
                }
                done.pop();
            }
        }
        Ok(None)
    }
}

/// The code after the two edges at a corner of 150 or 210 degrees are exchanged; `None` at other corners, and when a
/// neighbour's angle would leave 2 to 11.
fn exchanged(code: &[u8], corner: usize) -> Option<Vec<u8>> {
    let n = code.len();
    // The corner goes from 150 to 210 degrees, its neighbours lose 30 each; or the reverse.
    let change: i8 = match code[corner] {
        5 => -1,
        7 => 1,
        _ => return None,
    };
    let mut changed = code.to_vec();
    changed[corner] = 12 - code[corner];
    for neighbour in [(corner + n - 1) % n, (corner + 1) % n] {
        changed[neighbour] = changed[neighbour].checked_add_signed(change)?;
        if !(2..=11).contains(&changed[neighbour]) {
            return None;
        }
    }
    Some(changed)
}

/// Directions of the edges; what the first one is does not change the defect or the sums of counts, but which count is
/// which. The refutation does not ask.
fn directions(code: &[u8]) -> Vec<u8> {
    let mut direction = 6 + code[0];
    let turn = |&angle: &u8| {
        direction = (direction + 18 - angle) % 12;
        direction
    };
    code.iter().map(turn).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::{outlines, random::Random};

    #[test]
    fn an_exchange_changes_the_area_by_half_a_square() {
        // Corners by rounded coordinates: their area changes by that of the thin rhombus.
        let area = |code: &[u8]| {
            let boundary = Boundary::new(code).unwrap();
            let p: Vec<[f64; 2]> = boundary.points().iter().map(|p| p.position()).collect();
            (0..p.len())
                .map(|k| {
                    let [a, b] = [p[k], p[(k + 1) % p.len()]];
                    (a[0] * b[1] - a[1] * b[0]) / 2.0
                })
                .sum::<f64>()
        };
        let code = [5; 12];
        let changed = exchanged(&code, 3).unwrap();
        assert_eq!(changed, [5, 5, 4, 7, 4, 5, 5, 5, 5, 5, 5, 5]);
        assert!((area(&code) - area(&changed) - 0.5).abs() < 1e-9);
        assert_eq!(exchanged(&changed, 3).unwrap(), code);
    }

    #[test]
    fn spoilt_outlines_are_repaired_with_no_more_exchanges_than_spoilt_them() {
        let (options, monitor) = (Options::default(), Monitor::new());
        let mut random = Random::new(5);
        let mut repaired = 0;
        for _ in 0..100 {
            let mut code = outlines::random_tileable(6 + random.index(12), &mut random);
            let mut spoilt = 0;
            for _ in 0..3 {
                if let Some(changed) = exchanged(&code, random.index(code.len())).filter(|c| Boundary::new(c).is_ok()) {
                    code = changed;
                    spoilt += 1;
                }
            }
            let found = repair(&Boundary::new(&code).unwrap(), &options, &monitor).unwrap().unwrap();
            assert!(found.corners.len() <= spoilt, "{code:?}");
            assert!(outlines::count_by_trying(found.boundary.code()) > 0);
            // The exchanges named lead from the one to the other.
            let replayed = found.corners.iter().fold(code.clone(), |code, &k| exchanged(&code, k as usize).unwrap());
            assert_eq!(replayed, found.boundary.code());
            repaired += usize::from(!found.corners.is_empty());
        }
        assert!(repaired > 10, "{repaired}");
    }

    #[test]
    fn a_tileable_outline_needs_none() {
        let found = repair(&Boundary::new(&[5; 12]).unwrap(), &Options::default(), &Monitor::new()).unwrap().unwrap();
        assert!(found.corners.is_empty());
    }
}
