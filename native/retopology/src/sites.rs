//! Free sites: base vertices between the curves.
//!
//! In Daniels et al. 2011 the artist places all sites. Here what curves leave of the surface is filled by farthest points, then
//! evened out by moving each to the centre of its cell (Lloyd).

use crate::base_error::RetopologyError;
use crate::features::Network;
use crate::metric::Metric;
use crate::split_mesh::SplitMesh;
use mesh::{DVec3, Monitor, NONE};

/// A place is filled when no base vertex is nearer than this many wanted edge lengths.
const REACH: f64 = 0.72;
/// Distance to a curve counts this much more than distance to a vertex: a row of triangles is lower than its edges are long.
const OFF_CURVE: f64 = 1.3;
/// Rounds of moving free sites to the centres of their cells.
const ROUNDS: usize = 5;

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
