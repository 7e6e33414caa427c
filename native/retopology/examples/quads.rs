//! Quads on generated bases, as OBJ files in the folder given: `quads FOLDER`. With further arguments `COARSE.obj INPUT.obj`
//! the base is a coarse triangle mesh whose divided triangles are put on the input.
use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use retopology::base::{Base, BaseEdge};
use retopology::{LayoutOptions, Pairing, Size, quads_from_base};
use surface::closest::ClosestPoint;
use testkit::coarse::{Divided, divide};
use testkit::{obj, shapes};

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
    // Edges between triangles that meet at more than `crease` radians are features, a chain each.
    let normal = |t: usize| {
        let p = base.triangles[t].map(|v| base.surface.positions[v as usize]);
        (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero()
    };
    let mut sides = vec![Vec::new(); base.edges.len()];
    for (t, edges) in base.triangle_edges.iter().enumerate() {
        edges.iter().for_each(|&e| sides[e as usize].push(normal(t)));
    }
    for (e, sides) in sides.iter().enumerate() {
        base.edges[e].feature = (sides.len() < 2 || sides[0].angle_between(sides[1]) > crease).then_some(e as u32);
    }
    base
}

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    let triangles = |mesh: &PolygonMesh| shapes::triangulated(mesh);
    let read = |path: &str| obj::read(&std::fs::read_to_string(path).expect("a file")).expect("a mesh");
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    if let [coarse, input] = &arguments[..] {
        let crease = std::env::var("CREASE").map_or(0.7, |text| text.parse().expect("an angle in radians"));
        let target = ClosestPoint::new(&TriangleMesh::from_polygons(&read(input)).0);
        let flat = std::env::var("FLAT").is_ok();
        let base = base(divide(&read(coarse), 6, |p| if flat { p } else { target.project(p).point }), crease);
        let features = base.edges.iter().filter(|e| e.feature.is_some()).count();
        println!("{} base triangles, {features} feature edges", base.triangles.len());
        let name = std::path::Path::new(coarse).file_stem().expect("a file").to_string_lossy().into_owned();
        run(&folder, &name, &base);
        return;
    }
    let cases = [
        ("cube", base(divide(&triangles(&shapes::cuboid(DVec3::splat(2.0), 1)), 12, |p| p), 0.5)),
        ("box", base(divide(&triangles(&shapes::cuboid(DVec3::new(1.0, 2.0, 4.0), 2)), 8, |p| p), 0.5)),
        ("ball", base(divide(&triangles(&shapes::cuboid(DVec3::splat(2.0), 2)), 12, DVec3::normalize), 4.0)),
        ("torus", base(divide(&triangles(&shapes::torus(2.0, 0.7, 12, 6)), 6, |p| p), 4.0)),
        ("sheet", base(divide(&triangles(&shapes::sheet(3, 2)), 6, |p| p + DVec3::Z * (p.x * p.y * 0.2)), 4.0)),
        ("cylinder", base(divide(&triangles(&shapes::cylinder(1.0, 3.0, 2, 2)), 6, |p| p), 0.9)),
    ];
    for (name, base) in cases {
        run(&folder, name, &base);
    }
}

fn run(folder: &str, name: &str, base: &Base) {
    let quads = quads_from_base(base, &options(), &Monitor::new()).expect(name);
    let report = &quads.report;
    println!(
        "{name}: {} faces, {} patches, {} singles, {} irregular, {} inverted, {:.3?}",
        report.faces, report.patches, report.singles, report.irregular, report.inverted, report.seconds
    );
    let mut valence = vec![0; quads.mesh.vertex_count()];
    quads.mesh.corner_verts().iter().for_each(|&v| valence[v as usize] += 1);
    let at_corners = (0..valence.len()).filter(|&v| quads.base_vertex[v] != mesh::NONE && valence[v] != 4).count();
    println!("    {at_corners} of {} base vertices are not of valence 4", base.vertices.len());
    std::fs::write(format!("{folder}/{name}.obj"), obj::write(&quads.mesh)).expect("the folder can be written");
}

/// The defaults, changed by the environment: `PAIR` (2, 3 or paper), `IRREGULARITY`, `FACES`, `IMPROVE`.
fn options() -> LayoutOptions {
    let mut options = LayoutOptions::default();
    let given = |name: &str| std::env::var(name).ok();
    match given("PAIR").as_deref() {
        Some("paper") => options.pairing = Pairing::PAPER,
        Some(text) => options.pairing = Pairing::Programme { most_triangles: text.parse().expect("2 or 3") },
        None => {}
    }
    if let Some(text) = given("IRREGULARITY") {
        options.irregularity = text.parse().expect("a number");
    }
    if let Some(text) = given("FACES") {
        options.size = Size::TargetFaces(text.parse().expect("a number"));
    }
    options.improve = given("IMPROVE").is_some();
    options
}
