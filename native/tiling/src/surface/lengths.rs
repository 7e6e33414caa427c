//! Lengths of the sides of a patch graph, in edges (problem 11), with its extension to sqrt-3 edges.
//!
//! A side is *straight*, n edges long, or a *zigzag* of m pairs of edges, one 30 degrees to the left and one to the right of
//! the side's direction: sqrt 3 each. A pair runs round the triangle whose height the paper's sqrt-3 edge is. So no tile
//! is cut by a side, and what 4.2.3 demands of tiles cut in two holds by itself.
//!
//! **Patches that surely have a tiling.** Where all edges of an outline run in directions of one parity, its inside is a
//! piece of the triangular lattice; where all run in directions a right angle apart, one of the square lattice. Either
//! way the one tiling is known to exist, whatever the lengths. So the programme prefers, patch by patch, to choose straight or zigzag that way. A
//! patch that cannot have it (`mixed`) is left to the plane solver and its certificate.
//!
//! Deviations: squared errors are divided by the side's length, so that stretch counts, not length; sides of both straight
//! edges and zigzags are not made.

use super::patch_graph::{Patch, PatchGraph};
use crate::plane::Point;
use mesh::Monitor;
use solve::SolveError;
use solve::integer::{Options, Programme, Solution, Term, Variable};
use std::time::Duration;

/// What a patch costs that is neither of squares nor of triangles alone, in squared edges.
const MIXED: f64 = 20.0;

/// What a zigzag costs: of equals, the straight side.
const ZIGZAG: f64 = 0.02;

/// Limits of the programme: the nodes bind first but on a loaded machine.
const MOST_NODES: u32 = 1500;
const TIME: Duration = Duration::from_secs(12);

/// Edges of a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Steps {
    /// How many, or how many pairs.
    pub count: u32,
    /// Straight edges, else pairs of edges to the left and to the right.
    pub is_straight: bool,
}

impl Steps {
    /// How long the side is in the plane, in edges.
    pub fn chord(self) -> f64 {
        f64::from(self.count) * if self.is_straight { 1.0 } else { 3f64.sqrt() }
    }

    /// Number of edges.
    pub fn edges(self) -> u32 {
        self.count * if self.is_straight { 1 } else { 2 }
    }
}

/// A bound on the number of steps around a patch: how other lengths are asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Perimeter {
    pub patch: usize,
    pub least: i64,
    pub most: i64,
}

/// The steps of each side that close every patch and come nearest to the lengths of the sides; `None` when none close.
pub(super) fn side_steps(
    graph: &PatchGraph,
    edge_length: f64,
    perimeters: &[Perimeter],
    monitor: &Monitor,
) -> Result<Option<(Vec<Steps>, f64)>, SolveError> {
    let mut programme = Programme::new();
    let variables: Vec<[Variable; 3]> = graph
        .sides
        .iter()
        .map(|side| {
            let length = (side.length() / edge_length).max(0.5);
            let (most, most_pairs) = (2.0 * length + 3.0, 2.0 * length / 3f64.sqrt() + 2.0);
            let (most, most_pairs) = (most as i32, most_pairs as i32);
            let straight = programme.variable(0..=1);
            let (n, m) = (programme.variable(0..=most), programme.variable(0..=most_pairs));
            programme.row(&[(n, 1), (straight, -1)], 0..);
            programme.row(&[(n, 1), (straight, -most)], ..=0);
            programme.row(&[(m, 1), (straight, 1)], 1..);
            programme.row(&[(m, 1), (straight, most_pairs)], ..=i64::from(most_pairs));
            // Each of the two costs is about nothing while the other is the one that counts.
            let near = length.round().max(1.0);
            let near_pairs = (length / 3f64.sqrt()).round().max(1.0);
            programme.convex_cost(
                &[(n, 1), (straight, -(near as i32))],
                move |v| (v as f64 + near - length).powi(2) / length,
                -4..=4,
            );
            let at = near_pairs as i64;
            programme.convex_cost(
                &[(m, 1), (straight, near_pairs as i32)],
                move |v| (v as f64 * 3f64.sqrt() - length).powi(2) / length,
                at - 3..=at + 3,
            );
            programme.convex_cost(&[(straight, -1)], |v| ZIGZAG * (v + 1) as f64, -1..=0);
            [straight, n, m]
        })
        .collect();
    // A cone closes whatever its lengths.
    for patch in graph.patches.iter().filter(|patch| patch.total_interior_defect() == 0) {
        close(&mut programme, patch, &variables);
        prefer_lattice(&mut programme, patch, &variables);
    }
    for bound in perimeters {
        let terms: Vec<Term> = graph.patches[bound.patch]
            .corners
            .iter()
            .flat_map(|corner| [(variables[corner.side as usize][1], 1), (variables[corner.side as usize][2], 1)])
            .collect();
        programme.row(&terms, bound.least..=bound.most);
    }
    let options = Options { max_nodes: MOST_NODES, time_limit: TIME, relative_gap: 1e-3 };
    match programme.solve(&options, None, &|| monitor.is_cancelled()) {
        Ok(Solution { values, cost, .. }) => {
            let steps = variables.iter().map(|[straight, n, m]| {
                let is_straight = values[straight.index()] == 1;
                Steps { count: values[if is_straight { n } else { m }.index()] as u32, is_straight }
            });
            Ok(Some((steps.collect(), cost)))
        }
        Err(SolveError::Infeasible { .. } | SolveError::LimitWithoutSolution { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The outline of a patch ends where it begins, in the exact plane.
fn close(programme: &mut Programme<'_>, patch: &Patch, variables: &[[Variable; 3]]) {
    let mut rows: [Vec<Term>; 4] = Default::default();
    for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
        let [_, n, m] = variables[corner.side as usize];
        let straight = Point::unit(direction);
        let pair = Point::unit((direction + 1) % 12) + Point::unit((direction + 11) % 12);
        for (axis, row) in rows.iter_mut().enumerate() {
            row.extend([(n, straight.0[axis]), (m, pair.0[axis])]);
        }
    }
    for row in rows {
        programme.row(&row, 0..=0);
    }
}

/// A patch is of triangles, its edges along even or along odd directions, or of squares, or pays.
fn prefer_lattice(programme: &mut Programme<'_>, patch: &Patch, variables: &[[Variable; 3]]) {
    let [mixed, squares, even, odd] = [(); 4].map(|()| programme.variable(0..=1));
    programme.row(&[(mixed, 1), (squares, 1), (even, 1), (odd, 1)], 1..=1);
    programme.convex_cost(&[(mixed, 1)], |v| MIXED * v as f64, 0..=1);
    if patch.corners.iter().any(|corner| corner.c_index % 3 != 0) {
        programme.row(&[(squares, 1)], 0..=0);
    }
    for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
        let straight = variables[corner.side as usize][0];
        let (along, across) = if direction % 2 == 0 { (even, odd) } else { (odd, even) };
        programme.row(&[(straight, 1), (along, -1), (squares, -1)], 0..);
        programme.row(&[(straight, 1), (across, 1)], ..=1);
    }
}
