//! What a boolean gives back.

use mesh::PolygonMesh;
use serde::Serialize;
use std::collections::BTreeMap;

/// The result of [`crate::boolean`].
#[derive(Debug, Clone)]
pub struct Output {
    /// The pure-quad result.
    pub mesh: PolygonMesh,
    /// For each face the input mesh (0 for A, 1 for B) and face it is; `[-1, -1]` when new.
    pub face_source: Vec<[i32; 2]>,
    /// Where each corner's attributes come from.
    pub corner_source: Vec<CornerSource>,
    /// Edges of `mesh` on the intersection curve.
    pub intersection_edges: Vec<[u32; 2]>,
    /// What was done.
    pub report: Report,
}

/// A point of an input face that a corner of the result takes its attributes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerSource {
    /// Input mesh: 0 for A, 1 for B.
    pub mesh: u8,
    /// Face of that mesh.
    pub face: u32,
    /// Weights of the face's four corners, in their order; they sum to 1.
    pub weights: [f64; 4],
}

/// What a boolean did, as numbers.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Faces that are an input's, vertex for vertex.
    pub faces_kept: usize,
    /// New faces.
    pub faces_new: usize,
    /// Kept faces with a vertex moved by the blend.
    pub faces_moved: usize,
    /// Vertices of the new faces whose valence is not four.
    pub irregular_vertices: usize,
    /// Least scaled Jacobian of the new faces.
    pub scaled_jacobian_min: f64,
    /// Mean scaled Jacobian of the new faces.
    pub scaled_jacobian_mean: f64,
    /// Regions remade, with who filled each.
    pub regions: Vec<RegionReport>,
    /// Closed curves of the intersection.
    pub curves: usize,
    /// Quads of each input that the exact boolean leaves whole.
    pub quads_whole: usize,
    /// Attempts that validation rejected, with the reason.
    pub retries: Vec<String>,
    /// Sentences for the artist.
    pub warnings: Vec<String>,
    /// Seconds spent in each stage; the only part of the output that differs between runs.
    pub seconds: BTreeMap<String, f64>,
}

/// One remade region.
#[derive(Debug, Clone, Serialize)]
pub struct RegionReport {
    /// Filler that won.
    pub filler: String,
    /// Quads it made.
    pub quads: usize,
    /// Border loops of the region.
    pub loops: usize,
    /// Score of each filler that delivered; lower is better.
    pub scores: BTreeMap<String, f64>,
    /// Why other fillers did not deliver.
    pub declined: BTreeMap<String, String>,
}
