//! Quad disks: what a filling is, how a pattern with strip multiplicities unfolds into one, and how moves reduce a disk to
//! a simpler one and put it back together. Topology only; positions are [`crate::place`]'s business.

use crate::pattern::{Pattern, edge_key};
use mesh::Topology;
use std::collections::{BTreeMap, VecDeque};

/// How a filling was found.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// One pattern of the catalogue, by name, with every corner regular.
    Pattern(String),
    /// A pattern or a grid after rows were peeled off or corners merged.
    Moves,
    /// More corners than patterns have sides, or corners too blunt for one quad: these were made flat before filling.
    Flattened,
    /// A ring of quads around a grid: exists for every disk.
    Universal,
}

/// What makes one filling worse than another; compared field by field in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Corners with another number of quads than one.
    pub irregular_corners: u32,
    /// Sum of |valence - 4| over inner vertices and of |quads - 2| over border vertices that are not corners. A valence of
    /// 6 thus counts like two of 5, because it bends its quads as much.
    pub valence_excess: u32,
    /// Moves made before a pattern fitted: rows peeled off and corners merged. The universal ring counts as one for each side.
    pub moves: u32,
    /// Variance of the strip multiplicities, plus one for each vertex of valence 6 or more: breaks near ties.
    pub unevenness: f64,
}

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let counts = |c: &Self| (c.irregular_corners, c.valence_excess, c.moves);
        counts(self).cmp(&counts(other)).then(self.unevenness.total_cmp(&other.unevenness))
    }
}

/// A disk of quads. The vertices `0..border.len()` are the border, counter-clockwise from corner 0; the others lie inside.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchTopology {
    /// Number of vertices.
    pub vertex_count: usize,
    /// Border vertices in order, counter-clockwise from corner 0: always `0, 1, 2, ...`.
    pub border: Vec<u32>,
    /// Vertices of each quad, counter-clockwise.
    pub quads: Vec<[u32; 4]>,
    /// How it was found.
    pub method: Method,
    /// Number of irregular vertices: inner ones of valence other than 4, border ones (corners apart) with other than two
    /// quads.
    pub irregular: u32,
    /// What candidates are ranked by.
    pub cost: Cost,
}

/// A quad disk whose first `perimeter` vertices are its border, counter-clockwise.
#[derive(Debug, Clone)]
pub(crate) struct Disk {
    pub perimeter: u32,
    pub vertex_count: u32,
    pub quads: Vec<[u32; 4]>,
}

/// Irregular elements of a disk, counted on the disk itself.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Irregularity {
    pub corners: u32,
    pub vertices: u32,
    pub excess: u32,
    pub high: u32,
}

impl Disk {
    /// Unfolds a pattern: every coarse quad becomes a grid, as wide and high as its two strips.
    pub(crate) fn unfold(pattern: &Pattern, strips: &[u32]) -> Self {
        let width = |a: u32, b: u32| strips[pattern.strip_of_edge[&edge_key(a, b)]];
        let mut of_vertex = vec![mesh::NONE; pattern.vertex_count];
        // Inner vertices of each coarse edge, from its lower to its higher end.
        let mut of_edge: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        let mut count = 0;
        for side in &pattern.sides {
            for edge in side.windows(2) {
                of_vertex[edge[0] as usize] = count;
                let end = count + width(edge[0], edge[1]);
                let mut inner: Vec<u32> = (count + 1..end).collect();
                if edge[0] > edge[1] {
                    inner.reverse();
                }
                of_edge.insert(edge_key(edge[0], edge[1]), inner);
                count = end;
            }
        }
        let perimeter = count;
        for vertex in of_vertex.iter_mut().filter(|v| **v == mesh::NONE) {
            *vertex = count;
            count += 1;
        }
        for (&edge, &strip) in &pattern.strip_of_edge {
            of_edge.entry(edge).or_insert_with(|| {
                let start = count;
                count += strips[strip] - 1;
                (start..count).collect()
            });
        }
        let along = |a: u32, b: u32| {
            let mut line = vec![of_vertex[a as usize]];
            let inner = &of_edge[&edge_key(a, b)];
            if a < b {
                line.extend(inner);
            } else {
                line.extend(inner.iter().rev());
            }
            line.push(of_vertex[b as usize]);
            line
        };
        let mut quads = Vec::new();
        for &[a, b, c, d] in &pattern.quads {
            let (mut below, top) = (along(a, b), along(d, c));
            let (left, right) = (along(a, d), along(b, c));
            for row in 1..left.len() {
                let mut above = if row + 1 == left.len() { top.clone() } else { vec![left[row]] };
                if above.len() == 1 {
                    for _ in 2..below.len() {
                        above.push(count);
                        count += 1;
                    }
                    above.push(right[row]);
                }
                push_row(&mut quads, &below, &above);
                below = above;
            }
        }
        Self { perimeter, vertex_count: count, quads }
    }

