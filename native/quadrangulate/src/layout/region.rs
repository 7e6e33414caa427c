//! A part of the surface still to be divided: cutting it along paths, and what each border corner is worth.
//!
//! A corner's worth is its number of *quarters*: how many quads should meet there, 1 where convex, 2 where flat, 3 where
//! concave, 4 at the tip of a slit. A path into a corner shares the quarters between its two sides, which is all of
//! figure 8: concave 3 = 1 + 2 by one trace and 1 + 1 + 1 by two, flat 2 = 1 + 1, and convex 1 cannot be shared.
//!
//! Cutting copies the vertices along the path, so that a region that meets itself along a cut is still an ordinary mesh.

use glam::DVec3;
use mesh::{NONE, Topology, TriangleMesh};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use surface::tracing::{Corner, Trace, TracePoint};

/// Which corners of a border are convex, flat and concave. Angles are measured inside the region, on the surface, in radians.
#[derive(Debug, Clone, Copy)]
pub struct CornerAngles {
    /// Below it a corner is convex. Default: 157.5 degrees, the paper's.
    pub convex: f64,
    /// Above it a corner is concave. Default: 202.5 degrees, the paper's.
    pub concave: f64,
    /// Above it a corner is the tip of a slit, with room for four quads. Default: 315 degrees.
    pub slit: f64,
    /// A corner that turns by less than this, while both its neighbours turn the same way at least half as much, belongs to a
    /// round curve of few edges and is flat. Default: 50 degrees, an octagon's 45 and some; 0 gives the paper's rule.
    pub round: f64,
    /// A corner at an interior feature may have a quad more or less than that, up to so many quads off its angle, where the vertex has
    /// four in all then. Default: 0, so that none has.
    pub slack: f64,
    /// Bends one way within so little of the border are one, which has as many corners as its turn has right angles: a fillet between
    /// two sides. Scene units. Default: 0, so that each vertex is judged by itself.
    pub fillet: f64,
}

impl Default for CornerAngles {
    fn default() -> Self {
        Self { convex: PI * 0.875, concave: PI * 1.125, slit: PI * 1.75, round: PI / 3.6, slack: 0.0, fillet: 0.0 }
    }
}

impl CornerAngles {
    /// Quarters of a corner from the turn (a straight angle less the corner's) there and at its neighbours along the border.
    pub fn quarters(&self, before: f64, turn: f64, after: f64) -> u8 {
        let alike = |other: f64| other * turn.signum() >= 0.5 * turn.abs();
        if turn.abs() < self.round && alike(before) && alike(after) {
            return 2;
        }
        let angle = PI - turn;
        1 + u8::from(angle >= self.convex) + u8::from(angle > self.concave) + u8::from(angle > self.slit)
    }
}

/// Vertices are local; `vertex` gives their place in the whole layout's mesh. Vertices along cuts occur more than once.
#[derive(Debug, Clone)]
pub(super) struct Region {
    /// Place of each local vertex in the whole mesh.
    pub vertex: Vec<u32>,
    /// Positions and triangles in local indices.
    pub mesh: TriangleMesh,
    /// A direction of the cross of each triangle.
    pub field: Vec<DVec3>,
    /// The corners of the triangles, one for each half-edge.
    pub corners: Vec<Corner>,
    /// Quarters of each local border vertex; 0 inside.
    pub quarters: Vec<u8>,
    /// Index of the cross at each local vertex inside, in quarter turns: 0 where it is regular, and on the border.
    pub index: Vec<i8>,
    pub topology: Topology,
}

/// How a cut divides the quarters at the two ends of its path: those of the fan before the path (from the outgoing border
/// half-edge counter-clockwise), and those after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub start: [u8; 2],
    pub end: [u8; 2],
}

impl Region {
    /// Border loops as local vertices, each along its triangles.
    pub fn loops(&self) -> Vec<Vec<u32>> {
        self.topology.border_loops().iter().map(|l| l.iter().map(|&h| self.topology.from(h)).collect()).collect()
    }

    /// Vertices of each side, from its first corner; the whole border where it has no corner.
    pub fn sides(&self) -> Vec<Vec<u32>> {
        let mut sides = vec![];
        for mut border in self.loops() {
            let first = border.iter().position(|&v| self.quarters[v as usize] == 1).unwrap_or(0);
            border.rotate_left(first);
            let is_corner = |v: &u32| self.quarters[*v as usize] == 1;
            let mut from = 0;
            for k in (1..border.len()).filter(|k| is_corner(&border[*k])).chain([border.len()]) {
                sides.push(border[from..k].to_vec());
                from = k;
            }
        }
        sides
    }

