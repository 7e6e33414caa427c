//! Tilings with the fewest thin rhombi (30 degrees), as near to the border as they can lie (section 6, Fig. 23 middle).
//!
//! A rhombus changes the certificate's defect by one, so at least |defect| are needed, and their number has the defect's
//! parity. Numbers are tried from there upwards; with each, first rhombi that touch the outline, then such that lie within
//! 1, 2 and 4 edges of its corners, then any. So the first tiling found has the fewest, and of these none keeps all its
//! rhombi in a narrower band.
//!
//! Deviation: the paper adds the rhombus to its integer programme, and moves rhombi outwards by their cost. Here the state
//! graph searches, with the defect of each loop that is left as a bound.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::fence::Fence;
use crate::graph::Graph;
use crate::options::Options;
use crate::plane::Isometry;
use crate::tile::{Kind, Tiling};
use crate::tilings::{Walk, find_tiling, never_overflows, sweep};
use crate::value::{ByRhombi, Cost};
use mesh::Monitor;
use num_bigint::BigUint;

/// Bands tried, in edges from the outline's corners; after them rhombi may lie anywhere.
const BANDS: [f64; 4] = [0.0, 1.0, 2.0, 4.0];

/// A tiling by triangles, squares and as few thin rhombi as there can be.
#[derive(Debug, Clone, PartialEq)]
pub struct WithRhombi {
    /// The tiles.
    pub tiling: Tiling,
    /// How many of them are rhombi; proven to be the fewest.
    pub rhombi: usize,
    /// The greatest distance of a rhombus's nearest corner from the nearest corner of the outline, in edges: 0 when all
    /// rhombi touch the outline, and when there are none.
    pub depth: f64,
}

/// A tiling of an outline with the fewest thin rhombi, none when it has a tiling without; `None` when no number of rhombi
/// helps. Another seed may give another tiling, with as many.
///
/// # Errors
/// [`TilingError::Memory`] when the states do not fit, [`TilingError::Cancelled`].
///
/// # Source
/// Peng et al. 2018, 6. Time and memory grow exponentially with the number of rhombi and with the width of the outline.
pub fn tile_with_rhombi(
    boundary: &Boundary,
    seed: u64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<WithRhombi>, TilingError> {
    let certificate = Certificate::new(boundary.directions());
    if !certificate.refutes() {
        if let Some(tiling) = find_tiling(boundary, seed, options, monitor)? {
            return Ok(Some(WithRhombi { tiling, rhombi: 0, depth: 0.0 }));
        }
    }
    // What is not triangles has the area of its squares and half as much for each rhombus.
    let most = 2 * certificate.square_count() + certificate.defect;
    let fewest = if certificate.defect == 0 { 2 } else { certificate.defect.abs() };
    for rhombi in (fewest..=most.min(i32::from(u16::MAX))).step_by(2) {
        if certificate.refutes_with_rhombi(rhombi) {
            continue;
        }
        for band in BANDS.into_iter().map(Some).chain([None]) {
            monitor.stage("rhombi", 0.0)?;
            let fence = band.map(|reach| Fence::new(boundary.points(), reach));
            let mut graph =
                Graph::<Cost>::rhombic(fence, sweep(boundary, &[Isometry::default()]), options.memory);
            let begun = graph.begin(&boundary.word(), rhombi as u16, &[Isometry::default()], monitor);
            let Some(root) = begun.map_err(never_overflows)? else { continue };
            let found = graph.evaluate(&root, monitor).map_err(never_overflows)?;
             if std::env::var("TRACE").is_ok() { eprintln!("  k {rhombi} band {band:?}: {} states, {found:?}", graph.states()); }
            if found.0.is_none_or(|found| found > i64::from(rhombi)) {
                continue;
            }
            if let Some(tiling) = Walk::new(graph, Some(root)).least(monitor)? {
                let depth = depth(&tiling, boundary);
                return Ok(Some(WithRhombi { rhombi: tiling.count(Kind::Rhombus), tiling, depth }));
            }
        }
    }
    Ok(None)
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
    let mut graph = Graph::<ByRhombi>::rhombic(None, sweep(boundary, &group), options.memory);
    let counted = graph.begin(&boundary.word(), highest as u16, &group, monitor).and_then(|root| match root {
        Some(root) => graph.evaluate(&root, monitor),
        None => Ok(crate::graph::Value::none()),
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
    rhombi.map(|tile| tile.corners().map(|corner| fence.distance(corner)).fold(f64::INFINITY, f64::min)).fold(0.0, f64::max)
}
