//! The point of a triangle mesh nearest to a given one.
//!
//! A bounding-volume hierarchy from parry3d answers each query in about O(log n). Where a triangle near the answer is known, the few
//! triangles around that are looked through instead, unless two are about as near: which of them is found is the hierarchy's to say. Parry's vectors come from another version
//! of glam than ours: `to_parry` and `from_parry` are the one place where they meet.

use glam::DVec3;
use mesh::{NONE, TriangleMesh, split_quad};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhLeafCost, BvhNode};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{Segment, SegmentPointLocation, Triangle, TrianglePointLocation};
use std::sync::OnceLock;

/// A triangle whose height is below this fraction of its longest edge is projected to that edge: barycentric coordinates
/// computed from its area would be noise.
const DEGENERATE_HEIGHT: f64 = 1e-10;

/// The triangles around one reach as far from its middle as this, in distances of its furthest corner, or half as far, and so on,
/// until there are few enough.
const AROUND: f64 = 3.0;
const MOST_AROUND: usize = 48;
const HALVINGS: usize = 4;

/// Where a point meets the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// The nearest point of the surface.
    pub point: DVec3,
    /// The triangle that holds it; [`NONE`] when the surface has no triangle, or the query is not finite.
    pub triangle: u32,
    /// Its barycentric coordinates in that triangle: none negative, sum 1.
    pub barycentric: [f64; 3],
    /// Distance from the query, scene units; infinite when `triangle` is [`NONE`].
    pub distance: f64,
}

/// Answers closest-point queries on a triangle mesh; shareable between threads.
#[derive(Debug, Clone)]
pub struct ClosestPoint {
    hierarchy: Bvh,
    corners: Vec<[Vector; 3]>,
    /// For a triangle without area, the first corner of its longest edge; 3 for all others.
    longest_edge: Vec<u8>,
    /// What lies around each triangle, once that was asked for.
    around: Vec<OnceLock<Around>>,
    /// Largest coordinate, which rounding is measured in.
    scale: f64,
}

/// All triangles that come into a ball, and maybe some more: how far their boxes are from its middle, rounded down, the nearest first.
#[derive(Debug, Clone)]
struct Around {
    middle: Vector,
    radius: f64,
    triangles: Box<[(f32, u32)]>,
}

/// A candidate answer; its cost is the squared distance.
#[derive(Clone)]
struct Candidate {
    squared_distance: f64,
    point: Vector,
    barycentric: [f64; 3],
}

impl BvhLeafCost for Candidate {
    fn cost(&self) -> f64 {
        self.squared_distance
    }
}

fn to_parry(p: DVec3) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn from_parry(p: Vector) -> DVec3 {
    DVec3::new(p.x, p.y, p.z)
}

impl ClosestPoint {
    /// Builds the hierarchy over all triangles; those without area count as their longest edge. O(n log n).
    pub fn new(mesh: &TriangleMesh) -> Self {
        Self::of_corners((0..mesh.triangles.len()).map(|t| mesh.points(t).map(to_parry)).collect())
    }

    /// The same for quads, each as the two triangles that [`split_quad`] makes of it.
    pub fn of_quads(positions: &[DVec3], quads: impl IntoIterator<Item = [u32; 4]>) -> Self {
        let halves = |quad: [u32; 4]| {
            let corners = quad.map(|v| positions[v as usize]);
            split_quad(corners).map(|half| half.map(|k| to_parry(corners[k])))
        };
        Self::of_corners(quads.into_iter().flat_map(halves).collect())
    }

    fn of_corners(corners: Vec<[Vector; 3]>) -> Self {
        let boxes: Vec<Aabb> = corners.iter().map(|&[a, b, c]| Aabb::new(a.min(b).min(c), a.max(b).max(c))).collect();
        let longest_edge = corners.iter().map(degenerate_edge).collect();
        let scale = corners.iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let around = vec![OnceLock::new(); corners.len()];
        let hierarchy = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { hierarchy, corners, longest_edge, around, scale }
    }

    /// The nearest point of the surface to `p`. About O(log n).
    pub fn project(&self, p: DVec3) -> Projection {
        let nowhere = Projection { point: p, triangle: NONE, barycentric: [1.0, 0.0, 0.0], distance: f64::INFINITY };
        if p.is_finite() { self.search(to_parry(p), f64::MAX, None).unwrap_or(nowhere) } else { nowhere }
    }

