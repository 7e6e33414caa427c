//! Which base triangles are merged into patches: sections 5.2 and 5.3.
//!
//! [`Pairing::Matching`] is the paper's: a matching in the dual graph without the features' edges, of greatest weight by
//! equations 3 to 5 among those that leave the fewest triangles single.
//!
//! [`Pairing::Programme`], the default, deviates: the matching does not see that a vertex of the layout gets as many quads
//! as it has triangles less the edges taken out, so that it leaves irregular vertices at random. An integer programme
//! picks one patch for each triangle among all possible ones of one to three triangles, so that the number of quads at each
//! vertex comes near the angle there divided by 90 degrees (a full turn is four; between features the surface angle,
//! so that quads meet features squarely), and few patches have another number of sides than four. Blunt corners of a
//! patch may count as straight, where two quads meet. The matching's patches start the search, so that a limit costs no result.

use crate::anneal::{self, Choice, Goal};
use crate::base::Base;
use crate::error::LayoutError;
use crate::measures::{Measures, Sector};
use crate::patch::{Patch, Rim};
use mesh::{Monitor, NONE};
use rayon::prelude::*;
use solve::matching::{maximum_matching, weight_spread_limit};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI};

/// How base triangles are merged into patches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pairing {
    /// The maximum-weight matching of sections 5.2 and 5.3.
    Matching {
        /// Range of the weights, above 0. The paper: 10.
        lambda: f64,
        /// Share of orthogonality against planarity, 0 to 1. The paper: 0.5.
        mu: f64,
    },
    /// The valence-aware integer programme.
    Programme {
        /// Most triangles in a patch, 2 or 3. Default 3.
        most_triangles: usize,
    },
}

impl Default for Pairing {
    fn default() -> Self {
        Self::Programme { most_triangles: 3 }
    }
}

impl Pairing {
    /// The paper's matching with the paper's constants.
    pub const PAPER: Self = Self::Matching { lambda: 10.0, mu: 0.5 };
}

/// Corners of a patch blunter than this may count as straight: 120 degrees.
const BLUNT: f64 = PI * 2.0 / 3.0;
/// Weight of the corner angles' squared deviation from the right angle, in irregular vertices for each right angle squared.
const ANGLE_WEIGHT: f64 = 0.6;
/// Weight of a fold between merged triangles, in irregular vertices.
const FOLD_WEIGHT: f64 = 1.0;
/// Weight of the squared logarithm of the ratio of opposite sides.
const RATIO_WEIGHT: f64 = 0.4;

/// How far a sector of features may fall short of a whole number of right angles and still need as many quads: 27 degrees.
const STRAIGHT: f64 = 0.3;
/// Patches that cost more than this are never worth it: lone triangles do not.
const MOST_COST: f64 = 1.8;

/// What a choice of patches has to respect.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given<'a> {
    /// Pairs of triangles that are patches.
    pub forced: &'a [[u32; 2]],
    /// Patches that are there already.
    pub kept: &'a [Patch],
    /// Without, every side is one base edge.
    pub straight_corners: bool,
    /// Weight of sides other than four, in irregular vertices.
    pub off_four: f64,
}

impl Given<'_> {
    /// Whether each base triangle is in no patch yet.
    fn is_bare(&self, base: &Base) -> Vec<bool> {
        let mut bare = vec![true; base.triangles.len()];
        self.kept.iter().flat_map(|patch| &patch.triangles).for_each(|&t| bare[t as usize] = false);
        bare
    }
}

/// Patches that hold every base triangle that is not in a patch yet once.
pub(crate) fn pair(
    base: &Base,
    measures: &Measures,
    pairing: Pairing,
    given: Given<'_>,
    monitor: &Monitor,
) -> Result<Vec<Patch>, LayoutError> {
    Ok(pair_often(base, measures, pairing, given, 1, monitor)?.swap_remove(0))
}

