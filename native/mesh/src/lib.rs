//! Polygon and triangle meshes, half-edge topology, and the check that names every defect.
//!
//! Layer 0: knows nothing of booleans, fields or Python. Positions are in scene units, `f64`; indices are `u32`.
//! Faces run counter-clockwise seen from outside.

mod bvh;
mod check;
mod intersect;
mod monitor;
mod polygon;
mod quality;
mod topology;
mod triangle;

pub use bvh::{Aabb, Bvh};
pub use check::{Defects, check};
pub use intersect::{are_collinear, self_intersections, self_intersections_of, triangles_intersect, unit_scale};
pub use monitor::{Cancelled, Monitor};
pub use polygon::{MeshError, PolygonMesh};
pub use quality::{face_normal, nearest_on_segment, scaled_jacobian, volume};
pub use topology::{NONE, Topology, sorted};
pub use triangle::{TriangleMesh, split_quad};

/// Vectors and points in space.
pub use glam::DVec3;
