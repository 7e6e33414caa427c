//! Vertices where a curve bends.
//!
//! Vertices slide along borders to wherever their tiles become regular, and the edges between them are chords: where a border of a few long
//! edges bends, or rounds a hole, a chord may cut off what there is to see of it. So where chords are too far from their curve, vertices are
//! put where they are near, in the order they have, and the rest is shaped around them. Which places these are is found by dynamic
//! programming along each chain of vertices, from the steps between them, the way to where they were, and the distance of the curve from
//! the chords. The paper, whose borders are smooth and whose patches end at all corners, has no need of it.

use super::curve::{Curve, off_segment};
use super::room::Chain;

/// Distance of a curve from the chord of an edge, in edges, above which vertices are put elsewhere, and that which they are put for.
const MOST_OFF: f64 = 0.04;
const AIM: f64 = 0.03;

/// As much is enough to be looked for with so many edges.
const ENOUGH: f64 = 0.042;

/// Up to so many steps along a curve are counted one by one.
const FEW_STEPS: usize = 16;

/// Points of a curve that are this near to the line between others make no bend, in edges.
const STRAIGHT: f64 = 0.005;

/// Places looked at are so far apart, and so far from where a vertex was at most, in edges.
const APART: f64 = 0.1;
const FAR: f64 = 0.9;

/// The shortest step, in mean ones.
const SHORTEST: f64 = 0.5;

/// Weights of what a curve is off its chord, above the aim, and of the way from where a vertex was, squared, in edges and in mean steps. That
/// of unequal steps, squared, is 1.
const OFF: f64 = 3000.0;
const WAY: f64 = 0.2;

/// A curve unrolled so far that all of a chain has one length each.
struct Unrolled<'a> {
    curve: &'a Curve,
    knots: Vec<f64>,
    /// Length of an edge, and of a mean step of the chain.
    edge: f64,
    step: f64,
}

/// Better places for the vertices of a chain, as lengths along its curve, where this is too far from the chords between them; `edge` is the
/// mean edge. O(n) in the vertices and the bends of the curve.
pub(super) fn put_on_bends(
    chain: &Chain,
    curve: &Curve,
    edge: f64,
    at: impl Fn(u32) -> mesh::DVec3,
) -> Option<Vec<(u32, f64)>> {
    let whole = curve.length();
    let [low, high] = chain.stretch.unwrap_or([0.0, whole]);
    let mut vertices = chain.vertices.clone();
    let along = |v: u32| {
        let length = curve.length_at(curve.project(at(v)));
        if length < low && high > whole { length + whole } else { length.clamp(low, high) }
    };
    let mut lengths: Vec<f64> = vertices.iter().map(|&v| along(v)).collect();
    // Whether most steps go backwards; all round, one step passes the start of the curve.
    let backwards = lengths.windows(2).filter(|w| w[1] < w[0]).count();
    if 2 * backwards > lengths.len().saturating_sub(1) {
        vertices.reverse();
        lengths.reverse();
    }
    if chain.stretch.is_none() {
        let first = (0..lengths.len()).min_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))?;
        vertices.rotate_left(first);
    }
    lengths.sort_by(f64::total_cmp);
    if let Some(stretch) = chain.stretch {
        let ends = [stretch[0]].into_iter().chain(lengths).chain([stretch[1]]).collect::<Vec<f64>>();
        let unrolled = Unrolled::new(curve, edge, &ends);
        if unrolled.most_off(&ends) <= MOST_OFF {
            return None;
        }
        let lengths = unrolled.best(&ends)?;
        return Some(vertices.into_iter().zip(lengths[1..].iter().copied()).collect());
    }
    let round = [lengths.clone(), vec![lengths[0] + whole]].concat();
    let unrolled = Unrolled::new(curve, edge, &round);
    if unrolled.most_off(&round) <= MOST_OFF {
        return None;
    }
    let lengths = unrolled.best_round(lengths)?;
    Some(vertices.into_iter().zip(lengths).collect())
}

/// About the least number of steps along a curve, of so many edges each, with which it is near its chords; as many as the least allowed, where
/// the most are not enough. The curve goes all round where it has no corner at its start.
pub(super) fn steps_wanted(curve: &Curve, edge: f64, is_round: bool, step_edges: usize, allowed: [usize; 2]) -> usize {
    let first = Unrolled::new(curve, edge, &[0.0, curve.length()]);
    let is_enough = |steps: usize| {
        let count = steps * step_edges;
        let even: Vec<f64> = (0..=count).map(|k| curve.length() * k as f64 / count as f64).collect();
        let unrolled = first.for_steps(&even);
        unrolled.most_off(&even) <= MOST_OFF || {
            let best = if is_round { unrolled.best_round(even[..count].to_vec()) } else { unrolled.best(&even) };
            let ends =
                |best: Vec<f64>| if is_round { [best.clone(), vec![best[0] + curve.length()]].concat() } else { best };
            best.is_some_and(|best| unrolled.most_off(&ends(best)) <= ENOUGH)
        }
    };
    let [least, most] = allowed;
    if is_enough(least) || !is_enough(most) {
        return least;
    }
    let mut steps = least;
    while !is_enough(steps) {
        // One by one where they are few.
        steps = (steps + 1 + steps / FEW_STEPS).min(most);
    }
    steps
}

