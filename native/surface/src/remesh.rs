//! Isotropic remeshing of a surface patch with fixed edges: `QuadMixer` (Nuvoli et al. 2019), section 3.2.1, first step.
//!
//! The loop is that of Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", 2004, section 4: split long
//! edges, collapse short ones, flip, relax in the tangent plane, project back. Deviations:
//! - The paper keeps the triangles at the border; here border and fixed *edges* are kept, so that the slivers which the
//!   boolean leaves beside them can go.
//! - The surface is cut along the fixed edges first, and each piece is remeshed on its own, projected to its own triangles
//!   only: at the intersection curve two surfaces meet, and a vertex must not jump from one to the other.
//! - No edge between two fixed vertices is ever made (a *chord*); with [`RemeshOptions::split_chords`] those of the input are
//!   split. So the pieces can be sewn together again without an edge appearing twice, and every triangle has a free corner.

mod passes;
mod piece;

use crate::editable::{Editable, fans};
use mesh::{Cancelled, DVec3, Monitor, NONE, Topology, TriangleMesh};
use piece::Piece;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// How to remesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RemeshOptions {
    /// Rounds of split, collapse, flip and relax. Default 6; from 0 (only chords are split) to some 20.
    pub iterations: u32,
    /// Split every inner edge, not itself fixed, that joins two border or fixed vertices. Default true.
    pub split_chords: bool,
    /// Largest angle between a triangle and the surface below it, radians. Default 60 degrees; below 90.
    pub normal_limit: f64,
}

impl Default for RemeshOptions {
    fn default() -> Self {
        Self { iterations: 6, split_chords: true, normal_limit: 60_f64.to_radians() }
    }
}

/// A remeshed patch.
#[derive(Debug, Clone, PartialEq)]
pub struct Remeshed {
    /// The new triangles. The border and fixed vertices come first, in the order of the input, bit for bit in place.
    pub mesh: TriangleMesh,
    /// Where each input vertex went: the output vertex for border and fixed ones, [`NONE`] for all others.
    pub vertex: Vec<u32>,
    /// For each output triangle an input triangle near its centroid, on the same side of the fixed edges.
    pub source: Vec<u32>,
}

