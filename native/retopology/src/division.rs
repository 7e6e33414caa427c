//! Where the vertices along rails lie: on the bends of a feature, evenly elsewhere.
//!
//! Not in the paper, whose curves are smooth and finely sampled. A feature of a CAD part is a coarse polyline: an edge of the
//! quads that cuts across one of its bends leaves it by much, however short the edge, so that bends must become vertices.
//! Between the corners of a rail all vertices are placed together by dynamic programming: each has a few places to
//! choose from near where even division puts it, and the choice weighs how far edges leave the rail against uneven edges.

use crate::base::Base;
use crate::rails::Rails;
use mesh::{DVec3, nearest_on_segment};
use std::f64::consts::PI;
use surface::smooth_star::Polyline;

/// A vertex on a bend of more than this stays there while quads are smoothed: 12 degrees.
const PINNING_TURN: f64 = PI * 12.0 / 180.0;
/// An edge may differ from the direction of its rail by this much; more costs as much as an edge of zero length: 9 degrees.
const MOST_STRAY: f64 = PI * 9.0 / 180.0;
/// An edge that leaves its rail by this fraction of the edge length costs as much as one of zero length.
const TOLERANCE: f64 = 0.04;
/// An edge that leaves its rail by less than this fraction of the edge length follows it wherever its ends are.
const HARDLY: f64 = 0.003;
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
    let off = |p: &DVec3| p.distance(a.lerp(b, nearest_on_segment(*p, a, b)));
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

    /// The point of a closed line at which it turns most.
    fn sharpest(&self) -> DVec3 {
        let n = self.points.len() - 1;
        let turn = |i: usize| {
            let (before, at, after) = (self.points[(i + n - 1) % n], self.points[i], self.points[i + 1]);
            if before == at || at == after { 0.0 } else { (at - before).angle_between(after - at) }
        };
        self.points[(0..n).fold(0, |best, i| if turn(i) > turn(best) + 1e-9 { i } else { best })]
    }

    /// A closed line started elsewhere.
    fn from(&self, start: f64) -> Self {
        let first = self.arc.partition_point(|&a| a <= start);
        let split = self.polyline.at(start);
        let mut points = vec![split];
        points.extend(&self.points[first..]);
        points.extend(&self.points[1..first]);
        points.push(split);
        Self::new(points)
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

/// Divides all rails. `even` gives the arc lengths, from the start of a base edge, of the points that divide it evenly;
/// `edge_lengths` what is wanted along each rail otherwise.
pub(crate) fn divide(base: &Base, rails: &Rails, even: &dyn Fn(u32) -> Vec<f64>, edge_lengths: &[f64]) -> Division {
    let mut division = Division {
        of_vertex: vec![None; base.vertices.len()],
        of_edge: vec![Vec::new(); base.edges.len()],
        vertex_stays: vec![false; base.vertices.len()],
        edge_stays: vec![Vec::new(); base.edges.len()],
    };
    for ((steps, points), &edge_length) in rails.steps.iter().zip(&rails.points).zip(edge_lengths) {
        let mut wanted = vec![0.0];
        let mut start = 0.0;
        for step in steps {
            let path = &base.edges[step.edge as usize].path;
            let at = |v: u32| base.surface.positions[v as usize];
            let length: f64 = path.windows(2).map(|w| at(w[0]).distance(at(w[1]))).sum();
            let mut inner = even(step.edge);
            if !step.forward {
                inner.reverse();
                for a in &mut inner {
                    *a = length - *a;
                }
            }
            wanted.extend(inner.iter().map(|a| start + a));
            start += length;
            wanted.push(start);
        }
        let line = Line::new(points.clone());
        let chosen = choose(&line, &wanted, &vec![false; wanted.len()], edge_length);
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

/// The vertices of a rail, given in order, put where the edges between them follow it, near where they are; and for each
/// whether an edge at it leaves the rail by more than [`HARDLY`]. Those that `stays` names stay, and the ends of an open rail; a closed
/// one repeats its first. `None` where the vertices are not in order along the rail.
pub(crate) fn settled(
    points: &[DVec3],
    places: &[DVec3],
    stays: &[bool],
    edge_length: f64,
) -> Option<(Vec<DVec3>, Vec<bool>)> {
    let n = places.len().checked_sub(1).filter(|&n| n > 0)?;
    let closed = places[0] == places[n];
    let (line, turn) = if closed {
        // It starts at a vertex that stays, or at the one nearest to its sharpest bend.
        let whole = Line::new(points.to_vec());
        let turn = stays[..n].iter().position(|&stays| stays);
        let (turn, start) = if let Some(turn) = turn {
            (turn, places[turn])
        } else {
            let bend = whole.sharpest();
            let far = |i: usize| places[i].distance_squared(bend);
            ((0..n).fold(0, |best, i| if far(i) < far(best) { i } else { best }), bend)
        };
        (whole.from(whole.polyline.locate(start)), turn)
    } else {
        (Line::new(points.to_vec()), 0)
    };
    // Vertex i of the rail's order is vertex (i + turn) % n of those given, on closed rails.
    let given = |i: usize| if closed { (i + turn) % n } else { i };
    let mut arcs: Vec<f64> = (0..=n).map(|i| line.polyline.locate(places[given(i)])).collect();
    (arcs[0], arcs[n]) = (0.0, line.polyline.length());
    if arcs.windows(2).any(|w| w[0] >= w[1]) {
        return None;
    }
    let stays: Vec<bool> = (0..=n).map(|i| stays[given(i)]).collect();
    let chosen = choose(&line, &arcs, &stays, edge_length);
    let mut bent = vec![false; n + 1];
    for i in 0..n {
        let away = |arcs: &[f64]| line.leaves(arcs[i], arcs[i + 1]).0 > HARDLY * edge_length;
        if away(&arcs) || away(&chosen) {
            (bent[given(i)], bent[given(i + 1)]) = (true, true);
        }
    }
    let mut moved = places.to_vec();
    if bent.contains(&true) {
        // The ends of an open rail stay to the last bit, and so do vertices that stay.
        for i in (0..=n).filter(|&i| !stays[i] && (closed || (i > 0 && i < n))) {
            moved[given(i)] = line.polyline.at(chosen[i]);
        }
    }
    if closed {
        (moved[n], bent[n]) = (moved[0], bent[0]);
    }
    Some((moved, bent))
}

/// The best arc lengths near the wanted ones; the first, the last and those that `stays` names stay.
fn choose(line: &Line, wanted: &[f64], stays: &[bool], edge_length: f64) -> Vec<f64> {
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
        if i + 1 < n && !stays[i] {
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
                    let total = cost + off.powi(3) + uneven + stay;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular polygon of the given corners and side 1, its first corner repeated.
    fn ring(corners: u32) -> Vec<DVec3> {
        let radius = 0.5 / (PI / f64::from(corners)).sin();
        let at = |k: u32| {
            let angle = 2.0 * PI * f64::from(k % corners) / f64::from(corners);
            DVec3::new(angle.cos(), angle.sin(), 0.0) * radius
        };
        (0..=corners).map(at).collect()
    }

    #[test]
    fn vertices_that_slid_off_bends_return_to_them() {
        let points = ring(12);
        let line = Polyline::new(points.clone());
        let mut places: Vec<DVec3> = (0..12).map(|k| line.at(f64::from(k) + 0.3)).collect();
        places.push(places[0]);
        let (moved, bent) = settled(&points, &places, &[false; 13], 1.0).unwrap();
        assert!(bent.iter().all(|&bent| bent));
        for at in &moved {
            assert!(points.iter().any(|p| p.distance(*at) < 1e-9), "{at}");
        }
        assert_eq!(moved[0], moved[12]);
        // One that is held stays, and so does everything on a straight rail.
        let mut stays = [false; 13];
        stays[4] = true;
        assert_eq!(settled(&points, &places, &stays, 1.0).unwrap().0[4], places[4]);
        let straight = [0.0, 3.0].map(|x| DVec3::X * x);
        let uneven = [0.0, 0.7, 2.5, 3.0].map(|x| DVec3::X * x);
        assert_eq!(settled(&straight, &uneven, &[false; 4], 1.0).unwrap(), (uneven.to_vec(), vec![false; 4]));
        places.swap(3, 7);
        assert!(settled(&points, &places, &[false; 13], 1.0).is_none());
    }
}
