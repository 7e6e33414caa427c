//! Local search by whole walks: counts change by one along a row of patches, from border to border or round to where it began.
//!
//! What single steps cannot reach. A walk enters a patch over one sub-side and leaves it over another, and the counts of both change
//! by one, up or down, so that every perimeter stays even; straight through a regular four-sided patch it keeps it regular. Walks
//! that lower the energy are negative cycles of a graph whose nodes are sub-sides, seen from the patch ahead, each with a sign;
//! they are found by Bellman and Ford's relaxation and taken where the energy falls as promised. Such walks are the augmenting
//! ones of bidirected flows with convex costs, which counts along the rows of a layout are.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::energy::{Condition, Part, Penalties, conditions};
use super::{Layout, MOST, Options};
use mesh::NONE;
use solve::{CancelCheck, SolveError};

/// An improvement must exceed this, so that rounding errors cannot make the search circle.
const LEAST_GAIN: f64 = 1e-9;
/// Rounds of relaxation in which a walk that gains is looked for.
const ROUNDS: usize = 64;
/// Walks in a row that do not gain what they promise, because they cross a patch twice, before the search ends.
const MOST_FAILURES: usize = 30;

/// A free sub-side in a patch, or outside of the layout behind a sub-side of its border.
struct Use {
    sub_side: u32,
    /// The patch, or [`NONE`] outside.
    patch: u32,
    side: usize,
    /// The sub-side's use on its other side.
    across: u32,
}

/// The graph of walks: a node for each use and sign, where a walk has just come over the sub-side into the patch and changed its count
/// by one, down for even nodes; and one for the outside of the layout.
struct Search<'a> {
    layout: &'a Layout,
    penalties: &'a Penalties,
    options: &'a Options,
    uses: Vec<Use>,
    /// The uses of each patch.
    of_patch: Vec<Range<usize>>,
    /// For each patch how much its conditions rise when two of its sides change by one: by sides and signs.
    rises: Vec<Vec<f64>>,
    /// For each sub-side how much its isometry rises when it shrinks or grows by one.
    steps: Vec<[f64; 2]>,
    perimeters: Vec<i64>,
    /// Uses that may not follow each other.
    banned: BTreeSet<[u32; 2]>,
}

/// Takes walks that lower the energy until none is found.
pub(super) fn descend(
    layout: &Layout,
    penalties: &Penalties,
    options: &Options,
    counts: &mut [u32],
    cancelled: CancelCheck<'_>,
) -> Result<(), SolveError> {
    let mut search = Search::new(layout, penalties, options, counts);
    let mut failures = 0;
    while failures < MOST_FAILURES {
        if cancelled() {
            return Err(SolveError::Cancelled);
        }
        let found = search.walks();
        if found.is_empty() {
            break;
        }
        let mut gained = false;
        for walk in &found {
            gained |= search.take(walk, counts);
        }
        if gained {
            failures = 0;
            search.banned.clear();
        } else {
            failures += 1;
            for walk in &found {
                search.ban(walk);
            }
        }
    }
    Ok(())
}

impl<'a> Search<'a> {
    fn new(layout: &'a Layout, penalties: &'a Penalties, options: &'a Options, counts: &[u32]) -> Self {
        let mut uses: Vec<Use> = vec![];
        let mut of_patch = vec![];
        let mut open: Vec<u32> = vec![NONE; layout.sub_sides.len()];
        for (patch, given) in (0..).zip(&layout.patches) {
            let from = uses.len();
            for (side, sub_sides) in given.sides.iter().enumerate() {
                for &sub_side in sub_sides.iter().filter(|s| layout.sub_sides[**s as usize].fixed.is_none()) {
                    let own = uses.len() as u32;
                    let across = std::mem::replace(&mut open[sub_side as usize], own);
                    if across != NONE {
                        uses[across as usize].across = own;
                        open[sub_side as usize] = NONE;
                    }
                    uses.push(Use { sub_side, patch, side, across });
                }
            }
            of_patch.push(from..uses.len());
        }
        for index in 0..uses.len() {
            if uses[index].across == NONE {
                uses[index].across = uses.len() as u32;
                uses.push(Use { sub_side: uses[index].sub_side, patch: NONE, side: 0, across: index as u32 });
            }
        }
        let mut search = Self {
            layout,
            penalties,
            options,
            uses,
            of_patch,
            rises: vec![vec![]; layout.patches.len()],
            steps: vec![[0.0; 2]; counts.len()],
            perimeters: vec![0; layout.patches.len()],
            banned: BTreeSet::new(),
        };
        (0..layout.patches.len()).for_each(|patch| search.look_at_patch(patch, counts));
        (0..counts.len()).for_each(|sub_side| search.look_at_sub_side(sub_side, counts));
        search
    }

