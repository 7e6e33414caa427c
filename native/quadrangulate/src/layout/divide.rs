//! Chooses the next trace of a region: first one that relieves a concave corner, then one that makes a part acceptable.
//!
//! The paper traces every concave corner of a region at once and resolves conflicts; then it splits patches with a dense set
//! of candidates. Here each trace is cut before the next one is looked for, so that two traces can never meet tangentially:
//! a trace ends where it reaches another, and may do so only within 45 degrees of the corner direction that the other
//! offers there, which is the sheet test of M2. Orthogonal crossings arise where traces land from both sides on one vertex.
//! The choice adds to the paper's "shortest first" what the cut would leave: it must bring the region closer to disks of 3 to 6
//! sides, among equals those win whose sides are as many as the singularities inside ask for, then balanced parts of four sides.

use super::canvas::Canvas;
use super::preview::{Crossing, Preview};
use super::region::{Bend, Outline, Region, Shape, Share};
use super::{Fault, LayoutOptions};
use mesh::{Cancelled, Monitor};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use surface::tracing::{Trace, TraceOptions, Visit};

/// Starts tried at most in one region, evenly spread, when any flat vertex would do.
const STARTS: usize = 48;
/// But so many on each side.
const STARTS_A_SIDE: usize = 6;
/// Cuts evaluated in one region, cheapest traces first; more, up to the second number, while none of them helps.
const CUTS: [usize; 2] = [96, 400];
/// Traces of which the cheapest are wanted that are looked for at the same time.
const TOGETHER: usize = 4;

/// Ends of sides nearer than this to each other, in edge lengths, are better one.
const MISS: f64 = 1.5;

/// Length of the first cut where the field is regular, in edge lengths.
const SLIT: f64 = 4.0;

/// What became of a region.
pub(super) enum Step {
    /// It is a patch.
    Patch,
    /// It was cut into these parts.
    Parts(Vec<Region>),
    /// No trace could relieve a concave corner: this one, a place, has a quarter less now.
    Flattened(u32),
    /// Nothing can be done.
    Stuck(Fault),
}

struct Candidate {
    trace: Trace,
    share: Share,
}

/// Takes one step towards patches.
pub(super) fn divide(
    region: &Region,
    canvas: &mut Canvas,
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<Step, Cancelled> {
    let outline = Outline::new(canvas, region);
    let index = outline.index(canvas);
    let shape = Shape::of(&outline.loops, outline.euler_characteristic, index, options);
    let fault = shape.fault();
    if fault.is_none() && shape.soft() == 0 {
        return Ok(Step::Patch);
    }
    let distances = distances(&outline, canvas);
    let regular = options.regular;
    // First only the cheapest traces of concave corners, then all, then wider cones that may also crowd other sides' ends.
    let tries = [(1.0, true, true), (1.0, true, false), (1.5, false, false), (2.0, false, false)];
    for (widening, strict, hasty) in tries {
        if hasty && shape.concave == 0 {
            continue;
        }
        let cone = (options.trace.cone * widening).min(FRAC_PI_2);
        let trace_options = TraceOptions { cone, ..options.trace };
        let search = Search {
            canvas,
            outline: &outline,
            options: &trace_options,
            distances: &distances,
            regular,
            strict,
            hasty,
        };
        let candidates = search.candidates(shape.concave > 0, monitor)?;
        let most = if strict { CUTS } else { [usize::MAX; 2] };
        if let Some(chosen) = best_cut(&outline, shape, &candidates, most, canvas, options, monitor)? {
            return Ok(Step::Parts(canvas.cut(region, &chosen.trace, chosen.share)));
        }
        // A round side is no reason to bend the rules.
        if fault.is_none() {
            return Ok(Step::Patch);
        }
    }
    let border = || outline.loops.iter().flatten();
    let flat = || border().filter(|bend| bend.quarters == 2).min_by(|a, b| a.angle.total_cmp(&b.angle));
    let least = match fault {
        Some(Fault::Concave) => border().filter(|bend| bend.quarters > 2).min_by_key(|bend| bend.vertex),
        // A disk with two corners is given a third.
        Some(Fault::Sides { count }) if count < 3 && options.partial => flat(),
        _ => None,
    };
    if let Some(bend) = least {
        canvas.quarters[bend.vertex as usize] -= 1;
        return Ok(Step::Flattened(bend.place));
    }
    Ok(fault.map_or(Step::Patch, Step::Stuck))
}

/// Badness with the sides that the field does not ask for, those alone, and what is soft: the order of cuts.
type Rank = (usize, usize, usize);

/// The best cut, if one helps.
fn best_cut<'c>(
    outline: &Outline,
    shape: Shape,
    candidates: &'c [Candidate],
    most: [usize; 2],
    canvas: &mut Canvas,
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<Option<&'c Candidate>, Cancelled> {
    let mut best: Option<(Rank, f64, &Candidate)> = None;
    for (tried, candidate) in candidates.iter().enumerate() {
        monitor.check()?;
        // No later candidate can cost less than this one does before its penalties and its reward for balance.
        let least = if shape.concave > 0 { candidate.trace.cost } else { candidate.trace.cost / 0.6 };
        if tried >= most[usize::from(best.is_none())]
            || best.as_ref().is_some_and(|(rank, cost, ..)| *rank == (0, 0, 0) && *cost <= least)
        {
            break;
        }
        let failed = (canvas.place[candidate.trace.start() as usize], candidate.share.start[0]);
        let Some(cut) = Preview::new(canvas, outline, &candidate.trace, candidate.share, options) else {
            canvas.failed.insert(failed);
            continue;
        };
        let (rank, cost) = if shape.concave > 0 {
            if cut.concave >= shape.concave {
                canvas.failed.insert(failed);
                continue;
            }
            let astray = cut.astray.saturating_sub(shape.astray);
            let worse = cut.badness.saturating_sub(shape.badness()) + astray;
            ((0, 0, 0), candidate.trace.cost * (1.0 + 0.5 * worse as f64))
        } else {
            let is_no_gain = (cut.badness, cut.soft) >= (shape.badness(), shape.soft());
            // A corner that the field does not have is an irregular vertex: no way to shorten a side.
            if is_no_gain || cut.badness == shape.badness() && cut.astray > shape.astray {
                continue;
            }
            let cost = candidate.trace.cost * (1.0 + 0.1 * cut.irregular as f64) / (0.1 + cut.balance);
            ((cut.badness + cut.astray, cut.astray, cut.soft), cost)
        };
        if best.as_ref().is_none_or(|(found, least, ..)| (rank, cost) < (*found, *least)) {
            best = Some((rank, cost, candidate));
        }
    }
    Ok(best.map(|(.., chosen)| chosen))
}

