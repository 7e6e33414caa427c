//! Where thin rhombi may lie: near the outline, so that they can be pushed to the border (section 6).

use crate::plane::Point;
use hashbrown::HashMap;

/// The longest diagonal of a thin rhombus, in edges.
const DIAGONAL: f64 = 1.94;

/// Distances are rounded; points of the plane that differ are farther apart than this on outlines of any size.
const ROUNDING: f64 = 1e-6;

/// The corners of an outline, and how far from the nearest of them a rhombus may begin.
#[derive(Debug)]
pub(crate) struct Fence {
    corners: Vec<[f64; 2]>,
    reach: f64,
    /// Distances of points to the nearest corner, as they were asked for.
    known: HashMap<Point, f64, foldhash::fast::FixedState>,
}

impl Fence {
    /// With a reach of 0, rhombi must touch a corner of the outline.
    pub(crate) fn new(corners: &[Point], reach: f64) -> Self {
        let corners = corners.iter().map(|corner| corner.position()).collect();
        Self { corners, reach, known: HashMap::with_hasher(foldhash::fast::FixedState::with_seed(0)) }
    }

    /// Distance from a point to the nearest corner of the outline.
    pub(crate) fn distance(&mut self, point: Point) -> f64 {
        let corners = &self.corners;
        *self.known.entry(point).or_insert_with(|| {
            let [x, y] = point.position();
            corners.iter().map(|[u, v]| (x - u).hypot(y - v)).fold(f64::INFINITY, f64::min)
        })
    }

    /// True when a rhombus with these corners may lie there.
    pub(crate) fn admits(&mut self, corners: impl Iterator<Item = Point>) -> bool {
        let limit = self.reach + ROUNDING;
        let mut corners = corners;
        corners.any(|corner| self.distance(corner) <= limit)
    }

    /// True when a rhombus with a corner at this point may, for all that its distance says.
    pub(crate) fn may_admit(&mut self, point: Point) -> bool {
        self.distance(point) <= self.reach + DIAGONAL
    }
}
