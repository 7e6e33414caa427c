//! How many quads go along each base edge.
//!
//! The paper samples every template alike; measured, one even count misses the target by up to half and squeezes short
//! edges. Here each edge has its own count, for the edge length wanted there:
//!
//! 1. Opposite sides of four-sided patches that are one base edge each form chords, which are cut into pieces of one count:
//!    [`crate::chords`].
//! 2. The pieces are the unknowns of [`quadrangulate::quantise`], each at the mean logarithm of its lengths, with even sums
//!    round every patch that is not crossed by whole pieces on all sides.
//! 3. The edge length is searched for until the quads number what was asked; single pieces then make up the rest.

mod make_up;
mod paint;

use crate::base::Base;
use crate::chords::{Run, Term, chords, cut, opposite};
use crate::curvature::mean_along;
use crate::division::parts;
use crate::error::LayoutError;
use crate::lines::divided;
use crate::patch::{Patch, Plan};
use crate::sizing::scaled_area;
use crate::templates::{Chosen, TemplateError};
use mesh::{DVec3, Monitor, NONE};
use quadrangulate::Filler;
use quadrangulate::quantise::{self, Layout, MOST, QuantiseError, SubSide, quantise_instantly};
use solve::components::connected_components;

pub(crate) use paint::{Contrast, spread};

/// Rounds of the search for the edge length.
const SEARCH_ROUNDS: usize = 14;
/// The search ends when the quads are within this fraction of the target.
const CLOSE_ENOUGH: f64 = 0.004;
/// Weight of the condition that lets a three- or five-sided patch do with one irregular vertex, per squared miss.
const PATTERN_WEIGHT: f64 = 2.0;
/// How far the chords of a bent feature may leave it, in mean edge lengths, before it gets more edges; and how much more its
/// wishes count than those of others then.
pub(crate) const CHORD_ERROR: f64 = 0.045;
const BENT_WEIGHT: f64 = 8.0;
/// Bends are not followed with edges shorter than this, in mean edge lengths; nor, where so many quads would be too many by
/// [`MOST_MISS`], than these.
pub(crate) const SHORTEST: f64 = 0.1;
const LESS_SHORT: [f64; 4] = [0.25, 0.4, 0.7, f64::INFINITY];
/// Where counts fall short of what bends need, these weigh so many times more in the next of some rounds.
const URGENT: f64 = 10.0;
const URGENT_ROUNDS: usize = 3;
/// Chords are cut after all when whole ones miss the target by more than this fraction, at this price.
pub(crate) const MOST_MISS: f64 = 0.045;
const CUTTING: f64 = 200.0;
/// Weight of counts that are fixed where chords are cut: two different ones are never in one piece.
const FIXED_WEIGHT: f64 = 1e9;
/// How much longer or shorter edges beside others may be to make up for a number of quads.
const MOST_CHANGE: f64 = 1.2;

/// How large quads shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// So many quads on the whole surface, at least 1.
    TargetFaces(usize),
    /// Edges of this length, scene units, where the density is 1.
    EdgeLength(f64),
}

/// Counts and what they give.
#[derive(Debug)]
pub(crate) struct Counts {
    /// Quads along each base edge; 0 for edges inside patches.
    pub of_edge: Vec<u32>,
    /// The edge length aimed at, scene units.
    pub edge_length: f64,
}

/// What is wanted of a piece of a chord.
#[derive(Debug, Clone, Copy)]
struct Ideal {
    /// Mean logarithm of its lengths.
    mean: f64,
    /// The area beside it; more where a bent feature needs its edges.
    area: f64,
    /// The edges that its bent features need, whatever the edge length; 0 without.
    least: f64,
    /// The count that it has already.
    fixed: Option<u32>,
}

impl Ideal {
    fn count(&self, h: f64) -> f64 {
        (self.mean.exp() / h).max(self.least).min(f64::from(MOST))
    }
}

/// Counts that edges have already.
#[derive(Debug, Clone, Copy, Default)]
struct Fixed<'a> {
    /// For each base edge; or none at all.
    counts: &'a [Option<u32>],
    /// Whether every edge has a count of its own instead of every chord.
    apart: bool,
}

