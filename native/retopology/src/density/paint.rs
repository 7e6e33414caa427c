//! Painted sizes: what is wanted between the places where it was given, and how much of a contrast counts can make of it.
//!
//! Not in Daniels et al. 2011, whose templates are sampled alike. Features hold counts up where large quads are wanted, and a base
//! edge has one quad at least, so that a painted contrast comes out too low; asking for more of it makes up for that, and so does
//! following bends less closely where even that is not enough.

use super::{LESS_SHORT, SHORTEST, Size, count};
use crate::error::LayoutError;
use crate::fill;
use crate::patch::Plan;
use mesh::{Monitor, TriangleMesh};

/// A smaller contrast of sizes than this is not worth a round.
const LEAST_CONTRAST: f64 = 1.2;
/// Rounds of asking for more contrast, and the greatest power of the painted one that is asked for: more stretches the quads between
/// features without end.
const ROUNDS: usize = 3;
const MOST_POWER: f64 = 1.8;
/// A contrast whose logarithm is within this fraction of the wanted one will do.
const CLOSE_ENOUGH: f64 = 0.04;
/// Where it is further off than this, bends of features are followed less closely.
const FAIR: f64 = 0.15;
/// That has to bring it nearer by this much, or is given up: sizes that change within an edge or two are beyond any counts.
const LEAST_GAIN: f64 = 0.05;

/// Relative edge lengths at the vertices of a surface from those at its first vertices; the others take the mean of their
/// neighbours, and vertices of no triangle 1.
pub(crate) fn spread(surface: &TriangleMesh, given: &[f64]) -> Vec<f64> {
    let mut size = vec![0.0; surface.positions.len()];
    if given.is_empty() {
        size.fill(1.0);
        return size;
    }
    let known = given.len().min(size.len());
    size[..known].copy_from_slice(&given[..known]);
    // A vertex added by a cut has input vertices near it: few rounds are needed.
    loop {
        let mut sums = vec![(0.0, 0); size.len()];
        for t in &surface.triangles {
            for k in 0..3 {
                let (v, w) = (t[k] as usize, t[(k + 1) % 3] as usize);
                for (v, w) in [(v, w), (w, v)] {
                    if size[v] == 0.0 && size[w] > 0.0 {
                        sums[v] = (sums[v].0 + size[w], sums[v].1 + 1);
                    }
                }
            }
        }
        let mut changed = false;
        for (size, (sum, count)) in size.iter_mut().zip(sums).filter(|(_, (_, count))| *count > 0) {
            *size = sum / f64::from(count);
            changed = true;
        }
        if !changed {
            break;
        }
    }
    size.iter_mut().filter(|s| **s == 0.0).for_each(|s| *s = 1.0);
    size
}

/// What counts are asked for so that the quads have the painted contrast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contrast {
    /// The power of the painted sizes.
    power: f64,
    /// Bends of features are not followed with edges shorter than this, in mean edge lengths.
    pub shortest: f64,
}

impl Default for Contrast {
    fn default() -> Self {
        Self { power: 1.0, shortest: SHORTEST }
    }
}

