//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod closest;
mod editable;
pub mod geodesic;
pub mod remesh;
#[cfg(test)]
mod test_shapes;
