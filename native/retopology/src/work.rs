//! The quads in the making: section 6, from the maps' places to the last resort.
//!
//! What may move is taken out as a part, so that after an edit only that is worked on.

mod repair;

use crate::base::Base;
use crate::density::{Contrast, Counts};
use crate::division;
use crate::error::LayoutError;
use crate::fill::{Filled, Place};
use crate::keep::Kept;
use crate::mend;
use crate::optimise::{self, Shape};
use crate::patch::Patch;
use crate::quads::SourcePoint;
use crate::rails::Rails;
use crate::reach;
use crate::surfaces::{Chart, Ground};
use mesh::{DVec3, Monitor, NONE};
use quadrangulate::PatchTopology;
use quadrangulate::improve::{NEAREST, QuadPatch, Setting, refill};
use rayon::prelude::*;
use surface::smooth::{Constraint, SmoothOptions};
use surface::smooth_star::Reference;

/// Times that points which stick out are looked for.
const REACHING_ROUNDS: usize = 2;
/// Rounds of the pull between two looks at what it slipped off.
const STEP: usize = 10;
/// One point in so many edge lengths is held: quads between two that are closer are bent out of shape.
const APART: f64 = 2.0;
/// Sweeps of the barrier energy before the pull, which keeps quads valid that are: over all, and over the vertices of bad quads.
const UNTANGLING_SWEEPS: usize = 3;
const UNTANGLING_WORST: usize = 6;
/// Times that the barrier energy has the last word: with 4 the mean angle deviation is 0.2 to 0.7 degrees less than with 1, with 8
/// another 0.2 at most.
pub(crate) const TIMES: usize = 4;
/// The same after an edit, which is to be quick.
pub(crate) const TIMES_AFTER_EDIT: usize = 1;
/// They are left again where that takes quads of less than this quality.
const WORST_REACHED: f64 = 0.15;
/// Traced quads keep the corners that they were given at features, up to a right angle off: with [`NEAREST`] a fish and a goat's head got a
/// tenth more irregular vertices when they were refilled.
const TRACED_SLACK: f64 = 1.0;
/// Most quads that are replaced together to take out irregular vertices.
const LARGEST: usize = 800;
/// Vertices of a rail that are put back by less, in edge lengths, leave all others where they are.
const MOVED: f64 = 0.02;
/// Vertices further from such a point than this, in edge lengths, are left alone.
const MOST_REACH: f64 = 2.5;

fn constraint(place: Place, rails: &Rails) -> Constraint {
    match place {
        Place::Corner(v) if rails.corner[v as usize] => Constraint::Fixed,
        Place::Corner(v) => rails.of_vertex[v as usize].map_or(Constraint::Free, Constraint::OnChain),
        Place::Edge(e) => rails.of_edge[e as usize].map_or(Constraint::Free, Constraint::OnChain),
        Place::Patch(_) => Constraint::Free,
    }
}

fn constraints(filled: &Filled, rails: &Rails) -> Vec<Constraint> {
    let of = |(&place, &stays): (&Place, &bool)| if stays { Constraint::Fixed } else { constraint(place, rails) };
    filled.places.iter().zip(&filled.stays).map(of).collect()
}

fn surfaces(charts: &[Chart]) -> Vec<&dyn Reference> {
    charts.iter().map(|chart| chart as &dyn Reference).collect()
}

/// The quads in the making.
#[derive(Clone)]
pub(crate) struct Work<'a> {
    base: &'a Base,
    charts: &'a [Chart],
    rails: &'a Rails,
    chart_of_quad: Vec<u32>,
    constraints: Vec<Constraint>,
    /// See [`Setting::slack`].
    slack: f64,
    pub filled: Filled,
}

/// What vertices are moved for.
pub(crate) struct Wanted<'a> {
    /// Relative edge length at each vertex of the surface, and what it is relative to.
    pub size: &'a [f64],
    pub edge_length: f64,
    /// Edge length wanted along each rail, scene units.
    pub rail_edge: &'a [f64],
    /// How far edges may leave the surface.
    pub error: f64,
    /// Chart of each base triangle, and whether its quads are new.
    pub chart_of: &'a [u32],
    pub are_new: &'a [bool],
    /// Rounds of the rectangles' pull.
    pub rounds: usize,
}