/// Why a patch cannot be remeshed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RemeshError {
    /// One size a vertex is needed.
    #[error("{given} target sizes for {vertices} vertices; give one for each")]
    SizeCount {
        /// Sizes given.
        given: usize,
        /// Vertices there are.
        vertices: usize,
    },
    /// A target edge length must be a positive number.
    #[error("the target edge length at vertex {vertex} is not a positive number")]
    BadSize {
        /// The vertex.
        vertex: u32,
    },
    /// A triangle names a vertex that does not exist, or one twice.
    #[error("triangle {triangle} does not have three vertices of the mesh; remove it")]
    BadTriangle {
        /// The triangle.
        triangle: u32,
    },
    /// A position is infinite or not a number.
    #[error("the position of vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// A fixed edge is not an edge of the mesh.
    #[error("fixed edge {edge} is not an edge of the mesh")]
    NoSuchEdge {
        /// Index into the list of fixed edges.
        edge: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Remeshes a patch towards the edge length `size`, given at each input vertex in scene units and interpolated between.
///
/// Border edges (those without a single partner) and `fixed_edges` (vertex pairs) are never split, collapsed or flipped,
/// and their vertices never move; all other vertices may go. The result has the Euler characteristic of the input and is
/// as manifold. An operation that would turn a triangle away from the surface or make a needle is refused, unless what it
/// replaces is worse. Pieces between fixed edges are remeshed in parallel, with the same result on any number of threads.
///
/// Costs O(n log n) an iteration, for n the larger of input and output.
///
/// # Errors
/// [`RemeshError`] for unusable input, and when cancelled.
pub fn remesh(
    surface: &TriangleMesh,
    fixed_edges: &[[u32; 2]],
    size: &[f64],
    options: &RemeshOptions,
    monitor: &Monitor,
) -> Result<Remeshed, RemeshError> {
    check_input(surface, size)?;
    let twin = cut_twins(surface, fixed_edges)?;
    let (corners, vertex_of) = fans(&surface.triangles, &twin);
    let is_fixed = fixed_fans(&corners, &twin, &vertex_of, surface.positions.len());
    let pieces = components(surface.triangles.len(), &twin);
    let mut scratch = vec![NONE; vertex_of.len()];
    let mut place = vec![NONE; surface.triangles.len()];
    let pieces: Vec<Piece> = pieces
        .iter()
        .map(|triangles| {
            for (local, &t) in triangles.iter().enumerate() {
                place[t as usize] = local as u32;
            }
            let mut fan_of = Vec::new();
            let local_corners: Vec<[u32; 3]> = triangles
                .iter()
                .map(|&t| {
                    corners[t as usize].map(|fan| {
                        if scratch[fan as usize] == NONE {
                            scratch[fan as usize] = fan_of.len() as u32;
                            fan_of.push(fan);
                        }
                        scratch[fan as usize]
                    })
                })
                .collect();
            let local_twin = triangles
                .iter()
                .flat_map(|&t| (0..3).map(move |k| 3 * t + k))
                .map(|h| match twin[h as usize] {
                    NONE => NONE,
                    g => 3 * place[g as usize / 3] + g % 3,
                })
                .collect();
            let input: Vec<u32> = fan_of.iter().map(|&fan| vertex_of[fan as usize]).collect();
            let editable = Editable::new(
                input.iter().map(|&v| surface.positions[v as usize]).collect(),
                input,
                &local_corners,
                local_twin,
                triangles.clone(),
                surface.positions.len() as u32,
            );
            let fixed = fan_of.iter().map(|&fan| is_fixed[fan as usize]).collect();
            Piece::new(editable, fixed, surface, size, options)
        })
        .collect();
    let pieces: Result<Vec<Piece>, Cancelled> = pieces
        .into_par_iter()
        .map(|mut piece| {
            piece.remesh(options, monitor)?;
            Ok(piece)
        })
        .collect();
    Ok(sew(surface, &pieces?))
}

fn check_input(surface: &TriangleMesh, size: &[f64]) -> Result<(), RemeshError> {
    let vertices = surface.positions.len();
    if size.len() != vertices {
        return Err(RemeshError::SizeCount { given: size.len(), vertices });
    }
    if let Some(vertex) = size.iter().position(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(RemeshError::BadSize { vertex: vertex as u32 });
    }
    if let Some(vertex) = surface.positions.iter().position(|p| !p.is_finite()) {
        return Err(RemeshError::NotFinite { vertex: vertex as u32 });
    }
    let is_bad = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a || a.max(b).max(c) as usize >= vertices;
    match surface.triangles.iter().position(is_bad) {
        Some(triangle) => Err(RemeshError::BadTriangle { triangle: triangle as u32 }),
        None => Ok(()),
    }
}

/// The twins of the surface, without those across fixed edges.
fn cut_twins(surface: &TriangleMesh, fixed_edges: &[[u32; 2]]) -> Result<Vec<u32>, RemeshError> {
    let topology = Topology::of_triangles(surface);
    let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
    let fixed: BTreeSet<[u32; 2]> = fixed_edges.iter().map(|&[a, b]| sorted(a, b)).collect();
    let mut found = BTreeSet::new();
    let mut twin = topology.twin.clone();
    if !fixed.is_empty() {
        for h in 0..topology.len() as u32 {
            let edge = sorted(topology.from(h), topology.to(h));
            if fixed.contains(&edge) {
                found.insert(edge);
                twin[h as usize] = NONE;
            }
        }
    }
    match fixed_edges.iter().position(|&[a, b]| !found.contains(&sorted(a, b))) {
        Some(edge) => Err(RemeshError::NoSuchEdge { edge }),
        None => Ok(twin),
    }
}

/// Fans that must stay: those on a border of the cut surface, and those that share their vertex with another fan.
fn fixed_fans(corners: &[[u32; 3]], twin: &[u32], vertex_of: &[u32], vertices: usize) -> Vec<bool> {
    let mut copies = vec![0_u32; vertices];
    for &v in vertex_of {
        copies[v as usize] += 1;
    }
    let mut fixed: Vec<bool> = vertex_of.iter().map(|&v| copies[v as usize] > 1).collect();
    for (t, corner) in corners.iter().enumerate() {
        for k in 0..3 {
            if twin[3 * t + k] == NONE {
                fixed[corner[k] as usize] = true;
                fixed[corner[(k + 1) % 3] as usize] = true;
            }
        }
    }
    fixed
}

/// Triangles grouped by what can be reached without crossing a cut, in order of their first triangle.
fn components(triangles: usize, twin: &[u32]) -> Vec<Vec<u32>> {
    let mut seen = vec![false; triangles];
    let mut groups = Vec::new();
    for start in 0..triangles as u32 {
        if std::mem::replace(&mut seen[start as usize], true) {
            continue;
        }
        let mut group = vec![start];
        let mut done = 0;
        while let Some(&t) = group.get(done) {
            done += 1;
            for &g in &twin[3 * t as usize..3 * t as usize + 3] {
                if g != NONE && !std::mem::replace(&mut seen[g as usize / 3], true) {
                    group.push(g / 3);
                }
            }
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// Puts the pieces together again at their fixed vertices.
fn sew(surface: &TriangleMesh, pieces: &[Piece]) -> Remeshed {
    let mut vertex = vec![NONE; surface.positions.len()];
    for piece in pieces {
        for (_, input) in piece.fixed_vertices() {
            vertex[input as usize] = 0;
        }
    }
    let mut mesh = TriangleMesh::default();
    for (v, slot) in vertex.iter_mut().enumerate() {
        if *slot == 0 {
            *slot = mesh.positions.len() as u32;
            mesh.positions.push(surface.positions[v]);
        }
    }
    let mut source = Vec::new();
    for piece in pieces {
        let mut output = vec![NONE; piece.mesh.vertex_slots() as usize];
        for (v, input) in piece.fixed_vertices() {
            output[v as usize] = vertex[input as usize];
        }
        for t in piece.mesh.triangles() {
            mesh.triangles.push(piece.mesh.corners(t).map(|v| {
                let slot = &mut output[v as usize];
                if *slot == NONE {
                    *slot = mesh.positions.len() as u32;
                    mesh.positions.push(piece.mesh.positions[v as usize]);
                }
                *slot
            }));
            source.push(piece.nearest_input(t));
        }
    }
    Remeshed { mesh, vertex, source }
}

/// Twice the area times the unit normal.
fn area_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests;
