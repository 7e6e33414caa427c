//! The outline of a tileable region near a drawn curve (section 3.4).
//!
//! Deviation: the paper finds the lattice loop nearest to the curve by an integer programme (eq. 9). Nearly all such
//! loops admit no tiling: [`crate::Certificate`] alone refutes more than 95 of 100. Here the outline is cut from a tiling
//! of the plane first: the tiles whose centres lie inside the curve, as far as they make a disk. It is tileable by
//! construction and nowhere much farther from the curve than a tile's radius. Of many placements of many tilings the one
//! nearest to the curve is taken; from it a search (`approach`) goes on to nearer loops that have tilings too.

use crate::TilingError;
use crate::approach::{Loop, approach};
use crate::boundary::Boundary;
use crate::drawn::{Position, contains, distance, greatest_distance, mean_square, middle, segments, to_curve};
use crate::inflate::plane_tiling;
use crate::plane::{Direction, Isometry, Point};
use crate::random::Random;
use crate::tile::{Tile, Tiling};
use mesh::{Cancelled, Monitor};
use rayon::prelude::*;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::FRAC_PI_6;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Placements tried with each tiling: tilings are dear, placements cheap.
const PLACEMENTS: usize = 12;

/// How far a placement may shift a tiling along each axis, in edges.
const SHIFT: f64 = 4.0;

/// Options of [`fit_boundary`]. `Default` gives the recommended values.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Angle between the curve's x axis and the outline's edges, up to multiples of 30 degrees, in radians. Default: the
    /// best that is found.
    pub rotation: Option<f64>,
    /// Placements tried, 1 to 100,000. Default 96; the time grows in proportion.
    pub tries: usize,
    /// Another seed tries other tilings and placements. Default 0.
    pub seed: u64,
    /// Most loops looked at in the search for a nearer outline that has a tiling too; 0 takes the outline as it was cut,
    /// which keeps what symmetry it has. Default 4000.
    pub loops: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { rotation: None, tries: 96, seed: 0, loops: 4000 }
    }
}

/// An outline near a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The outline. It can be tiled.
    pub boundary: Boundary,
    /// One tiling of it, that it was cut from: there is one even where the search for another takes too long.
    pub tiling: Tiling,
    /// Where its first corner lies.
    pub origin: Position,
    /// Direction of its first edge, in radians.
    pub rotation: f64,
    /// Length of its edges, as given.
    pub edge_length: f64,
    /// Greatest distance from a point of either curve to the other curve, in edge lengths.
    pub greatest_distance: f64,
    /// Mean distance from the outline's corners to the curve, in edge lengths.
    pub mean_distance: f64,
}

impl Fit {
    /// The outline's corners in the plane of the curve.
    pub fn positions(&self) -> Vec<Position> {
        let place = Placement { origin: self.origin, rotation: self.rotation, edge_length: self.edge_length };
        self.boundary.points().iter().map(|point| place.out(point.position())).collect()
    }
}

/// From the plane of a tiling to that of the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    pub(crate) origin: Position,
    pub(crate) rotation: f64,
    pub(crate) edge_length: f64,
}

impl Placement {
    fn out(&self, [x, y]: Position) -> Position {
        let (sin, cos) = self.rotation.sin_cos();
        let scale = self.edge_length;
        [self.origin[0] + scale * (cos * x - sin * y), self.origin[1] + scale * (sin * x + cos * y)]
    }

    /// The inverse of `out`.
    pub(crate) fn back(&self, [x, y]: Position) -> Position {
        let (sin, cos) = self.rotation.sin_cos();
        let (x, y) = ((x - self.origin[0]) / self.edge_length, (y - self.origin[1]) / self.edge_length);
        [cos * x + sin * y, cos * y - sin * x]
    }
}

