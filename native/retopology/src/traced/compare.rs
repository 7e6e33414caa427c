//! Whether quads laid anew are better than those that were there.

use crate::fill::Filled;
use crate::quads::{angle_deviation, irregular};
use crate::rails::Rails;
use crate::work::Work;
use mesh::{DVec3, Topology, scaled_jacobian};
use rayon::prelude::*;
use surface::closest::ClosestPoint;
use surface::smooth_star::Polyline;

/// Traced quads are looked at further when they have this many times the irregular vertices at most.
const FEWER: f64 = 0.9;
/// What traced quads must be, or what the others are: the scaled Jacobian of nearly all, that of all but one quad in a hundred, the mean
/// deviation of angles, degrees, the share of the features within [`NEAR`] edge lengths; and the number of quads, as a fraction off
/// the wanted one.
const LEAST: f64 = 0.05;
/// Share of the quads that may be below the first beside as many as the others have.
const MOST_WEAK: f64 = 0.001;
const LEAST_JACOBIAN: f64 = 0.3;
const MOST_ANGLE: f64 = 10.0;
const LEAST_FOLLOWED: f64 = 0.99;
/// Shares of the features that differ by less are the same.
const FOLLOWED_ALIKE: f64 = 0.005;
const MOST_DRIFT: f64 = 0.04;
const NEAR: f64 = 0.05;
/// Where quads are few, all have angles that are off by more, and traced ones may by so many times as much.
const MORE: f64 = 1.1;
/// Traced quads are not finished where their number is off by more than this.
pub(super) const MOST_OFF: f64 = 2.0 * MOST_DRIFT;
/// Traced quads are finished where all but one in a hundred have this share of the scaled Jacobian that the others have now.
const PROMISING: f64 = 0.25;
/// Shapes that differ by less are the same: the worst quad of a narrow corner is often where it was.
const SAME: f64 = 1e-6;

impl Work<'_> {
    /// Whether these quads, traced and refilled, may be better than the others when they are finished: well before that it shows where
    /// counts came out badly.
    pub fn promises(&self, others: &Self, target: Option<f64>) -> bool {
        self.irregular() as f64 <= FEWER * others.irregular() as f64
            && self.off(others, target) <= MOST_OFF
            && self.shapes().0 >= (LEAST_JACOBIAN - 0.05).min(PROMISING * others.shapes().0)
    }

    /// Whether these quads, traced and finished, are sound, follow the features, and have fewer irregular vertices than the others and
    /// about as many quads as are wanted. Where the others `are_finished` it is enough to be as well shaped.
    pub fn is_better(&self, others: &Self, are_finished: bool, target: Option<f64>) -> bool {
        if self.irregular() >= others.irregular() || self.off(others, target) > MOST_DRIFT {
            return false;
        }
        let theirs = others.shapes();
        let weak = others.weak() + (MOST_WEAK * self.filled.quads.len() as f64) as usize;
        let (mut jacobian, mut angle) = (LEAST_JACOBIAN, MOST_ANGLE);
        if are_finished {
            (jacobian, angle) = (jacobian.min(theirs.0 - SAME), angle.max(MORE * theirs.1));
        }
        let shapes = self.shapes();
        self.weak() <= weak && shapes.0 >= jacobian && shapes.1 <= angle && self.follows(others)
    }

    /// Whether these quads follow the features about as well as the others, or well enough.
    pub fn follows(&self, others: &Self) -> bool {
        self.followed() >= (others.followed() - FOLLOWED_ALIKE).min(LEAST_FOLLOWED)
    }

    /// Where the quads and their surface are further from each other than this: vertices and middles of triangles and quads.
    pub fn apart(&self, surface: &ClosestPoint, reach: f64) -> Vec<(DVec3, f64)> {
        let Filled { positions, quads, .. } = &self.filled;
        let own = ClosestPoint::of_quads(positions, quads.iter().copied());
        let ground = &self.base().surface;
        let middles = (0..ground.triangles.len()).map(|t| ground.points(t).into_iter().sum::<DVec3>() / 3.0);
        let theirs: Vec<DVec3> = ground.positions.iter().copied().chain(middles).collect();
        let ours: Vec<DVec3> =
            quads.iter().map(|q| q.map(|v| positions[v as usize]).into_iter().sum::<DVec3>() / 4.0).collect();
        let far = |points: Vec<DVec3>, to: &ClosestPoint| -> Vec<(DVec3, f64)> {
            let measured = points.into_par_iter().map(|p| (p, to.project(p).distance));
            measured.filter(|(_, distance)| *distance > reach).collect()
        };
        let mut apart = far(theirs, &own);
        apart.extend(far(ours, surface));
        apart
    }

    /// How far the number of quads is off the wanted one or, without, the others', as a fraction.
    fn off(&self, others: &Self, target: Option<f64>) -> f64 {
        (self.filled.quads.len() as f64 / target.unwrap_or(others.filled.quads.len() as f64) - 1.0).abs()
    }

    /// The scaled Jacobian of all but one quad in a hundred, and the mean deviation of angles, degrees.
    fn shapes(&self) -> (f64, f64) {
        let corners = |quad: &[u32; 4]| quad.map(|v| self.filled.positions[v as usize]);
        let shape = |quad| (scaled_jacobian(corners(quad)), angle_deviation(corners(quad)));
        let (mut jacobians, angles): (Vec<f64>, Vec<f64>) = self.filled.quads.iter().map(shape).unzip();
        jacobians.sort_by(f64::total_cmp);
        (jacobians[jacobians.len() / 100], angles.iter().sum::<f64>() / angles.len() as f64)
    }

    /// Number of quads with a scaled Jacobian below [`LEAST`].
    pub fn weak(&self) -> usize {
        let corners = |quad: &[u32; 4]| quad.map(|v| self.filled.positions[v as usize]);
        self.filled.quads.iter().filter(|quad| scaled_jacobian(corners(quad)) < LEAST).count()
    }

    /// Inner vertices of other valence than 4.
    fn irregular(&self) -> usize {
        irregular(&Topology::new(self.filled.positions.len(), &self.filled.quads))
    }

    /// Share of the length of the rails within [`NEAR`] mean edge lengths of the quads' edges along them.
    fn followed(&self) -> f64 {
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
}
