//! Smoothing on shapes whose answer is known, judged by formulas of their own.

use super::*;
use crate::closest::ClosestPoint;
use crate::smooth_star::SurfacePoint;
use mesh::{NONE, TriangleMesh};

/// A triangle mesh with normals interpolated from its vertices.
struct TriangleReference {
    closest: ClosestPoint,
    corner_normals: Vec<[DVec3; 3]>,
}

impl TriangleReference {
    fn new(mesh: &TriangleMesh) -> Self {
        let mut sum = vec![DVec3::ZERO; mesh.positions.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let (p, normal) = (mesh.points(t), mesh.area_normal(t).normalize_or_zero());
            for k in 0..3 {
                // Weighted by angle, the normal does not depend on how the surface is cut into triangles.
                let (e, f) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                sum[triangle[k] as usize] += normal * e.cross(f).length().atan2(e.dot(f));
            }
        }
        let corner_normals = mesh.triangles.iter().map(|t| t.map(|v| sum[v as usize].normalize_or_zero())).collect();
        Self { closest: ClosestPoint::new(mesh), corner_normals }
    }
}

impl Reference for TriangleReference {
    fn project_near(&self, point: DVec3, _: &mut u32) -> SurfacePoint {
        let foot = self.closest.project(point);
        if foot.triangle == NONE {
            return SurfacePoint { point, normal: DVec3::ZERO };
        }
        let [a, b, c] = self.corner_normals[foot.triangle as usize];
        let [u, v, w] = foot.barycentric;
        SurfacePoint { point: foot.point, normal: (a * u + b * v + c * w).normalize_or_zero() }
    }
}

struct Plane;
impl Reference for Plane {
    fn project_near(&self, p: DVec3, _: &mut u32) -> SurfacePoint {
        SurfacePoint { point: DVec3::new(p.x, p.y, 0.0), normal: DVec3::Z }
    }
}

struct Sphere;
impl Reference for Sphere {
    fn project_near(&self, p: DVec3, _: &mut u32) -> SurfacePoint {
        SurfacePoint { point: p.normalize(), normal: p.normalize() }
    }
}

/// Pseudo-random numbers in -1..1, the same every run.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
}

struct Grid {
    n: usize,
    quads: Vec<[u32; 4]>,
    positions: Vec<DVec3>,
    constraints: Vec<Constraint>,
}

/// An n by n grid of unit quads in the plane with its border fixed.
fn grid(n: usize) -> Grid {
    let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let quads =
        (0..n).flat_map(|i| (0..n).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])).collect();
    let (mut positions, mut constraints) = (vec![], vec![]);
    for i in 0..=n {
        for j in 0..=n {
            positions.push(DVec3::new(i as f64, j as f64, 0.0));
            let border = i % n == 0 || j % n == 0;
            constraints.push(if border { Constraint::Fixed } else { Constraint::Free });
        }
    }
    Grid { n, quads, positions, constraints }
}

impl Grid {
    fn patch<'a>(
        &'a self,
        surface_of: &'a [u32],
        chains: &'a [Polyline],
        surfaces: &'a [&'a dyn Reference],
    ) -> Patch<'a> {
        Patch { quads: &self.quads, surface_of, constraints: &self.constraints, chains, surfaces }
    }
}

/// Least sine over all corners, signed along z: an oracle that shares no code with the smoother.
fn least_planar_sine(quads: &[[u32; 4]], p: &[DVec3]) -> f64 {
    let mut least = f64::INFINITY;
    for quad in quads {
        for k in 0..4 {
            let at = |i: usize| p[quad[(k + i) % 4] as usize].truncate();
            least =
                least.min((at(1) - at(0)).perp_dot(at(3) - at(0)) / (at(0).distance(at(1)) * at(0).distance(at(3))));
        }
    }
    least
}

#[test]
fn a_scrambled_grid_returns_to_squares() {
    let g = grid(12);
    let mut positions = g.positions.clone();
    let mut seed = 1;
    for (p, c) in positions.iter_mut().zip(&g.constraints) {
        if *c == Constraint::Free {
            *p += DVec3::new(noise(&mut seed), noise(&mut seed), noise(&mut seed)) * 0.9;
        }
    }
    assert!(least_planar_sine(&g.quads, &positions) < -0.5, "the start is tangled");
    let surface_of = vec![0; g.quads.len()];
    let options = SmoothOptions { sweeps: 60, ..SmoothOptions::default() };
    let report = smooth_quads(g.patch(&surface_of, &[], &[&Plane]), &mut positions, &options, &Monitor::new()).unwrap();
    assert_eq!(report.inverted, 0);
    assert!(report.worst_before < 0.0 && report.worst > 0.9, "{report:?}");
    assert!(least_planar_sine(&g.quads, &positions) > 0.9);
    assert!(positions.iter().all(|p| p.z == 0.0));
    for (v, c) in g.constraints.iter().enumerate() {
        assert!(*c == Constraint::Free || positions[v] == g.positions[v], "vertex {v} is fixed");
    }
}

