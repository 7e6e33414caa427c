//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod closest;
pub mod geodesic;
pub mod smooth;
pub mod smooth_blend;
pub mod smooth_reference;
pub mod smooth_star;
#[cfg(test)]
mod test_shapes;
