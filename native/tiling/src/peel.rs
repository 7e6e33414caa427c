//! Thin rhombi laid along the border until the certificate lets what is left be tiled (section 6: rhombi pushed to the
//! border).
//!
//! At a corner of 150 degrees a rhombus fits with its blunt corner; the two edges there change places. Rhombi of the sign of
//! the defect are laid at corners drawn at random, as many as the defect asks for, so that a tiling of what is left is one
//! with the fewest rhombi; or some more, with as many of the other sign. This finds tilings with dozens of rhombi, for which
//! the states of a search are too many; that it finds none says nothing.

use crate::TilingError;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::options::Options;
use crate::piece::defect_of;
use crate::plane::{Direction, Isometry, Point};
use crate::random::Random;
use crate::tile::{Kind, Tile, Tiling};
use crate::tilings::find_within;
use mesh::Monitor;

/// Draws, and most states to find a tiling of what each leaves.
const DRAWS: usize = 400;
const STATES: usize = 1_000;

/// A tiling with as many rhombi as the defect asks for, and `pairs` more of either sign, if chance finds one.
///
/// # Errors
/// [`TilingError::Cancelled`].
pub(crate) fn peel(
    boundary: &Boundary,
    pairs: usize,
    seed: u64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<Tiling>, TilingError> {
    let defect = Certificate::new(boundary.directions()).defect;
    let mut random = Random::new(seed);
    for draw in 0..DRAWS {
        monitor.stage("rhombi", draw as f64 / DRAWS as f64)?;
        let mut border = Border { points: boundary.points().to_vec(), directions: boundary.directions().to_vec() };
        // How many are still to be laid with the sign of the defect, and with the other.
        let mut left = [defect.unsigned_abs() as usize + pairs, pairs];
        let mut tiles = Vec::new();
        while left != [0, 0] {
            let other = usize::from(random.index(left[0] + left[1]) >= left[0]);
            let sign = if (defect < 0) == (other == 0) { -1 } else { 1 };
            let corners: Vec<usize> = (0..border.points.len()).filter(|&corner| border.blunt(corner, sign)).collect();
            if corners.is_empty() {
                break;
            }
            tiles.push(border.lay(corners[random.index(corners.len())]));
            left[other] -= 1;
        }
        if left != [0, 0] || Certificate::new(&border.directions).refutes() {
            continue;
        }
        // Where rhombi met, the border touches itself.
        let Ok(left) = Boundary::new(&border.code()) else { continue };
        let place = Isometry { mirror: false, turn: border.directions[0], shift: border.points[0] };
        if let Some(rest) = find_within(&left, seed, STATES, options, monitor)? {
            tiles.extend(rest.tiles.into_iter().map(|tile| tile.mapped(place)));
            return Ok(Some(Tiling { tiles }));
        }
    }
    Ok(None)
}

/// The border of what is left.
struct Border {
    points: Vec<Point>,
    directions: Vec<Direction>,
}

impl Border {
    /// Interior angle.
    fn angle(&self, corner: usize) -> u8 {
        let n = self.points.len();
        (self.directions[(corner + n - 1) % n] + 18 - self.directions[corner]) % 12
    }

    /// True when a rhombus that changes the defect by `sign` fits at a corner.
    fn blunt(&self, corner: usize, sign: i32) -> bool {
        let n = self.points.len();
        let before = (corner + n - 1) % n;
        // The neighbours lose 30 degrees each.
        self.angle(corner) == 5
            && self.angle(before) > 2
            && self.angle((corner + 1) % n) > 2
            && defect_of(self.directions[before]) == sign
    }

    /// Lays it.
    fn lay(&mut self, corner: usize) -> Tile {
        let n = self.points.len();
        let before = (corner + n - 1) % n;
        let tile = Tile { origin: self.points[before], direction: self.directions[before], kind: Kind::Rhombus };
        self.points[corner] = self.points[before] + Point::unit(self.directions[corner]);
        self.directions.swap(before, corner);
        tile
    }

    fn code(&self) -> Vec<u8> {
        (0..self.points.len()).map(|corner| self.angle(corner)).collect()
    }
}
