//! Quads on generated bases, as OBJ files in the folder given.
use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use retopology::base::{Base, BaseEdge};
use retopology::{LayoutOptions, quads_from_base};
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
    let cases = [
        ("cube", base(divide(&triangles(&shapes::cuboid(DVec3::splat(2.0), 1)), 12, |p| p), 0.5)),
        ("box", base(divide(&triangles(&shapes::cuboid(DVec3::new(1.0, 2.0, 4.0), 2)), 8, |p| p), 0.5)),
        ("ball", base(divide(&triangles(&shapes::cuboid(DVec3::splat(2.0), 2)), 12, DVec3::normalize), 4.0)),
        ("torus", base(divide(&triangles(&shapes::torus(2.0, 0.7, 12, 6)), 6, |p| p), 4.0)),
        ("sheet", base(divide(&triangles(&shapes::sheet(3, 2)), 6, |p| p + DVec3::Z * (p.x * p.y * 0.2)), 4.0)),
        ("cylinder", base(divide(&triangles(&shapes::cylinder(1.0, 3.0, 2, 2)), 6, |p| p), 0.9)),
    ];
    for (name, base) in cases {
        let quads = quads_from_base(&base, &LayoutOptions::default(), &Monitor::new()).expect(name);
        let report = &quads.report;
        println!(
            "{name}: {} faces, {} patches, {} singles, {} irregular, {} inverted, {:?}",
            report.faces, report.patches, report.singles, report.irregular, report.inverted, report.seconds
        );
        std::fs::write(format!("{folder}/{name}.obj"), obj::write(&quads.mesh)).expect("the folder can be written");
    }
}
