//! What a retopology gives back.

use crate::sources::CornerSource;
use mesh::{DVec3, PolygonMesh};
use serde::Serialize;
use std::collections::BTreeMap;

/// The result of [`crate::retopologize`].
#[derive(Debug, Clone)]
pub struct Output {
    /// The quads.
    pub mesh: PolygonMesh,
    /// The base triangulation as a mesh of straight triangles.
    pub base: PolygonMesh,
    /// Its edges as they lie on the surface.
    pub base_paths: Vec<BasePath>,
    /// Edges of `mesh` on features and borders.
    pub feature_edges: Vec<OutputFeature>,
    /// Where each corner's attributes come from.
    pub corner_source: Vec<CornerSource>,
    /// For each vertex of `mesh` its mirror image, itself on the plane; empty when no symmetry was asked for.
    pub mirror: Vec<u32>,
    /// What was done.
    pub report: Report,
}

/// An edge of the base triangulation on the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct BasePath {
    /// The vertices of the base that it joins.
    pub ends: [u32; 2],
    /// Its points, scene units.
    pub points: Vec<DVec3>,
    /// The feature chain it lies on, if any.
    pub chain: Option<u32>,
}

/// Why an edge is a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FeatureKind {
    /// The caller marked it.
    Marked,
    /// Its dihedral angle was found to be sharp.
    Detected,
    /// It lies on a border of the surface.
    Border,
}

/// An edge of the result that lies on a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutputFeature {
    /// Vertices of the result.
    pub ends: [u32; 2],
    /// Number of the feature chain: edges between the same corners have the same.
    pub chain: u32,
    /// Why it is a feature.
    pub kind: FeatureKind,
    /// The input edge under its middle, as vertices of the input.
    pub input_edge: [u32; 2],
}

/// What was done, as numbers. Counts of a chain's length are in scene units.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Quads.
    pub faces: usize,
    /// Quads asked for, when a number was.
    pub target: Option<usize>,
    /// Edge length aimed at where the density is 1, scene units.
    pub edge_length: f64,
    /// Vertices of the base triangulation.
    pub base_vertices: usize,
    /// Triangles of the base triangulation.
    pub base_triangles: usize,
    /// Base vertices put where no feature asked for one: an even layout needs them, or the topology.
    pub sites_added: usize,
    /// Patches of the layout.
    pub patches: usize,
    /// Those that are as they were before the last edit; 0 when the same mesh and features from the start give the same result.
    pub patches_kept: usize,
    /// Those of a single base triangle.
    pub single_patches: usize,
    /// Patches of the quads' base complex: between the lines of edges that go straight on from irregular vertices.
    pub base_complex: usize,
    /// Inner vertices of the quads whose valence is not 4.
    pub irregular_vertices: usize,
    /// Quads that are turned over.
    pub inverted: usize,
    /// Least scaled Jacobian of the quads.
    pub scaled_jacobian_min: f64,
    /// Its first percentile.
    pub scaled_jacobian_p01: f64,
    /// Its mean.
    pub scaled_jacobian_mean: f64,
    /// Mean deviation of the quads' angles from a right one, degrees.
    pub angle_deviation: f64,
    /// Chains of the feature network, borders among them.
    pub chains: usize,
    /// Length of all features.
    pub feature_length: f64,
    /// The part of it within a twentieth of the mean edge length of an edge of the result.
    pub features_reproduced: f64,
    /// Edges that detection made features.
    pub edges_detected: usize,
    /// Edges of features left out because the features are much shorter than a quad.
    pub edges_dropped: usize,
    /// How far the input is from symmetric, scene units; none when no symmetry was asked for.
    pub symmetry_deviation: Option<f64>,
    /// Base triangles that the last edit made anew; none when all were, so that the same mesh and features from the start
    /// give the same result.
    pub base_triangles_edited: Option<usize>,
    /// Sentences for the artist.
    pub warnings: Vec<String>,
    /// Seconds spent in each stage; the only part of the output that differs between runs.
    pub seconds: BTreeMap<String, f64>,
}
