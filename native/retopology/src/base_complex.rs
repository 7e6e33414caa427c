//! The base complex of a quad mesh: the patches between its separatrices, the lines of edges that leave irregular vertices
//! and go straight on until they meet another one or the border.

use mesh::{NONE, PolygonMesh, Topology};
use solve::components::connected_components;

/// Patches left when every separatrix is traced to its end: few mean a layout that an artist can edit. All faces must be quads.
/// O(n).
pub(crate) fn patches(mesh: &PolygonMesh) -> usize {
    let topology = Topology::of(mesh);
    let count = topology.len();
    let next = |h: u32| h - h % 4 + (h + 1) % 4;
    let irregular: Vec<bool> = (0..mesh.vertex_count() as u32)
        .map(|v| {
            let around = topology.around(v).count();
            if topology.is_border_vertex(v) { around + 1 > 4 } else { around != 4 }
        })
        .collect();
    let mut cut = vec![false; count];
    for start in 0..count as u32 {
        if !irregular[topology.from(start) as usize] {
            continue;
        }
        let mut h = start;
        loop {
            if std::mem::replace(&mut cut[h as usize], true) {
                break;
            }
            let twin = topology.twin[h as usize];
            if twin == NONE {
                break;
            }
            cut[twin as usize] = true;
            let v = topology.to(h);
            if irregular[v as usize] || topology.is_border_vertex(v) {
                break;
            }
            h = next(topology.twin[next(h) as usize]);
        }
    }
    let joined = (0..count as u32)
        .filter(|&h| topology.twin[h as usize] != NONE && !cut[h as usize])
        .map(|h| (h / 4, topology.twin[h as usize] / 4));
    connected_components(mesh.face_count(), joined).len()
}

#[cfg(test)]
mod tests {
    use super::patches;
    use mesh::DVec3;
    use testkit::shapes;

    #[test]
    fn a_cube_has_six_patches_and_a_torus_one() {
        for n in [1, 2, 5] {
            assert_eq!(patches(&shapes::cuboid(DVec3::ONE, n)), 6);
        }
        assert_eq!(patches(&shapes::torus(2.0, 0.5, 8, 5)), 1);
        assert_eq!(patches(&shapes::sheet(4, 3)), 1);
    }
}
