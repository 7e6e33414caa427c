//! Quad Boolean: union, intersection and difference of quad meshes that keep every quad the cut does not touch.
//!
//! Follows S. Nuvoli, A. Hernandez, C. Esperança, R. Scateni, P. Cignoni, N. Pietroni, `QuadMixer`: Layout Preserving
//! Blending of Quadrilateral Meshes, ACM TOG 38(6), 2019. Each stage is a file; docs/papers.md maps sections to files.

mod attributes;
mod band;
mod blend;
mod division;
mod error;
mod fill;
mod inspect;
mod intersect;
mod layout;
mod options;
mod output;
mod pipeline;
mod plan;
mod polychord;
mod regroup;
mod resample;
mod retract;
mod stitch;
#[cfg(test)]
mod test_setting;
mod unique_edges;
mod validate;

pub use error::{BooleanError, Elements};
pub use mesh::Cancelled;
pub use options::{Filler, Layout, Operation, Options, Regroup};
pub use output::{CornerSource, Output, RegionReport, Report};
pub use pipeline::boolean;
