//! The surface as the other stages want it: checked, pinched vertices apart, the edges to follow by its own indices.

use super::{STEP, SurfaceError, SurfaceOptions};
use mesh::{Aabb, DVec3, Monitor, NONE, Topology, TriangleMesh, check, sorted};
use std::collections::BTreeMap;

/// Most panels that a call may be asked for: some minutes and gigabytes.
const MOST_PANELS: f64 = 2e6;

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

/// Sharp edges less those that hang together with others in a box smaller than `least` across: smaller than a step of the coarse
/// triangulation they are flaws of the mesh (slivers, noise), and panels would be bent or turned over at them.
pub(crate) fn without_crumbs(sharp: &[[u32; 2]], positions: &[DVec3], least: f64) -> Vec<[u32; 2]> {
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in sharp {
        beside.entry(a).or_default().push(b);
        beside.entry(b).or_default().push(a);
    }
    let mut is_large: BTreeMap<u32, bool> = BTreeMap::new();
    for &start in beside.keys() {
        if is_large.contains_key(&start) {
            continue;
        }
        is_large.insert(start, false);
        let mut part = vec![start];
        let mut next = 0;
        while let Some(v) = part.get(next) {
            let met = beside[v].iter().copied().filter(|&w| is_large.insert(w, false).is_none());
            part.extend(met.collect::<Vec<_>>());
            next += 1;
        }
        let across = Aabb::of(part.iter().map(|&v| positions[v as usize])).diagonal();
        for v in part {
            is_large.insert(v, across >= least);
        }
    }
    sharp.iter().copied().filter(|[a, _]| is_large[a]).collect()
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
}
