//! The exact plane: points with coordinates in Z[z], where z is the twelfth root of unity (section 3.2).
//!
//! A tiling by unit triangles and squares with one edge along the x axis has all its vertices there, four integers each.
//! The paper's coordinates are views of these: its four integers for edges of length 2 ([`Point::four`], eq. 1), and the
//! three projections in which main paths are straight ([`Point::six`], eq. 2 to 4). Deviation: the basis 1, z, z^2, z^3
//! reaches every vertex and nothing that is not a sum of edges, where the paper's four integers obey parity rules.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// The direction of an edge: a multiple of 30 degrees, counter-clockwise from the x axis, below 12.
pub type Direction = u8;

/// a + b z + c z^2 + d z^3: a point that unit edges can reach from the origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Point(pub [i32; 4]);

impl Point {
    /// The origin.
    pub const ORIGIN: Self = Self([0; 4]);

    /// The end of a unit edge from the origin. Directions count modulo 12.
    pub const fn unit(direction: Direction) -> Self {
        Self(match direction % 12 {
            0 => [1, 0, 0, 0],
            1 => [0, 1, 0, 0],
            2 => [0, 0, 1, 0],
            3 => [0, 0, 0, 1],
            4 => [-1, 0, 1, 0],
            5 => [0, -1, 0, 1],
            6 => [-1, 0, 0, 0],
            7 => [0, -1, 0, 0],
            8 => [0, 0, -1, 0],
            9 => [0, 0, 0, -1],
            10 => [1, 0, -1, 0],
            _ => [0, 1, 0, -1],
        })
    }

    /// Turned about the origin by `direction` times 30 degrees, counter-clockwise.
    #[must_use]
    pub fn turned(self, direction: Direction) -> Self {
        // z^4 = z^2 - 1.
        (0..direction % 12).fold(self, |Self([a, b, c, d]), _| Self([-d, a, b + d, c]))
    }

    /// Mirrored in the x axis.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([a + c, b, -c, -b - d])
    }

    /// The paper's four integers (A, B, C, D): the point is (A + B sqrt 3, C + D sqrt 3) when edges have length 2.
    pub fn four(self) -> [i32; 4] {
        let [a, b, c, d] = self.0;
        [2 * a + c, b, b + 2 * d, c]
    }

    /// The paper's six integers (x1, y1, x2, y2, x3, y3): main paths in direction k are parallel to an axis of projection
    /// 1 + k mod 3.
    pub fn six(self) -> [i32; 6] {
        let [a, b, c, d] = self.four();
        [
            2 * a + 4 * b,
            2 * c + 4 * d,
            2 * a + 3 * b + c + 2 * d,
            -a - 2 * b + 2 * c + 3 * d,
            2 * a + 3 * b - c - 2 * d,
            a + 2 * b + 2 * c + 3 * d,
        ]
    }

    /// The inverse of [`Point::four`]; `None` when no vertex has these coordinates (A + D or B + C is odd).
    pub fn from_four([a, b, c, d]: [i32; 4]) -> Option<Self> {
        ((a - d) % 2 == 0 && (c - b) % 2 == 0).then(|| Self([(a - d) / 2, b, d, (c - b) / 2]))
    }

    /// Twice the x coordinate, exactly.
    pub fn twice_x(self) -> Surd {
        let [a, b, ..] = self.four();
        Surd::new(a.into(), b.into())
    }

    /// Twice the y coordinate, exactly.
    pub fn twice_y(self) -> Surd {
        let [.., c, d] = self.four();
        Surd::new(c.into(), d.into())
    }

    /// Four times the cross product with another vector, exactly: positive when `other` points to the left of `self`.
    pub fn four_cross(self, other: Self) -> Surd {
        self.twice_x() * other.twice_y() - self.twice_y() * other.twice_x()
    }

    /// Four times the dot product with another vector, exactly.
    pub fn four_dot(self, other: Self) -> Surd {
        self.twice_x() * other.twice_x() + self.twice_y() * other.twice_y()
    }

    /// Where the point lies, rounded; for drawing and for meshes.
    pub fn position(self) -> [f64; 2] {
        [self.twice_x().value() / 2.0, self.twice_y().value() / 2.0]
    }
}