impl Fixed<'_> {
    fn count(&self, edge: u32) -> Option<u32> {
        self.counts.get(edge as usize).copied().flatten()
    }
}

/// Everything but the edge length.
struct Sides<'a> {
    base: &'a Base,
    patches: &'a [Patch],
    templates: &'a [Chosen],
    /// The one or two pieces of chords whose counts add up to each base edge's; [`NONE`] for none.
    parts: Vec<[u32; 2]>,
    ideals: Vec<Ideal>,
    /// Pieces round each patch that whole pieces do not make even by themselves; `sub_sides` still empty.
    layout: Layout,
    /// Whether a piece occurs in `layout`.
    bound: Vec<bool>,
}

/// Counts for all base edges that give the number of quads wanted; see [`count_for`]. Bends are followed as far as that allows, with
/// edges not shorter than `shortest`, in mean edge lengths.
pub(crate) fn count(
    plan: Plan<'_>,
    wanted: Size,
    irregularity: f64,
    shortest: f64,
    monitor: &Monitor,
) -> Result<Counts, LayoutError> {
    let (mut found, mut made) = count_for(plan, wanted, irregularity, shortest, monitor)?;
    for shortest in LESS_SHORT.into_iter().filter(|less| *less > shortest) {
        match wanted {
            Size::TargetFaces(faces)
                if made > (1.0 + MOST_MISS) * faces as f64
                    || (irregularity.is_infinite() && made < (1.0 - MOST_MISS) * faces as f64) =>
            {
                (found, made) = count_for(plan, wanted, irregularity, shortest, monitor)?;
            }
            _ => break,
        }
    }
    Ok(found)
}

/// Counts for all base edges, and the quads that the filled patches will have. `irregularity` is what a patch with unequal opposite sides costs, in quads stretched by e.
fn count_for(
    plan: Plan<'_>,
    wanted: Size,
    irregularity: f64,
    shortest: f64,
    monitor: &Monitor,
) -> Result<(Counts, f64), LayoutError> {
    let Plan { base, size, .. } = plan;
    let area = scaled_area(&base.surface, |v| size[v as usize]);
    let start = match wanted {
        Size::EdgeLength(h) if h > 0.0 && h.is_finite() => h,
        Size::EdgeLength(_) => return Err(LayoutError::BadOption { option: "edge length", expected: "positive" }),
        Size::TargetFaces(0) => return Err(LayoutError::BadOption { option: "target faces", expected: "at least 1" }),
        Size::TargetFaces(faces) => (area / faces as f64).sqrt(),
    };
    let sides = Sides::new(plan, &Fixed::default(), start, shortest, irregularity);
    let mut filler = Filler::new();
    let mut counts = sides.solve(start, monitor)?;
    let mut edge_length = start;
    if let Size::TargetFaces(faces) = wanted {
        let target = faces as f64;
        let miss = |found: f64| (found / target).ln().abs();
        let mut found = sides.faces(&counts, &mut filler)?;
        let mut best = miss(found);
        let (mut coarse, mut fine): (Option<f64>, Option<f64>) = (None, None);
        let mut h = start;
        for _ in 0..SEARCH_ROUNDS {
            if best < CLOSE_ENOUGH {
                break;
            }
            if found > target {
                fine = Some(h);
            } else {
                coarse = Some(h);
            }
            h = match (fine, coarse) {
                (Some(fine), Some(coarse)) => (fine * coarse).sqrt(),
                _ => h * (found / target).sqrt().clamp(0.25, 4.0) * if found > target { 1.02 } else { 0.98 },
            };
            let next = sides.solve(h, monitor)?;
            found = sides.faces(&next, &mut filler)?;
            if miss(found) < best {
                (best, counts, edge_length) = (miss(found), next, h);
            }
        }
        sides.make_up(&mut counts, target, edge_length, &mut filler, monitor)?;
        if irregularity.is_infinite() {
            sides.make_up_in_pairs(&mut counts, target, edge_length, &mut filler, monitor)?;
        }
    }
    let faces = sides.faces(&counts, &mut filler)?;
    if let Size::TargetFaces(target) = wanted
        && irregularity.is_infinite()
        && (faces / target as f64 - 1.0).abs() > MOST_MISS
        && shortest.is_infinite()
    {
        // One chord that winds over most of the surface leaves too few numbers of quads to choose from: cut it.
        return count_for(plan, wanted, CUTTING, shortest, monitor);
    }
    let of_edge = (0..base.edges.len() as u32).map(|e| sides.along(e, &counts)).collect();
    Ok((Counts { of_edge, edge_length }, faces))
}

