//! Zigzags on the sides of a patch graph (section 4.3, Fig. 13).
//!
//! A zigzag is a run of edges that leave their side's direction by 30 degrees: where it begins one patch beside has a c-index
//! of 5 and the other of 7, where it ends the other way round. So no vertex becomes irregular, on either side, and no defect
//! of a patch changes. But the end of the side moves, and what lies beside it must give way. On a four-sided patch the
//! opposite side takes the same zigzag, on a three-sided one all three do: the paper's pairs and triples. From patch to
//! patch zigzags so form strips, as rows of quads do, that close or end at the border.
//!
//! Deviation: the paper's user places each zigzag of a pair or triple. Here the user asks for one, or for those of a patch,
//! and an integer programme finds the others: the least change of side lengths and zigzags that closes all patches in the
//! exact plane. It is asked of the patches beside the side first, then of one ring of patches more, and so on: patches
//! outside keep all their tiles. The order of edges along the sides that change is searched together with the tilings of the
//! patches beside them.

use super::cone::Filling;
use super::counts::{Counts, changed, counts_of};
use super::courses::{Course, fault};
use super::patch_graph::PatchGraph;
use super::paving::{Paving, fill_patch, stitch};
use super::strip::Tiled;
use super::{Fill, SurfaceError};
use crate::plane::Point;
use crate::tile::Kind;
use mesh::Monitor;
use solve::SolveError;
use solve::integer::{Options, Programme, Term, Variable};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// What an edge costs that is turned or turned back besides those asked for, and one that is added or taken away; in
/// squared edges, the unit of stretch.
const TURNED: f64 = 1.0;
const LENGTHENED: f64 = 0.5;

/// Most edges that a zigzag may have.
const MOST_EDGES: i32 = 100;

/// Most outlines tried for the lengths that a programme found.
const MOST_OUTLINES: usize = 400;

/// Other lengths tried with as many rings of patches.
const OTHER_LENGTHS: usize = 3;

/// Rings of patches that a single zigzag may change, before it is made by a strip.
const RINGS: usize = 3;

/// Limits of a programme; the nodes decide, as in `lengths`.
const MOST_NODES: u32 = 200;
const TIME: Duration = Duration::from_secs(600);

/// Where along a side a zigzag is tried, less the place asked for.
const SHIFTS: [f64; 9] = [0.0, 0.12, -0.12, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0];

/// A change of one side: edges that leave its direction by 30 degrees, as the side runs from its first node to its last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zigzag {
    /// Index into [`PatchGraph::sides`].
    pub side: u32,
    /// Edges that turn: to the left, or to the right when negative. At most 100, not 0.
    pub edges: i32,
    /// Whether as many turn the other way after them, so that the side runs on as it would.
    pub pair: bool,
    /// Whether they stand alone, evenly spread, instead of one after the other: the more fractured pattern.
    pub spread: bool,
    /// Where along the side the middle of the zigzag is wished for, 0 to 1. It lies elsewhere where only that has a tiling.
    pub position: f64,
}

impl Zigzag {
    /// A single zigzag in the middle of a side.
    pub fn new(side: u32, edges: i32) -> Self {
        Self { side, edges, pair: false, spread: false, position: 0.5 }
    }

    /// Edges to the left and to the right.
    fn turned(&self) -> [i32; 2] {
        let size = self.edges.abs();
        if self.pair {
            [size, size]
        } else if self.edges > 0 {
            [size, 0]
        } else {
            [0, size]
        }
    }
}

/// What an edit did.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Edit {
    /// Sides whose edges are not those before.
    pub sides: Vec<u32>,
    /// Patches that were filled anew: those beside these sides. All others have their tiles as before.
    pub patches: Vec<u32>,
}

