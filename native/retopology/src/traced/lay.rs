//! The quads of a traced layout, put on the surface: `QuadMixer`, section 3.5.
//!
//! Vertices along features go where [`division`] puts them, those along traces lie evenly on them, and each patch is mapped
//! onto its piece of the quads that were there. Parts that are kept keep their quads and share the new vertices along features.

use super::Parts;
use super::plan::{Piece, Plan, Traced};
use crate::division;
use crate::fill::{Filled, Place, divide_evenly};
use mesh::{Cancelled, DVec3, Monitor, NONE};
use quadrangulate::{DiskSurface, place};
use rayon::prelude::*;
use std::collections::BTreeMap;

impl Parts<'_, '_> {
    /// The quads of a plan; the patch of each is its part. Rails with fewer edges than `room` times what their bends need have vertices
    /// on the bends that stay. `None` where a patch cannot be laid over its surface.
    pub fn lay(&self, traced: &Traced, plan: &Plan, room: f64, monitor: &Monitor) -> Result<Option<Filled>, Cancelled> {
        let Self { work, wanted, part_of, .. } = self;
        let (base, rails) = (work.base(), work.rails());
        let Traced { layout, sizes, sides, .. } = traced;
        let Plan { pieces, chain, counts, topologies } = plan;
        let mut filled = Filled { along: vec![vec![]; base.edges.len()], ..Filled::default() };
        let count_of: Vec<u32> = chain.iter().map(|c| c.iter().map(|&(p, _)| counts[p]).sum()).collect();
        let arcs = |e: u32| divide_evenly(base, &base.edges[e as usize].path, count_of[e as usize], wanted.size);
        let division = division::divide(base, rails, &arcs, &rails.means(base, self.plain));
        // Where bends take most of a rail's vertices they stay on them; elsewhere the quads slide to where they are square first.
        let mut is_tight = vec![false; base.edges.len()];
        for steps in &rails.steps {
            let edges = || steps.iter().map(|step| step.edge as usize);
            let needed: u32 = edges().flat_map(|e| &chain[e]).map(|&(p, _)| pieces[p].needed).sum();
            let all: u32 = edges().map(|e| count_of[e]).sum();
            edges().for_each(|e| is_tight[e] = f64::from(all) < room * f64::from(needed));
        }
        let mut of_base = vec![NONE; base.vertices.len()];
        let mut of_layout: BTreeMap<u32, u32> = BTreeMap::new();
        let mut paths: Vec<Vec<u32>> = vec![vec![]; pieces.len()];
        for e in 0..base.edges.len() {
            if chain[e].is_empty() {
                continue;
            }
            for v in base.edges[e].ends {
                if of_base[v as usize] == NONE {
                    of_base[v as usize] = filled.positions.len() as u32;
                    let at = base.surface.positions[base.vertices[v as usize] as usize];
                    filled.positions.push(division.of_vertex[v as usize].unwrap_or(at));
                    filled.stays.push(is_tight[e] && division.vertex_stays[v as usize]);
                    filled.places.push(Place::Corner(v));
                }
            }
            let mut along = vec![of_base[base.edges[e].ends[0] as usize]];
            for (i, &p) in division.of_edge[e].iter().enumerate() {
                along.push(filled.positions.len() as u32);
                filled.positions.push(p);
                filled.places.push(Place::Edge(e as u32));
                filled.stays.push(is_tight[e] && division.edge_stays[e].get(i).copied().unwrap_or(false));
            }
            along.push(of_base[base.edges[e].ends[1] as usize]);
            let mut i = 0;
            for &(p, forward) in &chain[e] {
                let vertices = &pieces[p].vertices;
                let mut path = along[i..=i + counts[p] as usize].to_vec();
                i += counts[p] as usize;
                if !forward {
                    path.reverse();
                }
                if pieces[p].fixed.is_some() {
                    of_layout.extend(vertices.iter().copied().zip(path.iter().copied()));
                }
                of_layout.insert(vertices[0], path[0]);
                of_layout.insert(vertices[vertices.len() - 1], path[path.len() - 1]);
                paths[p] = path;
            }
            filled.along[e] = along;
        }
        let add = |filled: &mut Filled, p: DVec3| {
            filled.positions.push(p);
            filled.places.push(Place::Patch(0));
            filled.stays.push(false);
            filled.positions.len() as u32 - 1
        };
        let at = |v: u32| layout.mesh.positions[v as usize];
        let stays = |filled: &mut Filled, of_layout: &mut BTreeMap<u32, u32>, v: u32| {
            *of_layout.entry(v).or_insert_with(|| {
                let new = add(filled, work.filled.positions[v as usize]);
                filled.places[new as usize] = work.filled.places[v as usize];
                new
            })
        };
        for (p, piece) in pieces.iter().enumerate() {
            if !paths[p].is_empty() {
                continue;
            }
            if piece.fixed.is_some() {
                // Along quads that stay.
                paths[p] = piece.vertices.iter().map(|&v| stays(&mut filled, &mut of_layout, v)).collect();
                continue;
            }
            let n = piece.vertices.len();
            let [first, last] = [piece.vertices[0], piece.vertices[n - 1]]
                .map(|v| *of_layout.entry(v).or_insert_with(|| add(&mut filled, at(v))));
            let mut path = vec![first];
            let mut passed = 0.0;
            let step = piece.ideal / f64::from(counts[p]);
            for w in piece.vertices.windows(2) {
                let length = at(w[0]).distance(at(w[1])) / f64::midpoint(sizes[w[0] as usize], sizes[w[1] as usize]);
                while path.len() < counts[p] as usize && path.len() as f64 * step <= passed + length {
                    let t = (path.len() as f64 * step - passed) / length;
                    path.push(add(&mut filled, at(w[0]).lerp(at(w[1]), t)));
                }
                passed += length;
            }
            path.push(last);
            paths[p] = path;
        }
        let inner: Vec<Option<Vec<DVec3>>> = topologies
            .par_iter()
            .enumerate()
            .map(|(index, topology)| {
                let patch = &layout.patches[index];
                let border = border(traced, pieces, &paths, index);
                let points: Vec<DVec3> = border.iter().map(|&v| filled.positions[v as usize]).collect();
                let counts: Vec<u32> =
                    sides[index].iter().map(|side| side.iter().map(|&p| counts[p as usize]).sum()).collect();
                let mut names: Vec<u32> =
                    patch.triangles.iter().flat_map(|&t| layout.mesh.triangles[t as usize]).collect();
                names.sort_unstable();
                names.dedup();
                let local = |v: u32| names.binary_search(&v).map_or(NONE, |i| i as u32);
                let (mut rim, mut corners) = (vec![], vec![]);
                for side in 0..patch.sides.len() {
                    corners.push(rim.len());
                    let path = layout.side_path(index, side);
                    rim.extend(path[..path.len() - 1].iter().map(|&v| local(v)));
                }
                let surface = DiskSurface {
                    positions: &names.iter().map(|&v| at(v)).collect::<Vec<_>>(),
                    triangles: &patch
                        .triangles
                        .iter()
                        .map(|&t| layout.mesh.triangles[t as usize].map(local))
                        .collect::<Vec<_>>(),
                    border: &rim,
                    corners: &corners,
                };
                let mut placed = place(topology, &counts, &points, &surface, None, monitor).ok()?;
                Some(placed.split_off(points.len()))
            })
            .collect();
        monitor.check()?;
        for (index, (inner, topology)) in inner.into_iter().zip(topologies).enumerate() {
            let Some(inner) = inner else { return Ok(None) };
            let mut names = border(traced, pieces, &paths, index);
            names.extend(inner.into_iter().map(|p| add(&mut filled, p)));
            filled.quads.extend(topology.quads.iter().map(|q| q.map(|v| names[v as usize])));
            filled.patch_of.resize(filled.quads.len(), layout.patches[index].part);
        }
        let parts = self.parts();
        for (q, quad) in work.filled.quads.iter().enumerate().filter(|(q, _)| part_of[*q] == NONE) {
            let quad = quad.map(|v| stays(&mut filled, &mut of_layout, v));
            filled.quads.push(quad);
            filled.patch_of.push(parts + work.charts_of_quads()[q]);
        }
        Ok(Some(filled))
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