impl<'a> Work<'a> {
    /// Filled patches, before any vertex is moved.
    pub fn new(ground: &'a Ground<'a>, rails: &'a Rails, patches: &[Patch], filled: Filled) -> Self {
        let Ground { base, charts, chart_of, .. } = ground;
        let chart_of_quad =
            filled.patch_of.iter().map(|&p| chart_of[patches[p as usize].triangles[0] as usize]).collect();
        let constraints = constraints(&filled, rails);
        Self { base, charts, rails, chart_of_quad, constraints, slack: NEAREST, filled }
    }

    /// Section 6 for the vertices that may move: they are pulled into shape, and to what sticks out of the quads. It ends
    /// with the barrier energy some `times`; with none, only what the next step needs is done.
    pub fn relax(
        &mut self,
        movable: &[bool],
        wanted: &Wanted<'_>,
        smooth: &SmoothOptions,
        times: usize,
        monitor: &Monitor,
    ) -> Result<(), LayoutError> {
        let last = times > 0;
        let (mut part, names) = self.part(movable);
        let lengths = part.lengths(wanted);
        let untangle = SmoothOptions { sweeps: UNTANGLING_SWEEPS, worst_sweeps: UNTANGLING_WORST, ..*smooth };
        // The maps reach every tip, but the pull may slip off it row by row: what was nearest to the tip at the start is held there then.
        let start = part.filled.positions.clone();
        let mut reached = Vec::new();
        if wanted.rounds > 0 {
            part.smooth(1, &untangle, monitor)?;
        }
        for step in 0..wanted.rounds.div_ceil(STEP) {
            part.pull(&lengths, STEP.min(wanted.rounds - step * STEP), monitor)?;
            let held = part.hold(&part.missed(wanted, monitor)?, &start, wanted);
            if !held.is_empty() {
                part.smooth(1, &untangle, monitor)?;
                reached.extend(held);
            }
        }
        let mut held = Vec::new();
        if wanted.rounds > 0 {
            self.take_back(&part, &names, movable);
            let moved;
            (held, moved) = self.settle(wanted.rail_edge, movable);
            held = held.into_iter().filter_map(|v| names.binary_search(&(v as u32)).ok()).collect();
            part = self.part(movable).0;
            if moved {
                part.smooth(1, &untangle, monitor)?;
                part.pull(&lengths, STEP, monitor)?;
            }
        }
        held.extend(reached);
        part.smooth(1, smooth, monitor)?;
        for round in 0..=REACHING_ROUNDS {
            if part.release(&held) > 0 {
                part.smooth(1, smooth, monitor)?;
            }
            if round == REACHING_ROUNDS || !last {
                break;
            }
            held = part.hold(&part.missed(wanted, monitor)?, &part.filled.positions.clone(), wanted);
            if held.is_empty() {
                break;
            }
            part.smooth(1, &untangle, monitor)?;
            part.pull(&lengths, STEP.min(wanted.rounds), monitor)?;
            part.smooth(1, smooth, monitor)?;
        }
        if last && wanted.rounds > 0 {
            part.smooth(times, smooth, monitor)?;
        }
        self.take_back(&part, &names, movable);
        Ok(())
    }

    /// Vertices of a part, where they are now. Those that may not move are where they were, but held: they keep their constraint.
    fn take_back(&mut self, part: &Self, names: &[u32], movable: &[bool]) {
        for (own, &whole) in names.iter().enumerate().filter(|(_, v)| movable[**v as usize]) {
            self.filled.positions[whole as usize] = part.filled.positions[own];
            self.constraints[whole as usize] = part.constraints[own];
        }
    }

