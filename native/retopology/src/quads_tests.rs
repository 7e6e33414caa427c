//! What must hold whatever the base: topology, features, validity, counts; with oracles of their own.

use super::*;
use crate::test_bases::{all, base, fan, frame, octahedron};
use mesh::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use testkit::{oracle, shapes};

fn make(base: &Base, options: &LayoutOptions) -> Quads {
    quads_from_base(base, options, &Monitor::new()).expect("a sound base")
}

fn faces(number: usize) -> LayoutOptions {
    LayoutOptions { size: Size::TargetFaces(number), ..LayoutOptions::default() }
}

/// Edges with one face, from counting.
fn borders(mesh: &PolygonMesh) -> BTreeSet<[u32; 2]> {
    let mut count = BTreeMap::<[u32; 2], usize>::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            *count.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    assert!(count.values().all(|&n| n <= 2));
    count.into_iter().filter(|(_, n)| *n == 1).map(|(edge, _)| edge).collect()
}

fn check(name: &str, base: &Base, quads: &Quads) {
    let mesh = &quads.mesh;
    assert!(mesh.is_pure_quad(), "{name}");
    let surface = base.surface.to_polygons();
    assert_eq!(oracle::euler(mesh), oracle::euler(&surface), "{name}");
    assert_eq!(oracle::components(mesh), oracle::components(&surface), "{name}");
    let open = borders(mesh);
    if borders(&surface).is_empty() {
        assert_eq!(oracle::closed_manifold(mesh), Ok(()), "{name}");
    }
    for f in 0..mesh.face_count() {
        let p: Vec<DVec3> = mesh.face_points(f).collect();
        assert!(mesh::scaled_jacobian([p[0], p[1], p[2], p[3]]) > 0.0, "{name}: quad {f} is inverted");
    }
    // Each rail is a chain from one end to the other, on the rail.
    let sides: BTreeSet<[u32; 2]> = mesh
        .faces()
        .flat_map(|face| (0..4).map(|k| [face[k], face[(k + 1) % 4]]).collect::<Vec<_>>())
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let mut used = vec![0; base.edges.len()];
    base.triangle_edges.iter().flatten().for_each(|&e| used[e as usize] += 1);
    for (e, edge) in base.edges.iter().enumerate().filter(|(e, edge)| edge.feature.is_some() || used[*e] == 1) {
        let chain: Vec<_> = quads.feature_edges.iter().filter(|f| f.base_edge == e as u32).collect();
        assert_eq!(chain.len(), quads.report.counts[e] as usize, "{name}: edge {e}");
        assert_eq!(quads.base_vertex[chain[0].ends[0] as usize], edge.ends[0]);
        assert_eq!(quads.base_vertex[chain[chain.len() - 1].ends[1] as usize], edge.ends[1]);
        assert!(chain.windows(2).all(|w| w[0].ends[1] == w[1].ends[0]));
        for link in chain {
            let [a, b] = link.ends;
            assert!(sides.contains(&[a.min(b), a.max(b)]), "{name}: feature edge {a} {b} is no edge");
            assert_eq!(open.contains(&[a.min(b), a.max(b)]), used[e] == 1);
        }
    }
    let border_edges = quads.feature_edges.iter().filter(|f| used[f.base_edge as usize] == 1).count();
    assert_eq!(open.len(), border_edges, "{name}");
    // The source of each vertex is under it.
    for (v, source) in quads.source.iter().enumerate() {
        let p = base.surface.points(source.surface_triangle as usize);
        let at: DVec3 = p.iter().zip(source.barycentric).map(|(&p, w)| p * w).sum();
        assert!(at.distance(mesh.positions[v]) < 1e-6 * mesh.diagonal(), "{name}: vertex {v}");
        assert_eq!(source.triangle, base.source[source.surface_triangle as usize]);
    }
}

#[test]
fn quads_have_the_surfaces_topology_and_its_features() {
    for (name, base) in all() {
        for pairing in [Pairing::PAPER, Pairing::Programme { most_triangles: 2 }, Pairing::default()] {
            for irregularity in [20.0, f64::INFINITY] {
                let options = LayoutOptions { pairing, irregularity, ..faces(600) };
                let quads = make(&base, &options);
                check(name, &base, &quads);
                assert_eq!(quads.report.inverted, 0, "{name}");
            }
        }
    }
}

