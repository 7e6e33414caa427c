//! Chords: rows of base edges that four-sided patches link side by side, and the best places to cut them.
//!
//! A chord with one count leaves all its patches regular. It is cut where the lengths along it differ so much that
//! two irregular vertices (what a patch with unequal opposite sides needs, however unequal) are worth less than the
//! quads they save from distortion. The best cuts of a chord are found exactly, by dynamic programming over its edges.

use crate::patch::Patch;

/// Pairs of opposite sides of a four-sided patch that are one half-edge each.
pub(crate) fn opposite(patch: &Patch) -> impl Iterator<Item = (u32, u32)> + '_ {
    let sides: Vec<&[u32]> = patch.sides().collect();
    let pairs = if sides.len() == 4 && patch.template.is_none() {
        vec![(sides[0], sides[2]), (sides[1], sides[3])]
    } else {
        vec![]
    };
    pairs.into_iter().filter_map(|(a, b)| match (a, b) {
        (&[a], &[b]) => Some((a, b)),
        _ => None,
    })
}

/// Base edges in the order in which a chord crosses them.
pub(crate) struct Chord {
    pub edges: Vec<u32>,
    /// Whether the last is linked to the first.
    pub closed: bool,
}

/// Walks the links: paths from their ends, then cycles. Edges inside patches belong to no chord.
pub(crate) fn chords(links: &[Vec<u32>], areas: &[f64]) -> Vec<Chord> {
    let mut seen: Vec<bool> = areas.iter().map(|&area| area <= 0.0).collect();
    let mut chords = Vec::new();
    for ends in [true, false] {
        for start in 0..links.len() {
            if seen[start] || (ends && links[start].len() > 1) {
                continue;
            }
            let mut edges = Vec::new();
            let mut at = Some(start as u32);
            while let Some(edge) = at {
                seen[edge as usize] = true;
                edges.push(edge);
                at = links[edge as usize].iter().copied().find(|&next| !seen[next as usize]);
            }
            chords.push(Chord { closed: !ends && edges.len() > 1, edges });
        }
    }
    chords
}

/// An edge that a chord crosses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    pub weight: f64,
    pub value: f64,
    /// The least value that will do, if there is one.
    pub least: Option<f64>,
}

/// Sums over a run of terms that get one value.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Run {
    pub weight: f64,
    first: f64,
    second: f64,
    pub least: Option<f64>,
}

impl Run {
    pub fn add(&mut self, term: &Term) {
        self.weight += term.weight;
        self.first += term.weight * term.value;
        self.second += term.weight * term.value * term.value;
        if let Some(wanted) = term.least {
            self.least = Some(self.least.map_or(wanted, |least| least.max(wanted)));
        }
    }

    pub fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.first / self.weight } else { 0.0 }
    }

    /// The mean, or the greatest of the least values where that is more.
    pub fn value(&self) -> f64 {
        self.least.map_or(self.mean(), |least| least.max(self.mean()))
    }

    /// The weighted squared deviations from it.
    fn spread(&self) -> f64 {
        let value = self.value();
        (self.second - 2.0 * value * self.first + value * value * self.weight).max(0.0)
    }
}

/// Splits a row into runs that get one value each: least sum of their spreads plus `price` for each split. A closed row
/// may be split between its ends too. Exact for open rows, O(n²); a closed row is opened at its widest gap.
pub(crate) fn cut(terms: &[Term], closed: bool, price: f64) -> Vec<Vec<usize>> {
    let n = terms.len();
    let turn = if closed {
        let gap = |i: usize| (terms[i].value - terms[(i + n - 1) % n].value).abs();
        (0..n).fold(0, |best, i| if gap(i) > gap(best) { i } else { best })
    } else {
        0
    };
    let order: Vec<usize> = (0..n).map(|i| (i + turn) % n).collect();
    let mut best: Vec<(f64, usize)> = vec![(0.0, 0)];
    for to in 1..=n {
        let mut run = Run::default();
        let mut found = (f64::INFINITY, 0);
        for from in (0..to).rev() {
            run.add(&terms[order[from]]);
            // Opening a closed row is a split too, unless it stays whole.
            let split = if from > 0 || (closed && to < n) { price } else { 0.0 };
            let cost = best[from].0 + run.spread() + split;
            if cost < found.0 {
                found = (cost, from);
            }
        }
        best.push(found);
    }
    let (mut runs, mut to) = (Vec::new(), n);
    while to > 0 {
        let from = best[to].1;
        runs.push(order[from..to].to_vec());
        to = from;
    }
    runs.reverse();
    runs
}

#[cfg(test)]
#[path = "chords_tests.rs"]
mod tests;
