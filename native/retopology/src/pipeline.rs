//! The whole way from a polygon mesh and its features to quads: check -> triangulate -> detect -> base triangulation ->
//! quads -> sources of attributes -> report. Sections 4 to 6 of Daniels et al. 2011, and what surrounds them.
//!
//! The stages work in a box of unit diagonal about the origin, so that no place and no scale of the scene matters; corners
//! of features come back bit for bit.

use crate::base::Base;
use crate::base_complex::patches;
use crate::build::{BaseOptions, Built, build_base};
use crate::density::Size;
use crate::detect::sharp_edges;
use crate::failure::RetopologizeError;
use crate::features::Features;
use crate::input::{Placement, normalised};
use crate::inspect::{edges_of, inspect, inspect_features};
use crate::measures::Measures;
use crate::output::{BasePath, FeatureKind, Output, OutputFeature, Report};
use crate::quads::{LayoutOptions, Quads, quads_from_base};
use crate::sources::{corner_sources, distance_to_segment, nearest_edges};
use crate::triangulate::{Triangulated, triangulate};
use mesh::{Cancelled, DVec3, Monitor, NONE, PolygonMesh, Topology, scaled_jacobian, sorted};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::time::Instant;

/// Most quads: what a scene can hold, and a slip of the edge length should not ask for.
const MOST_FACES: f64 = 4e6;
/// A feature counts as reproduced within this part of the mean edge length.
const REPRODUCED: f64 = 0.05;
/// Bases tried for the coarsest layout: base vertices, and the least length of base edges, in terms of the options'. Measured on
/// 19 meshes none was the best for more than a third.
const COARSE_TRIES: [(f64, f64); 4] = [(1.0, 1.0), (0.4, 1.0), (0.4, 2.0), (0.6, 1.6)];
/// Of a coarse layout with turned quads, far from its target, or whose first percentile of the scaled Jacobian is below what is
/// fair, each patch counts as so many.
const TURNED: f64 = 100.0;
const MISSED: f64 = 10.0;
const BAD: f64 = 1.6;
const FAIR: f64 = 0.3;
/// A result this far from its target is worth a word.
const NEAR_TARGET: f64 = 0.05;

/// Options of [`retopologize`].
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The base triangulation, detection of sharp edges among it.
    pub base: BaseOptions,
    /// The quads. `size` is in scene units, `density` has one value for each vertex of the mesh, or none.
    pub layout: LayoutOptions,
}

