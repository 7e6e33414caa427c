//! The paper's partition on surfaces of all kinds: whatever is found is checked from outside, and must be found.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use testkit::{oracle, shapes};
use tiling::{BigUint, Fill, Kind, Partition, SurfaceOptions, SurfaceTiling, tile_surface};

/// A grid over the unit square, mapped into space; closed where its first and last columns, or rows, fall together.
fn grid(columns: u32, rows: u32, is_closed: [bool; 2], place: impl Fn(f64, f64) -> DVec3) -> PolygonMesh {
    let across = if is_closed[0] { columns } else { columns + 1 };
    let up = if is_closed[1] { rows } else { rows + 1 };
    let at = |i: u32, j: u32| (j % up) * across + i % across;
    let positions = (0..up)
        .flat_map(|j| (0..across).map(move |i| (i, j)))
        .map(|(i, j)| place(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)))
        .collect();
    let faces: Vec<[u32; 4]> = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    PolygonMesh::from_polygons(positions, &faces).expect("a grid")
}

/// A square tube that turns and narrows: four creases.
fn tower() -> PolygonMesh {
    grid(40, 40, [true, false], |u, v| {
        let (corner, along) = ((4.0 * u).floor(), (4.0 * u).fract());
        let at = |k: f64| DVec3::new((PI / 4.0 + PI / 2.0 * k).cos(), (PI / 4.0 + PI / 2.0 * k).sin(), 0.0);
        let flat = 2f64.sqrt() * (1.2 - 0.4 * v) * at(corner).lerp(at(corner + 1.0), along);
        let turn = 1.5 * v;
        DVec3::new(flat.x * turn.cos() - flat.y * turn.sin(), flat.x * turn.sin() + flat.y * turn.cos(), 5.0 * v)
    })
}

fn vault() -> PolygonMesh {
    grid(24, 16, [false, false], |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        DVec3::new(2.5 * x, 2.0 * y, 0.8 * (1.0 - x * x) * (1.0 + 0.3 * y * y))
    })
}

/// A flat frame: a square with a square hole.
fn frame() -> PolygonMesh {
    let mut mesh = grid(6, 6, [false, false], |u, v| DVec3::new(6.0 * u, 6.0 * v, 0.0));
    let faces: Vec<Vec<u32>> = mesh
        .faces()
        .filter(|face| {
            let middle = face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 4.0;
            (middle - DVec3::new(3.0, 3.0, 0.0)).abs().max_element() > 1.0
        })
        .map(<[u32]>::to_vec)
        .collect();
    // The vertex in the middle is used no more.
    let positions = std::mem::take(&mut mesh.positions);
    let used: BTreeSet<u32> = faces.iter().flatten().copied().collect();
    let place: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
    let faces: Vec<Vec<u32>> = faces.iter().map(|face| face.iter().map(|v| place[v]).collect()).collect();
    PolygonMesh::from_polygons(used.iter().map(|&v| positions[v as usize]).collect(), &faces).expect("a frame")
}

fn tiled(mesh: &PolygonMesh, panels: f64, fill: Fill) -> SurfaceTiling {
    let surface = TriangleMesh::from_polygons(mesh).0;
    let area: f64 = (0..surface.triangles.len()).map(|t| surface.area_normal(t).length() / 2.0).sum();
    let options = SurfaceOptions { partition: Partition::Paper, fill, ..SurfaceOptions::default() };
    tile_surface(&surface, (1.7 * area / panels).sqrt(), &options, &Monitor::new()).expect("a sound surface")
}

/// Interior vertices whose panels' angles do not sum to a full turn, over all interior vertices; and the sum of all defects.
fn irregular(mesh: &PolygonMesh) -> (f64, i64) {
    let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut angle = vec![0; mesh.vertex_count()];
    for face in mesh.faces() {
        for k in 0..face.len() {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
            angle[a as usize] += if face.len() == 3 { 2 } else { 3 };
        }
    }
    let rim: BTreeSet<u32> = uses.iter().filter(|(_, n)| **n == 1).flat_map(|(edge, _)| *edge).collect();
    let inner: Vec<u32> = (0..mesh.vertex_count() as u32).filter(|v| !rim.contains(v)).collect();
    let odd = inner.iter().filter(|&&v| angle[v as usize] != 12).count();
    let sum = (0..mesh.vertex_count() as u32)
        .map(|v| if rim.contains(&v) { 6 } else { 12 } - i64::from(angle[v as usize]))
        .sum();
    (odd as f64 / inner.len().max(1) as f64, sum)
}

