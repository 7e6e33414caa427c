//! Puts the patches back into one mesh and finds the sub-sides they share.

use super::canvas::Canvas;
use super::region::{Outline, Region};
use super::{Patch, PatchLayout, SubSide, SubSideKind, Undivided};
use mesh::TriangleMesh;
use std::collections::BTreeMap;

/// The layout of finished regions. `kinds` holds the edges (lower vertex first) that are not along traces. A side ends at a
/// corner of its own patch; a sub-side also at those of other patches and where its kind changes.
pub(super) fn assemble(
    canvas: &Canvas,
    regions: &[Region],
    kinds: &BTreeMap<[u32; 2], SubSideKind>,
    flattened: Vec<u32>,
    undivided: Vec<Undivided>,
) -> PatchLayout {
    let kind = |a: u32, b: u32| kinds.get(&[a.min(b), a.max(b)]).copied().unwrap_or(SubSideKind::Trace);
    // Each region's border from a corner back to it, in the whole mesh's vertices, with "is a corner here".
    let borders: Vec<Vec<(u32, bool)>> = regions.iter().map(|region| border_from_corner(canvas, region)).collect();
    let mut ends = vec![false; canvas.positions.len()];
    for border in &borders {
        border.iter().filter(|&&(_, corner)| corner).for_each(|&(v, _)| ends[v as usize] = true);
        for w in border.windows(3) {
            ends[w[1].0 as usize] |= kind(w[0].0, w[1].0) != kind(w[1].0, w[2].0);
        }
    }
    let mut mesh = TriangleMesh { positions: canvas.positions.clone(), triangles: Vec::new() };
    let mut patches = Vec::with_capacity(regions.len());
    let mut sub_sides: Vec<SubSide> = Vec::new();
    // A sub-side by the directed edge it starts with, from either end.
    let mut known: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for (region, border) in regions.iter().zip(&borders) {
        let first = mesh.triangles.len() as u32;
        mesh.triangles.extend(region.triangles.iter().map(|&t| canvas.corners(t).map(|v| canvas.place[v as usize])));
        let (mut sides, mut side) = (Vec::new(), Vec::new());
        let mut path: Vec<u32> = Vec::new();
        for &(v, corner) in border {
            path.push(v);
            if path.len() > 1 && ends[v as usize] {
                let id = *known.entry([path[0], path[1]]).or_insert(sub_sides.len() as u32);
                if id as usize == sub_sides.len() {
                    known.insert([v, path[path.len() - 2]], id);
                    let at = |v: u32| mesh.positions[v as usize];
                    let length = path.windows(2).map(|w| at(w[0]).distance(at(w[1]))).sum();
                    sub_sides.push(SubSide { kind: kind(path[0], path[1]), vertices: path, length });
                }
                side.push(id);
                path = vec![v];
                if corner {
                    sides.push(std::mem::take(&mut side));
                }
            }
        }
        // The border is listed from a corner back to that corner.
        let corners = border[1..].iter().filter(|&&(_, corner)| corner).map(|&(v, _)| v);
        let mut corners: Vec<u32> = corners.collect();
        corners.rotate_right(1);
        patches.push(Patch {
            triangles: (first..mesh.triangles.len() as u32).collect(),
            corners,
            sides,
            part: region.part,
        });
    }
    PatchLayout { mesh, patches, sub_sides, flattened, undivided }
}

/// A patch has one border loop and at least three corners on it.
fn border_from_corner(canvas: &Canvas, region: &Region) -> Vec<(u32, bool)> {
    let loops = Outline::new(canvas, region).loops;
    let mut border: Vec<(u32, bool)> =
        loops.into_iter().flatten().map(|bend| (bend.place, bend.quarters == 1)).collect();
    let corner = border.iter().position(|&(_, corner)| corner).unwrap_or(0);
    border.rotate_left(corner);
    border.push(border[0]);
    border
}
