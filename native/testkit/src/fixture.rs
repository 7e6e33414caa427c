//! The real meshes that ship with the repository: `blend_fixtures/meshes`, with their table of sources and licences.

use crate::obj;
use mesh::PolygonMesh;
use std::path::Path;

/// Closed, manifold, pure-quad meshes of one component, free of self-intersections, for [`fixture`]: those of the random
/// placements, from `blend_fixtures/placements.txt`. Seeds refer to their order.
pub fn placement_fixtures() -> Vec<&'static str> {
    include_str!("../../../blend_fixtures/placements.txt").lines().collect()
}

/// A closed, manifold, pure-quad mesh of one component that intersects itself, for [`fixture`].
pub const SELF_INTERSECTING_FIXTURE: &str = "bob_control";

/// Meshes with a border, triangles, n-gons or a defect, for [`fixture`].
pub const REJECT_FIXTURES: [&str; 12] = [
    "reject/cube_soup",
    "reject/fish_control",
    "reject/moebius",
    "reject/nonmanifold_edge",
    "reject/nonmanifold_vertex",
    "reject/nonoriented_edge",
    "reject/osd_car_open",
    "reject/osd_helmet_open",
    "reject/osd_nonmanifold_quadpole",
    "reject/osd_pawn_open",
    "reject/spot_control_mixed",
    "reject/torus3_misoriented",
];

/// Loads a shipped mesh by its path below `blend_fixtures/meshes`, without the ending.
///
/// # Panics
/// When there is no such file or it is no mesh.
pub fn fixture(name: &str) -> PolygonMesh {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../blend_fixtures/meshes");
    let path = Path::new(folder).join(format!("{name}.obj"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    obj::read(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle;

    #[test]
    fn the_lists_say_what_the_files_hold() {
        for name in placement_fixtures().into_iter().chain([SELF_INTERSECTING_FIXTURE]) {
            let mesh = fixture(name);
            assert!(mesh.is_pure_quad(), "{name}");
            assert_eq!(oracle::closed_manifold(&mesh), Ok(()), "{name}");
            assert_eq!(oracle::components(&mesh), 1, "{name}");
            assert!(oracle::volume(&mesh) > 0.0, "{name}");
        }
        for name in REJECT_FIXTURES {
            let mesh = fixture(name);
            assert!(!mesh.is_pure_quad() || oracle::closed_manifold(&mesh).is_err(), "{name}");
        }
    }
}
