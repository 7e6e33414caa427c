//! `quadloom.count_tilings`, `tilings`, `find_tiling`, `explain_boundary`, `repair_boundary` and what they return.

use crate::arrays;
use crate::errors::{self, InternalError, QuadloomError};
use crate::mesh::Mesh;
use crate::worker;
use ::tiling::{BigUint, Configuration, Explanation, Isometry, Kind, Options, TilingError, Tilings as Inner, Verdict};
use mesh::Monitor;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyIndexError, PyOverflowError};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Adds the functions and classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Boundary>()?;
    module.add_class::<Symmetry>()?;
    module.add_class::<Tiling>()?;
    module.add_class::<Tilings>()?;
    module.add_class::<TilingIterator>()?;
    module.add_function(wrap_pyfunction!(count_tilings, module)?)?;
    module.add_function(wrap_pyfunction!(find_tiling, module)?)?;
    module.add_function(wrap_pyfunction!(tilings, module)?)?;
    module.add_function(wrap_pyfunction!(repair_boundary, module)?)?;
    module.add_function(wrap_pyfunction!(explain_boundary, module)?)
}

/// Number of ways to tile an outline by triangles and squares with unit edges; exact, of any size.
///
/// code: interior angles in units of 30 degrees, 2 to 11, counter-clockwise, of a closed simple polygon with unit edges.
/// rhombi: how many thin rhombi (30 degrees) the tilings have besides.
/// memory: most bytes for the states of the search.
/// progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.
///
/// Raises `QuadloomError` when the code is not a closed simple polygon (`elements["corners"]` names the corners) or the
/// memory is used up, and `Cancelled`. Time grows exponentially with the width of the outline, not with its area; and with
/// the number of rhombi.
#[pyfunction]
#[pyo3(signature = (code, *, rhombi = 0, memory = 4_294_967_296, progress = None))]
fn count_tilings(
    py: Python<'_>,
    code: &Bound<'_, PyAny>,
    rhombi: usize,
    memory: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<BigUint> {
    with_outline(py, code, progress, move |boundary, monitor| {
        if rhombi == 0 {
            return ::tiling::count_tilings(boundary, &Options { memory }, monitor);
        }
        let mut counts = ::tiling::count_with_rhombi(boundary, rhombi, &Options { memory }, monitor)?;
        Ok(counts.swap_remove(rhombi))
    })
}

/// All tilings of an outline by triangles and squares with unit edges, in a fixed order; they are made when asked for.
///
/// Arguments and errors as of `count_tilings`.
#[pyfunction]
#[pyo3(signature = (code, *, memory = 4_294_967_296, progress = None))]
fn tilings(
    py: Python<'_>,
    code: &Bound<'_, PyAny>,
    memory: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Tilings> {
    with_outline(py, code, progress, move |boundary, monitor| {
        let options = Options { memory };
        Ok(Tilings::from((Inner::new(boundary, &options, monitor)?, options)))
    })
}

/// A tiling of an outline, another for another seed; None when there is none.
///
/// rhombi: where there is no tiling by triangles and squares, take the fewest thin rhombi (30 degrees) besides, as near to
/// the outline as they can lie; `Tiling.kinds` shows them. None then means that no number of them helps.
///
/// Quick where there are too many tilings to count. Not each tiling is equally likely: for that, see `Tilings.sample`.
/// Other arguments and errors as of `count_tilings`; `QuadloomError` with the code "unsettled" when no tiling with rhombi
/// was found, nor ruled out.
#[pyfunction]
#[pyo3(signature = (code, seed = 0, *, rhombi = false, memory = 4_294_967_296, progress = None))]
fn find_tiling(
    py: Python<'_>,
    code: &Bound<'_, PyAny>,
    seed: u64,
    rhombi: bool,
    memory: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Option<Tiling>> {
    with_outline(py, code, progress, move |boundary, monitor| {
        let options = Options { memory };
        if rhombi {
            let found = ::tiling::tile_with_rhombi(boundary, seed, &options, monitor)?;
            return Ok(found.map(|found| Tiling { rhombi_at_least: found.at_least, ..found.tiling.into() }));
        }
        Ok(::tiling::find_tiling(boundary, seed, &options, monitor)?.map(Tiling::from))
    })
}

/// Says whether a boundary code closes, is simple and can be tiled; and if not, why not.
///
/// Arguments as of `count_tilings`; any code gets an answer. Raises `QuadloomError` when the memory is used up, and
/// `Cancelled`. Outlines that a formula refutes need no search.
#[pyfunction]
#[pyo3(signature = (code, *, memory = 4_294_967_296, progress = None))]
fn explain_boundary(
    py: Python<'_>,
    code: &Bound<'_, PyAny>,
    memory: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Boundary> {
    let code = angles(py, code)?;
    let explain = move |monitor: &Monitor| ::tiling::explain_boundary(&code, &Options { memory }, monitor);
    to_boundary(py, &run(py, progress, explain)?)
}

/// The nearest boundary code that can be tiled: the fewest exchanges of neighbouring edges, each of which adds or removes
/// a rhombus of 30 degrees at the border; the code itself when it can be tiled. None when few exchanges do not help: then
/// `find_tiling` with rhombi may.
///
/// Arguments and errors as of `count_tilings`.
#[pyfunction]
#[pyo3(signature = (code, *, memory = 4_294_967_296, progress = None))]
fn repair_boundary<'py>(
    py: Python<'py>,
    code: &Bound<'py, PyAny>,
    memory: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Option<Bound<'py, PyArray1<i32>>>> {
    let repaired = with_outline(py, code, progress, move |boundary, monitor| {
        ::tiling::repair(boundary, &Options { memory }, monitor)
    })?;
    Ok(repaired.map(|found| PyArray1::from_iter(py, found.boundary.code().iter().map(|&angle| i32::from(angle)))))
}

/// Runs a job on the outline of a code; its errors become exceptions.
fn with_outline<T: Send + 'static>(
    py: Python<'_>,
    code: &Bound<'_, PyAny>,
    progress: Option<Bound<'_, PyAny>>,
    job: impl FnOnce(&::tiling::Boundary, &Monitor) -> Result<T, TilingError> + Send + 'static,
) -> PyResult<T> {
    let code = angles(py, code)?;
    run(py, progress, move |monitor| job(&::tiling::Boundary::new(&code)?, monitor))
}

/// Runs a job; its errors become exceptions.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Bound<'_, PyAny>>,
    job: impl FnOnce(&Monitor) -> Result<T, TilingError> + Send + 'static,
) -> PyResult<T> {
    worker::run(py, progress.as_ref(), job)?.map_err(|error| to_exception(py, error))
}

/// What `explain_boundary` finds.
#[pyclass(frozen, get_all, module = "quadloom")]
struct Boundary {
    /// "angle", "turning", "open", "not_simple", "refuted", "untileable" or "tileable": the first fault found, or none.
    verdict: &'static str,
    /// What is wrong and what to change, or what any tiling consists of.
    sentence: String,
    /// (N,) int32: the corners at fault; for "not_simple" pairs of edges, by the corners they leave; for "refuted" one
    /// whose leaving edge no tile fits, if that is the reason.
    corners: Py<PyArray1<i32>>,
    /// (V, 2) float64: the corners, the first at the origin and the first edge along x; and the end when it is open.
    points: Py<PyArray2<f64>>,
    /// Whether the outline ends where it begins.
    closes: bool,
    /// Whether it closes without touching itself.
    simple: bool,
    /// Whether it has a tiling.
    tileable: bool,
    /// Squares of any tiling, turned by 0, 30 and 60 degrees; None when the outline does not close. A negative number
    /// refutes it.
    squares: Option<(i32, i32, i32)>,
    /// Triangles of any tiling, turned by 0, 30, 60 and 90 degrees; None when the outline does not close. A negative
    /// number refutes it.
    triangles: Option<(i32, i32, i32, i32)>,
    /// Other than zero, it refutes the outline; its size is the least number of thin rhombi that could help. None when
    /// the outline does not close.
    defect: Option<i32>,
}

#[pymethods]
impl Boundary {
    /// True when the outline has a tiling.
    fn __bool__(&self) -> bool {
        self.tileable
    }

    fn __repr__(&self) -> String {
        format!("<Boundary: {}: {}>", self.verdict, self.sentence)
    }
}

fn to_boundary(py: Python<'_>, found: &Explanation) -> PyResult<Boundary> {
    let points: Vec<[f64; 2]> = found.points.iter().map(|point| point.position()).collect();
    let certificate = found.certificate;
    let simple = matches!(found.verdict, Verdict::Refuted | Verdict::Untileable | Verdict::Tileable);
    Ok(Boundary {
        verdict: found.verdict.code(),
        sentence: found.sentence.clone(),
        corners: arrays::index_array(py, &found.corners).unbind(),
        points: arrays::rows(py, &points)?.unbind(),
        closes: certificate.is_some(),
        simple,
        tileable: found.verdict == Verdict::Tileable,
        squares: certificate.map(|certificate| certificate.squares.into()),
        triangles: certificate.map(|certificate| certificate.triangles.into()),
        defect: certificate.map(|certificate| certificate.defect),
    })
}

/// A symmetry of an outline: a rotation about a centre or a reflection in an axis.
#[pyclass(frozen, module = "quadloom")]
struct Symmetry {
    isometry: Isometry,
}

#[pymethods]
impl Symmetry {
    /// Whether it is a reflection.
    #[getter]
    fn reflection(&self) -> bool {
        self.isometry.mirror
    }

    /// Degrees: of a rotation the angle, of a reflection the direction of its axis.
    #[getter]
    fn angle(&self) -> f64 {
        f64::from(self.isometry.turn) * if self.isometry.mirror { 15.0 } else { 30.0 }
    }

    /// The centre of a rotation, or a point of the axis.
    #[getter]
    fn centre(&self) -> (f64, f64) {
        self.isometry.centre().into()
    }

    fn __repr__(&self) -> String {
        let (x, y) = self.centre();
        let kind = if self.isometry.mirror { "reflection in the axis at" } else { "rotation by" };
        format!("<Symmetry: {kind} {} degrees, through ({x:.3}, {y:.3})>", self.angle())
    }
}

/// Tilings with their state graph, shared with the single tilings that are read from it.
type Shared = Arc<Mutex<Inner>>;

fn lock(shared: &Shared) -> std::sync::MutexGuard<'_, Inner> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// All tilings of an outline, in a fixed order: a sequence of `Tiling`.
#[pyclass(frozen, module = "quadloom")]
struct Tilings {
    shared: Shared,
    options: Options,
    /// How many there are; `len` only takes numbers below 2^63.
    #[pyo3(get)]
    count: BigUint,
    /// States of the search.
    #[pyo3(get)]
    states: usize,
}

impl From<(Inner, Options)> for Tilings {
    fn from((inner, options): (Inner, Options)) -> Self {
        let (count, states) = (inner.count().clone(), inner.states());
        Self { shared: Arc::new(Mutex::new(inner)), options, count, states }
    }
}

#[pymethods]
impl Tilings {
    fn __len__(&self) -> PyResult<usize> {
        let fits = isize::try_from(&self.count).ok().map(isize::unsigned_abs);
        fits.ok_or_else(|| PyOverflowError::new_err("too many tilings for len(); use count"))
    }

    fn __bool__(&self) -> bool {
        self.count > BigUint::ZERO
    }

    fn __getitem__(&self, index: &Bound<'_, PyAny>) -> PyResult<Tiling> {
        // Negative indices count from the end, as in any sequence.
        let from_end = index.lt(0)?;
        let index: BigUint = if from_end { index.neg()?.extract()? } else { index.extract()? };
        if from_end && index > self.count || !from_end && index >= self.count {
            return Err(PyIndexError::new_err(format!("there are {} tilings", self.count)));
        }
        let index = if from_end { &self.count - index } else { index };
        Ok(Tiling::listed(&self.shared, index))
    }

    fn __iter__(&self) -> TilingIterator {
        TilingIterator { shared: Arc::clone(&self.shared), next: Mutex::new(BigUint::ZERO), count: self.count.clone() }
    }

    /// `n` tilings drawn independently, each tiling equally likely; the same for the same seed. Empty when there is none.
    #[pyo3(signature = (n, seed = 0))]
    fn sample(&self, n: usize, seed: u64) -> Vec<Tiling> {
        let indices = lock(&self.shared).sample(n, seed);
        indices.map(|index| Tiling::listed(&self.shared, index)).collect()
    }

    /// A tiling with the least sum of weights over its inner vertices, proven, and that sum; None when there is none.
    ///
    /// objective: "regular" (fewest butterflies), "fractured" (most), or a dict of integer weights by configuration:
    /// "triangles", "squares", "rows" and "butterfly". A butterfly is a vertex with two triangles, a square, a triangle
    /// and a square round it. Vertices of the outline have no weight.
    /// progress: as of `count_tilings`.
    #[pyo3(signature = (objective, *, progress = None))]
    fn best(
        &self,
        py: Python<'_>,
        objective: &Bound<'_, PyAny>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<(Tiling, i64)>> {
        let weights = weights(py, objective)?;
        let shared = Arc::clone(&self.shared);
        let best = run(py, progress, move |monitor| lock(&shared).best(weights, monitor))?;
        Ok(best.map(|(tiling, cost)| (tiling.into(), cost)))
    }

    /// The symmetries of the outline, the identity first.
    #[getter]
    fn symmetries(&self) -> Vec<Symmetry> {
        lock(&self.shared).boundary().symmetries().into_iter().map(|isometry| Symmetry { isometry }).collect()
    }

    /// Those tilings that are exactly symmetric.
    ///
    /// group: "reflection" (in the axis with the most such tilings), a number n for n-fold rotation about the outline's
    /// centre, or a list of `symmetries` that must all hold.
    /// progress: as of `count_tilings`.
    #[pyo3(signature = (group, *, progress = None))]
    fn symmetric(
        &self,
        py: Python<'_>,
        group: &Bound<'_, PyAny>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Tilings> {
        let boundary = lock(&self.shared).boundary().clone();
        let groups = groups(py, &boundary, group)?;
        let options = self.options.clone();
        let found = run(py, progress, move |monitor| {
            let mut best: Option<Inner> = None;
            for group in groups {
                let found = Inner::symmetric(&boundary, &group, &options, monitor)?;
                if best.as_ref().is_none_or(|best| best.count() < found.count()) {
                    best = Some(found);
                }
            }
            Ok(best)
        })?;
        match found {
            Some(inner) => Ok((inner, self.options.clone()).into()),
            None => Err(bad_option(py, "the outline has no axis of reflection".to_owned())),
        }
    }

    fn __repr__(&self) -> String {
        format!("<Tilings: {} of an outline with {} edges>", self.count, lock(&self.shared).boundary().code().len())
    }
}

/// Goes through `Tilings` in order.
#[pyclass(frozen, module = "quadloom")]
struct TilingIterator {
    shared: Shared,
    next: Mutex<BigUint>,
    count: BigUint,
}

#[pymethods]
impl TilingIterator {
    fn __iter__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __next__(&self) -> Option<Tiling> {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let index = next.clone();
        *next += 1u32;
        (index < self.count).then(|| Tiling::listed(&self.shared, index))
    }
}

/// Where a tiling's tiles are.
enum Source {
    /// In the state graph: a sample of 100,000 tilings should not hold all their tiles.
    Listed(Shared, BigUint),
    Made(::tiling::Tiling),
}

/// One tiling.
#[pyclass(frozen, module = "quadloom")]
pub struct Tiling {
    source: Source,
    /// No tiling of the outline has fewer thin rhombi: equal to their number, but where the proof would have taken too
    /// long.
    #[pyo3(get)]
    rhombi_at_least: usize,
}

impl From<::tiling::Tiling> for Tiling {
    fn from(tiling: ::tiling::Tiling) -> Self {
        Self { source: Source::Made(tiling), rhombi_at_least: 0 }
    }
}

impl Tiling {
    fn listed(shared: &Shared, index: BigUint) -> Self {
        Self { source: Source::Listed(Arc::clone(shared), index), rhombi_at_least: 0 }
    }

    /// The tiles, made from the index when need be; some 50 microseconds for 400 tiles.
    fn tiling(&self, py: Python<'_>) -> PyResult<::tiling::Tiling> {
        match &self.source {
            Source::Made(tiling) => Ok(tiling.clone()),
            Source::Listed(shared, index) => {
                let found = py.detach(|| lock(shared).get(index, &Monitor::new()));
                let found = found.map_err(|error| to_exception(py, error))?;
                found.ok_or_else(|| PyIndexError::new_err("there is no tiling with this index"))
            }
        }
    }
}

#[pymethods]
impl Tiling {
    /// The tiles as a mesh with unit edges in the plane z = 0; the outline's first corner is the origin, its first edge
    /// along x.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> PyResult<Mesh> {
        Ok(self.tiling(py)?.mesh(1.0).into())
    }

    /// (F,) int32: what each face is: 0 a triangle, 1 a square, 2 a thin rhombus.
    #[getter]
    fn kinds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let tiling = self.tiling(py)?;
        Ok(PyArray1::from_iter(py, tiling.tiles.iter().map(|tile| tile.kind as i32)))
    }

    /// (F,) int32: by how many times 30 degrees each face is turned; 0 to 3 for triangles, 0 to 2 for squares, 0 to 5 for
    /// rhombi.
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let tiling = self.tiling(py)?;
        Ok(PyArray1::from_iter(py, tiling.tiles.iter().map(|tile| i32::from(tile.orientation()))))
    }

    /// How many inner vertices, those of rhombi apart, have each configuration: "triangles", "squares", "rows", "butterfly".
    #[getter]
    fn configurations(&self, py: Python<'_>) -> PyResult<BTreeMap<&'static str, usize>> {
        let counts = self.tiling(py)?.configuration_counts();
        Ok(Configuration::ALL.into_iter().map(name).zip(counts).collect())
    }

    /// A picture, `width` pixels wide: triangles warm, squares cold, a shade for each orientation; rhombi magenta.
    #[pyo3(signature = (width = 800))]
    fn svg(&self, py: Python<'_>, width: u32) -> PyResult<String> {
        Ok(self.tiling(py)?.svg(width))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let tiling = self.tiling(py)?;
        let [triangles, squares, rhombi] = [Kind::Triangle, Kind::Square, Kind::Rhombus].map(|kind| tiling.count(kind));
        let rhombi = if rhombi > 0 { format!(", {rhombi} rhombi") } else { String::new() };
        Ok(format!("<Tiling: {squares} squares, {triangles} triangles{rhombi}>"))
    }
}