/// An all-quad mesh of a surface in which every feature is a chain of edges and every corner of a feature keeps its exact
/// position. The surface may have triangles, quads and n-gons, borders, any genus and any number of components; borders are
/// features. Same input, same output, whatever the number of threads. Nearly linear in the faces of input and result.
///
/// # Errors
/// [`RetopologizeError`]: a mesh or features that cannot be worked on, with the elements; an option out of range; cancelled.
///
/// # Source
/// Daniels et al., Template-based quadrilateral meshing, 2011; docs/papers.md lists the deviations.
///
/// ```
/// use mesh::{DVec3, Monitor, PolygonMesh};
/// use retopology::{Options, Size, retopologize};
/// let corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)];
/// let corners = corners.map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into())).to_vec();
/// let faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// let cube = PolygonMesh::from_polygons(corners, faces)?;
/// let mut options = Options::default();
/// options.base.detect = Some(Default::default());
/// options.layout.size = Size::TargetFaces(600);
/// let made = retopologize(&cube, &Default::default(), &options, &Monitor::new())?;
/// assert!(made.mesh.is_pure_quad());
/// assert_eq!(made.report.chains, 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn retopologize(
    mesh: &PolygonMesh,
    features: &Features,
    options: &Options,
    monitor: &Monitor,
) -> Result<Output, RetopologizeError> {
    let mut clock = Clock { last: Instant::now(), seconds: BTreeMap::new() };
    monitor.stage("checking the mesh", 0.0)?;
    inspect(mesh)?;
    let marked = inspect_features(mesh, features)?;
    let given = &options.layout.density;
    if !given.is_empty() && given.len() != mesh.vertex_count() {
        return Err(RetopologizeError::Option(format!(
            "density has {} values; it must have one for each of the {} vertices",
            given.len(),
            mesh.vertex_count()
        )));
    }
    clock.lap("check");
    monitor.check()?;

    let (input, placement) = at_unit_size(mesh);
    let mut layout = options.layout.clone();
    layout.density = input.spread(given);
    if let Size::EdgeLength(length) = &mut layout.size {
        *length /= placement.scale;
    }
    let final_edge = edge_length(&input, &layout)?;
    clock.lap("triangulate");
    let mut kinds: BTreeMap<[u32; 2], FeatureKind> =
        marked.into_iter().map(|edge| (edge, FeatureKind::Marked)).collect();
    let mut all = features.clone();
    let mut edges_detected = 0;
    if let Some(detection) = &options.base.detect {
        let topology = Topology::of_triangles(&input.mesh);
        // Diagonals of bent quads may be as sharp as an edge, but are none.
        let edges = edges_of(mesh);
        for edge in sharp_edges(&input.mesh, &topology, &features.edges, detection)? {
            let edge = sorted(edge[0], edge[1]);
            if edges.binary_search(&edge).is_ok() {
                kinds.insert(edge, FeatureKind::Detected);
                all.edges.push(edge);
                edges_detected += 1;
            }
        }
        clock.lap("detect");
    }
    // Where the quads are smallest.
    let smallest = layout.density.iter().copied().reduce(f64::min).unwrap_or(1.0);
    let given = options.base.final_edge.map(|length| length / placement.scale);
    let base_options =
        BaseOptions { detect: None, final_edge: Some(given.unwrap_or(final_edge * smallest)), ..options.base.clone() };
    let (built, quads) = made(&input, &all, &base_options, &layout, &mut clock, monitor)?;

    monitor.stage("tracing attributes", 0.95)?;
    let measures = Measures::new(&built.base)?;
    let corner_source = corner_sources(&input, &built.base, &measures, &quads);
    let chains = input_chains(&built, input.mesh.positions.len());
    let under = nearest_edges(&quads, &chains, &input.mesh.positions, monitor)?;
    if under.contains(&[NONE; 2]) {
        return Err(RetopologizeError::bug("a feature edge of the quads lies on no feature"));
    }
    let feature_edges: Vec<OutputFeature> = quads
        .feature_edges
        .iter()
        .zip(under)
        .map(|(edge, input_edge)| OutputFeature {
            ends: edge.ends,
            chain: edge.chain.unwrap_or(NONE),
            kind: kinds.get(&sorted(input_edge[0], input_edge[1])).copied().unwrap_or(FeatureKind::Border),
            input_edge,
        })
        .collect();
    clock.lap("attributes");

    monitor.stage("measuring", 0.98)?;
    let mut report = measure(&built, &quads, placement);
    report.edges_detected = edges_detected;
    let dropped = &built.report.dropped;
    measure_features(&mut report, &quads, &chains, dropped, &input.mesh.positions, placement, monitor)?;
    report.warnings = warnings(&report);
    clock.lap("measure");
    report.seconds = clock.seconds;
    Ok(Output {
        base: base_mesh(&built.base, mesh, placement)?,
        base_paths: base_paths(&built.base, placement),
        mesh: in_scene(&quads, &built.base, mesh, placement),
        feature_edges,
        corner_source,
        report,
    })
}