struct Search<'a> {
    canvas: &'a Canvas,
    outline: &'a Outline,
    options: &'a TraceOptions,
    /// See [`distances`].
    distances: &'a [f64],
    /// See [`LayoutOptions::regular`].
    regular: bool,
    strict: bool,
    hasty: bool,
}

impl Search<'_> {
    /// Traces from the concave corners, or from flat vertices, cheapest first.
    fn candidates(&self, concave: bool, monitor: &Monitor) -> Result<Vec<Candidate>, Cancelled> {
        let quarters = &self.canvas.quarters;
        let eligible = |v: u32| {
            let q = quarters[v as usize];
            if concave { q > 2 } else { q == 2 && !(self.strict && self.is_crowded(v)) }
        };
        let starts: Vec<u32> = if concave {
            self.border().filter(|&v| eligible(v)).collect()
        } else {
            let mut sides = if self.regular { self.outline.sides() } else { vec![self.border().collect()] };
            for side in &mut sides {
                side.retain(|&v| eligible(v));
            }
            let all: usize = sides.iter().map(Vec::len).sum();
            let some = |side: Vec<u32>| {
                let share = (STARTS * side.len()).div_ceil(all.max(1)).max(STARTS_A_SIDE);
                let stride = side.len().div_ceil(share).max(1);
                let goes_on = |v: u32| self.regular && self.distances[v as usize] == 0.0;
                side.into_iter().enumerate().filter(move |&(k, v)| k % stride == 0 || goes_on(v)).map(|(_, v)| v)
            };
            sides.into_iter().flat_map(some).collect()
        };
        let failed = |&(start, j): &(u32, u8)| {
            self.strict && concave && self.canvas.failed.contains(&(self.canvas.place[start as usize], j))
        };
        let ways = starts.into_iter().flat_map(|start| (1..quarters[start as usize]).map(move |j| (start, j)));
        let ways: Vec<(u32, u8)> = ways.filter(|way| !failed(way)).collect();
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut limit = f64::INFINITY;
        for some in ways.chunks(if self.hasty { TOGETHER } else { usize::MAX }) {
            let find = |&(start, j): &(u32, u8)| {
                monitor.check()?;
                let q = quarters[start as usize];
                let graph = &self.canvas.graph;
                let direction = graph.angle(start) * f64::from(j) / f64::from(q);
                let found = graph.trace(start, direction, self.options, limit, |v, back| self.visit(v, back, start));
                Ok(found.map(|trace| {
                    let end = trace.end();
                    let (i, _) = self.quarter_of(end, trace.arrival());
                    let share = Share { start: [j, q - j], end: [i, quarters[end as usize] - i] };
                    Candidate { trace, share }
                }))
            };
            let found: Vec<Option<Candidate>> = some.par_iter().map(find).collect::<Result<_, Cancelled>>()?;
            for candidate in found.into_iter().flatten() {
                // As if they had been traced one after another.
                if candidate.trace.cost > limit {
                    continue;
                }
                if self.hasty {
                    limit = limit.min(1.5 * candidate.trace.cost);
                }
                candidates.push(candidate);
            }
        }
        candidates.sort_by(|a, b| a.trace.cost.total_cmp(&b.trace.cost));
        Ok(candidates)
    }

    /// The vertices of the border.
    fn border(&self) -> impl Iterator<Item = u32> {
        self.outline.loops.iter().flatten().map(|bend| bend.vertex)
    }

    /// The direction of a border vertex closest to an angle, as a number of quarters, and how many quarters off it is.
    fn quarter_of(&self, v: u32, angle: f64) -> (u8, f64) {
        let q = self.canvas.quarters[v as usize];
        let exact = angle / self.canvas.graph.angle(v) * f64::from(q);
        let nearest = (exact.round() as u8).clamp(1, q - 1);
        (nearest, (exact - f64::from(nearest)).abs())
    }

    fn visit(&self, v: u32, back: f64, start: u32) -> Visit {
        match self.canvas.quarters[v as usize] {
            0 => return Visit::Pass,
            1 => return Visit::Block,
            _ => {}
        }
        let (_, off) = self.quarter_of(v, back);
        if off > self.options.cone / FRAC_PI_2 || self.strict && self.is_crowded(v) {
            return Visit::Block;
        }
        // Traces that miss the end of another one, or their own start across a cut, leave a sliver that takes a row of quads.
        let from_start = self.canvas.at(v).distance(self.canvas.at(start)) / self.canvas.edge_length;
        let miss = if from_start == 0.0 { 0.0 } else { self.distances[v as usize].min(from_start) };
        let sliver = if self.regular && miss > 0.0 { (1.0 - miss / MISS).max(0.0) } else { 0.0 };
        Visit::Land(self.canvas.edge_length * ((off * PI).powi(2) + sliver))
    }

    /// Whether a flat vertex is so near to the end of another side that a row of quads would be squeezed into the gap.
    fn is_crowded(&self, v: u32) -> bool {
        let d = self.distances[v as usize];
        0.0 < d && d < 0.6
    }
}

