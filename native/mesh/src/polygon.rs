//! A polygon mesh in Blender's own layout: positions, face offsets, corner vertices.

use crate::Aabb;
use glam::DVec3;

/// Why arrays do not describe a mesh. Geometry may still be bad: see [`crate::check`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// Offsets must start at 0, never fall, and end at the number of corners.
    #[error(
        "face offsets must start at 0, rise by at least 3 a face and end at the number of corners ({corners}); face {face} does not"
    )]
    Offsets {
        /// The first face that breaks the rule.
        face: usize,
        /// Length of the corner array.
        corners: usize,
    },
    /// A corner names a vertex that does not exist.
    #[error("corner {corner} names vertex {vertex}, but there are {vertices} vertices")]
    VertexOutOfRange {
        /// Index into the corner array.
        corner: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// More elements than 32-bit indices can name.
    #[error("the mesh has more than 2^31 - 1 elements; split it first")]
    TooLarge,
}

/// A polygon mesh: face `f` has the corners `corner_verts[face_offsets[f]..face_offsets[f + 1]]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolygonMesh {
    /// Vertex positions, scene units.
    pub positions: Vec<DVec3>,
    face_offsets: Vec<u32>,
    corner_verts: Vec<u32>,
}

impl PolygonMesh {
    /// Takes arrays in Blender's layout and checks that their indices make sense.
    ///
    /// # Errors
    /// [`MeshError`] when offsets or vertex indices are out of range. Costs O(corners).
    pub fn new(positions: Vec<DVec3>, face_offsets: Vec<u32>, corner_verts: Vec<u32>) -> Result<Self, MeshError> {
        let corners = corner_verts.len();
        if positions.len().max(corners).max(face_offsets.len()) > i32::MAX as usize {
            return Err(MeshError::TooLarge);
        }
        if face_offsets.first() != Some(&0) {
            return Err(MeshError::Offsets { face: 0, corners });
        }
        for (face, pair) in face_offsets.windows(2).enumerate() {
            if pair[1] < pair[0] + 3 || pair[1] as usize > corners {
                return Err(MeshError::Offsets { face, corners });
            }
        }
        if face_offsets.last().copied() != Some(corners as u32) {
            return Err(MeshError::Offsets { face: face_offsets.len() - 1, corners });
        }
        for (corner, &vertex) in corner_verts.iter().enumerate() {
            if vertex as usize >= positions.len() {
                return Err(MeshError::VertexOutOfRange { corner, vertex, vertices: positions.len() });
            }
        }
        Ok(Self { positions, face_offsets, corner_verts })
    }

    /// Builds a mesh from one vertex list a face.
    ///
    /// # Errors
    /// As [`PolygonMesh::new`].
    pub fn from_polygons<P: AsRef<[u32]>>(
        positions: Vec<DVec3>,
        polygons: impl IntoIterator<Item = P>,
    ) -> Result<Self, MeshError> {
        let (mut offsets, mut corners) = (vec![0], Vec::new());
        for polygon in polygons {
            corners.extend_from_slice(polygon.as_ref());
            offsets.push(corners.len() as u32);
        }
        Self::new(positions, offsets, corners)
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.face_offsets.len().saturating_sub(1)
    }

    /// Vertices of face `f`, counter-clockwise.
    pub fn face(&self, f: usize) -> &[u32] {
        &self.corner_verts[self.face_offsets[f] as usize..self.face_offsets[f + 1] as usize]
    }

    /// The corners of face `f` as a range into [`PolygonMesh::corner_verts`].
    pub fn face_corners(&self, f: usize) -> std::ops::Range<usize> {
        self.face_offsets[f] as usize..self.face_offsets[f + 1] as usize
    }

    /// All faces in order.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.face_count()).map(|f| self.face(f))
    }

    /// Offsets into the corner array, one more than there are faces.
    pub fn face_offsets(&self) -> &[u32] {
        &self.face_offsets
    }

    /// The vertex at each corner.
    pub fn corner_verts(&self) -> &[u32] {
        &self.corner_verts
    }

    /// True when every face is a quad.
    pub fn is_pure_quad(&self) -> bool {
        self.face_offsets.windows(2).all(|w| w[1] - w[0] == 4)
    }

    /// Positions of the corners of face `f`.
    pub fn face_points(&self, f: usize) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        self.face(f).iter().map(|&v| self.positions[v as usize])
    }

    /// The same faces on positions scaled about the origin.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        self.with_positions(self.positions.iter().map(|&p| p * factor).collect())
    }

    /// The same faces on other positions, one for each vertex.
    ///
    /// # Panics
    /// When the number of positions differs.
    #[must_use]
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        assert_eq!(positions.len(), self.positions.len(), "one position for each vertex");
        Self { positions, face_offsets: self.face_offsets.clone(), corner_verts: self.corner_verts.clone() }
    }

    /// Length of the bounding-box diagonal; 0 for an empty mesh.
    pub fn diagonal(&self) -> f64 {
        Aabb::of(self.positions.iter().copied()).diagonal()
    }
}
