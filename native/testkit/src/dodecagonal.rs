//! Random square-triangle tilings of the plane and outlines cut from them.
//!
//! The tilings are made by inflation: a tiling is scaled by 2 + sqrt 3, every vertex becomes a regular dodecagon of unit
//! edges (the dodecagons of two neighbours share an edge), and the gaps that are left are one triangle for a triangle,
//! and a square between four triangles for a square. Each dodecagon is filled in one of its two ways, at random.
//! After P. Stampfli, A dodecagonal quasiperiodic lattice in two dimensions, Helv. Phys. Acta 59, 1986.

use crate::random::Random;
use std::collections::{BTreeMap, BTreeSet};

/// a + b z + c z^2 + d z^3, where z is the twelfth root of unity: a vertex of a square-triangle tiling with unit edges.
pub type Point = [i32; 4];

/// Corners of a triangle or square, counter-clockwise.
pub type Tile = Vec<Point>;

fn add(p: Point, q: Point) -> Point {
    std::array::from_fn(|k| p[k] + q[k])
}

/// Turned by 30 degrees: times z, where z^4 = z^2 - 1.
fn turned(p: Point) -> Point {
    [-p[3], p[0], p[1] + p[3], p[2]]
}

/// The unit vector at `direction` times 30 degrees.
fn unit(direction: usize) -> Point {
    (0..direction % 12).fold([1, 0, 0, 0], |p, _| turned(p))
}

/// Times 2 + sqrt 3, where sqrt 3 = 2 z - z^3.
fn scaled(p: Point) -> Point {
    let z = turned(p);
    let z3 = turned(turned(z));
    std::array::from_fn(|k| 2 * p[k] + 2 * z[k] - z3[k])
}

/// Where a point lies.
pub fn position(p: Point) -> [f64; 2] {
    let [a, b, c, d] = p.map(f64::from);
    let half_root = 0.75_f64.sqrt();
    [a + b * half_root + c / 2.0, b / 2.0 + c * half_root + d]
}

/// Direction of a unit edge.
fn direction(from: Point, to: Point) -> usize {
    (0..12).find(|&d| add(from, unit(d)) == to).expect("a unit edge")
}

/// The two points of a vertex's dodecagon in the corner of a tile whose edge leaves the vertex in `direction`.
fn rim(vertex: Point, direction: usize) -> Point {
    add(scaled(vertex), add(unit(direction), unit(direction + 1)))
}

/// A tiling round the origin, `rounds` inflations of a regular dodecagon; its radius is 1.9 times 3.7 to the `rounds`.
pub fn tiling(rounds: usize, random: &mut Random) -> Vec<Tile> {
    let mut tiles = dodecagon([0; 4], random.index(2));
    for _ in 0..rounds {
        let vertices: BTreeSet<Point> = tiles.iter().flatten().copied().collect();
        let mut next: Vec<Tile> = vertices.into_iter().flat_map(|v| dodecagon(scaled(v), random.index(2))).collect();
        for tile in &tiles {
            let count = tile.len();
            let leaving: Vec<usize> = (0..count).map(|k| direction(tile[k], tile[(k + 1) % count])).collect();
            // The gap's points on the sides of the tile and, for a square, towards its corners.
            let side: Vec<Point> = (0..count).map(|k| rim(tile[k], leaving[k])).collect();
            if count == 3 {
                next.push(side);
            } else {
                let corner: Vec<Point> = (0..4).map(|k| rim(tile[k], leaving[k] + 1)).collect();
                next.extend((0..4).map(|k| vec![corner[k], side[k], corner[(k + 1) % 4]]));
                next.push(corner);
            }
        }
        tiles = next;
    }
    tiles
}

