//! Outlines as boundary codes (section 3.3): the interior angles in units of 30 degrees, counter-clockwise, of a polygon
//! with unit edges.

use crate::TilingError;
use crate::plane::{Direction, Point};
use crate::region::MAX_EDGES;
use std::collections::BTreeMap;

/// A closed simple polygon with unit edges in the twelve directions: the outline of a region to tile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Boundary {
    code: Vec<u8>,
    directions: Vec<Direction>,
    points: Vec<Point>,
}

impl Boundary {
    /// The outline with this code. Its first corner lies at the origin, and its first edge along the x axis.
    ///
    /// # Errors
    /// [`TilingError::Boundary`] when the code is too short or too long (16,000 edges), an angle is not in 2 to 11, or
    /// the polygon does not turn once, does not close, or touches itself. Costs O(n log n) unless corners crowd.
    pub fn new(code: &[u8]) -> Result<Self, TilingError> {
        let trace = Trace::new(code)?;
        let fault = |code, sentence, corners| Err(TilingError::Boundary { code, sentence, corners });
        if trace.turning != 12 {
            return fault("turning", trace.turning_sentence(), Vec::new());
        }
        if trace.end != Point::ORIGIN {
            return fault("open", trace.gap_sentence(), Vec::new());
        }
        let contacts = trace.contacts();
        if contacts.is_empty() {
            return Ok(Self { code: code.to_vec(), directions: trace.directions, points: trace.points });
        }
        let sentence = format!(
            "the outline crosses or touches itself at {} pairs of edges, the first of them {} and {}; change the angles there",
            contacts.len(),
            contacts[0][0],
            contacts[0][1]
        );
        fault("not_simple", sentence, contacts.into_flattened())
    }

    /// The interior angles, in units of 30 degrees.
    pub fn code(&self) -> &[u8] {
        &self.code
    }

    /// Direction of the edge that leaves each corner.
    pub fn directions(&self) -> &[Direction] {
        &self.directions
    }

    /// The corners.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The first edge's direction and the angles: how the state graph writes a loop.
    pub(crate) fn word(&self) -> Vec<u8> {
        [&self.directions[..1], &self.code].concat()
    }
}

/// A code drawn from the origin, whether or not it closes.
pub(crate) struct Trace {
    pub(crate) directions: Vec<Direction>,
    pub(crate) points: Vec<Point>,
    /// Where the last edge ends.
    pub(crate) end: Point,
    /// Sum of the exterior angles in units of 30 degrees; 12 for a simple polygon.
    pub(crate) turning: i32,
}

impl Trace {
    /// # Errors
    /// [`TilingError::Boundary`] for a code that cannot be drawn: too short, too long, or with an impossible angle.
    pub(crate) fn new(code: &[u8]) -> Result<Self, TilingError> {
        let fault = |code, sentence: String, corners| Err(TilingError::Boundary { code, sentence, corners });
        if code.len() < 3 {
            return fault("too_short", format!("the code has {} angles; a polygon has at least 3", code.len()), vec![]);
        }
        if code.len() > MAX_EDGES {
            let sentence =
                format!("the code has {} angles; at most {MAX_EDGES} are possible: divide the outline", code.len());
            return fault("too_long", sentence, vec![]);
        }
        let wrong: Vec<u32> = (0..code.len()).filter(|&k| !(2..=11).contains(&code[k])).map(|k| k as u32).collect();
        if let Some(&first) = wrong.first() {
            let sentence = format!(
                "angle {} at corner {first} is not possible: angles are 2 to 11, in units of 30 degrees",
                code[first as usize]
            );
            return fault("angle", sentence, wrong);
        }
        let mut directions = vec![0];
        for &angle in &code[1..] {
            directions.push((directions[directions.len() - 1] + 18 - angle) % 12);
        }
        let mut end = Point::ORIGIN;
        let mut points = Vec::with_capacity(code.len());
        for &direction in &directions {
            points.push(end);
            end = end + Point::unit(direction);
        }
        let turning = code.iter().map(|&angle| 6 - i32::from(angle)).sum();
        Ok(Self { directions, points, end, turning })
    }

    pub(crate) fn turning_sentence(&self) -> String {
        let excess = 12 - self.turning;
        format!(
            "the exterior angles add up to {} degrees instead of 360: {} the angles by {} units of 30 degrees in all",
            30 * self.turning,
            if excess > 0 { "lower" } else { "raise" },
            excess.abs()
        )
    }

    pub(crate) fn gap_sentence(&self) -> String {
        let [x, y] = self.end.position();
        format!("the outline ends ({x:.3}, {y:.3}) from where it begins: add, remove or turn edges that close this gap")
    }

    /// Pairs of edges, by the corners they leave, that have a point in common other than the corner between neighbours.
    pub(crate) fn contacts(&self) -> Vec<[u32; 2]> {
        // Edges that meet begin at most 2 apart: in the same cell or in neighbouring ones, whatever the rounding.
        const CELL: f64 = 2.5;
        let cell = |k: usize| self.points[k].position().map(|x| (x / CELL).floor() as i32);
        let n = self.points.len();
        let mut cells: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        for k in 0..n {
            cells.entry(cell(k)).or_default().push(k);
        }
        let mut contacts = Vec::new();
        for i in 0..n {
            let [x, y] = cell(i);
            let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
            for &j in around.filter_map(|cell| cells.get(&cell)).flatten().filter(|&&j| j > i) {
                let neighbours = j == i + 1 || (i == 0 && j == n - 1);
                if !neighbours && meet(self.edge(i), self.edge(j)) {
                    contacts.push([i as u32, j as u32]);
                }
            }
        }
        contacts.sort_unstable();
        contacts
    }

    fn edge(&self, k: usize) -> [Point; 2] {
        [self.points[k], self.points[k] + Point::unit(self.directions[k])]
    }
}

/// True when two segments have a point in common, exactly.
pub(crate) fn meet([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let side = |p: Point, q: Point, r: Point| (q - p).four_cross(r - p).signum();
    let (c_side, d_side) = (side(a, b, c), side(a, b, d));
    let (a_side, b_side) = (side(c, d, a), side(c, d, b));
    if [c_side, d_side, a_side, b_side] == [0; 4] {
        // On one line: they meet when an end of one lies between the ends of the other.
        let between = |p: Point, q: Point, r: Point| (p - r).four_dot(q - r).signum() <= 0;
        return between(a, b, c) || between(a, b, d) || between(c, d, a);
    }
    c_side * d_side <= 0 && a_side * b_side <= 0
}
