//! Base vertices before any field is known: corners, breakpoints that divide the curves, and free sites between them.
//!
//! In Daniels et al. 2011 the artist places all sites. Here curves are divided evenly in wanted edge lengths, and the rest of
//! the surface is filled by farthest points, then evened out by moving each to the centre of its cell (Lloyd).

use crate::base_error::RetopologyError;
use crate::features::{Chain, Network};
use crate::metric::Metric;
use crate::split_mesh::SplitMesh;
use mesh::{DVec3, Monitor, NONE};

/// A place is filled when no base vertex is nearer than this many wanted edge lengths.
const REACH: f64 = 0.72;
/// Distance to a curve counts this much more than distance to a vertex: a row of triangles is lower than its edges are long.
const OFF_CURVE: f64 = 1.3;
/// Rounds of moving free sites to the centres of their cells.
const ROUNDS: usize = 5;
/// A curve turns by at most this much between breakpoints, radians.
const LARGEST_TURN: f64 = 1.75;

/// Base vertices that lie on curves, and where.
#[derive(Debug, Clone, Default)]
pub struct Breakpoints {
    /// For each chain the indices of its breakpoints into [`crate::features::Chain::walk`], ascending; the ends of an open
    /// chain are among them, and the first of a closed one stands for its last too.
    pub along: Vec<Vec<usize>>,
}

/// Pieces that a chain must have: enough for its turns, at least three round a closed curve or a loop from a corner to itself.
pub fn least_pieces(mesh: &SplitMesh, chain: &Chain) -> usize {
    let walk: Vec<u32> = chain.walk().collect();
    let at = |k: usize| mesh.positions[walk[k] as usize];
    let turn: f64 = (1..walk.len() - 1).map(|k| (at(k) - at(k - 1)).angle_between(at(k + 1) - at(k))).sum();
    let least = if walk[0] == walk[walk.len() - 1] { 3 } else { 1 };
    // A zigzag turns a lot and gets nowhere: no more pieces than edges.
    ((turn / LARGEST_TURN).ceil() as usize).max(least).min(walk.len() - 1)
}

/// Divides every chain into pieces of about the wanted lengths, and no fewer than [`least_pieces`].
pub fn divide_curves(mesh: &SplitMesh, network: &Network, wanted: &[f64]) -> Breakpoints {
    let along = network.chains.iter().map(|chain| {
        let walk: Vec<u32> = chain.walk().collect();
        let at = |k: usize| mesh.positions[walk[k] as usize];
        let mut reached = vec![0.0];
        for k in 1..walk.len() {
            let size = 0.5 * (wanted[walk[k - 1] as usize] + wanted[walk[k] as usize]);
            reached.push(reached[k - 1] + at(k).distance(at(k - 1)) / size);
        }
        let pieces = (reached[walk.len() - 1].round() as usize).max(least_pieces(mesh, chain)).min(walk.len() - 1);
        divided(&reached, pieces)
    });
    Breakpoints { along: along.collect() }
}

/// Indices nearest to even fractions of the way, strictly rising from 0 to the last; `pieces` is at most their number.
fn divided(reached: &[f64], pieces: usize) -> Vec<usize> {
    let last = reached.len() - 1;
    let mut at = vec![0];
    for piece in 1..pieces {
        let goal = reached[last] * piece as f64 / pieces as f64;
        let k = reached.partition_point(|&r| r < goal);
        let nearest = if k > 0 && goal - reached[k - 1] < reached[k] - goal { k - 1 } else { k };
        // Leave one for each piece before and behind.
        at.push(nearest.clamp(at[piece - 1] + 1, last - (pieces - piece)));
    }
    at.push(last);
    at
}

