//! The whole way from a polygon mesh and its features to quads: check -> triangulate -> detect -> base triangulation ->
//! quads -> sources of attributes -> report. Sections 4 to 6 of Daniels et al. 2011, and what surrounds them.
//!
//! [`crate::project`] keeps what it makes from one edit of the features to the next.
//!
//! The stages work in a box of unit diagonal about the origin, so that no place and no scale of the scene matters; corners
//! of features come back bit for bit.

use crate::base::Base;
use crate::base_complex::patches;
use crate::build::BaseOptions;
use crate::coarse;
use crate::density::Size;
use crate::error::LayoutError;
use crate::failure::RetopologizeError;
use crate::features::{Features, Network};
use crate::fidelity::followed;
use crate::input::{Placement, normalised};
use crate::keep::Kept;
use crate::output::{BasePath, FeatureKind, Output, OutputFeature, Report};
use crate::project::Project;
use crate::quads::{LayoutOptions, Quads, angle_deviation, quads_after};
use crate::session::{EditReport, Session};
use crate::sizing::scaled_area;
use crate::sources::{corner_sources, nearest_edges};
use crate::surfaces::Ground;
use crate::symmetry::Symmetry;
use crate::templates::{TemplateChoice, TemplatePlace, edges_at};
use mesh::{DVec3, Monitor, NONE, PolygonMesh, scaled_jacobian, sorted};
use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use surface::triangulate::{Triangulated, triangulate};

/// Most quads: what a scene can hold, and a slip of the edge length should not ask for.
const MOST_FACES: f64 = 4e6;
/// A result this far from its target is worth a word.
pub(crate) const NEAR_TARGET: f64 = 0.05;

/// Options of [`retopologize`].
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The base triangulation, detection of sharp edges among it.
    pub base: BaseOptions,
    /// The quads. `size` is in scene units, `density` has one value for each vertex of the mesh, or none.
    pub layout: LayoutOptions,
    /// A plane about which the result is exactly symmetric. Default: none.
    pub symmetry: Option<Symmetry>,
    /// Templates for pairs of base triangles, in place of those of `layout`. Default: none.
    pub templates: Vec<(TemplatePlace, TemplateChoice)>,
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
    Project::new(mesh.clone(), features, options, monitor)?.quads(monitor)
}

/// A mesh that goes through the pipeline, or the half of one.
#[derive(Debug)]
pub(crate) struct Workpiece {
    mesh: PolygonMesh,
    input: Triangulated,
    placement: Placement,
    /// In the unit box.
    layout: LayoutOptions,
    session: Session,
    /// What the last quads leave for the next.
    kept: RefCell<Option<Kept>>,
    /// Quads that were laid to find the coarsest layout, until they are asked for.
    ready: RefCell<Option<(Quads, Kept)>>,
}

impl Workpiece {
    /// Makes the base triangulation. `features` are all there are; detection has been done.
    pub fn new(
        mesh: PolygonMesh,
        (input, placement): (Triangulated, Placement),
        features: &Features,
        options: &Options,
        monitor: &Monitor,
    ) -> Result<Self, RetopologizeError> {
        let mut layout = unit_layout(&options.layout, &input, placement);
        let final_edge = edge_length(&input, &layout)?;
        let given = options.base.final_edge.map(|length| length / placement.scale);
        let base_options = BaseOptions {
            detect: None,
            final_edge: Some(given.unwrap_or(final_edge)),
            density: layout.density.clone(),
            ..options.base.clone()
        };
        let make = |base_options: &BaseOptions, monitor: &Monitor| {
            Session::new(input.mesh.clone(), features.clone(), base_options.clone(), monitor)
        };
        let (session, ready) = if layout.irregularity.is_finite() {
            (make(&base_options, monitor)?, None)
        } else {
            // The coarsest layout: bases are tried side by side, and the quads of the best one are kept.
            let tries = coarse::tries(&base_options, layout.lines);
            let done = AtomicUsize::new(0);
            let positions = &input.mesh.positions;
            let tried = |(base_options, lines): &(BaseOptions, bool)| -> Result<_, RetopologizeError> {
                let aside = monitor.aside();
                let session = make(base_options, &aside)?;
                let layout = LayoutOptions { lines: *lines, ..layout.clone() };
                let made = laid(&session, &Ground::new(session.base())?, &layout, None, &aside)?;
                let chains = input_chains(session.network(), positions.len());
                let score = coarse::score(&made.0, followed(&made.0, &chains, positions, &aside)?.share());
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                monitor.stage("trying layouts", done as f64 / tries.len() as f64)?;
                Ok((score, session, *lines, made))
            };
            monitor.stage("trying layouts", 0.0)?;
            let tried: Vec<_> = tries.par_iter().map(tried).collect::<Result<_, _>>()?;
            let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            let (_, session, lines, made) = best.ok_or_else(|| RetopologizeError::bug("no base was tried"))?;
            layout.lines = lines;
            (session, Some(made))
        };
        Ok(Self { mesh, input, placement, layout, session, kept: RefCell::default(), ready: RefCell::new(ready) })
    }

