//! A triangulation of a surface that lives in its metric: edge lengths and half-edges, no positions.
//!
//! Edges are geodesics of the surface. A flip replaces the diagonal of two triangles unfolded into the plane, so the
//! triangulation may leave the input triangles while the surface stays what it was. Where the two meet is kept as integers:
//! for each edge the number of *surface* edges that cross it (normal coordinates). A flip updates them without rounding, so
//! what crosses what is exact however bad the triangles are, and edges of the triangulation can be cut into the surface at
//! the end ([`Intrinsic::arcs`]).
//!
//! Sources: Sharp, Soliman and Crane, "Navigating intrinsic triangulations", 2019; Gillespie, Sharp and Crane, "Integer
//! coordinates for intrinsic geometry processing", 2021 (normal coordinates; the rule for a flip is derived here from the
//! order of the crossings along the flipped edge); Sharp and Crane, "A Laplacian for nonmanifold triangle meshes", 2020
//! (lengths of triangles without area).

use glam::DVec2;
use mesh::{Cancelled, Monitor, NONE, Topology, TriangleMesh};
use std::f64::consts::PI;

/// Triangles are kept from collapsing: any two sides exceed the third by this fraction of the mean edge.
const SLACK: f64 = 1e-7;
/// Angles closer than this are taken for equal, radians.
const ANGLE_TOLERANCE: f64 = 1e-9;

/// An intrinsic triangulation over the vertices of a surface. Half-edges are numbered as in the surface's [`Topology`] at
/// first; a flip keeps the numbers of all others.
#[derive(Debug, Clone)]
pub struct Intrinsic {
    /// Opposite half-edge, or [`NONE`] on a border.
    pub twin: Vec<u32>,
    /// Next half-edge round the triangle.
    pub next: Vec<u32>,
    /// Vertex that each half-edge starts from.
    pub origin: Vec<u32>,
    /// Edge of each half-edge.
    pub edge: Vec<u32>,
    /// Length of each edge.
    pub length: Vec<f64>,
    /// Surface edges that cross each edge; -1 for an edge that is itself a surface edge.
    crossings: Vec<i32>,
}

/// A surface edge seen from the triangulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Its end vertices; the walk starts at the first.
    pub ends: [u32; 2],
    /// What it crosses, in order.
    pub crossings: Vec<Crossing>,
}

/// Where a surface edge crosses an edge of the triangulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The half-edge it leaves a triangle through.
    pub half_edge: u32,
    /// How many surface edges cross this half-edge nearer to its origin.
    pub index: u32,
    /// Fraction of the way along the surface edge, 0 to 1.
    pub at: f64,
}

/// How surface edges run through one triangle, seen from its half-edges (first, second, third from corners 0, 1, 2).
struct Corners {
    /// Edges that cut off each corner.
    around: [i32; 3],
    /// Edges that start at each corner and leave through the side opposite.
    from: [i32; 3],
}

impl Intrinsic {
    /// The triangulation that is the surface itself. Lengths of triangles without area are padded evenly until every
    /// triangle has some. O(triangles).
    pub fn new(mesh: &TriangleMesh, topology: &Topology) -> Self {
        let mut edge = vec![NONE; topology.len()];
        let mut length = Vec::with_capacity(topology.len() / 2);
        for h in topology.edges() {
            edge[h as usize] = length.len() as u32;
            if !topology.is_border(h) {
                edge[topology.twin[h as usize] as usize] = length.len() as u32;
            }
            let [a, b] = [topology.from(h), topology.to(h)].map(|v| mesh.positions[v as usize]);
            length.push(a.distance(b));
        }
        let slack = SLACK * length.iter().sum::<f64>() / length.len().max(1) as f64;
        let missing = edge.chunks_exact(3).fold(0.0_f64, |worst, sides| {
            let [a, b, c] = [0, 1, 2].map(|k| length[sides[k] as usize]);
            worst.max(slack - (a + b - c).min(b + c - a).min(c + a - b))
        });
        for l in &mut length {
            *l += missing;
        }
        let crossings = vec![-1; length.len()];
        Self {
            twin: topology.twin.clone(),
            next: topology.next.clone(),
            origin: topology.origin.clone(),
            edge,
            length,
            crossings,
        }
    }

    /// Previous half-edge round the triangle.
    pub fn prev(&self, h: u32) -> u32 {
        self.next[self.next[h as usize] as usize]
    }

