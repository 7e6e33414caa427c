//! From a surface to its patch graph: cuts, corners of the charts, partitions, and what they leave (section 4.2.1).
//!
//! Corners come from the angles of the border in space: where it turns by more than 15 degrees at a vertex, and where the
//! turn of a smooth stretch adds up to 30 degrees. C-indices are the nearest that close: the turns of a chart sum to a whole
//! multiple of 30 degrees, the nearest to their sum in space, and what the surface curves inside is left to the
//! partition.

use super::assemble::assemble;
use super::chart::Chart;
use super::curve::Curve;
use super::cut::{Cut, cut};
use super::halves::{Slide, Through};
use super::input::Input;
use super::partition::{Division, Ground, WARY};
use super::patch_graph::{PatchGraph, closing_c_indices};
use super::pattern::Place as VertexPlace;
use super::region::{Arc, Line, Region, Spot};
use super::search::{BUDGET, DRAWN, MOST_BUDGET, Search};
use super::{SurfaceError, SurfaceOptions};
use mesh::{Cancelled, Monitor, Topology, sorted};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_6, PI};
use std::sync::Arc as Shared;

/// A vertex turns a corner by more than this, in units of 30 degrees.
pub(super) const TURN: f64 = 0.5;

/// A smooth stretch gets a corner when it turns by more than this, in units of 30 degrees: less is better left to its ends.
pub(super) const LEAST_TURN: f64 = 0.75;

/// The shortest distance between corners of one border, in edges; and that under which two of its vertices are one corner.
const APART: f64 = 1.3;
const CLOSE: f64 = 0.8;

/// The same for vertices at which it turns to one side and back: what stairs of a few panels are.
const STEP: f64 = 2.2;

/// A crease that is not followed: the surface turns by more than this there, radians.
const CREASE: f64 = 0.6;

/// How closely charts follow the curvature of the surface.
#[derive(Clone, Copy)]
pub(super) struct Tolerance {
    /// What the corners of a chart leave may be off its curvature by less than this, in units of 30 degrees.
    pub corners: f64,
    /// The most curvature of one sign in a chart, in units of 30 degrees.
    pub curvature: f64,
    /// Whether charts with three corners or more are patches as they are: smooth borders get no corners, and the others change until
    /// the defect is zero.
    pub is_flat: bool,
}

/// Tried two by two, until there is a result: corners as the angles are, and charts that are patches as they are; then smaller
/// charts, and corners as they are whatever they leave.
pub(super) const TOLERANCES: [Tolerance; 4] = [
    Tolerance { corners: 1.0, curvature: 7.0, is_flat: false },
    Tolerance { corners: 1.0, curvature: 4.0, is_flat: true },
    Tolerance { corners: 1.0, curvature: 3.6, is_flat: false },
    Tolerance { corners: f64::INFINITY, curvature: 7.0, is_flat: false },
];

/// Numbers of curves kept free for each region, so that all can be divided at once.
const CURVES: usize = 1 << 24;

/// A patch graph, with where its sides run in the charts.
pub(super) struct Layout {
    pub graph: PatchGraph,
    /// Chart of each patch, and the piece of a curve for each of its corners.
    pub chart_of: Vec<usize>,
    pub pieces: Vec<Vec<Arc>>,
    /// Borders and marked lines, and where nodes and sides may go along them.
    pub curves: Vec<Curve>,
    pub node_places: Vec<VertexPlace>,
    pub side_places: Vec<VertexPlace>,
    /// Of nodes within a line: where.
    pub through: Vec<Option<Through>>,
}

/// Lines of the surface before partitions: their vertices, and whether they are borders or marked.
pub(super) struct Chains {
    pub paths: Vec<Vec<u32>>,
    pub is_line: Vec<bool>,
    /// Line and segment of each edge.
    at: BTreeMap<[u32; 2], (usize, usize)>,
    /// Vertices at which three or more lines meet, or a line ends.
    pub fixed: BTreeSet<u32>,
}

/// A surface in charts, with the lines between them: what no partition changes.
pub(super) struct Base {
    pub cut: Cut,
    pub chains: Chains,
    pub creases: Vec<Vec<[glam::DVec2; 2]>>,
    pub edge_length: f64,
    pub corner_angle: f64,
}