#[test]
fn a_traced_layout_keeps_the_promises_with_fewer_irregular_vertices() {
    let mut traced = 0;
    let pairings = [Pairing::PAPER, Pairing::Programme { most_triangles: 2 }, Pairing::default()];
    let mut bases: Vec<_> = all().into_iter().map(|(name, base)| (name, base, 600)).collect();
    bases.push(("fan", base(&fan(), 12, 4.0, &|p| p), 2000));
    for ((name, base, count), pairing) in
        bases.into_iter().flat_map(|base| pairings.map(|pairing| (base.clone(), pairing)))
    {
        let options = LayoutOptions { pairing, ..faces(count) };
        let quads = make(&base, &options);
        check(name, &base, &quads);
        let laid = make(&base, &LayoutOptions { improve: false, ..options.clone() });
        // Painted sizes are the base's.
        let density = vec![1.0; base.surface.positions.len()];
        let painted = make(&base, &LayoutOptions { density, ..options });
        assert!(!laid.report.traced && !painted.report.traced);
        if quads.report.traced {
            println!("{name}, {pairing:?}: {} instead of {}", quads.report.irregular, painted.report.irregular);
            traced += 1;
            assert!(quads.report.irregular < painted.report.irregular, "{name}");
            assert_eq!(quads.report.inverted, 0, "{name}");
        }
    }
    assert!(traced >= 3, "{traced}");
}

#[test]
fn corners_of_features_stay_where_they_are() {
    let base = base(&frame(1), 4, 0.5, &|p| p);
    let quads = make(&base, &faces(1000));
    let mut corners = 0;
    for (v, &at) in quads.base_vertex.iter().enumerate().filter(|(_, v)| **v != NONE) {
        let ends = base.edges.iter().filter(|e| e.feature.is_some() && e.ends.contains(&at)).count();
        if ends >= 3 {
            corners += 1;
            assert_eq!(quads.mesh.positions[v], base.surface.positions[base.vertices[at as usize] as usize]);
        }
    }
    assert_eq!(corners, 16);
}

#[test]
fn the_number_of_quads_is_what_was_asked() {
    let ball = base(&shapes::cuboid(DVec3::splat(2.0), 2), 10, 4.0, &DVec3::normalize);
    let frame = base(&frame(2), 6, 0.5, &|p| p);
    for target in [500, 2000, 10_000, 50_000] {
        for base in [&ball, &frame] {
            // The shape does not matter here.
            let quads = make(base, &LayoutOptions { rounds: 0, ..faces(target) });
            let found = quads.mesh.face_count() as f64 / target as f64;
            assert!((found - 1.0).abs() < 0.05, "{target}: {found}");
        }
    }
    let fine = make(&ball, &LayoutOptions { size: Size::EdgeLength(0.1), ..LayoutOptions::default() });
    let area = oracle::area(&fine.mesh);
    assert!((fine.mesh.face_count() as f64 * 0.01 / area - 1.0).abs() < 0.15);
}

#[test]
fn bent_features_get_the_edges_they_need() {
    // A round block: its rims turn by 90 degrees from base vertex to base vertex, and their length alone asks for 4 edges each.
    let round = |p: DVec3| {
        let (flat, square) = (p.x.hypot(p.y), p.x.abs().max(p.y.abs()));
        if flat > 0.0 { DVec3::new(p.x * square / flat, p.y * square / flat, p.z) } else { p }
    };
    let base = base(&shapes::cuboid(DVec3::splat(2.0), 1), 16, 0.5, &round);
    let quads = make(&base, &faces(150));
    let chains: Vec<Vec<[u32; 2]>> =
        base.edges.iter().map(|edge| edge.path.windows(2).map(|w| [w[0], w[1]]).collect()).collect();
    let followed = crate::fidelity::followed(&quads, &chains, &base.surface.positions, &Monitor::new()).unwrap();
    // Edges that are no features, the diagonals of the block's sides, have no chain that follows them.
    let features: Vec<usize> = (0..base.edges.len()).filter(|&e| base.edges[e].feature.is_some()).collect();
    let at = |v: u32| base.surface.positions[v as usize];
    let length: f64 = features.iter().flat_map(|&e| &chains[e]).map(|[a, b]| at(*a).distance(at(*b))).sum();
    assert!(followed.near > 0.99 * length, "{} of {length}", followed.near);
    for e in features.into_iter().filter(|&e| at(base.edges[e].path[0]).z == at(base.edges[e].path[8]).z) {
        assert!(quads.report.counts[e] >= 5, "{}", quads.report.counts[e]);
    }
}