/// Counts that the coarsest layout could have, whatever the lengths: two quads along each piece of a chord, so that no two of its
/// edges join the same vertices.
pub(crate) fn coarsest(plan: Plan<'_>) -> Vec<u32> {
    let sides = Sides::new(plan, &Fixed::default(), 1.0, f64::INFINITY, f64::INFINITY);
    let counts = vec![2; sides.ideals.len()];
    (0..plan.base.edges.len() as u32).map(|e| sides.along(e, &counts)).collect()
}

/// Counts for the base edges round the patches of a plan that are only a part of the layout: those that edges have already where
/// other patches are, 0 on edges of others alone. For edges of about length `h` and, if some are wanted, so many quads.
pub(crate) fn count_beside(
    plan: Plan<'_>,
    fixed: &[Option<u32>],
    [h, irregularity]: [f64; 2],
    wanted: Option<f64>,
    monitor: &Monitor,
) -> Result<Counts, LayoutError> {
    // Chords between fixed edges may leave patches an odd border. Edges by themselves cannot: around all patches together there are as
    // many fixed edges as there were around those which lay there before, whose borders were even.
    match beside(plan, fixed, [h, irregularity], wanted, false, monitor) {
        Err(LayoutError::Counts(QuantiseError::OddComponent { .. } | QuantiseError::TooShort { .. })) => {
            beside(plan, fixed, [h, irregularity], wanted, true, monitor)
        }
        found => found,
    }
}

fn beside(
    plan: Plan<'_>,
    fixed: &[Option<u32>],
    [h, irregularity]: [f64; 2],
    wanted: Option<f64>,
    apart: bool,
    monitor: &Monitor,
) -> Result<Counts, LayoutError> {
    let sides = Sides::new(plan, &Fixed { counts: fixed, apart }, h, SHORTEST, irregularity);
    let mut filler = Filler::new();
    let mut best: Option<(f64, Vec<u32>)> = None;
    let mut edge_length = h;
    for _ in 0..SEARCH_ROUNDS {
        let counts = sides.solve(edge_length, monitor)?;
        let found = sides.faces(&counts, &mut filler)?;
        let miss = wanted.map_or(0.0, |wanted| (found - wanted).abs());
        if best.as_ref().is_none_or(|(least, _)| miss < *least) {
            best = Some((miss, counts));
        }
        let Some(wanted) = wanted.filter(|_| miss > CLOSE_ENOUGH * found) else { break };
        let next = edge_length * (found / wanted.max(1.0)).sqrt().clamp(0.9, 1.1);
        edge_length = next.clamp(h / MOST_CHANGE, h * MOST_CHANGE);
    }
    let counts = best.map_or_else(Vec::new, |(_, counts)| counts);
    let of_edge = (0..plan.base.edges.len() as u32).map(|e| sides.along(e, &counts)).collect();
    Ok(Counts { of_edge, edge_length: h })
}