fn mean_step(lengths: &[f64]) -> f64 {
    let steps = lengths.len() - 1;
    (lengths[steps] - lengths[0]) / steps as f64
}

impl<'a> Unrolled<'a> {
    /// For vertices at these lengths, the ends with them.
    fn new(curve: &'a Curve, edge: f64, lengths: &[f64]) -> Self {
        let knots = curve.knots(STRAIGHT * edge);
        let turns = if curve.is_closed() { 3 } else { 1 };
        let unrolled = (0..turns).flat_map(|k| knots.iter().map(move |knot| knot + f64::from(k) * curve.length()));
        let mut unrolled: Vec<f64> = unrolled.collect();
        unrolled.dedup();
        Self { curve, knots: unrolled, edge, step: mean_step(lengths) }
    }

    /// The same for other vertices.
    fn for_steps(&self, lengths: &[f64]) -> Unrolled<'a> {
        Unrolled { knots: self.knots.clone(), step: mean_step(lengths), ..*self }
    }

    /// How far the curve between two lengths is from the line between its points there, in edges.
    fn off(&self, a: f64, b: f64) -> f64 {
        if b <= a {
            return 0.0;
        }
        let [from, to] = [a, b].map(|length| self.curve.point_at(length).0);
        let inner = self.knots.partition_point(|&knot| knot <= a)..self.knots.partition_point(|&knot| knot < b);
        let far = self.knots[inner].iter().map(|&knot| off_segment(self.curve.point_at(knot).0, from, to));
        far.fold(0.0, f64::max) / self.edge
    }

    fn most_off(&self, lengths: &[f64]) -> f64 {
        lengths.windows(2).map(|w| self.off(w[0], w[1])).fold(0.0, f64::max)
    }

    fn cost(&self, a: f64, b: f64) -> f64 {
        let step = (b - a) / self.step;
        if step < SHORTEST {
            return f64::INFINITY;
        }
        (step - 1.0).powi(2) + OFF * (self.off(a, b) - AIM).max(0.0).powi(2)
    }

    /// The best places all round: with the first as it is, then with the one farthest from that.
    fn best_round(&self, mut lengths: Vec<f64>) -> Option<Vec<f64>> {
        let whole = self.curve.length();
        for half in [lengths.len() / 2, lengths.len() - lengths.len() / 2] {
            lengths.push(lengths[0] + whole);
            lengths = self.best(&lengths)?;
            lengths.pop();
            for length in &mut lengths[..half] {
                *length += whole;
            }
            lengths.rotate_left(half);
        }
        // Both halves were taken round once.
        Some(lengths.into_iter().map(|length| length - whole).collect())
    }

    /// The best places, the first and last as they are.
    fn best(&self, lengths: &[f64]) -> Option<Vec<f64>> {
        let (low, high) = (lengths[0], lengths[lengths.len() - 1]);
        let places: Vec<Vec<f64>> = (0..lengths.len())
            .map(|k| {
                if k == 0 || k + 1 == lengths.len() {
                    return vec![lengths[k]];
                }
                // The last of so many steps, and the first after as many, keep the least distance from the ends.
                let least = [k, lengths.len() - 1 - k].map(|steps| SHORTEST * self.step * steps as f64);
                let from = (lengths[k] - FAR * self.edge).clamp(low + least[0], high - least[1]);
                let to = (lengths[k] + FAR * self.edge).clamp(from, high - least[1]);
                let count = ((to - from) / (APART * self.edge)).floor().max(0.0) as usize;
                let even = (0..=count).map(|j| from + j as f64 * APART * self.edge);
                let knots = &self.knots
                    [self.knots.partition_point(|&knot| knot < from)..self.knots.partition_point(|&knot| knot <= to)];
                let mut all: Vec<f64> = even.chain(knots.iter().copied()).chain([lengths[k].clamp(from, to)]).collect();
                all.sort_by(f64::total_cmp);
                all.dedup();
                all
            })
            .collect();
        // Of each place the least cost to come there, and from where.
        let mut reached: Vec<Vec<(f64, usize)>> = vec![vec![(0.0, 0)]];
        for k in 1..lengths.len() {
            let before = &reached[k - 1];
            let come = |&to: &f64| {
                let way = if k + 1 == lengths.len() { 0.0 } else { WAY * ((to - lengths[k]) / self.step).powi(2) };
                let from = (0..before.len()).map(|j| (before[j].0 + self.cost(places[k - 1][j], to) + way, j));
                from.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0))
            };
            reached.push(places[k].iter().map(come).collect());
        }
        let mut k = reached.len() - 1;
        let mut here = 0;
        if !reached[k][here].0.is_finite() {
            return None;
        }
        let mut found = vec![high];
        while k > 0 {
            here = reached[k][here].1;
            k -= 1;
            found.push(places[k][here]);
        }
        found.reverse();
        Some(found)
    }
}
