//! Where the edges of any tiling can lie: on main paths between points of the outline (section 3.3.1).
//!
//! Every triangle and square is thought subdivided at the midpoints of its edges; a main path keeps its direction label
//! and runs from one point of the outline (a corner or the midpoint of an edge) to another (Lemma 3.1). Its pieces are
//! halves of edges, heights of triangles, and two kinds of square diagonals. For each pair of outline points the
//! coordinate test asks whether a path of one of the labels can join them, the inside test whether it stays inside, the
//! decomposition test of which pieces it can consist.
//!
//! Deviations: the decomposition has one free parameter, so it is solved by hand instead of by an integer programme; the
//! inside test in a projection is left out when the projected outline crosses itself, where it would reject valid paths;
//! each edge found is tested against the outline in the plane as well.

use crate::boundary::{Boundary, meet};
use crate::plane::{Direction, Point};
use mesh::{Cancelled, Monitor};
use std::collections::BTreeSet;

/// Pieces of a main path with label 0, in coordinates of twice the size, so that midpoints are whole: half an edge, the
/// height of a triangle, the diagonals from a midpoint of a square to the far corner on the left and on the right (the
/// paper's 1-edge, sqrt-3-edge, sqrt-5-edge-a and -b).
const PIECES: [Point; 4] = [Point([1, 0, 0, 0]), Point([0, 2, 0, -1]), Point([1, 2, -1, 0]), Point([0, 2, 1, -2])];

/// An edge: from a point in a direction below 6.
pub(crate) type Edge = (Point, Direction);

/// The edge between a point and its neighbour, written in the one way.
pub(crate) fn edge(from: Point, direction: Direction) -> Edge {
    if direction % 12 < 6 { (from, direction % 12) } else { (from + Point::unit(direction), (direction + 6) % 12) }
}

/// A superset of the edges inside any tiling of an outline, without those of the outline. Costs O(n^2) pairs of outline
/// points, for each as many places as pieces fit between them.
pub(crate) fn possible_edges(boundary: &Boundary, monitor: &Monitor) -> Result<BTreeSet<Edge>, Cancelled> {
    let corners = boundary.points();
    let n = corners.len();
    // Corners and midpoints, at twice the size.
    let doubled: Vec<Point> =
        (0..n).flat_map(|k| [corners[k] + corners[k], corners[k] + corners[(k + 1) % n]]).collect();
    let mut places: BTreeSet<Edge> = BTreeSet::new();
    for label in 0..6 {
        let projected: Vec<[i32; 2]> = doubled.iter().map(|p| projection(*p, label)).collect();
        let is_plain = is_simple(&projected);
        let pieces = PIECES.map(|piece| piece.turned(label));
        for (i, &from) in doubled.iter().enumerate() {
            monitor.check()?;
            for (j, &to) in doubled.iter().enumerate() {
                // Coordinate test: on a line along the projection's axis, and ahead.
                if projected[i][1] != projected[j][1] || projected[i][0] >= projected[j][0] {
                    continue;
                }
                if is_plain && !stays_inside(&projected, i, j) {
                    continue;
                }
                for counts in decompositions((to - from).turned(12 - label)) {
                    place(from, label, &pieces, counts, &mut places);
                }
            }
        }
    }
    let outline: BTreeSet<Edge> = (0..n).map(|k| edge(corners[k], boundary.directions()[k])).collect();
    places.retain(|place| !outline.contains(place) && is_inside(*place, boundary));
    Ok(places)
}

/// Coordinates in the projection in which paths with this label run along the first axis (eq. 2 to 4). Directions 3 to 5
/// run along the second axis of the projection of 0 to 2, which a turn by 90 degrees exchanges.
fn projection(point: Point, label: Direction) -> [i32; 2] {
    let [x1, y1, x2, y2, x3, y3] = point.six();
    match label {
        0 => [x1, y1],
        1 => [x2, y2],
        2 => [y3, -x3],
        3 => [y1, -x1],
        4 => [y2, -x2],
        _ => [-x3, -y3],
    }
}

/// All numbers of pieces that make up a vector with label 0 (at twice the size). Two diagonals of different kinds are as
/// long as an edge's half and two heights together: that is the one freedom.
fn decompositions(vector: Point) -> impl Iterator<Item = [i32; 4]> {
    // As a sum of halves t0, heights t1, left diagonals t2 and right ones t3, the coordinates are
    // (t0 + t2, 2 t1 + 2 t2 + 2 t3, t3 - t2, - t1 - 2 t3).
    let [a, b, c, d] = vector.0;
    let heights_and_diagonals = b / 2;
    let whole = b % 2 == 0;
    (0..=heights_and_diagonals.max(-1)).filter_map(move |left| {
        let right = left + c;
        let counts = [a - left, heights_and_diagonals - left - right, left, right];
        (whole && counts.iter().all(|&count| count >= 0) && d == -counts[1] - 2 * right).then_some(counts)
    })
}

/// Adds every place that an edge can have on a path: after any of the pieces but two halves.
fn place(from: Point, label: Direction, pieces: &[Point; 4], counts: [i32; 4], places: &mut BTreeSet<Edge>) {
    let times = |Point(p): Point, k: i32| Point(p.map(|x| x * k));
    for halves in 0..=counts[0] - 2 {
        for heights in 0..=counts[1] {
            for left in 0..=counts[2] {
                for right in 0..=counts[3] {
                    let before = [halves, heights, left, right];
                    let at = (0..4).fold(from, |at, k| at + times(pieces[k], before[k]));
                    if at.0.iter().all(|x| x % 2 == 0) {
                        places.insert((Point(at.0.map(|x| x / 2)), label));
                    }
                }
            }
        }
    }
}

