//! The base triangulation of shapes and of real meshes, judged from the definitions.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh, sorted};
use proptest::prelude::*;
use retopology::base::Base;
use retopology::base_error::RetopologyError;
use retopology::build::{BaseOptions, Built, build_base};
use retopology::features::Features;
use retopology::session::{EditReport, Session};
use std::collections::{BTreeMap, BTreeSet};
use testkit::random::Random;
use testkit::{oracle, shapes};

mod generated;
use generated::{marked_shape, punched_block, sharp};

fn built(mesh: &PolygonMesh, features: &Features, vertices: u32) -> Built {
    let (triangles, _) = TriangleMesh::from_polygons(mesh);
    let options = BaseOptions { vertices, ..BaseOptions::default() };
    build_base(&triangles, features, &options, &Monitor::new()).unwrap_or_else(|error| panic!("{error}"))
}

fn check(holds: bool, what: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what.to_owned()) }
}

/// Everything that [`Base`] promises, recomputed. Says what does not hold.
fn judge(mesh: &PolygonMesh, features: &Features, base: &Base) -> Result<(), String> {
    let (input, _) = TriangleMesh::from_polygons(mesh);
    judge_surface(&input, base)?;
    judge_triangulation(&input, base)?;
    let corners: BTreeSet<u32> = base.vertices.iter().copied().collect();
    check(corners.len() == base.vertices.len(), "base vertices are distinct")?;
    let mut inner = BTreeSet::new();
    for edge in &base.edges {
        let (first, last) = (edge.path[0], edge.path[edge.path.len() - 1]);
        check([first, last] == edge.ends.map(|v| base.vertices[v as usize]), "a path joins its ends")?;
        for v in &edge.path[1..edge.path.len() - 1] {
            check(inner.insert(*v) && !corners.contains(v), "paths do not touch")?;
        }
    }
    judge_regions(base)?;
    judge_features(&input, features, base, &inner)
}

/// The cut surface is the input, divided.
fn judge_surface(input: &TriangleMesh, base: &Base) -> Result<(), String> {
    check(
        base.surface.positions[..input.positions.len()] == input.positions[..],
        "input vertices stay where they are",
    )?;
    let area = |mesh: &TriangleMesh, t: usize| mesh.area_normal(t).length() / 2.0;
    let mut of_source = vec![0.0; input.triangles.len()];
    for (t, &source) in base.source.iter().enumerate() {
        of_source[source as usize] += area(&base.surface, t);
    }
    let largest = (0..input.triangles.len()).map(|t| area(input, t)).fold(0.0, f64::max);
    for (t, sum) in of_source.iter().enumerate() {
        check((sum - area(input, t)).abs() < 1e-6 * largest, "the pieces of an input triangle fill it")?;
    }
    Ok(())
}

/// A simplicial complex with the topology of the input.
fn judge_triangulation(input: &TriangleMesh, base: &Base) -> Result<(), String> {
    let points = base.vertices.iter().map(|&v| base.surface.positions[v as usize]).collect();
    let coarse = PolygonMesh::from_polygons(points, &base.triangles).map_err(|error| error.to_string())?;
    let input = input.to_polygons();
    check(oracle::euler(&coarse) == oracle::euler(&input), "Euler characteristic")?;
    check(oracle::components(&coarse) == oracle::components(&input), "components")?;
    let closed = oracle::closed_manifold(&input).is_ok();
    check(closed == oracle::closed_manifold(&coarse).is_ok(), "closed")?;
    let distinct: BTreeSet<BTreeSet<u32>> = base.triangles.iter().map(|t| t.iter().copied().collect()).collect();
    check(distinct.iter().all(|t| t.len() == 3), "three distinct corners")?;
    check(distinct.len() == base.triangles.len(), "no two triangles with the same corners")?;
    let ends: BTreeSet<[u32; 2]> = base.edges.iter().map(|edge| sorted(edge.ends[0], edge.ends[1])).collect();
    check(ends.len() == base.edges.len(), "no two edges with the same ends")
}

