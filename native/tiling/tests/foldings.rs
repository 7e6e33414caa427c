//! Foldings (section 5.1, Fig. 15), judged from outside: lengths measured, topology counted.

use mesh::{Monitor, PolygonMesh};
use std::collections::BTreeSet;
use testkit::oracle;
use tiling::{Boundary, FoldError, FoldOptions, Folding, Gluing, Options, find_tiling, fold};

/// A tiling of an outline given by its sides: direction in units of 30 degrees, and length.
fn tiling(sides: &[(u8, usize)]) -> PolygonMesh {
    let directions: Vec<u8> = sides.iter().flat_map(|&(d, n)| std::iter::repeat_n(d, n)).collect();
    let n = directions.len();
    let code: Vec<u8> = (0..n).map(|k| (18 + directions[(k + n - 1) % n] - directions[k]) % 12).collect();
    let boundary = Boundary::new(&code).expect("an outline");
    let found = find_tiling(&boundary, 1, &Options::default(), &Monitor::new()).expect("not cancelled");
    found.expect("a tiling").mesh(1.0)
}

fn folded(sheet: &PolygonMesh, cut: &[u32], gluings: &[Gluing]) -> Folding {
    fold(sheet, cut, gluings, &FoldOptions::default(), &Monitor::new()).expect("a folding")
}

fn at(mesh: &PolygonMesh, x: f64, y: f64) -> u32 {
    let off = |v: usize| (mesh.positions[v].x - x).hypot(mesh.positions[v].y - y);
    let nearest = (0..mesh.vertex_count()).min_by(|&a, &b| off(a).total_cmp(&off(b))).expect("vertices");
    assert!(off(nearest) < 1e-9, "no vertex at ({x}, {y})");
    nearest as u32
}

/// All edges one length, all squares square: measured.
fn assert_regular(name: &str, result: &Folding) {
    let mesh = &result.mesh;
    let edges = mesh.faces().flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]]));
    let diagonals = mesh.faces().filter(|f| f.len() == 4).flat_map(|f| [[f[0], f[2]], [f[1], f[3]]]);
    let length = |[a, b]: [u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let off = edges
        .map(|e| (length(e) - 1.0).abs())
        .chain(diagonals.map(|d| (length(d) - 2f64.sqrt()).abs()))
        .fold(0.0, f64::max);
    if let Ok(folder) = std::env::var("FOLDINGS_OUT") {
        std::fs::write(format!("{folder}/{name}.obj"), testkit::obj::write(mesh)).expect("a folder");
    }
    assert!(off < 1e-6, "{name}: off by {off} edges; said {}", result.irregularity);
    assert!(result.is_regular());
}

#[test]
fn a_hexagon_without_a_sixth_becomes_a_pyramid() {
    // A hexagon of triangles, side 4, with the wedge from its centre to two corners cut out and zipped: five sixths of a cone.
    let sheet = tiling(&[(0, 4), (2, 4), (4, 4), (6, 4), (8, 4), (10, 4)]);
    let centre = at(&sheet, 2.0, 12f64.sqrt());
    let wedge: Vec<u32> = (0..sheet.face_count())
        .filter(|&f| {
            let c = sheet.face_points(f).sum::<mesh::DVec3>() / 3.0 - sheet.positions[centre as usize];
            (-60.0..0.0).contains(&c.y.atan2(c.x).to_degrees())
        })
        .map(|f| f as u32)
        .collect();
    assert_eq!(wedge.len(), 16);
    let result = folded(&sheet, &wedge, &[Gluing::Zip { vertex: centre, edges: 4 }]);
    assert_regular("pyramid", &result);
    assert_eq!(oracle::euler(&result.mesh), 1);
    assert_eq!(result.mesh.face_count(), 80);
    assert!(result.defects.iter().any(|&(v, d)| v == result.vertex_of[centre as usize] && d == 2));
    // It left the plane: the tip stands above its neighbours.
    let spread = result.mesh.positions.iter().map(|p| p.z).fold(0.0, |a: f64, z| a.max(z.abs()));
    assert!(spread > 0.5, "it is flat");
}

#[test]
fn a_strip_becomes_a_tube() {
    // Rows of squares and of triangles in turn, so that the tube has a lattice of both.
    let sheet = tiling(&[(0, 12), (3, 1), (2, 1), (3, 1), (6, 12), (9, 1), (8, 1), (9, 1)]);
    let [a, b, c, d] = [
        at(&sheet, 0.0, 0.0),
        at(&sheet, 0.5, 2.0 + 0.75f64.sqrt()),
        at(&sheet, 12.0, 0.0),
        at(&sheet, 12.5, 2.0 + 0.75f64.sqrt()),
    ];
    // The left side runs with faces on its right from a to b; the right side from c to d with faces on its left.
    let result = folded(&sheet, &[], &[Gluing::Runs([c, d, a, b])]);
    assert_regular("tube", &result);
    assert_eq!(oracle::euler(&result.mesh), 0);
    assert!(result.defects.iter().all(|&(_, defect)| defect == 0), "a tube is flat within");
    let vertices = sheet.vertex_count() - 4;
    assert_eq!(result.mesh.vertex_count(), vertices);
}