    /// The quads around vertices that may move, by themselves, and the names of their vertices.
    fn part(&self, movable: &[bool]) -> (Work<'a>, Vec<u32>) {
        let all = &self.filled;
        let concerned = |q: &usize| all.quads[*q].iter().any(|&v| movable[v as usize]);
        let quads: Vec<usize> = (0..all.quads.len()).filter(concerned).collect();
        let mut names: Vec<u32> = quads.iter().flat_map(|&q| all.quads[q]).collect();
        names.sort_unstable();
        names.dedup();
        let own = |v: u32| names.binary_search(&v).map_or(NONE, |own| own as u32);
        let constraint = |&v: &u32| if movable[v as usize] { self.constraints[v as usize] } else { Constraint::Fixed };
        let part = Work {
            chart_of_quad: quads.iter().map(|&q| self.chart_of_quad[q]).collect(),
            constraints: names.iter().map(constraint).collect(),
            filled: Filled {
                positions: names.iter().map(|&v| all.positions[v as usize]).collect(),
                quads: quads.iter().map(|&q| all.quads[q].map(own)).collect(),
                places: names.iter().map(|&v| all.places[v as usize]).collect(),
                ..Filled::default()
            },
            ..*self
        };
        (part, names)
    }

    /// What the next edit of the base can keep.
    pub fn kept(
        &self,
        names: &[u64],
        topologies: &[PatchTopology],
        patches: &[Patch],
        counts: &Counts,
        contrast: Contrast,
    ) -> Kept {
        let mut filled = self.filled.clone();
        for (v, &place) in filled.places.iter().enumerate() {
            // Vertices at points that stuck out.
            let held = self.constraints[v] == Constraint::Fixed && constraint(place, self.rails) != Constraint::Fixed;
            filled.stays[v] |= held;
        }
        Kept {
            names: names.to_vec(),
            triangles: self.base.triangles.clone(),
            triangle_edges: self.base.triangle_edges.clone(),
            patches: patches.to_vec(),
            topologies: topologies.to_vec(),
            counts: counts.of_edge.clone(),
            edge_length: counts.edge_length,
            contrast,
            filled,
        }
    }

    fn shape<'b>(&'b self, lengths: &'b [f64]) -> Shape<'b> {
        Shape {
            quads: &self.filled.quads,
            chart_of: &self.chart_of_quad,
            constraints: &self.constraints,
            lines: &self.rails.lines,
            charts: self.charts,
            lengths,
        }
    }

    fn pull(&mut self, lengths: &[f64], rounds: usize, monitor: &Monitor) -> Result<(), LayoutError> {
        let mut positions = std::mem::take(&mut self.filled.positions);
        let done = optimise::pull(&self.shape(lengths), &mut positions, rounds, monitor);
        self.filled.positions = positions;
        done
    }

    /// See [`optimise::smooth`].
    fn smooth(&mut self, times: usize, options: &SmoothOptions, monitor: &Monitor) -> Result<(), LayoutError> {
        let mut positions = std::mem::take(&mut self.filled.positions);
        let done = optimise::smooth(&self.shape(&[]), &mut positions, times, options, monitor);
        self.filled.positions = positions;
        done
    }

    /// Moves the vertices of bent rails that may move to where the edges between them follow the rails again, and fixes them there: the
    /// pull spread them with no eye for bends. Returns those that were free to slide, and whether any vertex is elsewhere now.
    fn settle(&mut self, edge_lengths: &[f64], movable: &[bool]) -> (Vec<usize>, bool) {
        let (mut held, mut moved) = (Vec::new(), false);
        for ((steps, points), &edge_length) in self.rails.steps.iter().zip(&self.rails.points).zip(edge_lengths) {
            let mut along: Vec<u32> = Vec::new();
            for step in steps {
                let mut own = self.filled.along[step.edge as usize].clone();
                if !step.forward {
                    own.reverse();
                }
                along.extend(&own[usize::from(!along.is_empty())..]);
            }
            let places: Vec<DVec3> = along.iter().map(|&v| self.filled.positions[v as usize]).collect();
            let stays = |&v: &u32| !movable[v as usize] || self.constraints[v as usize] == Constraint::Fixed;
            let stays: Vec<bool> = along.iter().map(stays).collect();
            if stays.iter().all(|stays| *stays) {
                continue;
            }
            let Some((places, bent)) = division::settled(points, &places, &stays, edge_length) else { continue };
            for ((&v, place), bent) in along.iter().zip(places).zip(bent) {
                let v = v as usize;
                moved |= self.filled.positions[v].distance(place) > MOVED * edge_length;
                self.filled.positions[v] = place;
                if bent && self.constraints[v] != Constraint::Fixed {
                    self.constraints[v] = Constraint::Fixed;
                    held.push(v);
                }
            }
        }
        (held, moved)
    }

