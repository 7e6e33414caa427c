//! `quadloom.fold_tiling` and its result.

use crate::arrays;
use crate::errors::{self, InfeasibleError, InvalidMeshError, QuadloomError};
use crate::mesh::Mesh;
use crate::polyhedron::rounds_within;
use crate::schedule::{self, Schedule};
use crate::worker;
use ::tiling::schedule::{Schedule as Inner, ScheduleError, ScheduleOptions};
use ::tiling::{FoldError, FoldOptions, Gluing, SurfaceError, fold};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// Adds the function and the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FoldResult>()?;
    module.add_function(wrap_pyfunction!(fold_tiling, module)?)
}

/// What `fold_tiling` returns.
#[pyclass(frozen, get_all, module = "quadloom")]
struct FoldResult {
    /// The folded sheet, in space.
    mesh: Py<Mesh>,
    /// The panels measured and sorted into types, as `panel_schedule` does: two types when it is regular.
    panels: Py<Schedule>,
    /// (F,) int32: the face of the tiling that each face was.
    face_source: Py<PyArray1<i32>>,
    /// (V,) int32: the vertex that each vertex of the tiling became; -1 where all faces at it were cut out.
    vert_target: Py<PyArray1<i32>>,
    /// (N,) int32: vertices whose angle defect is not zero.
    irregular_verts: Py<PyArray1<i32>>,
    /// (N,) int32: their defects in units of 30 degrees; the sum is 12 times the Euler characteristic.
    defects: Py<PyArray1<i32>>,
    /// The greatest departure of an edge from the mean edge, and of a square's diagonal from sqrt 2 of it; in edges.
    irregularity: f64,
    /// Whether that is below a millionth: all panels are equilateral triangles and squares.
    regular: bool,
}

