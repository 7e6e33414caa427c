//! A border or a marked line of the surface, along which vertices slide.

use mesh::DVec3;

/// How many segments on either side of the last one are searched for the nearest point: a vertex moves little at a time.
const WINDOW: usize = 24;

/// A polyline; closed when its last point is its first.
pub(super) struct Curve {
    points: Vec<DVec3>,
}

impl Curve {
    pub fn new(points: impl Iterator<Item = DVec3>) -> Self {
        Self { points: points.collect() }
    }

    /// Nearest point on any segment, and that segment.
    pub fn project(&self, p: DVec3) -> (DVec3, usize) {
        self.nearest(p, 0..self.points.len() - 1)
    }

    /// Nearest point on the segments about `hint`.
    pub fn project_near(&self, p: DVec3, hint: usize) -> (DVec3, usize) {
        let count = self.points.len() - 1;
        if count <= 2 * WINDOW + 1 {
            return self.project(p);
        }
        let is_closed = self.points[0] == self.points[count];
        let around = (hint + count - WINDOW)..=(hint + count + WINDOW);
        let inside = around.filter(|&k| is_closed || (count..2 * count).contains(&k));
        self.nearest(p, inside.map(|k| k % count))
    }

    fn nearest(&self, p: DVec3, segments: impl Iterator<Item = usize>) -> (DVec3, usize) {
        let mut best = (f64::INFINITY, self.points[0], 0);
        for k in segments {
            let (a, d) = (self.points[k], self.points[k + 1] - self.points[k]);
            let along = if d == DVec3::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            let q = a + along * d;
            let distance = p.distance_squared(q);
            if distance < best.0 {
                best = (distance, q, k);
            }
        }
        (best.1, best.2)
    }
}
