//! The last resort for quads that no place of their vertices makes sound: another connectivity around them.
//!
//! Not in the paper. Where a patch is a sliver, or one quad spans a flat angle of a feature, smoothing ends with quads that are
//! inverted or nearly so. The quads a few rings around the worst one are then handed to the local search of
//! [`quadrangulate::improve`] with their border fixed, and its result is kept when the worst quad got better.

use crate::error::LayoutError;
use mesh::{DVec3, Monitor, NONE, TriangleMesh, split_quad};
use quadrangulate::improve::{ImproveError, ImproveOptions, QuadPatch, Setting, improve};
use std::collections::{BTreeMap, BTreeSet};
use surface::closest::ClosestPoint;
use surface::smooth::{Constraint, SmoothOptions};
use surface::smooth_star::{Reference, quad_quality};

/// Quads below this quality are mended; in the coarsest layout, where every new irregular vertex sends lines over the whole
/// mesh, only inverted ones.
pub(crate) const SOUND: f64 = 0.25;
pub(crate) const INVERTED: f64 = 0.0;
/// Rings of quads round a bad one that may change.
const RINGS: usize = 3;
/// An inverted quad that cannot be mended so is tried again with more rings and more states to look at.
const MORE_RINGS: usize = 2;
const MORE_BUDGET: usize = 2;
/// No vertex of what is replaced may end up farther from what replaces it than this, in edge lengths.
const MOST_LOST: f64 = 1.5;
/// Places mended at most, and those tried in vain one after another before the rest is left: a surface without room for
/// its quads has bad ones everywhere.
const MOST_PLACES: usize = 60;
const MOST_IN_VAIN: usize = 12;
/// For quads that are not inverted the number of quads changes by one in so many at most.
const MOST_DRIFT: usize = 50;
/// States that the search looks at in one place. More are no better: many places, each looked at briefly, mend more in less time.
const BUDGET: usize = 250;

/// [`quality`] of each quad.
pub(crate) fn qualities(patch: &QuadPatch, surfaces: &[&dyn Reference]) -> Vec<f64> {
    let quads = patch.quads.iter().zip(&patch.surface_of);
    quads
        .map(|(quad, &surface)| quality(quad.map(|v| patch.positions[v as usize]), surfaces[surface as usize]))
        .collect()
}

