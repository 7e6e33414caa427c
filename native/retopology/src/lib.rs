//! Feature retopology: marked edges become edge loops of an all-quad mesh with a coarse layout.
//!
//! Follows Daniels, Lizier, Siqueira, Silva and Nonato, Template-based quadrilateral meshing, Computers & Graphics 2011.

pub mod base;

mod anneal;
mod base_complex;
mod chords;
mod coarse;
mod curvature;
mod density;
mod division;
mod error;
pub mod failure;
mod fidelity;
mod fill;
mod inspect;
mod keep;
mod lines;
mod measures;
mod mend;
mod optimise;
mod output;
mod pairing;
mod patch;
mod pipeline;
pub mod project;
mod quads;
mod rails;
mod reach;
mod sources;
mod surfaces;
mod templates;
#[cfg(test)]
mod test_bases;
mod traced;
mod work;

pub use density::Size;
pub use error::LayoutError;
pub use failure::RetopologizeError;
pub use output::{BasePath, FeatureKind, Output, OutputFeature, Report};
pub use pairing::Pairing;
pub use pipeline::{Options, retopologize};
pub use quads::{FeatureEdge, LayoutOptions, LayoutReport, Quads, SourcePoint, quads_from_base};
pub use sources::CornerSource;
pub use templates::{Catalogue, Template, TemplateChoice, TemplateError, TemplatePlace};

mod assemble;
pub mod base_error;
mod base_options;
mod beside;
mod breakpoints;
pub mod build;
mod bulges;
mod cells;
mod cut;
pub mod detect;
mod dual;
pub mod features;
pub mod fields;
mod groups;
mod half;
mod harmonic;
pub mod input;
pub mod metric;
pub mod session;
mod sites;
mod sizing;
mod splice;
pub mod split_mesh;
mod stars;
pub mod symmetry;
mod tidy;
