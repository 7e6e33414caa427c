//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod closest;
mod editable;
pub mod geodesic;
pub mod remesh;
pub mod resample;
#[cfg(test)]
mod test_shapes;
pub mod tracing;