    /// The same as [`ClosestPoint::project`], faster when `hint` is a triangle near the answer.
    pub fn project_near(&self, p: DVec3, hint: u32) -> Projection {
        let query = to_parry(p);
        let Some(near) = ((hint as usize) < self.corners.len()).then(|| self.candidate(query, hint)) else {
            return self.project(p);
        };
        if let Some((triangle, found)) = self.nearby(query, hint, &near, None) {
            return projection(triangle, &found);
        }
        let bound = near.squared_distance;
        self.search(query, bound, None).unwrap_or_else(|| projection(hint, &near))
    }

    /// The same where no other triangle comes about as near, so that the answer is the same whatever the hint; else `None`.
    pub fn project_surely(&self, p: DVec3, hint: u32) -> Option<Projection> {
        let query = to_parry(p);
        let sure = |hint: u32| {
            let (triangle, found) = self.nearby(query, hint, &self.candidate(query, hint), None)?;
            Some(projection(triangle, &found))
        };
        let known = ((hint as usize) < self.corners.len()).then(|| sure(hint)).flatten();
        known.or_else(|| Some(self.project_near(p, hint).triangle).filter(|t| *t != NONE).and_then(sure))
    }

    /// The nearest point on the triangles that face as `facing` does, by less than a right angle; `None` where there are none.
    pub fn project_facing(&self, p: DVec3, facing: DVec3, hint: u32) -> Option<Projection> {
        let (query, facing) = (to_parry(p), to_parry(facing));
        let near =
            ((hint as usize) < self.corners.len() && self.faces(hint, facing)).then(|| self.candidate(query, hint));
        if let Some((triangle, found)) = near.as_ref().and_then(|near| self.nearby(query, hint, near, Some(facing))) {
            return Some(projection(triangle, &found));
        }
        let near = near.map(|near| projection(hint, &near));
        let bound = near.map_or(f64::MAX, |near| near.distance * near.distance);
        if p.is_finite() { self.search(query, bound, Some(facing)).or(near) } else { None }
    }

    /// The nearest point among the triangles around `hint`, whose own is `near`, where that is sure to be the nearest of all by far more
    /// than rounding. Written so that a query that is not finite is never sure.
    fn nearby(&self, query: Vector, hint: u32, near: &Candidate, facing: Option<Vector>) -> Option<(u32, Candidate)> {
        let around = self.around[hint as usize].get_or_init(|| self.around(hint));
        let off = (query - around.middle).length();
        let reach = off + near.squared_distance.sqrt();
        let within = reach * (1.0 + 1e-9) + 1e-12 * self.scale <= around.radius;
        if !within {
            return None;
        }
        // Squared distances this close may come out in either order.
        let rounded_up = |squared: f64| {
            squared * (1.0 + 1e-9) + 1e-13 * self.scale * squared.sqrt() + 1e-26 * self.scale * self.scale
        };
        let (mut best, mut others) = ((hint, near.clone()), f64::INFINITY);
        let mut bound = rounded_up(near.squared_distance);
        for &(distance, t) in &around.triangles {
            let beyond = f64::from(distance) - off;
            if beyond > 0.0 && beyond * beyond > bound {
                break;
            }
            if t == hint {
                continue;
            }
            let [a, b, c] = self.corners[t as usize];
            let outside = (a.min(b).min(c) - query).max(query - a.max(b).max(c)).max(Vector::ZERO);
            if outside.length_squared() > bound || facing.is_some_and(|facing| !self.faces(t, facing)) {
                continue;
            }
            let found = self.candidate(query, t);
            if found.squared_distance < best.1.squared_distance {
                others = best.1.squared_distance;
                best = (t, found);
                bound = rounded_up(best.1.squared_distance);
            } else {
                others = others.min(found.squared_distance);
            }
        }
        (others > bound).then_some(best)
    }

    fn around(&self, t: u32) -> Around {
        let [a, b, c] = self.corners[t as usize];
        let middle = (a + b + c) / 3.0;
        let mut radius = AROUND * [a, b, c].map(|p| (p - middle).length()).into_iter().fold(0.0, f64::max);
        for _ in 0..HALVINGS {
            let off = |low: Vector, high: Vector| (low - middle).max(middle - high).max(Vector::ZERO).length();
            let comes_near = |node: &BvhNode| off(node.mins(), node.maxs()) <= radius;
            let distance = |t: u32| {
                let [a, b, c] = self.corners[t as usize];
                ((off(a.min(b).min(c), a.max(b).max(c)) * (1.0 - 1e-6)) as f32, t)
            };
            let found = self.hierarchy.leaves(comes_near).take(MOST_AROUND + 1);
            let mut triangles: Box<[(f32, u32)]> = found.map(distance).collect();
            if triangles.len() <= MOST_AROUND {
                triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
                return Around { middle, radius, triangles };
            }
            radius /= 2.0;
        }
        Around { middle, radius: -1.0, triangles: Box::default() }
    }

