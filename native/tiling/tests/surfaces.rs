//! Surfaces in triangles and quads, judged from outside: topology by counting, angles by adding, shape by measuring.

use mesh::{DVec3, Monitor, PolygonMesh, TriangleMesh};
use std::collections::BTreeMap;
use testkit::{oracle, shapes};
use tiling::{Bar, Fill, Partition, PatchDesign, SurfaceError, SurfaceOptions, SurfaceTiling, tile_surface};

fn tiled(mesh: &PolygonMesh, edge_length: f64) -> SurfaceTiling {
    let surface = TriangleMesh::from_polygons(mesh).0;
    tile_surface(&surface, edge_length, &SurfaceOptions::default(), &Monitor::new()).expect("a sound surface")
}

/// How many faces use each edge, from either side.
fn uses(mesh: &PolygonMesh) -> BTreeMap<[u32; 2], [usize; 2]> {
    let mut uses = BTreeMap::<[u32; 2], [usize; 2]>::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            let (a, b) = (face[k], face[(k + 1) % face.len()]);
            uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    uses
}

/// Angle defects, in units of 30 degrees, that sum to 12 times the Euler characteristic.
fn defect_sum(mesh: &PolygonMesh) -> i64 {
    let on_border: std::collections::BTreeSet<u32> =
        uses(mesh).into_iter().filter(|(_, n)| n[0] + n[1] == 1).flat_map(|(edge, _)| edge).collect();
    let corners: i64 = mesh.faces().map(|face| if face.len() == 3 { 6 } else { 12 }).sum();
    12 * mesh.vertex_count() as i64 - 6 * on_border.len() as i64 - corners
}

fn assert_sound(name: &str, input: &PolygonMesh, edge_length: f64) -> SurfaceTiling {
    let result = tiled(input, edge_length);
    let mesh = &result.mesh;
    assert!(mesh.faces().all(|face| face.len() == 3 || face.len() == 4), "{name}: panels have three or four corners");
    assert!(uses(mesh).values().all(|n| n[0] <= 1 && n[1] <= 1), "{name}: an edge twice in one direction");
    assert_eq!(oracle::euler(mesh), oracle::euler(input), "{name}: Euler characteristic");
    assert_eq!(oracle::components(mesh), oracle::components(input), "{name}: components");
    assert_eq!(defect_sum(mesh), 12 * oracle::euler(input), "{name}: angle defects");
    let listed: i64 = result.defects.iter().map(|&(_, defect)| i64::from(defect)).sum();
    assert_eq!(listed, 12 * oracle::euler(input), "{name}: listed defects");
    assert!(result.turned.is_empty(), "{name}: panels {:?} turned over", result.turned);
    result
}

#[test]
fn closed_surfaces_of_any_step_stay_closed() {
    for edge_length in [0.08, 0.3, 2.0] {
        assert_sound("sphere", &shapes::sphere(8), edge_length);
        assert_sound("box", &shapes::cuboid(DVec3::ONE, 4), edge_length);
    }
    let torus = shapes::torus(2.0, 0.7, 48, 20);
    for edge_length in [0.2, 0.5] {
        let result = assert_sound("torus", &torus, edge_length);
        assert!(oracle::closed_manifold(&result.mesh).is_ok());
    }
}

#[test]
fn a_torus_too_thin_for_its_panels_gets_smaller_ones() {
    let result = assert_sound("thin torus", &shapes::torus(2.0, 0.3, 48, 12), 0.6);
    assert!(result.edge_length < 0.6);
}

