//! Turning back tiles that are turned over.
//!
//! Tiles are laid by way of a coarse triangulation, and where that is bent much the projection onto the surface folds a few of them over.
//! Regularity alone does not undo a fold: it is a place where tiles have less room than they ask for, and each keeps the others from
//! giving way. A net whose vertices are each at the mean of their neighbours asks for no room, and in the plane with a convex outline has
//! no fold at all (Tutte 1963). So what is around a fold is made such a net, on the surface, and shaped again from there; steps that
//! would fold it again are not taken by [`Shaper::guarded`]. The paper, whose patches are large and flat, has no such folds.

use super::super::SurfaceError;
use super::super::pattern::Place;
use super::{Phase, Shaper};
use mesh::{DVec3, Monitor};
use std::collections::BTreeSet;

/// How many edges around a fold are smoothed, tried one after another.
const RINGS: [usize; 4] = [2, 3, 4, 6];

/// Sweeps of putting each vertex at the mean of its neighbours: twice the greatest number of edges across what is smoothed, and more.
const SWEEPS: usize = 40;

/// The part of the tiles that may be turned over for it: where more are, there is no room for tiles of that size.
const MOST_TURNED: f64 = 0.3;

/// Rounds of shaping after each.
const ROUNDS: usize = 20;

impl Shaper<'_> {
    /// Turns tiles back, as far as they can be, and goes on with the phase there.
    pub(super) fn untangle(
        &mut self,
        phase: &Phase,
        positions: &mut Vec<DVec3>,
        monitor: &Monitor,
    ) -> Result<(), SurfaceError> {
        let mut turned = self.turned(positions);
        for rings in RINGS {
            if turned.is_empty() || turned.len() as f64 > MOST_TURNED * self.pattern.tiles.len() as f64 {
                break;
            }
            let mut tried = positions.clone();
            self.smooth(&mut tried, &self.around(&turned, rings), monitor)?;
            self.run(phase, ROUNDS, &mut tried, monitor)?;
            let left = self.turned(&tried);
            if left.len() < turned.len() {
                *positions = tried;
                turned = left;
            }
        }
        Ok(())
    }

    /// Vertices of the tiles and those so many edges away from them, in order.
    pub(super) fn around(&self, tiles: &[u32], rings: usize) -> Vec<usize> {
        let mut found: BTreeSet<u32> = tiles.iter().flat_map(|&t| &self.pattern.tiles[t as usize]).copied().collect();
        for _ in 0..rings {
            let next: Vec<u32> = found.iter().flat_map(|&v| &self.beside[v as usize]).copied().collect();
            found.extend(next);
        }
        found.into_iter().map(|v| v as usize).filter(|&v| self.pattern.places[v] != Place::Fixed).collect()
    }

    /// Puts each of the vertices at the mean of its neighbours, on the surface or on its curve.
    fn smooth(&mut self, positions: &mut [DVec3], vertices: &[usize], monitor: &Monitor) -> Result<(), SurfaceError> {
        for _ in 0..SWEEPS {
            monitor.check()?;
            for &v in vertices {
                let beside = &self.beside[v];
                let mean = beside.iter().map(|&w| positions[w as usize]).sum::<DVec3>() / beside.len().max(1) as f64;
                positions[v] = self.nearest(v, mean);
            }
        }
        Ok(())
    }
}
