//! Tiles for every patch of a patch graph (section 4.2.2): each is filled by the plane solver and joined to its
//! neighbours by index.
//!
//! Nodes and the vertices along sides are made once, for both patches. The inside of a patch goes to the place that the
//! harmonic map of its tiles gives it, with the weights of equilateral triangles and squares: these are the cotangents of
//! least-squares conformal maps (whose area term is the same for all maps of one border), and as none is negative it
//! is a mean-value map as well, which does not fold into a convex border.

use super::choice::choose;
use super::cone::{Filling, fill_cone};
use super::courses::{Course, code, courses};
use super::halves::{Halfway, Slide, Steps, rounded};
use super::lengths::{Lengths, Perimeter, Wishes, side_lengths};
use super::patch_graph::{Patch, PatchGraph};
use super::{Fill, SurfaceError};
use crate::plane::Point;
use crate::rhombi::tile_with_rhombi;
use crate::tile::Kind;
use crate::{Boundary, Certificate, Options, TilingError};
use mesh::{DVec3, Monitor};
use num_bigint::BigUint;
use rayon::prelude::*;
use solve::cholesky::Factor;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Memory for the tilings of one patch, bytes.
const MEMORY: usize = 1 << 25;

/// Programmes of lengths that a patch graph is worth.
const EFFORT: usize = 5;

/// Patches without a tiling that are mended; with more, the patch graph is not worth keeping.
const MOST_EMPTY: usize = 3;

/// How often other lengths are tried before rhombi are laid; and how often patches of both tiles, before all are of one.
const OTHER_LENGTHS: usize = 1;
const PLAIN_ROUNDS: usize = 3;

/// Most rhombi that the certificate may ask for in a patch; with more, the patch graph is not worth keeping.
const MOST_RHOMBI: i32 = 16;

/// Weights of the harmonic map: half the cotangent of 60 and of 45 degrees.
const TRIANGLE_WEIGHT: f64 = 0.288_675_134_594_812_9;
const SQUARE_WEIGHT: f64 = 0.5;

/// What each patch was filled with.
#[derive(Debug)]
pub(super) struct Paving {
    /// Edges of each side.
    pub courses: Vec<Course>,
    /// The tiling of each patch.
    pub filled: Vec<Filling>,
    /// Vertices of each tile, counter-clockwise.
    pub tiles: Vec<Vec<u32>>,
    pub kinds: Vec<Kind>,
    /// Patch of each tile.
    pub patch_of: Vec<u32>,
    /// Vertices along each side, its nodes included; nodes come first, so a node's vertex has its index.
    pub along: Vec<Vec<u32>>,
    pub sheets: Vec<Sheet>,
    pub vertex_count: usize,
    /// How many tilings each patch has, where that is known.
    pub counts: Vec<Option<BigUint>>,
    /// Patches that got other lengths than the best because these had no tiling, and those that got rhombi.
    pub relengthened: Vec<u32>,
    pub with_rhombi: Vec<u32>,
    /// Nodes in the middle of an edge, which go to its end.
    pub slides: Vec<Slide>,
    /// Error of the lengths of sides, in squared edges over their lengths, and what they cost besides.
    pub cost: f64,
}

/// The tiles of one patch, with the vertices along a slit there twice.
#[derive(Debug)]
pub(super) struct Sheet {
    /// Vertex of the result for each of the sheet's own: around the outline first, from corner 0 of a flat patch.
    pub vertices: Vec<u32>,
    /// How many of them are on the outline.
    pub outline: usize,
    /// Edges of the slit; 0 for a flat patch.
    pub slit: usize,
    /// The tiles by the sheet's own vertices.
    pub tiles: Vec<Vec<u32>>,
}

/// Lengths, courses, and the patches that have a tiling with them.
struct Laid {
    steps: Vec<Steps>,
    courses: Vec<Course>,
    filled: Vec<Option<Filling>>,
    /// Nodes in the middle of an edge.
    slides: Vec<Slide>,
    /// Of the lengths.
    cost: f64,
}

