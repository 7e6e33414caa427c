//! The region that is still to be tiled: boundary loops that shrink as tiles are placed, with forced moves and splitting.
//!
//! A loop is a doubly linked list of corners; the region lies on its left. Placing a tile on an edge replaces the edge by
//! the tile's other edges. Edges that then run back over each other cancel ("zip"), and a new corner that falls on
//! another corner of its loop splits the loop in two. An edge whose two corners admit one kind of tile only is forced.
//!
//! Crossing loops need no test: the tiles placed so far and any filling of what remains glue to a disk of flat faces, and
//! a disk whose outline is the simple loop it began with lies flat in the plane. So a loop that crosses itself has no
//! filling, and the search finds none.
//!
//! Where thin rhombi are allowed (section 6), two more pieces fit an edge, with the sharp corner at either end. While the
//! region may take more of them, fewer moves are forced: an edge near which a rhombus may lie leaves a choice, and a corner
//! of 30 degrees needs one. Once they are used up, the moves of a region of triangles and squares are forced again.

use crate::corner::{Alphabet, End, Symbol, angle};
use crate::fence::Fence;
use crate::packed::{Crowd, pack, unpack};
use crate::piece::{Piece, defect_of};
use crate::plane::{Direction, Isometry, Point};
use crate::tile::Tile;
use mesh::Monitor;

/// Most edges of an outline: packed coordinates have 16 bits each.
pub(crate) const MAX_EDGES: usize = 16_000;

/// In place of a number of rhombi: no limit.
pub(crate) const ANY_NUMBER: u16 = u16::MAX;

/// Corner of a loop, by its index in the pool.
type Corner = u32;

/// A corner that a tile has just made, and the tile's angle there.
type Fresh = (Corner, u8);

/// Mark of a free place in the pool, and its position.
const FREE: Corner = Corner::MAX;
const NOWHERE: i64 = i64::MIN;

/// By angle, the tiles that a corner admits at its ends: bit 0 triangle, bit 1 square.
const ADMITS: [u8; 16] = [0, 0, 1, 2, 1, 3, 3, 3, 3, 3, 3, 3, 0, 0, 0, 0];

/// A linear order of the plane's directions in exact integers: the branch edge lies at the lowest corner in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep([i64; 12]);

impl Sweep {
    /// Height is measured along the vector (x, y), with 1351/780 for sqrt 3: any near value gives a linear order.
    pub(crate) fn new([x, y]: [i64; 2]) -> Self {
        Self(std::array::from_fn(|d| {
            let [a, b, c, d] = Point::unit(d as u8).four().map(i64::from);
            x * (780 * a + 1351 * b) + y * (780 * c + 1351 * d)
        }))
    }

    /// Extent of a closed loop of edges in this order.
    pub(crate) fn extent(&self, directions: &[Direction]) -> i64 {
        let heights = directions.iter().scan(0, |height, &d| {
            *height += self.0[d as usize];
            Some(*height)
        });
        let (low, high) = heights.fold((i64::MAX, i64::MIN), |(low, high), h| (low.min(h), high.max(h)));
        high - low
    }
}

#[derive(Debug, Clone, Copy)]
struct Node {
    next: Corner,
    prev: Corner,
    symbol: Symbol,
    /// Of the edge that leaves the corner.
    direction: Direction,
}

/// Why a move was not carried through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Halt {
    /// No tiling continues from here.
    DeadEnd,
    /// The caller asked to stop.
    Cancelled,
}

/// The loops of a region, each from its lowest corner.
#[derive(Debug, Default)]
pub(crate) struct Loops {
    /// The words: direction of the lowest corner's edge, then the symbols of all corners, counter-clockwise.
    bytes: Vec<u8>,
    /// The lowest corner, and where the word ends.
    ends: Vec<(Point, usize)>,
}

impl Loops {
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The lowest corner and the word of each.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Point, &[u8])> {
        let begins = std::iter::once(0).chain(self.ends.iter().map(|end| end.1));
        begins.zip(&self.ends).map(|(begin, &(start, end))| (start, &self.bytes[begin..end]))
    }
}

