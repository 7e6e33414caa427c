//! How long base edges should be, place by place; and a surface fine enough to hold them.
//!
//! Not in Daniels et al. 2011, where the artist places every site. The wanted length is even but for three things: near
//! curves that run close to one another it is some multiple of their distance, so that base triangles between them do not
//! become needles; on curves that turn it is no more than a given turn takes; and it grows from there no faster than a given
//! slope. It never falls below a few edges of the quads to come, where these are known. Where sizes are painted it follows them in
//! part: a base edge shorter than the quads that are wanted there would force smaller ones.

use crate::base_error::RetopologyError;
use crate::breakpoints::{Course, faces};
use crate::build::BaseOptions;
use crate::features::Network;
use crate::metric::Metric;
use crate::split_mesh::SplitMesh;
use mesh::{Monitor, NONE, TriangleMesh, sorted};
use ordered_float::OrderedFloat;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Surface edges are split until they are at most this fraction of the wanted base edge.
const RESOLUTION: f64 = 0.3;

/// Wanted base edge lengths, in the units of the mesh.
#[derive(Debug, Clone)]
pub struct Sizing {
    /// At each vertex.
    pub wanted: Vec<f64>,
    /// Far from all features, at each vertex.
    even: Vec<f64>,
    /// How fast they grow.
    gradation: f64,
}

/// Base edges are longer than others by this power of how much longer the quads shall be.
const FOLLOWS_DENSITY: f64 = 0.3;

/// Bounds of base edge lengths where the density is 1.
#[derive(Debug, Clone, Copy)]
pub struct Lengths {
    /// Far from all features.
    pub even: f64,
    /// None is wanted below this.
    pub least: f64,
}

/// The edge, where the density is 1, of a triangulation of a surface with this many vertices that is even but for `density`, a
/// relative edge length of the quads at each vertex; empty for 1.
pub fn even_length(mesh: &TriangleMesh, density: &[f64], vertices: u32) -> f64 {
    let area = scaled_area(mesh, |v| longer(density, v));
    (2.0 * area / (3.0_f64.sqrt() * f64::from(vertices))).sqrt()
}

/// Area of a surface in units of the square of the relative edge length `size` at its vertices, scene units squared: so many
/// quads of edges of length 1. O(n).
pub(crate) fn scaled_area(mesh: &TriangleMesh, size: impl Fn(u32) -> f64) -> f64 {
    let mean = |corners: &[u32; 3]| corners.iter().map(|&v| size(v)).sum::<f64>() / 3.0;
    (0..).zip(&mesh.triangles).map(|(t, corners)| mesh.area_normal(t).length() / 2.0 / mean(corners).powi(2)).sum()
}

/// How many times as long as elsewhere base edges are at a vertex.
fn longer(density: &[f64], v: u32) -> f64 {
    density.get(v as usize).map_or(1.0, |size| size.powf(FOLLOWS_DENSITY))
}

/// Finds the wanted base edge lengths. O(n log n).
pub fn wanted_lengths(mesh: &SplitMesh, network: &Network, options: &BaseOptions, lengths: Lengths) -> Sizing {
    let metric = Metric::new(mesh);
    let n = mesh.positions.len();
    let least = |v: u32| lengths.least * options.density.get(v as usize).copied().unwrap_or(1.0);
    let even: Vec<f64> = (0..n as u32).map(|v| (lengths.even * longer(&options.density, v)).max(least(v))).collect();
    let longest = even.iter().copied().fold(0.0, f64::max);
    let mut limits = BTreeMap::<u32, f64>::new();
    let mut limit = |v: u32, length: f64| {
        let limit = limits.entry(v).or_insert(f64::INFINITY);
        *limit = limit.min(length.max(least(v)));
    };
    for facing in faces(mesh, &metric, network) {
        for v in facing.ends {
            limit(v, options.aspect * facing.across);
        }
    }
    for chain in network.chains.iter().filter(|chain| !chain.whole) {
        let course = Course::new(mesh, chain, longest);
        for (&v, longest) in course.walk.iter().zip(course.longest_pieces()) {
            limit(v, longest);
        }
    }
    let mut wanted = even.clone();
    let seeds: Vec<(u32, f64, u32)> = limits.into_iter().map(|(v, limit)| (v, limit, 0)).collect();
    metric.spread(&mut wanted, &mut vec![0; n], &seeds, options.gradation);
    Sizing { wanted, even, gradation: options.gradation }
}