impl Add for Point {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Point {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl Neg for Point {
    type Output = Self;
    fn neg(self) -> Self {
        Self::ORIGIN - self
    }
}

/// a + b sqrt 3 with integers a and b, ordered as the real number it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Surd {
    /// a.
    pub rational: i64,
    /// b.
    pub root: i64,
}

impl Surd {
    /// `rational` + `root` sqrt 3.
    pub fn new(rational: i64, root: i64) -> Self {
        Self { rational, root }
    }

    /// -1, 0 or 1, exactly.
    pub fn signum(self) -> i64 {
        let (a, b) = (self.rational.signum(), self.root.signum());
        if a == b || b == 0 {
            a
        } else if a == 0 {
            b
        } else {
            // The signs differ, so the larger of |a| and |b| sqrt 3 decides; they are never equal.
            let (a_squared, b_squared) = (i128::from(self.rational).pow(2), i128::from(self.root).pow(2));
            if a_squared > 3 * b_squared { a } else { b }
        }
    }

    /// The number, rounded.
    pub fn value(self) -> f64 {
        self.rational as f64 + self.root as f64 * 3f64.sqrt()
    }
}

impl Add for Surd {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.rational + other.rational, self.root + other.root)
    }
}

impl Sub for Surd {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.rational - other.rational, self.root - other.root)
    }
}

impl Mul for Surd {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(
            self.rational * other.rational + 3 * self.root * other.root,
            self.rational * other.root + self.root * other.rational,
        )
    }
}

impl PartialOrd for Surd {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Surd {
    fn cmp(&self, other: &Self) -> Ordering {
        (*self - *other).signum().cmp(&0)
    }
}

/// A symmetry of the exact plane: mirrored in the x axis when `mirror`, then turned, then shifted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Isometry {
    /// Mirror in the x axis first.
    pub mirror: bool,
    /// Turn by this many times 30 degrees, below 12.
    pub turn: Direction,
    /// Then shift.
    pub shift: Point,
}

impl Isometry {
    /// A shift.
    pub fn shift(shift: Point) -> Self {
        Self { mirror: false, turn: 0, shift }
    }

    /// Image of a vector.
    pub fn vector(self, vector: Point) -> Point {
        if self.mirror { vector.mirrored().turned(self.turn) } else { vector.turned(self.turn) }
    }

    /// Image of a point.
    pub fn point(self, point: Point) -> Point {
        self.vector(point) + self.shift
    }

    /// Image of a direction.
    pub fn direction(self, direction: Direction) -> Direction {
        if self.mirror { (12 + self.turn - direction) % 12 } else { (self.turn + direction) % 12 }
    }

    /// The point that a turn leaves in place, or one on the axis of a mirror; rounded, for showing.
    pub fn centre(self) -> [f64; 2] {
        let [x, y] = self.shift.position();
        if self.mirror || self.turn == 0 {
            return [x / 2.0, y / 2.0];
        }
        // p = R p + shift: half the shift, and half of it turned left over the tangent of half the angle.
        let cotangent = 1.0 / (f64::from(self.turn) * std::f64::consts::PI / 12.0).tan();
        [f64::midpoint(x, -cotangent * y), f64::midpoint(y, cotangent * x)]
    }