    /// Whether it has no border.
    pub fn is_closed(&self) -> bool {
        !self.topology.twin.contains(&NONE)
    }

    /// Euler characteristic: 1 for a disk, 0 for an annulus.
    pub fn euler_characteristic(&self) -> i64 {
        self.mesh.positions.len() as i64 - self.topology.edges().count() as i64 + self.mesh.triangles.len() as i64
    }

    /// Sum of the corner angles at each vertex.
    pub fn angles(&self) -> Vec<f64> {
        let mut angles = vec![0.0; self.vertex.len()];
        for (&v, corner) in self.mesh.triangles.iter().flatten().zip(&self.corners) {
            angles[v as usize] += corner.angle;
        }
        angles
    }

    /// Sum of the triangle areas.
    pub fn area(&self) -> f64 {
        (0..self.mesh.triangles.len()).map(|t| self.mesh.area_normal(t).length() / 2.0).sum()
    }

    /// Cuts along a path and returns the one or two parts, the one that holds triangle 0 first, and the places of the vertices that
    /// points inside edges become: `first` and following ones of the whole mesh. `None` when the path crosses itself.
    pub fn cut(&self, trace: &Trace, share: Share, first: usize) -> Option<(Vec<Self>, Vec<DVec3>)> {
        let mut whole = self.clone();
        let mut path = Vec::with_capacity(trace.points.len());
        let mut added = Vec::new();
        for &point in &trace.points {
            path.push(match point {
                TracePoint::Vertex(v) => v,
                TracePoint::Edge(a, b, t) => whole.split_edge(a, b, t, first, &mut added)?,
            });
        }
        if path.iter().collect::<BTreeSet<_>>().len() < path.len() {
            return None;
        }
        let edges: Vec<u32> = path.windows(2).map(|w| whole.topology.find(w[0], w[1])).collect::<Option<_>>()?;
        let ends = [
            (path[0], share.start, edges[0]),
            (path[path.len() - 1], share.end, whole.topology.twin[edges[edges.len() - 1] as usize]),
        ];
        // Which side of the path each corner at the two ends lies on, decided before the cut.
        let mut quarters_at: BTreeMap<u32, u8> = BTreeMap::new();
        for (v, share, along) in ends {
            let mut side = 0;
            for h in whole.topology.around(v) {
                side |= usize::from(h == along);
                quarters_at.insert(h, share[side]);
            }
        }
        let quarters = |h, old| quarters_at.get(&h).copied().unwrap_or(if old == 0 { 2 } else { old });
        Some((whole.open(&edges, quarters), added))
    }

    /// Opens the mesh along interior edges (one half-edge each) and returns the connected parts, ordered by their first
    /// triangle. `quarters` gives those of a border vertex from one of its half-edges and what it had before.
    pub fn open(&self, edges: &[u32], quarters: impl Fn(u32, u8) -> u8) -> Vec<Self> {
        let mut cut = vec![false; self.topology.len()];
        for &h in edges {
            cut[h as usize] = true;
            cut[self.topology.twin[h as usize] as usize] = true;
        }
        let crosses = |h: usize| self.topology.twin[h] != NONE && !cut[h];
        let faces = self.mesh.triangles.len();
        let mut part = vec![usize::MAX; faces];
        let mut members: Vec<Vec<usize>> = Vec::new();
        for seed in 0..faces {
            if part[seed] != usize::MAX {
                continue;
            }
            part[seed] = members.len();
            let mut reached = vec![seed];
            let mut next = 0;
            while next < reached.len() {
                for h in 3 * reached[next]..3 * reached[next] + 3 {
                    if crosses(h) {
                        let face = self.topology.twin[h] as usize / 3;
                        if part[face] == usize::MAX {
                            part[face] = members.len();
                            reached.push(face);
                        }
                    }
                }
                next += 1;
            }
            reached.sort_unstable();
            members.push(reached);
        }
        members.iter().map(|faces| self.extract(faces, &crosses, &quarters)).collect()
    }

