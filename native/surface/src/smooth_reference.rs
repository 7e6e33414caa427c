//! A triangle mesh as the reference surface of smoothing: closest points with interpolated normals.

use crate::closest::ClosestPoint;
use crate::smooth_star::{Reference, SurfacePoint};
use glam::DVec3;
use mesh::{NONE, TriangleMesh};

/// One smooth side of a surface. Normals are interpolated from the vertices, so cut the mesh along creases and along
/// the intersection curve, one reference each side: a normal blended across a crease says little about orientation.
#[derive(Clone)]
pub struct TriangleReference {
    closest: ClosestPoint,
    /// Unit normals at the corners of each triangle.
    corner_normals: Vec<[DVec3; 3]>,
}

impl TriangleReference {
    /// Prepares closest-point queries. O(n log n).
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut sum = vec![DVec3::ZERO; mesh.positions.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let (p, normal) = (mesh.points(t), mesh.area_normal(t).normalize_or_zero());
            for k in 0..3 {
                // Weighted by angle, the normal does not depend on how the surface is cut into triangles.
                let (e, f) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                sum[triangle[k] as usize] += normal * e.cross(f).length().atan2(e.dot(f));
            }
        }
        let corner_normals = mesh.triangles.iter().map(|t| t.map(|v| sum[v as usize].normalize_or_zero())).collect();
        Self { closest: ClosestPoint::new(mesh), corner_normals }
    }
}

impl Reference for TriangleReference {
    fn project(&self, point: DVec3) -> SurfacePoint {
        let foot = self.closest.project(point);
        if foot.triangle == NONE {
            return SurfacePoint { point, normal: DVec3::ZERO };
        }
        let [a, b, c] = self.corner_normals[foot.triangle as usize];
        let [u, v, w] = foot.barycentric;
        SurfacePoint { point: foot.point, normal: (a * u + b * v + c * w).normalize_or_zero() }
    }
}
