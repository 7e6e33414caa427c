//! `quadloom.tile_surface` and its result.

use crate::arrays;
use crate::errors::{self, InfeasibleError, InternalError, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::patch_edit::{self, Wish};
use crate::patch_graph::PatchGraph;
use crate::schedule::{self, Schedule};
use crate::surface_options::{PanelKeywords, SurfaceKeywords};
use crate::worker;
use ::tiling::schedule::{Schedule as Inner, ScheduleError, ScheduleOptions};
use ::tiling::{
    Bar, GraphFault, MissedBar, PanelSize, Partition, PolygonTiling, PolygonsError, SurfaceError, SurfaceOptions,
    Zigzag, tile_polygons,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A count of panels this far from the one asked for is worth a word: a factor, as its logarithm.
const NEAR_COUNT: f64 = 0.15;

/// Elements that a warning names; the report has them all.
const NAMED: usize = 5;

/// Adds the function and the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<SurfaceResult>()?;
    module.add_class::<PatchGraph>()?;
    module.add_function(wrap_pyfunction!(tile_surface, module)?)
}

/// What `tile_surface` returns.
#[pyclass(frozen, module = "quadloom")]
pub struct SurfaceResult {
    /// The panels, triangles and quads, with the topology of the surface.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    /// The panels measured and sorted into types, as `panel_schedule` does.
    #[pyo3(get)]
    panels: Py<Schedule>,
    /// Length of the edges asked for, scene units: shorter than `edge_length` where panels of that size had no room.
    #[pyo3(get)]
    edge_length: f64,
    /// (N,) int32: vertices whose angle defect is not zero, a triangle's corner counting 60 and a square's 90 degrees.
    #[pyo3(get)]
    irregular_verts: Py<PyArray1<i32>>,
    /// (N,) int32: their defects in units of 30 degrees; the sum is 12 times the Euler characteristic.
    #[pyo3(get)]
    defects: Py<PyArray1<i32>>,
    /// (N,) int32: panels with a corner that faces away from the surface: none but where no size had room.
    #[pyo3(get)]
    turned_faces: Py<PyArray1<i32>>,
    /// The patches of `partition="patches"`; None where none were asked for or found.
    #[pyo3(get)]
    patch_graph: Option<Py<PatchGraph>>,
    /// What was done: counts, quality, seconds a stage, warnings.
    #[pyo3(get)]
    report: Py<PyAny>,
    made: Arc<PolygonTiling>,
    types: ScheduleOptions,
}

#[pymethods]
impl SurfaceResult {
    /// The same surface with a zigzag on a side of its patch graph: edges that leave the side's direction by 30 degrees, so that
    /// where they begin and end there are c-indices of 5 and 7 and no irregular vertex. This result stays as it is.
    ///
    /// The side's end moves, so other sides must change, as little and as near as may be: the opposite side of a patch of
    /// four sides, all sides of one of three, and so on to the border or round. Only patches beside sides that changed get
    /// other panels (all with pattern="random"); sides and patches keep their indices. `report["edited_sides"]` and
    /// `report["edited_patches"]` say which; all vertices are shaped anew.
    ///
    /// side: index of a side of `patch_graph`.
    /// edges: how many turn, 1 to 100, to the left as the side runs; to the right when negative.
    /// pair: as many then turn to the other side, so that the side runs on in its direction.
    /// spread: they lie apart along the side instead of one after the other: a more fractured pattern.
    /// position: where along the side the middle is wished for, 0 to 1; elsewhere where only that has panels.
    /// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
    ///
    /// Raises `InfeasibleError` with the code "no_patches" (the panels are even), "zigzag_open" (nothing closes) or
    /// "zigzag_untileable" (a patch has no panels then: `elements["patches"]`), `elements["sides"]` being the side; `QuadloomError`
    /// when an option is out of range; `Cancelled`. After Peng et al. 2018, section 4.3, Fig. 13.
    #[pyo3(signature = (side, edges = 1, *, pair = false, spread = false, position = 0.5, progress = None))]
    #[allow(clippy::too_many_arguments)]
    fn zigzag(
        &self,
        py: Python<'_>,
        side: i64,
        edges: i32,
        pair: bool,
        spread: bool,
        position: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let wish = Wish { edges, pair, spread, position };
        self.edited(py, wish.on_side(py, self.made.tiling.patch_graph.as_ref(), side)?, progress)
    }

    /// The same surface with zigzags on all three sides of a patch (a triple), or on two opposite sides of one of four (a pair).
    ///
    /// patch: index of a patch of `patch_graph` with three or four corners that are not straight.
    /// first: of a patch of four sides, which two: the side that leaves its corner `first` (counting corners that are not
    ///     straight) and the one opposite.
    /// Others, results and errors as of `zigzag`, sides as they run round the patch counter-clockwise; "patch_sides" when it
    /// has more sides.
    #[pyo3(signature = (patch, edges = 1, *, first = 0, pair = false, spread = false, position = 0.5, progress = None))]
    #[allow(clippy::too_many_arguments)]
    fn zigzag_patch(
        &self,
        py: Python<'_>,
        patch: i64,
        edges: i32,
        first: usize,
        pair: bool,
        spread: bool,
        position: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let wish = Wish { edges, pair, spread, position };
        self.edited(py, wish.on_patch(py, self.made.tiling.patch_graph.as_ref(), patch, first)?, progress)
    }
}

impl SurfaceResult {
    fn edited(&self, py: Python<'_>, zigzags: Vec<Zigzag>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Self> {
        let (made, types) = (Arc::clone(&self.made), self.types);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            let made = monitor.within(0.0, 0.9, || made.zigzag(&zigzags, monitor)).map_err(PolygonsError::from)?;
            let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.tiling.mesh, &types, monitor))?;
            Ok((made, schedule))
        })?;
        let (made, schedule) = outcome.map_err(|failure: Failure| failure.to_exception(py))?;
        let size = PanelSize::EdgeLength(made.tiling.edge_length);
        to_result(py, size, Partition::Paper, made, schedule, types)
    }
}

