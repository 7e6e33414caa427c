//! Between numpy and Rust: any array-like in, with its type, shape and memory order made sure of; arrays out.
//!
//! Errors are sentences; the caller knows which exception they belong to.

use mesh::DVec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// `value` as an aligned array in C order. `as_slice` on its own would also take Fortran order and hand the columns
/// over as rows, so the order is made here. Numbers convert within their kind: floats never become integers.
fn require<'py, T: numpy::Element>(
    value: &Bound<'py, PyAny>,
    name: &str,
    dtype: &str,
) -> Result<PyReadonlyArrayDyn<'py, T>, String> {
    let convert = || -> PyResult<Result<PyReadonlyArrayDyn<'py, T>, String>> {
        let numpy = value.py().import("numpy")?;
        let array = numpy.call_method1("asarray", (value,))?;
        // An empty list arrives as an array of floats and may stand for either kind.
        let empty = array.getattr("size")?.extract::<usize>()? == 0;
        let found = array.getattr("dtype")?;
        if !empty && !numpy.call_method1("can_cast", (&found, dtype, "same_kind"))?.is_truthy()? {
            return Ok(Err(format!("{name} has the type {found}; it must be an array of {dtype}")));
        }
        let array = numpy.call_method1("require", (array, dtype, ("C_CONTIGUOUS", "ALIGNED")))?;
        Ok(Ok(array.extract()?))
    };
    convert().unwrap_or_else(|cause| Err(format!("{name} is not an array of {dtype}: {}", cause.value(value.py()))))
}

fn wrong_shape(name: &str, found: &[usize], expected: &str) -> String {
    format!("{name} has the shape {found:?}; it must be {expected}")
}

/// Rows of three floats.
pub fn points(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<DVec3>, String> {
    let array = require::<f64>(value, name, "float64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_, 3] | [0]) => Ok(flat.chunks_exact(3).map(DVec3::from_slice).collect()),
        (_, found) => Err(wrong_shape(name, found, "(V, 3)")),
    }
}

/// Rows of two floats.
pub fn plane_points(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<[f64; 2]>, String> {
    let array = require::<f64>(value, name, "float64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_, 2] | [0]) => Ok(flat.chunks_exact(2).map(|p| [p[0], p[1]]).collect()),
        (_, found) => Err(wrong_shape(name, found, "(N, 2)")),
    }
}

/// A row of floats.
pub fn numbers(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<f64>, String> {
    let array = require::<f64>(value, name, "float64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_]) => Ok(flat.to_vec()),
        (_, found) => Err(wrong_shape(name, found, "(N,)")),
    }
}

/// Integers that fit an index: 0 to 2^31 - 1.
pub fn indices(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<u32>, String> {
    let array = require::<i64>(value, name, "int64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_]) => to_indices(flat, name),
        (_, found) => Err(wrong_shape(name, found, "(N,)")),
    }
}

/// Rows of two indices.
pub fn pairs(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<[u32; 2]>, String> {
    let array = require::<i64>(value, name, "int64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_, 2] | [0]) => Ok(to_indices(flat, name)?.chunks_exact(2).map(|p| [p[0], p[1]]).collect()),
        (_, found) => Err(wrong_shape(name, found, "(E, 2)")),
    }
}

/// Rows of four indices.
pub fn quadruples(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<[u32; 4]>, String> {
    let array = require::<i64>(value, name, "int64")?;
    match (array.as_slice(), array.shape()) {
        (Ok(flat), [_, 4] | [0]) => {
            Ok(to_indices(flat, name)?.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect())
        }
        (_, found) => Err(wrong_shape(name, found, "(N, 4)")),
    }
}

fn to_indices(values: &[i64], name: &str) -> Result<Vec<u32>, String> {
    let convert = |(at, &value): (usize, &i64)| match i32::try_from(value) {
        Ok(index) if index >= 0 => Ok(index as u32),
        _ => Err(format!("{name} holds {value} at position {at}; an index lies between 0 and 2^31 - 1")),
    };
    values.iter().enumerate().map(convert).collect()
}

/// An (N, W) array from rows of W numbers.
pub fn rows<'py, T: numpy::Element + Copy, const W: usize>(
    py: Python<'py>,
    rows: &[[T; W]],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), W])
}

/// An int32 array of indices.
pub fn index_array<'py>(py: Python<'py>, indices: &[u32]) -> Bound<'py, PyArray1<i32>> {
    PyArray1::from_iter(py, indices.iter().map(|&i| i as i32))
}

/// An (N, 2) int32 array of index pairs.
pub fn index_pairs<'py>(py: Python<'py>, pairs: &[[u32; 2]]) -> PyResult<Bound<'py, PyArray2<i32>>> {
    let signed: Vec<[i32; 2]> = pairs.iter().map(|pair| pair.map(|i| i as i32)).collect();
    rows(py, &signed)
}
