//! Proptest strategies.

use crate::{random::Random, shapes};
use mesh::{DVec3, PolygonMesh};
use proptest::prelude::*;

/// Small closed pure-quad meshes of one component, of genus 0 or 1, at any position, size and rotation.
pub fn closed_quad_mesh() -> impl Strategy<Value = PolygonMesh> {
    let shape = prop_oneof![
        (1..5u32, prop::array::uniform3(0.2..3.0)).prop_map(|(n, size)| shapes::cuboid(DVec3::from_array(size), n)),
        (1..5u32).prop_map(shapes::sphere),
        (3..12u32, 3..8u32, 0.1..0.9).prop_map(|(around, across, minor)| shapes::torus(1.0, minor, around, across)),
        (1..4u32, 1..5u32, 0.2..4.0).prop_map(|(n, layers, height)| shapes::cylinder(1.0, height, n, layers)),
    ];
    (shape, any::<u64>(), -2.0..2.0, prop::array::uniform3(-10.0..10.0)).prop_map(|(mesh, seed, size, at)| {
        shapes::transformed(&mesh, Random::new(seed).rotation() * 10f64.powf(size), DVec3::from_array(at))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle;

    proptest! {
        #[test]
        fn what_it_makes_is_closed_and_faces_outwards(mesh in closed_quad_mesh()) {
            prop_assert_eq!(oracle::closed_manifold(&mesh), Ok(()));
            prop_assert!(mesh.is_pure_quad() && oracle::volume(&mesh) > 0.0);
            prop_assert_eq!(oracle::components(&mesh), 1);
        }
    }
}
