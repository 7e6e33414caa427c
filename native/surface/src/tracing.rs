//! Field-aligned paths over a triangle mesh: `QuadMixer` (Nuvoli et al. 2019), appendix A, after Campen et al., *Dual loops
//! meshing*, 2012.
//!
//! The graph has four nodes a vertex, one for each direction of its cross (the four-fold cover M4). An arc leads from a
//! node to a vertex within the visibility cone of its direction, and there to the copy whose direction agrees best with the
//! direction of travel. Two of the four copies that differ by half a turn form a sheet of M2: a path that meets another one
//! on the same sheet meets it tangentially, on the other sheet orthogonally. A caller who cuts the mesh along each path
//! before tracing the next, as the patch layout does, tests that with the angle of arrival (see [`Visit`]).
//!
//! Deviations. Arcs reach every vertex seen along a straight line through up to four triangles, not only the one-ring and
//! its neighbours: about 25 directions a vertex instead of 12. Instead of the greedy walk, which can miss the border by one
//! bad choice, the path is the shortest one under length * (1 + penalty * deviation^2). Angles are intrinsic (polar
//! coordinates by unfolding), so creases and strong curvature need no tangent planes.

use crate::cross_field::wrap_quarter;
use glam::{DVec2, DVec3};
use mesh::{NONE, Topology, TriangleMesh};
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashSet};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Triangles that one arc may cross.
const REACH: usize = 4;
/// No way to a node.
const NO_WAY: (f64, u32, u32) = (f64::INFINITY, NONE, NONE);
/// An arc keeps this far from the ends of an edge it crosses, as a fraction of the edge: closer, the detour over the vertex is
/// as straight and cutting leaves no sliver.
const MARGIN: f64 = 0.12;

/// How paths weigh turning against length.
#[derive(Debug, Clone, Copy)]
pub struct TraceOptions {
    /// Half the opening of the visibility cone, radians, 0 to pi/2. Default: 45 degrees, the paper's.
    pub cone: f64,
    /// Extra cost of an arc that leaves its direction by 45 degrees, as a multiple of its length. Default: 20.
    pub penalty: f64,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self { cone: FRAC_PI_4, penalty: 20.0 }
    }
}

/// A point of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TracePoint {
    /// A vertex of the mesh.
    Vertex(u32),
    /// A point inside the edge from the first vertex to the second, at this fraction of its length.
    Edge(u32, u32, f64),
}

/// A path from one vertex to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// From start to end; consecutive points lie in one triangle.
    pub points: Vec<TracePoint>,
    /// Length, scene units.
    pub length: f64,
    /// Length with the penalties for turning and for landing.
    pub cost: f64,
    /// Angles on the surface left and right of the path at each point; at the two ends, which lie on the border, between the path and that.
    pub angles: Vec<[f64; 2]>,
}

impl Trace {
    /// The vertex it starts from.
    pub fn start(&self) -> u32 {
        self.vertex_at(0)
    }

    /// The vertex it lands on.
    pub fn end(&self) -> u32 {
        self.vertex_at(self.points.len() - 1)
    }

    /// Angle, in the polar frame of the last vertex, of the way back along the path.
    pub fn arrival(&self) -> f64 {
        self.angles[self.angles.len() - 1][0]
    }

    /// The vertices it comes through, both ends included.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.points.iter().filter_map(|point| match point {
            TracePoint::Vertex(v) => Some(*v),
            TracePoint::Edge(..) => None,
        })
    }

    fn vertex_at(&self, index: usize) -> u32 {
        match self.points[index] {
            TracePoint::Vertex(v) | TracePoint::Edge(v, ..) => v,
        }
    }
}

/// What a path does at a vertex it could reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Visit {
    /// Goes on. Only for interior vertices.
    Pass,
    /// May end here, at this extra cost in scene units.
    Land(f64),
    /// Must not come here.
    Block,
}

/// A straight arc to a vertex in sight.
#[derive(Debug, Clone, Copy)]
struct Arc {
    to: u32,
    /// Direction in the polar frame of the start.
    leave: f64,
    /// Direction of the way back in the polar frame of the end.
    back: f64,
    length: f64,
    /// Edges crossed: a range of `Arcs::crossings`.
    crossings: [u32; 2],
}

