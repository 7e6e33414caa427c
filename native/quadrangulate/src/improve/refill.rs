//! Fewer irregular vertices by filling whole pieces of the mesh anew.
//!
//! Local operators cancel irregular vertices that are a few quads apart; those further off stay. Here a disk of quads is
//! grown round an irregular vertex, never across a feature, until its border is straight but for convex corners. Where a
//! pattern with those sides has fewer irregular vertices than the disk and its border have, and the surface bears it, the
//! pattern takes the quads' place. The idea is that of Bunin, "Non-local topological cleanup", 2006, and of Verma and
//! Suresh, "A robust combinatorial approach to reduce singularities in quadrilateral meshes", 2017; the patterns are
//! those of the fillers.

use super::editable::Editable;
use super::grow::{Disk, Rim};
use super::search::{FIRST_STEP, Search};
use crate::fill::pattern_patches;
use crate::flatten::{harmonic, uniform_weights};
use crate::{DiskSurface, PatchTopology, PlaceError, place};
use glam::DVec2;
use mesh::{Cancelled, DVec3, Monitor, NONE, split_quad};
use std::collections::{BTreeMap, BTreeSet};
use surface::closest::ClosestPoint;

/// Passes over the irregular vertices at most.
const PASSES: usize = 4;
/// The number of quads changes by no more than this fraction.
const MOST_DRIFT: f64 = 0.015;
/// Ways in which disks grow towards other irregular vertices: in the second the nearest is passed over, and so on. One more
/// way is to grow evenly.
const WAYS: usize = 3;
/// Steps by which a disk grows one way at most. Most disks that are any good come sooner; where hundreds of irregular vertices
/// lie close together each step takes in one more.
const STEPS: usize = 40;
/// Patterns tried on the surface for one disk.
const PATTERNS_TRIED: usize = 2;
/// What one irregular vertex less is worth in the cost of [`Search::judge_quads`].
const WORTH: f64 = 4.0;
/// The worst quad a pattern may bring, unless there was a worse one.
const FLOOR: f64 = 0.2;
/// The largest quad a pattern may bring, in areas wanted there, unless there was a larger one: few strips over a tip would
/// cut it off.
const LARGEST: f64 = 3.0;
/// How far a pattern's quads may be from any of the vertices that they replace, in edge lengths wanted there.
const MOST_LOST: f64 = 1.0;
/// Sweeps that smooth a pattern.
const SWEEPS: usize = 4;

/// Where to try again is not worth it: the clock when a vertex was tried last, and the vertices that its disks came to.
type Tried = BTreeMap<u32, (u32, Vec<u32>)>;

/// Where the vertices of a pattern go, and the edge lengths wanted there.
type Laid = (Vec<DVec3>, Vec<f64>);

/// What a refilling search needs beside [`Search`].
pub(super) struct Refill<'s, 'a> {
    pub search: &'s mut Search<'a>,
    /// Quads that may not be replaced.
    pub stays: &'s [bool],
    /// The quad beyond each edge of each quad, or [`NONE`], and whether the edge is a feature.
    pub across: Vec<[(u32, bool); 4]>,
    /// Quads missing at each corner of each quad: those that its vertex should have, in its sector, less those that it has.
    pub missing: Vec<[i32; 4]>,
    pub disk: Disk,
    /// Most quads in a disk.
    pub most: usize,
    /// Quads of disks that patterns were tried in, and what these might cost: disks round several vertices grow into the same.
    tried_disks: BTreeSet<(Vec<u32>, u32)>,
    /// Quads now more than at the start, and the most there may be.
    drift: i64,
    most_drift: i64,
}

impl<'s, 'a> Refill<'s, 'a> {
    pub fn new(search: &'s mut Search<'a>, stays: &'s [bool], most: usize) -> Self {
        let quads = search.mesh.quads.len();
        let most_drift = (quads as f64 * MOST_DRIFT) as i64;
        let mut refill = Self {
            search,
            stays,
            across: vec![],
            missing: vec![],
            disk: Disk::default(),
            most,
            tried_disks: BTreeSet::new(),
            drift: 0,
            most_drift,
        };
        (0..quads as u32).for_each(|q| refill.link(q));
        refill
    }