    /// Finds anew what changes of two sides of a patch would cost.
    fn look_at_patch(&mut self, patch: usize, counts: &[u32]) {
        let sides = &self.layout.patches[patch].sides;
        let n = sides.len();
        let mut sums: Vec<i64> =
            sides.iter().map(|side| side.iter().map(|&s| i64::from(counts[s as usize])).sum()).collect();
        self.perimeters[patch] = sums.iter().sum();
        let all: Vec<(Condition, f64)> = conditions(n, self.options).collect();
        let cost = |sums: &[i64]| -> f64 {
            let one = |(condition, weight): &(Condition, f64)| {
                let value: i64 = sums.iter().zip(condition.factors).map(|(sum, &f)| sum * i64::from(f)).sum();
                weight * condition.part.measure(value as f64 - condition.target, self.options.norm)
            };
            all.iter().map(one).sum()
        };
        let now = cost(&sums);
        let mut rises = vec![];
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
            for (s, t) in [(-1, -1), (-1, 1), (1, -1), (1, 1)] {
                sums[a] += s;
                sums[b] += t;
                rises.push(cost(&sums) - now);
                sums[a] -= s;
                sums[b] -= t;
            }
        }
        self.rises[patch] = rises;
    }

    /// Finds anew what it costs that a sub-side shrinks or grows by one.
    fn look_at_sub_side(&mut self, sub_side: usize, counts: &[u32]) {
        let (count, least) = (i64::from(counts[sub_side]), i64::from(self.layout.sub_sides[sub_side].least));
        self.steps[sub_side] = [-1, 1].map(|step| {
            if !(least..=i64::from(MOST)).contains(&(count + step)) {
                return f64::INFINITY;
            }
            let own = self.penalties.of_sub_side[sub_side].iter().map(|&index| &self.penalties.all[index]);
            let isometry = own.filter(|penalty| penalty.part == Part::Isometry);
            isometry.map(|penalty| penalty.cost(count + step) - penalty.cost(count)).sum()
        });
    }

    /// Walks that promise to lower the energy, as nodes, each in one of them at most.
    fn walks(&self) -> Vec<Vec<u32>> {
        let outside = 2 * self.uses.len();
        let mut least = vec![0.0; outside + 1];
        let mut before = vec![NONE; outside + 1];
        let mut is_open = vec![true; outside + 1];
        let border = |own: &Use| own.patch != NONE && self.uses[own.across as usize].patch == NONE;
        for _ in 0..ROUNDS {
            let mut is_next = vec![false; outside + 1];
            for node in (0..=outside).filter(|node| is_open[*node]) {
                let so_far = least[node];
                let mut relax = |to: usize, cost: f64| {
                    if so_far + cost < least[to] - LEAST_GAIN {
                        least[to] = so_far + cost;
                        before[to] = node as u32;
                        is_next[to] = true;
                    }
                };
                let (index, sign) = (node / 2, node % 2);
                if node == outside {
                    for (to, own) in self.uses.iter().enumerate().filter(|(_, own)| border(own)) {
                        (0..2).for_each(|sign| relax(2 * to + sign, self.steps[own.sub_side as usize][sign]));
                    }
                    continue;
                }
                let Use { patch, side, sub_side, .. } = self.uses[index];
                if patch == NONE {
                    relax(outside, 0.0);
                    continue;
                }
                let patch = patch as usize;
                let sides = self.layout.patches[patch].sides.len();
                for (over, other) in self.of_patch[patch].clone().zip(&self.uses[self.of_patch[patch].clone()]) {
                    if other.sub_side == sub_side || self.banned.contains(&[index as u32, over as u32]) {
                        continue;
                    }
                    for to in 0..2 {
                        let cost = self.rises[patch][(side * sides + other.side) * 4 + 2 * sign + to]
                            + self.steps[other.sub_side as usize][to];
                        if cost.is_finite() && (sign + to > 0 || self.perimeters[patch] >= 6) {
                            relax(2 * other.across as usize + to, cost);
                        }
                    }
                }
            }
            let found = cycles(&before);
            if !found.is_empty() {
                return found;
            }
            if !is_next.contains(&true) {
                break;
            }
            is_open = is_next;
        }
        vec![]
    }

    /// Changes counts along a walk if the energy falls.
    fn take(&mut self, walk: &[u32], counts: &mut [u32]) -> bool {
        let mut changes: BTreeMap<usize, i64> = BTreeMap::new();
        let mut patches = BTreeSet::new();
        for node in walk.iter().filter(|node| self.is_inside(**node)) {
            let own = &self.uses[*node as usize / 2];
            *changes.entry(own.sub_side as usize).or_default() += i64::from(node % 2) * 2 - 1;
            patches.extend([own.patch, self.uses[own.across as usize].patch]);
        }
        patches.remove(&NONE);
        let after = |s: usize, change: i64, counts: &[u32]| i64::from(counts[s]) + change;
        let range = |s: usize| i64::from(self.layout.sub_sides[s].least)..=i64::from(MOST);
        if changes.iter().any(|(&s, &change)| !range(s).contains(&after(s, change, counts))) {
            return false;
        }
        let concerned: BTreeSet<usize> =
            changes.keys().flat_map(|&s| self.penalties.of_sub_side[s].iter().copied()).collect();
        let energy = |counts: &[u32]| -> f64 {
            let cost = |index: &usize| self.penalties.all[*index].cost(self.penalties.all[*index].value(counts));
            concerned.iter().map(cost).sum()
        };
        let perimeter = |patch: u32, counts: &[u32]| -> u64 {
            self.layout.patches[patch as usize].sides.iter().flatten().map(|&s| u64::from(counts[s as usize])).sum()
        };
        let before = energy(counts);
        for (&s, &change) in &changes {
            counts[s] = after(s, change, counts) as u32;
        }
        if energy(counts) > before - LEAST_GAIN || patches.iter().any(|&patch| perimeter(patch, counts) < 4) {
            for (&s, &change) in &changes {
                counts[s] = after(s, -change, counts) as u32;
            }
            return false;
        }
        for patch in patches {
            self.look_at_patch(patch as usize, counts);
        }
        for s in changes.into_keys() {
            self.look_at_sub_side(s, counts);
        }
        true
    }

    /// Bans the first way of a walk through a patch, for it crosses one twice.
    fn ban(&mut self, walk: &[u32]) {
        let steps = walk.iter().zip(walk.iter().cycle().skip(1));
        let mut inside = steps.filter(|(node, next)| self.is_inside(**node) && self.is_inside(**next));
        if let Some((node, next)) = inside.next() {
            let way = [node / 2, self.uses[*next as usize / 2].across];
            self.banned.insert(way);
        }
    }

    fn is_inside(&self, node: u32) -> bool {
        (node as usize) < 2 * self.uses.len()
    }
}

/// The cycles of a graph where each node has one before it or none, each from one of its nodes on forwards.
fn cycles(before: &[u32]) -> Vec<Vec<u32>> {
    let mut seen = vec![NONE; before.len()];
    let mut cycles = vec![];
    for start in 0..before.len() as u32 {
        let mut node = start;
        while node != NONE && seen[node as usize] == NONE {
            seen[node as usize] = start;
            node = before[node as usize];
        }
        if node == NONE || seen[node as usize] != start {
            continue;
        }
        let mut cycle = vec![node];
        let mut at = before[node as usize];
        while at != node {
            cycle.push(at);
            at = before[at as usize];
        }
        cycle.reverse();
        cycles.push(cycle);
    }
    cycles
}