/// Standard deviation of the edge lengths over their mean.
fn spread(mesh: &PolygonMesh) -> f64 {
    let lengths: Vec<f64> = uses(mesh)
        .into_keys()
        .map(|edge| edge.map(|v| mesh.positions[v as usize]))
        .map(|[p, q]| p.distance(q))
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    (lengths.iter().map(|l| (l / mean - 1.0).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt()
}

#[test]
fn holes_of_the_size_of_a_panel_leave_panels_alike() {
    // Rows of slits, shorter than two panels, 0.25 of spread before vertices were merged.
    let sheet = shapes::sheet(40, 28);
    let is_hole = |f: usize| [4, 5, 6].contains(&((f % 40) % 10)) && [3, 4, 5].contains(&((f / 40) % 9));
    let faces: Vec<Vec<u32>> =
        sheet.faces().enumerate().filter(|(f, _)| !is_hole(*f)).map(|(_, face)| face.to_vec()).collect();
    let mesh = PolygonMesh::from_polygons(sheet.positions, &faces).expect("a sheet");
    let result = assert_sound("holes", &mesh, 1.5);
    assert!(spread(&result.mesh) < 0.2, "{}", spread(&result.mesh));
    // Narrower than a panel, they lose corners.
    assert_eq!(result.missed_bars().iter().map(|missed| missed.bar).collect::<Vec<_>>(), [Bar::Borders]);
}

#[test]
fn the_tip_of_a_cone_is_kept() {
    let rings =
        (1..=16).flat_map(|k| (0..40).map(move |j| (f64::from(k) / 16.0, f64::from(j) * std::f64::consts::TAU / 40.0)));
    let rim = rings.map(|(r, turn)| DVec3::new(r * turn.cos(), r * turn.sin(), 2.0 - 1.6 * r));
    let tip = DVec3::new(0.0, 0.0, 2.0);
    let positions: Vec<DVec3> = std::iter::once(tip).chain(rim).collect();
    let at = |ring: u32, j: u32| 1 + 40 * ring + j % 40;
    let mut faces: Vec<Vec<u32>> = (0..40).map(|j| vec![0, at(0, j), at(0, j + 1)]).collect();
    faces.extend(
        (0..600).map(|k| (k / 40, k % 40)).map(|(k, j)| vec![at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)]),
    );
    let mesh = PolygonMesh::from_polygons(positions, &faces).expect("a cone");
    let result = assert_sound("cone", &mesh, 0.12);
    let off = result.mesh.positions.iter().map(|p| p.distance(tip)).fold(f64::INFINITY, f64::min);
    assert!(off < 1e-9, "{off}");
    assert_eq!(result.missed_bars(), []);
}

#[test]
fn borders_lie_on_borders_and_corners_stay() {
    let sheet = shapes::sheet(9, 6);
    let low = sheet.positions.iter().fold(DVec3::INFINITY, |l, &p| l.min(p));
    let high = sheet.positions.iter().fold(DVec3::NEG_INFINITY, |h, &p| h.max(p));
    let edge_length = (high - low).max_element() / 20.0;
    let result = assert_sound("sheet", &sheet, edge_length);
    let mesh = &result.mesh;
    let is_on_rim = |p: DVec3| (p.x - low.x).min(high.x - p.x).min(p.y - low.y).min(high.y - p.y).abs() < 1e-9;
    for (edge, n) in uses(mesh) {
        if n[0] + n[1] == 1 {
            assert!(edge.iter().all(|&v| is_on_rim(mesh.positions[v as usize])), "edge {edge:?} off the rim");
        }
    }
    for corner in [low, high, DVec3::new(low.x, high.y, 0.0), DVec3::new(high.x, low.y, 0.0)] {
        let near =
            mesh.positions.iter().map(|p| p.truncate().distance(corner.truncate())).fold(f64::INFINITY, f64::min);
        assert!(near < 1e-9, "no vertex at the corner {corner}");
    }
    // A flat panel is as large as its edges say.
    let area: f64 = result.panels.iter().map(|panel| panel.area).sum();
    assert!((area - (high - low).x * (high - low).y).abs() < 1e-6 * area, "the panels cover {area}");
}

#[test]
fn most_vertices_are_regular_and_most_edges_alike() {
    let result = assert_sound("sphere", &shapes::sphere(16), 0.12);
    let irregular = result.defects.len() as f64 / result.interior_vertices as f64;
    assert!(irregular < 0.08, "{irregular} of the vertices are irregular");
    let lengths: Vec<f64> = result.panels.iter().flat_map(|panel| panel.edges.iter().copied()).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let spread = (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt() / mean;
    assert!(spread < 0.12, "edge lengths vary by {spread}");
    assert!((mean / 0.12 - 1.0).abs() < 0.1, "edges of {mean}");
}

#[test]
fn the_same_call_gives_the_same_mesh() {
    let torus = shapes::torus(2.0, 0.7, 30, 12);
    assert_eq!(tiled(&torus, 0.4).mesh, tiled(&torus, 0.4).mesh);
}

#[test]
fn unusable_input_is_named() {
    let surface = TriangleMesh::from_polygons(&shapes::sphere(4)).0;
    let call = |surface: &TriangleMesh, edge: f64, options: &SurfaceOptions| {
        tile_surface(surface, edge, options, &Monitor::new()).expect_err("unusable")
    };
    let options = SurfaceOptions::default();
    assert!(matches!(call(&surface, f64::NAN, &options), SurfaceError::EdgeLength { .. }));
    assert!(matches!(call(&surface, 1e-9, &options), SurfaceError::TooMany { .. }));
    let marked = SurfaceOptions { marked_edges: vec![[0, 0]], ..options.clone() };
    assert!(matches!(call(&surface, 0.3, &marked), SurfaceError::NoSuchEdge { index: 0 }));
    let mut doubled = surface.clone();
    doubled.triangles.push(doubled.triangles[0]);
    assert!(matches!(call(&doubled, 0.3, &options), SurfaceError::NotManifold { .. }));
    let empty = TriangleMesh { positions: Vec::new(), triangles: Vec::new() };
    assert!(matches!(call(&empty, 0.3, &options), SurfaceError::Empty));
}

#[test]
fn random_patches_keep_what_is_regular_and_differ_by_seed() {
    let sphere = shapes::sphere(12);
    let surface = TriangleMesh::from_polygons(&sphere).0;
    let with = |fill: Fill| {
        let options = SurfaceOptions { fill, ..SurfaceOptions::default() };
        tile_surface(&surface, 0.15, &options, &Monitor::new()).expect("a sphere")
    };
    let regular = with(Fill::Regular);
    let [first, second] = [1, 2].map(|seed| with(Fill::Random { seed, patch_panels: 40 }));
    for random in [&first, &second] {
        assert!(random.changed_patches > 0 && random.patches >= random.changed_patches);
        assert_eq!(random.defects, regular.defects);
        assert_eq!(random.mesh.face_count(), regular.mesh.face_count());
        assert!(oracle::closed_manifold(&random.mesh).is_ok());
        assert!(random.turned.is_empty());
    }
    let corners = |tiling: &SurfaceTiling| tiling.mesh.corner_verts().to_vec();
    assert_ne!(corners(&first), corners(&regular));
    assert_ne!(corners(&first), corners(&second));
}

/// One of six slices of the unit sphere, between two meridians (Fig. 10): its corners at the poles have 60 degrees.
fn slice() -> PolygonMesh {
    let (rows, columns) = (24u32, 8u32);
    let mut positions = vec![DVec3::Z, -DVec3::Z];
    for row in 1..rows {
        let polar = std::f64::consts::PI * f64::from(row) / f64::from(rows);
        for column in 0..=columns {
            let azimuth = std::f64::consts::FRAC_PI_3 * f64::from(column) / f64::from(columns);
            positions.push(DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()));
        }
    }
    let at = |row: u32, column: u32| match row {
        0 => 0,
        row if row == rows => 1,
        row => 2 + (row - 1) * (columns + 1) + column,
    };
    let mut faces = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let corners = [at(row, column), at(row + 1, column), at(row + 1, column + 1), at(row, column + 1)];
            let mut face: Vec<u32> = Vec::new();
            for v in corners {
                if !face.contains(&v) {
                    face.push(v);
                }
            }
            faces.push(face);
        }
    }
    PolygonMesh::from_polygons(positions, &faces).expect("a slice")
}

