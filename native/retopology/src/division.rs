//! Where the vertices along rails lie: on the bends of a feature, evenly elsewhere.
//!
//! Not in the paper, whose curves are smooth and finely sampled. A feature of a CAD part is a coarse polyline: an edge of the
//! quads that cuts across one of its bends leaves it by much, however short the edge, so that bends must become vertices.
//! Between the corners of a rail all vertices are placed together by dynamic programming: each has a few places to
//! choose from near where even division puts it, and the choice weighs how far edges leave the rail against uneven edges.

use crate::base::Base;
use crate::rails::Rails;
use mesh::DVec3;
use std::f64::consts::PI;
use surface::smooth_star::Polyline;

/// A vertex on a bend of more than this stays there while quads are smoothed: 12 degrees.
const PINNING_TURN: f64 = PI * 12.0 / 180.0;
/// An edge may differ from the direction of its rail by this much; more costs as much as an edge of zero length: 9 degrees.
const MOST_STRAY: f64 = PI * 9.0 / 180.0;
/// An edge that leaves its rail by this fraction of the edge length costs as much as one of zero length.
const TOLERANCE: f64 = 0.03;
/// Weight of a vertex's distance from its even place, in edges, squared.
const STAY: f64 = 0.3;

/// Places of the vertices along rails.
#[derive(Debug, Default)]
pub(crate) struct Division {
    /// For each base vertex on a line its place.
    pub of_vertex: Vec<Option<DVec3>>,
    /// For each rail the places inside it, from its first end.
    pub of_edge: Vec<Vec<DVec3>>,
    /// Whether these stay, in the same order.
    pub vertex_stays: Vec<bool>,
    pub edge_stays: Vec<Vec<bool>>,
}

/// The fewest chords between points of a polyline that stay within `error` of it and, those longer than `shortest`, within
/// [`MOST_STRAY`] of its direction, by greedy choice: the index that each ends at. O(n · longest chord).
pub(crate) fn parts(points: &[DVec3], error: f64, shortest: f64) -> Vec<usize> {
    let follows = |part: &[DVec3]| {
        let length = part[0].distance(part[part.len() - 1]);
        leaves(part) <= error && (length <= shortest || strays(part) <= MOST_STRAY)
    };
    let (mut from, mut ends) = (0, Vec::new());
    while from + 1 < points.len() {
        let mut to = from + 1;
        while to + 1 < points.len() && follows(&points[from..=to + 1]) {
            to += 1;
        }
        ends.push(to);
        from = to;
    }
    ends
}

