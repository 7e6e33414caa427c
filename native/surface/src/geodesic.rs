//! Geodesic distance from a set of vertices, for the retraction of `QuadMixer` (Nuvoli et al. 2019, section 3.1).
//!
//! Fast marching after Kimmel and Sethian, "Computing geodesic paths on manifolds", 1998, in two ways more exact: two
//! settled vertices of a triangle are unfolded into a virtual point source (Novotni and Klein, "Computing geodesic
//! distances on triangular meshes", 2002) instead of a straight wave front, and each such pair also updates the vertices
//! across the neighbouring edges, so that fronts pass obtuse triangles. On a plane with one source the result is exact
//! up to rounding; at the meeting of two fronts it is off by a fraction of the edge.

use glam::{DVec2, DVec3};
use mesh::{Cancelled, Monitor, NONE, Topology, TriangleMesh};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A tentative distance; the heap pops the least, ties by vertex so that the order is always the same.
struct Front {
    distance: f64,
    vertex: u32,
}

impl PartialEq for Front {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Front {}

impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.vertex.cmp(&self.vertex))
    }
}

/// Geodesic distance of every vertex from the nearest of `sources` (vertices, not the edges between them), in scene
/// units; infinite beyond `limit` and where no path leads. Out-of-range sources are ignored.
///
/// Costs O(k log k) for the k vertices within the limit, and one fill of the result.
///
/// # Errors
/// [`Cancelled`].
pub fn distance_field(
    mesh: &TriangleMesh,
    topology: &Topology,
    sources: &[u32],
    limit: f64,
    monitor: &Monitor,
) -> Result<Vec<f64>, Cancelled> {
    let mut march = March {
        mesh,
        topology,
        limit,
        distance: vec![f64::INFINITY; mesh.positions.len()],
        settled: vec![false; mesh.positions.len()],
        front: BinaryHeap::new(),
    };
    for &source in sources {
        if (source as usize) < march.distance.len() {
            march.offer(source, 0.0);
        }
    }
    let mut steps = 0_u32;
    while let Some(Front { vertex, distance }) = march.front.pop() {
        if march.settled[vertex as usize] || distance > march.distance[vertex as usize] {
            continue;
        }
        march.settled[vertex as usize] = true;
        march.spread(vertex);
        steps += 1;
        if steps.is_multiple_of(1024) {
            monitor.check()?;
        }
    }
    Ok(march.distance)
}

struct March<'a> {
    mesh: &'a TriangleMesh,
    topology: &'a Topology,
    limit: f64,
    distance: Vec<f64>,
    settled: Vec<bool>,
    front: BinaryHeap<Front>,
}

impl March<'_> {
    fn offer(&mut self, vertex: u32, distance: f64) {
        let v = vertex as usize;
        if !self.settled[v] && distance <= self.limit && distance < self.distance[v] {
            self.distance[v] = distance;
            self.front.push(Front { distance, vertex });
        }
    }

    fn at(&self, v: u32) -> DVec3 {
        self.mesh.positions[v as usize]
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        self.at(a).distance(self.at(b))
    }

    /// Updates everything that depends on the vertex just settled.
    fn spread(&mut self, u: u32) {
        let topology = self.topology;
        for h in topology.around(u) {
            let next = topology.next[h as usize];
            let prev = topology.prev[h as usize];
            let (p, q) = (topology.to(h), topology.from(prev));
            for other in [p, q] {
                self.offer(other, self.distance[u as usize] + self.length(u, other));
            }
            // Half-edges: h = (u, p), next = (p, q), prev = (q, u).
            if self.settled[p as usize] {
                self.spread_pair([u, p], q, [next, prev]);
            }
            if self.settled[q as usize] {
                self.spread_pair([q, u], p, [h, next]);
            }
        }
    }

    /// Two settled vertices a, b of the triangle (a, b, c) update c, and the vertices across its two other edges.
    fn spread_pair(&mut self, [a, b]: [u32; 2], c: u32, across: [u32; 2]) {
        let base = self.length(a, b);
        let Some(source) = virtual_source(self.distance[a as usize], self.distance[b as usize], base) else {
            return;
        };
        let Some(apex) = unfold(DVec2::ZERO, DVec2::new(base, 0.0), self.length(a, c), self.length(b, c)) else {
            return;
        };
        let foot = |v: u32| match v {
            v if v == a => DVec2::ZERO,
            v if v == c => apex,
            _ => DVec2::new(base, 0.0),
        };
        if passes(source, apex, DVec2::ZERO, DVec2::new(base, 0.0)) {
            self.offer(c, source.distance(apex));
        }
        for gate in across {
            let twin = self.topology.twin[gate as usize];
            if twin == NONE {
                continue;
            }
            let (from, to) = (self.topology.from(gate), self.topology.to(gate));
            let far = self.topology.from(self.topology.prev[twin as usize]);
            // Seen from across the gate runs the other way, and `far` lies to its left.
            let (left, right) = (foot(to), foot(from));
            let Some(point) = unfold(left, right, self.length(to, far), self.length(from, far)) else { continue };
            if passes(source, point, left, right) && passes(source, point, DVec2::ZERO, DVec2::new(base, 0.0)) {
                self.offer(far, source.distance(point));
            }
        }
    }
}

