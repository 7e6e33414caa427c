//! From a base triangulation to quads: sections 5 and 6 in one call.

use crate::base::Base;
use crate::build::edge_for_faces;
use crate::curvature;
use crate::density::{self, Counts, Size};
use crate::division;
use crate::error::LayoutError;
use crate::fill::{self, Filled, Place};
use crate::keep::{Carried, Kept};
use crate::mend::{self, Mended, mend, qualities};
use crate::optimise::{Shape, optimise};
use crate::pairing::{Given, Pairing, pair};
use crate::patch::{Patch, Plan};
use crate::rails::Rails;
use crate::reach;
use crate::surfaces::{Chart, Ground};
use crate::templates::{self, Catalogue, TemplateChoice};
use mesh::{Monitor, NONE, PolygonMesh, TriangleMesh};
use quadrangulate::PatchTopology;
use quadrangulate::improve::{ImproveOptions, QuadPatch, Setting, improve};
use std::collections::BTreeMap;
use std::time::Instant;
use surface::smooth::{Constraint, SmoothOptions};
use surface::smooth_star::Reference;

/// The least distance that edges may leave the surface by, in mean edge lengths. With 0.004 of the diagonal whatever the
/// edges, 500 quads of Spot had a mean angle deviation of 25 degrees; with this, 10; unbounded, 9.
pub const LEAST_CHORD_ERROR: f64 = 0.6;

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
    /// Rounds of the rectangles' pull. Default 40.
    pub rounds: usize,
    /// Whether a topological search takes out irregular vertices away from features. Default: no, it undoes the layout.
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
            rounds: 40,
            improve: false,
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
    let Ground { base, measures, charts, chart_of } = ground;
    if base.triangles.is_empty() {
        return Err(LayoutError::BadBase { element: "triangle", index: 0, reason: "there are none" });
    }
    let mut size = density::spread(base, &options.density)?;
    let [least, most] = [f64::min, f64::max].map(|pick| size.iter().copied().reduce(pick).unwrap_or(1.0));
    let irregularity = options.irregularity * (least / most).powi(2);
    let diagonal = base.surface.to_polygons().diagonal();
    let mean_edge = match options.size {
        Size::TargetFaces(faces) => edge_for_faces(&base.surface, faces),
        Size::EdgeLength(length) => length,
    };
    let error = (options.chord_error * diagonal).max(LEAST_CHORD_ERROR * mean_edge);
    let plain_edge = match options.size {
        Size::TargetFaces(faces) => (density::scaled_area(base, &size) / faces.max(1) as f64).sqrt(),
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
    let given = Given { forced: &forced, kept: &carried.patches, straight_corners };
    let mut patches = carried.patches.clone();
    patches.extend(pair(base, measures, options.pairing, given, monitor)?);
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
    let mut least = vec![1; base.edges.len()];
    let (mut counts, mut topologies, mut filled);
    let mut round = 0;
    loop {
        let plan = Plan {
            base,
            measures,
            patches: &patches,
            templates: &templates,
            size: &size,
            plain: &plain,
            least: &least,
        };
        let new = Plan { patches: &patches[first..], ..plan };
        let found = if first > 0 {
            let given = [carried.edge_length, irregularity];
            let wanted = target.map(|target| target - carried.faces() as f64);
            carried.completed(density::count_beside(new, &carried.counts, given, wanted, monitor)?)
        } else {
            Some(density::count(plan, options.size, irregularity, monitor)?)
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
    let chart_of_quad: Vec<u32> =
        filled.patch_of.iter().map(|&p| chart_of[patches[p as usize].triangles[0] as usize]).collect();
    let constraints: Vec<Constraint> = filled
        .places
        .iter()
        .zip(&filled.stays)
        .map(|(&place, &stays)| if stays { Constraint::Fixed } else { constraint(place, &rails) })
        .collect();
    let mut work = Work { base, charts, rails: &rails, chart_of_quad, constraints, filled };
    let smooth = SmoothOptions { sweeps: 6, ..SmoothOptions::default() };
    let mut are_new = vec![true; base.triangles.len()];
    carried.patches.iter().flat_map(|patch| &patch.triangles).for_each(|&t| are_new[t as usize] = false);
    let wanted = Wanted {
        size: &size,
        edge_length: counts.edge_length,
        rail_edge: &rails.means(base, &plain),
        error,
        chart_of,
        are_new: &are_new,
        rounds: options.rounds,
    };
    work.relax(&carried.movable(&work.filled), &wanted, &smooth, monitor)?;
    let kept = work.kept(names, &topologies, &patches, &counts);
    clock.stop("optimise");
    monitor.stage("improve", 0.8)?;
    if options.improve {
        work.improve(&smooth, monitor)?;
    }
    let sound = if options.irregularity.is_finite() { mend::SOUND } else { mend::INVERTED };
    let (mut mended, mut inverted) = work.mend(&smooth, sound, monitor)?;
    if inverted > 0 && work.release(&work.pinned()) > 0 {
        // No bend is worth an inverted quad.
        work.optimise(&work.lengths(&wanted), 0, &smooth, monitor)?;
        let more = work.mend(&smooth, sound, monitor)?;
        (mended, inverted) = (mended + more.0, more.1);
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
        irregular: irregular(&mesh),
        counts: counts.of_edge,
        edge_length: counts.edge_length,
        faces: mesh.face_count(),
        target: if let Size::TargetFaces(faces) = options.size { Some(faces) } else { None },
        mended,
        inverted,
        seconds: clock.seconds,
    };
    Ok((Quads { mesh, feature_edges, base_vertex, source, report }, kept))
}

/// Times that counts are raised where edges of two patches would be one.
const NARROW_ROUNDS: u32 = 4;
/// Times that points which stick out are looked for.
const REACHING_ROUNDS: usize = 2;
/// They are left again where that takes quads of less than this quality.
const WORST_REACHED: f64 = 0.15;
/// Vertices further from such a point than this, in edge lengths, are left alone.
const MOST_REACH: f64 = 2.5;

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

fn constraint(place: Place, rails: &Rails) -> Constraint {
    match place {
        Place::Corner(v) if rails.corner[v as usize] => Constraint::Fixed,
        Place::Corner(v) => rails.of_vertex[v as usize].map_or(Constraint::Free, Constraint::OnChain),
        Place::Edge(e) => rails.of_edge[e as usize].map_or(Constraint::Free, Constraint::OnChain),
        Place::Patch(_) => Constraint::Free,
    }
}

fn surfaces(charts: &[Chart]) -> Vec<&dyn Reference> {
    charts.iter().map(|chart| chart as &dyn Reference).collect()
}

/// Inner vertices of other valence than 4.
pub(crate) fn irregular(mesh: &PolygonMesh) -> usize {
    let topology = mesh::Topology::of(mesh);
    let off = |v: &u32| !topology.is_border_vertex(*v) && topology.around(*v).count() != 4;
    (0..mesh.vertex_count() as u32).filter(off).count()
}

/// The quads in the making.
struct Work<'a> {
    base: &'a Base,
    charts: &'a [Chart],
    rails: &'a Rails,
    chart_of_quad: Vec<u32>,
    constraints: Vec<Constraint>,
    filled: Filled,
}

/// What vertices are moved for.
struct Wanted<'a> {
    /// Relative edge length at each vertex of the surface, and what it is relative to.
    size: &'a [f64],
    edge_length: f64,
    /// Edge length wanted along each rail, scene units.
    rail_edge: &'a [f64],
    /// How far edges may leave the surface.
    error: f64,
    /// Chart of each base triangle, and whether its quads are new.
    chart_of: &'a [u32],
    are_new: &'a [bool],
    /// Rounds of the rectangles' pull.
    rounds: usize,
}

