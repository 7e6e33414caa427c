//! Polyhedra by Conway's operators, tiled (section 5.1, Fig. 14, Table 2).

use mesh::{DVec3, Monitor, PolygonMesh};
use std::collections::BTreeMap;
use testkit::oracle;
use tiling::{Kind, Patch, PolygonsError, PolyhedronOptions, PolyhedronTiling, SurfaceError, tile_polyhedron};

/// A solid, its faces counter-clockwise from outside.
fn solid(positions: &[[f64; 3]], faces: &[&[u32]]) -> PolygonMesh {
    PolygonMesh::from_polygons(positions.iter().map(|p| DVec3::from_array(*p)).collect(), faces).expect("a solid")
}

fn tetrahedron() -> PolygonMesh {
    let positions = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    solid(&positions, &[&[0, 1, 2], &[0, 2, 3], &[0, 3, 1], &[1, 3, 2]])
}

fn dodecahedron() -> PolygonMesh {
    // The dual of the icosahedron: its faces about each vertex.
    let g = f64::midpoint(1.0, 5f64.sqrt());
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        vertices.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let mut centres = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [p, q, r] = [vertices[i], vertices[j], vertices[k]];
                if [p.distance(q), q.distance(r), r.distance(p)].iter().all(|d| (d - 2.0).abs() < 1e-9) {
                    centres.push(((p + q + r) / 3.0, [i, j, k]));
                }
            }
        }
    }
    let faces: Vec<Vec<u32>> = (0..12)
        .map(|v| {
            let up = vertices[v].normalize();
            let (x, y) = up.any_orthonormal_pair();
            let mut around: Vec<u32> = (0..20).filter(|&c| centres[c as usize].1.contains(&v)).collect();
            let angle = |c: u32| {
                let d = centres[c as usize].0;
                d.dot(y).atan2(d.dot(x))
            };
            around.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
            around
        })
        .collect();
    PolygonMesh::from_polygons(centres.into_iter().map(|c| c.0).collect(), &faces).expect("a dodecahedron")
}

/// The faces around each vertex, counter-clockwise, as the vertices that each face leads to.
fn around(mesh: &PolygonMesh) -> Vec<Vec<u32>> {
    let mut next: Vec<BTreeMap<u32, u32>> = vec![BTreeMap::new(); mesh.vertex_count()];
    for face in mesh.faces() {
        let n = face.len();
        for k in 0..n {
            // A face leaves a vertex to one neighbour and arrives from the next one counter-clockwise.
            next[face[k] as usize].insert(face[(k + 1) % n], face[(k + n - 1) % n]);
        }
    }
    next.into_iter()
        .map(|next| {
            let start = *next.keys().next().expect("every vertex has faces");
            let mut ring = vec![start];
            while let Some(&v) = next.get(&ring[ring.len() - 1]).filter(|&&v| v != start) {
                ring.push(v);
            }
            ring
        })
        .collect()
}

/// A vertex on each edge at a fraction from each of its ends; at one half, one vertex.
fn on_edges(mesh: &PolygonMesh, fraction: f64) -> (Vec<DVec3>, BTreeMap<[u32; 2], u32>) {
    let (mut positions, mut at) = (Vec::new(), BTreeMap::new());
    for (a, ring) in (0..).zip(around(mesh)) {
        for b in ring {
            if fraction < 0.5 || a < b {
                let [p, q] = [a, b].map(|v: u32| mesh.positions[v as usize]);
                at.insert([a, b], positions.len() as u32);
                if fraction >= 0.5 {
                    at.insert([b, a], positions.len() as u32);
                }
                positions.push(p.lerp(q, fraction));
            }
        }
    }
    (positions, at)
}

/// Conway's truncation t and ambo a: vertices are cut off at a fraction of the edges.
fn cut_off(mesh: &PolygonMesh, fraction: f64) -> PolygonMesh {
    let (positions, at) = on_edges(mesh, fraction);
    let mut faces: Vec<Vec<u32>> =
        (0..).zip(around(mesh)).map(|(a, ring)| ring.iter().map(|&b| at[&[a, b]]).collect()).collect();
    for face in mesh.faces() {
        let mut corners = Vec::new();
        for k in 0..face.len() {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            corners.push(at[&[a, b]]);
            if fraction < 0.5 {
                corners.push(at[&[b, a]]);
            }
        }
        faces.push(corners);
    }
    PolygonMesh::from_polygons(positions, &faces).expect("a polyhedron")
}