fn paper() -> SurfaceOptions {
    SurfaceOptions { partition: Partition::Paper, ..SurfaceOptions::default() }
}

/// Half edges are used where they make panels more equal, and every side is near its length then.
#[test]
fn a_slice_of_few_panels_has_sides_of_half_edges() {
    let surface = TriangleMesh::from_polygons(&slice()).0;
    let result = tile_surface(&surface, 0.109, &paper(), &Monitor::new()).expect("a sound surface");
    assert!(!result.halfway_nodes.is_empty(), "no sides of half edges");
    let irregular: Vec<u32> = result.defects.iter().map(|(v, _)| *v).collect();
    let (graph, tiles) = (result.patch_graph.expect("patches"), result.patch_tiles.expect("patches"));
    for node in &result.halfway_nodes {
        assert!(!irregular.contains(node), "node {node} is irregular");
    }
    // Edges that turn by 30 degrees count as they run along their side.
    let along = |course: &[i8]| {
        course.iter().map(|&offset| (f64::from(offset) * std::f64::consts::FRAC_PI_6).cos()).sum::<f64>()
    };
    let error: f64 = graph
        .sides
        .iter()
        .zip(&tiles.courses)
        .map(|(side, course)| (along(course), side.length() / result.edge_length))
        .map(|(edges, wanted)| (edges - wanted).powi(2) / wanted)
        .sum();
    assert!(error < 1.5, "the lengths err by {error}");
}

/// Divides the parts of a design until all are flat, with so many nodes of 30 degrees inside: the best proposals first.
fn divided(design: &PatchDesign, patches: usize, tried: &mut usize) -> Option<PatchDesign> {
    let defects = design.defects();
    let Some(part) = defects.iter().position(|&defect| defect != 0) else {
        let graph = design.patch_graph()?;
        let inner = graph.node_defects().into_iter().filter(|&defect| defect == 1).count();
        return (defects.len() == patches && inner == 4).then(|| design.clone());
    };
    *tried += 1;
    if *tried > 60 {
        return None;
    }
    let proposals = design.admissible_partitions(part, &Monitor::new()).expect("not cancelled");
    // As the paper's figure: halves of equal defect, then three flat parts about a point.
    let wanted = |defects: &[i32]| match defects {
        [a, b] => a == b && 2 * a == design.defects()[part],
        [0, 0, 0] => true,
        _ => false,
    };
    for proposal in proposals.iter().filter(|proposal| wanted(&proposal.defects)).take(6) {
        if let Some(found) = divided(&design.divided(part, proposal), patches, tried) {
            return Some(found);
        }
    }
    None
}