impl Contrast {
    /// What makes the painted contrast, or comes as near to it as can be. `plan` has the sizes wanted without, `painted` those that
    /// were painted, at each vertex of the surface. Costs some rounds of counting where something was painted.
    pub fn new(
        plan: Plan<'_>,
        painted: &[f64],
        wanted: Size,
        irregularity: f64,
        monitor: &Monitor,
    ) -> Result<Self, LayoutError> {
        let Some(ends) = Ends::new(plan, painted) else { return Ok(Self::default()) };
        let mut best = (f64::INFINITY, Self::default());
        for shortest in std::iter::once(SHORTEST).chain(LESS_SHORT) {
            let before = best;
            // What sufficed not with more bends will be needed with fewer.
            let mut contrast = Self { shortest, ..best.1 };
            for _ in 0..ROUNDS {
                let size = contrast.sizes(plan.size, painted);
                let plan = Plan { size: &size, ..plan };
                let counts = count(plan, wanted, irregularity, shortest, monitor)?;
                let topologies = fill::topologies(plan, &counts.of_edge, monitor)?;
                let quads: Vec<f64> = topologies.iter().map(|topology| topology.quads.len() as f64).collect();
                let made = ends.made(&quads);
                if (made - 1.0).abs() < best.0 {
                    best = ((made - 1.0).abs(), contrast);
                }
                let power = (contrast.power + (1.0 - made)).clamp(1.0, MOST_POWER);
                if best.0 < CLOSE_ENOUGH || power == contrast.power {
                    break;
                }
                contrast.power = power;
            }
            if before.0 - best.0 < LEAST_GAIN {
                best = before;
                break;
            }
            if best.0 < FAIR {
                break;
            }
        }
        Ok(best.1)
    }

    /// These sizes with more of the painted ones in them.
    pub fn sizes(self, size: &[f64], painted: &[f64]) -> Vec<f64> {
        size.iter().zip(painted).map(|(size, painted)| size * painted.powf(self.power - 1.0)).collect()
    }
}

/// The patches where quads shall be small, and those where they shall be large.
struct Ends {
    patches: [Vec<usize>; 2],
    /// Their areas.
    areas: [f64; 2],
    /// The wanted contrast between them, as a logarithm.
    wanted: f64,
}

impl Ends {
    /// The lower and the upper third of the painted contrast, as factors; halves where a third has no patch; `None` where the contrast
    /// is too small.
    fn new(plan: Plan<'_>, painted: &[f64]) -> Option<Self> {
        let surface = &plan.base.surface;
        // Area of each patch, and the quads that it shall have for sizes of 1.
        let of_patch: Vec<[f64; 2]> = plan
            .patches
            .iter()
            .map(|patch| {
                let pieces = patch.triangles.iter().flat_map(|&t| &plan.measures.pieces[t as usize]);
                pieces.fold([0.0; 2], |[area, quads], &t| {
                    let own = surface.area_normal(t as usize).length() / 2.0;
                    let size = surface.triangles[t as usize].map(|v| painted[v as usize]).iter().sum::<f64>() / 3.0;
                    [area + own, quads + own / size.powi(2)]
                })
            })
            .collect();
        let size = |p: &usize| (of_patch[*p][0] / of_patch[*p][1]).sqrt().ln();
        let real: Vec<usize> = (0..of_patch.len()).filter(|&p| of_patch[p][0] > 0.0).collect();
        let [least, most] = [f64::min, f64::max].map(|pick| real.iter().map(size).reduce(pick).unwrap_or(0.0));
        [1.0 / 3.0, 0.5].into_iter().find_map(|part| {
            let step = part * (most - least);
            let small = real.iter().copied().filter(|p| size(p) <= least + step).collect::<Vec<_>>();
            let large = real.iter().copied().filter(|p| size(p) >= most - step).collect::<Vec<_>>();
            let patches = [small, large];
            let sums = |k: usize| patches.each_ref().map(|all| all.iter().map(|&p| of_patch[p][k]).sum::<f64>());
            let (areas, quads) = (sums(0), sums(1));
            let wanted = (areas[1] / quads[1] / (areas[0] / quads[0])).sqrt().ln();
            (wanted > LEAST_CONTRAST.ln() && patches.iter().all(|all| !all.is_empty())).then_some(Self {
                patches,
                areas,
                wanted,
            })
        })
    }

    /// The contrast that so many quads in each patch make, as a part of the wanted one, both as logarithms.
    fn made(&self, quads: &[f64]) -> f64 {
        let quads = self.patches.each_ref().map(|all| all.iter().map(|&p| quads[p]).sum::<f64>());
        (self.areas[1] / quads[1] / (self.areas[0] / quads[0])).sqrt().ln() / self.wanted
    }
}