/// Cuts parts out of a plane tiling, glues borders together and shapes what comes out into a regular mesh in space: equilateral
/// triangles and squares of one edge length.
///
/// mesh: of triangles and squares with one edge length, such as `Tiling.mesh`; it may be bent already.
/// cut: (N,) faces to cut out first; None for none.
/// glue: pairs of runs, each run a list of vertices along the border: vertex k of the first becomes vertex k of the second.
/// runs: (N, 4) vertices a, b, c, d: the border from a to b with faces on its left is glued to that from c to d with faces on its
///     right; a to c, b to d.
/// zips: (N, 2) a vertex and a number of edges: so many edges of the border to both sides of the vertex are glued.
/// rounds: of shaping, 0 to 10000; 0 leaves the first shape as it was found.
/// type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Gluings count from 0, those of `glue` first, then `runs`, then `zips`. All are made together, on the border that is there once
/// the faces are cut out. Where no regular mesh is found the nearest one is returned: see `irregularity`. Panels may pass through
/// one another: `check` tells.
///
/// Raises `InvalidMeshError` when the mesh is no such tiling (`elements["faces"]` or `["edges"]`); `InfeasibleError` with the code
/// "glue_lengths", "glue_orientation" (the sheet would have one side), "glue_border" (no vertex or edge of the border),
/// "glue_twice" or "glue_surface" (the glued sheet would be no manifold) and the vertices, edges and faces of the mesh
/// concerned; `QuadloomError` for other options; `Cancelled`. Costs O(n log n) and a few dozen sparse factorisations. After
/// C.-H. Peng et al., Designing patterns using triangle-quad hybrid meshes, ACM TOG 37(4), 2018, section 5.1, Fig. 15.
#[pyfunction]
#[pyo3(signature = (
    mesh, *, cut = None, glue = None, runs = None, zips = None, rounds = 400, type_tolerance = None, mirror = false,
    progress = None
))]
#[allow(clippy::too_many_arguments)]
fn fold_tiling(
    py: Python<'_>,
    mesh: &Bound<'_, Mesh>,
    cut: Option<Bound<'_, PyAny>>,
    glue: Option<Bound<'_, PyAny>>,
    runs: Option<Bound<'_, PyAny>>,
    zips: Option<Bound<'_, PyAny>>,
    rounds: i64,
    type_tolerance: Option<f64>,
    mirror: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<FoldResult> {
    let bad_option = |sentence: String| errors::raise_plain::<QuadloomError>(py, "option", sentence);
    let options = FoldOptions { rounds: rounds_within(py, rounds)? };
    let cut = cut.map_or(Ok(vec![]), |given| arrays::indices(&given, "cut")).map_err(bad_option)?;
    let mut gluings = Vec::new();
    if let Some(given) = glue {
        for (k, pair) in given.try_iter()?.enumerate() {
            let (first, second): (Bound<'_, PyAny>, Bound<'_, PyAny>) =
                pair?.extract().map_err(|_| bad_option(format!("glue[{k}] is no pair of runs of vertices")))?;
            let run =
                |given: &Bound<'_, PyAny>| arrays::indices(given, &format!("a run of glue[{k}]")).map_err(bad_option);
            gluings.push(Gluing::Vertices(run(&first)?, run(&second)?));
        }
    }
    if let Some(given) = runs {
        let rows = arrays::quadruples(&given, "runs").map_err(bad_option)?;
        gluings.extend(rows.into_iter().map(Gluing::Runs));
    }
    if let Some(given) = zips {
        let rows = arrays::pairs(&given, "zips").map_err(bad_option)?;
        gluings.extend(rows.into_iter().map(|[vertex, edges]| Gluing::Zip { vertex, edges }));
    }
    let types = ScheduleOptions { tolerance: type_tolerance, mirror };
    let mesh = Arc::clone(&mesh.get().inner);
    let outcome = worker::run(py, progress.as_ref(), move |monitor| {
        let made = monitor.within(0.0, 0.9, || fold(&mesh, &cut, &gluings, &options, monitor))?;
        let schedule = monitor.within(0.9, 1.0, || Inner::of(&made.mesh, &types, monitor))?;
        Ok((made, schedule))
    })?;
    let (made, schedule) = outcome.map_err(|failure: Failure| match failure {
        Failure::Folding(error) => to_exception(py, &error),
        Failure::Schedule(error) => schedule::to_exception(py, &error),
    })?;
    Ok(FoldResult {
        irregularity: made.irregularity,
        regular: made.is_regular(),
        panels: Py::new(py, Schedule::from(schedule))?,
        face_source: arrays::index_array(py, &made.face_source).unbind(),
        vert_target: arrays::index_array(py, &made.vertex_of).unbind(),
        irregular_verts: PyArray1::from_iter(py, made.defects.iter().map(|&(v, _)| v as i32)).unbind(),
        defects: PyArray1::from_iter(py, made.defects.iter().map(|&(_, defect)| defect)).unbind(),
        mesh: Py::new(py, Mesh::from(made.mesh))?,
    })
}

/// Either half of the work may fail.
enum Failure {
    Folding(FoldError),
    Schedule(ScheduleError),
}

impl From<FoldError> for Failure {
    fn from(error: FoldError) -> Self {
        Self::Folding(error)
    }
}

impl From<ScheduleError> for Failure {
    fn from(error: ScheduleError) -> Self {
        Self::Schedule(error)
    }
}

fn to_exception(py: Python<'_>, error: &FoldError) -> PyErr {
    let sentence = error.to_string();
    let invalid = |code: &str, kind: &str, elements: &[u32]| {
        errors::raise::<InvalidMeshError>(py, code, sentence.clone(), None, [(kind.to_owned(), elements)])
    };
    let infeasible = |code: &str, kind: &str, elements: &[u32]| {
        errors::raise::<InfeasibleError>(py, code, sentence.clone(), None, [(kind.to_owned(), elements)])
    };
    match error {
        FoldError::NotTiles { faces } => invalid("not_tiles", "faces", faces),
        FoldError::NotManifold { edges } => invalid("non_manifold", "edges", edges.as_flattened()),
        FoldError::NoSuchFace { .. } | FoldError::Nothing => {
            errors::raise_plain::<QuadloomError>(py, "option", sentence)
        }
        FoldError::NotOnBorder { vertex, .. } => infeasible("glue_border", "verts", &[*vertex]),
        FoldError::NotAnEdge { edge, .. } => infeasible("glue_border", "edges", edge),
        FoldError::Lengths { .. } => infeasible("glue_lengths", "edges", &[]),
        FoldError::Orientation { first, second, .. } => {
            infeasible("glue_orientation", "edges", [*first, *second].as_flattened())
        }
        FoldError::Twice { edge, .. } => infeasible("glue_twice", "edges", edge),
        FoldError::NoSurface { faces, edges, vertices } => {
            let elements = [
                ("faces".to_owned(), faces.as_slice()),
                ("edges".to_owned(), edges.as_flattened()),
                ("verts".to_owned(), vertices.as_slice()),
            ];
            errors::raise::<InfeasibleError>(py, "glue_surface", sentence, None, elements)
        }
        FoldError::Cancelled(_) | FoldError::Shaping(SurfaceError::Cancelled(_)) => worker::cancelled(py),
        FoldError::Shaping(_) => errors::raise_plain::<errors::InternalError>(
            py,
            "internal",
            format!("{sentence}; please report it with the mesh"),
        ),
    }
}
