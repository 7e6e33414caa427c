//! The coarsest layout: pairs of base triangles, and lines between those that find no partner.
//!
//! Not in Daniels et al. 2011, whose lone triangles are divided from their middle: three lines leave each and run straight on through the
//! patches beside, over most of the mesh. One is enough. Where a single line joins two lone triangles, each is a patch of four sides: the
//! side that the line ends in counts as two. A line may cross features and may end on a border, and every region between features has as many
//! lines as it has triangles without a partner; that is the T-join of regions with odd borders.
//!
//! An integer programme chooses pairs, lone triangles and the base edges that lines cross. It starts from the best choice without lines, and
//! ends near enough to the best one: what it takes to prove more is hours.

use crate::base::Base;
use crate::error::LayoutError;
use crate::measures::Measures;
use crate::pairing::{Given, candidates};
use crate::patch::Patch;
use mesh::{Monitor, NONE};
use solve::components::connected_components;
use solve::integer::{self, Programme, Stop, Term, Variable};
use std::ops::RangeInclusive;
use std::time::Duration;

/// What a lone triangle costs, in irregular vertices, divided from its middle and as the end of a line.
const LONE: f64 = 10.0;
const LINE_END: f64 = 1.0;
/// What a line costs for each base edge that it crosses.
const CROSSED: f64 = 0.1;
/// The bluntest corner of a quad between features that holds, in right angles: 153 degrees. A straighter one stays flat, whatever moves.
const BLUNTEST: f64 = 1.7;
/// Larger bases take minutes.
const MOST_TRIANGLES: usize = 1000;
/// How near to the best choice, as a part of its cost, and the nodes of the search that may take: a tray and a goat's head needed no more
/// than three. The seconds are a backstop that no mesh has come to, since where they end a search depends on the machine.
const GAP: f64 = 0.1;
const NODES: u32 = 5;
const SECONDS: u64 = 600;

/// A patch that may be taken.
struct Pick {
    patch: Patch,
    quads: Vec<(u32, i32)>,
    cost: f64,
}

/// The best patches; `None` for bases too large for that.
///
/// # Errors
/// Cancelled, or as the solver says.
pub(crate) fn choose(base: &Base, measures: &Measures, monitor: &Monitor) -> Result<Option<Vec<Patch>>, LayoutError> {
    if base.triangles.len() > MOST_TRIANGLES {
        return Ok(None);
    }
    let given = Given { forced: &[], kept: &[], straight_corners: false, off_four: LONE };
    let mut picks: Vec<Pick> = candidates(base, measures, 2, given, monitor)?
        .into_iter()
        .map(|(patch, choice)| Pick { patch, quads: choice.quads, cost: choice.cost })
        .collect();
    let alone: Vec<bool> = picks.iter().map(|pick| pick.patch.border.len() == 3).collect();
    let taken = |picks: &[Pick], values: &[i64]| -> Vec<Patch> {
        picks.iter().zip(values).filter(|(_, value)| **value == 1).map(|(pick, _)| pick.patch.clone()).collect()
    };
    let (mut programme, _) = in_pairs(base, measures, &picks);
    let start: Vec<i64> = alone.iter().map(|&alone| i64::from(alone)).collect();
    let found = solve(&mut programme, &start, monitor)?;
    let Some(mut start) = found else { return Ok(None) };
    let divided_first = divided(base, &taken(&picks, &start));

    // A line that ends on a feature would leave a flat corner there.
    for lone in (0..alone.len()).filter(|&i| alone[i]) {
        for side in 0..3 {
            let Pick { patch, quads, cost } = &picks[lone];
            if !measures.rails[edge_of(base, patch.border[side])] {
                let patch = Patch { split: true, ..patch.clone().turned(side) };
                picks.push(Pick { patch, quads: quads.clone(), cost: cost - LONE + LINE_END });
            }
        }
    }
    let (mut programme, variables) = in_pairs(base, measures, &picks);
    add_lines(&mut programme, base, &picks, &variables);
    start.resize(picks.len(), 0);
    start.extend(divided_first.into_iter().map(i64::from));
    let found = solve(&mut programme, &start, monitor)?;
    Ok(found.map(|values| taken(&picks, &values)))
}

fn edge_of(base: &Base, h: u32) -> usize {
    base.triangle_edges[h as usize / 3][h as usize % 3] as usize
}

/// A solution that is the same on every run; `None` where time ran out.
fn solve(programme: &mut Programme<'_>, start: &[i64], monitor: &Monitor) -> Result<Option<Vec<i64>>, LayoutError> {
    let limits = integer::Options { max_nodes: NODES, relative_gap: GAP, time_limit: Duration::from_secs(SECONDS) };
    let solution = programme.solve(&limits, Some(start), &|| monitor.is_cancelled())?;
    Ok((solution.stop != Stop::Time).then_some(solution.values))
}

