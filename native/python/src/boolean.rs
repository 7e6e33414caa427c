//! `quadloom.boolean` and its result.

use crate::arrays;
use crate::errors::{self, InfeasibleError, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::worker;
use ::boolean::{BooleanError, CornerSource, Elements, Filler, Layout, Operation, Options, Output, Regroup};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;

/// What `boolean` returns.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct BooleanResult {
    /// The result, every face a quad.
    mesh: Py<Mesh>,
    /// (F, 2) int32: the input mesh (0 or 1) and the face of it that each face is; (-1, -1) when new.
    face_source: Py<PyArray2<i32>>,
    /// Where each corner's attributes come from.
    corner_source: Py<CornerSources>,
    /// (E, 2) int32: edges of `mesh` on the intersection curve, as vertex pairs.
    intersection_edges: Py<PyArray2<i32>>,
    /// What was done: counts, seconds a stage, warnings.
    report: Py<PyAny>,
}

/// Where each of the C corners of a result takes its attributes from: a point of an input's face.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct CornerSources {
    /// (C,) int32: input mesh, 0 or 1.
    mesh: Py<PyArray1<i32>>,
    /// (C,) int32: face of that mesh.
    face: Py<PyArray1<i32>>,
    /// (C, 4) float64: weights of that face's four corners, in their order; each row sums to 1.
    weights: Py<PyArray2<f64>>,
}

/// Union, intersection or difference (A without B) of two closed, manifold, pure-quad meshes, as a pure-quad mesh that
/// keeps every quad the cut does not come near, vertex for vertex.
///
/// operation: "union", "intersection" or "difference".
/// retraction_distance: quads nearer to the intersection curve than this are remade; edge lengths, 0 to 10.
/// alpha: even edge lengths (towards 0) or regular patches (towards 1); between 0 and 1, both excluded.
/// blend_radius: smooth the surface within this distance of the curve; scene units, 0 keeps the curve sharp.
/// layout: "motorcycle" (fewer patches) or "separatrices" (no T-junctions): how the inputs are divided at the start.
/// regroup: "rows" or "rectangles": how the quads that survive are regrouped; "rectangles" is the paper's rule.
/// filler: "auto", "patches", "rings" or "matching": who meshes the band along the curve; "auto" takes the best.
/// sharp_angle: edges bent by more than this become edge loops of the band; radians, 0 to pi.
/// feature_edges: a pair, for A and B, of (E, 2) vertex pairs that become edge loops of the band whatever their angle.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `InvalidMeshError` (open, non-manifold, not all quads ...), `InfeasibleError` (nothing left, or no valid mesh
/// of some region), `Cancelled`, or `QuadloomError` when an option is out of range.
///
/// The interpreter is released throughout. Same input, same bytes out. Time grows with F log F, and with the length of
/// the curve. After S. Nuvoli et al., QuadMixer, ACM TOG 38(6), 2019.
#[pyfunction(name = "boolean")]
#[pyo3(signature = (
    a, b, operation = "union", *, retraction_distance = 1.0, alpha = 0.5, blend_radius = 0.0, layout = "motorcycle",
    regroup = "rows", filler = "auto", sharp_angle = 0.610_865_238_198_015_3, feature_edges = None, progress = None
))]
// One Python keyword each: the signature is the interface.
#[allow(clippy::too_many_arguments)]
pub fn boolean_of_meshes(
    py: Python<'_>,
    a: &Bound<'_, Mesh>,
    b: &Bound<'_, Mesh>,
    operation: &str,
    retraction_distance: f64,
    alpha: f64,
    blend_radius: f64,
    layout: &str,
    regroup: &str,
    filler: &str,
    sharp_angle: f64,
    feature_edges: Option<(Bound<'_, PyAny>, Bound<'_, PyAny>)>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<BooleanResult> {
    let bad_option = |sentence| errors::raise_plain::<QuadloomError>(py, "option", sentence);
    let operations =
        [("union", Operation::Union), ("intersection", Operation::Intersection), ("difference", Operation::Difference)];
    let layouts = [("motorcycle", Layout::Motorcycle), ("separatrices", Layout::Separatrices)];
    let regroups = [("rows", Regroup::Rows), ("rectangles", Regroup::Rectangles)];
    let fillers = [
        ("auto", Filler::Auto),
        ("patches", Filler::Patches),
        ("rings", Filler::Rings),
        ("matching", Filler::Matching),
    ];
    let features = match feature_edges {
        None => [Vec::new(), Vec::new()],
        Some((of_a, of_b)) => [
            arrays::pairs(&of_a, "feature_edges[0]").map_err(bad_option)?,
            arrays::pairs(&of_b, "feature_edges[1]").map_err(bad_option)?,
        ],
    };
    let operation = choose("operation", operation, &operations).map_err(bad_option)?;
    let options = Options {
        retraction_distance,
        alpha,
        blend_radius,
        layout: choose("layout", layout, &layouts).map_err(bad_option)?,
        regroup: choose("regroup", regroup, &regroups).map_err(bad_option)?,
        filler: choose("filler", filler, &fillers).map_err(bad_option)?,
        sharp_angle,
        feature_edges: features,
    };
    let (a, b) = (Arc::clone(&a.get().inner), Arc::clone(&b.get().inner));
    let outcome =
        worker::run(py, progress.as_ref(), move |monitor| ::boolean::boolean(&a, &b, operation, &options, monitor))?;
    to_result(py, outcome.map_err(|error| to_exception(py, error))?)
}

fn choose<T: Copy>(option: &str, given: &str, choices: &[(&str, T)]) -> Result<T, String> {
    choices.iter().find(|(name, _)| *name == given).map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<&str> = choices.iter().map(|&(name, _)| name).collect();
        format!("{option} is \"{given}\"; it must be one of: {}", names.join(", "))
    })
}

