//! Feature retopology: marked edges become edge loops of an all-quad mesh with a coarse layout.
//!
//! Follows Daniels, Lizier, Siqueira, Silva and Nonato, Template-based quadrilateral meshing, Computers & Graphics 2011.

pub mod base;

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