/// A surface on its way to a patch graph: regions, some of them not flat yet.
#[derive(Clone)]
pub(super) struct Draft {
    pub base: Shared<Base>,
    pub regions: Vec<Region>,
    /// Number of the next curve.
    pub next: usize,
}

impl Draft {
    /// Whether there are corners of 150 or 210 degrees: no lattice has them, so patches with them are seldom tiled.
    pub fn is_odd(&self) -> bool {
        self.regions.iter().flat_map(|region| &region.corners).any(|c| matches!(c, 5 | 7))
    }
}

impl Draft {
    /// The charts of a surface, with corners; `None` when it cannot be cut into charts whose corners close.
    ///
    /// Corners are the nearest to their angles unless what they leave is off the curvature by `tolerance`, of [`TOLERANCES`].
    pub fn new(
        input: &Input,
        edge_length: f64,
        options: &SurfaceOptions,
        tolerance: Tolerance,
        monitor: &Monitor,
    ) -> Result<Option<Self>, SurfaceError> {
        let Some(cut) = cut(&input.mesh, &input.followed, edge_length, tolerance.curvature, monitor)? else {
            return Ok(None);
        };
        let chains = chains(&cut);
        let lines = lines(&cut, &chains);
        let shared = shared_corners(&cut, &chains, &lines, edge_length);
        let regions: Option<Vec<Region>> = (0..cut.charts.len())
            .map(|c| region(&cut, &chains, &lines, &shared, c, edge_length, options, tolerance))
            .collect();
        let creases = creases(&cut);
        let base = Shared::new(Base { cut, chains, creases, edge_length, corner_angle: options.corner_angle });
        Ok(regions.map(|regions| Self { base, regions, next: lines.len() }))
    }

    fn ground(&self, mixed: f64, drawn: usize) -> Ground<'_> {
        let Base { cut, creases, edge_length, .. } = &*self.base;
        Ground {
            old: self.base.chains.is_line.len(),
            mixed,
            drawn,
            charts: &cut.charts,
            edge_length: *edge_length,
            creases,
        }
    }

    /// The admissible partitions of a region, best first.
    pub fn divisions(&mut self, region: usize, monitor: &Monitor) -> Result<Vec<Division>, Cancelled> {
        let mut next = self.next;
        let found = self.ground(WARY[0], usize::MAX).divisions(&self.regions[region], &mut next, monitor);
        self.next = next;
        found
    }

    /// Divides all regions that are not flat, with a weight against patches of more than one lattice; whether that was possible.
    pub fn finish(&mut self, mixed: f64, monitor: &Monitor) -> Result<bool, Cancelled> {
        monitor.stage("partitioning", 0.0)?;
        let ground = self.ground(mixed, DRAWN);
        let tasks: Vec<f64> = self.regions.iter().map(|region| ground.task(region)).collect();
        let all: f64 = tasks.iter().sum::<f64>().max(1.0);
        let divided = |(k, region): (usize, &Region)| {
            let mut search = Search { ground: &ground, next: self.next + k * CURVES, looked_at: 0, monitor };
            let budget = tasks[k] * BUDGET.min(MOST_BUDGET / all);
            let found = search.solve(region, budget, f64::INFINITY)?;
            Ok(found.map(|(_, found)| found))
        };
        let found: Vec<Option<Vec<Region>>> =
            self.regions.par_iter().enumerate().map(divided).collect::<Result<_, Cancelled>>()?;
        let Some(patches) = found.into_iter().collect::<Option<Vec<_>>>() else { return Ok(false) };
        self.next += self.regions.len() * CURVES;
        self.regions = patches.concat();
        Ok(true)
    }

    /// The c-indices of all regions: drafts of one surface that agree in them are the same.
    pub fn outline(&self) -> Vec<Vec<u8>> {
        self.regions.iter().map(|region| region.corners.clone()).collect()
    }

    /// The patch graph of regions that are all flat, with some nodes moved along their lines; `None` where two corners of one fall
    /// together.
    pub fn layout(&self, slides: &[Slide]) -> Option<Layout> {
        assemble(&self.base, &self.regions, slides)
    }

    pub fn charts(&self) -> &[Chart] {
        &self.base.cut.charts
    }
}

