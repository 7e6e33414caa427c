//! The loop nearest to a drawn curve that can be tiled (section 3.4): a search over loops near the best one.
//!
//! Loops are neighbours when they differ by one piece: two edges at a corner change places, which adds or takes a
//! parallelogram, or an edge gives way to the other two of a triangle, or the reverse. From the outline that `fit` cut, the
//! search goes on to the neighbour of least error met so far, through loops without tilings too, for those lie everywhere
//! between. The certificate's defect counts as an error: it must be zero, and where it is, most loops can be tiled. The
//! loop with a tiling and the least error is taken; nothing proves it the nearest of all.
//!
//! The error of a loop is the distance from the curve, integrated over what lies inside one of the two only: half the
//! square of the distance, integrated along the curve. It is measured both ways, and changes by an integral over the
//! piece alone. Deviation: eq. 9 sums the distances of half-edges, which makes short loops and cuts off tips.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::drawn::{Position, signed_distance};
use crate::options::Options;
use crate::plane::{Direction, Point};
use crate::tile::Tiling;
use crate::tilings::find_within;
use mesh::Monitor;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Loops searched for a tiling before the search gives up, and states that each may take.
const MOST_SEARCHES: usize = 60;
const MOST_STATES: usize = 20_000;

/// How far from the curve the corner of a new piece may lie, in edges.
const REACH: f64 = 1.0;

/// What one more of the certificate's defect counts for in the order of the search, in grains: of 20 to 150 million the
/// value that brought ten drawn curves the nearest outlines.
const DEFECT: i64 = 30_000_000;

/// Cells along each side of a piece over which distances are integrated.
const CELLS: usize = 6;

/// Errors are compared as whole multiples of this, in square edges, the same on every machine.
const GRAIN: f64 = 1e-9;

/// A closed loop of unit edges, counter-clockwise.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Loop {
    pub(crate) first: Point,
    pub(crate) directions: Vec<Direction>,
}

impl Loop {
    /// The interior angles in units of 30 degrees.
    pub(crate) fn code(&self) -> Vec<u8> {
        let n = self.directions.len();
        (0..n).map(|k| (self.directions[(k + n - 1) % n] + 18 - self.directions[k]) % 12).collect()
    }

    pub(crate) fn points(&self) -> Vec<Point> {
        let step = |end: &mut Point, &direction: &Direction| {
            let begin = *end;
            *end = begin + Point::unit(direction);
            Some(begin)
        };
        self.directions.iter().scan(self.first, step).collect()
    }

    /// The same loop from its least corner, so that equal loops compare equal.
    fn canonical(&self) -> Self {
        let points = self.points();
        let least = (0..points.len()).min_by_key(|&k| points[k]).unwrap_or(0);
        let mut directions = self.directions.clone();
        directions.rotate_left(least);
        Self { first: points[least], directions }
    }
}

/// One piece added or taken at an edge: the loop's edges `at` and, for all but `Split`, the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Move {
    /// The two edges change places.
    Exchange,
    /// The two edges, with 60 or 300 degrees between them, become one.
    Join,
    /// The edge becomes two, to its left (true) or right.
    Split(bool),
}

/// The nearest loop with a tiling that the search meets, and the tiling; `None` when none of the first `loops` it looks at is
/// nearer than `start`. The curve, counter-clockwise or not, is in the loop's coordinates. Costs some 0.1 ms a loop.
pub(crate) fn approach(
    curve: &[Position],
    start: &Loop,
    loops: usize,
    monitor: &Monitor,
) -> Result<Option<(Loop, Tiling)>, TilingError> {
    let mut search = Search { curve, distances: BTreeMap::new(), seen: BTreeSet::new(), looked_at: Vec::new() };
    let defect = |of: &Loop| i64::from(Certificate::new(&of.directions).defect.abs());
    // By error and defect; a neighbour's defect is taken to be the least it can be until its turn comes.
    let mut queue = BinaryHeap::from([(Reverse(0), 0i64, usize::MAX, 0, Move::Exchange)]);
    let start = start.canonical();
    let mut best: Option<(i64, Loop, Tiling)> = None;
    let mut searches = 0;
    while let Some((Reverse(rank), error, parent, at, change)) = queue.pop().filter(|_| search.looked_at.len() < loops)
    {
        monitor.stage("approach", search.looked_at.len() as f64 / loops as f64)?;
        let found = match search.looked_at.get(parent) {
            None => start.clone(),
            Some((parent, _)) => changed(parent, at, change).canonical(),
        };
        let defect = defect(&found);
        if rank < error + DEFECT * defect && parent != usize::MAX {
            queue.push((Reverse(error + DEFECT * defect), error, parent, at, change));
            continue;
        }
        if !search.seen.insert(found.clone()) {
            continue;
        }
        let code = found.code();
        let Ok(boundary) = Boundary::new(&code) else { continue };
        let least = best.as_ref().map_or(0, |(error, ..)| *error);
        if error < least && searches < MOST_SEARCHES && defect == 0 && may_be_tiled(&boundary) {
            searches += 1;
            if let Some(tiling) = find_within(&boundary, 0, MOST_STATES, &Options::default(), monitor)? {
                best = Some((error, found.clone(), tiling));
            }
        }
        let next = search.looked_at.len();
        for (at, change, difference) in search.moves(&found, &code) {
            let error = error + difference;
            queue.push((Reverse(error + DEFECT * (defect - 1).max(0)), error, next, at, change));
        }
        search.looked_at.push((found, defect));
    }
    Ok(best.map(|(_, found, tiling)| (found, tiling)))
}