impl<'a> Work<'a> {
    /// Section 6 for the vertices that may move: they are pulled into shape, and to what sticks out of the quads.
    fn relax(
        &mut self,
        movable: &[bool],
        wanted: &Wanted<'_>,
        smooth: &SmoothOptions,
        monitor: &Monitor,
    ) -> Result<(), LayoutError> {
        let (mut part, names) = self.part(movable);
        let lengths = part.lengths(wanted);
        // The maps reach every tip, the pull slips off: so before it too.
        let mut reached = part.reach(wanted, monitor)?;
        part.optimise(&lengths, wanted.rounds, smooth, monitor)?;
        if wanted.rounds > 0 {
            self.take_back(&part, &names, movable);
            let held = self.settle(wanted.rail_edge, movable);
            part = self.part(movable).0;
            part.optimise(&lengths, wanted.rounds, smooth, monitor)?;
            let held: Vec<usize> = held.into_iter().filter_map(|v| names.binary_search(&(v as u32)).ok()).collect();
            if part.release(&held) > 0 {
                part.optimise(&lengths, 0, smooth, monitor)?;
            }
        }
        for _ in 0..REACHING_ROUNDS {
            if part.release(&reached) > 0 {
                part.optimise(&lengths, 0, smooth, monitor)?;
            }
            reached = part.reach(wanted, monitor)?;
            if reached.is_empty() {
                break;
            }
            part.optimise(&lengths, wanted.rounds / 3, smooth, monitor)?;
        }
        if part.release(&reached) > 0 {
            part.optimise(&lengths, 0, smooth, monitor)?;
        }
        self.take_back(&part, &names, movable);
        Ok(())
    }

