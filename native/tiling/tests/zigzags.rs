//! Edits of patch graphs (section 4.3, Fig. 13), judged from outside: what changed, and that nothing became irregular.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use std::collections::{BTreeMap, BTreeSet};
use testkit::{oracle, shapes};
use tiling::{
    EditError, Fill, Kind, Partition, PatchTiles, PolyhedronOptions, SurfaceError, SurfaceOptions, SurfaceTiling,
    Zigzag, tile_polyhedron, tile_surface, zigzags_of_patch,
};

fn tiled(mesh: &PolygonMesh, edge_length: f64, corners: Vec<(u32, u8)>) -> SurfaceTiling {
    let surface = TriangleMesh::from_polygons(mesh).0;
    let options = SurfaceOptions { partition: Partition::Paper, corners, ..SurfaceOptions::default() };
    tile_surface(&surface, edge_length, &options, &Monitor::new()).expect("a sound surface")
}

/// A flat triangle with sides of length 1.
fn triangle(n: u32) -> PolygonMesh {
    let mut positions = Vec::new();
    let mut index = BTreeMap::new();
    for j in 0..=n {
        for i in 0..=n - j {
            index.insert((i, j), positions.len() as u32);
            let (x, y) = (f64::from(i) + 0.5 * f64::from(j), f64::from(j) * 0.75f64.sqrt());
            positions.push(DVec3::new(x, y, 0.0) / f64::from(n));
        }
    }
    let mut faces = Vec::new();
    for j in 0..n {
        for i in 0..n - j {
            faces.push([index[&(i, j)], index[&(i + 1, j)], index[&(i, j + 1)]]);
            if i + j + 1 < n {
                faces.push([index[&(i + 1, j)], index[&(i + 1, j + 1)], index[&(i, j + 1)]]);
            }
        }
    }
    PolygonMesh::from_polygons(positions, faces).expect("a triangle")
}

/// Vertices whose corners do not add up to a full turn, off the border, and by how much, in units of 30 degrees.
fn irregular(mesh: &PolygonMesh) -> BTreeMap<u32, i32> {
    let mut sides = BTreeSet::new();
    let mut left: BTreeMap<u32, i32> = BTreeMap::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            sides.insert((face[k], face[(k + 1) % face.len()]));
            *left.entry(face[k]).or_insert(12) -= if face.len() == 3 { 2 } else { 3 };
        }
    }
    for &(a, b) in sides.iter().filter(|&&(a, b)| !sides.contains(&(b, a))) {
        left.remove(&a);
        left.remove(&b);
    }
    left.retain(|_, defect| *defect != 0);
    left
}

fn assert_surface(mesh: &PolygonMesh, euler: i64) {
    assert!(mesh.faces().all(|face| face.len() == 3 || face.len() == 4));
    let mut seen = BTreeSet::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            assert!(seen.insert((face[k], face[(k + 1) % face.len()])), "an edge twice in one direction");
        }
    }
    assert_eq!(oracle::euler(mesh), euler);
}

/// The faces of a patch, each by its corners' places among the patch's vertices in the order they are met: equal for patches
/// that are tiled alike, whatever their vertices are called.
fn connectivity(mesh: &PolygonMesh, tiles: &PatchTiles, patch: u32) -> Vec<Vec<usize>> {
    let mut met: Vec<u32> = Vec::new();
    (0..mesh.face_count())
        .filter(|&f| tiles.patch_of[f] == patch)
        .map(|f| {
            let place = |v: &u32| {
                met.iter().position(|w| w == v).unwrap_or_else(|| {
                    met.push(*v);
                    met.len() - 1
                })
            };
            mesh.face(f).iter().map(place).collect()
        })
        .collect()
}