/// Why a side cannot take a zigzag.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// There are no patches.
    #[error(
        "the panels are not those of patches; only a surface that was tiled with a partition into patches can be edited"
    )]
    NoPatches,
    /// There is no such side.
    #[error("side {side} does not exist; the patch graph has sides 0 to {}", count - 1)]
    NoSuchSide {
        /// As given.
        side: u32,
        /// Number of sides.
        count: usize,
    },
    /// There is no such patch.
    #[error("patch {patch} does not exist; the patch graph has patches 0 to {}", count - 1)]
    NoSuchPatch {
        /// As given.
        patch: u32,
        /// Number of patches.
        count: usize,
    },
    /// The number of edges is of no use.
    #[error("a zigzag of {edges} edges is not possible; give it 1 to {MOST_EDGES} edges, negative ones to turn right")]
    Edges {
        /// As given.
        edges: i32,
    },
    /// A patch has neither three nor four sides.
    #[error(
        "patch {patch} has {sides} sides; zigzags for a whole patch are for those of three or four: name a side instead"
    )]
    Shape {
        /// The patch.
        patch: u32,
        /// Its sides between corners that turn.
        sides: usize,
    },
    /// Nothing closes.
    #[error(
        "side {side} cannot take this zigzag: no lengths of the other sides, of {patches} patches around, close the patches \
         beside it; take a pair on this side, the other direction, another side, or smaller panels"
    )]
    Open {
        /// The side.
        side: u32,
        /// How many patches were allowed to change.
        patches: usize,
    },
    /// There are lengths but no tiles.
    #[error(
        "side {side} cannot take this zigzag: patch {patch} closes but has no tiling then; take more or fewer edges, another \
         position, spread them, or another side"
    )]
    Untileable {
        /// The side.
        side: u32,
        /// A patch without a tiling.
        patch: u32,
    },
}

/// The zigzags that a whole patch takes: one on each side of a three-sided patch (a triple), on two opposite sides of a
/// four-sided one (a pair), beginning with the side that leaves corner `first`.
///
/// # Errors
/// [`EditError::NoSuchPatch`], [`EditError::Shape`].
pub fn zigzags_of_patch(graph: &PatchGraph, patch: u32, first: usize, like: Zigzag) -> Result<Vec<Zigzag>, EditError> {
    let corners = match graph.patches.get(patch as usize) {
        Some(patch) => &patch.corners,
        None => return Err(EditError::NoSuchPatch { patch, count: graph.patches.len() }),
    };
    // Runs of sides between corners that turn; the longest side of each run stands for it.
    let starts: Vec<usize> = (0..corners.len()).filter(|&k| corners[k].c_index != 6).collect();
    if !(3..=4).contains(&starts.len()) {
        return Err(EditError::Shape { patch, sides: starts.len() });
    }
    let length = |k: usize| graph.sides[corners[k % corners.len()].side as usize].length();
    let longest = |run: usize| {
        let (from, to) = (starts[run], starts[(run + 1) % starts.len()]);
        let to = if to > from { to } else { to + corners.len() };
        (from..to).max_by(|&a, &b| length(a).total_cmp(&length(b)).then(b.cmp(&a))).unwrap_or(from) % corners.len()
    };
    let chosen: Vec<usize> = if starts.len() == 3 {
        (0..3).map(longest).collect()
    } else {
        [first % 4, (first + 2) % 4].map(longest).to_vec()
    };
    // To the left as the patch runs; the place as it runs, too.
    let of = |k: usize| {
        let corner = &corners[k];
        let position = if corner.reversed { 1.0 - like.position } else { like.position };
        Zigzag { side: corner.side, position, ..like }
    };
    Ok(chosen.into_iter().map(of).collect())
}

