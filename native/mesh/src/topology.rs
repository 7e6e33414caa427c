//! Half-edge topology of a polygon mesh. A half-edge is a corner: it runs from the corner's vertex to the next one's.

/// "No such element", in index arrays.
pub const NONE: u32 = u32::MAX;

/// An edge as a vertex pair, lower vertex first.
pub fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Who meets whom. Topology never sees positions. Built once, O(corners), for any mesh: half-edges that have no single
/// partner of opposite direction (borders, non-manifold or misoriented edges) have `twin == NONE`.
#[derive(Debug, Clone)]
pub struct Topology {
    /// Opposite half-edge of each, or [`NONE`].
    pub twin: Vec<u32>,
    /// Face of each half-edge.
    pub face: Vec<u32>,
    /// Next half-edge round the face.
    pub next: Vec<u32>,
    /// Previous half-edge round the face.
    pub prev: Vec<u32>,
    /// Vertex that each half-edge starts from.
    pub origin: Vec<u32>,
    /// A half-edge that starts at each vertex, a border one (without a twin) if there is any; [`NONE`] for unused vertices.
    pub outgoing: Vec<u32>,
}

impl Topology {
    /// Builds the topology of faces given as vertex lists.
    pub fn new<F: AsRef<[u32]>>(vertex_count: usize, faces: impl IntoIterator<Item = F>) -> Self {
        let mut t = Self {
            twin: vec![],
            face: vec![],
            next: vec![],
            prev: vec![],
            origin: vec![],
            outgoing: vec![NONE; vertex_count],
        };
        for (f, corners) in faces.into_iter().enumerate() {
            let corners = corners.as_ref();
            let (start, n) = (t.origin.len() as u32, corners.len() as u32);
            for k in 0..n {
                t.origin.push(corners[k as usize]);
                t.face.push(f as u32);
                t.next.push(start + (k + 1) % n);
                t.prev.push(start + (k + n - 1) % n);
            }
        }
        t.twin = vec![NONE; t.origin.len()];
        // Half-edges by the lower end of the edge they lie on, then by the other; one whose ends are the same vertex has no twin.
        let ends: Vec<[u32; 2]> = (0..t.origin.len() as u32).map(|h| sorted(t.from(h), t.to(h))).collect();
        let mut row = vec![0_u32; vertex_count + 1];
        for [low, _] in &ends {
            row[*low as usize + 1] += 1;
        }
        for v in 0..vertex_count {
            row[v + 1] += row[v];
        }
        let mut place = row.clone();
        let mut by_edge = vec![(0, 0); ends.len()];
        for (h, &[low, high]) in (0..).zip(&ends) {
            by_edge[place[low as usize] as usize] = (high, h);
            place[low as usize] += 1;
        }
        for low in row.windows(2) {
            let around = &mut by_edge[low[0] as usize..low[1] as usize];
            around.sort_unstable();
            for on_edge in around.chunk_by(|(a, _), (b, _)| a == b) {
                if let &[(_, g), (_, h)] = on_edge
                    && t.origin[g as usize] != t.origin[h as usize]
                {
                    t.twin[g as usize] = h;
                    t.twin[h as usize] = g;
                }
            }
        }
        for h in 0..t.origin.len() {
            let v = t.origin[h] as usize;
            if t.outgoing[v] == NONE || t.twin[h] == NONE {
                t.outgoing[v] = h as u32;
            }
        }
        t
    }

    /// Topology of a polygon mesh.
    pub fn of(mesh: &crate::PolygonMesh) -> Self {
        Self::new(mesh.vertex_count(), mesh.faces())
    }

    /// Topology of a triangle mesh.
    pub fn of_triangles(mesh: &crate::TriangleMesh) -> Self {
        Self::new(mesh.positions.len(), &mesh.triangles)
    }

    /// Number of half-edges.
    pub fn len(&self) -> usize {
        self.origin.len()
    }

    /// True for a mesh without faces.
    pub fn is_empty(&self) -> bool {
        self.origin.is_empty()
    }

    /// Vertex a half-edge starts from.
    pub fn from(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// Vertex a half-edge ends at.
    pub fn to(&self, h: u32) -> u32 {
        self.origin[self.next[h as usize] as usize]
    }

    /// True when the half-edge has no partner.
    pub fn is_border(&self, h: u32) -> bool {
        self.twin[h as usize] == NONE
    }

    /// Half-edges that start at `v`, counter-clockwise from [`Topology::outgoing`]: complete where the vertex is manifold
    /// (a border vertex starts at its border half-edge, so that the walk covers the whole fan).
    pub fn around(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.outgoing[v as usize];
        let mut next = (start != NONE).then_some(start);
        std::iter::from_fn(move || {
            let h = next?;
            // The half-edge that ends at v in this face is prev(h); its twin starts at v in the next face.
            let t = self.twin[self.prev[h as usize] as usize];
            next = (t != NONE && t != start).then_some(t);
            Some(h)
        })
    }

    /// Vertices that share an edge with `v`, in the order of [`Topology::around`]; at a border vertex the one behind the last
    /// half-edge too. Complete where the vertex is manifold.
    pub fn neighbours(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let mut around = self.around(v);
        let mut last = NONE;
        std::iter::from_fn(move || {
            if let Some(h) = around.next() {
                last = h;
                return Some(self.to(h));
            }
            let back = (last != NONE).then(|| self.prev[last as usize])?;
            last = NONE;
            self.is_border(back).then(|| self.from(back))
        })
    }

    /// The half-edge from `a` to `b` around `a`, when there is one.
    pub fn find(&self, a: u32, b: u32) -> Option<u32> {
        self.around(a).find(|&h| self.to(h) == b)
    }

    /// True when `v` lies on a border.
    pub fn is_border_vertex(&self, v: u32) -> bool {
        let h = self.outgoing[v as usize];
        h != NONE && self.is_border(h)
    }

    /// One half-edge for each edge: those without a twin, and of each pair the lower.
    pub fn edges(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.len() as u32).filter(|&h| self.is_border(h) || h < self.twin[h as usize])
    }

    /// Border loops as lists of border half-edges, each running along its face (so a hole is walked clockwise seen
    /// from the hole's side). Meaningful where border vertices are manifold.
    pub fn border_loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.len()];
        let mut loops = Vec::new();
        for start in 0..self.len() as u32 {
            if seen[start as usize] || !self.is_border(start) {
                continue;
            }
            let mut walk = Vec::new();
            let mut h = start;
            while !seen[h as usize] {
                seen[h as usize] = true;
                walk.push(h);
                // Turn about the end vertex until the border is met again.
                let mut g = self.next[h as usize];
                while !self.is_border(g) {
                    g = self.next[self.twin[g as usize] as usize];
                }
                h = g;
            }
            loops.push(walk);
        }
        loops
    }
}
