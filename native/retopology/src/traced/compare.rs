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
/// What well shaped quads are: the scaled Jacobian of nearly all and the share that may be below it, the scaled Jacobian of all but one
/// quad in a hundred, and the mean deviation of angles, degrees.
const LEAST: f64 = 0.05;
const MOST_WEAK: f64 = 0.001;
const LEAST_JACOBIAN: f64 = 0.3;
const MOST_ANGLE: f64 = 10.0;
/// What twice the share of weak quads that may be is worth, where the whole of another measure is 1.
const WEAK_LACK: f64 = 0.05;
/// What traced quads may lack more than the others for the irregular vertices that those have and they have not, as a share of those.
const PRICE: f64 = 0.25;
/// The share of the features within [`NEAR`] edge lengths that is enough; shares that differ by less than the second are the same.
const LEAST_FOLLOWED: f64 = 0.99;
const FOLLOWED_ALIKE: f64 = 0.005;
const NEAR: f64 = 0.05;
/// The number of quads, as a fraction off the wanted one.
const MOST_DRIFT: f64 = 0.0495;
/// Traced quads are not finished where their number is off by more than this.
pub(super) const MOST_OFF: f64 = 0.08;
/// Traced quads are finished where all but one in a hundred have this share of the scaled Jacobian that the others have now.
const PROMISING: f64 = 0.1;

impl Work<'_> {
    /// Whether these quads, traced and refilled, may be better than the others when they are finished: well before that it shows where
    /// counts came out badly.
    pub fn promises(&self, others: &Self, target: Option<f64>) -> bool {
        self.irregular() as f64 <= FEWER * others.irregular() as f64
            && self.off(others, target) <= MOST_OFF
            && self.shapes().0 >= PROMISING * others.shapes().0
    }

    /// Whether these quads, traced and finished, follow the features, and have fewer irregular vertices than the others and about as many
    /// quads as are wanted, without being worse shaped. Where the others are not finished yet, they must be well shaped.
    pub fn is_better(&self, others: &Self, are_finished: bool, target: Option<f64>) -> bool {
        let [ours, theirs] = [self, others].map(|quads| quads.irregular() as f64);
        if ours >= theirs || self.off(others, target) > MOST_DRIFT || !self.follows(others, 0.0) {
            return false;
        }
        let shape = self.lacks();
        if !are_finished {
            return shape.iter().all(|lack| *lack == 0.0);
        }
        is_worth(1.0 - ours / theirs, shape, others.lacks())
    }

    /// How far the quads are from being well shaped: in the scaled Jacobian of all but one in a hundred and in the mean deviation of
    /// angles, as fractions of what they should be, and in quads that are hardly valid, in so many times the share that may be.
    fn lacks(&self) -> [f64; 3] {
        let (jacobian, angle) = self.shapes();
        let weak = self.weak() as f64 / self.filled.quads.len() as f64;
        [1.0 - jacobian / LEAST_JACOBIAN, angle / MOST_ANGLE - 1.0, WEAK_LACK * (weak / MOST_WEAK - 1.0)]
            .map(|lack| lack.max(0.0))
    }

    /// Whether these quads follow the features about as well as the others, or well enough, but for so much of them.
    pub fn follows(&self, others: &Self, less: f64) -> bool {
        self.followed() >= (others.followed() - FOLLOWED_ALIKE).min(LEAST_FOLLOWED) - less
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

/// Whether a share of irregular vertices less is worth what these quads lack more than the others.
fn is_worth(saved: f64, own: [f64; 3], others: [f64; 3]) -> bool {
    own.iter().sum::<f64>() <= others.iter().sum::<f64>() + PRICE * saved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_irregular_vertices_outweigh_a_little_shape() {
        // A goat's head and a wing nut, whose angles are off by a degree more than ten, with half the irregular vertices.
        assert!(is_worth(0.59, [0.0, 0.1, 0.0], [0.0; 3]));
        assert!(is_worth(0.45, [0.0, 0.09, 0.0], [0.0; 3]));
        // Fish whose angles are off by 14 degrees instead of 7, and a hand with slivers.
        assert!(!is_worth(0.55, [0.0, 0.4, 0.0], [0.0; 3]));
        assert!(!is_worth(0.45, [0.5, 0.0, 0.2], [0.0; 3]));
        // Among quads that are all badly shaped the better ones.
        assert!(is_worth(0.1, [0.5, 0.6, 0.1], [0.6, 0.7, 0.0]));
        assert!(!is_worth(0.1, [0.6, 0.8, 0.1], [0.6, 0.7, 0.0]));
    }
}