    /// Vertex a half-edge starts from.
    pub fn from(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// Vertex a half-edge ends at.
    pub fn to(&self, h: u32) -> u32 {
        self.origin[self.next[h as usize] as usize]
    }

    /// The half-edge that follows `h` counter-clockwise round its origin, or [`NONE`] at a border.
    pub fn counter_clockwise(&self, h: u32) -> u32 {
        self.twin[self.prev(h) as usize]
    }

    /// Length of the half-edge's edge.
    pub fn length_of(&self, h: u32) -> f64 {
        self.length[self.edge[h as usize] as usize]
    }

    /// Number of surface edges that cross the half-edge's edge; `None` when it is a surface edge itself.
    pub fn crossing_count(&self, h: u32) -> Option<u32> {
        u32::try_from(self.crossings[self.edge[h as usize] as usize]).ok()
    }

    /// Angle of the triangle at the origin of `h`, radians.
    pub fn angle(&self, h: u32) -> f64 {
        let n = self.next[h as usize];
        let (a, opposite, b) = (self.length_of(h), self.length_of(n), self.length_of(self.next[n as usize]));
        ((a * a + b * b - opposite * opposite) / (2.0 * a * b)).clamp(-1.0, 1.0).acos()
    }

    /// Cotangent of the angle opposite to `h`; large, never infinite, for a triangle almost without area.
    pub fn cotangent_opposite(&self, h: u32) -> f64 {
        let n = self.next[h as usize];
        let (c, a, b) = (self.length_of(h), self.length_of(n), self.length_of(self.next[n as usize]));
        // Heron's formula as Kahan arranges it, without cancellation.
        let mut sides = [a, b, c];
        sides.sort_by(|x, y| y.total_cmp(x));
        let [x, y, z] = sides;
        let area = 0.25 * ((x + (y + z)) * (z - (x - y)) * (z + (x - y)) * (x + (y - z))).max(0.0).sqrt();
        (a * a + b * b - c * c) / (4.0 * area).max(1e-12 * x * x)
    }

    /// Third corner of the triangle left of `h` when `h` runs from (0, 0) to (length, 0).
    fn apex(&self, h: u32) -> DVec2 {
        let n = self.next[h as usize];
        let (base, from_end, from_start) =
            (self.length_of(h), self.length_of(n), self.length_of(self.next[n as usize]));
        let x = (from_start * from_start - from_end * from_end + base * base) / (2.0 * base);
        DVec2::new(x, (from_start * from_start - x * x).max(0.0).sqrt())
    }

    /// Replaces the edge of `h` by the other diagonal of its two triangles. Afterwards `h` runs from the corner that was
    /// right of it to the one that was left; every other half-edge stays. The caller sees to it that the edge is no border
    /// and that the two triangles, unfolded, form a convex quadrilateral.
    pub fn flip(&mut self, h: u32) {
        let t = self.twin[h as usize];
        let (a, c) = (self.next[h as usize], self.next[t as usize]);
        let (b, d) = (self.next[a as usize], self.next[c as usize]);
        let (left, right) = (self.apex(h), self.apex(t));
        let across = left.distance(DVec2::new(self.length_of(h) - right.x, -right.y));
        let crossings = self.crossings_after_flip(h, t);
        let e = self.edge[h as usize] as usize;
        self.length[e] = across;
        self.crossings[e] = crossings;
        let (k, l) = (self.from(b), self.from(d));
        self.origin[h as usize] = l;
        self.origin[t as usize] = k;
        for [x, y, z] in [[h, b, c], [t, d, a]] {
            self.next[x as usize] = y;
            self.next[y as usize] = z;
            self.next[z as usize] = x;
        }
    }

    /// Crossings in the triangle of `h`, corner 0 at the origin of `h`.
    fn corners(&self, h: u32) -> Corners {
        let n = self.next[h as usize];
        let sides = [h, n, self.next[n as usize]].map(|g| self.crossings[self.edge[g as usize] as usize].max(0));
        // Corner k lies between sides k and k - 1; side k + 1 is opposite.
        let from = [0, 1, 2].map(|k: usize| (sides[(k + 1) % 3] - sides[k] - sides[(k + 2) % 3]).max(0));
        let around = [0, 1, 2].map(|k: usize| {
            let both = (sides[k] + sides[(k + 2) % 3] - sides[(k + 1) % 3]).max(0);
            (both - from[(k + 1) % 3] - from[(k + 2) % 3]) / 2
        });
        Corners { around, from }
    }

    /// Along the edge from i to j, the crossings turn round i, end at the apex, or turn round j, in this order, on either
    /// side. A surface edge crosses the new diagonal when it goes from i's half to j's; one that joins the two apexes is it.
    fn crossings_after_flip(&self, h: u32, t: u32) -> i32 {
        let (up, down) = (self.corners(h), self.corners(t));
        let total = self.crossings[self.edge[h as usize] as usize];
        let ([up_i, up_k, up_j], [down_i, down_l, down_j]) =
            ([up.around[0], up.from[2], up.around[1]], [down.around[1], down.from[2], down.around[0]]);
        if (up_i + up_k).min(down_i + down_l) > up_i.max(down_i) {
            return -1;
        }
        let crossing = (up_i - down_i - down_l).max(0) + (down_i - up_i - up_k).max(0);
        debug_assert!(up_j >= 0 && down_j >= 0, "corner counts are counts");
        crossing
            + up.around[2]
            + down.around[2]
            + up.from[0]
            + up.from[1]
            + down.from[0]
            + down.from[1]
            + i32::from(total < 0)
    }

    /// Flips edges until every one that is not `fixed` is Delaunay: the angles opposite to it add up to at most pi.
    ///
    /// Source: Fisher, Springborn, Schröder and Bobenko, "An algorithm for the construction of intrinsic Delaunay
    /// triangulations with applications to digital geometry processing", 2007.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn make_delaunay(&mut self, fixed: &[bool], monitor: &Monitor) -> Result<(), Cancelled> {
        let mut waiting: Vec<u32> = (0..self.twin.len() as u32).filter(|&h| self.twin[h as usize] > h).collect();
        waiting.retain(|&h| self.twin[h as usize] != NONE);
        let mut queued = vec![false; self.length.len()];
        for &h in &waiting {
            queued[self.edge[h as usize] as usize] = true;
        }
        // Flips end in exact arithmetic; the limit guards against rounding, and only quality is lost when it strikes.
        let mut budget = 100 * self.length.len();
        while let Some(h) = waiting.pop() {
            let (t, e) = (self.twin[h as usize], self.edge[h as usize] as usize);
            queued[e] = false;
            let opposite = |h: u32| self.angle(self.prev(h));
            if fixed[e] || budget == 0 || opposite(h) + opposite(t) <= PI + ANGLE_TOLERANCE {
                continue;
            }
            budget -= 1;
            if budget.is_multiple_of(1024) {
                monitor.check()?;
            }
            self.flip(h);
            for g in [self.next[h as usize], self.prev(h), self.next[t as usize], self.prev(t)] {
                let e = self.edge[g as usize] as usize;
                if self.twin[g as usize] != NONE && !queued[e] {
                    queued[e] = true;
                    waiting.push(g);
                }
            }
        }
        Ok(())
    }