/// As [`pair`], as many times as `runs` says, each time otherwise; the matching has but one way.
pub(crate) fn pair_often(
    base: &Base,
    measures: &Measures,
    pairing: Pairing,
    given: Given<'_>,
    runs: u64,
    monitor: &Monitor,
) -> Result<Vec<Vec<Patch>>, LayoutError> {
    match pairing {
        Pairing::Matching { lambda, mu } => {
            if !(lambda > 0.0 && lambda.is_finite()) {
                return Err(LayoutError::BadOption { option: "lambda", expected: "above 0" });
            }
            if !(0.0..=1.0).contains(&mu) {
                return Err(LayoutError::BadOption { option: "mu", expected: "from 0 to 1" });
            }
            Ok(vec![matching(base, measures, [lambda, mu], given, monitor)?])
        }
        Pairing::Programme { most_triangles } => {
            if !(2..=3).contains(&most_triangles) {
                return Err(LayoutError::BadOption { option: "most_triangles", expected: "2 or 3" });
            }
            let problem = Problem::new(base, measures, most_triangles, given, monitor)?;
            let all = (0..runs).into_par_iter().map(|run| {
                let taken = problem.solve(run, monitor)?;
                // The choices after the candidates are the patches that are there already.
                Ok(taken.into_iter().filter_map(|c| problem.patches.get(c as usize).cloned()).collect())
            });
            all.collect()
        }
    }
}

/// Whether a group of triangles, ascending, keeps forced pairs whole and by themselves.
fn allowed(group: &[u32], forced: &[[u32; 2]]) -> bool {
    forced.iter().all(|pair| {
        !pair.iter().any(|t| group.contains(t)) || (group.len() == 2 && pair.iter().all(|t| group.contains(t)))
    })
}

