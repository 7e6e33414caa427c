//! The mesh that is divided, and how paths cut it.
//!
//! Cutting copies the vertices along the path, so that a region that meets itself along a cut is still an ordinary mesh: a region is
//! the triangles that can be reached from one another, and every vertex belongs to one. All stays where it is but for what lies along
//! the path, so that a cut costs what the smaller of its sides has, and what the graph for tracing knows elsewhere stays true.

use super::region::{Region, Share};
use glam::DVec3;
use mesh::{NONE, Topology, TriangleMesh};
use solve::components::connected_components;
use std::collections::{BTreeMap, BTreeSet};
use surface::tracing::{Corner, FieldGraph, Trace, TracePoint};

/// A mesh cut into regions, what is known about its vertices, and the graph for tracing on it.
pub(super) struct Canvas {
    /// The triangles, with what traces follow: three half-edges each, in order.
    pub graph: FieldGraph,
    /// A direction of the cross of each triangle.
    field: Vec<DVec3>,
    /// Place of each vertex, copies share theirs.
    pub place: Vec<u32>,
    /// Quarters of each border vertex; 0 inside.
    pub quarters: Vec<u8>,
    /// Index of the cross at each vertex inside, in quarter turns: 0 where it is regular, and on the border.
    pub index: Vec<i8>,
    /// Positions of the places.
    pub positions: Vec<DVec3>,
    /// Places on the border given by the caller: fixed, never too close to each other.
    pub fixed: Vec<bool>,
    /// Places where a side of some region ends.
    pub node: Vec<bool>,
    /// Mean length of the border's edges: what "too close" is measured in.
    pub edge_length: f64,
    /// Traces, by place and quarter, that gave no cut when they were the cheapest: tried last.
    pub failed: BTreeSet<(u32, u8)>,
}

/// Triangles on the two sides of a path: left, right.
pub(super) type Sides = [Vec<u32>; 2];

impl Canvas {
    /// A mesh with a direction of the cross of each triangle and the index of the cross at each vertex, and its regions when it is cut
    /// along `features`, in the order of their first triangles. Border vertices have two quarters.
    pub fn new(
        mesh: &TriangleMesh,
        features: &[[u32; 2]],
        field: &[DVec3],
        index: Vec<i8>,
        edge_length: f64,
    ) -> (Self, Vec<Region>) {
        let topology = Topology::of_triangles(mesh);
        let fixed: Vec<bool> = (0..mesh.positions.len() as u32).map(|v| topology.is_border_vertex(v)).collect();
        let edges: Vec<u32> =
            features.iter().filter_map(|&[a, b]| topology.find(a, b)).filter(|&h| !topology.is_border(h)).collect();
        let mut canvas = Self {
            graph: FieldGraph::new(topology, Corner::of_mesh(mesh, field)),
            field: field.to_vec(),
            place: (0..mesh.positions.len() as u32).collect(),
            quarters: fixed.iter().map(|&fixed| 2 * u8::from(fixed)).collect(),
            index: index.into_iter().zip(&fixed).map(|(index, &fixed)| if fixed { 0 } else { index }).collect(),
            positions: mesh.positions.clone(),
            node: vec![false; mesh.positions.len()],
            fixed,
            edge_length,
            failed: BTreeSet::new(),
        };
        let ends: Vec<u32> = edges.iter().flat_map(|&h| [canvas.topology().from(h), canvas.topology().to(h)]).collect();
        canvas.open(&edges, &BTreeMap::new());
        canvas.graph.renew(&ends, &[]);
        let twin = &canvas.topology().twin;
        let joined = twin.iter().enumerate().filter(|(_, h)| **h != NONE).map(|(g, h)| (g as u32 / 3, h / 3));
        let parts = connected_components(mesh.triangles.len(), joined);
        let regions = (0..).zip(parts).map(|(part, triangles)| Region { triangles, part }).collect();
        (canvas, regions)
    }

    pub fn topology(&self) -> &Topology {
        &self.graph.topology
    }

    /// Where a vertex lies.
    pub fn at(&self, v: u32) -> DVec3 {
        self.positions[self.place[v as usize] as usize]
    }

    /// Where a point of a path lies.
    pub fn at_point(&self, point: TracePoint) -> DVec3 {
        match point {
            TracePoint::Vertex(v) => self.at(v),
            TracePoint::Edge(a, b, t) => self.at(a).lerp(self.at(b), t),
        }
    }

