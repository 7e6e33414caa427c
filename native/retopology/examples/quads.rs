//! Makes quads of OBJ files, or of generated shapes when none are given, and prints a row for each.
//!
//! `cargo run -p quadloom-retopology --example quads -- [--faces N] [--vertices N] [--paper] [--merge 2|3] [--irregularity X]
//! [--rounds N] [--chord-error X] [--as-laid] [--plain] [--out FOLDER] FILE.obj...`
//!
//! Features come from `FILE.edges40` beside each file (`i j` a line), unless `--plain`. With `--out`, writes `NAME.obj`.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use retopology::base::{Base, BaseEdge};
use retopology::build::{BaseOptions, build_base, edge_for_faces};
use retopology::features::Features;
use retopology::{LayoutOptions, Pairing, Size, quads_from_base};
use std::path::{Path, PathBuf};
use std::time::Instant;
use testkit::coarse::{Divided, divide};
use testkit::{obj, shapes};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let (mut coarse, mut options) = (BaseOptions::default(), LayoutOptions::default());
    let (mut plain, mut out, mut files) = (false, None, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        match word.as_str() {
            "--vertices" => coarse.vertices = value()?.parse()?,
            "--aspect" => coarse.aspect = value()?.parse()?,
            "--faces" => options.size = Size::TargetFaces(value()?.parse()?),
            "--paper" => options.pairing = Pairing::PAPER,
            "--merge" => options.pairing = Pairing::Programme { most_triangles: value()?.parse()? },
            "--irregularity" => options.irregularity = value()?.parse()?,
            "--rounds" => options.rounds = value()?.parse()?,
            "--chord-error" => options.chord_error = value()?.parse()?,
            "--as-laid" => options.improve = false,
            "--plain" => plain = true,
            "--out" => out = Some(PathBuf::from(value()?)),
            _ => files.push(PathBuf::from(word)),
        }
    }
    println!(
        "{:20} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}  stages",
        "mesh", "base", "patch", "single", "target", "faces", "irreg", "invert", "s base", "s quad"
    );
    if files.is_empty() {
        for (name, base) in generated() {
            run(name, &base, 0.0, &options, out.as_deref())?;
        }
    }
    for file in files {
        let name = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let (mesh, _) = TriangleMesh::from_polygons(&obj::read(&std::fs::read_to_string(&file)?)?);
        let features = if plain { Features::default() } else { read_edges(&file.with_extension("edges40"))? };
        if let Size::TargetFaces(faces) = options.size {
            coarse.final_edge = Some(edge_for_faces(&mesh, faces));
        }
        let start = Instant::now();
        match build_base(&mesh, &features, &coarse, &Monitor::new()) {
            Ok(built) => run(&name, &built.base, start.elapsed().as_secs_f64(), &options, out.as_deref())?,
            Err(error) => println!("{name:20} {error}"),
        }
    }
    Ok(())
}

fn run(name: &str, base: &Base, seconds: f64, options: &LayoutOptions, out: Option<&Path>) -> Result<(), Failure> {
    let start = Instant::now();
    let quads = match quads_from_base(base, options, &Monitor::new()) {
        Ok(quads) => quads,
        Err(error) => {
            println!("{name:20} {error}");
            return Ok(());
        }
    };
    let report = &quads.report;
    let stages: Vec<String> = report.seconds.iter().map(|(stage, s)| format!("{stage} {s:.2}")).collect();
    println!(
        "{name:20} {:6} {:6} {:6} {:6} {:6} {:6} {:6} {seconds:6.2} {:6.2}  {}",
        base.triangles.len(),
        report.patches,
        report.singles,
        report.target.unwrap_or(0),
        report.faces,
        report.irregular,
        report.inverted,
        start.elapsed().as_secs_f64(),
        stages.join(", ")
    );
    if let Some(folder) = out {
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join(format!("{name}.obj")), obj::write(&quads.mesh))?;
    }
    Ok(())
}

fn read_edges(file: &Path) -> Result<Features, Failure> {
    let edges = if file.exists() { obj::read_edges(&std::fs::read_to_string(file)?)? } else { vec![] };
    Ok(Features { edges, vertices: vec![] })
}

/// Shapes whose base triangulations are known.
fn generated() -> Vec<(&'static str, Base)> {
    let of = |mesh: &PolygonMesh, n, crease, shape: &dyn Fn(DVec3) -> DVec3| {
        base(divide(&shapes::triangulated(mesh), n, shape), crease)
    };
    vec![
        ("cube", of(&shapes::cuboid(DVec3::splat(2.0), 1), 12, 0.5, &|p| p)),
        ("box", of(&shapes::cuboid(DVec3::new(1.0, 2.0, 4.0), 2), 8, 0.5, &|p| p)),
        ("ball", of(&shapes::cuboid(DVec3::splat(2.0), 2), 12, 4.0, &DVec3::normalize)),
        ("torus", of(&shapes::torus(2.0, 0.7, 12, 6), 6, 4.0, &|p| p)),
        ("sheet", of(&shapes::sheet(3, 2), 6, 4.0, &|p| p + DVec3::Z * (p.x * p.y * 0.2))),
        ("cylinder", of(&shapes::cylinder(1.0, 3.0, 2, 2), 6, 0.9, &|p| p)),
    ]
}

/// The base that a divided mesh is; edges that bend by more than `crease` radians are features, a chain each.
fn base(divided: Divided, crease: f64) -> Base {
    let surface = TriangleMesh { positions: divided.positions, triangles: divided.triangles };
    let mut base = Base {
        source: (0..surface.triangles.len() as u32).collect(),
        owner: divided.owner,
        vertices: (0..=divided.coarse.iter().flatten().copied().max().unwrap_or(0)).collect(),
        edges: divided.edges.into_iter().map(|(ends, path)| BaseEdge { ends, path, feature: None }).collect(),
        triangle_edges: divided.triangle_edges,
        triangles: divided.coarse,
        surface,
    };
    let normal = |t: usize| {
        let p = base.triangles[t].map(|v| base.surface.positions[v as usize]);
        (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero()
    };
    let mut sides = vec![Vec::new(); base.edges.len()];
    for (t, edges) in base.triangle_edges.iter().enumerate() {
        for &e in edges {
            sides[e as usize].push(normal(t));
        }
    }
    for (e, sides) in sides.iter().enumerate() {
        base.edges[e].feature = (sides.len() < 2 || sides[0].angle_between(sides[1]) > crease).then_some(e as u32);
    }
    base
}
