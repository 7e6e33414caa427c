//! The last resort for quads that no place of their vertices makes sound: another connectivity around them.
//!
//! Not in the paper. Where a patch is a sliver, or one quad spans a flat angle of a feature, smoothing ends with quads that are
//! inverted or nearly so. The quads a few rings around the worst one are then handed to the local search of
//! [`quadrangulate::improve`] with their border fixed, and its result is kept when the worst quad got better.

use crate::error::LayoutError;
use mesh::{DVec3, Monitor, NONE};
use quadrangulate::improve::{ImproveError, ImproveOptions, QuadPatch, Setting, improve};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use surface::closest::ClosestPoint;
use surface::smooth::{Constraint, SmoothOptions};
use surface::smooth_star::{Reference, quad_quality};

/// Quads below this quality are mended; in the coarsest layout, where every new irregular vertex sends lines over the whole
/// mesh, only inverted ones.
pub(crate) const SOUND: f64 = 0.3;
pub(crate) const INVERTED: f64 = 0.0;
/// Rings of quads round a bad one that may change.
const RINGS: usize = 3;
/// An inverted quad that cannot be mended so is tried again with more rings and more states to look at.
const MORE_RINGS: usize = 2;
const MORE_BUDGET: usize = 2;
/// No vertex of what is replaced may end up farther from what replaces it than this, in edge lengths: where quads are inverted, and
/// where they are badly shaped only.
const MOST_LOST: f64 = 1.5;
const MOST_LOST_FOR_SHAPE: f64 = 0.6;
/// Places mended at most, and those tried in vain one after another before the rest is left: a surface without room for
/// its quads has bad ones everywhere.
const MOST_PLACES: usize = 60;
const MOST_IN_VAIN: usize = 12;
/// Where more than one quad in so many is bad, only inverted ones are mended, and tried once: there is no room.
const MOST_BAD: usize = 20;
/// The number of quads changes by one in so many at most, for quads that are inverted, and for others.
const MOST_DRIFT_FOR_INVERTED: usize = 32;
const MOST_DRIFT: usize = 50;
/// Places mended at once.
const AT_ONCE: usize = 8;
/// Quality that the worst quad must gain for another look at what is inverted still, or all bad quads of a region together where the
/// worst one stays as it is.
const LEAST_GAIN: f64 = 0.05;
/// Operators looked ahead: with 3, or in two passes, the same places are mended in two to four times the time.
const DEPTH: usize = 2;
/// States that the search looks at in one place. More are no better: many places, each looked at briefly, mend more in less time.
const BUDGET: usize = 250;

/// [`quality`] of each quad.
pub(crate) fn qualities(patch: &QuadPatch, surfaces: &[&dyn Reference]) -> Vec<f64> {
    let quads = patch.quads.par_iter().zip(&patch.surface_of);
    quads
        .map(|(quad, &surface)| quality(quad.map(|v| patch.positions[v as usize]), surfaces[surface as usize]))
        .collect()
}

/// Quality of a quad against the normal of its surface under its middle.
pub(crate) fn quality(p: [DVec3; 4], surface: &dyn Reference) -> f64 {
    quad_quality(p, surface.normal_under(p, &mut { NONE }))
}

/// What [`mend`] did.
#[derive(Debug)]
pub(crate) struct Mended {
    pub patch: QuadPatch,
    /// For each vertex its index before, [`NONE`] for a new one.
    pub source: Vec<u32>,
    /// Places where quads were replaced.
    pub places: usize,
}