/// What a configuration is called in Python.
fn name(configuration: Configuration) -> &'static str {
    match configuration {
        Configuration::Triangles => "triangles",
        Configuration::Squares => "squares",
        Configuration::Rows => "rows",
        Configuration::Butterfly => "butterfly",
    }
}

pub fn bad_option(py: Python<'_>, sentence: String) -> PyErr {
    errors::raise_plain::<QuadloomError>(py, "option", sentence)
}

/// A boundary code. Numbers too large for an angle become one that no corner has.
fn angles(py: Python<'_>, code: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    let angles = arrays::indices(code, "code").map_err(|sentence| bad_option(py, sentence))?;
    Ok(angles.into_iter().map(|angle| u8::try_from(angle).unwrap_or(u8::MAX)).collect())
}

fn weights(py: Python<'_>, objective: &Bound<'_, PyAny>) -> PyResult<[i64; 4]> {
    if let Ok(word) = objective.extract::<String>() {
        return match word.as_str() {
            "regular" => Ok([0, 0, 0, 1]),
            "fractured" => Ok([0, 0, 0, -1]),
            _ => {
                Err(bad_option(py, format!("objective is \"{word}\"; it must be \"regular\", \"fractured\" or a dict")))
            }
        };
    }
    let by_name: BTreeMap<String, i64> = objective.extract().map_err(|_| {
        bad_option(py, "objective must be \"regular\", \"fractured\" or a dict of integers by configuration".to_owned())
    })?;
    let mut weights = [0; 4];
    for (key, weight) in by_name {
        let found = Configuration::ALL.into_iter().find(|&configuration| name(configuration) == key);
        let Some(configuration) = found else {
            let names = Configuration::ALL.map(name).join(", ");
            return Err(bad_option(py, format!("objective names \"{key}\"; the configurations are: {names}")));
        };
        weights[configuration as usize] = weight;
    }
    Ok(weights)
}

