//! The dual of the cells as a triangulation of its own, and flips that give it better triangles.
//!
//! Daniels et al. 2011, section 4.2, take the dual as it is. Where a small feature lies among large cells the dual has
//! needles, and triangles that lie flat along a curve. The base triangulation is a coarse surface with edge lengths, so its
//! edges can be flipped as those of any intrinsic triangulation, wherever that raises the least angle, leaves features
//! alone, and joins no two base vertices twice.

use crate::base_error::RetopologyError;
use crate::cells::Cells;
use crate::split_mesh::SplitMesh;
use mesh::{NONE, sorted};
use std::collections::BTreeMap;

/// A flip must raise the least angle of its two triangles by this, radians.
const WORTHWHILE: f64 = 0.03;
/// The corners where the flipped edge ended must stay below pi by this, radians.
const CONVEX: f64 = 0.05;

/// A coarse triangulation; its edges have paths elsewhere.
#[derive(Debug, Clone)]
pub struct Dual {
    /// Base vertices of each triangle, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// Edge `k` of a triangle joins corners `k` and `k + 1`.
    pub sides: Vec<[u32; 3]>,
    /// Base vertices of each edge, the lower first.
    pub ends: Vec<[u32; 2]>,
    /// The piece of curve that an edge lies on.
    pub piece: Vec<Option<u32>>,
}

impl Dual {
    /// The dual of sound cells; edge `k` is arc `k`.
    ///
    /// # Errors
    /// [`RetopologyError::Internal`] when the cells are not sound.
    pub fn new(mesh: &SplitMesh, cells: &Cells) -> Result<Self, RetopologyError> {
        let ends: Vec<[u32; 2]> = cells.arcs.iter().map(|arc| arc.cells).collect();
        let by_ends: BTreeMap<[u32; 2], u32> = ends.iter().zip(0..).map(|(&ends, k)| (ends, k)).collect();
        let (mut triangles, mut sides) = (Vec::new(), Vec::new());
        for &t in &cells.meetings {
            let corners = [0, 1, 2].map(|k| cells.label[mesh.from(3 * t + k) as usize]);
            let mut edges = [NONE; 3];
            for k in 0..3 {
                edges[k] =
                    *by_ends.get(&sorted(corners[k], corners[(k + 1) % 3])).ok_or(RetopologyError::Internal {
                        stage: "taking the dual",
                        reason: "two cells that meet in a point have no arc",
                    })?;
            }
            triangles.push(corners);
            sides.push(edges);
        }
        Ok(Self { triangles, sides, ends, piece: cells.arcs.iter().map(|arc| arc.piece).collect() })
    }

