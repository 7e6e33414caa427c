//! From a base triangulation to quads: sections 5 and 6 in one call.

use crate::base::Base;
use crate::build::edge_for_faces;
use crate::coarse;
use crate::curvature;
use crate::density::{self, Contrast, Size};
use crate::error::LayoutError;
use crate::fill::{self, Filled, Place};
use crate::keep::{Carried, Kept};
use crate::mend;
use crate::pairing::{Given, Pairing, pair};
use crate::patch::Plan;
use crate::pipeline::NEAR_TARGET;
use crate::rails::Rails;
use crate::sizing::scaled_area;
use crate::surfaces::Ground;
use crate::templates::{self, Catalogue, TemplateChoice};
use crate::traced::{Remade, Remaking};
use crate::work::{TIMES, TIMES_AFTER_EDIT, Wanted, Work};
use mesh::{DVec3, Monitor, NONE, PolygonMesh, Topology, TriangleMesh};
use std::collections::BTreeMap;
use std::time::Instant;
use surface::smooth::SmoothOptions;

/// The least distance that edges may leave the surface by, in mean edge lengths. With 0.004 of the diagonal whatever the
/// edges, 500 quads of Spot had a mean angle deviation of 25 degrees; with this, 10; unbounded, 9.
pub const LEAST_CHORD_ERROR: f64 = 0.6;

/// Share of that distance that finished quads keep, before they are mended. With all of it tips were off by a third more.
const FINISHED_ERROR: f64 = 0.8;

/// How quads are made.
#[derive(Debug, Clone)]
pub struct LayoutOptions {
    /// How many quads, or how large. Default: 4000 quads.
    pub size: Size,
    /// Relative edge length at each input vertex, positive; empty for 1 everywhere. Default: empty.
    pub density: Vec<f64>,
    /// How far edges may leave the surface for its curvature, fraction of the bounding-box diagonal: they are made shorter where it
    /// is bent, and longer elsewhere. What still sticks out further, a tip for
    /// instance, gets a vertex of its own. Never less than [`LEAST_CHORD_ERROR`] of the mean edge: few quads cannot follow
    /// everything, and shape comes first. Above 0; infinite for even sizes. Default 0.004.
    pub chord_error: f64,
    /// How base triangles are merged. Default: [`Pairing::Programme`].
    pub pairing: Pairing,
    /// What a patch of unequal opposite sides costs, in quads stretched by a factor e: low for even sizes, infinite for the
    /// coarsest layout. It falls with the square of the contrast of `density`, which takes irregular vertices to follow: painted
    /// 4 : 1, a torus got 2.9 : 1 without and 3.3 : 1 with that. Above 0. Default 20.
    pub irregularity: f64,
    /// Templates to choose from. Default: the built-in ones.
    pub catalogue: Catalogue,
    /// Templates chosen, by the base edge between the two triangles of a pair; such pairs are always patches. Default: none.
    pub templates: BTreeMap<u32, TemplateChoice>,
    /// Base vertices that keep their place although no feature ends or bends there. Default: none.
    pub fixed: Vec<u32>,
    /// Whether the coarsest layout may join lone triangles by lines, see docs/papers.md: far fewer patches, where the features stand it.
    /// [`crate::retopologize`] tries both ways and keeps the better one. Default: yes.
    pub lines: bool,
    /// Rounds of the rectangles' pull. Default 40.
    pub rounds: usize,
    /// Whether irregular vertices away from features are taken out, see [`quadrangulate::improve::refill`]. Not from the
    /// coarsest layout, which it would undo, nor from templates that were chosen. After an edit it moves all vertices; without it, those away
    /// from the edit stay bit for bit. Default: yes.
    pub improve: bool,
}

impl Default for LayoutOptions {
    fn default() -> Self {
        Self {
            size: Size::TargetFaces(4000),
            density: Vec::new(),
            chord_error: 0.004,
            pairing: Pairing::default(),
            irregularity: 20.0,
            catalogue: Catalogue::default(),
            templates: BTreeMap::new(),
            fixed: Vec::new(),
            lines: true,
            rounds: 40,
            improve: true,
        }
    }
}

