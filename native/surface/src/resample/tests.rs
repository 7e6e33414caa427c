//! Resampling checked from outside: topology by counting, the curve by walking it, the old polyline by distance.

use super::*;
use crate::remesh::{RemeshOptions, remesh};
use crate::test_shapes::{census, cut, grid, insert_slivers, sphere};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Orders the edges of a simple loop into a closed path.
fn closed_path(edges: &[[u32; 2]]) -> Vec<u32> {
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in edges {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    let mut path = vec![edges[0][0], edges[0][1]];
    while path[0] != path[path.len() - 1] {
        let [before, here] = [path[path.len() - 2], path[path.len() - 1]];
        path.push(*around[&here].iter().find(|&&v| v != before).expect("a loop"));
    }
    path
}

fn distance_to_polyline(p: DVec3, line: &[DVec3]) -> f64 {
    line.windows(2)
        .map(|s| {
            let along = s[1] - s[0];
            let t = ((p - s[0]).dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
            p.distance(s[0] + along * t)
        })
        .fold(f64::INFINITY, f64::min)
}

fn even(count: usize) -> Vec<f64> {
    (1..count).map(|k| k as f64 / count as f64).collect()
}

/// What the interface promises.
fn assert_promises(input: &TriangleMesh, chains: &[Chain], output: &Resampled) {
    let (before, after) = (census(input), census(&output.mesh));
    assert_eq!(
        (before.euler, before.bad_edges, before.bad_vertices),
        (after.euler, after.bad_edges, after.bad_vertices)
    );
    let edges: BTreeSet<[u32; 2]> = output
        .mesh
        .triangles
        .iter()
        .flat_map(|t| (0..3).map(move |k| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])]))
        .collect();
    for (chain, path) in chains.iter().zip(&output.chains) {
        assert_eq!(path.len(), chain.positions.len() + 2);
        let old: Vec<DVec3> = chain.vertices.iter().map(|&v| input.positions[v as usize]).collect();
        let total: f64 = old.windows(2).map(|s| s[0].distance(s[1])).sum();
        for step in path.windows(2) {
            assert!(edges.contains(&[step[0].min(step[1]), step[0].max(step[1])]), "{step:?} is no edge");
        }
        for &v in path {
            assert!(distance_to_polyline(output.mesh.positions[v as usize], &old) < 1e-9 * total);
        }
        let kept: BTreeSet<u32> = path.iter().copied().collect();
        for &v in &chain.vertices[1..chain.vertices.len() - 1] {
            let now = output.vertex[v as usize];
            assert!(now == NONE || kept.contains(&now), "vertex {v} is still there");
        }
    }
    for (v, &now) in output.vertex.iter().enumerate() {
        assert!(now == NONE || output.mesh.positions[now as usize] == input.positions[v]);
    }
    assert_eq!(output.source.len(), output.mesh.triangles.len());
}

fn turned(mesh: &TriangleMesh) -> usize {
    (0..mesh.triangles.len())
        .filter(|&t| {
            let centre = mesh.points(t).iter().sum::<DVec3>();
            mesh.area_normal(t).dot(centre) < 0.0
        })
        .count()
}

#[test]
fn resamples_the_cut_of_a_sphere_and_leaves_a_mesh_fit_for_remeshing() {
    for k in 0..12 {
        let f = f64::from(k);
        let normal = DVec3::new((f * 1.7).sin(), (f * 2.3).cos(), (f * 0.9).sin() + 0.2).normalize();
        let (mut mesh, curve) = cut(&sphere(32, 16), normal, 0.6 * (f * 3.1).sin() + 0.01);
        insert_slivers(&mut mesh);
        for count in [3, 8, 24, 60, 150] {
            let chain = Chain { vertices: closed_path(&curve), positions: even(count) };
            let output = resample_chains(&mesh, std::slice::from_ref(&chain), &[], &Monitor::new()).expect("resamples");
            assert_promises(&mesh, &[chain], &output);
            let fixed: Vec<[u32; 2]> = output.chains[0].windows(2).map(|s| [s[0], s[1]]).collect();
            let sizes = vec![6.0 / 40.0; output.mesh.positions.len()];
            let remeshed =
                remesh(&output.mesh, &fixed, &sizes, &RemeshOptions::default(), &Monitor::new()).expect("remeshes");
            assert_eq!(census(&output.mesh).euler, census(&remeshed.mesh).euler);
            // Fewer samples cut far into the sphere: nothing outward is left to compare with.
            if count >= 24 {
                assert_eq!(turned(&remeshed.mesh), 0, "case {k}, {count} samples");
            }
        }
    }
}

