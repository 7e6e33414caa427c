//! Fewer irregular vertices by filling whole pieces of the mesh anew.
//!
//! Local operators cancel irregular vertices that are a few quads apart; those further off stay. Here a disk of quads is
//! grown round an irregular vertex, never across a feature, until its border is straight but for convex corners. Where a
//! pattern with those sides has fewer irregular vertices than the disk and its border have, and the surface bears it, the
//! pattern takes the quads' place. The idea is that of Bunin, "Non-local topological cleanup", 2006, and of Verma and
//! Suresh, "A robust combinatorial approach to reduce singularities in quadrilateral meshes", 2017; the patterns are
//! those of the fillers.

use super::search::{FIRST_STEP, Search};
use crate::disk::Disk as Pattern;
use crate::fill::pattern_disks;
use crate::flatten::{harmonic, uniform_weights};
use glam::DVec2;
use mesh::{Cancelled, DVec3, Monitor, NONE};
use std::collections::{BTreeMap, VecDeque};
use surface::smooth::Constraint;

/// Passes over the irregular vertices at most.
const PASSES: usize = 4;
/// The number of quads changes by no more than this fraction.
const MOST_DRIFT: f64 = 0.01;
/// Ways in which disks grow towards other irregular vertices: in the second the nearest is passed over, and so on. One more
/// way is to grow evenly.
const WAYS: usize = 3;
/// Patterns tried on the surface for one disk.
const PATTERNS_TRIED: usize = 2;
/// What one irregular vertex less is worth in the cost of [`Search::judge_quads`].
const WORTH: f64 = 3.0;
/// The worst quad a pattern may bring, unless there was a worse one.
const FLOOR: f64 = 0.25;
/// Sweeps that smooth a pattern.
const SWEEPS: usize = 4;

/// A disk of quads that grows. Scratch lists have an entry for each quad or vertex of the mesh.
#[derive(Default)]
pub(super) struct Disk {
    surface: u32,
    quads: Vec<u32>,
    vertices: Vec<u32>,
    /// Sum of the valence costs of its vertices.
    cost: i32,
    is_in: Vec<bool>,
    /// Quads of the disk at each vertex.
    inside: Vec<u32>,
    /// Vertices whose surroundings have changed since they were last looked at.
    fresh: Vec<u32>,
    /// The quad from which a walk came to each quad, and the quads it came to.
    came_from: Vec<u32>,
    walked: Vec<u32>,
}

impl Disk {
    fn clear(&mut self, surface: u32, quads: usize, vertices: usize) {
        self.quads.iter().for_each(|&q| self.is_in[q as usize] = false);
        self.vertices.iter().for_each(|&v| self.inside[v as usize] = 0);
        self.quads.clear();
        self.vertices.clear();
        self.fresh.clear();
        (self.surface, self.cost) = (surface, 0);
        self.is_in.resize(quads, false);
        self.came_from.resize(quads, NONE);
        self.inside.resize(vertices, 0);
    }

    fn has(&self, q: u32) -> bool {
        q != NONE && self.is_in[q as usize]
    }
}

/// A disk's border, counter-clockwise from a corner.
struct Rim {
    vertices: Vec<u32>,
    /// Edges between one corner and the next.
    sides: Vec<u32>,
}

/// Where to try again is not worth it: the clock when a vertex was tried last, and the vertices that its disks came to.
type Tried = BTreeMap<u32, (u32, Vec<u32>)>;

/// What a refilling search needs beside [`Search`].
pub(super) struct Refill<'s, 'a> {
    search: &'s mut Search<'a>,
    /// Quads that may not be replaced.
    stays: &'s [bool],
    /// The quad beyond each edge of each quad, or [`NONE`], and whether the edge is a feature.
    across: Vec<[(u32, bool); 4]>,
    disk: Disk,
    /// Most quads in a disk.
    most: usize,
    /// Quads now more than at the start, and the most there may be.
    drift: i64,
    most_drift: i64,
}

impl<'s, 'a> Refill<'s, 'a> {
    pub fn new(search: &'s mut Search<'a>, stays: &'s [bool], most: usize) -> Self {
        let quads = search.mesh.quads.len();
        let most_drift = (quads as f64 * MOST_DRIFT) as i64;
        let mut refill =
            Self { search, stays, across: vec![], disk: Disk::default(), most, drift: 0, most_drift };
        (0..quads as u32).for_each(|q| refill.link(q));
        refill
    }