/// What an edit promises.
fn assert_edited(before: &SurfaceTiling, after: &SurfaceTiling) {
    assert_surface(&after.mesh, oracle::euler(&before.mesh));
    assert_eq!(
        irregular(&after.mesh),
        irregular(&before.mesh),
        "irregular vertices are nodes, which keep their indices"
    );
    let graph = after.patch_graph.as_ref().expect("patches");
    assert_eq!(Some(graph), before.patch_graph.as_ref());
    assert!(graph.patches.iter().all(|patch| patch.total_interior_defect() == 0));
    assert!(after.panels.iter().all(|panel| panel.kind != Kind::Rhombus));
    assert!(after.turned.is_empty(), "panels {:?} turned over", after.turned);
    let [old, new] = [before, after].map(|tiling| tiling.patch_tiles.as_ref().expect("whole patches"));
    for s in 0..graph.sides.len() {
        let is_named = after.edit.sides.contains(&(s as u32));
        assert!(is_named || old.courses[s] == new.courses[s], "side {s} changed");
        assert_eq!(new.along[s].len(), new.courses[s].len() + 1);
        assert_eq!([new.along[s][0], *new.along[s].last().expect("two ends")], graph.sides[s].ends);
    }
    for p in 0..graph.patches.len() as u32 {
        let is_beside = graph.patches[p as usize].corners.iter().any(|c| after.edit.sides.contains(&c.side));
        assert_eq!(after.edit.patches.contains(&p), is_beside);
        if !is_beside {
            let [a, b] = [(before, old), (after, new)].map(|(t, tiles)| connectivity(&t.mesh, tiles, p));
            assert_eq!(a, b, "patch {p}");
        }
    }
}

fn turned_edges(course: &[i8]) -> [usize; 2] {
    [1, -1].map(|letter| course.iter().filter(|&&offset| offset == letter).count())
}

fn draw(name: &str, mesh: &PolygonMesh) {
    if let Ok(folder) = std::env::var("ZIGZAGS_OUT") {
        std::fs::write(format!("{folder}/{name}.obj"), testkit::obj::write(mesh)).expect("a folder");
    }
}

#[test]
fn a_four_sided_patch_takes_a_pair_of_zigzags() {
    let sheet = shapes::sheet(9, 6);
    let before = tiled(&sheet, 0.5, Vec::new());
    let graph = before.patch_graph.clone().expect("patches");
    assert_eq!(graph.patches.len(), 1);
    assert!(before.panels.iter().all(|panel| panel.kind == Kind::Square));
    draw("sheet", &before.mesh);
    // Progressively more fractured, as in the figure's top row.
    let mut now = before.clone();
    for round in 1..=3 {
        let zigzags = zigzags_of_patch(&graph, 0, 0, Zigzag::new(0, 1)).expect("four sides");
        assert_eq!(zigzags.len(), 2);
        let next = now.zigzag(&zigzags, &Monitor::new()).expect("a zigzag");
        assert_edited(&now, &next);
        let courses = &next.patch_tiles.as_ref().expect("patches").courses;
        for zigzag in &zigzags {
            assert_eq!(turned_edges(&courses[zigzag.side as usize]), [round, 0]);
        }
        let triangles = next.panels.iter().filter(|panel| panel.kind == Kind::Triangle).count();
        assert!(triangles > now.panels.iter().filter(|panel| panel.kind == Kind::Triangle).count());
        draw(&format!("sheet{round}"), &next.mesh);
        now = next;
    }
    // Naming one side alone makes the pair too.
    let single = before.zigzag(&[Zigzag::new(0, 2)], &Monitor::new()).expect("a zigzag");
    assert_edited(&before, &single);
    assert!(single.edit.sides.len() >= 2);
}

#[test]
fn a_side_takes_a_pair_of_its_own_and_spreads_it() {
    let before = tiled(&shapes::sheet(9, 6), 0.5, Vec::new());
    for spread in [false, true] {
        let zigzag = Zigzag { pair: true, spread, ..Zigzag::new(1, 2) };
        let after = before.zigzag(&[zigzag], &Monitor::new()).expect("a pair");
        assert_edited(&before, &after);
        assert_eq!(turned_edges(&after.patch_tiles.as_ref().expect("patches").courses[1]), [2, 2]);
        draw(if spread { "pair_spread" } else { "pair" }, &after.mesh);
    }
}

