//! Lengths of the sides of a patch graph, in edges (problem 11), with its extension to half edges (`halves`) and sqrt-3 edges.
//!
//! A side has n edges in its own direction and m pairs of edges, one 30 degrees to the left and one to the right of it:
//! sqrt 3 each. A pair runs round the triangle whose height the paper's sqrt-3 edge is. So no tile
//! is cut by a side, and what 4.2.3 demands of tiles cut in two holds by itself.
//!
//! **Patches that surely have a tiling.** Where all edges of an outline run in directions of one parity, its inside is a
//! piece of the triangular lattice; where all run in directions a right angle apart, one of the square lattice. Either
//! way the one tiling is known to exist, whatever the lengths. So the programme prefers, patch by patch, sides of
//! edges alone or of pairs alone that make it so. A patch that cannot have that is left to the plane solver and its
//! certificate.
//!
//! **Patches of both tiles.** Such patches have one tiling each; a facade of them is either of squares or of triangles. On wish, sides
//! get edges and pairs alike, where the patches beside may take them. A patch of four right angles then is laid in *rows*: two
//! opposite sides of both kinds, the other two of edges alone, rows of squares and of triangles between; it surely has
//! a tiling when both sides take the same course (`courses`). Other shapes are left to the plane solver.
//!
//! Deviation: squared errors are divided by the side's length, so that stretch counts, not length.

use super::halves::{Halfway, HalfwayVariables, Halves};
use super::lattices::{Choice, choices, of_edges};
use super::patch_graph::{Patch, PatchGraph};
use crate::plane::Point;
use mesh::Monitor;
use solve::SolveError;
use solve::integer::{Options, Programme, Solution, Term, Variable};
use std::time::Duration;

/// What a patch costs that is neither of squares nor of triangles alone, in squared edges.
const MIXED: f64 = 20.0;

/// The same where patches are to be of both tiles: what one costs that is of one lattice, one in rows and one of neither; and a
/// side that is all edges or all pairs.
const PLAIN: f64 = 1.0;
const FREE: f64 = 0.5;
const UNBALANCED: f64 = 1.5;

/// What a side of both edges and pairs costs, and what each pair: of equals, the straight side.
const BOTH: f64 = 1.5;
const PAIR: f64 = 0.01;

/// What a node in the middle of an edge costs: of equals, the lengths of whole edges.
const HALFWAY: f64 = 0.02;

/// Half edges and half pairs as eighths of an edge: sqrt 3 is about 7/4.
const EIGHTHS: [i32; 2] = [4, 7];

/// Limits of the programme. The nodes decide, so that the same input gives the same lengths on any machine: the slowest programme seen
/// came to them in 19 s on a machine that was shared by four; the time only ends what a cancel leaves behind.
const MOST_NODES: u32 = 30;
const TIME: Duration = Duration::from_secs(600);

/// Most sides that may have edges and pairs: with more, the programme takes seconds or finds nothing.
const MOST_FREE: usize = 32;

/// The same for sides and nodes that may lie in the middle of an edge, which count twice.
const MOST_FREE_HALVES: usize = 36;

/// A solution is good enough when its cost is proved to be within this fraction of the least.
const GAP: f64 = 0.05;

/// The variables of a side: whether it has edges in its direction, whether pairs, and how many of each.
struct SideVariables {
    has_straight: Variable,
    has_pairs: Variable,
    straight: Variable,
    pairs: Variable,
    /// Half an edge more, half a pair more, where there may be.
    halves: [Option<Variable>; 2],
}

/// A bound on the number of steps around a patch: how other lengths are asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Perimeter {
    pub patch: usize,
    pub least: i64,
    pub most: i64,
}

/// What is asked of lengths beside closing and being near.
#[derive(Debug, Clone, Default)]
pub(super) struct Wishes {
    pub perimeters: Vec<Perimeter>,
    /// Whether every patch is to be of one lattice.
    pub of_lattices: bool,
    /// Whether each side has edges, and whether pairs; empty when that is to be found.
    pub kinds: Vec<[bool; 2]>,
    /// Patches that may be of both tiles; empty when none are to be.
    pub mixing: Vec<bool>,
}

impl Wishes {
    fn mixes(&self, patch: usize) -> bool {
        self.mixing.get(patch) == Some(&true)
    }
}

/// Lengths of all sides.
pub(super) struct Lengths {
    pub of_side: Vec<Halves>,
    /// Of the nodes that might, those that lie in the middle of an edge.
    pub is_half: Vec<bool>,
    pub cost: f64,
}

