//! New vertices along chains of mesh edges: the intersection curve and the creases get the number of edges that the plan of
//! the quad mesh asks for, before the surface between is remeshed (`QuadMixer`, Nuvoli et al. 2019, section 3.2).
//!
//! The paper keeps the vertices of the curve as the boolean left them, and resamples later, in the quad patches. Here the
//! chain itself is resampled in the triangle mesh: its edges are split at the samples, then all other vertices of the
//! chain are collapsed along it. Where a collapse would turn a triangle, edges beside the chain are flipped and free
//! vertices removed first; where an edge stands in the way of the link condition, it is split.

mod removal;

use crate::editable::{Editable, fans};
use mesh::{Cancelled, Monitor, NONE, Topology, TriangleMesh};
use removal::Removal;

/// A path of mesh edges and where its new vertices lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The path; closed when the last vertex is the first.
    pub vertices: Vec<u32>,
    /// Arc length from the start, as a fraction of the whole: strictly rising, between 0 and 1. The first and the last
    /// vertex of the path stay beside these.
    pub positions: Vec<f64>,
}

/// A mesh with resampled chains.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// The new mesh: input vertices that remain, in their order, then new ones.
    pub mesh: TriangleMesh,
    /// For each triangle an input triangle it came from, on the same side of every chain.
    pub source: Vec<u32>,
    /// The vertices of each chain in the new mesh, from end to end; the first again at the end of closed ones.
    pub chains: Vec<Vec<u32>>,
    /// Where each input vertex went; [`NONE`] for those that were removed.
    pub vertex: Vec<u32>,
}