/// The outline of a tileable region near a closed curve, given by the corners of a polygon in either sense.
///
/// `edge_length` is that of the tiles, in the curve's units. The curve should not cross itself; where it does, what lies
/// inside is what an odd number of windings encloses.
///
/// # Errors
/// [`TilingError::Option`] when the curve has less than 3 points, a coordinate is not finite, the edge length is not
/// positive, or the curve is too small for a tile or longer than 1,000 edges; [`TilingError::Cancelled`].
///
/// # Source
/// Peng et al. 2018, 3.4, with the deviation above. Costs O(tries * area * points) with the area in tiles, and O(loops *
/// length * points).
pub fn fit_boundary(
    curve: &[Position],
    edge_length: f64,
    options: &FitOptions,
    monitor: &Monitor,
) -> Result<Fit, TilingError> {
    let refuse = |sentence: &str| Err(TilingError::Option(sentence.to_owned()));
    if curve.len() < 3 || curve.iter().flatten().any(|x| !x.is_finite()) {
        return refuse("the curve needs at least 3 points with finite coordinates");
    }
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return refuse("the edge length must be a positive number");
    }
    if !(1..=100_000).contains(&options.tries)
        || options.loops > 1_000_000
        || options.rotation.is_some_and(|angle| !angle.is_finite())
    {
        return refuse("tries must be 1 to 100,000, loops at most 1,000,000, and the rotation a finite number");
    }
    let length: f64 = segments(curve).map(|[a, b]| distance(a, b)).sum();
    if length > 1000.0 * edge_length {
        return refuse("the curve is longer than 1,000 edges; choose longer edges");
    }
    let middle = middle(curve);
    let radius = curve.iter().map(|&p| distance(p, middle)).fold(0.0, f64::max) / edge_length;
    let drawn = Drawn { curve, middle, radius, edge_length, options };
    monitor.stage("fit", 0.0)?;
    // A seed for each tiling, so that they can be made side by side.
    let mut random = Random::new(options.seed);
    let seeds: Vec<u64> = (0..options.tries.div_ceil(PLACEMENTS)).map(|_| random.bits()).collect();
    let done = AtomicUsize::new(0);
    let best_of = |(round, &seed): (usize, &u64)| {
        let best = drawn.best_cut(round, seed, monitor);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        monitor.stage("fit", done as f64 / seeds.len() as f64)?;
        best
    };
    let cuts = seeds.par_iter().enumerate().map(best_of).collect::<Result<Vec<_>, Cancelled>>()?;
    // The first of the nearest, whatever was done first.
    let Some(best) = cuts.into_iter().flatten().min_by(|a, b| a.error.total_cmp(&b.error)) else {
        return refuse("no tile fits into the curve; choose shorter edges");
    };
    let (place, mut outline, mut tiling) = (best.place, best.outline, best.tiling);
    let local: Vec<Position> = curve.iter().map(|&p| place.back(p)).collect();
    if let Some(nearer) = approach(&local, &outline, options.loops, monitor)? {
        (outline, tiling) = nearer;
    }
    let positions: Vec<Position> = outline.points().iter().map(|p| p.position()).collect();
    Ok(Fit {
        boundary: Boundary::new(&outline.code())?,
        tiling,
        origin: place.out(outline.first.position()),
        rotation: (place.rotation + f64::from(outline.directions[0]) * FRAC_PI_6).rem_euclid(std::f64::consts::TAU),
        edge_length,
        greatest_distance: greatest_distance(&positions, &local),
        mean_distance: positions.iter().map(|&p| to_curve(p, &local)).sum::<f64>() / positions.len() as f64,
    })
}

/// What is fitted.
struct Drawn<'a> {
    curve: &'a [Position],
    middle: Position,
    /// Of the curve about its middle, in edges.
    radius: f64,
    edge_length: f64,
    options: &'a FitOptions,
}

/// An outline cut from a tiling.
struct CutOut {
    error: f64,
    place: Placement,
    outline: Loop,
    tiling: Tiling,
}