impl<'a> Sides<'a> {
    fn new(plan: Plan<'a>, fixed: &Fixed<'_>, h: f64, shortest: f64, irregularity: f64) -> Self {
        let Plan { base, measures, patches, templates, size, plain, least: floor } = plan;
        let at = |v: u32| base.surface.positions[v as usize];
        let step = |w: &[u32]| at(w[0]).distance(at(w[1])) / f64::midpoint(size[w[0] as usize], size[w[1] as usize]);
        let mut lengths: Vec<f64> =
            base.edges.iter().map(|e| e.path.windows(2).map(step).sum::<f64>().max(1e-6 * h)).collect();
        let edge_of = |corner: u32| base.triangle_edges[corner as usize / 3][corner as usize % 3];
        let mut areas = vec![0.0; base.edges.len()];
        let mut links: Vec<Vec<u32>> = vec![Vec::new(); base.edges.len()];
        for patch in patches {
            let area: f64 = patch.triangles.iter().map(|&t| measures.areas[t as usize]).sum();
            let mean_size = patch.border.iter().map(|&c| {
                let e = &base.edges[edge_of(c) as usize].path;
                size[e[e.len() / 2] as usize]
            });
            let mean_size = mean_size.sum::<f64>() / patch.border.len() as f64;
            for &corner in &patch.border {
                areas[edge_of(corner) as usize] += area / mean_size.powi(2) / 2.0;
            }
            for (a, b) in opposite(patch).map(|(a, b)| (edge_of(a), edge_of(b))) {
                if a != b && !fixed.apart {
                    links[a as usize].push(b);
                    links[b as usize].push(a);
                }
            }
        }
        // Bent features need more edges than their length says, and will have them before others have theirs.
        let mut least = vec![None; base.edges.len()];
        for (e, edge) in base.edges.iter().enumerate().filter(|(e, _)| measures.rails[*e]) {
            let points: Vec<DVec3> = edge.path.iter().map(|&v| at(v)).collect();
            let edge_length = mean_along(&edge.path, plain);
            // The last resort asks for nothing.
            let error = if shortest.is_finite() { CHORD_ERROR * edge_length } else { f64::INFINITY };
            let wanted = parts(&points, error, shortest * edge_length).len() as f64 * h;
            if wanted > 1.5 * h {
                least[e] = Some(wanted.ln());
            }
            lengths[e] = lengths[e].max(wanted);
        }
        for (e, &floor) in floor.iter().enumerate().filter(|(_, floor)| **floor > 1) {
            let wanted = (f64::from(floor) * h).ln();
            least[e] = Some(least[e].map_or(wanted, |least: f64| least.max(wanted)));
        }
        for e in 0..base.edges.len() as u32 {
            if let Some(count) = fixed.count(e) {
                (lengths[e as usize], least[e as usize]) = (f64::from(count) * h, None);
                areas[e as usize] *= FIXED_WEIGHT;
            }
        }
        let mut sides = Self {
            base,
            patches,
            templates,
            parts: vec![[NONE; 2]; base.edges.len()],
            ideals: Vec::new(),
            layout: Layout::default(),
            bound: Vec::new(),
        };
        if irregularity.is_infinite() && templates.is_empty() {
            sides.conform(&lengths, &areas, &least, h);
            return sides;
        }
        for chord in chords(&links, &areas) {
            let term = |&e: &u32| {
                let e = e as usize;
                Term { weight: areas[e] / (h * h), value: lengths[e].ln(), least: least[e] }
            };
            let terms: Vec<Term> = chord.edges.iter().map(term).collect();
            for piece in cut(&terms, chord.closed, irregularity) {
                let counts = piece.iter().filter_map(|&i| fixed.count(chord.edges[i]));
                let count = counts.reduce(u32::max);
                let mut run = Run::default();
                for &i in &piece {
                    run.add(&terms[i]);
                    sides.parts[chord.edges[i] as usize][0] = sides.ideals.len() as u32;
                }
                let urgency = if run.value() > run.mean() { BENT_WEIGHT } else { 1.0 };
                let least = run.least.map_or(0.0, |least| least.exp() / h);
                sides.ideals.push(Ideal { mean: run.mean(), area: run.weight * h * h * urgency, least, fixed: count });
            }
        }
        sides.bind();
        sides
    }

    /// The first piece of a half-edge's base edge.
    fn piece(&self, corner: u32) -> u32 {
        self.parts[self.edge(corner) as usize][0]
    }

    fn edge(&self, corner: u32) -> u32 {
        self.base.triangle_edges[corner as usize / 3][corner as usize % 3]
    }

