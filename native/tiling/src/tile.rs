//! Tiles, whole tilings, and what can be read off them: corners, vertex configurations, a mesh.

use crate::plane::{Direction, Isometry, Point};
use mesh::{DVec3, PolygonMesh};
use std::collections::BTreeMap;

/// What a tile is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Equilateral, unit edges.
    Triangle,
    /// Unit edges.
    Square,
    /// The thin rhombus of section 6: unit edges, 30 degrees at two corners. Only where a caller asks for it.
    Rhombus,
}

impl Kind {
    /// The two tiles that tilings are made of, in the order in which tilings are listed.
    pub const REGULAR: [Self; 2] = [Self::Triangle, Self::Square];

    /// Number of corners.
    pub const fn corners(self) -> usize {
        match self {
            Self::Triangle => 3,
            Self::Square | Self::Rhombus => 4,
        }
    }

    /// Interior angle at the corner where a tile begins, and at every second one from there, in units of 30 degrees.
    pub const fn angle(self) -> u8 {
        self.angles()[0]
    }

    /// Interior angles at the corner where a tile begins and at the next; they alternate.
    pub const fn angles(self) -> [u8; 2] {
        match self {
            Self::Triangle => [2; 2],
            Self::Square => [3; 2],
            Self::Rhombus => [1, 5],
        }
    }
}

/// A tile at its place: on the left of the unit edge that leaves `origin` in `direction`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tile {
    /// One corner; of a rhombus a sharp one.
    pub origin: Point,
    /// Direction of the edge to the next corner, counter-clockwise.
    pub direction: Direction,
    /// What it is.
    pub kind: Kind,
}

impl Tile {
    /// The corners, counter-clockwise from `origin`.
    pub fn corners(self) -> impl ExactSizeIterator<Item = Point> {
        let mut corner = self.origin;
        (0..self.kind.corners()).map(move |k| {
            let this = corner;
            corner = corner + Point::unit(self.leaving(k));
            this
        })
    }

    /// Direction of the edge that leaves a corner, by the corner's number.
    pub(crate) fn leaving(self, corner: usize) -> Direction {
        let angles = self.kind.angles();
        let turns = (1..=corner).map(|k| 6 - angles[k % 2]).sum::<u8>();
        (self.direction + turns) % 12
    }

    /// The same tile from its least corner: equal tiles become equal values.
    #[must_use]
    pub fn normalised(self) -> Self {
        let step = if self.kind == Kind::Rhombus { 2 } else { 1 };
        let least = self.corners().enumerate().step_by(step).min_by_key(|&(_, corner)| corner);
        let (k, origin) = least.unwrap_or((0, self.origin));
        Self { origin, direction: self.leaving(k), ..self }
    }

    /// Image under a symmetry of the plane.
    #[must_use]
    pub fn mapped(self, by: Isometry) -> Self {
        if by.mirror && self.kind == Kind::Rhombus {
            // The edge that arrives at the sharp corner leaves it when mirrored.
            let direction = by.direction((self.direction + self.kind.angle()) % 12);
            return Self { origin: by.point(self.origin), direction, ..self };
        }
        // A mirrored edge is turned round, so that the tile stays on its left.
        let from = if by.mirror { self.origin + Point::unit(self.direction) } else { self.origin };
        let direction = by.direction(self.direction) + if by.mirror { 6 } else { 0 };
        Self { origin: by.point(from), direction: direction % 12, kind: self.kind }
    }
}

/// What surrounds an inner vertex (section 3, Fig. 2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Configuration {
    /// Six triangles (a).
    Triangles,
    /// Four squares (b).
    Squares,
    /// Three triangles in a row, two squares in a row (c).
    Rows,
    /// Two triangles, a square, a triangle, a square (d): the tiling looks fractured here.
    Butterfly,
}

impl Configuration {
    /// All four, in the order of Fig. 2.
    pub const ALL: [Self; 4] = [Self::Triangles, Self::Squares, Self::Rows, Self::Butterfly];

    /// The configuration of tiles in cyclic order, whose angles make a full turn.
    pub(crate) fn of(tiles: &[Kind]) -> Self {
        let square = |k: usize| tiles[k % tiles.len()] == Kind::Square;
        match (0..tiles.len()).filter(|&k| square(k)).count() {
            0 => Self::Triangles,
            4 => Self::Squares,
            _ if (0..tiles.len()).any(|k| square(k) && square(k + 1)) => Self::Rows,
            _ => Self::Butterfly,
        }
    }
}

/// A tiling of a region.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tiling {
    /// The tiles, in the order in which they were placed.
    pub tiles: Vec<Tile>,
}

impl Tiling {
    /// The inner vertices without a rhombus, with their configurations, in the order of their coordinates. Costs O(n log n).
    pub fn configurations(&self) -> Vec<(Point, Configuration)> {
        // The tiles at each vertex by the direction in which their corner opens.
        let mut around: BTreeMap<Point, BTreeMap<Direction, Kind>> = BTreeMap::new();
        for tile in &self.tiles {
            for (k, corner) in tile.corners().enumerate() {
                around.entry(corner).or_default().insert(tile.leaving(k), tile.kind);
            }
        }
        let full = |kinds: &Vec<Kind>| {
            !kinds.contains(&Kind::Rhombus) && kinds.iter().map(|kind| kind.angle()).sum::<u8>() == 12
        };
        around
            .into_iter()
            .map(|(point, kinds)| (point, kinds.into_values().collect::<Vec<_>>()))
            .filter(|(_, kinds)| full(kinds))
            .map(|(point, kinds)| (point, Configuration::of(&kinds)))
            .collect()
    }

    /// How many tiles are of a kind.
    pub fn count(&self, kind: Kind) -> usize {
        self.tiles.iter().filter(|tile| tile.kind == kind).count()
    }

    /// How many inner vertices have each configuration, in the order of [`Configuration::ALL`].
    pub fn configuration_counts(&self) -> [usize; 4] {
        let mut counts = [0; 4];
        for (_, configuration) in self.configurations() {
            counts[configuration as usize] += 1;
        }
        counts
    }

    /// A mesh in the plane z = 0: the vertex at point p lies at `edge_length` times p. Vertices are in the order of
    /// their coordinates, faces in that of the tiles.
    pub fn mesh(&self, edge_length: f64) -> PolygonMesh {
        let mut index: BTreeMap<Point, u32> =
            self.tiles.iter().flat_map(|tile| tile.corners()).map(|p| (p, 0)).collect();
        for (k, value) in index.values_mut().enumerate() {
            *value = k as u32;
        }
        let place = |p: &Point| {
            let [x, y] = p.position();
            DVec3::new(x * edge_length, y * edge_length, 0.0)
        };
        let faces = self.tiles.iter().map(|tile| tile.corners().map(|p| index[&p]).collect::<Vec<_>>());
        // Every face has three or four corners of the index, so the arrays describe a mesh.
        PolygonMesh::from_polygons(index.keys().map(place).collect(), faces).unwrap_or_default()
    }
}