/// The arcs of one vertex.
#[derive(Debug, Clone, Default)]
struct Arcs {
    arcs: Vec<Arc>,
    crossings: Vec<(u32, u32, f64)>,
}

/// What tracing measures at a corner of a triangle: the same wherever the triangle goes, so that a mesh cut in two keeps them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Length of the half-edge that starts here, scene units.
    pub length: f64,
    /// Angle between it and the one before, radians.
    pub angle: f64,
    /// Direction of the triangle's cross, from the half-edge counter-clockwise, radians.
    pub cross: f64,
}

impl Corner {
    /// The corners of a triangle, from one `direction` of its cross. O(1).
    pub fn of(p: [DVec3; 3], direction: DVec3) -> [Self; 3] {
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        [0, 1, 2].map(|k| {
            let along = p[(k + 1) % 3] - p[k];
            Self {
                length: p[k].distance(p[(k + 1) % 3]),
                angle: along.angle_between(p[(k + 2) % 3] - p[k]),
                cross: direction.dot(normal.cross(along)).atan2(direction.dot(along)),
            }
        })
    }

    /// Those of a whole mesh, with a direction of the cross of each triangle: one for each half-edge. O(n).
    pub fn of_mesh(mesh: &TriangleMesh, directions: &[DVec3]) -> Vec<Self> {
        directions.iter().enumerate().flat_map(|(t, &direction)| Self::of(mesh.points(t), direction)).collect()
    }
}

/// The cheapest way to each node of a search: its cost, the arc that reached it and the node it came from.
type Ways = Vec<(f64, u32, u32)>;

/// The tracing graph of a mesh with a cross per face. Arcs are found when a path first comes to their vertex, so that short
/// traces on a large mesh stay cheap, and kept as long as what they cross: about 5 microseconds and 2 kB a vertex.
///
/// The polar frame of an interior vertex measures angles from the half-edge `topology.outgoing`, scaled to a full turn; that
/// of a border vertex from its outgoing border half-edge through the inside, unscaled, up to [`FieldGraph::angle`].
#[derive(Debug)]
pub struct FieldGraph {
    /// Of triangles. Who changes it renews the graph.
    pub topology: Topology,
    /// One for each half-edge, the same.
    pub corners: Vec<Corner>,
    /// Direction of each half-edge in the frame of its origin.
    polar: Vec<f64>,
    /// Angles of a vertex's frame over those of the surface.
    scale: Vec<f64>,
    angle: Vec<f64>,
    on_border: Vec<bool>,
    field: Vec<OnceLock<f64>>,
    arcs: Vec<OnceLock<Arcs>>,
    /// Room for searches, with no way to any node: to make it anew for each would cost more than a short trace.
    room: Mutex<Vec<Ways>>,
}

/// Strip of triangles unfolded into the plane about the start, while looking for vertices in sight.
struct Sight<'a> {
    graph: &'a FieldGraph,
    found: Arcs,
    start: u32,
    /// Angle of the unfolded x axis in the frame of the start.
    base: f64,
    /// Edges looked through, nearest first, with their ends in the plane.
    through: Vec<(u32, DVec2, DVec2)>,
}

impl FieldGraph {
    /// Builds the graph from the corners of a triangle mesh, one for each half-edge.
    pub fn new(topology: Topology, corners: Vec<Corner>) -> Self {
        let mut graph = Self {
            topology,
            corners,
            polar: vec![],
            scale: vec![],
            angle: vec![],
            on_border: vec![],
            field: vec![],
            arcs: vec![],
            room: Mutex::default(),
        };
        graph.renew(&[], &[]);
        graph
    }

