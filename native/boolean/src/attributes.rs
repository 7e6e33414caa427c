//! Where the attributes of new corners come from: the point of the input that lies under them.

use crate::CornerSource;
use crate::Operation;
use crate::fill::Region;
use crate::intersect::Input;
use crate::stitch::Stitched;
use mesh::{DVec3, NONE};
use rayon::prelude::*;

/// One source for each corner of the result: exact on kept faces; on new ones the closest point of the same region of
/// the exact boolean. A region lies on one input, so a corner on the curve gets each side's own attributes.
pub fn corner_sources(
    inputs: &[Input<'_>; 2],
    operation: Operation,
    regions: &[Region],
    stitched: &Stitched,
) -> Vec<CornerSource> {
    (0..stitched.mesh.face_count())
        .into_par_iter()
        .flat_map_iter(|f| {
            let corners: Vec<CornerSource> = match stitched.face_source[f] {
                [-1, _] if stitched.face_region[f] == NONE => stitched.piece_source[&(f as u32)].to_vec(),
                [-1, _] => {
                    let r = stitched.face_region[f] as usize;
                    stitched
                        .mesh
                        .face_points(f)
                        .map(|p| {
                            let (point, source) = regions[r].under.source_at(p);
                            interpolate(&inputs[source.mesh as usize], source.mesh, source.triangle, point)
                        })
                        .collect()
                }
                [m, face] => {
                    let turned = m == 1 && operation == Operation::Difference;
                    let order = if turned { [0, 3, 2, 1] } else { [0, 1, 2, 3] };
                    order
                        .into_iter()
                        .map(|k| {
                            let mut weights = [0.0; 4];
                            weights[k] = 1.0;
                            CornerSource { mesh: m as u8, face: face as u32, weights }
                        })
                        .collect()
                }
            };
            corners
        })
        .collect()
}

/// Weights of a quad's corners at a point of one of its two triangles.
fn interpolate(input: &Input<'_>, mesh: u8, triangle: u32, point: DVec3) -> CornerSource {
    let face = input.quad_of[triangle as usize];
    let corners = input.triangles.triangles[triangle as usize];
    let [a, b, c] = corners.map(|v| input.triangles.positions[v as usize]);
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    let bary = if area > 0.0 {
        let u = (c - b).cross(point - b).dot(normal) / area;
        let v = (a - c).cross(point - c).dot(normal) / area;
        [u, v, 1.0 - u - v]
    } else {
        [1.0, 0.0, 0.0]
    };
    // Rounding may leave the triangle by a hair: weights stay a convex combination.
    let bary = bary.map(|w| w.max(0.0));
    let sum: f64 = bary.iter().sum();
    let mut weights = [0.0; 4];
    for (v, w) in corners.iter().zip(bary) {
        let k = input.quads.face(face as usize).iter().position(|u| u == v).expect("a corner of its quad");
        weights[k] = w / sum;
    }
    CornerSource { mesh, face, weights }
}
