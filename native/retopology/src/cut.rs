//! Cutting the surface along the base edges: Daniels et al. 2011, section 4.3.
//!
//! The base edges are edges of an intrinsic triangulation that knows, in integers, which surface edges cross them and in
//! what order. The cut follows that order, so its connectivity does not depend on rounding; coordinates only place the
//! crossings along the surface edges, kept a little apart from each other and from the ends, so that no triangle collapses.

use crate::base_error::RetopologyError;
use crate::split_mesh::SplitMesh;
use mesh::{DVec3, Monitor, NONE, Topology, TriangleMesh};
use std::collections::BTreeMap;
use surface::intrinsic::Intrinsic;

/// Crossings keep this far apart on a surface edge, and from its ends, as a fraction of the edge.
const APART: f64 = 0.04;

/// A surface cut along paths.
#[derive(Debug, Clone)]
pub struct CutSurface {
    /// Vertices of the uncut surface first, unmoved.
    pub mesh: TriangleMesh,
    /// The input triangle each triangle is part of.
    pub source: Vec<u32>,
    /// Each path as vertices of `mesh`.
    pub paths: Vec<Vec<u32>>,
}

/// Cuts `mesh` along `paths`, half-edges of `triangulation`, which lies over the vertices of `mesh` and shares its
/// `topology` at first. O(n).
///
/// # Errors
/// Cancelled; [`RetopologyError::Internal`] when triangulation and mesh do not belong together.
pub fn cut(
    mesh: &SplitMesh,
    topology: &Topology,
    triangulation: &Intrinsic,
    paths: &[Vec<u32>],
    monitor: &Monitor,
) -> Result<CutSurface, RetopologyError> {
    monitor.check()?;
    // For each edge on a path, the half-edge along the path, and the points where surface edges cross it.
    let mut on_path = vec![NONE; triangulation.length.len()];
    let mut points = vec![Vec::new(); triangulation.length.len()];
    for &h in paths.iter().flatten() {
        let e = triangulation.edge[h as usize] as usize;
        on_path[e] = h;
        points[e] = vec![NONE; triangulation.crossing_count(h).unwrap_or(0) as usize];
    }
    let mut positions = mesh.positions.clone();
    // For each crossed surface edge, by the lower of its half-edges, the points along it.
    let mut on_edge = BTreeMap::<u32, Vec<u32>>::new();
    let mut edge_of_point = Vec::new();
    let first = positions.len() as u32;
    for arc in triangulation.arcs() {
        let edge_at = |half_edge: u32| triangulation.edge[half_edge as usize] as usize;
        let cuts: Vec<_> = arc.crossings.iter().filter(|c| on_path[edge_at(c.half_edge)] != NONE).collect();
        if cuts.is_empty() {
            continue;
        }
        let half = topology.find(arc.ends[0], arc.ends[1]).or_else(|| topology.find(arc.ends[1], arc.ends[0]));
        let half = half.ok_or(MISMATCH)?;
        let twin = topology.twin[half as usize];
        let edge = if twin == NONE { half } else { half.min(twin) };
        let [a, b] = arc.ends.map(|v| mesh.positions[v as usize]);
        let mut ids = Vec::with_capacity(cuts.len());
        for (c, at) in cuts.iter().zip(kept_apart(cuts.iter().map(|c| c.at).collect())) {
            let e = edge_at(c.half_edge);
            let along =
                if on_path[e] == c.half_edge { c.index as usize } else { points[e].len() - 1 - c.index as usize };
            let id = positions.len() as u32;
            points[e][along] = id;
            ids.push(id);
            positions.push(a.lerp(b, at));
            edge_of_point.push(edge);
        }
        if topology.from(edge) != arc.ends[0] {
            ids.reverse();
        }
        on_edge.insert(edge, ids);
    }

    let faces_of = |point: u32| {
        let edge = edge_of_point[(point - first) as usize];
        let twin = topology.twin[edge as usize];
        [edge / 3, if twin == NONE { NONE } else { twin / 3 }]
    };
    let mut chords = BTreeMap::<u32, Vec<[u32; 2]>>::new();
    let mut polylines = Vec::with_capacity(paths.len());
    for path in paths {
        let mut line: Vec<u32> = path.first().map(|&h| triangulation.from(h)).into_iter().collect();
        for &h in path {
            line.extend(&points[triangulation.edge[h as usize] as usize]);
            line.push(triangulation.to(h));
        }
        if line.contains(&NONE) {
            return Err(MISMATCH);
        }
        for pair in line.windows(2) {
            let face = match [pair[0] >= first, pair[1] >= first] {
                [false, false] => continue,
                [true, true] => faces_of(pair[0]).into_iter().find(|&f| f != NONE && faces_of(pair[1]).contains(&f)),
                [point_first, _] => {
                    let (vertex, point) = if point_first { (pair[1], pair[0]) } else { (pair[0], pair[1]) };
                    faces_of(point)
                        .into_iter()
                        .find(|&f| f != NONE && (3 * f..3 * f + 3).any(|h| topology.from(h) == vertex))
                }
            };
            chords.entry(face.ok_or(MISMATCH)?).or_default().push([pair[0], pair[1]]);
        }
        polylines.push(line);
    }

    let (mut triangles, mut source) = (Vec::new(), Vec::new());
    for f in 0..topology.len() as u32 / 3 {
        let mut polygon = Vec::new();
        for h in 3 * f..3 * f + 3 {
            polygon.push(topology.from(h));
            let twin = topology.twin[h as usize];
            let edge = if twin == NONE { h } else { h.min(twin) };
            if let Some(ids) = on_edge.get(&edge) {
                if edge == h { polygon.extend(ids) } else { polygon.extend(ids.iter().rev()) }
            }
        }
        let before = triangles.len();
        divide(&polygon, chords.remove(&f).unwrap_or_default(), &positions, &mut triangles)?;
        source.resize(source.len() + triangles.len() - before, mesh.source[f as usize]);
    }
    Ok(CutSurface { mesh: TriangleMesh { positions, triangles }, source, paths: polylines })
}

