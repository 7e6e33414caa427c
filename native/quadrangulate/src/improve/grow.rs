//! The disks of [`super::refill`]: how they grow, and their borders.

use super::editable::{sector_cost, valence_cost};
use super::refill::Refill;
use crate::fill::MOST_SIDES;
use mesh::NONE;
use std::collections::VecDeque;
use surface::smooth::Constraint;

/// A disk of quads that grows. Scratch lists have an entry for each quad or vertex of the mesh.
#[derive(Default)]
pub(super) struct Disk {
    pub surface: u32,
    pub quads: Vec<u32>,
    /// Those of them that may have a side on its border, in the order in which they came.
    rim: Vec<u32>,
    pub vertices: Vec<u32>,
    /// Sum of the valence costs of its vertices.
    pub cost: i32,
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
    pub fn clear(&mut self, surface: u32, quads: usize, vertices: usize) {
        self.quads.iter().for_each(|&q| self.is_in[q as usize] = false);
        self.vertices.iter().for_each(|&v| self.inside[v as usize] = 0);
        self.quads.clear();
        self.rim.clear();
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
pub(super) struct Rim {
    pub vertices: Vec<u32>,
    /// Edges between one corner and the next.
    pub sides: Vec<u32>,
    /// What its vertices cost when a pattern lies inside.
    pub cost: i32,
}

impl Refill<'_, '_> {
    /// Adds a quad if what results is a disk still, crosses no feature and buries no vertex that must stay.
    pub(super) fn add(&mut self, q: u32) -> bool {
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
        disk.rim.push(q);
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

    /// Adds the quads around a vertex. Twice: one may touch the others at its corner only, until the one between is there.
    pub(super) fn surround(&mut self, v: u32) {
        self.add_around(v);
        self.add_around(v);
    }

    fn add_around(&mut self, v: u32) {
        for k in 0..self.search.mesh.around[v as usize].len() {
            self.add(self.search.mesh.around[v as usize][k]);
        }
    }

    /// Quads the disk should have at a vertex of its border.
    fn wanted(&self, v: u32) -> i32 {
        let mesh = &self.search.mesh;
        let corner = |&q: &u32| Some((q, mesh.quads[q as usize]?.iter().position(|&w| w == v)?));
        let in_disk = mesh.around[v as usize].iter().filter(|&&q| self.disk.has(q)).find_map(corner);
        in_disk.map_or(2, |(q, k)| self.missing[q as usize][k] + self.disk.inside[v as usize] as i32)
    }

    /// Takes in what lies at reflex vertices of the border, and at those with too many quads outside.
    pub(super) fn straighten(&mut self) {
        while let Some(v) = self.disk.fresh.pop() {
            let is_inner = self.disk.inside[v as usize] as usize == self.search.mesh.around[v as usize].len();
            if is_inner || (1..=2).contains(&self.wanted(v)) || self.disk.quads.len() > self.most {
                continue;
            }
            self.add_around(v);
        }
        let mut rim = std::mem::take(&mut self.disk.rim);
        rim.retain(|&q| self.across[q as usize].iter().any(|&(other, _)| !self.disk.has(other)));
        self.disk.rim = rim;
    }

    /// Adds the quads beyond the border. Returns whether there were any.
    pub(super) fn grow(&mut self) -> bool {
        let mut grown = false;
        for q in self.disk.rim.clone() {
            for (other, is_feature) in self.across[q as usize] {
                grown |= other != NONE && !is_feature && self.add(other);
            }
        }
        grown
    }

    /// Adds the quads on the way to the nearest irregular vertex beyond the border, and those around it. Returns whether there
    /// were any; as many as `passed_over` says are left alone.
    pub(super) fn reach(&mut self, passed_over: &mut usize) -> bool {
        let mut queue: VecDeque<u32> = self.disk.rim.iter().copied().collect();
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
            self.surround(v);
        }
        grown
    }

    /// The border of the disk, when it has corners.
    pub(super) fn rim(&self) -> Option<Rim> {
        let quad = |q: u32| self.search.mesh.quads[q as usize];
        let mut edges = self.disk.rim.iter().flat_map(|&q| (0..4).map(move |k| (q, k)));
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
        let wanted: Vec<i32> = vertices.iter().map(|&v| self.wanted(v)).collect();
        let corners: Vec<usize> = (0..vertices.len()).filter(|&k| wanted[k] <= 1).collect();
        let first = *corners.first().filter(|_| corners.len() <= MOST_SIDES)?;
        let after = corners.iter().skip(1).copied().chain([first + vertices.len()]);
        let sides = corners.iter().zip(after).map(|(from, to)| (to - from) as u32).collect();
        // A pattern has one quad at a corner, two elsewhere.
        let with_pattern = |(&v, &wanted): (&u32, &i32)| self.cost_with(v, wanted, if wanted <= 1 { 1 } else { 2 });
        let cost = vertices.iter().zip(&wanted).map(with_pattern).sum();
        vertices.rotate_left(first);
        Some(Rim { vertices, sides, cost })
    }

    /// What a vertex of the border would cost with so many quads in the disk.
    fn cost_with(&self, v: u32, wanted: i32, inside: i32) -> i32 {
        let off = inside - wanted;
        if !self.search.mesh.anchored[v as usize] {
            return valence_cost(off);
        }
        // Its other sectors stay as they are.
        self.search.cost[v as usize] - sector_cost(self.disk.inside[v as usize] as i32 - wanted) + sector_cost(off)
    }
}
