//! Chooses the next trace of a region: first one that relieves a concave corner, then one that makes a part acceptable.
//!
//! The paper traces every concave corner of a region at once and resolves conflicts; then it splits patches with a dense set
//! of candidates. Here each trace is cut before the next one is looked for, so that two traces can never meet tangentially:
//! a trace ends where it reaches another, and may do so only within 45 degrees of the corner direction that the other
//! offers there, which is the sheet test of M2. Orthogonal crossings arise where traces land from both sides on one vertex.
//! The choice adds to the paper's "shortest first" what the cut would leave: it must bring the region closer to disks of 3 to 6
//! sides, among equals those win whose sides are as many as the singularities inside ask for, then balanced parts of four sides.

use super::region::{Region, Share};
use super::{Fault, LayoutOptions};
use glam::DVec3;
use mesh::{Cancelled, Monitor};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI};
use surface::tracing::{FieldGraph, Trace, TraceOptions, Visit};

/// Starts tried at most in one region, evenly spread, when any flat vertex would do.
const STARTS: usize = 48;
/// But so many on each side.
const STARTS_A_SIDE: usize = 6;
/// Cuts evaluated in one region, cheapest traces first; more, up to the second number, while none of them helps.
const CUTS: [usize; 2] = [24, 120];
/// Cuts, and traces of which the cheapest are wanted, that are made at the same time.
const TOGETHER: usize = 4;

/// Ends of sides nearer than this to each other, in edge lengths, are better one.
const MISS: f64 = 1.5;

/// Length of the first cut where the field is regular, in edge lengths.
const SLIT: f64 = 4.0;

/// What all regions share: the growing mesh and what is known about its vertices.
pub(super) struct Canvas {
    /// Positions of the whole mesh.
    pub positions: Vec<DVec3>,
    /// Vertices on the border given by the caller: fixed, never too close to each other.
    pub fixed: Vec<bool>,
    /// Vertices where a side of some region ends.
    pub node: Vec<bool>,
    /// Mean length of the border's edges: what "too close" is measured in.
    pub edge_length: f64,
    /// Traces, by vertex and quarter, that gave no cut when they were the cheapest: tried last.
    pub failed: BTreeSet<(u32, u8)>,
}

impl Canvas {
    /// Vertices that a cut made.
    fn add(&mut self, positions: Vec<DVec3>) {
        self.positions.extend(positions);
        self.fixed.resize(self.positions.len(), false);
        self.node.resize(self.positions.len(), false);
    }
}

/// A region's distance from being a patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    pub sides: usize,
    pub concave: usize,
    pub euler_characteristic: i64,
    pub touches_itself: bool,
    /// Sides that turn by more than the options allow.
    pub round: usize,
    /// How much longer sides are than the options want.
    pub long: usize,
    /// How many sides more or fewer it has than the field inside asks for: where traces follow the field, the quarters that the border
    /// turns by and the indices of the singularities inside add up to four for a disk (Poincaré and Hopf). None unless that is asked for.
    pub astray: usize,
}

impl Shape {
    pub fn of(region: &Region, options: &LayoutOptions) -> Self {
        let mut seen = BTreeSet::new();
        let border: Vec<usize> = (0..region.quarters.len()).filter(|&v| region.quarters[v] > 0).collect();
        let [round, long] = round_sides(region, options.side_turn, options.longest);
        let euler_characteristic = region.euler_characteristic();
        let turns: i64 = border.iter().map(|&v| 2 - i64::from(region.quarters[v])).sum();
        let index: i64 = region.index.iter().map(|&index| i64::from(index)).sum();
        Self {
            sides: border.iter().filter(|&&v| region.quarters[v] == 1).count(),
            concave: border.iter().filter(|&&v| region.quarters[v] > 2).count(),
            euler_characteristic,
            astray: if options.regular {
                (turns + index - 4 * euler_characteristic).unsigned_abs() as usize
            } else {
                0
            },
            touches_itself: !border.iter().all(|&v| seen.insert(region.vertex[v])),
            round,
            long,
        }
    }

