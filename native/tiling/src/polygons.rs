//! Surface tiling of polygon meshes, as artists have them: faults are named by the elements of the mesh itself, faces of any
//! size become triangles, and the surface is tiled about the origin at about unit size, so that no place and no scale of the
//! scene matters.

use crate::panel_count::{Guess, edge_length_by_area, edge_length_of, tile_to_count};
use crate::surface::{
    PolyhedronOptions, PolyhedronTiling, SurfaceError, SurfaceOptions, SurfaceTiling, Zigzag, tile_faces, tile_surface,
};
use crate::surface::{STEP, without_crumbs};
use ::surface::inspect::{Fault, inspect, inspect_vertices};
use ::surface::triangulate::{Triangulated, triangulate};
use mesh::{Aabb, Cancelled, DVec3, Monitor, NONE, PolygonMesh, Topology, TriangleMesh, face_normal};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Most edges along all sides of a polyhedron together.
const MOST_SIDE_EDGES: f64 = 20_000.0;
/// Part of the progress for finding the edge length of a count.
const COUNT_PART: f64 = 0.4;

/// How large the panels are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PanelSize {
    /// Length of their edges, scene units.
    EdgeLength(f64),
    /// About so many panels in all.
    Count(u32),
}

/// Why a polygon mesh cannot be tiled.
#[derive(Debug, thiserror::Error)]
pub enum PolygonsError {
    /// The mesh is no surface.
    #[error(transparent)]
    Mesh(#[from] Fault),
    /// No panels were asked for.
    #[error("a count of 0 panels makes no surface; ask for at least one")]
    NoPanels,
    /// The surface cannot be tiled so.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

impl From<Cancelled> for PolygonsError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Surface(cancelled.into())
    }
}

/// A tiled polygon mesh.
#[derive(Debug, Clone)]
pub struct PolygonTiling {
    /// The panels, in the scene.
    pub tiling: SurfaceTiling,
    /// Vertices of the input where sheets touch: the panels of each sheet end there in a vertex of their own.
    pub taken_apart: Vec<u32>,
    /// Faces of the input at which larger panels turned over, where smaller ones or more than asked for were made.
    pub narrow: Vec<u32>,
    /// How many vertices off the border have an angle defect that is not zero.
    pub irregular_interior_vertices: usize,
    place: Place,
}

impl PolygonTiling {
    pub(crate) fn new(made: SurfaceTiling, taken_apart: Vec<u32>, place: Place) -> Self {
        let tiling = place.restored(made);
        let topology = Topology::of(&tiling.mesh);
        let irregular = tiling.defects.iter().filter(|&&(v, _)| !topology.is_border_vertex(v)).count();
        Self { tiling, taken_apart, narrow: Vec::new(), irregular_interior_vertices: irregular, place }
    }

    /// The same mesh with zigzags on sides of its patch graph, as [`SurfaceTiling::zigzag`].
    ///
    /// # Errors
    /// [`SurfaceError::Edit`]; cancelled.
    pub fn zigzag(&self, zigzags: &[Zigzag], monitor: &Monitor) -> Result<Self, SurfaceError> {
        let made = Self::new(self.tiling.zigzag(zigzags, monitor)?, self.taken_apart.clone(), self.place);
        Ok(Self { narrow: self.narrow.clone(), ..made })
    }
}

