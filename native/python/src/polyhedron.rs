//! `quadloom.tile_polyhedron` and its result.

use crate::errors::{self, QuadloomError};
use crate::mesh::Mesh;
use crate::patch_edit::Wish;
use crate::patch_graph::PatchGraph;
use crate::schedule::Schedule;
use crate::surface::Failure;
use crate::worker;
use ::tiling::schedule::{Schedule as Inner, ScheduleOptions};
use ::tiling::{Kind, PolygonsError, PolyhedronOptions, PolyhedronTiling, Zigzag};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Adds the function and the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PolyhedronResult>()?;
    module.add_function(wrap_pyfunction!(tile_polyhedron, module)?)
}

/// What `tile_polyhedron` returns.
#[pyclass(frozen, module = "quadloom")]
struct PolyhedronResult {
    /// The panels, triangles and quads, with the topology of the polyhedron.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    /// The panels measured and sorted into types, as `panel_schedule` does.
    #[pyo3(get)]
    panels: Py<Schedule>,
    /// A patch for each face of the polyhedron, in order.
    #[pyo3(get)]
    patch_graph: Py<PatchGraph>,
    /// (N,) int32: vertices whose angle defect is not zero, a triangle's corner counting 60 and a square's 90 degrees.
    #[pyo3(get)]
    irregular_verts: Py<PyArray1<i32>>,
    /// (N,) int32: their defects in units of 30 degrees; the sum is 12 times the Euler characteristic.
    #[pyo3(get)]
    defects: Py<PyArray1<i32>>,
    /// The greatest departure of an edge from the mean edge, and of a quad's diagonal from sqrt 2 of it; in edges.
    #[pyo3(get)]
    irregularity: f64,
    /// Whether that is below a millionth: all panels are equilateral triangles and squares.
    #[pyo3(get)]
    regular: bool,
    /// What was done: counts, patches that got other side lengths or rhombi, those edited.
    #[pyo3(get)]
    report: Py<PyAny>,
    made: Arc<PolyhedronTiling>,
    types: ScheduleOptions,
}

/// Turns a polyhedron into triangles and squares: each face becomes a patch of them, and the whole is shaped to be as regular as
/// its combinatorics allow, without regard to the faces' shape. Where a mesh of equilateral triangles and squares is near,
/// that is found to a millionth of an edge, as for Conway's bD; its vertices are then no longer in the polyhedron's faces.
///
/// The faces may have any number of corners; the mesh may be open, of any genus and in parts, but must be an oriented
/// manifold. A face's corners get c-indices, multiples of 30 degrees, near to their angles.
///
/// edge_length: of the panels, scene units, above 0; None for the mean length of the polyhedron's edges.
/// cones: whether faces whose angles leave 30 or 60 degrees, as a decagon's or a pentagon's, keep that at a point inside.
/// seed: which of the tilings of the faces.
/// rounds: of shaping, 0 to 10000; 0 leaves the faces as flat as they were.
/// type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `InvalidMeshError` (no oriented surface ...); `InfeasibleError` with the code "no_c_indices" (`elements["faces"]`: faces
/// whose corners cannot be multiples of 30 degrees) or "no_lengths" (no side lengths near to these close all faces);
/// `QuadloomError` when an option is out of range; `Cancelled`. Costs one integer programme over the edges. After C.-H. Peng
/// et al., Designing patterns using triangle-quad hybrid meshes, ACM TOG 37(4), 2018, section 5.1, Fig. 14.
#[pyfunction]
#[pyo3(signature = (
    mesh, edge_length = None, *, cones = true, seed = 0, rounds = 400, type_tolerance = None, mirror = false, progress = None
))]
#[allow(clippy::too_many_arguments)]
fn tile_polyhedron(
    py: Python<'_>,
    mesh: &Bound<'_, Mesh>,
    edge_length: Option<f64>,
    cones: bool,
    seed: u64,
    rounds: i64,
    type_tolerance: Option<f64>,
    mirror: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PolyhedronResult> {
    let rounds = rounds_within(py, rounds)?;
    let options = PolyhedronOptions { cones, seed, rounds };
    let types = ScheduleOptions { tolerance: type_tolerance, mirror };
    let mesh = Arc::clone(&mesh.get().inner);
    run(py, progress.as_ref(), types, move |monitor| ::tiling::tile_polyhedron(&mesh, edge_length, &options, monitor))
}

/// A number of rounds of shaping.
pub fn rounds_within(py: Python<'_>, rounds: i64) -> PyResult<usize> {
    usize::try_from(rounds).ok().filter(|&rounds| rounds <= 10_000).ok_or_else(|| {
        let sentence = format!("rounds is {rounds}, but it must lie between 0 and 10000");
        errors::raise_plain::<QuadloomError>(py, "option", sentence)
    })
}

#[pymethods]
impl PolyhedronResult {
    /// The same polyhedron with a zigzag on a side of its patch graph. Arguments, report and errors as of
    /// `SurfaceResult.zigzag`.
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
        self.edited(py, wish.on_side(py, Some(&self.made.patch_graph), side)?, progress)
    }

    /// The same polyhedron with zigzags on all three sides of a patch, or on two opposite ones of four. Arguments, report and
    /// errors as of `SurfaceResult.zigzag_patch`.
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
        self.edited(py, wish.on_patch(py, Some(&self.made.patch_graph), patch, first)?, progress)
    }
}

impl PolyhedronResult {
    fn edited(&self, py: Python<'_>, zigzags: Vec<Zigzag>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Self> {
        let made = Arc::clone(&self.made);
        run(py, progress.as_ref(), self.types, move |monitor| {
            made.zigzag(&zigzags, monitor).map_err(PolygonsError::from)
        })
    }
}

/// Runs a job that makes a polyhedron, and measures its panels.
fn run(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    types: ScheduleOptions,
    job: impl FnOnce(&mesh::Monitor) -> Result<PolyhedronTiling, PolygonsError> + Send + 'static,
) -> PyResult<PolyhedronResult> {
    let outcome = worker::run(py, progress, move |monitor| {
        let made = monitor.within(0.0, 0.9, || job(monitor))?;
        let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.mesh, &types, monitor))?;
        Ok((made, schedule))
    })?;
    let (made, schedule) = outcome.map_err(|failure: Failure| failure.to_exception(py))?;
    let report = PyDict::new(py);
    let count = |kind: Kind| made.panels.iter().filter(|panel| panel.kind == kind).count();
    report.set_item("triangles", count(Kind::Triangle))?;
    report.set_item("squares", count(Kind::Square))?;
    report.set_item("rhombi", count(Kind::Rhombus))?;
    report.set_item("types", schedule.types.len())?;
    report.set_item("relengthened_patches", &made.relengthened_patches)?;
    report.set_item("patches_with_rhombi", &made.patches_with_rhombi)?;
    report.set_item("edited_sides", &made.edit.sides)?;
    report.set_item("edited_patches", &made.edit.patches)?;
    Ok(PolyhedronResult {
        mesh: Py::new(py, Mesh::from(made.mesh.clone()))?,
        panels: Py::new(py, Schedule::from(schedule))?,
        patch_graph: Py::new(py, PatchGraph::new(py, &made.patch_graph, Some(&made.patch_tiles))?)?,
        irregular_verts: PyArray1::from_iter(py, made.defects.iter().map(|&(v, _)| v as i32)).unbind(),
        defects: PyArray1::from_iter(py, made.defects.iter().map(|&(_, defect)| defect)).unbind(),
        irregularity: made.irregularity,
        regular: made.is_regular(),
        report: report.into_any().unbind(),
        made: Arc::new(made),
        types,
    })
}
