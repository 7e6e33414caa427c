//! The quads of a traced layout, put on the surface: `QuadMixer`, section 3.5.
//!
//! Vertices along features go where [`division`] puts them, those along traces lie evenly on them, and each patch is mapped
//! onto its piece of the quads that were there. Quads that stay share the new vertices along features.

use super::Parts;
use super::plan::{Piece, Plan, Traced};
use crate::division;
use crate::fill::{Filled, Place, divide_evenly};
use mesh::{Cancelled, DVec3, Monitor, NONE};
use quadrangulate::layout::PatchLayout;
use quadrangulate::{DiskSurface, place};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Quads in the making.
struct Laying<'a> {
    parts: &'a Parts<'a, 'a>,
    traced: &'a Traced,
    plan: &'a Plan,
    filled: Filled,
    /// The vertex at each of the layout's where one is.
    of_layout: BTreeMap<u32, u32>,
    /// Vertices along each piece.
    paths: Vec<Vec<u32>>,
}

impl<'p> Parts<'p, 'p> {
    /// The quads of a plan; the patch of each is its part. Rails with fewer edges than `room` times what their bends need have vertices
    /// on the bends that stay. `None` where a patch cannot be laid over its surface.
    pub fn lay(&self, traced: &Traced, plan: &Plan, room: f64, monitor: &Monitor) -> Result<Option<Filled>, Cancelled> {
        let mut laying = Laying {
            parts: self,
            traced,
            plan,
            filled: Filled { along: vec![vec![]; self.work.base().edges.len()], ..Filled::default() },
            of_layout: BTreeMap::new(),
            paths: vec![vec![]; plan.pieces.len()],
        };
        laying.along_rails(room);
        laying.inside();
        if !laying.patches(monitor)? {
            return Ok(None);
        }
        laying.old_quads();
        Ok(Some(laying.filled))
    }
}

impl Laying<'_> {
    /// Vertices along rails.
    fn along_rails(&mut self, room: f64) {
        let Parts { work, wanted, plain, .. } = self.parts;
        let (base, rails) = (work.base(), work.rails());
        let Plan { pieces, chain, counts, .. } = self.plan;
        let count_of: Vec<u32> = chain.iter().map(|c| c.iter().map(|&(p, _)| counts[p]).sum()).collect();
        let arcs = |e: u32| divide_evenly(base, &base.edges[e as usize].path, count_of[e as usize], wanted.size);
        let division = division::divide(base, rails, &arcs, &rails.means(base, plain));
        // Where bends take most of a rail's vertices they stay on them; elsewhere the quads slide to where they are square first.
        let mut is_tight = vec![false; base.edges.len()];
        for steps in &rails.steps {
            let edges = || steps.iter().map(|step| step.edge as usize);
            let needed: u32 = edges().flat_map(|e| &chain[e]).map(|&(p, _)| pieces[p].needed).sum();
            let all: u32 = edges().map(|e| count_of[e]).sum();
            edges().for_each(|e| is_tight[e] = f64::from(all) < room * f64::from(needed));
        }
        let mut of_base = vec![NONE; base.vertices.len()];
        for e in (0..base.edges.len()).filter(|e| !chain[*e].is_empty()) {
            let ends = base.edges[e].ends.map(|v| {
                if of_base[v as usize] == NONE {
                    let at = base.surface.positions[base.vertices[v as usize] as usize];
                    let stays = is_tight[e] && division.vertex_stays[v as usize];
                    of_base[v as usize] =
                        self.add(division.of_vertex[v as usize].unwrap_or(at), Place::Corner(v), stays);
                }
                of_base[v as usize]
            });
            let mut along = vec![ends[0]];
            for (i, &p) in division.of_edge[e].iter().enumerate() {
                let stays = is_tight[e] && division.edge_stays[e].get(i).copied().unwrap_or(false);
                along.push(self.add(p, Place::Edge(e as u32), stays));
            }
            along.push(ends[1]);
            let mut i = 0;
            for &(p, forward) in &chain[e] {
                let vertices = &pieces[p].vertices;
                let mut path = along[i..=i + counts[p] as usize].to_vec();
                i += counts[p] as usize;
                if !forward {
                    path.reverse();
                }
                if pieces[p].fixed.is_some() {
                    self.of_layout.extend(vertices.iter().copied().zip(path.iter().copied()));
                }
                self.of_layout.insert(vertices[0], path[0]);
                self.of_layout.insert(vertices[vertices.len() - 1], path[path.len() - 1]);
                self.paths[p] = path;
            }
            self.filled.along[e] = along;
        }
    }

    /// Vertices along traces, and along quads that stay.
    fn inside(&mut self) {
        let Traced { layout, sizes, .. } = self.traced;
        let Plan { pieces, counts, .. } = self.plan;
        let at = |v: u32| layout.mesh.positions[v as usize];
        for (p, piece) in pieces.iter().enumerate() {
            if !self.paths[p].is_empty() {
                continue;
            }
            if piece.fixed.is_some() {
                self.paths[p] = piece.vertices.iter().map(|&v| self.old(v)).collect();
                continue;
            }
            let [first, last] = [piece.vertices[0], piece.vertices[piece.vertices.len() - 1]].map(|v| {
                self.of_layout.get(&v).copied().unwrap_or_else(|| {
                    let new = self.add(at(v), Place::Patch(0), false);
                    self.of_layout.insert(v, new);
                    new
                })
            });
            let mut path = vec![first];
            let mut passed = 0.0;
            let step = piece.ideal / f64::from(counts[p]);
            for w in piece.vertices.windows(2) {
                let length = at(w[0]).distance(at(w[1])) / f64::midpoint(sizes[w[0] as usize], sizes[w[1] as usize]);
                while path.len() < counts[p] as usize && path.len() as f64 * step <= passed + length {
                    let t = (path.len() as f64 * step - passed) / length;
                    path.push(self.add(at(w[0]).lerp(at(w[1]), t), Place::Patch(0), false));
                }
                passed += length;
            }
            path.push(last);
            self.paths[p] = path;
        }
    }

    /// The quads of all patches; false where one cannot be laid.
    fn patches(&mut self, monitor: &Monitor) -> Result<bool, Cancelled> {
        let Traced { layout, sides, .. } = self.traced;
        let Plan { pieces, counts, topologies, .. } = self.plan;
        let borders: Vec<Vec<u32>> =
            (0..sides.len()).map(|patch| border(self.traced, pieces, &self.paths, patch)).collect();
        let inner = |(index, border): (usize, &Vec<u32>)| {
            let points: Vec<DVec3> = border.iter().map(|&v| self.filled.positions[v as usize]).collect();
            let counts: Vec<u32> =
                sides[index].iter().map(|side| side.iter().map(|&p| counts[p as usize]).sum()).collect();
            let disk = Disk::of(layout, index);
            let mut placed = place(&topologies[index], &counts, &points, &disk.surface(), None, monitor).ok()?;
            Some(placed.split_off(points.len()))
        };
        let inner: Vec<Option<Vec<DVec3>>> = borders.par_iter().enumerate().map(inner).collect();
        monitor.check()?;
        for (index, (mut names, inner)) in borders.into_iter().zip(inner).enumerate() {
            let Some(inner) = inner else { return Ok(false) };
            names.extend(inner.into_iter().map(|p| self.add(p, Place::Patch(0), false)));
            self.filled.quads.extend(topologies[index].quads.iter().map(|q| q.map(|v| names[v as usize])));
            self.filled.patch_of.resize(self.filled.quads.len(), layout.patches[index].part);
        }
        Ok(true)
    }

    /// The quads that stay.
    fn old_quads(&mut self) {
        let Parts { work, part_of, .. } = self.parts;
        let parts = self.parts.parts();
        for (q, quad) in work.filled.quads.iter().enumerate().filter(|(q, _)| part_of[*q] == NONE) {
            let quad = quad.map(|v| self.old(v));
            self.filled.quads.push(quad);
            self.filled.patch_of.push(parts + work.charts_of_quads()[q]);
        }
    }

    /// The vertex for an old one.
    fn old(&mut self, v: u32) -> u32 {
        if let Some(&known) = self.of_layout.get(&v) {
            return known;
        }
        let old = &self.parts.work.filled;
        let new = self.add(old.positions[v as usize], old.places[v as usize], false);
        self.of_layout.insert(v, new);
        new
    }

    fn add(&mut self, position: DVec3, place: Place, stays: bool) -> u32 {
        self.filled.positions.push(position);
        self.filled.places.push(place);
        self.filled.stays.push(stays);
        self.filled.positions.len() as u32 - 1
    }
}