    /// The part made of some triangles. The corners at a vertex that uncut edges join become one local vertex.
    fn extract(&self, faces: &[usize], crosses: &impl Fn(usize) -> bool, quarters: &impl Fn(u32, u8) -> u8) -> Self {
        let mut local = vec![NONE; self.topology.len()];
        let (mut vertex, mut positions, mut worth, mut index) = (vec![], vec![], vec![], vec![]);
        for &face in faces {
            for h in 3 * face..3 * face + 3 {
                if local[h] != NONE {
                    continue;
                }
                let id = vertex.len() as u32;
                let origin = self.topology.origin[h] as usize;
                // Walk clockwise to the first corner of the fan, then give the whole fan its name.
                let mut first = h;
                let mut closed = false;
                while crosses(first) {
                    first = self.topology.next[self.topology.twin[first] as usize] as usize;
                    if first == h {
                        closed = true;
                        break;
                    }
                }
                let mut corner = first;
                loop {
                    local[corner] = id;
                    let before = self.topology.prev[corner] as usize;
                    if !crosses(before) {
                        break;
                    }
                    corner = self.topology.twin[before] as usize;
                    if corner == first {
                        break;
                    }
                }
                vertex.push(self.vertex[origin]);
                positions.push(self.mesh.positions[origin]);
                index.push(if closed { self.index[origin] } else { 0 });
                worth.push(if closed { 0 } else { quarters(first as u32, self.quarters[origin]) });
            }
        }
        let triangles = faces.iter().map(|&f| [local[3 * f], local[3 * f + 1], local[3 * f + 2]]).collect();
        let field = faces.iter().map(|&f| self.field[f]).collect();
        let corners = faces.iter().flat_map(|&f| &self.corners[3 * f..3 * f + 3]).copied().collect();
        let topology = self.topology_of(faces, crosses, &local, vertex.len());
        Self { vertex, mesh: TriangleMesh { positions, triangles }, field, corners, quarters: worth, index, topology }
    }

    /// Topology of some triangles of this region, read off its own: hashing the edges anew is what cutting would spend its time on.
    fn topology_of(
        &self,
        faces: &[usize],
        crosses: &impl Fn(usize) -> bool,
        local: &[u32],
        vertices: usize,
    ) -> Topology {
        let count = 3 * faces.len() as u32;
        let mut place = vec![NONE; self.topology.len() / 3];
        for (i, &f) in faces.iter().enumerate() {
            place[f] = i as u32;
        }
        let old: Vec<usize> = faces.iter().flat_map(|&f| 3 * f..3 * f + 3).collect();
        let twin = |h: usize| {
            let other = self.topology.twin[h];
            if crosses(h) { 3 * place[other as usize / 3] + other % 3 } else { NONE }
        };
        let mut topology = Topology {
            twin: old.iter().map(|&h| twin(h)).collect(),
            face: (0..count).map(|h| h / 3).collect(),
            next: (0..count).map(|h| h - h % 3 + (h + 1) % 3).collect(),
            prev: (0..count).map(|h| h - h % 3 + (h + 2) % 3).collect(),
            origin: old.iter().map(|&h| local[h]).collect(),
            outgoing: vec![NONE; vertices],
        };
        for h in 0..count {
            let v = topology.from(h) as usize;
            if topology.outgoing[v] == NONE || topology.is_border(h) {
                topology.outgoing[v] = h;
            }
        }
        topology
    }

    /// Splits every interior edge that joins two border vertices, so that a map of the border onto a polygon squeezes no triangle
    /// onto one side.
    pub fn split_chords(&mut self, positions: &mut Vec<DVec3>) {
        let chord = |h: &u32| {
            let ends = [self.topology.from(*h), self.topology.to(*h)];
            !self.topology.is_border(*h) && ends.iter().all(|&v| self.quarters[v as usize] > 0)
        };
        let ends = |h: u32| [self.topology.from(h), self.topology.to(h)];
        let chords: Vec<[u32; 2]> = self.topology.edges().filter(chord).map(ends).collect();
        for [a, b] in chords {
            self.split_edge(a, b, 0.5, 0, positions);
        }
    }

