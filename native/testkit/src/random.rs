//! Random numbers, rotations and placements that a seed repeats exactly.

use crate::shapes;
use glam::{DMat3, DQuat};
use mesh::{Aabb, DVec3, PolygonMesh, TriangleMesh};
use std::f64::consts::TAU;

/// The `SplitMix64` generator (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator; each seed gives its own sequence.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in 0 (included) to 1 (excluded).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in `low` (included) to `high` (excluded).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// An index below `n`, which must not be 0.
    pub fn index(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// A rotation, uniform over all (Shoemake, "Uniform random rotations", 1992).
    pub fn rotation(&mut self) -> DMat3 {
        let (u, a, b) = (self.unit(), self.between(0.0, TAU), self.between(0.0, TAU));
        let (s, t) = ((1.0 - u).sqrt(), u.sqrt());
        DMat3::from_quat(DQuat::from_xyzw(s * a.sin(), s * a.cos(), t * b.sin(), t * b.cos()))
    }

    /// A point of the surface, uniform by area.
    ///
    /// # Panics
    /// When the mesh has no area.
    pub fn surface_point(&mut self, mesh: &PolygonMesh) -> DVec3 {
        let (mesh, _) = TriangleMesh::from_polygons(mesh);
        let areas: Vec<f64> = (0..mesh.triangles.len()).map(|t| mesh.area_normal(t).length()).collect();
        let mut left = self.unit() * areas.iter().sum::<f64>();
        let picked = areas.iter().position(|area| {
            left -= area;
            left < 0.0
        });
        let [a, b, c] = mesh.points(picked.expect("a mesh with area"));
        let (u, v) = (self.unit(), self.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + u * (b - a) + v * (c - a)
    }
}

/// Places `b` on `a` at random: 0.4 to 0.9 of its size by bounding-box diagonals, in any rotation, the centre of
/// its bounding box on a surface point of `a`. Returns the moved `b`.
pub fn placement(a: &PolygonMesh, b: &PolygonMesh, seed: u64) -> PolygonMesh {
    let mut random = Random::new(seed);
    let turned = shapes::transformed(b, random.rotation(), DVec3::ZERO);
    let bounds = Aabb::of(turned.positions.iter().copied());
    // The size of b is that before it was turned.
    let scale = random.between(0.4, 0.9) * a.diagonal() / b.diagonal();
    let anchor = random.surface_point(a);
    turned.with_positions(turned.positions.iter().map(|&p| anchor + scale * (p - bounds.centre())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_published_sequence() {
        // First outputs for seed 1234567, from the reference implementation's test vector.
        let mut random = Random::new(1_234_567);
        assert_eq!([random.bits(), random.bits()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn rotations_are_rotations_and_even() {
        let mut random = Random::new(7);
        let mut mean = DVec3::ZERO;
        for _ in 0..1000 {
            let r = random.rotation();
            assert!((r * r.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-12) && (r.determinant() - 1.0).abs() < 1e-12);
            mean += r * DVec3::X / 1000.0;
        }
        assert!(mean.length() < 0.1, "{mean}");
    }

    #[test]
    fn placements_keep_their_promises() {
        let (a, b) = (shapes::sphere(4), shapes::cuboid(DVec3::new(1.0, 2.0, 3.0), 2));
        for seed in 0..50 {
            let placed = placement(&a, &b, seed);
            let bounds = Aabb::of(placed.positions.iter().copied());
            // Centres of faces of a sphere lie a little inside it.
            assert!((0.8..=1.0).contains(&bounds.centre().length()), "{}", bounds.centre());
            let size = crate::oracle::volume(&placed).cbrt() / crate::oracle::volume(&b).cbrt() * b.diagonal();
            assert!((0.4..0.9).contains(&(size / a.diagonal())));
            assert_eq!(placed, placement(&a, &b, seed));
        }
    }
}
