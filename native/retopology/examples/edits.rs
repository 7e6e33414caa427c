//! Times the editing loop on a generated torus of 20,000 vertices with 70 curves, and prints a row for each edit.
//!
//! `cargo run -p quadloom-retopology --example edits`

use mesh::{Monitor, TriangleMesh};
use retopology::build::{BaseOptions, edge_for_faces};
use retopology::features::Features;
use retopology::session::Session;
use retopology::{LayoutOptions, quads_from_base};
use std::time::Instant;
use testkit::shapes;

/// Vertices the long way round, and across.
const AROUND: u32 = 200;
const ACROSS: u32 = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mesh, _) = TriangleMesh::from_polygons(&shapes::triangulated(&shapes::torus(2.0, 0.8, AROUND, ACROSS)));
    let at = |i: u32, j: u32| (i % AROUND) * ACROSS + j % ACROSS;
    let curve = |i: u32, j: u32| Features {
        edges: (0..8).map(|k| [at(i + k, j), at(i + k + 1, j)]).collect(),
        vertices: vec![],
    };
    let mut features = Features::default();
    for k in 0..70 {
        features.edges.extend(curve(20 * (k % 10), 14 * (k / 10) + 3).edges);
    }
    let options = BaseOptions { final_edge: Some(edge_for_faces(&mesh, 4000)), ..BaseOptions::default() };
    let monitor = Monitor::new();
    let start = Instant::now();
    let mut session = Session::new(mesh, features, options, &monitor)?;
    println!("base {:.3} s, {} triangles", start.elapsed().as_secs_f64(), session.base().triangles.len());
    let start = Instant::now();
    let quads = quads_from_base(session.base(), &LayoutOptions::default(), &monitor)?;
    println!("quads {:.3} s, {} faces", start.elapsed().as_secs_f64(), quads.mesh.face_count());
    for (from, to) in [((0, 3), (2, 5)), ((60, 31), (61, 33)), ((100, 45), (110, 50)), ((180, 87), (181, 86))] {
        let start = Instant::now();
        let report = session.move_feature(&curve(from.0, from.1), &curve(to.0, to.1), &monitor)?;
        println!("edit {:.3} s, {report:?}", start.elapsed().as_secs_f64());
    }
    Ok(())
}