/// Covers a polygon mesh by panels, as [`tile_surface`] covers triangles; faces may have any number of corners, and where
/// sheets touch in a vertex each gets its own. O(n log n) for input and output.
///
/// # Errors
/// [`PolygonsError`], naming elements of the mesh.
pub fn tile_polygons(
    mesh: &PolygonMesh,
    size: PanelSize,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<PolygonTiling, PolygonsError> {
    let Prepared { surface, face_of, options, place, taken_apart, guess, start } =
        prepare(mesh, size, options, monitor)?;
    let made = monitor.within(start, 1.0, || match size {
        PanelSize::EdgeLength(_) => tile_surface(&surface, guess.edge_length, &options, monitor),
        PanelSize::Count(count) => tile_to_count(count, &surface, guess, &options, monitor),
    });
    let made = made.map_err(|error| place.in_scene_units(error))?;
    let narrow: BTreeSet<u32> = made.narrow.iter().map(|&triangle| face_of[triangle as usize]).collect();
    Ok(PolygonTiling { narrow: narrow.into_iter().collect(), ..PolygonTiling::new(made, taken_apart, place) })
}

/// A polygon mesh as a surface of triangles at about unit size, what is followed there, and the edge length that a count needs.
pub(crate) struct Prepared {
    pub surface: TriangleMesh,
    /// The face of each triangle.
    pub face_of: Vec<u32>,
    pub options: SurfaceOptions,
    pub place: Place,
    pub taken_apart: Vec<u32>,
    pub guess: Guess,
    /// Part of the progress that is over.
    pub start: f64,
}

pub(crate) fn prepare(
    mesh: &PolygonMesh,
    size: PanelSize,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<Prepared, PolygonsError> {
    monitor.stage("checking", 0.0)?;
    inspect(mesh)?;
    let taken_apart = inspect_vertices(mesh).err().map_or_else(Vec::new, |fault| fault.elements);
    let place = Place::of(mesh);
    let unit: Vec<DVec3> = mesh.positions.iter().map(|&p| (p - place.origin) / place.scale).collect();
    let unit = mesh.with_positions(unit);
    let Triangulated { mesh: surface, face: face_of, .. } = triangulate(&unit);
    let mut options = options.clone();
    let rough_length = match size {
        PanelSize::EdgeLength(length) => length / place.scale,
        PanelSize::Count(count) => edge_length_by_area(count, &surface),
    };
    options.marked_edges.extend(sharp_edges(&unit, options.feature_angle, rough_length));
    options.feature_angle = PI;
    let (guess, start) = match size {
        PanelSize::EdgeLength(_) => (Guess { edge_length: rough_length, narrow: Vec::new() }, 0.0),
        PanelSize::Count(0) => return Err(PolygonsError::NoPanels),
        PanelSize::Count(count) => {
            let find = || edge_length_of(count, rough_length, &surface, &options, monitor);
            (monitor.within(0.0, COUNT_PART, find)?, COUNT_PART)
        }
    };
    Ok(Prepared { surface, face_of, options, place, taken_apart, guess, start })
}

/// Tiles the faces of a polyhedron, each a patch, by triangles and squares with edges of about `edge_length`, scene units;
/// `None` for the mean of the polyhedron's edges. The mesh may be open, bent and of any genus; it is shaped for regularity alone.
///
/// # Errors
/// [`PolygonsError::Mesh`] when it is no oriented surface; [`SurfaceError::Polygons`] for faces without c-indices;
/// [`SurfaceError::NoLengths`] when no side lengths close all faces or a face has no tiling; [`SurfaceError::EdgeLength`],
/// [`SurfaceError::TooMany`]; cancelled.
///
/// # Source
/// Peng et al. 2018, section 5.1, Fig. 14. Costs one integer programme over the sides.
pub fn tile_polyhedron(
    polyhedron: &PolygonMesh,
    edge_length: Option<f64>,
    options: &PolyhedronOptions,
    monitor: &Monitor,
) -> Result<PolyhedronTiling, PolygonsError> {
    monitor.stage("checking", 0.0)?;
    inspect(polyhedron)?;
    let topology = Topology::of(polyhedron);
    let lengths: Vec<f64> = topology
        .edges()
        .map(|h| [topology.from(h), topology.to(h)].map(|v| polyhedron.positions[v as usize]))
        .map(|[p, q]| p.distance(q))
        .collect();
    let whole: f64 = lengths.iter().sum();
    let edge_length = edge_length.unwrap_or(whole / lengths.len() as f64);
    // Sides are given to an integer programme, which is the first to have too many panels.
    let least = whole / MOST_SIDE_EDGES;
    if edge_length > 0.0 && edge_length < least {
        let panels = whole / edge_length;
        return Err(SurfaceError::TooMany { edge_length, panels, least }.into());
    }
    Ok(tile_faces(polyhedron, edge_length, options, monitor)?)
}

/// Edges of faces at which the surface turns by more than the angle, crumbs left out. Diagonals of bent faces may turn as much, but are
/// no edges.
fn sharp_edges(mesh: &PolygonMesh, angle: f64, edge_length: f64) -> Vec<[u32; 2]> {
    let topology = Topology::of(mesh);
    let normals: Vec<DVec3> =
        (0..mesh.face_count()).map(|f| face_normal(&mesh.face_points(f).collect::<Vec<_>>())).collect();
    let turns = |h: u32| {
        let twin = topology.twin[h as usize];
        twin != NONE && {
            let [left, right] = [h, twin].map(|h| normals[topology.face[h as usize] as usize]);
            left != DVec3::ZERO && right != DVec3::ZERO && left.angle_between(right) > angle
        }
    };
    let sharp: Vec<[u32; 2]> =
        topology.edges().filter(|&h| turns(h)).map(|h| [topology.from(h), topology.to(h)]).collect();
    without_crumbs(&sharp, &mesh.positions, STEP * edge_length)
}

/// Where the mesh is, and how large.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    origin: DVec3,
    /// A power of two, so that no digit is lost.
    pub scale: f64,
}

impl Place {
    fn of(mesh: &PolygonMesh) -> Self {
        let bounds = Aabb::of(mesh.corner_verts().iter().map(|&v| mesh.positions[v as usize]));
        // Halved first: the box of a huge mesh may be wider than the largest number.
        let longest = (bounds.high / 2.0 - bounds.low / 2.0).max_element();
        Self { origin: bounds.low.midpoint(bounds.high), scale: longest.log2().floor().exp2() }
    }

    pub(crate) fn restored(&self, mut made: SurfaceTiling) -> SurfaceTiling {
        for p in &mut made.mesh.positions {
            *p = *p * self.scale + self.origin;
        }
        for panel in &mut made.panels {
            panel.area *= self.scale * self.scale;
            panel.edges.iter_mut().for_each(|length| *length *= self.scale);
        }
        made.edge_length *= self.scale;
        if let Some(graph) = &mut made.patch_graph {
            *graph = graph.moved(|p| self.in_scene(p));
        }
        made
    }

    /// A point of the unit surface in the scene, and back.
    pub(crate) fn in_scene(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.origin
    }

    pub(crate) fn on_unit(&self, p: DVec3) -> DVec3 {
        (p - self.origin) / self.scale
    }

    pub(crate) fn in_scene_units(&self, error: SurfaceError) -> SurfaceError {
        match error {
            SurfaceError::EdgeLength { edge_length, diagonal } => {
                SurfaceError::EdgeLength { edge_length: edge_length * self.scale, diagonal: diagonal * self.scale }
            }
            SurfaceError::TooMany { edge_length, panels, least } => {
                SurfaceError::TooMany { edge_length: edge_length * self.scale, panels, least: least * self.scale }
            }
            other => other,
        }
    }
}
