//! Quick geodesic distances: Dijkstra over edges and, where two triangles unfold to a convex quadrilateral, over the other
//! diagonal too. Within a few percent on fair triangles, which is enough for placing sites and dividing curves.

use crate::split_mesh::{SplitMesh, next, prev};
use mesh::NONE;
use ordered_float::OrderedFloat;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Who can be reached from each vertex in one step, and how far it is.
#[derive(Debug, Clone)]
pub struct Metric {
    start: Vec<u32>,
    steps: Vec<(u32, f64)>,
}

impl Metric {
    /// Gathers the steps of a mesh. O(n).
    pub fn new(mesh: &SplitMesh) -> Self {
        let mut pairs: Vec<(u32, u32, f64)> = Vec::with_capacity(4 * mesh.origin.len());
        for h in 0..mesh.origin.len() as u32 {
            let t = mesh.twin[h as usize];
            if t != NONE && t < h {
                continue;
            }
            let (a, b, length) = (mesh.from(h), mesh.to(h), mesh.length(h));
            pairs.extend([(a, b, length), (b, a, length)]);
            if t == NONE {
                continue;
            }
            let (k, l) = (mesh.from(prev(h)), mesh.from(prev(t)));
            let foot = |along: f64, end: f64| (along * along - end * end + length * length) / (2.0 * length);
            let (ka, kb) = (mesh.length(prev(h)), mesh.length(next(h)));
            let (la, lb) = (mesh.length(next(t)), mesh.length(prev(t)));
            let (x, u) = (foot(ka, kb), foot(la, lb));
            let (y, w) = ((ka * ka - x * x).max(0.0).sqrt(), (la * la - u * u).max(0.0).sqrt());
            // Where the diagonal meets the edge.
            let crossing = (x * w + u * y) / (y + w);
            if crossing > 0.0 && crossing < length {
                let across = (x - u).hypot(y + w);
                pairs.extend([(k, l, across), (l, k, across)]);
            }
        }
        let mut start = vec![0_u32; mesh.positions.len() + 1];
        for &(a, ..) in &pairs {
            start[a as usize + 1] += 1;
        }
        for v in 0..mesh.positions.len() {
            start[v + 1] += start[v];
        }
        let mut place = start.clone();
        let mut steps = vec![(0, 0.0); pairs.len()];
        for (a, b, length) in pairs {
            steps[place[a as usize] as usize] = (b, length);
            place[a as usize] += 1;
        }
        Self { start, steps }
    }

    /// Vertices one step from `v`.
    pub fn steps(&self, v: u32) -> &[(u32, f64)] {
        &self.steps[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }

    /// Lowers `value` from the seeds outwards, `slope` times the length of each step more at every step, and passes the
    /// seed's mark on to every vertex it lowers. Values that are lower already stay, so calls add up.
    pub fn spread(&self, value: &mut [f64], mark: &mut [u32], seeds: &[(u32, f64, u32)], slope: f64) {
        self.spread_within(value, mark, seeds, slope, |_| true);
    }

    /// As [`Metric::spread`], over those vertices only that `inside` accepts.
    pub fn spread_within(
        &self,
        value: &mut [f64],
        mark: &mut [u32],
        seeds: &[(u32, f64, u32)],
        slope: f64,
        inside: impl Fn(u32) -> bool,
    ) {
        let mut front = BinaryHeap::new();
        for &(v, start, seed) in seeds {
            if start < value[v as usize] {
                value[v as usize] = start;
                mark[v as usize] = seed;
                front.push(Reverse((OrderedFloat(start), v)));
            }
        }
        while let Some(Reverse((OrderedFloat(distance), vertex))) = front.pop() {
            if distance > value[vertex as usize] {
                continue;
            }
            for &(w, length) in self.steps(vertex) {
                let reached = distance + slope * length;
                if reached < value[w as usize] && inside(w) {
                    value[w as usize] = reached;
                    mark[w as usize] = mark[vertex as usize];
                    front.push(Reverse((OrderedFloat(reached), w)));
                }
            }
        }
    }
}