    /// The vertices of a triangle.
    pub fn corners(&self, t: u32) -> [u32; 3] {
        [0, 1, 2].map(|k| self.topology().from(3 * t + k))
    }

    /// Area of a triangle.
    pub fn area(&self, t: u32) -> f64 {
        let [a, b, c] = self.corners(t).map(|v| self.at(v));
        (b - a).cross(c - a).length() / 2.0
    }

    /// Cuts a region along a path and returns its one or two parts, the one that holds the first triangle first.
    ///
    /// The path must be one that [`super::preview::Crossing::new`] takes.
    pub fn cut(&mut self, region: &Region, trace: &Trace, share: Share) -> Vec<Region> {
        let mut near = BTreeSet::new();
        for &point in &trace.points {
            match point {
                TracePoint::Vertex(v) => near.extend([v]),
                TracePoint::Edge(a, b, _) => {
                    let both = self.topology().find(a, b).map(|h| [h, self.topology().twin[h as usize]]);
                    near.extend(both.into_iter().flatten().flat_map(|h| self.corners(h / 3)));
                }
            }
        }
        let near: Vec<u32> = near.into_iter().collect();
        let seeing = self.graph.seeing(&near);
        let triangles = self.field.len() as u32;
        let path: Vec<u32> = (trace.points.iter())
            .filter_map(|&point| match point {
                TracePoint::Vertex(v) => Some(v),
                TracePoint::Edge(a, b, t) => self.split_edge(a, b, t),
            })
            .collect();
        let edges: Vec<u32> = path.windows(2).filter_map(|w| self.topology().find(w[0], w[1])).collect();
        debug_assert_eq!(edges.len() + 1, trace.points.len(), "the path is one of edges");
        let sides: Sides = [
            edges.iter().map(|h| h / 3).collect(),
            edges.iter().map(|&h| self.topology().twin[h as usize] / 3).collect(),
        ];
        // Which side of the path each corner at the two ends lies on, decided before the cut.
        let mut quarters_at: BTreeMap<u32, u8> = BTreeMap::new();
        if let [first, .., last] | [first @ last] = edges[..] {
            let ends =
                [(path[0], share.start, first), (path[path.len() - 1], share.end, self.topology().twin[last as usize])];
            for (v, share, along) in ends {
                let mut side = 0;
                for h in self.topology().around(v) {
                    side |= usize::from(h == along);
                    quarters_at.insert(h, share[side]);
                }
            }
        }
        self.open(&edges, &quarters_at);
        self.graph.renew(&near, &seeing);
        for end in [trace.start(), trace.end()] {
            self.node[self.place[end as usize] as usize] = true;
        }
        let mut all = region.triangles.clone();
        all.extend(triangles..self.field.len() as u32);
        let mut marks = vec![0; self.field.len()];
        let Some((_, few)) = self.smaller_side(&sides, &[], &mut marks) else {
            return vec![Region { triangles: all, ..*region }];
        };
        let mut is_few = vec![false; self.field.len()];
        for &t in &few {
            is_few[t as usize] = true;
        }
        let first = is_few[all[0] as usize];
        let (one, other) = all.into_iter().partition(|&t| is_few[t as usize] == first);
        [one, other].map(|triangles| Region { triangles, ..*region }).into()
    }

    /// The triangles on that side of a path which has fewer or as many, and which side it is; `None` where both sides are one. `sides` are
    /// triangles beside the path on either, `walls` the half-edges that no way leads across, sorted, and `marks` by triangle 0; what is
    /// reached gets 1 and 2. Others are left out.
    pub fn smaller_side(&self, sides: &Sides, walls: &[u32], marks: &mut [u8]) -> Option<(usize, Vec<u32>)> {
        let twin = &self.topology().twin;
        let mut reached: Sides = [vec![], vec![]];
        for (side, seeds) in sides.iter().enumerate() {
            for &t in seeds {
                match marks[t as usize] {
                    0 => {
                        marks[t as usize] = side as u8 + 1;
                        reached[side].push(t);
                    }
                    mark if mark == 2 - side as u8 => return None,
                    _ => {}
                }
            }
        }
        let mut next = 0;
        loop {
            for (side, reached) in reached.iter_mut().enumerate() {
                let Some(&t) = reached.get(next) else {
                    return Some((side, std::mem::take(reached)));
                };
                for h in 3 * t..3 * t + 3 {
                    let across = twin[h as usize];
                    if across == NONE {
                        continue;
                    }
                    let mark = &mut marks[across as usize / 3];
                    if *mark == 0 && walls.binary_search(&h).is_err() {
                        *mark = side as u8 + 1;
                        reached.push(across / 3);
                    } else if *mark == 2 - side as u8 && walls.binary_search(&h).is_err() {
                        return None;
                    }
                }
            }
            next += 1;
        }
    }

