//! Why there is no retopology, with the elements of the polygon mesh to look at.

use crate::base_error::RetopologyError;
use crate::error::LayoutError;
use mesh::Cancelled;
use std::collections::BTreeMap;
use surface::inspect::Fault;

/// What to mend, by kind of element: `"faces"`, `"edges"` (flat vertex pairs), `"verts"`; `"features"` and
/// `"feature_verts"` are positions in the lists of features.
pub type Elements = BTreeMap<&'static str, Vec<u32>>;

/// Failure of [`crate::retopologize`].
#[derive(Debug, Clone, thiserror::Error)]
pub enum RetopologizeError {
    /// The mesh is no surface the method can work on.
    #[error("the mesh {sentence}")]
    Invalid {
        /// Stable identifier, such as `non_manifold`.
        code: &'static str,
        /// What is wrong and how to mend it.
        sentence: String,
        /// The elements concerned.
        elements: Elements,
    },
    /// A feature is no part of the surface, or given twice.
    #[error("{sentence}")]
    Feature {
        /// Stable identifier.
        code: &'static str,
        /// What is wrong and how to mend it.
        sentence: String,
        /// Positions in the lists of features.
        elements: Elements,
    },
    /// An option is out of range.
    #[error("{0}")]
    Option(String),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A promise of this crate does not hold: a bug.
    #[error("{sentence}")]
    Internal {
        /// What failed, and a plea to report it.
        sentence: String,
    },
}

impl RetopologizeError {
    /// A promise that does not hold.
    pub(crate) fn bug(what: &str) -> Self {
        // Errors of the stages say so themselves, or know no better.
        let plea = if what.contains("please report") { "" } else { "; please report it with the mesh" };
        Self::Internal { sentence: format!("{what}{plea}") }
    }
}

impl From<Fault> for RetopologizeError {
    fn from(fault: Fault) -> Self {
        let Fault { code, sentence, kind, elements } = fault;
        Self::Invalid { code, sentence, elements: Elements::from([(kind, elements)]) }
    }
}

impl From<RetopologyError> for RetopologizeError {
    fn from(error: RetopologyError) -> Self {
        match error {
            RetopologyError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            RetopologyError::BadOption { .. } => Self::Option(error.to_string()),
            // The mesh and its features were looked at before.
            _ => Self::bug(&format!("no base triangulation: {error}")),
        }
    }
}

impl From<LayoutError> for RetopologizeError {
    fn from(error: LayoutError) -> Self {
        match error {
            LayoutError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            LayoutError::Narrow { .. } => {
                Self::Invalid { code: "too_narrow", sentence: error.to_string(), elements: Elements::new() }
            }
            LayoutError::BadOption { .. } | LayoutError::Template(_) => Self::Option(error.to_string()),
            _ => Self::bug(&format!("no quads: {error}")),
        }
    }
}
