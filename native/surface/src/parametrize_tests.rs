use super::*;
use testkit::plane_region::{circle, plane_region, subdivided};

fn square() -> [DVec2; 4] {
    [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(DVec2::from)
}

fn hill(p: DVec2) -> DVec3 {
    p.extend(0.8 * (3.0 * p.x).sin() * p.y)
}

#[test]
fn a_plane_disk_is_reproduced() {
    let mesh = plane_region(&[subdivided(&square(), 0.13)], |p| p.extend(0.0));
    let flat = |v: usize| mesh.positions[v].truncate();
    let topology = Topology::of_triangles(&mesh);
    let border: Vec<(u32, DVec2)> = (0..mesh.positions.len())
        .filter(|&v| topology.is_border_vertex(v as u32))
        .map(|v| (v as u32, flat(v)))
        .collect();
    let pins = [border[0], border[border.len() / 2]];
    for map in [lscm(&mesh, &pins), lscm(&mesh, &border)] {
        let map = map.expect("a map");
        assert!(map.flipped().is_empty());
        for v in 0..mesh.positions.len() {
            assert!(map.uv[v].distance(flat(v)) < 1e-8, "{v}");
        }
    }
}

#[test]
fn lscm_keeps_the_angles_of_a_cone() {
    // A cone unrolls: an exact isometry exists, so every angle must survive.
    let (n, rings) = (24_u32, 6_u32);
    let mut mesh = TriangleMesh::default();
    for r in 1..=rings {
        for k in 0..=n {
            let angle = 1.5 * f64::from(k) / f64::from(n);
            mesh.positions.push(f64::from(r) * DVec3::new(angle.cos(), angle.sin(), 0.7));
        }
    }
    for (r, k) in (0..rings - 1).flat_map(|r| (0..n).map(move |k| (r, k))) {
        let at = |r: u32, k: u32| r * (n + 1) + k;
        mesh.triangles.push([at(r, k), at(r + 1, k), at(r + 1, k + 1)]);
        mesh.triangles.push([at(r, k), at(r + 1, k + 1), at(r, k + 1)]);
    }
    let map = lscm(&mesh, &[(0, DVec2::ZERO), (n, DVec2::X)]).expect("a map");
    assert!(map.flipped().is_empty());
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let (p, q) = (mesh.points(t), triangle.map(|v| map.uv[v as usize]));
        for k in 0..3 {
            let here = (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
            let there = (q[(k + 1) % 3] - q[k]).angle_to(q[(k + 2) % 3] - q[k]);
            assert!((here - there).abs() < 1e-7);
        }
    }
}

#[test]
fn located_points_lie_under_the_query() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 1.0, 40)], hill);
    let map = Flat::new(mesh.positions.iter().map(|p| p.truncate()).collect(), mesh.triangles.clone());
    let over = |l: Location| -> DVec2 {
        (0..3).map(|k| map.uv[mesh.triangles[l.triangle as usize][k] as usize] * l.weights[k]).sum()
    };
    for k in 0..2000 {
        let p = DVec2::from_angle(f64::from(k) * 2.4) * (f64::from(k) / 2000.0).sqrt() * 1.3;
        let found = map.locate(p).expect("a place");
        assert!((found.weights.element_sum() - 1.0).abs() < 1e-9 && found.weights.min_element() >= 0.0);
        // Brute force: the distance to the nearest of all triangles.
        let nearest = (0..mesh.triangles.len()).map(|t| nearest(map.corners(t), p).0).fold(f64::INFINITY, f64::min);
        assert!((over(found).distance(p) - nearest).abs() < 1e-12);
        if p.length() < 0.8 {
            assert!(nearest == 0.0);
        }
        assert!(found.point(&mesh).is_finite());
    }
}

#[test]
fn bad_input_is_named() {
    let ring = plane_region(&[circle(DVec2::ZERO, 2.0, 30), circle(DVec2::ZERO, 1.0, 15)], hill);
    let error = lscm(&ring, &[]).unwrap_err();
    assert_eq!(error, ParametrizeError::NotDisk { loops: 2, euler_characteristic: 0 });
    let disk = plane_region(&[circle(DVec2::ZERO, 1.0, 20)], hill);
    assert_eq!(lscm(&disk, &[(0, DVec2::X)]).unwrap_err(), ParametrizeError::Pins { pin: 1 });
    assert_eq!(lscm(&disk, &[(0, DVec2::X), (0, DVec2::Y)]).unwrap_err(), ParametrizeError::Pins { pin: 1 });
    assert_eq!(lscm(&disk, &[(9999, DVec2::X)]).unwrap_err(), ParametrizeError::Pins { pin: 0 });
}
