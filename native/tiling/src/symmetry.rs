//! Symmetries of a loop, and groups of them (section 3.3.5).

use crate::corner::angle;
use crate::plane::{Direction, Isometry, Point};

/// Set of symmetries by their linear parts: bit `turn` for turns, bit 12 + `turn` for mirrored ones. Two symmetries of a
/// bounded region that differ by a shift are equal, so the linear parts say it all.
pub(crate) type Mask = u32;

/// The identity alone.
pub(crate) const TRIVIAL: Mask = 1;

/// The bit of an isometry.
pub(crate) fn bit(isometry: &Isometry) -> Mask {
    1 << (isometry.turn + if isometry.mirror { 12 } else { 0 })
}

/// Directions of the edges of a word.
pub(crate) fn directions(word: &[u8]) -> Vec<Direction> {
    let mut directions = vec![word[0]];
    for &symbol in &word[2..] {
        directions.push((directions[directions.len() - 1] + 18 - angle(symbol)) % 12);
    }
    directions
}

/// The isometries of `mask` that map the loop of a word, its first corner at the origin, onto itself; turns first.
/// Costs O(n^2) for each.
pub(crate) fn symmetries(word: &[u8], mask: Mask) -> Vec<Isometry> {
    if mask == TRIVIAL {
        return vec![Isometry::default()];
    }
    let symbols = &word[1..];
    let n = symbols.len();
    let directions = directions(word);
    let mut corner = Point::ORIGIN;
    let corners: Vec<Point> = directions
        .iter()
        .map(|&direction| {
            let this = corner;
            corner = corner + Point::unit(direction);
            this
        })
        .collect();
    let linear = (0..24).filter(|k| mask >> k & 1 == 1);
    linear
        .filter_map(|k| {
            let mut isometry = Isometry { mirror: k >= 12, turn: k % 12, shift: Point::ORIGIN };
            // The first corner goes to corner `at`; a mirrored loop runs backwards.
            let at = (0..n).find(|&at| {
                (0..n).all(|i| {
                    let (corner, edge, turn) = if isometry.mirror {
                        ((at + n - i) % n, (at + 2 * n - i - 1) % n, 6)
                    } else {
                        ((at + i) % n, (at + i) % n, 0)
                    };
                    angle(symbols[corner]) == angle(symbols[i])
                        && directions[edge] == (isometry.direction(directions[i]) + turn) % 12
                })
            })?;
            isometry.shift = corners[at];
            Some(isometry)
        })
        .collect()
}