/// Replaces quads of less than `sound` quality and what lies around them, worst first. Keeps features, borders and topology.
///
/// Places that share no vertex are worked on at once; which these are does not depend on threads.
pub(crate) fn mend(
    mut patch: QuadPatch,
    setting: &Setting<'_>,
    smooth: &SmoothOptions,
    mut sound: f64,
    monitor: &Monitor,
) -> Result<Mended, LayoutError> {
    let (before, wanted) = (patch.positions.len(), patch.quads.len());
    let features: BTreeSet<[u32; 2]> = setting.features.iter().map(|&[a, b]| mesh::sorted(a, b)).collect();
    let mut quality_of = qualities(&patch, setting.surfaces);
    let has_room = quality_of.iter().filter(|quality| **quality < sound).count() <= wanted / MOST_BAD;
    if !has_room {
        sound = INVERTED;
    }
    let mut tried = vec![0_u8; patch.quads.len()];
    let shortfall = |values: &[f64]| values.iter().map(|value| (sound - value).max(0.0)).sum::<f64>();
    let (mut places, mut looked_at, mut in_vain) = (0, 0, 0);
    while looked_at < MOST_PLACES && in_vain < MOST_IN_VAIN {
        monitor.check()?;
        let regions = Region::apart(&patch, &quality_of, &tried, sound, has_room);
        if regions.is_empty() {
            break;
        }
        let replacement = |region: &Region| {
            let is_inverted = region.quads.iter().any(|&q| quality_of[q] <= INVERTED);
            let most_lost = if is_inverted { MOST_LOST } else { MOST_LOST_FOR_SHAPE };
            region.replacement(&patch, most_lost, setting, &features, smooth, monitor)
        };
        let found: Vec<Option<Replacement>> = regions.par_iter().map(replacement).collect::<Result<_, _>>()?;
        let mut keep = vec![true; patch.quads.len()];
        let mut count = patch.quads.len();
        for (region, found) in regions.iter().zip(found) {
            looked_at += 1;
            in_vain += 1;
            let old: Vec<f64> = region.quads.iter().map(|&q| quality_of[q]).collect();
            let least_old = least(&old);
            let better = found.filter(|found| {
                let after = count + found.patch.quads.len() - region.quads.len();
                let drifts = |part: usize| after.abs_diff(wanted) > count.abs_diff(wanted).max(wanted / part);
                let is_better = found.least() > least_old + 1e-6
                    || found.least() >= least_old && shortfall(&old) > shortfall(&found.qualities) + LEAST_GAIN;
                let inverted = |values: &[f64]| values.iter().filter(|value| **value <= INVERTED).count();
                is_better
                    && inverted(&found.qualities) <= inverted(&old)
                    && !drifts(if least_old <= INVERTED { MOST_DRIFT_FOR_INVERTED } else { MOST_DRIFT })
            });
            let Some(better) = better else {
                // The search had its chance at all of the region's bad quads, not at the first only.
                for &q in
                    region.quads.iter().filter(|&&q| is_bad(quality_of[q], sound) && region.is_inside(patch.quads[q]))
                {
                    tried[q] = tried[q].max(region.times);
                }
                continue;
            };
            places += 1;
            in_vain = 0;
            count = count + better.patch.quads.len() - region.quads.len();
            region.quads.iter().for_each(|&q| keep[q] = false);
            // What got better by a hair is not worth another look.
            let times = if better.least() > least_old + LEAST_GAIN { 1 } else { region.times };
            tried.extend(better.qualities.iter().map(|_| times));
            keep.extend(better.qualities.iter().map(|_| true));
            quality_of.extend(&better.qualities);
            better.put_into(&mut patch);
        }
        retain(&mut patch.quads, &keep);
        retain(&mut patch.surface_of, &keep);
        retain(&mut quality_of, &keep);
        retain(&mut tried, &keep);
    }
    let (patch, source) = compact(patch, before);
    Ok(Mended { patch, source, places })
}

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next() == Some(&true));
}