    /// What keeps the region from being a patch, the worst first.
    pub fn fault(&self) -> Option<Fault> {
        if self.concave > 0 {
            Some(Fault::Concave)
        } else if self.euler_characteristic != 1 {
            Some(Fault::NotDisk { euler_characteristic: self.euler_characteristic })
        } else if self.touches_itself {
            Some(Fault::TouchesItself)
        } else if !(3..=6).contains(&self.sides) {
            Some(Fault::Sides { count: self.sides })
        } else {
            None
        }
    }

    /// What cuts should lower, but is no fault.
    fn soft(&self) -> usize {
        self.round + self.long
    }

    /// Zero for a patch; every cut must lower the sum over its parts. A handle or hole outweighs touching, which outweighs sides.
    fn badness(&self) -> usize {
        let holes = (1 - self.euler_characteristic).unsigned_abs() as usize;
        let sides = 3_usize.saturating_sub(self.sides) + self.sides.saturating_sub(6);
        100 * holes + 10 * usize::from(self.touches_itself) + sides
    }
}

/// Number of sides (stretches between corners) whose bends add up to more than `limit`; and by how much sides are longer than
/// `longest`, squared, so that halves count less.
fn round_sides(region: &Region, limit: f64, longest: f64) -> [usize; 2] {
    let at = |v: u32| region.mesh.positions[v as usize];
    let excess = |length: f64| (4.0 * (length / longest - 1.0).max(0.0).powi(2)) as usize;
    let mut long = 0;
    let angles = region.angles();
    let mut count = 0;
    for mut border in region.loops() {
        let corner = border.iter().position(|&v| region.quarters[v as usize] == 1).unwrap_or(0);
        border.rotate_left(corner);
        let (mut turn, mut length) = (0.0_f64, 0.0);
        for (k, &v) in border.iter().enumerate() {
            if region.quarters[v as usize] == 1 && k > 0 {
                count += usize::from(turn.abs() > limit);
                long += excess(length);
                (turn, length) = (0.0, 0.0);
            } else {
                turn += PI - angles[v as usize];
            }
            length += at(v).distance(at(border[(k + 1) % border.len()]));
        }
        count += usize::from(turn.abs() > limit);
        long += excess(length);
    }
    [count, long]
}

/// What became of a region.
pub(super) enum Step {
    /// It is a patch.
    Patch,
    /// It was cut into these parts.
    Parts(Vec<Region>),
    /// No trace could relieve a concave corner: this one has a quarter less now.
    Flattened(Box<Region>, u32),
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
    let shape = Shape::of(region, options);
    let fault = shape.fault();
    if fault.is_none() && shape.soft() == 0 {
        return Ok(Step::Patch);
    }
    let graph = FieldGraph::new(&region.topology, &region.corners);
    let distances = distances(region, canvas);
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
            region,
            graph: &graph,
            canvas,
            options: &trace_options,
            distances: &distances,
            regular,
            strict,
            hasty,
        };
        let candidates = search.candidates(shape.concave > 0, monitor)?;
        let most = if strict { CUTS } else { [usize::MAX; 2] };
        if let Some(parts) = best_cut(region, shape, &candidates, most, canvas, options, monitor)? {
            return Ok(Step::Parts(parts));
        }
        // A round side is no reason to bend the rules.
        if fault.is_none() {
            return Ok(Step::Patch);
        }
    }
    let angles = region.angles();
    let flat =
        || (0..angles.len()).filter(|&v| region.quarters[v] == 2).min_by(|&a, &b| angles[a].total_cmp(&angles[b]));
    let least = match fault {
        Some(Fault::Concave) => (0..region.quarters.len()).find(|&v| region.quarters[v] > 2),
        // A disk with two corners is given a third.
        Some(Fault::Sides { count }) if count < 3 && options.partial => flat(),
        _ => None,
    };
    if let Some(v) = least {
        let mut flatter = region.clone();
        flatter.quarters[v] -= 1;
        return Ok(Step::Flattened(Box::new(flatter), region.vertex[v]));
    }
    Ok(fault.map_or(Step::Patch, Step::Stuck))
}

