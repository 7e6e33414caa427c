//! What is done about quads that came out bad: vertices go back to where they were, quads are mended.

use super::{Work, constraint, surfaces};
use crate::error::LayoutError;
use crate::fill::Filled;
use crate::mend::{self, Mended, mend, qualities};
use mesh::{DVec3, Monitor};
use quadrangulate::improve::Setting;
use std::collections::BTreeSet;
use surface::closest::ClosestPoint;
use surface::smooth::{Constraint, SmoothOptions};

/// Rings of quads around mended ones that move once more.
const MOVE_ON_RINGS: usize = 4;

impl Work<'_> {
    /// Takes back the moves of vertices around quads that got worse than `weak` by them, and around points: those within so many rings go
    /// to where they were `before` and are held there, those around them are smoothed. Vertices on bends stay unless `bends` says so. Returns
    /// whether any did.
    pub fn put_back(
        &mut self,
        before: &[DVec3],
        (weak, points): (f64, &[DVec3]),
        (rings, bends): (usize, bool),
        smooth: &SmoothOptions,
        monitor: &Monitor,
    ) -> Result<bool, LayoutError> {
        let Filled { positions, quads, places, .. } = &self.filled;
        let surfaces = surfaces(self.charts);
        let quality = |q: usize, at: &[DVec3]| {
            let (p, surface) = (quads[q].map(|v| at[v as usize]), surfaces[self.chart_of_quad[q] as usize]);
            mend::quality(p, surface).min(mesh::scaled_jacobian(p))
        };
        let got_weak = |&q: &usize| {
            let now = quality(q, positions);
            now < weak && quality(q, before) > now
        };
        let mut slipped: Vec<usize> = (0..quads.len()).filter(got_weak).collect();
        slipped.extend(self.nearest(points));
        if slipped.is_empty() {
            return Ok(false);
        }
        let mut near = self.around(&slipped, rings);
        let own = |v: usize| if bends { constraint(places[v], self.rails) } else { self.constraints[v] };
        let goes = |&v: &usize| near[v] && (own(v) == Constraint::Free || bends && own(v) != Constraint::Fixed);
        let back: Vec<usize> = (0..near.len()).filter(goes).collect();
        (0..rings).for_each(|_| self.grow(&mut near));
        for v in back {
            self.filled.positions[v] = before[v];
            self.constraints[v] = Constraint::Fixed;
        }
        let (mut part, names) = self.part(&near);
        part.smooth(1, smooth, monitor)?;
        self.take_back(&part, &names, &near);
        Ok(true)
    }

    /// The quads nearest to some points.
    pub(crate) fn nearest(&self, points: &[DVec3]) -> Vec<usize> {
        if points.is_empty() {
            return vec![];
        }
        let closest = ClosestPoint::of_quads(&self.filled.positions, self.filled.quads.iter().copied());
        points.iter().map(|&p| closest.project(p).triangle as usize / 2).collect()
    }

    /// The vertices of some quads and of so many rings around them.
    pub(crate) fn around(&self, quads: &[usize], rings: usize) -> Vec<bool> {
        let mut near = vec![false; self.filled.positions.len()];
        quads.iter().flat_map(|&q| self.filled.quads[q]).for_each(|v| near[v as usize] = true);
        (0..rings).for_each(|_| self.grow(&mut near));
        near
    }

    /// Adds the vertices of all quads that have a marked one.
    fn grow(&self, near: &mut [bool]) {
        let is_near = |quad: &&[u32; 4]| quad.iter().any(|&v| near[v as usize]);
        let reached: Vec<&[u32; 4]> = self.filled.quads.iter().filter(is_near).collect();
        reached.into_iter().flatten().for_each(|&v| near[v as usize] = true);
    }

    /// The last resort, see [`mend`]; then, where quads are inverted still, once more without the bends that are held. Where all vertices
    /// may `move_on`, they do so around what was mended. Returns the places mended and the quads still inverted.
    pub fn mend_all(
        &mut self,
        smooth: &SmoothOptions,
        sound: f64,
        move_on: bool,
        monitor: &Monitor,
    ) -> Result<(usize, usize), LayoutError> {
        let start = self.filled.positions.clone();
        let (mut mended, mut inverted) = self.mend(smooth, sound, monitor)?;
        if inverted > 0 {
            // No bend is worth an inverted quad.
            let mut loose = self.clone();
            if loose.release(&loose.pinned()) > 0 {
                loose.smooth(1, smooth, monitor)?;
                let more = loose.mend(smooth, mend::INVERTED, monitor)?;
                if more.1 < inverted {
                    *self = loose;
                    (mended, inverted) = (mended + more.0, more.1);
                }
            }
        }
        if move_on && mended > 0 {
            // The quads around each place were held. Some have no room to move without one turning over.
            let bits = |p: &DVec3| p.to_array().map(f64::to_bits);
            let known: BTreeSet<[u64; 3]> = start.iter().map(bits).collect();
            let mut near: Vec<bool> = self.filled.positions.iter().map(|p| !known.contains(&bits(p))).collect();
            (0..MOVE_ON_RINGS).for_each(|_| self.grow(&mut near));
            let before = self.filled.positions.clone();
            let (mut part, names) = self.part(&near);
            part.smooth(1, smooth, monitor)?;
            self.take_back(&part, &names, &near);
            let now = self.inverted().len();
            if now > inverted {
                self.filled.positions = before;
            } else {
                inverted = now;
            }
        }
        Ok((mended, inverted))
    }

    fn mend(&mut self, smooth: &SmoothOptions, sound: f64, monitor: &Monitor) -> Result<(usize, usize), LayoutError> {
        let (features, surfaces) = (self.features(), surfaces(self.charts));
        let start = self.take();
        let before = start.positions.len();
        let setting = Setting {
            features: &features,
            outside: &[],
            chains: &self.rails.lines,
            surfaces: &surfaces,
            slack: self.slack,
        };
        let Mended { patch, source, places } = mend(start, &setting, smooth, sound, monitor)?;
        let inverted = qualities(&patch, &surfaces).iter().filter(|quality| **quality <= 0.0).count();
        self.put(patch, &source, before);
        Ok((places, inverted))
    }

    /// The middles of the quads that are inverted.
    pub(crate) fn inverted(&self) -> Vec<DVec3> {
        let surfaces = surfaces(self.charts);
        let corners = |quad: &[u32; 4]| quad.map(|v| self.filled.positions[v as usize]);
        let quads = self.filled.quads.iter().map(corners).zip(&self.chart_of_quad);
        let inverted = quads.filter(|(p, c)| mend::quality(*p, surfaces[**c as usize]) <= mend::INVERTED);
        inverted.map(|(p, _)| p.into_iter().sum::<DVec3>() / 4.0).collect()
    }
}
