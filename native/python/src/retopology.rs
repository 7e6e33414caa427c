//! `quadloom.retopologize` and its result; see `session.rs` for edits, `retopology_options.rs` for the keywords.

use crate::arrays;
use crate::errors::{self, InternalError, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::retopology_options::{Keywords, to_features};
use crate::worker;
use ::retopology::failure::Elements;
use ::retopology::{BasePath, Catalogue, CornerSource, Output, RetopologizeError};
use mesh::{DVec3, NONE};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;

/// What `retopologize` returns.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct RetopologyResult {
    /// The result, every face a quad.
    mesh: Py<Mesh>,
    /// The base triangulation, with straight edges.
    base: Py<Mesh>,
    /// (B, 2) int32: the edges of `base`, as vertex pairs.
    base_edges: Py<PyArray2<i32>>,
    /// Those edges as they lie on the surface: a list of B (N, 3) float64 arrays of points, from first to second vertex.
    base_paths: Vec<Py<PyArray2<f64>>>,
    /// (B,) int32: the feature chain that each of `base_paths` lies on, -1 for none.
    base_chain: Py<PyArray1<i32>>,
    /// (V,) int32: the mirror image of each vertex of `mesh`, itself on the plane; None when no symmetry was asked for.
    mirror: Option<Py<PyArray1<i32>>>,
    /// (E, 2) int32: edges of `mesh` that lie on features, open borders among them, as vertex pairs.
    feature_edges: Py<PyArray2<i32>>,
    /// (E,) int32: the chain each of `feature_edges` belongs to; a chain runs from corner to corner.
    feature_chain: Py<PyArray1<i32>>,
    /// (E,) int32: why it is a feature: 0 marked, 1 detected, 2 an open border and nothing else.
    feature_kind: Py<PyArray1<i32>>,
    /// (E, 2) int32: the edge of the input under the middle of each of `feature_edges`, as a pair of the input's vertices.
    feature_source: Py<PyArray2<i32>>,
    /// Where each corner's attributes come from.
    corner_source: Py<CornerPoints>,
    /// What was done: counts, quality, seconds a stage, warnings.
    report: Py<PyAny>,
}

/// The base triangulation of a `RetopologySession`.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct BaseTriangulation {
    /// Straight triangles.
    mesh: Py<Mesh>,
    /// (B, 2) int32: its edges, as vertex pairs.
    edges: Py<PyArray2<i32>>,
    /// Those edges as they lie on the surface: a list of B (N, 3) float64 arrays of points, from first to second vertex.
    paths: Vec<Py<PyArray2<f64>>>,
    /// (B,) int32: the feature chain that each lies on, -1 for none.
    chain: Py<PyArray1<i32>>,
}

impl BaseTriangulation {
    pub(crate) fn new(py: Python<'_>, mesh: ::mesh::PolygonMesh, paths: &[BasePath]) -> PyResult<Self> {
        let path = |path: &BasePath| {
            let rows: Vec<[f64; 3]> = path.points.iter().map(DVec3::to_array).collect();
            Ok::<_, PyErr>(arrays::rows(py, &rows)?.unbind())
        };
        let chain = |chain: Option<u32>| chain.filter(|&c| c != NONE).map_or(-1, |c| c as i32);
        Ok(Self {
            mesh: Py::new(py, Mesh::from(mesh))?,
            edges: arrays::index_pairs(py, &paths.iter().map(|path| path.ends).collect::<Vec<_>>())?.unbind(),
            paths: paths.iter().map(path).collect::<PyResult<_>>()?,
            chain: PyArray1::from_iter(py, paths.iter().map(|path| chain(path.chain))).unbind(),
        })
    }
}

/// Where each of the C corners of a result takes its attributes from: a point of a face of the input, on the corner's own
/// side of every feature.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct CornerPoints {
    /// (C,) int32: face of the input.
    face: Py<PyArray1<i32>>,
    /// (C, 3) int32: three corners of that face, as indices into the input's `corner_verts`.
    corners: Py<PyArray2<i32>>,
    /// (C, 3) float64: weights of the three; none negative, each row sums to 1.
    weights: Py<PyArray2<f64>>,
}