/// Covers a surface by panels: triangles and quads that are near to equilateral triangles and squares of one edge length.
///
/// The surface may have triangles, quads and n-gons, open borders, any genus and any number of parts. The result has its
/// topology; its border runs on the surface's, and marked edges become chains of edges.
///
/// edge_length: of the panels, scene units, above 0; None for about `target_panels` panels.
/// feature_edges: (E, 2) vertex pairs, edges of faces that edges of panels follow; None for none.
/// target_panels: about how many panels, 1 to 2,000,000, when there is no edge_length. Where no size makes so many that are alike, flat and
///     near the surface, the nearest number that does is made, and a warning says so.
/// partition: "even" spreads irregular vertices evenly, by expanding a coarse triangulation, and always succeeds; "patches"
///     divides the surface into large patches that are flat in themselves, with irregular vertices where it curves, as the
///     paper does; where no such patches are found the report says so and the panels are even.
/// corners: (N, 2) ints, border vertices and their c-indices (interior angles in units of 30 degrees, 2 to 10), instead of
///     those nearest to their angles; for patches only. None for none.
/// pattern: "regular", as periodic as the surface allows; "fractured", both panels in every patch that allows it, with as many
///     butterflies as there can be; "symmetric", with as many symmetries as the outline of each patch allows; "random", drawn
///     from all tilings of each patch. With partition="even" fractured is random and symmetric is regular.
/// seed: of the pattern, unless it is regular; the same seed gives the same panels.
/// patch_panels: panels of a patch of the random pattern, 12 to 200: more of them leave fewer traces of the regular one.
/// feature_angle: edges between faces that turn by more than this are followed too; radians, 0 to pi, by default 50 degrees.
/// corner_angle: borders and followed lines keep a vertex where they turn by more; radians, 0 to pi, by default 30 degrees.
/// shaping_rounds: rounds that make panels regular, on the surface; 0 to 1000.
/// flattening_rounds: further rounds that make them flat, near the surface; 0 to 1000.
/// closeness: weight of nearness to the surface in the latter, as all weights against that of regularity, 1; 0.001 to 1000.
/// planarity: weight of flat quads in the latter; 0 to 1000.
/// fairness: weight in the latter of the curvature that the panels had on the surface, against wiggles; 0 to 1000.
/// uniformity: weight in all rounds of one length for all edges and one for all diagonals; 0 to 1000.
/// borders, features: "slide", so that vertices move along borders and along followed edges, or "keep" them at equal steps.
/// type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// `report["warnings"]` says in sentences what came out other than asked, or is hard to build; `report["missed_bars"]` has a dict for each
/// bar that is missed: "bar" (spread; planarity, as of the schedule; closeness, of the corners and the middle of each panel to the surface and
/// of its vertices to the panels; or lines), "measured", "allowed", and "elements", the indices of faces or vertices ("kind") that miss it by themselves, the worst
/// first. `report["taken_apart"]` has the vertices of the input where it touches itself: the panels are apart there, for a mesh that can
/// be built is a manifold, and `report["euler_characteristic"]` is that of the surface cut apart so. `report["narrow_faces"]` has the faces of the input where larger panels turned over, when smaller or
/// more of them were made than asked for.
///
/// Raises `InvalidMeshError` (no oriented surface, no area ...), `Cancelled`, or `QuadloomError` when a feature is no edge of
/// the surface (its element "features" is a position in the list) or an option is out of range.
///
/// The interpreter is released throughout. Same input, same bytes out. Time grows about linearly with the faces of input and
/// result. After C.-H. Peng et al., Designing patterns using triangle-quad hybrid meshes, ACM TOG 37(4), 2018, section 4.
#[pyfunction]
#[pyo3(signature = (
    mesh, edge_length = None, feature_edges = None, *, target_panels = 1000, partition = "even", corners = None,
    pattern = "regular", seed = 0, patch_panels = 40, feature_angle = 0.872_664_625_997_164_8, corner_angle = std::f64::consts::FRAC_PI_6,
    shaping_rounds = 60, flattening_rounds = 15, closeness = 1.0, planarity = 5.0, fairness = 0.0, uniformity = 0.0,
    borders = "slide", features = "slide", type_tolerance = None, mirror = false, progress = None
))]
// One Python keyword each: the signature is the interface.
#[allow(clippy::too_many_arguments)]
fn tile_surface(
    py: Python<'_>,
    mesh: &Bound<'_, Mesh>,
    edge_length: Option<f64>,
    feature_edges: Option<Bound<'_, PyAny>>,
    target_panels: i64,
    partition: &str,
    corners: Option<Bound<'_, PyAny>>,
    pattern: &str,
    seed: u64,
    patch_panels: i64,
    feature_angle: f64,
    corner_angle: f64,
    shaping_rounds: i64,
    flattening_rounds: i64,
    closeness: f64,
    planarity: f64,
    fairness: f64,
    uniformity: f64,
    borders: &str,
    features: &str,
    type_tolerance: Option<f64>,
    mirror: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<SurfaceResult> {
    let bad_option = |sentence: String| errors::raise_plain::<QuadloomError>(py, "option", sentence);
    let keywords = SurfaceKeywords { edge_length, feature_edges, target_panels, corners, feature_angle, corner_angle };
    let pattern = pattern.to_owned();
    let panels = PanelKeywords {
        pattern,
        seed,
        patch_panels,
        shaping_rounds,
        flattening_rounds,
        closeness,
        planarity,
        fairness,
        uniformity,
        borders: borders.to_owned(),
        features: features.to_owned(),
        type_tolerance,
        mirror,
    };
    let partition = match partition {
        "even" => Partition::Expansion,
        "patches" => Partition::Paper,
        _ => return Err(bad_option(format!("partition is \"{partition}\"; it must be one of: even, patches"))),
    };
    let mesh = Arc::clone(&mesh.get().inner);
    let (size, options) = keywords.options(mesh.vertex_count()).map_err(bad_option)?;
    let (fill, shape, types) = panels.options().map_err(bad_option)?;
    let options = SurfaceOptions { partition, fill, shape, ..options };
    let outcome = worker::run(py, progress.as_ref(), move |monitor| {
        let made = monitor.within(0.0, 0.9, || tile_polygons(&mesh, size, &options, monitor))?;
        let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.tiling.mesh, &types, monitor))?;
        Ok((made, schedule))
    })?;
    let (made, schedule) = outcome.map_err(|failure: Failure| failure.to_exception(py))?;
    to_result(py, size, partition, made, schedule, types)
}

