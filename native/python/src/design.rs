//! `quadloom.PatchDesign`: the patches of a surface chosen by hand, or drawn.

use crate::arrays;
use crate::errors::{self, QuadloomError};
use crate::mesh::Mesh;
use crate::patch_graph::{PatchGraph, to_drawn};
use crate::surface::{Failure, SurfaceResult, to_result};
use crate::surface_options::{PanelKeywords, SurfaceKeywords};
use crate::worker;
use ::tiling::schedule::Schedule as Inner;
use ::tiling::{PanelSize, Partition, PolygonDesign, PolygonsError, Proposal};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;

/// Adds the classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PatchDesign>()?;
    module.add_class::<PatchPartition>()
}

/// A surface being divided into patches by hand: its parts, the ways to divide each, and the panels of what was chosen.
///
/// Without a graph it begins with the disks that the surface is cut into; a `patch_graph` is laid on the surface and is the
/// partition. A part of defect 0 is a patch. Immutable: dividing a part gives another design, so any step can be taken back.
///
/// The other arguments and errors are those of `tile_surface` with patches. Raises `InfeasibleError` for surfaces that cannot
/// be cut into flat disks ("`no_patches`"), and for graphs that are no partition (codes "`graph_far`", "`graph_apart`",
/// "`graph_open`", "`graph_not_flat`" and "`graph_not_closing`"; elements "nodes" and "sides" of the graph).
///
/// After C.-H. Peng et al., Designing patterns using triangle-quad hybrid meshes, ACM TOG 37(4), 2018, Algorithm 1.
#[pyclass(frozen, module = "quadloom")]
pub struct PatchDesign {
    inner: Arc<PolygonDesign>,
    size: PanelSize,
}

/// One way to divide a part of a `PatchDesign`.
#[pyclass(frozen, module = "quadloom")]
pub struct PatchPartition {
    inner: Arc<Proposal>,
    design: Arc<PolygonDesign>,
    part: usize,
}

