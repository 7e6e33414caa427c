//! Triangulated regions of the plane with given border vertices, to lift onto curved surfaces.

use glam::{DVec2, DVec3};
use mesh::TriangleMesh;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::f64::consts::TAU;

struct Site {
    at: Point2<f64>,
    index: u32,
}

impl HasPosition for Site {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Triangulates the inside of simple loops (the outer one and holes, any direction) with their vertices as the only border
/// vertices, in order, followed by a triangular lattice of about the loops' mean edge length. `lift` places each point.
///
/// # Panics
/// When loops cross each other.
pub fn plane_region(loops: &[Vec<DVec2>], lift: impl Fn(DVec2) -> DVec3) -> TriangleMesh {
    let edges: Vec<[DVec2; 2]> =
        loops.iter().flat_map(|l| (0..l.len()).map(move |k| [l[k], l[(k + 1) % l.len()]])).collect();
    let spacing = edges.iter().map(|[a, b]| a.distance(*b)).sum::<f64>() / edges.len() as f64;
    let inside = |p: DVec2| {
        let crossings = edges
            .iter()
            .filter(|[a, b]| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x));
        crossings.count() % 2 == 1
    };
    let clearance = |p: DVec2| {
        let to = |[a, b]: &[DVec2; 2]| {
            let t = ((p - *a).dot(*b - *a) / a.distance_squared(*b)).clamp(0.0, 1.0);
            p.distance(a.lerp(*b, t))
        };
        edges.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    let mut points: Vec<DVec2> = loops.concat();
    let low = points.iter().fold(DVec2::INFINITY, |l, &p| l.min(p));
    let high = points.iter().fold(DVec2::NEG_INFINITY, |h, &p| h.max(p));
    let row = spacing * 0.75_f64.sqrt();
    for j in 0..=((high.y - low.y) / row) as usize {
        for i in 0..=((high.x - low.x) / spacing) as usize {
            let p = low + DVec2::new((i as f64 + 0.5 * (j % 2) as f64 + 0.23) * spacing, (j as f64 + 0.37) * row);
            if inside(p) && clearance(p) > 0.6 * spacing {
                points.push(p);
            }
        }
    }
    let mut delaunay = ConstrainedDelaunayTriangulation::<Site>::new();
    let handles: Vec<_> = points
        .iter()
        .enumerate()
        .map(|(k, p)| delaunay.insert(Site { at: Point2::new(p.x, p.y), index: k as u32 }).expect("finite points"))
        .collect();
    let mut first = 0;
    for l in loops {
        for k in 0..l.len() {
            delaunay.add_constraint(handles[first + k], handles[first + (k + 1) % l.len()]);
        }
        first += l.len();
    }
    let mut triangles: Vec<[u32; 3]> = delaunay
        .inner_faces()
        .map(|face| face.vertices().map(|v| v.data().index))
        .filter(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            // Rounding leaves slivers along straight sides.
            (b - a).perp_dot(c - a) > 1e-6 * spacing * spacing && inside((a + b + c) / 3.0)
        })
        .collect();
    triangles.sort_unstable();
    TriangleMesh { positions: points.into_iter().map(lift).collect(), triangles }
}

/// A regular polygon of `count` vertices.
pub fn circle(centre: DVec2, radius: f64, count: usize) -> Vec<DVec2> {
    (0..count).map(|k| centre + radius * DVec2::from_angle(TAU * k as f64 / count as f64)).collect()
}

/// A polygon with its sides cut into edges of about `edge_length`.
pub fn subdivided(corners: &[DVec2], edge_length: f64) -> Vec<DVec2> {
    let mut points = Vec::new();
    for (k, &a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        let count = (a.distance(b) / edge_length).round().max(1.0) as usize;
        points.extend((0..count).map(|i| a.lerp(b, i as f64 / count as f64)));
    }
    points
}
