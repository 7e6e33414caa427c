//! `quadloom.tile_surface`, `quadloom.panel_schedule` and what they return.

use crate::arrays;
use crate::errors::{self, InternalError, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::worker;
use ::tiling::schedule::{Format, Schedule as Inner, ScheduleError, ScheduleOptions, SheetOptions, Table};
use ::tiling::{
    Fill, PanelSize, PolygonsError, ShapeOptions, SurfaceError, SurfaceOptions, SurfaceTiling, tile_polygons,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A count of panels this far from the one asked for is worth a word: a factor, as its logarithm.
const NEAR_COUNT: f64 = 0.15;

/// Adds the functions and the classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<SurfaceResult>()?;
    module.add_class::<Schedule>()?;
    module.add_function(wrap_pyfunction!(tile_surface, module)?)?;
    module.add_function(wrap_pyfunction!(panel_schedule, module)?)
}

/// What `tile_surface` returns.
#[pyclass(frozen, get_all, module = "quadloom")]
struct SurfaceResult {
    /// The panels, triangles and quads, with the topology of the surface.
    mesh: Py<Mesh>,
    /// The panels measured and sorted into types, as `panel_schedule` does.
    panels: Py<Schedule>,
    /// Length of the edges asked for, scene units: shorter than `edge_length` where panels of that size had no room.
    edge_length: f64,
    /// (N,) int32: vertices whose angle defect is not zero, a triangle's corner counting 60 and a square's 90 degrees.
    irregular_verts: Py<PyArray1<i32>>,
    /// (N,) int32: their defects in units of 30 degrees; the sum is 12 times the Euler characteristic.
    defects: Py<PyArray1<i32>>,
    /// (N,) int32: panels with a corner that faces away from the surface: none but where no size had room.
    turned_faces: Py<PyArray1<i32>>,
    /// What was done: counts, quality, seconds a stage, warnings.
    report: Py<PyAny>,
}

/// Covers a surface by panels: triangles and quads that are near to equilateral triangles and squares of one edge length.
///
/// The surface may have triangles, quads and n-gons, open borders, any genus and any number of parts. The result has its
/// topology; its border runs on the surface's, and marked edges become chains of edges.
///
/// edge_length: of the panels, scene units, above 0; None for about `target_panels` panels.
/// feature_edges: (E, 2) vertex pairs, edges of faces that edges of panels follow; None for none.
/// target_panels: about how many panels, 1 to 2,000,000, when there is no edge_length.
/// pattern: "regular", as periodic as the surface allows, or "random", drawn anew patch by patch.
/// seed: of the random pattern; the same seed gives the same panels.
/// patch_panels: panels of a patch of the random pattern, 12 to 200: more of them leave fewer traces of the regular one.
/// feature_angle: edges between faces that turn by more than this are followed too; radians, 0 to pi, by default 50 degrees.
/// corner_angle: borders and followed lines keep a vertex where they turn by more; radians, 0 to pi, by default 30 degrees.
/// shaping_rounds: rounds that make panels regular, on the surface; 0 to 1000.
/// flattening_rounds: further rounds that make them flat, near the surface; 0 to 1000.
/// closeness: weight of nearness to the surface against regularity in the latter; 0.001 to 1000.
/// type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `InvalidMeshError` (no oriented surface, no area ...), `Cancelled`, or `QuadloomError` when a feature is no edge of
/// the surface (its element "features" is a position in the list) or an option is out of range.
///
/// The interpreter is released throughout. Same input, same bytes out. Time grows about linearly with the faces of input and
/// result. After C.-H. Peng et al., Designing patterns using triangle-quad hybrid meshes, ACM TOG 37(4), 2018, section 4.
#[pyfunction]
#[pyo3(signature = (
    mesh, edge_length = None, feature_edges = None, *, target_panels = 1000, pattern = "regular", seed = 0,
    patch_panels = 40, feature_angle = 0.872_664_625_997_164_8, corner_angle = 0.523_598_775_598_298_9,
    shaping_rounds = 60, flattening_rounds = 15, closeness = 1.0, type_tolerance = None, mirror = false, progress = None
))]
// One Python keyword each: the signature is the interface.
#[allow(clippy::too_many_arguments)]
fn tile_surface(
    py: Python<'_>,
    mesh: &Bound<'_, Mesh>,
    edge_length: Option<f64>,
    feature_edges: Option<Bound<'_, PyAny>>,
    target_panels: i64,
    pattern: &str,
    seed: u64,
    patch_panels: i64,
    feature_angle: f64,
    corner_angle: f64,
    shaping_rounds: i64,
    flattening_rounds: i64,
    closeness: f64,
    type_tolerance: Option<f64>,
    mirror: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<SurfaceResult> {
    let bad_option = |sentence: String| errors::raise_plain::<QuadloomError>(py, "option", sentence);
    let features = feature_edges.map_or(Ok(vec![]), |given| arrays::pairs(&given, "feature_edges"));
    let within = |name: &str, value: i64, range: std::ops::RangeInclusive<i64>| {
        if range.contains(&value) {
            return Ok(value);
        }
        Err(bad_option(format!("{name} is {value}, but it must lie between {} and {}", range.start(), range.end())))
    };
    let angle = |name: &str, value: f64| {
        if (0.0..=std::f64::consts::PI).contains(&value) {
            return Ok(value);
        }
        Err(bad_option(format!("{name} is {value}, but it must lie between 0 and pi")))
    };
    if !(1e-3..=1e3).contains(&closeness) {
        return Err(bad_option(format!("closeness is {closeness}, but it must lie between 0.001 and 1000")));
    }
    let fill = match pattern {
        "regular" => Fill::Regular,
        "random" => Fill::Random { seed, patch_panels: within("patch_panels", patch_panels, 12..=200)? as usize },
        _ => return Err(bad_option(format!("pattern is \"{pattern}\"; it must be one of: regular, random"))),
    };
    let size = match edge_length {
        Some(length) => PanelSize::EdgeLength(length),
        None => PanelSize::Count(within("target_panels", target_panels, 1..=2_000_000)? as u32),
    };
    let options = SurfaceOptions {
        marked_edges: features.map_err(bad_option)?,
        feature_angle: angle("feature_angle", feature_angle)?,
        corner_angle: angle("corner_angle", corner_angle)?,
        fill,
        shape: ShapeOptions {
            rounds: within("shaping_rounds", shaping_rounds, 0..=1000)? as usize,
            flattening_rounds: within("flattening_rounds", flattening_rounds, 0..=1000)? as usize,
            closeness,
        },
    };
    let types = ScheduleOptions { tolerance: type_tolerance, mirror };
    let mesh = Arc::clone(&mesh.get().inner);
    let outcome = worker::run(py, progress.as_ref(), move |monitor| {
        let made = monitor.within(0.0, 0.9, || tile_polygons(&mesh, size, &options, monitor))?;
        let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.mesh, &types, monitor))?;
        Ok((made, schedule))
    })?;
    let (made, schedule) = outcome.map_err(|failure: Failure| failure.to_exception(py))?;
    to_result(py, size, made, schedule)
}

