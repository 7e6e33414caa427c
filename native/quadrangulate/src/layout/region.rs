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
use surface::tracing::{Trace, TracePoint};

/// Angles that bound the classes of corners, radians inside the region, measured on the surface.
#[derive(Debug, Clone, Copy)]
pub struct CornerAngles {
    /// Below it a corner is convex. Default: 157.5 degrees, the paper's.
    pub convex: f64,
    /// Above it a corner is concave. Default: 202.5 degrees, the paper's.
    pub concave: f64,
    /// Above it a corner is the tip of a slit, with room for four quads. Default: 315 degrees.
    pub slit: f64,
}

impl Default for CornerAngles {
    fn default() -> Self {
        Self { convex: PI * 0.875, concave: PI * 1.125, slit: PI * 1.75 }
    }
}

impl CornerAngles {
    /// Quarters of a corner of this angle.
    pub fn quarters(&self, angle: f64) -> u8 {
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
    /// Quarters of each local border vertex; 0 inside.
    pub quarters: Vec<u8>,
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
    pub fn new(vertex: Vec<u32>, mesh: TriangleMesh, field: Vec<DVec3>, quarters: Vec<u8>) -> Self {
        let topology = Topology::of_triangles(&mesh);
        Self { vertex, mesh, field, quarters, topology }
    }

    /// Border loops as local vertices, each along its triangles.
    pub fn loops(&self) -> Vec<Vec<u32>> {
        self.topology.border_loops().iter().map(|l| l.iter().map(|&h| self.topology.from(h)).collect()).collect()
    }

    /// Euler characteristic: 1 for a disk, 0 for an annulus.
    pub fn euler_characteristic(&self) -> i64 {
        self.mesh.positions.len() as i64 - self.topology.edges().count() as i64 + self.mesh.triangles.len() as i64
    }

    /// Sum of the triangle areas.
    pub fn area(&self) -> f64 {
        (0..self.mesh.triangles.len()).map(|t| self.mesh.area_normal(t).length() / 2.0).sum()
    }

    /// Cuts along a path and returns the one or two parts, the one that holds triangle 0 first. Points inside edges become
    /// vertices, appended to `positions`. `None` when the path crosses itself.
    pub fn cut(&self, trace: &Trace, share: Share, positions: &mut Vec<DVec3>) -> Option<Vec<Self>> {
        let mut whole = self.clone();
        let mut path = Vec::with_capacity(trace.points.len());
        let appended = positions.len();
        for &point in &trace.points {
            path.push(match point {
                TracePoint::Vertex(v) => v,
                TracePoint::Edge(a, b, t) => {
                    let Some(v) = whole.split_edge(a, b, t, positions) else {
                        positions.truncate(appended);
                        return None;
                    };
                    v
                }
            });
        }
        if path.iter().collect::<BTreeSet<_>>().len() < path.len() {
            positions.truncate(appended);
            return None;
        }
        whole.topology = Topology::of_triangles(&whole.mesh);
        let edges: Option<Vec<u32>> = path.windows(2).map(|w| whole.topology.find(w[0], w[1])).collect();
        let Some(edges) = edges else {
            positions.truncate(appended);
            return None;
        };
        let ends = [(path[0], share.start, edges[0]), (path[path.len() - 1], share.end, whole.topology.twin[edges[edges.len() - 1] as usize])];
        // Which side of the path each corner at the two ends lies on, decided before the cut.
        let mut quarters_at: BTreeMap<u32, u8> = BTreeMap::new();
        for (v, share, along) in ends {
            let mut side = 0;
            for h in whole.topology.around(v) {
                side |= usize::from(h == along);
                quarters_at.insert(h, share[side]);
            }
        }
        Some(whole.open(&edges, |h, old| quarters_at.get(&h).copied().unwrap_or(if old == 0 { 2 } else { old })))
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
        let (mut vertex, mut positions, mut worth) = (vec![], vec![], vec![]);
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
                worth.push(if closed { 0 } else { quarters(first as u32, self.quarters[origin]) });
            }
        }
        let triangles = faces.iter().map(|&f| [local[3 * f], local[3 * f + 1], local[3 * f + 2]]).collect();
        let field = faces.iter().map(|&f| self.field[f]).collect();
        Self::new(vertex, TriangleMesh { positions, triangles }, field, worth)
    }

    /// Puts a vertex on the interior edge from `a` to `b`. `topology` is stale afterwards. `None` when there is no such edge.
    fn split_edge(&mut self, a: u32, b: u32, t: f64, positions: &mut Vec<DVec3>) -> Option<u32> {
        let sides: Vec<(usize, usize)> = (0..self.mesh.triangles.len())
            .filter_map(|f| {
                let triangle = self.mesh.triangles[f];
                let k = (0..3).find(|&k| {
                    let edge = (triangle[k], triangle[(k + 1) % 3]);
                    edge == (a, b) || edge == (b, a)
                })?;
                Some((f, k))
            })
            .collect();
        if sides.len() != 2 {
            return None;
        }
        let middle = self.mesh.positions.len() as u32;
        let at = self.mesh.positions[a as usize].lerp(self.mesh.positions[b as usize], t);
        self.mesh.positions.push(at);
        self.vertex.push(positions.len() as u32);
        self.quarters.push(0);
        positions.push(at);
        for (f, k) in sides {
            let mut far = self.mesh.triangles[f];
            far[k] = middle;
            self.mesh.triangles[f][(k + 1) % 3] = middle;
            self.mesh.triangles.push(far);
            self.field.push(self.field[f]);
        }
        Some(middle)
    }
}