/// Whether a quad of this quality is to be mended. At [`INVERTED`] those of no quality are, too.
fn is_bad(quality: f64, sound: f64) -> bool {
    quality < sound || quality <= INVERTED
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// How far the farthest of some places is from quads, in mean lengths of their sides.
fn lost(places: &[DVec3], quads: &QuadPatch) -> f64 {
    let at = |v: u32| quads.positions[v as usize];
    let closest = ClosestPoint::of_quads(&quads.positions, quads.quads.iter().copied());
    let farthest = places.iter().map(|&p| closest.project(p).point.distance(p)).fold(0.0, f64::max);
    let lengths = quads.quads.iter().flat_map(sides).map(|[v, w]| at(v).distance(at(w)));
    farthest * 4.0 * quads.quads.len() as f64 / lengths.sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Sides that two of the quads share.
fn inner_sides(quads: &[[u32; 4]]) -> impl Iterator<Item = [u32; 2]> {
    let mut count = BTreeMap::<[u32; 2], usize>::new();
    for side in quads.iter().flat_map(sides) {
        *count.entry(side).or_default() += 1;
    }
    count.into_iter().filter(|(_, count)| *count == 2).map(|(side, _)| side)
}

/// The sides of a quad, the lower vertex first.
fn sides(quad: &[u32; 4]) -> [[u32; 2]; 4] {
    [0, 1, 2, 3].map(|k| mesh::sorted(quad[k], quad[(k + 1) % 4]))
}

/// Leaves out vertices of no quad.
fn compact(patch: QuadPatch, before: usize) -> (QuadPatch, Vec<u32>) {
    let mut number = vec![NONE; patch.positions.len()];
    patch.quads.iter().flatten().for_each(|&v| number[v as usize] = 0);
    let used: Vec<usize> = (0..number.len()).filter(|&v| number[v] == 0).collect();
    for (new, &v) in used.iter().enumerate() {
        number[v] = new as u32;
    }
    let compacted = QuadPatch {
        quads: patch.quads.iter().map(|quad| quad.map(|v| number[v as usize])).collect(),
        surface_of: patch.surface_of,
        positions: used.iter().map(|&v| patch.positions[v]).collect(),
        constraints: used.iter().map(|&v| patch.constraints[v]).collect(),
    };
    (compacted, used.into_iter().map(|v| if v < before { v as u32 } else { NONE }).collect())
}

/// What takes the place of a region.
struct Replacement {
    /// The quads by themselves.
    patch: QuadPatch,
    qualities: Vec<f64>,
    /// For each vertex its name in the whole, [`NONE`] for a new one.
    names: Vec<u32>,
}

impl Replacement {
    fn least(&self) -> f64 {
        least(&self.qualities)
    }

    /// Moves vertices that stay, and appends new ones and the quads; the old ones are still there.
    fn put_into(self, whole: &mut QuadPatch) {
        let mut names = self.names;
        for ((name, position), constraint) in names.iter_mut().zip(self.patch.positions).zip(self.patch.constraints) {
            if *name == NONE {
                *name = whole.positions.len() as u32;
                whole.positions.push(position);
                whole.constraints.push(constraint);
            } else {
                whole.positions[*name as usize] = position;
            }
        }
        whole.quads.extend(self.patch.quads.iter().map(|quad| quad.map(|v| names[v as usize])));
        whole.surface_of.extend(self.patch.surface_of);
    }
}

/// Quads that are changed together.
struct Region {
    /// Ascending.
    quads: Vec<usize>,
    /// How many of the quads have each side.
    sides: BTreeMap<[u32; 2], usize>,
    /// For each of its vertices the quads around it that are not in it.
    outside: BTreeMap<u32, u32>,
    /// How often its first quad was tried, this time included.
    times: u8,
}

impl Region {
    /// Regions round the worst quads that are not done with, without a common vertex.
    fn apart(patch: &QuadPatch, quality_of: &[f64], tried: &[u8], sound: f64, has_room: bool) -> Vec<Self> {
        let times = |q: usize| if has_room && quality_of[q] <= INVERTED { 2 } else { 1 };
        let mut open: Vec<usize> =
            (0..patch.quads.len()).filter(|&q| tried[q] < times(q) && is_bad(quality_of[q], sound)).collect();
        open.sort_by(|&a, &b| quality_of[a].total_cmp(&quality_of[b]));
        if open.is_empty() {
            return Vec::new();
        }
        let mut around = vec![Vec::new(); patch.positions.len()];
        for (q, corners) in patch.quads.iter().enumerate() {
            for &v in corners {
                around[v as usize].push(q);
            }
        }
        let mut regions: Vec<Self> = Vec::new();
        let mut taken = vec![false; patch.positions.len()];
        for q in open {
            if patch.quads[q].iter().any(|&v| taken[v as usize]) {
                continue;
            }
            let region = Self::around(patch, &around, q, tried[q]);
            let is_apart = region.outside.keys().all(|&v| !taken[v as usize]);
            // What a worse quad's region would change waits for it.
            region.outside.keys().for_each(|&v| taken[v as usize] = true);
            if is_apart {
                regions.push(region);
            }
            if regions.len() == AT_ONCE {
                break;
            }
        }
        regions
    }

    /// Some rings of quads around one, more where it was tried before, and more where the region would touch itself.
    fn around(patch: &QuadPatch, around: &[Vec<usize>], quad: usize, tried: u8) -> Self {
        let ring = |quads: &BTreeSet<usize>| -> BTreeSet<usize> {
            quads.iter().flat_map(|&q| patch.quads[q]).flat_map(|v| around[v as usize].iter().copied()).collect()
        };
        let mut quads = BTreeSet::from([quad]);
        for _ in 0..RINGS + MORE_RINGS * usize::from(tried) {
            quads = ring(&quads);
        }
        loop {
            let mut sides = BTreeMap::<[u32; 2], usize>::new();
            for &q in &quads {
                for side in self::sides(&patch.quads[q]) {
                    *sides.entry(side).or_default() += 1;
                }
            }
            let mut open = BTreeMap::<u32, usize>::new();
            for (side, _) in sides.iter().filter(|(_, count)| **count == 1) {
                for &v in side {
                    *open.entry(v).or_default() += 1;
                }
            }
            let pinched = open.into_iter().filter(|(_, count)| *count > 2).flat_map(|(v, _)| &around[v as usize]);
            let more: Vec<usize> = pinched.copied().filter(|q| !quads.contains(q)).collect();
            if more.is_empty() {
                let mut outside = BTreeMap::new();
                for v in quads.iter().flat_map(|&q| patch.quads[q]) {
                    let beyond = around[v as usize].iter().filter(|q| !quads.contains(q)).count();
                    outside.insert(v, beyond as u32);
                }
                return Self { quads: quads.into_iter().collect(), sides, outside, times: tried + 1 };
            }
            quads.extend(more);
        }
    }

    /// Whether no corner of a quad is held because other quads meet there.
    fn is_inside(&self, quad: [u32; 4]) -> bool {
        quad.iter().all(|v| self.outside.get(v) == Some(&0))
    }

    /// Quads that the search finds to take its place, if they may: none may lose a vertex by more than `most_lost` edge lengths.
    fn replacement(
        &self,
        whole: &QuadPatch,
        most_lost: f64,
        setting: &Setting<'_>,
        features: &BTreeSet<[u32; 2]>,
        smooth: &SmoothOptions,
        monitor: &Monitor,
    ) -> Result<Option<Replacement>, LayoutError> {
        let (own, names) = self.patch(whole);
        let places = own.positions.clone();
        let local = |v: u32| names.binary_search(&v).map_or(NONE, |i| i as u32);
        let inner: Vec<[u32; 2]> =
            self.sides.keys().filter(|side| features.contains(*side)).map(|side| side.map(local)).collect();
        let outside: Vec<u32> = names.iter().map(|v| self.outside[v]).collect();
        let own_setting = Setting { features: &inner, outside: &outside, ..*setting };
        let budget = if self.times > 1 { MORE_BUDGET * BUDGET } else { BUDGET };
        let options = ImproveOptions { depth: DEPTH, passes: 1, budget, smooth: *smooth, ..ImproveOptions::default() };
        let better = match improve(own, &own_setting, &options, monitor) {
            Ok(better) => better,
            Err(ImproveError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // What lies there cannot be changed by itself; the quad is reported if it is inverted.
            Err(_) => return Ok(None),
        };
        if lost(&places, &better.patch) > most_lost {
            // It made room by giving up a finger or a horn.
            return Ok(None);
        }
        let names: Vec<u32> = better.source.iter().map(|&v| names.get(v as usize).copied().unwrap_or(NONE)).collect();
        let beyond = self.sides_beyond(whole);
        let named = |[a, b]: [u32; 2]| mesh::sorted(names[a as usize], names[b as usize]);
        if inner_sides(&better.patch.quads).any(|side| beyond.contains(&named(side))) {
            // The search knows the region only: two of its edges would be one with edges beyond it.
            return Ok(None);
        }
        let qualities = qualities(&better.patch, setting.surfaces);
        Ok(Some(Replacement { patch: better.patch, qualities, names }))
    }

    /// Sides of other quads that join two of its vertices.
    fn sides_beyond(&self, whole: &QuadPatch) -> BTreeSet<[u32; 2]> {
        let own = |v: &u32| self.outside.contains_key(v);
        let others = (0..whole.quads.len()).filter(|q| self.quads.binary_search(q).is_err());
        others.flat_map(|q| sides(&whole.quads[q])).filter(|side| side.iter().all(own)).collect()
    }

    /// The quads by themselves, held where others meet them, and the names of their vertices.
    fn patch(&self, whole: &QuadPatch) -> (QuadPatch, Vec<u32>) {
        let names: Vec<u32> = self.outside.keys().copied().collect();
        let local = |v: u32| names.binary_search(&v).map_or(NONE, |i| i as u32);
        let held = |v: &u32| if self.outside[v] > 0 { Constraint::Fixed } else { whole.constraints[*v as usize] };
        let patch = QuadPatch {
            quads: self.quads.iter().map(|&q| whole.quads[q].map(local)).collect(),
            surface_of: self.quads.iter().map(|&q| whole.surface_of[q]).collect(),
            positions: names.iter().map(|&v| whole.positions[v as usize]).collect(),
            constraints: names.iter().map(held).collect(),
        };
        (patch, names)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_given_up_is_measured_in_edges() {
        // Two quads with sides of 2 in a plane, in place of a vertex 3 above it.
        let points = [(0., 0.), (2., 0.), (4., 0.), (0., 2.), (2., 2.), (4., 2.)];
        let patch = QuadPatch {
            quads: vec![[0, 1, 4, 3], [1, 2, 5, 4]],
            surface_of: vec![0; 2],
            positions: points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect(),
            constraints: vec![Constraint::Free; 6],
        };
        let given_up = lost(&[DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, 1.5, 3.0)], &patch);
        assert!((given_up - 1.5).abs() < 1e-12, "{given_up}");
    }

    #[test]
    fn sides_beyond_a_region_and_inside_it_are_told_apart() {
        // Three quads in a row and one more that joins the ends of the first side from beyond.
        let quads = vec![[0, 1, 2, 3], [1, 4, 5, 2], [4, 6, 7, 5], [0, 3, 8, 9]];
        let positions = vec![DVec3::ZERO; 10];
        let constraints = vec![Constraint::Free; 10];
        let patch = QuadPatch { surface_of: vec![0; 4], quads, positions, constraints };
        let outside = BTreeMap::from([0, 1, 2, 3, 4, 5].map(|v| (v, 0)));
        let region = Region { quads: vec![0, 1], sides: BTreeMap::new(), outside, times: 1 };
        assert_eq!(region.sides_beyond(&patch), BTreeSet::from([[0, 3], [4, 5]]));
        assert_eq!(inner_sides(&patch.quads[..2]).collect::<Vec<_>>(), [[1, 2]]);
    }
}