/// Loops to be filled, and the tiles placed since they were loaded.
#[derive(Debug)]
pub(crate) struct Region {
    alphabet: Alphabet,
    sweep: Sweep,
    units: [i64; 12],
    nodes: Vec<Node>,
    positions: Vec<i64>,
    crowd: Crowd,
    free: Vec<Corner>,
    /// Edges to look at again, by the corner they leave.
    queue: Vec<Corner>,
    placed: Vec<(i64, Direction, Piece)>,
    /// Loop of each corner, filled by `loops`.
    loop_of: Vec<u32>,
    cost: i64,
    /// How many more rhombi may be placed.
    rhombi: u16,
    /// The certificate's defect of what is left; a rhombus changes it by one.
    defect: i32,
    /// Where rhombi may lie; everywhere when there is none.
    fence: Option<Fence>,
    /// Where the loaded loop's first corner lies in the fence's plane.
    base: Point,
}

impl Region {
    pub(crate) fn new(alphabet: Alphabet, sweep: Sweep) -> Self {
        Self {
            alphabet,
            sweep,
            units: std::array::from_fn(|d| pack(Point::unit(d as u8))),
            nodes: Vec::new(),
            positions: Vec::new(),
            crowd: Crowd::default(),
            free: Vec::new(),
            queue: Vec::new(),
            placed: Vec::new(),
            loop_of: Vec::new(),
            cost: 0,
            rhombi: 0,
            defect: 0,
            fence: None,
            base: Point::ORIGIN,
        }
    }

    /// Keeps rhombi inside a fence, if there is one.
    pub(crate) fn fenced(self, fence: Option<Fence>) -> Self {
        Self { fence, ..self }
    }

    /// True when it matters where a loop lies.
    pub(crate) fn is_fenced(&self) -> bool {
        self.fence.is_some()
    }

    /// Lets up to `rhombi` rhombi be placed in the loop just loaded, whose certificate has this defect, and whose first
    /// corner is at `base`.
    pub(crate) fn allow(&mut self, rhombi: u16, defect: i32, base: Point) {
        self.rhombi = rhombi;
        self.defect = defect;
        self.base = base;
    }

    /// How many more rhombi may be placed.
    pub(crate) fn rhombi(&self) -> u16 {
        self.rhombi
    }

    /// Starts over with one loop, its first corner at the origin.
    pub(crate) fn load(&mut self, word: &[u8]) {
        self.nodes.clear();
        self.positions.clear();
        self.free.clear();
        self.queue.clear();
        self.placed.clear();
        self.cost = 0;
        self.rhombi = 0;
        let (mut direction, symbols) = (word[0], &word[1..]);
        self.crowd.clear(symbols.len());
        let last = symbols.len() as Corner - 1;
        let mut position = 0;
        for (k, &symbol) in symbols.iter().enumerate() {
            let k = k as Corner;
            if k > 0 {
                direction = (direction + 18 - angle(symbol)) % 12;
            }
            let (next, prev) = (if k == last { 0 } else { k + 1 }, if k == 0 { last } else { k - 1 });
            self.nodes.push(Node { next, prev, symbol, direction });
            self.positions.push(position);
            *self.crowd.at(position) += 1;
            position += self.units[direction as usize];
        }
    }

    /// Looks at every edge for forced moves, as after a load of a loop that never was settled.
    pub(crate) fn queue_all(&mut self) {
        self.queue.extend(0..self.nodes.len() as Corner);
    }

    /// Cost settled since the load.
    pub(crate) fn cost(&self) -> i64 {
        self.cost
    }

    /// Tiles placed since the load.
    pub(crate) fn placed(&self) -> impl Iterator<Item = Tile> {
        self.placed.iter().map(|&(origin, direction, piece)| piece.tile(unpack(origin), direction))
    }

    /// Places `piece` on the loaded loop's first edge, and its images under `group` on theirs; then all forced moves.
    ///
    /// # Errors
    /// [`Halt`].
    pub(crate) fn play(&mut self, piece: Piece, group: &[Isometry], monitor: &Monitor) -> Result<(), Halt> {
        if self.rhombi > 0 && self.fitting(0) & piece.bit() == 0 {
            return Err(Halt::DeadEnd);
        }
        let first = piece.tile(Point::ORIGIN, self.nodes[0].direction);
        self.place(0, piece).ok_or(Halt::DeadEnd)?;
        for isometry in group {
            let image = first.mapped(*isometry);
            if let Some(corner) = self.corner_of(image.origin, image.direction) {
                self.place(corner, piece).ok_or(Halt::DeadEnd)?;
            } else if !self.placed().any(|tile| tile.normalised() == image.normalised()) {
                return Err(Halt::DeadEnd);
            }
        }
        self.settle(monitor)
    }