/// Half-edges, one for each base edge that may go and lies between two triangles.
fn removable(base: &Base, measures: &Measures) -> impl Iterator<Item = u32> {
    let rail = |h: u32| measures.rails[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
    (0..measures.twins.len() as u32)
        .filter(move |&h| measures.twins[h as usize] > h && measures.twins[h as usize] != NONE && !rail(h))
}

/// Equation 4 for the rim of the two triangles on both sides of a half-edge.
fn orthogonality(rim: &Rim) -> f64 {
    rim.angles.iter().map(|a| a.sin()).sum::<f64>() / rim.angles.len() as f64
}

/// Equation 5.
fn planarity(measures: &Measures, a: u32, b: u32) -> f64 {
    f64::midpoint(1.0, measures.normals[a as usize].dot(measures.normals[b as usize]))
}

fn whole(rim: &Rim, triangles: &[u32]) -> Patch {
    rim.patch(triangles, &(0..rim.border.len()).collect::<Vec<_>>())
}

fn matching(
    base: &Base,
    measures: &Measures,
    [lambda, mu]: [f64; 2],
    given: Given<'_>,
    monitor: &Monitor,
) -> Result<Vec<Patch>, LayoutError> {
    let count = base.triangles.len();
    let bare = given.is_bare(base);
    let scale = f64::from(weight_spread_limit(count));
    let mut edges = Vec::new();
    for h in removable(base, measures) {
        let pair = [h / 3, measures.twins[h as usize] / 3];
        if !pair.iter().all(|&t| bare[t as usize]) {
            continue;
        }
        if let Some(rim) = Rim::new(base, measures, &pair).filter(|_| allowed(&pair, given.forced)) {
            let good = mu * orthogonality(&rim) + (1.0 - mu) * planarity(measures, pair[0], pair[1]);
            let weight = (-lambda * (1.0 - good)).exp();
            edges.push((pair[0], pair[1], (weight * scale) as i32));
        }
    }
    let partner = maximum_matching(count, &edges, &|| monitor.is_cancelled())?;
    let mut patches = Vec::new();
    for (t, partner) in (0..count as u32).zip(partner).filter(|(t, _)| bare[*t as usize]) {
        let triangles = match partner {
            Some(other) if other < t => continue,
            Some(other) => vec![t, other],
            None => vec![t],
        };
        // A pair was offered only with a rim, and a lone triangle has one since its corners differ.
        let rim = Rim::new(base, measures, &triangles).ok_or(LayoutError::BadBase {
            element: "triangle",
            index: t as usize,
            reason: "it has no rim of its own",
        })?;
        patches.push(whole(&rim, &triangles));
    }
    Ok(patches)
}

/// All candidates, those of one triangle without straight corners first, in order.
pub(crate) fn candidates(
    base: &Base,
    measures: &Measures,
    most: usize,
    given: Given<'_>,
    monitor: &Monitor,
) -> Result<Vec<(Patch, Choice)>, LayoutError> {
    let Given { forced, straight_corners, off_four, .. } = given;
    let bare = given.is_bare(base);
    let mut groups: BTreeSet<(usize, Vec<u32>)> =
        (0..base.triangles.len() as u32).filter(|&t| bare[t as usize]).map(|t| (1, vec![t])).collect();
    let rail = |h: u32| measures.rails[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
    let mut last: Vec<Vec<u32>> = groups.iter().map(|(_, group)| group.clone()).collect();
    for size in 2..=most {
        let mut grown = BTreeSet::new();
        for group in &last {
            monitor.check()?;
            for h in group.iter().flat_map(|&t| 3 * t..3 * t + 3) {
                let twin = measures.twins[h as usize];
                if twin != NONE && !rail(h) && bare[twin as usize / 3] && !group.contains(&(twin / 3)) {
                    let mut more = group.clone();
                    more.push(twin / 3);
                    more.sort_unstable();
                    grown.insert(more);
                }
            }
        }
        last = grown.into_iter().collect();
        groups.extend(last.iter().map(|group| (size, group.clone())));
    }
    let mut found = Vec::new();
    for (_, group) in &groups {
        if !allowed(group, forced) {
            continue;
        }
        if let Some(rim) = Rim::new(base, measures, group) {
            let single = group.len() == 1;
            let useful = |(patch, choice): &(Patch, Choice)| {
                let has_straight = patch.corners.len() < patch.border.len();
                if forced.iter().any(|pair| pair.contains(&group[0])) {
                    return !has_straight;
                }
                (choice.cost <= MOST_COST * off_four && (straight_corners || !has_straight))
                    || (single && !has_straight)
            };
            found.extend(variants(base, measures, &rim, group, off_four).into_iter().filter(useful));
        }
    }
    Ok(found)
}

/// The patch with all corners, then those with one or two blunt corners straight.
fn variants(base: &Base, measures: &Measures, rim: &Rim, group: &[u32], off_four: f64) -> Vec<(Patch, Choice)> {
    let n = rim.border.len();
    let blunt: Vec<usize> = (0..n).filter(|&k| rim.angles[k] > BLUNT).collect();
    let mut straight: Vec<Vec<usize>> = vec![vec![]];
    for (i, &a) in blunt.iter().enumerate() {
        straight.push(vec![a]);
        straight.extend(blunt[i + 1..].iter().map(|&b| vec![a, b]));
    }
    let fold: f64 = inner_pairs(base, measures, group).map(|[a, b]| 1.0 - planarity(measures, a, b)).sum();
    straight
        .into_iter()
        .filter(|straight| n - straight.len() >= 3)
        .map(|straight| {
            let corners: Vec<usize> = (0..n).filter(|k| !straight.contains(k)).collect();
            let off = |k: usize| {
                let wanted = if straight.contains(&k) { PI } else { FRAC_PI_2 };
                ((rim.angles[k] - wanted) / FRAC_PI_2).powi(2)
            };
            let patch = rim.patch(group, &corners);
            let mut cost = off_four * f64::from(4_u32.abs_diff(corners.len() as u32));
            cost += ANGLE_WEIGHT * (0..n).map(off).sum::<f64>() + FOLD_WEIGHT * fold;
            if corners.len() == 4 {
                let length: Vec<f64> =
                    patch.sides().map(|side| side.iter().map(|&h| edge_length(base, h)).sum()).collect();
                let ratio = (length[0] / length[2]).ln().powi(2) + (length[1] / length[3]).ln().powi(2);
                cost += RATIO_WEIGHT * ratio.min(4.0);
            }
            let quads = quads_at(measures, &patch);
            (patch, Choice { triangles: group.to_vec(), cost, quads })
        })
        .collect()
}

/// The quads that a patch brings to the sectors round it: one at a corner, two where a side goes on.
fn quads_at(measures: &Measures, patch: &Patch) -> Vec<(u32, i32)> {
    let quads =
        |(k, &h): (usize, &u32)| (measures.sector_of[h as usize], if patch.corners.contains(&k) { 1 } else { 2 });
    patch.border.iter().enumerate().map(quads).collect()
}

/// Pairs of triangles of a group that share an edge that may go.
fn inner_pairs<'a>(base: &'a Base, measures: &'a Measures, group: &'a [u32]) -> impl Iterator<Item = [u32; 2]> + 'a {
    group.iter().flat_map(|&t| 3 * t..3 * t + 3).filter_map(move |h| {
        let twin = measures.twins[h as usize];
        let rail = measures.rails[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
        (twin != NONE && twin > h && !rail && group.contains(&(twin / 3))).then_some([h / 3, twin / 3])
    })
}

/// Length of the base edge of a half-edge, scene units.
fn edge_length(base: &Base, h: u32) -> f64 {
    let path = &base.edges[base.triangle_edges[h as usize / 3][h as usize % 3] as usize].path;
    let at = |v: u32| base.surface.positions[v as usize];
    path.windows(2).map(|w| at(w[0]).distance(at(w[1]))).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// The choice of patches as the solver sees it.
struct Problem {
    patches: Vec<Patch>,
    choices: Vec<Choice>,
    goals: Vec<Goal>,
    neighbours: Vec<Vec<u32>>,
    /// Triangles that are in no patch yet.
    bare: Vec<u32>,
    start: Vec<u32>,
}

impl Problem {
    fn new(
        base: &Base,
        measures: &Measures,
        most: usize,
        given: Given<'_>,
        monitor: &Monitor,
    ) -> Result<Self, LayoutError> {
        let (patches, mut choices): (Vec<Patch>, Vec<Choice>) =
            candidates(base, measures, most, given, monitor)?.into_iter().unzip();
        let is_bare = given.is_bare(base);
        let mut on_border = vec![false; base.vertices.len()];
        let mut neighbours = vec![Vec::new(); base.triangles.len()];
        for (h, &twin) in measures.twins.iter().enumerate() {
            if twin == NONE {
                for k in [h % 3, (h + 1) % 3] {
                    on_border[base.triangles[h / 3][k] as usize] = true;
                }
            } else if !measures.rails[base.triangle_edges[h / 3][h % 3] as usize] && is_bare[twin as usize / 3] {
                neighbours[h / 3].push(twin / 3);
            }
        }
        let goal = |sector: &Sector| {
            // Two quads alone at a vertex would share two edges.
            let least_at_vertex = if on_border[sector.vertex as usize] { 1 } else { 3 };
            // A quad with a straight corner between features stays flat there, whatever moves.
            let least = (sector.ideal + STRAIGHT).floor().max(1.0) as i32;
            Goal { vertex: sector.vertex, ideal: sector.ideal, least, least_at_vertex }
        };
        let goals = measures.sectors.iter().map(goal).collect();
        // Each triangle by itself is always a way, but for forced pairs.
        let mut start: Vec<u32> = (0..choices.len() as u32)
            .filter(|&c| {
                let (Choice { triangles, .. }, patch) = (&choices[c as usize], &patches[c as usize]);
                let is_forced = given.forced.iter().any(|pair| pair.contains(&triangles[0]));
                patch.corners.len() == patch.border.len() && triangles.len() == if is_forced { 2 } else { 1 }
            })
            .collect();
        for patch in given.kept {
            start.push(choices.len() as u32);
            choices.push(Choice { triangles: patch.triangles.clone(), cost: 0.0, quads: quads_at(measures, patch) });
        }
        let bare = (0..is_bare.len() as u32).filter(|&t| is_bare[t as usize]).collect();
        Ok(Self { patches, choices, goals, neighbours, bare, start })
    }

    fn solve(&self, run: u64, monitor: &Monitor) -> Result<Vec<u32>, LayoutError> {
        Ok(anneal::choose(&self.choices, &self.bare, &self.neighbours, &self.goals, &self.start, run, monitor)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bases::{all, base, octahedron, tetrahedron};
    use mesh::DVec3;

    const ANYTHING: Given<'static> = Given { forced: &[], kept: &[], straight_corners: true, off_four: 1.0 };

    /// The least cost of a pick, by trying all: squared misses of the sectors and what the patches cost.
    fn least(choices: &[Choice], goals: &[Goal], taken: &mut Vec<usize>, bare: &mut [bool]) -> f64 {
        let Some(t) = bare.iter().position(|&bare| bare) else {
            let mut total: f64 = taken.iter().map(|&c| choices[c].cost).sum();
            for (s, goal) in goals.iter().enumerate() {
                let at = |sector: u32| -> i32 {
                    let all = taken.iter().flat_map(|&c| &choices[c].quads);
                    all.filter(|q| q.0 == sector).map(|q| q.1).sum()
                };
                let same = (0..goals.len()).filter(|&o| goals[o].vertex == goal.vertex);
                let whole: i32 = same.map(|o| at(o as u32)).sum();
                let quads = at(s as u32);
                let missing = (goal.least - quads).max(0) + (goal.least_at_vertex - whole).max(0);
                total += anneal::MISSING * f64::from(missing);
                total += (f64::from(quads) - goal.ideal).powi(2);
            }
            return total;
        };
        let mut best = f64::INFINITY;
        for (c, choice) in choices.iter().enumerate() {
            let own = &choice.triangles;
            if own.contains(&(t as u32)) && own.iter().all(|&t| bare[t as usize]) {
                for &t in own {
                    bare[t as usize] = false;
                }
                taken.push(c);
                best = best.min(least(choices, goals, taken, bare));
                taken.pop();
                for &t in own {
                    bare[t as usize] = true;
                }
            }
        }
        best
    }

    #[test]
    fn the_search_finds_the_best_pick_of_tiny_bases() {
        for (base, most) in [
            (base(&octahedron(), 4, 4.0, &DVec3::normalize), 2),
            (base(&tetrahedron(), 4, 0.5, &|p| p), 3),
            (base(&tetrahedron(), 4, 4.0, &DVec3::normalize), 3),
            (base(&testkit::shapes::sheet(2, 1), 4, 4.0, &|p| p), 3),
        ] {
            let measures = Measures::new(&base).unwrap();
            let problem = Problem::new(&base, &measures, most, ANYTHING, &Monitor::new()).unwrap();
            let taken = problem.solve(0, &Monitor::new()).unwrap();
            let count = base.triangles.len();
            let found = anneal::cost(&problem.choices, count, &problem.goals, &taken);
            let best = least(&problem.choices, &problem.goals, &mut vec![], &mut vec![true; count]);
            assert!((found - best).abs() < 1e-9, "{found} {best}");
        }
    }

    #[test]
    fn every_triangle_is_in_one_patch_and_no_patch_crosses_a_feature() {
        for (name, base) in all() {
            let measures = Measures::new(&base).unwrap();
            for pairing in [Pairing::PAPER, Pairing::default()] {
                let patches = pair(&base, &measures, pairing, ANYTHING, &Monitor::new()).unwrap();
                let mut seen = vec![0; base.triangles.len()];
                patches.iter().flat_map(|p| &p.triangles).for_each(|&t| seen[t as usize] += 1);
                assert!(seen.iter().all(|&n| n == 1), "{name}");
                for patch in &patches {
                    let rim: Vec<u32> =
                        patch.border.iter().map(|&h| base.triangle_edges[h as usize / 3][h as usize % 3]).collect();
                    let all = patch.triangles.iter().flat_map(|&t| base.triangle_edges[t as usize]);
                    assert!(all.filter(|&e| measures.rails[e as usize]).all(|e| rim.contains(&e)), "{name}");
                    assert_eq!(patch.border.len(), patch.triangles.len() + 2);
                }
            }
        }
    }
}