    /// Disk by disk, from every irregular vertex, until none helps.
    pub fn run(&mut self, monitor: &Monitor) -> Result<(), Cancelled> {
        let mut tried = Tried::new();
        for _ in 0..PASSES {
            let mut progress = false;
            let mut v = 0;
            while v < self.search.mesh.positions.len() as u32 {
                let in_vain = tried.get(&v).is_some_and(|(clock, seen)| {
                    seen.iter().all(|&w| self.search.changed[w as usize] <= *clock)
                });
                if self.search.cost[v as usize] != 0 && !in_vain {
                    let clock = self.search.clock;
                    let mut seen = Vec::new();
                    progress |= self.at(v, &mut seen, monitor)?;
                    tried.insert(v, (clock, seen));
                }
                v += 1;
            }
            if !progress {
                break;
            }
        }
        Ok(())
    }

    /// Looks up what lies beside a quad.
    fn link(&mut self, q: u32) {
        let mesh = &self.search.mesh;
        if self.across.len() <= q as usize {
            self.across.resize(q as usize + 1, [(NONE, false); 4]);
        }
        if let Some(quad) = mesh.quads[q as usize] {
            self.across[q as usize] = [0, 1, 2, 3].map(|k| {
                let (a, b) = (quad[k], quad[(k + 1) & 3]);
                (mesh.directed(b, a).map_or(NONE, |(other, _)| other), mesh.is_feature(a, b))
            });
        }
    }

    /// Grows disks round a vertex until a pattern takes the place of one. Returns whether one did; `seen` are the vertices of the
    /// disks where none did.
    fn at(&mut self, v: u32, seen: &mut Vec<u32>, monitor: &Monitor) -> Result<bool, Cancelled> {
        for way in 0..=WAYS {
            monitor.check()?;
            let around = self.search.mesh.around[v as usize].clone();
            let mesh = &self.search.mesh;
            let Some(&seed) = around.first() else { break };
            self.disk.clear(mesh.surface_of[seed as usize], mesh.quads.len(), mesh.positions.len());
            // Twice: a quad may touch the others at its corner only until the one between is there.
            for q in [&around[..], &around[..]].concat() {
                self.add(q);
            }
            let mut passed_over = way;
            loop {
                self.straighten();
                if self.disk.quads.len() > self.most {
                    break;
                }
                if self.disk.cost > 1
                    && let Some(rim) = self.rim()
                    && self.try_patterns(&rim, monitor)?
                {
                    return Ok(true);
                }
                if !(if way == WAYS { self.grow() } else { self.reach(&mut passed_over) }) {
                    break;
                }
            }
            seen.extend(&self.disk.vertices);
        }
        seen.sort_unstable();
        seen.dedup();
        Ok(false)
    }

    /// Adds a quad if what results is a disk still, crosses no feature and buries no vertex that must stay.
    fn add(&mut self, q: u32) -> bool {
        let Self { search, disk, across, stays, .. } = self;
        let mesh = &search.mesh;
        let Some(quad) = mesh.quads[q as usize] else { return false };
        let may_go = !stays.get(q as usize).is_some_and(|stays| *stays);
        if disk.has(q) || mesh.surface_of[q as usize] != disk.surface || !may_go {
            return false;
        }
        if !disk.quads.is_empty() {
            let beside = across[q as usize];
            if beside.iter().any(|&(other, is_feature)| is_feature && disk.has(other)) {
                return false;
            }
            // What it shares with the disk must be one run of edges, and nothing more.
            let shared = beside.map(|(other, _)| disk.has(other));
            let runs = (0..4).filter(|&k| shared[k] && !shared[(k + 3) & 3]).count();
            let touches = |k: usize| disk.inside[quad[k] as usize] > 0 && !shared[k] && !shared[(k + 3) & 3];
            if runs != 1 || (0..4).any(touches) {
                return false;
            }
            let is_buried = |&v: &u32| {
                let v = v as usize;
                disk.inside[v] as usize + 1 == mesh.around[v].len()
                    && !mesh.anchored[v]
                    && mesh.constraints[v] != Constraint::Free
            };
            if quad.iter().any(is_buried) {
                return false;
            }
        }
        disk.is_in[q as usize] = true;
        disk.quads.push(q);
        for v in quad {
            if disk.inside[v as usize] == 0 {
                disk.vertices.push(v);
                disk.cost += search.cost[v as usize];
            }
            disk.inside[v as usize] += 1;
            disk.fresh.push(v);
        }
        true
    }