    /// Vertices of a part, where they are now. Those that may not move are where they were, but held: they keep their constraint.
    fn take_back(&mut self, part: &Self, names: &[u32], movable: &[bool]) {
        for (own, &whole) in names.iter().enumerate().filter(|(_, v)| movable[**v as usize]) {
            self.filled.positions[whole as usize] = part.filled.positions[own];
            self.constraints[whole as usize] = part.constraints[own];
        }
    }

    /// The quads around vertices that may move, by themselves, and the names of their vertices.
    fn part(&self, movable: &[bool]) -> (Work<'a>, Vec<u32>) {
        let all = &self.filled;
        let concerned = |q: &usize| all.quads[*q].iter().any(|&v| movable[v as usize]);
        let quads: Vec<usize> = (0..all.quads.len()).filter(concerned).collect();
        let mut names: Vec<u32> = quads.iter().flat_map(|&q| all.quads[q]).collect();
        names.sort_unstable();
        names.dedup();
        let own = |v: u32| names.binary_search(&v).map_or(NONE, |own| own as u32);
        let constraint = |&v: &u32| if movable[v as usize] { self.constraints[v as usize] } else { Constraint::Fixed };
        let part = Work {
            chart_of_quad: quads.iter().map(|&q| self.chart_of_quad[q]).collect(),
            constraints: names.iter().map(constraint).collect(),
            filled: Filled {
                positions: names.iter().map(|&v| all.positions[v as usize]).collect(),
                quads: quads.iter().map(|&q| all.quads[q].map(own)).collect(),
                patch_of: quads.iter().map(|&q| all.patch_of[q]).collect(),
                places: names.iter().map(|&v| all.places[v as usize]).collect(),
                ..Filled::default()
            },
            ..*self
        };
        (part, names)
    }

    /// What the next edit of the base can keep.
    fn kept(&self, names: &[u64], topologies: &[PatchTopology], patches: &[Patch], counts: &Counts) -> Kept {
        let mut filled = self.filled.clone();
        for (v, &place) in filled.places.iter().enumerate() {
            // Vertices at points that stuck out.
            let held = self.constraints[v] == Constraint::Fixed && constraint(place, self.rails) != Constraint::Fixed;
            filled.stays[v] |= held;
        }
        Kept {
            names: names.to_vec(),
            triangles: self.base.triangles.clone(),
            triangle_edges: self.base.triangle_edges.clone(),
            patches: patches.to_vec(),
            topologies: topologies.to_vec(),
            counts: counts.of_edge.clone(),
            edge_length: counts.edge_length,
            filled,
        }
    }

    fn optimise(
        &mut self,
        lengths: &[f64],
        rounds: usize,
        smooth: &SmoothOptions,
        monitor: &Monitor,
    ) -> Result<(), LayoutError> {
        let shape = Shape {
            quads: &self.filled.quads,
            chart_of: &self.chart_of_quad,
            constraints: &self.constraints,
            lines: &self.rails.lines,
            charts: self.charts,
            lengths,
        };
        optimise(&shape, &mut self.filled.positions, rounds, smooth, monitor)?;
        Ok(())
    }

