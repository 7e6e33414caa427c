//! The paper's own route to tilings, kept as an independent check: an integer programme picks edges among those possible
//! (section 3.3.2, eq. 7 and 8), and each tiling found is banned before the next is sought (3.3.3).
//!
//! It shares nothing with the state graph but the outline. Deviation: none in the programme; the signs of eq. 7 and of
//! the last row of eq. 8 are those that their explanation asks for.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::paths::{Edge, edge, possible_edges};
use crate::plane::{Direction, Point};
use crate::tile::{Kind, Tile, Tiling};
use mesh::Monitor;
use solve::SolveError;
use solve::integer::{Options as Limits, Programme, Term, Variable};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Up to `most` tilings of an outline, by the integer programme of the paper. Far slower than [`crate::Tilings`]: use it
/// to check.
///
/// # Errors
/// [`TilingError::Solver`] when `HiGHS` fails or its limits strike, [`TilingError::Cancelled`].
///
/// # Source
/// Peng et al. 2018, 3.3.1 to 3.3.3. The programme has some hundred variables for 20 edges of outline; each tiling costs
/// a solve.
pub fn tilings_by_programme(boundary: &Boundary, most: usize, monitor: &Monitor) -> Result<Vec<Tiling>, TilingError> {
    monitor.stage("edges", 0.0)?;
    let corners = boundary.points();
    let outline: Vec<Edge> = (0..corners.len()).map(|k| edge(corners[k], boundary.directions()[k])).collect();
    let inner = possible_edges(boundary, monitor)?;
    let mut programme = Programme::new();
    // E_i: the outline's edges are there.
    let mut edges: BTreeMap<Edge, Variable> = BTreeMap::new();
    edges.extend(outline.iter().map(|&edge| (edge, programme.variable(1..=1))));
    edges.extend(inner.iter().map(|&edge| (edge, programme.variable(0..=1))));
    let mut around: BTreeMap<Point, BTreeMap<Direction, Variable>> = BTreeMap::new();
    for (&(from, direction), &variable) in &edges {
        around.entry(from).or_default().insert(direction, variable);
        around.entry(from + Point::unit(direction)).or_default().insert(direction + 6, variable);
    }
    let at_corner: BTreeMap<Point, usize> = corners.iter().copied().zip(0..).collect();
    for (vertex, leaving) in &around {
        let corner = at_corner.get(vertex).map(|&k| (boundary.directions()[k], boundary.code()[k]));
        let present = configure(&mut programme, leaving, corner);
        programme.row(&present, if corner.is_some() { 1..=1 } else { 0..=1 });
        for &there in leaving.values() {
            // No edge ends at a vertex without configuration.
            let dangling: Vec<Term> = present.iter().map(|&(c, _)| (c, -1)).chain([(there, 1)]).collect();
            programme.row(&dangling, ..=0);
        }
    }
    let limits = Limits { max_nodes: u32::MAX, time_limit: Duration::from_secs(600), ..Limits::default() };
    let mut found = Vec::new();
    while found.len() < most {
        monitor.stage("programme", found.len() as f64 / most as f64)?;
        let solution = match programme.solve(&limits, None, &|| monitor.is_cancelled()) {
            Ok(solution) => solution,
            Err(SolveError::Infeasible { .. }) => break,
            Err(SolveError::Cancelled) => return Err(mesh::Cancelled.into()),
            Err(error) => return Err(error.into()),
        };
        let is_there = |variable: &Variable| solution.values[variable.index()] == 1;
        let present: BTreeSet<Edge> = edges.iter().filter(|(_, v)| is_there(v)).map(|(&edge, _)| edge).collect();
        // Ban it: at least one edge must differ.
        let ban: Vec<Term> = edges.values().map(|&v| (v, if is_there(&v) { 1 } else { -1 })).collect();
        programme.row(&ban, ..present.len() as i64);
        found.push(to_tiling(&present, &at_corner, boundary));
    }
    Ok(found)
}

/// Adds the variables `C_jm` of one vertex with eq. 7: a configuration is on exactly when its edges are there and no
/// others. `corner` gives the leaving direction and the angle at a corner of the outline.
fn configure(
    programme: &mut Programme<'_>,
    leaving: &BTreeMap<Direction, Variable>,
    corner: Option<(Direction, u8)>,
) -> Vec<Term> {
    let mut configurations: BTreeSet<BTreeSet<Direction>> = BTreeSet::new();
    match corner {
        Some((first, angle)) => fill(first, angle, &mut vec![first], &mut configurations),
        None => (0..12).for_each(|first| fill(first, 12, &mut vec![first], &mut configurations)),
    }
    let count = leaving.len() as i32;
    let mut present = Vec::new();
    for directions in configurations {
        if !directions.iter().all(|direction| leaving.contains_key(direction)) {
            continue;
        }
        let on = programme.variable(0..=1);
        present.push((on, 1));
        // Edges as they should be, less N if on, lies in 0 to N - 1.
        let mut matches = vec![(on, -count)];
        matches.extend(leaving.iter().map(|(d, &e)| (e, if directions.contains(d) { 1 } else { -1 })));
        let absent = i64::from(count) - directions.len() as i64;
        programme.row(&matches, -absent..i64::from(count) - absent);
    }
    present
}

/// The sets of directions of edges between which triangles and squares fill an angle from `at`.
fn fill(at: Direction, angle: u8, edges: &mut Vec<Direction>, found: &mut BTreeSet<BTreeSet<Direction>>) {
    if angle == 0 {
        found.insert(edges.iter().copied().collect());
        return;
    }
    for kind in Kind::REGULAR {
        if angle >= kind.angle() {
            let next = (at + kind.angle()) % 12;
            edges.push(next);
            fill(next, angle - kind.angle(), edges, found);
            edges.pop();
        }
    }
}

/// The faces between edges: wherever two neighbouring edges at a vertex make 60 or 90 degrees inside the outline.
fn to_tiling(edges: &BTreeSet<Edge>, at_corner: &BTreeMap<Point, usize>, boundary: &Boundary) -> Tiling {
    let mut leaving: BTreeMap<Point, BTreeSet<Direction>> = BTreeMap::new();
    for &(from, direction) in edges {
        leaving.entry(from).or_default().insert(direction);
        leaving.entry(from + Point::unit(direction)).or_default().insert(direction + 6);
    }
    let mut tiles = BTreeSet::new();
    for (&origin, directions) in &leaving {
        let corner = at_corner.get(&origin).map(|&k| (boundary.directions()[k], boundary.code()[k]));
        for &direction in directions {
            // Outside the corner's wedge there are no tiles.
            let is_last = corner.is_some_and(|(first, angle)| (direction + 12 - first) % 12 == angle);
            let to_next = (1..12).find(|turn| directions.contains(&((direction + turn) % 12)));
            let kind = Kind::REGULAR.into_iter().find(|kind| to_next == Some(kind.angle()));
            if let (false, Some(kind)) = (is_last, kind) {
                tiles.insert(Tile { origin, direction, kind }.normalised());
            }
        }
    }
    Tiling { tiles: tiles.into_iter().collect() }
}
