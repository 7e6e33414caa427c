//! Features that run side by side nearer than quads are wide: one of them will do.
//!
//! Not in Daniels et al. 2011. A fillet in steps has a sharp line for each; with all of them, and the short pieces of its rims between
//! them, there are more corners than quads have room for.

use crate::features::{Curve, curves_from_forks, neighbours};
use mesh::{DVec3, TriangleMesh, nearest_on_segment};
use std::collections::{BTreeMap, BTreeSet};

/// The directions of curves that run side by side are no further apart than this, radians.
const PARALLEL: f64 = std::f64::consts::PI / 6.0;

/// The edges of curves between forks that run beside another one within `reach` all along, the nearest first: the lines of a fillet in
/// steps, which leave no room for a row of quads. Borders and what holds a marked vertex stay. Nearly linear in the
/// length of the edges over `reach`.
pub(crate) fn curves_beside(
    mesh: &TriangleMesh,
    edges: &BTreeMap<[u32; 2], bool>,
    marked: &[u32],
    reach: f64,
) -> BTreeSet<[u32; 2]> {
    let at = |v: u32| mesh.positions[v as usize];
    let length = |&[a, b]: &[u32; 2]| at(a).distance(at(b));
    let mut keep = vec![false; mesh.positions.len()];
    for &v in marked {
        keep[v as usize] = true;
    }
    let around = neighbours(mesh, edges);
    let is_fork = |v: &u32| around[*v as usize].len() > 2;
    let mut curves = curves_from_forks(&around, &keep, edges);
    curves.retain(|curve| curve.ends.iter().all(is_fork));
    let of_edge: BTreeMap<[u32; 2], usize> =
        (0..).zip(&curves).flat_map(|(k, curve)| curve.edges.iter().map(move |&edge| (edge, k))).collect();
    // Edges by the cells of a grid that they pass through, or nearly.
    let cell = |p: DVec3| (p / reach).floor().as_i64vec3().to_array();
    let mut cells: BTreeMap<[i64; 3], Vec<[u32; 2]>> = BTreeMap::new();
    for edge in edges.keys() {
        let steps = (length(edge) / reach).ceil().max(1.0) as usize;
        let passed = (0..=steps).map(|step| cell(at(edge[0]).lerp(at(edge[1]), step as f64 / steps as f64)));
        passed.collect::<BTreeSet<_>>().into_iter().for_each(|cell| cells.entry(cell).or_default().push(*edge));
    }
    let beside = |k: usize, gone: &[bool]| -> f64 {
        let Curve { edges: curve, ends } = &curves[k];
        let is_other = |edge: &[u32; 2]| {
            let apart =
                |&other: &usize| other != k && !gone[other] && !curves[other].ends.iter().any(|v| ends.contains(v));
            of_edge.get(edge).is_none_or(apart) && !edge.iter().any(|v| ends.contains(v))
        };
        let total: f64 = curve.iter().map(length).sum();
        let away = |part: f64| {
            let mut left = part * total;
            let Some(&[a, b]) = curve.iter().find(|edge| {
                left -= length(edge);
                left <= 0.0
            }) else {
                return f64::INFINITY;
            };
            let (point, along) = (at(b).lerp(at(a), -left / length(&[a, b])), (at(b) - at(a)).normalize_or_zero());
            let [x, y, z] = cell(point);
            let near =
                (0..125).filter_map(|n| cells.get(&[x + n / 25 - 2, y + n / 5 % 5 - 2, z + n % 5 - 2])).flatten();
            let distance = |&[c, d]: &[u32; 2]| {
                let is_parallel = (at(d) - at(c)).normalize_or_zero().dot(along).abs() > PARALLEL.cos();
                let foot = || at(c).lerp(at(d), nearest_on_segment(point, at(c), at(d)));
                is_parallel.then(|| point.distance(foot()))
            };
            near.filter(|edge| is_other(edge)).filter_map(distance).fold(f64::INFINITY, f64::min)
        };
        [0.25, 0.5, 0.75].map(away).into_iter().fold(0.0, f64::max)
    };
    let mut gone = vec![false; curves.len()];
    let mut near: Vec<(f64, usize)> =
        (0..curves.len()).map(|k| (beside(k, &gone), k)).filter(|(away, _)| *away < reach).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, k) in near {
        gone[k] = beside(k, &gone) < reach;
    }
    curves.into_iter().zip(gone).filter(|(_, gone)| *gone).flat_map(|(curve, _)| curve.edges).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::sorted;

    #[test]
    fn of_lines_side_by_side_between_two_rims_some_go_and_the_rims_stay() {
        // A flat grid of 9 by 9 squares of side 1 / 9: two rims of 7 edges, three apart, and lines at 2, 3, 4 and 7 between them.
        let (mesh, _) = TriangleMesh::from_polygons(&testkit::shapes::sheet(9, 9));
        let at = |i: u32, j: u32| i * 10 + j;
        let rims = [2, 5].into_iter().flat_map(|i| (1..8).map(move |j| [at(i, j), at(i, j + 1)]));
        let lines = [2, 3, 4, 7].into_iter().flat_map(|j| (2..5).map(move |i| [at(i, j), at(i + 1, j)]));
        let edges: BTreeMap<[u32; 2], bool> = rims.chain(lines).map(|[a, b]| (sorted(a, b), false)).collect();
        let side = mesh.positions[0].distance(mesh.positions[1]);
        let gone = |marked: &[u32], sides: f64| {
            let dropped = curves_beside(&mesh, &edges, marked, sides * side);
            assert!(dropped.iter().all(|edge| edges.contains_key(edge)));
            dropped.into_iter().map(|[a, _]| a % 10).collect::<BTreeSet<_>>()
        };
        assert_eq!(gone(&[], 0.9), BTreeSet::new());
        assert_eq!(gone(&[], 1.5), BTreeSet::from([2, 3]));
        assert_eq!(gone(&[at(3, 3)], 1.5), BTreeSet::from([2, 4]), "what holds a marked vertex stays");
    }
}