#[test]
fn resamples_border_and_inner_chains_that_meet() {
    let mesh = grid(12, 12, |x, y| DVec3::new(x, y, 0.1 * (x * 0.7).sin()));
    let at = |i: u32, j: u32| j * 13 + i;
    let across = Chain { vertices: (0..=12).map(|i| at(i, 6)).collect(), positions: even(5) };
    let down = Chain { vertices: (0..=6).map(|j| at(6, j)).collect(), positions: even(17) };
    // `down` ends in the middle of `across`: that has to be cut there.
    let crossing = resample_chains(&mesh, &[across.clone(), down.clone()], &[], &Monitor::new());
    assert!(matches!(crossing, Err(ResampleError::Crossing { vertex, .. }) if vertex == at(6, 6)), "{crossing:?}");
    let halves = [0..=6, 6..=12].map(|part| Chain { vertices: part.map(|i| at(i, 6)).collect(), positions: even(2) });
    let border = Chain { vertices: (0..=12).map(|i| at(i, 0)).collect(), positions: vec![0.1, 0.5, 0.8] };
    let chains = [halves[0].clone(), halves[1].clone(), down];
    let fixed: Vec<u32> = (0..=12).map(|i| at(i, 0)).collect();
    let output = resample_chains(&mesh, &chains, &fixed, &Monitor::new()).expect("resamples");
    assert_promises(&mesh, &chains, &output);
    assert_eq!(census(&mesh).border_edges, census(&output.mesh).border_edges);
    let kept = resample_chains(&mesh, std::slice::from_ref(&border), &fixed, &Monitor::new());
    assert!(matches!(kept, Err(ResampleError::Kept { chain: 0, .. })));
    let output = resample_chains(&mesh, std::slice::from_ref(&border), &[], &Monitor::new()).expect("resamples");
    assert_promises(&mesh, &[border], &output);
    assert_eq!(census(&mesh).border_edges, census(&output.mesh).border_edges + 8);
}

#[test]
fn snaps_samples_to_the_vertices_they_fall_on() {
    let mesh = grid(4, 4, |x, y| DVec3::new(x, y, 0.0));
    let chain = Chain { vertices: (10..15).collect(), positions: even(4) };
    let output = resample_chains(&mesh, std::slice::from_ref(&chain), &[], &Monitor::new()).expect("resamples");
    assert_eq!(output.mesh, mesh);
    assert_eq!(output.chains[0], chain.vertices);
}

#[test]
fn names_the_chain_that_is_wrong() {
    let mesh = grid(4, 4, |x, y| DVec3::new(x, y, 0.0));
    let try_with = |vertices: Vec<u32>, positions: Vec<f64>| {
        resample_chains(&mesh, &[Chain { vertices, positions }], &[], &Monitor::new()).expect_err("a bad chain")
    };
    assert_eq!(try_with(vec![0, 1, 3], vec![]), ResampleError::NotAPath { chain: 0, step: 1 });
    assert_eq!(try_with(vec![0, 99], vec![]), ResampleError::NotAPath { chain: 0, step: 0 });
    assert_eq!(try_with(vec![0], vec![]), ResampleError::NotAPath { chain: 0, step: 0 });
    assert_eq!(try_with(vec![0, 1], vec![0.5, 0.5]), ResampleError::BadPosition { chain: 0, position: 1 });
    assert_eq!(try_with(vec![0, 1], vec![f64::NAN]), ResampleError::BadPosition { chain: 0, position: 0 });
    assert_eq!(try_with(vec![6, 7, 12, 6], vec![0.5]), ResampleError::TooFewSamples { chain: 0 });
    // Two chains with the same ends cannot both be one edge, nor can a chain lie upon the border.
    let pair = [vec![6, 7, 12], vec![6, 11, 12]].map(|vertices| Chain { vertices, positions: vec![] });
    assert_eq!(resample_chains(&mesh, &pair, &[], &Monitor::new()), Err(ResampleError::Topology { chain: 1 }));
    assert_eq!(try_with(vec![0, 6, 1], vec![]), ResampleError::Topology { chain: 0 });
}
