//! Quad Boolean: union, intersection and difference of quad meshes that keep every quad the cut does not touch.
//!
//! Follows S. Nuvoli, A. Hernandez, C. Esperança, R. Scateni, P. Cignoni, N. Pietroni, `QuadMixer`: Layout Preserving
//! Blending of Quadrilateral Meshes, ACM TOG 38(6), 2019. Each stage is a file; docs/papers.md maps sections to files.

mod error;
mod options;
mod output;

pub use error::{BooleanError, Elements};
pub use options::{Filler, Layout, Operation, Options, Regroup};
pub use output::{CornerSource, Output, RegionReport, Report};