/// The paving with these zigzags besides those that are there, and what became another.
pub(super) fn zigzagged(
    graph: &PatchGraph,
    paving: &Paving,
    zigzags: &[Zigzag],
    edge_length: f64,
    fill: Fill,
    monitor: &Monitor,
) -> Result<(Paving, Edit), SurfaceError> {
    for zigzag in zigzags {
        if zigzag.side as usize >= graph.sides.len() {
            return Err(EditError::NoSuchSide { side: zigzag.side, count: graph.sides.len() }.into());
        }
        if zigzag.edges == 0 || zigzag.edges.abs() > MOST_EDGES {
            return Err(EditError::Edges { edges: zigzag.edges }.into());
        }
    }
    let Some(first) = zigzags.first() else { return Err(EditError::Edges { edges: 0 }.into()) };
    let editor = Editor { graph, paving, zigzags, edge_length, fill, beside: beside(graph), monitor };
    let mut allowed: BTreeSet<u32> =
        zigzags.iter().flat_map(|zigzag| editor.beside[zigzag.side as usize].iter().copied()).collect();
    let mut untileable = None;
    let mut ring = 0;
    loop {
        ring += 1;
        monitor.stage("lengths", 0.0)?;
        let mut perimeters: Vec<(u32, std::ops::RangeInclusive<i64>)> = Vec::new();
        for _ in 0..=OTHER_LENGTHS {
            let Some(counts) = editor.counts(&allowed, &perimeters)? else { break };
            monitor.stage("filling", 0.3)?;
            match editor.filled(&counts)? {
                Ok(found) => return Ok(editor.stitched(found)),
                Err(patch) => {
                    untileable = Some(patch);
                    // Other lengths: more around the patch that has no tiling.
                    let around: i64 = editor.around(patch, &counts);
                    perimeters.retain(|(p, _)| *p != patch);
                    perimeters.push((patch, around + 1..=i64::from(i32::MAX)));
                }
            }
        }
        let wider: BTreeSet<u32> = allowed
            .iter()
            .flat_map(|&p| &graph.patches[p as usize].corners)
            .flat_map(|corner| editor.beside[corner.side as usize].iter().copied())
            .collect();
        if zigzags.len() == 1
            && (ring == RINGS || wider.len() == allowed.len())
            && let Some(found) = editor.by_strip(first)?
        {
            return Ok(found);
        }
        if wider.len() == allowed.len() {
            let side = first.side;
            let error = match untileable {
                Some(patch) => EditError::Untileable { side, patch },
                None => EditError::Open { side, patches: allowed.len() },
            };
            return Err(error.into());
        }
        allowed = wider;
    }
}

/// Patches along each side: one on the border, two inside, which may be the same.
fn beside(graph: &PatchGraph) -> Vec<Vec<u32>> {
    let mut beside = vec![Vec::new(); graph.sides.len()];
    for (p, patch) in (0..).zip(&graph.patches) {
        for corner in &patch.corners {
            beside[corner.side as usize].push(p);
        }
    }
    beside
}

/// Courses and fillings that are not those before.
struct Found {
    courses: BTreeMap<u32, Course>,
    fillings: BTreeMap<u32, Filling>,
}

struct Editor<'a> {
    graph: &'a PatchGraph,
    paving: &'a Paving,
    zigzags: &'a [Zigzag],
    edge_length: f64,
    fill: Fill,
    beside: Vec<Vec<u32>>,
    monitor: &'a Monitor,
}

