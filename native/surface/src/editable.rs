//! A triangle mesh that can be changed in place: edges split, flipped and collapsed.
//!
//! Half-edges are corners, `3 * triangle + corner`, as in [`mesh::Topology`]. A half-edge without twin is a border. Vertices
//! are manifold: one where several fans of triangles meet comes as one copy a fan ([`fans`]), and the copies share an
//! identity, so that no operation can give two copies one edge. Removed elements stay as gaps until the mesh is read out.
//! Nothing here looks at positions: the callers decide what a good operation is.

use glam::DVec3;
use mesh::NONE;

/// The mutable mesh.
pub(crate) struct Editable {
    /// Position of each vertex.
    pub positions: Vec<DVec3>,
    /// What a vertex stands for: copies of one input vertex share it, a new vertex has its own.
    pub identity: Vec<u32>,
    /// Input triangle that each triangle came from.
    pub source: Vec<u32>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    /// A half-edge from each vertex, the border one if there is any; [`NONE`] once removed.
    outgoing: Vec<u32>,
    next_identity: u32,
}

pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

pub(crate) fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// Gives every fan of triangles round a vertex, as the twins connect them, its own vertex. Returns the triangles in terms
/// of the fans, and the vertex of each fan. O(corners).
pub(crate) fn fans(triangles: &[[u32; 3]], twin: &[u32]) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut corners = vec![NONE; twin.len()];
    let mut vertex_of = Vec::new();
    for start in 0..twin.len() as u32 {
        if corners[start as usize] != NONE {
            continue;
        }
        let fan = vertex_of.len() as u32;
        vertex_of.push(triangles[start as usize / 3][start as usize % 3]);
        let mut h = start;
        while h != NONE && corners[h as usize] == NONE {
            corners[h as usize] = fan;
            h = twin[prev(h) as usize];
        }
        h = twin[start as usize];
        while h != NONE && corners[next(h) as usize] == NONE {
            corners[next(h) as usize] = fan;
            h = twin[next(h) as usize];
        }
    }
    (corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(), vertex_of)
}

impl Editable {
    /// Takes triangles over fan vertices with the twin of each half-edge; `identity` is below `identities` for all.
    pub fn new(
        positions: Vec<DVec3>,
        identity: Vec<u32>,
        triangles: &[[u32; 3]],
        twin: Vec<u32>,
        source: Vec<u32>,
        identities: u32,
    ) -> Self {
        let origin: Vec<u32> = triangles.iter().flatten().copied().collect();
        let mut outgoing = vec![NONE; positions.len()];
        for (h, &v) in origin.iter().enumerate() {
            if outgoing[v as usize] == NONE || twin[h] == NONE {
                outgoing[v as usize] = h as u32;
            }
        }
        Self { positions, identity, source, origin, twin, outgoing, next_identity: identities }
    }

    /// Number of vertices, removed ones included.
    pub fn vertex_slots(&self) -> u32 {
        self.positions.len() as u32
    }

    /// Number of half-edges, removed ones included.
    pub fn half_edge_slots(&self) -> u32 {
        self.origin.len() as u32
    }

    pub fn from(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    pub fn to(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    /// The vertex across the edge, in the triangle of `h`.
    pub fn apex(&self, h: u32) -> u32 {
        self.origin[prev(h) as usize]
    }

    pub fn twin(&self, h: u32) -> Option<u32> {
        let twin = self.twin[h as usize];
        (twin != NONE).then_some(twin)
    }

    pub fn is_live(&self, h: u32) -> bool {
        self.origin[h as usize] != NONE
    }

    pub fn is_live_vertex(&self, v: u32) -> bool {
        self.outgoing[v as usize] != NONE
    }

    pub fn is_border_vertex(&self, v: u32) -> bool {
        self.twin[self.outgoing[v as usize] as usize] == NONE
    }

    /// One live half-edge of each edge.
    pub fn edges(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.half_edge_slots())
            .filter(|&h| self.is_live(h) && (self.twin[h as usize] == NONE || h < self.twin[h as usize]))
    }

    /// Live triangles.
    pub fn triangles(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.half_edge_slots() / 3).filter(|&t| self.is_live(3 * t))
    }

