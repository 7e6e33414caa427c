//! A layout of few patches traced over finished quads, and quads laid over it anew.
//!
//! Not in Daniels et al. 2011, whose layout has a vertex for every site, and each may become an irregular one. Here the parts
//! between features are divided once more, now into disks of three to six sides along a cross field that follows the features
//! (`QuadMixer`, section 3.2.1, see [`quadrangulate::layout`]): rows run along the features, and irregular vertices remain where
//! the field is singular or counts do not meet. The quads at hand are what is traced on, so that features, their corners and
//! the topology are theirs. The result is taken only where it is better, see [`Work::is_better`].

mod compare;
mod lay;
mod plan;
mod stay;

use crate::error::LayoutError;
use crate::fill::{Filled, Place, doubled};
use crate::work::{TIMES, Wanted, Work};
use mesh::{DVec3, Monitor, NONE, Topology, TriangleMesh, sorted, split_quad};
use plan::{Plan, Traced};
use quadrangulate::layout::{self, CornerAngles, LayoutOptions, Undivided, parts, trace_along, trace_layout};
use rayon::prelude::*;
use stay::Stay;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use surface::closest::ClosestPoint;
use surface::smooth::SmoothOptions;

/// Corners of features sharper than 135 degrees get one quad, and so on by quarters, but for those that may have four in all with one
/// that is up to 72 degrees off: a fifth of the irregular vertices of a goat's head.
const CORNERS: CornerAngles =
    CornerAngles { convex: PI * 0.75, concave: PI * 1.25, slit: PI * 1.75, round: PI / 3.6, slack: 0.8, fillet: 0.0 };
/// Bends within so many edges are one: a fillet of a tooth. With 1 a gear and a wing nut, whose fillets are longer, had a fifth more irregular
/// vertices.
const FILLET: f64 = 0.5;
/// Patches with sides of more edges than this are divided where a trace allows it. Without a bound the rows of long patches shear: mean
/// angle deviation 14 instead of 8 degrees on a goat's head, 11 instead of 4 on a fish; bounded by 6 there were a tenth more
/// irregular vertices.
const LONGEST: f64 = 12.0;
/// Rounds of the pull before traced quads are refilled.
const ROUNDS_BEFORE_REFILLING: usize = 10;
/// Times that quads are laid with more and more old ones that stay, where the new ones do not stand for them.
const TRIES: usize = 3;
/// Quads that finishing makes worse than this are taken back to where they were before.
const WEAK: f64 = 0.1;
/// Rings of quads around those that cannot be laid anew that stay as well.
const RINGS: usize = 2;
/// Share of the features that finishing may gain, where vertices do not stay on the bends from the start and where they do.
const GAINED: [f64; 2] = [0.005, 0.02];
/// So few quads that are turned over finishing turns back, as a rule, or they are mended.
const MENDED: usize = 1;
/// Rings of quads around those that are turned over that are finished first, to see whether they stay so.
const PROBE_RINGS: usize = 6;
/// Old quads stay where new ones are further from them than this, in edge lengths: the tip of a finger that few quads would cover.
const MOST_LOST: f64 = 0.7;
/// And where finished ones are further from the surface than this, as a fraction of its diagonal, and than the old ones are.
const MOST_APART: f64 = 0.0098;
/// Quads are not laid anew where more than one in so many is inverted at first.
const MOST_FOLDED: usize = 25;
/// Rails with fewer edges than this times what their bends need have vertices on the bends from the start; where edges do not follow
/// the features then, all have. Quads are less square for it, by 0.6 degrees on a gear.
const ROOM: f64 = 1.3;

/// Quads to be laid anew.
pub(crate) struct Remaking<'b, 'a> {
    pub work: &'b Work<'a>,
    pub wanted: &'b Wanted<'b>,
    /// Edge lengths wanted at the vertices of the surface but for bends, scene units.
    pub plain: &'b [f64],
    /// Shortest edge that bends of features may ask for, in wanted ones.
    pub shortest: f64,
    /// Edges that bends are followed with, in wanted ones: longer where there are so many bends that little would be left for the rest.
    pub bend_edge: f64,
    pub smooth: &'b SmoothOptions,
    /// Quality below which quads are mended.
    pub sound: f64,
    /// Quads wanted, when a number is.
    pub target: Option<f64>,
}

