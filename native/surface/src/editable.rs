//! A triangle mesh under edit: split, collapse and flip of single edges, each keeping the surface a manifold of the same
//! topology. Vertices know their triangles; edges are found through them.

use glam::DVec3;
use mesh::TriangleMesh;
use std::collections::BTreeSet;

/// A vertex pair, lower first.
pub fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The mesh. Dead vertices and triangles stay in place until [`Editable::finish`].
#[derive(Debug, Clone)]
pub struct Editable {
    /// Positions; those of dead vertices are stale.
    pub positions: Vec<DVec3>,
    /// Triangles; dead ones are stale.
    pub triangles: Vec<[u32; 3]>,
    /// False for triangles that were collapsed.
    pub alive: Vec<bool>,
    /// Input triangle that each triangle comes from.
    pub source: Vec<u32>,
    /// Triangles at each vertex; none at dead vertices.
    pub incident: Vec<Vec<u32>>,
    /// Edges that stay edges, lower vertex first. A split divides them.
    pub lines: BTreeSet<[u32; 2]>,
}

/// The mesh after an edit.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Without dead elements.
    pub mesh: TriangleMesh,
    /// New vertex of each vertex, [`mesh::NONE`] for dead ones.
    pub vertex: Vec<u32>,
    /// Input triangle that each triangle comes from.
    pub source: Vec<u32>,
}