/// The point below the segment from (0, 0) to (base, 0) at these distances from its ends.
fn virtual_source(from_a: f64, from_b: f64, base: f64) -> Option<DVec2> {
    let x = (from_a * from_a - from_b * from_b + base * base) / (2.0 * base);
    let y_squared = from_a * from_a - x * x;
    (y_squared >= 0.0 && x.is_finite()).then(|| DVec2::new(x, -y_squared.sqrt()))
}

/// The point to the left of the segment from `a` to `b` at these distances from its ends.
fn unfold(a: DVec2, b: DVec2, from_a: f64, from_b: f64) -> Option<DVec2> {
    let along = (b - a).try_normalize()?;
    let base = a.distance(b);
    let x = (from_a * from_a - from_b * from_b + base * base) / (2.0 * base);
    let y = (from_a * from_a - x * x).max(0.0).sqrt();
    Some(a + along * x + along.perp() * y)
}

/// True when the straight line from `source` to `target` passes between `a` and `b`, with `a` on its left.
fn passes(source: DVec2, target: DVec2, a: DVec2, b: DVec2) -> bool {
    let line = target - source;
    line.perp_dot(a - source) >= 0.0 && line.perp_dot(b - source) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::{grid, sphere};

    fn field(mesh: &TriangleMesh, sources: &[u32], limit: f64) -> Vec<f64> {
        distance_field(mesh, &Topology::of_triangles(mesh), sources, limit, &Monitor::new()).expect("not cancelled")
    }

    #[test]
    fn is_exact_on_a_plane() {
        let mesh = grid(20, 20, |x, y| DVec3::new(x, y * 0.6, 0.0));
        let source = 21 * 7 + 5;
        for (v, d) in field(&mesh, &[source], f64::INFINITY).into_iter().enumerate() {
            let exact = mesh.positions[v].distance(mesh.positions[source as usize]);
            assert!((d - exact).abs() < 1e-9, "vertex {v}: {d} against {exact}");
        }
    }

    #[test]
    fn stays_close_on_a_sheared_plane_full_of_obtuse_triangles() {
        let mesh = grid(20, 20, |x, y| DVec3::new(x + 1.5 * y, y * 0.7, 0.0));
        let source = 21 * 10 + 10;
        for (v, d) in field(&mesh, &[source], f64::INFINITY).into_iter().enumerate() {
            let exact = mesh.positions[v].distance(mesh.positions[source as usize]);
            assert!((d - exact).abs() <= 0.02 * exact, "vertex {v}: {d} against {exact}");
        }
    }

    #[test]
    fn matches_great_circles_within_the_limit() {
        let mesh = sphere(48, 24);
        let pole = mesh.positions[0];
        let limit = 2.0;
        for (v, d) in field(&mesh, &[0], limit).into_iter().enumerate() {
            let exact = pole.angle_between(mesh.positions[v]);
            if d.is_finite() {
                assert!((d - exact).abs() < 0.01, "vertex {v}: {d} against {exact}");
            } else {
                assert!(exact > limit - 0.01);
            }
        }
        let off = 48 * 11 + 4;
        let centre = mesh.positions[off];
        for (v, d) in field(&mesh, &[off as u32], f64::INFINITY).into_iter().enumerate() {
            let exact = centre.angle_between(mesh.positions[v]);
            assert!((d - exact).abs() < 0.03, "vertex {v}: {d} against {exact}");
        }
    }

    #[test]
    fn stops_when_cancelled() {
        let mesh = grid(60, 60, |x, y| DVec3::new(x, y, 0.0));
        let monitor = Monitor::new();
        monitor.cancel();
        let result = distance_field(&mesh, &Topology::of_triangles(&mesh), &[0], f64::INFINITY, &monitor);
        assert_eq!(result, Err(Cancelled));
    }
}