fn truncated(mesh: &PolygonMesh) -> PolygonMesh {
    cut_off(mesh, 1.0 / 3.0)
}

/// The polyhedron with its faces as regular as they get, edges of about 1: each vertex goes to the mean of where the
/// regular polygons nearest to its faces would have it, again and again.
fn relaxed(mesh: &PolygonMesh) -> PolygonMesh {
    let mut mesh = mesh.clone();
    for _ in 0..2000 {
        let mut sum = vec![(DVec3::ZERO, 0.0); mesh.vertex_count()];
        for f in 0..mesh.face_count() {
            let points: Vec<DVec3> = mesh.face_points(f).collect();
            let n = points.len() as f64;
            let centre = points.iter().sum::<DVec3>() / n;
            let (x, y) = mesh::face_normal(&points).any_orthonormal_pair();
            let turn = |k: usize| std::f64::consts::TAU * k as f64 / n;
            let (mut along, mut across) = (0.0, 0.0);
            for (k, p) in points.iter().enumerate() {
                let (a, b) = ((*p - centre).dot(x), (*p - centre).dot(y));
                along += a * turn(k).cos() + b * turn(k).sin();
                across += b * turn(k).cos() - a * turn(k).sin();
            }
            let start = across.atan2(along);
            let radius = 0.5 / (std::f64::consts::PI / n).sin();
            for (k, &v) in mesh.face(f).iter().enumerate() {
                let angle = start + turn(k);
                sum[v as usize].0 += centre + radius * (angle.cos() * x + angle.sin() * y);
                sum[v as usize].1 += 1.0;
            }
        }
        mesh.positions = sum.into_iter().map(|(p, n)| p / n).collect();
    }
    mesh
}

fn ambo(mesh: &PolygonMesh) -> PolygonMesh {
    cut_off(mesh, 0.5)
}

/// The mean length of the edges between faces of so many corners.
fn edge_between(mesh: &PolygonMesh, sizes: [usize; 2]) -> f64 {
    let mut of: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            of.entry(mesh::sorted(face[k], face[(k + 1) % face.len()])).or_default().push(face.len());
        }
    }
    let lengths: Vec<f64> = of
        .iter()
        .filter(|(_, n)| **n == [sizes[0], sizes[1]] || **n == [sizes[1], sizes[0]])
        .map(|(e, _)| mesh.positions[e[0] as usize].distance(mesh.positions[e[1] as usize]))
        .collect();
    lengths.iter().sum::<f64>() / lengths.len() as f64
}

fn tiled(mesh: &PolygonMesh, edge_length: f64) -> PolyhedronTiling {
    tile_polyhedron(mesh, Some(edge_length), &PolyhedronOptions::default(), &Monitor::new()).expect("a polyhedron")
}

fn counts(result: &PolyhedronTiling) -> [usize; 2] {
    [Kind::Triangle, Kind::Square].map(|kind| result.panels.iter().filter(|panel| panel.kind == kind).count())
}

fn assert_sphere(result: &PolyhedronTiling) {
    assert!(oracle::closed_manifold(&result.mesh).is_ok());
    assert_eq!(oracle::euler(&result.mesh), 2);
    assert_eq!(result.defects.iter().map(|d| d.1).sum::<i32>(), 24);
    let graph = &result.patch_graph;
    let of_patches: i32 = graph.patches.iter().map(Patch::total_interior_defect).sum();
    assert_eq!(graph.node_defects().iter().sum::<i32>() + of_patches, 24);
}

