//! A layout of few patches traced over finished quads, and quads laid over it anew.
//!
//! Not in Daniels et al. 2011, whose layout has a vertex for every site, and each may become an irregular one. Here the parts
//! between features are divided once more, now into disks of three to six sides along a cross field that follows the features
//! (`QuadMixer`, section 3.2.1, see [`quadrangulate::layout`]): rows run along the features, and irregular vertices remain where
//! the field is singular or counts do not meet. The quads at hand are what is traced on, so that features, their corners and
//! the topology are theirs. The result is taken only where it is better, see [`Work::is_better`].

mod lay;
mod plan;

use crate::error::LayoutError;
use crate::fill::{Filled, Place, doubled};
use crate::quads::{angle_deviation, irregular};
use crate::rails::Rails;
use crate::work::{Wanted, Work};
use mesh::{DVec3, Monitor, Topology, TriangleMesh, scaled_jacobian, split_quad};
use quadrangulate::layout::{self, CornerAngles, LayoutOptions, parts, trace_layout};
use rayon::prelude::*;
use std::f64::consts::PI;
use surface::closest::ClosestPoint;
use surface::smooth_star::Polyline;

/// Corners of features sharper than 135 degrees get one quad, and so on by quarters.
const CORNERS: CornerAngles = CornerAngles { convex: PI * 0.75, concave: PI * 1.25, slit: PI * 1.75, round: PI / 3.6 };
/// Patches with sides of more edges than this are divided where a trace allows it. Without a bound the rows of long patches shear: mean
/// angle deviation 14 instead of 8 degrees on a goat's head, 11 instead of 4 on a fish; bounded by 6 there were a tenth more
/// irregular vertices.
const LONGEST: f64 = 12.0;
/// Times that parts which cannot be laid well are kept as they are, and the rest is laid once more, if it is most of the quads.
const TRIES: usize = 3;
/// A part is kept where new quads are further from its vertices than this, in edge lengths: a finger that few quads would cover.
const MOST_LOST: f64 = 1.0;
/// Traced quads are looked at further when they have this many times the irregular vertices at most.
const FEWER: f64 = 0.9;
/// What traced quads must be, or what the others are: the least scaled Jacobian, that of all but one quad in a hundred, the mean
/// deviation of angles, degrees, the share of the features within [`NEAR`] edge lengths; and the number of quads, as a fraction off
/// the wanted one.
const LEAST: f64 = 0.05;
const LEAST_JACOBIAN: f64 = 0.3;
const MOST_ANGLE: f64 = 9.0;
const LEAST_FOLLOWED: f64 = 0.99;
const MOST_DRIFT: f64 = 0.03;
const NEAR: f64 = 0.05;

/// Quads to be laid anew.
struct Remaking<'b, 'a> {
    work: &'b Work<'a>,
    wanted: &'b Wanted<'b>,
    /// Edge lengths wanted at the vertices of the surface but for bends, scene units.
    plain: &'b [f64],
    /// Shortest edge that bends of features may ask for, in wanted ones.
    shortest: f64,
    /// The part between features of each quad.
    part_of: Vec<u32>,
    /// Parts that stay as they are.
    kept: Vec<bool>,
}