/// Either half of the work may fail.
enum Failure {
    Tiling(PolygonsError),
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
    fn to_exception(&self, py: Python<'_>) -> PyErr {
        match self {
            Self::Tiling(error) => tiling_exception(py, error),
            Self::Schedule(error) => schedule_exception(py, error),
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
        SurfaceError::Cancelled(_) => worker::cancelled(py),
        // The mesh was looked at before.
        _ => errors::raise_plain::<InternalError>(py, "internal", format!("{sentence}; please report it with the mesh")),
    }
}

fn schedule_exception(py: Python<'_>, error: &ScheduleError) -> PyErr {
    let sentence = error.to_string();
    let invalid = |code: &str, kind: &str, elements: &[u32]| {
        errors::raise::<InvalidMeshError>(py, code, sentence.clone(), None, [(kind.to_owned(), elements)])
    };
    match error {
        ScheduleError::Empty => invalid("empty", "faces", &[]),
        ScheduleError::NotFinite(verts) => invalid("not_finite", "verts", verts),
        ScheduleError::Ngons(faces) => invalid("ngons", "faces", faces),
        ScheduleError::Degenerate(faces) => invalid("degenerate", "faces", faces),
        ScheduleError::NoArea(faces) => invalid("zero_area", "faces", faces),
        ScheduleError::Sheet { panels, .. } => {
            let elements = [("faces".to_owned(), panels.as_slice())];
            errors::raise::<QuadloomError>(py, "sheet", sentence, None, elements)
        }
        ScheduleError::Option(_) => errors::raise_plain::<QuadloomError>(py, "option", sentence),
        ScheduleError::Text(_) => errors::raise_plain::<QuadloomError>(py, "text", sentence),
        ScheduleError::Cancelled(_) => worker::cancelled(py),
    }
}

fn to_result(py: Python<'_>, asked: PanelSize, made: SurfaceTiling, schedule: Inner) -> PyResult<SurfaceResult> {
    let report = report(py, asked, &made, &schedule)?;
    Ok(SurfaceResult {
        edge_length: made.edge_length,
        irregular_verts: PyArray1::from_iter(py, made.defects.iter().map(|&(v, _)| v as i32)).unbind(),
        defects: PyArray1::from_iter(py, made.defects.iter().map(|&(_, defect)| defect)).unbind(),
        turned_faces: arrays::index_array(py, &made.turned).unbind(),
        mesh: Py::new(py, Mesh::from(made.mesh))?,
        panels: Py::new(py, Schedule::from(schedule))?,
        report: report.into_any().unbind(),
    })
}

fn report<'py>(
    py: Python<'py>,
    asked: PanelSize,
    made: &SurfaceTiling,
    schedule: &Inner,
) -> PyResult<Bound<'py, PyDict>> {
    let report = PyDict::new(py);
    let quads: Vec<f64> =
        schedule.panels.iter().filter(|panel| panel.nodes.len() == 4).map(|panel| panel.planarity).collect();
    let lengths = || schedule.edges.iter().map(|edge| edge.length);
    let count = schedule.edges.len() as f64;
    let mean = lengths().map(|length| length / count).sum::<f64>();
    let spread = lengths().map(|length| (length / mean - 1.0).powi(2)).sum::<f64>() / count;
    report.set_item("panels", schedule.panels.len())?;
    report.set_item("triangles", schedule.panels.len() - quads.len())?;
    report.set_item("quads", quads.len())?;
    report.set_item("types", schedule.types.len())?;
    report.set_item("edge_length", made.edge_length)?;
    report.set_item("edge_length_mean", mean)?;
    report.set_item("edge_length_spread", spread.sqrt())?;
    report.set_item("planarity_mean", quads.iter().sum::<f64>() / quads.len().max(1) as f64)?;
    report.set_item("planarity_max", quads.iter().copied().fold(0.0, f64::max))?;
    report.set_item("irregular_vertices", made.defects.len())?;
    report.set_item("interior_vertices", made.interior_vertices)?;
    report.set_item("patches", made.patches)?;
    report.set_item("changed_patches", made.changed_patches)?;
    let seconds: BTreeMap<&str, f64> = made.stages.iter().map(|(stage, time)| (*stage, time.as_secs_f64())).collect();
    report.set_item("seconds", seconds)?;
    let mut warnings = Vec::new();
    match asked {
        PanelSize::EdgeLength(length) if made.edge_length < length * (1.0 - 1e-9) => warnings.push(format!(
            "panels of the size asked for have no room on this surface; their edges are {:.4} long",
            made.edge_length
        )),
        PanelSize::Count(count) if (schedule.panels.len() as f64 / f64::from(count)).ln().abs() > NEAR_COUNT => warnings
            .push(format!(
                "{count} panels were asked for and {} made: borders and followed edges leave no other size",
                schedule.panels.len()
            )),
        _ => {}
    }
    if !made.turned.is_empty() {
        warnings.push(format!("{} panels are turned over; smaller panels may fit", made.turned.len()));
    }
    report.set_item("warnings", warnings)?;
    Ok(report)
}