    pub fn corners(&self, t: u32) -> [u32; 3] {
        [0, 1, 2].map(|k| self.origin[(3 * t + k) as usize])
    }

    /// Half-edges that start at `v`, counter-clockwise, from the border one if there is any.
    pub fn around(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.outgoing[v as usize];
        let mut next = (start != NONE).then_some(start);
        std::iter::from_fn(move || {
            let h = next?;
            let turned = self.twin[prev(h) as usize];
            next = (turned != NONE && turned != start).then_some(turned);
            Some(h)
        })
    }

    /// Vertices joined to `v` by an edge, counter-clockwise.
    pub fn neighbours(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.around(v).flat_map(move |h| {
            let last = (self.twin[prev(h) as usize] == NONE).then(|| self.apex(h));
            std::iter::once(self.to(h)).chain(last)
        })
    }

    pub fn valence(&self, v: u32) -> usize {
        self.neighbours(v).count()
    }

    /// The half-edge from `a` to `b`.
    pub fn find(&self, a: u32, b: u32) -> Option<u32> {
        self.around(a).find(|&h| self.to(h) == b)
    }

    /// True when an edge joins `a` to a copy of `b`, or `b` to a copy of `a`.
    pub fn are_joined(&self, a: u32, b: u32) -> bool {
        self.neighbours(a).any(|n| self.identity[n as usize] == self.identity[b as usize])
            || self.neighbours(b).any(|n| self.identity[n as usize] == self.identity[a as usize])
    }

    /// Splits the edge of `h` at a new vertex, and returns that. `h` then runs from its old origin to the new vertex.
    pub fn split(&mut self, h: u32, position: DVec3) -> u32 {
        let m = self.positions.len() as u32;
        self.positions.push(position);
        self.identity.push(self.next_identity);
        self.next_identity += 1;
        let (b, g) = (self.to(h), self.twin[h as usize]);
        let beyond = self.halve(h, m);
        if g == NONE {
            self.outgoing.push(beyond);
        } else {
            let other = self.halve(g, m);
            self.outgoing.push(beyond);
            self.pair(h, other);
            self.pair(g, beyond);
        }
        debug_assert!(self.find(m, b) == Some(beyond));
        m
    }

    /// Cuts the triangle of `h` from `m` on the edge to the apex; returns the new half-edge from `m` to the old end.
    fn halve(&mut self, h: u32, m: u32) -> u32 {
        let (hn, b, c) = (next(h), self.to(h), self.apex(h));
        let new = self.origin.len() as u32;
        self.origin.extend([m, b, c]);
        self.twin.extend([NONE; 3]);
        self.source.push(self.source[h as usize / 3]);
        let across = self.twin[hn as usize];
        self.pair(new + 1, across);
        self.origin[hn as usize] = m;
        self.pair(hn, new + 2);
        if self.outgoing[b as usize] == hn {
            self.outgoing[b as usize] = new + 1;
        }
        new
    }

    fn pair(&mut self, a: u32, b: u32) {
        if a != NONE {
            self.twin[a as usize] = b;
        }
        if b != NONE {
            self.twin[b as usize] = a;
        }
    }

    /// True when the edge has two triangles and the edge across does not exist yet.
    pub fn can_flip(&self, h: u32) -> bool {
        let Some(g) = self.twin(h) else { return false };
        let (c, d) = (self.apex(h), self.apex(g));
        self.identity[c as usize] != self.identity[d as usize]
            && !self.are_joined(c, d)
            // An interior vertex needs three edges, a border vertex two.
            && [self.from(h), self.to(h)]
                .into_iter()
                .all(|v| self.valence(v) > if self.is_border_vertex(v) { 2 } else { 3 })
    }

