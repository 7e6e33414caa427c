//! Tiles surfaces read from OBJ files and prints what came out.
//!
//! `cargo run --example surface -- OUT_FOLDER EDGE FILE.obj...`: EDGE is the edge length, or the wanted number of panels
//! when it starts with `n`.

use mesh::{DVec3, Monitor, Topology, TriangleMesh, check};
use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use surface::closest::ClosestPoint;
use tiling::{
    Fill, Kind, PanelSize, Partition, PatchGraph, PolygonTiling, SurfaceOptions, SurfaceTiling, tile_polygons,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, edge, files @ ..] = arguments.as_slice() else {
        return Err("usage: surface OUT_FOLDER EDGE|nPANELS FILE.obj...".into());
    };
    // RANDOM_SEED in the environment asks for patches filled at random, FRACTURED_SEED for fractured ones.
    let seed = |name: &str| std::env::var(name).ok().map(|seed| seed.parse()).transpose();
    let fill = match (seed("RANDOM_SEED")?, seed("FRACTURED_SEED")?) {
        (Some(seed), _) => Fill::Random { seed, patch_panels: 40 },
        (_, Some(seed)) => Fill::Fractured { seed },
        _ => Fill::Regular,
    };
    // PAPER in the environment asks for the paper's partition.
    let partition = if std::env::var_os("PAPER").is_some() { Partition::Paper } else { Partition::Expansion };
    let mut options = SurfaceOptions { fill, partition, ..SurfaceOptions::default() };
    // UNSHAPED in the environment leaves the pattern as it was laid.
    if std::env::var_os("UNSHAPED").is_some() {
        (options.shape.rounds, options.shape.flattening_rounds) = (0, 0);
    }
    println!(
        "{:24}{:>7}{:>7}{:>5}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>7}{:>6}  seconds",
        "surface", "panels", "quads", "rh", "irreg%", "edge cv", "plan%", "max%", "close%", "border", "turned", "chi"
    );
    for file in files {
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        let polygons = testkit::obj::read(&std::fs::read_to_string(file)?)?;
        let size = match edge.strip_prefix('n') {
            Some(panels) => PanelSize::Count(panels.parse()?),
            None => PanelSize::EdgeLength(edge.parse()?),
        };
        match tile_polygons(&polygons, size, &options, &Monitor::new()) {
            Ok(PolygonTiling { tiling: result, .. }) => {
                report(&name, &TriangleMesh::from_polygons(&polygons).0, &result)?;
                if let Some(graph) = &result.patch_graph {
                    std::fs::write(Path::new(folder).join(format!("{name}.patches.svg")), picture(graph))?;
                }
                std::fs::write(Path::new(folder).join(format!("{name}.obj")), testkit::obj::write(&result.mesh))?;
            }
            Err(error) => println!("{name:24} {error}"),
        }
    }
    Ok(())
}

