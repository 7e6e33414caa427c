//! Takes vertices out of a chain by collapsing them along it, and makes room where something is in the way.

use super::ResampleError;
use crate::editable::{Editable, next, prev};
use glam::DVec3;
use mesh::{Monitor, NONE, TriangleMesh, sorted};
use std::collections::{BTreeSet, HashSet};

/// A triangle may turn by this much (cosine) from the input triangle it comes from.
const TURN: f64 = 0.5;

/// Height over longest edge below which an input triangle borrows the normal of a neighbour.
const THIN: f64 = 1e-7;

/// How often room is made round one vertex before it is collapsed without regard to shape.
const ATTEMPTS: u32 = 12;

/// The mesh while its chains are being reduced.
pub(super) struct Removal {
    pub mesh: Editable,
    copies: Vec<Vec<u32>>,
    /// Normal of each input triangle.
    normals: Vec<DVec3>,
    is_fixed: Vec<bool>,
    /// Vertices of any chain; they are no free vertices.
    on_chain: Vec<bool>,
    /// Edges of the chains, lower vertex first. Only asked, never walked.
    locked: HashSet<[u32; 2]>,
    /// Vertices before and after each inner vertex of a chain.
    links: Vec<[u32; 2]>,
    /// Vertices to remove from each chain.
    doomed: Vec<Vec<u32>>,
}

impl Removal {
    pub fn new(mesh: Editable, copies: Vec<Vec<u32>>, input: &TriangleMesh, fixed: &[u32]) -> Self {
        let slots = mesh.vertex_slots() as usize;
        let mut is_fixed = vec![false; slots];
        for &v in fixed {
            for &copy in copies.get(v as usize).into_iter().flatten() {
                is_fixed[copy as usize] = true;
            }
        }
        for copy in copies.iter().filter(|c| c.len() > 1).flatten() {
            is_fixed[*copy as usize] = true;
        }
        let normals = borrowed_normals(&mesh, input);
        Self {
            mesh,
            copies,
            normals,
            is_fixed,
            on_chain: vec![false; slots],
            locked: HashSet::new(),
            links: Vec::new(),
            doomed: Vec::new(),
        }
    }

    /// Checks that a chain is a path of its own and marks its vertices.
    pub fn claim(&mut self, chain: usize, path: &[u32]) -> Result<(), ResampleError> {
        let last = path.len() - 1;
        for (step, &v) in path.iter().enumerate() {
            let no_step = ResampleError::NotAPath { chain, step };
            let Some(&copy) = self.copies.get(v as usize).and_then(|c| c.first()) else {
                return Err(no_step);
            };
            if step < last {
                let Some(&w) = self.copies.get(path[step + 1] as usize).and_then(|c| c.first()) else {
                    return Err(no_step);
                };
                if self.edge(copy, w).is_none() {
                    return Err(no_step);
                }
                if !self.locked.insert(sorted(copy, w)) {
                    return Err(ResampleError::Crossing { chain, vertex: v });
                }
            }
            if step > 0 && step < last {
                if self.on_chain[copy as usize] {
                    return Err(ResampleError::Crossing { chain, vertex: v });
                }
                self.on_chain[copy as usize] = true;
            }
        }
        Ok(())
    }

    /// Records a chain with its samples in place, and what is to be removed from it.
    pub fn thread(&mut self, chain: usize, path: &[u32], is_sample: &[bool]) -> Result<(), ResampleError> {
        let slots = self.mesh.vertex_slots() as usize;
        self.links.resize(slots, [NONE; 2]);
        for end in [path[0], path[path.len() - 1]] {
            if self.links[end as usize] != [NONE; 2] {
                return Err(ResampleError::Crossing { chain, vertex: self.mesh.identity[end as usize] });
            }
            self.on_chain[end as usize] = true;
        }
        let mut doomed = Vec::new();
        for k in 1..path.len() - 1 {
            let v = path[k];
            self.links[v as usize] = [path[k - 1], path[k + 1]];
            if !is_sample[k] {
                if self.is_fixed[v as usize] {
                    return Err(ResampleError::Kept { chain, vertex: self.mesh.identity[v as usize] });
                }
                doomed.push(v);
            }
        }
        self.doomed.push(doomed);
        Ok(())
    }

