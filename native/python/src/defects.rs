//! `quadloom.check` and what it finds.

use crate::arrays;
use crate::mesh::Mesh;
use crate::worker;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;

/// Every defect of a mesh. True when there is any: `if quadloom.check(mesh): ...`. Borders, triangles and n-gons are
/// listed but are no defects by themselves. Indices are int32 and sorted; edges are vertex pairs, lower vertex first.
#[pyclass(frozen, get_all, module = "quadloom")]
// A state each, as Python reads them; nothing switches on them.
#[allow(clippy::struct_excessive_bools)]
pub struct Defects {
    /// (N,) vertices with a coordinate that is infinite or not a number.
    nonfinite_verts: Py<PyArray1<i32>>,
    /// (N,) vertices without a face.
    isolated_verts: Py<PyArray1<i32>>,
    /// (N, 2) vertices at exactly the position of a lower one: lowest vertex there, vertex.
    duplicate_verts: Py<PyArray2<i32>>,
    /// (N,) faces that name a vertex twice.
    degenerate_faces: Py<PyArray1<i32>>,
    /// (N,) faces whose corners all lie on one line.
    zero_area_faces: Py<PyArray1<i32>>,
    /// (N, 2) faces with the corners of a lower face: lowest such face, face.
    duplicate_faces: Py<PyArray2<i32>>,
    /// (N, 2) edges of more than two faces.
    nonmanifold_edges: Py<PyArray2<i32>>,
    /// (N, 2) edges that their two faces run along in the same direction: one of the two is flipped.
    misoriented_edges: Py<PyArray2<i32>>,
    /// (N, 2) edges of a single face.
    border_edges: Py<PyArray2<i32>>,
    /// (N,) vertices whose faces form more than one fan.
    nonmanifold_verts: Py<PyArray1<i32>>,
    /// (N, 2) pairs of faces that intersect, quads split along their shorter diagonal.
    self_intersecting_faces: Py<PyArray2<i32>>,
    /// The faces of each closed component that faces inwards, an (N,) array each.
    inside_out_components: Vec<Py<PyArray1<i32>>>,
    /// (N,) faces with three corners.
    triangles: Py<PyArray1<i32>>,
    /// (N,) faces with more than four corners.
    ngons: Py<PyArray1<i32>>,
    /// Number of components; faces that share a vertex belong together.
    components: usize,
    /// Euler characteristic: used vertices - edges + faces.
    euler: i64,
    /// No edge has a single face.
    closed: bool,
    /// A consistently oriented surface, with or without border.
    manifold: bool,
    /// Every face is a quad.
    pure_quad: bool,
    /// There is no defect.
    is_valid: bool,
    /// One sentence for a person.
    summary: String,
}

#[pymethods]
impl Defects {
    fn __bool__(&self) -> bool {
        !self.is_valid
    }

    fn __repr__(&self) -> String {
        format!("quadloom.Defects({})", self.summary)
    }
}

/// Finds every defect of a mesh, with indices. Any mesh will do. Costs O(F log F). The interpreter is released.
#[pyfunction]
#[pyo3(signature = (mesh, *, progress = None))]
pub fn check(py: Python<'_>, mesh: &Bound<'_, Mesh>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Defects> {
    let mesh = Arc::clone(&mesh.get().inner);
    let found = worker::run(py, progress.as_ref(), move |monitor| mesh::check(&mesh, monitor))?;
    to_python(py, &found.map_err(|_| worker::cancelled(py))?)
}

fn to_python(py: Python<'_>, found: &mesh::Defects) -> PyResult<Defects> {
    let list = |indices: &[u32]| arrays::index_array(py, indices).unbind();
    let pairs = |pairs: &[[u32; 2]]| arrays::index_pairs(py, pairs).map(Bound::unbind);
    Ok(Defects {
        nonfinite_verts: list(&found.nonfinite_verts),
        isolated_verts: list(&found.isolated_verts),
        duplicate_verts: pairs(&found.duplicate_verts)?,
        degenerate_faces: list(&found.degenerate_faces),
        zero_area_faces: list(&found.zero_area_faces),
        duplicate_faces: pairs(&found.duplicate_faces)?,
        nonmanifold_edges: pairs(&found.nonmanifold_edges)?,
        misoriented_edges: pairs(&found.misoriented_edges)?,
        border_edges: pairs(&found.border_edges)?,
        nonmanifold_verts: list(&found.nonmanifold_verts),
        self_intersecting_faces: pairs(&found.self_intersecting_faces)?,
        inside_out_components: found.inside_out_components.iter().map(|faces| list(faces)).collect(),
        triangles: list(&found.triangles),
        ngons: list(&found.ngons),
        components: found.components,
        euler: found.euler,
        closed: found.closed(),
        manifold: found.manifold(),
        pure_quad: found.pure_quad(),
        is_valid: found.is_clean(),
        summary: summarise(found),
    })
}

/// What is there, as counts: "no defects; 4 border edges", "2 non-manifold edges, 1 triangle".
fn summarise(found: &mesh::Defects) -> String {
    let count = |counts: &[(usize, &str, &str)]| {
        let phrases = counts.iter().filter(|(n, ..)| *n > 0).map(|&(n, one, many)| match n {
            1 => format!("1 {one}"),
            _ => format!("{n} {many}"),
        });
        phrases.collect::<Vec<_>>().join(", ")
    };
    let defects = count(&[
        (found.nonfinite_verts.len(), "non-finite vertex", "non-finite vertices"),
        (found.isolated_verts.len(), "vertex without a face", "vertices without a face"),
        (found.duplicate_verts.len(), "duplicate vertex", "duplicate vertices"),
        (found.degenerate_faces.len(), "degenerate face", "degenerate faces"),
        (found.zero_area_faces.len(), "face of zero area", "faces of zero area"),
        (found.duplicate_faces.len(), "duplicate face", "duplicate faces"),
        (found.nonmanifold_edges.len(), "non-manifold edge", "non-manifold edges"),
        (found.misoriented_edges.len(), "misoriented edge", "misoriented edges"),
        (found.nonmanifold_verts.len(), "non-manifold vertex", "non-manifold vertices"),
        (found.self_intersecting_faces.len(), "pair of intersecting faces", "pairs of intersecting faces"),
        (found.inside_out_components.len(), "inside-out component", "inside-out components"),
    ]);
    let traits = count(&[
        (found.border_edges.len(), "border edge", "border edges"),
        (found.triangles.len(), "triangle", "triangles"),
        (found.ngons.len(), "n-gon", "n-gons"),
    ]);
    let defects = if defects.is_empty() { "no defects".to_owned() } else { defects };
    if traits.is_empty() { defects } else { format!("{defects}; {traits}") }
}