    /// Carries out forced moves until there are none.
    ///
    /// # Errors
    /// [`Halt`].
    pub(crate) fn settle(&mut self, monitor: &Monitor) -> Result<(), Halt> {
        while let Some(corner) = self.queue.pop() {
            if self.nodes[corner as usize].next == FREE {
                continue;
            }
            let piece = match self.fitting(corner) {
                0 => return Err(Halt::DeadEnd),
                0b0001 => Piece::Triangle,
                0b0010 => Piece::Square,
                0b0100 => Piece::Sharp,
                0b1000 => Piece::Blunt,
                _ => continue,
            };
            self.place(corner, piece).ok_or(Halt::DeadEnd)?;
            if self.placed.len().is_multiple_of(64) && monitor.is_cancelled() {
                return Err(Halt::Cancelled);
            }
        }
        Ok(())
    }

    /// The pieces that the corners at both ends of an edge admit, by [`Piece::bit`].
    #[inline]
    fn fitting(&mut self, corner: Corner) -> u8 {
        let Node { next, symbol, .. } = self.nodes[corner as usize];
        let (from, to) = (angle(symbol), angle(self.symbol(next)));
        if self.rhombi == 0 {
            return ADMITS[from as usize] & ADMITS[to as usize];
        }
        self.fitting_with_rhombi(corner, from, to)
    }

    fn fitting_with_rhombi(&mut self, corner: Corner, from: u8, to: u8) -> u8 {
        let direction = self.nodes[corner as usize].direction;
        let origin = unpack(self.positions[corner as usize]) + self.base;
        let end = origin + Point::unit(direction);
        let mut bits = 0;
        for piece in Piece::ALL {
            let [begin, arrive] = piece.angles();
            if from >= begin
                && to >= arrive
                && self.may_be_left(from - begin, origin)
                && self.may_be_left(to - arrive, end)
                && (!piece.is_rhombus() || self.may_lie(piece.tile(origin, direction)))
            {
                bits |= piece.bit();
            }
        }
        bits
    }

    /// True unless the angle is left for a sharp corner that may not lie at the point.
    fn may_be_left(&mut self, angle: u8, point: Point) -> bool {
        angle != 1 || self.fence.as_mut().is_none_or(|fence| fence.may_admit(point))
    }

    /// True when a rhombus lies within the fence and leaves a defect that the other rhombi can take up.
    fn may_lie(&mut self, rhombus: Tile) -> bool {
        let left = self.defect - defect_of(rhombus.direction);
        (self.rhombi == ANY_NUMBER || left.unsigned_abs() < u32::from(self.rhombi))
            && self.fence.as_mut().is_none_or(|fence| fence.admits(rhombus.corners()))
    }

    /// The corner at a point whose edge leaves in this direction.
    fn corner_of(&self, point: Point, direction: Direction) -> Option<Corner> {
        let position = pack(point);
        let found = |k: &usize| self.positions[*k] == position && self.nodes[*k].direction == direction;
        (0..self.positions.len()).find(found).map(|k| k as Corner)
    }

    fn symbol(&self, corner: Corner) -> Symbol {
        self.nodes[corner as usize].symbol
    }

    fn link(&mut self, from: Corner, to: Corner) {
        self.nodes[from as usize].next = to;
        self.nodes[to as usize].prev = from;
    }

    fn add(&mut self, symbol: Symbol, direction: Direction, position: i64) -> Corner {
        let node = Node { next: FREE, prev: FREE, symbol, direction };
        let corner = if let Some(corner) = self.free.pop() {
            self.nodes[corner as usize] = node;
            self.positions[corner as usize] = position;
            corner
        } else {
            self.nodes.push(node);
            self.positions.push(position);
            self.nodes.len() as Corner - 1
        };
        *self.crowd.at(position) += 1;
        self.queue.push(corner);
        corner
    }

    fn remove(&mut self, corner: Corner) {
        self.nodes[corner as usize].next = FREE;
        *self.crowd.at(self.positions[corner as usize]) -= 1;
        self.positions[corner as usize] = NOWHERE;
        self.free.push(corner);
    }