/// Adds the function and its classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<RetopologyResult>()?;
    module.add_class::<CornerPoints>()?;
    module.add_class::<BaseTriangulation>()?;
    module.add_function(wrap_pyfunction!(template_catalogue, module)?)?;
    module.add_function(wrap_pyfunction!(retopologize, module)?)
}

/// An all-quad mesh of a surface in which marked edges are chains of edges and corners of features stay where they are.
///
/// The surface may have triangles, quads and n-gons, open borders, any genus and any number of parts. Open borders are
/// features without being marked. With few features or none, base vertices are added where an even layout needs them.
///
/// feature_edges: (E, 2) vertex pairs, edges of faces, each given once; None for none. What leaves no room for quads of the size
///     is left out and reported: parts shorter than half an edge, and where corners are more than one for ten quads the
///     shortest curves.
/// feature_verts: (N,) vertices that stay vertices where they are; None for none.
/// target_faces: how many quads, 1 to 4,000,000.
/// edge_length: longest edges where the density is 1, shorter where the surface bends, in place of target_faces; scene units.
/// density: (V,) how much denser the edges are round each vertex, above 0: edges are 1/density as long; None for 1.
/// detect: whether edges between faces that turn sharply are features as well.
/// detect_angle: detected curves start at edges turned by more than this; radians, 0 to pi, by default 40 degrees.
/// detect_continue_angle: they go on over edges turned by more than this; radians, 0 to detect_angle, by default 25 degrees.
/// detect_length: shorter ones are dropped; fraction of the bounding-box diagonal, 0 to 1.
/// corner_angle: features have a corner where they turn by more than this; radians, 0 to pi, by default 50 degrees.
/// base_vertices: vertices of an even base triangulation, 4 to 100,000; features add more where they need them.
/// coarseness: even edge lengths (0) or the coarsest layout, with the fewest patches (1); 0 to 1.
/// pairing: "valence" or "matching": how base triangles become patches; "matching" is the paper's rule.
/// improve: whether irregular vertices away from features are taken out by laying disks of quads anew; never where
///     coarseness is 1 or a template was chosen.
/// symmetry: the plane about which the result is exactly symmetric, by index: "x", "y" or "z" for the plane through the origin
///     across that axis, or (point, normal). The side that the normal points to decides.
/// symmetry_tolerance: how far mirror images of the surface, its marks and borders may be off; fraction of the bounding-box
///     diagonal, 0 or more, `inf` for anything.
/// templates: for pairs of base triangles, [(place, name)] or [(place, name, quarter turns)]: the place is a base edge (a number
///     of `base_edges`) or a point (x, y, z), which takes the pair nearest to it; the name is one of `template_catalogue()` or of
///     `catalogue`.
/// catalogue: templates of your own, the text of a JSON file; `template_catalogue()` is the one built in.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `InvalidMeshError` (no manifold with one side out, no area, not symmetric ...), `Cancelled`, or `QuadloomError` when
/// a feature is no edge of the surface (its elements "features" and "feature_verts" are positions in the lists given), marks
/// are not symmetric (its elements "edges" are vertex pairs), or an option is out of range.
///
/// The interpreter is released throughout. Same input, same bytes out. Time grows about linearly with the faces of input and
/// result. After J. Daniels et al., Template-based quadrilateral meshing, Computers & Graphics 35(3), 2011.
#[pyfunction]
#[pyo3(signature = (
    mesh, feature_edges = None, feature_verts = None, target_faces = 4000, *, edge_length = None, density = None,
    detect = false, detect_angle = 0.698_131_700_797_731_8, detect_continue_angle = 0.436_332_312_998_582_4,
    detect_length = 0.04, corner_angle = 0.872_664_625_997_164_8, base_vertices = 100, coarseness = 0.5,
    pairing = "valence", improve = true, symmetry = None, symmetry_tolerance = 0.01, templates = None, catalogue = None,
    progress = None
))]
// One Python keyword each: the signature is the interface.
#[allow(clippy::too_many_arguments)]
pub fn retopologize(
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
) -> PyResult<RetopologyResult> {
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
        ::retopology::retopologize(&mesh, &features, &options, monitor)
    })?;
    to_result(py, outcome.map_err(|error| to_exception(py, error))?)
}