    /// Quads along a base edge.
    fn along(&self, edge: u32, counts: &[u32]) -> u32 {
        self.parts[edge as usize].iter().filter(|&&piece| piece != NONE).map(|&piece| counts[piece as usize]).sum()
    }

    /// Pieces for the coarsest layout: no chord is cut. Patches of other than four sides are seen as divided into quads from
    /// their middle, or by the line that ends in them, so that the chords of the halves of their sides go on through them; edges that no such
    /// line crosses are whole. Any counts of these fit everywhere, and all irregular vertices lie on few lines.
    fn conform(&mut self, lengths: &[f64], areas: &[f64], least: &[Option<f64>], h: f64) {
        let divided = divided(self.base, self.patches);
        // A whole edge is numbered 2 e, its halves 2 e and 2 e + 1 along base edge e.
        let unit = |sides: &Self, corner: u32, second: bool| {
            let edge = sides.edge(corner);
            let forward = sides.base.edges[edge as usize].ends[0]
                == sides.base.triangles[corner as usize / 3][corner as usize % 3];
            2 * edge + u32::from(divided[edge as usize] && second == forward)
        };
        let mut joined = Vec::new();
        for patch in self.patches {
            let n = patch.border.len();
            if patch.split {
                joined.push((unit(self, patch.border[0], false), unit(self, patch.border[1], false)));
                joined.push((unit(self, patch.border[0], true), unit(self, patch.border[2], false)));
                continue;
            }
            for (i, &corner) in patch.border.iter().enumerate() {
                let across = patch.border[(i + 2) % n];
                joined.push((unit(self, corner, true), unit(self, across, false)));
                if n == 4 {
                    joined.push((unit(self, corner, false), unit(self, across, true)));
                }
            }
        }
        for class in connected_components(2 * lengths.len(), joined) {
            let mut run = Run::default();
            for &unit in &class {
                let e = unit as usize / 2;
                if areas[e] > 0.0 && (unit % 2 == 0 || divided[e]) {
                    let part: f64 = if divided[e] { 0.5 } else { 1.0 };
                    let least = least[e].map(|least| least + part.ln());
                    run.add(&Term { weight: part * areas[e], value: (part * lengths[e]).ln(), least });
                }
            }
            if run.weight <= 0.0 {
                continue;
            }
            for &unit in &class {
                self.parts[unit as usize / 2][unit as usize % 2] = self.ideals.len() as u32;
            }
            let least = run.least.map_or(0.0, |least| least.exp() / h);
            self.ideals.push(Ideal { mean: run.mean(), area: run.weight, least, fixed: None });
        }
        self.bound = vec![false; self.ideals.len()];
    }