    /// Vertices that may see one of these or over a triangle of theirs: what is known about them is to be renewed when triangles at these
    /// vertices change. Costs what it finds.
    pub fn seeing(&self, vertices: &[u32]) -> Vec<u32> {
        let topology = &self.topology;
        let mut found: Vec<u32> = vertices.iter().flat_map(|&v| topology.around(v)).map(|h| h / 3).collect();
        found.sort_unstable();
        found.dedup();
        let mut known: HashSet<u32> = found.iter().copied().collect();
        let mut from = 0;
        for _ in 1..REACH {
            let to = found.len();
            for k in from..to {
                let across = (3 * found[k]..3 * found[k] + 3).map(|h| topology.twin[h as usize]);
                found.extend(across.filter(|&h| h != NONE && known.insert(h / 3)).map(|h| h / 3));
            }
            from = to;
        }
        let mut seeing: Vec<u32> = found.iter().flat_map(|t| 3 * t..3 * t + 3).map(|h| topology.from(h)).collect();
        seeing.sort_unstable();
        seeing.dedup();
        seeing
    }

    /// Measures the frames of some vertices and of new ones again, and forgets what those that may see them saw, see
    /// [`FieldGraph::seeing`].
    pub fn renew(&mut self, vertices: &[u32], seeing: &[u32]) {
        let (first, all) = (self.angle.len(), self.topology.outgoing.len());
        self.polar.resize(self.topology.len(), 0.0);
        self.scale.resize(all, 1.0);
        self.angle.resize(all, 0.0);
        self.on_border.resize(all, false);
        self.field.resize_with(all, OnceLock::new);
        self.arcs.resize_with(all, OnceLock::new);
        for &v in seeing {
            self.arcs[v as usize] = OnceLock::new();
        }
        for v in vertices.iter().copied().chain(first as u32..all as u32) {
            let (topology, corners) = (&self.topology, &self.corners);
            let on_border = topology.is_border_vertex(v);
            let mut sum = 0.0;
            for h in topology.around(v) {
                self.polar[h as usize] = sum;
                sum += corners[h as usize].angle;
            }
            let scale = if on_border || sum <= 0.0 { 1.0 } else { TAU / sum };
            topology.around(v).for_each(|h| self.polar[h as usize] *= scale);
            let v = v as usize;
            (self.angle[v], self.scale[v], self.on_border[v]) = (sum, scale, on_border);
            self.field[v] = OnceLock::new();
        }
    }

    /// The arcs that leave a vertex.
    fn arcs(&self, start: u32) -> &Arcs {
        self.arcs[start as usize].get_or_init(|| {
            let found = Arcs { arcs: Vec::with_capacity(32), crossings: Vec::with_capacity(32) };
            let mut sight = Sight { graph: self, found, start, base: 0.0, through: Vec::with_capacity(REACH) };
            for h in self.topology.around(start) {
                let twin = self.topology.twin[h as usize];
                let Corner { length, angle, .. } = self.corners[h as usize];
                if twin != NONE {
                    sight.found.arcs.push(Arc {
                        to: self.topology.to(h),
                        leave: self.polar[h as usize],
                        back: self.polar[twin as usize],
                        length,
                        crossings: [0, 0],
                    });
                }
                sight.base = self.polar[h as usize];
                let right = DVec2::new(length, 0.0);
                let left = self.corners[self.topology.prev[h as usize] as usize].length * DVec2::from_angle(angle);
                sight.look(self.topology.next[h as usize], [right, left], [right, left]);
            }
            sight.found
        })
    }

    /// Sum of the corner angles at a vertex, radians.
    pub fn angle(&self, v: u32) -> f64 {
        self.angle[v as usize]
    }

    /// The angle of one direction of the cross in the polar frame of a vertex; add quarter turns for the others.
    pub fn field(&self, v: u32) -> f64 {
        *self.field[v as usize].get_or_init(|| {
            let mut power = DVec2::ZERO;
            for h in self.topology.around(v) {
                let Corner { angle, cross, .. } = self.corners[h as usize];
                // The frame stretches angles: measure from the middle of the corner, so that both its sides count alike.
                let stretch = 0.5 * angle * (self.scale[v as usize] - 1.0);
                power += angle * DVec2::from_angle(4.0 * (self.polar[h as usize] + stretch + cross));
            }
            power.to_angle() / 4.0
        })
    }