/// How far a polyline leaves the chord between its ends.
fn leaves(points: &[DVec3]) -> f64 {
    let (a, b) = (points[0], points[points.len() - 1]);
    let off = |p: &DVec3| {
        let t = ((*p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        p.distance(a.lerp(b, t))
    };
    points.iter().map(off).fold(0.0, f64::max)
}

/// The greatest angle between a polyline and the chord between its ends, radians.
fn strays(points: &[DVec3]) -> f64 {
    let chord = points[points.len() - 1] - points[0];
    let steps = points.windows(2).map(|w| w[1] - w[0]).filter(|step| step.length_squared() > 0.0);
    if chord.length_squared() > 0.0 { steps.map(|step| step.angle_between(chord)).fold(0.0, f64::max) } else { PI }
}

/// A rail as points with their arc lengths.
struct Line {
    points: Vec<DVec3>,
    arc: Vec<f64>,
    polyline: Polyline,
}

impl Line {
    fn new(points: Vec<DVec3>) -> Self {
        let mut arc = vec![0.0];
        for w in points.windows(2) {
            arc.push(arc[arc.len() - 1] + w[0].distance(w[1]));
        }
        Self { polyline: Polyline::new(points.clone()), points, arc }
    }

    /// How far the rail leaves the chord from one arc length to another, and its direction.
    fn leaves(&self, from: f64, to: f64) -> (f64, f64) {
        let (first, last) = (self.arc.partition_point(|&a| a <= from), self.arc.partition_point(|&a| a < to));
        let mut part = vec![self.polyline.at(from)];
        part.extend(&self.points[first..last.max(first)]);
        part.push(self.polyline.at(to));
        (leaves(&part), strays(&part))
    }

    /// How much the rail turns within a reach of an arc length.
    fn turns(&self, at: f64, reach: f64) -> f64 {
        let inner = 1..self.points.len().saturating_sub(1);
        inner
            .filter(|&i| (self.arc[i] - at).abs() <= reach)
            .map(|i| {
                let (to, from) = (self.points[i + 1] - self.points[i], self.points[i] - self.points[i - 1]);
                if to.length_squared() > 0.0 && from.length_squared() > 0.0 { to.angle_between(from) } else { 0.0 }
            })
            .sum()
    }
}

/// Divides all rails. `even` gives the arc lengths, from the start of a base edge, of the points that divide it evenly.
pub(crate) fn divide(base: &Base, rails: &Rails, even: &dyn Fn(u32) -> Vec<f64>, edge_length: f64) -> Division {
    let mut division = Division {
        of_vertex: vec![None; base.vertices.len()],
        of_edge: vec![Vec::new(); base.edges.len()],
        vertex_stays: vec![false; base.vertices.len()],
        edge_stays: vec![Vec::new(); base.edges.len()],
    };
    for steps in &rails.steps {
        let mut points: Vec<DVec3> = Vec::new();
        let mut wanted = vec![0.0];
        let mut start = 0.0;
        for step in steps {
            let path = &base.edges[step.edge as usize].path;
            let mut own: Vec<DVec3> = path.iter().map(|&v| base.surface.positions[v as usize]).collect();
            let length: f64 = own.windows(2).map(|w| w[0].distance(w[1])).sum();
            let mut inner = even(step.edge);
            if !step.forward {
                own.reverse();
                inner.reverse();
                for a in &mut inner {
                    *a = length - *a;
                }
            }
            points.extend(&own[usize::from(!points.is_empty())..]);
            wanted.extend(inner.iter().map(|a| start + a));
            start += length;
            wanted.push(start);
        }
        let line = Line::new(points);
        let chosen = choose(&line, &wanted, edge_length);
        let stays: Vec<bool> = chosen.iter().map(|&a| line.turns(a, 0.5 * edge_length) > PINNING_TURN).collect();
        let places: Vec<DVec3> = chosen.iter().map(|&a| line.polyline.at(a)).collect();
        let mut at = 0;
        for step in steps {
            let count = even(step.edge).len();
            let (first, last) = (at + 1, at + 1 + count);
            let e = step.edge as usize;
            division.of_edge[e] = places[first..last].to_vec();
            division.edge_stays[e] = stays[first..last].to_vec();
            if !step.forward {
                division.of_edge[e].reverse();
                division.edge_stays[e].reverse();
            }
            at = last;
            if at + 1 < places.len() {
                division.of_vertex[step.to as usize] = Some(places[at]);
                division.vertex_stays[step.to as usize] = stays[at];
            }
        }
    }
    division
}

/// The best arc lengths near the wanted ones; the first and the last stay.
fn choose(line: &Line, wanted: &[f64], edge_length: f64) -> Vec<f64> {
    let n = wanted.len();
    let spacing = |i: usize| match i {
        0 => wanted[1] - wanted[0],
        i if i + 1 == n => wanted[i] - wanted[i - 1],
        i => (wanted[i + 1] - wanted[i - 1]) / 2.0,
    };
    // (place, cost so far, place before), for each vertex.
    let mut rows: Vec<Vec<(f64, f64, usize)>> = vec![vec![(wanted[0], 0.0, 0)]];
    for i in 1..n {
        let gap = spacing(i).max(f64::MIN_POSITIVE);
        let mut places = vec![wanted[i]];
        if i + 1 < n {
            let near = |a: &&f64| (**a - wanted[i]).abs() < 0.8 * gap;
            places.extend(line.arc.iter().filter(near));
            places.extend([-0.4, -0.2, 0.2, 0.4].map(|t| wanted[i] + t * gap));
        }
        let row = places
            .into_iter()
            .map(|place| {
                let stay = STAY * ((place - wanted[i]) / gap).powi(2);
                let mut best = (f64::INFINITY, 0);
                for (k, &(before, cost, _)) in rows[i - 1].iter().enumerate() {
                    let length = place - before;
                    if length <= 0.2 * gap {
                        continue;
                    }
                    let (away, angle) = line.leaves(before, place);
                    let off = (away / (TOLERANCE * edge_length)).max(angle / MOST_STRAY);
                    let uneven = (length / (wanted[i] - wanted[i - 1]).max(f64::MIN_POSITIVE)).ln().powi(2);
                    let total = cost + off * off + uneven + stay;
                    if total < best.0 {
                        best = (total, k);
                    }
                }
                (place, best.0, best.1)
            })
            .filter(|entry| entry.1.is_finite())
            .collect::<Vec<_>>();
        if row.is_empty() {
            // Places so uneven that none can follow: keep the wanted ones.
            return wanted.to_vec();
        }
        rows.push(row);
    }
    let last = &rows[n - 1];
    let mut k = (0..last.len()).fold(0, |best, k| if last[k].1 < last[best].1 { k } else { best });
    let mut chosen = vec![0.0; n];
    for i in (0..n).rev() {
        chosen[i] = rows[i][k].0;
        k = rows[i][k].2;
    }
    chosen
}