/// Every base triangle is a disk whose rim is its three sides, and no chord joins two points of a side.
fn judge_regions(base: &Base) -> Result<(), String> {
    let mut owned = vec![Vec::new(); base.triangles.len()];
    for (t, &owner) in base.owner.iter().enumerate() {
        owned[owner as usize].push(base.surface.triangles[t]);
    }
    for (t, triangles) in owned.iter().enumerate() {
        let mut number = BTreeMap::new();
        let mut points = Vec::new();
        let mut local = |v: u32| {
            *number.entry(v).or_insert_with(|| {
                points.push(base.surface.positions[v as usize]);
                points.len() as u32 - 1
            })
        };
        let faces: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(&mut local)).collect();
        let region = PolygonMesh::from_polygons(points, faces).map_err(|e| e.to_string())?;
        check(oracle::euler(&region) == 1 && oracle::components(&region) == 1, "a base triangle is a disk")?;
        let half_edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut rim = BTreeSet::new();
        for [a, b] in half_edges() {
            if !rim.remove(&[b, a]) {
                rim.insert([a, b]);
            }
        }
        let mut sides = BTreeSet::new();
        for k in 0..3 {
            let [a, b] = [base.triangles[t][k], base.triangles[t][(k + 1) % 3]];
            let edge = &base.edges[base.triangle_edges[t][k] as usize];
            check(edge.ends == [a, b] || edge.ends == [b, a], "edge k joins corners k and k + 1")?;
            let forward = edge.ends == [a, b];
            sides.extend(edge.path.windows(2).map(|p| if forward { [p[0], p[1]] } else { [p[1], p[0]] }));
            let side: BTreeSet<u32> = edge.path.iter().copied().collect();
            let along: BTreeSet<[u32; 2]> = edge.path.windows(2).map(|p| sorted(p[0], p[1])).collect();
            for [p, q] in half_edges() {
                let chord = side.contains(&p) && side.contains(&q) && !along.contains(&sorted(p, q));
                check(!chord, "no chord between two points of a side")?;
            }
        }
        check(rim == sides, "the rim of a base triangle is its sides")?;
    }
    Ok(())
}

/// Marked and border edges lie on base edges, marked vertices are base vertices.
fn judge_features(input: &TriangleMesh, features: &Features, base: &Base, inner: &BTreeSet<u32>) -> Result<(), String> {
    let at = |v: u32| base.surface.positions[v as usize];
    let mut marked: BTreeSet<[u32; 2]> = features.edges.iter().map(|&[a, b]| sorted(a, b)).collect();
    let mut sides = BTreeMap::<[u32; 2], u32>::new();
    for &[a, b, c] in &input.triangles {
        for &[a, b] in &[[a, b], [b, c], [c, a]] {
            *sides.entry(sorted(a, b)).or_default() += 1;
        }
    }
    marked.extend(sides.into_iter().filter(|&(_, count)| count == 1).map(|(edge, _)| edge));
    let corners: BTreeSet<u32> = base.vertices.iter().copied().collect();
    let (mut covered, mut neighbours) = (0.0, BTreeMap::<u32, Vec<u32>>::new());
    for pair in base.edges.iter().filter(|edge| edge.feature.is_some()).flat_map(|edge| edge.path.windows(2)) {
        covered += at(pair[0]).distance(at(pair[1]));
        neighbours.entry(pair[0]).or_default().push(pair[1]);
        neighbours.entry(pair[1]).or_default().push(pair[0]);
    }
    let wanted: f64 = marked.iter().map(|&[a, b]| at(a).distance(at(b))).sum();
    check((covered - wanted).abs() <= 1e-9 * wanted, "features are as long as they were")?;
    for &[a, b] in &marked {
        // From a towards b over vertices that are new, each with one way on.
        let reaches = neighbours.get(&a).into_iter().flatten().any(|&first| {
            let (mut before, mut here) = (a, first);
            while here as usize >= input.positions.len() {
                let on = neighbours[&here].iter().copied().find(|&v| v != before);
                (before, here) = (here, on.unwrap_or(a));
            }
            here == b
        });
        check(reaches, "a marked edge is a path of base edges")?;
        check([a, b].iter().all(|v| inner.contains(v) || corners.contains(v)), "marked vertices lie on base edges")?;
    }
    check(features.vertices.iter().all(|v| corners.contains(v)), "marked vertices are base vertices")
}

#[track_caller]
fn accept(mesh: &PolygonMesh, features: &Features, vertices: u32) -> Built {
    let built = built(mesh, features, vertices);
    assert_eq!(judge(mesh, features, &built.base), Ok(()));
    built
}

