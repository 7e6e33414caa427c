//! Draws a given patch graph into a surface: every side becomes a path of edges, triangles being split on the way
//! (section 4.1, for graphs that a person has edited).
//!
//! Nodes come first: on the nearest border or marked line when one is near, else where the surface is nearest. A side that
//! runs along such a line is the line; any other is projected sample by sample and joined by the sections of the planes that
//! stand on the surface there. Where such a section leads nowhere, as over a fold, the shortest path along edges takes its place.

use super::given::DrawnGraph;
use super::input::Input;
use mesh::{Cancelled, DVec3, Monitor, Topology, TriangleMesh, nearest_on_segment, sorted};
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use surface::closest::ClosestPoint;

/// Distances in edges of the panels: within which a node or side belongs to a line, from a vertex within which a point is
/// that vertex, and between samples of a side.
const ON_LINE: f64 = 0.25;
const SAME: f64 = 0.08;
const STEP: f64 = 0.5;

/// Nodes farther from the surface than this, in edges, are not meant for it.
const FAR: f64 = 3.0;

/// A line turns a corner by more than this, radians: nodes near it are at the corner.
const BENT: f64 = 0.26;

/// Most triangles that a section between two samples may cross.
const MOST_CROSSED: usize = 4000;

/// A surface with the sides of a graph among its edges.
pub(super) struct Inscribed {
    pub mesh: TriangleMesh,
    /// Edges of marked lines, as they were split.
    pub followed: BTreeSet<[u32; 2]>,
    /// Edges of marked lines and of sides.
    pub edges: BTreeSet<[u32; 2]>,
    /// Vertex of each node.
    pub node_vertices: Vec<u32>,
    /// The side along an edge, by its vertices in either order, and whether that order runs against the side.
    pub side_of: BTreeMap<(u32, u32), (u32, bool)>,
}

/// Why a graph cannot be drawn: its elements.
pub(super) enum Undrawn {
    /// Nodes far from the surface.
    Far(Vec<u32>),
    /// Sides between pieces of the surface that do not hang together.
    Apart(Vec<u32>),
    Cancelled(Cancelled),
}

impl From<Cancelled> for Undrawn {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

/// Draws the sides, in their order. O(samples) besides the search structure.
pub(super) fn inscribe(
    input: &Input,
    graph: &DrawnGraph,
    edge_length: f64,
    monitor: &Monitor,
) -> Result<Inscribed, Undrawn> {
    let mut pen = Pen::new(input, edge_length);
    let projected: Vec<_> = graph.nodes.iter().map(|&p| pen.closest.project(p)).collect();
    // Written so that a distance that is no number is far.
    let is_far = |distance: f64| !matches!(distance.partial_cmp(&(FAR * edge_length)), Some(std::cmp::Ordering::Less));
    let far: Vec<u32> = (0..).zip(&projected).filter(|(_, found)| is_far(found.distance)).map(|(n, _)| n).collect();
    if !far.is_empty() {
        return Err(Undrawn::Far(far));
    }
    let mut node_vertices = Vec::with_capacity(graph.nodes.len());
    for p in projected.iter().map(|found| found.point) {
        monitor.check()?;
        let vertex = pen.on_line(p).unwrap_or_else(|| pen.insert(p).0);
        node_vertices.push(vertex);
    }
    let mut apart = Vec::new();
    for (s, side) in (0..).zip(&graph.sides) {
        monitor.stage("drawing sides", f64::from(s) / graph.sides.len() as f64)?;
        if !pen.draw(s, &side.points, side.ends.map(|n| node_vertices[n as usize])) {
            apart.push(s);
        }
    }
    if !apart.is_empty() {
        return Err(Undrawn::Apart(apart));
    }
    let mut edges = pen.followed.clone();
    edges.extend(pen.side_of.keys().map(|&(a, b)| sorted(a, b)).filter(|edge| !pen.border.contains(edge)));
    Ok(Inscribed { mesh: pen.mesh, followed: pen.followed, edges, node_vertices, side_of: pen.side_of })
}

struct Pen {
    mesh: TriangleMesh,
    edge_length: f64,
    /// Triangles at each vertex.
    at: Vec<Vec<u32>>,
    /// Over the surface as it came, and the triangles that each of that surface's was split into.
    closest: ClosestPoint,
    parts: Vec<Vec<u32>>,
    source: Vec<u32>,
    normals: Vec<DVec3>,
    border: BTreeSet<[u32; 2]>,
    followed: BTreeSet<[u32; 2]>,
    side_of: BTreeMap<(u32, u32), (u32, bool)>,
}

impl Pen {
    fn new(input: &Input, edge_length: f64) -> Self {
        let mesh = input.mesh.clone();
        let topology = Topology::of_triangles(&mesh);
        let mut at = vec![Vec::new(); mesh.positions.len()];
        for (t, corners) in (0..).zip(&mesh.triangles) {
            for &v in corners {
                at[v as usize].push(t);
            }
        }
        let count = mesh.triangles.len() as u32;
        let border = topology.edges().filter(|&h| topology.is_border(h));
        Self {
            edge_length,
            at,
            closest: ClosestPoint::new(&mesh),
            parts: (0..count).map(|t| vec![t]).collect(),
            source: (0..count).collect(),
            normals: (0..count as usize).map(|t| mesh.area_normal(t).normalize_or_zero()).collect(),
            border: border.map(|h| sorted(topology.from(h), topology.to(h))).collect(),
            followed: input.followed.iter().copied().collect(),
            side_of: BTreeMap::new(),
            mesh,
        }
    }