    /// The cheapest path from `start` that leaves within the cone of `direction` (an angle in its polar frame), follows the
    /// field through interior vertices and lands where `visit` (vertex, angle of the way back) lets it. A border vertex is
    /// never passed through. `None` when no landing can be reached or `limit` (a cost) is exceeded.
    /// Costs O(n log n) at worst in the vertices closer than the landing.
    pub fn trace(
        &self,
        start: u32,
        direction: f64,
        options: &TraceOptions,
        limit: f64,
        mut visit: impl FnMut(u32, f64) -> Visit,
    ) -> Option<Trace> {
        let nodes = 4 * self.field.len();
        let room = || self.room.lock().unwrap_or_else(PoisonError::into_inner);
        let mut best = room().pop().unwrap_or_default();
        best.resize(nodes, NO_WAY);
        let mut reached_nodes = Vec::new();
        let found = self.search(start, direction, options, limit, &mut visit, (&mut best, &mut reached_nodes));
        for node in reached_nodes {
            best[node as usize] = NO_WAY;
        }
        room().push(best);
        found
    }

    /// See [`FieldGraph::trace`]; `ways` has none, and gets the nodes it has ways to.
    fn search(
        &self,
        start: u32,
        direction: f64,
        options: &TraceOptions,
        limit: f64,
        visit: &mut impl FnMut(u32, f64) -> Visit,
        (best, ways): (&mut Ways, &mut Vec<u32>),
    ) -> Option<Trace> {
        let nodes = best.len();
        let mut landing: Option<(f64, u32, u32)> = None;
        let mut queue = BinaryHeap::new();
        let origin = nodes as u32;
        queue.push(Reached { cost: 0.0, node: origin });
        while let Some(Reached { cost, node }) = queue.pop() {
            if cost > limit || landing.is_some_and(|(found, ..)| found <= cost) {
                break;
            }
            let (v, heading) = if node == origin {
                (start, direction)
            } else if cost > best[node as usize].0 {
                continue;
            } else {
                (node / 4, self.field(node / 4) + f64::from(node % 4) * FRAC_PI_2)
            };
            for (index, arc) in self.arcs(v).arcs.iter().enumerate() {
                let index = index as u32;
                let turn = self.difference(v, arc.leave, heading).abs();
                if turn > options.cone || arc.to == start {
                    continue;
                }
                // A border vertex has no settled cross: its landing is judged by the angle of arrival alone.
                let travel = arc.back + PI;
                let is_inside = !self.on_border[arc.to as usize];
                let field = if is_inside { self.field(arc.to) } else { 0.0 };
                let off = wrap_quarter(travel - field);
                let settled = if is_inside { off.abs() } else { turn };
                let deviation = (turn * turn + settled * settled) / (2.0 * FRAC_PI_4 * FRAC_PI_4);
                let reached = cost + arc.length * (1.0 + options.penalty * deviation);
                match visit(arc.to, arc.back) {
                    Visit::Block => {}
                    Visit::Land(extra) => {
                        if landing.is_none_or(|(found, ..)| reached + extra < found) {
                            landing = Some((reached + extra, index, node));
                        }
                    }
                    Visit::Pass => {
                        let branch = (((travel - off - field) / FRAC_PI_2).round() as i64).rem_euclid(4);
                        let next = 4 * arc.to + branch as u32;
                        if reached < best[next as usize].0 {
                            if best[next as usize].1 == NONE {
                                ways.push(next);
                            }
                            best[next as usize] = (reached, index, node);
                            queue.push(Reached { cost: reached, node: next });
                        }
                    }
                }
            }
        }
        let (cost, last, mut node) = landing.filter(|l| l.0 <= limit)?;
        // From the landing back to the start: the vertex each arc leaves, and its index there.
        let vertex = |node: u32| if node == origin { start } else { node / 4 };
        let mut steps = vec![(vertex(node), last as usize)];
        while node != origin {
            let (_, arc, from) = best[node as usize];
            steps.push((vertex(from), arc as usize));
            node = from;
        }
        let mut points = vec![TracePoint::Vertex(start)];
        let mut angles = vec![];
        let mut length = 0.0;
        // Of the way back from the vertex; from the start none.
        let mut back = None;
        for &(v, index) in steps.iter().rev() {
            let Arcs { arcs, crossings } = self.arcs(v);
            let arc = arcs[index];
            let left = back.map_or(self.angle(v) - arc.leave, |back: f64| {
                (back - arc.leave).rem_euclid(TAU) / self.scale[v as usize]
            });
            angles.push([left, self.angle(v) - left]);
            let crossed = &crossings[arc.crossings[0] as usize..arc.crossings[1] as usize];
            points.extend(crossed.iter().map(|&(a, b, t)| TracePoint::Edge(a, b, t)));
            angles.extend(crossed.iter().map(|_| [PI; 2]));
            points.push(TracePoint::Vertex(arc.to));
            length += arc.length;
            back = Some(arc.back);
        }
        let last = self.arcs(steps[0].0).arcs[steps[0].1];
        angles.push([last.back, self.angle(last.to) - last.back]);
        Some(Trace { points, length, cost, angles })
    }

