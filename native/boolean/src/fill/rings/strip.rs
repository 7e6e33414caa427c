//! An annulus laid out as a strip of period one: the angle, and the height from one border loop (0) to the other (1).
//!
//! Both coordinates are harmonic with equal weights on all edges (W. Tutte, `How to draw a graph`, 1963), on the surface's
//! triangles and on the quads alike, so that rows of quads become level lines. Points go from one to the other by it.

use super::because;
use crate::fill::Declined;
use glam::DVec2;
use mesh::{DVec3, Monitor, Topology, TriangleMesh};
use solve::cholesky::Factor;
use std::collections::VecDeque;
use surface::parametrize::Flat;

/// Part of a border's angle that is given by arc length, the rest by the harmonic angle: bays of the border, where the
/// harmonic angle hardly moves, keep some room.
const BY_LENGTH: f64 = 0.5;

/// A vertex, and how many turns it is away from where the vertex was laid first.
pub type Lifted = (u32, i32);

/// A border loop as walked in the strip.
#[derive(Debug, Clone)]
pub struct Walk {
    /// Its vertices.
    pub vertices: Vec<u32>,
    /// Their angles, in turns, rising (or falling) by one turn round the loop.
    pub angles: Vec<f64>,
}

/// The surface laid over the strip.
#[derive(Debug)]
pub struct Strip {
    /// The lower border, walked with rising angle, and the upper, with falling angle: the surface on the left of both.
    pub walks: [Walk; 2],
    flat: Flat,
    mesh: TriangleMesh,
}