fn may_be_tiled(boundary: &Boundary) -> bool {
    let certificate = Certificate::new(boundary.directions());
    !certificate.refutes() && certificate.border_conflict(boundary.directions()).is_none()
}

struct Search<'a> {
    curve: &'a [Position],
    /// Integrals of the signed distance over pieces, in grains.
    distances: BTreeMap<(Point, Direction, Direction, bool), Option<i64>>,
    seen: BTreeSet<Loop>,
    looked_at: Vec<(Loop, i64)>,
}

impl Search<'_> {
    /// What can be changed in a loop, and how its error changes.
    fn moves(&mut self, of: &Loop, code: &[u8]) -> Vec<(usize, Move, i64)> {
        let n = code.len();
        let points = of.points();
        let mut moves = Vec::new();
        let before = |k: usize| (k + n - 1) % n;
        // A neighbour's angle after it changes by that many units.
        let fits = |k: usize, by: i32| (2..=11).contains(&(i32::from(code[k % n]) + by));
        for k in 0..n {
            let (arriving, leaving) = (of.directions[before(k)], of.directions[k]);
            let angle = i32::from(code[k]);
            let from = points[before(k)];
            // With a corner of less than 180 degrees the piece was inside.
            let sign = if angle < 6 { -1 } else { 1 };
            let both_fit = |a: usize, b: usize, by: i32| fits(a, by) && fits(b, by);
            if angle != 6
                && angle < 11
                && both_fit(before(k), k + 1, angle - 6)
                && let Some(integral) = self.integral(from, arriving, leaving, true)
            {
                moves.push((k, Move::Exchange, sign * integral));
            }
            if (angle == 2 || angle == 10)
                && n > 3
                && both_fit(before(k), k + 1, 2 * sign as i32)
                && let Some(integral) = self.integral(from, arriving, leaving, false)
            {
                moves.push((k, Move::Join, sign * integral));
            }
            for left in [false, true] {
                // Going round on the left takes a triangle from the inside.
                let sign = if left { -1 } else { 1 };
                let (first, second) = around(leaving, left);
                if both_fit(k, k + 1, 2 * sign as i32)
                    && let Some(integral) = self.integral(points[k], first, second, false)
                {
                    moves.push((k, Move::Split(left), sign * integral));
                }
            }
        }
        moves
    }

    /// The signed distance from the curve, negative inside, integrated over the triangle or parallelogram spanned by two edges
    /// one after the other, in grains; `None` when a corner lies too far away.
    fn integral(&mut self, from: Point, first: Direction, second: Direction, whole: bool) -> Option<i64> {
        let curve = self.curve;
        *self.distances.entry((from, first, second, whole)).or_insert_with(|| {
            let (u, v) = (Point::unit(first).position(), Point::unit(second).position());
            let origin = from.position();
            let at = |s: f64, t: f64| [origin[0] + s * u[0] + t * v[0], origin[1] + s * u[1] + t * v[1]];
            let distance = |s: f64, t: f64| signed_distance(curve, at(s, t));
            let last = if whole { [0.0, 1.0] } else { [1.0, 1.0] };
            if [[1.0, 0.0], [1.0, 1.0], last].iter().any(|&[s, t]| distance(s, t).abs() > REACH) {
                return None;
            }
            // Middles of a grid of cells of the parallelogram; of the triangle (0, 0), (1, 0), (1, 1) those with t < s, and
            // half of those on its diagonal.
            let middle = |k: usize| (k as f64 + 0.5) / CELLS as f64;
            let mut sum = 0.0;
            for (i, j) in (0..CELLS * CELLS).map(|k| (k / CELLS, k % CELLS)) {
                let weight = if whole || j < i {
                    1.0
                } else if i == j {
                    0.5
                } else {
                    continue;
                };
                sum += weight * distance(middle(i), middle(j));
            }
            let area = (u[0] * v[1] - u[1] * v[0]).abs();
            Some((sum * area / ((CELLS * CELLS) as f64 * GRAIN)).round() as i64)
        })
    }
}

