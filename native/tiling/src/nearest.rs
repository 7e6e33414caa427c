//! The lattice loop nearest to a drawn curve, by the paper's integer programme (section 3.4, eq. 9): the independent check of
//! `fit`.
//!
//! The loop runs along half-edges near the curve; the mean distances of these are minimised, and at each vertex as many
//! arrive as leave. Whether the loop can be tiled is not asked, so nothing that can lies nearer at the same placement.
//!
//! Deviations: of the vertices that must lie on the loop only the first is kept, since the plane's points lie dense and a
//! distance threshold would fix neighbours that no edge joins. What fixed vertices do in the paper, keeping the loop from
//! closing on one side, half-edges do here that must go forward along the curve, and a row that lets the loop go round it
//! once.

use crate::TilingError;
use crate::drawn::{Position, distance, nearest};
use crate::fit::Placement;
use crate::plane::{Direction, Point};
use mesh::Monitor;
use solve::SolveError;
use solve::integer::{Options as Limits, Programme, Term};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// How far forward along the curve a half-edge must go, and may, in edges.
const FORWARD: std::ops::Range<f64> = 0.2..1.8;

/// Distances are taken at the middles of this many parts of a half-edge.
const PARTS: usize = 4;

/// What [`nearest_loop_by_programme`] finds.
#[derive(Debug, Clone, PartialEq)]
pub struct NearestLoop {
    /// Corners, the first at the origin. The loop may touch itself.
    pub points: Vec<Point>,
    /// Direction of the half-edge that leaves each.
    pub directions: Vec<Direction>,
    /// Sum of the mean distances of its half-edges from the curve, in edges: what is least.
    pub cost: f64,
}

/// The loop of unit edges nearest to a closed curve, among those that run through `origin` with an edge at `rotation`, up
/// to multiples of 30 degrees, and keep within `reach` edge lengths of the curve; `None` when there is none.
///
/// # Errors
/// [`TilingError::Solver`] when `HiGHS` fails or its limits strike, [`TilingError::Cancelled`].
///
/// # Source
/// Peng et al. 2018, 3.4, with the deviations above. The number of half-edges grows with the cube of the curve's length and
/// with `reach`: some thousands for 20 edges. Use it to check.
pub fn nearest_loop_by_programme(
    curve: &[Position],
    origin: Position,
    rotation: f64,
    edge_length: f64,
    reach: f64,
    monitor: &Monitor,
) -> Result<Option<NearestLoop>, TilingError> {
    monitor.stage("edges", 0.0)?;
    let place = Placement { origin, rotation, edge_length };
    let mut local: Vec<Position> = curve.iter().map(|&p| place.back(p)).collect();
    if local.iter().zip(local.iter().cycle().skip(1)).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() < 0.0 {
        local.reverse();
    }
    let edges = half_edges(&local, reach, monitor)?;
    let mut programme = Programme::new();
    let variables: Vec<_> = edges.iter().map(|_| programme.variable(0..=1)).collect();
    let mut balance: BTreeMap<Point, Vec<Term>> = BTreeMap::new();
    let (mut first, mut round) = (Vec::new(), Vec::new());
    for (edge, &variable) in edges.iter().zip(&variables) {
        let cost = edge.cost;
        programme.convex_cost(&[(variable, 1)], move |on| cost * on as f64, 0..=1);
        balance.entry(edge.from).or_default().push((variable, 1));
        balance.entry(edge.from + Point::unit(edge.direction)).or_default().push((variable, -1));
        if edge.from == Point::ORIGIN {
            first.push((variable, 1));
        }
        if edge.passes_start {
            round.push((variable, 1));
        }
    }
    for terms in balance.values() {
        programme.row(terms, 0..=0);
    }
    programme.row(&first, 1..=1);
    programme.row(&round, 1..=1);
    let limits = Limits { max_nodes: u32::MAX, time_limit: Duration::from_secs(600), ..Limits::default() };
    monitor.stage("programme", 0.0)?;
    let solution = match programme.solve(&limits, None, &|| monitor.is_cancelled()) {
        Ok(solution) => solution,
        Err(SolveError::Infeasible { .. }) => return Ok(None),
        Err(SolveError::Cancelled) => return Err(mesh::Cancelled.into()),
        Err(error) => return Err(error.into()),
    };
    let on = |k: &usize| solution.values[variables[*k].index()] == 1;
    let leaving: BTreeMap<Point, Direction> =
        (0..variables.len()).filter(on).map(|k| (edges[k].from, edges[k].direction)).collect();
    let (mut points, mut directions) = (Vec::new(), Vec::new());
    let mut at = Point::ORIGIN;
    while let Some(&direction) = leaving.get(&at).filter(|_| at != Point::ORIGIN || points.is_empty()) {
        points.push(at);
        directions.push(direction);
        at = at + Point::unit(direction);
    }
    Ok(Some(NearestLoop { points, directions, cost: solution.cost }))
}

/// A place for a half-edge of the loop.
struct HalfEdge {
    from: Point,
    direction: Direction,
    /// Mean distance from the curve.
    cost: f64,
    /// Whether it passes the place on the curve where the loop begins.
    passes_start: bool,
}