    pub fn copy_of(&self, v: u32) -> u32 {
        self.copies[v as usize][0]
    }

    pub fn position(&self, v: u32) -> DVec3 {
        self.mesh.positions[v as usize]
    }

    pub fn distance(&self, a: u32, b: u32) -> f64 {
        self.position(a).distance(self.position(b))
    }

    /// A half-edge between any copies of two vertices, either way round.
    pub fn edge(&self, a: u32, b: u32) -> Option<u32> {
        let all = |v: u32| match self.copies.get(self.mesh.identity[v as usize] as usize) {
            Some(copies) => copies.clone(),
            None => vec![v],
        };
        let (from, to) = (all(a), all(b));
        from.iter()
            .flat_map(|&x| to.iter().map(move |&y| (x, y)))
            .find_map(|(x, y)| self.mesh.find(x, y).or_else(|| self.mesh.find(y, x)))
    }

    /// Splits the chain edge from `a` to `b` at `place`.
    pub fn split(&mut self, a: u32, b: u32, place: DVec3) -> u32 {
        self.locked.remove(&sorted(a, b));
        let h = self.edge(a, b).expect("a chain edge, checked when claimed and kept by every split");
        let m = self.mesh.split(h, place);
        self.grow();
        self.on_chain[m as usize] = true;
        self.locked.extend([sorted(a, m), sorted(m, b)]);
        m
    }

    fn grow(&mut self) {
        let slots = self.mesh.vertex_slots() as usize;
        self.on_chain.resize(slots, false);
        self.is_fixed.resize(slots, false);
        self.links.resize(slots, [NONE; 2]);
    }

    /// Removes all doomed vertices of a chain: first those that can go without harm, then one that needs room, and so on.
    pub fn reduce(&mut self, chain: usize, monitor: &Monitor) -> Result<(), ResampleError> {
        let mut doomed = std::mem::take(&mut self.doomed[chain]);
        let mut attempts = 0;
        while !doomed.is_empty() {
            monitor.check()?;
            let before = doomed.len();
            let mut left = Vec::new();
            for &v in &doomed {
                let best = self.ways(v).filter(|way| way.2 > 0.0);
                if let Some((h, w, _)) = best {
                    self.collapse(h, v, w);
                } else {
                    left.push(v);
                }
            }
            doomed = left;
            if doomed.len() < before {
                attempts = 0;
                continue;
            }
            attempts += 1;
            let mut changed = false;
            for &v in &doomed {
                changed |= self.make_room(v);
            }
            if changed && attempts <= ATTEMPTS {
                continue;
            }
            // Shape has to give way: topology does not.
            let forced = (0..doomed.len()).find_map(|k| {
                let v = doomed[k];
                self.links[v as usize]
                    .into_iter()
                    .filter_map(|w| Some((self.edge(v, w)?, w)))
                    .find(|&(h, _)| self.may_collapse(h, v))
                    .map(|(h, w)| (k, h, w))
            });
            let Some((k, h, w)) = forced else {
                return Err(ResampleError::Topology { chain });
            };
            let v = doomed.remove(k);
            self.collapse(h, v, w);
            attempts = 0;
        }
        Ok(())
    }

    /// Topology, and no chain laid upon another or upon the border.
    fn may_collapse(&self, h: u32, v: u32) -> bool {
        let [before, after] = self.links[v as usize];
        self.mesh.can_collapse(h, v) && !self.edge(before, after).is_some_and(|e| self.is_locked(e))
    }

