//! The dual of the cells and the cut surface become a [`Base`], and its promises are checked.

use crate::base::{Base, BaseEdge};
use crate::base_error::RetopologyError;
use crate::cells::Piece;
use crate::cut::CutSurface;
use crate::dual::Dual;
use mesh::{NONE, Topology};

/// Puts the base together and finds the base triangle of every surface triangle. O(n log n).
///
/// # Errors
/// [`RetopologyError::Internal`] when a base triangle is no disk bounded by its three edges.
pub fn assemble(
    dual: Dual,
    pieces: &[Piece],
    vertices: Vec<u32>,
    surface: CutSurface,
) -> Result<Base, RetopologyError> {
    let Dual { triangles, sides, ends, piece } = dual;
    let edges = ends
        .into_iter()
        .zip(piece)
        .zip(surface.paths)
        .map(|((ends, piece), path)| BaseEdge { ends, path, feature: piece.map(|k| pieces[k as usize].chain) })
        .collect();
    let mut base = Base {
        owner: vec![NONE; surface.mesh.triangles.len()],
        surface: surface.mesh,
        source: surface.source,
        vertices,
        triangles,
        edges,
        triangle_edges: sides,
    };
    find_owners(&mut base)?;
    Ok(base)
}

fn broken(reason: &'static str) -> RetopologyError {
    RetopologyError::Internal { stage: "assembling the base triangulation", reason }
}

/// Spreads every base triangle from its edges over the surface, up to the next base edges.
fn find_owners(base: &mut Base) -> Result<(), RetopologyError> {
    let topology = Topology::of_triangles(&base.surface);
    let mut wall = vec![false; topology.len()];
    let mut open = Vec::new();
    for (t, (corners, sides)) in base.triangles.iter().zip(&base.triangle_edges).enumerate() {
        for k in 0..3 {
            let edge = &base.edges[sides[k] as usize];
            let along = edge.ends == [corners[k], corners[(k + 1) % 3]];
            for pair in edge.path.windows(2) {
                let [a, b] = if along { [pair[0], pair[1]] } else { [pair[1], pair[0]] };
                let h = topology.find(a, b).ok_or(broken("a base edge is no path of surface edges"))?;
                if wall[h as usize] {
                    return Err(broken("two base triangles lie on one side of a base edge"));
                }
                wall[h as usize] = true;
                open.push((h / 3, t as u32));
            }
        }
    }
    while let Some((f, t)) = open.pop() {
        let owner = &mut base.owner[f as usize];
        if *owner == t {
            continue;
        }
        if *owner != NONE {
            return Err(broken("two base triangles overlap"));
        }
        *owner = t;
        for h in 3 * f..3 * f + 3 {
            if !wall[h as usize] && !topology.is_border(h) {
                open.push((topology.twin[h as usize] / 3, t));
            }
        }
    }
    if base.owner.contains(&NONE) {
        return Err(broken("a part of the surface belongs to no base triangle"));
    }
    // A connected region with a rim is a disk when its Euler characteristic is 1. Each triangle spreads from its rim, whose
    // three sides hang together, so the region is connected.
    let mut euler = vec![0_i64; base.triangles.len()];
    let mut corners: Vec<(u32, u32)> = Vec::with_capacity(topology.len());
    for h in 0..topology.len() as u32 {
        let t = base.owner[h as usize / 3];
        corners.push((t, topology.from(h)));
        // Every triangle has three sides; those inside are seen twice.
        let twin = topology.twin[h as usize];
        if wall[h as usize] || twin == NONE || h < twin {
            euler[t as usize] -= 1;
        }
        if h % 3 == 0 {
            euler[t as usize] += 1;
        }
    }
    corners.sort_unstable();
    corners.dedup();
    for &(t, _) in &corners {
        euler[t as usize] += 1;
    }
    if euler.iter().all(|&e| e == 1) { Ok(()) } else { Err(broken("a base triangle is no disk")) }
}
