use super::*;
use std::collections::BTreeSet;
use std::f64::consts::PI;
use testkit::plane_region::{circle, plane_region, subdivided};

fn field_of(mesh: &TriangleMesh, features: &[[u32; 2]]) -> CrossField {
    cross_field(mesh, &Topology::of_triangles(mesh), features, &[]).expect("a field")
}

/// Least angle between a cross and a direction in its plane.
fn deviation(cross: DVec3, normal: DVec3, direction: DVec3) -> f64 {
    let side = normal.cross(cross);
    wrap_quarter(direction.dot(side).atan2(direction.dot(cross))).abs()
}

fn square() -> Vec<DVec2> {
    [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(DVec2::from).to_vec()
}

#[test]
fn field_of_a_rectangle_is_parallel_to_its_sides() {
    let tilt = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.8, -1.1);
    let mesh = plane_region(&[subdivided(&square(), 0.31)], |p| tilt * p.extend(0.0));
    let field = field_of(&mesh, &[]);
    assert!(field.singularities.is_empty());
    for cross in field.face_directions.iter().chain(&field.vertex_directions) {
        assert!(deviation(*cross, tilt.z_axis, tilt.x_axis) < 1e-9);
        assert!((cross.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn field_of_a_regular_annulus_is_radial() {
    let (around, rings) = (24, 5);
    let at = |r: u32, k: u32| r * around + k % around;
    let mut mesh = TriangleMesh::default();
    for r in 0..=rings {
        mesh.positions
            .extend(circle(DVec2::ZERO, 1.0 + f64::from(r) * 0.25, around as usize).iter().map(|p| p.extend(0.0)));
    }
    for (r, k) in (0..rings).flat_map(|r| (0..around).map(move |k| (r, k))) {
        mesh.triangles.push([at(r, k), at(r + 1, k), at(r + 1, k + 1)]);
        mesh.triangles.push([at(r, k), at(r + 1, k + 1), at(r, k + 1)]);
    }
    let field = field_of(&mesh, &[]);
    assert!(field.singularities.is_empty());
    for (p, cross) in mesh.positions.iter().zip(&field.vertex_directions) {
        // Every quad is split the same way, which turns the border's tangent by at most a quarter of the 15 degrees between spokes.
        assert!(deviation(*cross, DVec3::Z, *p) < 15_f64.to_radians() / 4.0, "{p} {cross}");
    }
}

/// Quarter turns the cross makes inside a border vertex's corner, from one border edge to the other.
fn border_quarters(mesh: &TriangleMesh, topology: &Topology, field: &CrossField, v: u32) -> i32 {
    let mut angle = 0.0;
    let mut turned = 0.0;
    let mut previous: Option<u32> = None;
    for h in topology.around(v) {
        let f = h as usize / 3;
        let [p, q, r] =
            [v, topology.to(h), topology.from(topology.prev[h as usize])].map(|u| mesh.positions[u as usize]);
        angle += (q - p).angle_between(r - p);
        if let Some(g) = previous {
            // Rotate the previous face's plane onto this one about the shared edge.
            let rotation = glam::DQuat::from_rotation_arc(
                mesh.area_normal(g as usize).normalize(),
                mesh.area_normal(f).normalize(),
            );
            let (carried, cross) = (rotation * field.face_directions[g as usize], field.face_directions[f]);
            let normal = mesh.area_normal(f).normalize();
            turned += wrap_quarter(carried.cross(cross).dot(normal).atan2(carried.dot(cross)));
        }
        previous = Some(f as u32);
    }
    ((angle - turned) / FRAC_PI_2).round() as i32
}

fn euler_characteristic(mesh: &TriangleMesh) -> i32 {
    let used: BTreeSet<u32> = mesh.triangles.iter().flatten().copied().collect();
    let edges: BTreeSet<[u32; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|t| (0..3).map(|k| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])]))
        .collect();
    used.len() as i32 - edges.len() as i32 + mesh.triangles.len() as i32
}

#[test]
fn indices_sum_to_the_euler_characteristic() {
    let dome = |p: DVec2| p.extend(0.8 * (-0.3 * p.length_squared()).exp());
    let l_shape = [(0., 0.), (4., 0.), (4., 2.), (2., 2.), (2., 4.), (0., 4.)].map(DVec2::from);
    let regions = [
        plane_region(&[circle(DVec2::ZERO, 2.0, 40)], dome),
        plane_region(&[subdivided(&l_shape, 0.3)], dome),
        plane_region(&[subdivided(&[(0., 0.), (5., 1.), (2., 4.)].map(DVec2::from), 0.25)], dome),
        plane_region(
            &[
                circle(DVec2::ZERO, 3.0, 60),
                circle(DVec2::new(1.2, 0.0), 0.6, 14),
                circle(DVec2::new(-1.2, 0.3), 0.7, 16),
            ],
            dome,
        ),
    ];
    for mesh in &regions {
        let topology = Topology::of_triangles(mesh);
        let field = field_of(mesh, &[]);
        let interior: i32 = field.singularities.iter().map(|s| s.1).sum();
        let border: i32 = (0..mesh.positions.len() as u32)
            .filter(|&v| topology.is_border_vertex(v))
            .map(|v| 2 - border_quarters(mesh, &topology, &field, v))
            .sum();
        assert_eq!(interior + border, 4 * euler_characteristic(mesh));
    }
}

/// A sphere (genus 0) as a subdivided octahedron, and a torus.
fn closed_surfaces() -> [TriangleMesh; 2] {
    let n = 12_i32;
    let mut sphere = TriangleMesh::default();
    let mut index = std::collections::BTreeMap::new();
    let mut vertex = |p: glam::IVec3, mesh: &mut TriangleMesh| {
        *index.entry(p.to_array()).or_insert_with(|| {
            mesh.positions.push(p.as_dvec3().normalize());
            mesh.positions.len() as u32 - 1
        })
    };
    for sign in 0..8 {
        let s = glam::IVec3::new(1 - 2 * (sign & 1), 1 - (sign & 2), 1 - (sign & 4) / 2);
        let mut add = |t: [(i32, i32); 3]| {
            let mut t = t.map(|(i, j)| vertex(glam::IVec3::new(i, j, n - i - j) * s, &mut sphere));
            if s.x * s.y * s.z < 0 {
                t.swap(1, 2);
            }
            sphere.triangles.push(t);
        };
        for i in 0..n {
            for j in 0..n - i {
                add([(i, j), (i + 1, j), (i, j + 1)]);
                if i + j + 2 <= n {
                    add([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                }
            }
        }
    }
    let (a, b) = (30_u32, 14_u32);
    let mut torus = TriangleMesh::default();
    for (i, j) in (0..a).flat_map(|i| (0..b).map(move |j| (i, j))) {
        let (u, v) = (2.0 * PI * f64::from(i) / f64::from(a), 2.0 * PI * f64::from(j) / f64::from(b));
        let r = 3.0 + v.cos();
        torus.positions.push(DVec3::new(r * u.cos(), r * u.sin(), v.sin()));
        let at = |i: u32, j: u32| (i % a) * b + j % b;
        torus.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        torus.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    [sphere, torus]
}

#[test]
fn closed_surfaces_obey_poincare_hopf() {
    for mesh in closed_surfaces() {
        let sum: i32 = field_of(&mesh, &[]).singularities.iter().map(|s| s.1).sum();
        assert_eq!(sum, 4 * euler_characteristic(&mesh));
    }
}

#[test]
fn features_are_followed_on_both_sides() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 2.0, 40)], |p| p.extend(0.0));
    let topology = Topology::of_triangles(&mesh);
    let h = topology
        .edges()
        .find(|&h| [topology.from(h), topology.to(h)].iter().all(|&v| mesh.positions[v as usize].length() < 1.0));
    let h = h.expect("an interior edge");
    let edge = [topology.to(h), topology.from(h)];
    let field = field_of(&mesh, &[edge]);
    let direction = mesh.positions[edge[1] as usize] - mesh.positions[edge[0] as usize];
    for side in [h, topology.twin[h as usize]] {
        assert!(deviation(field.face_directions[side as usize / 3], DVec3::Z, direction) < 1e-9);
    }
}

#[test]
fn bad_input_is_named() {
    let flat = |p: DVec2| p.extend(0.0);
    let mesh = plane_region(&[circle(DVec2::ZERO, 1.0, 12)], flat);
    let error = cross_field(&mesh, &Topology::of_triangles(&mesh), &[[0, 6]], &[]).unwrap_err();
    assert_eq!(error, CrossFieldError::NoSuchEdge { feature: 0 });
    let mut thin = mesh.clone();
    thin.triangles.push([0, 0, 1]);
    let error = cross_field(&thin, &Topology::of_triangles(&thin), &[], &[]).unwrap_err();
    assert_eq!(error, CrossFieldError::Degenerate { triangle: mesh.triangles.len() as u32 });
    let mut both = closed_surfaces()[0].clone();
    let offset = both.positions.len() as u32;
    both.positions.extend(&mesh.positions);
    both.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + offset)));
    let error = cross_field(&both, &Topology::of_triangles(&both), &[], &[]).unwrap_err();
    assert_eq!(error, CrossFieldError::Unconstrained { triangle: 0 });
}