/// Badness with the sides that the field does not ask for, those alone, and what is soft: the order of cuts.
type Rank = (usize, usize, usize);

/// The parts of the best cut, if one helps.
fn best_cut(
    region: &Region,
    shape: Shape,
    candidates: &[Candidate],
    most: [usize; 2],
    canvas: &mut Canvas,
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<Option<Vec<Region>>, Cancelled> {
    let first = canvas.positions.len();
    let mut best: Option<(Rank, f64, &Candidate, Cut)> = None;
    let is_over = |tried: usize, candidate: &Candidate, best: &Option<(Rank, f64, &Candidate, Cut)>| {
        // No later candidate can cost less than this one does before its penalties and its reward for balance.
        let least = if shape.concave > 0 { candidate.trace.cost } else { candidate.trace.cost / 0.6 };
        tried >= most[usize::from(best.is_none())]
            || best.as_ref().is_some_and(|(rank, cost, ..)| *rank == (0, 0, 0) && *cost <= least)
    };
    // For a concave corner the first cut often will do; else most are compared.
    let together = if shape.concave > 0 { 1 } else { TOGETHER };
    for (start, batch) in candidates.chunks(together).enumerate().map(|(k, batch)| (k * together, batch)) {
        if is_over(start, &batch[0], &best) {
            break;
        }
        let cut = |candidate: &Candidate| {
            monitor.check()?;
            let cut = region.cut(&candidate.trace, candidate.share, first);
            Ok(cut.map(|(parts, added)| Cut::new(parts, added, region, options)))
        };
        let cuts: Vec<Option<Cut>> = batch.par_iter().map(cut).collect::<Result<_, Cancelled>>()?;
        for (tried, (candidate, cut)) in (start..).zip(batch.iter().zip(cuts)) {
            if is_over(tried, candidate, &best) {
                break;
            }
            let failed = (region.vertex[candidate.trace.start() as usize], candidate.share.start[0]);
            let Some(cut) = cut else {
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
                best = Some((rank, cost, candidate, cut));
            }
        }
    }
    let Some((.., chosen, Cut { parts, added, .. })) = best else {
        return Ok(None);
    };
    canvas.add(added);
    for end in [chosen.trace.start(), chosen.trace.end()] {
        canvas.node[region.vertex[end as usize] as usize] = true;
    }
    Ok(Some(parts))
}

/// What a cut leaves.
struct Cut {
    parts: Vec<Region>,
    /// Places of the new vertices.
    added: Vec<DVec3>,
    badness: usize,
    concave: usize,
    /// Sides more or fewer than four.
    irregular: usize,
    soft: usize,
    astray: usize,
    /// Share of the smaller part in the area.
    balance: f64,
}

impl Cut {
    fn new(parts: Vec<Region>, added: Vec<DVec3>, region: &Region, options: &LayoutOptions) -> Self {
        let shapes: Vec<Shape> = parts.iter().map(|part| Shape::of(part, options)).collect();
        let sum = |of: fn(&Shape) -> usize| shapes.iter().map(of).sum();
        let balance = match &parts[..] {
            [a, b] => a.area().min(b.area()) / region.area(),
            _ => 0.5,
        };
        Self {
            badness: sum(Shape::badness),
            concave: sum(|shape| shape.concave),
            irregular: sum(|shape| shape.sides.abs_diff(4)),
            soft: sum(Shape::soft),
            astray: sum(|shape| shape.astray),
            balance,
            parts,
            added,
        }
    }
}

struct Search<'a> {
    region: &'a Region,
    graph: &'a FieldGraph<'a>,
    canvas: &'a Canvas,
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
        let quarters = &self.region.quarters;
        let eligible = |v: u32| {
            let q = quarters[v as usize];
            if concave { q > 2 } else { q == 2 && !(self.strict && self.is_crowded(v)) }
        };
        let starts: Vec<u32> = if concave {
            self.region.loops().concat().into_iter().filter(|&v| eligible(v)).collect()
        } else {
            let mut sides = if self.regular { self.region.sides() } else { vec![self.region.loops().concat()] };
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
            self.strict && concave && self.canvas.failed.contains(&(self.region.vertex[start as usize], j))
        };
        let ways = starts.into_iter().flat_map(|start| (1..quarters[start as usize]).map(move |j| (start, j)));
        let ways: Vec<(u32, u8)> = ways.filter(|way| !failed(way)).collect();
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut limit = f64::INFINITY;
        for some in ways.chunks(if self.hasty { TOGETHER } else { usize::MAX }) {
            let find = |&(start, j): &(u32, u8)| {
                monitor.check()?;
                let q = quarters[start as usize];
                let direction = self.graph.angle(start) * f64::from(j) / f64::from(q);
                let found =
                    self.graph.trace(start, direction, self.options, limit, |v, back| self.visit(v, back, start));
                Ok(found.map(|trace| {
                    let end = trace.end();
                    let (i, _) = self.quarter_of(end, trace.arrival);
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

    /// The direction of a border vertex closest to an angle, as a number of quarters, and how many quarters off it is.
    fn quarter_of(&self, v: u32, angle: f64) -> (u8, f64) {
        let q = self.region.quarters[v as usize];
        let exact = angle / self.graph.angle(v) * f64::from(q);
        let nearest = (exact.round() as u8).clamp(1, q - 1);
        (nearest, (exact - f64::from(nearest)).abs())
    }

    fn visit(&self, v: u32, back: f64, start: u32) -> Visit {
        match self.region.quarters[v as usize] {
            0 => return Visit::Pass,
            1 => return Visit::Block,
            _ => {}
        }
        let (_, off) = self.quarter_of(v, back);
        if off > self.options.cone / FRAC_PI_2 || self.strict && self.is_crowded(v) {
            return Visit::Block;
        }
        // Traces that miss the end of another one, or their own start across a cut, leave a sliver that takes a row of quads.
        let at = |v: u32| self.region.mesh.positions[v as usize];
        let from_start = at(v).distance(at(start)) / self.canvas.edge_length;
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
fn distances(region: &Region, canvas: &Canvas) -> Vec<f64> {
    let mut distances = vec![f64::INFINITY; region.quarters.len()];
    let ends_side = |v: u32| region.quarters[v as usize] != 2 || canvas.node[region.vertex[v as usize] as usize];
    let at = |v: u32| region.mesh.positions[v as usize];
    for border in region.loops() {
        let n = border.len();
        for (k, &v) in border.iter().enumerate() {
            if canvas.fixed[region.vertex[v as usize] as usize] {
                continue;
            }
            if ends_side(v) {
                distances[v as usize] = 0.0;
                continue;
            }
            for step in [1, n - 1] {
                let (mut k, mut walked) = (k, 0.0);
                while walked < MISS {
                    let next = (k + step) % n;
                    walked += at(border[k]).distance(at(border[next])) / canvas.edge_length;
                    if ends_side(border[next]) {
                        distances[v as usize] = distances[v as usize].min(walked);
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
    let graph = FieldGraph::new(&region.topology, &region.corners);
    let singular: Vec<u32> = (0..).zip(&region.index).filter(|(_, index)| **index != 0).map(|(v, _)| v).collect();
    let starts = if singular.len() < 2 { vec![0] } else { singular };
    let stride = starts.len().div_ceil(STARTS);
    let mut best: Option<Trace> = None;
    for &start in starts.iter().step_by(stride) {
        for quarter in 0..4 {
            monitor.check()?;
            let from = region.mesh.positions[start as usize];
            let lands = |v: u32| {
                if starts.len() > 1 {
                    region.index[v as usize] != 0
                } else {
                    region.mesh.positions[v as usize].distance(from) > SLIT * canvas.edge_length
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
    let Some(trace) = best else { return Ok(None) };
    // A tip has the quads that the field wants there.
    let [start, end] = [trace.start(), trace.end()].map(|v| [(4 - region.index[v as usize]).clamp(1, 8) as u8; 2]);
    let cut = region.cut(&trace, Share { start, end }, canvas.positions.len());
    Ok(cut.map(|(parts, added)| {
        canvas.add(added);
        parts
    }))
}