/// A fixture with the sharp edges that ship with it.
fn fixture(name: &str) -> (PolygonMesh, Features) {
    let path = format!("{}/../../blend_fixtures/meshes/{name}.edges40", env!("CARGO_MANIFEST_DIR"));
    let numbers = |line: &str| line.split_whitespace().map(|w| w.parse().unwrap()).collect::<Vec<u32>>();
    let text = std::fs::read_to_string(path).unwrap();
    let edges = text.lines().skip(1).map(|line| numbers(line).try_into().unwrap()).collect();
    (testkit::fixture(name), Features { edges, vertices: vec![] })
}

#[test]
fn real_meshes_with_and_without_features() {
    for name in ["tri/plate_holes", "tri/mirror", "tri/fish_low_tri", "tri/vault_tri"] {
        let (mesh, features) = fixture(name);
        for features in [Features::default(), features] {
            let built = built(&mesh, &features, 80);
            assert_eq!(judge(&mesh, &features, &built.base), Ok(()), "{name}");
        }
    }
}

#[test]
fn surfaces_without_features_get_sites_of_their_own() {
    for (mesh, vertices) in [(shapes::sphere(12), 30), (shapes::torus(2.0, 0.6, 40, 16), 60), (shapes::sphere(1), 4)] {
        let built = accept(&mesh, &Features::default(), vertices);
        assert!(!built.report.sites.is_empty());
        assert_eq!(built.report.sites.len() + built.report.inserted.len(), built.base.vertices.len());
    }
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    accept(&PolygonMesh::from_polygons(positions, tetrahedron).unwrap(), &Features::default(), 4);
}

#[test]
fn a_cube_with_its_edges_marked_has_its_corners() {
    let mesh = shapes::cuboid(DVec3::new(1.0, 2.0, 0.7), 6);
    let built = accept(&mesh, &sharp(&mesh), 30);
    assert_eq!((built.report.curves, built.report.corners), (12, 8));
}

#[test]
fn fingers_get_sites_on_their_tips() {
    // Spheres pulled out into fingers along x, thinner than a base edge, of many lengths.
    let sphere = shapes::sphere(40);
    let mut bulges = 0;
    for length in 1..8 {
        let pull = |p: &DVec3| {
            if p.x > 0.97 { DVec3::new(p.x + f64::from(10 * length) * (p.x - 0.97), p.y, p.z) } else { *p }
        };
        let mesh = sphere.with_positions(sphere.positions.iter().map(pull).collect());
        bulges += accept(&mesh, &Features::default(), 24).report.bulges;
    }
    assert!(bulges > 0);
}

#[test]
fn genus_11_with_marked_edges_and_vertices() {
    let holes: BTreeSet<(i32, i32)> = (0..12).filter(|k| *k != 7).map(|k| (2 * (k % 4) + 1, 2 * (k / 4) + 1)).collect();
    let mesh = punched_block(9, 7, &holes, 2);
    assert_eq!(oracle::euler(&mesh), 2 - 2 * 11);
    accept(&mesh, &Features::default(), 60);
    let mut features = sharp(&mesh);
    let marked: BTreeSet<u32> = features.edges.iter().flatten().copied().collect();
    features.vertices = (0..mesh.vertex_count() as u32).filter(|v| !marked.contains(v)).step_by(40).collect();
    accept(&mesh, &features, 60);
}

#[test]
fn size_and_place_do_not_matter() {
    let mesh = shapes::torus(2.0, 0.6, 30, 14);
    let triangles = built(&mesh, &Features::default(), 50).base.triangles;
    for (scale, shift) in [(2_f64.powi(-40), 0.0), (2_f64.powi(60), 0.0), (1e-150, 0.0), (1e150, 0.0), (1.0, 1e7)] {
        let moved = mesh.with_positions(mesh.positions.iter().map(|&p| p * scale + DVec3::splat(shift)).collect());
        let base = built(&moved, &Features::default(), 50).base;
        // A power of two changes no digit.
        let exact = shift == 0.0 && (scale == 2_f64.powi(-40) || scale == 2_f64.powi(60));
        assert!(!exact || base.triangles == triangles, "{scale}");
        assert_eq!(judge_triangulation(&TriangleMesh::from_polygons(&moved).0, &base), Ok(()));
    }
}