const MISMATCH: RetopologyError =
    RetopologyError::Internal { stage: "cutting the surface", reason: "a base edge does not lie in the surface" };

/// Fractions in order, moved apart where they are too close.
fn kept_apart(mut at: Vec<f64>) -> Vec<f64> {
    let gap = APART.min(0.5 / (at.len() + 1) as f64);
    let mut least = gap;
    for a in &mut at {
        *a = a.max(least);
        least = *a + gap;
    }
    let mut most = 1.0 - gap;
    for a in at.iter_mut().rev() {
        *a = a.min(most);
        most = *a - gap;
    }
    at
}

/// Divides a convex polygon along chords that do not cross, then into triangles.
fn divide(
    polygon: &[u32],
    mut chords: Vec<[u32; 2]>,
    positions: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), RetopologyError> {
    let Some([a, b]) = chords.pop() else {
        triangulate(polygon, positions, triangles);
        return Ok(());
    };
    let place = |v: u32| polygon.iter().position(|&w| w == v).ok_or(MISMATCH);
    let (i, j) = (place(a)?, place(b)?);
    let (i, j) = (i.min(j), i.max(j));
    let one = polygon[i..=j].to_vec();
    let other: Vec<u32> = polygon[j..].iter().chain(&polygon[..=i]).copied().collect();
    if one.len() < 3 || other.len() < 3 {
        return Err(MISMATCH);
    }
    let (inside, outside): (Vec<_>, Vec<_>) =
        chords.into_iter().partition(|chord| chord.iter().all(|v| one.contains(v)));
    divide(&one, inside, positions, triangles)?;
    divide(&other, outside, positions, triangles)
}

/// The triangulation of a convex polygon whose worst triangle is best, by dynamic programming. O(k^3); k is 3 to 6 here.
fn triangulate(polygon: &[u32], positions: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    let n = polygon.len();
    if let &[a, b, c] = polygon {
        triangles.push([a, b, c]);
        return;
    }
    let shape = |i: usize, j: usize, k: usize| {
        let [a, b, c] = [i, j, k].map(|x| positions[polygon[x] as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        (b - a).cross(c - a).length() / longest.max(f64::MIN_POSITIVE)
    };
    // For corners i < j: the worst triangle between them, and the third corner of the one on their chord.
    let mut best = vec![vec![(f64::INFINITY, 0); n]; n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            best[i][j] = (i + 1..j)
                .map(|k| (shape(i, k, j).min(best[i][k].0).min(best[k][j].0), k))
                .fold((f64::NEG_INFINITY, i + 1), |best, other| if other.0 > best.0 { other } else { best });
        }
    }
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i < 2 {
            continue;
        }
        let k = best[i][j].1;
        triangles.push([polygon[i], polygon[k], polygon[j]]);
        open.extend([(i, k), (k, j)]);
    }
}
