use super::*;
use glam::{DVec2, DVec3};
use testkit::plane_region::{circle, plane_region, subdivided};