    fn position(&self, v: u32) -> DVec3 {
        self.mesh.positions[v as usize]
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        self.position(a).distance(self.position(b))
    }

    fn is_line(&self, a: u32, b: u32) -> bool {
        let edge = sorted(a, b);
        self.border.contains(&edge) || self.followed.contains(&edge)
    }

    fn is_drawn(&self, v: u32) -> bool {
        self.neighbours(v).into_iter().any(|w| self.is_line(v, w) || self.side_of.contains_key(&(v, w)))
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let corners = self.at[v as usize].iter().flat_map(|&t| self.mesh.triangles[t as usize]);
        let mut found: Vec<u32> = corners.filter(|&w| w != v).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn are_joined(&self, a: u32, b: u32) -> bool {
        self.at[a as usize].iter().any(|&t| self.mesh.triangles[t as usize].contains(&b))
    }

    /// Splits an edge at a new vertex.
    fn split(&mut self, a: u32, b: u32, p: DVec3) -> u32 {
        let m = self.mesh.positions.len() as u32;
        self.mesh.positions.push(p);
        self.at.push(Vec::new());
        let both: Vec<u32> =
            self.at[a as usize].iter().copied().filter(|&t| self.mesh.triangles[t as usize].contains(&b)).collect();
        for t in both {
            let corners = self.mesh.triangles[t as usize];
            let new = self.mesh.triangles.len() as u32;
            self.mesh.triangles[t as usize] = corners.map(|v| if v == b { m } else { v });
            self.mesh.triangles.push(corners.map(|v| if v == a { m } else { v }));
            self.source.push(self.source[t as usize]);
            self.parts[self.source[t as usize] as usize].push(new);
            for v in corners.into_iter().filter(|&v| v != a && v != b) {
                self.at[v as usize].push(new);
            }
            self.at[b as usize].retain(|&other| other != t);
            self.at[b as usize].push(new);
            self.at[m as usize].extend([t, new]);
        }
        for set in [&mut self.border, &mut self.followed] {
            if set.remove(&sorted(a, b)) {
                set.extend([sorted(a, m), sorted(b, m)]);
            }
        }
        for (from, to) in [(a, b), (b, a)] {
            if let Some(side) = self.side_of.remove(&(from, to)) {
                self.side_of.extend([((from, m), side), ((m, to), side)]);
            }
        }
        m
    }

    /// The vertex of a point on the nearest line, if one is near.
    fn on_line(&mut self, p: DVec3) -> Option<u32> {
        let near = ON_LINE * self.edge_length;
        let (mut best, mut least) = (None, near);
        for &[a, b] in self.border.iter().chain(&self.followed) {
            let (from, to) = (self.position(a), self.position(b));
            let t = nearest_on_segment(p, from, to);
            let distance = p.distance(from + t * (to - from));
            if distance < least {
                (best, least) = (Some((a, b, t)), distance);
            }
        }
        let (a, b, t) = best?;
        let here = self.position(a).lerp(self.position(b), t);
        let within = |v: u32| if self.is_bent(v) { near } else { SAME * self.edge_length };
        let end = [a, b].into_iter().filter(|&v| self.position(v).distance(here) <= within(v));
        let nearest = end.min_by(|&v, &w| self.position(v).distance(here).total_cmp(&self.position(w).distance(here)));
        Some(nearest.unwrap_or_else(|| self.split(a, b, here)))
    }

    /// Whether a line ends, branches or turns a corner at a vertex.
    fn is_bent(&self, v: u32) -> bool {
        let beside: Vec<u32> = self.neighbours(v).into_iter().filter(|&w| self.is_line(v, w)).collect();
        let &[a, b] = beside.as_slice() else { return true };
        (self.position(v) - self.position(a)).angle_between(self.position(b) - self.position(v)) > BENT
    }

    /// The vertex where the surface is nearest to a point, and the normal there.
    fn insert(&mut self, p: DVec3) -> (u32, DVec3) {
        let found = self.closest.project(p);
        let (p, normal) = (found.point, self.normals[found.triangle as usize]);
        // Of the parts of that triangle the one that holds the point: the least of its weights is greatest.
        let weights = |t: u32| {
            let q = self.mesh.points(t as usize);
            let area = |a: DVec3, b: DVec3| (a - p).cross(b - p).dot(normal);
            let parts = [area(q[1], q[2]), area(q[2], q[0]), area(q[0], q[1])];
            let whole: f64 = parts.iter().sum();
            parts.map(|part| if whole > 0.0 { part / whole } else { -1.0 })
        };
        let inside = |t: &u32| weights(*t).into_iter().fold(f64::INFINITY, f64::min);
        let parts = &self.parts[found.triangle as usize];
        let t = *parts.iter().max_by(|a, b| inside(a).total_cmp(&inside(b))).expect("a triangle has parts");
        let (corners, at) = (self.mesh.triangles[t as usize], weights(t));
        let same = SAME * self.edge_length;
        let nearest = corners.into_iter().filter(|&v| self.position(v).distance(p) <= same);
        let nearest = nearest.min_by(|&v, &w| self.position(v).distance(p).total_cmp(&self.position(w).distance(p)));
        if let Some(v) = nearest {
            return (v, normal);
        }
        // Beside an edge, on it.
        for k in 0..3 {
            let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let along = self.position(b) - self.position(a);
            let t = (p - self.position(a)).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            let foot = self.position(a) + t.clamp(0.0, 1.0) * along;
            if (0.0..1.0).contains(&t) && (foot.distance(p) <= 0.5 * same || at[k] <= 1e-6) {
                return (self.split(a, b, foot), normal);
            }
        }
        // The line from the heaviest corner through the point meets the edge across.
        let k = (0..3).max_by(|&i, &j| at[i].total_cmp(&at[j])).unwrap_or(0);
        let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let share = at[(k + 2) % 3] / (at[(k + 1) % 3] + at[(k + 2) % 3]).max(f64::MIN_POSITIVE);
        let across = self.position(b).lerp(self.position(c), share.clamp(0.0, 1.0));
        let m = self.split(b, c, across);
        (self.split(a, m, p), normal)
    }

    /// Draws one side between the vertices of its nodes; whether the surface joins them. A loop is drawn in two halves, as it
    /// may be a whole border.
    fn draw(&mut self, s: u32, points: &[DVec3], [from, to]: [u32; 2]) -> bool {
        if from == to && points.len() > 2 {
            let (first, second) = (&points[..=points.len() / 2], &points[points.len() / 2..]);
            let middle =
                self.on_line(self.closest.project(second[0]).point).unwrap_or_else(|| self.insert(second[0]).0);
            return middle == from || (self.draw(s, first, [from, middle]) && self.draw(s, second, [middle, to]));
        }
        let near = ON_LINE * self.edge_length;
        let is_along = |pen: &Self, a: u32, b: u32| {
            pen.is_line(a, b) && distance_to(points, pen.position(a).midpoint(pen.position(b))) < near
        };
        if let Some(path) = self.path(from, to, is_along) {
            self.mark(s, &path);
            return true;
        }
        let (mut here, mut normal) = (from, self.normal_near(from));
        for p in samples(points, STEP * self.edge_length) {
            let (next, there) = self.insert(p);
            if !self.join(s, here, next, normal + there) {
                return false;
            }
            (here, normal) = (next, there);
        }
        let last = self.normal_near(to);
        self.join(s, here, to, normal + last)
    }

    fn normal_near(&self, v: u32) -> DVec3 {
        self.at[v as usize].iter().map(|&t| self.mesh.area_normal(t as usize)).sum::<DVec3>().normalize_or_zero()
    }

    /// A path from vertex to vertex, by the section of the plane along a normal where that leads on.
    fn join(&mut self, s: u32, from: u32, to: u32, normal: DVec3) -> bool {
        let mut here = from;
        for _ in 0..MOST_CROSSED {
            if here == to {
                return true;
            }
            if self.are_joined(here, to) {
                self.mark(s, &[here, to]);
                return true;
            }
            let Some(next) = self.crossing(here, to, normal) else { break };
            self.mark(s, &[here, next]);
            here = next;
        }
        let Some(path) = self.path(here, to, |_, _, _| true) else { return false };
        self.mark(s, &path);
        true
    }

    /// The next vertex of a section towards `to`: where it crosses the edge across one of the triangles here.
    fn crossing(&mut self, here: u32, to: u32, normal: DVec3) -> Option<u32> {
        let (p, q) = (self.position(here), self.position(to));
        let plane = normal.cross(q - p).try_normalize()?;
        let left = p.distance(q);
        // A little nearer at least, so that it ends.
        let (mut best, mut least) = (None, left * (1.0 - 1e-9));
        for &t in &self.at[here as usize] {
            let corners = self.mesh.triangles[t as usize];
            let k = corners.iter().position(|&v| v == here)?;
            let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let heights = [a, b].map(|v| (self.position(v) - p).dot(plane));
            if heights[0] * heights[1] > 0.0 || heights[0] == heights[1] {
                continue;
            }
            let share = heights[0] / (heights[0] - heights[1]);
            let x = self.position(a).lerp(self.position(b), share);
            if (x - p).dot(q - p) > 0.0 && x.distance(q) < least {
                (best, least) = (Some((a, b, x)), x.distance(q));
            }
        }
        let (a, b, x) = best?;
        // Vertices of other lines are not touched in passing, but for rounding.
        let within = |v: u32| SAME * self.edge_length * if self.is_drawn(v) { 0.01 } else { 1.0 };
        let end = [a, b].into_iter().find(|&v| self.position(v).distance(x) <= within(v));
        Some(end.unwrap_or_else(|| self.split(a, b, x)))
    }

    fn mark(&mut self, s: u32, path: &[u32]) {
        for w in path.windows(2) {
            self.side_of.insert((w[0], w[1]), (s, false));
            self.side_of.insert((w[1], w[0]), (s, true));
        }
    }

    /// The shortest path along edges that are allowed.
    fn path(&self, from: u32, to: u32, is_allowed: impl Fn(&Self, u32, u32) -> bool) -> Option<Vec<u32>> {
        let mut before: BTreeMap<u32, u32> = BTreeMap::new();
        let mut distance = BTreeMap::from([(from, 0.0)]);
        // Distances as whole numbers order the queue; a millionth of an edge is exact enough.
        let unit = 1e-6 * self.edge_length;
        let mut queue = BinaryHeap::from([(std::cmp::Reverse(0u64), from)]);
        while let Some((std::cmp::Reverse(at), v)) = queue.pop() {
            if v == to {
                let mut path = vec![to];
                while let Some(&v) = before.get(&path[path.len() - 1]) {
                    path.push(v);
                }
                path.reverse();
                return Some(path);
            }
            if at > (distance[&v] / unit) as u64 {
                continue;
            }
            for w in self.neighbours(v) {
                let there = distance[&v] + self.distance(v, w);
                if distance.get(&w).is_none_or(|&known| there < known) && is_allowed(self, v, w) {
                    distance.insert(w, there);
                    before.insert(w, v);
                    queue.push((std::cmp::Reverse((there / unit) as u64), w));
                }
            }
        }
        None
    }
}

/// Points within a polyline: its own where they are not too close, and more on long segments.
fn samples(points: &[DVec3], step: f64) -> Vec<DVec3> {
    let end = points[points.len() - 1];
    let mut last = points[0];
    let mut found = Vec::new();
    for w in points.windows(2) {
        let count = (w[0].distance(w[1]) / step).ceil().max(1.0) as usize;
        for k in 1..=count {
            let p = w[0].lerp(w[1], k as f64 / count as f64);
            if p.distance(last) > 0.4 * step && p.distance(end) > 0.4 * step {
                found.push(p);
                last = p;
            }
        }
    }
    found
}

fn distance_to(points: &[DVec3], p: DVec3) -> f64 {
    let to_segment = |w: &[DVec3]| p.distance(w[0] + nearest_on_segment(p, w[0], w[1]) * (w[1] - w[0]));
    points.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
}
