//! Takes out of the cut surface what only the construction needed, and makes it fit for the maps of section 4.3.
//!
//! Refining the surface and drawing paths leave many vertices behind inside input triangles and edges. They are merged into
//! a neighbour wherever the surface stays exactly what it was: within their triangle, along their edge, or along a straight
//! base edge. Afterwards no surface edge inside a base triangle joins two points of one of its sides: a map that
//! straightens the side would flatten what lies between.

use crate::base_error::RetopologyError;
use crate::cut::CutSurface;
use crate::split_mesh::{SplitMesh, next, prev};
use mesh::{DVec3, Monitor, NONE, TriangleMesh};
use std::collections::BTreeSet;

/// Merging may leave triangles this bad (twice the area over the longest edge squared), or as bad as those before.
const FAIR: f64 = 0.12;
/// A base edge may be straightened at a vertex where it turns by less than this, radians.
const STRAIGHT: f64 = 0.05;
/// Passes over all vertices; few are left to merge after the second.
const PASSES: usize = 4;

/// Tidies a cut surface whose first `inputs` vertices are the input's. Returns the new number of each vertex, [`NONE`] for
/// those that are gone; `keep` are never gone.
///
/// # Errors
/// Cancelled.
pub fn tidy(
    surface: &mut CutSurface,
    inputs: usize,
    keep: &[u32],
    monitor: &Monitor,
) -> Result<Vec<u32>, RetopologyError> {
    let mut merging = Merging::new(surface, inputs, keep);
    for _ in 0..PASSES {
        monitor.check()?;
        let mut merged = false;
        for v in inputs as u32..merging.gone.len() as u32 {
            merged |= merging.merge(v);
        }
        if !merged {
            break;
        }
    }
    Ok(merging.finish(surface))
}

struct Merging {
    positions: Vec<DVec3>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    source: Vec<u32>,
    outgoing: Vec<u32>,
    /// Vertices that are merged into others, and triangles that went with them.
    gone: Vec<bool>,
    dead: Vec<bool>,
    fixed: Vec<bool>,
    /// The base edge that runs through each vertex, and the vertices before and behind on it.
    path: Vec<u32>,
    along: Vec<[u32; 2]>,
    ends: Vec<[u32; 2]>,
}

impl Merging {
    fn new(surface: &CutSurface, inputs: usize, keep: &[u32]) -> Self {
        let topology = mesh::Topology::of_triangles(&surface.mesh);
        let n = surface.mesh.positions.len();
        let mut fixed: Vec<bool> = (0..n).map(|v| v < inputs || topology.is_border_vertex(v as u32)).collect();
        for &v in keep {
            fixed[v as usize] = true;
        }
        let (mut path, mut along, mut ends) = (vec![NONE; n], vec![[NONE; 2]; n], Vec::new());
        for (k, line) in surface.paths.iter().enumerate() {
            for triple in line.windows(3) {
                path[triple[1] as usize] = k as u32;
                along[triple[1] as usize] = [triple[0], triple[2]];
            }
            ends.push([line[0], line[line.len() - 1]]);
        }
        Self {
            positions: surface.mesh.positions.clone(),
            origin: topology.origin,
            twin: topology.twin,
            source: surface.source.clone(),
            outgoing: topology.outgoing,
            gone: vec![false; n],
            dead: vec![false; surface.source.len()],
            fixed,
            path,
            along,
            ends,
        }
    }

