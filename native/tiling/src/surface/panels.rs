//! What each panel is like, for schedules and for the bars: kind, planarity, area, edges; and the irregular vertices.

use crate::Kind;
use mesh::{DVec3, PolygonMesh, Topology};
use std::collections::BTreeMap;

/// One face of the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it is in the plane.
    pub kind: Kind,
    /// Distance between the diagonals over their mean length: 0 when flat.
    pub planarity: f64,
    /// Scene units squared; a quad's is that of its two halves.
    pub area: f64,
    /// From each corner to the next, scene units.
    pub edges: Vec<f64>,
}

impl Panel {
    /// Measures every face of a mesh of triangles and quads, given what each is.
    pub(super) fn all(mesh: &PolygonMesh, kinds: &[Kind]) -> Vec<Self> {
        (0..mesh.face_count())
            .map(|f| {
                let p: Vec<_> = mesh.face_points(f).collect();
                let n = p.len();
                let kind = kinds[f];
                let edges = (0..n).map(|k| p[k].distance(p[(k + 1) % n])).collect();
                if n == 3 {
                    let area = (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0;
                    return Self { kind, planarity: 0.0, area, edges };
                }
                let planarity = planarity(&p);
                let half = |a: usize, b: usize| (p[a] - p[0]).cross(p[b] - p[0]).length() / 2.0;
                let area = half(1, 2) + half(2, 3);
                Self { kind, planarity, area, edges }
            })
            .collect()
    }
}

/// Distance between the diagonals of a quad over their mean length.
pub(super) fn planarity(p: &[DVec3]) -> f64 {
    let (first, second) = (p[2] - p[0], p[3] - p[1]);
    let across = first.cross(second).normalize_or_zero();
    let mean = f64::midpoint(first.length(), second.length());
    if mean > 0.0 { across.dot(p[1] - p[0]).abs() / mean } else { 0.0 }
}

/// Combinatorial angle defects, in units of 30 degrees, of the vertices where they are not zero: 12 less the angles around
/// an interior vertex, 6 less those of a border vertex, a triangle's corner being 2 and a square's 3 (section 4.0.2 of the paper).
pub(super) fn defects(mesh: &PolygonMesh) -> (BTreeMap<u32, i32>, usize) {
    let topology = Topology::of(mesh);
    let mut defect: Vec<i32> =
        (0..mesh.vertex_count() as u32).map(|v| if topology.is_border_vertex(v) { 6 } else { 12 }).collect();
    for face in mesh.faces() {
        for &v in face {
            defect[v as usize] -= if face.len() == 3 { 2 } else { 3 };
        }
    }
    let interior = (0..mesh.vertex_count() as u32).filter(|&v| !topology.is_border_vertex(v)).count();
    ((0..).zip(defect).filter(|&(_, d)| d != 0).collect(), interior)
}