impl Drawn<'_> {
    /// The nearest outline of a round of placements of one tiling.
    fn best_cut(&self, round: usize, seed: u64, monitor: &Monitor) -> Result<Option<CutOut>, Cancelled> {
        // The first tiling is symmetric about its middle, for the sake of symmetric curves.
        let centred = round == 0;
        let mut random = Random::new(seed);
        let size = self.radius + SHIFT * std::f64::consts::SQRT_2 + 2.0;
        let patch = Patch::new(&plane_tiling(size, (!centred).then_some(&mut random), monitor)?, monitor)?;
        let mut best: Option<CutOut> = None;
        for attempt in 0..PLACEMENTS.min(self.options.tries - round * PLACEMENTS) {
            let searched = if centred { attempt as f64 / PLACEMENTS as f64 } else { random.unit() };
            let rotation = self.options.rotation.unwrap_or(searched * FRAC_PI_6);
            let mut shift = || if centred { 0.0 } else { SHIFT * (2.0 * random.unit() - 1.0) };
            let place = Placement { origin: [0.0; 2], rotation, edge_length: self.edge_length };
            let origin = place.out([shift(), shift()]);
            let place = Placement { origin: [self.middle[0] + origin[0], self.middle[1] + origin[1]], ..place };
            let local: Vec<Position> = self.curve.iter().map(|&p| place.back(p)).collect();
            let Some((corners, taken)) = cut(&patch, &local, monitor)? else { continue };
            let positions: Vec<Position> = corners.iter().map(|(p, _)| p.position()).collect();
            let error = mean_square(&positions, &local);
            if best.as_ref().is_none_or(|least| error < least.error) {
                let (first, towards) = corners[0];
                let outline = Loop { first, directions: corners.iter().map(|&(_, direction)| direction).collect() };
                best = Some(CutOut { error, place, outline, tiling: patch.tiling(&taken, first, towards) });
            }
        }
        Ok(best)
    }
}

/// A tiling of a part of the plane, ready to be cut.
struct Patch {
    tiles: Vec<Tile>,
    corners: Vec<Vec<Point>>,
    centres: Vec<Position>,
    /// The tile on the left of each edge.
    at_edge: BTreeMap<(Point, Point), usize>,
}

impl Patch {
    fn new(tiling: &[Tile], monitor: &Monitor) -> Result<Self, Cancelled> {
        let mut patch =
            Self { tiles: tiling.to_vec(), corners: Vec::new(), centres: Vec::new(), at_edge: BTreeMap::new() };
        for (at, tile) in tiling.iter().enumerate() {
            monitor.check()?;
            let corners: Vec<Point> = tile.corners().collect();
            let n = corners.len();
            let sum = corners.iter().map(|p| p.position()).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
            patch.centres.push(sum.map(|x| x / n as f64));
            patch.at_edge.extend((0..n).map(|k| ((corners[k], corners[(k + 1) % n]), at)));
            patch.corners.push(corners);
        }
        Ok(patch)
    }

    /// The tiles taken, moved so that the edge that leaves `first` `towards` there becomes the first edge of a boundary.
    fn tiling(&self, taken: &[bool], first: Point, towards: Direction) -> Tiling {
        let turn = Isometry { turn: (12 - towards) % 12, ..Isometry::default() };
        let home = turn.after(Isometry::shift(Point::default() - first));
        let tiles = self.tiles.iter().zip(taken).filter(|(_, taken)| **taken);
        Tiling { tiles: tiles.map(|(tile, _)| tile.mapped(home)).collect() }
    }
}

/// A region's border, as corners and the directions of the edges that leave them, and which tiles are in it.
type Cut = (Vec<(Point, Direction)>, Vec<bool>);