    /// Points of the surface that stick out of the quads: see [`reach::missed`].
    fn missed(&self, wanted: &Wanted<'_>, monitor: &Monitor) -> Result<Vec<(DVec3, u32)>, LayoutError> {
        let &Wanted { are_new, error, edge_length: spacing, .. } = wanted;
        let on_rail = |e: usize| self.rails.of_edge[e].is_some();
        let Filled { positions, quads, .. } = &self.filled;
        Ok(reach::missed(self.base, are_new, &on_rail, positions, quads, [error, APART * spacing], monitor)?)
    }

    /// Moves the free vertices that were nearest to points of the surface, from the `places` they had, there, and fixes them. Returns
    /// them.
    fn hold(&mut self, points: &[(DVec3, u32)], places: &[DVec3], wanted: &Wanted<'_>) -> Vec<usize> {
        let mut chart = vec![NONE; self.filled.positions.len()];
        for (quad, &c) in self.filled.quads.iter().zip(&self.chart_of_quad) {
            for &v in quad {
                chart[v as usize] = c;
            }
        }
        let mut moved = Vec::new();
        for &(point, triangle) in points {
            let own = wanted.chart_of[self.base.owner[triangle as usize] as usize];
            let free = (0..chart.len()).filter(|&v| chart[v] == own && self.constraints[v] == Constraint::Free);
            let far = |v: usize| places[v].distance(point);
            let nearest = free.min_by(|&a, &b| far(a).total_cmp(&far(b)));
            if let Some(nearest) = nearest.filter(|&v| far(v) < MOST_REACH * wanted.edge_length) {
                self.filled.positions[nearest] = point;
                self.constraints[nearest] = Constraint::Fixed;
                moved.push(nearest);
            }
        }
        moved
    }

    /// Vertices that are held although their place on the base lets them slide or move.
    fn pinned(&self) -> Vec<usize> {
        let moves = |v: usize| constraint(self.filled.places[v], self.rails) != Constraint::Fixed;
        (0..self.constraints.len()).filter(|&v| self.constraints[v] == Constraint::Fixed && moves(v)).collect()
    }

    /// Lets go of vertices around which quads are bad. Returns how many.
    fn release(&mut self, fixed: &[usize]) -> usize {
        let surfaces = surfaces(self.charts);
        let mut asked = vec![false; self.filled.positions.len()];
        for &v in fixed {
            asked[v] = true;
        }
        let mut bad = vec![false; self.filled.positions.len()];
        for (quad, &c) in self.filled.quads.iter().zip(&self.chart_of_quad) {
            if quad.iter().all(|&v| !asked[v as usize]) {
                continue;
            }
            if mend::quality(quad.map(|v| self.filled.positions[v as usize]), surfaces[c as usize]) < WORST_REACHED {
                for &v in quad {
                    bad[v as usize] = true;
                }
            }
        }
        let released = fixed.iter().filter(|&&v| bad[v]);
        released.map(|&v| self.constraints[v] = constraint(self.filled.places[v], self.rails)).count()
    }

    /// Takes irregular vertices out, with features, borders and the quads that stay kept. New vertices want to be relaxed.
    pub fn refill(&mut self, stays: &[bool], monitor: &Monitor) -> Result<(), LayoutError> {
        let (features, surfaces) = (self.features(), surfaces(self.charts));
        let start = self.take();
        let outside = vec![0; start.positions.len()];
        let setting = Setting {
            features: &features,
            outside: &outside,
            chains: &self.rails.lines,
            surfaces: &surfaces,
            slack: self.slack,
        };
        let better = refill(start, &setting, stays, LARGEST, monitor)?;
        self.put(better.patch, &better.source, outside.len());
        Ok(())
    }