/// Each triangle in one patch, enough quads in every sector between features, and vertices as regular as can be.
fn in_pairs<'a>(base: &Base, measures: &Measures, picks: &[Pick]) -> (Programme<'a>, Vec<Variable>) {
    let mut programme = Programme::new();
    let variables: Vec<Variable> = picks.iter().map(|_| programme.variable(0..=1)).collect();
    let mut of_triangle: Vec<Vec<Term>> = vec![Vec::new(); base.triangles.len()];
    let mut of_sector: Vec<Vec<Term>> = vec![Vec::new(); measures.sectors.len()];
    for (pick, &variable) in picks.iter().zip(&variables) {
        pick.patch.triangles.iter().for_each(|&t| of_triangle[t as usize].push((variable, 1)));
        pick.quads.iter().for_each(|&(s, quads)| of_sector[s as usize].push((variable, quads)));
        charge(&mut programme, variable, pick.cost);
    }
    for terms in &of_triangle {
        programme.row(terms, 1..=1);
    }
    let mut on_border = vec![false; base.vertices.len()];
    for (h, _) in measures.twins.iter().enumerate().filter(|(_, twin)| **twin == NONE) {
        for k in [h % 3, (h + 1) % 3] {
            on_border[base.triangles[h / 3][k] as usize] = true;
        }
    }
    let mut at_vertex: Vec<(usize, Vec<Term>)> = vec![(0, Vec::new()); base.vertices.len()];
    for (sector, terms) in measures.sectors.iter().zip(&of_sector) {
        // More quads than triangles there cannot be.
        let most = sector.corners.len();
        programme.row(terms, ((sector.ideal / BLUNTEST).ceil() as i64).clamp(1, most as i64)..);
        let ideal = sector.ideal;
        let near = ideal.round() as i64;
        programme.convex_cost(terms, move |quads| (quads as f64 - ideal).powi(2), near - 1..=near + 2);
        let (all, quads) = &mut at_vertex[sector.vertex as usize];
        *all += most;
        quads.extend(terms);
    }
    for ((all, terms), on_border) in at_vertex.iter().zip(on_border).filter(|((all, _), _)| *all > 0) {
        // Two quads alone at a vertex would share two edges.
        programme.row(terms, (*all as i64).min(if on_border { 1 } else { 3 })..);
    }
    (programme, variables)
}

fn charge(programme: &mut Programme<'_>, variable: Variable, cost: f64) {
    const EITHER: RangeInclusive<i64> = 0..=1;
    programme.convex_cost(&[(variable, 1)], move |taken| cost * taken as f64, EITHER);
}

/// Lines go straight through patches of four sides, end in the middle of a side of lone triangles that are divided along it, and leave all
/// sides of others.
fn add_lines(programme: &mut Programme<'_>, base: &Base, picks: &[Pick], variables: &[Variable]) {
    let divided: Vec<Variable> = base.edges.iter().map(|_| programme.variable(0..=1)).collect();
    for &edge in &divided {
        charge(programme, edge, CROSSED);
    }
    let mut ends: Vec<Vec<Term>> = vec![Vec::new(); divided.len()];
    for (pick, &taken) in picks.iter().zip(variables) {
        let border: Vec<usize> = pick.patch.border.iter().map(|&h| edge_of(base, h)).collect();
        if let [a, b, c, d] = border[..] {
            for (from, to) in [(a, c), (c, a), (b, d), (d, b)].into_iter().filter(|(from, to)| from != to) {
                programme.row(&[(divided[from], 1), (divided[to], -1), (taken, 1)], ..=1);
            }
            continue;
        }
        for (k, &edge) in border.iter().enumerate() {
            if k == 0 || !pick.patch.split {
                programme.row(&[(divided[edge], 1), (taken, -1)], 0..);
            } else {
                programme.row(&[(divided[edge], 1), (taken, 1)], ..=1);
            }
        }
        if pick.patch.split {
            ends[border[0]].push((taken, 1));
        }
    }
    // Between two lone triangles alone a line would have two quads at each end.
    ends.iter().filter(|ends| ends.len() > 1).for_each(|ends| programme.row(ends, ..=1));
}

/// Whether a line crosses each base edge in its middle.
pub(crate) fn divided(base: &Base, patches: &[Patch]) -> Vec<bool> {
    let mut divided = vec![false; base.edges.len()];
    let mut across = Vec::new();
    for patch in patches {
        let edges: Vec<usize> = patch.border.iter().map(|&h| edge_of(base, h)).collect();
        match edges[..] {
            [a, b, c, d] => across.extend([(a as u32, c as u32), (b as u32, d as u32)]),
            [first, ..] if patch.split => divided[first] = true,
            _ => edges.into_iter().for_each(|e| divided[e] = true),
        }
    }
    for chord in connected_components(divided.len(), across) {
        if chord.iter().any(|&e| divided[e as usize]) {
            for e in chord {
                divided[e as usize] = true;
            }
        }
    }
    divided
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bases::all;

    #[test]
    fn lines_join_lone_triangles_and_leave_their_other_sides_whole() {
        for (name, base) in all() {
            let measures = Measures::new(&base).unwrap();
            let patches = choose(&base, &measures, &Monitor::new()).unwrap().unwrap();
            let mut seen = vec![0; base.triangles.len()];
            patches.iter().flat_map(|p| &p.triangles).for_each(|&t| seen[t as usize] += 1);
            assert!(seen.iter().all(|&n| n == 1), "{name}");
            let crossed = divided(&base, &patches);
            for patch in patches.iter().filter(|patch| patch.split) {
                let edges: Vec<usize> = patch.border.iter().map(|&h| edge_of(&base, h)).collect();
                assert_eq!(edges.iter().map(|&e| crossed[e]).collect::<Vec<_>>(), [true, false, false], "{name}");
                assert!(!measures.rails[edges[0]], "{name}");
            }
        }
    }
}
