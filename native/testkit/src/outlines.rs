//! Boundary codes for tests of square-triangle tilings: all short ones, random ones; and a count of their tilings that
//! tries every tile.
//!
//! Everything here works on rounded coordinates with a tolerance, where the library works on exact ones.

use crate::dodecagonal::{Point, position};
use crate::random::Random;

const NEAR: f64 = 1e-6;

type Vector = [f64; 2];

fn plus(p: Vector, q: Vector) -> Vector {
    [p[0] + q[0], p[1] + q[1]]
}

fn minus(p: Vector, q: Vector) -> Vector {
    [p[0] - q[0], p[1] - q[1]]
}

fn cross(p: Vector, q: Vector) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

fn same(p: Vector, q: Vector) -> bool {
    (p[0] - q[0]).abs() < NEAR && (p[1] - q[1]).abs() < NEAR
}

/// The unit vector at `direction` times 30 degrees; with `conjugate`, at five times that: the other image of the lattice
/// in the plane. A sum of units is zero when it is zero in both.
fn unit(direction: i32, conjugate: bool) -> Vector {
    let (sin, cos) = (f64::from(direction * if conjugate { 5 } else { 1 }) * std::f64::consts::PI / 6.0).sin_cos();
    [cos, sin]
}

/// Corners of the polygon with these directions of edges.
fn corners(directions: &[i32]) -> Vec<Vector> {
    walk([0.0; 2], directions.iter().copied())
}

/// Where each of the unit steps begins.
fn walk(from: Vector, directions: impl Iterator<Item = i32>) -> Vec<Vector> {
    let step = |at: &mut Vector, direction| {
        let before = *at;
        *at = plus(before, unit(direction, false));
        Some(before)
    };
    directions.scan(from, step).collect()
}

fn directions(code: &[u8]) -> Vec<i32> {
    let mut direction = i32::from(code[0]) - 6;
    let turn = |&angle: &u8| {
        direction += 6 - i32::from(angle);
        direction
    };
    code.iter().map(turn).collect()
}

/// Interior angles of a polygon with these directions; `None` when one is not in 2 to 11 or they do not turn once.
fn angles(directions: &[i32]) -> Option<Vec<u8>> {
    let n = directions.len();
    let angle = |k: usize| (directions[(k + n - 1) % n] + 6 - directions[k]).rem_euclid(12) as u8;
    let code: Vec<u8> = (0..n).map(angle).collect();
    let turning: i32 = code.iter().map(|&angle| 6 - i32::from(angle)).sum();
    (turning == 12 && code.iter().all(|&angle| angle >= 2)).then_some(code)
}

fn distance_to_segment(p: Vector, [a, b]: [Vector; 2]) -> f64 {
    let (ab, ap) = (minus(b, a), minus(p, a));
    let t = ((ab[0] * ap[0] + ab[1] * ap[1]) / (ab[0] * ab[0] + ab[1] * ab[1])).clamp(0.0, 1.0);
    (ap[0] - t * ab[0]).hypot(ap[1] - t * ab[1])
}

fn segments_touch(s: [Vector; 2], t: [Vector; 2]) -> bool {
    let side = |[a, b]: [Vector; 2], p: Vector| cross(minus(b, a), minus(p, a));
    let apart = |s: [Vector; 2], t: [Vector; 2]| side(s, t[0]) * side(s, t[1]) < 0.0;
    (apart(s, t) && apart(t, s))
        || t.iter().any(|&p| distance_to_segment(p, s) < NEAR)
        || s.iter().any(|&p| distance_to_segment(p, t) < NEAR)
}

/// True when no two edges touch but neighbours at their corner.
pub fn is_simple(code: &[u8]) -> bool {
    let points = corners(&directions(code));
    let n = points.len();
    let edge = |k: usize| [points[k % n], points[(k + 1) % n]];
    (0..n).all(|i| (i + 2..n).all(|j| (i == 0 && j == n - 1) || !segments_touch(edge(i), edge(j))))
}

/// Every boundary code of a simple closed polygon with `n` edges, once up to rotation.
pub fn all_codes(n: usize) -> Vec<Vec<u8>> {
    fn extend(n: usize, directions: &mut Vec<i32>, at: [Vector; 2], found: &mut Vec<Vec<u8>>) {
        let left = (n - directions.len()) as f64;
        // As many steps must lead back, in both images of the lattice.
        if at.iter().any(|p| p[0].hypot(p[1]) > left + NEAR) {
            return;
        }
        if directions.len() == n {
            if let Some(code) = angles(directions).filter(|code| is_simple(code)) {
                // Only the least rotation.
                if (1..n).all(|k| [&code[k..], &code[..k]].concat() >= code) {
                    found.push(code);
                }
            }
            return;
        }
        let last = directions[directions.len() - 1];
        for turn in -5..=4 {
            let next = last + turn;
            directions.push(next);
            extend(n, directions, [plus(at[0], unit(next, false)), plus(at[1], unit(next, true))], found);
            directions.pop();
        }
    }
    let mut found = Vec::new();
    extend(n, &mut vec![0], [unit(0, false), unit(0, true)], &mut found);
    found
}