/// Fills the surface between the vertices in `fixed` with free sites. Every component gets at least one base vertex.
///
/// # Errors
/// Cancelled.
pub fn free_sites(
    mesh: &SplitMesh,
    metric: &Metric,
    network: &Network,
    fixed: &[u32],
    wanted: &[f64],
    monitor: &Monitor,
) -> Result<Vec<u32>, RetopologyError> {
    let n = mesh.positions.len();
    let on_curves: Vec<(u32, f64, u32)> =
        network.chains.iter().flat_map(|c| c.vertices.iter().map(|&v| (v, 0.0, v))).collect();
    let mut off_curve = vec![f64::INFINITY; n];
    metric.spread(&mut off_curve, &mut vec![NONE; n], &on_curves, 1.0);
    let mut used = vec![false; n];
    for &v in &mesh.origin {
        used[v as usize] = true;
    }

    let (mut away, mut cell) = (vec![f64::INFINITY; n], vec![NONE; n]);
    let seeds: Vec<(u32, f64, u32)> = fixed.iter().map(|&v| (v, 0.0, v)).collect();
    metric.spread(&mut away, &mut cell, &seeds, 1.0);
    let mut sites: Vec<u32> = Vec::new();
    loop {
        monitor.check()?;
        let (mut best, mut best_score) = (NONE, REACH);
        for v in (0..n).filter(|&v| used[v]) {
            let score = away[v].min(OFF_CURVE * off_curve[v]) / wanted[v];
            if score > best_score {
                (best, best_score) = (v as u32, score);
            }
        }
        if best == NONE {
            break;
        }
        sites.push(best);
        metric.spread(&mut away, &mut cell, &[(best, 0.0, best)], 1.0);
    }
    let weight = vertex_areas(mesh);
    for _ in 0..ROUNDS {
        monitor.check()?;
        even_out(mesh, metric, fixed, &mut sites, &weight, &off_curve, wanted);
    }
    sites.sort_unstable();
    Ok(sites)
}

/// A third of the triangles round each vertex.
fn vertex_areas(mesh: &SplitMesh) -> Vec<f64> {
    let mut area = vec![0.0; mesh.positions.len()];
    for corners in mesh.origin.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[corners[k] as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        for &v in corners {
            area[v as usize] += third;
        }
    }
    area
}

/// Moves every free site to the vertex of its cell nearest to the cell's centre, as far as it stays off the curves.
fn even_out(
    mesh: &SplitMesh,
    metric: &Metric,
    fixed: &[u32],
    sites: &mut [u32],
    weight: &[f64],
    off_curve: &[f64],
    wanted: &[f64],
) {
    let n = mesh.positions.len();
    let (mut away, mut cell) = (vec![f64::INFINITY; n], vec![NONE; n]);
    let none = sites.len() as u32;
    let seeds: Vec<(u32, f64, u32)> = fixed
        .iter()
        .map(|&v| (v, 0.0, none))
        .chain(sites.iter().enumerate().map(|(k, &v)| (v, 0.0, k as u32)))
        .collect();
    metric.spread(&mut away, &mut cell, &seeds, 1.0);
    let mut centre = vec![(DVec3::ZERO, 0.0); sites.len()];
    for v in 0..n {
        if cell[v] < none {
            // Where shorter edges are wanted, the surface weighs more.
            let mass = weight[v] / wanted[v].powi(2);
            let (sum, total) = &mut centre[cell[v] as usize];
            *sum += mesh.positions[v] * mass;
            *total += mass;
        }
    }
    let mut best = vec![(f64::INFINITY, NONE); sites.len()];
    for v in 0..n {
        if cell[v] < none && OFF_CURVE * off_curve[v] > 0.6 * REACH * wanted[v] {
            let (sum, total) = centre[cell[v] as usize];
            let distance = mesh.positions[v].distance(sum / total);
            if distance < best[cell[v] as usize].0 {
                best[cell[v] as usize] = (distance, v as u32);
            }
        }
    }
    for (site, &(_, vertex)) in sites.iter_mut().zip(&best) {
        if vertex != NONE {
            *site = vertex;
        }
    }
}
