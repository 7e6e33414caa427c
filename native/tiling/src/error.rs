//! Why a boundary cannot be tiled, or the tilings not be had.

use mesh::Cancelled;
use solve::SolveError;

/// Failure of this crate's functions, with the elements to look at.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TilingError {
    /// The code is not the outline of a plane region.
    #[error("{sentence}")]
    Boundary {
        /// Stable identifier: `too_short`, `too_long`, `angle`, `turning`, `open` or `not_simple`.
        code: &'static str,
        /// What is wrong and what to change.
        sentence: String,
        /// Corners concerned, as indices into the code; for `not_simple` pairs of edges, by the corners they leave.
        corners: Vec<u32>,
    },
    /// The memory that the caller allowed is used up.
    #[error(
        "{states} states of the search fill the {bytes} bytes allowed: raise the limit, or divide the outline; the time to count grows with the number of states"
    )]
    Memory {
        /// States kept when the limit struck.
        states: usize,
        /// The limit.
        bytes: usize,
    },
    /// No tiling with rhombi was found, but there may be one.
    #[error(
        "no tiling was found, with any number of rhombi, though searches of up to {states} states each did not rule one out: \
         turn or shorten some edges, or divide the outline"
    )]
    Unsettled {
        /// States of a search, at most.
        states: usize,
    },
    /// The integer programme could not be solved.
    #[error("{0}")]
    Solver(#[from] SolveError),
    /// An option is out of range.
    #[error("{0}")]
    Option(String),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