impl Strip {
    /// Lays out an annulus between two border loops, each with the surface on the left.
    pub fn new(mesh: TriangleMesh, loops: [&[u32]; 2], monitor: &Monitor) -> Result<Self, Declined> {
        let topology = Topology::of_triangles(&mesh);
        let count = mesh.positions.len();
        let corners = cut(&mesh, &topology, loops)?;
        let edges = edges_of(&corners);

        let mut fixed = vec![None; count];
        fixed[loops[0][0] as usize] = Some(0.0);
        let free = harmonic(count, &edges, &fixed).map_err(|e| because(monitor, &e))?;
        let walks = [(loops[0], 1.0), (loops[1], -1.0)].map(|(walk, turn)| Walk::new(walk, turn, &free, &mesh));
        let mut angles = vec![None; count];
        let mut heights = vec![None; count];
        for (walk, height) in walks.iter().zip([0.0, 1.0]) {
            let mut natural = free[walk.vertices[0] as usize];
            for (k, &v) in walk.vertices.iter().enumerate() {
                let raw = free[v as usize];
                natural += nearest_turn(raw - natural);
                // The seam's turns are those of the harmonic angle.
                angles[v as usize] = Some(walk.angles[k] + raw - natural);
                heights[v as usize] = Some(height);
            }
        }
        let angle = harmonic(count, &edges, &angles).map_err(|e| because(monitor, &e))?;
        let level = edges.iter().map(|&(a, b, _)| (a, b, 0)).collect::<Vec<_>>();
        let height = harmonic(count, &level, &heights).map_err(|e| because(monitor, &e))?;
        // Each triangle on its own, whole, in three turns.
        let mut uv = Vec::new();
        for turn in [-1, 0, 1] {
            for triangle in &corners {
                let low = triangle.iter().map(|&(v, t)| angle[v as usize] + f64::from(t)).fold(f64::INFINITY, f64::min);
                let back = low.floor() - f64::from(turn);
                uv.extend(
                    triangle
                        .iter()
                        .map(|&(v, t)| DVec2::new(angle[v as usize] + f64::from(t) - back, height[v as usize])),
                );
            }
        }
        let triangles = (0..uv.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Ok(Self { walks, flat: Flat::new(uv, triangles), mesh })
    }

    /// The point of the surface at an angle and a height.
    pub fn point(&self, angle: f64, height: f64) -> DVec3 {
        let place = self.flat.locate(DVec2::new(angle - angle.floor(), height)).expect("the strip is not empty");
        let [a, b, c] = self.mesh.points(place.triangle as usize % self.mesh.triangles.len());
        a * place.weights.x + b * place.weights.y + c * place.weights.z
    }
}

impl Walk {
    /// Angles of a loop: some of the harmonic ones, some by arc length; the mean stays.
    fn new(vertices: &[u32], turn: f64, free: &[f64], mesh: &TriangleMesh) -> Self {
        let n = vertices.len();
        let next = |k: usize| vertices[(k + 1) % n];
        let natural: Vec<f64> =
            (0..n).map(|k| nearest_turn(free[next(k) as usize] - free[vertices[k] as usize])).collect();
        let forward: Vec<f64> = natural.iter().map(|s| (s * turn).max(0.0)).collect();
        let length = |k: usize| mesh.positions[vertices[k] as usize].distance(mesh.positions[next(k) as usize]);
        let lengths: Vec<f64> = (0..n).map(length).collect();
        let totals = [&forward, &lengths].map(|l| l.iter().sum::<f64>().max(f64::MIN_POSITIVE));
        let (mut angle, mut harmonic) = (0.0, free[vertices[0] as usize]);
        let (mut angles, mut shift) = (Vec::with_capacity(n), 0.0);
        for k in 0..n {
            angles.push(angle);
            shift += harmonic - angle;
            harmonic += natural[k];
            angle += turn * ((1.0 - BY_LENGTH) * forward[k] / totals[0] + BY_LENGTH * lengths[k] / totals[1]);
        }
        for angle in &mut angles {
            *angle += shift / n as f64;
        }
        Self { vertices: vertices.to_vec(), angles }
    }
}

fn nearest_turn(step: f64) -> f64 {
    step - step.round()
}

/// The corners of the triangles, cut along a shortest path of edges from the lower loop to the upper: corners left of the
/// path are one turn on.
fn cut(mesh: &TriangleMesh, topology: &Topology, loops: [&[u32]; 2]) -> Result<Vec<Vec<Lifted>>, Declined> {
    let count = mesh.positions.len();
    let mut before = vec![mesh::NONE; count];
    let mut is_end = vec![false; count];
    for &v in loops[1] {
        is_end[v as usize] = true;
    }
    let mut queue: VecDeque<u32> = loops[0].iter().copied().collect();
    for &v in loops[0] {
        before[v as usize] = v;
    }
    let mut end = None;
    while let Some(v) = queue.pop_front() {
        if is_end[v as usize] {
            end = Some(v);
            break;
        }
        for u in topology.neighbours(v) {
            if before[u as usize] == mesh::NONE {
                before[u as usize] = v;
                queue.push_back(u);
            }
        }
    }
    let mut path = vec![end.ok_or_else(|| Declined::Because("the two border loops do not belong together".into()))?];
    while before[path[path.len() - 1] as usize] != path[path.len() - 1] {
        path.push(before[path[path.len() - 1] as usize]);
    }
    path.reverse();
    let mut turns = vec![0; topology.len()];
    for (k, &v) in path.iter().enumerate() {
        let fan: Vec<u32> = topology.around(v).collect();
        // Left of the path: from the edge to the next vertex round to the edge from the one before; at an end, up to
        // the border, or from it.
        let towards = |u: Option<&u32>| u.and_then(|&u| fan.iter().position(|&h| topology.to(h) == u));
        let first = if k + 1 < path.len() { towards(path.get(k + 1)) } else { Some(0) };
        let last = if k > 0 { towards(path.get(k - 1)) } else { Some(0) };
        let (Some(first), Some(last)) = (first, last) else {
            return Err(Declined::Because("the region has no edge path across".into()));
        };
        let mut i = first;
        loop {
            turns[fan[i] as usize] = 1;
            i = (i + 1) % fan.len();
            if i == last {
                break;
            }
        }
    }
    Ok((0..mesh.triangles.len())
        .map(|t| (3 * t..3 * t + 3).map(|h| (topology.origin[h], turns[h])).collect())
        .collect())
}

/// Edges of faces, once for each face: both ends, and the turns from the first to the second.
pub fn edges_of<F: AsRef<[Lifted]>>(faces: &[F]) -> Vec<(u32, u32, i32)> {
    let edge = |f: &[Lifted], k: usize| {
        let (a, b) = (f[k], f[(k + 1) % f.len()]);
        (a.0, b.0, b.1 - a.1)
    };
    faces.iter().map(AsRef::as_ref).flat_map(|f| (0..f.len()).map(move |k| edge(f, k))).collect()
}

/// Values that are, at every vertex not fixed, the mean of the neighbours', less the turns to them. O(n^1.5).
pub fn harmonic(count: usize, edges: &[(u32, u32, i32)], fixed: &[Option<f64>]) -> Result<Vec<f64>, solve::SolveError> {
    let mut number = vec![usize::MAX; count];
    let mut unknowns = 0;
    for v in 0..count {
        if fixed[v].is_none() {
            number[v] = unknowns;
            unknowns += 1;
        }
    }
    let mut triplets = Vec::with_capacity(3 * edges.len());
    let mut right = vec![0.0; unknowns];
    for &(a, b, turn) in edges {
        for (v, u, turn) in [(a as usize, b as usize, f64::from(turn)), (b as usize, a as usize, -f64::from(turn))] {
            if fixed[v].is_some() {
                continue;
            }
            triplets.push((number[v], number[v], 1.0));
            right[number[v]] += turn;
            match fixed[u] {
                Some(value) => right[number[v]] += value,
                None if number[v] > number[u] => triplets.push((number[v], number[u], -1.0)),
                None => {}
            }
        }
    }
    if unknowns > 0 {
        Factor::new(unknowns, &triplets)?.solve(&mut right)?;
    }
    Ok((0..count).map(|v| fixed[v].unwrap_or_else(|| right[number[v]])).collect())
}
