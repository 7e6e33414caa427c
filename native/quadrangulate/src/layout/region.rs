//! A part of the surface still to be divided, and what each corner of its border is worth.
//!
//! A corner's worth is its number of *quarters*: how many quads should meet there, 1 where convex, 2 where flat, 3 where
//! concave, 4 at the tip of a slit. A path into a corner shares the quarters between its two sides, which is all of
//! figure 8: concave 3 = 1 + 2 by one trace and 1 + 1 + 1 by two, flat 2 = 1 + 1, and convex 1 cannot be shared.

use super::canvas::Canvas;
use super::{Fault, LayoutOptions};
use glam::DVec3;
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Which corners of a border are convex, flat and concave. Angles are measured inside the region, on the surface, in radians.
#[derive(Debug, Clone, Copy)]
pub struct CornerAngles {
    /// Below it a corner is convex. Default: 157.5 degrees, the paper's.
    pub convex: f64,
    /// Above it a corner is concave. Default: 202.5 degrees, the paper's.
    pub concave: f64,
    /// Above it a corner is the tip of a slit, with room for four quads. Default: 315 degrees.
    pub slit: f64,
    /// A corner that turns by less than this, while both its neighbours turn the same way at least half as much, belongs to a
    /// round curve of few edges and is flat. Default: 50 degrees, an octagon's 45 and some; 0 gives the paper's rule.
    pub round: f64,
    /// A corner at an interior feature may have a quad more or less than that, up to so many quads off its angle, where the vertex has
    /// four in all then. Default: 0, so that none has.
    pub slack: f64,
    /// Bends one way within so little of the border are one, which has as many corners as its turn has right angles: a fillet between
    /// two sides. Scene units. Default: 0, so that each vertex is judged by itself.
    pub fillet: f64,
}

impl Default for CornerAngles {
    fn default() -> Self {
        Self { convex: PI * 0.875, concave: PI * 1.125, slit: PI * 1.75, round: PI / 3.6, slack: 0.0, fillet: 0.0 }
    }
}

impl CornerAngles {
    /// Quarters of a corner from the turn (a straight angle less the corner's) there and at its neighbours along the border.
    pub fn quarters(&self, before: f64, turn: f64, after: f64) -> u8 {
        let alike = |other: f64| other * turn.signum() >= 0.5 * turn.abs();
        if turn.abs() < self.round && alike(before) && alike(after) {
            return 2;
        }
        let angle = PI - turn;
        1 + u8::from(angle >= self.convex) + u8::from(angle > self.concave) + u8::from(angle > self.slit)
    }
}

/// A part still to be divided.
#[derive(Debug, Clone)]
pub(super) struct Region {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// The part between features that it belongs to.
    pub part: u32,
}

/// How a cut divides the quarters at the two ends of its path: those of the fan before the path (from the outgoing border
/// half-edge counter-clockwise), and those after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub start: [u8; 2],
    pub end: [u8; 2],
}

/// A vertex of a region's border.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    pub vertex: u32,
    pub place: u32,
    pub at: DVec3,
    pub quarters: u8,
    /// Angle on the surface inside, radians.
    pub angle: f64,
}

/// What a region has round and inside it.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    /// Border loops, each along its triangles.
    pub loops: Vec<Vec<Bend>>,
    /// Vertices inside where the cross is singular.
    pub singular: Vec<u32>,
    /// Euler characteristic: 1 for a disk, 0 for an annulus.
    pub euler_characteristic: i64,
    /// Sum of the triangle areas.
    pub area: f64,
}

impl Outline {
    /// Measures a region. O(triangles).
    pub fn new(canvas: &Canvas, region: &Region) -> Self {
        let topology = canvas.topology();
        let mut seen = vec![false; topology.len()];
        let (mut loops, mut singular) = (vec![], vec![]);
        let (mut vertices, mut borders) = (0, 0);
        for start in region.triangles.iter().flat_map(|t| 3 * t..3 * t + 3) {
            let v = topology.from(start);
            if topology.outgoing[v as usize] == start {
                vertices += 1;
                if canvas.index[v as usize] != 0 {
                    singular.push(v);
                }
            }
            if seen[start as usize] || !topology.is_border(start) {
                continue;
            }
            let (mut border, mut h) = (vec![], start);
            while !seen[h as usize] {
                seen[h as usize] = true;
                let v = topology.from(h);
                border.push(Bend {
                    vertex: v,
                    place: canvas.place[v as usize],
                    at: canvas.at(v),
                    quarters: canvas.quarters[v as usize],
                    angle: canvas.graph.angle(v),
                });
                // Turn about the end vertex until the border is met again.
                h = topology.next[h as usize];
                while !topology.is_border(h) {
                    h = topology.next[topology.twin[h as usize] as usize];
                }
            }
            borders += border.len() as i64;
            loops.push(border);
        }
        let faces = region.triangles.len() as i64;
        Self {
            loops,
            singular,
            euler_characteristic: vertices - i64::midpoint(3 * faces, borders) + faces,
            area: region.triangles.iter().map(|&t| canvas.area(t)).sum(),
        }
    }