/// Base and quads: for the coarsest layout, of some bases that with the best [`score`].
fn made(
    input: &Triangulated,
    features: &Features,
    base: &BaseOptions,
    layout: &LayoutOptions,
    clock: &mut Clock,
    monitor: &Monitor,
) -> Result<(Built, Quads), RetopologizeError> {
    let tries: &[(f64, f64)] = if layout.irregularity.is_infinite() { &COARSE_TRIES } else { &[(1.0, 1.0)] };
    let mut best: Option<(f64, Built, Quads)> = None;
    for (k, (vertices, least)) in tries.iter().enumerate() {
        let at = |part: f64| 0.02 + 0.93 * (k as f64 + part) / tries.len() as f64;
        let options = BaseOptions {
            vertices: (f64::from(base.vertices) * vertices).round().max(4.0_f64.min(f64::from(base.vertices))) as u32,
            least_quads: (base.least_quads * least).min(20.0_f64.max(base.least_quads)),
            ..base.clone()
        };
        let built = monitor.within(at(0.0), at(0.4), || build_base(&input.mesh, features, &options, monitor))?;
        clock.add(&built.report.seconds);
        // Marked vertices, and the corners that the caller's angle makes.
        let network = &built.fieldwork.network;
        let stays = |v: &u32| network.corners.binary_search(v).is_ok() || network.points.binary_search(v).is_ok();
        let fixed = (0..).zip(&built.base.vertices).filter(|(_, v)| stays(v)).map(|(k, _)| k).collect();
        let layout = LayoutOptions { fixed, ..layout.clone() };
        let quads = monitor.within(at(0.4), at(1.0), || quads_from_base(&built.base, &layout, monitor))?;
        clock.add(&quads.report.seconds);
        let score = if tries.len() > 1 { score(&quads) } else { 0.0 };
        if best.as_ref().is_none_or(|found| score < found.0) {
            best = Some((score, built, quads));
        }
    }
    best.map(|(_, built, quads)| (built, quads)).ok_or_else(|| RetopologizeError::bug("no base was tried"))
}

/// What speaks against a coarse layout: its patches, and its faults.
fn score(quads: &Quads) -> f64 {
    let mut jacobians: Vec<f64> = (0..quads.mesh.face_count()).map(|f| jacobian(&quads.mesh, f)).collect();
    jacobians.sort_by(f64::total_cmp);
    let turned = quads.report.inverted > 0 || jacobians.first().is_none_or(|least| *least <= 0.0);
    let bad = jacobians.get(jacobians.len() / 100).is_none_or(|percentile| *percentile < FAIR);
    let (faces, target) = (quads.report.faces as f64, quads.report.target.unwrap_or(quads.report.faces) as f64);
    let missed = (faces / target - 1.0).abs() > NEAR_TARGET;
    let faults = [(turned, TURNED), (missed, MISSED), (bad, BAD)];
    faults.iter().filter(|fault| fault.0).fold(patches(&quads.mesh) as f64, |score, fault| score * fault.1)
}

fn jacobian(mesh: &PolygonMesh, face: usize) -> f64 {
    let corners = mesh.face(face);
    scaled_jacobian([corners[0], corners[1], corners[2], corners[3]].map(|v| mesh.positions[v as usize]))
}

struct Clock {
    last: Instant,
    seconds: BTreeMap<String, f64>,
}

impl Clock {
    /// Books the time since the last lap to a stage.
    fn lap(&mut self, stage: &str) {
        *self.seconds.entry(stage.to_owned()).or_default() += self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
    }