#[test]
fn a_net_becomes_a_cube() {
    // The cross of six squares of two by two.
    let sheet =
        tiling(&[(0, 2), (3, 2), (0, 2), (3, 2), (6, 2), (3, 4), (6, 2), (9, 4), (6, 2), (9, 2), (0, 2), (9, 2)]);
    let p = |x: f64, y: f64| at(&sheet, x, y);
    // Seven edges of the cube, as zips at concave corners and runs between what is left.
    let gluings = [
        Gluing::Zip { vertex: p(2.0, 2.0), edges: 2 },
        Gluing::Zip { vertex: p(0.0, 2.0), edges: 2 },
        Gluing::Zip { vertex: p(2.0, 4.0), edges: 2 },
        Gluing::Zip { vertex: p(0.0, 4.0), edges: 2 },
        Gluing::Runs([p(4.0, 2.0), p(4.0, 4.0), p(2.0, 8.0), p(2.0, 6.0)]),
        Gluing::Runs([p(-2.0, 4.0), p(-2.0, 2.0), p(0.0, 6.0), p(0.0, 8.0)]),
        Gluing::Runs([p(0.0, 0.0), p(2.0, 0.0), p(0.0, 8.0), p(2.0, 8.0)]),
    ];
    let result = folded(&sheet, &[], &gluings);
    assert_regular("cube", &result);
    assert!(oracle::closed_manifold(&result.mesh).is_ok());
    assert_eq!(oracle::euler(&result.mesh), 2);
    assert_eq!(result.mesh.vertex_count(), 26);
    assert_eq!(result.defects.iter().map(|d| d.1).collect::<Vec<_>>(), [3; 8]);
    // A cube of two by two squares: no other closed shape has these corners.
    let corners: Vec<_> = result.defects.iter().map(|d| result.mesh.positions[d.0 as usize]).collect();
    let widest = corners.iter().flat_map(|p| corners.iter().map(move |q| p.distance(*q))).fold(0.0, f64::max);
    assert!((widest - 12f64.sqrt()).abs() < 1e-6, "its corners are {widest} apart");
}

#[test]
fn what_cannot_be_glued_is_named() {
    let sheet = tiling(&[(0, 3), (3, 2), (6, 3), (9, 2)]);
    let p = |x: f64, y: f64| at(&sheet, x, y);
    let refused = |cut: &[u32], gluings: &[Gluing]| {
        fold(&sheet, cut, gluings, &FoldOptions::default(), &Monitor::new()).expect_err("impossible")
    };
    let row = |y: f64| vec![p(0.0, y), p(1.0, y), p(2.0, y), p(3.0, y)];
    let column = |x: f64| vec![p(x, 0.0), p(x, 1.0), p(x, 2.0)];
    let vertices = Gluing::Vertices;
    assert!(matches!(
        refused(&[], &[vertices(row(0.0), column(0.0))]),
        FoldError::Lengths { gluing: 0, first: 3, second: 2 }
    ));
    let backwards: Vec<u32> = row(2.0).into_iter().rev().collect();
    assert!(matches!(refused(&[], &[vertices(row(0.0), backwards)]), FoldError::Orientation { gluing: 0, .. }));
    assert!(matches!(refused(&[], &[vertices(row(1.0), row(2.0))]), FoldError::NotAnEdge { gluing: 0, .. }));
    let tube = vertices(row(0.0), row(2.0));
    assert!(matches!(refused(&[], &[tube.clone(), tube.clone()]), FoldError::Twice { gluing: 1, .. }));
    // A torus of two by three squares has edges that join the same two vertices: no mesh.
    assert!(matches!(refused(&[], &[tube, vertices(column(0.0), column(3.0))]), FoldError::NoSurface { .. }));
    assert!(matches!(
        refused(&[], &[Gluing::Zip { vertex: p(1.0, 1.0), edges: 1 }]),
        FoldError::NotOnBorder { gluing: 0, .. }
    ));
    assert!(matches!(refused(&[9], &[]), FoldError::NoSuchFace { face: 9, count: 6 }));
    assert!(matches!(refused(&[0, 1, 2, 3, 4, 5], &[]), FoldError::Nothing));
    let mut crooked = sheet.clone();
    crooked.positions[0].x -= 0.2;
    let error = fold(&crooked, &[], &[], &FoldOptions::default(), &Monitor::new()).expect_err("no tiling");
    assert!(matches!(error, FoldError::NotTiles { faces } if faces.len() == 1));
    let used: BTreeSet<u32> = sheet.corner_verts().iter().copied().collect();
    assert_eq!(used.len(), 12);
}
