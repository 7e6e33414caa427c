//! The surface as the other stages want it: checked, pinched vertices apart, the edges to follow by its own indices.

use super::{STEP, SurfaceError, SurfaceOptions};
use mesh::{Aabb, DVec3, Monitor, NONE, Topology, TriangleMesh, check, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// Most panels that a call may be asked for: some minutes and gigabytes.
const MOST_PANELS: f64 = 2e6;

/// A sharp line between two others is too short below this part of what a loose one is: an edge of a panel.
const BETWEEN: f64 = 0.37;

/// A manifold surface.
pub(super) struct Input {
    /// The triangles; a vertex at which several fans met is there once a fan, each at its place.
    pub mesh: TriangleMesh,
    /// Marked and sharp edges, sorted vertices of `mesh`.
    pub followed: Vec<[u32; 2]>,
}

impl Input {
    /// Checks what the caller gave. O(n log n).
    pub fn new(
        surface: &TriangleMesh,
        edge_length: f64,
        options: &SurfaceOptions,
        monitor: &Monitor,
    ) -> Result<Self, SurfaceError> {
        check_surface(surface, monitor)?;
        check_edge_length(surface, edge_length)?;
        let (mesh, original) = unpinched(surface);
        let topology = Topology::of_triangles(&mesh);
        let mut edges: BTreeMap<[u32; 2], Vec<[u32; 2]>> = BTreeMap::new();
        let mut followed = Vec::new();
        for h in topology.edges() {
            let (a, b) = (topology.from(h), topology.to(h));
            edges.entry(sorted(original[a as usize], original[b as usize])).or_default().push(sorted(a, b));
            let twin = topology.twin[h as usize];
            if twin != NONE {
                let [left, right] = [h, twin].map(|h| mesh.area_normal(topology.face[h as usize] as usize));
                let is_bent =
                    left != DVec3::ZERO && right != DVec3::ZERO && left.angle_between(right) > options.feature_angle;
                if is_bent {
                    followed.push(sorted(a, b));
                }
            }
        }
        followed = without_crumbs(&followed, &mesh.positions, STEP * edge_length);
        for (index, &[a, b]) in options.marked_edges.iter().enumerate() {
            followed.extend(edges.get(&sorted(a, b)).ok_or(SurfaceError::NoSuchEdge { index })?);
        }
        Ok(Self { mesh, followed })
    }
}

/// Sharp edges less those that panels cannot follow: lines shorter than `least` that end in nothing, lines between two others shorter than
/// a part of it, and what hangs together in a box smaller than `least` across. Smaller than a step of the coarse triangulation they are flaws
/// of the mesh (slivers, noise), and panels would be bent or turned over at them.
pub(crate) fn without_crumbs(sharp: &[[u32; 2]], positions: &[DVec3], least: f64) -> Vec<[u32; 2]> {
    let mut left: BTreeSet<[u32; 2]> = sharp.iter().map(|&[a, b]| sorted(a, b)).collect();
    loop {
        let lines = sharp_lines(&left, positions);
        let mut short: Vec<&SharpLine> = lines.iter().filter(|line| line.is_loose && line.length < least).collect();
        if short.is_empty() {
            // Of those that meet the shortest only: two others may be one without it.
            let mut shortest: BTreeMap<u32, f64> = BTreeMap::new();
            let wanted = || lines.iter().filter(|line| !line.is_loose && line.length < BETWEEN * least);
            for line in wanted() {
                for end in line.ends {
                    let length = shortest.entry(end).or_insert(line.length);
                    *length = length.min(line.length);
                }
            }
            short = wanted().filter(|line| line.ends.iter().all(|end| line.length <= shortest[end])).collect();
        }
        if short.is_empty() {
            break;
        }
        short.into_iter().flat_map(|line| &line.edges).for_each(|edge| {
            left.remove(edge);
        });
    }
    sharp.iter().copied().filter(|&[a, b]| left.contains(&sorted(a, b))).collect()
}

/// Edges one after another between two vertices at which it is not two that meet; of a loop without any, all of them.
struct SharpLine {
    edges: Vec<[u32; 2]>,
    ends: [u32; 2],
    /// Of a line that is all there is, or a loop, the size of its box.
    length: f64,
    /// Whether it ends somewhere, or meets no other.
    is_loose: bool,
}

fn sharp_lines(edges: &BTreeSet<[u32; 2]>, positions: &[DVec3]) -> Vec<SharpLine> {
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in edges {
        beside.entry(a).or_default().push(b);
        beside.entry(b).or_default().push(a);
    }
    let mut left = edges.clone();
    let mut lines = Vec::new();
    let starts = beside.iter().filter(|(_, beside)| beside.len() != 2).chain(beside.iter());
    for (&start, around) in starts {
        for &first in around {
            if !left.remove(&sorted(start, first)) {
                continue;
            }
            let (mut path, mut before, mut here) = (vec![start, first], start, first);
            while let [one, other] = beside[&here][..] {
                let next = if one == before { other } else { one };
                if !left.remove(&sorted(here, next)) {
                    break;
                }
                path.push(next);
                (before, here) = (here, next);
            }
            let at = |v: u32| positions[v as usize];
            let degrees = [start, here].map(|v| beside[&v].len());
            let is_alone = degrees.iter().all(|&degree| degree <= 2);
            let length = if is_alone {
                Aabb::of(path.iter().map(|&v| at(v))).diagonal()
            } else {
                path.windows(2).map(|w| at(w[0]).distance(at(w[1]))).sum()
            };
            let edges = path.windows(2).map(|w| sorted(w[0], w[1])).collect();
            lines.push(SharpLine { edges, ends: [start, here], length, is_loose: is_alone || degrees.contains(&1) });
        }
    }
    lines
}

fn check_surface(surface: &TriangleMesh, monitor: &Monitor) -> Result<(), SurfaceError> {
    if surface.triangles.is_empty() {
        return Err(SurfaceError::Empty);
    }
    let defects = check(&surface.to_polygons(), monitor)?;
    let is_sound = defects.nonmanifold_edges.is_empty()
        && defects.misoriented_edges.is_empty()
        && defects.nonfinite_verts.is_empty()
        && defects.degenerate_faces.is_empty();
    if is_sound {
        return Ok(());
    }
    Err(SurfaceError::NotManifold {
        edges: defects.nonmanifold_edges,
        misoriented: defects.misoriented_edges,
        nonfinite: defects.nonfinite_verts,
        faces: defects.degenerate_faces,
    })
}

fn check_edge_length(surface: &TriangleMesh, edge_length: f64) -> Result<(), SurfaceError> {
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return Err(SurfaceError::EdgeLength { edge_length, diagonal: surface.to_polygons().diagonal() });
    }
    let area: f64 = (0..surface.triangles.len()).map(|t| surface.area_normal(t).length() / 2.0).sum();
    // A period of the lattice has two triangles, three squares and the six triangles of a fan.
    let period = STEP * STEP * 3f64.sqrt() / 2.0;
    let panels = 11.0 * area / (period * edge_length * edge_length);
    if panels > MOST_PANELS {
        return Err(SurfaceError::TooMany { edge_length, panels, least: edge_length * (panels / MOST_PANELS).sqrt() });
    }
    Ok(())
}