    /// Opens the mesh along interior edges (one half-edge each). `quarters_at` gives those of a border vertex from its outgoing border
    /// half-edge, else it has what it had, or two where it was inside.
    fn open(&mut self, edges: &[u32], quarters_at: &BTreeMap<u32, u8>) {
        let topology = &mut self.graph.topology;
        let ends: BTreeSet<u32> = edges.iter().flat_map(|&h| [topology.from(h), topology.to(h)]).collect();
        let around: Vec<(u32, Vec<u32>)> = ends.into_iter().map(|v| (v, topology.around(v).collect())).collect();
        for &h in edges {
            let other = std::mem::replace(&mut topology.twin[h as usize], NONE);
            topology.twin[other as usize] = NONE;
        }
        for (v, around) in around {
            let old = self.quarters[v as usize];
            let mut id = v;
            // Fans of triangles that hang together: the first keeps the vertex.
            for first in around.into_iter().filter(|h| topology.twin[*h as usize] == NONE) {
                if id == NONE {
                    id = self.place.len() as u32;
                    self.place.push(self.place[v as usize]);
                    self.quarters.push(0);
                    self.index.push(0);
                    topology.outgoing.push(NONE);
                }
                topology.outgoing[id as usize] = first;
                let fan: Vec<u32> = topology.around(id).collect();
                for h in fan {
                    topology.origin[h as usize] = id;
                }
                self.quarters[id as usize] = quarters_at.get(&first).copied().unwrap_or(if old == 0 { 2 } else { old });
                self.index[id as usize] = 0;
                id = NONE;
            }
        }
    }

    /// Splits every interior edge of a region that joins two border vertices, so that a map of the border onto a polygon squeezes no
    /// triangle onto one side.
    pub fn split_chords(&mut self, region: &mut Region) {
        let topology = self.topology();
        let ends = |h: u32| [topology.from(h), topology.to(h)];
        let half_edges = region.triangles.iter().flat_map(|t| 3 * t..3 * t + 3);
        let chord = |h: &u32| {
            *h < topology.twin[*h as usize]
                && !topology.is_border(*h)
                && ends(*h).iter().all(|&v| self.quarters[v as usize] > 0)
        };
        let chords: Vec<[u32; 2]> = half_edges.filter(chord).map(ends).collect();
        for [a, b] in chords {
            let first = self.field.len() as u32;
            self.split_edge(a, b, 0.5);
            region.triangles.extend(first..self.field.len() as u32);
        }
    }

    /// Puts a vertex on the interior edge from `a` to `b`. `None` when there is no such edge.
    fn split_edge(&mut self, a: u32, b: u32, t: f64) -> Option<u32> {
        let h = self.topology().find(a, b).filter(|&h| !self.topology().is_border(h))?;
        let twin = self.topology().twin[h as usize];
        let middle = self.place.len() as u32;
        let at = self.at(a).lerp(self.at(b), t);
        self.place.push(self.positions.len() as u32);
        self.positions.push(at);
        self.quarters.push(0);
        self.index.push(0);
        self.fixed.push(false);
        self.node.push(false);
        let topology = &mut self.graph.topology;
        topology.outgoing.push(topology.next[h as usize]);
        let [beyond, before] = [h, twin].map(|h| self.split_triangle(h, middle));
        self.pair(h, before);
        self.pair(twin, beyond);
        Some(middle)
    }

