//! The judge: one number for a region's fill, the same for every filler. Lower is better.

use super::{Fill, Region};
use crate::validate::DISTANCE_GOAL;
use mesh::{Cancelled, DVec3, Monitor, PolygonMesh, Topology, TriangleMesh, scaled_jacobian, self_intersections};

/// What one inverted quad or one intersecting pair costs: more than any difference of shape.
const FAULT: f64 = 10.0;

/// Scaled Jacobian below which the worst quad costs extra.
const WANTED_JACOBIAN: f64 = 0.3;

/// Quads up to this many times those wanted cost nothing; beyond, each further time costs this much.
const MOST_QUADS: f64 = 1.5;
const EXCESS_WEIGHT: f64 = 0.3;

/// The judgement of a fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Lower is better.
    pub total: f64,
    /// No inverted quad, no self-intersection, near enough to the surface.
    pub flawless: bool,
}

/// Scores a fill by faults (inverted quads, self-intersections), distance from the surface beyond half the limit,
/// irregular vertices per border edge, quads beyond those wanted, and shape (worst and mean scaled Jacobian).
///
/// # Errors
/// [`Cancelled`].
pub fn score(region: &Region, fill: &Fill, diagonal: f64, monitor: &Monitor) -> Result<Score, Cancelled> {
    let points = region.points(fill);
    let at = |v: u32| points[v as usize];
    let jacobians: Vec<f64> = fill.quads.iter().map(|q| scaled_jacobian(q.map(at))).collect();
    let worst = jacobians.iter().fold(1.0_f64, |a, &b| a.min(b));
    let mean = jacobians.iter().sum::<f64>() / jacobians.len().max(1) as f64;
    let mut faults = jacobians.iter().filter(|&&j| j <= 0.0).count();
    let quads = PolygonMesh::from_polygons(points.clone(), &fill.quads).expect("indices were verified");
    let (triangles, _) = TriangleMesh::from_polygons(&quads);
    faults += self_intersections(&triangles, monitor)?.len();

    // The surface of the quad between its vertices: where its diagonals cross, and the middles of its sides.
    let centre = |q: &[u32; 4]| q.iter().map(|&v| at(v)).sum::<DVec3>() / 4.0;
    let samples = |q: &[u32; 4]| {
        let [a, b, c, d] = q.map(at);
        [centre(q), a.midpoint(b), b.midpoint(c), c.midpoint(d), d.midpoint(a)]
    };
    let distance = fill.quads.iter().flat_map(samples).map(|p| region.under.distance(p)).fold(0.0, f64::max) / diagonal;

    let topology = Topology::new(points.len(), &fill.quads);
    let inner = region.rim_count as u32..points.len() as u32;
    let irregular = inner.map(|v| (topology.around(v).count() as f64 - 4.0).abs()).sum::<f64>();
    let border: usize = region.loops.iter().map(Vec::len).sum();
    // A rim finer than the region makes more quads than its area asks for.
    let wanted = region.expected_quads().max(border as f64 / 2.0);
    let excess = (fill.quads.len() as f64 / wanted - MOST_QUADS).max(0.0);
    let total = FAULT * faults as f64
        + EXCESS_WEIGHT * excess
        + (2.0 * distance / DISTANCE_GOAL - 1.0).max(0.0)
        + irregular / border as f64
        + 4.0 * (1.0 - mean)
        + 5.0 * (WANTED_JACOBIAN - worst).max(0.0);
    Ok(Score { total, flawless: faults == 0 && distance <= DISTANCE_GOAL })
}
