//! Geometry on triangle surfaces: geodesics, cross fields, tracing, maps, remeshing, smoothing.
