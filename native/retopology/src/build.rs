//! From a surface and its features to the base triangulation: Daniels et al. 2011, section 4, stage by stage.
//!
//! check -> network -> wanted lengths, refined surface -> breakpoints and sites -> fields -> cells, and base vertices added
//! until their dual is a triangulation of the surface -> a star of paths in each cell -> geodesics by flips -> cut.

use crate::assemble::assemble;
use crate::base::Base;
use crate::base_error::RetopologyError;
pub use crate::base_options::BaseOptions;
use crate::breakpoints::{Breakpoints, divide_curves};
use crate::cells::{Cells, Piece, labels};
use crate::dual::Dual;
use crate::features::{Features, Network, network};
use crate::fields::{Addition, Fields, Hat};
use crate::groups::Groups;
use crate::metric::Metric;
use crate::sites::free_sites;
use crate::sizing::{Lengths, even_length, refine, wanted_lengths};
use crate::split_mesh::SplitMesh;
use crate::stars::Drawing;
use crate::{bulges, cut, detect, input, stars, tidy};
use mesh::{Monitor, NONE, Topology, TriangleMesh};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;
use surface::flip_geodesic;
use surface::intrinsic::Intrinsic;
use surface::laplacian::cotangent_weights;

/// Rounds of flipping base edges by their lengths and drawing them anew.
const FLIP_ROUNDS: usize = 4;

/// Rounds of putting base vertices on what bulges out of base triangles.
const BULGE_ROUNDS: usize = 2;
/// Base vertices added in one round keep this far apart, in wanted edge lengths.
const SPACING: f64 = 0.3;

/// Edge length of squares that cover a surface with this many faces, scene units. O(n).
pub fn edge_for_faces(mesh: &TriangleMesh, faces: usize) -> f64 {
    let area: f64 = (0..mesh.triangles.len()).map(|t| 0.5 * mesh.area_normal(t).length()).sum();
    (area / faces.max(1) as f64).sqrt()
}

/// What was done, for the artist and for measurements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BaseReport {
    /// Curves of the feature network, borders included.
    pub curves: usize,
    /// Corners of the network and marked vertices.
    pub corners: usize,
    /// Base vertices put on curves between corners.
    pub breakpoints: usize,
    /// Free base vertices put where no feature was, as vertices of the base's surface.
    pub sites: Vec<u32>,
    /// Base vertices added until the dual was valid, as vertices of the base's surface.
    pub inserted: Vec<u32>,
    /// Those of them that stand on a bulge: a finger tip within one base triangle, say.
    pub bulges: usize,
    /// Rounds of adding them.
    pub rounds: usize,
    /// Base edges flipped for better base triangles.
    pub flipped: usize,
    /// Vertices that refining the surface added.
    pub refined: usize,
    /// Edges that detection made features.
    pub detected: usize,
    /// Feature edges dropped with the short features they are part of, as vertex pairs of the input.
    pub dropped: Vec<[u32; 2]>,
    /// Seconds by stage.
    pub seconds: Vec<(&'static str, f64)>,
}

/// What an editing loop keeps between one base and the next: while only sites and breakpoints change, the refined surface,
/// its factorised Laplacian and the fields stay.
#[derive(Debug, Clone)]
pub struct Fieldwork {
    /// The surface in the unit box, refined; input vertices first.
    pub mesh: SplitMesh,
    /// Distances on it.
    pub metric: Metric,
    /// Curves, corners and points.
    pub network: Network,
    /// Harmonic fields of the base vertices.
    pub fields: Fields,
    /// The base vertices.
    pub peaks: Vec<u32>,
    /// Wanted base edge length at each vertex.
    pub wanted: Vec<f64>,
    /// For each chain, where its breakpoints are and which base vertices they are.
    breakpoints: Vec<Vec<(usize, u32)>>,
}

/// Builds the base triangulation of a surface: every feature a path of base edges, every base triangle a disk with three
/// sides, no two with the same corners. Lengths in the options are relative, so the scale does not matter. 20,000 vertices
/// with 70 features take about a second, nearly all of it linear in the vertices.
///
/// ```
/// use mesh::{DVec3, Monitor, TriangleMesh};
/// use retopology::build::{BaseOptions, build_base};
/// let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let tetrahedron = TriangleMesh { positions, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] };
/// let built = build_base(&tetrahedron, &Default::default(), &BaseOptions::default(), &Monitor::new())?;
/// let base = built.base;
/// assert_eq!(base.vertices.len() + base.triangles.len(), base.edges.len() + 2);
/// # Ok::<(), retopology::base_error::RetopologyError>(())
/// ```
///
/// # Errors
/// [`RetopologyError`]: bad mesh, features or options, cancelled.
pub fn build_base(
    mesh: &TriangleMesh,
    features: &Features,
    options: &BaseOptions,
    monitor: &Monitor,
) -> Result<Built, RetopologyError> {
    build_within(mesh, features, options, None, monitor).map(|(built, _)| built)
}