    /// The same disk with its inner vertices and quads numbered in the order of a walk from the border edge 0-1: equal
    /// disks get equal numbers. O(quads).
    pub(crate) fn renumbered(&self) -> Self {
        let topology = Topology::new(self.vertex_count as usize, &self.quads);
        let mut number: Vec<u32> =
            (0..self.vertex_count).map(|v| if v < self.perimeter { v } else { mesh::NONE }).collect();
        let mut count = self.perimeter;
        let mut seen = vec![false; self.quads.len()];
        let mut queue = VecDeque::new();
        let mut quads = Vec::with_capacity(self.quads.len());
        queue.extend(topology.find(0, 1));
        while let Some(start) = queue.pop_front() {
            if std::mem::replace(&mut seen[topology.face[start as usize] as usize], true) {
                continue;
            }
            let mut h = start;
            quads.push([(); 4].map(|()| {
                let v = topology.from(h) as usize;
                if number[v] == mesh::NONE {
                    number[v] = count;
                    count += 1;
                }
                if !topology.is_border(h) {
                    queue.push_back(topology.twin[h as usize]);
                }
                h = topology.next[h as usize];
                number[v]
            }));
        }
        Self { perimeter: self.perimeter, vertex_count: self.vertex_count, quads }
    }

    /// Counts irregular corners and vertices; `corners` are border vertices.
    pub(crate) fn irregularity(&self, corners: impl IntoIterator<Item = u32>) -> Irregularity {
        let mut quads = vec![0i64; self.vertex_count as usize];
        for &v in self.quads.iter().flatten() {
            quads[v as usize] += 1;
        }
        let mut wanted: Vec<i64> = (0..self.vertex_count).map(|v| if v < self.perimeter { 2 } else { 4 }).collect();
        for corner in corners {
            wanted[corner as usize] = 1;
        }
        let mut sum = Irregularity::default();
        for (&count, &wanted) in quads.iter().zip(&wanted) {
            let off = (count - wanted).unsigned_abs() as u32;
            if wanted == 1 {
                sum.corners += u32::from(off > 0);
            } else {
                sum.vertices += u32::from(off > 0);
                sum.excess += off;
                sum.high += u32::from(count >= 6);
            }
        }
        sum
    }

    /// The disk seen from a differently named border: `position(v)` is the new place of border vertex `v`. `mirrored`
    /// turns the quads over.
    pub(crate) fn with_border(&self, mirrored: bool, position: impl Fn(u32) -> u32) -> Self {
        let rename = |v: u32| if v < self.perimeter { position(v) } else { v };
        let quads = self
            .quads
            .iter()
            .map(|q| {
                let [a, b, c, d] = q.map(rename);
                if mirrored { [a, d, c, b] } else { [a, b, c, d] }
            })
            .collect();
        Self { quads, ..*self }
    }
}

/// One row of quads between two vertex lines of equal length, both running with the inside on the left of `below`.
pub(crate) fn push_row(quads: &mut Vec<[u32; 4]>, below: &[u32], above: &[u32]) {
    for (b, a) in below.windows(2).zip(above.windows(2)) {
        quads.push([b[0], b[1], a[1], a[0]]);
    }
}

/// A corner of an outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Corner {
    /// Border vertex.
    pub at: u32,
    /// True for a corner of the patch, false for one that a peeled row left.
    pub real: bool,
}

/// The border of a disk still to fill: its length and its corners in order, the first one at vertex 0.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Outline {
    pub perimeter: u32,
    pub corners: Vec<Corner>,
}

/// A step towards a disk that some pattern fills.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Move {
    /// A row of quads on a side; `flatten` says which of the two corners the row leaves are made flat: an irregular
    /// border vertex each.
    Peel { side: usize, flatten: [bool; 2] },
    /// A real corner is treated as flat: an irregular corner.
    Merge { corner: usize },
}

/// What a move leaves to fill, and how that sits in the disk it came from.
#[derive(Debug)]
pub(crate) struct Reduction {
    pub inner: Outline,
    /// Outer vertex of each border vertex of the inner disk; vertices from the outer perimeter on are new.
    border: Vec<u32>,
    row: Vec<[u32; 4]>,
    outer_perimeter: u32,
    added: u32,
}

