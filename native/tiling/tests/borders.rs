//! Borders of tilings against those of their surfaces, along all edges of both.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use testkit::oracle;
use tiling::{Bar, SurfaceOptions, SurfaceTiling, tile_surface};

fn tiled(mesh: &PolygonMesh, edge_length: f64) -> SurfaceTiling {
    let surface = TriangleMesh::from_polygons(mesh).0;
    let result = tile_surface(&surface, edge_length, &SurfaceOptions::default(), &Monitor::new()).expect("a surface");
    assert!(result.turned.is_empty(), "{:?} turned over", result.turned);
    assert_eq!(oracle::euler(&result.mesh), oracle::euler(mesh));
    result
}

/// All edges of a mesh with the number of faces at each.
fn edges(mesh: &PolygonMesh) -> Vec<([DVec3; 2], usize)> {
    let mut uses = BTreeMap::<[u32; 2], usize>::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    uses.into_iter().map(|(edge, uses)| (edge.map(|v| mesh.positions[v as usize]), uses)).collect()
}

fn border(mesh: &PolygonMesh) -> Vec<[DVec3; 2]> {
    edges(mesh).into_iter().filter(|(_, uses)| *uses == 1).map(|(edge, _)| edge).collect()
}

fn distance(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let part = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, part))
}

/// The greatest distance of the border of each from that of the other, at eighths of all edges, in mean edges of the result.
fn off(mesh: &PolygonMesh, result: &PolygonMesh) -> f64 {
    let of_result = edges(result);
    let mean = of_result.iter().map(|([a, b], _)| a.distance(*b)).sum::<f64>() / of_result.len() as f64;
    let borders = [border(mesh), border(result)];
    let one_way = |from: &[[DVec3; 2]], to: &[[DVec3; 2]]| {
        let samples = from.iter().flat_map(|&[a, b]| (0..8).map(move |k| a.lerp(b, f64::from(k) / 8.0)));
        let nearest = samples.map(|p| to.iter().map(|&edge| distance(p, edge)).fold(f64::INFINITY, f64::min));
        nearest.fold(0.0, f64::max)
    };
    one_way(&borders[0], &borders[1]).max(one_way(&borders[1], &borders[0])) / mean
}

fn spread(mesh: &PolygonMesh) -> f64 {
    let lengths: Vec<f64> = edges(mesh).into_iter().map(|([a, b], _)| a.distance(b)).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    (lengths.iter().map(|l| (l / mean - 1.0).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt()
}

/// A flat ring between two loops, the inner one around the origin, in `n` sectors and eight rows.
fn ring(n: u32, inner: impl Fn(f64) -> f64, outer: impl Fn(f64) -> f64) -> PolygonMesh {
    let at = |row: u32, k: u32| {
        let turn = TAU * f64::from(k) / f64::from(n);
        let part = f64::from(row) / 8.0;
        let radius = inner(turn) * (1.0 - part) + outer(turn) * part;
        DVec3::new(radius * turn.cos(), radius * turn.sin(), 0.0)
    };
    let positions = (0..9).flat_map(|row| (0..n).map(move |k| (row, k))).map(|(row, k)| at(row, k)).collect();
    let v = |row: u32, k: u32| row * n + k % n;
    let faces: Vec<Vec<u32>> = (0..8 * n)
        .map(|f| (f / n, f % n))
        .map(|(row, k)| vec![v(row, k), v(row + 1, k), v(row + 1, k + 1), v(row, k + 1)])
        .collect();
    PolygonMesh::from_polygons(positions, &faces).expect("a ring")
}

#[test]
fn bends_too_blunt_for_corners_get_a_vertex() {
    // Borders of fifteen sides, 24 degrees between them, about three panels each.
    let mesh = ring(15, |_| 3.0, |_| 8.0);
    for edge_length in [0.95, 1.0, 1.1] {
        let result = tiled(&mesh, edge_length);
        let off = off(&mesh, &result.mesh);
        assert!(off < 0.05, "{off} with edges of {edge_length}");
        assert!(spread(&result.mesh) < 0.2);
        assert_eq!(result.missed_bars(), []);
    }
}

#[test]
fn holes_of_a_few_panels_are_round() {
    let mesh = ring(64, |_| 1.4, |_| 8.0);
    for edge_length in [0.8, 1.0, 1.3] {
        let result = tiled(&mesh, edge_length);
        let off = off(&mesh, &result.mesh);
        assert!(off < 0.05, "{off} with edges of {edge_length}");
        assert!(spread(&result.mesh) < 0.2);
    }
}

#[test]
fn teeth_smaller_than_panels_are_cut_off_and_said() {
    let teeth = |turn: f64| if (60.0 * turn / TAU).round() as i32 % 2 == 0 { 7.6 } else { 8.0 };
    let mesh = ring(60, |_| 3.0, teeth);
    let result = tiled(&mesh, 1.2);
    let missed = result.missed_bars();
    let found = missed.iter().find(|missed| missed.bar == Bar::Borders).expect("teeth are cut off");
    let off = off(&mesh, &result.mesh);
    assert!(off > 0.05 && (found.measured - off).abs() < 0.01, "{} for {off}", found.measured);
    // The panels named are on the border.
    let rim = border(&result.mesh);
    for &face in &found.elements {
        let corners: Vec<DVec3> = result.mesh.face_points(face as usize).collect();
        assert!(rim.iter().any(|edge| edge.iter().all(|p| corners.contains(p))), "face {face}");
    }
    assert!(!found.elements.is_empty());
}