    /// Moves the vertices of bent rails that may move to where the edges between them follow the rails again, and fixes them there: the
    /// pull spread them with no eye for bends. Returns those that were free to slide.
    fn settle(&mut self, edge_lengths: &[f64], movable: &[bool]) -> Vec<usize> {
        let mut held = Vec::new();
        for ((steps, points), &edge_length) in self.rails.steps.iter().zip(&self.rails.points).zip(edge_lengths) {
            let mut along: Vec<u32> = Vec::new();
            for step in steps {
                let mut own = self.filled.along[step.edge as usize].clone();
                if !step.forward {
                    own.reverse();
                }
                along.extend(&own[usize::from(!along.is_empty())..]);
            }
            let places: Vec<mesh::DVec3> = along.iter().map(|&v| self.filled.positions[v as usize]).collect();
            let stays = |&v: &u32| !movable[v as usize] || self.constraints[v as usize] == Constraint::Fixed;
            let stays: Vec<bool> = along.iter().map(stays).collect();
            if stays.iter().all(|stays| *stays) {
                continue;
            }
            let Some((places, bent)) = division::settled(points, &places, &stays, edge_length) else { continue };
            for ((&v, place), bent) in along.iter().zip(places).zip(bent) {
                let v = v as usize;
                self.filled.positions[v] = place;
                if bent && self.constraints[v] != Constraint::Fixed {
                    self.constraints[v] = Constraint::Fixed;
                    held.push(v);
                }
            }
        }
        held
    }

    /// Moves free vertices to the points of the surface that stick out of the quads, and fixes them there: see
    /// [`reach::missed`]. Returns them.
    fn reach(&mut self, wanted: &Wanted<'_>, monitor: &Monitor) -> Result<Vec<usize>, LayoutError> {
        let &Wanted { chart_of, are_new, error, edge_length: spacing, .. } = wanted;
        let (positions, quads) = (&self.filled.positions, &self.filled.quads);
        let on_rail = |e: usize| self.rails.of_edge[e].is_some();
        let missed = reach::missed(self.base, are_new, &on_rail, positions, quads, error, spacing, monitor)?;
        let mut chart = vec![NONE; positions.len()];
        for (quad, &c) in quads.iter().zip(&self.chart_of_quad) {
            for &v in quad {
                chart[v as usize] = c;
            }
        }
        let mut moved = Vec::new();
        for (point, triangle) in missed {
            let own = chart_of[self.base.owner[triangle as usize] as usize];
            let free = (0..chart.len()).filter(|&v| chart[v] == own && self.constraints[v] == Constraint::Free);
            let far = |v: usize| self.filled.positions[v].distance(point);
            let nearest = free.min_by(|&a, &b| far(a).total_cmp(&far(b)));
            if let Some(nearest) = nearest.filter(|&v| far(v) < MOST_REACH * spacing) {
                self.filled.positions[nearest] = point;
                self.constraints[nearest] = Constraint::Fixed;
                moved.push(nearest);
            }
        }
        Ok(moved)
    }

    /// Vertices that are held although their place on the base lets them slide or move.
    fn pinned(&self) -> Vec<usize> {
        let moves = |v: usize| constraint(self.filled.places[v], self.rails) != Constraint::Fixed;
        (0..self.constraints.len()).filter(|&v| self.constraints[v] == Constraint::Fixed && moves(v)).collect()
    }

    /// Lets go of vertices around which quads are bad. Returns how many.
    fn release(&mut self, fixed: &[usize]) -> usize {
        let surfaces = surfaces(self.charts);
        let mut bad = vec![false; self.filled.positions.len()];
        for (quad, &c) in self.filled.quads.iter().zip(&self.chart_of_quad) {
            if mend::quality(quad.map(|v| self.filled.positions[v as usize]), surfaces[c as usize]) < WORST_REACHED {
                for &v in quad {
                    bad[v as usize] = true;
                }
            }
        }
        let released = fixed.iter().filter(|&&v| bad[v]);
        released.map(|&v| self.constraints[v] = constraint(self.filled.places[v], self.rails)).count()
    }