/// A hexagon of triangles, turned by 0 or 30 degrees, in a ring of squares and triangles.
fn dodecagon(centre: Point, turn: usize) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for k in 0..6 {
        let d = 2 * k + turn;
        let at = |p: Point| add(centre, p);
        let (a, b) = (unit(d), unit(d + 2));
        let out = unit(d + 1);
        tiles.push(vec![centre, at(a), at(b)]);
        tiles.push(vec![at(a), at(add(a, out)), at(add(b, out)), at(b)]);
        tiles.push(vec![at(b), at(add(b, out)), at(add(b, unit(d + 3)))]);
    }
    tiles
}

/// The tiles whose centres lie within `radius` of `centre`, when they make a disk whose outline touches itself nowhere:
/// its boundary code (interior angles in units of 30 degrees, counter-clockwise) and the number of tiles.
pub fn disc(tiling: &[Tile], centre: [f64; 2], radius: f64) -> Option<(Vec<u8>, usize)> {
    let inside = |tile: &&Tile| {
        let count = tile.len() as f64;
        let sum = tile.iter().map(|&p| position(p)).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        (sum[0] / count - centre[0]).hypot(sum[1] / count - centre[1]) < radius
    };
    let tiles: Vec<&Tile> = tiling.iter().filter(inside).collect();
    Some((outline(tiles.iter().map(|tile| tile.as_slice()))?, tiles.len()))
}

/// The boundary code of tiles that make a disk; `None` when they do not, or the outline touches itself.
pub fn outline<'a>(tiles: impl Iterator<Item = &'a [Point]>) -> Option<Vec<u8>> {
    let mut edges = BTreeSet::new();
    for tile in tiles {
        for k in 0..tile.len() {
            let (a, b) = (tile[k], tile[(k + 1) % tile.len()]);
            if !edges.remove(&(b, a)) {
                edges.insert((a, b));
            }
        }
    }
    let next: BTreeMap<Point, Point> = edges.iter().copied().collect();
    if next.len() != edges.len() {
        return None;
    }
    let start = *next.keys().next()?;
    let mut points = vec![start];
    while let Some(&p) = next.get(points.last()?).filter(|&&p| p != start) {
        points.push(p);
    }
    let count = points.len();
    let towards: Vec<usize> = (0..count).map(|k| direction(points[k], points[(k + 1) % count])).collect();
    let angle = |k: usize| ((towards[(k + count - 1) % count] + 6 + 12 - towards[k]) % 12) as u8;
    (count == edges.len()).then(|| (0..count).map(angle).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inflation_covers_the_plane_once() {
        let tiles = tiling(2, &mut Random::new(1));
        let mut used = BTreeSet::new();
        for tile in &tiles {
            assert!((0..tile.len()).all(|k| used.insert((tile[k], tile[(k + 1) % tile.len()]))), "an edge used twice");
        }
        // Angles round every vertex inside add up to a full turn, so nothing overlaps.
        let mut angles: BTreeMap<Point, usize> = BTreeMap::new();
        for tile in &tiles {
            for &p in tile {
                *angles.entry(p).or_default() += if tile.len() == 3 { 2 } else { 3 };
            }
        }
        let inside = |p: Point| used.iter().filter(|edge| edge.0 == p).all(|&(a, b)| used.contains(&(b, a)));
        assert!(angles.iter().filter(|(p, _)| inside(**p)).all(|(_, &sum)| sum == 12));
    }

    #[test]
    fn outlines_close_and_hold_their_tiles() {
        let mut random = Random::new(2);
        let tiles = tiling(2, &mut random);
        let mut cut = 0;
        for _ in 0..20 {
            let centre = [random.between(-4.0, 4.0), random.between(-4.0, 4.0)];
            let Some((code, count)) = disc(&tiles, centre, 5.0) else { continue };
            assert_eq!(code.iter().map(|&a| 6 - i32::from(a)).sum::<i32>(), 12);
            // Area of the disc over the mean area of a tile, 0.604.
            assert!((110..150).contains(&count), "{count}");
            cut += 1;
        }
        assert!(cut > 2);
    }
}
