//! Necessary conditions that an outline can be read off in one pass: the area test of section 6, and a finer one.
//!
//! Write a corner as p = (a, b, c, d) in the basis 0 to 3 of the exact plane, and let
//! A be half the sum of p wedge q over the edges p to q of the outline, a bivector of four-dimensional space. A is the sum
//! over the tiles, whatever the tiling: a square with edges u and v contributes u wedge v, a triangle half of that. Three orientations of squares and two pairs of triangles therefore leave no freedom:
//!
//! - squares with edges along directions 0 and 3: A03; along 1 and 4: A01; along 2 and 5: A23;
//! - triangles with edges along even directions: 2 A02; along odd ones: 2 A13;
//! - A12 = A01 + A23.
//!
//! Inside, every edge is used once in each sense, and a square's edges cancel. So on the outline the edges in direction k
//! less those in direction k + 6 count the triangles with an edge along k less those with one along k + 6, which tells the
//! two triangles of a pair apart.
//!
//! An outline that breaks the third line, or gives a negative count, admits no tiling. The paper's area test is one
//! combination of these. A thin rhombus (30 degrees) changes the defect A12 - A01 - A23 by one.

use crate::plane::{Direction, Point};
use std::fmt;

/// The tiles that any tiling of an outline has, by orientation; and the reason when there can be none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Certificate {
    /// Squares with edges in directions k and k + 3, for k = 0, 1, 2.
    pub squares: [i32; 3],
    /// Triangles with edges in directions k, k + 4 and k + 8, for k = 0 to 3.
    pub triangles: [i32; 4],
    /// A12 - A01 - A23: zero when a tiling exists; its size is the least number of thin rhombi that could help.
    pub defect: i32,
}

impl Certificate {
    /// From the directions of the edges of a closed outline. Costs O(n).
    pub fn new(directions: &[Direction]) -> Self {
        // Twice the bivector: 01, 02, 03, 12, 13, 23.
        let mut twice = [0; 6];
        let mut p = Point::ORIGIN;
        for &direction in directions {
            let e = Point::unit(direction);
            let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            for (sum, (i, j)) in twice.iter_mut().zip(pairs) {
                *sum += p.0[i] * e.0[j] - p.0[j] * e.0[i];
            }
            p = p + e;
        }
        let [a01, a02, a03, a12, a13, a23] = twice;
        let along = |direction| directions.iter().map(|&d| i32::from(d == direction)).sum::<i32>();
        let (even, odd) = (along(0) - along(6), along(3) - along(9));
        // A closed lattice loop is a sum of unit parallelograms and triangles, so all the halves are whole.
        Self {
            squares: [a03, a01, a23].map(|count| count / 2),
            triangles: [a02 + even, a13 - odd, a02 - even, a13 + odd].map(|count| count / 2),
            defect: (a12 - a01 - a23) / 2,
        }
    }

    /// True when the certificate rules out every tiling.
    pub fn refutes(&self) -> bool {
        self.defect != 0 || self.squares.iter().chain(&self.triangles).any(|&count| count < 0)
    }

    /// True when the certificate rules out every tiling with thin rhombi, however many. They leave the triangles as they
    /// are, and take the area of half a square each.
    pub fn refutes_rhombi(&self) -> bool {
        2 * self.square_count() + self.defect < self.defect.abs() || self.triangles.iter().any(|&count| count < 0)
    }

    /// True when the certificate rules out every tiling with at most this many thin rhombi. Each of them changes the
    /// defect by one, and the number of squares of an orientation by one at most.
    pub fn refutes_with_rhombi(&self, most: i32) -> bool {
        self.refutes_rhombi() || self.defect.abs() > most || self.squares.iter().any(|&count| count < -most)
    }

    /// Number of squares of any tiling.
    pub fn square_count(&self) -> i32 {
        self.squares.iter().sum()
    }

    /// Number of triangles of any tiling.
    pub fn triangle_count(&self) -> i32 {
        self.triangles.iter().sum()
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [s0, s1, s2] = self.squares;
        let [t0, t1, t2, t3] = self.triangles;
        if self.defect != 0 {
            return write!(
                f,
                "no tiling exists: the areas that squares and triangles of each orientation would cover leave a defect of {}, \
                 which at least {} rhombi of 30 degrees would take up",
                self.defect,
                self.defect.abs()
            );
        }
        let counts = [(s0, "squares", 0), (s1, "squares", 30), (s2, "squares", 60)].into_iter();
        let counts =
            counts.chain([(t0, "triangles", 0), (t1, "triangles", 30), (t2, "triangles", 60), (t3, "triangles", 90)]);
        match counts.into_iter().find(|(count, ..)| *count < 0) {
            Some((count, what, degrees)) => write!(
                f,
                "no tiling exists: it would have {count} {what} turned by {degrees} degrees, and a count cannot be negative"
            ),
            None => write!(
                f,
                "any tiling has {} squares ({s0}, {s1} and {s2} turned by 0, 30 and 60 degrees) and {} triangles \
                 ({t0}, {t1}, {t2} and {t3} turned by 0, 30, 60 and 90 degrees)",
                self.square_count(),
                self.triangle_count()
            ),
        }
    }
}