    /// `other` first, then `self`.
    #[must_use]
    pub fn after(self, other: Self) -> Self {
        Self { mirror: self.mirror != other.mirror, turn: self.direction(other.turn), shift: self.point(other.shift) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn point() -> impl Strategy<Value = Point> {
        prop::array::uniform4(-40..40).prop_map(Point)
    }

    impl Isometry {
        /// Image of any point, rounded.
        fn rounded(self, [x, y]: [f64; 2]) -> [f64; 2] {
            let [x, y] = rotated([x, if self.mirror { -y } else { y }], f64::from(self.turn) * TAU / 12.0);
            let [dx, dy] = self.shift.position();
            [x + dx, y + dy]
        }
    }

    fn close(p: [f64; 2], q: [f64; 2]) -> bool {
        (p[0] - q[0]).abs() < 1e-9 && (p[1] - q[1]).abs() < 1e-9
    }

    fn rotated(p: [f64; 2], angle: f64) -> [f64; 2] {
        let (s, c) = angle.sin_cos();
        [c * p[0] - s * p[1], s * p[0] + c * p[1]]
    }

    #[test]
    fn units_are_the_twelve_directions() {
        for d in 0..12 {
            assert!(close(Point::unit(d).position(), rotated([1.0, 0.0], f64::from(d) * TAU / 12.0)));
        }
    }

    proptest! {
        #[test]
        fn agrees_with_floats(p in point(), q in point(), k in 0u8..12) {
            let (x, y) = (p.position(), q.position());
            prop_assert!(close((p + q).position(), [x[0] + y[0], x[1] + y[1]]));
            prop_assert!(close(p.turned(k).position(), rotated(x, f64::from(k) * TAU / 12.0)));
            prop_assert!(close(p.mirrored().position(), [x[0], -x[1]]));
            prop_assert!((p.four_cross(q).value() - 4.0 * (x[0] * y[1] - x[1] * y[0])).abs() < 1e-6);
            prop_assert!((p.four_dot(q).value() - 4.0 * (x[0] * y[0] + x[1] * y[1])).abs() < 1e-6);
            // Close ties are what the exact comparison is for; floats decide the others.
            if (x[0] - y[0]).abs() > 1e-9 {
                prop_assert_eq!(p.twice_x() < q.twice_x(), x[0] < y[0]);
            }
        }

        #[test]
        fn isometries_compose_and_keep_lengths(p in point(), q in point(), a in 0u8..12, b in 0u8..12, m in any::<[bool; 2]>()) {
            let f = Isometry { mirror: m[0], turn: a, shift: q };
            let g = Isometry { mirror: m[1], turn: b, shift: p };
            prop_assert_eq!(f.after(g).point(p), f.point(g.point(p)));
            prop_assert_eq!(f.vector(Point::unit(b)), Point::unit(f.direction(b)));
            let d = p - q;
            if m[0] == (f.after(f) == Isometry::default()) && (m[0] || a > 0) {
                // What is left in place, or on the axis of a mirror that is no glide.
                let [x, y] = f.centre();
                let image = f.rounded([x, y]);
                prop_assert!(close(image, [x, y]));
            }
            prop_assert_eq!(f.vector(d).four_dot(f.vector(d)), d.four_dot(d));
        }

        #[test]
        fn the_papers_coordinates_are_views(p in point()) {
            let [a, b, c, d] = p.four();
            prop_assert_eq!(Point::from_four(p.four()), Some(p));
            prop_assert!((a + d) % 2 == 0 && (b + c) % 2 == 0);
            let [x1, y1, x2, y2, x3, y3] = p.six();
            // Eq. 5 and the inversion of eq. 6.
            prop_assert_eq!([x1 + y2 - y3, y1 - x2 + x3], [0, 0]);
            prop_assert_eq!([-3 * x1 + 2 * x2 + 2 * x3, 2 * x1 - x2 - x3], [2 * a, 2 * b]);
            prop_assert_eq!([-3 * y1 + 2 * y2 + 2 * y3, 2 * y1 - y2 - y3], [2 * c, 2 * d]);
        }

        #[test]
        fn signs_are_exact(a in -1_000_000_000i64..1_000_000_000, b in -1_000_000_000i64..1_000_000_000) {
            let value = Surd::new(a, b);
            if value.value().abs() > 1e-3 {
                prop_assert_eq!(value.signum() as f64, value.value().signum());
            }
            prop_assert_eq!(value.signum(), -(Surd::default() - value).signum());
        }
    }

    #[test]
    fn signs_hold_where_floats_fail() {
        // A convergent of sqrt 3: a^2 - 3 b^2 = 1, far below the rounding of f64.
        let (a, b) = (2_642_885_282_467_i64, 1_525_870_529_340);
        let square = |x: i64| i128::from(x).pow(2);
        let sign = (square(a) - 3 * square(b)).signum() as i64;
        assert_eq!(Surd::new(a, -b).signum(), sign);
        assert_eq!(Surd::new(-a, b).signum(), -sign);
    }

    /// Table 1, first column: the six integers of unit edges (2-edges of the paper).
    #[test]
    fn table_1() {
        let table = [
            [4, 0, 4, -2, 4, 2],
            [4, 2, 4, 0, 2, 4],
            [2, 4, 4, 2, 0, 4],
            [0, 4, 2, 4, -2, 4],
            [-2, 4, 0, 4, -4, 2],
            [-4, 2, -2, 4, -4, 0],
        ];
        for (d, six) in table.into_iter().enumerate() {
            assert_eq!(Point::unit(d as u8).six(), six);
        }
    }
}