impl Work<'_> {
    /// These quads laid anew over a traced layout, but for parts between features that cannot be; `None` where those are all.
    ///
    /// # Errors
    /// [`LayoutError::Cancelled`].
    pub fn traced(
        &self,
        plain: &[f64],
        shortest: f64,
        wanted: &Wanted<'_>,
        monitor: &Monitor,
    ) -> Result<Option<Self>, LayoutError> {
        let features = self.features();
        let mut on_rail = vec![false; self.filled.positions.len()];
        features.iter().flatten().for_each(|&v| on_rail[v as usize] = true);
        let held = |v: usize| matches!(self.filled.places[v], Place::Corner(c) if self.rails().corner[c as usize]);
        if (0..on_rail.len()).any(|v| held(v) && !on_rail[v]) {
            // Marked vertices inside a part would be lost.
            return Ok(None);
        }
        let mesh = self.triangles();
        let part_of: Vec<u32> = parts(&mesh, &features).into_iter().step_by(2).collect();
        let count = part_of.iter().max().map_or(0, |&last| last as usize + 1);
        let mut chart = vec![0; count];
        part_of.iter().zip(self.charts_of_quads()).for_each(|(&part, &c)| chart[part as usize] = c);
        let lengths = self.lengths(wanted);
        let options = LayoutOptions {
            corners: CORNERS,
            refinements: 0,
            longest: LONGEST * wanted.edge_length,
            partial: true,
            ..LayoutOptions::default()
        };
        let layout = match trace_layout(&mesh, &features, &options, monitor) {
            Ok(layout) => layout,
            Err(layout::LayoutError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // The field needs triangles that have an area, and something to follow in every component or in none.
            Err(_) => return Ok(None),
        };
        let under = ClosestPoint::new(&mesh);
        let size = |(v, &p): (usize, &DVec3)| {
            lengths.get(v).copied().unwrap_or_else(|| {
                let found = under.project(p);
                let corners = mesh.triangles[found.triangle as usize];
                (0..3).map(|k| found.barycentric[k] * lengths[corners[k] as usize]).sum()
            })
        };
        let sizes = layout.mesh.positions.iter().enumerate().map(size).collect();
        let mut kept = vec![false; count];
        layout.undivided.iter().for_each(|&(part, _)| kept[part as usize] = true);
        let mut remaking = Remaking { work: self, wanted, plain, shortest, part_of, kept };
        let traced = remaking.traced(layout, sizes);
        for _ in 0..TRIES {
            let stay = remaking.part_of.iter().filter(|part| remaking.kept[**part as usize]).count();
            if stay > remaking.part_of.len() / 2 {
                return Ok(None);
            }
            let Some(plan) = remaking.plan(&traced, monitor)? else { return Ok(None) };
            let Some(filled) = remaking.lay(&traced, &plan, monitor)? else { return Ok(None) };
            let lost = remaking.lost(&filled, &lengths);
            let doubled = doubled(&filled);
            let bad = |part: &usize| lost[*part] > MOST_LOST || doubled.contains(&(*part as u32));
            let bad: Vec<usize> = (0..count).filter(|part| !remaking.kept[*part]).filter(bad).collect();
            if bad.is_empty() {
                return Ok(Some(self.with(filled, &chart)));
            }
            for part in bad {
                remaking.kept[part] = true;
            }
        }
        Ok(None)
    }

    /// Whether these quads, traced and refilled, may be better than the others when they are finished: well before that it shows where
    /// counts or features came out badly.
    pub fn promises(&self, others: &Self, target: Option<f64>) -> bool {
        self.irregular() as f64 <= FEWER * others.irregular() as f64
            && self.off(others, target) <= 2.0 * MOST_DRIFT
            && self.shapes().1 >= LEAST_JACOBIAN - 0.05
            && self.followed() >= others.followed().min(LEAST_FOLLOWED) - 0.005
    }

    /// Whether these quads, traced and finished, are sound, follow the features, and have fewer irregular vertices than the others and
    /// about as many quads as are wanted. Where the others `are_finished` it is enough to be as well shaped.
    pub fn is_better(&self, others: &Self, are_finished: bool, target: Option<f64>) -> bool {
        if self.irregular() >= others.irregular() || self.off(others, target) > MOST_DRIFT {
            return false;
        }
        let (mut least, mut jacobian, mut angle) = (LEAST, LEAST_JACOBIAN, MOST_ANGLE);
        if are_finished {
            let shapes = others.shapes();
            (least, jacobian, angle) = (least.min(shapes.0), jacobian.min(shapes.1), angle.max(shapes.2));
        }
        let shapes = self.shapes();
        shapes.0 >= least
            && shapes.1 >= jacobian
            && shapes.2 <= angle
            && self.followed() >= others.followed().min(LEAST_FOLLOWED)
    }

    /// How far the number of quads is off the wanted one or, without, the others', as a fraction.
    fn off(&self, others: &Self, target: Option<f64>) -> f64 {
        (self.filled.quads.len() as f64 / target.unwrap_or(others.filled.quads.len() as f64) - 1.0).abs()
    }

    /// The least scaled Jacobian, that of all but one quad in a hundred, and the mean deviation of angles, degrees.
    fn shapes(&self) -> (f64, f64, f64) {
        let corners = |quad: &[u32; 4]| quad.map(|v| self.filled.positions[v as usize]);
        let shape = |quad| (scaled_jacobian(corners(quad)), angle_deviation(corners(quad)));
        let (mut jacobians, angles): (Vec<f64>, Vec<f64>) = self.filled.quads.iter().map(shape).unzip();
        jacobians.sort_by(f64::total_cmp);
        (jacobians[0], jacobians[jacobians.len() / 100], angles.iter().sum::<f64>() / angles.len() as f64)
    }

    /// Inner vertices of other valence than 4.
    pub fn irregular(&self) -> usize {
        irregular(&Topology::new(self.filled.positions.len(), &self.filled.quads))
    }

    /// Share of the length of the rails within [`NEAR`] mean edge lengths of the quads' edges along them.
    pub fn followed(&self) -> f64 {
        let Rails { steps, points, .. } = self.rails();
        let Filled { positions, along, .. } = &self.filled;
        let (mut near, mut all) = (0.0, 0.0);
        let edges = || along.iter().flat_map(|along| along.windows(2));
        let length: f64 = edges().map(|w| positions[w[0] as usize].distance(positions[w[1] as usize])).sum();
        let reach = NEAR * length / edges().count().max(1) as f64;
        for (steps, points) in steps.iter().zip(points) {
            let lines: Vec<Polyline> = steps
                .iter()
                .map(|step| &along[step.edge as usize])
                .filter(|along| along.len() > 1)
                .map(|along| Polyline::new(along.iter().map(|&v| positions[v as usize]).collect()))
                .collect();
            let off = |p: DVec3| {
                let far = |line: &Polyline| line.at(line.locate(p)).distance(p);
                lines.iter().map(far).fold(f64::INFINITY, f64::min)
            };
            for w in points.windows(2) {
                let length = w[0].distance(w[1]);
                all += length;
                let samples = [0.125, 0.375, 0.625, 0.875].map(|t| off(w[0].lerp(w[1], t)) <= reach);
                near += length * samples.iter().filter(|near| **near).count() as f64 / samples.len() as f64;
            }
        }
        if all > 0.0 { near / all } else { 1.0 }
    }

    /// The quads as triangles, two each.
    fn triangles(&self) -> TriangleMesh {
        let positions = &self.filled.positions;
        let mut mesh = TriangleMesh { positions: positions.clone(), triangles: vec![] };
        for quad in &self.filled.quads {
            let halves = split_quad(quad.map(|v| positions[v as usize]));
            mesh.triangles.extend(halves.map(|half| half.map(|k| quad[k])));
        }
        mesh
    }
}

impl Remaking<'_, '_> {
    /// For each part how far its vertices are from the new quads, in edge lengths at most.
    fn lost(&self, made: &Filled, lengths: &[f64]) -> Vec<f64> {
        let old = &self.work.filled;
        (0..self.kept.len() as u32)
            .into_par_iter()
            .map(|part| {
                if self.kept[part as usize] {
                    return 0.0;
                }
                let own = made.quads.iter().zip(&made.patch_of).filter(|(_, p)| **p == part);
                let closest = ClosestPoint::of_quads(&made.positions, own.map(|(quad, _)| *quad));
                let mut before: Vec<u32> =
                    old.quads.iter().zip(&self.part_of).filter(|(_, p)| **p == part).flat_map(|(q, _)| *q).collect();
                before.sort_unstable();
                before.dedup();
                let far = |&v: &u32| closest.project(old.positions[v as usize]).distance / lengths[v as usize];
                before.iter().map(far).fold(0.0, f64::max)
            })
            .collect()
    }
}
