//! The exceptions of the module. Each carries `code` (a stable identifier), `elements` (kind -> index array), `mesh`
//! (whose elements they are) and a sentence that says what is wrong and what to do.

use crate::arrays;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pyo3::create_exception!(
    quadloom,
    QuadloomError,
    PyException,
    "Base of every error of this module.\n\n\
    code: str, a stable identifier such as \"open\".\n\
    mesh: 0 or 1, the input the elements belong to; None when there is one input, or when both are concerned.\n\
    elements: dict of int32 arrays by kind: \"verts\", \"faces\" and \"corners\" (N,), \"edges\" (N, 2) vertex pairs;\n\
    \"sides\" and \"patches\" are those of a patch graph;\n\
    \"features\" and \"feature_verts\" are positions in what was given under those names; when both inputs are\n\
    concerned the kinds begin with \"a_\" or \"b_\"."
);
pyo3::create_exception!(quadloom, InvalidMeshError, QuadloomError, "An input mesh is not what the operation needs.");
pyo3::create_exception!(quadloom, InfeasibleError, QuadloomError, "The operation has no valid result on these inputs.");
pyo3::create_exception!(quadloom, Cancelled, QuadloomError, "The caller's `progress` asked to stop.");
pyo3::create_exception!(quadloom, InternalError, QuadloomError, "A bug of this library; the sentence names the stage.");

/// Adds the exceptions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("QuadloomError", py.get_type::<QuadloomError>())?;
    module.add("InvalidMeshError", py.get_type::<InvalidMeshError>())?;
    module.add("InfeasibleError", py.get_type::<InfeasibleError>())?;
    module.add("Cancelled", py.get_type::<Cancelled>())?;
    module.add("InternalError", py.get_type::<InternalError>())
}

/// An exception of type `E` with its code, its sentence, the input concerned and the elements to look at.
pub fn raise<'a, E: pyo3::PyTypeInfo>(
    py: Python<'_>,
    code: &str,
    sentence: String,
    mesh: Option<usize>,
    elements: impl IntoIterator<Item = (String, &'a [u32])>,
) -> PyErr {
    let error = PyErr::new::<E, _>(sentence);
    let fill = || -> PyResult<()> {
        let arrays = PyDict::new(py);
        for (kind, indices) in elements {
            let flat = arrays::index_array(py, indices);
            // Edges travel flat inside and leave as rows of two vertices.
            if kind.ends_with("edges") {
                arrays.set_item(kind, flat.call_method1("reshape", (-1, 2))?)?;
            } else {
                arrays.set_item(kind, flat)?;
            }
        }
        let value = error.value(py);
        value.setattr("code", code)?;
        value.setattr("mesh", mesh)?;
        value.setattr("elements", arrays)
    };
    match fill() {
        Ok(()) => error,
        Err(cause) => cause,
    }
}

/// [`raise`] without elements.
pub fn raise_plain<E: pyo3::PyTypeInfo>(py: Python<'_>, code: &str, sentence: impl Into<String>) -> PyErr {
    raise::<E>(py, code, sentence.into(), None, [])
}
