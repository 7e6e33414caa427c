//! Tilings with the fewest thin rhombi (30 degrees), as near to the border as they can lie (section 6, Fig. 23 middle).
//!
//! A rhombus changes the certificate's defect by one, so at least |defect| are needed, and their number has the defect's
//! parity. Numbers are tried from there upwards; with each, first rhombi that touch the outline, then such that lie within
//! 1, 2 and 4 edges of its corners, then any. So the first tiling found has the fewest, and of these none keeps all its
//! rhombi in a narrower band.
//!
//! Deviation: the paper adds the rhombus to its integer programme, and moves rhombi outwards by their cost. Here the state
//! graph searches, with the defect of each loop that is left as a bound. To show that a number is too small takes a search
//! of all ways to place so many; where that has too many states, larger numbers are tried, and the result says what is
//! proven.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::fence::Fence;
use crate::graph::{Alternative, Graph, Value};
use crate::options::Options;
use crate::peel::peel;
use crate::plane::Isometry;
use crate::random::Random;
use crate::region::ANY_NUMBER;
use crate::tile::{Kind, Tiling};
use crate::tilings::{Walk, find_tiling, never_overflows, sweep};
use crate::value::{ByRhombi, Cost};
use mesh::Monitor;
use num_bigint::BigUint;

/// Bands tried, in edges from the outline's corners; after them rhombi may lie anywhere.
const BANDS: [f64; 4] = [0.0, 1.0, 2.0, 4.0];

/// Rhombi of either sign beyond the certificate's number, tried along the border when searches settle nothing.
const PAIRS: [usize; 4] = [1, 2, 4, 8];

/// Most states of one search: about a second; and of one that takes what it finds first.
const MOST_STATES: usize = 30_000;
const HASTY_STATES: usize = 4_000;

/// A tiling by triangles, squares and as few thin rhombi as there can be.
#[derive(Debug, Clone, PartialEq)]
pub struct WithRhombi {
    /// The tiles.
    pub tiling: Tiling,
    /// How many of them are rhombi.
    pub rhombi: usize,
    /// No tiling has fewer than this: equal to `rhombi` but where the proof would have taken too long.
    pub at_least: usize,
    /// The greatest distance of a rhombus's nearest corner from the nearest corner of the outline, in edges: 0 when all
    /// rhombi touch the outline, and when there are none.
    pub depth: f64,
}

/// A tiling of an outline with the fewest thin rhombi, none when it has a tiling without; `None` when no number of rhombi
/// helps. Another seed may give another tiling.
///
/// # Errors
/// [`TilingError::Memory`] when a tiling without rhombi was neither found nor ruled out within the memory;
/// [`TilingError::Unsettled`] when none was found with any number of rhombi, nor ruled out; [`TilingError::Cancelled`].
///
/// # Source
/// Peng et al. 2018, 6. Milliseconds for outlines of 60 edges that lack a few rhombi; seconds where the certificate's
/// lower bound is not reached.
pub fn tile_with_rhombi(
    boundary: &Boundary,
    seed: u64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<WithRhombi>, TilingError> {
    let certificate = Certificate::new(boundary.directions());
    if !certificate.refutes()
        && let Some(tiling) = find_tiling(boundary, seed, options, monitor)?
    {
        return Ok(Some(WithRhombi { tiling, rhombi: 0, at_least: 0, depth: 0.0 }));
    }
    if certificate.refutes_rhombi() {
        return Ok(None);
    }
    let mut search = Search { boundary, seed, options, monitor, is_cut: false };
    let mut at_least = if certificate.defect == 0 { 2 } else { certificate.defect.abs() };
    // Nearly always the certificate's number touches the border.
    if let Some(found) = search.tiling(at_least, Some(BANDS[0]))? {
        return search.fewer(found, at_least).map(Some);
    }
    if search.is_cut
        && let Some(found) = search.peeled(0)?
    {
        return search.fewer(found, at_least).map(Some);
    }
    search.is_cut = false;
    if search.is_impossible()? {
        return Ok(None);
    }
    search.is_cut = false;
    // What is not triangles has the area of its squares and half as much for each rhombus.
    let most = (2 * certificate.square_count() + certificate.defect).min(i32::from(ANY_NUMBER) - 1);
    let (mut rhombi, mut step) = (at_least, 2);
    while rhombi <= most {
        // Whether any band does is asked before which.
        if let Some(found) = search.tiling(rhombi, Some(BANDS[0]))? {
            return search.fewer(found, at_least).map(Some);
        }
        if let Some(found) = search.tiling(rhombi, None)? {
            return search.fewer(found, at_least).map(Some);
        }
        if search.is_cut {
            step *= 2;
        } else {
            at_least = rhombi + 2;
        }
        rhombi = if rhombi < most { most.min(rhombi + step) } else { most + 2 };
    }
    if !search.is_cut {
        return Ok(None);
    }
    for pairs in PAIRS {
        if let Some(found) = search.peeled(pairs)? {
            return search.fewer(found, at_least).map(Some);
        }
    }
    Err(TilingError::Unsettled { states: MOST_STATES })
}

struct Search<'a> {
    boundary: &'a Boundary,
    seed: u64,
    options: &'a Options,
    monitor: &'a Monitor,
    /// Whether a search met too many states, so that nothing follows from its finding nothing.
    is_cut: bool,
}

