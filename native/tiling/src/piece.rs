//! The moves of the state graph: a tile on an edge of the region that is left.

use crate::plane::{Direction, Point};
use crate::tile::{Kind, Tile};

/// A tile by how it lies on an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Piece {
    Triangle,
    Square,
    /// A rhombus whose sharp corner is where the edge begins.
    Sharp,
    /// A rhombus whose sharp corner is where the edge ends.
    Blunt,
}

impl Piece {
    /// In the order in which tilings are listed.
    pub(crate) const ALL: [Self; 4] = [Self::Triangle, Self::Square, Self::Sharp, Self::Blunt];
    /// Without the rhombi.
    pub(crate) const REGULAR: [Self; 2] = [Self::Triangle, Self::Square];

    /// Angles where the edge begins and where it ends.
    pub(crate) const fn angles(self) -> [u8; 2] {
        match self {
            Self::Triangle => [2, 2],
            Self::Square => [3, 3],
            Self::Sharp => [1, 5],
            Self::Blunt => [5, 1],
        }
    }

    pub(crate) const fn bit(self) -> u8 {
        1 << self as u8
    }

    pub(crate) const fn is_rhombus(self) -> bool {
        matches!(self, Self::Sharp | Self::Blunt)
    }

    /// The tile on the left of the edge that leaves `origin` in `direction`.
    pub(crate) fn tile(self, origin: Point, direction: Direction) -> Tile {
        match self {
            Self::Triangle => Tile { origin, direction, kind: Kind::Triangle },
            Self::Square => Tile { origin, direction, kind: Kind::Square },
            Self::Sharp => Tile { origin, direction, kind: Kind::Rhombus },
            Self::Blunt => {
                Tile { origin: origin + Point::unit(direction), direction: (direction + 5) % 12, kind: Kind::Rhombus }
            }
        }
    }
}

/// What a thin rhombus with its sharp corner towards this direction adds to the certificate's defect.
pub(crate) fn defect_of(direction: Direction) -> i32 {
    if direction.is_multiple_of(2) { -1 } else { 1 }
}