impl Laid {
    fn new(
        graph: &PatchGraph,
        edge_length: f64,
        wishes: &Wishes,
        nodes: &[Halfway],
        fill: Fill,
        monitor: &Monitor,
    ) -> Result<Option<Self>, SurfaceError> {
        monitor.stage("lengths", 0.0)?;
        let Some(lengths) = side_lengths(graph, edge_length, wishes, nodes, monitor)? else { return Ok(None) };
        let Lengths { of_side, is_half, cost } = lengths;
        let halfway: Vec<&Halfway> = nodes.iter().zip(is_half).filter(|(_, is)| *is).map(|(node, _)| node).collect();
        let Some((steps, slides)) = rounded(graph, &of_side, &halfway) else { return Ok(None) };
        let courses = courses(graph, &steps, fill.seed(), monitor)?;
        let filled = fill_all(graph, &courses, fill, monitor)?;
        Ok(Some(Self { steps, courses, filled, slides, cost }))
    }

    fn empty(&self) -> impl Iterator<Item = usize> {
        self.filled.iter().enumerate().filter(|(_, filling)| filling.is_none()).map(|(p, _)| p)
    }
}

/// Lengths, outlines and tiles, both kinds of them in every patch that allows it when `mixes`; `None` when no lengths close all
/// patches, or one has no tiling even with rhombi. Any of `nodes` may lie in the middle of an edge.
pub(super) fn pave(
    graph: &PatchGraph,
    nodes: &[Halfway],
    edge_length: f64,
    fill: Fill,
    mixes: bool,
    monitor: &Monitor,
) -> Result<Option<Paving>, SurfaceError> {
    let mut effort = EFFORT;
    let mut lay = |wishes: &Wishes| {
        if effort == 0 {
            return Ok(None);
        }
        effort -= 1;
        Laid::new(graph, edge_length, wishes, nodes, fill, monitor)
    };
    let mut wishes = Wishes::default();
    let mut laid = None;
    if mixes {
        wishes.mixing = vec![true; graph.patches.len()];
        for _ in 0..PLAIN_ROUNDS {
            laid = lay(&wishes)?;
            let Some(mixed) = &laid else { break };
            if mixed.empty().next().is_none() {
                break;
            }
            // What has no tiling of both is laid in one lattice next, where that is possible.
            mixed.empty().for_each(|p| wishes.mixing[p] = false);
        }
    }
    if laid.as_ref().is_none_or(|laid| laid.empty().next().is_some()) {
        wishes.mixing.clear();
        laid = lay(&wishes)?;
    }
    let Some(mut laid) = laid else { return Ok(None) };
    if laid.empty().next().is_some()
        && let Some(other) = lay(&Wishes { of_lattices: true, ..Wishes::default() })?
        && other.empty().count() < laid.empty().count()
    {
        laid = other;
    }
    if laid.empty().count() > MOST_EMPTY {
        return Ok(None);
    }
    let mut relengthened = Vec::new();
    for _ in 0..OTHER_LENGTHS {
        let Some(p) = laid.empty().next() else { break };
        let around: i64 = graph.patches[p]
            .corners
            .iter()
            .map(|c| i64::from(laid.steps[c.side as usize].straight + laid.steps[c.side as usize].pairs))
            .sum();
        let mut best: Option<(Laid, Wishes)> = None;
        for (least, most) in [(around + 1, i64::MAX), (0, around - 1)] {
            // Of the edges that it has, so that the programme has no more to choose.
            let kinds = laid.steps.iter().map(|steps| [steps.straight > 0, steps.pairs > 0]);
            let mut tried = Wishes { kinds: kinds.collect(), ..wishes.clone() };
            tried.perimeters.push(Perimeter { patch: p, least, most });
            if let Some(other) = lay(&tried)?
                && best.as_ref().is_none_or(|(known, _)| other.cost < known.cost)
            {
                best = Some((other, tried));
            }
        }
        let Some((other, tried)) = best else { break };
        wishes = tried;
        if other.empty().count() < laid.empty().count() {
            relengthened.push(p as u32);
            laid = other;
        }
    }
    let Laid { courses: chosen, mut filled, slides, cost, .. } = laid;
    let mut with_rhombi = Vec::new();
    for (p, tiling) in filled.iter_mut().enumerate() {
        if tiling.is_some() {
            continue;
        }
        let Ok(boundary) = Boundary::new(&code(&graph.patches[p], &chosen)) else { return Ok(None) };
        if Certificate::new(boundary.directions()).defect.abs() > MOST_RHOMBI {
            return Ok(None);
        }
        match tile_with_rhombi(&boundary, fill.seed(), &Options { memory: MEMORY }, monitor) {
            Ok(Some(found)) => {
                *tiling = Some(Filling { tiling: found.tiling, boundary, start: 0, slit: 0, count: None });
            }
            Ok(None) | Err(TilingError::Unsettled { .. } | TilingError::Memory { .. }) => return Ok(None),
            Err(TilingError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(error) => return Err(SurfaceError::Filling(error)),
        }
        with_rhombi.push(p as u32);
    }
    let filled: Vec<Filling> = filled.into_iter().flatten().collect();
    Ok(Some(Paving { slides, cost, ..stitch(graph, chosen, filled, relengthened, with_rhombi) }))
}

/// A tiling of each patch where there is one.
fn fill_all(
    graph: &PatchGraph,
    courses: &[Course],
    fill: Fill,
    monitor: &Monitor,
) -> Result<Vec<Option<Filling>>, SurfaceError> {
    let count = graph.patches.len() as f64;
    let done = AtomicUsize::new(0);
    let fill_one = |patch: &Patch| {
        monitor.stage("filling", done.fetch_add(1, Ordering::Relaxed) as f64 / count)?;
        fill_patch(patch, courses, fill, monitor)
    };
    graph.patches.par_iter().map(fill_one).collect()
}

/// A tiling of a patch; `None` when there is none, or none within the memory.
pub(super) fn fill_patch(
    patch: &Patch,
    courses: &[Course],
    fill: Fill,
    monitor: &Monitor,
) -> Result<Option<Filling>, SurfaceError> {
    let options = Options { memory: MEMORY };
    let code = code(patch, courses);
    let defect = patch.total_interior_defect();
    let filling = if defect == 0 {
        let Ok(boundary) = Boundary::new(&code) else { return Ok(None) };
        choose(&boundary, fill, monitor)
            .map(|(tiling, count)| tiling.map(|tiling| Filling { tiling, boundary, start: 0, slit: 0, count }))
    } else {
        fill_cone(&code, defect, fill.seed(), &options, monitor)
    };
    match filling {
        Ok(filling) => Ok(filling),
        Err(TilingError::Memory { .. }) => Ok(None),
        Err(TilingError::Cancelled(cancelled)) => Err(cancelled.into()),
        Err(error) => Err(SurfaceError::Filling(error)),
    }
}

/// Numbers the vertices: nodes, then those along sides, then those inside patches.
pub(super) fn stitch(
    graph: &PatchGraph,
    courses: Vec<Course>,
    filled: Vec<Filling>,
    relengthened: Vec<u32>,
    with_rhombi: Vec<u32>,
) -> Paving {
    let mut count = graph.nodes.len() as u32;
    let mut fresh = || {
        count += 1;
        count - 1
    };
    let along: Vec<Vec<u32>> = graph
        .sides
        .iter()
        .zip(&courses)
        .map(|(side, course)| {
            let inner = (1..course.len()).map(|_| fresh()).collect::<Vec<_>>();
            [&side.ends[..1], &inner, &side.ends[1..]].concat()
        })
        .collect();
    let (mut tiles, mut kinds, mut sheets, mut patch_of) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for ((p, patch), filling) in (0..).zip(&graph.patches).zip(&filled) {
        let mut vertices = Vec::new();
        for corner in &patch.corners {
            let side = &along[corner.side as usize];
            let mut side = side.clone();
            if corner.reversed {
                side.reverse();
            }
            vertices.extend_from_slice(&side[..side.len() - 1]);
        }
        vertices.rotate_left(filling.start);
        if filling.slit > 0 {
            let inner: Vec<u32> = (0..filling.slit).map(|_| fresh()).collect();
            vertices.push(vertices[0]);
            vertices.extend(&inner);
            vertices.extend(inner.iter().rev().skip(1));
        }
        let outline = vertices.len();
        let mut own: BTreeMap<Point, u32> = filling.boundary.points().iter().copied().zip(0..).collect();
        let mut sheet_tiles = Vec::new();
        for tile in &filling.tiling.tiles {
            let corners = tile.corners().map(|corner| {
                *own.entry(corner).or_insert_with(|| {
                    vertices.push(fresh());
                    vertices.len() as u32 - 1
                })
            });
            let corners: Vec<u32> = corners.collect();
            tiles.push(corners.iter().map(|&v| vertices[v as usize]).collect());
            kinds.push(tile.kind);
            patch_of.push(p);
            sheet_tiles.push(corners);
        }
        sheets.push(Sheet { vertices, outline, slit: filling.slit, tiles: sheet_tiles });
    }
    let vertex_count = count as usize;
    let counts = filled.iter().map(|filling| filling.count.clone()).collect();
    Paving {
        courses,
        filled,
        tiles,
        kinds,
        patch_of,
        along,
        sheets,
        vertex_count,
        counts,
        relengthened,
        with_rhombi,
        slides: Vec::new(),
        cost: 0.0,
    }
}

/// Which tiles and vertices belong to which patches and sides.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PatchTiles {
    /// Patch of each face.
    pub patch_of: Vec<u32>,
    /// Vertices along each side, as it runs, its nodes included. A node's vertex has the node's index.
    pub along: Vec<Vec<u32>>,
    /// Direction of each edge of a side less that of the side, in units of 30 degrees: 0 straight on, 1 to the left, -1 to
    /// the right.
    pub courses: Vec<Vec<i8>>,
}

