//! Shaping with vertices held where borders and followed lines bend.
//!
//! After the other vertices found their places, [`put_on_bends`] says where those of curves have to be for their edges to keep near the
//! curves; they are held there, and all is shaped once more from where it is. Where that crumples a panel, those of the curves
//! beside it slide as they did.

use super::super::SurfaceError;
use super::super::bars::MOST_SPREAD;
use super::super::bends::put_on_bends;
use super::super::regular::mean_edge;
use super::{Aims, Shaper};
use mesh::{DVec3, Monitor};
use std::collections::BTreeSet;

/// Rounds that take the vertices to where their curves bend, and what is around along.
const ROUNDS: usize = 30;

/// How often vertices are let go again.
const RELEASES: usize = 6;

/// Sine of the angle at a panel's corner below which, or at which outwards, the panel is crumpled, where it was larger by so much.
const SHARP: f64 = 0.06;
const SHARPER: f64 = 0.03;

impl Shaper<'_> {
    /// Shapes once more with vertices where their curves bend, if there are bends that are cut off: for regularity, then for planarity.
    pub(super) fn follow_bends(
        &mut self,
        [bound, free]: [Aims; 2],
        flattening_rounds: usize,
        positions: &mut Vec<DVec3>,
        monitor: &Monitor,
    ) -> Result<(), SurfaceError> {
        if !self.turned(positions).is_empty() {
            // Not a mesh to keep, or one without room.
            return Ok(());
        }
        let edge = mean_edge(&self.pattern.tiles, positions);
        let at = |v: u32| positions[v as usize];
        let mut held: Vec<Vec<(u32, f64)>> = Vec::new();
        for chain in &self.chains {
            monitor.check()?;
            held.extend(put_on_bends(chain, &self.curves[chain.curve], edge, at));
        }
        let sharpness = self.sharpness(positions);
        for release in 1..=RELEASES {
            if held.is_empty() {
                break;
            }
            let rooms = self.rooms.clone();
            for &(v, length) in held.iter().flatten() {
                self.rooms[v as usize] = Some([length; 2]);
            }
            let mut tried = positions.clone();
            let phase = self.phase(bound, &tried, |_| true)?;
            self.run(&phase, ROUNDS, &mut tried, monitor)?;
            self.flatten(free, flattening_rounds, &mut tried, monitor)?;
            let now = self.sharpness(&tried);
            let is_worse = |&t: &usize| now[t] < SHARP && now[t] < sharpness[t] - SHARPER;
            let worse: Vec<u32> = (0..now.len()).filter(is_worse).map(|t| t as u32).collect();
            let [before, after] = [&*positions, &tried].map(|positions| self.spread(positions));
            if worse.is_empty() && after <= before.max(MOST_SPREAD) {
                *positions = tried;
                break;
            }
            self.rooms = rooms;
            if worse.is_empty() {
                break;
            }
            // The longer it takes, the farther off is what is let go.
            let near: BTreeSet<usize> = self.around(&worse, release).into_iter().collect();
            held.retain(|chain| !chain.iter().any(|&(v, _)| near.contains(&(v as usize))));
        }
        Ok(())
    }

    /// Standard deviation of the edge lengths over their mean.
    fn spread(&self, positions: &[DVec3]) -> f64 {
        let length = |&[a, b]: &[u32; 2]| positions[a as usize].distance(positions[b as usize]);
        let count = self.edges.len().max(1) as f64;
        let mean = self.edges.iter().map(length).sum::<f64>() / count;
        (self.edges.iter().map(|edge| (length(edge) / mean - 1.0).powi(2)).sum::<f64>() / count).sqrt()
    }

    /// The least sine of an angle at a corner of each panel, negative where it is outwards; -1 of a panel that is turned over.
    fn sharpness(&self, positions: &[DVec3]) -> Vec<f64> {
        let sharpness = |tile: &Vec<u32>| {
            if self.is_over(tile, positions) {
                return -1.0;
            }
            let corners: Vec<DVec3> = tile.iter().map(|&v| positions[v as usize]).collect();
            let up = mesh::face_normal(&corners).normalize_or_zero();
            let n = corners.len();
            let sine = |k: usize| {
                let [ahead, back] =
                    [k + 1, k + n - 1].map(|other| (corners[other % n] - corners[k]).normalize_or_zero());
                ahead.cross(back).dot(up)
            };
            (0..n).map(sine).fold(1.0, f64::min)
        };
        self.pattern.tiles.iter().map(sharpness).collect()
    }
}
