//! The five passes of an iteration, each over all edges or vertices of a piece in a fixed order.

use super::RemeshOptions;
use super::piece::{NEEDLE, Piece, passable};
use mesh::{Cancelled, DVec3, Monitor};

/// Edges longer than this times the target are split, edges shorter than [`SHORT`] collapsed: the factors of Botsch and
/// Kobbelt, for which neither undoes the other.
const LONG: f64 = 4.0 / 3.0;
const SHORT: f64 = 4.0 / 5.0;

/// The ends of an edge this short, relative to the target, are one point: merging them changes no shape.
const COINCIDENT: f64 = 1e-9;

/// Passes of one kind in a row; each but the first one works on what the last has left.
const MAX_REPEATS: u32 = 8;

/// An edge across a crease sharper than this, as the cosine between its triangles, is not flipped: that would cut it.
const CREASE: f64 = 0.5;

impl Piece {
    /// The whole loop.
    pub fn remesh(&mut self, options: &RemeshOptions, monitor: &Monitor) -> Result<(), Cancelled> {
        if options.split_chords {
            self.split_chords();
        }
        for _ in 0..options.iterations {
            for _ in 0..MAX_REPEATS {
                monitor.check()?;
                if self.split_long() == 0 {
                    break;
                }
                self.flip();
            }
            for _ in 0..MAX_REPEATS {
                monitor.check()?;
                if self.collapse_short() == 0 {
                    break;
                }
            }
            monitor.check()?;
            self.flip();
            monitor.check()?;
            self.relax();
        }
        Ok(())
    }

    /// Splits every edge that joins two fixed vertices and is not a border of the piece. The new edges have a free end.
    fn split_chords(&mut self) {
        loop {
            let is_inner_chord = |h: &u32| self.mesh.twin(*h).is_some() && self.is_chord(*h);
            let chords: Vec<u32> = self.mesh.edges().filter(is_inner_chord).collect();
            let mut changed = false;
            for h in chords {
                // A split gives the edges beside it other half-edges: what has moved waits for the next round.
                if self.is_chord(h) {
                    changed |= self.split(h);
                }
            }
            if !changed {
                return;
            }
        }
    }

    fn is_chord(&self, h: u32) -> bool {
        self.is_fixed(self.mesh.from(h)) && self.is_fixed(self.mesh.to(h))
    }

    /// Splits edges that are too long, the longest first; returns how many.
    fn split_long(&mut self) -> usize {
        let long = self.ranked(|ratio, _| (ratio > LONG).then_some(-ratio));
        for &(_, h) in &long {
            // A split gives the edges beside it other half-edges, so this may be a new, short one.
            if self.relative_length(self.mesh.from(h), self.mesh.to(h)) > LONG {
                self.split(h);
            }
        }
        long.len()
    }

    /// Inner edges that `rank` takes, given the relative length and the half-edge, by ascending rank.
    fn ranked(&self, rank: impl Fn(f64, u32) -> Option<f64>) -> Vec<(f64, u32)> {
        let mut edges: Vec<(f64, u32)> = self
            .mesh
            .edges()
            .filter(|&h| self.mesh.twin(h).is_some())
            .filter_map(|h| rank(self.relative_length(self.mesh.from(h), self.mesh.to(h)), h).map(|r| (r, h)))
            .collect();
        edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        edges
    }

    /// Collapses edges that are too short, the shortest first, and any edge of a needle whose collapse removes it well.
    /// Returns how many.
    fn collapse_short(&mut self) -> usize {
        let candidates = self.ranked(|ratio, h| {
            let is_needle = |h: u32| self.shape(self.mesh.corners(h / 3)) < NEEDLE;
            let near_needle = || is_needle(h) || self.mesh.twin(h).is_some_and(is_needle);
            (ratio < SHORT || near_needle()).then_some(ratio)
        });
        let mut done = 0;
        for (_, h) in candidates {
            if !self.mesh.is_live(h) || self.mesh.twin(h).is_none() {
                continue;
            }
            let (a, b) = (self.mesh.from(h), self.mesh.to(h));
            let length = self.relative_length(a, b);
            let best = [a, b]
                .into_iter()
                .filter_map(|v| self.after_collapse(h, v, length).map(|worst| (worst, v)))
                .reduce(|x, y| if y.0 > x.0 { y } else { x });
            if let Some((_, v)) = best
                && self.mesh.can_collapse(h, v)
            {
                self.mesh.collapse(h, v);
                done += 1;
            }
        }
        done
    }

