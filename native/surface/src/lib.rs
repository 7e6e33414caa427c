//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod closest;
pub mod cross_field;
mod editable;
pub mod flip_geodesic;
pub mod geodesic;
pub mod inspect;
pub mod intrinsic;
pub mod laplacian;
pub mod parametrize;
pub mod remesh;
pub mod resample;
pub mod smooth;
pub mod smooth_blend;
pub mod smooth_star;
#[cfg(test)]
mod test_shapes;
pub mod tracing;
pub mod triangulate;
