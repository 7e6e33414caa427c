//! Small meshes and oracles for the tests of this crate.

use glam::DVec3;
use mesh::TriangleMesh;
use std::collections::BTreeMap;

/// A grid of `columns` x `rows` squares, each split in two, its vertices placed by `place(column, row)`;
/// vertex (i, j) is `j * (columns + 1) + i`.
pub fn grid(columns: u32, rows: u32, place: impl Fn(f64, f64) -> DVec3) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            mesh.positions.push(place(f64::from(i), f64::from(j)));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let c = a + columns + 1;
            mesh.triangles.push([a, a + 1, c + 1]);
            mesh.triangles.push([a, c + 1, c]);
        }
    }
    mesh
}

/// A unit sphere of `meridians` x `parallels` strips: vertex 0 is the north pole, the last the south pole, ring `r`
/// (from 1) starts at `1 + (r - 1) * meridians`.
pub fn sphere(meridians: u32, parallels: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh { positions: vec![DVec3::Z], triangles: vec![] };
    for r in 1..parallels {
        let polar = std::f64::consts::PI * f64::from(r) / f64::from(parallels);
        for m in 0..meridians {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(m) / f64::from(meridians)).sin_cos();
            mesh.positions.push(DVec3::new(polar.sin() * cos, polar.sin() * sin, polar.cos()));
        }
    }
    let south = mesh.positions.len() as u32;
    mesh.positions.push(DVec3::NEG_Z);
    let at = |r: u32, m: u32| 1 + (r - 1) * meridians + m % meridians;
    for m in 0..meridians {
        mesh.triangles.push([0, at(1, m), at(1, m + 1)]);
        for r in 1..parallels - 1 {
            mesh.triangles.push([at(r, m), at(r + 1, m), at(r + 1, m + 1)]);
            mesh.triangles.push([at(r, m), at(r + 1, m + 1), at(r, m + 1)]);
        }
        mesh.triangles.push([at(parallels - 1, m), south, at(parallels - 1, m + 1)]);
    }
    mesh
}

/// What an independent count says of a mesh.
#[derive(Debug, PartialEq, Eq)]
pub struct Census {
    pub euler: i64,
    pub border_edges: usize,
    /// Edges of more than two triangles, or of two that run the same way.
    pub bad_edges: usize,
    /// Vertices whose triangles do not form one fan.
    pub bad_vertices: usize,
}

/// Counts vertices, edges and faces, and the fans round each vertex, from the triangle list alone.
pub fn census(mesh: &TriangleMesh) -> Census {
    let mut directed: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut links: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
    for &[a, b, c] in &mesh.triangles {
        assert!(a != b && b != c && c != a, "a triangle repeats a vertex");
        for (u, v, w) in [(a, b, c), (b, c, a), (c, a, b)] {
            *directed.entry((u, v)).or_default() += 1;
            links.entry(u).or_default().push((v, w));
        }
    }
    let mut edges = BTreeMap::new();
    for (&(a, b), &count) in &directed {
        edges.entry((a.min(b), a.max(b))).or_insert_with(Vec::new).push(count);
    }
    let bad_edges = edges.values().filter(|counts| counts.iter().any(|&c| c > 1)).count();
    let border_edges = edges.values().filter(|counts| counts.as_slice() == [1]).count();
    let bad_vertices = links.values().filter(|link| !is_one_path(link)).count();
    let euler = links.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64;
    Census { euler, border_edges, bad_edges, bad_vertices }
}

/// True when the segments chain up into one path or one loop.
fn is_one_path(segments: &[(u32, u32)]) -> bool {
    let next: BTreeMap<u32, u32> = segments.iter().copied().collect();
    let ends: std::collections::BTreeSet<u32> = segments.iter().map(|s| s.1).collect();
    let start = segments.iter().map(|s| s.0).find(|v| !ends.contains(v)).unwrap_or(segments[0].0);
    let mut walked = 0;
    let mut v = start;
    while let Some(&w) = next.get(&v) {
        walked += 1;
        v = w;
        if v == start || walked > segments.len() {
            break;
        }
    }
    walked == segments.len()
}

/// The least angle of any triangle, degrees.
pub fn minimum_angle(mesh: &TriangleMesh) -> f64 {
    let mut least = f64::INFINITY;
    for t in 0..mesh.triangles.len() {
        let p = mesh.points(t);
        for k in 0..3 {
            let angle = (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
            least = least.min(if angle.is_nan() { 0.0 } else { angle.to_degrees() });
        }
    }
    least
}

/// Cuts a mesh by a plane; returns the edges on the cut. Tiny triangles appear wherever the plane passes near a vertex.
pub fn cut(mesh: &TriangleMesh, normal: DVec3, offset: f64) -> (TriangleMesh, Vec<[u32; 2]>) {
    let height: Vec<f64> = mesh.positions.iter().map(|p| p.dot(normal) - offset).collect();
    assert!(height.iter().all(|h| *h != 0.0));
    let mut out = TriangleMesh { positions: mesh.positions.clone(), triangles: vec![] };
    let mut on_edge = BTreeMap::new();
    let mut curve = Vec::new();
    for &triangle in &mesh.triangles {
        let above = triangle.map(|v| height[v as usize] > 0.0);
        let Some(odd) = (0..3).find(|&k| above[k] != above[(k + 1) % 3] && above[k] != above[(k + 2) % 3]) else {
            out.triangles.push(triangle);
            continue;
        };
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(odd + k) % 3]);
        let mut crossing = |u: u32, v: u32| {
            *on_edge.entry((u.min(v), u.max(v))).or_insert_with(|| {
                let (hu, hv) = (height[u as usize], height[v as usize]);
                out.positions.push((out.positions[u as usize] * hv - out.positions[v as usize] * hu) / (hv - hu));
                out.positions.len() as u32 - 1
            })
        };
        let (p, q) = (crossing(a, b), crossing(a, c));
        out.triangles.extend([[a, p, q], [p, b, c], [p, c, q]]);
        curve.push([p, q]);
    }
    (out, curve)
}

/// Splits every seventh triangle by a vertex that lies almost on one of its edges.
pub fn insert_slivers(mesh: &mut TriangleMesh) {
    for t in (0..mesh.triangles.len()).step_by(7) {
        let [a, b, c] = mesh.triangles[t];
        let [p, q, r] = mesh.points(t);
        let squeeze = if t % 2 == 0 { 1e-6 } else { 0.0 };
        let m = mesh.positions.len() as u32;
        mesh.positions.push(p * (0.4 - squeeze) + q * 0.6 + r * squeeze);
        mesh.triangles[t] = [a, b, m];
        mesh.triangles.extend([[b, c, m], [c, a, m]]);
    }
}
