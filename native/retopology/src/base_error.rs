//! Why there is no base triangulation.

use mesh::Cancelled;
use solve::SolveError;

/// What was wrong with the input of [`crate::build::build_base`], or where it stopped. Elements are indices into the input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RetopologyError {
    /// The caller cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// No triangle at all.
    #[error("the mesh has no faces: choose an object with a surface")]
    Empty,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are {vertices} vertices")]
    VertexOutOfRange {
        /// The triangle.
        triangle: u32,
        /// The vertex.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// Positions that are NaN or infinite.
    #[error("{} vertices have no finite position, the first is {}: delete or move them", .vertices.len(), .vertices[0])]
    NotFinite {
        /// The vertices.
        vertices: Vec<u32>,
    },
    /// Triangles that name a vertex twice.
    #[error("{} triangles have two corners at one vertex, the first is {}: dissolve degenerate faces", .triangles.len(), .triangles[0])]
    RepeatedCorners {
        /// The triangles.
        triangles: Vec<u32>,
    },
    /// Triangles with the same three vertices.
    #[error("triangles {} and {} have the same corners, as have {} pairs in all: delete one of each", .pairs[0][0], .pairs[0][1], .pairs.len())]
    DuplicateTriangles {
        /// Pairs of triangles.
        pairs: Vec<[u32; 2]>,
    },
    /// Edges with more than two triangles.
    #[error("{} edges have more than two faces, the first joins vertices {} and {}: separate the sheets", .edges.len(), .edges[0][0], .edges[0][1])]
    NonManifoldEdges {
        /// Vertex pairs.
        edges: Vec<[u32; 2]>,
    },
    /// Edges whose two triangles face opposite ways.
    #[error("{} edges join faces that face opposite ways, the first joins vertices {} and {}: recalculate normals; a Möbius strip cannot be meshed", .edges.len(), .edges[0][0], .edges[0][1])]
    MisorientedEdges {
        /// Vertex pairs.
        edges: Vec<[u32; 2]>,
    },
    /// Vertices where sheets touch in a point.
    #[error("at {} vertices sheets touch in a point, the first is {}: separate them", .vertices.len(), .vertices[0])]
    NonManifoldVertices {
        /// The vertices.
        vertices: Vec<u32>,
    },
    /// Feature edges that are no edges of the mesh.
    #[error("{} feature edges are no edges of the mesh, the first is number {}: mark edges of the surface only", .features.len(), .features[0])]
    FeatureOffSurface {
        /// Indices into the list of feature edges.
        features: Vec<u32>,
    },
    /// Feature edges given twice.
    #[error("{} feature edges are given twice, the first again as number {}: list each edge once", .features.len(), .features[0])]
    FeatureRepeated {
        /// Indices of the second mention in the list of feature edges.
        features: Vec<u32>,
    },
    /// Marked vertices that no triangle uses.
    #[error("{} feature vertices lie on no face, the first is number {}", .features.len(), .features[0])]
    VertexOffSurface {
        /// Indices into the list of feature vertices.
        features: Vec<u32>,
    },
    /// An option is out of its range.
    #[error("the option {option} must be {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// Its range.
        expected: &'static str,
    },
    /// A linear solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A promise of this crate does not hold: a bug.
    #[error("the base triangulation failed while {stage}: {reason}; please report it with the input")]
    Internal {
        /// What it was doing.
        stage: &'static str,
        /// What did not hold.
        reason: &'static str,
    },
}