    /// Splits the triangle of half-edge `h` at `middle`, a vertex on it. The triangle keeps the half before `middle`; returns the
    /// half-edge of the other half. The twins of both are left to the caller.
    fn split_triangle(&mut self, h: u32, middle: u32) -> u32 {
        let topology = &mut self.graph.topology;
        let (face, added) = (h / 3, topology.len() as u32 - h / 3 * 3);
        let [next, prev] = [topology.next[h as usize], topology.prev[h as usize]];
        let mut far = [0, 1, 2].map(|k| topology.from(3 * face + k));
        far[h as usize % 3] = middle;
        // The new triangle's half-edges lie as those of the old one, `added` places on.
        let first = topology.len() as u32;
        topology.origin.extend(far);
        topology.face.extend([first / 3; 3]);
        topology.next.extend([first + 1, first + 2, first]);
        topology.prev.extend([first + 2, first, first + 1]);
        topology.twin.extend([NONE; 3]);
        let end = topology.origin[next as usize];
        if topology.outgoing[end as usize] == next {
            topology.outgoing[end as usize] = next + added;
        }
        topology.origin[next as usize] = middle;
        let outer = topology.twin[next as usize];
        self.pair(next + added, outer);
        self.pair(next, prev + added);
        let cross = self.field[face as usize];
        self.field.push(cross);
        let [own, other] = [face, first / 3].map(|t| Corner::of(self.corners(t).map(|v| self.at(v)), cross));
        let corners = &mut self.graph.corners;
        corners[3 * face as usize..3 * face as usize + 3].copy_from_slice(&own);
        corners.extend(other);
        h + added
    }

    /// Makes two half-edges twins; the second may be missing.
    fn pair(&mut self, h: u32, other: u32) {
        let twin = &mut self.graph.topology.twin;
        twin[h as usize] = other;
        if other != NONE {
            twin[other as usize] = h;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::preview::Preview;
    use super::super::region::{Outline, Shape};
    use super::super::{LayoutOptions, indices};
    use super::*;
    use glam::DVec2;
    use std::f64::consts::FRAC_PI_4;
    use surface::tracing::{TraceOptions, Visit};
    use testkit::plane_region::{circle, plane_region};

    /// A hilly disk with two holes whose cross turns by a quarter about one of its vertices, and its one region.
    fn canvas() -> (Canvas, Region) {
        let hill = |p: DVec2| p.extend(0.5 * (-p.length_squared()).exp());
        let holes = [circle(DVec2::new(-1.0, 0.3), 0.4, 14), circle(DVec2::new(1.1, -0.2), 0.5, 16)];
        let mesh = plane_region(&[circle(DVec2::ZERO, 2.2, 60), holes[0].clone(), holes[1].clone()], hill);
        let centre = |t: usize| mesh.points(t).into_iter().sum::<DVec3>() / 3.0;
        let turned = |t: usize| {
            let angle = centre(t).truncate().to_angle() / 4.0;
            DVec3::new(angle.cos(), angle.sin(), 0.0)
        };
        let field: Vec<DVec3> = (0..mesh.triangles.len()).map(turned).collect();
        let middle = (0..mesh.positions.len()).min_by(|&a, &b| {
            let far = |v: usize| mesh.positions[v].truncate().length();
            far(a).total_cmp(&far(b))
        });
        let index = indices(&mesh, &[(middle.expect("a vertex") as u32, 1)], 0.0);
        let (canvas, mut regions) = Canvas::new(&mesh, &[], &field, index, 0.2);
        assert_eq!(regions.len(), 1);
        (canvas, regions.remove(0))
    }

    /// A trace from each border vertex of a region.
    fn traces(canvas: &Canvas, outline: &Outline) -> Vec<(Trace, Share)> {
        let graph = &canvas.graph;
        let mut found = vec![];
        for bend in outline.loops.iter().flatten() {
            let lands = |v: u32, back: f64| {
                let off = (back - graph.angle(v) / 2.0).abs();
                match canvas.quarters[v as usize] {
                    0 => Visit::Pass,
                    2 if off < FRAC_PI_4 => Visit::Land(0.0),
                    _ => Visit::Block,
                }
            };
            if bend.quarters == 2 {
                let options = TraceOptions::default();
                let trace = graph.trace(bend.vertex, bend.angle / 2.0, &options, f64::INFINITY, lands);
                found.extend(trace.map(|trace| (trace, Share { start: [1, 1], end: [1, 1] })));
            }
        }
        found
    }

    /// Checks the topology against one built anew, and what tracing measures against a graph built anew.
    fn check(canvas: &Canvas, regions: &[Region]) {
        let own = canvas.topology();
        let count = own.len() as u32 / 3;
        let triangles: Vec<[u32; 3]> = (0..count).map(|t| canvas.corners(t)).collect();
        let fresh = Topology::new(canvas.place.len(), &triangles);
        assert_eq!((&own.twin, &own.face, &own.next), (&fresh.twin, &fresh.face, &fresh.next));
        assert_eq!((&own.prev, &own.origin), (&fresh.prev, &fresh.origin));
        for v in 0..canvas.place.len() as u32 {
            assert_eq!(own.from(own.outgoing[v as usize]), v);
            assert_eq!(own.is_border_vertex(v), fresh.is_border_vertex(v));
            assert_eq!(own.around(v).count(), fresh.around(v).count());
        }
        let mut all: Vec<u32> = regions.iter().flat_map(|region| region.triangles.clone()).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..count));
        let anew = FieldGraph::new(own.clone(), canvas.graph.corners.clone());
        for region in regions {
            for bend in Outline::new(canvas, region).loops.into_iter().flatten().step_by(7) {
                let land =
                    |v: u32, _: f64| if canvas.quarters[v as usize] > 0 { Visit::Land(0.0) } else { Visit::Pass };
                let [own, anew] = [&canvas.graph, &anew].map(|graph| {
                    graph.trace(bend.vertex, graph.angle(bend.vertex) / 2.0, &TraceOptions::default(), 9.0, land)
                });
                assert_eq!(own, anew);
            }
        }
    }