#[test]
fn chain_vertices_slide_and_stay_on_the_chain() {
    let mut g = grid(8);
    let n = g.n;
    let chain = Polyline::new((0..=n).map(|j| DVec3::new(4.0, j as f64, 0.0)).collect());
    let mut positions = g.positions.clone();
    for j in 1..n {
        let v = 4 * (n + 1) + j;
        g.constraints[v] = Constraint::OnChain(0);
        positions[v].y = (j as f64).powi(2) / n as f64;
    }
    let surface_of = vec![0; g.quads.len()];
    let options = SmoothOptions { sweeps: 60, keep_aspect: 0.0, ..SmoothOptions::default() };
    let chains = [chain];
    smooth_quads(g.patch(&surface_of, &chains, &[&Plane]), &mut positions, &options, &Monitor::new()).unwrap();
    for j in 1..n {
        let p = positions[4 * (n + 1) + j];
        assert!(p.x == 4.0 && (p.y - j as f64).abs() < 0.2, "{p}");
    }
}

#[test]
fn a_quad_folded_over_on_the_sphere_is_unfolded() {
    let g = grid(10);
    // The grid wrapped onto a cap of the unit sphere, one vertex pulled across its neighbours.
    let mut positions: Vec<DVec3> =
        g.positions.iter().map(|p| DVec3::new(p.x / 5.0 - 1.0, p.y / 5.0 - 1.0, 1.5).normalize()).collect();
    let v = 5 * 11 + 5;
    positions[v] = positions[v + 3];
    let surface_of = vec![0; g.quads.len()];
    let report =
        smooth_quads(g.patch(&surface_of, &[], &[&Sphere]), &mut positions, &SmoothOptions::default(), &Monitor::new())
            .unwrap();
    assert!(report.worst_before <= 0.0 && report.worst > 0.6, "{report:?}");
    // Every triangle of both splits faces outwards.
    for quad in &g.quads {
        for k in 0..4 {
            let at = |i: usize| positions[quad[(k + i) % 4] as usize];
            assert!((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0)) > 0.0);
        }
    }
    assert!(positions.iter().all(|p| (p.length() - 1.0).abs() < 1e-12));
}

#[test]
fn bad_arrays_and_cancelling_are_errors() {
    let g = grid(3);
    let mut positions = g.positions.clone();
    let run = |patch: Patch<'_>, positions: &mut [DVec3], monitor: &Monitor| {
        smooth_quads(patch, positions, &SmoothOptions::default(), monitor)
    };
    let monitor = Monitor::new();
    assert_eq!(
        run(g.patch(&[0; 2], &[], &[&Plane]), &mut positions, &monitor),
        Err(SmoothError::Length { array: "surface_of", found: 2, wanted: 9 })
    );
    assert_eq!(
        run(g.patch(&[0, 0, 1, 0, 0, 0, 0, 0, 0], &[], &[&Plane]), &mut positions, &monitor),
        Err(SmoothError::Quad { quad: 2 })
    );
    monitor.cancel();
    assert_eq!(run(g.patch(&[0; 9], &[], &[&Plane]), &mut positions, &monitor), Err(SmoothError::Cancelled(Cancelled)));
}

#[test]
fn two_thousand_quads_follow_a_triangle_mesh() {
    let reference = TriangleReference::new(&crate::test_shapes::sphere(120, 80));
    let g = grid(45);
    let mut seed = 5;
    let mut positions: Vec<DVec3> = g
        .positions
        .iter()
        .zip(&g.constraints)
        .map(|(p, c)| {
            let mut jitter = || if *c == Constraint::Free { 0.35 * noise(&mut seed) } else { 0.0 };
            DVec3::new((p.x + jitter()) / 22.5 - 1.0, (p.y + jitter()) / 22.5 - 1.0, 1.5).normalize()
        })
        .collect();
    let surface_of = vec![0; g.quads.len()];
    let clock = std::time::Instant::now();
    let report = smooth_quads(
        g.patch(&surface_of, &[], &[&reference]),
        &mut positions,
        &SmoothOptions::default(),
        &Monitor::new(),
    )
    .unwrap();
    println!("{} quads in {:.1} ms: {report:?}", g.quads.len(), 1e3 * clock.elapsed().as_secs_f64());
    assert!(report.worst > 0.6 && report.mean > 0.9, "{report:?}");
    for (p, c) in positions.iter().zip(&g.constraints) {
        assert!(*c == Constraint::Fixed || (0.995..=1.0 + 1e-12).contains(&p.length()), "{}", p.length());
    }
}