    /// Puts a vertex on the interior edge from `a` to `b`: its place is added to those that the whole mesh has from vertex `first` on.
    /// `None` when there is no such edge.
    fn split_edge(&mut self, a: u32, b: u32, t: f64, first: usize, positions: &mut Vec<DVec3>) -> Option<u32> {
        let h = self.topology.find(a, b).filter(|&h| !self.topology.is_border(h))?;
        let twin = self.topology.twin[h as usize];
        let middle = self.vertex.len() as u32;
        let at = self.mesh.positions[a as usize].lerp(self.mesh.positions[b as usize], t);
        self.mesh.positions.push(at);
        self.vertex.push((first + positions.len()) as u32);
        self.quarters.push(0);
        self.index.push(0);
        positions.push(at);
        self.topology.outgoing.push(self.topology.next[h as usize]);
        let [beyond, before] = [h, twin].map(|h| self.split_triangle(h, middle));
        self.pair(h, before);
        self.pair(twin, beyond);
        Some(middle)
    }

    /// Splits the triangle of half-edge `h` at `middle`, a vertex on it. The triangle keeps the half before `middle`; returns the
    /// half-edge of the other half. The twins of both are left to the caller.
    fn split_triangle(&mut self, h: u32, middle: u32) -> u32 {
        let topology = &mut self.topology;
        let (face, added) = (h as usize / 3, topology.len() as u32 - h / 3 * 3);
        let [next, prev] = [topology.next[h as usize], topology.prev[h as usize]];
        let mut far = self.mesh.triangles[face];
        far[h as usize % 3] = middle;
        self.mesh.triangles[face][next as usize % 3] = middle;
        self.mesh.triangles.push(far);
        self.field.push(self.field[face]);
        let [own, other] = [face, self.field.len() - 1].map(|f| Corner::of(&self.mesh, f, self.field[face]));
        self.corners[3 * face..3 * face + 3].copy_from_slice(&own);
        self.corners.extend(other);
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
        h + added
    }

    /// Makes two half-edges twins; the second may be missing.
    fn pair(&mut self, h: u32, other: u32) {
        self.topology.twin[h as usize] = other;
        if other != NONE {
            self.topology.twin[other as usize] = h;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use testkit::plane_region::{circle, plane_region};

    /// Checks a region's own topology against one built anew.
    fn check(region: &Region) {
        let fresh = Topology::of_triangles(&region.mesh);
        let own = &region.topology;
        assert_eq!((&own.twin, &own.face, &own.next), (&fresh.twin, &fresh.face, &fresh.next));
        assert_eq!((&own.prev, &own.origin), (&fresh.prev, &fresh.origin));
        assert_eq!(region.corners, Corner::of_mesh(&region.mesh, &region.field));
        for v in 0..region.vertex.len() as u32 {
            assert_eq!(own.from(own.outgoing[v as usize]), v);
            assert_eq!(own.is_border_vertex(v), fresh.is_border_vertex(v));
            assert_eq!(own.around(v).count(), fresh.around(v).count());
        }
    }

    #[test]
    fn topology_stays_true_through_splits_and_cuts() {
        let mesh = plane_region(&[circle(DVec2::ZERO, 2.0, 30), circle(DVec2::ZERO, 1.0, 16)], |p| p.extend(0.0));
        let topology = Topology::of_triangles(&mesh);
        let count = mesh.positions.len();
        let quarters = (0..count as u32).map(|v| 2 * u8::from(topology.is_border_vertex(v))).collect();
        let field = vec![DVec3::X; mesh.triangles.len()];
        let mut positions = mesh.positions.clone();
        let index = vec![0; count];
        let corners = Corner::of_mesh(&mesh, &field);
        let mut region =
            Region { vertex: (0..count as u32).collect(), mesh, field, corners, quarters, index, topology };
        for k in 0..40 {
            let h = (0..region.topology.len() as u32).filter(|&h| !region.topology.is_border(h)).nth(k * 3);
            let h = h.expect("an interior edge");
            let middle = region.split_edge(region.topology.from(h), region.topology.to(h), 0.4, 0, &mut positions);
            assert_eq!(middle, Some((count + k) as u32));
            check(&region);
        }
        let right = |h: u32| {
            let [p, q] = [region.topology.from(h), region.topology.to(h)].map(|v| region.mesh.positions[v as usize]);
            p.x > 0.0 && q.x > 0.0
        };
        let edges: Vec<u32> = region.topology.edges().filter(|&h| !region.topology.is_border(h) && right(h)).collect();
        let parts = region.open(&edges, |_, _| 2);
        assert!(parts.len() > 40);
        parts.iter().for_each(check);
        assert_eq!(parts.iter().map(|part| part.mesh.triangles.len()).sum::<usize>(), region.mesh.triangles.len());
    }
}