/// The sets of symmetries that a `group` argument stands for; the one with the most tilings is meant.
fn groups(py: Python<'_>, boundary: &::tiling::Boundary, group: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<Isometry>>> {
    let all = boundary.symmetries();
    if let Ok(word) = group.extract::<String>() {
        if word != "reflection" {
            return Err(bad_option(py, format!("group is \"{word}\"; it must be \"reflection\", a number or a list")));
        }
        return Ok(all.into_iter().filter(|isometry| isometry.mirror).map(|isometry| vec![isometry]).collect());
    }
    if let Ok(fold) = group.extract::<u8>() {
        let turn = if fold > 0 && 12 % fold == 0 { 12 / fold % 12 } else { 12 };
        let rotation = all.into_iter().find(|isometry| !isometry.mirror && isometry.turn == turn);
        return match rotation {
            Some(rotation) => Ok(vec![vec![rotation]]),
            None => Err(bad_option(py, format!("the outline has no {fold}-fold rotation"))),
        };
    }
    let chosen: Vec<PyRef<'_, Symmetry>> = group.extract().map_err(|_| {
        bad_option(py, "group must be \"reflection\", a number or a list of the outline's symmetries".to_owned())
    })?;
    Ok(vec![chosen.iter().map(|symmetry| symmetry.isometry).collect()])
}

fn to_exception(py: Python<'_>, error: TilingError) -> PyErr {
    let sentence = error.to_string();
    match error {
        TilingError::Boundary { code, corners, .. } => {
            errors::raise::<QuadloomError>(py, code, sentence, None, [("corners".to_owned(), corners.as_slice())])
        }
        TilingError::Memory { .. } => errors::raise_plain::<QuadloomError>(py, "memory", sentence),
        TilingError::Unsettled { .. } => errors::raise_plain::<QuadloomError>(py, "unsettled", sentence),
        TilingError::Option(_) => bad_option(py, sentence),
        TilingError::Solver(_) => errors::raise_plain::<InternalError>(py, "solver", sentence),
        TilingError::Cancelled(_) => worker::cancelled(py),
    }
}
