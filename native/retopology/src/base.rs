//! The base triangulation: a coarse triangle complex laid over the surface, whose edges hold every feature.
//!
//! Source: Daniels et al. 2011, sections 4.2 and 4.3. The surface is cut along the base edges, as 4.3 says, so that every
//! base edge is a path of surface edges and every base triangle a disk of surface triangles.

use mesh::TriangleMesh;

/// An edge of the base triangulation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BaseEdge {
    /// The base vertices it joins.
    pub ends: [u32; 2],
    /// Vertices of [`Base::surface`] along it, from `ends[0]` to `ends[1]`, both included.
    pub path: Vec<u32>,
    /// The feature chain it lies on, if any; borders of open surfaces are features too.
    pub feature: Option<u32>,
}

/// A base triangulation and the surface it lies on.
#[derive(Debug, Clone, Default)]
pub struct Base {
    /// The input surface, its triangles divided where base edges cross them; input vertices come first, unmoved.
    pub surface: TriangleMesh,
    /// The input triangle that each triangle of `surface` is part of.
    pub source: Vec<u32>,
    /// The base triangle that each triangle of `surface` belongs to: a disk for each base triangle.
    pub owner: Vec<u32>,
    /// The vertex of `surface` at each base vertex.
    pub vertices: Vec<u32>,
    /// Base vertices of each base triangle, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// The base edges; no two cross, or meet but at their ends.
    pub edges: Vec<BaseEdge>,
    /// For each base triangle its three edges; edge `k` joins corners `k` and `k + 1`, in either direction.
    pub triangle_edges: Vec<[u32; 3]>,
}