fn to_result(py: Python<'_>, output: Output) -> PyResult<BooleanResult> {
    let report = serde_json::to_string(&output.report)
        .map_err(|cause| errors::raise_plain::<errors::InternalError>(py, "internal", cause.to_string()))?;
    Ok(BooleanResult {
        mesh: Py::new(py, Mesh::from(output.mesh))?,
        face_source: arrays::rows(py, &output.face_source)?.unbind(),
        corner_source: Py::new(py, corner_sources(py, &output.corner_source)?)?,
        intersection_edges: arrays::index_pairs(py, &output.intersection_edges)?.unbind(),
        report: py.import("json")?.call_method1("loads", (report,))?.unbind(),
    })
}

fn corner_sources(py: Python<'_>, sources: &[CornerSource]) -> PyResult<CornerSources> {
    let weights: Vec<[f64; 4]> = sources.iter().map(|source| source.weights).collect();
    Ok(CornerSources {
        mesh: PyArray1::from_iter(py, sources.iter().map(|source| i32::from(source.mesh))).unbind(),
        face: PyArray1::from_iter(py, sources.iter().map(|source| source.face as i32)).unbind(),
        weights: arrays::rows(py, &weights)?.unbind(),
    })
}

fn to_exception(py: Python<'_>, error: BooleanError) -> PyErr {
    let sentence = error.to_string();
    match error {
        BooleanError::Invalid { input, code, elements, .. } => {
            errors::raise::<InvalidMeshError>(py, code, sentence, Some(input), prefixed("", &elements))
        }
        BooleanError::Infeasible { code, elements: [of_a, of_b], .. } => {
            let elements = prefixed("a_", &of_a).chain(prefixed("b_", &of_b));
            errors::raise::<InfeasibleError>(py, code, sentence, None, elements)
        }
        BooleanError::Empty(_) => errors::raise_plain::<InfeasibleError>(py, "empty", sentence),
        BooleanError::Intersect(_) => errors::raise_plain::<InfeasibleError>(py, "intersect", sentence),
        BooleanError::Option(_) => errors::raise_plain::<QuadloomError>(py, "option", sentence),
        BooleanError::Cancelled(_) => worker::cancelled(py),
    }
}

fn prefixed<'a>(prefix: &'a str, elements: &'a Elements) -> impl Iterator<Item = (String, &'a [u32])> {
    elements.iter().map(move |(kind, indices)| (format!("{prefix}{kind}"), indices.as_slice()))
}