fn turn([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let [ab, ac] = [b, c].map(|p| [i64::from(p[0] - a[0]), i64::from(p[1] - a[1])]);
    (ab[0] * ac[1] - ab[1] * ac[0]).signum()
}

/// True when two segments cross at inner points of both.
fn cross([a, b]: [[i32; 2]; 2], [c, d]: [[i32; 2]; 2]) -> bool {
    turn([a, b, c]) * turn([a, b, d]) < 0 && turn([c, d, a]) * turn([c, d, b]) < 0
}

/// True when no two edges of a closed polygon have a point in common but neighbours their corner.
fn is_simple(polygon: &[[i32; 2]]) -> bool {
    let n = polygon.len();
    let between = |[a, b]: [[i32; 2]; 2], p: [i32; 2]| {
        turn([a, b, p]) == 0 && (0..2).all(|k| (a[k].min(b[k])..=a[k].max(b[k])).contains(&p[k]))
    };
    let segment = |k: usize| [polygon[k], polygon[(k + 1) % n]];
    (0..n).all(|i| {
        (i + 2..n).all(|j| {
            let (s, t) = (segment(i), segment(j));
            let touch = s.iter().any(|&p| between(t, p)) || t.iter().any(|&p| between(s, p));
            (i == 0 && j == n - 1) || !(cross(s, t) || touch)
        })
    })
}

/// True when the segment between two points of a polygon crosses none of its edges. Segments outside pass as well; the
/// edges on them are sorted out in the plane.
fn stays_inside(polygon: &[[i32; 2]], i: usize, j: usize) -> bool {
    let n = polygon.len();
    (0..n).all(|k| !cross([polygon[i], polygon[j]], [polygon[k], polygon[(k + 1) % n]]))
}

/// True when an edge that is not the outline's runs inside it, touching it at its ends at most.
fn is_inside((from, direction): Edge, boundary: &Boundary) -> bool {
    let to = from + Point::unit(direction);
    let corners = boundary.points();
    let n = corners.len();
    let ends = |p: Point| p == from || p == to;
    let clear = (0..n).all(|k| {
        let (a, b) = (corners[k], corners[(k + 1) % n]);
        // A neighbour at an end may only come near the edge there: both have length 1 and differ in direction.
        ends(a) || ends(b) || !meet([from, to], [a, b])
    });
    clear && contains(corners, from + to)
}

/// True when a point, given at twice the size, lies inside a polygon and not on it.
fn contains(corners: &[Point], doubled: Point) -> bool {
    let n = corners.len();
    let crossings = (0..n).filter(|&k| {
        let (a, b) = (corners[k] + corners[k], corners[(k + 1) % n] + corners[(k + 1) % n]);
        let (a_above, b_above) = (a.twice_y() > doubled.twice_y(), b.twice_y() > doubled.twice_y());
        // The ray to the right is crossed when the point lies left of an edge that goes up, or right of one that goes down.
        a_above != b_above && ((b - a).four_cross(doubled - a).signum() > 0) == b_above
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, Tilings};
    use num_bigint::BigUint;
    use testkit::{outlines, random::Random};

    /// Table 1: the six integers of all pieces; edges are two halves, and the paper's unit is half an edge.
    #[test]
    fn pieces_are_those_of_table_1() {
        let table = [[4, 0, 4, -2, 4, 2], [4, 0, 3, -2, 3, 2], [5, 0, 4, -2, 4, 3], [5, 0, 4, -3, 4, 2]];
        assert_eq!((PIECES[0] + PIECES[0]).six().map(|x| x / 2), table[0]);
        for (piece, six) in PIECES[1..].iter().zip(&table[1..]) {
            assert_eq!(&piece.six().map(|x| x / 2), six);
        }
    }

    #[test]
    fn decompositions_are_all_that_small_counts_make() {
        let total =
            |counts: [i32; 4]| (0..4).fold(Point::ORIGIN, |sum, k| (0..counts[k]).fold(sum, |sum, _| sum + PIECES[k]));
        let all: Vec<[i32; 4]> = (0..256).map(|k| [k % 4, k / 4 % 4, k / 16 % 4, k / 64]).collect();
        for &counts in &all {
            let found: BTreeSet<_> = decompositions(total(counts)).collect();
            assert!(found.contains(&counts));
            assert!(found.iter().all(|&other| total(other) == total(counts)));
            let known = all.iter().filter(|&&other| total(other) == total(counts));
            assert!(known.into_iter().all(|other| found.contains(other)));
        }
    }

    /// Lemma 3.1: whatever the tiling, its edges are among those found.
    #[test]
    fn the_edges_of_all_tilings_are_found() {
        let monitor = Monitor::new();
        let mut random = Random::new(12);
        for k in 0..200 {
            let boundary = Boundary::new(&outlines::random_tileable(3 + k % 30, &mut random)).unwrap();
            let mut found = possible_edges(&boundary, &monitor).unwrap();
            found.extend((0..boundary.code().len()).map(|k| edge(boundary.points()[k], boundary.directions()[k])));
            let mut tilings = Tilings::new(&boundary, &Options::default(), &monitor).unwrap();
            let count: u32 = tilings.count().try_into().unwrap();
            for index in 0..count {
                let tiling = tilings.get(&BigUint::from(index), &monitor).unwrap().unwrap();
                for tile in tiling.tiles {
                    let turn = 12 / tile.kind.corners() as u8;
                    for (k, corner) in tile.corners().enumerate() {
                        assert!(found.contains(&edge(corner, tile.direction + k as u8 * turn)));
                    }
                }
            }
        }
    }
}