/// Either half of the work may fail.
pub enum Failure {
    /// The panels cannot be made.
    Tiling(PolygonsError),
    /// The panels cannot be measured.
    Schedule(ScheduleError),
}

impl From<PolygonsError> for Failure {
    fn from(error: PolygonsError) -> Self {
        Self::Tiling(error)
    }
}

impl From<ScheduleError> for Failure {
    fn from(error: ScheduleError) -> Self {
        Self::Schedule(error)
    }
}

impl Failure {
    /// The exception for it.
    pub fn to_exception(&self, py: Python<'_>) -> PyErr {
        match self {
            Self::Tiling(error) => tiling_exception(py, error),
            Self::Schedule(error) => schedule::to_exception(py, error),
        }
    }
}

fn tiling_exception(py: Python<'_>, error: &PolygonsError) -> PyErr {
    let sentence = error.to_string();
    let error = match error {
        PolygonsError::Mesh(fault) => {
            let elements = [(fault.kind.to_owned(), fault.elements.as_slice())];
            return errors::raise::<InvalidMeshError>(py, fault.code, sentence, None, elements);
        }
        PolygonsError::NoPanels => return errors::raise_plain::<QuadloomError>(py, "option", sentence),
        PolygonsError::Surface(error) => error,
    };
    match error {
        SurfaceError::EdgeLength { .. } | SurfaceError::TooMany { .. } => {
            errors::raise_plain::<QuadloomError>(py, "option", sentence)
        }
        SurfaceError::NoSuchEdge { index } => {
            let at = [*index as u32];
            let elements = [("features".to_owned(), at.as_slice())];
            errors::raise::<QuadloomError>(py, "feature_not_edge", sentence, None, elements)
        }
        SurfaceError::Graph(fault) => {
            let elements = [("nodes", &fault.nodes), ("sides", &fault.sides)];
            let elements = elements.map(|(kind, indices)| (kind.to_owned(), indices.as_slice()));
            errors::raise::<InfeasibleError>(py, graph_code(fault.fault), sentence, None, elements)
        }
        SurfaceError::NoPartition => errors::raise_plain::<InfeasibleError>(py, "no_patches", sentence),
        SurfaceError::Cancelled(_) => worker::cancelled(py),
        SurfaceError::Polygons(error) => {
            let elements = [("faces".to_owned(), error.faces.as_slice())];
            errors::raise::<InfeasibleError>(py, "no_c_indices", sentence, None, elements)
        }
        SurfaceError::NoLengths => errors::raise_plain::<InfeasibleError>(py, "no_lengths", sentence),
        SurfaceError::Edit(error) => patch_edit::to_exception(py, error),
        // The mesh was looked at before.
        _ => {
            errors::raise_plain::<InternalError>(py, "internal", format!("{sentence}; please report it with the mesh"))
        }
    }
}

