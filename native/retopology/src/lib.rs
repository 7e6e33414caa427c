//! Feature retopology: marked edges become edge loops of an all-quad mesh with a coarse layout.
//!
//! Follows Daniels, Lizier, Siqueira, Silva and Nonato, Template-based quadrilateral meshing, Computers & Graphics 2011.

pub mod base;
