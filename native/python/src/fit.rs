//! `quadloom.fit_boundary` and what it returns.

use crate::arrays;
use crate::tiling::{Tiling, bad_option, run};
use ::tiling::FitOptions;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// Adds the function and the class to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Fit>()?;
    module.add_function(wrap_pyfunction!(fit_boundary, module)?)
}

/// What `fit_boundary` finds: an outline that can be tiled, near a curve.
#[pyclass(frozen, get_all, module = "quadloom")]
struct Fit {
    /// (V,) int32: the boundary code.
    code: Py<PyArray1<i32>>,
    /// One tiling of the outline: there is one even where the search for another takes too long.
    tiling: Py<Tiling>,
    /// (V, 2) float64: the corners in the plane of the curve.
    points: Py<PyArray2<f64>>,
    /// Where the first corner lies: a tiling's vertex p belongs at origin + edge_length * (p turned by rotation).
    origin: (f64, f64),
    /// Direction of the first edge, radians.
    rotation: f64,
    /// As given.
    edge_length: f64,
    /// Greatest distance from a point of either to the other, in edge lengths.
    greatest_distance: f64,
    /// Mean distance of the corners from the curve, in edge lengths.
    mean_distance: f64,
}

/// The outline of a region near a closed curve that triangles and squares can tile.
///
/// points: (N, 2) floats, the corners of a polygon that does not cross itself, in either sense.
/// edge_length: of the tiles, in the units of the points.
/// rotation: angle between the x axis and the edges, up to multiples of 30 degrees; radians, None takes the best found.
/// tries: placements tried, 1 to 100000.
/// seed: another one tries others.
/// loops: looked at in the search for a nearer outline, 0 to 1000000; 0 keeps the symmetry of the one found first.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `QuadloomError` for a curve that is too small for a tile or longer than 1000 edges, and `Cancelled`. The outline
/// keeps within about 0.7 edge lengths of the curve. Time grows with tries, the area in tiles, loops and the number of
/// points.
#[pyfunction]
#[pyo3(signature = (points, edge_length, *, rotation = None, tries = 96, seed = 0, loops = 4000, progress = None))]
// One Python keyword each: the signature is the interface.
#[allow(clippy::too_many_arguments)]
fn fit_boundary(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    edge_length: f64,
    rotation: Option<f64>,
    tries: usize,
    seed: u64,
    loops: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Fit> {
    let curve = arrays::plane_points(points, "points").map_err(|sentence| bad_option(py, sentence))?;
    let options = FitOptions { rotation, tries, seed, loops };
    let fit = run(py, progress, move |monitor| ::tiling::fit_boundary(&curve, edge_length, &options, monitor))?;
    let positions = arrays::rows(py, &fit.positions())?.unbind();
    Ok(Fit {
        code: PyArray1::from_iter(py, fit.boundary.code().iter().map(|&angle| i32::from(angle))).unbind(),
        tiling: Py::new(py, Tiling::from(fit.tiling))?,
        points: positions,
        origin: fit.origin.into(),
        rotation: fit.rotation,
        edge_length,
        greatest_distance: fit.greatest_distance,
        mean_distance: fit.mean_distance,
    })
}
