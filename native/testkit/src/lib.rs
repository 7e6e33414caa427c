//! Shapes, random strategies, oracles and drawings for tests.