    /// The better of the two collapses of `v` along its chain: half-edge, target, worst shape.
    fn ways(&self, v: u32) -> Option<(u32, u32, f64)> {
        self.links[v as usize]
            .into_iter()
            .filter_map(|w| {
                let h = self.edge(v, w)?;
                self.may_collapse(h, v).then(|| (h, w, self.worst_after(v, w)))
            })
            .reduce(|x, y| if y.2 > x.2 { y } else { x })
    }

    fn collapse(&mut self, h: u32, v: u32, w: u32) {
        let [before, after] = self.links[v as usize];
        let other = if w == before { after } else { before };
        self.locked.remove(&sorted(v, before));
        self.locked.remove(&sorted(v, after));
        self.locked.insert(sorted(w, other));
        for (end, slot, new) in [(before, 1, after), (after, 0, before)] {
            if self.links[end as usize] != [NONE; 2] {
                self.links[end as usize][slot] = new;
            }
        }
        self.mesh.collapse(h, v);
    }

    /// Shape of a triangle against the input triangle `source`: negative when turned, 0 without area, 1 at best.
    fn shape(&self, corners: [u32; 3], source: u32) -> f64 {
        let [a, b, c] = corners.map(|v| self.position(v));
        let normal = (b - a).cross(c - a);
        let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        let ratio = 2.0 * 3_f64.sqrt() * normal.length() / squares;
        if ratio.is_nan() || ratio < 1e-9 {
            return 0.0;
        }
        let cos = normal.normalize().dot(self.normals[source as usize]);
        if cos >= TURN { ratio } else { (cos - TURN).min(-f64::MIN_POSITIVE) }
    }

    /// Worst shape of the triangles that `v` would take along to `w`; 0 or less when it must not. What was no better
    /// before does not count.
    fn worst_after(&self, v: u32, w: u32) -> f64 {
        let mut worst: f64 = 1.0;
        for h in self.mesh.around(v) {
            let (p, q) = (self.mesh.to(h), self.mesh.apex(h));
            if p == w || q == w {
                continue;
            }
            let source = self.mesh.source[h as usize / 3];
            let (before, after) = (self.shape([v, p, q], source), self.shape([w, p, q], source));
            if after <= 0.0 && after > before {
                continue;
            }
            worst = worst.min(after);
        }
        worst
    }

    /// Flips, removes or splits one thing beside `v` that keeps it from going; false when there is nothing to do.
    fn make_room(&mut self, v: u32) -> bool {
        for w in self.links[v as usize] {
            let Some(h) = self.edge(v, w) else { continue };
            if !self.mesh.can_collapse(h, v) {
                if self.split_obstacle(h, v, w) {
                    return true;
                }
                continue;
            }
            let obstacles: BTreeSet<u32> = self
                .mesh
                .around(v)
                .filter(|&g| {
                    let (p, q) = (self.mesh.to(g), self.mesh.apex(g));
                    p != w && q != w && self.shape([w, p, q], self.mesh.source[g as usize / 3]) <= 0.0
                })
                .flat_map(|g| [self.mesh.to(g), self.mesh.apex(g)])
                .collect();
            for &x in &obstacles {
                if self.flip_spoke(v, x) || self.remove_free(x) {
                    return true;
                }
            }
        }
        false
    }

    fn is_locked(&self, h: u32) -> bool {
        self.mesh.twin(h).is_none() || self.locked.contains(&sorted(self.mesh.from(h), self.mesh.to(h)))
    }