    #[test]
    fn a_cut_leaves_what_its_preview_says_and_all_that_is_known_stays_true() {
        let options = LayoutOptions { regular: true, longest: 1.0, ..LayoutOptions::default() };
        let (mut joined, mut apart) = (0, 0);
        for first in (0..90).step_by(3) {
            let (mut canvas, region) = canvas();
            let mut regions = vec![region];
            // Three cuts, one after another.
            for k in 0..3 {
                let region = regions.remove(0);
                let outline = Outline::new(&canvas, &region);
                let all = traces(&canvas, &outline);
                assert!(all.len() > 10);
                let (trace, share) = &all[(first + 11 * k) % all.len()];
                let Some(preview) = Preview::new(&canvas, &outline, trace, *share, &options) else {
                    regions.push(region);
                    continue;
                };
                let parts = canvas.cut(&region, trace, *share);
                let outlines: Vec<Outline> = parts.iter().map(|part| Outline::new(&canvas, part)).collect();
                let shape = |outline: &Outline| {
                    Shape::of(&outline.loops, outline.euler_characteristic, outline.index(&canvas), &options)
                };
                let shapes: Vec<Shape> = outlines.iter().map(shape).collect();
                let balance = match &outlines[..] {
                    [a, b] => a.area.min(b.area) / outline.area,
                    _ => 0.5,
                };
                let left = Preview::of(&shapes, balance);
                assert!((left.balance - preview.balance).abs() < 1e-9);
                assert_eq!(Preview { balance: 0.0, ..left }, Preview { balance: 0.0, ..preview });
                if parts.len() == 1 {
                    joined += 1;
                } else {
                    apart += 1;
                }
                regions.extend(parts);
                regions.sort_by_key(|region| std::cmp::Reverse(region.triangles.len()));
            }
            check(&canvas, &regions);
        }
        assert!(joined >= 10 && apart >= 10, "{joined} {apart}");
    }

    #[test]
    fn edges_between_border_vertices_are_split() {
        let mut split = 0;
        for k in 0..20 {
            let (mut canvas, region) = canvas();
            let all = traces(&canvas, &Outline::new(&canvas, &region));
            let (trace, share) = &all[3 * k];
            for mut part in canvas.cut(&region, trace, *share) {
                let before = part.triangles.len();
                canvas.split_chords(&mut part);
                split += part.triangles.len() - before;
                let topology = canvas.topology();
                let is_chord = |h: u32| {
                    let ends = [topology.from(h), topology.to(h)];
                    !topology.is_border(h) && ends.iter().all(|&v| canvas.quarters[v as usize] > 0)
                };
                assert!(!part.triangles.iter().flat_map(|t| 3 * t..3 * t + 3).any(is_chord));
            }
        }
        assert!(split > 0);
    }
}
