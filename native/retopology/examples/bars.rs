//! A row for each OBJ file: what the acceptance bars of feature retopology measure.
//!
//! `cargo run -p quadloom-retopology --example bars -- [--faces N] [--plain] [--detect] [--coarse] [--irregularity X]
//! [--rounds N] [--vertices N] [--aspect X] [--least-quads X] [--least-feature X] [--paint R] [--as-laid] [--stages] [--out FOLDER] FILE.obj...`
//!
//! Features come from `FILE.edges40` beside each file (`i j` a line), unless `--plain`; `--detect` adds those found. `--paint R`
//! wants edges R times as long in the left third as in the right one, and prints what was made of it. `--coarse` asks for the
//! coarsest layout; `--stages` prints the seconds of each stage. With `--out`, writes `NAME.obj`, `NAME_base.obj` and the edges on features, `NAME.edges`. The columns are
//! those of the judge, measured anew: irregular
//! vertices; patches of the base complex; least scaled Jacobian and its first percentile; mean deviation of angles, degrees;
//! two-way distance at samples, percent of the diagonal; percent of the features within 5% and 1% of the mean edge of
//! an edge within 10 degrees of their direction; inverted quads; quads; Euler characteristic before and after; seconds.

use mesh::{DVec3, Monitor, PolygonMesh, Topology, TriangleMesh, scaled_jacobian};
use retopology::features::Features;
use retopology::{Options, Size, retopologize};
use std::path::PathBuf;
use std::time::Instant;
use surface::closest::ClosestPoint;
use testkit::{obj, oracle};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut options = Options::default();
    let (mut plain, mut stages, mut out, mut paint, mut files) = (false, false, None, 1.0, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        match word.as_str() {
            "--faces" => options.layout.size = Size::TargetFaces(value()?.parse()?),
            "--vertices" => options.base.vertices = value()?.parse()?,
            "--aspect" => options.base.aspect = value()?.parse()?,
            "--least-quads" => options.base.least_quads = value()?.parse()?,
            "--least-feature" => options.base.least_feature = value()?.parse()?,
            "--rounds" => options.layout.rounds = value()?.parse()?,
            "--irregularity" => options.layout.irregularity = value()?.parse()?,
            "--paint" => paint = value()?.parse()?,
            "--coarse" => options.layout.irregularity = f64::INFINITY,
            "--detect" => options.base.detect = Some(retopology::detect::DetectOptions::default()),
            "--plain" => plain = true,
            "--stages" => stages = true,
            "--as-laid" => options.layout.improve = false,
            "--out" => out = Some(PathBuf::from(value()?)),
            _ => files.push(PathBuf::from(word)),
        }
    }
    println!(
        "{:18} {:>5} {:>7} {:>6} {:>5} {:>6} {:>5} {:>6} {:>6} {:>4} {:>6} {:>9} {:>6}  base",
        "mesh", "irreg", "patches", "SJ min", "1%", "angle", "haus%", "feat5", "feat1", "inv", "faces", "euler", "s"
    );
    for file in files {
        let name = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let mesh = obj::read(&std::fs::read_to_string(&file)?)?;
        let marked = file.with_extension("edges40");
        let edges =
            if plain || !marked.exists() { vec![] } else { obj::read_edges(&std::fs::read_to_string(&marked)?)? };
        let features = Features { edges, vertices: vec![] };
        let [left, right] = thirds(&mesh);
        if paint != 1.0 {
            let size = |p: &DVec3| {
                let t = ((p.x - left) / (right - left)).clamp(0.0, 1.0);
                f64::powf(paint, -t)
            };
            options.layout.density = mesh.positions.iter().map(size).collect();
        }
        let start = Instant::now();
        let made = match retopologize(&mesh, &features, &options, &Monitor::new()) {
            Ok(made) => made,
            Err(error) => {
                println!("{name:18} {error}");
                continue;
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        if stages {
            println!("{:?}", made.report.seconds);
        }
        let quads = Judged::new(&made.mesh);
        let [within_5, within_1] = followed(&made.mesh, &mesh, &features.edges);
        println!(
            "{name:18} {:5} {:7} {:6.2} {:5.2} {:6.2} {:5.2} {:6.2} {:6.2} {:4} {:6} {:4}/{:<4} {seconds:6.2}  {} {}",
            made.report.irregular_vertices,
            made.report.base_complex,
            quads.least,
            quads.first_percentile,
            quads.angle,
            100.0 * distance(&made.mesh, &mesh),
            100.0 * within_5,
            100.0 * within_1,
            quads.inverted,
            made.mesh.face_count(),
            oracle::euler(&mesh),
            oracle::euler(&made.mesh),
            made.report.base_triangles,
            made.report.warnings.join("; ")
        );

        if paint != 1.0 {
            println!("{name:18} painted {paint}, made {:.2}", contrast(&made.mesh, left, right));
        }
        if let Some(folder) = &out {
            std::fs::create_dir_all(folder)?;
            std::fs::write(folder.join(format!("{name}.obj")), obj::write(&made.mesh))?;
            let base = &made.base;
            std::fs::write(folder.join(format!("{name}_base.obj")), obj::write(base))?;
            let lines = made.feature_edges.iter().map(|edge| format!("{} {}\n", edge.ends[0], edge.ends[1]));
            std::fs::write(folder.join(format!("{name}.edges")), lines.collect::<String>())?;
        }
    }
    Ok(())
}

/// The shape of quads.
struct Judged {
    least: f64,
    first_percentile: f64,
    angle: f64,
    inverted: usize,
}

impl Judged {
    fn new(mesh: &PolygonMesh) -> Self {
        let (mut jacobians, mut off) = (Vec::new(), 0.0);
        for f in 0..mesh.face_count() {
            let p: Vec<DVec3> = mesh.face_points(f).collect();
            jacobians.push(scaled_jacobian([p[0], p[1], p[2], p[3]]));
            let angle = |k: usize| (p[(k + 1) % 4] - p[k]).angle_between(p[(k + 3) % 4] - p[k]).to_degrees();
            off += (0..4).map(|k| (angle(k) - 90.0).abs()).sum::<f64>() / 4.0;
        }
        jacobians.sort_by(f64::total_cmp);
        let count = jacobians.len();
        Self {
            least: jacobians[0],
            first_percentile: jacobians[count / 100],
            angle: off / count as f64,
            inverted: jacobians.iter().filter(|j| **j <= 0.0).count(),
        }
    }
}

/// The bounds along x of the middle third of a mesh.
fn thirds(mesh: &PolygonMesh) -> [f64; 2] {
    let least = mesh.positions.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    let most = mesh.positions.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    [1.0, 2.0].map(|k| least + (most - least) * k / 3.0)
}

/// Mean size of the quads left of the middle third over that of those right of it, as lengths.
fn contrast(mesh: &PolygonMesh, left: f64, right: f64) -> f64 {
    let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
    for f in 0..mesh.face_count() {
        let p: Vec<DVec3> = mesh.face_points(f).collect();
        let x = p.iter().map(|p| p.x).sum::<f64>() / 4.0;
        let side = usize::from(x >= left);
        if x < left || x > right {
            sums[side] += (p[2] - p[0]).cross(p[3] - p[1]).length() / 2.0;
            counts[side] += 1.0;
        }
    }
    (sums[0] / counts[0] / (sums[1] / counts[1])).sqrt()
}

/// The larger of the two distances between the surfaces, at vertices and middles of edges and faces, over the diagonal.
fn distance(quads: &PolygonMesh, input: &PolygonMesh) -> f64 {
    let [quads, given] = [quads, input].map(|mesh| TriangleMesh::from_polygons(mesh).0);
    let off = |from: &TriangleMesh, to: &TriangleMesh| {
        let closest = ClosestPoint::new(to);
        (0..from.triangles.len())
            .flat_map(|t| {
                let [a, b, c] = from.points(t);
                [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
            })
            .map(|p| closest.project(p).point.distance(p))
            .fold(0.0, f64::max)
    };
    off(&quads, &given).max(off(&given, &quads)) / input.diagonal()
}

/// Shares of the marked length within 5% and 1% of the mean edge of an edge in nearly the same direction.
fn followed(quads: &PolygonMesh, input: &PolygonMesh, edges: &[[u32; 2]]) -> [f64; 2] {
    let topology = Topology::of(quads);
    let at = |v: u32| quads.positions[v as usize];
    let made: Vec<[DVec3; 2]> = topology.edges().map(|h| [at(topology.from(h)), at(topology.to(h))]).collect();
    let mean = made.iter().map(|[p, q]| p.distance(*q)).sum::<f64>() / made.len() as f64;
    // Edges by the cells of a grid that they pass near.
    let longest = made.iter().map(|[p, q]| p.distance(*q)).fold(0.0, f64::max);
    let cell = |p: DVec3| (p / longest).floor().to_array().map(|x| x as i64);
    let mut grid = std::collections::BTreeMap::<[i64; 3], Vec<u32>>::new();
    for (e, [p, q]) in (0..).zip(&made) {
        let mut cells = vec![cell(*p), cell(*q), cell((*p + *q) / 2.0)];
        cells.sort_unstable();
        cells.dedup();
        for c in cells {
            grid.entry(c).or_default().push(e);
        }
    }
    let mut found = [0.0; 2];
    let mut total = 0.0;
    for ends in edges {
        let [a, b] = ends.map(|v| input.positions[v as usize]);
        let length = a.distance(b);
        let count = ((length / (0.2 * mean)).ceil() as usize).max(2);
        total += length;
        let tangent = (b - a).normalize_or_zero();
        for i in 0..count {
            let point = a.lerp(b, (i as f64 + 0.5) / count as f64);
            let [x, y, z] = cell(point);
            let mut best = f64::INFINITY;
            for d in 0..27 {
                for &e in grid.get(&[x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1]).into_iter().flatten() {
                    let [p, q] = made[e as usize];
                    if (q - p).normalize_or_zero().dot(tangent).abs() >= 10_f64.to_radians().cos() {
                        let t = ((point - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
                        best = best.min(p.lerp(q, t).distance(point));
                    }
                }
            }
            for (found, limit) in found.iter_mut().zip([0.05, 0.01]) {
                if best <= limit * mean {
                    *found += length / count as f64;
                }
            }
        }
    }
    found.map(|part| if total > 0.0 { part / total } else { 1.0 })
}