/// A part of a surface that already has a base triangulation, to be triangulated anew. Its rim, where it meets the rest, stays.
pub(crate) struct Part<'a> {
    /// The input triangle that each triangle is part of.
    pub source: &'a [u32],
    /// The first vertices stay; others that the base does not need go.
    pub fixed: usize,
    /// Edges of the rim: each chain of them becomes one base edge, undivided.
    pub rim: &'a BTreeSet<[u32; 2]>,
    /// Base edge length far from features where the density is 1, scene units.
    pub even: f64,
}

/// As [`build_base`]; also returns what became of each vertex, [`NONE`] for those that went.
///
/// # Errors
/// As [`build_base`]; [`RetopologyError::Internal`] when the rim of a part cannot stay.
pub(crate) fn build_within(
    mesh: &TriangleMesh,
    features: &Features,
    options: &BaseOptions,
    part: Option<&Part<'_>>,
    monitor: &Monitor,
) -> Result<(Built, Vec<u32>), RetopologyError> {
    options.check(mesh.positions.len())?;
    let mut report = BaseReport::default();
    let mut clock = Clock(Instant::now());
    monitor.stage("reading the surface", 0.0)?;
    let topology = input::check(mesh)?;
    let (working, placement) = input::normalised(mesh);
    let mut features = features.clone();
    if let Some(detection) = &options.detect {
        let found = detect::sharp_edges(&working, &topology, &features.edges, detection)?;
        report.detected = found.len();
        features.edges.extend(found);
    }
    let final_edge = options.final_edge.unwrap_or(0.0) / placement.scale;
    let crumbs = options.crumbs(mesh).scaled(1.0 / placement.scale);
    let mut network = network(&working, &topology, &features, options.corner_angle, crumbs)?;
    if let Some(part) = part {
        for chain in &mut network.chains {
            chain.whole = part.rim.contains(&mesh::sorted(chain.vertices[0], chain.vertices[1]));
        }
    }
    report.dropped.clone_from(&network.dropped);
    report.curves = network.chains.len();
    report.corners = network.corners.len() + network.points.len();
    clock.lap(&mut report, "features");

    let lengths = Lengths {
        even: part.map_or_else(
            || even_length(&working, &options.density, options.vertices),
            |part| part.even / placement.scale,
        ),
        least: options.least_quads * final_edge,
    };
    let mut surface = SplitMesh::new(&working, &topology);
    if let Some(part) = part {
        surface.source.copy_from_slice(part.source);
    }
    let mut work = Fieldwork::new(surface, network, options, lengths, &mut report, &mut clock, monitor)?;
    monitor.stage("triangulating", 0.4)?;
    let mut drawn = Drawn::new(&mut work, &mut report, &mut clock, monitor)?;
    for _ in 0..BULGE_ROUNDS {
        let lengths = drawn.straight.lengths(&drawn.drawing, &drawn.dual, false);
        let tips = bulges::tips(&drawn.drawing, &drawn.dual, &work.peaks, &lengths, work.mesh.positions.len());
        if tips.is_empty() {
            break;
        }
        report.bulges += tips.len();
        report.inserted.extend(&tips);
        let additions: Vec<Addition> = tips.into_iter().map(|v| work.addition(v, (NONE, 0))).collect();
        work.fields.add(&additions, monitor)?;
        drawn = Drawn::new(&mut work, &mut report, &mut clock, monitor)?;
    }
    let Drawn { pieces, dual, drawing, straight } = drawn;

    monitor.stage("cutting the surface", 0.9)?;
    let Straightened { topology, triangulation, paths } = straight;
    let mut surface = cut::cut(&drawing.mesh, &topology, &triangulation, &paths, monitor)?;
    for ((piece, path), vertices) in dual.piece.iter().zip(&mut surface.paths).zip(drawing.paths) {
        if piece.is_some() {
            *path = vertices;
        }
    }
    let fixed = part.map_or(mesh.positions.len(), |part| part.fixed);
    let number = tidy::tidy(&mut surface, fixed, &work.peaks, monitor)?;
    tidy::split_chords(&mut surface);
    let renumbered = |vertices: &[u32]| vertices.iter().map(|&v| number[v as usize]).collect::<Vec<u32>>();
    report.sites = renumbered(&report.sites);
    report.inserted = renumbered(&report.inserted);
    for position in &mut surface.mesh.positions {
        *position = placement.to_scene(*position);
    }
    for (&position, &v) in mesh.positions.iter().zip(&number).filter(|(_, v)| **v != NONE) {
        surface.mesh.positions[v as usize] = position;
    }
    let base = assemble(dual, &pieces, renumbered(&work.peaks), surface)?;
    clock.lap(&mut report, "cut");
    Ok((Built { base, report, fieldwork: work }, number))
}