    fn faces(&self, t: u32, facing: Vector) -> bool {
        let [a, b, c] = self.corners[t as usize];
        (b - a).cross(c - a).dot(facing) > 0.0
    }

    /// The nearest point nearer than the square root of `bound`, on a triangle that faces as told.
    fn search(&self, query: Vector, bound: f64, facing: Option<Vector>) -> Option<Projection> {
        let to_box = |node: &BvhNode, _: f64| {
            let outside = (node.mins() - query).max(query - node.maxs()).max(Vector::ZERO);
            outside.length_squared()
        };
        let (triangle, found) = self.hierarchy.find_best(bound, to_box, |t, _| {
            facing.is_none_or(|facing| self.faces(t, facing)).then(|| self.candidate(query, t))
        })?;
        Some(projection(triangle, &found))
    }

    fn candidate(&self, query: Vector, t: u32) -> Candidate {
        let [a, b, c] = self.corners[t as usize];
        let first = self.longest_edge[t as usize] as usize;
        let barycentric = if first < 3 {
            let (i, j) = (first, (first + 1) % 3);
            let edge = Segment::new(self.corners[t as usize][i], self.corners[t as usize][j]);
            let mut weights = [0.0; 3];
            [weights[i], weights[j]] = match edge.project_local_point_and_get_location(query, false).1 {
                SegmentPointLocation::OnVertex(0) => [1.0, 0.0],
                SegmentPointLocation::OnVertex(_) => [0.0, 1.0],
                SegmentPointLocation::OnEdge(w) => w,
            };
            weights
        } else {
            match Triangle::new(a, b, c).project_local_point_and_get_location(query, false).1 {
                TrianglePointLocation::OnVertex(0) | TrianglePointLocation::OnSolid => [1.0, 0.0, 0.0],
                TrianglePointLocation::OnVertex(1) => [0.0, 1.0, 0.0],
                TrianglePointLocation::OnVertex(_) => [0.0, 0.0, 1.0],
                TrianglePointLocation::OnEdge(0, [u, v]) => [u, v, 0.0],
                TrianglePointLocation::OnEdge(1, [v, w]) => [0.0, v, w],
                TrianglePointLocation::OnEdge(_, [u, w]) => [u, 0.0, w],
                TrianglePointLocation::OnFace(_, weights) => weights,
            }
        };
        // Rounding leaves weights a hair below zero in thin triangles.
        let clamped = barycentric.map(|w| w.max(0.0));
        let sum: f64 = clamped.iter().sum();
        let barycentric = clamped.map(|w| w / sum);
        let point = a * barycentric[0] + b * barycentric[1] + c * barycentric[2];
        Candidate { squared_distance: (point - query).length_squared(), point, barycentric }
    }
}

fn projection(triangle: u32, found: &Candidate) -> Projection {
    Projection {
        point: from_parry(found.point),
        triangle,
        barycentric: found.barycentric,
        distance: found.squared_distance.sqrt(),
    }
}

