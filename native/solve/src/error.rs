//! The one error type of this crate.

/// What went wrong, with the elements concerned and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// The caller's `cancelled` returned true.
    #[error("cancelled by the caller")]
    Cancelled,
    /// An index lies outside the problem.
    #[error("{what} {index} is out of range: there are {count}")]
    OutOfRange {
        /// What the index names.
        what: &'static str,
        /// The index.
        index: usize,
        /// Number of elements there are.
        count: usize,
    },
    /// A number is NaN, infinite, or has a sign that the problem excludes.
    #[error("the {what} of element {index} is not usable: it must be {expected}")]
    BadNumber {
        /// What the number is.
        what: &'static str,
        /// The element it belongs to, counted as in the input.
        index: usize,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// Cholesky met a pivot that is not positive.
    #[error(
        "the {size} x {size} matrix is not positive definite{}: pin at least one unknown of every connected component, or add a small multiple of the mass matrix",
        .row.map_or(String::new(), |row| format!(" (the diagonal of row {row} is not positive)"))
    )]
    NotPositiveDefinite {
        /// Number of rows.
        size: usize,
        /// First row whose diagonal is zero or negative, when there is one.
        row: Option<usize>,
    },
    /// No assignment satisfies all rows and bounds of an integer programme.
    #[error("the integer programme has no solution: some of its {rows} rows contradict each other or the bounds")]
    Infeasible {
        /// Number of rows.
        rows: usize,
    },
    /// A limit struck before any solution was known.
    #[error(
        "no solution of the integer programme was found within {nodes} nodes and {seconds} s: raise the limit, or give a first solution"
    )]
    LimitWithoutSolution {
        /// The node limit.
        nodes: u32,
        /// The time limit, rounded down.
        seconds: u64,
    },
    /// No perfect matching exists.
    #[error("{} vertices stay without a partner in every matching", .vertices.len())]
    Unmatched {
        /// The vertices that one best matching leaves single, ascending.
        vertices: Vec<u32>,
    },
    /// A connected component holds an odd number of terminals, so it has no T-join.
    #[error("a connected component of {} vertices has an odd number of terminals, {}: add or remove one", .vertices.len(), .terminals.len())]
    OddComponent {
        /// The component's vertices, ascending.
        vertices: Vec<u32>,
        /// Those of them that are terminals, ascending.
        terminals: Vec<u32>,
    },
    /// The solver behind the interface failed or broke its promise. This is a bug, here or there.
    #[error("the {solver} solver failed: {message}; please report it with the input")]
    Solver {
        /// Name of the library.
        solver: &'static str,
        /// What happened.
        message: String,
    },
}
