//! Quads that are symmetric about a plane: the surface is cut there, one half is meshed, and the other is its mirror image.
//!
//! Not in Daniels et al. 2011. The cut is a border of the half, and so a feature: quads meet the plane with whole edges. What is
//! mirrored is stitched by index, never by comparing coordinates, and vertices on the plane are put exactly on it. A surface
//! that is not symmetric is made so: the side that the plane's normal points to decides, as Blender's Symmetrize does.

use crate::base_error::RetopologyError;
use crate::build::{BaseOptions, Built, build_base};
use crate::error::LayoutError;
use crate::features::Features;
use crate::half::{Half, halve};
use crate::input;
use crate::quads::{FeatureEdge, LayoutOptions, Quads, SourcePoint, quads_from_base};
use crate::{Size, base::Base};
use mesh::{Aabb, DVec3, Monitor, NONE, PolygonMesh, TriangleMesh};
use std::collections::BTreeSet;
use surface::closest::ClosestPoint;

/// Vertices this near to the plane are on it, fraction of the bounding-box diagonal.
const ON_PLANE: f64 = 1e-6;

/// A plane of symmetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// A point of it, scene units.
    pub point: DVec3,
    /// Its normal, of any length; it points to the side that is kept.
    pub normal: DVec3,
}

impl Plane {
    /// Signed distance of a point, for a normal of length 1.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }

    pub(crate) fn mirrored(&self, p: DVec3) -> DVec3 {
        p - self.normal * (2.0 * self.distance(p))
    }

    pub(crate) fn foot(&self, p: DVec3) -> DVec3 {
        p - self.normal * self.distance(p)
    }
}

/// Why there are no symmetric quads.
#[derive(Debug, thiserror::Error)]
pub enum SymmetryError {
    /// The plane's normal has no length, or something is not finite.
    #[error("the plane of symmetry needs a finite point and a normal that is not zero")]
    BadPlane,
    /// The kept side is empty.
    #[error("the surface has nothing on the kept side of the plane: choose the other side, or move the plane")]
    NothingKept,
    /// The half has no base triangulation.
    #[error(transparent)]
    Base(#[from] RetopologyError),
    /// The half has no quads.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Symmetric quads.
#[derive(Debug, Clone)]
pub struct Symmetric {
    /// The whole mesh: the kept half first. Its sources are on the input; those of mirrored vertices are on the kept side too,
    /// where what is symmetric takes its colours and weights from. `base_vertex` and the report's layout are of the half.
    pub quads: Quads,
    /// Base triangulation of the kept half, with its report.
    pub half: Built,
    /// The base triangulation of the whole as a mesh.
    pub base_mesh: PolygonMesh,
    /// For each vertex the one mirrored to it; itself on the plane.
    pub mirror: Vec<u32>,
    /// How far the input was from symmetric: the greatest distance of a mirrored vertex to it, scene units.
    pub deviation: f64,
}

/// Lays symmetric quads over a surface. Numbers of faces and base vertices in the options are those of the whole. Vertices that
/// are mirrored to one another are so to the last digit; those on the plane are on it to rounding.
///
/// Cost: that of [`build_base`] and [`quads_from_base`] for the half, plus O(n log n).
///
/// # Errors
/// [`SymmetryError`]; element indices of the half's errors are those of the half where the input itself is sound.
pub fn symmetric_quads(
    mesh: &TriangleMesh,
    features: &Features,
    plane: Plane,
    coarse: &BaseOptions,
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<Symmetric, SymmetryError> {
    let normal = plane.normal.normalize_or_zero();
    if normal == DVec3::ZERO || !plane.point.is_finite() {
        return Err(SymmetryError::BadPlane);
    }
    let plane = Plane { point: plane.point, normal };
    monitor.stage("reading the surface", 0.0).map_err(RetopologyError::from)?;
    let topology = input::check(mesh)?;
    // Named here, with the indices of the input.
    crate::features::network(mesh, &topology, features, coarse.corner_angle, 0.0)?;
    if !options.density.is_empty() && options.density.len() != mesh.positions.len() {
        let reason = "the density needs a value for each input vertex";
        return Err(LayoutError::BadBase { element: "vertex", index: options.density.len(), reason }.into());
    }
    let bounds = Aabb::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]));
    let tolerance = ON_PLANE * bounds.low.distance(bounds.high);
    let half = halve(mesh, features, plane, tolerance);
    if half.mesh.triangles.is_empty() {
        return Err(SymmetryError::NothingKept);
    }
    let deviation = deviation(mesh, plane);
    let coarse = BaseOptions { vertices: (coarse.vertices / 2).max(4), ..coarse.clone() };
    let mut options = options.clone();
    if let Size::TargetFaces(faces) = &mut options.size {
        *faces = faces.div_ceil(2);
    }
    if !options.density.is_empty() {
        options.density = half.interpolated(&options.density);
    }
    let built = build_base(&half.mesh, &half.features, &coarse, monitor)?;
    let quads = quads_from_base(&built.base, &options, monitor)?;

