use super::*;
use crate::test_shapes::{grid, sphere};
use glam::DVec3;
use mesh::Topology;

fn of(mesh: &TriangleMesh) -> Intrinsic {
    Intrinsic::new(mesh, &Topology::of_triangles(mesh))
}

/// A plane grid with every vertex moved a little, so that no three of them lie on a line.
fn rough_plane() -> TriangleMesh {
    grid(9, 7, |x, y| {
        let noise = |a: f64, b: f64| 0.31 * (a * x + b * y + a * b * x * y).sin();
        DVec3::new(x + noise(12.9, 78.2), y + noise(39.3, 11.1), 0.0)
    })
}

/// Numbers that repeat.
fn random(seed: &mut u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *seed >> 33
}

/// Flips random edges whose two triangles form a convex quadrilateral.
fn flip_at_random(triangulation: &mut Intrinsic, times: usize, mut seed: u64) -> usize {
    let mut flips = 0;
    for _ in 0..times {
        let h = (random(&mut seed) % triangulation.twin.len() as u64) as u32;
        let t = triangulation.twin[h as usize];
        if t == NONE {
            continue;
        }
        let at_start = triangulation.angle(h) + triangulation.angle(triangulation.next[t as usize]);
        let at_end = triangulation.angle(t) + triangulation.angle(triangulation.next[h as usize]);
        if at_start.max(at_end) < PI - 1e-3 {
            triangulation.flip(h);
            flips += 1;
        }
    }
    flips
}

/// Where two segments of the plane cross inside both, as the fraction along the first.
fn crossing([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> Option<f64> {
    let side = |p: DVec3, q: DVec3, r: DVec3| (q - p).truncate().perp_dot((r - p).truncate());
    let (s, t) = (side(c, d, a), side(c, d, b));
    (s * t < 0.0 && side(a, b, c) * side(a, b, d) < 0.0).then(|| s / (s - t))
}

#[test]
fn crossings_are_those_of_the_plane_after_many_flips() {
    let mesh = rough_plane();
    let mut triangulation = of(&mesh);
    assert!(flip_at_random(&mut triangulation, 4000, 7) > 1000);
    let at = |v: u32| mesh.positions[v as usize];
    let surface: Vec<[u32; 2]> = of(&mesh).surface_edges();
    for h in 0..triangulation.twin.len() as u32 {
        let ends = [triangulation.from(h), triangulation.to(h)];
        let length = at(ends[0]).distance(at(ends[1]));
        assert!((triangulation.length_of(h) - length).abs() < 1e-9);
        let is_edge = surface.contains(&mesh::sorted(ends[0], ends[1]));
        let expected = surface.iter().filter(|e| crossing(ends.map(at), e.map(at)).is_some()).count();
        assert_eq!(triangulation.crossing_count(h), (!is_edge).then_some(expected as u32), "edge {ends:?}");
    }
    // Every surface edge is found, with its crossings in order and in place.
    let arcs = triangulation.arcs();
    for arc in &arcs {
        let mut expected: Vec<f64> =
            triangulation.surface_edges().iter().filter_map(|e| crossing(arc.ends.map(at), e.map(at))).collect();
        expected.sort_by(f64::total_cmp);
        assert_eq!(arc.crossings.len(), expected.len());
        for (found, expected) in arc.crossings.iter().zip(expected) {
            assert!((found.at - expected).abs() < 1e-6);
        }
    }
    let kept = (0..triangulation.twin.len() as u32)
        .filter(|&h| triangulation.crossing_count(h).is_none())
        .filter(|&h| triangulation.twin[h as usize] == NONE || h < triangulation.twin[h as usize])
        .count();
    assert_eq!(arcs.len() + kept, surface.len());
}

#[test]
fn surface_edges_are_found_again_on_a_closed_surface() {
    let mesh = sphere(17, 11);
    let mut triangulation = of(&mesh);
    let mut surface = triangulation.surface_edges();
    assert!(flip_at_random(&mut triangulation, 3000, 3) > 500);
    let mut found: Vec<[u32; 2]> = triangulation.arcs().iter().map(|arc| arc.ends).collect();
    for h in (0..triangulation.twin.len() as u32).filter(|&h| h < triangulation.twin[h as usize]) {
        if triangulation.crossing_count(h).is_none() {
            found.push(mesh::sorted(triangulation.from(h), triangulation.to(h)));
        }
    }
    found.sort_unstable();
    surface.sort_unstable();
    assert_eq!(found, surface);
}

#[test]
fn delaunay_flips_leave_no_opposite_angles_beyond_pi_but_on_fixed_edges() {
    let mesh = grid(12, 9, |x, y| DVec3::new(x + 2.3 * y, 0.4 * y, (0.4 * x).sin()));
    let mut triangulation = of(&mesh);
    let mut fixed = vec![false; triangulation.length.len()];
    for e in (0..fixed.len()).step_by(11) {
        fixed[e] = true;
    }
    let before = triangulation.length.clone();
    triangulation.make_delaunay(&fixed, &Monitor::new()).unwrap();
    let mut flipped = 0;
    for h in 0..triangulation.twin.len() as u32 {
        let (t, e) = (triangulation.twin[h as usize], triangulation.edge[h as usize] as usize);
        if fixed[e] {
            assert_eq!(triangulation.length[e], before[e]);
        } else if t != NONE {
            let opposite = |h: u32| triangulation.angle(triangulation.prev(h));
            assert!(opposite(h) + opposite(t) <= PI + 1e-8);
        }
        flipped += usize::from(triangulation.crossing_count(h).is_some());
    }
    assert!(flipped > 50);
}

#[test]
fn triangles_without_area_get_some() {
    let mut mesh = grid(3, 3, |x, y| DVec3::new(x, y, 0.0));
    mesh.positions[5] = mesh.positions[6];
    mesh.positions[10] = (mesh.positions[9] + mesh.positions[11]) / 2.0;
    let triangulation = of(&mesh);
    for h in 0..triangulation.twin.len() as u32 {
        let [a, b, c] = [h, triangulation.next[h as usize], triangulation.prev(h)].map(|h| triangulation.length_of(h));
        assert!(a + b > c);
        assert!(triangulation.cotangent_opposite(h).is_finite());
    }
}

impl Intrinsic {
    /// Ends of all edges, the lower first: of the surface's edges before any flip.
    fn surface_edges(&self) -> Vec<[u32; 2]> {
        (0..self.twin.len() as u32)
            .filter(|&h| self.twin[h as usize] == NONE || h < self.twin[h as usize])
            .map(|h| mesh::sorted(self.from(h), self.to(h)))
            .collect()
    }
}
