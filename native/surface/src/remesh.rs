//! Isotropic remeshing of a patch with its border and given lines fixed (`QuadMixer`, section 3.2.1, first step; after
//! M. Botsch, L. Kobbelt, A remeshing approach to multiresolution modeling, SGP 2004): long edges are split, short ones
//! collapsed, edges flipped towards even triangles, free vertices relaxed in the surface.
//!
//! The input comes from an exact boolean and is full of slivers: a triangle is judged against the normal of the surface
//! under its centre, never against its own former normal.

use crate::closest::ClosestPoint;
use crate::editable::{Editable, sorted};
use glam::DVec3;
use mesh::{Cancelled, Monitor, TriangleMesh};
use std::f64::consts::PI;

/// Edges longer than this times their target are split.
const LONG: f64 = 4.0 / 3.0;

/// Edges shorter than this times their target are collapsed.
const SHORT: f64 = 4.0 / 5.0;

/// Cosine of the angle that a triangle may make with the surface under it.
const UPRIGHT: f64 = 0.5;

/// How to remesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RemeshOptions {
    /// Rounds of split, collapse, flip and relax.
    pub rounds: usize,
    /// Afterwards splits every inner edge that joins two fixed vertices, so that triangles can be paired into quads.
    pub split_chords: bool,
}

impl Default for RemeshOptions {
    fn default() -> Self {
        Self { rounds: 6, split_chords: false }
    }
}

/// A remeshed patch.
#[derive(Debug, Clone)]
pub struct Remeshed {
    /// The new mesh.
    pub mesh: TriangleMesh,
    /// New vertex of each input vertex, [`mesh::NONE`] when it went. Fixed vertices never go.
    pub vertex: Vec<u32>,
    /// An input triangle near each new triangle.
    pub source: Vec<u32>,
}

/// Remeshes towards edges of length `size` (one target a vertex, scene units). Border edges and `lines` stay as they are.
///
/// Keeps the topology. Costs O(n log n) for n triangles before and after.
///
/// # Errors
/// [`Cancelled`].
pub fn remesh(
    surface: &TriangleMesh,
    lines: &[[u32; 2]],
    size: &[f64],
    options: &RemeshOptions,
    monitor: &Monitor,
) -> Result<Remeshed, Cancelled> {
    let mut work = Work::new(surface, lines, size);
    for round in 0..options.rounds {
        monitor.check()?;
        work.split_long();
        work.collapse_short();
        monitor.check()?;
        work.flip(round > 0);
        work.relax();
    }
    if options.split_chords {
        work.split_chords();
        for _ in 0..3 {
            work.relax();
        }
    }
    let done = work.mesh.finish();
    Ok(Remeshed { mesh: done.mesh, vertex: done.vertex, source: done.source })
}

struct Work<'a> {
    mesh: Editable,
    size: Vec<f64>,
    fixed: Vec<bool>,
    surface: &'a TriangleMesh,
    under: ClosestPoint,
}

impl<'a> Work<'a> {
    fn new(surface: &'a TriangleMesh, lines: &[[u32; 2]], size: &[f64]) -> Self {
        let mut mesh = Editable::new(surface, lines.iter().copied());
        let mut fixed = vec![false; size.len()];
        for [a, b] in mesh.edges() {
            // Border edges are lines too: nothing may split, collapse or flip them.
            if mesh.on_edge(a, b).nth(1).is_none() {
                mesh.lines.insert([a, b]);
            }
        }
        for v in mesh.lines.iter().flatten() {
            fixed[*v as usize] = true;
        }
        Self { mesh, size: size.to_vec(), fixed, surface, under: ClosestPoint::new(surface) }
    }

    fn is_line(&self, a: u32, b: u32) -> bool {
        self.mesh.lines.contains(&sorted(a, b))
    }

    fn target(&self, a: u32, b: u32) -> f64 {
        0.5 * (self.size[a as usize] + self.size[b as usize])
    }

    /// Unit normal of the surface under a point.
    fn normal(&self, p: DVec3) -> DVec3 {
        self.surface.area_normal(self.under.project(p).triangle as usize).normalize_or_zero()
    }

    fn normal_under(&self, t: [u32; 3]) -> DVec3 {
        self.normal(t.iter().map(|&v| self.mesh.at(v)).sum::<DVec3>() / 3.0)
    }

    /// How well a triangle stands on the surface: the cosine between its normal and the surface's under its centre.
    fn upright(&self, t: [u32; 3]) -> f64 {
        self.mesh.area_normal(t).normalize_or_zero().dot(self.normal_under(t))
    }

    /// Height over longest edge, 0.87 for an equilateral triangle.
    fn fatness(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = t;
        let longest = self.mesh.length(a, b).max(self.mesh.length(b, c)).max(self.mesh.length(c, a));
        if longest > 0.0 { self.mesh.area_normal(t).length() / (longest * longest) } else { 0.0 }
    }

    fn split_at(&mut self, a: u32, b: u32) -> u32 {
        let middle = self.mesh.at(a).midpoint(self.mesh.at(b));
        let point = self.under.project(middle).point;
        let v = self.mesh.split(a, b, point);
        self.size.push(self.target(a, b));
        self.fixed.push(false);
        v
    }

    fn split_long(&mut self) {
        // Halving until nothing is long; the bound only guards against targets near zero.
        for _ in 0..12 {
            let mut long: Vec<(f64, [u32; 2])> = self
                .mesh
                .edges()
                .into_iter()
                .filter(|&[a, b]| !self.is_line(a, b))
                .map(|[a, b]| (self.mesh.length(a, b) / self.target(a, b), [a, b]))
                .filter(|&(ratio, _)| ratio > LONG)
                .collect();
            if long.is_empty() {
                return;
            }
            long.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            for (_, [a, b]) in long {
                self.split_at(a, b);
            }
        }
    }

