//! Tilings of the plane to cut outlines from: random dodecagonal ones, by inflation.
//!
//! A tiling is scaled by 2 + sqrt 3; every vertex becomes a dodecagon of unit edges, filled in one of its two ways, and
//! the gaps left become one triangle for a triangle, a square between four triangles for a square. After P. Stampfli, A
//! dodecagonal quasiperiodic lattice in two dimensions, Helv. Phys. Acta 59, 1986.

use crate::plane::{Direction, Point};
use crate::random::Random;
use crate::tile::{Kind, Tile};
use mesh::{Cancelled, Monitor};
use std::collections::BTreeSet;

/// Times 2 + sqrt 3, where sqrt 3 = 2 z - z^3.
fn scaled(p: Point) -> Point {
    let z = p.turned(1);
    p + p + z + z - p.turned(3)
}

/// The tiles within `radius` of the origin (and some beyond), in a fixed order. Without a generator every dodecagon is
/// filled the same way, and the tiling has the symmetries of a hexagon about the origin.
pub(crate) fn plane_tiling(
    radius: f64,
    mut random: Option<&mut Random>,
    monitor: &Monitor,
) -> Result<Vec<Tile>, Cancelled> {
    // Each round multiplies the radius, which begins with that of one dodecagon.
    let factor = 2.0 + 3f64.sqrt();
    let mut rounds = 0;
    while 1.9 * factor.powi(rounds) < radius + 2.0 {
        rounds += 1;
    }
    let mut turn = || random.as_mut().map_or(0, |random| random.bit());
    let mut tiles = dodecagon(Point::ORIGIN, turn());
    for round in (0..rounds).rev() {
        // What will be needed of this round, before it is scaled.
        let needed = radius / factor.powi(round + 1) + 2.0;
        tiles.retain(|tile| {
            let [x, y] = tile.origin.position();
            x.hypot(y) < needed + 2.0
        });
        let vertices: BTreeSet<Point> = tiles.iter().flat_map(|tile| tile.corners()).collect();
        let mut next = Vec::new();
        for vertex in vertices {
            monitor.check()?;
            next.extend(dodecagon(scaled(vertex), turn()));
        }
        for tile in &tiles {
            fill_gap(*tile, &mut next);
        }
        tiles = next;
    }
    Ok(tiles)
}

/// A hexagon of triangles in a ring of squares and triangles, turned by 0 or 30 degrees.
fn dodecagon(centre: Point, turn: Direction) -> Vec<Tile> {
    let tiles = (0..6).flat_map(|k| {
        let towards = 2 * k + turn;
        let corner = centre + Point::unit(towards);
        [
            Tile { origin: centre, direction: towards % 12, kind: Kind::Triangle },
            // The edge of the hexagon, seen from the next corner: the square lies outside.
            Tile { origin: centre + Point::unit(towards + 2), direction: (towards + 10) % 12, kind: Kind::Square },
            Tile { origin: corner, direction: (towards + 11) % 12, kind: Kind::Triangle },
        ]
    });
    tiles.collect()
}

/// The tiles between the dodecagons round a scaled tile.
fn fill_gap(tile: Tile, tiles: &mut Vec<Tile>) {
    let turn = 6 - tile.kind.angle();
    for (k, corner) in tile.corners().enumerate() {
        let leaving = (tile.direction + k as u8 * turn) % 12;
        // The end of the edge that the dodecagons of this corner and the next share.
        let tip = scaled(corner) + Point::unit(leaving) + Point::unit(leaving + 1);
        if tile.kind == Kind::Square || k == 0 {
            tiles.push(Tile { origin: tip, direction: (leaving + 2) % 12, kind: Kind::Triangle });
        }
        if tile.kind == Kind::Square && k == 0 {
            let inner = scaled(corner) + Point::unit(leaving + 1) + Point::unit(leaving + 2);
            tiles.push(Tile { origin: inner, direction: leaving, kind: Kind::Square });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every edge is used once on each side, or bounds the patch far out; and angles make full turns inside.
    #[test]
    fn it_covers_the_disc_once() {
        let monitor = Monitor::new();
        for seed in [None, Some(1), Some(2)] {
            let mut random = seed.map(Random::new);
            let tiles = plane_tiling(15.0, random.as_mut(), &monitor).unwrap();
            let mut edges = BTreeSet::new();
            let mut area = 0.0;
            for tile in &tiles {
                let corners: Vec<Point> = tile.corners().collect();
                for k in 0..corners.len() {
                    assert!(edges.insert((corners[k], corners[(k + 1) % corners.len()])), "an edge twice on one side");
                }
                let [x, y] = tile.origin.position();
                if x.hypot(y) < 15.0 {
                    area += if tile.kind == Kind::Square { 1.0 } else { 0.75f64.sqrt() / 2.0 };
                }
            }
            let open = edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a)));
            assert!(open.map(|(a, _)| a.position()).all(|[x, y]| x.hypot(y) > 15.0), "a hole");
            let disc = std::f64::consts::PI * 225.0;
            assert!((area / disc - 1.0).abs() < 0.03, "{area} of {disc}");
        }
    }
}
