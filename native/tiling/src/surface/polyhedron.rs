//! Tri-quad meshes from polyhedra (section 5.1): each face of a polygon mesh is a patch.
//!
//! There is no surface to keep to: the mesh is shaped for regularity alone, and becomes one of equilateral triangles and
//! squares where there is such a polyhedron, as the paper's b3D.

use super::panels::{self, Panel};
use super::patch_graph::PatchGraph;
use super::paving::{PatchTiles, Paving, at_equal_steps, pave};
use super::regular::{REGULAR, regularise};
use super::zigzag::{Edit, Zigzag, zigzagged};
use super::{Fill, SurfaceError};
use mesh::{DVec3, Monitor, PolygonMesh};
use std::sync::Arc;

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
    /// Rounds of shaping before Newton's method. Default 400; 0 leaves the faces as flat as they were.
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
    /// Which panels belong to which patches.
    pub patch_tiles: PatchTiles,
    /// Vertices whose combinatorial angle defect is not zero, and the defect in units of 30 degrees.
    pub defects: Vec<(u32, i32)>,
    /// The greatest departure of an edge from the mean edge, and of a quad's diagonal from sqrt 2, in edges.
    pub irregularity: f64,
    /// Patches that got other side lengths than the best, because these admit no tiling.
    pub relengthened_patches: Vec<u32>,
    /// Patches that got rhombi, having no tiling without.
    pub patches_with_rhombi: Vec<u32>,
    /// What the edit that led here changed; nothing in a tiling that is none's result.
    pub edit: Edit,
    kept: Kept,
}

/// What edits of the patch graph need.
#[derive(Debug, Clone)]
struct Kept {
    paving: Arc<Paving>,
    edge_length: f64,
    options: PolyhedronOptions,
}

/// Tiles the faces of an oriented manifold; see [`crate::tile_polyhedron`].
pub fn tile_faces(
    polyhedron: &PolygonMesh,
    edge_length: f64,
    options: &PolyhedronOptions,
    monitor: &Monitor,
) -> Result<PolyhedronTiling, SurfaceError> {
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return Err(SurfaceError::EdgeLength { edge_length, diagonal: polyhedron.diagonal() });
    }
    let patch_graph = PatchGraph::of_polygons(polyhedron, options.cones)?;
    let fill = fill_of(options);
    let paving = pave(&patch_graph, &[], edge_length, fill, false, monitor)?.ok_or(SurfaceError::NoLengths)?;
    shaped(patch_graph, paving, Edit::default(), edge_length, options, monitor)
}

impl PolyhedronTiling {
    /// Whether all panels are equilateral triangles and squares of one edge length, to a millionth of it.
    pub fn is_regular(&self) -> bool {
        self.irregularity < REGULAR
    }

    /// The same polyhedron with zigzags on sides of its patch graph, as [`super::SurfaceTiling::zigzag`].
    ///
    /// # Errors
    /// [`SurfaceError::Edit`]; cancelled.
    pub fn zigzag(&self, zigzags: &[Zigzag], monitor: &Monitor) -> Result<Self, SurfaceError> {
        let Kept { paving, edge_length, options } = &self.kept;
        let graph = &self.patch_graph;
        let (paving, edit) = zigzagged(graph, paving, zigzags, *edge_length, fill_of(options), monitor)?;
        shaped(graph.clone(), paving, edit, *edge_length, options, monitor)
    }
}

/// Patches are drawn from all their tilings.
fn fill_of(options: &PolyhedronOptions) -> Fill {
    Fill::Random { seed: options.seed, patch_panels: 0 }
}

/// Gives the tiles their places and shapes them.
fn shaped(
    patch_graph: PatchGraph,
    paving: Paving,
    edit: Edit,
    edge_length: f64,
    options: &PolyhedronOptions,
    monitor: &Monitor,
) -> Result<PolyhedronTiling, SurfaceError> {
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
    let irregularity = regularise(&paving.tiles, &mut positions, options.rounds, monitor)?;
    let mesh = PolygonMesh::from_polygons(positions, &paving.tiles)?;
    Ok(PolyhedronTiling {
        panels: Panel::all(&mesh, &paving.kinds),
        defects: panels::defects(&mesh).0.into_iter().collect(),
        mesh,
        patch_graph,
        irregularity,
        patch_tiles: paving.patch_tiles(),
        relengthened_patches: paving.relengthened.clone(),
        patches_with_rhombi: paving.with_rhombi.clone(),
        edit,
        kept: Kept { paving: Arc::new(paving), edge_length, options: options.clone() },
    })
}