/// The built-in templates as a JSON text: the form that `catalogue` has.
#[pyfunction]
pub fn template_catalogue(py: Python<'_>) -> PyResult<String> {
    let text = Catalogue::default().to_json();
    text.map_err(|error| errors::raise_plain::<InternalError>(py, "internal", error.to_string()))
}

pub(crate) fn to_result(py: Python<'_>, output: Output) -> PyResult<RetopologyResult> {
    let report = serde_json::to_string(&output.report)
        .map_err(|cause| errors::raise_plain::<InternalError>(py, "internal", cause.to_string()))?;
    let features = &output.feature_edges;
    let edges: Vec<[u32; 2]> = features.iter().map(|edge| edge.ends).collect();
    let sources: Vec<[u32; 2]> = features.iter().map(|edge| edge.input_edge).collect();
    let base = BaseTriangulation::new(py, output.base, &output.base_paths)?;
    Ok(RetopologyResult {
        mesh: Py::new(py, Mesh::from(output.mesh))?,
        base: base.mesh,
        base_edges: base.edges,
        base_paths: base.paths,
        base_chain: base.chain,
        mirror: (!output.mirror.is_empty()).then(|| arrays::index_array(py, &output.mirror).unbind()),
        feature_edges: arrays::index_pairs(py, &edges)?.unbind(),
        feature_chain: PyArray1::from_iter(py, features.iter().map(|edge| edge.chain as i32)).unbind(),
        feature_kind: PyArray1::from_iter(py, features.iter().map(|edge| edge.kind as i32)).unbind(),
        feature_source: arrays::index_pairs(py, &sources)?.unbind(),
        corner_source: Py::new(py, corner_points(py, &output.corner_source)?)?,
        report: py.import("json")?.call_method1("loads", (report,))?.unbind(),
    })
}

fn corner_points(py: Python<'_>, sources: &[CornerSource]) -> PyResult<CornerPoints> {
    let corners: Vec<[i32; 3]> = sources.iter().map(|source| source.corners.map(|c| c as i32)).collect();
    let weights: Vec<[f64; 3]> = sources.iter().map(|source| source.weights).collect();
    Ok(CornerPoints {
        face: PyArray1::from_iter(py, sources.iter().map(|source| source.face as i32)).unbind(),
        corners: arrays::rows(py, &corners)?.unbind(),
        weights: arrays::rows(py, &weights)?.unbind(),
    })
}

pub(crate) fn to_exception(py: Python<'_>, error: RetopologizeError) -> PyErr {
    let sentence = error.to_string();
    match error {
        RetopologizeError::Invalid { code, elements, .. } => {
            errors::raise::<InvalidMeshError>(py, code, sentence, None, named(&elements))
        }
        RetopologizeError::Feature { code, elements, .. } => {
            errors::raise::<QuadloomError>(py, code, sentence, None, named(&elements))
        }
        RetopologizeError::Option(_) => errors::raise_plain::<QuadloomError>(py, "option", in_keywords(&sentence)),
        RetopologizeError::Cancelled(_) => worker::cancelled(py),
        RetopologizeError::Internal { .. } => errors::raise_plain::<InternalError>(py, "internal", sentence),
    }
}

/// A sentence about an option of the crate, with the keyword's name.
fn in_keywords(sentence: &str) -> String {
    let keywords = [
        ("start_angle", "detect_angle"),
        ("continue_angle", "detect_continue_angle"),
        ("min_length", "detect_length"),
        ("vertices", "base_vertices"),
    ];
    keywords.iter().fold(sentence.to_owned(), |text, (field, keyword)| {
        text.replace(&format!("option {field} must"), &format!("option {keyword} must"))
            .replace(&format!("to {field}"), &format!("to {keyword}"))
    })
}

fn named(elements: &Elements) -> impl Iterator<Item = (String, &[u32])> {
    elements.iter().map(|(kind, indices)| ((*kind).to_owned(), indices.as_slice()))
}