impl Editor<'_> {
    /// Edges that the user asks for, besides those that are there, for each side named.
    fn asked(&self) -> BTreeMap<u32, [i32; 2]> {
        let mut asked: BTreeMap<u32, [i32; 2]> = BTreeMap::new();
        for zigzag in self.zigzags {
            let entry = asked.entry(zigzag.side).or_default();
            let turned = zigzag.turned();
            *entry = [entry[0] + turned[0], entry[1] + turned[1]];
        }
        asked
    }

    /// Edges of the sides that may change, such that all patches close and little changes; `None` when nothing closes.
    /// Only sides whose patches are all `allowed` may change.
    fn counts(
        &self,
        allowed: &BTreeSet<u32>,
        perimeters: &[(u32, std::ops::RangeInclusive<i64>)],
    ) -> Result<Option<BTreeMap<u32, Counts>>, SurfaceError> {
        let mut programme = Programme::new();
        let asked = self.asked();
        let mut variables: BTreeMap<u32, [Variable; 3]> = BTreeMap::new();
        for (s, side) in (0..).zip(&self.graph.sides) {
            if !self.beside[s as usize].iter().all(|p| allowed.contains(p)) {
                continue;
            }
            let now = counts_of(&self.paving.courses[s as usize]);
            let wanted = asked.get(&s);
            let extra: i32 = asked.values().flatten().sum();
            let length = (side.length() / self.edge_length).max(0.5);
            let most = (2.0 * length) as i32 + 4 + extra;
            let [straight, left, right] = match wanted {
                Some([l, r]) => [(0, most), (now[1] + l, now[1] + l), (now[2] + r, now[2] + r)],
                None => [(0, most.max(now[0])), (0, now[1] + 2 * extra), (0, now[2] + 2 * extra)],
            }
            .map(|(least, most)| programme.variable(least..=most));
            programme.row(&[(straight, 1), (left, 1), (right, 1)], 1..);
            // Lengths in eighths of an edge: half of sqrt 3 is about 7/8. The end moves aside by half an edge for each turned one.
            let eighths = 8.0 * length;
            programme.convex_cost(
                &[(straight, 8), (left, 7), (right, 7)],
                move |v| (v as f64 - eighths).powi(2) / (2.0 * eighths * 8.0),
                eighths as i64 - 16..=eighths as i64 + 16,
            );
            if wanted.is_none() {
                programme.convex_cost(&[(left, 1), (right, -1)], move |v| (v as f64).powi(2) / length, -2..=2);
                for (variable, now, cost) in
                    [(straight, now[0], LENGTHENED), (left, now[1], TURNED), (right, now[2], TURNED)]
                {
                    let now = i64::from(now);
                    programme.convex_cost(&[(variable, 1)], move |v| cost * (v - now).abs() as f64, now - 2..=now + 2);
                }
            }
            variables.insert(s, [straight, left, right]);
        }
        for &p in allowed {
            self.close(&mut programme, p, &variables);
        }
        for (p, range) in perimeters {
            let mut terms: Vec<Term> = Vec::new();
            let mut fixed = 0;
            for corner in &self.graph.patches[*p as usize].corners {
                match variables.get(&corner.side) {
                    Some(of) => terms.extend(of.map(|variable| (variable, 1))),
                    None => fixed += self.paving.courses[corner.side as usize].len() as i64,
                }
            }
            programme.row(&terms, range.start() - fixed..=range.end() - fixed);
        }
        let options = Options { max_nodes: MOST_NODES, time_limit: TIME, relative_gap: 1e-2 };
        match programme.solve(&options, None, &|| self.monitor.is_cancelled()) {
            Ok(solution) => Ok(Some(
                variables
                    .into_iter()
                    .map(|(s, of)| (s, of.map(|variable| solution.values[variable.index()] as i32)))
                    .collect(),
            )),
            Err(SolveError::Infeasible { .. } | SolveError::LimitWithoutSolution { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The outline of a patch ends where it begins, in the exact plane. A cone closes whatever its lengths.
    fn close(&self, programme: &mut Programme<'_>, p: u32, variables: &BTreeMap<u32, [Variable; 3]>) {
        let patch = &self.graph.patches[p as usize];
        if patch.total_interior_defect() != 0 {
            return;
        }
        let mut rows: [Vec<Term>; 4] = Default::default();
        let mut fixed = Point::ORIGIN;
        for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
            // A side walked backwards has its left where it has its left when walked forwards: the course is only reversed.
            let units = [0, 1, 11].map(|offset| Point::unit(direction + offset));
            if let Some(of) = variables.get(&corner.side) {
                for (axis, row) in rows.iter_mut().enumerate() {
                    row.extend((0..3).map(|k| (of[k], units[k].0[axis])));
                }
            } else {
                let counts = counts_of(&self.paving.courses[corner.side as usize]);
                for (unit, count) in units.into_iter().zip(counts) {
                    fixed = fixed + Point(unit.0.map(|x| x * count));
                }
            }
        }
        for (axis, row) in rows.iter().enumerate() {
            let rest = -i64::from(fixed.0[axis]);
            programme.row(row, rest..=rest);
        }
    }

    /// The paving with a zigzag by strips of tiles.
    fn by_strip(&self, zigzag: &Zigzag) -> Result<Option<(Paving, Edit)>, SurfaceError> {
        let (courses, filled) = (self.paving.courses.clone(), self.paving.filled.clone());
        let mut tiled = Tiled { graph: self.graph, courses, filled };
        // Patches beside a crossed side are passed, and no others change.
        let Some(edit) = tiled.take(zigzag, self.monitor)? else { return Ok(None) };
        let has = |p: &u32| tiled.filled[*p as usize].tiling.count(Kind::Rhombus) > 0;
        let with_rhombi = (0..tiled.filled.len() as u32).filter(has).collect();
        let relengthened = self.paving.relengthened.clone();
        let Tiled { courses, filled, .. } = tiled;
        Ok(Some((stitch(self.graph, courses, filled, relengthened, with_rhombi), edit)))
    }

    fn around(&self, patch: u32, counts: &BTreeMap<u32, Counts>) -> i64 {
        let edges = |side: u32| match counts.get(&side) {
            Some(counts) => i64::from(counts.iter().sum::<i32>()),
            None => self.paving.courses[side as usize].len() as i64,
        };
        self.graph.patches[patch as usize].corners.iter().map(|corner| edges(corner.side)).sum()
    }

    /// Courses for sides of new counts, and tilings of the patches beside them; the patch that had none most often when there
    /// are none for all.
    fn filled(&self, counts: &BTreeMap<u32, Counts>) -> Result<Result<Found, u32>, SurfaceError> {
        let is_asked = |s: u32| self.zigzags.iter().any(|zigzag| zigzag.side == s);
        let changed: Vec<u32> = counts
            .iter()
            .filter(|&(&s, of)| is_asked(s) || counts_of(&self.paving.courses[s as usize]) != *of)
            .map(|(&s, _)| s)
            .collect();
        // From the sides asked for outwards, so that patches are decided early.
        let mut order: Vec<u32> = Vec::new();
        let mut waiting: VecDeque<u32> = self.zigzags.iter().map(|zigzag| zigzag.side).collect();
        loop {
            while let Some(s) = waiting.pop_front() {
                if order.contains(&s) {
                    continue;
                }
                order.push(s);
                for &p in &self.beside[s as usize] {
                    let corners = &self.graph.patches[p as usize].corners;
                    waiting.extend(corners.iter().map(|corner| corner.side).filter(|side| changed.contains(side)));
                }
            }
            match changed.iter().find(|s| !order.contains(s)) {
                Some(&s) => waiting.push_back(s),
                None => break,
            }
        }
        let rank: BTreeMap<u32, usize> = order.iter().copied().zip(0..).collect();
        // The patches that are decided once the side of some rank is.
        let mut decided: Vec<Vec<u32>> = vec![Vec::new(); order.len()];
        for (p, patch) in (0..).zip(&self.graph.patches) {
            if let Some(last) = patch.corners.iter().filter_map(|corner| rank.get(&corner.side)).max() {
                decided[*last].push(p);
            }
        }
        let mut search = Search {
            editor: self,
            counts,
            order: &order,
            decided: &decided,
            courses: self.paving.courses.clone(),
            known: BTreeMap::new(),
            failures: BTreeMap::new(),
            outlines: 0,
        };
        if !search.from(0)? {
            let worst = search.failures.iter().max_by_key(|&(p, n)| (*n, std::cmp::Reverse(*p)));
            let fallback = decided.iter().flatten().next().copied().unwrap_or(0);
            return Ok(Err(worst.map_or(fallback, |(&p, _)| p)));
        }
        let courses = order.iter().map(|&s| (s, search.courses[s as usize].clone())).collect();
        let mut fillings = BTreeMap::new();
        for &p in decided.iter().flatten() {
            if let Some(filling) = search.filling(p)? {
                fillings.insert(p, filling);
            }
        }
        Ok(Ok(Found { courses, fillings }))
    }

    /// Ways to lay the edges of a side, the best first.
    fn ways(&self, s: u32, counts: Counts, courses: &[Course]) -> Vec<Course> {
        let old = &self.paving.courses[s as usize];
        let asked: Vec<&Zigzag> = self.zigzags.iter().filter(|zigzag| zigzag.side == s).collect();
        let mut ways: Vec<Course> = Vec::new();
        let mut add = |course: Course| {
            if counts_of(&course) == counts && !ways.contains(&course) {
                ways.push(course);
            }
        };
        if asked.is_empty() {
            // The sides asked for come first, and others that answer them look alike.
            for zigzag in self.zigzags {
                let course = &courses[zigzag.side as usize];
                add(course.clone());
                add(course.iter().rev().copied().collect());
            }
        }
        let &Zigzag { position, spread, edges, .. } = asked.first().copied().unwrap_or(&self.zigzags[0]);
        let leads = if edges > 0 { 1 } else { -1 };
        for spread in [spread, !spread] {
            for shift in SHIFTS {
                for leads in [leads, -leads] {
                    add(changed(old, counts, (position + shift).clamp(0.0, 1.0), spread, leads));
                }
            }
        }
        ways
    }

    fn stitched(&self, found: Found) -> (Paving, Edit) {
        let mut courses = self.paving.courses.clone();
        let mut filled = self.paving.filled.clone();
        let edit =
            Edit { sides: found.courses.keys().copied().collect(), patches: found.fillings.keys().copied().collect() };
        for (s, course) in found.courses {
            courses[s as usize] = course;
        }
        for (p, filling) in found.fillings {
            filled[p as usize] = filling;
        }
        let without = |patches: &[u32]| patches.iter().copied().filter(|p| !edit.patches.contains(p)).collect();
        let relengthened = self.paving.relengthened.clone();
        let paving = stitch(self.graph, courses, filled, relengthened, without(&self.paving.with_rhombi));
        (paving, edit)
    }
}

/// A search for courses under which every patch has a tiling, side after side.
struct Search<'a> {
    editor: &'a Editor<'a>,
    counts: &'a BTreeMap<u32, Counts>,
    order: &'a [u32],
    decided: &'a [Vec<u32>],
    courses: Vec<Course>,
    /// Tilings of outlines, by patch and the courses around it.
    known: BTreeMap<(u32, Vec<Course>), Option<Filling>>,
    /// How often each patch had none.
    failures: BTreeMap<u32, usize>,
    outlines: usize,
}

impl Search<'_> {
    fn from(&mut self, rank: usize) -> Result<bool, SurfaceError> {
        let Some(&s) = self.order.get(rank) else { return Ok(true) };
        let before = self.courses[s as usize].clone();
        let counts = self.counts.get(&s).copied().unwrap_or_else(|| counts_of(&before));
        for way in self.editor.ways(s, counts, &self.courses) {
            self.editor.monitor.check()?;
            self.courses[s as usize] = way;
            let mut has_failed = false;
            for &p in &self.decided[rank] {
                if self.filling(p)?.is_none() {
                    *self.failures.entry(p).or_default() += 1;
                    has_failed = true;
                    break;
                }
            }
            if !has_failed && self.from(rank + 1)? {
                return Ok(true);
            }
            if self.outlines > MOST_OUTLINES {
                break;
            }
        }
        self.courses[s as usize] = before;
        Ok(false)
    }

    /// The tiling of a patch with the present courses.
    fn filling(&mut self, p: u32) -> Result<Option<Filling>, SurfaceError> {
        let patch = &self.editor.graph.patches[p as usize];
        let around = patch.corners.iter().map(|corner| self.courses[corner.side as usize].clone()).collect();
        let key = (p, around);
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        self.outlines += 1;
        let filling = match fault(patch, &self.courses) {
            0 => fill_patch(patch, &self.courses, self.editor.fill, self.editor.monitor)?,
            _ => None,
        };
        self.known.insert(key, filling.clone());
        Ok(filling)
    }
}