    /// Quads the disk should have at a vertex of its border.
    fn wanted(&self, v: u32) -> i32 {
        let mesh = &self.search.mesh;
        let inside = self.disk.inside[v as usize] as i32;
        if !mesh.anchored[v as usize] {
            return 4 - (mesh.around[v as usize].len() as i32 - inside);
        }
        // In the sector with the disk's quads.
        let in_disk = mesh.fan(v).iter().position(|&(q, _)| self.disk.has(q)).unwrap_or(0);
        let mut passed = 0;
        for (first, _, count, _) in mesh.sectors_of(v) {
            passed += count as usize;
            if in_disk < passed {
                return mesh.ideal(v, first) as i32 - (count as i32 - inside);
            }
        }
        2
    }

    /// Takes in what lies at reflex vertices of the border, and at those with too many quads outside.
    fn straighten(&mut self) {
        while let Some(v) = self.disk.fresh.pop() {
            let is_inner = self.disk.inside[v as usize] as usize == self.search.mesh.around[v as usize].len();
            if is_inner || (1..=2).contains(&self.wanted(v)) || self.disk.quads.len() > self.most {
                continue;
            }
            for q in self.search.mesh.around[v as usize].clone() {
                self.add(q);
            }
        }
    }

    /// Adds the quads beyond the border. Returns whether there were any.
    fn grow(&mut self) -> bool {
        let mut grown = false;
        for k in 0..self.disk.quads.len() {
            for (other, is_feature) in self.across[self.disk.quads[k] as usize] {
                grown |= other != NONE && !is_feature && self.add(other);
            }
        }
        grown
    }