    /// Lets a tile take an end of a corner. `None` when it does not fit.
    fn take(&mut self, corner: Corner, tile: u8, end: End) -> Option<()> {
        let node = &mut self.nodes[corner as usize];
        let (symbol, cost) = self.alphabet.take(node.symbol, tile, end)?;
        node.symbol = symbol;
        self.cost += cost;
        Some(())
    }

    /// Puts a tile on the edge that leaves `from`. `None` when it does not fit.
    fn place(&mut self, from: Corner, piece: Piece) -> Option<()> {
        let Node { next: to, prev: before, direction, .. } = self.nodes[from as usize];
        let origin = self.positions[from as usize];
        let [begin, arrive] = piece.angles();
        self.placed.push((origin, direction, piece));
        self.take(from, begin, End::Leaving)?;
        self.take(to, arrive, End::Arriving)?;
        for corner in [before, from, to] {
            self.queue.push(corner);
        }
        let up = (direction + begin) % 12;
        let above = origin + self.units[up as usize];
        self.nodes[from as usize].direction = up;
        let fresh = if piece == Piece::Triangle {
            let (symbol, cost) = self.alphabet.fresh(begin);
            let apex = self.add(symbol, (direction + 10) % 12, above);
            self.link(from, apex);
            self.link(apex, to);
            self.cost += cost;
            [(apex, begin), (FREE, 0)]
        } else {
            // Opposite angles are equal.
            let ((left_symbol, left_cost), (right_symbol, right_cost)) =
                (self.alphabet.fresh(arrive), self.alphabet.fresh(begin));
            let left = self.add(left_symbol, direction, above);
            let right = self.add(right_symbol, (up + 6) % 12, above + self.units[direction as usize]);
            self.link(from, left);
            self.link(left, right);
            self.link(right, to);
            self.cost += left_cost + right_cost;
            [(left, arrive), (right, begin)]
        };
        if piece.is_rhombus() {
            self.cost += 1;
            if self.rhombi != ANY_NUMBER {
                self.rhombi = self.rhombi.checked_sub(1)?;
                self.defect -= defect_of(piece.tile(Point::ORIGIN, direction).direction);
                if self.rhombi == 0 {
                    // More moves are forced from here.
                    self.queue_all();
                }
            }
        }
        for end in [from, to] {
            if self.nodes[end as usize].next != FREE && angle(self.symbol(end)) == 0 {
                self.zip(end, fresh)?;
            }
        }
        for (corner, tile) in fresh {
            if corner != FREE && self.nodes[corner as usize].next != FREE {
                self.split_at(corner, tile, fresh)?;
            }
        }
        Some(())
    }

    /// Cancels the two edges at a corner whose angle is used up, and goes on while the next corner's is used up too. One
    /// of the two corners that meet is new, with one tile, which the other takes over.
    fn zip(&mut self, mut corner: Corner, fresh: [Fresh; 2]) -> Option<()> {
        let tile_at = |corner: Corner| fresh.iter().find(|fresh| fresh.0 == corner).map(|fresh| fresh.1);
        loop {
            let Node { next, prev, .. } = self.nodes[corner as usize];
            if next == prev {
                // The loop is used up.
                if angle(self.symbol(next)) != 0 {
                    return None;
                }
                self.remove(corner);
                self.remove(next);
                return Some(());
            }
            let (kept, end, tile) = if let Some(tile) = tile_at(next) {
                let Node { next: beyond, direction, .. } = self.nodes[next as usize];
                self.nodes[prev as usize].direction = direction;
                self.remove(next);
                self.link(prev, beyond);
                (prev, End::Leaving, tile)
            } else if let Some(tile) = tile_at(prev) {
                let beyond = self.nodes[prev as usize].prev;
                self.remove(prev);
                self.link(beyond, next);
                (next, End::Arriving, tile)
            } else {
                return None;
            };
            self.cost -= self.alphabet.fresh(tile).1;
            self.remove(corner);
            self.take(kept, tile, end)?;
            self.queue.push(kept);
            self.queue.push(self.nodes[kept as usize].prev);
            if angle(self.symbol(kept)) != 0 {
                return Some(());
            }
            corner = kept;
        }
    }