/// The outline of the tiles whose centres lie inside a curve, as far as they make a disk. Grown from the middle outwards, each tile meeting the disk in one piece of its border; then
/// tiles that stick out or are missing between their neighbours change sides when their centres are near the curve.
fn cut(patch: &Patch, curve: &[Position], monitor: &Monitor) -> Result<Option<Cut>, Cancelled> {
    // In edges: how near the curve a centre must be for its tile to change sides.
    const NEAR: f64 = 0.3;
    let middle = middle(curve);
    // Whole numbers order the growth the same way on every machine.
    let order = |at: usize| std::cmp::Reverse((1e6 * distance(patch.centres[at], middle)) as u64);
    let is_inside = |&centre: &Position| monitor.check().map(|()| contains(curve, centre));
    let inside = patch.centres.iter().map(is_inside).collect::<Result<Vec<bool>, Cancelled>>()?;
    let Some(first) = (0..inside.len()).filter(|&at| inside[at]).max_by_key(|&at| order(at)) else { return Ok(None) };
    // The border of the disk: each corner with the next.
    let edges = |at: usize| {
        let corners = &patch.corners[at];
        (0..corners.len()).map(move |k| (corners[k], corners[(k + 1) % corners.len()]))
    };
    let mut next: BTreeMap<Point, Point> = edges(first).collect();
    let mut taken = vec![false; inside.len()];
    taken[first] = true;
    let beyond = |at: usize| edges(at).filter_map(|(a, b)| patch.at_edge.get(&(b, a)).copied());
    let mut queue: BinaryHeap<_> = beyond(first).map(|other| (order(other), other)).collect();
    while let Some((_, at)) = queue.pop() {
        if inside[at] && !taken[at] && grow(&mut next, &patch.corners[at]) {
            taken[at] = true;
            // Among these are tiles that were refused, and may fit now.
            queue.extend(beyond(at).map(|other| (order(other), other)));
        }
    }
    let border: Vec<(Point, Point)> = next.iter().map(|(&a, &b)| (a, b)).collect();
    for (a, b) in border {
        let near = |at: usize| to_curve(patch.centres[at], curve) < NEAR;
        if let Some(&at) = patch.at_edge.get(&(a, b)).filter(|&&at| taken[at] && near(at)) {
            taken[at] = !shrink(&mut next, &patch.corners[at]);
        }
        if let Some(&at) = patch.at_edge.get(&(b, a)).filter(|&&at| !taken[at] && near(at)) {
            let shared = edges(at).filter(|(a, b)| next.get(b) == Some(a)).count();
            taken[at] = shared + 1 == patch.corners[at].len() && grow(&mut next, &patch.corners[at]);
        }
    }
    Ok(walk(&next).map(|corners| (corners, taken)))
}

/// A border from its least corner: corners and the directions of the edges that leave them.
fn walk(next: &BTreeMap<Point, Point>) -> Option<Vec<(Point, Direction)>> {
    let &start = next.keys().next()?;
    let mut corners = vec![start];
    while let Some(&p) = next.get(corners.last()?).filter(|&&p| p != start) {
        corners.push(p);
    }
    let n = corners.len();
    let towards = |k: usize| (0..12).find(|&d| corners[k] + Point::unit(d) == corners[(k + 1) % n]);
    (0..n).map(|k| Some((corners[k], towards(k)?))).collect()
}

/// Takes a tile from a disk when all its edges but one are on the disk's border.
fn shrink(next: &mut BTreeMap<Point, Point>, corners: &[Point]) -> bool {
    let n = corners.len();
    let mut inner = (0..n).filter(|&k| next.get(&corners[k]) != Some(&corners[(k + 1) % n]));
    let (Some(k), None) = (inner.next(), inner.next()) else { return false };
    for other in (0..n).filter(|&other| other != k) {
        next.remove(&corners[other]);
    }
    // The border now runs along the edge that was inside, with the disk on the other side of it.
    next.insert(corners[(k + 1) % n], corners[k]);
    true
}

