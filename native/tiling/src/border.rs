//! A second necessary condition that an outline can be read off in one pass: tiles along the border that fit its corners.
//!
//! Each edge of the outline has a triangle or a square on it. Which of the two is limited by the certificate: no tile of an
//! orientation of which there are none. At a corner the tiles of the two edges are the same, when the angle is that of one
//! tile, or leave an angle between them that tiles fill: none, or 60 degrees or more. So the choices along the border are the
//! walks round a cycle with two states, and an edge without a choice on any walk refutes the outline. Edges with one choice
//! left must have that tile; there must be as many of it as that takes.

use crate::certificate::Certificate;
use crate::plane::Direction;
use crate::tile::Kind;
use std::fmt;

/// Why no tiles along the border fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conflict {
    /// Neither tile fits on the edge that leaves this corner, whatever lies on the others.
    Edge(u32),
    /// More tiles of this kind must lie along the border, turned by this many degrees, than any tiling has.
    Crowd {
        /// Triangle or square.
        kind: Kind,
        /// Orientation in degrees.
        degrees: u8,
        /// How many must lie along the border.
        needed: u32,
        /// How many there are.
        count: u32,
    },
}

impl fmt::Display for Conflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Edge(corner) => write!(
                f,
                "no tiling exists: no choice of triangles and squares along the outline fits its corners, and neither of them \
                 fits on the edge that leaves corner {corner}"
            ),
            Self::Crowd { kind, degrees, needed, count } => write!(
                f,
                "no tiling exists: the corners need {needed} {} turned by {degrees} degrees along the outline, and any tiling \
                 has {count}",
                if *kind == Kind::Triangle { "triangles" } else { "squares" }
            ),
        }
    }
}

/// Sets of kinds, by bit: 1 for a triangle, 2 for a square.
type Kinds = u8;

/// By angle of a corner and kind on the edge that arrives, the kinds that may lie on the edge that leaves.
const FOLLOWING: [[Kinds; 2]; 12] = {
    let mut table = [[0; 2]; 12];
    let mut angle = 2;
    while angle < 12 {
        let (mut arriving, mut leaving) = (0, 0);
        while arriving < 2 {
            while leaving < 2 {
                let rest = angle as i32 - (arriving + 2) as i32 - (leaving + 2) as i32;
                if rest == 0 || rest >= 2 || arriving == leaving && angle == arriving + 2 {
                    table[angle][arriving] |= 1 << leaving;
                }
                leaving += 1;
            }
            (arriving, leaving) = (arriving + 1, 0);
        }
        angle += 1;
    }
    table
};

impl Certificate {
    /// Why no tiles along the border of the outline that this certificate was made for fit its corners, if so. Costs O(n).
    pub fn border_conflict(&self, directions: &[Direction]) -> Option<Conflict> {
        let n = directions.len();
        let angle = |k: usize| usize::from((directions[(k + n - 1) % n] + 18 - directions[k]) % 12);
        let possible = |k: usize| {
            let triangle = u8::from(self.triangles[usize::from(directions[k] % 4)] > 0);
            triangle | u8::from(self.squares[usize::from(directions[k] % 3)] > 0) << 1
        };
        let after = |kinds: Kinds, corner: usize| {
            let row = FOLLOWING[angle(corner)];
            (if kinds & 1 > 0 { row[0] } else { 0 }) | (if kinds & 2 > 0 { row[1] } else { 0 })
        };
        // The relation is symmetric, so going backwards is the same.
        let mut choices = vec![0; n];
        for first in [1, 2].map(|kind| kind & possible(0)).into_iter().filter(|&kind| kind > 0) {
            let mut forward = vec![first; n];
            for k in 1..n {
                forward[k] = after(forward[k - 1], k) & possible(k);
            }
            let mut kinds = after(forward[n - 1], 0) & first;
            for k in (0..n).rev() {
                // What lies on edge k + 1, or the first again, limits edge k.
                kinds = after(kinds, (k + 1) % n) & forward[k];
                choices[k] |= kinds;
            }
        }
        if let Some(edge) = choices.iter().position(|&kinds| kinds == 0) {
            return Some(Conflict::Edge(edge as u32));
        }
        // Of the edges of a tile, those of one direction are one. Two edges of a triangle on the outline meet at a corner,
        // since it touches itself nowhere; a square may reach from side to side.
        let only = |bit: Kinds, k: usize| choices[k] == bit;
        for turn in 0..4u8 {
            let is_new = |&k: &usize| only(1, k) && directions[k] % 4 == turn && angle(k) != 2;
            let needed = (0..n).filter(is_new).count() as i32;
            let count = self.triangles[usize::from(turn)];
            if needed > count {
                let (needed, count) = (needed as u32, count.max(0) as u32);
                return Some(Conflict::Crowd { kind: Kind::Triangle, degrees: 30 * turn, needed, count });
            }
        }
        for direction in 0..12u8 {
            let needed = (0..n).filter(|&k| only(2, k) && directions[k] == direction).count() as i32;
            let count = self.squares[usize::from(direction % 3)];
            if needed > count {
                let (needed, count) = (needed as u32, count.max(0) as u32);
                return Some(Conflict::Crowd { kind: Kind::Square, degrees: 30 * (direction % 3), needed, count });
            }
        }
        None
    }
}
