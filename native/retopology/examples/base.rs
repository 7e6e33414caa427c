//! Builds the base triangulation of OBJ files and prints a row for each: sizes, worst angle, seconds by stage.
//!
//! `cargo run -p quadloom-retopology --example base -- [--vertices N] [--faces N] [--aspect X] [--gradation X] [--plain] [--detect] [--out FOLDER] FILE.obj...`
//!
//! Features come from `FILE.edges40` beside each file (`i j` a line), unless `--plain`. With `--out`, writes for each file the
//! base as `NAME.base.obj`, the cut surface as `NAME.cut.obj` with one group a base triangle, and `NAME.base.txt` with the
//! base edges as vertex paths of the cut surface (feature or `-` first).

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use retopology::base::Base;
use retopology::build::{BaseOptions, build_base, edge_for_faces};
use retopology::detect::DetectOptions;
use retopology::features::Features;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut options, mut plain, mut out, mut files) = (BaseOptions::default(), false, None, Vec::new());
    let mut faces = 4000;
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--vertices" => options.vertices = words.next().ok_or("--vertices needs a number")?.parse()?,
            "--aspect" => options.aspect = words.next().ok_or("--aspect needs a number")?.parse()?,
            "--gradation" => options.gradation = words.next().ok_or("--gradation needs a number")?.parse()?,
            "--faces" => faces = words.next().ok_or("--faces needs a number")?.parse()?,
            "--plain" => plain = true,
            "--detect" => options.detect = Some(DetectOptions::default()),
            "--out" => out = Some(PathBuf::from(words.next().ok_or("--out needs a folder")?)),
            _ => files.push(PathBuf::from(word)),
        }
    }
    println!(
        "{:22} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7}  stages",
        "file",
        "verts",
        "marked",
        "curves",
        "fixed",
        "sites",
        "added",
        "rounds",
        "tris",
        "cut",
        "least",
        "median",
        "seconds"
    );
    for file in files {
        let name = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let polygons = testkit::obj::read(&std::fs::read_to_string(&file)?)?;
        let (mesh, _) = TriangleMesh::from_polygons(&polygons);
        let features = if plain { Features::default() } else { read_edges(&file.with_extension("edges40"))? };
        options.final_edge = Some(edge_for_faces(&mesh, faces));
        let start = Instant::now();
        let built = match build_base(&mesh, &features, &options, &Monitor::new()) {
            Ok(built) => built,
            Err(error) => {
                println!("{name:22} {error}");
                continue;
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let (base, report) = (&built.base, &built.report);
        let angles = least_angles(base);
        let stages: Vec<String> = report.seconds.iter().map(|(stage, s)| format!("{stage} {s:.2}")).collect();
        println!(
            "{name:22} {:6} {:6} {:6} {:6} {:6} {:6} {:6} {:6} {:6} {:6.1} {:6.1} {seconds:7.2}  {}",
            mesh.positions.len(),
            features.edges.len(),
            report.curves,
            report.corners + report.breakpoints,
            report.sites.len(),
            report.inserted.len(),
            report.rounds,
            base.triangles.len(),
            base.surface.positions.len(),
            angles[0],
            angles[angles.len() / 2],
            stages.join(", ")
        );
        if let Some(folder) = &out {
            write(base, folder, &name)?;
        }
    }
    Ok(())
}

fn read_edges(file: &Path) -> Result<Features, Box<dyn std::error::Error>> {
    let edges = if file.exists() { testkit::obj::read_edges(&std::fs::read_to_string(file)?)? } else { vec![] };
    Ok(Features { edges, vertices: vec![] })
}

/// The least angle of every base triangle, degrees, ascending; sides are as long as base edges, or as chords of curves.
fn least_angles(base: &Base) -> Vec<f64> {
    let at = |v: u32| base.surface.positions[v as usize];
    let length = |e: u32| {
        let edge = &base.edges[e as usize];
        let path: Vec<DVec3> = edge.path.iter().map(|&v| at(v)).collect();
        let along = path.windows(2).map(|p| p[0].distance(p[1])).sum::<f64>();
        if edge.feature.is_some() { path[0].distance(path[path.len() - 1]) } else { along }
    };
    let mut angles: Vec<f64> = base
        .triangle_edges
        .iter()
        .map(|sides| {
            let [a, b, c] = sides.map(length);
            let angle = |a: f64, b: f64, c: f64| ((b * b + c * c - a * a) / (2.0 * b * c)).clamp(-1.0, 1.0).acos();
            angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b)).to_degrees()
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    angles
}

fn write(base: &Base, folder: &Path, name: &str) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let points: Vec<DVec3> = base.vertices.iter().map(|&v| base.surface.positions[v as usize]).collect();
    let mesh = PolygonMesh::from_polygons(points, &base.triangles)?;
    std::fs::write(folder.join(format!("{name}.base.obj")), testkit::obj::write(&mesh))?;
    let mut text = String::new();
    for p in &base.surface.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
    }
    let mut order: Vec<usize> = (0..base.owner.len()).collect();
    order.sort_by_key(|&t| base.owner[t]);
    let mut group = None;
    for t in order {
        if group != Some(base.owner[t]) {
            group = Some(base.owner[t]);
            writeln!(text, "g base_{}", base.owner[t])?;
        }
        let [a, b, c] = base.surface.triangles[t].map(|v| v + 1);
        writeln!(text, "f {a} {b} {c}")?;
    }
    std::fs::write(folder.join(format!("{name}.cut.obj")), text)?;
    let mut text = String::new();
    for edge in &base.edges {
        let feature = edge.feature.map_or_else(|| "-".to_owned(), |f| f.to_string());
        let path: Vec<String> = edge.path.iter().map(u32::to_string).collect();
        writeln!(text, "{feature} {}", path.join(" "))?;
    }
    std::fs::write(folder.join(format!("{name}.base.txt")), text)?;
    Ok(())
}
