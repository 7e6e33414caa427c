//! How far the border of a mesh is from that of its surface, along all of its edges and back.
//!
//! Vertices that lie on a border do not make it the same: edges between them may cut off what bends. So edges are measured along their
//! length, and the vertices of the surface's border from the edges.

use mesh::{DVec3, Topology, TriangleMesh};
use surface::closest::ClosestPoint;

/// Where along an edge it is measured.
const SAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

/// The border of a surface.
pub(super) struct Rim {
    edges: ClosestPoint,
    points: Vec<DVec3>,
}

impl Rim {
    /// `None` where there is none. O(n).
    pub fn of(surface: &TriangleMesh) -> Option<Self> {
        let topology = Topology::of_triangles(surface);
        let borders = (0..topology.len() as u32).filter(|&h| topology.is_border(h));
        let edges: Vec<[DVec3; 2]> =
            borders.map(|h| [topology.from(h), topology.to(h)].map(|v| surface.positions[v as usize])).collect();
        let points = edges.iter().map(|edge| edge[0]).collect();
        Self::closest(&edges).map(|edges| Self { edges, points })
    }

    /// Each edge as a triangle without area, which counts as its longest edge.
    fn closest(edges: &[[DVec3; 2]]) -> Option<ClosestPoint> {
        let positions = edges.iter().flatten().copied().collect();
        let triangles = (0..edges.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect();
        (!edges.is_empty()).then(|| ClosestPoint::new(&TriangleMesh { positions, triangles }))
    }

    /// Of each border edge of a mesh the greatest distance from this border, and that from it of the points of this border nearest to
    /// the edge, scene units.
    pub fn off(&self, edges: &[[DVec3; 2]]) -> Vec<f64> {
        let along = |&[a, b]: &[DVec3; 2]| {
            SAMPLES.into_iter().map(|part| self.edges.project(a.lerp(b, part)).distance).fold(0.0, f64::max)
        };
        let mut off: Vec<f64> = edges.iter().map(along).collect();
        if let Some(closest) = Self::closest(edges) {
            for &p in &self.points {
                let found = closest.project(p);
                let off = &mut off[found.triangle as usize];
                *off = off.max(found.distance);
            }
        }
        off
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_over_a_corner_is_as_far_off_as_the_corner() {
        // A unit square; the mesh has its four corners but one, which an edge cuts off.
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let positions: Vec<DVec3> = corners.iter().map(|&[x, y]| DVec3::new(x, y, 0.0)).collect();
        let surface = TriangleMesh { positions: positions.clone(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let rim = Rim::of(&surface).expect("a border");
        let [a, b, c, d] = [0, 1, 2, 3].map(|k: usize| positions[k]);
        let (p, q) = (DVec3::new(1.0, 0.6, 0.0), DVec3::new(0.6, 1.0, 0.0));
        let off = rim.off(&[[a, b], [b, p], [p, q], [q, d], [d, a]]);
        assert!((off[2] - 0.4 / 2f64.sqrt()).abs() < 1e-12, "{off:?}: {c} is cut off");
        assert!([0, 1, 3, 4].iter().all(|&k: &usize| off[k] < 1e-12), "{off:?}");
        let closed = TriangleMesh { positions, triangles: vec![[0, 1, 2], [2, 1, 0]] };
        assert!(Rim::of(&closed).is_none());
    }
}
