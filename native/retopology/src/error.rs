//! Why a base triangulation has no quads.

use crate::templates::TemplateError;
use mesh::Cancelled;
use quadrangulate::improve::ImproveError;
use quadrangulate::quantise::QuantiseError;
use quadrangulate::{FillError, PlaceError};
use solve::SolveError;
use surface::smooth::SmoothError;

/// Why a base triangulation has no quads.
#[derive(Debug, thiserror::Error)]
pub enum LayoutError {
    /// The caller cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The base triangulation contradicts itself.
    #[error("the base triangulation is broken at {element} {index}: {reason}")]
    BadBase {
        /// Kind of element: "triangle", "edge", "vertex" or "surface triangle".
        element: &'static str,
        /// Its index.
        index: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An option is out of its range.
    #[error("the option {option} must be {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// Its range.
        expected: &'static str,
    },
    /// A template was chosen where none can be.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// No counts.
    #[error(transparent)]
    Counts(QuantiseError),
    /// A patch has no filling.
    #[error("patch {patch} cannot be filled: {source}")]
    Fill {
        /// Index of the patch.
        patch: usize,
        /// Why.
        source: FillError,
    },
    /// A patch's quads cannot be put on the surface.
    #[error("the quads of patch {patch} cannot be placed: {source}")]
    Place {
        /// Index of the patch.
        patch: usize,
        /// Why.
        source: PlaceError,
    },
    /// Quads of the wanted size would share edges round narrow parts.
    #[error(
        "is too narrow in {patches} places for quads of this size: edges there would be one; ask for smaller quads"
    )]
    Narrow {
        /// Patches with such edges.
        patches: usize,
    },
    /// A solver failed.
    #[error(transparent)]
    Solve(SolveError),
    /// The smoothing refused its input.
    #[error(transparent)]
    Smooth(SmoothError),
    /// The topological search refused its input.
    #[error(transparent)]
    Improve(ImproveError),
}

impl From<SolveError> for LayoutError {
    fn from(error: SolveError) -> Self {
        if matches!(error, SolveError::Cancelled) { Self::Cancelled(Cancelled) } else { Self::Solve(error) }
    }
}

impl From<SmoothError> for LayoutError {
    fn from(error: SmoothError) -> Self {
        if let SmoothError::Cancelled(cancelled) = error { Self::Cancelled(cancelled) } else { Self::Smooth(error) }
    }
}

impl From<ImproveError> for LayoutError {
    fn from(error: ImproveError) -> Self {
        if let ImproveError::Cancelled(cancelled) = error { Self::Cancelled(cancelled) } else { Self::Improve(error) }
    }
}

impl From<QuantiseError> for LayoutError {
    fn from(error: QuantiseError) -> Self {
        if let QuantiseError::Solve(error) = error { error.into() } else { Self::Counts(error) }
    }
}