fn graph_code(fault: GraphFault) -> &'static str {
    match fault {
        GraphFault::Malformed => "graph_malformed",
        GraphFault::Far => "graph_far",
        GraphFault::Apart => "graph_apart",
        GraphFault::Open => "graph_open",
        GraphFault::NotFlat => "graph_not_flat",
        GraphFault::NotClosing => "graph_not_closing",
    }
}

/// The panels, measured, with a report.
pub fn to_result(
    py: Python<'_>,
    asked: PanelSize,
    partition: Partition,
    made: PolygonTiling,
    schedule: Inner,
    types: ScheduleOptions,
) -> PyResult<SurfaceResult> {
    let report = report(py, asked, partition, &made, &schedule)?;
    let all = Arc::new(made);
    let made = &all.tiling;
    let tiles = made.patch_tiles.as_ref();
    let graph = made.patch_graph.as_ref().map(|graph| Py::new(py, PatchGraph::new(py, graph, tiles)?)).transpose()?;
    Ok(SurfaceResult {
        edge_length: made.edge_length,
        irregular_verts: PyArray1::from_iter(py, made.defects.iter().map(|&(v, _)| v as i32)).unbind(),
        defects: PyArray1::from_iter(py, made.defects.iter().map(|&(_, defect)| defect)).unbind(),
        turned_faces: arrays::index_array(py, &made.turned).unbind(),
        mesh: Py::new(py, Mesh::from(made.mesh.clone()))?,
        panels: Py::new(py, Schedule::from(schedule))?,
        patch_graph: graph,
        report: report.into_any().unbind(),
        made: all,
        types,
    })
}