    fn collapse_short(&mut self) {
        let mut short: Vec<(f64, [u32; 2])> = self
            .mesh
            .edges()
            .into_iter()
            .map(|[a, b]| (self.mesh.length(a, b) / self.target(a, b), [a, b]))
            .filter(|&(ratio, _)| ratio < SHORT)
            .collect();
        short.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for (_, [a, b]) in short {
            // Into the fixed end, if any; else whichever way is allowed.
            let _ = self.try_collapse(a, b) || self.try_collapse(b, a);
        }
    }

    fn try_collapse(&mut self, from: u32, to: u32) -> bool {
        if self.fixed[from as usize] || !self.mesh.can_collapse(from, to) {
            return false;
        }
        let before = self.mesh.incident[from as usize]
            .iter()
            .map(|&t| self.fatness(self.mesh.triangles[t as usize]))
            .fold(1.0, f64::min);
        for (_, fresh) in self.mesh.after_collapse(from, to) {
            let too_long = fresh.iter().any(|&v| {
                v != to && self.mesh.length(v, to) > LONG * self.target(v, to).max(self.mesh.length(v, from))
            });
            let thin = self.fatness(fresh) < before.min(0.1);
            if too_long || thin || self.upright(fresh) < UPRIGHT {
                return false;
            }
        }
        self.mesh.collapse(from, to);
        true
    }

    /// Number of triangles wanted at a vertex: six inside; at fixed ones what the angle there holds.
    fn wanted(&self, v: u32) -> f64 {
        if !self.fixed[v as usize] {
            return 6.0;
        }
        let angle: f64 = self.mesh.incident[v as usize].iter().map(|&t| self.angle(t, v)).sum();
        (angle / (PI / 3.0)).max(1.0)
    }

    fn angle(&self, t: u32, v: u32) -> f64 {
        let corners = self.mesh.triangles[t as usize];
        let k = corners.iter().position(|&c| c == v).expect("a corner");
        let [p, q] = [1, 2].map(|i| (self.mesh.at(corners[(k + i) % 3]) - self.mesh.at(v)).normalize_or_zero());
        p.dot(q).clamp(-1.0, 1.0).acos()
    }

    /// Flips edges: first towards fat triangles (which undoes slivers), later towards even valences among fat ones.
    fn flip(&mut self, by_valence: bool) {
        for _ in 0..4 {
            let mut flipped = false;
            for [a, b] in self.mesh.edges() {
                let Some((sides, fresh)) = self.mesh.after_flip(a, b) else { continue };
                let old = sides.map(|t| self.mesh.triangles[t as usize]);
                let [c, d] = [fresh[0][2], fresh[0][1]];
                // An inner edge between fixed vertices would be a chord.
                if self.fixed[c as usize] && self.fixed[d as usize] {
                    continue;
                }
                let worst = |t: [[u32; 3]; 2]| self.fatness(t[0]).min(self.fatness(t[1]));
                let (before, after) = (worst(old), worst(fresh));
                let better = if by_valence && before > 0.2 && after > 0.35 {
                    let excess = |v: u32, change: f64| {
                        (self.mesh.incident[v as usize].len() as f64 + change - self.wanted(v)).powi(2)
                    };
                    let now: f64 = [a, b, c, d].iter().map(|&v| excess(v, 0.0)).sum();
                    let then = excess(a, -1.0) + excess(b, -1.0) + excess(c, 1.0) + excess(d, 1.0);
                    then < now - 1e-9
                } else {
                    after > before + 1e-6
                };
                if !better || self.mesh.incident[a as usize].len() <= 3 || self.mesh.incident[b as usize].len() <= 3 {
                    continue;
                }
                let stand = |t: [[u32; 3]; 2]| self.upright(t[0]).min(self.upright(t[1]));
                let stands = stand(fresh);
                if stands < UPRIGHT && stands <= stand(old) {
                    continue;
                }
                self.mesh.flip(sides, fresh);
                flipped = true;
            }
            if !flipped {
                return;
            }
        }
    }

    /// Moves every free vertex towards the area-weighted centre of its neighbours, in the surface.
    fn relax(&mut self) {
        for v in 0..self.mesh.positions.len() as u32 {
            if self.fixed[v as usize] || self.mesh.incident[v as usize].is_empty() {
                continue;
            }
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for &t in &self.mesh.incident[v as usize] {
                let corners = self.mesh.triangles[t as usize];
                let size: f64 = corners.iter().map(|&c| self.size[c as usize]).sum();
                let area = self.mesh.area_normal(corners).length() / (size * size).max(1e-300);
                sum += area * corners.iter().map(|&c| self.mesh.at(c)).sum::<DVec3>() / 3.0;
                weight += area;
            }
            if weight <= 0.0 {
                continue;
            }
            let old = self.mesh.at(v);
            let worst = |work: &Self| {
                work.mesh.incident[v as usize]
                    .iter()
                    .map(|&t| work.upright(work.mesh.triangles[t as usize]))
                    .fold(1.0, f64::min)
            };
            let before = worst(self);
            let target = self.under.project(sum / weight).point;
            self.mesh.positions[v as usize] = target;
            let after = worst(self);
            if after < UPRIGHT && after < before {
                self.mesh.positions[v as usize] = old;
            }
        }
    }

    /// Splits inner edges between fixed vertices. New vertices are free, so none is left.
    fn split_chords(&mut self) {
        for [a, b] in self.mesh.edges() {
            if self.fixed[a as usize] && self.fixed[b as usize] && !self.is_line(a, b) {
                self.split_at(a, b);
            }
        }
    }
}