/// Adds a tile to a disk when it meets the disk's border in one run of edges and nowhere else.
fn grow(next: &mut BTreeMap<Point, Point>, corners: &[Point]) -> bool {
    let n = corners.len();
    let shared: Vec<bool> = (0..n).map(|k| next.get(&corners[(k + 1) % n]) == Some(&corners[k])).collect();
    let runs = (0..n).filter(|&k| shared[k] && !shared[(k + n - 1) % n]).count();
    // A corner between two edges that are not shared must not lie on the border.
    let touches = (0..n).any(|k| !shared[k] && !shared[(k + n - 1) % n] && next.contains_key(&corners[k]));
    if runs != 1 || touches {
        return false;
    }
    for k in (0..n).filter(|&k| shared[k]) {
        next.remove(&corners[(k + 1) % n]);
    }
    for k in (0..n).filter(|&k| !shared[k]) {
        next.insert(corners[k], corners[(k + 1) % n]);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, Tilings};
    use std::collections::BTreeSet;
    use std::f64::consts::TAU;

    fn polar(radius: impl Fn(f64) -> f64, stretch: f64) -> Vec<Position> {
        (0..240)
            .map(|k| {
                let angle = TAU * f64::from(k) / 240.0;
                let r = radius(angle);
                [stretch * r * angle.cos(), r * angle.sin()]
            })
            .collect()
    }

    fn rounded_rectangle(width: f64, height: f64, corner: f64) -> Vec<Position> {
        (0..240)
            .map(|k| {
                let angle = TAU * (f64::from(k) + 0.5) / 240.0;
                let (sin, cos) = angle.sin_cos();
                [
                    cos.signum() * (width / 2.0 - corner) + corner * cos,
                    sin.signum() * (height / 2.0 - corner) + corner * sin,
                ]
            })
            .collect()
    }

    /// The ten outlines of the bars, with edges of length 1.
    fn drawn() -> Vec<(&'static str, Vec<Position>)> {
        vec![
            ("circle", polar(|_| 7.0, 1.0)),
            ("ellipse", polar(|_| 5.0, 1.8)),
            ("stadium", rounded_rectangle(22.0, 10.0, 5.0)),
            ("L", vec![[0.0, 0.0], [14.0, 0.0], [14.0, 6.0], [6.0, 6.0], [6.0, 14.0], [0.0, 14.0]]),
            ("star", polar(|a| 8.0 + 2.5 * (5.0 * a).cos(), 1.0)),
            ("kidney", polar(|a| 7.0 + 3.0 * a.cos() - 1.5 * (2.0 * a).cos(), 1.0)),
            ("rounded rectangle", rounded_rectangle(16.0, 11.0, 3.0)),
            ("leaf", polar(|a| 4.0 + 6.0 * a.cos().powi(2), 1.0)),
            ("tower", polar(|a| 13.0 + 1.5 * (4.0 * a).cos(), 1.0)),
            ("sports stadium", polar(|_| 8.5, 1.25)),
        ]
    }

    /// The edges of a polygon.
    fn around(corners: impl Iterator<Item = Point>) -> Vec<(Point, Point)> {
        let corners: Vec<Point> = corners.collect();
        (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()])).collect()
    }

    #[test]
    fn the_drawn_outlines_are_fitted_within_an_edge_and_can_be_tiled() {
        let monitor = Monitor::new();
        let mut nearer = 0;
        for (name, curve) in drawn() {
            let options = FitOptions { tries: 36, ..FitOptions::default() };
            let cut = fit_boundary(&curve, 1.0, &FitOptions { loops: 0, ..options.clone() }, &monitor).unwrap();
            let fit = fit_boundary(&curve, 1.0, &options, &monitor).unwrap();
            nearer += usize::from(mean_square(&fit.positions(), &curve) < mean_square(&cut.positions(), &curve));
            assert!(fit.greatest_distance < 1.0, "{name}: {}", fit.greatest_distance);
            let tiling = crate::find_tiling(&fit.boundary, 1, &Options::default(), &monitor).unwrap();
            assert!(tiling.is_some(), "{name}");
            // No two tiles of its tiling share a side of an edge, and the edges with one tile are the outline's.
            let edges: BTreeSet<(Point, Point)> =
                fit.tiling.tiles.iter().flat_map(|tile| around(tile.corners())).collect();
            assert_eq!(edges.len(), fit.tiling.tiles.iter().map(|tile| tile.kind.corners()).sum::<usize>(), "{name}");
            let single: BTreeSet<_> = edges.iter().copied().filter(|&(a, b)| !edges.contains(&(b, a))).collect();
            assert_eq!(single, around(fit.boundary.points().iter().copied()).into_iter().collect(), "{name}");
            // What is reported, measured again on the corners alone.
            let corners = fit.positions();
            assert!(corners.iter().all(|&p| to_curve(p, &curve) < fit.greatest_distance + 1e-9));
            let area = |p: &[Position]| segments(p).map(|[a, b]| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum::<f64>();
            assert!((area(&corners) / area(&curve) - 1.0).abs() < 0.06, "{name}");
            println!(
                "{name}: {} edges, {:.2} at most, {:.2} in the mean (as cut {:.2})",
                corners.len(),
                fit.greatest_distance,
                fit.mean_distance,
                cut.mean_distance
            );
        }
        // The search takes the distance along the lines, this the corners'.
        assert!(nearer >= 8, "{nearer} of 10");
    }

    /// A symmetric tiling is tried in the middle of the curve.
    #[test]
    fn a_circle_can_get_a_symmetric_outline() {
        let options = FitOptions { tries: 12, loops: 0, ..FitOptions::default() };
        let fit = fit_boundary(&polar(|_| 7.0, 1.0), 1.0, &options, &Monitor::new()).unwrap();
        assert_eq!(fit.boundary.symmetries().len(), 12);
    }

    #[test]
    fn a_fit_follows_its_curve_when_it_is_moved_and_scaled() {
        let monitor = Monitor::new();
        let curve = polar(|a| 5.0 + (3.0 * a).cos(), 1.0);
        let fit = fit_boundary(&curve, 1.0, &FitOptions::default(), &monitor).unwrap();
        let moved: Vec<Position> = curve.iter().rev().map(|[x, y]| [3.0 * x + 100.0, 3.0 * y - 50.0]).collect();
        let other = fit_boundary(&moved, 3.0, &FitOptions::default(), &monitor).unwrap();
        assert_eq!(other.boundary.code(), fit.boundary.code());
        for ([x, y], [u, v]) in fit.positions().into_iter().zip(other.positions()) {
            assert!((3.0 * x + 100.0 - u).abs() < 1e-6 && (3.0 * y - 50.0 - v).abs() < 1e-6);
        }
        let turned = FitOptions { rotation: Some(0.2), ..FitOptions::default() };
        let fit = fit_boundary(&curve, 1.0, &turned, &monitor).unwrap();
        assert!(((fit.rotation - 0.2) / FRAC_PI_6).fract().abs() < 1e-9);
    }

    #[test]
    fn bad_curves_are_refused() {
        let monitor = Monitor::new();
        let fit = |curve: &[Position], edge| fit_boundary(curve, edge, &FitOptions::default(), &monitor);
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for (curve, edge) in
            [(&square[..2], 1.0), (&square, 0.0), (&square, f64::NAN), (&square, 1e-5), (&square, 50.0)]
        {
            assert!(matches!(fit(curve, edge), Err(TilingError::Option(_))));
        }
        assert!(matches!(fit(&[[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]], 1.0), Err(TilingError::Option(_))));
        let tilings = Tilings::new(&fit(&square, 0.5).unwrap().boundary, &Options::default(), &monitor).unwrap();
        assert!(tilings.count() > &0u32.into());
    }
}