    /// Vertices of each side, from its first corner; the whole border where it has no corner.
    pub fn sides(&self) -> Vec<Vec<u32>> {
        let mut sides = vec![];
        for border in &self.loops {
            let first = border.iter().position(|bend| bend.quarters == 1).unwrap_or(0);
            let mut side = vec![];
            for bend in border[first..].iter().chain(&border[..first]) {
                if bend.quarters == 1 && !side.is_empty() {
                    sides.push(std::mem::take(&mut side));
                }
                side.push(bend.vertex);
            }
            sides.push(side);
        }
        sides
    }

    /// Sum of the indices of the cross inside, in quarter turns.
    pub fn index(&self, canvas: &Canvas) -> i64 {
        self.singular.iter().map(|&v| i64::from(canvas.index[v as usize])).sum()
    }
}

/// A region's distance from being a patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    pub sides: usize,
    pub concave: usize,
    pub euler_characteristic: i64,
    pub touches_itself: bool,
    /// Sides that turn by more than the options allow.
    pub round: usize,
    /// How much longer sides are than the options want.
    pub long: usize,
    /// How many sides more or fewer it has than the field inside asks for: where traces follow the field, the quarters that the border
    /// turns by and the indices of the singularities inside add up to four for a disk (Poincaré and Hopf). None unless that is asked for.
    pub astray: usize,
}

impl Shape {
    /// That of a region with these border loops, Euler characteristic, and sum of the indices of the cross inside.
    pub fn of(loops: &[Vec<Bend>], euler_characteristic: i64, index: i64, options: &LayoutOptions) -> Self {
        let border = || loops.iter().flatten();
        let mut seen = BTreeSet::new();
        let [round, long] = round_sides(loops, options.side_turn, options.longest);
        let turns: i64 = border().map(|bend| 2 - i64::from(bend.quarters)).sum();
        Self {
            sides: border().filter(|bend| bend.quarters == 1).count(),
            concave: border().filter(|bend| bend.quarters > 2).count(),
            euler_characteristic,
            astray: if options.regular {
                (turns + index - 4 * euler_characteristic).unsigned_abs() as usize
            } else {
                0
            },
            touches_itself: !border().all(|bend| seen.insert(bend.place)),
            round,
            long,
        }
    }

    /// What keeps the region from being a patch, the worst first.
    pub fn fault(&self) -> Option<Fault> {
        if self.concave > 0 {
            Some(Fault::Concave)
        } else if self.euler_characteristic != 1 {
            Some(Fault::NotDisk { euler_characteristic: self.euler_characteristic })
        } else if self.touches_itself {
            Some(Fault::TouchesItself)
        } else if !(3..=6).contains(&self.sides) {
            Some(Fault::Sides { count: self.sides })
        } else {
            None
        }
    }

    /// What cuts should lower, but is no fault.
    pub fn soft(&self) -> usize {
        self.round + self.long
    }

    /// Zero for a patch; every cut must lower the sum over its parts. A handle or hole outweighs touching, which outweighs sides.
    pub fn badness(&self) -> usize {
        let holes = (1 - self.euler_characteristic).unsigned_abs() as usize;
        let sides = 3_usize.saturating_sub(self.sides) + self.sides.saturating_sub(6);
        100 * holes + 10 * usize::from(self.touches_itself) + sides
    }
}

/// Number of sides (stretches between corners) whose bends add up to more than `limit`; and by how much sides are longer than
/// `longest`, squared, so that halves count less.
fn round_sides(loops: &[Vec<Bend>], limit: f64, longest: f64) -> [usize; 2] {
    let excess = |length: f64| (4.0 * (length / longest - 1.0).max(0.0).powi(2)) as usize;
    let (mut count, mut long) = (0, 0);
    for border in loops {
        let first = border.iter().position(|bend| bend.quarters == 1).unwrap_or(0);
        let (mut turn, mut length) = (0.0_f64, 0.0);
        for k in 0..border.len() {
            let [bend, next] = [k, k + 1].map(|k| &border[(first + k) % border.len()]);
            if bend.quarters != 1 {
                turn += PI - bend.angle;
            } else if k > 0 {
                count += usize::from(turn.abs() > limit);
                long += excess(length);
                (turn, length) = (0.0, 0.0);
            }
            length += bend.at.distance(next.at);
        }
        count += usize::from(turn.abs() > limit);
        long += excess(length);
    }
    [count, long]
}
