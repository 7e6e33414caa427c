//! Surface tiling of polygon meshes, as artists have them: faults are named by the elements of the mesh itself, faces of any
//! size become triangles, and the surface is tiled about the origin at about unit size, so that no place and no scale of the
//! scene matters.

use crate::surface::{SurfaceError, SurfaceOptions, SurfaceTiling, tile_surface};
use ::surface::inspect::{Fault, inspect};
use ::surface::triangulate::triangulate;
use mesh::{Aabb, Cancelled, DVec3, Monitor, PolygonMesh};

/// Mean area of a panel of the regular pattern with unit edges: eight triangles and three squares are a period of it.
const MEAN_PANEL_AREA: f64 = 0.587_645_601_370_716_2;

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
) -> Result<SurfaceTiling, PolygonsError> {
    monitor.stage("checking", 0.0)?;
    inspect(mesh)?;
    let place = Place::of(mesh);
    let unit: Vec<DVec3> = mesh.positions.iter().map(|&p| (p - place.origin) / place.scale).collect();
    let surface = triangulate(&mesh.with_positions(unit)).mesh;
    let edge_length = match size {
        PanelSize::EdgeLength(length) => length / place.scale,
        PanelSize::Count(0) => return Err(PolygonsError::NoPanels),
        PanelSize::Count(count) => {
            let area: f64 = (0..surface.triangles.len()).map(|t| surface.area_normal(t).length() / 2.0).sum();
            (area / (MEAN_PANEL_AREA * f64::from(count))).sqrt()
        }
    };
    let made = tile_surface(&surface, edge_length, options, monitor);
    Ok(place.restored(made.map_err(|error| place.in_scene_units(error))?))
}

/// Where the mesh is, and how large.
struct Place {
    origin: DVec3,
    /// A power of two, so that no digit is lost.
    scale: f64,
}

impl Place {
    fn of(mesh: &PolygonMesh) -> Self {
        let bounds = Aabb::of(mesh.corner_verts().iter().map(|&v| mesh.positions[v as usize]));
        // Halved first: the box of a huge mesh may be wider than the largest number.
        let longest = (bounds.high / 2.0 - bounds.low / 2.0).max_element();
        Self { origin: bounds.low.midpoint(bounds.high), scale: longest.log2().floor().exp2() }
    }

    fn restored(&self, mut made: SurfaceTiling) -> SurfaceTiling {
        for p in &mut made.mesh.positions {
            *p = *p * self.scale + self.origin;
        }
        for panel in &mut made.panels {
            panel.area *= self.scale * self.scale;
            panel.edges.iter_mut().for_each(|length| *length *= self.scale);
        }
        made.edge_length *= self.scale;
        made
    }

    fn in_scene_units(&self, error: SurfaceError) -> SurfaceError {
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
