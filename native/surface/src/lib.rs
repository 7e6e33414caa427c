//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.

pub mod closest;
pub mod geodesic;
#[cfg(test)]
mod test_shapes;
