//! Side quantisation and the filling of n-sided patches with quads.

pub mod improve;