    let on_plane = half.base_edges_on_plane(&built.base);
    let mut in_plane = vec![false; quads.mesh.vertex_count()];
    for edge in quads.feature_edges.iter().filter(|edge| on_plane[edge.base_edge as usize]) {
        for v in edge.ends {
            in_plane[v as usize] = true;
        }
    }
    let mut seam = vec![false; built.base.vertices.len()];
    for edge in built.base.edges.iter().zip(&on_plane).filter(|(_, on)| **on).map(|(edge, _)| edge) {
        for v in edge.ends {
            seam[v as usize] = true;
        }
    }
    let points: Vec<DVec3> = built.base.vertices.iter().map(|&v| built.base.surface.positions[v as usize]).collect();
    let faces = built.base.triangles.iter().map(|t| t.to_vec()).collect();
    let (base_mesh, _) = doubled(&points, faces, &seam, plane)?;
    let faces = quads.mesh.faces().map(<[u32]>::to_vec).collect();
    let (whole, mirror) = doubled(&quads.mesh.positions, faces, &in_plane, plane)?;
    let mut quads = whole_quads(quads, whole, &mirror, &half, &built.base, &on_plane);
    if let Some(target) = &mut quads.report.target {
        *target *= 2;
    }
    Ok(Symmetric { quads, half: built, base_mesh, mirror, deviation })
}

/// The greatest distance of a mirrored vertex to the surface.
fn deviation(mesh: &TriangleMesh, plane: Plane) -> f64 {
    let closest = ClosestPoint::new(mesh);
    let mut used = vec![false; mesh.positions.len()];
    for &v in mesh.triangles.iter().flatten() {
        used[v as usize] = true;
    }
    let off = |&p: &DVec3| {
        let image = plane.mirrored(p);
        closest.project(image).point.distance(image)
    };
    mesh.positions.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| off(p)).fold(0.0, f64::max)
}

/// A mesh with its mirror image, stitched at the vertices that are `in_plane`; and the mirror vertex of each.
fn doubled(
    points: &[DVec3],
    mut faces: Vec<Vec<u32>>,
    in_plane: &[bool],
    plane: Plane,
) -> Result<(PolygonMesh, Vec<u32>), SymmetryError> {
    let place = |(&p, &on): (&DVec3, &bool)| if on { plane.foot(p) } else { p };
    let mut positions: Vec<DVec3> = points.iter().zip(in_plane).map(place).collect();
    let mut mirror: Vec<u32> = (0..points.len() as u32).collect();
    for v in (0..points.len()).filter(|&v| !in_plane[v]) {
        mirror[v] = positions.len() as u32;
        positions.push(plane.mirrored(positions[v]));
        mirror.push(v as u32);
    }
    let images: Vec<Vec<u32>> = faces
        .iter()
        .map(|face| face[..1].iter().chain(face[1..].iter().rev()).map(|&v| mirror[v as usize]).collect())
        .collect();
    faces.extend(images);
    let whole = PolygonMesh::from_polygons(positions, &faces).map_err(|_| LayoutError::BadBase {
        element: "triangle",
        index: 0,
        reason: "it asks for more quads than 32-bit indices can name",
    })?;
    Ok((whole, mirror))
}

/// The quads of the half with all that belongs to their vertices doubled.
fn whole_quads(
    half_quads: Quads,
    mesh: PolygonMesh,
    mirror: &[u32],
    half: &Half,
    base: &Base,
    on_plane: &[bool],
) -> Quads {
    let Quads { mut feature_edges, mut base_vertex, mut source, mut report, .. } = half_quads;
    // Edges in the plane lie on a feature only where the artist marked one.
    feature_edges.retain(|edge| !on_plane[edge.base_edge as usize] || half.is_marked(base, edge.base_edge));
    let images: Vec<FeatureEdge> = feature_edges
        .iter()
        .filter(|edge| !on_plane[edge.base_edge as usize])
        .map(|&edge| FeatureEdge { ends: edge.ends.map(|v| mirror[v as usize]), ..edge })
        .collect();
    feature_edges.extend(images);
    let own = base_vertex.len();
    for point in &mut source {
        point.triangle = half.source.get(point.triangle as usize).copied().unwrap_or(NONE);
    }
    let images: Vec<SourcePoint> = mirror[own..].iter().map(|&v| source[v as usize]).collect();
    source.extend(images);
    base_vertex.resize(mirror.len(), NONE);
    report.patches *= 2;
    report.singles *= 2;
    report.inverted *= 2;
    report.faces = mesh.face_count();
    report.irregular = crate::quads::irregular(&mesh);
    Quads { mesh, feature_edges, base_vertex, source, report }
}

impl Half {
    /// Which base edges lie in the plane, on the border that the cut made or that was there.
    fn base_edges_on_plane(&self, base: &Base) -> Vec<bool> {
        let mut uses = vec![0; base.edges.len()];
        for &e in base.triangle_edges.iter().flatten() {
            uses[e as usize] += 1;
        }
        let in_plane = |&v: &u32| self.plane.distance(base.surface.positions[v as usize]).abs() <= self.tolerance;
        base.edges.iter().zip(uses).map(|(edge, uses)| uses == 1 && edge.path.iter().all(in_plane)).collect()
    }

    /// True when every input edge along a base edge in the plane is marked.
    fn is_marked(&self, base: &Base, edge: u32) -> bool {
        let count = self.mesh.positions.len() as u32;
        let path: Vec<u32> = base.edges[edge as usize].path.iter().copied().filter(|&v| v < count).collect();
        let marked: &BTreeSet<[u32; 2]> = &self.marked_in_plane;
        path.len() > 1 && path.windows(2).all(|pair| marked.contains(&mesh::sorted(pair[0], pair[1])))
    }
}

#[cfg(test)]
#[path = "symmetry_tests.rs"]
mod tests;