/// A point of the input surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourcePoint {
    /// Triangle of the input.
    pub triangle: u32,
    /// Triangle of [`Base::surface`], which is a part of it.
    pub surface_triangle: u32,
    /// Barycentric coordinates in the surface triangle: none negative, sum 1.
    pub barycentric: [f64; 3],
}

/// An edge of the quads that lies on a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct FeatureEdge {
    /// Vertices of the quads, in the direction of the base edge.
    pub ends: [u32; 2],
    /// The feature chain; `None` on a border that the base gives no chain.
    pub chain: Option<u32>,
    /// The base edge.
    pub base_edge: u32,
}

/// What was done.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayoutReport {
    /// Patches of the layout.
    pub patches: usize,
    /// Those that are as they were before an edit of the base.
    pub patches_kept: usize,
    /// Those of one base triangle.
    pub singles: usize,
    /// Inner vertices of other valence than 4.
    pub irregular: usize,
    /// Quads along each base edge; 0 for edges inside patches.
    pub counts: Vec<u32>,
    /// The edge length aimed at, scene units.
    pub edge_length: f64,
    /// Quads.
    pub faces: usize,
    /// Quads that were asked for, when a number was.
    pub target: Option<usize>,
    /// Whether the quads were laid anew over a traced layout, see docs/papers.md.
    pub traced: bool,
    /// Places where quads were replaced because no place of their vertices made them sound.
    pub mended: usize,
    /// Quads still inverted; 0 unless the surface leaves no room.
    pub inverted: usize,
    /// Seconds for each stage.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Quads on a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Quads {
    /// The mesh, all of quads.
    pub mesh: PolygonMesh,
    /// Its edges on features and borders, by base edge.
    pub feature_edges: Vec<FeatureEdge>,
    /// The base vertex at each vertex that stands for one, else [`NONE`].
    pub base_vertex: Vec<u32>,
    /// Where each vertex lies on the input.
    pub source: Vec<SourcePoint>,
    /// What was done.
    pub report: LayoutReport,
}

/// Lays quads over the surface of a base triangulation.
///
/// Every feature edge of the base becomes a row of edges whose vertices lie on it; base vertices where features end,
/// meet or bend keep their exact position. The result has the surface's topology. Same input, same bytes, whatever the threads.
///
/// Source: Daniels et al. 2011, sections 5 and 6; see [`crate::pairing`], [`crate::density`] and [`crate::optimise`]
/// for what differs. Cost: nearly linear in surface triangles and quads.
///
/// # Errors
/// [`LayoutError`].
pub fn quads_from_base(base: &Base, options: &LayoutOptions, monitor: &Monitor) -> Result<Quads, LayoutError> {
    Ok(quads_after(&Ground::new(base)?, &[], options, None, monitor)?.0)
}