    /// Fills in the patches of the quantisation.
    fn bind(&mut self) {
        let mut dummies = self.ideals.len() as u32;
        for patch in self.patches.iter().filter(|patch| patch.template.is_none()) {
            let pieces: Vec<Vec<u32>> =
                patch.sides().map(|side| side.iter().map(|&c| self.piece(c)).collect()).collect();
            let equal = |k: usize| pieces.len() == 4 && pieces[k] == pieces[k + 2] && pieces[k].len() == 1;
            let cut = |k: usize| !equal(k) && pieces[k].len() == 1 && pieces[k + 2].len() == 1;
            let sides = match (equal(0), equal(1)) {
                (true, true) => continue,
                (false, false) => pieces.clone(),
                (first, _) => {
                    let k = usize::from(first);
                    if cut(k) {
                        // Where a chord was cut nothing is gained by nearly equal sides.
                        vec![pieces[k].clone(), pieces[k + 2].clone()]
                    } else {
                        // Two sub-sides of one edge each stand for the sides that are equal anyway.
                        dummies += 2;
                        vec![pieces[k].clone(), vec![dummies - 2], pieces[k + 2].clone(), vec![dummies - 1]]
                    }
                }
            };
            self.layout.patches.push(quantise::Patch { sides });
        }
        self.bound = vec![false; self.ideals.len()];
        for &piece in self.layout.patches.iter().flat_map(|p| p.sides.iter().flatten()) {
            if let Some(bound) = self.bound.get_mut(piece as usize) {
                *bound = true;
            }
        }
    }
    /// Counts of all pieces for an edge length.
    fn solve(&self, h: f64, monitor: &Monitor) -> Result<Vec<u32>, LayoutError> {
        monitor.check()?;
        let mut layout = self.layout.clone();
        let used =
            layout.patches.iter().flat_map(|p| p.sides.iter().flatten()).max().map_or(0, |&last| last as usize + 1);
        for wanted in &self.ideals {
            let ideal = wanted.count(h);
            // Near the ideal the stretched area, area x ln(n / ideal)², is this times the squared deviation.
            let weight = (wanted.area / (h * h) / ideal.max(0.5).powi(2)).clamp(1e-6, 1e6);
            layout.sub_sides.push(SubSide { ideal, fixed: wanted.fixed, least: 1, weight });
        }
        // The sides of a template have the counts that it can have.
        for patch in self.patches {
            let Some(template) = patch.template.map(|index| &self.templates[index]) else { continue };
            let pieces: Vec<u32> = patch.border.iter().map(|&c| self.piece(c)).collect();
            let wanted: Vec<f64> = pieces.iter().map(|&piece| layout.sub_sides[piece as usize].ideal).collect();
            for (&piece, count) in pieces.iter().zip(template.pattern.nearest_counts(&wanted)) {
                let fixed = &mut layout.sub_sides[piece as usize].fixed;
                if fixed.is_some_and(|other| other != count) {
                    return Err(TemplateError::DoesNotFit { edge: template.edge }.into());
                }
                *fixed = Some(count);
            }
        }
        layout
            .sub_sides
            .resize(used.max(self.ideals.len()), SubSide { ideal: 1.0, fixed: Some(1), least: 1, weight: 1.0 });
        let options = quantise::Options { pattern_weight: PATTERN_WEIGHT, ..quantise::Options::default() };
        let mut counts = quantise_instantly(&layout, &options, &|| monitor.is_cancelled())?.counts;
        for _ in 0..URGENT_ROUNDS {
            let short = |k: &usize| f64::from(counts[*k]) < self.ideals[*k].least - 0.5;
            let short: Vec<usize> = (0..self.ideals.len()).filter(short).collect();
            if short.is_empty() {
                break;
            }
            for k in short {
                layout.sub_sides[k].weight = (URGENT * layout.sub_sides[k].weight).min(1e6);
            }
            counts = quantise_instantly(&layout, &options, &|| monitor.is_cancelled())?.counts;
        }
        counts.truncate(self.ideals.len());
        Ok(counts)
    }

    /// Counts of the sides of a patch.
    fn sides_of(&self, patch: &Patch, counts: &[u32]) -> Vec<u32> {
        patch.sides().map(|side| side.iter().map(|&c| self.along(self.edge(c), counts)).sum()).collect()
    }

    /// Quads that the filled patches will have.
    fn faces(&self, counts: &[u32], filler: &mut Filler) -> Result<f64, LayoutError> {
        let mut faces = 0.0;
        for (index, patch) in self.patches.iter().enumerate() {
            faces += self.faces_of(index, patch, counts, filler)?;
        }
        Ok(faces)
    }

    fn faces_of(&self, index: usize, patch: &Patch, counts: &[u32], filler: &mut Filler) -> Result<f64, LayoutError> {
        let sides = self.sides_of(patch, counts);
        if let Some(template) = patch.template.map(|index| &self.templates[index]) {
            let filled = template.pattern.fill(&sides);
            return Ok(filled.ok_or(TemplateError::DoesNotFit { edge: template.edge })?.quads.len() as f64);
        }
        if patch.is_grid(&sides) {
            return Ok(f64::from(sides[1]) * f64::from(sides[2]));
        }
        Ok(match sides[..] {
            [a, b, c, d] if a == c && b == d => f64::from(a) * f64::from(b),
            _ => filler.fill(&sides).map_err(|source| LayoutError::Fill { patch: index, source })?.quads.len() as f64,
        })
    }
}
