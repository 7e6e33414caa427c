//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod cross_field;
pub mod parametrize;
pub mod tracing;
pub mod closest;
pub mod geodesic;
pub mod remesh;
pub mod resample;
#[cfg(test)]
mod test_shapes;
pub mod smooth;
pub mod smooth_blend;
pub mod smooth_star;
