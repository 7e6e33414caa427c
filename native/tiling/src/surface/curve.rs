//! A border or a marked line of the surface, along which vertices slide.

use mesh::DVec3;

/// How many segments on either side of the last one are searched for the nearest point: a vertex moves little at a time.
const WINDOW: usize = 24;

/// A polyline; closed when its last point is its first.
pub(super) struct Curve {
    points: Vec<DVec3>,
    /// Length up to each point.
    walked: Vec<f64>,
}

/// A point this near to a curve is on it, as a part of the curve's length.
const ON_CURVE: f64 = 1e-9;

/// A curve without its jags, by length: where equal steps along it end.
pub(super) struct Strides {
    /// Up to each of equally many lengths of the curve itself, that along the curve without jags.
    walked: Vec<f64>,
}

/// How finely the mean of a curve is followed, as a part of what it is the mean over.
const FINENESS: f64 = 0.25;

impl Strides {
    pub fn length(&self) -> f64 {
        self.walked[self.walked.len() - 1]
    }

    /// Where `count` equal steps end, the last left out, as fractions of the curve's own length.
    pub fn equal(&self, count: usize) -> Vec<f64> {
        let samples = self.walked.len() - 1;
        let at = |wanted: f64| {
            let k = self.walked.partition_point(|&walked| walked < wanted).clamp(1, samples);
            let [low, high] = [self.walked[k - 1], self.walked[k]];
            let part = if high > low { (wanted - low) / (high - low) } else { 1.0 };
            ((k - 1) as f64 + part) / samples as f64
        };
        (1..count).map(|k| at(self.length() * k as f64 / count as f64)).collect()
    }
}

/// Distance of a point from a segment.
pub(super) fn off_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    let along = ((p - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + along * d)
}

impl Curve {
    pub fn new(points: impl Iterator<Item = DVec3>) -> Self {
        let points: Vec<DVec3> = points.collect();
        let mut walked = vec![0.0; points.len()];
        for k in 1..points.len() {
            walked[k] = walked[k - 1] + points[k - 1].distance(points[k]);
        }
        Self { points, walked }
    }

    pub fn length(&self) -> f64 {
        self.walked[self.walked.len() - 1]
    }

    pub fn is_closed(&self) -> bool {
        self.points[0] == self.points[self.points.len() - 1]
    }

    /// The length along the curve up to a point of a segment.
    pub fn length_at(&self, (point, segment): (DVec3, usize)) -> f64 {
        self.walked[segment] + self.points[segment].distance(point)
    }

    /// The stretch between two points of the curve, as lengths along it, of two the one with a point near `middle`; `None` when they are
    /// not on the curve or nothing is between them. On a closed curve the second length may be larger than that of the curve.
    pub fn stretch(&self, ends: [DVec3; 2], middle: DVec3) -> Option<[f64; 2]> {
        let whole = self.length();
        let found = ends.map(|p| (p, self.project(p)));
        if found.iter().any(|(p, (q, _))| p.distance(*q) > ON_CURVE * whole) {
            return None;
        }
        let [a, b] = found.map(|(_, found)| self.length_at(found));
        let (low, high) = (a.min(b), a.max(b));
        let inner = self.length_at(self.project(middle));
        let stretch =
            if self.is_closed() && !(low..=high).contains(&inner) { [high, low + whole] } else { [low, high] };
        (stretch[1] - stretch[0] > ON_CURVE * whole).then_some(stretch)
    }

    /// A point of the curve moved along it into a stretch, the nearer end of it when it is outside.
    pub fn within(&self, found: (DVec3, usize), [low, high]: [f64; 2]) -> (DVec3, usize) {
        let whole = self.length();
        let at = self.length_at(found);
        // On a closed curve a stretch may run past the end.
        let here = if self.is_closed() && at < low && at + whole - high < low - at { at + whole } else { at };
        if (low..=high).contains(&here) {
            return found;
        }
        self.point_at(here.clamp(low, high))
    }

    /// The point at a length along the curve, which may run on past the end of a closed one, and its segment.
    pub fn point_at(&self, length: f64) -> (DVec3, usize) {
        let to = if length > self.length() { length.rem_euclid(self.length()) } else { length };
        let segment = self.walked.partition_point(|&walked| walked <= to).clamp(1, self.points.len() - 1) - 1;
        let part =
            (to - self.walked[segment]) / (self.walked[segment + 1] - self.walked[segment]).max(f64::MIN_POSITIVE);
        (self.points[segment].lerp(self.points[segment + 1], part), segment)
    }

