//! Measures of faces and meshes.

use crate::TriangleMesh;
use glam::DVec3;

/// Where the point of the segment from `a` to `b` nearest to `p` lies, as a fraction of the way: 0 to 1, 0 where the ends are one.
pub fn nearest_on_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Unit normal of a polygon (Newell's method); zero for a degenerate one.
pub fn face_normal(points: &[DVec3]) -> DVec3 {
    let origin = points[0];
    let mut sum = DVec3::ZERO;
    for k in 1..points.len() - 1 {
        sum += (points[k] - origin).cross(points[k + 1] - origin);
    }
    sum.normalize_or_zero()
}

/// Scaled Jacobian of a quad: the least, over its corners, of the sine between the two unit edges, signed against
/// the normal of the diagonals. 1 for a rectangle, 0 or less when inverted at a corner.
pub fn scaled_jacobian(p: [DVec3; 4]) -> f64 {
    let normal = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or_zero();
    (0..4)
        .map(|k| {
            let forward = (p[(k + 1) % 4] - p[k]).normalize_or_zero();
            let backward = (p[(k + 3) % 4] - p[k]).normalize_or_zero();
            forward.cross(backward).dot(normal)
        })
        .fold(f64::INFINITY, f64::min)
}

/// Signed volume enclosed by a closed triangle mesh, in cubic scene units; positive when it faces outwards.
pub fn volume(mesh: &TriangleMesh) -> f64 {
    let Some(&origin) = mesh.positions.first() else { return 0.0 };
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize] - origin);
            a.dot(b.cross(c))
        })
        .sum::<f64>()
        / 6.0
}