/// The greatest departure of an edge from the mean, and of a quad's diagonals from sqrt 2, in edges.
fn irregularity(mesh: &PolygonMesh) -> f64 {
    let lengths: Vec<f64> = mesh
        .faces()
        .flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]]))
        .map(|e| mesh.positions[e[0] as usize].distance(mesh.positions[e[1] as usize]))
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let edges = lengths.iter().map(|l| (l / mean - 1.0).abs());
    let diagonals =
        mesh.faces().filter(|f| f.len() == 4).flat_map(|f| [[f[0], f[2]], [f[1], f[3]]]).map(|d| {
            (mesh.positions[d[0] as usize].distance(mesh.positions[d[1] as usize]) / mean - 2f64.sqrt()).abs()
        });
    edges.chain(diagonals).fold(0.0, f64::max)
}

#[test]
fn tat_t_has_the_papers_38_patches_144_triangles_and_42_squares() {
    // Table 2 prints these numbers in the row of b3D, and those of b3D in the row of tatT.
    let polyhedron = relaxed(&truncated(&ambo(&truncated(&tetrahedron()))));
    assert_eq!(polyhedron.faces().filter(|f| f.len() == 12).count(), 4);
    let result = tiled(&polyhedron, 1.0);
    assert_eq!(result.patch_graph.patches.len(), 38);
    assert_eq!(result.patch_graph.sides.len(), 108);
    assert_sphere(&result);
    if let Ok(folder) = std::env::var("POLYHEDRA_OUT") {
        std::fs::write(format!("{folder}/tatT.obj"), testkit::obj::write(&result.mesh)).expect("a folder");
    }
    assert_eq!(counts(&result), [144, 42]);
    assert_eq!(result.defects.len(), 24);
    assert!(result.patches_with_rhombi.is_empty());
}

#[test]
fn b3d_has_62_patches_and_becomes_regular() {
    // The dodecahedron's bevel, b = t a. Edges between hexagons and squares are twice as long as the others.
    let mut polyhedron = truncated(&ambo(&dodecahedron()));
    assert_eq!(polyhedron.faces().filter(|f| f.len() == 10).count(), 12);
    stretch(&mut polyhedron);
    let result = tiled(&polyhedron, edge_between(&polyhedron, [4, 10]));
    if let Ok(folder) = std::env::var("POLYHEDRA_OUT") {
        std::fs::write(format!("{folder}/b3D.obj"), testkit::obj::write(&result.mesh)).expect("a folder");
    }
    assert_eq!(result.patch_graph.patches.len(), 62);
    assert_eq!(result.patch_graph.sides.len(), 180);
    assert_sphere(&result);
    assert_eq!(counts(&result), [380, 120]);
    let irregularity = irregularity(&result.mesh);
    assert!(irregularity < 1e-6, "off by {irregularity} edges");
    assert!(result.is_regular());
}

/// Moves the vertices of the bevelled dodecahedron in their faces' planes until squares are 1 by 2.
fn stretch(mesh: &mut PolygonMesh) {
    // By shaping: every edge to its length, a few thousand times.
    let mut sizes: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            *sizes.entry(mesh::sorted(face[k], face[(k + 1) % face.len()])).or_default() += face.len();
        }
    }
    let radius = mesh.positions[0].length();
    for _ in 0..4000 {
        for (&[a, b], &size) in &sizes {
            let wanted = radius * if size == 10 { 0.4 } else { 0.2 };
            let (p, q) = (mesh.positions[a as usize], mesh.positions[b as usize]);
            let change = 0.5 * (1.0 - wanted / p.distance(q)) * (q - p);
            mesh.positions[a as usize] += 0.5 * change;
            mesh.positions[b as usize] -= 0.5 * change;
        }
    }
}

#[test]
fn a_face_without_c_indices_is_named() {
    // Two corners of 60 degrees and one of 60 are a triangle; a face of two corners cannot be one, nor does it exist. A
    // triangle mesh always works; no edge length does not.
    let error =
        tile_polyhedron(&tetrahedron(), Some(0.0), &PolyhedronOptions::default(), &Monitor::new()).expect_err("zero");
    assert!(matches!(error, PolygonsError::Surface(SurfaceError::EdgeLength { .. })));
}

#[test]
fn the_platonic_tetrahedron_is_regular_at_once() {
    let result = tiled(&tetrahedron(), 8f64.sqrt() / 3.0);
    assert_sphere(&result);
    assert_eq!(counts(&result), [36, 0]);
    assert!(irregularity(&result.mesh) < 1e-3);
}