fn report(name: &str, input: &TriangleMesh, result: &SurfaceTiling) -> Result<(), Box<dyn Error>> {
    let mesh = &result.mesh;
    let topology = Topology::of(mesh);
    let lengths: Vec<f64> = topology
        .edges()
        .map(|h| mesh.positions[topology.from(h) as usize].distance(mesh.positions[topology.to(h) as usize]))
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let spread = (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt() / mean;
    let quads: Vec<f64> = result.panels.iter().filter(|p| p.kind != Kind::Triangle).map(|p| p.planarity).collect();
    let rhombi = result.panels.iter().filter(|p| p.kind == Kind::Rhombus).count();
    let planarity = quads.iter().sum::<f64>() / quads.len().max(1) as f64;
    let surface = ClosestPoint::new(input);
    let far = mesh.positions.iter().map(|&p| surface.project(p).distance).fold(0.0, f64::max);
    let is_inner = |&&(v, _): &&(u32, i32)| !topology.is_border_vertex(v);
    let irregular = result.defects.iter().filter(is_inner).count() as f64 / result.interior_vertices.max(1) as f64;
    let of_input = Topology::of_triangles(input);
    let rim: Vec<[DVec3; 2]> = (0..of_input.len() as u32)
        .filter(|&h| of_input.is_border(h))
        .map(|h| [of_input.from(h), of_input.to(h)].map(|v| input.positions[v as usize]))
        .collect();
    let off_rim = (0..mesh.vertex_count() as u32)
        .filter(|&v| topology.is_border_vertex(v))
        .map(|v| rim.iter().map(|s| distance(mesh.positions[v as usize], *s)).fold(f64::INFINITY, f64::min))
        .fold(0.0, f64::max);
    let turned = (0..mesh.face_count())
        .filter(|&f| is_turned(&mesh.face_points(f).collect::<Vec<_>>(), input, &surface))
        .count();
    let defects = check(mesh, &Monitor::new())?;
    let of_surface = check(&input.to_polygons(), &Monitor::new())?;
    let mut remarks =
        format!(" used {:.3}, patches {} changed {}", result.edge_length, result.patches, result.changed_patches);
    if let Some(graph) = &result.patch_graph {
        write!(
            remarks,
            "; {} patches, {} sides, {} nodes halfway, {} relengthened, {} with rhombi",
            graph.patches.len(),
            graph.sides.len(),
            result.halfway_nodes.len(),
            result.relengthened_patches.len(),
            result.patches_with_rhombi.len()
        )?;
        let counts = result.tiling_counts.iter().map(|count| count.as_ref().map_or("?".into(), ToString::to_string));
        write!(remarks, ", tilings {}", counts.collect::<Vec<_>>().join(" "))?;
    }
    if !defects.manifold() {
        remarks += " NOT MANIFOLD";
    }
    if defects.euler != of_surface.euler {
        write!(remarks, " EULER {} was {}", defects.euler, of_surface.euler)?;
    }
    if result.defects.iter().map(|d| i64::from(d.1)).sum::<i64>() != 12 * defects.euler {
        remarks += " DEFECT SUM";
    }
    if topology.border_loops().len() != of_input.border_loops().len() {
        remarks += " BORDER LOOPS";
    }
    if !defects.self_intersecting_faces.is_empty() {
        write!(remarks, " {} faces intersect", defects.self_intersecting_faces.len())?;
    }
    let times: Vec<String> = result.stages.iter().map(|(stage, t)| format!("{stage} {:.2}", t.as_secs_f64())).collect();
    println!(
        "{name:24}{:>7}{:>7}{rhombi:>5}{:>8.1}{spread:>8.3}{:>8.2}{:>8.2}{:>8.2}{:>8.3}{turned:>7}{:>6}  {}{remarks}",
        result.panels.len(),
        quads.len(),
        100.0 * irregular,
        100.0 * planarity,
        100.0 * quads.iter().copied().fold(0.0, f64::max),
        100.0 * far / mesh.diagonal(),
        off_rim / mean,
        defects.euler,
        times.join(", ")
    );
    Ok(())
}

/// The patch graph seen from above and aside: sides, nodes with a defect in red.
fn picture(graph: &PatchGraph) -> String {
    let flat = |p: DVec3| [p.x + 0.35 * p.y, -p.z - 0.6 * p.y];
    let all: Vec<[f64; 2]> = graph.sides.iter().flat_map(|side| &side.points).map(|&p| flat(p)).collect();
    let low = [0, 1].map(|k| all.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k| all.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
    let scale = 760.0 / (high[0] - low[0]).max(high[1] - low[1]);
    let at = |p: DVec3| [0, 1].map(|k| 20.0 + scale * (flat(p)[k] - low[k]));
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='800' height='800'><rect width='800' height='800' fill='white'/>",
    );
    for side in &graph.sides {
        let points: Vec<String> = side.points.iter().map(|&p| format!("{:.1},{:.1}", at(p)[0], at(p)[1])).collect();
        let _ = write!(svg, "<polyline fill='none' stroke='black' points='{}'/>", points.join(" "));
    }
    for (&p, defect) in graph.nodes.iter().zip(graph.node_defects()) {
        let [x, y] = at(p);
        let (radius, colour) = if defect == 0 { (2, "black") } else { (6, if defect > 0 { "red" } else { "blue" }) };
        let _ = write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='{radius}' fill='{colour}'/>");
        if defect != 0 {
            let _ = write!(svg, "<text x='{:.1}' y='{:.1}'>{defect}</text>", x + 7.0, y);
        }
    }
    svg + "</svg>"
}

fn distance(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let d = b - a;
    p.distance(a + ((p - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0) * d)
}

/// A face with a corner that faces away from the surface below its middle.
fn is_turned(p: &[DVec3], input: &TriangleMesh, surface: &ClosestPoint) -> bool {
    let n = p.len();
    let below = surface.project(p.iter().sum::<DVec3>() / n as f64);
    let up = input.area_normal(below.triangle as usize);
    (0..n).any(|k| (p[(k + 1) % n] - p[k]).cross(p[(k + n - 1) % n] - p[k]).dot(up) <= 0.0)
}
