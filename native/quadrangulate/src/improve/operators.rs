//! The local operators: each replaces a disk of quads by another disk with the same rim.
//!
//! After Tarini et al., "Practical quad mesh simplification", 2010, section 3 (edge rotation, diagonal collapse, doublet removal) and
//! the inverse of the collapse, the opening. Border and feature vertices keep their identity; border and feature edges stay.

use super::editable::{Editable, Mark, valence_cost};

/// One change, named by vertices so that it can be replayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operator {
    /// The edge a-b turns one vertex round the hexagon of its two quads, counter-clockwise or clockwise.
    Rotate { a: u32, b: u32, clockwise: bool },
    /// The quad with the directed edge gone-next vanishes: its corner `gone` merges into the opposite corner.
    Collapse { gone: u32, next: u32 },
    /// The vertex `at` splits along the edges to `from` and `to`: a new vertex takes the edges strictly between them,
    /// counter-clockwise, and a new quad at-from-new-to fills the gap.
    Open { at: u32, from: u32, to: u32 },
}

impl Editable {
    /// Applies an operator and merges the doublets it leaves. Returns `None`, with nothing changed, when the result would
    /// not be a proper mesh or a protected edge would go.
    pub(super) fn apply(&mut self, operator: Operator) -> Option<Mark> {
        let mark = self.mark();
        let applied = match operator {
            Operator::Rotate { a, b, clockwise } => self.rotate(a, b, clockwise),
            Operator::Collapse { gone, next } => self.collapse(gone, next),
            Operator::Open { at, from, to } => self.open(at, from, to),
        };
        if applied.is_some() && self.remove_doublets(mark) && self.is_proper_since(mark) {
            Some(mark)
        } else {
            self.undo(mark);
            None
        }
    }

    /// The quad of a directed edge, starting with that edge.
    fn quad_from(&self, a: u32, b: u32) -> Option<(u32, [u32; 4])> {
        let (q, k) = self.directed(a, b)?;
        let quad = self.quads[q as usize]?;
        Some((q, [0, 1, 2, 3].map(|i| quad[(k + i) & 3])))
    }

    /// What an operator will add to the valence cost, when it is easy to tell: no anchored vertex and no doublet involved.
    /// Sparing the search most applications, it costs a hundredth of one.
    pub(super) fn predicted_cost(&self, operator: Operator) -> Option<i32> {
        let changes: [(u32, i32); 4] = match operator {
            Operator::Rotate { a, b, clockwise } => {
                let (_, [_, _, c, d]) = self.quad_from(a, b)?;
                let (_, [_, _, e, f]) = self.quad_from(b, a)?;
                let (from, to) = if clockwise { (d, f) } else { (c, e) };
                [(a, -1), (b, -1), (from, 1), (to, 1)]
            }
            Operator::Collapse { gone, next } => {
                let (_, [_, b, kept, d]) = self.quad_from(gone, next)?;
                let valence = self.around[gone as usize].len() as i32;
                // The vanishing vertex counts as regular afterwards.
                [(b, -1), (d, -1), (kept, valence - 2), (gone, 4 - valence)]
            }
            Operator::Open { .. } => return None,
        };
        let mut total = 0;
        for (v, change) in changes {
            let valence = self.around[v as usize].len() as i32;
            if self.anchored[v as usize] || valence + change < 3 {
                return None;
            }
            total += valence_cost(valence + change - 4) - valence_cost(valence - 4);
        }
        Some(total)
    }

    fn rotate(&mut self, a: u32, b: u32, clockwise: bool) -> Option<()> {
        if self.is_feature(a, b) {
            return None;
        }
        let (left, [_, _, c, d]) = self.quad_from(a, b)?;
        let (right, [_, _, e, f]) = self.quad_from(b, a)?;
        let surface = self.surface_of[left as usize];
        let (from, to) = if clockwise { (d, f) } else { (c, e) };
        if surface != self.surface_of[right as usize] || from == to || self.has_edge(from, to) {
            return None;
        }
        self.remove(left);
        self.remove(right);
        // The hexagon is a e f b c d, counter-clockwise.
        if clockwise {
            self.add([d, a, e, f], surface);
            self.add([f, b, c, d], surface);
        } else {
            self.add([c, d, a, e], surface);
            self.add([e, f, b, c], surface);
        }
        Some(())
    }

    fn collapse(&mut self, gone: u32, next: u32) -> Option<()> {
        if self.anchored[gone as usize] {
            return None;
        }
        let (q, [_, b, kept, d]) = self.quad_from(gone, next)?;
        let surface = self.surface_of[q as usize];
        let fan = self.around[gone as usize].clone();
        if fan.iter().any(|&p| self.surface_of[p as usize] != surface) {
            return None;
        }
        for &p in &fan {
            for w in self.quads[p as usize]? {
                // Another common neighbour would make a fin.
                if w != b && w != d && w != gone && self.has_edge(gone, w) && self.has_edge(kept, w) {
                    return None;
                }
            }
        }
        for p in fan {
            let quad = self.quads[p as usize]?;
            self.remove(p);
            if p != q {
                self.add(quad.map(|w| if w == gone { kept } else { w }), surface);
            }
        }
        Some(())
    }