/// The lengths of each side that close every patch and come nearest to those of the sides, with `nodes` that may lie in the middle of an
/// edge; `None` when none close.
pub(super) fn side_lengths(
    graph: &PatchGraph,
    edge_length: f64,
    wishes: &Wishes,
    nodes: &[Halfway],
    monitor: &Monitor,
) -> Result<Option<Lengths>, SolveError> {
    if !wishes.kinds.is_empty() {
        return solve(graph, edge_length, wishes, nodes, Some(&Choice::new()), monitor);
    }
    let of_lattices = || -> Result<Option<Lengths>, SolveError> {
        let mut best: Option<Lengths> = None;
        for choice in choices(graph) {
            let found = solve(graph, edge_length, wishes, nodes, Some(&choice), monitor)?;
            if let Some(found) = found.filter(|found| best.as_ref().is_none_or(|best| found.cost < best.cost)) {
                best = Some(found);
            }
        }
        Ok(best)
    };
    if wishes.of_lattices {
        return of_lattices();
    }
    if wishes.mixing.is_empty() {
        // With little or nothing to branch on first.
        if let Some(found) = solve(graph, edge_length, wishes, nodes, Some(&of_edges(graph)), monitor)? {
            return Ok(Some(found));
        }
        if let Some(found) = of_lattices()? {
            return Ok(Some(found));
        }
    }
    solve(graph, edge_length, wishes, nodes, None, monitor)
}

