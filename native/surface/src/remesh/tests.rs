//! Remeshing checked from outside: topology by counting, fixed edges by looking for them, shape by angles.

use super::*;
use crate::test_shapes::{census, cut, grid, insert_slivers, minimum_angle, sphere};
use std::collections::BTreeMap;

fn edges(mesh: &TriangleMesh) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges
}

/// Everything the interface promises, whatever the shape.
fn assert_promises(input: &TriangleMesh, fixed: &[[u32; 2]], output: &Remeshed) {
    let (before, after) = (census(input), census(&output.mesh));
    assert_eq!(before, after, "same Euler characteristic, border and manifoldness");
    let all = edges(&output.mesh);
    let border: Vec<[u32; 2]> = edges(input).into_iter().filter(|e| e.1 == 1).map(|e| e.0).collect();
    let mut kept = BTreeSet::new();
    let mut kept_edges = BTreeSet::new();
    for edge in border.iter().chain(fixed) {
        let [a, b] = edge.map(|v| output.vertex[v as usize]);
        assert!(a != NONE && b != NONE && all.contains_key(&[a.min(b), a.max(b)]), "edge {edge:?} is gone");
        for v in edge {
            let position = output.mesh.positions[output.vertex[*v as usize] as usize];
            assert_eq!(position, input.positions[*v as usize]);
        }
        kept.extend([a, b]);
        kept_edges.insert([a.min(b), a.max(b)]);
    }
    for edge in all.keys() {
        let is_chord = kept.contains(&edge[0]) && kept.contains(&edge[1]) && !kept_edges.contains(edge);
        assert!(!is_chord, "edge {edge:?} joins two fixed vertices");
    }
    assert!(output.source.len() == output.mesh.triangles.len());
    assert!(output.source.iter().all(|&t| (t as usize) < input.triangles.len()));
}

fn run(input: &TriangleMesh, fixed: &[[u32; 2]], size: f64) -> Remeshed {
    let sizes = vec![size; input.positions.len()];
    remesh(input, fixed, &sizes, &RemeshOptions::default(), &Monitor::new()).expect("remeshes")
}

#[test]
fn cleans_up_cut_spheres_full_of_slivers() {
    for k in 0..12 {
        let f = f64::from(k);
        let normal = DVec3::new((f * 1.7).sin(), (f * 2.3).cos(), (f * 0.9).sin() + 0.2).normalize();
        let (mut mesh, curve) = cut(&sphere(32, 16), normal, 0.6 * (f * 3.1).sin());
        insert_slivers(&mut mesh);
        let output = run(&mesh, &curve, 0.15);
        assert_promises(&mesh, &curve, &output);
        let turned = (0..output.mesh.triangles.len())
            .filter(|&t| {
                let [a, b, c] = output.mesh.points(t);
                if a.distance(b).min(b.distance(c)).min(c.distance(a)) < 1e-9 {
                    return false;
                }
                let centre = output.mesh.points(t).iter().sum::<DVec3>();
                output.mesh.area_normal(t).normalize().dot(centre.normalize()) < 0.5
            })
            .count();
        assert_eq!(turned, 0);
        // Edges of the cut may be tiny, and stay: angles count away from them.
        let fixed: BTreeSet<u32> = curve.iter().flatten().map(|&v| output.vertex[v as usize]).collect();
        let free = output.mesh.triangles.iter().filter(|t| t.iter().all(|v| !fixed.contains(v))).copied().collect();
        let inner = TriangleMesh { positions: output.mesh.positions.clone(), triangles: free };
        assert!(minimum_angle(&inner) > 25.0, "{}", minimum_angle(&inner));
    }
}

#[test]
fn keeps_each_side_of_a_sharp_fixed_edge_to_its_own_surface() {
    // A roof: two planes that meet at a right angle along x = 8.
    let mesh = grid(16, 12, |x, y| {
        let jolted = x + if x == 8.0 { 0.0 } else { 0.3 * (x * (16.0 - x) * y).sin() };
        DVec3::new(jolted, y, -(jolted - 8.0).abs())
    });
    let ridge: Vec<[u32; 2]> = (0..12).map(|j| [j * 17 + 8, (j + 1) * 17 + 8]).collect();
    let output = run(&mesh, &ridge, 1.0);
    assert_promises(&mesh, &ridge, &output);
    for p in &output.mesh.positions {
        assert!((p.z + (p.x - 8.0).abs()).abs() < 1e-12, "{p} left the roof");
    }
    for (t, &s) in output.source.iter().enumerate() {
        assert!(output.mesh.area_normal(t).normalize().dot(mesh.area_normal(s as usize).normalize()) > 1.0 - 1e-9);
    }
}

