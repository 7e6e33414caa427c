//! The division of one line into edges: evenly by the wanted edge length, with a vertex at every corner of the line, and
//! as many edges as it takes to stay near it. Not in the paper, whose lines all come divided.

use mesh::{DVec3, nearest_on_segment};

/// Largest distance between a chord and its piece of line, as a part of the piece: seven edges make a circle.
const CHORD_SAG: f64 = 0.12;

/// A vertex of the line is a corner when dividing there leaves less than this part of the distance between chord and
/// line. Half way along a smooth piece it leaves a quarter.
const CORNER_REST: f64 = 0.2;

/// Corners are this far apart, in wanted edges, and from the ends of the line.
const CORNER_DISTANCE: f64 = 0.4;

/// A line with the places where it is divided.
#[derive(Debug, Clone)]
pub struct Division {
    points: Vec<DVec3>,
    /// Arc length up to each point, scene units.
    length: Vec<f64>,
    /// Wanted edges up to each point.
    density: Vec<f64>,
    /// Points that stay vertices, rising: the ends and the corners.
    pins: Vec<usize>,
    /// Number of edges from each pin to the next.
    counts: Vec<usize>,
}

impl Division {
    /// Divides the line through `points`, at each of which `size` is wanted. Uses at least `fewest` edges, and more, up
    /// to twice as many as wanted or 16, while a chord is further than `chord_error` (scene units) from the line.
    ///
    /// Costs O(points) for each edge added.
    pub fn new(points: Vec<DVec3>, size: &[f64], chord_error: f64, fewest: usize) -> Self {
        let (mut length, mut density) = (vec![0.0], vec![0.0]);
        for k in 1..points.len() {
            let step = points[k].distance(points[k - 1]);
            length.push(length[k - 1] + step);
            density.push(density[k - 1] + step * 0.5 * (1.0 / size[k - 1] + 1.0 / size[k]));
        }
        let last = points.len() - 1;
        let count = (density[last].round() as usize).max(fewest);
        let mut division = Self { points, length, density, pins: vec![0, last], counts: vec![count] };
        let most = (2 * count).max(16);
        while division.count() < most {
            let Some((interval, corner)) = division.worst_edge(chord_error) else { break };
            match corner {
                Some(vertex) => division.pin(interval, vertex),
                None => division.counts[interval] += 1,
            }
        }
        division
    }