impl Search<'_> {
    /// True when no number of rhombi helps, for sure.
    fn is_impossible(&mut self) -> Result<bool, TilingError> {
        let found = self.evaluate::<bool>(ANY_NUMBER, None)?;
        Ok(!self.is_cut && !found.is_some_and(|(_, _, found)| found))
    }

    /// A tiling with rhombi along the border, as many as the defect asks for and so many pairs more, if chance finds one.
    fn peeled(&self, pairs: usize) -> Result<Option<WithRhombi>, TilingError> {
        let tiling = peel(self.boundary, pairs, self.seed, self.options, self.monitor)?;
        Ok(tiling.map(|tiling| self.described(tiling)))
    }

    fn described(&self, tiling: Tiling) -> WithRhombi {
        let depth = depth(&tiling, self.boundary);
        WithRhombi { rhombi: tiling.count(Kind::Rhombus), at_least: 0, depth, tiling }
    }

    /// The same or a tiling with fewer rhombi, at least this many; of these, one in the narrowest band.
    fn fewer(&mut self, mut best: WithRhombi, at_least: i32) -> Result<WithRhombi, TilingError> {
        best.at_least = at_least as usize;
        let defect = Certificate::new(self.boundary.directions()).defect.unsigned_abs() as usize;
        for pairs in PAIRS.into_iter().filter(|pairs| (best.at_least..best.rhombi).contains(&(defect + 2 * pairs))) {
            if let Some(found) = self.peeled(pairs)? {
                best = WithRhombi { at_least: best.at_least, ..found };
                break;
            }
        }
        let (mut low, mut high) = (at_least, best.rhombi as i32);
        while low < high {
            let middle = low + (high - low) / 4 * 2;
            let found = match self.tiling(middle, Some(BANDS[0]))? {
                None => self.tiling(middle, None)?,
                found => found,
            };
            match found {
                Some(found) => {
                    high = found.rhombi as i32;
                    best = WithRhombi { at_least: best.at_least, ..found };
                }
                None => low = middle + 2,
            }
        }
        for band in BANDS {
            if best.depth <= band {
                break;
            }
            if let Some(found) = self.tiling(best.rhombi as i32, Some(band))? {
                return Ok(WithRhombi { at_least: best.at_least, ..found });
            }
        }
        Ok(best)
    }

    /// A tiling with up to this many rhombi, within a band along the outline if there is one.
    fn tiling(&mut self, rhombi: i32, band: Option<f64>) -> Result<Option<WithRhombi>, TilingError> {
        let Some((graph, root, Cost(Some(found)))) = self.evaluate::<Cost>(rhombi as u16, band)? else {
            return Ok(None);
        };
        if found > i64::from(rhombi) {
            return Ok(None);
        }
        let tiling = Walk::new(graph, Some(root)).least(self.monitor)?;
        Ok(tiling.map(|tiling| self.described(tiling)))
    }

    /// The state graph of the outline, and what the whole is worth; `None` when forced moves contradict each other, or the
    /// search is cut, which is kept.
    #[allow(clippy::type_complexity)] // Three things that belong together only here.
    fn evaluate<V: Value>(
        &mut self,
        rhombi: u16,
        band: Option<f64>,
    ) -> Result<Option<(Graph<V>, Alternative, V)>, TilingError> {
        self.monitor.stage("rhombi", 0.0)?;
        let group = [Isometry::default()];
        let fence = band.map(|reach| Fence::new(self.boundary.points(), reach));
        // After a cut the number of rhombi is no lower bound any more.
        let hasty = self.is_cut;
        let graph = Graph::<V>::rhombic(fence, hasty, sweep(self.boundary, &group), self.options.memory);
        let mut graph = graph.limited(if hasty { HASTY_STATES } else { MOST_STATES }).shuffled(Random::new(self.seed));
        let begun = graph.begin(&self.boundary.word(), rhombi, &group, self.monitor).map_err(never_overflows)?;
        let Some(root) = begun else { return Ok(None) };
        match graph.evaluate(&root, self.monitor).map_err(never_overflows) {
            Ok(value) => Ok(Some((graph, root, value))),
            Err(TilingError::Memory { .. }) => {
                self.is_cut = true;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// Numbers of tilings of an outline with 0, 1, 2 ... up to `most` thin rhombi, exactly.
///
/// # Errors
/// [`TilingError::Memory`] when the states do not fit, [`TilingError::Option`] for more than 1,000 rhombi,
/// [`TilingError::Cancelled`]. Rhombi can lie almost anywhere: this is for small outlines, or few rhombi.
pub fn count_with_rhombi(
    boundary: &Boundary,
    most: usize,
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<BigUint>, TilingError> {
    if most > 1000 {
        return Err(TilingError::Option("at most 1,000 rhombi can be asked for".to_owned()));
    }
    let defect = Certificate::new(boundary.directions()).defect;
    let mut counts = vec![BigUint::ZERO; most + 1];
    // Only numbers of the defect's parity occur.
    let highest = if (most as i32 - defect) % 2 == 0 { most as i32 } else { most as i32 - 1 };
    if highest < defect.abs() {
        return Ok(counts);
    }
    monitor.stage("rhombi", 0.0)?;
    let group = [Isometry::default()];
    let mut graph = Graph::<ByRhombi>::rhombic(None, false, sweep(boundary, &group), options.memory);
    let counted = graph.begin(&boundary.word(), highest as u16, &group, monitor).and_then(|root| match root {
        Some(root) => graph.evaluate(&root, monitor),
        None => Ok(Value::none()),
    });
    let ByRhombi(found) = counted.map_err(never_overflows)?;
    for (count, found) in counts.iter_mut().zip(found) {
        *count = found;
    }
    Ok(counts)
}

/// See [`WithRhombi::depth`].
fn depth(tiling: &Tiling, boundary: &Boundary) -> f64 {
    let mut fence = Fence::new(boundary.points(), 0.0);
    let rhombi = tiling.tiles.iter().filter(|tile| tile.kind == Kind::Rhombus);
    rhombi
        .map(|tile| tile.corners().map(|corner| fence.distance(corner)).fold(f64::INFINITY, f64::min))
        .fold(0.0, f64::max)
}