/// Distance along the border from each vertex on a trace to the nearest end of another side, in edge lengths, where it is at most about
/// [`MISS`]; infinite elsewhere.
fn distances(outline: &Outline, canvas: &Canvas) -> Vec<f64> {
    let mut distances = vec![f64::INFINITY; canvas.place.len()];
    let ends_side = |bend: &Bend| bend.quarters != 2 || canvas.node[bend.place as usize];
    for border in &outline.loops {
        let n = border.len();
        for (k, bend) in border.iter().enumerate() {
            if canvas.fixed[bend.place as usize] {
                continue;
            }
            let nearest = &mut distances[bend.vertex as usize];
            if ends_side(bend) {
                *nearest = 0.0;
                continue;
            }
            for step in [1, n - 1] {
                let (mut k, mut walked) = (k, 0.0);
                while walked < MISS {
                    let next = (k + step) % n;
                    walked += border[k].at.distance(border[next].at) / canvas.edge_length;
                    if ends_side(&border[next]) {
                        *nearest = nearest.min(walked);
                        break;
                    }
                    k = next;
                }
            }
        }
    }
    distances
}

/// Cuts a closed region open along the cheapest trace between two singular vertices or, where there are none, along a short one.
/// `None` where no trace is found.
pub(super) fn open_closed(
    region: &Region,
    canvas: &mut Canvas,
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<Option<Vec<Region>>, Cancelled> {
    let graph = &canvas.graph;
    let mut singular = Outline::new(canvas, region).singular;
    singular.sort_unstable();
    let starts = if singular.len() < 2 { vec![canvas.corners(region.triangles[0])[0]] } else { singular };
    let stride = starts.len().div_ceil(STARTS);
    let mut best: Option<Trace> = None;
    for &start in starts.iter().step_by(stride) {
        for quarter in 0..4 {
            monitor.check()?;
            let from = canvas.at(start);
            let lands = |v: u32| {
                if starts.len() > 1 {
                    canvas.index[v as usize] != 0
                } else {
                    canvas.at(v).distance(from) > SLIT * canvas.edge_length
                }
            };
            let visit = |v: u32, _: f64| if lands(v) { Visit::Land(0.0) } else { Visit::Pass };
            let limit = best.as_ref().map_or(f64::INFINITY, |best| best.cost);
            let direction = graph.field(start) + f64::from(quarter) * FRAC_PI_2;
            if let Some(trace) = graph.trace(start, direction, &options.trace, limit, visit)
                && best.as_ref().is_none_or(|best| trace.cost < best.cost)
            {
                best = Some(trace);
            }
        }
    }
    let Some(trace) = best.filter(|trace| Crossing::new(canvas, trace).is_some()) else { return Ok(None) };
    // A tip has the quads that the field wants there.
    let [start, end] = [trace.start(), trace.end()].map(|v| [(4 - canvas.index[v as usize]).clamp(1, 8) as u8; 2]);
    Ok(Some(canvas.cut(region, &trace, Share { start, end })))
}