fn report<'py>(
    py: Python<'py>,
    asked: PanelSize,
    partition: Partition,
    made: &PolygonTiling,
    schedule: &Inner,
) -> PyResult<Bound<'py, PyDict>> {
    let summary = serde_json::to_string(&schedule.summary())
        .map_err(|cause| errors::raise_plain::<InternalError>(py, "internal", cause.to_string()))?;
    let report: Bound<'py, PyDict> = py.import("json")?.call_method1("loads", (summary,))?.extract()?;
    report.set_item("irregular_vertices", made.irregular_interior_vertices)?;
    let missed = made.tiling.missed_bars();
    let mut warnings = warnings(asked, partition, made);
    warnings.extend(missed.iter().map(missed_sentence));
    report.set_item("warnings", warnings)?;
    report.set_item("missed_bars", missed.iter().map(|bar| missed_item(py, bar)).collect::<PyResult<Vec<_>>>()?)?;
    report.set_item("taken_apart", &made.taken_apart)?;
    report.set_item("euler_characteristic", made.tiling.euler_characteristic())?;
    report.set_item("narrow_faces", &made.narrow)?;
    let made = &made.tiling;
    report.set_item("edge_length", made.edge_length)?;
    report.set_item("interior_vertices", made.interior_vertices)?;
    report.set_item("patches", made.patch_graph.as_ref().map(|graph| graph.patches.len()))?;
    report.set_item("patch_tilings", &made.tiling_counts)?;
    report.set_item("halfway_nodes", &made.halfway_nodes)?;
    report.set_item("relengthened_patches", &made.relengthened_patches)?;
    report.set_item("patches_with_rhombi", &made.patches_with_rhombi)?;
    report.set_item("edited_sides", &made.edit.sides)?;
    report.set_item("edited_patches", &made.edit.patches)?;
    report.set_item("filled_patches", made.patches)?;
    report.set_item("changed_patches", made.changed_patches)?;
    let seconds: BTreeMap<&str, f64> = made.stages.iter().map(|(stage, time)| (*stage, time.as_secs_f64())).collect();
    report.set_item("seconds", seconds)?;
    Ok(report)
}

/// A missed bar for programs: its name, what was measured and is allowed, the elements.
fn missed_item<'py>(py: Python<'py>, missed: &MissedBar) -> PyResult<Bound<'py, PyDict>> {
    let (name, kind) = match missed.bar {
        Bar::Spread => ("spread", "faces"),
        Bar::Planarity => ("planarity", "faces"),
        Bar::Closeness => ("closeness", "faces"),
        Bar::Lines => ("lines", "verts"),
        Bar::Borders => ("borders", "faces"),
    };
    let item = PyDict::new(py);
    item.set_item("bar", name)?;
    item.set_item("measured", missed.measured)?;
    item.set_item("allowed", missed.allowed)?;
    item.set_item("kind", kind)?;
    item.set_item("elements", &missed.elements)?;
    Ok(item)
}

