//! Marked edges and vertices become a network: chains between corners, closed curves, single points.
//!
//! Daniels et al. 2011, section 4.1, take disjoint curves that meet at end points only. Here any set of edges is such a
//! network once it is cut at its corners, so features never cross: where they meet there is a corner.

use crate::base_error::RetopologyError;
use mesh::{DVec3, NONE, Topology, TriangleMesh, sorted};
use std::collections::BTreeMap;

/// What the artist marked. Borders of the surface are features without being marked.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Features {
    /// Marked edges as vertex pairs.
    pub edges: Vec<[u32; 2]>,
    /// Marked vertices: each becomes a base vertex.
    pub vertices: Vec<u32>,
}

/// A curve of the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Its vertices in order. An open chain runs from corner to corner, both included, which may be the same vertex; a
    /// closed one names each vertex once and has no corner.
    pub vertices: Vec<u32>,
    /// True for a closed curve without a corner.
    pub closed: bool,
    /// True when it lies on a border of the surface.
    pub border: bool,
}

impl Chain {
    /// Its vertices with the first repeated at the end of a closed curve.
    pub fn walk(&self) -> impl Iterator<Item = u32> + '_ {
        self.vertices.iter().copied().chain(self.closed.then(|| self.vertices[0]))
    }
}

/// The marked network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Network {
    /// Curves; every marked or border edge is in exactly one of them.
    pub chains: Vec<Chain>,
    /// Vertices where curves end or turn sharply, ascending.
    pub corners: Vec<u32>,
    /// Marked vertices off the curves, ascending.
    pub points: Vec<u32>,
}

/// Builds the network. A vertex is a corner when other than two features meet there, when it is marked, or when the curve
/// turns by more than `corner_angle` (radians) both between its two edges and between the chords over two edges on either
/// side, so that the zigzag of a curve over a triangle mesh is none. O(n log n).
///
/// # Errors
/// [`RetopologyError::FeatureOffSurface`], [`RetopologyError::FeatureRepeated`], [`RetopologyError::VertexOffSurface`].
pub fn network(
    mesh: &TriangleMesh,
    topology: &Topology,
    features: &Features,
    corner_angle: f64,
) -> Result<Network, RetopologyError> {
    let edges = feature_edges(topology, features)?;
    let unused = |v: u32| topology.outgoing.get(v as usize).is_none_or(|&h| h == NONE);
    let lost: Vec<u32> =
        (0..features.vertices.len() as u32).filter(|&k| unused(features.vertices[k as usize])).collect();
    if !lost.is_empty() {
        return Err(RetopologyError::VertexOffSurface { features: lost });
    }
    let mut neighbours = vec![Vec::new(); mesh.positions.len()];
    for &[a, b] in edges.keys() {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let mut is_corner: Vec<bool> = neighbours.iter().map(|around| !matches!(around.len(), 0 | 2)).collect();
    let mut points: Vec<u32> = Vec::new();
    for &v in &features.vertices {
        is_corner[v as usize] = !neighbours[v as usize].is_empty();
        if neighbours[v as usize].is_empty() {
            points.push(v);
        }
    }
    points.sort_unstable();
    points.dedup();
    let turns: Vec<u32> = (0..mesh.positions.len() as u32)
        .filter(|&v| !is_corner[v as usize] && neighbours[v as usize].len() == 2)
        .filter(|&v| turns_sharply(mesh, &neighbours, &is_corner, v, corner_angle))
        .collect();
    turns.iter().for_each(|&v| is_corner[v as usize] = true);

    let mut left = edges;
    let mut chains = Vec::new();
    let starts = (0..mesh.positions.len() as u32).filter(|&v| is_corner[v as usize]);
    for start in starts {
        for &second in &neighbours[start as usize] {
            if let Some(border) = left.remove(&sorted(start, second)) {
                let vertices = walk(&neighbours, &is_corner, &mut left, start, second);
                chains.push(Chain { vertices, closed: false, border });
            }
        }
    }
    while let Some((&[start, second], &border)) = left.first_key_value() {
        left.remove(&[start, second]);
        let mut vertices = walk(&neighbours, &is_corner, &mut left, start, second);
        vertices.pop();
        chains.push(Chain { vertices, closed: true, border });
    }
    let corners = (0..mesh.positions.len() as u32).filter(|&v| is_corner[v as usize]).collect();
    Ok(Network { chains, corners, points })
}

/// Marked and border edges, and whether each is a border.
fn feature_edges(topology: &Topology, features: &Features) -> Result<BTreeMap<[u32; 2], bool>, RetopologyError> {
    let (mut edges, mut off, mut repeated) = (BTreeMap::new(), Vec::new(), Vec::new());
    for (k, &[a, b]) in features.edges.iter().enumerate() {
        let on = |v: u32| (v as usize) < topology.outgoing.len();
        let found = (on(a) && on(b) && a != b).then(|| topology.find(a, b).or_else(|| topology.find(b, a))).flatten();
        match found {
            None => off.push(k as u32),
            Some(h) => {
                if edges.insert(sorted(a, b), topology.is_border(h)).is_some() {
                    repeated.push(k as u32);
                }
            }
        }
    }
    if !off.is_empty() {
        return Err(RetopologyError::FeatureOffSurface { features: off });
    }
    if !repeated.is_empty() {
        return Err(RetopologyError::FeatureRepeated { features: repeated });
    }
    for h in (0..topology.len() as u32).filter(|&h| topology.is_border(h)) {
        edges.insert(sorted(topology.from(h), topology.to(h)), true);
    }
    Ok(edges)
}

/// Follows a curve from `start` over `second` to the next corner or back to `start`.
fn walk(
    neighbours: &[Vec<u32>],
    is_corner: &[bool],
    left: &mut BTreeMap<[u32; 2], bool>,
    start: u32,
    second: u32,
) -> Vec<u32> {
    let mut vertices = vec![start, second];
    let (mut before, mut at) = (start, second);
    while !is_corner[at as usize] && at != start {
        let next = if neighbours[at as usize][0] == before { neighbours[at as usize][1] } else { neighbours[at as usize][0] };
        left.remove(&sorted(at, next));
        vertices.push(next);
        (before, at) = (at, next);
    }
    vertices
}

fn turns_sharply(mesh: &TriangleMesh, neighbours: &[Vec<u32>], is_corner: &[bool], v: u32, limit: f64) -> bool {
    let at = |v: u32| mesh.positions[v as usize];
    let &[a, b] = &neighbours[v as usize][..] else { return false };
    let beyond = |first: u32| {
        if is_corner[first as usize] {
            return first;
        }
        neighbours[first as usize].iter().copied().find(|&w| w != v).unwrap_or(first)
    };
    let turn = |p: DVec3, q: DVec3| (at(v) - p).angle_between(q - at(v));
    let sharp = |angle: f64| angle > limit;
    sharp(turn(at(a), at(b))) && sharp(turn(at(beyond(a)), at(beyond(b))))
}