    /// Splits the loop of a new corner that lies on another corner of it.
    fn split_at(&mut self, corner: Corner, tile: u8, fresh: [Fresh; 2]) -> Option<()> {
        let position = self.positions[corner as usize];
        let Some(other) = self.other_at(position, corner) else { return Some(()) };
        let (before, before_other) = (self.nodes[corner as usize].prev, self.nodes[other as usize].prev);
        let wedge = |arriving: Corner, leaving: Corner| {
            (self.nodes[arriving as usize].direction + 18 - self.nodes[leaving as usize].direction) % 12
        };
        let (leaving, arriving) = (wedge(before, other), wedge(before_other, corner));
        let (one, two, cost) = self.alphabet.split(self.symbol(other), leaving, tile, arriving)?;
        self.cost += cost - self.alphabet.fresh(tile).1;
        self.link(before, other);
        self.link(before_other, corner);
        self.nodes[other as usize].symbol = one;
        self.nodes[corner as usize].symbol = two;
        for corner in [other, before, corner, before_other] {
            self.queue.push(corner);
        }
        for end in [other, corner] {
            if self.nodes[end as usize].next != FREE && angle(self.symbol(end)) == 0 {
                self.zip(end, fresh)?;
            }
        }
        Some(())
    }

    /// Another corner of the same loop at the same place.
    fn other_at(&mut self, position: i64, corner: Corner) -> Option<Corner> {
        if *self.crowd.at(position) == 1 {
            return None;
        }
        let same_loop = |other: Corner| {
            let mut at = self.nodes[corner as usize].next;
            while at != corner && at != other {
                at = self.nodes[at as usize].next;
            }
            at == other
        };
        let here = self.positions.iter().enumerate().filter(|&(_, &p)| p == position).map(|(k, _)| k as Corner);
        here.filter(|&other| other != corner).find(|&other| same_loop(other))
    }

    /// Reads the loops that are left; false when one of them cannot bound a plane disk.
    pub(crate) fn loops(&mut self, loops: &mut Loops) -> bool {
        const UNSEEN: u32 = u32::MAX;
        self.loop_of.clear();
        self.loop_of.resize(self.nodes.len(), UNSEEN);
        loops.bytes.clear();
        loops.ends.clear();
        for first in 0..self.nodes.len() {
            if self.nodes[first].next == FREE || self.loop_of[first] != UNSEEN {
                continue;
            }
            let (mut lowest, mut least, mut height) = (first, 0, 0);
            let (mut at, mut turning) = (first, 0);
            loop {
                self.loop_of[at] = loops.ends.len() as u32;
                if height < least {
                    (lowest, least) = (at, height);
                }
                let node = self.nodes[at];
                turning += 6 - i32::from(angle(node.symbol));
                height += self.sweep.0[node.direction as usize];
                at = node.next as usize;
                if at == first {
                    break;
                }
            }
            if turning != 12 {
                return false;
            }
            loops.bytes.push(self.nodes[lowest].direction);
            at = lowest;
            loop {
                let node = self.nodes[at];
                loops.bytes.push(node.symbol);
                at = node.next as usize;
                if at == lowest {
                    break;
                }
            }
            loops.ends.push((unpack(self.positions[lowest]), loops.bytes.len()));
        }
        true
    }

    /// Which of the loops that [`Region::loops`] listed has this edge.
    pub(crate) fn loop_with_edge(&self, point: Point, direction: Direction) -> Option<usize> {
        self.corner_of(point, direction).map(|corner| self.loop_of[corner as usize] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_filled(region: &mut Region) -> bool {
        let mut loops = Loops::default();
        region.loops(&mut loops) && loops.len() == 0
    }

    #[test]
    fn the_last_triangle_and_the_last_square_close() {
        for word in [&[0, 2, 2, 2][..], &[5, 3, 3, 3, 3]] {
            let mut region = Region::new(Alphabet::plain(), Sweep::new([1, 3]));
            region.load(word);
            region.queue_all();
            region.settle(&Monitor::new()).unwrap();
            assert_eq!(region.placed().count(), 1);
            assert!(is_filled(&mut region));
        }
    }

    #[test]
    fn a_pinch_splits_the_loop() {
        // Two unit hexagons joined by the edge of a square: the square is forced, and leaves both.
        let word = [0, 7, 4, 4, 4, 4, 7, 7, 4, 4, 4, 4, 7];
        let mut region = Region::new(Alphabet::plain(), Sweep::new([1, 3]));
        region.load(&word);
        region.queue_all();
        region.settle(&Monitor::new()).unwrap();
        assert_eq!(region.placed().count(), 13);
        assert!(is_filled(&mut region));
    }
}