/// Quality of a quad against the normal of its surface under its middle.
pub(crate) fn quality(p: [DVec3; 4], surface: &dyn Reference) -> f64 {
    quad_quality(p, surface.project(p.iter().sum::<DVec3>() / 4.0).normal)
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
pub(crate) fn mend(
    mut patch: QuadPatch,
    setting: &Setting<'_>,
    smooth: &SmoothOptions,
    sound: f64,
    monitor: &Monitor,
) -> Result<Mended, LayoutError> {
    let (before, wanted) = (patch.positions.len(), patch.quads.len());
    let features: BTreeSet<[u32; 2]> = setting.features.iter().map(|&[a, b]| mesh::sorted(a, b)).collect();
    let mut quality_of = qualities(&patch, setting.surfaces);
    let mut tried = vec![0; patch.quads.len()];
    let (mut places, mut in_vain) = (0, 0);
    for _ in 0..MOST_PLACES {
        monitor.check()?;
        if in_vain == MOST_IN_VAIN {
            break;
        }
        in_vain += 1;
        let times = |q: usize| if quality_of[q] <= INVERTED { 2 } else { 1 };
        let open = (0..patch.quads.len()).filter(|&q| tried[q] < times(q) && quality_of[q] < sound);
        let Some(worst) = open.min_by(|&a, &b| quality_of[a].total_cmp(&quality_of[b])) else { break };
        let again = tried[worst];
        tried[worst] += 1;
        let region = Region::around(&patch, worst, RINGS + MORE_RINGS * again);
        let (own, names) = region.patch(&patch);
        let own_places = own.positions.clone();
        let local = |v: u32| names.binary_search(&v).map_or(NONE, |i| i as u32);
        let inner: Vec<[u32; 2]> = region.sides.keys().filter(|side| features.contains(*side)).copied().collect();
        let inner: Vec<[u32; 2]> = inner.into_iter().map(|side| side.map(local)).collect();
        let outside: Vec<u32> = names.iter().map(|v| region.outside[v]).collect();
        let own_setting = Setting { features: &inner, outside: &outside, ..*setting };
        let budget = if again > 0 { MORE_BUDGET * BUDGET } else { BUDGET };
        let options = ImproveOptions { depth: 3, passes: 2, budget, smooth: *smooth, ..ImproveOptions::default() };
        let better = match improve(own, &own_setting, &options, monitor) {
            Ok(better) => better,
            Err(ImproveError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // What lies there cannot be changed by itself; the quad is reported if it is inverted.
            Err(_) => continue,
        };
        let found = qualities(&better.patch, setting.surfaces);
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let old = least(&mut region.quads.iter().map(|&q| quality_of[q]));
        if least(&mut found.iter().copied()) <= old + 1e-6 {
            continue;
        }
        if lost(&own_places, &better.patch) > MOST_LOST {
            // It made room by giving up a finger or a horn.
            continue;
        }
        let count = patch.quads.len() + better.patch.quads.len() - region.quads.len();
        if old > INVERTED && count.abs_diff(wanted) > patch.quads.len().abs_diff(wanted).max(wanted / MOST_DRIFT) {
            continue;
        }
        let beyond = region.sides_beyond(&patch);
        let name = |v: u32| names.get(better.source[v as usize] as usize).copied().unwrap_or(NONE);
        if inner_sides(&better.patch.quads).any(|side| {
            beyond.contains(&{
                let [a, b] = side.map(name);
                mesh::sorted(a, b)
            })
        }) {
            // The search knows the region only: two of its edges would be one with edges beyond it.
            continue;
        }
        places += 1;
        in_vain = 0;
        let global: Vec<u32> = (0..better.source.len())
            .map(|new| {
                let Some(&v) = names.get(better.source[new] as usize) else {
                    patch.positions.push(better.patch.positions[new]);
                    patch.constraints.push(better.patch.constraints[new]);
                    return patch.positions.len() as u32 - 1;
                };
                patch.positions[v as usize] = better.patch.positions[new];
                v
            })
            .collect();
        let mut keep = vec![true; patch.quads.len()];
        region.quads.iter().for_each(|&q| keep[q] = false);
        let kept = |q: &usize| keep[*q];
        let pick = (0..patch.quads.len()).filter(kept);
        tried = pick.clone().map(|q| tried[q]).collect();
        quality_of = pick.clone().map(|q| quality_of[q]).collect();
        patch.surface_of = pick.clone().map(|q| patch.surface_of[q]).collect();
        patch.quads = pick.map(|q| patch.quads[q]).collect();
        patch.quads.extend(better.patch.quads.iter().map(|quad| quad.map(|v| global[v as usize])));
        patch.surface_of.extend(&better.patch.surface_of);
        tried.extend(found.iter().map(|_| 1));
        quality_of.extend(found);
    }
    let (patch, source) = compact(patch, before);
    Ok(Mended { patch, source, places })
}

/// How far the farthest of some places is from quads, in mean lengths of their sides.
fn lost(places: &[DVec3], quads: &QuadPatch) -> f64 {
    let at = |v: u32| quads.positions[v as usize];
    let halves = |quad: &[u32; 4]| split_quad(quad.map(at)).map(|half| half.map(|k| quad[k]));
    let triangles: Vec<[u32; 3]> = quads.quads.iter().flat_map(halves).collect();
    let closest = ClosestPoint::new(&TriangleMesh { positions: quads.positions.clone(), triangles });
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

/// Quads that are changed together.
struct Region {
    /// Ascending.
    quads: Vec<usize>,
    /// How many of the quads have each side.
    sides: BTreeMap<[u32; 2], usize>,
    /// For each of its vertices the quads around it that are not in it.
    outside: BTreeMap<u32, u32>,
}

impl Region {
    /// Some rings of quads around one, and more where the region would touch itself.
    fn around(patch: &QuadPatch, quad: usize, rings: usize) -> Self {
        let mut around = vec![Vec::new(); patch.positions.len()];
        for (q, corners) in patch.quads.iter().enumerate() {
            for &v in corners {
                around[v as usize].push(q);
            }
        }
        let ring = |quads: &BTreeSet<usize>| -> BTreeSet<usize> {
            quads.iter().flat_map(|&q| patch.quads[q]).flat_map(|v| around[v as usize].iter().copied()).collect()
        };
        let mut quads = BTreeSet::from([quad]);
        for _ in 0..rings {
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
                return Self { quads: quads.into_iter().collect(), sides, outside };
            }
            quads.extend(more);
        }
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
        let region = Region { quads: vec![0, 1], sides: BTreeMap::new(), outside };
        assert_eq!(region.sides_beyond(&patch), BTreeSet::from([[0, 3], [4, 5]]));
        assert_eq!(inner_sides(&patch.quads[..2]).collect::<Vec<_>>(), [[1, 2]]);
    }
}
