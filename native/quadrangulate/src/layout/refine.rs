//! Splits every interior edge of a triangle mesh in two, so that traces have room between borders that are few triangles apart.
//! The border keeps its vertices: they are the output's.

use mesh::{Topology, TriangleMesh};

/// The finer mesh (old vertices first) and the features in its edges. Triangles with one border edge become three, with two
/// border edges two, others four.
pub(super) fn refine(mesh: &TriangleMesh, topology: &Topology, features: &[[u32; 2]]) -> (TriangleMesh, Vec<[u32; 2]>) {
    let mut fine =
        TriangleMesh { positions: mesh.positions.clone(), triangles: Vec::with_capacity(4 * mesh.triangles.len()) };
    let mut middle: Vec<Option<u32>> = vec![None; topology.len()];
    for h in topology.edges().filter(|&h| !topology.is_border(h)) {
        let [a, b] = [topology.from(h), topology.to(h)].map(|v| mesh.positions[v as usize]);
        let added = Some(fine.positions.len() as u32);
        fine.positions.push(a.midpoint(b));
        middle[h as usize] = added;
        middle[topology.twin[h as usize] as usize] = added;
    }
    for (f, &triangle) in mesh.triangles.iter().enumerate() {
        // Turn the triangle until its unsplit edges come last.
        let split = |k: usize| middle[3 * f + k % 3];
        let count = (0..3).filter(|&k| split(k).is_some()).count();
        let turn = (0..3).find(|&k| (0..count).all(|i| split(k + i).is_some())).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(turn + k) % 3]);
        match [0, 1, 2].map(|k| split(turn + k)) {
            [Some(ab), Some(bc), Some(ca)] => {
                fine.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            [Some(ab), Some(bc), None] => {
                fine.triangles.push([ab, b, bc]);
                let at = |v: u32| fine.positions[v as usize];
                let quad = if at(a).distance(at(bc)) <= at(ab).distance(at(c)) {
                    [[a, ab, bc], [a, bc, c]]
                } else {
                    [[a, ab, c], [ab, bc, c]]
                };
                fine.triangles.extend(quad);
            }
            [Some(ab), None, _] => fine.triangles.extend([[a, ab, c], [ab, b, c]]),
            [None, ..] => fine.triangles.push([a, b, c]),
        }
    }
    let halves = |&[a, b]: &[u32; 2]| {
        let h = topology.find(a, b).or_else(|| topology.find(b, a));
        match h.and_then(|h| middle[h as usize]) {
            Some(m) => vec![[a, m], [m, b]],
            None => vec![[a, b]],
        }
    };
    let features = features.iter().flat_map(halves).collect();
    (fine, features)
}