    /// Disk by disk, from every irregular vertex, until none helps.
    pub fn run(&mut self, monitor: &Monitor) -> Result<(), Cancelled> {
        let mut tried = Tried::new();
        for _ in 0..PASSES {
            let mut progress = false;
            for v in self.irregular() {
                let in_vain = tried
                    .get(&v)
                    .is_some_and(|(clock, seen)| seen.iter().all(|&w| self.search.changed[w as usize] <= *clock));
                if self.search.cost[v as usize] != 0 && !in_vain {
                    let clock = self.search.clock;
                    let mut seen = Vec::new();
                    progress |= self.at(v, &mut seen, monitor)?;
                    tried.insert(v, (clock, seen));
                }
            }
            if !progress {
                break;
            }
        }
        Ok(())
    }

    /// Irregular vertices by place, so that an edit elsewhere that numbers vertices anew changes nothing here.
    fn irregular(&self) -> Vec<u32> {
        let (mesh, cost) = (&self.search.mesh, &self.search.cost);
        let mut irregular: Vec<u32> = (0..cost.len() as u32).filter(|&v| cost[v as usize] != 0).collect();
        let place = |v: u32| mesh.positions[v as usize].to_array();
        let by_place = |a: [f64; 3], b: [f64; 3]| a.iter().zip(&b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
        irregular.sort_by(|&a, &b| by_place(place(a), place(b)).unwrap_or(a.cmp(&b)));
        irregular
    }

    /// Looks up what lies beside a quad.
    fn link(&mut self, q: u32) {
        let mesh = &self.search.mesh;
        if self.across.len() <= q as usize {
            self.across.resize(q as usize + 1, [(NONE, false); 4]);
            self.missing.resize(q as usize + 1, [0; 4]);
        }
        if let Some(quad) = mesh.quads[q as usize] {
            self.across[q as usize] = [0, 1, 2, 3].map(|k| {
                let (a, b) = (quad[k], quad[(k + 1) & 3]);
                (mesh.directed(b, a).map_or(NONE, |(other, _)| other), mesh.is_feature(a, b))
            });
            self.missing[q as usize] = quad.map(|v| mesh.missing(q, v));
        }
    }

    /// Grows disks round a vertex until a pattern takes the place of one. Returns whether one did; `seen` are the vertices of the
    /// disks where none did.
    fn at(&mut self, v: u32, seen: &mut Vec<u32>, monitor: &Monitor) -> Result<bool, Cancelled> {
        for way in 0..=WAYS {
            monitor.check()?;
            let mesh = &self.search.mesh;
            let Some(&seed) = mesh.around[v as usize].first() else { break };
            self.disk.clear(mesh.surface_of[seed as usize], mesh.quads.len(), mesh.positions.len());
            self.surround(v);
            let mut passed_over = way;
            for _ in 0..STEPS {
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

    /// Puts the first pattern with the rim's sides in place that makes the mesh better.
    fn try_patterns(&mut self, rim: &Rim, monitor: &Monitor) -> Result<bool, Cancelled> {
        let limit = u32::try_from(self.disk.cost - rim.cost).unwrap_or(0);
        let patterns = pattern_patches(&rim.sides, limit, self.disk.quads.len());
        if patterns.is_empty() {
            return Ok(false);
        }
        let mut disk = self.disk.quads.clone();
        disk.sort_unstable();
        if !self.tried_disks.insert((disk, limit)) {
            return Ok(false);
        }
        for pattern in patterns.iter().take(PATTERNS_TRIED) {
            if self.try_pattern(rim, pattern, monitor)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn try_pattern(&mut self, rim: &Rim, pattern: &PatchTopology, monitor: &Monitor) -> Result<bool, Cancelled> {
        let drift = self.drift + pattern.quads.len() as i64 - self.disk.quads.len() as i64;
        if drift.abs() > self.drift.abs().max(self.most_drift) {
            return Ok(false);
        }
        let Some((places, sizes)) = self.places(rim, pattern, monitor)? else { return Ok(false) };
        let (search, disk) = (&mut *self.search, &self.disk);
        let (badness_before, worst_before) = search.judge_quads(&disk.quads);
        let largest_before = search.largest(&disk.quads);
        let mark = search.mesh.mark();
        disk.quads.iter().for_each(|&q| search.mesh.remove(q));
        let surface = search.surfaces[disk.surface as usize];
        let border = rim.vertices.len();
        let mut vertices = rim.vertices.clone();
        for (&place, &size) in places.iter().zip(&sizes).skip(border) {
            vertices.push(search.mesh.add_vertex(surface.project(place).point, size));
        }
        let first_quad = search.mesh.quads.len() as u32;
        for quad in &pattern.quads {
            search.mesh.add(quad.map(|v| vertices[v as usize]), disk.surface);
        }
        let gain = disk.cost - vertices.iter().map(|&v| search.mesh.vertex_cost(v)).sum::<i32>();
        let mut is_better = gain > 0 && search.mesh.is_proper_since(mark);
        let new_quads: Vec<u32> = (first_quad..search.mesh.quads.len() as u32).collect();
        if is_better {
            search.trials += 1;
            search.extend_normals();
            let new = &vertices[border..];
            search.relax(new, &mut vec![FIRST_STEP; new.len()], 0..SWEEPS);
            let (badness, worst) = search.judge_quads(&new_quads);
            is_better = worst >= worst_before.min(FLOOR)
                && badness - badness_before < WORTH * f64::from(gain)
                && search.largest(&new_quads) <= largest_before.max(LARGEST)
                && !loses(&search.mesh, &disk.vertices, &new_quads);
        }
        if !is_better {
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
        let around = |&v: &u32| self.search.mesh.around[v as usize].iter().copied();
        let mut beside: Vec<u32> = rim.vertices.iter().flat_map(around).chain(new_quads).collect();
        beside.sort_unstable();
        beside.dedup();
        for q in beside {
            self.link(q);
        }
        Ok(true)
    }

    /// Lays a pattern over the disk's quads; `None` when they cannot be mapped.
    fn places(&self, rim: &Rim, pattern: &PatchTopology, monitor: &Monitor) -> Result<Option<Laid>, Cancelled> {
        let (mesh, disk) = (&self.search.mesh, &self.disk);
        let mut inner: Vec<u32> = disk.vertices.iter().copied().filter(|v| !rim.vertices.contains(v)).collect();
        inner.sort_unstable();
        let vertices = [&rim.vertices[..], &inner[..]].concat();
        let own: BTreeMap<u32, u32> = vertices.iter().copied().zip(0..).collect();
        let positions: Vec<DVec3> = vertices.iter().map(|&v| mesh.positions[v as usize]).collect();
        let halves = |quad: [u32; 4]| {
            let split = split_quad(quad.map(|v| mesh.positions[v as usize]));
            split.map(|half| half.map(|k| own[&quad[k]]))
        };
        let triangles: Vec<[u32; 3]> =
            disk.quads.iter().filter_map(|&q| mesh.quads[q as usize]).flat_map(halves).collect();
        let mut corners = vec![0];
        corners.extend(rim.sides.iter().scan(0, |at, &side| {
            *at += side as usize;
            Some(*at)
        }));
        corners.pop();
        let old =
            DiskSurface { positions: &positions, triangles: &triangles, border: &pattern.border, corners: &corners };
        let border = &positions[..rim.vertices.len()];
        let places = match place(pattern, &rim.sides, border, &old, None, monitor) {
            Ok(places) => places,
            Err(PlaceError::Cancelled(cancelled)) => return Err(cancelled),
            Err(_) => return Ok(None),
        };
        let size = |k: usize| rim.vertices.get(k).map(|&v| DVec2::splat(mesh.size[v as usize]));
        let known: Vec<Option<DVec2>> = (0..pattern.vertex_count).map(size).collect();
        let sizes = harmonic(&uniform_weights(&pattern.quads), &known, monitor)?;
        Ok(Some((places, sizes.into_iter().map(|size| size.x).collect())))
    }
}

/// Whether a tip that vertices were on, a tail thinner than the quads say, is far from all quads that take their place.
fn loses(mesh: &Editable, before: &[u32], quads: &[u32]) -> bool {
    let corners = || quads.iter().filter_map(|&q| mesh.quads[q as usize]);
    let is_far = |v: &&u32| {
        let (at, reach) = (mesh.positions[**v as usize], MOST_LOST * mesh.size[**v as usize]);
        corners().flatten().all(|w| at.distance_squared(mesh.positions[w as usize]) > reach * reach)
    };
    let far: Vec<u32> = before.iter().filter(is_far).copied().collect();
    if far.is_empty() {
        return false;
    }
    let closest = ClosestPoint::of_quads(&mesh.positions, corners());
    far.iter().any(|&v| closest.project(mesh.positions[v as usize]).distance > MOST_LOST * mesh.size[v as usize])
}