    /// Lengths along the curve of those of its points that it cannot do without, were it to keep within a distance of itself (Ramer 1972,
    /// Douglas and Peucker 1973), with its ends. O(n log n) on most curves.
    pub fn knots(&self, within: f64) -> Vec<f64> {
        let last = self.points.len() - 1;
        let mut is_knot = vec![false; last + 1];
        (is_knot[0], is_knot[last]) = (true, true);
        // From ends that are one, as of a closed curve, points are measured as from a point.
        let mut open = vec![(0, last)];
        while let Some((a, b)) = open.pop() {
            let far = |k: usize| off_segment(self.points[k], self.points[a], self.points[b]);
            let Some(farthest) = (a + 1..b).max_by(|&j, &k| far(j).total_cmp(&far(k)).then(k.cmp(&j))) else {
                continue;
            };
            if far(farthest) > within {
                is_knot[farthest] = true;
                open.extend([(a, farthest), (farthest, b)]);
            }
        }
        (0..=last).filter(|&k| is_knot[k]).map(|k| self.walked[k]).collect()
    }

    /// The curve by the length of its mean over `reach` on both sides, less towards its ends.
    pub fn strides(&self, reach: f64) -> Strides {
        let whole = self.length();
        let samples = ((whole / (FINENESS * reach)).ceil() as usize).max(2 * self.points.len());
        // Integral of the curve over its length, up to each point.
        let mut summed = vec![DVec3::ZERO; self.points.len()];
        for k in 1..self.points.len() {
            let length = self.walked[k] - self.walked[k - 1];
            summed[k] = summed[k - 1] + length * self.points[k - 1].midpoint(self.points[k]);
        }
        let segment = |t: f64| self.walked.partition_point(|&walked| walked <= t).clamp(1, self.points.len() - 1) - 1;
        let point = |t: f64| {
            let k = segment(t);
            let along = (self.points[k + 1] - self.points[k]).normalize_or_zero();
            self.points[k] + (t - self.walked[k]) * along
        };
        let integral = |t: f64| {
            let k = segment(t);
            summed[k] + (t - self.walked[k]) * self.points[k].midpoint(point(t))
        };
        let mean = |t: f64| {
            let reach = reach.min(t).min(whole - t);
            if reach > 0.0 { (integral(t + reach) - integral(t - reach)) / (2.0 * reach) } else { point(t) }
        };
        let mut walked = vec![0.0; samples + 1];
        let mut last = mean(0.0);
        for k in 1..=samples {
            let here = mean(whole * k as f64 / samples as f64);
            walked[k] = walked[k - 1] + last.distance(here);
            last = here;
        }
        Strides { walked }
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
        let is_closed = self.is_closed();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square, closed, from its first corner.
    fn square() -> Curve {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        Curve::new(corners.into_iter().map(|[x, y]| DVec3::new(x, y, 0.0)))
    }

    #[test]
    fn of_two_stretches_of_a_closed_curve_the_one_with_the_middle_is_taken() {
        let ends = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
        assert_eq!(square().stretch(ends, DVec3::new(1.0, 0.9, 0.0)), Some([1.0, 3.0]));
        assert_eq!(square().stretch(ends, DVec3::new(0.4, 0.0, 0.0)), Some([3.0, 5.0]));
        assert_eq!(square().stretch([ends[0]; 2], DVec3::new(0.4, 0.0, 0.0)), Some([1.0, 5.0]), "all round");
        assert_eq!(square().stretch([ends[0], DVec3::splat(0.5)], ends[1]), None, "a point off the curve");
    }

    #[test]
    fn strides_are_equal_on_a_straight_line_and_pass_over_the_steps_of_a_staircase() {
        let straight = Curve::new([0.0, 0.3, 2.0].into_iter().map(|x| DVec3::new(x, 0.0, 0.0))).strides(0.5);
        assert!((straight.length() - 2.0).abs() < 1e-12);
        assert!(straight.equal(4).iter().zip([0.25, 0.5, 0.75]).all(|(t, wanted)| (t - wanted).abs() < 1e-12));
        // Ten units straight on, then a hundred small steps that lead as far at 45 degrees.
        let step = 0.1 / 2f64.sqrt();
        let stairs =
            (0..=200).map(|k| DVec3::new(10.0 + step * f64::from(k / 2 + k % 2), step * f64::from(k / 2), 0.0));
        let curve = Curve::new(std::iter::once(DVec3::ZERO).chain(stairs));
        let strides = curve.strides(1.0);
        assert!((strides.length() - 20.0).abs() < 0.2, "{}", strides.length());
        let half = strides.equal(2)[0] * curve.length();
        assert!((half - 10.0).abs() < 0.3, "{half}");
    }

    #[test]
    fn points_outside_a_stretch_go_to_its_nearer_end() {
        let curve = square();
        let within = |p: DVec3, stretch| curve.within(curve.project(p), stretch).0;
        assert_eq!(within(DVec3::new(1.0, 0.5, 0.0), [1.25, 2.75]), DVec3::new(1.0, 0.5, 0.0));
        assert_eq!(within(DVec3::new(0.9, 0.0, 0.0), [1.25, 2.75]), DVec3::new(1.0, 0.25, 0.0));
        // Past the end of a closed curve.
        assert_eq!(within(DVec3::new(0.5, 0.0, 0.0), [3.5, 4.25]), DVec3::new(0.25, 0.0, 0.0));
        assert_eq!(within(DVec3::new(0.125, 0.0, 0.0), [3.5, 4.25]), DVec3::new(0.125, 0.0, 0.0));
    }
}