/// The surface of a patch.
struct Disk {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    border: Vec<u32>,
    corners: Vec<usize>,
}

impl Disk {
    fn of(layout: &PatchLayout, index: usize) -> Self {
        let patch = &layout.patches[index];
        let corners_of = |&t: &u32| layout.mesh.triangles[t as usize];
        let mut names: Vec<u32> = patch.triangles.iter().flat_map(corners_of).collect();
        names.sort_unstable();
        names.dedup();
        let local = |v: u32| names.binary_search(&v).map_or(NONE, |i| i as u32);
        let (mut border, mut corners) = (vec![], vec![]);
        for side in 0..patch.sides.len() {
            corners.push(border.len());
            let path = layout.side_path(index, side);
            border.extend(path[..path.len() - 1].iter().map(|&v| local(v)));
        }
        let triangles = patch.triangles.iter().map(|t| corners_of(t).map(local)).collect();
        Self {
            positions: names.iter().map(|&v| layout.mesh.positions[v as usize]).collect(),
            triangles,
            border,
            corners,
        }
    }

    fn surface(&self) -> DiskSurface<'_> {
        let Self { positions, triangles, border, corners } = self;
        DiskSurface { positions, triangles, border, corners }
    }
}

/// Vertices of the quads round a patch, counter-clockwise from its first corner.
fn border(traced: &Traced, pieces: &[Piece], paths: &[Vec<u32>], patch: usize) -> Vec<u32> {
    let mut border = vec![];
    let mut from = traced.layout.patches[patch].corners[0];
    for &p in traced.sides[patch].iter().flatten() {
        let (vertices, path) = (&pieces[p as usize].vertices, &paths[p as usize]);
        if vertices[0] == from {
            border.extend(&path[..path.len() - 1]);
            from = vertices[vertices.len() - 1];
        } else {
            border.extend(path[1..].iter().rev());
            from = vertices[0];
        }
    }
    border
}