#[test]
fn reaches_the_size_asked_for_from_finer_and_from_coarser() {
    for (input, size) in [(sphere(96, 48), 0.2), (sphere(8, 5), 0.1), (sphere(32, 16), 0.12)] {
        let output = run(&input, &[], size);
        assert_promises(&input, &[], &output);
        let lengths: Vec<f64> = edges(&output.mesh)
            .keys()
            .map(|e| output.mesh.positions[e[0] as usize].distance(output.mesh.positions[e[1] as usize]))
            .collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        assert!((mean / size - 1.0).abs() < 0.15, "mean edge {mean} for {size}");
        assert!(minimum_angle(&output.mesh) > 25.0);
    }
}

#[test]
fn keeps_dangling_fixed_edges_and_pinched_vertices() {
    let mut mesh = grid(10, 10, |x, y| DVec3::new(x, y, 0.0));
    // A slit of three edges, a lone edge; and two grids that touch in a corner.
    let fixed = [[24, 25], [25, 26], [26, 27], [70, 81]];
    let other = grid(4, 4, |x, y| DVec3::new(10.0 + x, 10.0 + y, 0.0));
    let base = mesh.positions.len() as u32;
    let weld = |v: u32| if v == 0 { 120 } else { base + v - 1 };
    mesh.positions.extend(&other.positions[1..]);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(weld)));
    for size in [0.5, 1.0, 2.5] {
        assert_promises(&mesh, &fixed, &run(&mesh, &fixed, size));
    }
}

#[test]
fn splits_every_chord_of_a_strip_of_nothing_else() {
    let mut mesh = grid(30, 1, |x, y| DVec3::new(x, y, 0.0));
    // All inner edges fixed at one end: a fan, where one triangle has two chords.
    mesh.positions.push(DVec3::new(15.0, -9.0, 0.0));
    mesh.triangles.extend((0..30).map(|i| [62, i + 1, i]));
    for size in [0.5, 1.0, 4.0] {
        assert_promises(&mesh, &[], &run(&mesh, &[], size));
        let fixed: Vec<[u32; 2]> = (0..30).map(|i| [i, i + 1]).collect();
        assert_promises(&mesh, &fixed, &run(&mesh, &fixed, size));
    }
}

#[test]
fn gives_the_same_bytes_on_one_thread_and_on_many() {
    let (mesh, curve) = cut(&sphere(32, 16), DVec3::new(0.3, 0.2, 1.0), 0.1234);
    let many = run(&mesh, &curve, 0.1);
    let one =
        rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool").install(|| run(&mesh, &curve, 0.1));
    assert_eq!(many, one);
}

#[test]
fn names_what_is_wrong_with_the_input() {
    let mesh = grid(2, 2, |x, y| DVec3::new(x, y, 0.0));
    let try_with = |mesh: &TriangleMesh, fixed: &[[u32; 2]], size: &[f64]| {
        remesh(mesh, fixed, size, &RemeshOptions::default(), &Monitor::new()).expect_err("bad input")
    };
    assert_eq!(try_with(&mesh, &[], &[1.0]), RemeshError::SizeCount { given: 1, vertices: 9 });
    assert_eq!(try_with(&mesh, &[[0, 8]], &[1.0; 9]), RemeshError::NoSuchEdge { edge: 0 });
    let mut sizes = [1.0; 9];
    sizes[3] = f64::NAN;
    assert_eq!(try_with(&mesh, &[], &sizes), RemeshError::BadSize { vertex: 3 });
    let mut broken = mesh.clone();
    broken.triangles[2] = [0, 0, 1];
    assert_eq!(try_with(&broken, &[], &[1.0; 9]), RemeshError::BadTriangle { triangle: 2 });
    broken = mesh.clone();
    broken.positions[5].y = f64::INFINITY;
    assert_eq!(try_with(&broken, &[], &[1.0; 9]), RemeshError::NotFinite { vertex: 5 });
    let monitor = Monitor::new();
    monitor.cancel();
    let stopped = remesh(&mesh, &[], &[1.0; 9], &RemeshOptions::default(), &monitor);
    assert_eq!(stopped, Err(RemeshError::Cancelled(Cancelled)));
}