    fn open(&mut self, at: u32, from: u32, to: u32) -> Option<()> {
        let (mut q, mut k) = self.directed(at, from)?;
        let surface = self.surface_of[q as usize];
        let mut between = Vec::new();
        loop {
            let quad = self.quads[q as usize]?;
            between.push((q, quad));
            let last = quad[(k + 3) & 3];
            if self.surface_of[q as usize] != surface || between.len() > self.around[at as usize].len() {
                return None;
            }
            if last == to {
                break;
            }
            if self.is_feature(at, last) {
                return None;
            }
            (q, k) = self.directed(at, last)?;
        }
        let total = self.around[at as usize].len();
        // Both halves keep three quads, the new one included; an anchored vertex may keep less of its sector.
        if between.len() < 2 || (!self.anchored[at as usize] && total - between.len() < 2) {
            return None;
        }
        let place =
            (self.positions[at as usize] * 2.0 + self.positions[from as usize] + self.positions[to as usize]) / 4.0;
        let inner: mesh::DVec3 = between
            .iter()
            .map(|(_, quad)| quad.iter().map(|&v| self.positions[v as usize]).sum::<mesh::DVec3>() / 4.0)
            .sum();
        let new = self.add_vertex((place + inner / between.len() as f64) / 2.0, self.size[at as usize]);
        for (p, quad) in between {
            self.remove(p);
            self.add(quad.map(|w| if w == at { new } else { w }), surface);
        }
        self.add([at, from, new, to], surface);
        Some(())
    }

    /// Merges the two quads at every free vertex of valence two that the last change left. False when one cannot be merged.
    fn remove_doublets(&mut self, mark: Mark) -> bool {
        for _ in 0..4 {
            let doublet = self
                .touched(mark)
                .into_iter()
                .find(|&v| !self.anchored[v as usize] && self.around[v as usize].len() == 2);
            let Some(v) = doublet else { return true };
            let (p, q) = (self.around[v as usize][0], self.around[v as usize][1]);
            let (Some(first), Some(second)) = (self.quads[p as usize], self.quads[q as usize]) else { return false };
            let (Some(i), Some(j)) = (first.iter().position(|&w| w == v), second.iter().position(|&w| w == v)) else {
                return false;
            };
            let surface = self.surface_of[p as usize];
            if surface != self.surface_of[q as usize]
                || first[(i + 1) & 3] != second[(j + 3) & 3]
                || first[(i + 3) & 3] != second[(j + 1) & 3]
            {
                return false;
            }
            let merged = [first[(i + 1) & 3], first[(i + 2) & 3], first[(i + 3) & 3], second[(j + 2) & 3]];
            self.remove(p);
            self.remove(q);
            self.add(merged, surface);
        }
        false
    }

    /// Operators that change the valence of `v` or of a vertex next to it in one of its quads, in a fixed order.
    pub(super) fn operators_at(&self, v: u32) -> Vec<Operator> {
        let mut operators = Vec::new();
        for (q, k) in self.fan(v) {
            let Some(quad) = self.quads[q as usize] else { continue };
            let corner = |i: usize| quad[(k + i) & 3];
            let is_anchored = |i: usize| self.anchored[corner(i) as usize];
            for i in 0..4 {
                // Along a diagonal between two free vertices it does not matter which one goes.
                if is_anchored(i) || (i > 1 && !is_anchored(i - 2)) {
                    continue;
                }
                operators.push(Operator::Collapse { gone: corner(i), next: corner(i + 1) });
            }
            // Spoke, and the two edges of the rim.
            for i in 0..3 {
                for clockwise in [false, true] {
                    operators.push(Operator::Rotate { a: corner(i), b: corner(i + 1), clockwise });
                }
            }
        }
        operators.extend(self.openings(v));
        for w in self.spokes(v).0 {
            let gives_v_an_edge = |o: &Operator| matches!(*o, Operator::Open { from, to, .. } if from == v || to == v);
            operators.extend(self.openings(w).filter(gives_v_an_edge));
        }
        operators
    }

    /// Neighbours of `v` along edges, counter-clockwise, and whether the fan is open (on a border).
    fn spokes(&self, v: u32) -> (Vec<u32>, bool) {
        let fan = self.fan(v);
        let end = |i: usize| move |&(q, k): &(u32, usize)| Some(self.quads[q as usize]?[(k + i) & 3]);
        let mut spokes: Vec<u32> = fan.iter().filter_map(end(1)).collect();
        // On a border the fan has one more edge than quads, and does not wrap round.
        let last = fan.last().and_then(end(3)).filter(|last| spokes.first() != Some(last));
        spokes.extend(last);
        (spokes, last.is_some())
    }

    fn openings(&self, at: u32) -> impl Iterator<Item = Operator> + use<> {
        let (spokes, on_border) = self.spokes(at);
        let n = spokes.len();
        (0..n).flat_map(move |i| {
            let most = if on_border { n - i } else { n.saturating_sub(1) };
            let spokes = spokes.clone();
            (2..most.min(5)).map(move |width| Operator::Open { at, from: spokes[i], to: spokes[(i + width) % n] })
        })
    }
}