#[test]
fn triangles_without_area_are_no_obstacle() {
    let mesh = shapes::triangulated(&shapes::sphere(8));
    let mut positions = mesh.positions.clone();
    let mut faces: Vec<Vec<u32>> = mesh.faces().map(<[u32]>::to_vec).collect();
    // A vertex in the middle of an edge of one triangle only, and one on top of another.
    let (a, b, c) = (faces[10][0], faces[10][1], faces[10][2]);
    let m = positions.len() as u32;
    positions.push(positions[a as usize].midpoint(positions[b as usize]));
    faces[10] = vec![a, m, c];
    faces.extend([vec![m, b, c], vec![a, b, m]]);
    positions[faces[60][0] as usize] = positions[faces[60][1] as usize];
    let mesh = PolygonMesh::from_polygons(positions, faces).unwrap();
    assert_eq!(oracle::closed_manifold(&mesh), Ok(()));
    accept(&mesh, &Features::default(), 40);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (mesh, features) = fixture("tri/fish_low_tri");
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let base = pool.install(|| built(&mesh, &features, 60)).base;
        (base.surface, base.owner, base.edges)
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_cancelled_run_stops() {
    let monitor = Monitor::new();
    monitor.cancel();
    let (mesh, _) = TriangleMesh::from_polygons(&shapes::sphere(4));
    let result = build_base(&mesh, &Features::default(), &BaseOptions::default(), &monitor);
    assert!(matches!(result, Err(RetopologyError::Cancelled(_))));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_shapes(
        seed in any::<u64>(),
        kind in 0..5_u32,
        n in 1..4_i32,
        vertices in 4..90_u32,
        marks in 0..3_u32,
        rough in 0.0..0.25,
    ) {
        let (mesh, features) = marked_shape(kind, n, marks, rough, &mut Random::new(seed));
        let base = built(&mesh, &features, vertices).base;
        prop_assert_eq!(judge(&mesh, &features, &base), Ok(()));
    }
}

#[test]
fn edits_keep_every_promise_and_touch_little() {
    let mesh = shapes::triangulated(&shapes::torus(2.0, 0.7, 60, 30));
    let (triangles, _) = TriangleMesh::from_polygons(&mesh);
    let at = |i: u32, j: u32| (i % 60) * 30 + j % 30;
    let path = |i: u32, j: u32, n: u32| -> Features {
        Features { edges: (0..n).map(|k| [at(i + k, j), at(i + k + 1, j)]).collect(), vertices: vec![] }
    };
    let options = BaseOptions { vertices: 200, ..BaseOptions::default() };
    let start = Features { vertices: vec![at(40, 3)], ..path(10, 5, 8) };
    let mut session = Session::new(triangles.clone(), start, options, &Monitor::new()).unwrap();
    let monitor = Monitor::new();
    let whole = session.base().triangles.len();
    let judged = |session: &Session| assert_eq!(judge(&mesh, session.features(), session.base()), Ok(()));
    let mut local = 0;
    let mut note = |report: EditReport| {
        local += usize::from(!report.whole);
        assert!(report.whole || report.removed < whole / 2, "{report:?} of {whole}");
    };
    note(session.add_feature(&path(30, 20, 6), &monitor).unwrap());
    judged(&session);
    // Longer, so that it goes on from where it was.
    note(session.add_feature(&path(36, 20, 4), &monitor).unwrap());
    judged(&session);
    note(session.move_feature(&path(10, 5, 8), &path(11, 9, 8), &monitor).unwrap());
    judged(&session);
    let point = |v: u32| Features { edges: vec![], vertices: vec![v] };
    note(session.move_feature(&point(at(40, 3)), &point(at(42, 4)), &monitor).unwrap());
    judged(&session);
    note(session.remove_feature(&path(30, 20, 10), &monitor).unwrap());
    judged(&session);
    assert!(local >= 4, "{local} of 5 edits were local");
    let refused = session.remove_feature(&path(0, 0, 2), &monitor).unwrap_err();
    assert_eq!(refused, RetopologyError::FeatureOffSurface { features: vec![0, 1] });
    assert!(matches!(session.add_feature(&point(9999), &monitor), Err(RetopologyError::VertexOffSurface { .. })));
    judged(&session);
}