/// First corner of the longest edge when the triangle has no area to speak of, else 3.
fn degenerate_edge(&[a, b, c]: &[Vector; 3]) -> u8 {
    let squared = [(b - a).length_squared(), (c - b).length_squared(), (a - c).length_squared()];
    let longest = (0..3).fold(0, |best, k| if squared[k] > squared[best] { k } else { best });
    let double_area = (b - a).cross(c - a).length();
    if double_area > DEGENERATE_HEIGHT * squared[longest] { 3 } else { longest as u8 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip() -> TriangleMesh {
        let positions = vec![
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(0.5, 0.0, 0.0),
            DVec3::Y,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(5.0, 0.0, 0.0),
        ];
        // The second triangle has no area, the fourth is a single point.
        TriangleMesh { positions, triangles: vec![[0, 1, 3], [0, 2, 1], [1, 4, 3], [5, 5, 5]] }
    }

    /// The nearest of a dense grid of barycentric samples.
    fn brute_force(mesh: &TriangleMesh, p: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.points(t);
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let (u, v) = (f64::from(i) / 200.0, f64::from(j) / 200.0);
                    best = best.min((a * u + b * v + c * (1.0 - u - v)).distance(p));
                }
            }
        }
        best
    }

    #[test]
    fn finds_the_nearest_point_beside_degenerate_triangles() {
        let mesh = strip();
        let closest = ClosestPoint::new(&mesh);
        for k in 0..200 {
            let f = f64::from(k);
            let p = DVec3::new((f * 0.37).sin() * 3.0 + 1.0, (f * 0.71).cos() * 2.0, (f * 1.3).sin());
            let found = closest.project(p);
            assert!((found.distance - brute_force(&mesh, p)).abs() < 0.02, "{p}");
            let [a, b, c] = mesh.points(found.triangle as usize);
            let [u, v, w] = found.barycentric;
            assert!(u >= 0.0 && v >= 0.0 && w >= 0.0 && (u + v + w - 1.0).abs() < 1e-12);
            assert!((a * u + b * v + c * w).distance(found.point) < 1e-12);
            assert!((found.point.distance(p) - found.distance).abs() < 1e-12);
            for hint in 0..5 {
                assert!((closest.project_near(p, hint).distance - found.distance).abs() < 1e-12);
            }
        }
    }

    /// Height of a bent sheet.
    fn height(x: f64, y: f64) -> f64 {
        0.3 * (4.0 * x).sin() * (3.0 * y).cos()
    }

    /// The sheet over the unit square, of many small triangles.
    fn sheet() -> TriangleMesh {
        let n = 24;
        let at = |k: u32| f64::from(k) / f64::from(n);
        let place = |(i, j): (u32, u32)| DVec3::new(at(i), at(j), height(at(i), at(j)));
        let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))).map(place).collect();
        let corner = |i: u32, j: u32| i * (n + 1) + j;
        let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let halves = |(i, j): (u32, u32)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        TriangleMesh { positions, triangles: quads.flat_map(halves).collect() }
    }

    #[test]
    fn hints_make_no_difference() {
        let mesh = sheet();
        let closest = ClosestPoint::new(&mesh);
        let (mut sure, mut looked_around) = (0, 0);
        for k in 0..2000 {
            let f = f64::from(k);
            let (x, y) = (0.5 + 0.52 * (f * 0.37).sin(), 0.5 + 0.52 * (f * 0.71).cos());
            let mut p = DVec3::new(x, y, height(x, y) + 0.02 * (f * 1.3).sin());
            if k % 5 == 0 {
                p = mesh.positions[k as usize % mesh.positions.len()];
            }
            let found = closest.search(to_parry(p), f64::MAX, None).expect("a triangle");
            let known = closest.project_surely(p, NONE);
            assert!(known.is_none_or(|known| known == found));
            sure += usize::from(known.is_some());
            for hint in [found.triangle, (found.triangle + 3) % 1152, 7 * k % 1152] {
                let near = closest.project_near(p, hint);
                assert!(near == found || known.is_none() && (near.distance - found.distance).abs() < 1e-12);
                let own = closest.candidate(to_parry(p), hint);
                looked_around += usize::from(closest.nearby(to_parry(p), hint, &own, None).is_some());
            }
        }
        // Vertices, and points above ridges, have more than one triangle about as near.
        assert!((1000..1700).contains(&sure), "{sure}");
        assert!(looked_around > 1500, "{looked_around}");
    }

    #[test]
    fn finds_the_side_of_a_thin_plate_that_faces_as_told() {
        // Two triangles 0.1 apart, back to back.
        let below = [DVec3::ZERO, DVec3::Y, DVec3::X];
        let above = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| p + 0.1 * DVec3::Z);
        let positions = [below, above].concat();
        let closest = ClosestPoint::new(&TriangleMesh { positions, triangles: vec![[0, 1, 2], [3, 4, 5]] });
        let p = DVec3::new(0.2, 0.2, 0.02);
        assert_eq!(closest.project(p).triangle, 0);
        for hint in [NONE, 0, 1] {
            assert_eq!(closest.project_facing(p, DVec3::Z, hint).unwrap().triangle, 1);
            assert_eq!(closest.project_facing(p, -DVec3::Z, hint).unwrap().triangle, 0);
            assert_eq!(closest.project_facing(p, DVec3::X, hint), None);
        }
    }

    #[test]
    fn says_so_when_there_is_nothing_to_find() {
        let nothing = ClosestPoint::new(&TriangleMesh::default());
        assert_eq!(nothing.project(DVec3::ONE).triangle, NONE);
        assert_eq!(ClosestPoint::new(&strip()).project(DVec3::NAN).triangle, NONE);
    }
}