    /// Adds the quads on the way to the nearest irregular vertex beyond the border, and those around it. Returns whether there
    /// were any; as many as `passed_over` says are left alone.
    fn reach(&mut self, passed_over: &mut usize) -> bool {
        let mut queue: VecDeque<u32> = self.disk.quads.iter().copied().collect();
        let mut met = Vec::new();
        let mut found = None;
        'walk: while let Some(q) = queue.pop_front() {
            let Some(quad) = self.search.mesh.quads[q as usize] else { continue };
            for v in quad.into_iter().filter(|_| !self.disk.has(q)) {
                if self.search.cost[v as usize] != 0 && self.disk.inside[v as usize] == 0 && !met.contains(&v) {
                    met.push(v);
                    if *passed_over == 0 {
                        found = Some((q, v));
                        break 'walk;
                    }
                    *passed_over -= 1;
                }
            }
            if self.disk.walked.len() > self.most {
                break;
            }
            for (other, is_feature) in self.across[q as usize] {
                let is_new = other != NONE && !self.disk.has(other) && self.disk.came_from[other as usize] == NONE;
                if is_new && !is_feature {
                    self.disk.came_from[other as usize] = q;
                    self.disk.walked.push(other);
                    queue.push_back(other);
                }
            }
        }
        let mut way = Vec::new();
        if let Some((mut q, _)) = found {
            while !self.disk.has(q) {
                way.push(q);
                q = self.disk.came_from[q as usize];
            }
        }
        for q in std::mem::take(&mut self.disk.walked) {
            self.disk.came_from[q as usize] = NONE;
        }
        let mut grown = false;
        for q in way.into_iter().rev() {
            grown |= self.add(q);
        }
        if let Some((_, v)) = found.filter(|_| grown) {
            let around = self.search.mesh.around[v as usize].clone();
            for q in [&around[..], &around[..]].concat() {
                self.add(q);
            }
        }
        grown
    }

    /// The border of the disk, when it has corners.
    fn rim(&self) -> Option<Rim> {
        let quad = |q: u32| self.search.mesh.quads[q as usize];
        let mut edges = self.disk.quads.iter().flat_map(|&q| (0..4).map(move |k| (q, k)));
        let start = edges.find(|&(q, k)| !self.disk.has(self.across[q as usize][k].0))?;
        let (mut vertices, mut at) = (Vec::new(), start);
        loop {
            vertices.push(quad(at.0)?[at.1]);
            // The next edge out of its end that has nothing of the disk beyond.
            let (mut q, mut k) = (at.0, (at.1 + 1) & 3);
            loop {
                let beyond = self.across[q as usize][k].0;
                if !self.disk.has(beyond) {
                    break;
                }
                let end = quad(q)?[(k + 1) & 3];
                let back = quad(beyond)?.iter().position(|&v| v == end)?;
                (q, k) = (beyond, (back + 1) & 3);
            }
            at = (q, k);
            if at == start {
                break;
            }
            if vertices.len() > 4 * self.disk.quads.len() {
                return None;
            }
        }
        let corners: Vec<usize> = (0..vertices.len()).filter(|&k| self.wanted(vertices[k]) <= 1).collect();
        let first = *corners.first()?;
        let after = corners.iter().skip(1).copied().chain([first + vertices.len()]);
        let sides = corners.iter().zip(after).map(|(from, to)| (to - from) as u32).collect();
        vertices.rotate_left(first);
        Some(Rim { vertices, sides })
    }

    /// Puts the first pattern with the rim's sides in place that makes the mesh better.
    fn try_patterns(&mut self, rim: &Rim, monitor: &Monitor) -> Result<bool, Cancelled> {
        for pattern in pattern_disks(&rim.sides, PATTERNS_TRIED, self.disk.cost as u32) {
            if self.try_pattern(rim, &pattern, monitor)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn try_pattern(&mut self, rim: &Rim, pattern: &Pattern, monitor: &Monitor) -> Result<bool, Cancelled> {
        let (search, disk) = (&mut *self.search, &self.disk);
        let perimeter = rim.vertices.len();
        let drift = self.drift + pattern.quads.len() as i64 - disk.quads.len() as i64;
        if drift.abs() > self.drift.abs().max(self.most_drift) {
            return Ok(false);
        }
        let (badness_before, worst_before) = search.judge_quads(&disk.quads);
        let mark = search.mesh.mark();
        disk.quads.iter().for_each(|&q| search.mesh.remove(q));
        let first_vertex = search.mesh.positions.len() as u32;
        let first_quad = search.mesh.quads.len() as u32;
        for _ in perimeter..pattern.vertex_count as usize {
            search.mesh.add_vertex(DVec3::ZERO, 0.0);
        }
        let name = |v: u32| {
            let inner = v.checked_sub(perimeter as u32);
            inner.map_or_else(|| rim.vertices[v as usize], |inner| first_vertex + inner)
        };
        for quad in &pattern.quads {
            search.mesh.add(quad.map(name), disk.surface);
        }
        let vertices: Vec<u32> = (0..pattern.vertex_count).map(name).collect();
        let gain = vertices.iter().map(|&v| search.mesh.vertex_cost(v)).sum::<i32>() - disk.cost;
        if gain >= 0 || !search.mesh.is_proper_since(mark) {
            search.mesh.undo(mark);
            return Ok(false);
        }
        search.trials += 1;
        // Every new vertex the mean of its neighbours, and on the surface.
        let weights = uniform_weights(&pattern.quads);
        let spread = |value: &dyn Fn(usize) -> DVec2| {
            let on_rim = |k: usize| rim.vertices.get(k).map(|&v| value(v as usize));
            harmonic(&weights, &(0..vertices.len()).map(on_rim).collect::<Vec<_>>(), monitor)
        };
        let (positions, sizes) = (&search.mesh.positions, &search.mesh.size);
        let across = spread(&|v| DVec2::new(positions[v].x, positions[v].y))?;
        let rest = spread(&|v| DVec2::new(positions[v].z, sizes[v]))?;
        let surface = search.surfaces[disk.surface as usize];
        let new = &vertices[perimeter..];
        for ((&v, across), rest) in new.iter().zip(&across[perimeter..]).zip(&rest[perimeter..]) {
            search.mesh.positions[v as usize] = surface.project(DVec3::new(across.x, across.y, rest.x)).point;
            search.mesh.size[v as usize] = rest.y;
        }
        search.extend_normals();
        let mut steps = vec![FIRST_STEP; new.len()];
        search.relax(new, &mut steps, 0..SWEEPS);
        let new_quads: Vec<u32> = (first_quad..search.mesh.quads.len() as u32).collect();
        let (badness, worst) = search.judge_quads(&new_quads);
        if worst < worst_before.min(FLOOR) || WORTH * f64::from(gain) + badness - badness_before >= 0.0 {
            search.mesh.undo(mark);
            search.normals.truncate(search.mesh.quads.len());
            return Ok(false);
        }
        search.changes += 1;
        search.clock += 1;
        search.cost.resize(search.mesh.positions.len(), 0);
        search.changed.resize(search.mesh.positions.len(), 0);
        for &v in disk.vertices.iter().chain(&vertices) {
            search.cost[v as usize] = search.mesh.vertex_cost(v);
            search.changed[v as usize] = search.clock;
        }
        self.drift = drift;
        let mut beside: Vec<u32> =
            rim.vertices.iter().flat_map(|&v| self.search.mesh.around[v as usize].iter().copied()).collect();
        beside.extend(new_quads);
        beside.sort_unstable();
        beside.dedup();
        beside.into_iter().for_each(|q| self.link(q));
        Ok(true)
    }
}