/// The two edges that with the one in this direction make a triangle, on its left or right, in the order of the way.
fn around(direction: Direction, left: bool) -> (Direction, Direction) {
    let (up, down) = ((direction + 2) % 12, (direction + 10) % 12);
    if left { (up, down) } else { (down, up) }
}

fn changed(from: &Loop, at: usize, change: Move) -> Loop {
    let n = from.directions.len();
    let before = (at + n - 1) % n;
    let mut first = from.first;
    let mut directions = from.directions.clone();
    match change {
        Move::Exchange => {
            directions.swap(before, at);
            if at == 0 {
                // The corner that moves is the first one.
                first = first - Point::unit(from.directions[before]) + Point::unit(from.directions[0]);
            }
        }
        Move::Join => {
            // Of directions 120 degrees apart the one between them.
            let (arriving, leaving) = (directions[before], directions[at]);
            let between = if (leaving + 12 - arriving) % 12 == 4 { arriving + 2 } else { leaving + 2 } % 12;
            if at == 0 {
                first = first - Point::unit(arriving);
                directions.rotate_right(1);
                directions.splice(0..2, [between]);
            } else {
                directions.splice(before..=at, [between]);
            }
        }
        Move::Split(left) => {
            let (one, two) = around(directions[at], left);
            directions.splice(at..=at, [one, two]);
        }
    }
    Loop { first, directions }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;
    use testkit::{outlines, random::Random};

    /// The error of a loop, up to a constant: the signed distance over a fine grid of its inside.
    fn error(of: &Loop, curve: &[Position]) -> f64 {
        const FINE: f64 = 0.02;
        let outline: Vec<Position> = of.points().iter().map(|p| p.position()).collect();
        let mut sum = 0.0;
        for k in 0..800 * 800 {
            let p = [f64::from(k / 800 - 400) * FINE + 0.0037, f64::from(k % 800 - 400) * FINE + 0.0019];
            if signed_distance(&outline, p) < 0.0 {
                sum += signed_distance(curve, p) * FINE * FINE;
            }
        }
        sum
    }

    /// Each way to change a loop closes, has the angles it was chosen for, and changes the error by what it says.
    #[test]
    fn neighbours_differ_by_the_piece_between_them() {
        let circle: Vec<Position> =
            (0..24).map(|k| TAU * f64::from(k) / 24.0).map(|a| [2.0 + 2.0 * a.cos(), 1.5 + 2.0 * a.sin()]).collect();
        let mut random = Random::new(3);
        let mut kinds = BTreeSet::new();
        for _ in 0..4 {
            let code = outlines::random_tileable(8, &mut random);
            let boundary = Boundary::new(&code).unwrap();
            let of = Loop { first: Point::ORIGIN, directions: boundary.directions().to_vec() };
            assert_eq!(of.code(), code);
            let mut search =
                Search { curve: &circle, distances: BTreeMap::new(), seen: BTreeSet::new(), looked_at: Vec::new() };
            let before = error(&of, &circle);
            for (at, change, difference) in search.moves(&of, &code) {
                let next = changed(&of, at, change);
                assert_eq!(next.canonical().canonical(), next.canonical());
                let end = next.directions.iter().fold(Point::ORIGIN, |p, &d| p + Point::unit(d));
                assert_eq!(end, Point::ORIGIN);
                assert!(next.code().iter().all(|angle| (2..=11).contains(angle)), "{:?}", next.code());
                if Boundary::new(&next.code()).is_ok() && kinds.insert((change, code[at])) {
                    let measured = error(&next, &circle) - before;
                    assert!((measured - difference as f64 * GRAIN).abs() < 0.02, "{change:?}: {measured} {difference}");
                }
            }
        }
        assert!(kinds.len() > 8, "{kinds:?}");
    }
}