/// Why chains cannot be resampled.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ResampleError {
    /// Two vertices in a row are not joined by an edge.
    #[error("chain {chain} is not a path of mesh edges: its step {step} is no edge")]
    NotAPath {
        /// Index of the chain.
        chain: usize,
        /// Index of the first of the two vertices in it.
        step: usize,
    },
    /// Positions must rise strictly between 0 and 1.
    #[error("position {position} of chain {chain} does not lie between its neighbours and within (0, 1)")]
    BadPosition {
        /// Index of the chain.
        chain: usize,
        /// Index into its positions.
        position: usize,
    },
    /// A closed chain needs three samples to stay a loop.
    #[error("closed chain {chain} needs at least 2 positions beside its first vertex")]
    TooFewSamples {
        /// Index of the chain.
        chain: usize,
    },
    /// Chains may meet at their ends only.
    #[error("chain {chain} passes vertex {vertex} again, or another chain does; cut the chains there")]
    Crossing {
        /// Index of the chain.
        chain: usize,
        /// The vertex.
        vertex: u32,
    },
    /// A vertex that has to stay lies on the chain but is not among its samples.
    #[error("vertex {vertex} has to stay, but is no sample of chain {chain}; end a chain there")]
    Kept {
        /// Index of the chain.
        chain: usize,
        /// The vertex.
        vertex: u32,
    },
    /// No sequence of splits, flips and collapses frees the chain.
    #[error("chain {chain} cannot be reduced to its samples without changing the topology; give it more")]
    Topology {
        /// Index of the chain.
        chain: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl ResampleError {
    /// The chain it is about.
    pub fn chain(&self) -> Option<usize> {
        match *self {
            Self::NotAPath { chain, .. }
            | Self::BadPosition { chain, .. }
            | Self::TooFewSamples { chain }
            | Self::Crossing { chain, .. }
            | Self::Kept { chain, .. }
            | Self::Topology { chain } => Some(chain),
            Self::Cancelled(_) => None,
        }
    }
}

/// A sample nearer than this to a vertex of the chain, as a fraction of the chain, is that vertex.
const SNAP: f64 = 1e-9;

/// Gives each chain exactly its samples as vertices. They lie on the old polyline; between them the chain runs straight and
/// may cut corners of the old one, and the triangles beside it follow. Border edges off the chains stay as they are, and
/// the vertices `fixed` neither go nor move. Chains may share their end vertices.
///
/// Costs O(n) for the mesh and about O(k) collapses for k chain vertices.
///
/// # Errors
/// [`ResampleError`], naming the chain, and when cancelled.
pub fn resample_chains(
    mesh: &TriangleMesh,
    chains: &[Chain],
    fixed: &[u32],
    monitor: &Monitor,
) -> Result<Resampled, ResampleError> {
    let topology = Topology::of_triangles(mesh);
    let (corners, vertex_of) = fans(&mesh.triangles, &topology.twin);
    let mut copies = vec![Vec::new(); mesh.positions.len()];
    for (fan, &v) in vertex_of.iter().enumerate() {
        copies[v as usize].push(fan as u32);
    }
    let editable = Editable::new(
        vertex_of.iter().map(|&v| mesh.positions[v as usize]).collect(),
        vertex_of.clone(),
        &corners,
        topology.twin,
        (0..mesh.triangles.len() as u32).collect(),
        mesh.positions.len() as u32,
    );
    let mut removal = Removal::new(editable, copies, mesh, fixed);
    let mut samples = Vec::with_capacity(chains.len());
    for (index, chain) in chains.iter().enumerate() {
        check_positions(index, chain)?;
        removal.claim(index, &chain.vertices)?;
    }
    for chain in chains {
        monitor.check()?;
        samples.push(insert_samples(&mut removal, chain));
    }
    for (index, (path, is_sample)) in samples.iter().enumerate() {
        removal.thread(index, path, is_sample)?;
    }
    for index in 0..samples.len() {
        removal.reduce(index, monitor)?;
    }
    let paths: Vec<Vec<u32>> = samples
        .into_iter()
        .map(|(path, is_sample)| path.into_iter().zip(is_sample).filter(|p| p.1).map(|p| p.0).collect())
        .collect();
    for (chain, path) in paths.iter().enumerate() {
        if path.windows(2).any(|step| removal.edge(step[0], step[1]).is_none()) {
            return Err(ResampleError::Topology { chain });
        }
    }
    Ok(read_out(mesh, &removal.mesh, &paths))
}

fn check_positions(chain: usize, given: &Chain) -> Result<(), ResampleError> {
    let mut last = 0.0;
    for (position, &p) in given.positions.iter().enumerate() {
        if !(p > last && p < 1.0) {
            return Err(ResampleError::BadPosition { chain, position });
        }
        last = p;
    }
    if given.vertices.len() < 2 {
        return Err(ResampleError::NotAPath { chain, step: 0 });
    }
    if given.vertices.first() == given.vertices.last() && given.positions.len() < 2 {
        return Err(ResampleError::TooFewSamples { chain });
    }
    Ok(())
}

/// Splits the edges of a chain at its samples; returns the finer path and which of its vertices are samples.
fn insert_samples(removal: &mut Removal, chain: &Chain) -> (Vec<u32>, Vec<bool>) {
    let old: Vec<u32> = chain.vertices.iter().map(|&v| removal.copy_of(v)).collect();
    let mut arc = vec![0.0];
    for step in old.windows(2) {
        arc.push(arc[arc.len() - 1] + removal.distance(step[0], step[1]));
    }
    let total = arc[arc.len() - 1];
    let (mut path, mut is_sample) = (vec![old[0]], vec![true]);
    let mut wanted = chain.positions.iter().map(|p| p * total).peekable();
    for k in 1..old.len() {
        let is_end = k + 1 == old.len();
        let mut snapped = is_end;
        while let Some(&at) = wanted.peek() {
            if at >= arc[k] + SNAP * total && !is_end {
                break;
            }
            if at > arc[k] - SNAP * total && !is_end {
                // At most one sample is this vertex: another as near is not told apart from it by rounding alone.
                if snapped {
                    break;
                }
                snapped = true;
                wanted.next();
                continue;
            }
            let (from, to) = (path[path.len() - 1], old[k]);
            // All of a chain without length is one point.
            let length = arc[k] - arc[k - 1];
            let fraction = if length > 0.0 { (at - arc[k - 1]) / length } else { 0.0 };
            let place = removal.position(old[k - 1]).lerp(removal.position(old[k]), fraction.clamp(0.0, 1.0));
            path.push(removal.split(from, to, place));
            is_sample.push(true);
            wanted.next();
        }
        path.push(old[k]);
        is_sample.push(snapped);
    }
    (path, is_sample)
}

fn read_out(input: &TriangleMesh, editable: &Editable, paths: &[Vec<u32>]) -> Resampled {
    let inputs = input.positions.len() as u32;
    let mut used = vec![false; input.positions.len()];
    for v in (0..editable.vertex_slots()).filter(|&v| editable.is_live_vertex(v)) {
        if let Some(slot) = used.get_mut(editable.identity[v as usize] as usize) {
            *slot = true;
        }
    }
    let mut mesh = TriangleMesh::default();
    let mut vertex = vec![NONE; used.len()];
    for (v, _) in used.iter().enumerate().filter(|(_, used)| **used) {
        vertex[v] = mesh.positions.len() as u32;
        mesh.positions.push(input.positions[v]);
    }
    let mut output = vec![NONE; editable.vertex_slots() as usize];
    for v in (0..editable.vertex_slots()).filter(|&v| editable.is_live_vertex(v)) {
        let identity = editable.identity[v as usize];
        output[v as usize] = if identity < inputs {
            vertex[identity as usize]
        } else {
            mesh.positions.push(editable.positions[v as usize]);
            mesh.positions.len() as u32 - 1
        };
    }
    let mut source = Vec::new();
    for t in editable.triangles() {
        mesh.triangles.push(editable.corners(t).map(|v| output[v as usize]));
        source.push(editable.source[t as usize]);
    }
    let chains = paths.iter().map(|path| path.iter().map(|&v| output[v as usize]).collect()).collect();
    Resampled { mesh, source, chains, vertex }
}

#[cfg(test)]
mod tests;
