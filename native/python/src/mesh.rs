//! `quadloom.Mesh`: a polygon mesh in Blender's own layout.

use crate::arrays;
use crate::errors::{self, InvalidMeshError};
use mesh::{DVec3, MeshError, PolygonMesh};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use std::sync::Arc;

/// A polygon mesh: face `f` has the corners `corner_verts[face_offsets[f]:face_offsets[f + 1]]`, counter-clockwise seen
/// from outside. Immutable.
///
/// `positions`: (V, 3) floats, scene units. `face_offsets`: (F + 1,) integers from 0 to C, rising by at least 3.
/// `corner_verts`: (C,) integers from 0 to V - 1. Any array-like will do; the data is copied. Costs O(V + C).
///
/// Raises `InvalidMeshError` when the arrays do not describe a mesh. Geometry is not judged here: see `check`.
#[pyclass(frozen, module = "quadloom")]
pub struct Mesh {
    pub inner: Arc<PolygonMesh>,
    positions: PyOnceLock<Py<PyArray2<f64>>>,
    face_offsets: PyOnceLock<Py<PyArray1<i32>>>,
    corner_verts: PyOnceLock<Py<PyArray1<i32>>>,
}

impl From<PolygonMesh> for Mesh {
    fn from(mesh: PolygonMesh) -> Self {
        Self {
            inner: Arc::new(mesh),
            positions: PyOnceLock::new(),
            face_offsets: PyOnceLock::new(),
            corner_verts: PyOnceLock::new(),
        }
    }
}

#[pymethods]
impl Mesh {
    #[new]
    fn new(
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        face_offsets: &Bound<'_, PyAny>,
        corner_verts: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let bad_array = |sentence| errors::raise_plain::<InvalidMeshError>(py, "array", sentence);
        let positions = arrays::points(positions, "positions").map_err(bad_array)?;
        let face_offsets = arrays::indices(face_offsets, "face_offsets").map_err(bad_array)?;
        let corner_verts = arrays::indices(corner_verts, "corner_verts").map_err(bad_array)?;
        let mesh = py.detach(|| PolygonMesh::new(positions, face_offsets, corner_verts));
        mesh.map(Self::from).map_err(|error| mesh_error(py, &error))
    }

    /// A mesh from (V, 3) positions and one list of vertex indices a face.
    #[staticmethod]
    fn from_polygons(py: Python<'_>, positions: &Bound<'_, PyAny>, polygons: &Bound<'_, PyAny>) -> PyResult<Self> {
        let bad_array = |sentence| errors::raise_plain::<InvalidMeshError>(py, "array", sentence);
        let positions = arrays::points(positions, "positions").map_err(bad_array)?;
        let mut faces = Vec::new();
        for (face, polygon) in polygons.try_iter()?.enumerate() {
            faces.push(arrays::indices(&polygon?, &format!("polygon {face}")).map_err(bad_array)?);
        }
        PolygonMesh::from_polygons(positions, faces).map(Self::from).map_err(|error| mesh_error(py, &error))
    }

    /// Vertex positions: (V, 3) float64, scene units, read-only.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let make = || {
            let rows: Vec<[f64; 3]> = self.inner.positions.iter().map(DVec3::to_array).collect();
            let array = arrays::rows(py, &rows)?;
            array.readwrite().make_nonwriteable();
            Ok::<_, PyErr>(array.unbind())
        };
        Ok(self.positions.get_or_try_init(py, make)?.bind(py).clone())
    }

    /// Where each face's corners start: (F + 1,) int32, read-only.
    #[getter]
    fn face_offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        fixed_indices(py, &self.face_offsets, self.inner.face_offsets())
    }

    /// The vertex at each corner: (C,) int32, read-only.
    #[getter]
    fn corner_verts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        fixed_indices(py, &self.corner_verts, self.inner.corner_verts())
    }

    fn __repr__(&self) -> String {
        format!("quadloom.Mesh({} vertices, {} faces)", self.inner.vertex_count(), self.inner.face_count())
    }
}

/// Made on first use and kept: an attribute read in a loop must not copy the mesh each time.
fn fixed_indices<'py>(
    py: Python<'py>,
    cell: &PyOnceLock<Py<PyArray1<i32>>>,
    indices: &[u32],
) -> Bound<'py, PyArray1<i32>> {
    let make = || {
        let array = arrays::index_array(py, indices);
        array.readwrite().make_nonwriteable();
        array.unbind()
    };
    cell.get_or_init(py, make).bind(py).clone()
}

fn mesh_error(py: Python<'_>, error: &MeshError) -> PyErr {
    let (code, kind, element) = match *error {
        MeshError::Offsets { face, .. } => ("offsets", "faces", vec![face as u32]),
        MeshError::VertexOutOfRange { corner, .. } => ("vertex_out_of_range", "corners", vec![corner as u32]),
        MeshError::TooLarge => ("too_large", "faces", vec![]),
    };
    errors::raise::<InvalidMeshError>(py, code, error.to_string(), None, [(kind.to_owned(), element.as_slice())])
}
