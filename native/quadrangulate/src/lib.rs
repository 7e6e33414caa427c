//! Side quantisation and the filling of n-sided patches with quads.

mod custom;
mod disk;
mod fill;
mod flatten;
pub mod layout;
mod lbfgs;
mod optimise;
mod pattern;
mod place;
pub mod quantise;
mod strips;
mod universal;

pub use custom::CustomPattern;
pub use disk::{Cost, Method, PatchTopology};
pub use fill::{FillError, Filler, fill_disk, fill_loop};
pub mod improve;
pub use optimise::optimise_flat;
pub use place::{DiskSurface, PlaceError, place};
