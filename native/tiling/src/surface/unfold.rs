//! A first shape in space for a mesh that is known by its combinatorics alone.
//!
//! Distances walked along the mesh, over edges and the diagonals of squares, are nearly those of its regular shape as long as
//! that does not bend sharply. Multidimensional scaling finds places with these distances: the three greatest eigenvectors
//! of their centred squares, for some landmarks far from one another; all other vertices are placed by their distances from
//! these (landmark scaling: de Silva and Tenenbaum, Sparse multidimensional scaling using landmark points, 2004). A tube so
//! becomes round and a wedge glued shut a cone.

use super::SurfaceError;
use mesh::{DVec3, Monitor};
use solve::eigen::greatest_eigenvectors;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Most landmarks.
const LANDMARKS: usize = 120;

/// Lengths of edges and diagonals, in 1/1000 of an edge, so that distances are exact whatever the order of their sums.
const EDGE: u64 = 1000;
const DIAGONAL: u64 = 1414;

/// Places of the vertices, edges about 1 long; each component on its own, side by side.
pub(super) fn from_distances(tiles: &[Vec<u32>], count: usize, monitor: &Monitor) -> Result<Vec<DVec3>, SurfaceError> {
    let mut near: Vec<BTreeMap<u32, u64>> = vec![BTreeMap::new(); count];
    for tile in tiles {
        for i in 0..tile.len() {
            for j in 0..tile.len() {
                let is_diagonal = tile.len() == 4 && (i + 2) % 4 == j;
                if i != j {
                    let length = if is_diagonal { DIAGONAL } else { EDGE };
                    let known = near[tile[i] as usize].entry(tile[j]).or_insert(length);
                    *known = length.min(*known);
                }
            }
        }
    }
    let mut positions = vec![DVec3::ZERO; count];
    let mut is_placed = vec![false; count];
    let mut shift = 0.0;
    while let Some(start) = is_placed.iter().position(|placed| !placed) {
        let reached = walked(&near, start);
        let members: Vec<usize> = (0..count).filter(|&v| reached[v].is_some()).collect();
        let places = placed(&near, &members, monitor)?;
        let (low, high) = places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.x), h.max(p.x)));
        for (&v, p) in members.iter().zip(&places) {
            positions[v] = *p + (shift - low) * DVec3::X;
            is_placed[v] = true;
        }
        shift += high - low + 1.0;
    }
    Ok(facing_out(tiles, positions))
}

/// Distance of each vertex from one; `None` where there is no way.
fn walked(near: &[BTreeMap<u32, u64>], from: usize) -> Vec<Option<u64>> {
    let mut distance = vec![None; near.len()];
    let mut waiting = BinaryHeap::from([Reverse((0, from))]);
    while let Some(Reverse((here, v))) = waiting.pop() {
        if distance[v].is_some() {
            continue;
        }
        distance[v] = Some(here);
        waiting.extend(near[v].iter().map(|(&w, &length)| Reverse((here + length, w as usize))));
    }
    distance
}

/// Places for the vertices of one component.
fn placed(near: &[BTreeMap<u32, u64>], members: &[usize], monitor: &Monitor) -> Result<Vec<DVec3>, SurfaceError> {
    // Landmarks: each the farthest from those before.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut landmarks = vec![0];
    let mut least = vec![f64::INFINITY; members.len()];
    loop {
        monitor.check()?;
        let distance = walked(near, members[landmarks[landmarks.len() - 1]]);
        let row: Vec<f64> = members.iter().map(|&v| distance[v].map_or(0.0, |d| d as f64 / EDGE as f64)).collect();
        for (least, &d) in least.iter_mut().zip(&row) {
            *least = d.min(*least);
        }
        rows.push(row);
        let farthest = (0..members.len()).max_by(|&a, &b| least[a].total_cmp(&least[b]).then(b.cmp(&a)));
        match farthest.filter(|&v| least[v] > 0.0 && landmarks.len() < LANDMARKS) {
            Some(v) => landmarks.push(v),
            None => break,
        }
    }
    let n = landmarks.len();
    let square = |i: usize, v: usize| rows[i][v].powi(2);
    let mean: Vec<f64> = (0..n).map(|i| landmarks.iter().map(|&v| square(i, v)).sum::<f64>() / n as f64).collect();
    let whole = mean.iter().sum::<f64>() / n as f64;
    let centred = |i: usize, j: usize| -0.5 * (square(i, landmarks[j]) - mean[i] - mean[j] + whole);
    let axes = greatest_eigenvectors(n, centred, n.min(3))?;
    // The place along an axis of any vertex, from its distances to the landmarks.
    let at = |v: usize| {
        let mut p = DVec3::ZERO;
        for (axis, (value, vector)) in axes.iter().enumerate() {
            if *value > 1e-9 {
                let sum: f64 = (0..n).map(|i| vector[i] * (square(i, v) - mean[i])).sum();
                p[axis] = -0.5 * sum / value.sqrt();
            }
        }
        p
    };
    Ok((0..members.len()).map(at).collect())
}

/// Mirrored where the faces would look inwards.
fn facing_out(tiles: &[Vec<u32>], mut positions: Vec<DVec3>) -> Vec<DVec3> {
    let centre = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
    let mut volume = 0.0;
    for tile in tiles {
        for k in 1..tile.len() - 1 {
            let [a, b, c] = [tile[0], tile[k], tile[k + 1]].map(|v| positions[v as usize] - centre);
            volume += a.cross(b).dot(c);
        }
    }
    if volume < 0.0 {
        for p in &mut positions {
            p.z = -p.z;
        }
    }
    positions
}