    /// Changes the features; only the base triangles about them are made anew where that is possible.
    pub fn set_features(&mut self, features: &Features, monitor: &Monitor) -> Result<EditReport, RetopologizeError> {
        self.ready.take();
        Ok(self.session.set_features(features, monitor)?)
    }

    /// The surface as triangles, in the unit box.
    pub fn input(&self) -> &Triangulated {
        &self.input
    }

    /// The base triangulation, with its features.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The base triangulation as a mesh, and its edges on the surface; scene units.
    pub fn base(&self) -> Result<(PolygonMesh, Vec<BasePath>), RetopologizeError> {
        let base = self.session.base();
        Ok((base_mesh(base, &self.mesh, self.placement)?, base_paths(base, self.placement)))
    }

    /// The quads. `kinds` are those of edges that are no mere border; features at edges of `cut` are not measured.
    pub fn quads(
        &self,
        kinds: &BTreeMap<[u32; 2], FeatureKind>,
        cut: &BTreeSet<[u32; 2]>,
        templates: &[(TemplatePlace, TemplateChoice)],
        tuning: Tuning,
        clock: &mut Clock,
        monitor: &Monitor,
    ) -> Result<Output, RetopologizeError> {
        let (base, network) = (self.session.base(), self.session.network());
        let ground = Ground::new(base)?;
        clock.lap("charts");
        let in_box = |place: TemplatePlace| match place {
            TemplatePlace::Point(point) => TemplatePlace::Point(self.placement.to_working(point)),
            edge @ TemplatePlace::Edge(_) => edge,
        };
        let places: Vec<_> = templates.iter().map(|(place, choice)| (in_box(*place), choice.clone())).collect();
        let templates = edges_at(base, &ground.measures, &places).map_err(LayoutError::from)?;
        let rounds = tuning.rounds.unwrap_or(self.layout.rounds);
        let size = match self.layout.size {
            Size::TargetFaces(faces) => Size::TargetFaces((faces as f64 * tuning.growth).round() as usize),
            Size::EdgeLength(length) => Size::EdgeLength(length / tuning.growth.sqrt()),
        };
        let improve = self.layout.improve && tuning.rounds.is_none();
        let layout = LayoutOptions { size, templates, rounds, improve, ..self.layout.clone() };
        let last = if tuning.is_plain() { self.kept.take() } else { None };
        let ready = self.ready.take().filter(|_| tuning.is_plain() && layout.templates.is_empty());
        let (quads, kept) = if let Some(ready) = ready {
            ready
        } else {
            monitor.within(0.0, 0.9, || laid(&self.session, &ground, &layout, last.as_ref(), monitor))?
        };
        if tuning.rounds.is_none() {
            self.kept.replace(Some(kept).filter(|_| layout.templates.is_empty()));
        }
        clock.add(&quads.report.seconds);

        monitor.stage("tracing attributes", 0.9)?;
        let positions = &self.input.mesh.positions;
        let corner_source = corner_sources(&self.input, &ground, &quads);
        let chains = input_chains(network, positions.len());
        let under = nearest_edges(&quads, &chains, positions, monitor)?;
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
                kind: kind_of(kinds, input_edge),
                input_edge,
            })
            .collect();
        clock.lap("attributes");

        monitor.stage("measuring", 0.97)?;
        let mut report = measure(&self.session, &quads, self.placement);
        let measured: Vec<Vec<[u32; 2]>> = chains
            .iter()
            .map(|chain| chain.iter().filter(|edge| !cut.contains(&sorted(edge[0], edge[1]))).copied().collect())
            .collect();
        let mut followed = followed(&quads, &measured, positions, monitor)?;
        let length = |[a, b]: &[u32; 2]| positions[*a as usize].distance(positions[*b as usize]);
        followed.length += self.session.dropped().iter().map(length).sum::<f64>();
        report.feature_length = followed.length * self.placement.scale;
        report.features_reproduced = followed.share();
        clock.lap("measure");
        let (base_mesh, base_paths) = self.base()?;
        Ok(Output {
            base: base_mesh,
            base_paths,
            mesh: in_scene(&quads, base, &self.mesh, self.placement),
            feature_edges,
            corner_source,
            mirror: vec![],
            report,
        })
    }
}