fn assert_patches(name: &str, mesh: &PolygonMesh, result: &SurfaceTiling) {
    let graph = result.patch_graph.as_ref().unwrap_or_else(|| panic!("{name}: no partition was found"));
    assert!(graph.patches.iter().all(|patch| patch.total_interior_defect() == 0), "{name}: a patch is not flat");
    assert_eq!(graph.euler_characteristic(), oracle::euler(mesh), "{name}: Euler characteristic of the graph");
    for (k, side) in graph.sides.iter().enumerate() {
        for (end, point) in side.ends.iter().zip([side.points[0], side.points[side.points.len() - 1]]) {
            let off = graph.nodes[*end as usize].distance(point);
            assert!(off < 0.02 * result.edge_length, "{name}: side {k} ends {off} beside its node");
        }
    }
    assert_eq!(oracle::euler(&result.mesh), oracle::euler(mesh), "{name}: Euler characteristic");
    assert_eq!(oracle::components(&result.mesh), oracle::components(mesh), "{name}: components");
    let (share, sum) = irregular(&result.mesh);
    assert_eq!(sum, 12 * oracle::euler(mesh), "{name}: defects");
    assert!(share < 0.08, "{name}: {share} of the vertices are irregular");
    assert!(result.turned.is_empty(), "{name}: panels turned over");
    assert_eq!(result.tiling_counts.len(), graph.patches.len(), "{name}: counts");
    let none = result.tiling_counts.contains(&Some(BigUint::ZERO));
    assert!(!none, "{name}: a patch without a tiling was filled");
}

#[test]
fn a_torus_is_divided() {
    let mesh = shapes::torus(2.0, 0.7, 48, 20);
    assert_patches("torus", &mesh, &tiled(&mesh, 400.0, Fill::Regular));
}

#[test]
fn a_tower_with_creases_is_divided() {
    let mesh = tower();
    assert_patches("tower", &mesh, &tiled(&mesh, 400.0, Fill::Regular));
}

#[test]
fn a_vault_and_a_frame_are_divided() {
    for (name, mesh) in [("vault", vault()), ("frame", frame())] {
        assert_patches(name, &mesh, &tiled(&mesh, 300.0, Fill::Regular));
    }
}

#[test]
fn a_sphere_is_divided_at_few_panels() {
    let mesh = shapes::sphere(12);
    assert_patches("sphere", &mesh, &tiled(&mesh, 300.0, Fill::Regular));
}

/// Squares along the straight lines of a saddle cannot be flattened: where there are few of them, and large, other lattices are taken.
#[test]
fn a_saddle_of_few_panels_has_flat_quads() {
    let mesh = grid(24, 24, [false, false], |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        DVec3::new(x, y, 0.6 * (x * x - y * y))
    });
    let result = tiled(&mesh, 300.0, Fill::Regular);
    assert_patches("saddle", &mesh, &result);
    let bent = bent(&result.mesh);
    assert!(bent < 0.02, "quads are bent by {bent} in the mean");
}

/// Quads bent by more than 2% are flattened more, unless the caller gives the weights.
#[test]
fn squares_of_a_wavy_roof_are_flattened() {
    let mesh =
        grid(40, 30, [false, false], |u, v| DVec3::new(4.0 * u, 3.0 * v, 0.3 * (6.0 * u).sin() * (5.0 * v).cos()));
    let result = tiled(&mesh, 300.0, Fill::Regular);
    assert_patches("roof", &mesh, &result);
    let mut options = SurfaceOptions { partition: Partition::Paper, ..SurfaceOptions::default() };
    options.shape.planarity *= 1.001;
    let surface = TriangleMesh::from_polygons(&mesh).0;
    let asked = tile_surface(&surface, result.edge_length, &options, &Monitor::new()).expect("a sound surface");
    let [flattened, as_asked] = [&result, &asked].map(|tiling| bent(&tiling.mesh));
    assert!(as_asked > 0.02, "the weights asked for are enough: {as_asked}");
    assert!(flattened < 0.9 * as_asked, "quads are bent by {flattened} instead of {as_asked} in the mean");
}

/// Mean distance between the diagonals of quads, over the diagonals' mean length.
fn bent(mesh: &PolygonMesh) -> f64 {
    let bent: Vec<f64> = mesh
        .faces()
        .filter(|face| face.len() == 4)
        .map(|face| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| mesh.positions[face[k] as usize]);
            let normal = (c - a).cross(d - b).normalize();
            2.0 * (b - a).dot(normal).abs() / (a.distance(c) + b.distance(d))
        })
        .collect();
    bent.iter().sum::<f64>() / bent.len().max(1) as f64
}

/// Squares that would be of squares alone get rows of triangles between them, other ones for another seed.
#[test]
fn patches_of_both_tiles_have_both_and_differ_by_seed() {
    let mesh = grid(12, 8, [false, false], |u, v| DVec3::new(6.0 * u, 4.0 * v, 0.0));
    let regular = tiled(&mesh, 200.0, Fill::Regular);
    let count = |result: &SurfaceTiling, kind: Kind| result.panels.iter().filter(|panel| panel.kind == kind).count();
    assert_eq!(count(&regular, Kind::Triangle), 0);
    let results = [1, 2, 3].map(|seed| tiled(&mesh, 200.0, Fill::Fractured { seed }));
    for result in &results {
        assert_patches("sheet", &mesh, result);
        let [triangles, squares] = [Kind::Triangle, Kind::Square].map(|kind| count(result, kind) as f64);
        assert!(triangles.min(2.0 * squares) > 0.2 * (triangles + squares), "{triangles} triangles, {squares} squares");
    }
    assert!(results.iter().any(|result| result.mesh.corner_verts() != results[0].mesh.corner_verts()));
    let again = tiled(&mesh, 200.0, Fill::Fractured { seed: 1 });
    assert_eq!(again.mesh, results[0].mesh, "the same seed gives the same panels");
}