    /// Takes over the stages of a part that kept its own time.
    fn add(&mut self, stages: &[(&'static str, f64)]) {
        for (stage, seconds) in stages {
            *self.seconds.entry((*stage).to_owned()).or_default() += seconds;
        }
        self.last = Instant::now();
    }
}

/// The mesh as triangles in the unit box, and where that lies in the scene.
fn at_unit_size(mesh: &PolygonMesh) -> (Triangulated, Placement) {
    let (corners, _) = mesh::TriangleMesh::from_polygons(mesh);
    let (unit, placement) = normalised(&corners);
    (triangulate(&mesh.with_positions(unit.positions)), placement)
}

/// The edge length that the wanted size means where the density is 1, in the unit box. Refuses sizes that are no sizes, or
/// that ask for more quads than a scene can hold.
fn edge_length(input: &Triangulated, layout: &LayoutOptions) -> Result<f64, RetopologizeError> {
    let bad = |sentence: String| Err(RetopologizeError::Option(sentence));
    if layout.density.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return bad("density must be a positive number at every vertex".into());
    }
    let size =
        |t: &[u32; 3]| t.iter().map(|&v| layout.density.get(v as usize).copied().unwrap_or(1.0)).sum::<f64>() / 3.0;
    let area: f64 = (0..)
        .zip(&input.mesh.triangles)
        .map(|(t, corners)| input.mesh.area_normal(t).length() / 2.0 / size(corners).powi(2))
        .sum();
    match layout.size {
        Size::TargetFaces(faces) if faces == 0 || faces as f64 > MOST_FACES => {
            bad(format!("target_faces is {faces}, but it must lie between 1 and {MOST_FACES}"))
        }
        Size::TargetFaces(faces) => Ok((area / faces as f64).sqrt()),
        Size::EdgeLength(length) if !(length > 0.0 && length.is_finite()) => {
            bad("edge_length must be a positive number".into())
        }
        Size::EdgeLength(length) if area / length.powi(2) > MOST_FACES => bad(format!(
            "edge_length would give about {:.0} million quads, but {:.0} million is the most; make it longer",
            area / length.powi(2) / 1e6,
            MOST_FACES / 1e6
        )),
        Size::EdgeLength(length) => Ok(length),
    }
}

/// The input edges of each chain of the network; `count` is the number of vertices before the surface was refined.
fn input_chains(built: &Built, count: usize) -> Vec<Vec<[u32; 2]>> {
    let chains = &built.fieldwork.network.chains;
    let edges = |chain: &crate::features::Chain| {
        let own: Vec<u32> = chain.walk().filter(|&v| (v as usize) < count).collect();
        own.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    };
    chains.iter().map(edges).collect()
}

/// The quads where the mesh lies. What stands at a vertex of the mesh gets its very position.
fn in_scene(quads: &Quads, base: &Base, mesh: &PolygonMesh, placement: Placement) -> PolygonMesh {
    let place = |(v, &p): (usize, &DVec3)| {
        let at = quads.base_vertex[v];
        let exact =
            (at != NONE).then(|| base.vertices[at as usize] as usize).filter(|&s| base.surface.positions[s] == p);
        exact.and_then(|s| mesh.positions.get(s).copied()).unwrap_or_else(|| placement.to_scene(p))
    };
    quads.mesh.with_positions(quads.mesh.positions.iter().enumerate().map(place).collect())
}

fn base_mesh(base: &Base, mesh: &PolygonMesh, placement: Placement) -> Result<PolygonMesh, RetopologizeError> {
    let at = |&s: &u32| {
        let exact = mesh.positions.get(s as usize).copied();
        exact.unwrap_or_else(|| placement.to_scene(base.surface.positions[s as usize]))
    };
    PolygonMesh::from_polygons(base.vertices.iter().map(at).collect(), &base.triangles)
        .map_err(|error| RetopologizeError::bug(&format!("the base triangulation is no mesh: {error}")))
}

fn base_paths(base: &Base, placement: Placement) -> Vec<BasePath> {
    let path = |edge: &crate::base::BaseEdge| BasePath {
        ends: edge.ends,
        points: edge.path.iter().map(|&v| placement.to_scene(base.surface.positions[v as usize])).collect(),
        chain: edge.feature,
    };
    base.edges.iter().map(path).collect()
}

/// Counts, and the shape of the quads.
fn measure(built: &Built, quads: &Quads, placement: Placement) -> Report {
    let corners = |f: usize| {
        let face = quads.mesh.face(f);
        [face[0], face[1], face[2], face[3]].map(|v| quads.mesh.positions[v as usize])
    };
    let shapes: Vec<(f64, f64)> = (0..quads.mesh.face_count())
        .into_par_iter()
        .map(|f| {
            let p = corners(f);
            let angle = |k: usize| (p[(k + 1) % 4] - p[k]).angle_between(p[(k + 3) % 4] - p[k]).to_degrees();
            (scaled_jacobian(p), (0..4).map(|k| (angle(k) - 90.0).abs()).sum::<f64>() / 4.0)
        })
        .collect();
    let mut jacobians: Vec<f64> = shapes.iter().map(|shape| shape.0).collect();
    jacobians.sort_by(f64::total_cmp);
    let count = jacobians.len().max(1);
    let at = |k: usize| jacobians.get(k).copied().unwrap_or(0.0);
    let (base, layout) = (&built.report, &quads.report);
    Report {
        faces: layout.faces,
        target: layout.target,
        edge_length: layout.edge_length * placement.scale,
        base_vertices: built.base.vertices.len(),
        base_triangles: built.base.triangles.len(),
        sites_added: base.sites.len() + base.inserted.len(),
        patches: layout.patches,
        single_patches: layout.singles,
        base_complex: patches(&quads.mesh),
        irregular_vertices: layout.irregular,
        inverted: layout.inverted,
        scaled_jacobian_min: at(0),
        scaled_jacobian_p01: at(count / 100),
        scaled_jacobian_mean: jacobians.iter().sum::<f64>() / count as f64,
        angle_deviation: shapes.iter().map(|shape| shape.1).sum::<f64>() / count as f64,
        chains: base.curves,
        edges_dropped: base.dropped.len(),
        ..Report::default()
    }
}

/// How much of the features' length the edges of the result follow, sampled at the middles of the input's edges.
fn measure_features(
    report: &mut Report,
    quads: &Quads,
    chains: &[Vec<[u32; 2]>],
    dropped: &[[u32; 2]],
    positions: &[DVec3],
    placement: Placement,
    monitor: &Monitor,
) -> Result<(), Cancelled> {
    let mut made = vec![Vec::new(); chains.len()];
    let (mut total, mut sides) = (0.0, 0.0);
    let at = |v: u32| quads.mesh.positions[v as usize];
    for face in quads.mesh.faces() {
        for k in 0..face.len() {
            total += at(face[k]).distance(at(face[(k + 1) % face.len()]));
            sides += 1.0;
        }
    }
    let limit = REPRODUCED * total / f64::max(sides, 1.0);
    for edge in &quads.feature_edges {
        if let Some(of_chain) = edge.chain.and_then(|chain| made.get_mut(chain as usize)) {
            of_chain.push(edge.ends.map(at));
        }
    }
    let length_of = |[a, b]: &[u32; 2]| positions[*a as usize].distance(positions[*b as usize]);
    let (mut length, mut near) = (dropped.iter().map(length_of).sum::<f64>(), 0.0);
    for (chain, made) in chains.iter().zip(&made) {
        let parts: Vec<(f64, bool)> = chain
            .par_iter()
            .map(|ends| {
                monitor.check()?;
                let [a, b] = ends.map(|v| positions[v as usize]);
                let is_near = made.iter().any(|&[p, q]| distance_to_segment(a.midpoint(b), p, q) <= limit);
                Ok((a.distance(b), is_near))
            })
            .collect::<Result<_, Cancelled>>()?;
        length += parts.iter().map(|part| part.0).sum::<f64>();
        near += parts.iter().filter(|part| part.1).map(|part| part.0).sum::<f64>();
    }
    report.feature_length = length * placement.scale;
    report.features_reproduced = if length > 0.0 { near / length } else { 1.0 };
    Ok(())
}

fn warnings(report: &Report) -> Vec<String> {
    let mut said = Vec::new();
    if report.inverted > 0 {
        let quads = if report.inverted == 1 { "1 quad is" } else { &format!("{} quads are", report.inverted) };
        said.push(format!("{quads} turned over: the surface leaves no room there for quads of this size"));
    }
    if let Some(target) = report.target
        && (report.faces as f64 / target as f64 - 1.0).abs() > NEAR_TARGET
    {
        said.push(format!("{} quads instead of {target}: the features need so many", report.faces));
    }
    if report.edges_dropped > 0 {
        let edges = if report.edges_dropped == 1 { "1 edge" } else { &format!("{} edges", report.edges_dropped) };
        said.push(format!(
            "{edges} of features too short for quads of this size were left out: make the quads smaller"
        ));
    }
    said
}