/// The programme, with patches of the lattices that are chosen; where none are, it chooses.
fn solve(
    graph: &PatchGraph,
    edge_length: f64,
    wishes: &Wishes,
    nodes: &[Halfway],
    choice: Option<&Choice>,
    monitor: &Monitor,
) -> Result<Option<Lengths>, SolveError> {
    let mut programme = Programme::new();
    let halfway = HalfwayVariables::new(&mut programme, graph, nodes);
    for &is_half in &halfway.is_half {
        programme.convex_cost(&[(is_half, 1)], |v| HALFWAY * v as f64, 0..=1);
    }
    // Of each side, where that is settled: whether it has edges, and whether pairs.
    let mut settled: Vec<[Option<bool>; 2]> = vec![[None; 2]; graph.sides.len()];
    for (settled, kinds) in settled.iter_mut().zip(&wishes.kinds) {
        *settled = kinds.map(Some);
    }
    for (patch, lattice) in graph.patches.iter().zip(choice.into_iter().flatten()) {
        let Some(lattice) = lattice else { continue };
        for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
            settled[corner.side as usize] = [lattice.has(direction), !lattice.has(direction)].map(Some);
        }
        for (is_half, direction) in halfway.edges_at(patch) {
            programme.row(&[(is_half, 1)], 0..=i64::from(lattice.has(direction)));
        }
    }
    let mut may_mix = vec![!wishes.mixing.is_empty(); graph.sides.len()];
    for (_, patch) in graph.patches.iter().enumerate().filter(|(p, _)| !wishes.mixes(*p)) {
        patch.corners.iter().for_each(|corner| may_mix[corner.side as usize] = false);
    }
    let variables: Vec<SideVariables> = graph
        .sides
        .iter()
        .zip(may_mix)
        .zip(&settled)
        .zip(&halfway.of_side)
        .map(|(((side, may_mix), &settled), &halves)| {
            let length = (side.length() / edge_length).max(0.5);
            let most = [2.0 * length + 3.0, 2.0 * length / 3f64.sqrt() + 2.0].map(|most| most as i32);
            let [has_straight, has_pairs] = settled.map(|settled| match settled {
                None => programme.variable(0..=1),
                Some(has) => programme.variable(i32::from(has)..=i32::from(has)),
            });
            let [straight, pairs] = most.map(|most| programme.variable(0..=most));
            let numbers = [(straight, has_straight, most[0]), (pairs, has_pairs, most[1])];
            let mut terms = Vec::new();
            for (((number, has, most), half), eighths) in numbers.into_iter().zip(halves).zip(EIGHTHS) {
                let any: Vec<Term> = [Some(number), half].into_iter().flatten().map(|v| (v, 1)).collect();
                programme.row(&[any.as_slice(), &[(has, -1)]].concat(), 0..);
                programme.row(&[(number, 1), (has, -most)], ..=0);
                terms.push((number, 2 * eighths));
                if let Some(half) = half {
                    programme.row(&[(half, 1), (has, -1)], ..=0);
                    terms.push((half, eighths));
                }
            }
            programme.row(&[(has_straight, 1), (has_pairs, 1)], 1..);
            // Whole edges need no eighths.
            let unit = if halves == [None, None] { 2 } else { 1 };
            let wanted = f64::from(8 / unit) * length;
            programme.convex_cost(
                &terms.iter().map(|&(v, eighths)| (v, eighths / unit)).collect::<Vec<_>>(),
                move |v| (v as f64 - wanted).powi(2) / (f64::from(8 / unit) * wanted),
                wanted as i64 - i64::from(16 / unit)..=wanted as i64 + i64::from(16 / unit),
            );
            if may_mix {
                let balance = move |v: i64| UNBALANCED * (v as f64).abs() / wanted;
                let most = wanted as i64 + 8;
                programme.convex_cost(&[(straight, EIGHTHS[0]), (pairs, -EIGHTHS[1])], balance, -most..=most);
            } else {
                programme.convex_cost(&[(has_straight, 1), (has_pairs, 1)], |v| BOTH * (v - 1) as f64, 0..=2);
            }
            programme.convex_cost(&[(pairs, 1)], |v| PAIR * v as f64, 0..=i64::from(most[1]));
            SideVariables { has_straight, has_pairs, straight, pairs, halves }
        })
        .collect();
    // A cone closes whatever its lengths.
    for (p, patch) in graph.patches.iter().enumerate().filter(|(_, patch)| patch.total_interior_defect() == 0) {
        close(&mut programme, patch, &variables);
        if choice.is_none() {
            prefer_lattice(&mut programme, patch, &variables, &halfway, wishes.mixes(p));
        }
    }
    for bound in &wishes.perimeters {
        let terms: Vec<Term> = graph.patches[bound.patch]
            .corners
            .iter()
            .map(|corner| &variables[corner.side as usize])
            .flat_map(|side| [(side.straight, 1), (side.pairs, 1)])
            .collect();
        programme.row(&terms, bound.least..=bound.most);
    }
    // A programme that is too large is worth no search.
    let free = settled.iter().filter(|settled| settled.contains(&None)).count();
    let most = if nodes.is_empty() || free == 0 { MOST_FREE } else { MOST_FREE_HALVES.saturating_sub(2 * nodes.len()) };
    if free > most {
        return Ok(None);
    }
    let options = Options { max_nodes: MOST_NODES, time_limit: TIME, relative_gap: GAP };
    match programme.solve(&options, None, &|| monitor.is_cancelled()) {
        Ok(Solution { values, cost, .. }) => {
            let of = |variable: Variable| values[variable.index()] as u32;
            let of_side = variables.iter().map(|side| {
                let [straight, pairs] = side.halves.map(|half| half.map_or(0, of));
                Halves { straight: 2 * of(side.straight) + straight, pairs: 2 * of(side.pairs) + pairs }
            });
            let is_half = halfway.is_half.iter().map(|&is_half| of(is_half) == 1).collect();
            Ok(Some(Lengths { of_side: of_side.collect(), is_half, cost }))
        }
        Err(SolveError::Infeasible { .. } | SolveError::LimitWithoutSolution { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The outline of a patch ends where it begins, in the exact plane.
fn close(programme: &mut Programme<'_>, patch: &Patch, variables: &[SideVariables]) {
    let mut rows: [Vec<Term>; 4] = Default::default();
    for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
        let side = &variables[corner.side as usize];
        let straight = Point::unit(direction);
        let pair = Point::unit((direction + 1) % 12) + Point::unit((direction + 11) % 12);
        for (axis, row) in rows.iter_mut().enumerate() {
            row.extend([(side.straight, 2 * straight.0[axis]), (side.pairs, 2 * pair.0[axis])]);
            for (half, way) in side.halves.iter().zip([straight, pair]) {
                row.extend(half.map(|half| (half, way.0[axis])));
            }
        }
    }
    for row in rows {
        programme.row(&row, 0..=0);
    }
}

/// A patch is of triangles, its edges along even or along odd directions, or of squares, or in rows, or pays.
fn prefer_lattice(
    programme: &mut Programme<'_>,
    patch: &Patch,
    variables: &[SideVariables],
    halfway: &HalfwayVariables<'_>,
    mixes: bool,
) {
    let [free, squares, even, odd] = [(); 4].map(|()| programme.variable(0..=1));
    let mut ways = vec![(free, 1), (squares, 1), (even, 1), (odd, 1)];
    let sides = || patch.corners.iter().map(|corner| &variables[corner.side as usize]).zip(patch.directions());
    if mixes {
        let plain = |v: i64| PLAIN * v as f64;
        programme.convex_cost(&[(squares, 1), (even, 1), (odd, 1)], plain, 0..=1);
        programme.convex_cost(&[(free, 1)], |v| FREE * v as f64, 0..=1);
        for pair in patch.row_ends() {
            let rows = programme.variable(0..=1);
            ways.push((rows, 1));
            for (side, _) in sides().enumerate().filter(|(k, _)| !pair.contains(k)).map(|(_, side)| side) {
                programme.row(&[(side.has_pairs, 1), (rows, 1)], ..=1);
            }
        }
    } else {
        programme.convex_cost(&[(free, 1)], |v| MIXED * v as f64, 0..=1);
    }
    programme.row(&ways, 1..=1);
    if patch.corners.iter().any(|corner| corner.c_index % 3 != 0) {
        programme.row(&[(squares, 1)], 0..=0);
    } else if mixes {
        // Right angles alone: zigzags on sides that meet leave squares of a side of sqrt 3, which no tiles fill.
        programme.row(&[(free, 1)], 0..=0);
    }
    // An edge in whose middle a node lies is of the lattice, too.
    for (is_half, direction) in halfway.edges_at(patch) {
        let across = if direction % 2 == 0 { odd } else { even };
        programme.row(&[(is_half, 1), (across, 1)], ..=1);
        if direction % 3 != 0 {
            programme.row(&[(is_half, 1), (squares, 1)], ..=1);
        }
    }
    for (side, direction) in sides() {
        let (along, across) = if direction % 2 == 0 { (even, odd) } else { (odd, even) };
        // Edges run in directions of the side's own parity, those of pairs in the other.
        programme.row(&[(side.has_straight, 1), (across, 1)], ..=1);
        programme.row(&[(side.has_pairs, 1), (along, 1), (squares, 1)], ..=1);
    }
}