impl Outline {
    /// The outline of a patch with these side counts; none for a loop without corners.
    pub(crate) fn new(sides: &[u32]) -> Self {
        let mut perimeter = 0;
        let corners = sides
            .iter()
            .map(|&side| {
                perimeter += side;
                Corner { at: perimeter - side, real: true }
            })
            .collect();
        Self { perimeter, corners }
    }

    /// The outline of a loop without corners.
    pub(crate) fn closed(perimeter: u32) -> Self {
        Self { perimeter, corners: vec![] }
    }

    /// Edges on each side.
    pub(crate) fn sides(&self) -> Vec<u32> {
        let ends = self.corners.iter().skip(1).map(|c| c.at).chain([self.perimeter]);
        self.corners.iter().zip(ends).map(|(c, end)| end - c.at).collect()
    }

    /// Makes every corner flat that is not kept.
    pub(crate) fn keep(&self, kept: impl Fn(usize) -> bool) -> Reduction {
        let corners = (0..self.corners.len()).filter(|&k| kept(k)).map(|k| self.corners[k]).collect();
        self.reduction((0..self.perimeter).collect(), corners, vec![], 0)
    }

    /// All moves that make sense here.
    pub(crate) fn moves(&self) -> Vec<Move> {
        let n = self.corners.len();
        let mut moves = Vec::new();
        for side in 0..if n < 2 { 0 } else { n } {
            for flatten in [[false, false], [true, false], [false, true], [true, true]] {
                moves.push(Move::Peel { side, flatten });
            }
        }
        moves.extend((0..n).filter(|&k| self.corners[k].real).map(|corner| Move::Merge { corner }));
        moves
    }

    /// Makes a move; `None` when a neighbouring side is too short for it or less than one quad is left.
    pub(crate) fn reduce(&self, step: Move) -> Option<Reduction> {
        match step {
            Move::Merge { corner } => Some(self.keep(|k| k != corner)),
            Move::Peel { side, flatten } => self.peel(side, flatten),
        }
    }

    fn peel(&self, side: usize, flatten: [bool; 2]) -> Option<Reduction> {
        let (n, sides, p) = (self.corners.len(), self.sides(), self.perimeter);
        let [before, after] = [sides[(side + n - 1) % n], sides[(side + 1) % n]];
        // Both neighbours give up an edge and keep one; with two sides they are the same side.
        if before.min(after) < if n == 2 { 3 } else { 2 } || p < 6 {
            return None;
        }
        let (start, length) = (self.corners[side].at, sides[side]);
        let outside: Vec<u32> = (0..=length).map(|k| (start + k) % p).collect();
        let mut inside = vec![(start + p - 1) % p];
        inside.extend(p..p + length - 1);
        inside.push((start + length + 1) % p);
        let mut row = Vec::with_capacity(length as usize);
        push_row(&mut row, &outside, &inside);

        let mut corners = Vec::with_capacity(n);
        if !flatten[0] {
            corners.push(Corner { at: 0, real: false });
        }
        if !flatten[1] {
            corners.push(Corner { at: length, real: false });
        }
        for k in 2..n {
            let corner = self.corners[(side + k) % n];
            corners.push(Corner { at: length + (corner.at + 2 * p - start - length - 1) % p, ..corner });
        }
        // The rest of the border, from beyond the row's end to before its start.
        inside.extend((2..p - length - 1).map(|k| (start + length + k) % p));
        Some(self.reduction(inside, corners, row, length - 1))
    }

    fn reduction(&self, mut border: Vec<u32>, mut corners: Vec<Corner>, row: Vec<[u32; 4]>, added: u32) -> Reduction {
        let first = corners.first().map_or(0, |c| c.at);
        border.rotate_left(first as usize);
        for corner in &mut corners {
            corner.at -= first;
        }
        let inner = Self { perimeter: border.len() as u32, corners };
        Reduction { inner, border, row, outer_perimeter: self.perimeter, added }
    }
}

impl Reduction {
    /// The outer disk, given a filling of the inner one.
    pub(crate) fn restore(&self, inner: &Disk) -> Disk {
        let shift = self.outer_perimeter + self.added - inner.perimeter;
        let rename = |v: u32| if v < inner.perimeter { self.border[v as usize] } else { v + shift };
        let mut quads = self.row.clone();
        quads.extend(inner.quads.iter().map(|q| q.map(rename)));
        Disk { perimeter: self.outer_perimeter, vertex_count: inner.vertex_count + shift, quads }
    }
}
