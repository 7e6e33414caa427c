//! Sparse factorisation, integer programmes and matching, with no geometry in them.
//!
//! Each module hides one solver behind an interface of our own, so that a solver can be replaced in one file:
//!
//! | module | problem | solver behind it |
//! |---|---|---|
//! | [`cholesky`] | one sparse symmetric positive definite matrix, many right-hand sides | faer |
//! | [`eigen`] | the smallest generalised eigenvector of such a matrix; the greatest of a small dense one | inverse iteration; faer |
//! | [`integer`] | integer programmes with convex separable costs and parity rows | `HiGHS` |
//! | [`matching`] | maximum-weight matching among those of maximum cardinality | mwmatching |
//! | [`components`] | connected components | none |
//! | [`tjoin`] | minimum-weight T-join | Dijkstra and [`matching`] |
//! | [`worker`] | cancelling what takes no callback | a thread of its own |
//!
//! Same input, same bytes out, whatever the number of threads. Computations that may take long take a `cancelled`
//! closure that any thread may call; they give up within 50 ms of it returning true.

pub mod cholesky;
pub mod components;
pub mod eigen;
mod error;
pub mod integer;
pub mod matching;
pub mod tjoin;
pub mod worker;

pub use error::SolveError;

/// Asked every few milliseconds by long computations, from the thread that called them; true stops them.
pub type CancelCheck<'a> = &'a (dyn Fn() -> bool + Sync);