/// A mesh of triangles and quads as a list of parts: panels, their types, nodes and edges. Ids are indices of faces and
/// vertices. Lengths are in scene units.
#[pyclass(frozen, module = "quadloom")]
struct Schedule {
    inner: Arc<Inner>,
}

impl From<Inner> for Schedule {
    fn from(inner: Inner) -> Self {
        Self { inner: Arc::new(inner) }
    }
}

impl Schedule {
    fn each<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&::tiling::schedule::PanelRow) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.inner.panels.iter().map(value))
    }
}

#[pymethods]
impl Schedule {
    /// No corner of a panel is further than this from where its type has it.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.inner.tolerance
    }

    /// Whether mirror images are one type.
    #[getter]
    fn mirror(&self) -> bool {
        self.inner.mirror
    }

    /// (F,) int32: the type of each panel, an index into `type_names`.
    #[getter]
    fn types<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        self.each(py, |panel| panel.kind as i32)
    }

    /// (F,) bool: whether a panel is the mirror image of its type.
    #[getter]
    fn mirrored<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.each(py, |panel| panel.mirrored)
    }

    /// (F,) float64: greatest distance of a corner from where the type has it.
    #[getter]
    fn misfit<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |panel| panel.misfit)
    }

    /// (F,) float64: areas, scene units squared; a quad's is that of its projection onto its best plane.
    #[getter]
    fn area<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |panel| panel.area)
    }

    /// (F,) float64: greatest distance of a corner from the plane nearest to all: of a quad half the distance of its diagonals.
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |panel| panel.deviation)
    }

    /// (F,) float64: `deviation` over the mean length of the diagonals; 0 for triangles.
    #[getter]
    fn planarity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |panel| panel.planarity)
    }

    /// Names of the types: T1, T2, ... of triangles, Q1, Q2, ... of quads, the frequent ones first.
    #[getter]
    fn type_names(&self) -> Vec<String> {
        self.inner.types.iter().map(|row| row.name.clone()).collect()
    }

    /// (T,) int32: how many panels each type has.
    #[getter]
    fn type_counts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        PyArray1::from_iter(py, self.inner.types.iter().map(|row| row.count as i32))
    }

    /// (T,) int32: the panel whose shape each type has.
    #[getter]
    fn type_models<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        PyArray1::from_iter(py, self.inner.types.iter().map(|row| row.model as i32))
    }

    /// (E, 2) int32: the edges, as pairs of nodes.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        let pairs: Vec<[u32; 2]> = self.inner.edges.iter().map(|edge| edge.nodes).collect();
        arrays::index_pairs(py, &pairs)
    }

    /// (E,) float64: their lengths.
    #[getter]
    fn edge_lengths<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.inner.edges.iter().map(|edge| edge.length))
    }

    /// (E,) int32: their classes of length, from the shortest; none differs from the middle of its class by more than
    /// `tolerance`.
    #[getter]
    fn edge_classes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        PyArray1::from_iter(py, self.inner.edges.iter().map(|edge| edge.class as i32))
    }

    /// All of it as JSON text, with every digit.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        let inner = Arc::clone(&self.inner);
        py.detach(move || inner.to_json()).map_err(|error| schedule_exception(py, &error))
    }

    /// Reads what `to_json` wrote. Raises `QuadloomError` with the code "text" when the text is no schedule.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        py.detach(|| Inner::from_json(text)).map(Self::from).map_err(|error| schedule_exception(py, &error))
    }

    /// One table as comma-separated values with a line of headings.
    ///
    /// table: "panels", "types", "nodes" or "edges".
    #[pyo3(signature = (table = "panels"))]
    fn to_csv(&self, py: Python<'_>, table: &str) -> PyResult<String> {
        let table = match table {
            "panels" => Table::Panels,
            "types" => Table::Types,
            "nodes" => Table::Nodes,
            "edges" => Table::Edges,
            _ => {
                let sentence = format!("table is \"{table}\"; it must be one of: panels, types, nodes, edges");
                return Err(errors::raise_plain::<QuadloomError>(py, "option", sentence));
            }
        };
        let inner = Arc::clone(&self.inner);
        py.detach(move || inner.to_csv(table)).map_err(|error| schedule_exception(py, &error))
    }

    /// All panels laid flat on sheets, as a drawing in millimetres: each on its best plane, as seen from outside, those of a
    /// type beside one another and turned alike. A panel carries its id and type, and along its edges its neighbours' ids.
    ///
    /// format: "svg", or "dxf" (AutoCAD 2000, layers CUT, LABEL and SHEET).
    /// sheet: width and height of a sheet, scene units, above 0; None for one sheet that is large enough.
    /// gap: free space round panels, scene units, 0 or more; None for a tenth of the mean edge length.
    /// millimetres: how many a scene unit has, above 0.
    /// labels: whether ids are written.
    /// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
    ///
    /// Raises `QuadloomError` for options out of range and panels larger than the sheet (code "sheet", elements "faces"), and
    /// `Cancelled`.
    #[pyo3(signature = (format = "svg", *, sheet = None, gap = None, millimetres = 1000.0, labels = true, progress = None))]
    // One Python keyword each: the signature is the interface.
    #[allow(clippy::too_many_arguments)]
    fn unrolled(
        &self,
        py: Python<'_>,
        format: &str,
        sheet: Option<[f64; 2]>,
        gap: Option<f64>,
        millimetres: f64,
        labels: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let format = match format {
            "svg" => Format::Svg,
            "dxf" => Format::Dxf,
            _ => {
                let sentence = format!("format is \"{format}\"; it must be one of: svg, dxf");
                return Err(errors::raise_plain::<QuadloomError>(py, "option", sentence));
            }
        };
        let options = SheetOptions { sheet, gap, millimetres, labels };
        let inner = Arc::clone(&self.inner);
        worker::run(py, progress.as_ref(), move |monitor| inner.unrolled(format, &options, monitor))?
            .map_err(|error| schedule_exception(py, &error))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.inner == other.inner
    }

    fn __len__(&self) -> usize {
        self.inner.panels.len()
    }

    fn __repr__(&self) -> String {
        format!("<Schedule: {} panels of {} types>", self.inner.panels.len(), self.inner.types.len())
    }
}

/// Measures the panels of a mesh of triangles and quads and sorts them into types that can be made alike.
///
/// mesh: any; faces may be open, non-manifold or apart.
/// tolerance: no corner of a panel is further than this from where its type has it, the two laid on their best planes, outside
/// up, and turned to one another; scene units, above 0; None for a hundredth of the mean edge length.
/// mirror: whether a panel and its mirror image are one type, as when panels may be turned over.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `InvalidMeshError` for faces with more than four corners, without area or with a vertex twice, and positions that are
/// no numbers; `QuadloomError` for a tolerance out of range, `Cancelled`. Time grows with the panels, times the types that are
/// nearly alike.
#[pyfunction]
#[pyo3(signature = (mesh, *, tolerance = None, mirror = false, progress = None))]
fn panel_schedule(
    py: Python<'_>,
    mesh: &Bound<'_, Mesh>,
    tolerance: Option<f64>,
    mirror: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Schedule> {
    let options = ScheduleOptions { tolerance, mirror };
    let mesh = Arc::clone(&mesh.get().inner);
    let made = worker::run(py, progress.as_ref(), move |monitor| Inner::of(&mesh, &options, monitor))?;
    made.map(Schedule::from).map_err(|error| schedule_exception(py, &error))
}