#[test]
fn a_three_sided_patch_takes_triples_of_both_hands() {
    let before = tiled(&triangle(12), 0.1, Vec::new());
    let graph = before.patch_graph.clone().expect("patches");
    assert_eq!((graph.patches.len(), graph.patches[0].corners.len()), (1, 3));
    draw("triangle", &before.mesh);
    for edges in [1, -1, 2] {
        let zigzags = zigzags_of_patch(&graph, 0, 0, Zigzag::new(0, edges)).expect("three sides");
        assert_eq!(zigzags.len(), 3);
        let after = before.zigzag(&zigzags, &Monitor::new()).expect("a triple");
        assert_edited(&before, &after);
        for side in 0..3 {
            let turned = turned_edges(&after.patch_tiles.as_ref().expect("patches").courses[side]);
            assert_eq!(turned[usize::from(edges < 0)], edges.unsigned_abs() as usize);
        }
        assert!(after.panels.iter().any(|panel| panel.kind == Kind::Square));
        draw(&format!("triple{edges}"), &after.mesh);
    }
}

#[test]
fn patches_of_a_sphere_take_zigzags_and_far_ones_keep_their_tiles() {
    let before = tiled(&shapes::sphere(12), 0.15, Vec::new());
    let Some(graph) = &before.patch_graph else { panic!("no partition of the sphere") };
    let (mut taken, mut refused) = (0, 0);
    for side in (0..graph.sides.len() as u32).step_by(7) {
        match before.zigzag(&[Zigzag::new(side, 1)], &Monitor::new()) {
            Ok(after) => {
                assert_edited(&before, &after);
                taken += 1;
                if taken == 1 {
                    draw("sphere", &after.mesh);
                }
            }
            Err(SurfaceError::Edit(EditError::Open { .. } | EditError::Untileable { .. })) => refused += 1,
            Err(error) => panic!("side {side}: {error}"),
        }
    }
    // A strip must come back to where it began, for there is no border.
    assert!(taken > 0 && refused == 0, "{taken} sides took a zigzag, {refused} did not");
}

#[test]
fn a_polyhedron_takes_zigzags() {
    let cube = shapes::cuboid(DVec3::ONE, 1);
    let options = PolyhedronOptions::default();
    let before = tile_polyhedron(&cube, Some(1.0 / 6.0), &options, &Monitor::new()).expect("a cube");
    assert_eq!(before.panels.len(), 6 * 36);
    let zigzags = zigzags_of_patch(&before.patch_graph, 0, 0, Zigzag::new(0, 1)).expect("four sides");
    let after = before.zigzag(&zigzags, &Monitor::new()).expect("a zigzag round the cube");
    assert_surface(&after.mesh, 2);
    assert_eq!(irregular(&after.mesh), irregular(&before.mesh));
    // A strip round the cube: four sides, the patches beside them.
    assert!(after.edit.sides.len() >= 4);
    assert_ne!(after.mesh.face_count(), before.mesh.face_count());
    draw("cube", &after.mesh);
}

#[test]
fn impossible_edits_are_named() {
    let before = tiled(&shapes::sheet(9, 6), 0.5, Vec::new());
    let error = |zigzags: &[Zigzag]| match before.zigzag(zigzags, &Monitor::new()) {
        Err(SurfaceError::Edit(error)) => error,
        other => panic!("{other:?}"),
    };
    assert_eq!(error(&[Zigzag::new(4, 1)]), EditError::NoSuchSide { side: 4, count: 4 });
    assert_eq!(error(&[Zigzag::new(0, 0)]), EditError::Edges { edges: 0 });
    let graph = before.patch_graph.as_ref().expect("patches");
    assert_eq!(zigzags_of_patch(graph, 1, 0, Zigzag::new(0, 1)), Err(EditError::NoSuchPatch { patch: 1, count: 1 }));
    let surface = TriangleMesh::from_polygons(&shapes::sheet(9, 6)).0;
    let even = tile_surface(&surface, 0.5, &SurfaceOptions::default(), &Monitor::new()).expect("a sheet");
    assert!(matches!(
        even.zigzag(&[Zigzag::new(0, 1)], &Monitor::new()),
        Err(SurfaceError::Edit(EditError::NoPatches))
    ));
    let random = SurfaceOptions {
        partition: Partition::Paper,
        fill: Fill::Random { seed: 1, patch_panels: 30 },
        ..SurfaceOptions::default()
    };
    let drawn = tile_surface(&surface, 0.5, &random, &Monitor::new()).expect("a sheet");
    let edited = drawn.zigzag(&[Zigzag::new(0, 1)], &Monitor::new()).expect("a zigzag");
    assert!(edited.patch_tiles.is_none());
    assert_surface(&edited.mesh, 1);
}
