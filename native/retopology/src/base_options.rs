//! What the base triangulation can be told.

use crate::base_error::RetopologyError;
use crate::detect;
use crate::features::Crumbs;
use crate::sizing::scaled_area;
use mesh::TriangleMesh;

/// How coarse the base is and where its corners are.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseOptions {
    /// Base vertices that an even base would have, 4 to 100,000; features add more where they need them. Default: 100.
    pub vertices: u32,
    /// Edge length of the quads to come where the density is 1, scene units, positive, where it is known: base edges are not
    /// wanted shorter than [`BaseOptions::least_quads`] of them. [`crate::build::edge_for_faces`] has it for a number of quads. Default: unknown.
    pub final_edge: Option<f64>,
    /// Relative edge length of the quads to come at each vertex, positive; empty for 1 everywhere. Default: empty.
    pub density: Vec<f64>,
    /// Least length wanted of base edges, in edges of the quads to come, 0 to 20. Default: 2.5.
    pub least_quads: f64,
    /// Connected features, and branches of them that end nowhere, are dropped when shorter than this many edges of the quads
    /// to come, 0 to 100; they are in the report. Default: 0.5, for less than half an edge is no edge. Where features have
    /// more ends, forks and sharp bends than one for ten quads to come, curves that run beside others within this are dropped if
    /// that is enough, else longer ones, up to 16 times this, the shortest first: on a scan's hundreds of sharp crumbs nothing else would be left of the quads.
    pub least_feature: f64,
    /// Base edges near curves that run side by side, as a multiple of their distance, 0.5 to 50. Default: 8.
    pub aspect: f64,
    /// How fast the wanted edge length may grow, per unit of distance, 0.1 to 10. Default: 0.8.
    pub gradation: f64,
    /// Curves have a corner where they turn by more than this, radians, 0 to pi. Default: 50 degrees.
    pub corner_angle: f64,
    /// Sharp edges found by their dihedral angle become features too. Default: none.
    pub detect: Option<detect::DetectOptions>,
}

impl Default for BaseOptions {
    fn default() -> Self {
        Self {
            vertices: 100,
            final_edge: None,
            density: Vec::new(),
            least_quads: 2.5,
            least_feature: 0.5,
            aspect: 8.0,
            gradation: 0.8,
            corner_angle: 50_f64.to_radians(),
            detect: None,
        }
    }
}

/// Features have at most one corner for so many quads.
const QUADS_A_CORNER: f64 = 10.0;

impl BaseOptions {
    /// What of the features is too little for the quads to come; `mesh` is in the units of `final_edge`.
    pub(crate) fn crumbs(&self, mesh: &TriangleMesh) -> Crumbs {
        let Some(edge) = self.final_edge else { return Crumbs::NONE };
        let shorter_than = self.least_feature * edge * self.smallest();
        let quads = scaled_area(mesh, |v| self.density.get(v as usize).copied().unwrap_or(1.0)) / edge.powi(2);
        Crumbs { shorter_than, most_corners: (quads / QUADS_A_CORNER) as usize }
    }

    /// The least density.
    pub(crate) fn smallest(&self) -> f64 {
        self.density.iter().copied().reduce(f64::min).unwrap_or(1.0)
    }

    /// `vertices` are those of the mesh.
    pub(crate) fn check(&self, vertices: usize) -> Result<(), RetopologyError> {
        let bad = |option, expected| Err(RetopologyError::BadOption { option, expected });
        if !(4..=100_000).contains(&self.vertices) {
            return bad("vertices", "4 to 100,000");
        }
        if self.final_edge.is_some_and(|edge| !(edge.is_finite() && edge > 0.0)) {
            return bad("final_edge", "above 0");
        }
        if self.density.iter().any(|size| !(size.is_finite() && *size > 0.0))
            || !(self.density.is_empty() || self.density.len() == vertices)
        {
            return bad("density", "positive and finite at every vertex, or none");
        }
        if !(0.0..=20.0).contains(&self.least_quads) {
            return bad("least_quads", "0 to 20");
        }
        if !(0.0..=100.0).contains(&self.least_feature) {
            return bad("least_feature", "0 to 100");
        }
        if !(0.5..=50.0).contains(&self.aspect) {
            return bad("aspect", "0.5 to 50");
        }
        if !(0.1..=10.0).contains(&self.gradation) {
            return bad("gradation", "0.1 to 10");
        }
        if !(0.0..=std::f64::consts::PI).contains(&self.corner_angle) {
            return bad("corner_angle", "0 to pi radians");
        }
        Ok(())
    }
}