#[test]
fn the_slice_of_figure_10_has_twelve_patches_and_four_vertices_of_30_degrees() {
    let surface = TriangleMesh::from_polygons(&slice()).0;
    let design = PatchDesign::new(&surface, 0.04, &paper(), &Monitor::new()).expect("a slice");
    // Two corners of 60 degrees: a total interior defect of 120.
    assert_eq!(design.c_indices(), [[2, 2]]);
    assert_eq!(design.defects(), [4]);
    let found = divided(&design, 12, &mut 0).expect("the paper's partition");
    let graph = found.patch_graph().expect("all parts are flat");
    assert_eq!(graph.patches.len(), 12);
    let defects = graph.node_defects();
    assert_eq!(defects.iter().filter(|&&defect| defect == 1).count(), 4);
    // The corners at the poles have 60 of 180 degrees; nothing else is irregular.
    assert_eq!(defects.iter().filter(|&&defect| defect == 4).count(), 2);
    assert_eq!(defects.iter().sum::<i32>(), 12);
    assert_eq!(graph.euler_characteristic(), 1);
}

#[test]
fn the_papers_partition_is_flat_and_its_defects_sum_up() {
    for (name, mesh, edge_length) in [("slice", slice(), 0.12), ("sheet", shapes::sheet(9, 6), 0.5)] {
        let surface = TriangleMesh::from_polygons(&mesh).0;
        let result = tile_surface(&surface, edge_length, &paper(), &Monitor::new()).expect("a sound surface");
        let graph = result.patch_graph.as_ref().unwrap_or_else(|| panic!("{name}: no partition was found"));
        assert!(graph.patches.iter().all(|patch| patch.total_interior_defect() == 0), "{name}");
        assert_eq!(i64::from(graph.node_defects().iter().sum::<i32>()), 12 * oracle::euler(&mesh), "{name}");
        assert_eq!(graph.euler_characteristic(), oracle::euler(&mesh), "{name}");
        assert!(uses(&result.mesh).values().all(|n| n[0] <= 1 && n[1] <= 1), "{name}: an edge twice in one direction");
        assert_eq!(oracle::euler(&result.mesh), oracle::euler(&mesh), "{name}");
        assert_eq!(defect_sum(&result.mesh), 12 * oracle::euler(&mesh), "{name}");
        assert!(result.turned.is_empty(), "{name}: panels {:?} turned over", result.turned);
        // Inside, vertices are irregular at nodes only.
        let inner = result.defects.iter().filter(|(v, _)| *v as usize >= graph.nodes.len()).count();
        let on_border: std::collections::BTreeSet<u32> =
            uses(&result.mesh).into_iter().filter(|(_, n)| n[0] + n[1] == 1).flat_map(|(edge, _)| edge).collect();
        let irregular = result.defects.iter().filter(|(v, _)| !on_border.contains(v)).count();
        assert!(
            irregular <= graph.nodes.len() && (irregular as f64) < 0.08 * result.interior_vertices as f64,
            "{name}"
        );
        assert!(inner <= on_border.len(), "{name}");
        assert!(result.patches_with_rhombi.is_empty(), "{name}");
    }
}

#[test]
fn the_caller_sets_c_indices() {
    // A sheet whose corners are made 60 and 120 degrees is laid in triangles.
    let sheet = shapes::sheet(9, 6);
    let surface = TriangleMesh::from_polygons(&sheet).0;
    let low = sheet.positions.iter().fold(DVec3::INFINITY, |l, &p| l.min(p));
    let high = sheet.positions.iter().fold(DVec3::NEG_INFINITY, |h, &p| h.max(p));
    let at = |x: f64, y: f64| {
        let near = |p: &DVec3| (p.x - x).abs() + (p.y - y).abs() < 1e-9;
        sheet.positions.iter().position(near).expect("a corner") as u32
    };
    let corners = vec![(at(low.x, low.y), 2), (at(high.x, low.y), 4), (at(high.x, high.y), 2), (at(low.x, high.y), 4)];
    let options = SurfaceOptions { corners, ..paper() };
    let result = tile_surface(&surface, 0.6, &options, &Monitor::new()).expect("a sheet");
    let graph = result.patch_graph.expect("a partition");
    let mut found: Vec<u8> = graph.patches[0].corners.iter().map(|corner| corner.c_index).filter(|&c| c != 6).collect();
    found.sort_unstable();
    assert_eq!(found, [2, 2, 4, 4]);
    assert!(result.panels.iter().all(|panel| panel.kind == tiling::Kind::Triangle));
}