    /// Turns the edge of `h` to join the two apexes; `h` then belongs to the triangle at its old origin.
    pub fn flip(&mut self, h: u32) {
        let g = self.twin[h as usize];
        let (a, b, c, d) = (self.from(h), self.to(h), self.apex(h), self.apex(g));
        let (hn, gn) = (next(h), next(g));
        let (beyond_hn, beyond_gn) = (self.twin[hn as usize], self.twin[gn as usize]);
        // h: a -> d, hn: d -> c; g: b -> c, gn: c -> d.
        self.origin[hn as usize] = d;
        self.origin[gn as usize] = c;
        self.pair(h, beyond_gn);
        self.pair(g, beyond_hn);
        self.pair(hn, gn);
        if self.outgoing[a as usize] == gn {
            self.outgoing[a as usize] = h;
        }
        if self.outgoing[b as usize] == hn {
            self.outgoing[b as usize] = g;
        }
    }

    /// True when moving `v`, one end of the edge of `h`, into the other keeps the surface a manifold of the same kind
    /// (the link condition of Dey et al., "Topology preserving edge contraction", 1999). A border vertex may only move
    /// along its border.
    pub fn can_collapse(&self, h: u32, v: u32) -> bool {
        let w = self.from(h) ^ self.to(h) ^ v;
        let twin = self.twin(h);
        if self.is_border_vertex(v) && twin.is_some() {
            return false;
        }
        let apexes = [Some(self.apex(h)), twin.map(|g| self.apex(g))];
        for (side, apex) in [Some(h), twin].into_iter().zip(apexes) {
            let (Some(side), Some(apex)) = (side, apex) else {
                continue;
            };
            let outer = [next(side), prev(side)].map(|e| self.twin[e as usize]);
            if outer == [NONE; 2] || self.valence(apex) <= if self.is_border_vertex(apex) { 2 } else { 3 } {
                return false;
            }
        }
        if let [Some(c), Some(d)] = apexes
            && self.identity[c as usize] == self.identity[d as usize]
        {
            return false;
        }
        self.neighbours(v)
            .filter(|&n| n != w && !apexes.contains(&Some(n)))
            .all(|n| self.identity[n as usize] != self.identity[w as usize] && !self.are_joined(n, w))
    }

    /// Moves `v`, one end of the edge of `h`, into the other and removes the triangles between; ask
    /// [`Editable::can_collapse`] first.
    pub fn collapse(&mut self, h: u32, v: u32) {
        let w = self.from(h) ^ self.to(h) ^ v;
        let sides = [Some(h), self.twin(h)];
        let starts: Vec<u32> = self.around(v).collect();
        for start in starts {
            self.origin[start as usize] = w;
        }
        self.outgoing[v as usize] = NONE;
        let mut anchors = [None; 2];
        for (side, anchor) in sides.into_iter().zip(&mut anchors) {
            let Some(side) = side else { continue };
            let (x, y) = (self.twin[next(side) as usize], self.twin[prev(side) as usize]);
            *anchor = Some((self.apex(side), if x == NONE { y } else { x }));
            self.pair(x, y);
            for e in [side, next(side), prev(side)] {
                self.origin[e as usize] = NONE;
            }
        }
        for (apex, edge) in anchors.into_iter().flatten() {
            // The edge joins the apex and w, either way round.
            for vertex in [apex, w] {
                self.outgoing[vertex as usize] = if self.from(edge) == vertex { edge } else { next(edge) };
                self.rewind(vertex);
            }
        }
    }

    /// Turns clockwise to the border half-edge, if the vertex has one.
    fn rewind(&mut self, v: u32) {
        let start = self.outgoing[v as usize];
        let mut h = start;
        loop {
            let back = self.twin[h as usize];
            if back == NONE {
                break;
            }
            h = next(back);
            if h == start {
                break;
            }
        }
        self.outgoing[v as usize] = h;
    }
}