impl Editable {
    /// Takes a mesh; `lines` are edges to keep.
    pub fn new(mesh: &TriangleMesh, lines: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut incident = vec![vec![]; mesh.positions.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                incident[v as usize].push(t as u32);
            }
        }
        Self {
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.clone(),
            alive: vec![true; mesh.triangles.len()],
            source: (0..mesh.triangles.len() as u32).collect(),
            incident,
            lines: lines.into_iter().map(|[a, b]| sorted(a, b)).collect(),
        }
    }

    /// Position of a vertex.
    pub fn at(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    /// Length of an edge.
    pub fn length(&self, a: u32, b: u32) -> f64 {
        self.at(a).distance(self.at(b))
    }

    /// Triangles on the edge between `a` and `b`: none when there is no such edge, one at the border.
    pub fn on_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> + '_ {
        self.incident[a as usize].iter().copied().filter(move |&t| self.triangles[t as usize].contains(&b))
    }

    /// The corner of `t` that is neither `a` nor `b`.
    pub fn apex(&self, t: u32, a: u32, b: u32) -> u32 {
        let [x, y, z] = self.triangles[t as usize];
        if x != a && x != b {
            x
        } else if y != a && y != b {
            y
        } else {
            z
        }
    }

    /// Neighbours of `v`, sorted.
    pub fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut list: Vec<u32> = self.incident[v as usize]
            .iter()
            .flat_map(|&t| self.triangles[t as usize])
            .filter(|&u| u != v)
            .collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// True when `v` lies on the border.
    pub fn on_border(&self, v: u32) -> bool {
        self.neighbours(v).len() != self.incident[v as usize].len()
    }

    /// All edges, lower vertex first, sorted.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut list: Vec<[u32; 2]> = (0..self.triangles.len())
            .filter(|&t| self.alive[t])
            .flat_map(|t| {
                let [a, b, c] = self.triangles[t];
                [sorted(a, b), sorted(b, c), sorted(c, a)]
            })
            .collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// Twice the area times the unit normal of three points.
    pub fn area_normal(&self, t: [u32; 3]) -> DVec3 {
        let [a, b, c] = t.map(|v| self.at(v));
        (b - a).cross(c - a)
    }

    /// Splits an edge at `point`; returns the new vertex.
    pub fn split(&mut self, a: u32, b: u32, point: DVec3) -> u32 {
        let v = self.positions.len() as u32;
        self.positions.push(point);
        self.incident.push(vec![]);
        for t in self.on_edge(a, b).collect::<Vec<_>>() {
            let c = self.apex(t, a, b);
            let fresh = self.triangles.len() as u32;
            let old = self.triangles[t as usize];
            // The old triangle keeps a, the new one takes b.
            self.triangles.push(old.map(|x| if x == a { v } else { x }));
            self.triangles[t as usize] = old.map(|x| if x == b { v } else { x });
            self.alive.push(true);
            self.source.push(self.source[t as usize]);
            self.incident[b as usize].retain(|&x| x != t);
            self.incident[b as usize].push(fresh);
            self.incident[c as usize].push(fresh);
            self.incident[v as usize].extend([t, fresh]);
        }
        if self.lines.remove(&sorted(a, b)) {
            self.lines.insert(sorted(a, v));
            self.lines.insert(sorted(v, b));
        }
        v
    }

    /// Vertices joined to both ends of an edge although they form no triangle with it: they forbid its collapse.
    pub fn blockers(&self, a: u32, b: u32) -> Vec<u32> {
        let apexes: Vec<u32> = self.on_edge(a, b).map(|t| self.apex(t, a, b)).collect();
        let other = self.neighbours(b);
        self.neighbours(a).into_iter().filter(|v| other.binary_search(v).is_ok() && !apexes.contains(v)).collect()
    }

    /// True when `from` can be merged into its neighbour `to` without changing the topology (link condition). A border
    /// vertex only along the border.
    pub fn can_collapse(&self, from: u32, to: u32) -> bool {
        let sides = self.on_edge(from, to).count();
        if sides == 0 || !self.blockers(from, to).is_empty() {
            return false;
        }
        if self.on_border(from) && sides == 2 {
            return false;
        }
        // The last triangles of a piece, and vertices that would be left with two triangles, stay.
        let apexes: Vec<u32> = self.on_edge(from, to).map(|t| self.apex(t, from, to)).collect();
        self.incident[from as usize].len() > sides
            && apexes.iter().all(|&a| self.incident[a as usize].len() > if self.on_border(a) { 1 } else { 3 })
    }

    /// The triangles at `from` as they would be after merging it into `to`, with the triangles they replace.
    pub fn after_collapse(&self, from: u32, to: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        self.incident[from as usize].iter().filter_map(move |&t| {
            let corners = self.triangles[t as usize];
            (!corners.contains(&to)).then(|| (t, corners.map(|v| if v == from { to } else { v })))
        })
    }

    /// Merges `from` into `to`. The caller has asked [`Editable::can_collapse`].
    pub fn collapse(&mut self, from: u32, to: u32) {
        let moved: Vec<[u32; 2]> =
            self.neighbours(from).into_iter().map(|v| sorted(v, from)).filter(|l| self.lines.contains(l)).collect();
        for line in moved {
            self.lines.remove(&line);
            let other = if line[0] == from { line[1] } else { line[0] };
            if other != to {
                self.lines.insert(sorted(other, to));
            }
        }
        for t in std::mem::take(&mut self.incident[from as usize]) {
            let corners = self.triangles[t as usize];
            if corners.contains(&to) {
                self.alive[t as usize] = false;
                for v in corners {
                    self.incident[v as usize].retain(|&x| x != t);
                }
            } else {
                self.triangles[t as usize] = corners.map(|v| if v == from { to } else { v });
                self.incident[to as usize].push(t);
            }
        }
    }

    /// The two triangles that would replace those on an edge, when it is inside, no line, and the flip is possible.
    pub fn after_flip(&self, a: u32, b: u32) -> Option<([u32; 2], [[u32; 3]; 2])> {
        if self.lines.contains(&sorted(a, b)) {
            return None;
        }
        let mut sides = self.on_edge(a, b);
        let (s, t) = (sides.next()?, sides.next()?);
        let (c, d) = (self.apex(s, a, b), self.apex(t, a, b));
        if c == d || self.on_edge(c, d).next().is_some() {
            return None;
        }
        // s runs a, b, c or b, a, c: keep its turn.
        let turn = |t: [u32; 3]| (0..3).any(|k| t[k] == a && t[(k + 1) % 3] == b);
        let (c, d) = if turn(self.triangles[s as usize]) { (c, d) } else { (d, c) };
        Some(([s, t], [[a, d, c], [d, b, c]]))
    }

    /// Replaces the two triangles on an edge as [`Editable::after_flip`] says.
    pub fn flip(&mut self, sides: [u32; 2], fresh: [[u32; 3]; 2]) {
        for (t, corners) in sides.into_iter().zip(fresh) {
            for v in self.triangles[t as usize] {
                self.incident[v as usize].retain(|&x| x != t);
            }
            self.triangles[t as usize] = corners;
            for v in corners {
                self.incident[v as usize].push(t);
            }
        }
    }

    /// Drops dead elements; order is kept.
    pub fn finish(self) -> Finished {
        let mut vertex = vec![mesh::NONE; self.positions.len()];
        let mut positions = Vec::new();
        for (v, list) in self.incident.iter().enumerate() {
            if !list.is_empty() {
                vertex[v] = positions.len() as u32;
                positions.push(self.positions[v]);
            }
        }
        let living = || (0..self.triangles.len()).filter(|&t| self.alive[t]);
        let triangles = living().map(|t| self.triangles[t].map(|v| vertex[v as usize])).collect();
        let source = living().map(|t| self.source[t]).collect();
        Finished { mesh: TriangleMesh { positions, triangles }, vertex, source }
    }
}
