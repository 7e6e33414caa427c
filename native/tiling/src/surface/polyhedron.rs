//! Tri-quad meshes from polyhedra (section 5.1): each face of a polygon mesh is a patch.
//!
//! There is no surface to keep to: the mesh is shaped for regularity alone, and becomes one of equilateral triangles and
//! squares where there is such a polyhedron, as the paper's b3D.

use super::lengths::Steps;
use super::panels::{self, Panel};
use super::patch_graph::PatchGraph;
use super::paving::{at_equal_steps, pave};
use super::shape::regularise;
use super::{Fill, SurfaceError};
use mesh::{DVec3, Monitor, PolygonMesh};

/// How far vertices inside cones are lifted off their faces before shaping, in edges: the faces are flat to begin with,
/// and must know which way to bulge.
const LIFT: f64 = 0.3;

/// What the caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct PolyhedronOptions {
    /// Faces whose angles nearly fit keep a defect of 30 or 60 degrees at a point inside, instead of c-indices farther from
    /// their angles. Default true.
    pub cones: bool,
    /// Which of the tilings of each face.
    pub seed: u64,
    /// Rounds of shaping. Default 400; 0 leaves the faces as flat as they were.
    pub rounds: usize,
}

impl Default for PolyhedronOptions {
    fn default() -> Self {
        Self { cones: true, seed: 0, rounds: 400 }
    }
}

/// A polyhedron in triangles and quads.
#[derive(Debug, Clone)]
pub struct PolyhedronTiling {
    /// The mesh: its faces are the panels.
    pub mesh: PolygonMesh,
    /// One a face.
    pub panels: Vec<Panel>,
    /// The patches, sides and nodes.
    pub patch_graph: PatchGraph,
    /// Edges of each side.
    pub steps: Vec<Steps>,
    /// Vertices whose combinatorial angle defect is not zero, and the defect in units of 30 degrees.
    pub defects: Vec<(u32, i32)>,
    /// Patches that got other side lengths than the best, because these admit no tiling.
    pub relengthened_patches: Vec<u32>,
    /// Patches that got rhombi, having no tiling without.
    pub patches_with_rhombi: Vec<u32>,
}

/// Tiles the faces of a polygon mesh by triangles and squares with edges of about `edge_length`, scene units.
///
/// # Errors
/// [`SurfaceError::Polygons`] for faces without c-indices, [`SurfaceError::NoLengths`] when no side lengths close all
/// faces or a face has no tiling; [`SurfaceError::EdgeLength`]; cancelled.
///
/// # Source
/// Peng et al. 2018, section 5.1, Fig. 14. Costs one integer programme over the sides.
pub fn tile_polyhedron(
    polyhedron: &PolygonMesh,
    edge_length: f64,
    options: &PolyhedronOptions,
    monitor: &Monitor,
) -> Result<PolyhedronTiling, SurfaceError> {
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return Err(SurfaceError::EdgeLength { edge_length, diagonal: polyhedron.diagonal() });
    }
    let patch_graph = PatchGraph::of_polygons(polyhedron, options.cones)?;
    let fill = Fill::Random { seed: options.seed, patch_panels: 0 };
    let paving = pave(&patch_graph, edge_length, fill, false, monitor)?.ok_or(SurfaceError::NoLengths)?;
    let mut positions = vec![DVec3::ZERO; paving.vertex_count];
    for (side, along) in patch_graph.sides.iter().zip(&paving.along) {
        for (&v, p) in along.iter().zip(at_equal_steps(&side.points, along.len() - 1)) {
            positions[v as usize] = p;
        }
    }
    for sheet in &paving.sheets {
        let outline: Vec<DVec3> = sheet.vertices[..sheet.outline].iter().map(|&v| positions[v as usize]).collect();
        let ring = sheet.outline - 2 * sheet.slit;
        let lift = if sheet.slit > 0 { LIFT * edge_length * mesh::face_normal(&outline[..ring]) } else { DVec3::ZERO };
        let places = sheet.harmonic(&outline)?;
        for (&v, p) in sheet.vertices.iter().zip(places).skip(ring + usize::from(sheet.slit > 0)) {
            positions[v as usize] = p + lift;
        }
    }
    regularise(&paving.tiles, &mut positions, options.rounds, monitor)?;
    let mesh = PolygonMesh::from_polygons(positions, &paving.tiles)?;
    Ok(PolyhedronTiling {
        panels: Panel::all(&mesh, &paving.kinds),
        defects: panels::defects(&mesh).0.into_iter().collect(),
        mesh,
        patch_graph,
        steps: paving.steps,
        relengthened_patches: paving.relengthened,
        patches_with_rhombi: paving.with_rhombi,
    })
}