/// Borders, marked lines and cuts as paths between the vertices where they meet.
pub(super) fn chains(cut: &Cut) -> Chains {
    let topology = Topology::of_triangles(&cut.mesh);
    let mut is_line: BTreeMap<[u32; 2], bool> = cut.edges.iter().map(|&e| (e, cut.marked.contains(&e))).collect();
    for h in topology.edges().filter(|&h| topology.is_border(h)) {
        is_line.insert(sorted(topology.from(h), topology.to(h)), true);
    }
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in is_line.keys() {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    let kind = |a: u32, b: u32| is_line[&sorted(a, b)];
    let lines_at = |v: u32| around[&v].iter().filter(|&&w| kind(v, w)).count();
    let is_stop = |v: u32| around[&v].len() != 2 || lines_at(v) == 1;
    let fixed = around.keys().copied().filter(|&v| !matches!(lines_at(v), 0 | 2)).collect();
    let mut left: BTreeSet<[u32; 2]> = is_line.keys().copied().collect();
    let mut paths = Vec::new();
    let mut walk = |start: u32, first: u32, left: &mut BTreeSet<[u32; 2]>| {
        let (mut path, mut before, mut here) = (vec![start, first], start, first);
        left.remove(&sorted(start, first));
        while here != start && !is_stop(here) {
            let next = around[&here].iter().copied().find(|&n| n != before).unwrap_or(before);
            left.remove(&sorted(here, next));
            (before, here) = (here, next);
            path.push(here);
        }
        paths.push(path);
    };
    for (&v, beside) in around.iter().filter(|(v, _)| is_stop(**v)) {
        for &w in beside {
            if left.contains(&sorted(v, w)) {
                walk(v, w, &mut left);
            }
        }
    }
    while let Some(&[a, b]) = left.first() {
        walk(a, b, &mut left);
    }
    let mut at = BTreeMap::new();
    for (line, path) in paths.iter().enumerate() {
        for (k, w) in path.windows(2).enumerate() {
            at.insert(sorted(w[0], w[1]), (line, k));
        }
    }
    let is_line = paths.iter().map(|path| kind(path[0], path[1])).collect();
    Chains { paths, is_line, at, fixed }
}

/// The border of a chart as runs along lines: the line, whether backwards, and the first border vertex of the run.
pub(super) fn runs(cut: &Cut, chains: &Chains, chart: usize) -> Vec<(usize, bool, usize)> {
    let chart = &cut.charts[chart];
    let n = chart.border.len();
    let vertex = |k: usize| chart.origin[chart.border[k % n] as usize];
    let step = |k: usize| {
        let (line, segment) = chains.at[&sorted(vertex(k), vertex(k + 1))];
        let path = &chains.paths[line];
        // A closed path of two segments would be ambiguous; meshes have none.
        let reversed = path[segment] != vertex(k);
        (line, segment, reversed)
    };
    let starts: Vec<usize> = (0..n)
        .filter(|&k| {
            let (line, segment, reversed) = step(k);
            if reversed { segment + 2 == chains.paths[line].len() } else { segment == 0 }
        })
        .collect();
    starts.iter().map(|&k| (step(k).0, step(k).2, k)).collect()
}

pub(super) fn lines(cut: &Cut, chains: &Chains) -> Vec<Shared<Line>> {
    let mut images = vec![[None, None]; chains.paths.len()];
    for (c, chart) in cut.charts.iter().enumerate() {
        let n = chart.border.len();
        for (line, reversed, first) in runs(cut, chains, c) {
            let count = chains.paths[line].len();
            let mut uv: Vec<_> = (0..count).map(|k| chart.flat.uv[chart.border[(first + k) % n] as usize]).collect();
            if reversed {
                uv.reverse();
            }
            images[line][usize::from(reversed)] = Some(uv);
        }
    }
    chains
        .paths
        .iter()
        .zip(images)
        .enumerate()
        .map(|(id, (path, images))| {
            let points = path.iter().map(|&v| cut.mesh.positions[v as usize]).collect();
            let ends = [path[0], path[path.len() - 1]].map(Spot::Node);
            Shared::new(Line::new(id, points, images, ends))
        })
        .collect()
}

/// Corners within a stretch of border, as the step after which each comes and its turn in units of 30 degrees: where the
/// turn so far, given at each vertex between, passes equal parts of the whole.
pub(super) fn inserted(turns: &[f64], lengths: &[f64], edge_length: f64) -> Vec<(usize, i32)> {
    let whole: f64 = turns.iter().sum();
    let count = if whole.abs() < LEAST_TURN { 0 } else { whole.round() as i32 };
    let length: f64 = lengths.iter().sum();
    let room = (length / (APART * edge_length)) as i32 - 1;
    if count == 0 || room < 1 {
        return Vec::new();
    }
    let places = count.abs().min(room);
    let mut found: Vec<(usize, i32)> = Vec::new();
    for place in 0..places {
        let wanted = whole * (f64::from(place) + 0.5) / f64::from(places);
        let mut sum = 0.0;
        let at = turns.iter().position(|turn| {
            sum += turn;
            sum.abs() >= wanted.abs() - 1e-9
        });
        let share = count / places + if place < (count % places).abs() { count.signum() } else { 0 };
        found.push((at.unwrap_or(turns.len() - 1), share));
    }
    // Two at one vertex are one.
    found.dedup_by(|b, a| {
        let same = a.0 == b.0;
        if same {
            a.1 += b.1;
        }
        same
    });
    found
}

/// Turns at the inner vertices of a run, to the left as the chart walks it, and the lengths of its segments.
pub(super) fn turns_of_run(
    cut: &Cut,
    chains: &Chains,
    chart: usize,
    (line, _, first): (usize, bool, usize),
) -> (Vec<f64>, Vec<f64>) {
    let chart = &cut.charts[chart];
    let n = chart.border.len();
    let count = chains.paths[line].len();
    let turns = (1..count - 1).map(|k| (PI - chart.angles[(first + k) % n]) / FRAC_PI_6).collect();
    let at = |k: usize| chart.mesh.positions[chart.border[(first + k) % n] as usize];
    (turns, (1..count).map(|k| at(k - 1).distance(at(k))).collect())
}

/// Corners along cuts, the same for both sides: segment count from the line's start, and the turn seen from its left. Curvature
/// on the cut itself turns both sides alike; only where one side's gain is the other's loss does the cut bend.
fn shared_corners(cut: &Cut, chains: &Chains, lines: &[Shared<Line>], edge_length: f64) -> Vec<Vec<(usize, i32)>> {
    let mut bends: Vec<(Vec<f64>, Vec<f64>)> = vec![(Vec::new(), Vec::new()); lines.len()];
    for c in 0..cut.charts.len() {
        for run in runs(cut, chains, c).into_iter().filter(|run| !chains.is_line[run.0]) {
            let (mut turns, mut lengths) = turns_of_run(cut, chains, c, run);
            if run.1 {
                turns.reverse();
                lengths.reverse();
            }
            let sign = if run.1 { -0.5 } else { 0.5 };
            let bend = &mut bends[run.0];
            bend.0.resize(turns.len(), 0.0);
            for (sum, turn) in bend.0.iter_mut().zip(turns) {
                *sum += sign * turn;
            }
            bend.1 = lengths;
        }
    }
    bends
        .into_iter()
        .map(|(turns, lengths)| {
            inserted(&turns, &lengths, edge_length).into_iter().map(|(k, turn)| (k + 1, turn)).collect()
        })
        .collect()
}

/// What turns a border at a place.
enum Turn {
    /// An angle, in units of 30 degrees, whose c-index is to be found or was set by the caller.
    Corner(f64, Option<u8>),
    /// So many units, on a smooth stretch.
    Settled(i32),
}

/// The whole of a chart, with its corners; `None` when no c-indices close.
#[allow(clippy::too_many_arguments)] // What a draft is made of, together only here.
fn region(
    cut: &Cut,
    chains: &Chains,
    lines: &[Shared<Line>],
    shared: &[Vec<(usize, i32)>],
    c: usize,
    edge_length: f64,
    options: &SurfaceOptions,
    tolerance: Tolerance,
) -> Option<Region> {
    let chart = &cut.charts[c];
    let n = chart.border.len();
    // What the curvature inside leaves to the corners, half of that on cuts included.
    let total = 12.0 - chart.whole_curvature().iter().sum::<f64>();
    // Corners whose c-index is to be found: angle and what the caller set; and turns that are settled.
    let (mut angles, mut set): (Vec<f64>, Vec<Option<u8>>) = (Vec::new(), Vec::new());
    let mut settled = 0;
    let (mut arcs, mut corner_of): (Vec<Arc>, Vec<Result<usize, i32>>) = (Vec::new(), Vec::new());
    let runs = runs(cut, chains, c);
    let wanted = |k: usize| {
        let v = chart.origin[chart.border[k % n] as usize];
        options.corners.iter().find(|(vertex, _)| *vertex == v).map(|&(_, c)| c)
    };
    let is_sharp = |k: usize| (6.0 - chart.angles[k % n] / FRAC_PI_6).abs() > TURN;
    let starts = runs.iter().map(|run| run.2).filter(|&k| is_sharp(k)).count();
    let inner = runs.iter().filter(|run| chains.is_line[run.0]);
    let sharp: usize =
        inner.map(|&(line, _, first)| (1..chains.paths[line].len() - 1).filter(|k| is_sharp(first + k)).count()).sum();
    let is_flat = tolerance.is_flat && starts + sharp >= 3;
    // Turns beside the end of a run go to where the next one starts.
    let mut carried = 0.0;
    for &run in &runs {
        let (line, reversed, first) = run;
        let last = lines[line].last();
        let count = chains.paths[line].len();
        let angle = |k: usize| chart.angles[(first + k) % n] / FRAC_PI_6;
        // Places along the run, by segments walked.
        let mut places: Vec<(usize, Turn)> = vec![(0, Turn::Corner(angle(0) - carried, wanted(first)))];
        carried = 0.0;
        if chains.is_line[line] {
            let (turns, lengths) = turns_of_run(cut, chains, c, run);
            let walked: Vec<f64> = std::iter::once(0.0)
                .chain(lengths.iter().scan(0.0, |sum, length| {
                    *sum += length;
                    Some(*sum)
                }))
                .collect();
            let mut from = 0;
            for k in 1..count {
                let is_set = k < count - 1 && wanted(first + k).is_some();
                let is_corner = k < count - 1 && (turns[k - 1].abs() > TURN || is_set);
                // Corners nearer than panels are one; a step to one side and back is none.
                let is_near = |a: usize, b: usize| !is_set && walked[b] - walked[a] < CLOSE * edge_length;
                let is_step = |a: usize, b: usize| !is_set && walked[b] - walked[a] < STEP * edge_length;
                if (is_corner || k == count - 1) && !is_flat {
                    for (at, turn) in inserted(&turns[from..k - 1], &lengths[from..k], edge_length) {
                        places.push((from + at + 1, Turn::Settled(turn)));
                    }
                }
                if is_corner && is_near(k, count - 1) {
                    carried += turns[k - 1];
                } else if is_corner
                    && let Some((at, Turn::Corner(before, None))) = places.last_mut()
                    && (is_near(*at, k) || (6.0 - *before) * turns[k - 1] < 0.0 && is_step(*at, k))
                {
                    *before -= turns[k - 1];
                    // The sharpest of them is the corner.
                    if *at > 0 && turns[*at - 1].abs() < turns[k - 1].abs() {
                        *at = k;
                    }
                } else if is_corner {
                    places.push((k, Turn::Corner(angle(k), wanted(first + k))));
                }
                if is_corner {
                    from = k;
                }
            }
        } else {
            for &(k, turn) in &shared[line] {
                places.push(if reversed { (count - 1 - k, Turn::Settled(-turn)) } else { (k, Turn::Settled(turn)) });
            }
        }
        places.sort_by_key(|place| place.0);
        let at = |k: usize| if reversed { last - k as f64 } else { k as f64 };
        for (index, (k, kind)) in places.iter().enumerate() {
            let end = places.get(index + 1).map_or(count - 1, |next| next.0);
            arcs.push(Arc { line: lines[line].clone(), reversed, from: at(*k), to: at(end) });
            corner_of.push(match kind {
                Turn::Corner(angle, wanted) => {
                    angles.push(*angle);
                    set.push(*wanted);
                    Ok(angles.len() - 1)
                }
                Turn::Settled(turn) => {
                    settled += turn;
                    Err(*turn)
                }
            });
        }
    }
    if let Some(angle) = angles.first_mut() {
        *angle -= carried;
    }
    // Rounding alone closes with some defect; only one that is far from the curvature is worth changing a corner for.
    let rounded: i32 =
        angles.iter().zip(&set).map(|(a, s)| 6 - s.map_or(a.round().clamp(2.0, 10.0) as i32, i32::from)).sum();
    let turn = if is_flat {
        12 - settled
    } else if (f64::from(rounded + settled) - total).abs() < tolerance.corners {
        rounded
    } else {
        total.round() as i32 - settled
    };
    let parallel = if is_flat && settled == 0 { parallelogram(&angles, &set) } else { None };
    let chosen = parallel
        .or_else(|| closing_c_indices(&angles, &set, 12 - turn))
        .or_else(|| closing_c_indices(&angles, &set, 12 - rounded))?;
    let corners = corner_of
        .into_iter()
        .map(|corner| match corner {
            Ok(index) => Some(chosen[index]),
            Err(turn) => u8::try_from(6 - turn).ok(),
        })
        .collect::<Option<Vec<u8>>>()?;
    Some(Region { chart: c, arcs, corners })
}

/// The parallelogram of right angles or of 60 and 120 degrees nearest to four corners, where there are four: whatever its sides,
/// lengths close it, where those of the nearest trapezoid would demand what the charts beside it cannot give.
fn parallelogram(angles: &[f64], set: &[Option<u8>]) -> Option<Vec<u8>> {
    let turning = |least: f64| (0..angles.len()).filter(move |&k| (6.0 - angles[k]).abs() > least).collect::<Vec<_>>();
    // Where more vertices turn, four that do so much more than the others.
    let corners = [TURN, 2.0 * TURN, 3.0 * TURN].into_iter().map(turning).find(|found| found.len() <= 4)?;
    if corners.len() != 4 || corners.iter().any(|&k| angles[k] > 6.0) || set.iter().any(Option::is_some) {
        return None;
    }
    let far = |kind: &[u8; 4]| -> f64 {
        corners.iter().zip(kind).map(|(&corner, &c)| (angles[corner] - f64::from(c)).powi(2)).sum()
    };
    let kind = [[3, 3, 3, 3], [2, 4, 2, 4], [4, 2, 4, 2]].into_iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let mut chosen = vec![6; angles.len()];
    corners.iter().zip(kind).for_each(|(&corner, c)| chosen[corner] = c);
    Some(chosen)
}

/// Edges with a sharp bend that no line follows, in each chart.
pub(super) fn creases(cut: &Cut) -> Vec<Vec<[glam::DVec2; 2]>> {
    let of_chart = |chart: &Chart| {
        let topology = Topology::of_triangles(&chart.mesh);
        let sharp = topology.edges().filter(|&h| !topology.is_border(h)).filter(|&h| {
            let twin = topology.twin[h as usize];
            let [left, right] = [h, twin].map(|h| chart.mesh.area_normal(topology.face[h as usize] as usize));
            left.angle_between(right) > CREASE
        });
        sharp.map(|h| [topology.from(h), topology.to(h)].map(|v| chart.flat.uv[v as usize])).collect()
    };
    cut.charts.iter().map(of_chart).collect()
}

impl Base {
    /// Whether the border or marked line bends sharply at a vertex where its two parts meet.
    pub fn is_bent(&self, v: u32) -> bool {
        let lines = self.chains.at.iter().filter(|(edge, (line, _))| self.chains.is_line[*line] && edge.contains(&v));
        let beside: Vec<u32> = lines.map(|(edge, _)| if edge[0] == v { edge[1] } else { edge[0] }).collect();
        let at = |v: u32| self.cut.mesh.positions[v as usize];
        match beside[..] {
            [a, b] => (at(v) - at(a)).angle_between(at(b) - at(v)) > self.corner_angle,
            _ => false,
        }
    }
}
