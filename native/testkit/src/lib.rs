//! Shapes, random strategies, oracles and drawings for tests.
//!
//! Test code may panic: a broken fixture is a broken test. Oracles share no code with what they judge.

pub mod coarse;
pub mod dodecagonal;
mod fixture;
pub mod obj;
pub mod oracle;
pub mod outlines;
pub mod plane_region;
pub mod random;
pub mod shapes;
pub mod strategy;
mod svg;

pub use fixture::{REJECT_FIXTURES, SELF_INTERSECTING_FIXTURE, fixture, placement_fixtures};
pub use svg::svg;
