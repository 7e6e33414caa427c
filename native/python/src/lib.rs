//! The Python module `quadloom`: arrays in, arrays out, errors as exceptions.
//!
//! Layer 3, the only crate that knows Python. Each file binds one thing; the type stubs are in `quadloom.pyi` and
//! tests/api keeps them true.

// pyo3 hands arguments over by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod boolean;
mod defects;
mod design;
mod errors;
mod fit;
mod folding;
mod mesh;
mod patch_edit;
mod patch_graph;
mod polyhedron;
mod retopology;
mod retopology_options;
mod schedule;
mod session;
mod surface;
mod surface_options;
mod tiling;
mod worker;

use pyo3::prelude::*;

/// Pure-quad booleans of polygon meshes, retopology along marked edges, and triangle-quad tilings of outlines and
/// surfaces. Meshes are in
/// Blender's own layout, lengths in scene units.
#[pymodule]
fn quadloom(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<defects::Defects>()?;
    module.add_function(wrap_pyfunction!(defects::check, module)?)?;
    module.add_class::<boolean::BooleanResult>()?;
    module.add_class::<boolean::CornerSources>()?;
    module.add_function(wrap_pyfunction!(boolean::boolean_of_meshes, module)?)?;
    fit::register(module)?;
    folding::register(module)?;
    polyhedron::register(module)?;
    retopology::register(module)?;
    session::register(module)?;
    schedule::register(module)?;
    surface::register(module)?;
    design::register(module)?;
    tiling::register(module)
}