    /// Splits an edge that breaks the link condition: one of a triangle v, w, x that is no face, or beside an apex of
    /// too few edges.
    fn split_obstacle(&mut self, h: u32, v: u32, w: u32) -> bool {
        let sides = [Some(h), self.mesh.twin(h)];
        let apexes = sides.map(|side| side.map(|s| self.mesh.apex(s)));
        let mut candidates: Vec<u32> = Vec::new();
        for x in self.mesh.neighbours(v) {
            if x != w && !apexes.contains(&Some(x)) && self.mesh.are_joined(x, w) {
                candidates.extend(self.edge(v, x));
                candidates.extend(self.edge(w, x));
            }
        }
        for (side, apex) in sides.into_iter().zip(apexes) {
            let (Some(side), Some(apex)) = (side, apex) else {
                continue;
            };
            if self.mesh.valence(apex) <= 3 {
                // The triangles beyond the apex: their edges opposite it.
                for g in self.mesh.around(apex).filter(|g| g / 3 != side / 3) {
                    candidates.push(next(g));
                }
            }
        }
        let Some(g) = candidates.into_iter().find(|&g| !self.is_locked(g)) else {
            return false;
        };
        let middle = (self.position(self.mesh.from(g)) + self.position(self.mesh.to(g))) / 2.0;
        self.mesh.split(g, middle);
        self.grow();
        true
    }

    /// Takes the edge from `v` to `x` away from `v`, when the two new triangles are sound.
    fn flip_spoke(&mut self, v: u32, x: u32) -> bool {
        let Some(h) = self.edge(v, x) else {
            return false;
        };
        let Some(g) = self.mesh.twin(h) else {
            return false;
        };
        if self.is_locked(h) || !self.mesh.can_flip(h) {
            return false;
        }
        let (a, b, c, d) = (self.mesh.from(h), self.mesh.to(h), self.mesh.apex(h), self.mesh.apex(g));
        let (s, t) = (self.mesh.source[h as usize / 3], self.mesh.source[g as usize / 3]);
        let is_sound = [s, t].iter().all(|&s| self.shape([a, d, c], s) > 0.02 && self.shape([b, c, d], s) > 0.02);
        if is_sound {
            self.mesh.flip(h);
        }
        is_sound
    }

    /// Collapses a free vertex into the neighbour that leaves the best triangles.
    fn remove_free(&mut self, x: u32) -> bool {
        let i = x as usize;
        if self.on_chain[i] || self.is_fixed[i] || self.mesh.is_border_vertex(x) {
            return false;
        }
        let best = self
            .mesh
            .around(x)
            .filter(|&h| self.mesh.can_collapse(h, x))
            .map(|h| (self.worst_after(x, self.mesh.to(h)), h))
            .reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((worst, h)) = best else { return false };
        if worst > 0.0 {
            self.mesh.collapse(h, x);
        }
        worst > 0.0
    }
}

/// Unit normal of each input triangle; thin ones take that of the nearest sound triangle, ring by ring.
fn borrowed_normals(mesh: &Editable, input: &TriangleMesh) -> Vec<DVec3> {
    let mut normals: Vec<DVec3> = (0..input.triangles.len())
        .map(|t| {
            let p = input.points(t);
            let longest = (0..3).map(|k| p[k].distance_squared(p[(k + 1) % 3])).fold(0.0, f64::max);
            let normal = input.area_normal(t);
            if normal.length() > THIN * longest { normal.normalize() } else { DVec3::ZERO }
        })
        .collect();
    let mut waiting: Vec<u32> = (0..normals.len() as u32).filter(|&t| normals[t as usize] == DVec3::ZERO).collect();
    loop {
        let found: Vec<(u32, DVec3)> = waiting
            .iter()
            .filter_map(|&t| {
                let first = 3 * t;
                // The longest edge leads to the triangle this one is a crack of.
                let mut edges = [first, next(first), prev(first)];
                let length =
                    |h: u32| mesh.positions[mesh.from(h) as usize].distance(mesh.positions[mesh.to(h) as usize]);
                edges.sort_by(|&a, &b| length(b).total_cmp(&length(a)).then(a.cmp(&b)));
                let normal = edges
                    .iter()
                    .filter_map(|&h| mesh.twin(h))
                    .map(|g| normals[g as usize / 3])
                    .find(|n| *n != DVec3::ZERO)?;
                Some((t, normal))
            })
            .collect();
        if found.is_empty() {
            return normals;
        }
        for &(t, normal) in &found {
            normals[t as usize] = normal;
        }
        waiting.retain(|&t| normals[t as usize] == DVec3::ZERO);
    }
}
