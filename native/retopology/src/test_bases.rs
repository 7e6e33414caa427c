//! Base triangulations that are known by construction: coarse meshes divided and laid over shapes.

use crate::base::{Base, BaseEdge};
use mesh::{DVec3, PolygonMesh, TriangleMesh};
use testkit::coarse::divide;
use testkit::shapes;

/// A triangulated mesh, its triangles divided `n` times and moved by `shape`; edges that bend by more than `crease` radians
/// are features, a chain each, as are borders.
pub(crate) fn base(mesh: &PolygonMesh, n: u32, crease: f64, shape: &dyn Fn(DVec3) -> DVec3) -> Base {
    let divided = divide(&shapes::triangulated(mesh), n, shape);
    let surface = TriangleMesh { positions: divided.positions, triangles: divided.triangles };
    let mut base = Base {
        source: (0..surface.triangles.len() as u32).collect(),
        owner: divided.owner,
        vertices: (0..mesh.vertex_count() as u32).collect(),
        edges: divided.edges.into_iter().map(|(ends, path)| BaseEdge { ends, path, feature: None }).collect(),
        triangle_edges: divided.triangle_edges,
        triangles: divided.coarse,
        surface,
    };
    let mut sides = vec![Vec::new(); base.edges.len()];
    for (t, edges) in base.triangle_edges.iter().enumerate() {
        let p = base.triangles[t].map(|v| base.surface.positions[v as usize]);
        for &e in edges {
            sides[e as usize].push((p[1] - p[0]).cross(p[2] - p[0]));
        }
    }
    for (e, sides) in sides.iter().enumerate() {
        base.edges[e].feature = (sides.len() < 2 || sides[0].angle_between(sides[1]) > crease).then_some(e as u32);
    }
    base
}

fn polyhedron(points: &[[f64; 3]], faces: &[[u32; 3]]) -> PolygonMesh {
    PolygonMesh::from_polygons(points.iter().map(|&p| DVec3::from_array(p)).collect(), faces).expect("known faces")
}

pub(crate) fn octahedron() -> PolygonMesh {
    let points = [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let top = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let bottom = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    polyhedron(&points, &[top, bottom].concat())
}

pub(crate) fn tetrahedron() -> PolygonMesh {
    let points = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
    polyhedron(&points, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
}

/// A square as a fan of seven triangles, whose quads from pairs have irregular vertices that a square needs not.
pub(crate) fn fan() -> PolygonMesh {
    let border = [[0., 0.], [3., 0.], [4., 0.], [4., 1.5], [4., 4.], [1., 4.], [0., 4.]];
    let mut points: Vec<[f64; 3]> = border.iter().map(|&[x, y]| [x, y, 0.0]).collect();
    points.push([2.5, 1.5, 0.0]);
    let faces: Vec<[u32; 3]> = (0..7).map(|k| [k, (k + 1) % 7, 7]).collect();
    polyhedron(&points, &faces)
}

/// A box with a square hole through it: genus 1, all edges features.
pub(crate) fn frame(holes: u32) -> PolygonMesh {
    // Cells of a plate, all solid but the middle ones; its outer faces are the frame.
    let width = 2 * holes + 1;
    let solid = |i: i64, j: i64, k: i64| {
        let inside = (0..i64::from(width)).contains(&i) && (0..3).contains(&j) && k == 0;
        inside && !(j == 1 && i % 2 == 1)
    };
    let (mut points, mut faces) = (std::collections::BTreeMap::new(), Vec::<[u32; 4]>::new());
    for i in 0..i64::from(width) {
        for j in 0..3 {
            if !solid(i, j, 0) {
                continue;
            }
            for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)] {
                let mut beyond = [i, j, 0];
                beyond[axis] += sign;
                if solid(beyond[0], beyond[1], beyond[2]) {
                    continue;
                }
                let mut face = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                    let mut at = [i, j, 0];
                    at[axis] += i64::from(sign > 0);
                    at[(axis + 1) % 3] += u;
                    at[(axis + 2) % 3] += v;
                    let next = points.len() as u32;
                    *points.entry(at).or_insert(next)
                });
                if sign < 0 {
                    face.reverse();
                }
                faces.push(face);
            }
        }
    }
    let mut positions = vec![DVec3::ZERO; points.len()];
    for (at, index) in points {
        positions[index as usize] = DVec3::from_array(at.map(|x| x as f64));
    }
    PolygonMesh::from_polygons(positions, &faces).expect("known faces")
}

/// One of each kind: closed and open, smooth and sharp, of genus 0 to 2.
pub(crate) fn all() -> Vec<(&'static str, Base)> {
    let plain = |p: DVec3| p;
    vec![
        ("cube", base(&shapes::cuboid(DVec3::splat(2.0), 1), 8, 0.5, &plain)),
        ("tetrahedron", base(&tetrahedron(), 10, 0.5, &plain)),
        ("octahedron", base(&octahedron(), 10, 0.5, &plain)),
        ("ball", base(&octahedron(), 12, 4.0, &DVec3::normalize)),
        ("egg", base(&shapes::cuboid(DVec3::splat(2.0), 2), 6, 4.0, &|p| p.normalize() * DVec3::new(1.0, 1.3, 1.9))),
        ("torus", base(&shapes::torus(2.0, 0.7, 7, 5), 5, 4.0, &plain)),
        ("sheet", base(&shapes::sheet(3, 2), 5, 4.0, &|p| p + DVec3::Z * (p.x * p.y * 0.2))),
        ("cylinder", base(&shapes::cylinder(1.0, 3.0, 2, 2), 5, 0.9, &plain)),
        ("frame", base(&frame(1), 4, 0.5, &plain)),
        ("double frame", base(&frame(2), 4, 0.5, &plain)),
    ]
}
