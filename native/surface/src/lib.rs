//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod smooth;
pub mod smooth_blend;
pub mod smooth_star;