/// The result of [`build_base`].
#[derive(Debug, Clone)]
pub struct Built {
    /// The base triangulation.
    pub base: Base,
    /// What was done.
    pub report: BaseReport,
    /// What an editing loop reuses, and the fields for display.
    pub fieldwork: Fieldwork,
}

/// The base triangulation, drawn on the surface.
struct Drawn {
    pieces: Vec<Piece>,
    dual: Dual,
    drawing: Drawing,
    straight: Straightened,
}

impl Drawn {
    /// From fields to geodesic base edges, base vertices added and edges flipped as needed.
    fn new(
        work: &mut Fieldwork,
        report: &mut BaseReport,
        clock: &mut Clock,
        monitor: &Monitor,
    ) -> Result<Self, RetopologyError> {
        let (cells, pieces) = work.valid_cells(report, monitor)?;
        clock.lap(report, "cells");
        let mut dual = Dual::new(&work.mesh, &cells)?;
        let mut drawing = stars::draw(&work.mesh, &cells, &work.fields, &work.peaks, &pieces, monitor)?;
        clock.lap(report, "paths");
        let mut straight = Straightened::new(&drawing, &dual, &work.peaks, monitor)?;
        for _ in 0..FLIP_ROUNDS {
            let flips = dual.improve([false, true].map(|along| straight.lengths(&drawing, &dual, along)));
            if flips.is_empty() {
                break;
            }
            report.flipped += flips.len();
            for flip in flips {
                monitor.check()?;
                drawing.redraw(flip.edge as usize, flip.ends.map(|k| work.peaks[k as usize]))?;
            }
            straight = Straightened::new(&drawing, &dual, &work.peaks, monitor)?;
        }
        clock.lap(report, "geodesics");
        Ok(Self { pieces, dual, drawing, straight })
    }
}

/// The drawn base edges as geodesics.
struct Straightened {
    topology: Topology,
    triangulation: Intrinsic,
    /// Half-edges of the triangulation; empty for edges on curves.
    paths: Vec<Vec<u32>>,
}

impl Straightened {
    fn new(drawing: &Drawing, dual: &Dual, ends: &[u32], monitor: &Monitor) -> Result<Self, RetopologyError> {
        let topology = drawing.mesh.topology();
        let mut triangulation = Intrinsic::new(&drawing.mesh.to_mesh(), &topology);
        let mut fixed = vec![false; topology.len()];
        let mut paths = Vec::with_capacity(drawing.paths.len());
        for (path, piece) in drawing.paths.iter().zip(&dual.piece) {
            let half_edges = path.windows(2).map(|pair| drawing.mesh.find(pair[0], pair[1]));
            let half_edges = half_edges.collect::<Option<Vec<u32>>>().ok_or(RetopologyError::Internal {
                stage: "straightening base edges",
                reason: "a path leaves the surface",
            })?;
            if piece.is_some() {
                for &h in &half_edges {
                    fixed[h as usize] = true;
                }
                paths.push(Vec::new());
            } else {
                paths.push(half_edges);
            }
        }
        let mut network = flip_geodesic::Network::new(&triangulation, paths, &fixed, ends);
        network.shorten(&mut triangulation, monitor)?;
        Ok(Self { topology, triangulation, paths: network.paths })
    }

    /// Length of every base edge; of those on curves `along` them, or else between their ends.
    fn lengths(&self, drawing: &Drawing, dual: &Dual, along: bool) -> Vec<f64> {
        let at = |v: u32| drawing.mesh.positions[v as usize];
        let curve = |path: &[u32]| {
            if along {
                path.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).sum()
            } else {
                at(path[0]).distance(at(path[path.len() - 1]))
            }
        };
        let free = |path: &[u32]| path.iter().map(|&h| self.triangulation.length_of(h)).sum::<f64>();
        (0..self.paths.len())
            .map(|k| if dual.piece[k].is_some() { curve(&drawing.paths[k]) } else { free(&self.paths[k]) })
            .collect()
    }
}

struct Clock(Instant);