/// A division of the quads that do not stay into parts between features.
struct Parts<'b, 'a> {
    work: &'b Work<'a>,
    wanted: &'b Wanted<'b>,
    plain: &'b [f64],
    shortest: f64,
    bend_edge: f64,
    /// Quads wanted in place of those that do not stay.
    target: f64,
    /// The part of each quad, [`NONE`] for those that stay as they are.
    part_of: Vec<u32>,
}

/// Quads laid anew and finished.
pub(crate) struct Remade<'a> {
    pub work: Work<'a>,
    /// Places mended, and quads inverted still.
    pub done: (usize, usize),
    /// Points where the quads are further from the surface than they may.
    pub lost: usize,
    /// Whether they follow the features.
    pub follows: bool,
}

/// Quads turned over, points too far from the surface, and whether features are not followed: the lower the better.
type Rank = (usize, usize, bool);
/// The highest of quads that can be taken.
const SOUND: Rank = (0, 0, false);

impl Remade<'_> {
    fn rank(&self) -> Rank {
        (self.done.1, self.lost, !self.follows)
    }
}

impl<'a> Remaking<'_, 'a> {
    /// The quads laid anew over a traced layout and finished, but for some that stay as they are; `None` where those are most, or
    /// where it shows before they are finished that the new ones are no better.
    ///
    /// # Errors
    /// [`LayoutError::Cancelled`].
    pub fn remade(&self, monitor: &Monitor) -> Result<Option<Remade<'a>>, LayoutError> {
        let Self { work, wanted, .. } = self;
        let mut on_rail = vec![false; work.filled.positions.len()];
        work.features().iter().flatten().for_each(|&v| on_rail[v as usize] = true);
        let held = |v: usize| matches!(work.filled.places[v], Place::Corner(c) if work.rails().corner[c as usize]);
        if (0..on_rail.len()).any(|v| held(v) && !on_rail[v]) {
            // Marked vertices inside a part would be lost.
            return Ok(None);
        }
        let whole = work.triangles();
        let under = ClosestPoint::new(&whole);
        let Ok(field) = layout::field(&whole, &work.features(), &self.corners()) else {
            // It needs triangles that have an area, and something to follow in every component or in none.
            return Ok(None);
        };
        let old = Old { lengths: work.lengths(wanted), whole, under, field };
        let mut stay = Stay::new(work.filled.positions.len(), &work.filled.quads);
        let surface = ClosestPoint::new(&work.base().surface);
        let most = MOST_APART * work.base().surface.to_polygons().diagonal();
        let most = work.apart(&surface, most).into_iter().fold(most, |most, (_, distance)| most.max(distance));
        let lost =
            |quads: &Work<'_>| -> Vec<DVec3> { quads.apart(&surface, most).into_iter().map(|(p, _)| p).collect() };
        let mut best: Option<Remade<'a>> = None;
        let mut set_aside = None;
        let (mut division, mut room) = (None, ROOM);
        // More old quads stay at points; whether that made a difference.
        let grow = |stay: &mut Stay<'_>, points: &[DVec3]| {
            let before = stay.count();
            let seeds: Vec<usize> = points.iter().map(|&p| old.under.project(p).triangle as usize / 2).collect();
            stay.grow(&seeds, RINGS);
            stay.count() > before
        };
        for attempt in 0..=TRIES {
            let Some((parts, traced, plan)) = (match division.take() {
                None => self.divided(&old, &mut stay, monitor)?,
                found => found,
            }) else {
                break;
            };
            let Some(filled) = parts.lay(&traced, &plan, room, monitor)? else { break };
            let mut remade = work.with(filled, &parts.charts());
            if remade.inverted().len() > remade.filled.quads.len() / MOST_FOLDED {
                // Walls so thin that the maps fold over them.
                break;
            }
            // Vertices of bent features slide to where quads are square before they are put on the bends.
            remade.let_go();
            let first = Wanted { rounds: ROUNDS_BEFORE_REFILLING, ..**wanted };
            remade.relax(&vec![true; remade.filled.positions.len()], &first, self.smooth, 0, monitor)?;
            remade.refill(&vec![false; remade.filled.quads.len()], monitor)?;
            remade.let_go();
            if attempt == 0 && grow(&mut stay, &self.hopeless(&remade, monitor)?) {
                set_aside = Some(remade);
                continue;
            }
            if !remade.promises(work, self.target) {
                break;
            }
            if !remade.follows(work, GAINED[usize::from(room.is_infinite())]) {
                if room.is_infinite() {
                    break;
                }
                (division, room) = (Some((parts, traced, plan)), f64::INFINITY);
                continue;
            }
            let (remade, bad) = self.finished(remade, &lost, monitor)?;
            let (is_sound, follows) = (bad.is_empty(), remade.follows);
            if best.as_ref().is_none_or(|best| remade.rank() <= best.rank()) {
                best = Some(remade);
            }
            if is_sound {
                if follows || room.is_infinite() {
                    break;
                }
                division = Some((parts, traced, plan));
            } else if !grow(&mut stay, &bad) {
                // They are beside quads that stay already.
                break;
            }
            if !follows {
                room = f64::INFINITY;
            }
        }
        if best.as_ref().is_none_or(|best| best.rank() > SOUND)
            && let Some(remade) = set_aside
            && remade.promises(work, self.target)
        {
            let (remade, _) = self.finished(remade, &lost, monitor)?;
            if best.as_ref().is_none_or(|best| remade.rank() < best.rank()) {
                best = Some(remade);
            }
        }
        Ok(best)
    }

    /// Quads that are turned over, and stay so where only what lies around them is finished: as a rule they are so in the end.
    fn hopeless(&self, remade: &Work<'a>, monitor: &Monitor) -> Result<Vec<DVec3>, LayoutError> {
        let found = remade.inverted();
        if found.len() <= MENDED {
            return Ok(vec![]);
        }
        let mut probe = remade.clone();
        let near = probe.around(&probe.nearest(&found), PROBE_RINGS);
        // Without the pull, which has no room between what is held.
        probe.relax(&near, &Wanted { rounds: 0, ..*self.wanted }, self.smooth, 1, monitor)?;
        let still = probe.inverted();
        Ok(if still.len() < found.len() { still } else { found })
    }

    /// Quads finished, and where they are turned over or `lost`.
    fn finished(
        &self,
        mut remade: Work<'a>,
        lost: &impl Fn(&Work<'_>) -> Vec<DVec3>,
        monitor: &Monitor,
    ) -> Result<(Remade<'a>, Vec<DVec3>), LayoutError> {
        let before = remade.filled.positions.clone();
        remade.relax(&vec![true; before.len()], self.wanted, self.smooth, TIMES, monitor)?;
        let bad = |work: &Work<'_>, off: &[DVec3]| (work.inverted().len() + off.len(), work.weak());
        // What is put back may leave no room for what is not.
        let mut off = lost(&remade);
        let mut least = (bad(&remade, &off), remade.clone());
        for bends in [false, true] {
            if least.0 == (0, 0) || !remade.put_back(&before, (WEAK, &off), (RINGS, bends), self.smooth, monitor)? {
                break;
            }
            off = lost(&remade);
            let now = bad(&remade, &off);
            if now < least.0 {
                least = (now, remade.clone());
            }
        }
        remade = least.1;
        let done = remade.mend_all(self.smooth, self.sound, true, monitor)?;
        let lost = lost(&remade);
        let follows = remade.follows(self.work, 0.0);
        let mut bad = remade.inverted();
        bad.extend(&lost);
        Ok((Remade { work: remade, done, lost: lost.len(), follows }, bad))
    }

    fn corners(&self) -> CornerAngles {
        CornerAngles { fillet: FILLET * self.wanted.edge_length, ..CORNERS }
    }

    /// A layout and counts for the quads but for those that stay, which become more where the new ones do not stand for them.
    fn divided(
        &self,
        old: &Old,
        stay: &mut Stay<'_>,
        monitor: &Monitor,
    ) -> Result<Option<(Parts<'_, 'a>, Traced, Plan)>, LayoutError> {
        let Self { work, wanted, plain, shortest, bend_edge, target, .. } = *self;
        let Old { whole, under, lengths, field } = old;
        let mut options = LayoutOptions {
            corners: self.corners(),
            refinements: 0,
            longest: LONGEST * wanted.edge_length,
            regular: true,
            partial: true,
            ..LayoutOptions::default()
        };
        let size_at = |(v, &p): (usize, &DVec3)| {
            lengths.get(v).copied().unwrap_or_else(|| {
                let found = under.project(p);
                let corners = whole.triangles[found.triangle as usize];
                (0..3).map(|k| found.barycentric[k] * lengths[corners[k] as usize]).sum()
            })
        };
        let all = work.filled.quads.len();
        let mut bends = false;
        let mut attempt = 0;
        while attempt < TRIES {
            attempt += 1;
            if stay.count() > all / 2 {
                return Ok(None);
            }
            let moves: Vec<usize> = (0..all).filter(|&q| !stay.quads[q]).collect();
            let triangles = moves.iter().flat_map(|&q| [whole.triangles[2 * q], whole.triangles[2 * q + 1]]).collect();
            let mesh = TriangleMesh { positions: whole.positions.clone(), triangles };
            let edge = |t: &[u32; 3], k: usize| sorted(t[k], t[(k + 1) % 3]);
            let own: BTreeSet<[u32; 2]> = mesh.triangles.iter().flat_map(|t| (0..3).map(|k| edge(t, k))).collect();
            let mut features = work.features();
            features.retain(|&[a, b]| own.contains(&sorted(a, b)));
            // What stays does not bend the field where that works, so that the rest is divided as before.
            let traced = if bends {
                trace_layout(&mesh, &features, &options, monitor)
            } else {
                let crosses: Vec<DVec3> = moves.iter().flat_map(|&q| [field[2 * q], field[2 * q + 1]]).collect();
                trace_along(&mesh, &features, &crosses, &options, monitor)
            };
            let layout = match traced {
                Ok(layout) => layout,
                Err(layout::LayoutError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(_) => return Ok(None),
            };
            let parts: Vec<u32> = parts(&mesh, &features).into_iter().step_by(2).collect();
            let stuck = |undivided: &Undivided| -> Vec<usize> {
                let quads: BTreeSet<usize> = undivided.triangles.iter().map(|t| moves[*t as usize / 2]).collect();
                let all = parts.iter().filter(|part| **part == undivided.part).count();
                if quads.len() <= all / 2 { quads.into_iter().collect() } else { vec![] }
            };
            let stuck: Vec<usize> = layout.undivided.iter().flat_map(stuck).collect();
            if !stuck.is_empty() && attempt < TRIES {
                // Without those the rest can be divided.
                stay.grow(&stuck, 0);
                continue;
            }
            let mut part_of = vec![NONE; all];
            for (part, &q) in parts.into_iter().zip(&moves) {
                stay.quads[q] = layout.undivided.iter().any(|undivided| undivided.part == part);
                part_of[q] = if stay.quads[q] { NONE } else { part };
            }
            let sizes = layout.mesh.positions.iter().enumerate().map(size_at).collect();
            let target = target.unwrap_or(all as f64) - stay.count() as f64;
            let parts = Parts { work, wanted, plain, shortest, bend_edge, target, part_of };
            let traced = parts.traced(layout, sizes);
            let mut laid = None;
            if let Some(plan) = parts.plan(&traced, monitor)? {
                laid = parts.lay(&traced, &plan, ROOM, monitor)?.map(|filled| (plan, filled));
            }
            let Some((plan, filled)) = laid else {
                if !options.regular {
                    return Ok(None);
                }
                // Then what stays does bend it; and where borders zigzag, regular parts are more than the quads have room for.
                options.regular = !bends && stay.count() > 0;
                bends = true;
                attempt -= 1;
                continue;
            };
            let is_doubled = !doubled(&filled).is_empty();
            if !is_doubled && filled.topology() != work.filled.topology() {
                // Patches do not close the surface: a narrow one was lost along a feature.
                return Ok(None);
            }
            let bad = parts.bad(&filled, lengths, stay);
            if bad.is_empty() || attempt == TRIES && !is_doubled {
                // What is lost at last may be reached when they are finished.
                return Ok(Some((parts, traced, plan)));
            }
            stay.grow(&bad, RINGS);
        }
        Ok(None)
    }
}

/// The quads at hand as a surface.
struct Old {
    /// Two triangles for each quad.
    whole: TriangleMesh,
    under: ClosestPoint,
    /// Edge length wanted at each vertex.
    lengths: Vec<f64>,
    /// A direction of the cross of each triangle.
    field: Vec<DVec3>,
}

impl Filled {
    /// Euler characteristic and number of borders.
    fn topology(&self) -> (i64, usize) {
        let topology = Topology::new(self.positions.len(), &self.quads);
        let used = topology.outgoing.iter().filter(|h| **h != NONE).count() as i64;
        (used - topology.edges().count() as i64 + self.quads.len() as i64, topology.border_loops().len())
    }
}

impl Work<'_> {
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

impl Parts<'_, '_> {
    /// Number of parts that are laid anew.
    fn parts(&self) -> u32 {
        self.part_of.iter().filter(|part| **part != NONE).max().map_or(0, |last| last + 1)
    }

    /// The chart of each part, then those of quads that stay.
    fn charts(&self) -> Vec<u32> {
        let of_quads = self.work.charts_of_quads();
        let mut charts = vec![0; self.parts() as usize];
        self.part_of
            .iter()
            .zip(of_quads)
            .filter(|(part, _)| **part != NONE)
            .for_each(|(p, &c)| charts[*p as usize] = c);
        charts.extend(0..of_quads.iter().max().map_or(0, |last| last + 1));
        charts
    }

    /// Where new quads do not stand for old ones: of each stretch of quads far from the new ones of their part the farthest one, and
    /// parts whose new quads share edges.
    fn bad(&self, made: &Filled, lengths: &[f64], stay: &Stay<'_>) -> Vec<usize> {
        let old = &self.work.filled;
        let doubled = doubled(made);
        let parts: BTreeSet<u32> = self.part_of.iter().copied().filter(|part| *part != NONE).collect();
        let bad = |part: u32| -> Vec<usize> {
            let own: Vec<usize> = (0..self.part_of.len()).filter(|q| self.part_of[*q] == part).collect();
            if doubled.contains(&part) {
                return own;
            }
            let new = made.quads.iter().zip(&made.patch_of).filter(|(_, p)| **p == part);
            let closest = ClosestPoint::of_quads(&made.positions, new.map(|(quad, _)| *quad));
            let far = |&q: &usize| {
                let off = |v: u32| closest.project(old.positions[v as usize]).distance / lengths[v as usize];
                old.quads[q].map(off).into_iter().fold(0.0, f64::max)
            };
            let far: Vec<f64> = own.par_iter().map(far).collect();
            let lost: BTreeMap<usize, f64> = own.into_iter().zip(far).filter(|(_, far)| *far > MOST_LOST).collect();
            stay.farthest(&lost)
        };
        parts.into_iter().flat_map(bad).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_that_was_lost_shows_in_the_topology() {
        let corner = |i: u32, j: u32| 4 * i + j;
        let cells = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        let quads: Vec<[u32; 4]> =
            cells.map(|(i, j)| [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]).collect();
        let whole = Filled { positions: vec![DVec3::ZERO; 16], quads, ..Filled::default() };
        let mut less = whole.clone();
        less.quads.remove(4);
        assert_eq!([&whole, &less].map(Filled::topology), [(1, 1), (0, 2)]);
    }
}