    /// Signed angle between two directions at a vertex.
    fn difference(&self, v: u32, a: f64, b: f64) -> f64 {
        let d = a - b;
        // Most are less than half a turn, and rounding takes its time.
        if self.on_border[v as usize] || d.abs() < 3.0 { d } else { d - TAU * (d / TAU).round() }
    }
}

/// A node of the search, cheapest first, then lowest.
struct Reached {
    cost: f64,
    node: u32,
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.node.cmp(&self.node))
    }
}
impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Reached {}

impl Sight<'_> {
    /// Looks through half-edge `edge`, whose ends unfold to `[right, left]` = `ends`, between the rays of `window`.
    fn look(&mut self, edge: u32, ends: [DVec2; 2], window: [DVec2; 2]) {
        let twin = self.graph.topology.twin[edge as usize];
        if twin == NONE || self.through.len() + 1 >= REACH {
            return;
        }
        let beyond = self.graph.topology.next[twin as usize];
        let apex = self.graph.topology.prev[twin as usize];
        let [from_right, from_left] = [beyond, apex].map(|h| self.graph.corners[h as usize].length);
        let point = unfold(ends, from_right, from_left);
        self.through.push((edge, ends[0], ends[1]));
        let [from_right, from_left] = [window[0].perp_dot(point), point.perp_dot(window[1])];
        if from_right > 0.0 && from_left > 0.0 {
            self.arrive(apex, point, ends);
        }
        if from_right > 0.0 {
            let left = if from_left > 0.0 { point } else { window[1] };
            self.look(beyond, [ends[0], point], [window[0], left]);
        }
        if from_left > 0.0 {
            let right = if from_right > 0.0 { point } else { window[0] };
            self.look(apex, [point, ends[1]], [right, window[1]]);
        }
        self.through.pop();
    }

    /// Adds the arc to the origin of `apex`, seen at `point` over the edge with the unfolded `ends`.
    fn arrive(&mut self, apex: u32, point: DVec2, ends: [DVec2; 2]) {
        let to = self.graph.topology.from(apex);
        let first = self.found.crossings.len();
        for &(edge, right, left) in &self.through {
            // Solve right + t (left - right) parallel to point.
            let t = right.perp_dot(point) / (right - left).perp_dot(point);
            if !(MARGIN..=1.0 - MARGIN).contains(&t) {
                self.found.crossings.truncate(first);
                return;
            }
            self.found.crossings.push((self.graph.topology.from(edge), self.graph.topology.to(edge), t));
        }
        if to == self.start {
            self.found.crossings.truncate(first);
            return;
        }
        // At the apex, angles run from the half-edge to the left end towards the right end.
        let inner = (ends[1] - point).angle_to(-point);
        self.found.arcs.push(Arc {
            to,
            leave: self.base + self.graph.scale[self.start as usize] * point.to_angle(),
            back: self.graph.polar[apex as usize] + self.graph.scale[to as usize] * inner,
            length: point.length(),
            crossings: [first as u32, self.found.crossings.len() as u32],
        });
    }
}

/// The point beyond the segment `[right, left]` at the given distances from its ends.
fn unfold([right, left]: [DVec2; 2], from_right: f64, from_left: f64) -> DVec2 {
    let along = left - right;
    let width = along.length();
    let x = (width * width + from_right * from_right - from_left * from_left) / (2.0 * width);
    let height = (from_right * from_right - x * x).max(0.0).sqrt();
    right + (along * x - along.perp() * height) / width
}

#[cfg(test)]
#[path = "tracing_tests.rs"]
mod tests;