impl Clock {
    fn lap(&mut self, report: &mut BaseReport, stage: &'static str) {
        let seconds = self.0.elapsed().as_secs_f64();
        match report.seconds.iter_mut().find(|(name, _)| *name == stage) {
            Some((_, sum)) => *sum += seconds,
            None => report.seconds.push((stage, seconds)),
        }
        self.0 = Instant::now();
    }
}

impl Fieldwork {
    fn new(
        mut mesh: SplitMesh,
        mut network: Network,
        options: &BaseOptions,
        lengths: Lengths,
        report: &mut BaseReport,
        clock: &mut Clock,
        monitor: &Monitor,
    ) -> Result<Self, RetopologyError> {
        monitor.stage("placing sites", 0.05)?;
        let inputs = mesh.positions.len();
        let mut sizing = wanted_lengths(&mesh, &network, options, lengths);
        refine(&mut mesh, &mut network, &mut sizing, 20_000 + 2 * inputs, monitor)?;
        report.refined = mesh.positions.len() - inputs;
        clock.lap(report, "refinement");

        let metric = Metric::new(&mesh);
        let divided = divide_curves(&mesh, &metric, &mut network, &sizing.wanted);
        let (mut peaks, breakpoints) = curve_vertices(&network, &divided);
        let on_curves = peaks.len();
        peaks.extend(&network.points);
        report.breakpoints = on_curves - network.corners.len();
        report.sites = free_sites(&mesh, &metric, &network, &peaks, &sizing.wanted, monitor)?;
        peaks.extend(&report.sites);
        clock.lap(report, "sites");

        monitor.stage("harmonic fields", 0.2)?;
        let (refined, refined_topology) = (mesh.to_mesh(), mesh.topology());
        let mut prescribed = vec![false; mesh.positions.len()];
        let mut fixed = vec![false; refined_topology.len()];
        for chain in &network.chains {
            for &v in &chain.vertices {
                prescribed[v as usize] = true;
            }
            for pair in chain.walk().collect::<Vec<_>>().windows(2) {
                if let Some(h) = mesh.find(pair[0], pair[1]) {
                    fixed[h as usize] = true;
                }
            }
        }
        for &v in &peaks {
            prescribed[v as usize] = true;
        }
        let weights = cotangent_weights(&refined, &refined_topology, &fixed, monitor)?;
        let mut first: Vec<Addition> =
            peaks.iter().map(|&vertex| Addition { vertex, hat: vec![(vertex, 1.0)] }).collect();
        let mut seeds: Vec<(u32, u32)> = peaks.iter().zip(0..).map(|(&vertex, k)| (vertex, k)).collect();
        for piece in pieces(&network, &breakpoints) {
            for (v, at) in along(&mesh, &piece) {
                first[piece.ends[0] as usize].hat.push((v, 1.0 - at));
                first[piece.ends[1] as usize].hat.push((v, at));
                seeds.push((v, piece.ends[usize::from(at > 0.5)]));
            }
        }
        let groups = Groups::new(&mesh, &metric, &seeds, peaks.len());
        let fields = Fields::new(&weights, prescribed, first, groups, monitor)?;
        clock.lap(report, "fields");
        Ok(Self { mesh, metric, network, fields, peaks, wanted: sizing.wanted, breakpoints })
    }

    /// Adds base vertices until the dual of the cells is a triangulation of the surface.
    fn valid_cells(
        &mut self,
        report: &mut BaseReport,
        monitor: &Monitor,
    ) -> Result<(Cells, Vec<Piece>), RetopologyError> {
        let mut chain_of = vec![(NONE, 0); self.mesh.positions.len()];
        for (c, chain) in self.network.chains.iter().enumerate() {
            for (k, &v) in chain.vertices.iter().enumerate() {
                chain_of[v as usize] = (c as u32, k);
            }
        }
        loop {
            monitor.check()?;
            let pieces = pieces(&self.network, &self.breakpoints);
            let mut on_curve = vec![NONE; self.mesh.positions.len()];
            for piece in &pieces {
                for (v, at) in along(&self.mesh, piece) {
                    on_curve[v as usize] = piece.ends[usize::from(at > 0.5)];
                }
            }
            let label = labels(&self.mesh, &self.fields, &self.peaks, &on_curve);
            let cells = Cells::new(&self.mesh, label, &pieces);
            let flaws = cells.flaws(&self.mesh, &self.metric, &self.peaks, &pieces);
            if flaws.is_empty() {
                return Ok((cells, pieces));
            }
            // At the latest when every vertex is a base vertex there is no flaw left.
            if flaws.iter().any(|v| self.peaks.contains(v)) {
                return Err(RetopologyError::Internal {
                    stage: "triangulating",
                    reason: "a base vertex was added twice",
                });
            }
            let flaws = self.spaced(flaws);
            let whole = |v: u32| match chain_of[v as usize].0 {
                NONE => false,
                chain => self.network.chains[chain as usize].whole,
            };
            if flaws.iter().any(|&v| whole(v)) {
                return Err(RetopologyError::Internal {
                    stage: "triangulating",
                    reason: "the rim of a part is divided",
                });
            }
            report.rounds += 1;
            report.inserted.extend(&flaws);
            let additions: Vec<Addition> = flaws.iter().map(|&v| self.addition(v, chain_of[v as usize])).collect();
            self.fields.add(&additions, monitor)?;
        }
    }