/// One vertex for each fan of triangles, and the vertex of the input that each stands for. The first fan keeps the index.
fn unpinched(surface: &TriangleMesh) -> (TriangleMesh, Vec<u32>) {
    let topology = Topology::of_triangles(surface);
    let mut mesh = surface.clone();
    let mut original: Vec<u32> = (0..surface.positions.len() as u32).collect();
    let mut has_fan = vec![false; surface.positions.len()];
    let mut seen = vec![false; topology.len()];
    for start in 0..topology.len() as u32 {
        if seen[start as usize] {
            continue;
        }
        // Back to the fan's first triangle, or once round.
        let mut first = start;
        loop {
            let twin = topology.twin[first as usize];
            if twin == NONE || topology.next[twin as usize] == start {
                break;
            }
            first = topology.next[twin as usize];
        }
        let v = topology.from(start);
        let mut copy = v;
        if std::mem::replace(&mut has_fan[v as usize], true) {
            copy = mesh.positions.len() as u32;
            mesh.positions.push(surface.positions[v as usize]);
            original.push(v);
        }
        let mut h = first;
        while h != NONE && !seen[h as usize] {
            seen[h as usize] = true;
            mesh.triangles[h as usize / 3][h as usize % 3] = copy;
            h = topology.twin[topology.prev[h as usize] as usize];
        }
    }
    (mesh, original)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sharp_edges_that_are_small_together_are_crumbs() {
        let positions: Vec<DVec3> = (0..8).map(|k| DVec3::new(f64::from(k), 0.0, 0.0)).collect();
        // A line of three edges, given in no order, and one of two.
        let sharp = [[2, 1], [5, 6], [0, 1], [4, 5], [2, 3]];
        assert_eq!(without_crumbs(&sharp, &positions, 2.5), [[2, 1], [0, 1], [2, 3]]);
        assert_eq!(without_crumbs(&sharp, &positions, 2.0), sharp);
        assert!(without_crumbs(&sharp, &positions, 3.5).is_empty());
    }

    #[test]
    fn short_lines_that_end_in_nothing_or_join_two_others_are_crumbs() {
        // Two lines of five edges side by side, joined by a rung; at the first a whisker of two edges.
        let mut positions: Vec<DVec3> =
            (0..12).map(|k| DVec3::new(f64::from(k % 6), f64::from(k / 6) / 2.0, 0.0)).collect();
        positions.extend([DVec3::new(3.0, -0.5, 0.0), DVec3::new(3.0, -1.0, 0.0)]);
        let lines: Vec<[u32; 2]> = (0..5).flat_map(|k| [[k, k + 1], [6 + k, 7 + k]]).collect();
        let all: Vec<[u32; 2]> = lines.iter().copied().chain([[2, 8], [3, 12], [12, 13]]).collect();
        assert_eq!(without_crumbs(&all, &positions, 2.0), lines);
        assert_eq!(without_crumbs(&all, &positions, 0.9), all);
    }
}
