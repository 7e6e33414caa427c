//! `quadloom.panel_schedule` and `quadloom.Schedule`.

use crate::arrays;
use crate::errors::{self, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::worker;
use ::tiling::schedule::{Format, Schedule as Inner, ScheduleError, ScheduleOptions, SheetOptions, Table};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;

/// Adds the function and the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Schedule>()?;
    module.add_function(wrap_pyfunction!(panel_schedule, module)?)
}

/// A mesh of triangles and quads as a list of parts: panels, their types, nodes and edges. Ids are indices of faces and
/// vertices. Lengths are in scene units.
#[pyclass(frozen, module = "quadloom")]
pub struct Schedule {
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

    /// (F,) float64: the distance between the diagonals, twice the `deviation`, over their mean length; 0 for triangles.
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
        py.detach(move || inner.to_json()).map_err(|error| to_exception(py, &error))
    }

    /// Reads what `to_json` wrote. Raises `QuadloomError` with the code "text" when the text is no schedule.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        py.detach(|| Inner::from_json(text)).map(Self::from).map_err(|error| to_exception(py, &error))
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
        py.detach(move || inner.to_csv(table)).map_err(|error| to_exception(py, &error))
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
            .map_err(|error| to_exception(py, &error))
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
    made.map(Schedule::from).map_err(|error| to_exception(py, &error))
}

/// The exception for what went wrong with a schedule.
pub fn to_exception(py: Python<'_>, error: &ScheduleError) -> PyErr {
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