/// A missed bar for people, with the worst elements and what to do.
fn missed_sentence(missed: &MissedBar) -> String {
    let (measured, allowed) = (100.0 * missed.measured, 100.0 * missed.allowed);
    let (what, kind, remedy) = match missed.bar {
        Bar::Spread => (
            format!("edge lengths vary by {measured:.1}% of their mean (at most {allowed:.0}% for like panels)"),
            "faces",
            "smaller panels, the other partition or more uniformity make them more equal",
        ),
        Bar::Planarity => (
            format!(
                "quads are bent by {measured:.2}% of their diagonals on average (at most {allowed:.0}% for flat panels)"
            ),
            "faces",
            "smaller panels, a pattern with more triangles or a larger planarity make them flatter",
        ),
        Bar::Closeness => (
            format!("panels leave the surface by {measured:.1}% of its size (at most {allowed:.0}%)"),
            "faces",
            "smaller panels or a larger closeness keep them nearer",
        ),
        Bar::Lines => (
            format!("the border or a followed line is missed by {measured:.0}% of an edge (at most {allowed:.0}%)"),
            "vertices",
            "smaller panels, or a larger corner angle where the line is jagged, make room",
        ),
        Bar::Borders => (
            format!("edges of the border are off the surface's by {measured:.0}% of an edge (at most {allowed:.0}%)"),
            "faces",
            "the border bends more there than panels of this size can follow, smaller panels are nearer",
        ),
    };
    let worst = if missed.elements.is_empty() {
        String::new()
    } else {
        format!("; worst at {kind} {}", named(&missed.elements))
    };
    format!("{what}{worst}: {remedy}")
}

/// The first of some elements, and how many more there are.
fn named(elements: &[u32]) -> String {
    let first: Vec<String> = elements.iter().take(NAMED).map(ToString::to_string).collect();
    let more = elements.len() - first.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    first.join(", ") + &more
}

fn warnings(asked: PanelSize, partition: Partition, made: &PolygonTiling) -> Vec<String> {
    let mut warnings = Vec::new();
    let touching = made.taken_apart.len();
    if touching > 0 {
        let vertices = if touching == 1 { "vertex" } else { "vertices" };
        warnings.push(format!(
            "the surface touches itself at {touching} {vertices} ({}); the panels are apart there",
            named(&made.taken_apart)
        ));
        warnings.push(format!(
            "cut apart there the surface has the Euler characteristic {}, which the panels keep",
            made.tiling.euler_characteristic()
        ));
    }
    let narrow = &made.narrow;
    let made = &made.tiling;
    let panels = made.mesh.face_count() as u32;
    let off = |count: u32| (f64::from(panels) / f64::from(count)).ln();
    let no_room = || {
        let faces = named(narrow);
        format!(
            "larger ones turn over at faces {faces} of the surface, which is too narrow or too curved there: widen it, or ask for smaller panels"
        )
    };
    match asked {
        PanelSize::EdgeLength(length) if made.edge_length < length * (1.0 - 1e-9) => warnings.push(format!(
            "panels of the size asked for have no room: their edges are {:.4} long; {}",
            made.edge_length,
            no_room()
        )),
        PanelSize::Count(count) if off(count) > NEAR_COUNT && !narrow.is_empty() => {
            warnings.push(format!("{count} panels were asked for and {panels} made; {}", no_room()));
        }
        PanelSize::Count(count) if off(count).abs() > NEAR_COUNT => warnings.push(format!(
            "{count} panels were asked for and {panels} made: the borders, followed edges and patches of this surface leave no \
             nearer number, or none with panels as equal and as flat; ask for another number, or for even panels"
        )),
        _ => {}
    }
    if partition == Partition::Paper && made.patch_graph.is_none() {
        let sentence = "no patches were found that close at this size with panels equal and flat enough: the panels are even instead";
        warnings.push(sentence.to_owned());
    }
    if !made.patches_with_rhombi.is_empty() {
        warnings.push(format!(
            "{} patches have no tiling without thin rhombi, and got some",
            made.patches_with_rhombi.len()
        ));
    }
    if !made.turned.is_empty() {
        warnings.push(format!("{} panels are turned over; smaller panels may fit", made.turned.len()));
    }
    warnings
}