/// Quads over the base of a session, and what the next can keep of them, as these can of the last.
fn laid(
    session: &Session,
    ground: &Ground<'_>,
    layout: &LayoutOptions,
    last: Option<&Kept>,
    monitor: &Monitor,
) -> Result<(Quads, Kept), RetopologizeError> {
    let (base, network) = (session.base(), session.network());
    // Marked vertices, and the corners that the caller's angle makes.
    let stays = |v: &u32| network.corners.binary_search(v).is_ok() || network.points.binary_search(v).is_ok();
    let fixed = (0..).zip(&base.vertices).filter(|(_, v)| stays(v)).map(|(k, _)| k).collect();
    let layout = LayoutOptions { fixed, ..layout.clone() };
    Ok(quads_after(ground, session.names(), &layout, last, monitor)?)
}

/// What one call for quads has otherwise than the options say.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tuning {
    /// Rounds of optimisation; none for those of the options.
    pub rounds: Option<usize>,
    /// How many times as many quads.
    pub growth: f64,
}

impl Tuning {
    /// Nothing is otherwise.
    fn is_plain(self) -> bool {
        self.rounds.is_none() && self.growth <= 1.0
    }
}

/// Why an edge is a feature.
pub(crate) fn kind_of(kinds: &BTreeMap<[u32; 2], FeatureKind>, edge: [u32; 2]) -> FeatureKind {
    kinds.get(&sorted(edge[0], edge[1])).copied().unwrap_or(FeatureKind::Border)
}

/// The layout options in the unit box, with a density at every vertex of the triangles.
fn unit_layout(given: &LayoutOptions, input: &Triangulated, placement: Placement) -> LayoutOptions {
    let mut layout = given.clone();
    layout.density = input.spread(&given.density);
    if let Size::EdgeLength(length) = &mut layout.size {
        *length /= placement.scale;
    }
    layout
}

/// Seconds by stage.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    last: Instant,
    seconds: BTreeMap<String, f64>,
}

impl Clock {
    pub fn new() -> Self {
        Self { last: Instant::now(), seconds: BTreeMap::new() }
    }

    /// Goes on from here, with all that is booked.
    pub fn resumed(&self) -> Self {
        Self { last: Instant::now(), ..self.clone() }
    }

    pub fn seconds(self) -> BTreeMap<String, f64> {
        self.seconds
    }

    /// Books the time since the last lap to a stage.
    pub fn lap(&mut self, stage: &str) {
        *self.seconds.entry(stage.to_owned()).or_default() += self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
    }

