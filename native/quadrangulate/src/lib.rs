//! Side quantisation and the filling of n-sided patches with quads.

mod disk;
mod fill;
pub mod layout;
mod pattern;
mod strips;
mod universal;

pub use disk::{Cost, Method, PatchTopology};
pub use fill::{FillError, Filler, fill_disk, fill_loop};