/// Edges to be split, as their ends; the most oversized first.
type Oversized = BinaryHeap<(OrderedFloat<f64>, Reverse<[u32; 2]>)>;

/// Splits edges at their midpoints until they are short against the wanted base edges, and puts the new vertices of curves
/// into their chains. At most `budget` splits: what is left then is coarser than it should be, never wrong.
///
/// # Errors
/// Cancelled.
pub fn refine(
    mesh: &mut SplitMesh,
    network: &mut Network,
    sizing: &mut Sizing,
    budget: usize,
    monitor: &Monitor,
) -> Result<(), RetopologyError> {
    let Sizing { wanted, even, gradation } = sizing;
    let mut queue = BinaryHeap::new();
    let whole: BTreeSet<[u32; 2]> = network
        .chains
        .iter()
        .filter(|chain| chain.whole)
        .flat_map(|chain| chain.vertices.windows(2).map(|pair| sorted(pair[0], pair[1])))
        .collect();
    let consider = |queue: &mut Oversized, mesh: &SplitMesh, wanted: &[f64], h: u32| {
        let (a, b) = (mesh.from(h), mesh.to(h));
        let ratio = mesh.length(h) / wanted[a as usize].min(wanted[b as usize]);
        if ratio > RESOLUTION && !whole.contains(&sorted(a, b)) {
            queue.push((OrderedFloat(ratio), Reverse(sorted(a, b))));
        }
    };
    for h in 0..mesh.origin.len() as u32 {
        if mesh.twin[h as usize] == NONE || mesh.twin[h as usize] > h {
            consider(&mut queue, mesh, wanted, h);
        }
    }
    let mut middles = BTreeMap::new();
    let mut splits = 0;
    while let Some((_, Reverse([a, b]))) = queue.pop() {
        if splits == budget {
            break;
        }
        splits += 1;
        if splits.is_multiple_of(1024) {
            monitor.check()?;
        }
        // Each edge is queued once, when it comes into being, and splits only end the one they split.
        let Some(h) = mesh.find(a, b) else { continue };
        let length = mesh.length(h);
        let m = mesh.split(h, 0.5);
        middles.insert([a, b], m);
        let from_ends = wanted[a as usize].min(wanted[b as usize]) + *gradation * length / 2.0;
        even.push(f64::midpoint(even[a as usize], even[b as usize]));
        wanted.push(from_ends.min(even[m as usize]));
        let born: Vec<u32> = mesh.around(m).flat_map(|h| [h, crate::split_mesh::prev(h)]).collect();
        let mut ends: Vec<[u32; 2]> = born.iter().map(|&h| sorted(mesh.from(h), mesh.to(h))).collect();
        ends.sort_unstable();
        ends.dedup();
        for [a, b] in ends {
            if let Some(h) = mesh.find(a, b) {
                consider(&mut queue, mesh, wanted, h);
            }
        }
    }
    for chain in &mut network.chains {
        let walk: Vec<u32> = chain.walk().collect();
        let mut vertices = vec![walk[0]];
        for pair in walk.windows(2) {
            subdivided(&middles, pair[0], pair[1], &mut vertices);
        }
        if chain.closed {
            vertices.pop();
        }
        chain.vertices = vertices;
    }
    Ok(())
}

/// Appends the vertices of the split edge from `a`, excluded, to `b`.
fn subdivided(middles: &BTreeMap<[u32; 2], u32>, a: u32, b: u32, to: &mut Vec<u32>) {
    if let Some(&m) = middles.get(&sorted(a, b)) {
        subdivided(middles, a, m, to);
        subdivided(middles, m, b, to);
    } else {
        to.push(b);
    }
}