/// Quads over a base that is another one edited: what the edit left of its quads stays. `names` are the base's, see
/// [`crate::session::Session::names`]. Returns what the next edit can keep, too.
///
/// Everything is laid anew where templates are chosen, where nothing is left, and where the number of quads has come away from
/// what was asked for.
pub(crate) fn quads_after(
    ground: &Ground<'_>,
    names: &[u64],
    options: &LayoutOptions,
    last: Option<&Kept>,
    monitor: &Monitor,
) -> Result<(Quads, Kept), LayoutError> {
    let mut clock = Clock { start: Instant::now(), seconds: Vec::new() };
    if options.irregularity.is_nan() || options.irregularity <= 0.0 {
        return Err(LayoutError::BadOption { option: "irregularity", expected: "above 0" });
    }
    if options.chord_error.is_nan() || options.chord_error <= 0.0 {
        return Err(LayoutError::BadOption { option: "chord error", expected: "above 0" });
    }
    monitor.stage("layout", 0.0)?;
    let Ground { base, measures, chart_of, .. } = ground;
    if base.triangles.is_empty() {
        return Err(LayoutError::BadBase { element: "triangle", index: 0, reason: "there are none" });
    }
    if options.density.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(LayoutError::BadOption { option: "density", expected: "positive and finite at every vertex" });
    }
    if options.density.len() > base.surface.positions.len() {
        return Err(LayoutError::BadOption { option: "density", expected: "one value for each input vertex" });
    }
    let painted = density::spread(&base.surface, &options.density);
    let mut size = painted.clone();
    let [least, most] = [f64::min, f64::max].map(|pick| size.iter().copied().reduce(pick).unwrap_or(1.0));
    let irregularity = options.irregularity * (least / most).powi(2);
    let diagonal = base.surface.to_polygons().diagonal();
    let mean_edge = match options.size {
        Size::TargetFaces(faces) => edge_for_faces(&base.surface, faces),
        Size::EdgeLength(length) => length,
    };
    let error = (options.chord_error * diagonal).max(LEAST_CHORD_ERROR * mean_edge);
    let plain_edge = match options.size {
        Size::TargetFaces(faces) => (scaled_area(&base.surface, |v| size[v as usize]) / faces.max(1) as f64).sqrt(),
        Size::EdgeLength(length) => length,
    };
    let plain: Vec<f64> = size.iter().map(|size| size * plain_edge).collect();
    if options.chord_error.is_finite() {
        curvature::bound(base, measures, options.chord_error * diagonal, &plain, options.size, &mut size);
    }
    let templates = templates::chosen(base, measures, &options.catalogue, &options.templates)?;
    let forced: Vec<[u32; 2]> = templates.iter().map(|template| template.pair).collect();
    let straight_corners = options.irregularity.is_finite();
    let last = last.filter(|_| templates.is_empty() && straight_corners);
    let carried = last.map_or_else(Carried::default, |last| last.carry(base, names));
    let given = Given { forced: &forced, kept: &carried.patches, straight_corners, off_four: 1.0 };
    let mut patches = carried.patches.clone();
    if straight_corners || !templates.is_empty() {
        patches.extend(pair(base, measures, options.pairing, given, monitor)?);
    } else {
        patches = coarse::pair(base, measures, options, [&size, &plain], monitor)?;
    }
    for patch in &mut patches {
        if let Some(index) = forced.iter().position(|pair| patch.triangles == *pair) {
            *patch = templates[index].orient(base, std::mem::take(patch), index);
        }
    }
    clock.stop("pairing");

    monitor.stage("density", 0.2)?;
    if options.fixed.iter().any(|&v| v as usize >= base.vertices.len()) {
        return Err(LayoutError::BadOption { option: "fixed", expected: "vertices of the base" });
    }
    let first = carried.patches.len();
    let target = if let Size::TargetFaces(faces) = options.size { Some(faces as f64) } else { None };
    let rails = Rails::new(base, measures, &options.fixed);
    let one_each = vec![1; base.edges.len()];
    let plan =
        Plan { base, measures, patches: &patches, templates: &templates, size: &size, plain: &plain, least: &one_each };
    let mut least = one_each.clone();
    // Sizes are wanted as they were before, where quads stay.
    let contrast =
        if first > 0 { carried.contrast } else { Contrast::new(plan, &painted, options.size, irregularity, monitor)? };
    // What lies inside patches follows the sizes as painted.
    let counted = contrast.sizes(&size, &painted);
    let (mut counts, mut topologies, mut filled);
    let mut round = 0;
    loop {
        let plan = Plan { least: &least, ..plan };
        let new = Plan { patches: &patches[first..], ..plan };
        let found = if first > 0 {
            let given = [carried.edge_length, irregularity];
            let wanted = target.map(|target| target - carried.faces() as f64);
            carried.completed(density::count_beside(
                Plan { size: &counted, ..new },
                &carried.counts,
                given,
                wanted,
                monitor,
            )?)
        } else {
            Some(density::count(
                Plan { size: &counted, ..plan },
                options.size,
                irregularity,
                contrast.shortest,
                monitor,
            )?)
        };
        clock.stop("density");
        monitor.stage("fill", 0.4)?;
        let Some(found) = found else { return quads_after(ground, names, options, None, monitor) };
        counts = found;
        topologies = carried.topologies.clone();
        topologies.extend(fill::topologies(new, &counts.of_edge, monitor)?);
        filled = fill::fill(plan, &counts, &topologies, &carried, &rails, monitor)?;
        clock.stop("fill");
        let doubled = fill::doubled(&filled);
        let miss = target.map_or(0.0, |target| (filled.quads.len() as f64 / target - 1.0).abs());
        if first > 0 && (miss > density::MOST_MISS || !doubled.is_empty()) {
            return quads_after(ground, names, options, None, monitor);
        }
        if doubled.is_empty() {
            break;
        }
        if round == NARROW_ROUNDS {
            return Err(LayoutError::Narrow { patches: doubled.len() });
        }
        round += 1;
        // One row more across each keeps their edges apart.
        for &corner in doubled.iter().flat_map(|&p| &patches[p as usize].border) {
            let e = base.triangle_edges[corner as usize / 3][corner as usize % 3] as usize;
            if counts.of_edge[e] <= round {
                least[e] = round + 1;
            }
        }
    }

    monitor.stage("optimise", 0.6)?;
    let mut work = Work::new(ground, &rails, &patches, filled);
    // The pull decides on aspects: drawn halfway to squares, angles were off by 1 to 2.4 degrees more.
    let smooth = SmoothOptions { sweeps: 6, keep_aspect: 1.0, ..SmoothOptions::default() };
    let mut are_new = vec![true; base.triangles.len()];
    carried.patches.iter().flat_map(|patch| &patch.triangles).for_each(|&t| are_new[t as usize] = false);
    let refills = options.improve && options.irregularity.is_finite();
    let wanted = Wanted {
        size: &size,
        edge_length: counts.edge_length,
        rail_edge: &rails.means(base, &plain),
        error,
        chart_of,
        are_new: &are_new,
        // What lies around is in place already.
        rounds: if first > 0 { options.rounds / 2 } else { options.rounds },
    };
    let movable = carried.movable(&work.filled);
    let times = if first > 0 { TIMES_AFTER_EDIT } else { TIMES };
    work.relax(&movable, &wanted, &smooth, if refills { 0 } else { times }, monitor)?;
    let kept = work.kept(names, &topologies, &patches, &counts, contrast);
    clock.stop("optimise");
    monitor.stage("improve", 0.8)?;
    let as_laid = refills.then(|| work.clone());
    if refills {
        let stays: Vec<bool> = work.filled.patch_of.iter().map(|&p| patches[p as usize].template.is_some()).collect();
        work.refill(&stays, monitor)?;
        clock.stop("refill");
    }
    // As if all were new, so that what is kept makes no difference.
    let are_new = vec![true; base.triangles.len()];
    let all = Wanted { are_new: &are_new, rounds: options.rounds, error: FINISHED_ERROR * error, ..wanted };
    let sound = if options.irregularity.is_finite() { mend::SOUND } else { mend::INVERTED };
    // Painted sizes and chosen templates are the base's.
    let traced = if refills && templates.is_empty() && options.density.is_empty() {
        let covering = target.map_or(1.0, |target| (work.wanted_quads(&all) / target).sqrt());
        let narrower = if covering < NARROW { covering } else { 1.0 };
        let wanted = Wanted { edge_length: narrower * all.edge_length, ..all };
        let remaking = Remaking {
            work: &work,
            wanted: &wanted,
            plain: &plain,
            shortest: contrast.shortest,
            bend_edge: narrower.sqrt().recip(),
            smooth: &smooth,
            sound,
            target,
        };
        remaking.remade(monitor)?
    } else {
        None
    };
    clock.stop("trace");
    // Those that were there are finished only where they may be better.
    let is_sound = |remade: &Remade<'_>, inverted: usize| remade.done.1 <= inverted && remade.lost == 0;
    let (is_traced, mut mended, mut inverted);
    (work, (mended, inverted), is_traced) = match traced {
        Some(traced) if is_sound(&traced, 0) && traced.work.is_better(&work, false, target) => {
            (traced.work, traced.done, true)
        }
        traced => {
            if refills {
                work.relax(&vec![true; work.filled.positions.len()], &all, &smooth, TIMES, monitor)?;
            }
            let done = work.mend_all(&smooth, sound, refills, monitor)?;
            match traced {
                Some(traced) if is_sound(&traced, done.1) && traced.work.is_better(&work, true, target) => {
                    (traced.work, traced.done, true)
                }
                _ => (work, done, false),
            }
        }
    };
    if let Some(as_laid) = as_laid
        && target.is_some_and(|target| (work.filled.quads.len() as f64) < (1.0 - NEAR_TARGET) * target)
    {
        // There is little room, and mending took quads out as well: as they were laid they are more.
        work = as_laid;
        work.relax(&movable, &wanted, &smooth, times, monitor)?;
        (mended, inverted) = work.mend_all(&smooth, sound, false, monitor)?;
    }
    clock.stop("improve");
    monitor.stage("source", 0.95)?;
    let source = work.sources();
    clock.stop("source");

    let Filled { positions, places, quads, along, .. } = work.filled;
    let base_vertex = places.iter().map(|p| if let Place::Corner(v) = p { *v } else { NONE }).collect();
    let mesh = PolygonMesh::from_polygons(positions, &quads).map_err(|_| LayoutError::BadBase {
        element: "triangle",
        index: 0,
        reason: "it asks for more quads than 32-bit indices can name",
    })?;
    if is_traced {
        counts.of_edge = along.iter().map(|along| along.len().saturating_sub(1) as u32).collect();
    }
    let mut feature_edges = Vec::new();
    for (e, along) in along.iter().enumerate().filter(|(e, _)| measures.rails[*e]) {
        feature_edges.extend(along.windows(2).map(|w| FeatureEdge {
            ends: [w[0], w[1]],
            chain: base.edges[e].feature,
            base_edge: e as u32,
        }));
    }
    let report = LayoutReport {
        patches: patches.len(),
        patches_kept: first,
        singles: patches.iter().filter(|p| p.triangles.len() == 1).count(),
        irregular: irregular(&Topology::of(&mesh)),
        counts: counts.of_edge,
        edge_length: counts.edge_length,
        faces: mesh.face_count(),
        target: if let Size::TargetFaces(faces) = options.size { Some(faces) } else { None },
        traced: is_traced,
        mended,
        inverted,
        seconds: clock.seconds,
    };
    Ok((Quads { mesh, feature_edges, base_vertex, source, report }, kept))
}

