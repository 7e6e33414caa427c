//! Feature retopology: marked edges become edge loops of an all-quad mesh with a coarse layout.
//!
//! Follows Daniels, Lizier, Siqueira, Silva and Nonato, Template-based quadrilateral meshing, Computers & Graphics 2011.

pub mod base;

mod anneal;
mod chords;
mod curvature;
mod density;
mod division;
mod error;
mod fill;
mod measures;
mod mend;
mod optimise;
mod pairing;
mod patch;
mod quads;
mod rails;
mod reach;
mod surfaces;
mod templates;
#[cfg(test)]
mod test_bases;

pub use density::Size;
pub use error::LayoutError;
pub use pairing::Pairing;
pub use quads::{FeatureEdge, LayoutOptions, LayoutReport, Quads, SourcePoint, quads_from_base};
pub use templates::{Catalogue, Template, TemplateChoice, TemplateError};

mod assemble;
pub mod base_error;
pub mod build;
mod bulges;
mod cells;
mod cut;
pub mod detect;
mod dual;
pub mod features;
pub mod fields;
mod groups;
pub mod input;
pub mod metric;
mod sites;
mod sizing;
pub mod split_mesh;
mod stars;
mod tidy;