/// The half-edges on loops round a counter-clockwise curve from the origin, which go forward and keep within `reach`.
fn half_edges(curve: &[Position], reach: f64, monitor: &Monitor) -> Result<Vec<HalfEdge>, TilingError> {
    let length: f64 = (0..curve.len()).map(|k| distance(curve[k], curve[(k + 1) % curve.len()])).sum();
    let start = nearest(curve, [0.0; 2]).1;
    // How far along the curve from the start, below its length.
    let along = |p: Point| (nearest(curve, p.position()).1 - start).rem_euclid(length);
    let mut reached: BTreeMap<Point, f64> = BTreeMap::from([(Point::ORIGIN, 0.0)]);
    let mut layer: Vec<Point> = vec![Point::ORIGIN];
    let mut all = Vec::new();
    while !layer.is_empty() {
        let mut next = Vec::new();
        for from in std::mem::take(&mut layer) {
            monitor.check()?;
            for direction in 0..12 {
                let to = from + Point::unit(direction);
                let closes = to == Point::ORIGIN;
                if !closes && nearest(curve, to.position()).0 > reach {
                    continue;
                }
                let (here, there) = (reached[&from], if closes { length } else { along(to) });
                let step = (there - here).rem_euclid(length);
                if closes && length - here > FORWARD.end || !closes && !FORWARD.contains(&step) {
                    continue;
                }
                let passes_start = closes || there < here;
                if passes_start && !closes {
                    // Beyond the start without meeting it: no loop that goes round once.
                    continue;
                }
                all.push(HalfEdge { from, direction, cost: mean_distance(from, to, curve), passes_start });
                if !closes && reached.insert(to, there).is_none() {
                    next.push(to);
                }
            }
        }
        layer = next;
    }
    // Only what leads back to the start.
    let mut back: BTreeMap<Point, Vec<Point>> = BTreeMap::new();
    for edge in &all {
        back.entry(edge.from + Point::unit(edge.direction)).or_default().push(edge.from);
    }
    let mut useful = BTreeSet::new();
    let mut open = vec![Point::ORIGIN];
    while let Some(to) = open.pop() {
        for &from in back.get(&to).into_iter().flatten() {
            if useful.insert(from) {
                open.push(from);
            }
        }
    }
    all.retain(|edge| {
        let to = edge.from + Point::unit(edge.direction);
        useful.contains(&edge.from) && (to == Point::ORIGIN || useful.contains(&to))
    });
    Ok(all)
}

/// Of a half-edge from a curve.
fn mean_distance(from: Point, to: Point, curve: &[Position]) -> f64 {
    let ([a, b], [c, d]) = (from.position(), to.position());
    let at = |k: usize| (k as f64 + 0.5) / PARTS as f64;
    let sum: f64 = (0..PARTS).map(|k| nearest(curve, [a + at(k) * (c - a), b + at(k) * (d - b)]).0).sum();
    sum / PARTS as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Boundary, Certificate, FitOptions, fit_boundary};
    use std::f64::consts::TAU;

    fn curve(radius: impl Fn(f64) -> f64) -> Vec<Position> {
        let angle = |k: u32| TAU * f64::from(k) / 120.0;
        (0..120).map(|k| [radius(angle(k)) * angle(k).cos(), radius(angle(k)) * angle(k).sin()]).collect()
    }

    /// The programme's loop is as near as the fit, or nearer, where both begin at the same place; it closes; and it is no
    /// outline that can be tiled, or seldom, which is why the fit does not use it.
    #[test]
    fn no_loop_is_nearer_than_the_programmes() {
        let monitor = Monitor::new();
        let mut refuted = 0;
        for (name, curve) in [
            ("circle", curve(|_| 3.2)),
            ("star", curve(|a| 3.4 + 0.6 * (5.0 * a).cos())),
            ("egg", curve(|a| 3.0 + 0.5 * a.cos())),
        ] {
            let fit = fit_boundary(&curve, 1.0, &FitOptions::default(), &monitor).unwrap();
            let place = Placement { origin: fit.origin, rotation: fit.rotation, edge_length: 1.0 };
            let local: Vec<Position> = curve.iter().map(|&p| place.back(p)).collect();
            let points = fit.boundary.points();
            let cost: f64 =
                (0..points.len()).map(|k| mean_distance(points[k], points[(k + 1) % points.len()], &local)).sum();
            let reach = fit.greatest_distance + 1e-6;
            let found = nearest_loop_by_programme(&curve, fit.origin, fit.rotation, 1.0, reach, &monitor);
            let found = found.unwrap().unwrap();
            assert!(found.cost <= cost + 1e-9, "{name}: {} against {cost}", found.cost);
            let n = found.points.len();
            let end = found.points[n - 1] + Point::unit(found.directions[n - 1]);
            assert_eq!(end, Point::ORIGIN);
            let again: f64 = (0..n).map(|k| mean_distance(found.points[k], found.points[(k + 1) % n], &local)).sum();
            assert!((again - found.cost).abs() < 1e-6);
            let code: Vec<u8> =
                (0..n).map(|k| (found.directions[(k + n - 1) % n] + 18 - found.directions[k]) % 12).collect();
            let can = Boundary::new(&code).is_ok_and(|outline| !Certificate::new(outline.directions()).refutes());
            refuted += usize::from(!can);
            println!(
                "{name}: eq. 9 {n} edges, mean distance {:.3}; fit {} edges, {:.3}; eq. 9 {}",
                found.cost / n as f64,
                points.len(),
                cost / points.len() as f64,
                if can { "may be tiled" } else { "cannot be tiled" }
            );
        }
        assert!(refuted > 0);
    }
}
