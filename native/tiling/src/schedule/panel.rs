//! One panel, measured and laid flat: where its corners are in a frame of its own, and how far it is from another's shape.

use mesh::DVec3;

/// A panel laid on its best plane, outside up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Flat {
    /// The corners about their mean: x and y in the plane, z above it.
    pub corners: Vec<DVec3>,
    /// From each corner to the next.
    pub edges: Vec<f64>,
    /// Of a quad the two diagonals; of a triangle none.
    pub diagonals: Vec<f64>,
    /// Of the projection onto the plane.
    pub area: f64,
    /// Greatest height above or below the plane.
    pub deviation: f64,
}

/// How a panel lies on another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Laid {
    /// The corner that comes to lie on the other's first.
    pub first: usize,
    /// Whether it was reflected before.
    pub mirrored: bool,
    /// By which angle it is turned then; radians.
    pub angle: f64,
    /// Greatest distance of a corner from the other's.
    pub misfit: f64,
}

impl Flat {
    /// Lays a triangle or a quad flat. The plane is square to the vector area and half-way between the highest and the lowest
    /// corner; of a quad that is not folded over no plane is nearer to all four corners.
    pub fn of(points: &[DVec3]) -> Self {
        let n = points.len();
        let mean = points.iter().map(|&p| p / n as f64).sum::<DVec3>();
        let own: Vec<DVec3> = points.iter().map(|&p| p - mean).collect();
        let edges: Vec<f64> = (0..n).map(|k| own[k].distance(own[(k + 1) % n])).collect();
        let diagonals = if n == 4 { vec![own[0].distance(own[2]), own[1].distance(own[3])] } else { Vec::new() };
        // At unit size, so that squares of tiny and huge lengths are numbers.
        let size = edges.iter().copied().fold(0.0, f64::max);
        let unit = |p: DVec3| p / size;
        let vector = (0..n).map(|k| unit(own[k]).cross(unit(own[(k + 1) % n]))).sum::<DVec3>() / 2.0;
        let up = vector.normalize_or_zero();
        // Along the longest edge: it has a direction where any has.
        let longest = (0..n).fold(0, |best, k| if edges[k] > edges[best] { k } else { best });
        let along = unit(own[(longest + 1) % n] - own[longest]);
        let right = (along - along.dot(up) * up).normalize_or_zero();
        let back = up.cross(right);
        let heights: Vec<f64> = own.iter().map(|p| p.dot(up)).collect();
        let [low, high] = [f64::min, f64::max].map(|pick| heights.iter().copied().reduce(pick).unwrap_or(0.0));
        let middle = f64::midpoint(low, high);
        let corners =
            own.iter().zip(&heights).map(|(p, z)| DVec3::new(p.dot(right), p.dot(back), z - middle)).collect();
        let deviation = if n == 3 { 0.0 } else { (high - low) / 2.0 };
        Self { corners, edges, diagonals, area: vector.length() * size * size, deviation }
    }

    /// Whether it has a plane, and numbers for all that is measured.
    pub fn is_sound(&self) -> bool {
        self.area > 0.0 && self.area.is_finite() && self.corners.iter().all(|p| p.is_finite())
    }

    /// Distance between the diagonals, twice the deviation, over their mean length.
    pub fn planarity(&self) -> f64 {
        match self.diagonals[..] {
            [first, second] => 2.0 * self.deviation / f64::midpoint(first, second),
            _ => 0.0,
        }
    }

    /// The corner that comes onto the other's corner `k`, before it is turned.
    fn moved(&self, k: usize, first: usize, mirrored: bool) -> DVec3 {
        let n = self.corners.len();
        if mirrored {
            // A reflection runs round the other way; taking the corners backwards keeps outside up.
            let p = self.corners[(first + n - k) % n];
            DVec3::new(-p.x, p.y, p.z)
        } else {
            self.corners[(first + k) % n]
        }
    }

    /// How this panel lies best on another one with as many corners: turned so that the squared distances of the corners in
    /// the plane are least, then judged by the greatest.
    pub fn laid_on(&self, other: &Self, first: usize, mirrored: bool) -> Laid {
        let (mut cross, mut dot) = (0.0, 0.0);
        for (k, &to) in other.corners.iter().enumerate() {
            let from = self.moved(k, first, mirrored);
            cross += from.x * to.y - from.y * to.x;
            dot += from.x * to.x + from.y * to.y;
        }
        let angle = f64::atan2(cross, dot);
        let misfit = other
            .corners
            .iter()
            .enumerate()
            .map(|(k, &to)| turned(self.moved(k, first, mirrored), angle).distance(to))
            .fold(0.0, f64::max);
        Laid { first, mirrored, angle, misfit }
    }

    /// The way it lies best on the other one; reflected only when that is allowed, and needed to be within the tolerance.
    pub fn best_on(&self, other: &Self, mirror: bool, tolerance: f64) -> Laid {
        let mut best = self.laid_on(other, 0, false);
        for mirrored in [false, true] {
            if mirrored && (!mirror || best.misfit <= tolerance) {
                break;
            }
            for first in 0..self.corners.len() {
                let laid = self.laid_on(other, first, mirrored);
                if laid.misfit < best.misfit {
                    best = laid;
                }
            }
        }
        best
    }
}

/// Turned about the z axis.
pub(super) fn turned(p: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(points: [[f64; 3]; 4]) -> Flat {
        Flat::of(&points.map(DVec3::from))
    }

    #[test]
    fn a_skew_square_deviates_by_half_the_distance_of_its_diagonals() {
        let flat = quad([[0., 0., 0.1], [1., 0., -0.1], [1., 1., 0.1], [0., 1., -0.1]]);
        assert!((flat.deviation - 0.1).abs() < 1e-15);
        assert!((flat.planarity() - 0.2 / 2f64.sqrt()).abs() < 1e-15);
        assert!((flat.area - 1.0).abs() < 1e-15);
    }

    #[test]
    fn mirror_images_lie_on_one_another_only_reflected() {
        let kite = quad([[0., 0., 0.], [3., 0., 0.], [2., 2., 0.], [0., 1., 0.]]);
        let image = quad([[0., 0., 0.], [0., 1., 0.], [-2., 2., 0.], [-3., 0., 0.]]);
        assert!(image.best_on(&kite, false, 1e-9).misfit > 0.1);
        let laid = image.best_on(&kite, true, 1e-9);
        assert!(laid.mirrored && laid.misfit < 1e-12, "{laid:?}");
    }

    #[test]
    fn left_and_right_twisted_panels_differ() {
        let left = quad([[0., 0., 0.1], [2., 0., -0.1], [2., 1., 0.1], [0., 1., -0.1]]);
        let right = quad([[0., 0., -0.1], [2., 0., 0.1], [2., 1., -0.1], [0., 1., 0.1]]);
        assert!((left.best_on(&right, false, 1e-9).misfit - 0.2).abs() < 0.01);
        assert!(left.best_on(&right, true, 1e-9).misfit < 1e-12);
    }

    #[test]
    fn tiny_huge_and_far_panels_are_measured_alike() {
        for (size, far) in [(1e-150, 0.0), (1e150, 0.0), (1.0, 1e6)] {
            let at = |x: f64, y: f64, z: f64| [far + size * x, far + size * y, far + size * z];
            let flat = quad([at(0., 0., 0.1), at(1., 0., -0.1), at(1., 1., 0.1), at(0., 1., -0.1)]);
            assert!(flat.is_sound());
            assert!((flat.planarity() - 0.2 / 2f64.sqrt()).abs() < 1e-9, "{size} {far}");
        }
    }
}