    /// Leaves out vertices close to earlier ones: one addition often mends what lies around, and the next round tells.
    fn spaced(&self, vertices: Vec<u32>) -> Vec<u32> {
        let mut kept: Vec<u32> = Vec::with_capacity(vertices.len());
        for v in vertices {
            let at = |v: u32| self.mesh.positions[v as usize];
            let room = SPACING * self.wanted[v as usize];
            if kept.iter().all(|&w| at(v).distance(at(w)) > room) {
                kept.push(v);
            }
        }
        kept
    }

    /// Makes `vertex` a base vertex; `place` is its chain, if any, and its index there.
    fn addition(&mut self, vertex: u32, place: (u32, usize)) -> Addition {
        let base = self.peaks.len() as u32;
        self.peaks.push(vertex);
        let mut hat = Hat::new();
        if place.0 != NONE {
            let breakpoints = &mut self.breakpoints[place.0 as usize];
            let k = breakpoints.partition_point(|&(at, _)| at < place.1);
            breakpoints.insert(k, (place.1, base));
            hat.push((vertex, 1.0));
            for piece in pieces_of(&self.network, place.0, &self.breakpoints[place.0 as usize]) {
                for (end, rising) in [(piece.ends[1], true), (piece.ends[0], false)] {
                    if end == base {
                        let values = along(&self.mesh, &piece);
                        hat.extend(values.into_iter().map(|(v, at)| (v, if rising { at } else { 1.0 - at })));
                    }
                }
            }
        }
        Addition { vertex, hat }
    }
}

/// The base vertices on curves, corners first, and for each chain where they are.
fn curve_vertices(network: &Network, divided: &Breakpoints) -> (Vec<u32>, Vec<Vec<(usize, u32)>>) {
    let mut peaks = network.corners.clone();
    let mut index: BTreeMap<u32, u32> = peaks.iter().enumerate().map(|(k, &v)| (v, k as u32)).collect();
    let mut breakpoints = Vec::with_capacity(network.chains.len());
    for (chain, along) in network.chains.iter().zip(&divided.along) {
        let walk: Vec<u32> = chain.walk().collect();
        let base_of = |k: usize| {
            *index.entry(walk[k]).or_insert_with(|| {
                peaks.push(walk[k]);
                peaks.len() as u32 - 1
            })
        };
        let ids: Vec<u32> = along.iter().copied().map(base_of).collect();
        breakpoints.push(along.iter().copied().zip(ids).collect());
    }
    (peaks, breakpoints)
}

fn pieces(network: &Network, breakpoints: &[Vec<(usize, u32)>]) -> Vec<Piece> {
    (0..network.chains.len() as u32).flat_map(|c| pieces_of(network, c, &breakpoints[c as usize])).collect()
}

fn pieces_of(network: &Network, chain: u32, breakpoints: &[(usize, u32)]) -> Vec<Piece> {
    let walk: Vec<u32> = network.chains[chain as usize].walk().collect();
    breakpoints
        .windows(2)
        .map(|pair| Piece { ends: [pair[0].1, pair[1].1], chain, vertices: walk[pair[0].0..=pair[1].0].to_vec() })
        .collect()
}

/// The vertices between the ends of a piece, and the fraction of its length where each lies.
fn along(mesh: &SplitMesh, piece: &Piece) -> Vec<(u32, f64)> {
    let mut reached = vec![0.0];
    for pair in piece.vertices.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|v| mesh.positions[v as usize]);
        reached.push(reached[reached.len() - 1] + a.distance(b));
    }
    let total = reached[reached.len() - 1];
    let last = piece.vertices.len() - 1;
    (1..last)
        .map(|k| (piece.vertices[k], if total > 0.0 { reached[k] / total } else { k as f64 / last as f64 }))
        .collect()
}