    /// Every surface edge that crosses edges of the triangulation, once, from its lower vertex. O(crossings).
    pub fn arcs(&self) -> Vec<Arc> {
        let mut arcs = Vec::new();
        for h in 0..self.next.len() as u32 {
            let corners = self.corners(h);
            for k in 0..corners.from[0] {
                // Measured along the opposite side, those that turn round its origin come first.
                if let Some(arc) = self.trace(h, corners.around[1] + k) {
                    arcs.push(arc);
                }
            }
        }
        arcs
    }

    /// Follows the surface edge that starts at the origin of `start` and is the `index`-th on the side opposite; `None` when
    /// it ends at a lower vertex.
    fn trace(&self, start: u32, mut index: i32) -> Option<Arc> {
        let mut crossed = Vec::new();
        // The triangles unfolded: the side to be crossed, from a to b.
        let mut h = self.next[start as usize];
        let (mut a, mut b) = (DVec2::new(self.length_of(start), 0.0), self.apex(start));
        loop {
            crossed.push((h, index as u32, a, b));
            let t = self.twin[h as usize];
            // From the other side the edge runs from b to a.
            let seen = self.crossings[self.edge[t as usize] as usize] - 1 - index;
            let corners = self.corners(t);
            let (along, local) = ((a - b).normalize_or_zero(), self.apex(t));
            let apex = b + along * local.x + along.perp() * local.y;
            let after = self.prev(t);
            if seen < corners.around[0] {
                index = self.crossings[self.edge[after as usize] as usize] - 1 - seen;
                h = after;
                a = apex;
            } else if seen < corners.around[0] + corners.from[2] {
                let ends = [self.from(start), self.from(after)];
                return (ends[0] < ends[1]).then(|| Arc { ends, crossings: located(&crossed, apex) });
            } else {
                index = self.crossings[self.edge[t as usize] as usize] - 1 - seen;
                h = self.next[t as usize];
                b = apex;
            }
        }
    }
}

/// Puts the crossings on the straight line from (0, 0) to `end`.
fn located(crossed: &[(u32, u32, DVec2, DVec2)], end: DVec2) -> Vec<Crossing> {
    let mut last = 0.0;
    crossed
        .iter()
        .map(|&(half_edge, index, a, b)| {
            let at = a.perp_dot(b - a) / end.perp_dot(b - a);
            // Rounding must not change the order.
            last = if at.is_finite() { at.clamp(last, 1.0) } else { last };
            Crossing { half_edge, index, at: last }
        })
        .collect()
}

#[cfg(test)]
#[path = "intrinsic_tests.rs"]
mod tests;