    fn to(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    /// Half-edges from a vertex off the border, counter-clockwise.
    fn around(&self, v: u32) -> Vec<u32> {
        let start = self.outgoing[v as usize];
        let (mut star, mut h) = (vec![start], self.twin[prev(start) as usize]);
        while h != start {
            star.push(h);
            h = self.twin[prev(h) as usize];
        }
        star
    }

    /// Neighbours of any vertex.
    fn neighbours(&self, v: u32) -> BTreeSet<u32> {
        let start = self.outgoing[v as usize];
        let (mut found, mut h) = (BTreeSet::new(), start);
        loop {
            found.extend([self.to(h), self.origin[prev(h) as usize]]);
            h = self.twin[prev(h) as usize];
            if h == start {
                return found;
            }
            if h == NONE {
                break;
            }
        }
        h = self.twin[start as usize];
        while h != NONE {
            h = next(h);
            found.extend([self.to(h), self.origin[prev(h) as usize]]);
            h = self.twin[h as usize];
        }
        found
    }

    /// Merges a vertex into the neighbour that leaves the best triangles, if any will do.
    fn merge(&mut self, v: u32) -> bool {
        if self.gone[v as usize] || self.fixed[v as usize] || self.outgoing[v as usize] == NONE {
            return false;
        }
        let star = self.around(v);
        let mut sources: Vec<u32> = star.iter().map(|&h| self.source[h as usize / 3]).collect();
        sources.sort_unstable();
        sources.dedup();
        if sources.len() > 2 {
            return false;
        }
        let at = |v: u32| self.positions[v as usize];
        let on_path = self.path[v as usize] != NONE;
        if on_path {
            let [a, b] = self.along[v as usize].map(at);
            if (at(v) - a).angle_between(b - at(v)) > STRAIGHT {
                return false;
            }
        }
        let old =
            star.iter().map(|&h| shape([at(v), at(self.to(h)), at(self.origin[prev(h) as usize])])).fold(1.0, f64::min);
        let mut best = (old.min(FAIR), NONE);
        for &h in &star {
            let w = self.to(h);
            let sides = [h, self.twin[h as usize]].map(|g| self.source[g as usize / 3]);
            let in_line = sources.len() == 1 || sides[0] != sides[1];
            if !in_line || (on_path && !self.along[v as usize].contains(&w)) {
                continue;
            }
            let worst = self.shape_after(&star, v, w);
            if worst >= best.0 && self.keeps_topology(&star, v, h) {
                best = (worst, h);
            }
        }
        if best.1 == NONE {
            return false;
        }
        self.collapse(&star, v, best.1);
        true
    }

    /// The worst triangle round `v` once it is merged into `w`; negative when one turns over.
    fn shape_after(&self, star: &[u32], v: u32, w: u32) -> f64 {
        let at = |v: u32| self.positions[v as usize];
        let mut worst = 1.0_f64;
        for &h in star {
            let (a, b) = (self.to(h), self.origin[prev(h) as usize]);
            if a == w || b == w {
                continue;
            }
            let normal = (at(a) - at(v)).cross(at(b) - at(v));
            let after = (at(a) - at(w)).cross(at(b) - at(w));
            if normal.dot(after) <= 0.0 {
                return -1.0;
            }
            worst = worst.min(shape([at(w), at(a), at(b)]));
        }
        worst
    }

    /// True when merging along `h` leaves a manifold, and no edge between two points of one base edge.
    fn keeps_topology(&self, star: &[u32], v: u32, h: u32) -> bool {
        let (w, t) = (self.to(h), self.twin[h as usize]);
        let opposite = [self.origin[prev(h) as usize], self.origin[prev(t) as usize]];
        let near = self.neighbours(w);
        star.iter().map(|&g| self.to(g)).filter(|&x| x != w).all(|x| {
            if near.contains(&x) {
                return opposite.contains(&x);
            }
            let (p, q) = (self.path[w as usize], self.path[x as usize]);
            let was_side = self.path[v as usize] != NONE && self.along[v as usize].contains(&x);
            let one_side = (p != NONE && (p == q || self.ends[p as usize].contains(&x)))
                || (q != NONE && self.ends[q as usize].contains(&w));
            was_side || !one_side
        })
    }

    fn collapse(&mut self, star: &[u32], v: u32, h: u32) {
        let (w, t) = (self.to(h), self.twin[h as usize]);
        for &g in star {
            self.origin[g as usize] = w;
        }
        for side in [h, t] {
            let (n, p) = (next(side), prev(side));
            let (x, y) = (self.twin[n as usize], self.twin[p as usize]);
            for (x, y) in [(x, y), (y, x)] {
                if x != NONE {
                    self.twin[x as usize] = y;
                }
            }
            self.dead[side as usize / 3] = true;
            // The third corner, and w, need half-edges that live.
            let corner = self.origin[p as usize];
            for vertex in [corner, w] {
                for g in [x, y] {
                    if g != NONE {
                        for candidate in [g, next(g)] {
                            if self.origin[candidate as usize] == vertex {
                                self.outgoing[vertex as usize] = candidate;
                            }
                        }
                    }
                }
            }
        }
        self.gone[v as usize] = true;
        if self.path[v as usize] != NONE {
            let [a, b] = self.along[v as usize];
            for (vertex, slot, other) in [(a, 1, b), (b, 0, a)] {
                if self.path[vertex as usize] == self.path[v as usize] {
                    let ends = &mut self.along[vertex as usize];
                    // A path may be walked either way: replace v wherever it stands.
                    let slot = if ends[slot] == v { slot } else { 1 - slot };
                    ends[slot] = other;
                }
            }
        }
    }

    /// Writes what is left back, splits edges that join two points of one side, and numbers the vertices anew.
    fn finish(self, surface: &mut CutSurface) -> Vec<u32> {
        let mut number = vec![NONE; self.positions.len()];
        let mut positions = Vec::new();
        for v in (0..self.positions.len()).filter(|&v| !self.gone[v]) {
            number[v] = positions.len() as u32;
            positions.push(self.positions[v]);
        }
        let alive = |f: &usize| !self.dead[*f];
        let triangle = |f: usize| [0, 1, 2].map(|k| number[self.origin[3 * f + k] as usize]);
        let triangles = (0..self.dead.len()).filter(alive).map(triangle).collect();
        surface.source = (0..self.dead.len()).filter(alive).map(|f| self.source[f]).collect();
        surface.mesh = TriangleMesh { positions, triangles };
        for path in &mut surface.paths {
            path.retain(|&v| !self.gone[v as usize]);
            for v in path.iter_mut() {
                *v = number[*v as usize];
            }
        }
        number
    }
}

/// Splits every surface edge inside a base triangle that joins two points of one of its sides.
pub fn split_chords(surface: &mut CutSurface) {
    let topology = mesh::Topology::of_triangles(&surface.mesh);
    let n = surface.mesh.positions.len();
    let (mut through, mut from) = (vec![NONE; n], vec![Vec::new(); n]);
    let mut side = BTreeSet::new();
    for (k, path) in surface.paths.iter().enumerate() {
        for &v in &path[1..path.len() - 1] {
            through[v as usize] = k as u32;
        }
        for v in [path[0], path[path.len() - 1]] {
            from[v as usize].push(k as u32);
        }
        side.extend(path.windows(2).map(|pair| mesh::sorted(pair[0], pair[1])));
    }
    let one_side = |a: u32, b: u32| {
        let (p, q) = (through[a as usize], through[b as usize]);
        match [p != NONE, q != NONE] {
            [true, true] => p == q,
            [true, false] => from[b as usize].contains(&p),
            [false, true] => from[a as usize].contains(&q),
            [false, false] => from[a as usize].iter().any(|k| from[b as usize].contains(k)),
        }
    };
    let chords: Vec<[u32; 2]> = topology
        .edges()
        .map(|h| mesh::sorted(topology.from(h), topology.to(h)))
        .filter(|&[a, b]| one_side(a, b) && !side.contains(&[a, b]))
        .collect();
    let mut mesh = SplitMesh::new(&surface.mesh, &topology);
    mesh.source.clone_from(&surface.source);
    for [a, b] in chords {
        if let Some(h) = mesh.find(a, b) {
            mesh.split(h, 0.5);
        }
    }
    surface.mesh = mesh.to_mesh();
    surface.source = mesh.source;
}

/// Twice the area over the longest edge squared: 0 for no area, 0.87 for equal sides.
fn shape([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    if longest > 0.0 { (b - a).cross(c - a).length() / longest } else { 0.0 }
}