    /// Number of edges.
    pub fn count(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Edges that the wanted length asks for.
    pub fn wanted(&self) -> f64 {
        self.density[self.density.len() - 1]
    }

    /// One edge more, where they are longest.
    pub fn add_edge(&mut self) {
        let load = |i: usize| self.density_between(i) / (self.counts[i] + 1) as f64;
        let at = (0..self.counts.len()).max_by(|&i, &j| load(i).total_cmp(&load(j)).then(j.cmp(&i)));
        self.counts[at.expect("a line has an interval")] += 1;
    }

    /// Arc-length parameters in (0, 1) of the inner vertices, rising.
    pub fn positions(&self) -> Vec<f64> {
        let whole = self.length[self.length.len() - 1];
        let mut all: Vec<f64> = (0..self.counts.len()).flat_map(|i| self.interval(i).into_iter().skip(1)).collect();
        all.pop();
        all.into_iter().map(|l| l / whole).collect()
    }

    fn density_between(&self, interval: usize) -> f64 {
        self.density[self.pins[interval + 1]] - self.density[self.pins[interval]]
    }

    /// Arc lengths of the vertices from one pin to the next, both included.
    fn interval(&self, interval: usize) -> Vec<f64> {
        let (first, last, count) = (self.pins[interval], self.pins[interval + 1], self.counts[interval]);
        let (from, total) = (self.density[first], self.density_between(interval));
        let mut k = first + 1;
        let inner = (1..count).map(|i| {
            let target = from + total * i as f64 / count as f64;
            while k < last && self.density[k] < target {
                k += 1;
            }
            let (d0, d1) = (self.density[k - 1], self.density[k]);
            let part = if d1 > d0 { ((target - d0) / (d1 - d0)).clamp(0.0, 1.0) } else { 0.0 };
            self.length[k - 1] + part * (self.length[k] - self.length[k - 1])
        });
        let inner: Vec<f64> = inner.collect();
        [self.length[first]].into_iter().chain(inner).chain([self.length[last]]).collect()
    }

    /// The point at an arc length.
    fn at(&self, length: f64) -> DVec3 {
        let k = self.length.partition_point(|&l| l < length).clamp(1, self.length.len() - 1);
        let (l0, l1) = (self.length[k - 1], self.length[k]);
        let part = if l1 > l0 { (length - l0) / (l1 - l0) } else { 0.0 };
        self.points[k - 1].lerp(self.points[k], part)
    }

    /// The point of the line between two arc lengths that is furthest from the chord, and its distance.
    fn furthest(&self, from: f64, to: f64) -> Option<(usize, f64)> {
        let (p, q) = (self.at(from), self.at(to));
        let distance = |k: usize| {
            let point = self.points[k];
            (point - p - (q - p) * nearest_on_segment(point, p, q)).length()
        };
        let first = self.length.partition_point(|&l| l <= from);
        let end = self.length.partition_point(|&l| l < to);
        (first..end).map(|k| (k, distance(k))).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
    }

    /// The interval of the edge that is furthest from the line, beyond what is allowed, and the corner in that edge if it
    /// has one that can be pinned.
    fn worst_edge(&self, chord_error: f64) -> Option<(usize, Option<usize>)> {
        let mut worst = 1.0;
        let mut found = None;
        for interval in 0..self.counts.len() {
            for edge in self.interval(interval).windows(2) {
                let Some((vertex, distance)) = self.furthest(edge[0], edge[1]) else { continue };
                let excess = distance / chord_error.min(CHORD_SAG * (edge[1] - edge[0]));
                if excess > worst {
                    worst = excess;
                    found = Some((interval, edge[0], edge[1], vertex, distance));
                }
            }
        }
        let (interval, from, to, vertex, distance) = found?;
        let here = self.length[vertex];
        let rest = [(from, here), (here, to)].into_iter().filter_map(|(a, b)| self.furthest(a, b)).map(|f| f.1);
        let is_corner = rest.fold(0.0, f64::max) < CORNER_REST * distance;
        let room = |pin: usize| (self.density[vertex] - self.density[pin]).abs() >= CORNER_DISTANCE;
        let has_room = room(self.pins[interval]) && room(self.pins[interval + 1]);
        Some((interval, (is_corner && has_room).then_some(vertex)))
    }

    /// Makes a point a vertex; its interval falls into two with at least as many edges together.
    fn pin(&mut self, interval: usize, vertex: usize) {
        let before = self.counts[interval];
        self.pins.insert(interval + 1, vertex);
        self.counts.insert(interval + 1, 1);
        for i in [interval, interval + 1] {
            self.counts[i] = (self.density_between(i).round() as usize).max(1);
        }
        while self.counts[interval] + self.counts[interval + 1] < before {
            let load = |i: usize| self.density_between(i) / (self.counts[i] + 1) as f64;
            let longer = if load(interval) >= load(interval + 1) { interval } else { interval + 1 };
            self.counts[longer] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Division;
    use mesh::DVec3;
    use std::f64::consts::TAU;

    #[test]
    fn corners_of_a_square_become_vertices() {
        // A square of side 10, twenty points a side, started off a corner; edges of 3.1 would not hit the corners.
        let corner =
            [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 0.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let mut points: Vec<DVec3> =
            corner.windows(2).flat_map(|w| (0..20).map(move |k| w[0].lerp(w[1], f64::from(k) / 20.0))).collect();
        points.rotate_left(7);
        points.push(points[0]);
        let division = Division::new(points.clone(), &vec![3.1; points.len()], 0.05, 4);
        let positions = division.positions();
        assert_eq!(positions.len() + 1, division.count());
        for target in [6.5, 16.5, 26.5, 36.5].map(|l| l / 40.0) {
            assert!(
                positions.iter().any(|p| (p - target).abs() < 1e-9),
                "no vertex at the corner {target}: {positions:?}"
            );
        }
        assert!(positions.is_sorted());
    }

    #[test]
    fn a_circle_is_divided_evenly_and_within_the_chord_error() {
        let points: Vec<DVec3> =
            (0..=360).map(|k| TAU * f64::from(k % 360) / 360.0).map(|a| DVec3::new(a.cos(), a.sin(), 0.0)).collect();
        let division = Division::new(points.clone(), &vec![1.0; points.len()], 0.02, 4);
        // The sagitta of a chord over the angle 2 pi / n is 1 - cos(pi / n).
        let sagitta = |n: usize| 1.0 - (0.5 * TAU / n as f64).cos();
        let count = division.count();
        assert!(sagitta(count) <= 0.0205 && sagitta(count - 1) > 0.0195, "{count} edges");
        let positions = division.positions();
        for (k, p) in positions.iter().enumerate() {
            assert!((p - (k + 1) as f64 / count as f64).abs() < 1e-6);
        }
    }

    #[test]
    fn an_added_edge_goes_where_edges_are_longest() {
        let points: Vec<DVec3> = [(0.0, 0.0), (3.5, 0.0), (3.5, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let mut division = Division::new(points, &[1.2; 3], 0.01, 1);
        assert_eq!((division.count(), division.positions().len()), (4, 3));
        division.add_edge();
        let positions = division.positions();
        assert_eq!(division.count(), 5);
        assert!((positions[3] * 4.5 - 3.5).abs() < 1e-9, "the corner stays: {positions:?}");
    }
}
