//! `quadloom.RetopologySession`: a retopology kept between edits of its features.

use crate::arrays;
use crate::errors::{self, QuadloomError};
use crate::mesh::Mesh;
use crate::retopology::{BaseTriangulation, RetopologyResult, to_exception, to_result};
use crate::retopology_options::{Keywords, places, to_features};
use crate::worker;
use ::retopology::RetopologizeError;
use ::retopology::features::Features;
use ::retopology::project::Project;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Adds the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<RetopologySession>()
}

/// A surface whose features are edited: what `retopologize` makes, kept from one edit to the next.
///
/// It is made with the arguments of `retopologize`, and costs the time to the base triangulation. Only `improve` is False by
/// default: it goes over the whole mesh, at the end of editing say. An edit makes anew only the base triangles about what
/// changes, where that is possible, and the next quads only those on and beside them: the result then depends on the order
/// of edits (the report's "base_triangles_edited" is not None, "patches_kept" is not 0), but keeps every promise. After an
/// error nothing has changed.
#[pyclass(frozen, module = "quadloom")]
pub struct RetopologySession {
    project: Arc<Mutex<Project>>,
}

#[pymethods]
impl RetopologySession {
    #[new]
    #[pyo3(signature = (
        mesh, feature_edges = None, feature_verts = None, target_faces = 4000, *, edge_length = None, density = None,
        detect = false, detect_angle = 0.698_131_700_797_731_8, detect_continue_angle = 0.436_332_312_998_582_4,
        detect_length = 0.04, corner_angle = 0.872_664_625_997_164_8, base_vertices = 100, coarseness = 0.5,
        pairing = "valence", improve = false, symmetry = None, symmetry_tolerance = 0.01, templates = None, catalogue = None,
        progress = None
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        mesh: &Bound<'_, Mesh>,
        feature_edges: Option<Bound<'_, PyAny>>,
        feature_verts: Option<Bound<'_, PyAny>>,
        target_faces: i64,
        edge_length: Option<f64>,
        density: Option<Bound<'_, PyAny>>,
        detect: bool,
        detect_angle: f64,
        detect_continue_angle: f64,
        detect_length: f64,
        corner_angle: f64,
        base_vertices: i64,
        coarseness: f64,
        pairing: &str,
        improve: bool,
        symmetry: Option<Bound<'_, PyAny>>,
        symmetry_tolerance: f64,
        templates: Option<Bound<'_, PyAny>>,
        catalogue: Option<String>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let keywords = Keywords {
            target_faces,
            edge_length,
            density,
            detect,
            detect_angle,
            detect_continue_angle,
            detect_length,
            corner_angle,
            base_vertices,
            coarseness,
            pairing: pairing.to_owned(),
            improve,
            symmetry,
            symmetry_tolerance,
            templates,
            catalogue,
        };
        let bad_option = |sentence: String| errors::raise_plain::<QuadloomError>(py, "option", sentence);
        let features = to_features(feature_edges, feature_verts).map_err(bad_option)?;
        let options = keywords.options().map_err(bad_option)?;
        let mesh = Arc::clone(&mesh.get().inner);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            Project::new((*mesh).clone(), &features, &options, monitor)
        })?;
        let project = outcome.map_err(|error| to_exception(py, error))?;
        Ok(Self { project: Arc::new(Mutex::new(project)) })
    }

    /// (E, 2) int32: the marked edges as they were given last.
    #[getter]
    fn feature_edges(&self, py: Python<'_>) -> PyResult<Py<PyArray2<i32>>> {
        Ok(arrays::index_pairs(py, &lock(&self.project).features().edges)?.unbind())
    }

    /// (N,) int32: the marked vertices as they were given last.
    #[getter]
    fn feature_verts(&self, py: Python<'_>) -> Py<PyArray1<i32>> {
        arrays::index_array(py, &lock(&self.project).features().vertices).unbind()
    }

    /// Makes these the features, in place of those before. Returns what was done: base triangles "removed" and "added", and
    /// whether the "whole" base was made anew.
    #[pyo3(signature = (feature_edges = None, feature_verts = None, *, progress = None))]
    fn set_features(
        &self,
        py: Python<'_>,
        feature_edges: Option<Bound<'_, PyAny>>,
        feature_verts: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyDict>> {
        let features = given_features(py, feature_edges, feature_verts)?;
        self.edit(py, progress, move |_| Ok(features))
    }

    /// Marks edges and vertices, each not marked yet. Returns what `set_features` does.
    #[pyo3(signature = (feature_edges = None, feature_verts = None, *, progress = None))]
    fn add_features(
        &self,
        py: Python<'_>,
        feature_edges: Option<Bound<'_, PyAny>>,
        feature_verts: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyDict>> {
        let features = given_features(py, feature_edges, feature_verts)?;
        self.edit(py, progress, move |marked| Ok(marked.with(&features)))
    }

    /// Takes marks away. Returns what `set_features` does.
    #[pyo3(signature = (feature_edges = None, feature_verts = None, *, progress = None))]
    fn remove_features(
        &self,
        py: Python<'_>,
        feature_edges: Option<Bound<'_, PyAny>>,
        feature_verts: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyDict>> {
        let features = given_features(py, feature_edges, feature_verts)?;
        self.edit(py, progress, move |marked| marked.without(&features))
    }

    /// Takes edges away and marks others, in one step. Returns what `set_features` does.
    #[pyo3(signature = (from_edges, to_edges, *, progress = None))]
    fn move_features(
        &self,
        py: Python<'_>,
        from_edges: Bound<'_, PyAny>,
        to_edges: Bound<'_, PyAny>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyDict>> {
        let (from, to) = (given_features(py, Some(from_edges), None)?, given_features(py, Some(to_edges), None)?);
        self.edit(py, progress, move |marked| Ok(marked.without(&from)?.with(&to)))
    }

    /// The base triangulation: of the kept half when there is a plane of symmetry.
    fn base(&self, py: Python<'_>) -> PyResult<BaseTriangulation> {
        let base = lock(&self.project).base();
        let (mesh, paths) = base.map_err(|error| to_exception(py, error))?;
        BaseTriangulation::new(py, mesh, &paths)
    }

    /// The quads: what `retopologize` returns. `templates` as there, in place of those before. A `draft` is for a first look:
    /// patches and counts are those of the result, but its vertices are hardly smoothed; it takes half the time.
    #[pyo3(signature = (*, templates = None, draft = false, progress = None))]
    fn quads(
        &self,
        py: Python<'_>,
        templates: Option<Bound<'_, PyAny>>,
        draft: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<RetopologyResult> {
        let templates = templates.map(|given| places(&given)).transpose();
        let templates = templates.map_err(|sentence| errors::raise_plain::<QuadloomError>(py, "option", sentence))?;
        let project = Arc::clone(&self.project);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            let mut project = lock(&project);
            if let Some(templates) = templates {
                project.set_templates(templates);
            }
            if draft { project.draft(monitor) } else { project.quads(monitor) }
        })?;
        to_result(py, outcome.map_err(|error| to_exception(py, error))?)
    }

    /// (V,) float64: the harmonic field of a feature at the vertices of the mesh, 0 to 1: 1 on these edges and vertices, 0 on
    /// all other features and base vertices.
    #[pyo3(signature = (feature_edges = None, feature_verts = None, *, progress = None))]
    fn field(
        &self,
        py: Python<'_>,
        feature_edges: Option<Bound<'_, PyAny>>,
        feature_verts: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyArray1<f64>>> {
        let feature = given_features(py, feature_edges, feature_verts)?;
        let project = Arc::clone(&self.project);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| lock(&project).field(&feature, monitor))?;
        Ok(PyArray1::from_vec(py, outcome.map_err(|error| to_exception(py, error))?).unbind())
    }
}

impl RetopologySession {
    fn edit(
        &self,
        py: Python<'_>,
        progress: Option<Bound<'_, PyAny>>,
        change: impl FnOnce(&Features) -> Result<Features, RetopologizeError> + Send + 'static,
    ) -> PyResult<Py<PyDict>> {
        let project = Arc::clone(&self.project);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            let mut project = lock(&project);
            let features = change(project.features())?;
            project.set_features(&features, monitor)
        })?;
        let done = outcome.map_err(|error| to_exception(py, error))?;
        let report = PyDict::new(py);
        report.set_item("removed", done.removed)?;
        report.set_item("added", done.added)?;
        report.set_item("whole", done.whole)?;
        Ok(report.unbind())
    }
}

/// A panic while it was held has reached the caller as an exception; what is left is as before the edit.
fn lock(project: &Mutex<Project>) -> MutexGuard<'_, Project> {
    project.lock().unwrap_or_else(PoisonError::into_inner)
}

fn given_features(
    py: Python<'_>,
    edges: Option<Bound<'_, PyAny>>,
    vertices: Option<Bound<'_, PyAny>>,
) -> PyResult<Features> {
    to_features(edges, vertices).map_err(|sentence| errors::raise_plain::<QuadloomError>(py, "option", sentence))
}