#[pymethods]
impl PatchDesign {
    #[new]
    #[pyo3(signature = (
        mesh, edge_length = None, feature_edges = None, *, target_panels = 1000, patch_graph = None, corners = None,
        feature_angle = 0.872_664_625_997_164_8, corner_angle = std::f64::consts::FRAC_PI_6, progress = None
    ))]
    #[allow(clippy::too_many_arguments)] // One Python keyword each: the signature is the interface.
    fn new(
        py: Python<'_>,
        mesh: &Bound<'_, Mesh>,
        edge_length: Option<f64>,
        feature_edges: Option<Bound<'_, PyAny>>,
        target_panels: i64,
        patch_graph: Option<Bound<'_, PatchGraph>>,
        corners: Option<Bound<'_, PyAny>>,
        feature_angle: f64,
        corner_angle: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let bad_option = |sentence: String| errors::raise_plain::<QuadloomError>(py, "option", sentence);
        let keywords =
            SurfaceKeywords { edge_length, feature_edges, target_panels, corners, feature_angle, corner_angle };
        let mesh = Arc::clone(&mesh.get().inner);
        let (size, options) = keywords.options(mesh.vertex_count()).map_err(bad_option)?;
        let graph = patch_graph.map(|graph| to_drawn(&graph)).transpose().map_err(bad_option)?;
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            PolygonDesign::new(&mesh, size, graph.as_ref(), &options, monitor)
        })?;
        let inner = outcome.map_err(|error| Failure::from(error).to_exception(py))?;
        Ok(Self { inner: Arc::new(inner), size })
    }

    /// (P,) int32: the total interior defect of each part in units of 30 degrees; 0 of patches.
    #[getter]
    fn defects(&self, py: Python<'_>) -> Py<PyArray1<i32>> {
        PyArray1::from_vec(py, self.inner.defects()).unbind()
    }

    /// The parts as they are now: its patches are the parts, in their order, flat or not. None where two corners of a part
    /// fall together.
    #[getter]
    fn patch_graph(&self, py: Python<'_>) -> PyResult<Option<PatchGraph>> {
        self.inner.graph().map(|graph| PatchGraph::new(py, &graph, None)).transpose()
    }

    /// Length of the panels' edges, scene units, before a count of panels is met exactly.
    #[getter]
    fn edge_length(&self) -> f64 {
        self.inner.edge_length()
    }

    /// The admissible partitions of a part: none makes a part of greater defect. Those that divide the defect come first, then
    /// those that only cut flat parts off; each the best first. Deterministic.
    #[pyo3(signature = (part, *, progress = None))]
    fn partitions(
        &self,
        py: Python<'_>,
        part: i64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Vec<PatchPartition>> {
        let count = self.inner.defects().len();
        let Some(part) = usize::try_from(part).ok().filter(|&part| part < count) else {
            let sentence = format!("part is {part}, but it must lie between 0 and {}", count - 1);
            return Err(errors::raise_plain::<QuadloomError>(py, "option", sentence));
        };
        let design = Arc::clone(&self.inner);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| design.admissible_partitions(part, monitor))?;
        let found = outcome.map_err(|error: PolygonsError| Failure::from(error).to_exception(py))?;
        let bound = |inner| PatchPartition { inner: Arc::new(inner), design: Arc::clone(&self.inner), part };
        Ok(found.into_iter().map(bound).collect())
    }

    /// The design with a part divided; the parts made come last.
    ///
    /// Raises `QuadloomError` when the partition is one of another design.
    fn divided(&self, py: Python<'_>, partition: &Bound<'_, PatchPartition>) -> PyResult<Self> {
        let partition = partition.get();
        if !Arc::ptr_eq(&partition.design, &self.inner) {
            let sentence = "the partition belongs to another design; take one from this design's `partitions`";
            return Err(errors::raise_plain::<QuadloomError>(py, "option", sentence));
        }
        let inner = self.inner.divided(partition.part, &partition.inner);
        Ok(Self { inner: Arc::new(inner), size: self.size })
    }

    /// The panels: what `tile_surface` returns, with the arguments that it has in common. Parts that are no patches yet are
    /// divided automatically.
    ///
    /// Raises `InfeasibleError` "`no_lengths`" when that finds nothing, or no lengths of sides close all patches.
    #[pyo3(signature = (
        *, pattern = "regular", seed = 0, patch_panels = 40, shaping_rounds = 60, flattening_rounds = 15, closeness = 1.0,
        planarity = 0.0, fairness = 0.0, uniformity = 0.0, borders = "slide", features = "slide", type_tolerance = None, mirror = false, progress = None
    ))]
    #[allow(clippy::too_many_arguments)] // One Python keyword each.
    fn tile(
        &self,
        py: Python<'_>,
        pattern: &str,
        seed: u64,
        patch_panels: i64,
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
        let pattern = pattern.to_owned();
        let keywords = PanelKeywords {
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
        let (fill, shape, types) =
            keywords.options().map_err(|sentence| errors::raise_plain::<QuadloomError>(py, "option", sentence))?;
        let design = Arc::clone(&self.inner);
        let outcome = worker::run(py, progress.as_ref(), move |monitor| {
            let made = monitor.within(0.0, 0.9, || design.tile(fill, shape, monitor))?;
            let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.tiling.mesh, &types, monitor))?;
            Ok((made, schedule))
        })?;
        let (made, schedule) = outcome.map_err(|failure: Failure| failure.to_exception(py))?;
        to_result(py, self.size, Partition::Paper, made, schedule, types)
    }
}

#[pymethods]
impl PatchPartition {
    /// Lower is better: rounding errors of 30 degrees, gaps, bends, creases crossed and parts, summed.
    #[getter]
    fn score(&self) -> f64 {
        self.inner.score
    }

    /// (P,) int32: the total interior defect of each part made, in units of 30 degrees.
    #[getter]
    fn defects(&self, py: Python<'_>) -> Py<PyArray1<i32>> {
        PyArray1::from_slice(py, &self.inner.defects).unbind()
    }

    /// (C,) int32 for each part made: its c-indices, counter-clockwise.
    #[getter]
    fn c_indices(&self, py: Python<'_>) -> Vec<Py<PyArray1<i32>>> {
        let of_part = |part: &Vec<u8>| PyArray1::from_iter(py, part.iter().map(|&c| i32::from(c))).unbind();
        self.inner.c_indices.iter().map(of_part).collect()
    }

    /// (N, 3) float64 for each curve: its points on the surface, scene units.
    #[getter]
    fn curves(&self, py: Python<'_>) -> PyResult<Vec<Py<PyArray2<f64>>>> {
        let of_curve = |curve: &Vec<mesh::DVec3>| {
            let rows: Vec<[f64; 3]> = curve.iter().map(mesh::DVec3::to_array).collect();
            Ok(arrays::rows(py, &rows)?.unbind())
        };
        self.inner.curves.iter().map(of_curve).collect()
    }
}