#[test]
fn painted_sizes_are_kept() {
    // A long sheet whose one end wants edges a quarter as long.
    let base = base(&shapes::sheet(8, 2), 6, 4.0, &|p| p);
    let wanted = |x: f64| if x < 0.0 { 0.5 } else { 2.0 };
    let density: Vec<f64> = base.surface.positions.iter().map(|p| wanted(p.x)).collect();
    let quads = make(&base, &LayoutOptions { density, irregularity: 2.0, ..faces(2000) });
    let mean_area = |from: f64, to: f64| {
        let areas: Vec<f64> = (0..quads.mesh.face_count())
            .map(|f| quads.mesh.face_points(f).collect::<Vec<_>>())
            .filter(|p| p.iter().all(|p| (from..to).contains(&p.x)))
            .map(|p| (p[2] - p[0]).cross(p[3] - p[1]).length() / 2.0)
            .collect();
        areas.iter().sum::<f64>() / areas.len() as f64
    };
    let ratio = (mean_area(1.0, 4.1) / mean_area(-4.1, -1.0)).sqrt();
    assert!((3.0..5.0).contains(&ratio), "edges differ by {ratio}");
}

#[test]
fn threads_do_not_matter() {
    let base = base(&shapes::cylinder(1.0, 3.0, 2, 2), 5, 0.9, &|p| p);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut quads = pool.install(|| make(&base, &faces(800)));
        quads.report.seconds.clear();
        quads
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn a_chosen_template_is_used() {
    let base = base(&octahedron(), 8, 4.0, &DVec3::normalize);
    let choice = |name: &str| BTreeMap::from([(0, TemplateChoice { template: name.into(), turn: 1 })]);
    for pairing in [Pairing::PAPER, Pairing::default()] {
        let with = |name| make(&base, &LayoutOptions { templates: choice(name), pairing, ..faces(600) });
        let (plain, knuckle) = (with("plain"), with("knuckle"));
        check("plain", &base, &plain);
        check("knuckle", &base, &knuckle);
        let valences = |quads: &Quads| {
            let mut valence = vec![0; quads.mesh.vertex_count()];
            quads.mesh.corner_verts().iter().for_each(|&v| valence[v as usize] += 1);
            valence.iter().filter(|n| **n == 5).count()
        };
        assert!(valences(&knuckle) >= valences(&plain) + 4);
    }
    let fails = |edge, name: &str| {
        let templates = BTreeMap::from([(edge, TemplateChoice { template: name.into(), turn: 0 })]);
        quads_from_base(&base, &LayoutOptions { templates, ..faces(600) }, &Monitor::new()).unwrap_err()
    };
    assert!(matches!(fails(0, "none"), LayoutError::Template(crate::TemplateError::Unknown { .. })));
    assert!(matches!(fails(99, "plain"), LayoutError::Template(crate::TemplateError::NoPair { edge: 99 })));
}

#[test]
fn bad_input_is_refused() {
    let good = base(&octahedron(), 3, 4.0, &DVec3::normalize);
    let fails = |base: &Base, options: &LayoutOptions| quads_from_base(base, options, &Monitor::new()).unwrap_err();
    let spoil = |change: &dyn Fn(&mut Base)| {
        let mut base = good.clone();
        change(&mut base);
        fails(&base, &faces(100))
    };
    for error in [
        spoil(&|b| b.owner[0] = 99),
        spoil(&|b| b.triangles[1][0] = 99),
        spoil(&|b| b.vertices[0] = 9999),
        spoil(&|b| b.edges[2].path[0] = 5),
        spoil(&|b| b.triangle_edges[0] = [0, 0, 0]),
        spoil(&|b| b.surface.triangles[0][0] = 9999),
        spoil(&|b| b.source.truncate(1)),
        spoil(&|b| *b = Base::default()),
    ] {
        assert!(matches!(error, LayoutError::BadBase { .. }), "{error}");
    }
    for options in [
        faces(0),
        LayoutOptions { size: Size::EdgeLength(-1.0), ..faces(1) },
        LayoutOptions { irregularity: f64::NAN, ..faces(9) },
        LayoutOptions { chord_error: 0.0, ..faces(9) },
        LayoutOptions { density: vec![0.0], ..faces(9) },
        LayoutOptions { pairing: Pairing::Programme { most_triangles: 9 }, ..faces(9) },
        LayoutOptions { pairing: Pairing::Matching { lambda: -1.0, mu: 0.5 }, ..faces(9) },
    ] {
        assert!(matches!(fails(&good, &options), LayoutError::BadOption { .. }));
    }
    let monitor = Monitor::new();
    monitor.cancel();
    assert!(matches!(quads_from_base(&good, &faces(100), &monitor), Err(LayoutError::Cancelled(_))));
}
