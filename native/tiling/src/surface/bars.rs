//! Shaping until panels can be built (section 4.2.4): where edges are too unequal or quads too bent with the weights that serve most
//! surfaces, other weights are tried, and the mesh nearest to the bars is taken.
//!
//! Regularity comes first in the weights of [`ShapeOptions`], for it is what most surfaces have room for. A coarse mesh of a surface
//! that curves as a saddle has not: its squares are bent by a part of their diagonal that grows with their size. Then flatness
//! matters more, and the vertices leave the surface a little for it, for which there is room within the bar of closeness. Squares
//! along the straight lines of a saddle no weight can flatten; [`super::SurfaceTiling::flaws`] sets patch graphs with such behind others.
//!
//! Weights that the caller set are the caller's wish and stay.

use super::curve::Curve;
use super::panels::planarity;
use super::pattern::Pattern;
use super::shape::{ShapeOptions, shape};
use super::{SurfaceError, spread};
use mesh::{DVec3, Monitor, TriangleMesh};

/// Patches whose panels are more unequal than this (the spread of their edges) are no patches to build: the surface is not flat enough in
/// them.
pub(super) const MOST_SPREAD: f64 = 0.2;

/// Mean planarity of quads above which they are too bent to be cut from sheets.
pub(super) const MOST_BENT: f64 = 0.02;

/// Distance of a vertex from the surface, in diagonals of the mesh, above which the mesh shows another shape.
const MOST_DISTANCE: f64 = 0.03;

/// The weight of equal edges where without it they are too unequal: then they matter more than angles. More of it moves panels off the
/// surface and gains little (a torus of 500 squares: spread 20.1% without, 18.9% with 0.3, 18.7% with 1, closeness 0.6% and 0.95%).
const EVEN: f64 = 0.5;

/// The weights of planarity tried one after another where quads are too bent, and the rounds they take to have their effect: the
/// stiffer, the slower.
const FLAT: [(f64, usize); 3] = [(40.0, 60), (80.0, 120), (120.0, 160)];

/// What was measured of a shaped mesh, each in bars: 1 is just allowed.
struct Measures {
    spread: f64,
    bent: f64,
    distance: f64,
}

impl Measures {
    fn of(pattern: &Pattern, farthest: f64) -> Self {
        let Pattern { positions, tiles, .. } = pattern;
        let lengths = tiles.iter().flat_map(|tile| {
            (0..tile.len()).map(|k| [tile[k], tile[(k + 1) % tile.len()]].map(|v| positions[v as usize]))
        });
        let quads = tiles.iter().filter(|tile| tile.len() == 4);
        let bent: f64 = quads.clone().map(|tile| planarity([0, 1, 2, 3].map(|k| positions[tile[k] as usize]))).sum();
        let low = positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
        Self {
            spread: spread(lengths.map(|[a, b]| a.distance(b))) / MOST_SPREAD,
            bent: bent / quads.count().max(1) as f64 / MOST_BENT,
            distance: farthest / low.distance(high).max(f64::MIN_POSITIVE) / MOST_DISTANCE,
        }
    }

    /// What is above the bars, 0 where nothing is.
    fn excess(&self) -> f64 {
        [self.spread, self.bent, self.distance].into_iter().map(|measure| (measure - 1.0).max(0.0)).sum()
    }
}

/// Puts the pattern on the surface and shapes it with the weights asked for, and with others where these leave it above a bar; the tiles
/// that are turned over in the end.
pub(super) fn shape_to_bars(
    surface: &TriangleMesh,
    curves: &[Curve],
    pattern: &mut Pattern,
    options: ShapeOptions,
    monitor: &Monitor,
) -> Result<Vec<u32>, SurfaceError> {
    let laid = pattern.positions.clone();
    let first = shape(surface, curves, pattern, options, monitor)?;
    let mut best = Measures::of(pattern, first.farthest);
    if !first.turned.is_empty() || best.excess() <= 0.0 {
        return Ok(first.turned);
    }
    // Shapes once more and keeps what is nearer to the bars.
    let again = |pattern: &mut Pattern, best: &mut Measures, from: Option<&[DVec3]>, options| {
        let before = pattern.positions.clone();
        if let Some(from) = from {
            pattern.positions.copy_from_slice(from);
        }
        let shaped = shape(surface, curves, pattern, options, monitor)?;
        let measures = Measures::of(pattern, shaped.farthest);
        let is_better = shaped.turned.is_empty() && measures.excess() < best.excess();
        if is_better {
            *best = measures;
        } else {
            pattern.positions = before;
        }
        Ok::<bool, SurfaceError>(is_better)
    };
    let default = ShapeOptions::default();
    let mut weights = options;
    if best.spread > 1.0 && options.uniformity == 0.0 {
        let even = ShapeOptions { uniformity: EVEN, ..options };
        if again(pattern, &mut best, Some(&laid), even)? {
            weights = even;
        }
    }
    let chosen = [options.planarity, options.closeness].map(f64::to_bits);
    if options.flattening_rounds > 0 && chosen == [default.planarity, default.closeness].map(f64::to_bits) {
        for (planarity, flattening_rounds) in FLAT {
            if best.bent <= 1.0 {
                break;
            }
            let flat = ShapeOptions { rounds: 0, flattening_rounds, planarity, ..weights };
            again(pattern, &mut best, None, flat)?;
        }
    }
    Ok(Vec::new())
}
