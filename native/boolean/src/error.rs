//! Why a boolean cannot be had, with the elements to look at.

use mesh::Cancelled;
use std::collections::BTreeMap;

/// What to mend, by kind of element: `"faces"`, `"edges"` (flat vertex pairs) or `"verts"`.
pub type Elements = BTreeMap<&'static str, Vec<u32>>;

/// Failure of [`crate::boolean`].
#[derive(Debug, Clone, thiserror::Error)]
pub enum BooleanError {
    /// An input is not a closed, manifold, pure-quad mesh.
    #[error("{} {sentence}", ["A", "B"][*.input])]
    Invalid {
        /// 0 for A, 1 for B.
        input: usize,
        /// Stable identifier, such as `open` or `non_manifold`.
        code: &'static str,
        /// What is wrong and how to mend it.
        sentence: String,
        /// The elements of that input.
        elements: Elements,
    },
    /// An option is out of range.
    #[error("{0}")]
    Option(String),
    /// The operation leaves nothing: a disjoint intersection, or A wholly inside B.
    #[error("{0}")]
    Empty(&'static str),
    /// The exact boolean itself failed.
    #[error("the exact boolean of the triangulated inputs failed ({0}); check both objects for intersecting faces")]
    Intersect(String),
    /// No filler made a valid mesh of some region.
    #[error("{sentence}")]
    Infeasible {
        /// Stable identifier.
        code: &'static str,
        /// What is wrong and what to change.
        sentence: String,
        /// Elements of input A and of input B near the region.
        elements: [Elements; 2],
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
