//! Shapes, random strategies, oracles and drawings for tests.

pub mod plane_region;
