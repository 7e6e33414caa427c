//! Triangle meshes, and the split of quads that starts the quad boolean.

use crate::PolygonMesh;
use glam::DVec3;

/// An indexed triangle mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions, scene units.
    pub positions: Vec<DVec3>,
    /// Vertex triples, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// Splits a quad along its shorter diagonal; the diagonal 0-2 wins a tie. Corners are local: 0 to 3.
///
/// Source: Nuvoli et al., `QuadMixer`, 2019, section 3.1.
pub fn split_quad(p: [DVec3; 4]) -> [[usize; 3]; 2] {
    // Compare lengths, not squares, as tools/meshcheck does, so that near ties fall the same way.
    if p[0].distance(p[2]) <= p[1].distance(p[3]) { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] }
}

impl TriangleMesh {
    /// Triangulates a polygon mesh: quads along the shorter diagonal, larger faces as fans.
    /// Also returns the face each triangle came from. Costs O(corners).
    pub fn from_polygons(mesh: &PolygonMesh) -> (Self, Vec<u32>) {
        let mut triangles = Vec::with_capacity(mesh.corner_verts().len());
        let mut face_of = Vec::with_capacity(mesh.corner_verts().len());
        for (f, face) in mesh.faces().enumerate() {
            if let &[a, b, c, d] = face {
                let at = |v: u32| mesh.positions[v as usize];
                for t in split_quad([at(a), at(b), at(c), at(d)]) {
                    triangles.push(t.map(|k| face[k]));
                    face_of.push(f as u32);
                }
            } else {
                for k in 1..face.len() - 1 {
                    triangles.push([face[0], face[k], face[k + 1]]);
                    face_of.push(f as u32);
                }
            }
        }
        (Self { positions: mesh.positions.clone(), triangles }, face_of)
    }

    /// The three corner positions of triangle `t`.
    pub fn points(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// The same mesh as a [`PolygonMesh`].
    ///
    /// # Panics
    /// When an index is out of range: a `TriangleMesh` is built by code that knows its vertices.
    pub fn to_polygons(&self) -> PolygonMesh {
        PolygonMesh::from_polygons(self.positions.clone(), &self.triangles).expect("indices in range")
    }

    /// Normal of triangle `t`, its length twice the area.
    pub fn area_normal(&self, t: usize) -> DVec3 {
        let [a, b, c] = self.points(t);
        (b - a).cross(c - a)
    }
}