/// Where bends take so many edges that the others became longer than squares of the wanted number by more than the inverse of this, a traced
/// layout has edges of that number again, and bends get fewer: walls between round teeth had one quad from rim to rim. With 0.8 a gear of
/// 2,000 quads was worse for it.
const NARROW: f64 = 0.6;
/// Times that counts are raised where edges of two patches would be one.
const NARROW_ROUNDS: u32 = 4;
struct Clock {
    start: Instant,
    seconds: Vec<(&'static str, f64)>,
}

impl Clock {
    fn stop(&mut self, stage: &'static str) {
        self.seconds.push((stage, self.start.elapsed().as_secs_f64()));
        self.start = Instant::now();
    }
}

/// Mean deviation of the angles of a quad from right ones, degrees.
pub(crate) fn angle_deviation(p: [DVec3; 4]) -> f64 {
    let angle = |k: usize| (p[(k + 1) % 4] - p[k]).angle_between(p[(k + 3) % 4] - p[k]).to_degrees();
    (0..4).map(|k| (angle(k) - 90.0).abs()).sum::<f64>() / 4.0
}

/// Inner vertices of other valence than 4.
pub(crate) fn irregular(topology: &Topology) -> usize {
    let off = |v: &u32| !topology.is_border_vertex(*v) && topology.around(*v).count() != 4;
    (0..topology.outgoing.len() as u32).filter(off).count()
}

impl SourcePoint {
    /// Barycentric coordinates in the input's triangle, for the transfer of what the input has at its corners. O(1).
    pub fn on_input(&self, base: &Base, input: &TriangleMesh) -> [f64; 3] {
        let p = base.surface.points(self.surface_triangle as usize);
        let point = p[0] * self.barycentric[0] + p[1] * self.barycentric[1] + p[2] * self.barycentric[2];
        let [a, b, c] = input.points(self.triangle as usize);
        let normal = (b - a).cross(c - a);
        let squared = normal.length_squared();
        if squared <= 0.0 {
            return [1.0, 0.0, 0.0];
        }
        let part = |from: mesh::DVec3, to: mesh::DVec3| (from - point).cross(to - point).dot(normal).max(0.0) / squared;
        let weights = [part(b, c), part(c, a), part(a, b)];
        let sum = weights.iter().sum::<f64>();
        weights.map(|w| w / sum)
    }
}

#[cfg(test)]
#[path = "quads_tests.rs"]
mod tests;