    /// Flips edges where that is worth it, by their `lengths` with curves as their chords and along them: a strip beside an
    /// arc looks flat by chords, a cap on an arc along it, so a flip must be better by both. Returns the flips in order. The path of each
    /// edge must then be drawn anew between its new ends, through the two triangles it lies in at that moment.
    pub fn improve(&mut self, mut lengths: [Vec<f64>; 2]) -> Vec<Flip> {
        let mut at = vec![[NONE; 2]; self.ends.len()];
        for (t, sides) in self.sides.iter().enumerate() {
            for &e in sides {
                let slot = usize::from(at[e as usize][0] != NONE);
                at[e as usize][slot] = t as u32;
            }
        }
        let mut joined: BTreeMap<[u32; 2], u32> = self.ends.iter().zip(0..).map(|(&ends, k)| (ends, k)).collect();
        let mut flips = Vec::new();
        let mut waiting: Vec<u32> = (0..self.ends.len() as u32).rev().collect();
        // Each flip raises a least angle, so they end; the limit guards against rounding.
        let mut budget = 20 * self.ends.len();
        while let Some(e) = waiting.pop() {
            let [s, t] = at[e as usize];
            if self.piece[e as usize].is_some() || t == NONE || budget == 0 {
                continue;
            }
            let Some(ends) = self.new_ends(e, s, t, &joined) else { continue };
            let [by_chord, along] = [0, 1].map(|k| self.better(e, s, t, &lengths[k]));
            let Some((by_chord, along)) = by_chord.zip(along) else { continue };
            budget -= 1;
            joined.remove(&self.ends[e as usize]);
            joined.insert(ends, e);
            self.ends[e as usize] = ends;
            lengths[0][e as usize] = by_chord;
            lengths[1][e as usize] = along;
            let (i, j) = (self.place(s, e), self.place(t, e));
            let (a, b) = (self.sides[s as usize], self.sides[t as usize]);
            let (p, q) = (self.triangles[s as usize], self.triangles[t as usize]);
            let next = |k: usize| (k + 1) % 3;
            let prev = |k: usize| (k + 2) % 3;
            // s runs i, j, k and t runs j, i, l; then s runs k, i, l and t runs l, j, k.
            let (k, l) = (p[prev(i)], q[prev(j)]);
            self.triangles[s as usize] = [k, p[i], l];
            self.sides[s as usize] = [a[prev(i)], b[next(j)], e];
            self.triangles[t as usize] = [l, q[j], k];
            self.sides[t as usize] = [b[prev(j)], a[next(i)], e];
            for (edge, from, to) in [(b[next(j)], t, s), (a[next(i)], s, t)] {
                let slot = usize::from(at[edge as usize][0] != from);
                at[edge as usize][slot] = to;
            }
            flips.push(Flip { edge: e, ends });
            waiting.extend([a[prev(i)], a[next(i)], b[prev(j)], b[next(j)]]);
        }
        flips
    }

    fn place(&self, t: u32, e: u32) -> usize {
        self.sides[t as usize].iter().position(|&side| side == e).unwrap_or(0)
    }

    /// What the other diagonal of two triangles joins, unless that is joined already.
    fn new_ends(&self, e: u32, s: u32, t: u32, joined: &BTreeMap<[u32; 2], u32>) -> Option<[u32; 2]> {
        let (i, j) = (self.place(s, e), self.place(t, e));
        let ends = sorted(self.triangles[s as usize][(i + 2) % 3], self.triangles[t as usize][(j + 2) % 3]);
        (ends[0] != ends[1] && !joined.contains_key(&ends)).then_some(ends)
    }

    /// The length of the other diagonal of two triangles, when it is better.
    fn better(&self, e: u32, s: u32, t: u32, lengths: &[f64]) -> Option<f64> {
        let (i, j) = (self.place(s, e), self.place(t, e));
        let side = |t: u32, k: usize| lengths[self.sides[t as usize][k % 3] as usize];
        let c = lengths[e as usize];
        // Left: from the end of e to the apex, and back to its start; right the same, seen along e.
        let (left_end, left_start) = (side(s, i + 1), side(s, i + 2));
        let (right_start, right_end) = (side(t, j + 1), side(t, j + 2));
        let at_start = angle(left_end, left_start, c) + angle(right_end, right_start, c);
        let at_end = angle(left_start, left_end, c) + angle(right_start, right_end, c);
        if at_start.max(at_end) > std::f64::consts::PI - CONVEX {
            return None;
        }
        let across =
            (left_start.powi(2) + right_start.powi(2) - 2.0 * left_start * right_start * at_start.cos()).sqrt();
        let now = least(left_end, left_start, c).min(least(right_end, right_start, c));
        let then = least(left_start, right_start, across).min(least(left_end, right_end, across));
        (then > now + WORTHWHILE).then_some(across)
    }
}

/// An edge after its flip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flip {
    /// The edge.
    pub edge: u32,
    /// What it joins now, the lower first.
    pub ends: [u32; 2],
}

/// Angle opposite to side `a`, radians.
fn angle(a: f64, b: f64, c: f64) -> f64 {
    ((b * b + c * c - a * a) / (2.0 * b * c)).clamp(-1.0, 1.0).acos()
}

/// Least angle of a triangle.
fn least(a: f64, b: f64, c: f64) -> f64 {
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
}
