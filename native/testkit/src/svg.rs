//! Drawings of plane meshes.

use mesh::{Aabb, PolygonMesh};
use std::fmt::Write;

/// Draws a mesh seen from above (x to the right, y up), 800 pixels wide: quads blue, triangles yellow, other faces red.
pub fn svg(mesh: &PolygonMesh) -> String {
    const WIDTH: f64 = 800.0;
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let size = (bounds.high - bounds.low).max(mesh::DVec3::splat(1e-9 * bounds.diagonal()));
    let scale = WIDTH / size.x;
    let mut drawing = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-5 -5 {:.0} {:.0}\" stroke=\"#223\" stroke-linejoin=\"round\">\n",
        WIDTH + 10.0,
        size.y * scale + 10.0
    );
    for f in 0..mesh.face_count() {
        let colour = match mesh.face(f).len() {
            3 => "#fd8",
            4 => "#adf",
            _ => "#f99",
        };
        write!(drawing, "<polygon fill=\"{colour}\" points=\"").expect("a string takes all");
        for p in mesh.face_points(f) {
            let (x, y) = ((p.x - bounds.low.x) * scale, (bounds.high.y - p.y) * scale);
            write!(drawing, "{x:.2},{y:.2} ").expect("a string takes all");
        }
        drawing.push_str("\"/>\n");
    }
    drawing + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn draws_every_face_inside_the_frame() {
        let drawing = svg(&shapes::sheet(4, 2));
        assert_eq!(drawing.matches("<polygon fill=\"#adf\"").count(), 8);
        assert!(drawing.contains("viewBox=\"-5 -5 810 410\""));
        assert!(drawing.contains("points=\"0.00,400.00 200.00,400.00 200.00,200.00 0.00,200.00 \""));
    }
}