    /// Worst shape around `v` once it has moved into the other end of `h`; nothing when it must not.
    fn after_collapse(&self, h: u32, v: u32, length: f64) -> Option<f64> {
        if self.is_fixed(v) {
            return None;
        }
        let w = self.mesh.from(h) ^ self.mesh.to(h) ^ v;
        let apexes = [Some(self.mesh.apex(h)), self.mesh.twin(h).map(|g| self.mesh.apex(g))];
        let (mut before, mut after): (f64, f64) = (1.0, 1.0);
        let mut longest: f64 = 0.0;
        for g in self.mesh.around(v) {
            let (p, q) = (self.mesh.to(g), self.mesh.apex(g));
            before = before.min(self.shape([v, p, q]));
            if p == w || q == w {
                continue;
            }
            after = after.min(self.shape([w, p, q]));
            longest = longest.max(self.relative_length(w, p)).max(self.relative_length(w, q));
            let makes_chord = |n: u32| self.is_fixed(w) && self.is_fixed(n) && !apexes.contains(&Some(n));
            if makes_chord(p) || makes_chord(q) {
                return None;
            }
        }
        // A needle may cost longer edges, which are split again.
        let allowed = if before < NEEDLE { 2.0 * LONG } else { LONG };
        let wanted =
            length < COINCIDENT || length < SHORT && passable(after, before) || before < NEEDLE && after >= NEEDLE;
        (wanted && longest <= allowed).then_some(after)
    }

    /// Flips edges where that brings valences nearer to their ideal, or improves the worse triangle when it is bad.
    fn flip(&mut self) {
        let edges: Vec<u32> = self.mesh.edges().collect();
        for h in edges {
            if self.wants_flip(h) && self.mesh.can_flip(h) {
                self.mesh.flip(h);
            }
        }
    }

    fn wants_flip(&self, h: u32) -> bool {
        let Some(g) = self.mesh.twin(h) else {
            return false;
        };
        let (a, b, c, d) = (self.mesh.from(h), self.mesh.to(h), self.mesh.apex(h), self.mesh.apex(g));
        if self.is_fixed(c) && self.is_fixed(d) {
            return false;
        }
        let before = self.shape([a, b, c]).min(self.shape([b, a, d]));
        let after = self.shape([a, d, c]).min(self.shape([b, c, d]));
        if !passable(after, before) {
            return false;
        }
        if before > NEEDLE {
            let at = |v: u32| self.mesh.positions[v as usize];
            let left = super::area_normal([at(a), at(b), at(c)]);
            let right = super::area_normal([at(b), at(a), at(d)]);
            if left.dot(right) < CREASE * left.length() * right.length() {
                return false;
            }
        }
        // Good triangles are worth more than regular valences.
        if before < 0.6 || after < 0.6 {
            return after > before + 0.02;
        }
        let excess = |v: u32, change: i64| {
            let off = self.mesh.valence(v) as i64 + change - self.ideal_valence[v as usize] as i64;
            off * off
        };
        let now: i64 = [a, b, c, d].into_iter().map(|v| excess(v, 0)).sum();
        let then: i64 = excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1);
        then < now
    }

    /// Moves each free vertex in its tangent plane to the centroid of the triangles around it, weighted by their area in
    /// units of the target size, and projects it.
    fn relax(&mut self) {
        for v in 0..self.mesh.vertex_slots() {
            if !self.mesh.is_live_vertex(v) || self.is_fixed(v) {
                continue;
            }
            let (here, normal) = (self.mesh.positions[v as usize], self.normal[v as usize]);
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for h in self.mesh.around(v) {
                let corners = [v, self.mesh.to(h), self.mesh.apex(h)].map(|u| u as usize);
                let p = corners.map(|u| self.mesh.positions[u]);
                let size: f64 = corners.iter().map(|&u| self.size[u]).sum();
                let weight = super::area_normal(p).length() / (size * size);
                sum += ((p[0] + p[1] + p[2]) / 3.0 - here) * weight;
                total += weight;
            }
            let before = self.worst_around(v, here, normal);
            if before < NEEDLE {
                self.rescue(v, before);
                continue;
            }
            let step = sum / total;
            let step = step - normal * normal.dot(step);
            for scale in [1.0, 0.5, 0.25] {
                let found = self.project(here + step * scale, v);
                let there = self.normal_at(&found);
                // A folded surface may be nearest on its other side.
                if there.dot(normal) > 0.0 && self.worst_around(v, found.point, there) >= before.min(2.0 * NEEDLE) {
                    self.settle(v, &found);
                    break;
                }
            }
        }
    }

    /// Looks for a better place for a vertex among needles or turned triangles, where centroids say little: the mean of
    /// its neighbours, and half-way from there to each and to where it is.
    fn rescue(&mut self, v: u32, before: f64) {
        let here = self.mesh.positions[v as usize];
        let neighbours: Vec<DVec3> = self.mesh.neighbours(v).map(|n| self.mesh.positions[n as usize]).collect();
        let mean = neighbours.iter().sum::<DVec3>() / neighbours.len() as f64;
        let mut best = (before, None);
        for target in neighbours.iter().map(|n| (*n + mean) / 2.0).chain([mean, (here + mean) / 2.0]) {
            let found = self.project(target, v);
            if found.triangle == mesh::NONE {
                continue;
            }
            let worst = self.worst_around(v, found.point, self.normal_at(&found));
            if worst > best.0 {
                best = (worst, Some(found));
            }
        }
        if let (_, Some(found)) = best {
            self.settle(v, &found);
        }
    }
}
