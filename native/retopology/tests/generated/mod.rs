//! Surfaces with features that a seed repeats, for tests that want many.

use mesh::{DVec3, PolygonMesh, TriangleMesh, sorted};
use retopology::features::Features;
use std::collections::{BTreeMap, BTreeSet};
use testkit::random::Random;
use testkit::shapes;

/// A block of `columns` by `rows` cells, some of them holes through it, each divided into `n` by `n` by `n`.
pub fn punched_block(columns: i32, rows: i32, holes: &BTreeSet<(i32, i32)>, n: i32) -> PolygonMesh {
    let solid = |[x, y, z]: [i32; 3]| {
        let inside = (0..columns * n).contains(&x) && (0..rows * n).contains(&y) && (0..n).contains(&z);
        inside && !holes.contains(&(x.div_euclid(n), y.div_euclid(n)))
    };
    let cells = (0..columns * n).flat_map(|x| (0..rows * n).flat_map(move |y| (0..n).map(move |z| [x, y, z])));
    let (mut verts, mut positions, mut faces) = (BTreeMap::new(), Vec::new(), Vec::new());
    for cell in cells.filter(|&cell| solid(cell)) {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beyond = cell;
            beyond[axis] += 2 * side - 1;
            if solid(beyond) {
                continue;
            }
            let mut face = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                let mut at = cell;
                at[axis] += side;
                at[(axis + 1) % 3] += u;
                at[(axis + 2) % 3] += v;
                *verts.entry(at).or_insert_with(|| {
                    positions.push(DVec3::from_array(at.map(f64::from)) / f64::from(n));
                    positions.len() as u32 - 1
                })
            });
            if side == 0 {
                face.reverse();
            }
            faces.push(face);
        }
    }
    PolygonMesh::from_polygons(positions, faces).expect("indices in range by construction")
}

/// Edges where faces turn by more than 40 degrees.
pub fn sharp(mesh: &PolygonMesh) -> Features {
    let (triangles, _) = TriangleMesh::from_polygons(mesh);
    let mut normals = BTreeMap::<[u32; 2], Vec<DVec3>>::new();
    for (t, [a, b, c]) in triangles.triangles.iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            normals.entry(sorted(*p, *q)).or_default().push(triangles.area_normal(t));
        }
    }
    let turns = |n: &[DVec3]| n.len() == 2 && n[0].angle_between(n[1]) > 0.7;
    Features { edges: normals.into_iter().filter(|(_, n)| turns(n)).map(|(e, _)| e).collect(), vertices: vec![] }
}

/// A sheet with holes that do not touch, where `open` says so.
fn holed_sheet(size: u32, mut open: impl FnMut() -> bool) -> PolygonMesh {
    let sheet = shapes::sheet(size, size);
    let can_open = |f: u32| (f / size) % 3 == 1 && (f % size) % 3 == 1 && f / size + 1 < size && f % size + 1 < size;
    let kept: Vec<Vec<u32>> =
        sheet.faces().zip(0..).filter(|&(_, f)| !(can_open(f) && open())).map(|(face, _)| face.to_vec()).collect();
    PolygonMesh::from_polygons(sheet.positions.clone(), kept).expect("indices in range")
}

/// A shape of one of five kinds: sphere, torus, block with tunnels, sheet with holes, several components.
fn random_shape(kind: u32, n: i32, random: &mut Random) -> PolygonMesh {
    let mut holes = |columns: i32, rows: i32| -> BTreeSet<(i32, i32)> {
        let all = (1..columns - 1).step_by(2).flat_map(|x| (1..rows - 1).step_by(2).map(move |y| (x, y)));
        all.filter(|_| random.unit() < 0.7).collect()
    };
    let far =
        |mesh: PolygonMesh, x: f64| mesh.with_positions(mesh.positions.iter().map(|p| *p + DVec3::X * x).collect());
    match kind {
        0 => shapes::sphere(2 * n as u32 + 1),
        1 => shapes::torus(1.0, random.between(0.1, 0.8), 5 + random.index(30) as u32, 4 + random.index(12) as u32),
        2 => punched_block(9, 7, &holes(9, 7), n.min(2)),
        3 => holed_sheet(6 + 4 * n as u32, || random.unit() < 0.5),
        _ => shapes::joined(&[
            shapes::sphere(n as u32 + 1),
            far(punched_block(5, 5, &holes(5, 5), n), 10.0),
            far(shapes::sheet(3, 5), 30.0),
        ]),
    }
}

/// Triangles of a [`random_shape`] whose vertices are moved by up to `rough` of the shortest edge, with `marks` 0 for no
/// features, 1 for the sharp edges, 2 for those with some edges and a vertex more.
pub fn marked_shape(kind: u32, n: i32, marks: u32, rough: f64, random: &mut Random) -> (PolygonMesh, Features) {
    let mesh = random_shape(kind, n, random);
    let mut features = if marks == 0 { Features::default() } else { sharp(&mesh) };
    let mesh = shapes::triangulated(&mesh);
    if marks == 2 {
        let mut edges: BTreeSet<[u32; 2]> = features.edges.iter().copied().collect();
        for _ in 0..random.index(30) {
            let t = mesh.face(random.index(mesh.face_count()));
            let k = random.index(3);
            edges.insert(sorted(t[k], t[(k + 1) % 3]));
        }
        features.edges = edges.into_iter().collect();
        features.vertices = vec![mesh.face(random.index(mesh.face_count()))[0]];
    }
    let length = |f: usize| {
        let points: Vec<DVec3> = mesh.face_points(f).collect();
        (0..3).map(|k| points[k].distance(points[(k + 1) % 3])).fold(f64::INFINITY, f64::min)
    };
    let shortest = (0..mesh.face_count()).map(length).fold(f64::INFINITY, f64::min);
    let mut shake = || DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    let positions = mesh.positions.iter().map(|&p| p + shake() * rough * shortest).collect();
    (mesh.with_positions(positions), features)
}