/// A random simple closed code with `edges` edges: a closed sum of units in random order, its neighbours exchanged at
/// random until it is simple and then for a while longer. Few of these can be tiled.
///
/// # Panics
/// With less than 3 edges.
pub fn random_code(edges: usize, random: &mut Random) -> Vec<u8> {
    assert!(edges >= 3, "a polygon");
    loop {
        // Opposite pairs and triples of directions, turning once round: convex, so simple.
        let mut sum = Vec::new();
        while sum.len() < edges {
            let d = random.index(12) as i32;
            match edges - sum.len() {
                3 => sum.extend([d, d + 4, d + 8]),
                left if left == 4 || left == 2 || random.index(3) > 0 => sum.extend([d, d + 6]),
                _ => sum.extend([d, d + 4, d + 8]),
            }
        }
        for direction in &mut sum {
            *direction %= 12;
        }
        sum.sort_unstable();
        let Some(mut code) = angles(&sum).filter(|_| sum.len() == edges) else { continue };
        if !is_simple(&code) {
            continue;
        }
        for _ in 0..edges * edges {
            let (i, j) = (random.index(edges), random.index(edges));
            sum.swap(i, j);
            match angles(&sum).filter(|code| is_simple(code)) {
                Some(changed) => code = changed,
                None => sum.swap(i, j),
            }
        }
        return code;
    }
}

/// A random outline of about `tiles` tiles that can be tiled: a cluster of tiles grown at random. Fewer when it closes in.
pub fn random_tileable(tiles: usize, random: &mut Random) -> Vec<u8> {
    let mut placed: Vec<Vec<Vector>> = vec![tile([0.0; 2], 0, 3 + random.index(2))];
    let mut code = vec![placed[0].len() as u8 - 1; placed[0].len()];
    let mut at: Vec<i32> = directions(&code);
    for _ in 0..20 * tiles {
        if placed.len() >= tiles {
            break;
        }
        let points = corners(&at);
        let k = random.index(at.len());
        let candidate = tile(points[k], at[k] + 6, 3 + random.index(2));
        // On the outer side: from the edge's end back to its start.
        let end = plus(points[k], unit(at[k], false));
        let candidate: Vec<Vector> = candidate.iter().map(|&p| plus(p, minus(end, points[k]))).collect();
        let outer: Vec<i32> = match candidate.len() {
            3 => vec![at[k] - 2, at[k] + 2],
            _ => vec![at[k] - 3, at[k], at[k] + 3],
        };
        let mut grown = [&at[..k], &outer, &at[k + 1..]].concat();
        // Edges that run back over each other cancel, away from the first corner, which keeps its place.
        while let Some(i) = (1..grown.len() - 1).find(|&i| (grown[i] + 6 - grown[i + 1]).rem_euclid(12) == 0) {
            grown.drain(i..i + 2);
        }
        let overlaps = placed.iter().any(|other| overlap(other, &candidate));
        if let (false, Some(next)) = (overlaps, angles(&grown).filter(|next| is_simple(next))) {
            at = grown;
            code = next;
            placed.push(candidate);
        }
    }
    code
}

/// Corners of a regular polygon on the left of an edge.
fn tile(from: Vector, direction: i32, count: usize) -> Vec<Vector> {
    walk(from, (0..count as i32).map(|k| direction + k * 12 / count as i32))
}

/// True when two convex polygons share more than their border: no edge of either separates them.
fn overlap(a: &[Vector], b: &[Vector]) -> bool {
    let separates = |a: &[Vector], b: &[Vector]| {
        (0..a.len()).any(|k| {
            let along = minus(a[(k + 1) % a.len()], a[k]);
            b.iter().all(|&p| cross(along, minus(p, a[k])) < NEAR)
        })
    };
    !separates(a, b) && !separates(b, a)
}

/// Number of tilings by unit triangles and squares, by trying both on the first edge that is still open. Exponential.
pub fn count_by_trying(code: &[u8]) -> u64 {
    count_rhombi_by_trying(code, 0)[0]
}

