//! Which quads stay as they are.

use mesh::{NONE, Topology};
use std::collections::{BTreeMap, BTreeSet};

/// Quads that stay as they are.
pub(super) struct Stay<'a> {
    pub quads: Vec<bool>,
    corners: &'a [[u32; 4]],
    topology: Topology,
}

impl<'a> Stay<'a> {
    pub fn new(vertices: usize, corners: &'a [[u32; 4]]) -> Self {
        Self { quads: vec![false; corners.len()], corners, topology: Topology::new(vertices, corners) }
    }

    pub fn count(&self) -> usize {
        self.quads.iter().filter(|stays| **stays).count()
    }

    /// More quads stay: these, and so many rings around them. What remains is manifold.
    pub fn grow(&mut self, seeds: &[usize], rings: usize) {
        let mut more = vec![false; self.quads.len()];
        for &q in seeds {
            more[q] = true;
        }
        for _ in 0..rings {
            let reached: Vec<usize> = (0..more.len()).filter(|q| more[*q]).collect();
            for v in reached.into_iter().flat_map(|q| self.corners[q]) {
                self.around(v).for_each(|q| more[q] = true);
            }
        }
        self.quads.iter_mut().zip(more).for_each(|(stays, more)| *stays |= more);
        // Notches would be corners of what remains, and quads that meet at a vertex only would not be manifold.
        loop {
            let fill: Vec<usize> = (0..self.quads.len())
                .filter(|&q| !self.quads[q] && self.across(q).filter(|&other| self.quads[other]).count() > 1)
                .collect();
            for &q in &fill {
                self.quads[q] = true;
            }
            let pinched: Vec<u32> = (0..self.topology.outgoing.len() as u32).filter(|&v| self.fans(v) > 1).collect();
            if fill.is_empty() && pinched.is_empty() {
                break;
            }
            for v in pinched {
                for q in self.around(v).collect::<Vec<_>>() {
                    self.quads[q] = true;
                }
            }
        }
    }

    /// Of each stretch of connected quads the one with the greatest value.
    pub fn farthest(&self, values: &BTreeMap<usize, f64>) -> Vec<usize> {
        let mut seen = BTreeSet::new();
        let mut farthest = vec![];
        for &first in values.keys() {
            if seen.contains(&first) {
                continue;
            }
            let mut stack = vec![first];
            let mut best = first;
            while let Some(q) = stack.pop() {
                if !seen.insert(q) {
                    continue;
                }
                if values[&q] > values[&best] {
                    best = q;
                }
                stack.extend(self.across(q).filter(|other| values.contains_key(other)));
            }
            farthest.push(best);
        }
        farthest
    }

    /// The quads at a vertex.
    fn around(&self, v: u32) -> impl Iterator<Item = usize> + '_ {
        self.topology.around(v).map(|h| h as usize / 4)
    }

    /// The quads across the edges of one.
    fn across(&self, q: usize) -> impl Iterator<Item = usize> + '_ {
        self.topology.twin[4 * q..4 * q + 4].iter().filter(|twin| **twin != NONE).map(|twin| *twin as usize / 4)
    }

    /// Fans of quads around a vertex that do not stay.
    fn fans(&self, v: u32) -> usize {
        let around: Vec<bool> = self.around(v).map(|q| self.quads[q]).collect();
        let starts = (1..around.len()).filter(|&k| !around[k] && around[k - 1]).count();
        let first = around.first().is_some_and(|stays| !stays);
        let is_joined = !self.topology.is_border_vertex(v) && around.last().is_some_and(|stays| !stays);
        starts + usize::from(first && !(is_joined && starts > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of so many quads each way.
    fn grid(n: u32) -> Vec<[u32; 4]> {
        let at = |x: u32, y: u32| y * (n + 1) + x;
        (0..n * n)
            .map(|q| (q % n, q / n))
            .map(|(x, y)| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)])
            .collect()
    }

    #[test]
    fn what_remains_is_manifold_without_notches() {
        let quads = grid(12);
        let mut stay = Stay::new(13 * 13, &quads);
        stay.grow(&[3 * 12 + 3], 1);
        assert_eq!(stay.count(), 9);
        // Two blocks that would meet at a vertex, and one with a notch between it and the border.
        stay.grow(&[6 * 12 + 6, 12 * 11 + 9], 1);
        assert!((0..13 * 13).all(|v| stay.fans(v) <= 1));
        for q in (0..144).filter(|&q| !stay.quads[q]) {
            assert!(stay.across(q).filter(|&other| stay.quads[other]).count() < 2, "{q}");
        }
        assert!(stay.count() > 18 && stay.count() < 72);
    }

    #[test]
    fn the_farthest_quad_of_each_stretch_is_found() {
        let quads = grid(6);
        let stay = Stay::new(49, &quads);
        let values = BTreeMap::from([(0, 1.0), (1, 3.0), (2, 2.0), (20, 1.5), (35, 4.0), (34, 4.5)]);
        assert_eq!(stay.farthest(&values), [1, 20, 34]);
    }
}