    /// Takes over the stages of a part that kept its own time.
    pub fn add(&mut self, stages: &[(&'static str, f64)]) {
        for (stage, seconds) in stages {
            *self.seconds.entry((*stage).to_owned()).or_default() += seconds;
        }
        self.last = Instant::now();
    }
}

/// The mesh as triangles in the unit box, and where that lies in the scene.
pub(crate) fn at_unit_size(mesh: &PolygonMesh) -> (Triangulated, Placement) {
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
    let area = scaled_area(&input.mesh, |v| layout.density.get(v as usize).copied().unwrap_or(1.0));
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
fn input_chains(network: &Network, count: usize) -> Vec<Vec<[u32; 2]>> {
    let edges = |chain: &crate::features::Chain| {
        let own: Vec<u32> = chain.walk().filter(|&v| (v as usize) < count).collect();
        own.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    };
    network.chains.iter().map(edges).collect()
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
fn measure(session: &Session, quads: &Quads, placement: Placement) -> Report {
    let corners = |f: usize| {
        let face = quads.mesh.face(f);
        [face[0], face[1], face[2], face[3]].map(|v| quads.mesh.positions[v as usize])
    };
    let shapes: Vec<(f64, f64)> = (0..quads.mesh.face_count())
        .into_par_iter()
        .map(|f| {
            let p = corners(f);
            (scaled_jacobian(p), angle_deviation(p))
        })
        .collect();
    let mut jacobians: Vec<f64> = shapes.iter().map(|shape| shape.0).collect();
    jacobians.sort_by(f64::total_cmp);
    let count = jacobians.len().max(1);
    let at = |k: usize| jacobians.get(k).copied().unwrap_or(0.0);
    let (base, network, layout) = (session.base(), session.network(), &quads.report);
    Report {
        faces: layout.faces,
        target: layout.target,
        edge_length: layout.edge_length * placement.scale,
        base_vertices: base.vertices.len(),
        base_triangles: base.triangles.len(),
        sites_added: sites(base, network),
        patches: layout.patches,
        patches_kept: layout.patches_kept,
        single_patches: layout.singles,
        base_complex: patches(&quads.mesh),
        irregular_vertices: layout.irregular,
        inverted: layout.inverted,
        scaled_jacobian_min: at(0),
        scaled_jacobian_p01: at(count / 100),
        scaled_jacobian_mean: jacobians.iter().sum::<f64>() / count as f64,
        angle_deviation: shapes.iter().map(|shape| shape.1).sum::<f64>() / count as f64,
        chains: network.chains.len(),
        edges_dropped: session.dropped().len(),
        ..Report::default()
    }
}

/// Base vertices on no feature and not marked.
fn sites(base: &Base, network: &Network) -> usize {
    let mut asked: Vec<bool> = base.vertices.iter().map(|v| network.points.binary_search(v).is_ok()).collect();
    for edge in base.edges.iter().filter(|edge| edge.feature.is_some()) {
        edge.ends.iter().for_each(|&v| asked[v as usize] = true);
    }
    asked.iter().filter(|asked| !**asked).count()
}

pub(crate) fn warnings(report: &Report) -> Vec<String> {
    let mut said = Vec::new();
    if report.inverted > 0 {
        let quads = if report.inverted == 1 { "1 quad is" } else { &format!("{} quads are", report.inverted) };
        said.push(format!("{quads} turned over: the surface leaves no room there for quads of this size"));
    }
    if let Some(target) = report.target
        && (report.faces as f64 / target as f64 - 1.0).abs() > NEAR_TARGET
    {
        let why = if report.faces > target {
            "the features need so many"
        } else {
            "quads without room were replaced by fewer, or long rows of them leave no number in between"
        };
        said.push(format!("{} quads instead of {target}: {why}", report.faces));
    }
    if report.edges_dropped > 0 {
        let edges = if report.edges_dropped == 1 { "1 edge" } else { &format!("{} edges", report.edges_dropped) };
        said.push(format!(
            "{edges} of features too short or too close to others for quads of this size were left out: make the quads smaller"
        ));
    }
    said
}