    pub(crate) fn base(&self) -> &'a Base {
        self.base
    }

    pub(crate) fn rails(&self) -> &'a Rails {
        self.rails
    }

    pub(crate) fn charts_of_quads(&self) -> &[u32] {
        &self.chart_of_quad
    }

    /// Lets go of all vertices but those that features hold.
    pub(crate) fn let_go(&mut self) {
        self.constraints = constraints(&self.filled, self.rails);
    }

    /// Other quads in their place; `chart_of` tells the chart of each of their patches.
    pub(crate) fn with(&self, filled: Filled, chart_of: &[u32]) -> Self {
        let chart_of_quad = filled.patch_of.iter().map(|&p| chart_of[p as usize]).collect();
        let constraints = constraints(&filled, self.rails);
        Self { chart_of_quad, constraints, slack: TRACED_SLACK, filled, ..*self }
    }

    /// Edges on rails.
    pub(crate) fn features(&self) -> Vec<[u32; 2]> {
        (0..self.filled.along.len())
            .filter(|&e| self.rails.of_edge[e].is_some())
            .flat_map(|e| self.filled.along[e].windows(2).map(|w| [w[0], w[1]]))
            .collect()
    }

    /// The quads, moved out.
    fn take(&mut self) -> QuadPatch {
        QuadPatch {
            quads: std::mem::take(&mut self.filled.quads),
            surface_of: std::mem::take(&mut self.chart_of_quad),
            positions: std::mem::take(&mut self.filled.positions),
            constraints: std::mem::take(&mut self.constraints),
        }
    }

    /// Changed quads, back in; `source` has the vertices' old indices, of `before`.
    fn put(&mut self, patch: QuadPatch, source: &[u32], before: usize) {
        let mut new_index = vec![NONE; before];
        for (new, &old) in source.iter().enumerate().filter(|(_, old)| **old != NONE) {
            new_index[old as usize] = new as u32;
        }
        let places = &self.filled.places;
        self.filled.places =
            source.iter().map(|&old| places.get(old as usize).copied().unwrap_or(Place::Patch(0))).collect();
        let stays = &self.filled.stays;
        self.filled.stays = source.iter().map(|&old| stays.get(old as usize).copied().unwrap_or(false)).collect();
        for (e, along) in self.filled.along.iter_mut().enumerate() {
            // Only rails are sure to be edges still.
            if self.rails.of_edge[e].is_none() {
                along.clear();
            }
            for v in along {
                *v = new_index[*v as usize];
            }
        }
        self.filled.quads = patch.quads;
        self.filled.positions = patch.positions;
        self.constraints = patch.constraints;
        self.chart_of_quad = patch.surface_of;
    }

    /// The wanted edge length at each vertex, from the relative ones at the vertices of the surface.
    pub fn lengths(&self, wanted: &Wanted<'_>) -> Vec<f64> {
        let corners = &self.base.surface.triangles;
        let at = |found: SourcePoint| {
            let weights = corners[found.surface_triangle as usize].iter().zip(found.barycentric);
            weights.map(|(&v, weight)| wanted.size[v as usize] * weight).sum::<f64>() * wanted.edge_length
        };
        self.sources().into_iter().map(at).collect()
    }

    /// Number of squares of the wanted edge lengths that cover the quads.
    pub fn wanted_quads(&self, wanted: &Wanted<'_>) -> f64 {
        let lengths = self.lengths(wanted);
        let squares = |quad: &[u32; 4]| {
            let p = quad.map(|v| self.filled.positions[v as usize]);
            let length = quad.iter().map(|&v| lengths[v as usize]).sum::<f64>() / 4.0;
            (p[2] - p[0]).cross(p[3] - p[1]).length() / 2.0 / (length * length)
        };
        self.filled.quads.iter().map(squares).sum()
    }

    /// Where each vertex lies on the surface, on the chart of a quad around it.
    pub fn sources(&self) -> Vec<SourcePoint> {
        let mut chart = vec![0; self.filled.positions.len()];
        for (quad, &c) in self.filled.quads.iter().zip(&self.chart_of_quad) {
            for &v in quad {
                chart[v as usize] = c;
            }
        }
        let find = |(&p, &c): (&DVec3, &u32)| {
            let found = self.charts[c as usize].find(p);
            let triangle = self.base.source.get(found.triangle as usize).copied().unwrap_or(NONE);
            SourcePoint { triangle, surface_triangle: found.triangle, barycentric: found.barycentric }
        };
        self.filled.positions.par_iter().zip(&chart).map(find).collect()
    }
}

#[cfg(test)]
#[path = "work_tests.rs"]
mod tests;
