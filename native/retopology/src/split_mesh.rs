//! A triangle mesh whose edges can be split, and nothing else: all that refining a surface and cutting paths into it need.

use mesh::{DVec3, NONE, Topology, TriangleMesh};

/// Half-edge `3 t + k` runs from corner `k` of triangle `t` to the next one.
#[derive(Debug, Clone)]
pub struct SplitMesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Vertex that each half-edge starts from.
    pub origin: Vec<u32>,
    /// Opposite half-edge, or [`NONE`].
    pub twin: Vec<u32>,
    /// The input triangle that each triangle is part of.
    pub source: Vec<u32>,
    outgoing: Vec<u32>,
}

/// Next half-edge round the triangle.
pub fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// Previous half-edge round the triangle.
pub fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl SplitMesh {
    /// A mesh whose triangles are their own sources.
    pub fn new(mesh: &TriangleMesh, topology: &Topology) -> Self {
        Self {
            positions: mesh.positions.clone(),
            origin: topology.origin.clone(),
            twin: topology.twin.clone(),
            source: (0..mesh.triangles.len() as u32).collect(),
            outgoing: topology.outgoing.clone(),
        }
    }

    /// Vertex a half-edge starts from.
    pub fn from(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// Vertex a half-edge ends at.
    pub fn to(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    /// Length of the half-edge.
    pub fn length(&self, h: u32) -> f64 {
        self.positions[self.from(h) as usize].distance(self.positions[self.to(h) as usize])
    }

    /// Half-edges that start at `v`, all of them, in no promised order.
    pub fn around(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.outgoing[v as usize];
        let (mut forward, mut backward) = ((start != NONE).then_some(start), None);
        std::iter::from_fn(move || {
            if let Some(h) = forward {
                let after = self.twin[prev(h) as usize];
                forward = (after != NONE && after != start).then_some(after);
                if after == NONE {
                    backward = Some(start);
                }
                return Some(h);
            }
            // A border was met: the rest lies clockwise of the start.
            let t = self.twin[backward? as usize];
            backward = (t != NONE).then(|| next(t));
            backward
        })
    }

    /// The half-edge from `a` to `b`, or else the one from `b` to `a`.
    pub fn find(&self, a: u32, b: u32) -> Option<u32> {
        let directed = |a: u32, b: u32| self.around(a).find(|&h| self.to(h) == b);
        directed(a, b).or_else(|| directed(b, a))
    }

    /// Splits the edge of `h` at a point given by the fraction along `h`; returns the new vertex. The triangle of `h` keeps
    /// its half nearer to the origin of `h`.
    pub fn split(&mut self, h: u32, fraction: f64) -> u32 {
        let m = self.positions.len() as u32;
        let [a, b] = [self.from(h), self.to(h)].map(|v| self.positions[v as usize]);
        self.positions.push(a.lerp(b, fraction));
        self.outgoing.push(NONE);
        let t = self.twin[h as usize];
        let beyond = self.split_side(h, m);
        self.outgoing[m as usize] = beyond;
        if t != NONE {
            let nearer = self.split_side(t, m);
            self.join(h, nearer);
            self.join(t, beyond);
        }
        m
    }

    /// Splits the triangle of `h` at `m` on `h`; returns the half-edge from `m` to the former end of `h`.
    fn split_side(&mut self, h: u32, m: u32) -> u32 {
        let (n, apex) = (next(h), self.from(prev(h)));
        let far = self.origin[n as usize];
        let g = self.origin.len() as u32;
        self.origin.extend([m, far, apex]);
        self.twin.extend([NONE; 3]);
        self.source.push(self.source[h as usize / 3]);
        let outside = self.twin[n as usize];
        self.origin[n as usize] = m;
        self.join(g + 2, n);
        self.twin[g as usize + 1] = outside;
        if outside != NONE {
            self.twin[outside as usize] = g + 1;
        }
        self.outgoing[far as usize] = g + 1;
        g
    }

    fn join(&mut self, a: u32, b: u32) {
        self.twin[a as usize] = b;
        self.twin[b as usize] = a;
    }

    /// Its topology, with the same half-edges.
    pub fn topology(&self) -> Topology {
        let half_edges = 0..self.origin.len() as u32;
        let mut outgoing = self.outgoing.clone();
        for h in half_edges.clone().filter(|&h| self.twin[h as usize] == NONE) {
            outgoing[self.from(h) as usize] = h;
        }
        Topology {
            twin: self.twin.clone(),
            face: half_edges.clone().map(|h| h / 3).collect(),
            next: half_edges.clone().map(next).collect(),
            prev: half_edges.map(prev).collect(),
            origin: self.origin.clone(),
            outgoing,
        }
    }

    /// The mesh as it is.
    pub fn to_mesh(&self) -> TriangleMesh {
        let triangles = self.origin.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        TriangleMesh { positions: self.positions.clone(), triangles }
    }
}