/// Numbers of tilings by unit triangles, squares, and 0, 1, 2 ... up to `most` rhombi of 30 degrees, by trying all on the
/// first edge that is still open. Exponential.
pub fn count_rhombi_by_trying(code: &[u8], most: usize) -> Vec<u64> {
    let outline = corners(&directions(code));
    let n = outline.len();
    let open: Vec<[Vector; 2]> = (0..n).map(|k| [outline[k], outline[(k + 1) % n]]).collect();
    let mut counts = vec![0; most + 1];
    fill(&open, &mut Vec::new(), &outline, 0, &mut counts);
    counts
}

/// `open` are the edges that need a tile on their left; `rhombi` is the number of those placed.
fn fill(open: &[[Vector; 2]], placed: &mut Vec<Vec<Vector>>, outline: &[Vector], rhombi: usize, counts: &mut [u64]) {
    let Some(&[a, b]) = open.first() else {
        counts[rhombi] += 1;
        return;
    };
    let along = minus(b, a);
    let direction = (along[1].atan2(along[0]) * 6.0 / std::f64::consts::PI).round() as i32;
    let rhombus = |turn: i32| walk(a, [0, turn, 6, turn + 6].map(|d| direction + d).into_iter());
    let candidates = [(tile(a, direction, 3), 0), (tile(a, direction, 4), 0), (rhombus(1), 1), (rhombus(5), 1)];
    for (candidate, more) in candidates {
        let rhombi = rhombi + more;
        if rhombi >= counts.len()
            || !inside(&candidate, outline)
            || placed.iter().any(|other| overlap(other, &candidate))
        {
            continue;
        }
        let mut rest = open.to_vec();
        for k in 0..candidate.len() {
            let (p, q) = (candidate[k], candidate[(k + 1) % candidate.len()]);
            match rest.iter().position(|&[a, b]| same(a, p) && same(b, q)) {
                Some(at) => drop(rest.remove(at)),
                None => rest.push([q, p]),
            }
        }
        placed.push(candidate);
        fill(&rest, placed, outline, rhombi, counts);
        placed.pop();
    }
}

/// True when a tile lies in a polygon: its centre does, and no edge of the outline runs through it.
fn inside(tile: &[Vector], outline: &[Vector]) -> bool {
    let centre = tile.iter().fold([0.0; 2], |sum, &p| plus(sum, p)).map(|sum| sum / tile.len() as f64);
    let n = outline.len();
    let edges = || (0..n).map(|k| (outline[k], outline[(k + 1) % n]));
    let crossings = edges()
        .filter(|&(a, b)| (a[1] > centre[1]) != (b[1] > centre[1]))
        .filter(|&(a, b)| centre[0] < a[0] + (centre[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        .count();
    crossings % 2 == 1 && edges().all(|(a, b)| !overlap(tile, &[a, b]))
}

/// The boundary code of a polygon given by lattice points, counter-clockwise.
pub fn code_of(points: &[Point]) -> Vec<u8> {
    let n = points.len();
    let direction = |k: usize| {
        let d = minus(position(points[(k + 1) % n]), position(points[k]));
        (d[1].atan2(d[0]) * 6.0 / std::f64::consts::PI).round() as i32
    };
    (0..n).map(|k| (direction((k + n - 1) % n) + 6 - direction(k)).rem_euclid(12) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_codes_are_the_known_polygons() {
        assert_eq!(all_codes(3), [[2, 2, 2]]);
        // The square and the rhombi of 30 and 60 degrees; 30 degrees is no corner of a tile.
        assert_eq!(all_codes(4), [[2, 4, 2, 4], [3, 3, 3, 3]]);
        // A triangle on a square.
        assert!(all_codes(5).contains(&vec![2, 5, 3, 3, 5]));
    }

    #[test]
    fn trying_counts_what_can_be_counted_by_hand() {
        assert_eq!(count_by_trying(&[2, 2, 2]), 1);
        assert_eq!(count_by_trying(&[4; 6]), 1);
        assert_eq!(count_by_trying(&[5; 12]), 2);
        assert_eq!(count_by_trying(&[2, 4, 2, 4]), 1);
        assert_eq!(count_by_trying(&[2, 5, 3, 3, 5]), 1);
    }

    #[test]
    fn random_codes_are_simple_and_grown_ones_can_be_tiled() {
        let mut random = Random::new(9);
        for k in 0..60 {
            let code = random_code(5 + k % 16, &mut random);
            assert!(code.len() == 5 + k % 16 && is_simple(&code));
            let grown = random_tileable(3 + k % 10, &mut random);
            assert!(is_simple(&grown) && count_by_trying(&grown) > 0, "{grown:?}");
        }
    }
}