    /// The topological search, with features and borders kept.
    fn improve(&mut self, smooth: &SmoothOptions, monitor: &Monitor) -> Result<(), LayoutError> {
        let (features, surfaces) = (self.features(), surfaces(self.charts));
        let start = self.take();
        let outside = vec![0; start.positions.len()];
        let setting =
            Setting { features: &features, outside: &outside, chains: &self.rails.lines, surfaces: &surfaces };
        let options = ImproveOptions { depth: 3, smooth: *smooth, ..ImproveOptions::default() };
        let better = improve(start, &setting, &options, monitor)?;
        self.put(better.patch, &better.source, outside.len());
        Ok(())
    }

    /// The last resort: see [`mend`]. Returns the places mended and the quads still inverted.
    fn mend(&mut self, smooth: &SmoothOptions, sound: f64, monitor: &Monitor) -> Result<(usize, usize), LayoutError> {
        let (features, surfaces) = (self.features(), surfaces(self.charts));
        let start = self.take();
        let before = start.positions.len();
        let setting = Setting { features: &features, outside: &[], chains: &self.rails.lines, surfaces: &surfaces };
        let Mended { patch, source, places } = mend(start, &setting, smooth, sound, monitor)?;
        let inverted = qualities(&patch, &surfaces).iter().filter(|quality| **quality <= 0.0).count();
        self.put(patch, &source, before);
        Ok((places, inverted))
    }

    /// Edges on rails.
    fn features(&self) -> Vec<[u32; 2]> {
        (0..self.filled.along.len())
            .filter(|&e| self.rails.of_edge[e].is_some())
            .flat_map(|e| self.filled.along[e].windows(2).map(|w| [w[0], w[1]]))
            .collect()
    }

    /// The quads, moved out.
    fn take(&mut self) -> QuadPatch {
        QuadPatch {
            quads: std::mem::take(&mut self.filled.quads),
            surface_of: std::mem::take(&mut self.chart_of_quad),
            positions: std::mem::take(&mut self.filled.positions),
            constraints: std::mem::take(&mut self.constraints),
        }
    }

    /// Changed quads, back in; `source` has the vertices' old indices, of `before`.
    fn put(&mut self, patch: QuadPatch, source: &[u32], before: usize) {
        let mut new_index = vec![NONE; before];
        for (new, &old) in source.iter().enumerate().filter(|(_, old)| **old != NONE) {
            new_index[old as usize] = new as u32;
        }
        let places = &self.filled.places;
        self.filled.places =
            source.iter().map(|&old| places.get(old as usize).copied().unwrap_or(Place::Patch(0))).collect();
        for (e, along) in self.filled.along.iter_mut().enumerate() {
            // Only rails are sure to be edges still.
            if self.rails.of_edge[e].is_none() {
                along.clear();
            }
            for v in along {
                *v = new_index[*v as usize];
            }
        }
        self.filled.quads = patch.quads;
        self.filled.positions = patch.positions;
        self.constraints = patch.constraints;
        self.chart_of_quad = patch.surface_of;
    }

    /// The wanted edge length at each vertex, from the relative ones at the vertices of the surface.
    fn lengths(&self, wanted: &Wanted<'_>) -> Vec<f64> {
        let corners = &self.base.surface.triangles;
        let at = |found: SourcePoint| {
            let weights = corners[found.surface_triangle as usize].iter().zip(found.barycentric);
            weights.map(|(&v, weight)| wanted.size[v as usize] * weight).sum::<f64>() * wanted.edge_length
        };
        self.sources().into_iter().map(at).collect()
    }

    /// Where each vertex lies on the surface, on the chart of a quad around it.
    fn sources(&self) -> Vec<SourcePoint> {
        let mut chart = vec![0; self.filled.positions.len()];
        for (quad, &c) in self.filled.quads.iter().zip(&self.chart_of_quad) {
            for &v in quad {
                chart[v as usize] = c;
            }
        }
        let find = |(&p, &c): (&mesh::DVec3, &u32)| {
            let found = self.charts[c as usize].find(p);
            let triangle = self.base.source.get(found.triangle as usize).copied().unwrap_or(NONE);
            SourcePoint { triangle, surface_triangle: found.triangle, barycentric: found.barycentric }
        };
        self.filled.positions.iter().zip(&chart).map(find).collect()
    }
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