impl Paving {
    pub fn patch_tiles(&self) -> PatchTiles {
        PatchTiles { patch_of: self.patch_of.clone(), along: self.along.clone(), courses: self.courses.clone() }
    }

    pub fn rhombi(&self) -> usize {
        self.kinds.iter().filter(|&&kind| kind == Kind::Rhombus).count()
    }
}

impl Sheet {
    /// Places of the sheet's vertices when those on its outline are given: the harmonic map of its tiles. A slit has no
    /// places of its own: its vertices are counted once, and found like those inside.
    pub fn harmonic(&self, outline: &[DVec3]) -> Result<Vec<DVec3>, SurfaceError> {
        let ring = if self.slit == 0 { self.outline } else { self.outline - 2 * self.slit };
        // One unknown for each vertex of the result that is not on the ring.
        let mut unknown: BTreeMap<u32, usize> = BTreeMap::new();
        let is_given = |v: usize| v < ring || (self.slit > 0 && v == ring);
        for (v, vertex) in self.vertices.iter().enumerate() {
            if !is_given(v) {
                let next = unknown.len();
                unknown.entry(*vertex).or_insert(next);
            }
        }
        let place = |v: usize| if v == ring && self.slit > 0 { outline[0] } else { outline[v] };
        let mut places: Vec<DVec3> =
            (0..self.vertices.len()).map(|v| if is_given(v) { place(v) } else { DVec3::ZERO }).collect();
        if unknown.is_empty() {
            return Ok(places);
        }
        let mut triplets = Vec::new();
        let mut sides = vec![vec![0.0; unknown.len()]; 3];
        for tile in &self.tiles {
            let weight = if tile.len() == 3 { TRIANGLE_WEIGHT } else { SQUARE_WEIGHT };
            for k in 0..tile.len() {
                let ends = [tile[k] as usize, tile[(k + 1) % tile.len()] as usize];
                for [v, w] in [ends, [ends[1], ends[0]]] {
                    if is_given(v) {
                        continue;
                    }
                    let i = unknown[&self.vertices[v]];
                    triplets.push((i, i, weight));
                    if is_given(w) {
                        (0..3).for_each(|axis| sides[axis][i] += weight * places[w][axis]);
                    } else if unknown[&self.vertices[w]] < i {
                        triplets.push((i, unknown[&self.vertices[w]], -weight));
                    }
                }
            }
        }
        Factor::new(unknown.len(), &triplets)?.solve_many(&mut sides)?;
        for (v, place) in places.iter_mut().enumerate().filter(|(v, _)| !is_given(*v)) {
            let i = unknown[&self.vertices[v]];
            *place = DVec3::new(sides[0][i], sides[1][i], sides[2][i]);
        }
        Ok(places)
    }
}

/// Points at equal steps along a polyline, both ends included.
pub(super) fn at_equal_steps(points: &[DVec3], count: usize) -> Vec<DVec3> {
    let mut walked = vec![0.0];
    for w in points.windows(2) {
        walked.push(walked[walked.len() - 1] + w[0].distance(w[1]));
    }
    let whole = walked[walked.len() - 1];
    let mut segment = 0;
    (0..=count)
        .map(|k| {
            let at = whole * k as f64 / count as f64;
            while segment + 2 < walked.len() && walked[segment + 1] < at {
                segment += 1;
            }
            let step = walked[segment + 1] - walked[segment];
            let fraction = if step > 0.0 { ((at - walked[segment]) / step).clamp(0.0, 1.0) } else { 0.0 };
            points[segment].lerp(points[segment + 1], fraction)
        })
        .collect()
}
