//! A schedule in a few numbers.

use super::Schedule;
use serde::Serialize;

/// Counts, and how regular and flat the panels are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// All panels.
    pub panels: usize,
    /// Panels of three corners.
    pub triangles: usize,
    /// Panels of four corners.
    pub quads: usize,
    /// Types of panels.
    pub types: usize,
    /// Mean length of the edges, scene units.
    pub edge_length_mean: f64,
    /// Standard deviation of the lengths over their mean.
    pub edge_length_spread: f64,
    /// Mean planarity of the quads; 0 without quads.
    pub planarity_mean: f64,
    /// Greatest planarity.
    pub planarity_max: f64,
}

impl Schedule {
    /// Sums up. O(n).
    pub fn summary(&self) -> Summary {
        let quads: Vec<f64> =
            self.panels.iter().filter(|panel| panel.nodes.len() == 4).map(|panel| panel.planarity).collect();
        let count = self.edges.len() as f64;
        // Divided first: the sum of huge lengths may be no number.
        let mean = self.edges.iter().map(|edge| edge.length / count).sum::<f64>();
        let variance = self.edges.iter().map(|edge| (edge.length / mean - 1.0).powi(2) / count).sum::<f64>();
        Summary {
            panels: self.panels.len(),
            triangles: self.panels.len() - quads.len(),
            quads: quads.len(),
            types: self.types.len(),
            edge_length_mean: mean,
            edge_length_spread: variance.sqrt(),
            planarity_mean: quads.iter().fold(0.0, |sum, planarity| sum + planarity) / quads.len().max(1) as f64,
            planarity_max: quads.iter().copied().fold(0.0, f64::max),
        }
    }
}
