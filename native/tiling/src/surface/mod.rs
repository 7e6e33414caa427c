//! Tri-quad meshes on surfaces (section 4): any triangle mesh becomes triangles and squares of one edge length.
//!
//! **The construction, and why it always ends.** The paper partitions the surface recursively until every patch has total
//! interior defect zero, solves for side lengths, and tiles each patch; a partition may be missed, lengths may have no
//! solution and a patch no tiling. Here the order is turned round. A coarse triangulation with steps of 1 + sqrt 3 edges
//! exists for every surface and every edge length ([`coarse`]); its expansion ([`pattern`]) is a patch graph in the sense
//! of section 4.1 whose patches all admit tilings, because they come with one. Nothing can fail but the input.
//!
//! **Why it is regular.** Every vertex but those of the triangulation has angle defect zero by construction; of the coarse
//! vertices those with six triangles have. A remeshed surface has about a third of its vertices irregular, so less than a
//! twentieth of the pattern's are.
//!
//! Stages: `curve` and `coarse` (borders and marked edges at equal steps, triangulation between), `pattern` (tiles by
//! index, so borders of patches are shared without stitching), `fill` (4.2.2: other tilings of the same surface), `shape` (4.2.4), `merge` (fewer vertices where there is no room), `panels` (what a schedule needs).
//!
//! **The paper's own way** ([`Partition::Paper`]) has fewer irregular vertices, larger patches and no seam along the border, but may
//! find nothing. Stages: `cut` and `chart` (disks laid flat), `layout` (corners), `partition` (Algorithm 1; `guided` by hand;
//! `given` takes a graph that was drawn, which `inscribe` puts into the surface),
//! `assemble` (the `patch_graph`), `lattices`, `lengths`, `halves` and `courses` (problem 11), `paving` (tiles), then `shape` as above.
//!
//! Deviations of the expansion: defects sit at vertices of the triangulation, where the paper's sit
//! at the corners of its patches, fewer of them; along borders the combinatorial angles alternate between 4 and 7.

mod assemble;
mod bars;
mod bends;
mod chart;
mod choice;
mod chords;
mod coarse;
mod cone;
mod counts;
mod courses;
mod curve;
mod cut;
mod fill;
mod fold;
mod given;
mod guided;
mod halves;
mod input;
mod inscribe;
mod lattices;
mod layout;
mod lengths;
mod merge;
mod panels;
mod paper;
mod partition;
mod patch_graph;
mod pattern;
mod paving;
mod polyhedron;
mod region;
mod regular;
mod rim;
mod room;
mod search;
mod shape;
mod strip;
mod unfold;
mod zigzag;

pub use bars::{Bar, MissedBar};
pub use fold::{FoldError, FoldOptions, Folding, Gluing, fold};
pub use given::{DrawnGraph, GraphError, GraphFault};
pub use guided::{PatchDesign, Proposal};
pub use panels::Panel;
pub use patch_graph::{Corner, NoCIndices, Patch, PatchGraph, Side};
pub use paving::PatchTiles;
pub use polyhedron::{PolyhedronOptions, PolyhedronTiling, tile_faces};
pub use shape::{Along, ShapeOptions};
pub use zigzag::{Edit, EditError, Zigzag, zigzags_of_patch};

pub(crate) use input::without_crumbs;

use crate::{Kind, TilingError};
use bars::{MOST_BENT, MOST_SPREAD, Quality};
use input::Input;
use layout::{Draft, TOLERANCES};
use mesh::{Cancelled, DVec3, MeshError, Monitor, NONE, PolygonMesh, Topology, TriangleMesh};
use num_bigint::BigUint;
use paper::{Kept, Paper};
use pattern::Pattern;
use shape::Shaped;
use solve::SolveError;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};
use surface::closest::ClosestPoint;
use surface::remesh::RemeshError;
use surface::resample::ResampleError;

/// Step of the coarse triangulation in edges of the pattern: 1 + sqrt 3 inside; along a curve three edges, a little less
/// since they are drawn on by the tiles beside.
pub(crate) const STEP: f64 = 2.732_050_807_568_877;
const CURVE_STEP: f64 = 2.85;

/// Steps tried, as fractions of the one asked for, until no panel is turned over: where the surface has too little room for
/// the panels, as on a tube of two panels around, smaller ones fit. Where sixteen times as many are turned over still, room is not what lacks.
const SMALLER: [f64; 14] = [1.0, 0.97, 0.93, 0.89, 0.85, 0.8, 0.75, 0.68, 0.6, 0.52, 0.45, 0.39, 0.33, 0.25];

/// 360 degrees in units of 30.
const FULL_TURN: i32 = 12;

/// A patch graph whose mesh has no more flaws than this is taken without looking at others ([`SurfaceTiling::flaws`]).
const FEW_FLAWS: f64 = 0.15;

/// What the caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceOptions {
    /// Edges of the input that edges of the result must follow, as vertex pairs. Default none. Borders always are.
    pub marked_edges: Vec<[u32; 2]>,
    /// Edges at which the surface turns by more than this are followed too, radians, 0 to pi. Default 50 degrees; pi for none.
    pub feature_angle: f64,
    /// A border or marked line that turns by more than this keeps a vertex there, radians, 0 to pi. Default 30 degrees.
    pub corner_angle: f64,
    /// How the surface is divided. Default [`Partition::Expansion`].
    pub partition: Partition,
    /// Border vertices and their c-indices (interior angles in units of 30 degrees, 2 to 10), instead of those nearest to
    /// their angles. Only the paper's partition asks. Default none.
    pub corners: Vec<(u32, u8)>,
    /// Which of the many tilings of the surface.
    pub fill: Fill,
    /// How the mesh is shaped.
    pub shape: ShapeOptions,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            marked_edges: Vec::new(),
            feature_angle: 50f64.to_radians(),
            corner_angle: std::f64::consts::FRAC_PI_6,
            partition: Partition::Expansion,
            corners: Vec::new(),
            fill: Fill::Regular,
            shape: ShapeOptions::default(),
        }
    }
}

/// How a surface is divided into parts that can be flat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Partition {
    /// The expansion of a coarse triangulation: always there, irregular vertices evenly spread.
    Expansion,
    /// The paper's: cuts, Algorithm 1 and problem 11. Large patches, irregular vertices where the curvature is. Where no
    /// such partition is found, or its panels would turn over or be too unequal, the expansion; [`SurfaceTiling::patch_graph`] is then `None`.
    Paper,
}

/// Choice of tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// Hexagons of triangles between squares, as periodic as the surface allows. With [`Partition::Paper`]: patches of one
    /// tile each where that can be, the fewest butterflies in the others.
    Regular,
    /// With [`Partition::Paper`]: both tiles in every patch that allows it, and the most butterflies. With [`Partition::Expansion`] as
    /// [`Fill::Random`] with patches of 40 panels.
    Fractured {
        /// The same seed gives the same tiles.
        seed: u64,
    },
    /// With [`Partition::Paper`]: both tiles in every patch that allows it, and as many symmetries as its outline allows. With
    /// [`Partition::Expansion`] as [`Fill::Regular`].
    Symmetric {
        /// The same seed gives the same tiles.
        seed: u64,
    },
    /// Patches filled at random by the plane solver, all tilings of a patch equally likely.
    Random {
        /// The same seed gives the same tiles.
        seed: u64,
        /// Most panels of a patch: with more of them, fewer traces of the regular pattern, and more time. 40 is a good number;
        /// 12 the least that can change.
        patch_panels: usize,
    },
}

impl Fill {
    /// Which of the tilings of a patch.
    fn seed(self) -> u64 {
        match self {
            Self::Regular => 0,
            Self::Fractured { seed } | Self::Symmetric { seed } | Self::Random { seed, .. } => seed,
        }
    }

    /// Whether patches are of both tiles on purpose.
    fn mixes(self) -> bool {
        self != Self::Regular
    }

    /// Most panels of the patches that are grown in a pattern and drawn anew, if any are.
    fn refill_panels(self) -> Option<usize> {
        match self {
            Self::Random { patch_panels, .. } => Some(patch_panels),
            Self::Fractured { .. } => Some(40),
            Self::Regular | Self::Symmetric { .. } => None,
        }
    }
}

/// Why a surface cannot be tiled.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceError {
    /// The input is no oriented manifold.
    #[error(
        "the surface is not an oriented manifold: {} edges of three or more faces, {} edges between faces of opposite direction, {} \
         vertices that are no numbers, {} degenerate faces; merge by distance, split what touches, recalculate normals",
        edges.len(), misoriented.len(), nonfinite.len(), faces.len()
    )]
    NotManifold {
        /// Edges of more than two triangles.
        edges: Vec<[u32; 2]>,
        /// Edges whose two triangles run the same way.
        misoriented: Vec<[u32; 2]>,
        /// Vertices without a finite position.
        nonfinite: Vec<u32>,
        /// Triangles that name a vertex twice.
        faces: Vec<u32>,
    },
    /// There is nothing to tile.
    #[error("the surface has no triangles; give it at least one")]
    Empty,
    /// The edge length cannot be used.
    #[error("the edge length {edge_length} is not a positive number; the surface measures {diagonal} across")]
    EdgeLength {
        /// As given.
        edge_length: f64,
        /// Diagonal of the surface's box.
        diagonal: f64,
    },
    /// The edge length asks for more panels than can be made.
    #[error("an edge length of {edge_length} makes about {panels:.0} panels; use more than {least}")]
    TooMany {
        /// As given.
        edge_length: f64,
        /// About as many panels.
        panels: f64,
        /// The least edge length allowed.
        least: f64,
    },
    /// A marked edge is not one.
    #[error("marked edge {index} is no edge of the surface; name two joined vertices")]
    NoSuchEdge {
        /// Index into the marked edges.
        index: usize,
    },
    /// Borders and marked edges cannot be divided.
    #[error("borders and marked edges cannot be divided: {0}")]
    Curves(ResampleError),
    /// The coarse triangulation failed.
    #[error("the coarse triangulation failed: {0}")]
    Remesh(RemeshError),
    /// The result is too large for a mesh.
    #[error("the panels cannot be made a mesh: {0}")]
    Mesh(#[from] MeshError),
    /// A linear system failed.
    #[error(transparent)]
    Solver(#[from] SolveError),
    /// Faces without c-indices.
    #[error(transparent)]
    Polygons(#[from] NoCIndices),
    /// A patch graph that was given cannot be the partition.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// The surface cannot be cut into disks that can be laid flat, or one of them not be divided.
    #[error(
        "no partition into flat patches was found; mark edges that divide the surface, use smaller panels, or the expansion"
    )]
    NoPartition,
    /// No side lengths close all patches, or a patch has no tiling.
    #[error("no partition has side lengths that close all patches and leave each a tiling; choose another edge length")]
    NoLengths,
    /// The patch graph cannot be edited so.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// The plane solver failed.
    #[error("a patch could not be filled: {0}")]
    Filling(TilingError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<RemeshError> for SurfaceError {
    fn from(error: RemeshError) -> Self {
        if let RemeshError::Cancelled(cancelled) = error { cancelled.into() } else { Self::Remesh(error) }
    }
}

/// A surface in triangles and quads.
#[derive(Debug, Clone)]
pub struct SurfaceTiling {
    /// The mesh: its faces are the panels.
    pub mesh: PolygonMesh,
    /// One a face.
    pub panels: Vec<Panel>,
    /// Faces with a corner that faces away from the surface: none but where even panels of an eighth of the size found no room.
    pub turned: Vec<u32>,
    /// The edge length used: smaller than the one asked for where panels of that size turned over.
    pub edge_length: f64,
    /// Triangles of the surface at which panels a little larger than these turned over, where smaller ones than asked for were made: it is
    /// too narrow or too curved there for them.
    pub narrow: Vec<u32>,
    /// Vertices whose combinatorial angle defect is not zero, and the defect in units of 30 degrees; over all vertices it
    /// sums to 12 times the Euler characteristic.
    pub defects: Vec<(u32, i32)>,
    /// Vertices off the border.
    pub interior_vertices: usize,
    /// The patches of [`Partition::Paper`], if it was asked for and found.
    pub patch_graph: Option<PatchGraph>,
    /// Which panels belong to which of these patches; `None` with [`Fill::Random`], whose tiles lie across sides.
    pub patch_tiles: Option<PatchTiles>,
    /// Of these, how many tilings each has; `None` where they are too many to count in a quarter of a second, and for patches with
    /// rhombi.
    pub tiling_counts: Vec<Option<BigUint>>,
    /// Of these, patches that got other side lengths than the best, because these admit no tiling.
    pub relengthened_patches: Vec<u32>,
    /// Of these, patches that got rhombi, having no tiling without.
    pub patches_with_rhombi: Vec<u32>,
    /// Nodes of the patch graph that lay in the middle of an edge, where sides of half edges end, and went to one end of it.
    pub halfway_nodes: Vec<u32>,
    /// Patches that the plane solver filled, over all sweeps; none with [`Fill::Regular`].
    pub patches: usize,
    /// Those of them that got another tiling.
    pub changed_patches: usize,
    /// What the edit that led here changed; nothing in a tiling that is none's result.
    pub edit: Edit,
    /// Seconds by stage, in order.
    pub stages: Vec<(&'static str, Duration)>,
    quality: Quality,
    kept: Option<Kept>,
}

impl SurfaceTiling {
    /// The same surface with zigzags on sides of its patch graph (section 4.3, Fig. 13), besides those that are there.
    ///
    /// Sides and patches keep their indices. Only the patches beside sides that change get other tiles; with
    /// [`Fill::Random`] all are drawn anew, for its tiles lie across sides. All vertices are shaped anew.
    ///
    /// # Errors
    /// [`SurfaceError::Edit`]; cancelled. Costs a small integer programme, the tilings of the patches that change, and
    /// shaping.
    pub fn zigzag(&self, zigzags: &[Zigzag], monitor: &Monitor) -> Result<Self, SurfaceError> {
        self.kept.as_ref().ok_or(EditError::NoPatches)?.zigzagged(zigzags, monitor)
    }
}

impl SurfaceTiling {
    /// The bars that the mesh misses: what whoever builds it should know.
    pub fn missed_bars(&self) -> Vec<MissedBar> {
        self.quality.missed()
    }

    /// Vertices less edges plus faces of the mesh: those of the surface, cut apart where it touches itself in a vertex.
    pub fn euler_characteristic(&self) -> i32 {
        self.defects.iter().map(|defect| defect.1).sum::<i32>() / FULL_TURN
    }

    /// By how much the mesh misses its bars, in bars summed; 0 where it meets all. Panels turned over are a bar each.
    pub(crate) fn excess(&self) -> f64 {
        self.quality.excess() + self.turned.len() as f64
    }

    /// Whether the border is off along its edges, which [`Self::excess`] leaves out.
    pub(crate) fn is_off_border(&self) -> bool {
        self.quality.missed().iter().any(|missed| missed.bar == Bar::Borders)
    }

    /// How far from regular: the spread of edge lengths, the share of irregular vertices inside, ten times that of rhombi, and what
    /// quads are bent above the bar, in bars, summed.
    fn flaws(&self) -> f64 {
        let topology = Topology::of(&self.mesh);
        let irregular = self.defects.iter().filter(|(v, _)| !topology.is_border_vertex(*v)).count() as f64;
        let rhombi = self.panels.iter().filter(|panel| panel.kind == Kind::Rhombus).count() as f64;
        self.quality.spread
            + irregular / self.interior_vertices.max(1) as f64
            + 10.0 * rhombi / self.panels.len().max(1) as f64
            + (self.quality.bent / MOST_BENT - 1.0).max(0.0)
    }
}

/// Covers a surface by triangles and quads whose edges are about `edge_length` long, in scene units.
///
/// The surface is any oriented manifold triangle mesh, of any genus, with any borders, in any number of pieces; so is the
/// result, with the same topology, its border vertices on the borders. Costs O(n log n) for input and output.
///
/// # Errors
/// [`SurfaceError`], naming the elements to look at; only for unusable input, and when cancelled.
///
/// # Source
/// Peng et al. 2018, section 4; the construction is described at the head of this file.
pub fn tile_surface(
    surface: &TriangleMesh,
    edge_length: f64,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<SurfaceTiling, SurfaceError> {
    tile_in_room(surface, edge_length, options, 0.0, monitor)?.ok_or(SurfaceError::Empty)
}

/// As [`tile_surface`], where it is known what comes of asking for the edge length `room`; `None` where no panels larger than those have room.
pub(crate) fn tile_in_room(
    surface: &TriangleMesh,
    edge_length: f64,
    options: &SurfaceOptions,
    room: f64,
    monitor: &Monitor,
) -> Result<Option<SurfaceTiling>, SurfaceError> {
    let mut stages: Vec<(&'static str, Duration)> =
        ["check", "triangulate", "expand", "shape", "measure"].map(|s| (s, Duration::ZERO)).to_vec();
    let mut start = Instant::now();
    let mut lap = |stage: usize| {
        stages[stage].1 += start.elapsed();
        start = Instant::now();
    };
    monitor.stage("checking", 0.0)?;
    let input = Arc::new(Input::new(surface, edge_length, options, monitor)?);
    lap(0);
    if options.partition == Partition::Paper
        && let Some(tiling) = of_patches(&input, edge_length, options, &mut lap, monitor)?
    {
        lap(4);
        return Ok(Some(SurfaceTiling { stages, ..tiling }));
    }
    let mut attempts = Vec::new();
    let mut is_sound = false;
    for smaller in SMALLER {
        if room < edge_length && smaller * edge_length <= room {
            break;
        }
        let attempt = Attempt::new(&input, smaller * edge_length, options, &mut lap, monitor)?;
        is_sound = attempt.shaped.turned.is_empty();
        attempts.push(attempt);
        if is_sound {
            break;
        }
    }
    if !is_sound && room > 0.0 && room < edge_length {
        return Ok(None);
    }
    // The largest panels among those with the fewest turned over.
    let Some(place) = (0..attempts.len()).min_by_key(|&place| attempts[place].shaped.turned.len()) else {
        return Err(SurfaceError::Empty);
    };
    let narrow = if place == 0 { Vec::new() } else { attempts[place - 1].below_turned(surface) };
    let best = attempts.swap_remove(place);
    let kinds = best.pattern.kinds();
    let mesh = PolygonMesh::from_polygons(best.pattern.positions, &best.pattern.tiles)?;
    let (defects, interior_vertices) = panels::defects(&mesh);
    let panels = Panel::all(&mesh, &kinds);
    lap(4);
    Ok(Some(SurfaceTiling {
        edge_length: best.edge_length,
        patch_graph: None,
        patch_tiles: None,
        tiling_counts: Vec::new(),
        halfway_nodes: Vec::new(),
        relengthened_patches: Vec::new(),
        patches_with_rhombi: Vec::new(),
        patches: best.refilled.0,
        changed_patches: best.refilled.1,
        mesh,
        panels,
        turned: best.shaped.turned,
        narrow,
        quality: best.shaped.quality,
        defects: defects.into_iter().collect(),
        interior_vertices,
        edit: Edit::default(),
        stages,
        kept: None,
    }))
}

/// The mesh of the best patch graph found; `None` where there is none, or panels of all would turn over.
fn of_patches(
    input: &Arc<Input>,
    edge_length: f64,
    options: &SurfaceOptions,
    lap: &mut impl FnMut(usize),
    monitor: &Monitor,
) -> Result<Option<SurfaceTiling>, SurfaceError> {
    let mut best: Option<(f64, SurfaceTiling)> = None;
    let (mut tried, mut seen) = (Vec::new(), Vec::new());
    for tolerances in TOLERANCES.chunks(2) {
        let mut drafts: Vec<Draft> = Vec::new();
        for &tolerance in tolerances {
            if let Some(draft) = Draft::new(input, edge_length, options, tolerance, monitor)?
                && !tried.contains(&draft.outline())
            {
                tried.push(draft.outline());
                drafts.push(draft);
            }
        }
        // Charts that lattices fit are worth trying first.
        drafts.sort_by_key(Draft::is_odd);
        for draft in drafts {
            let papers = Paper::new(input, &draft, &mut seen, edge_length, options, lap, monitor)?;
            for paper in papers.into_iter().filter(|paper| paper.shaped.turned.is_empty()) {
                let tiling = paper.measured(Vec::new())?;
                let flaws = tiling.flaws();
                if tiling.quality.spread <= MOST_SPREAD && best.as_ref().is_none_or(|(least, _)| flaws < *least) {
                    best = Some((flaws, tiling));
                }
            }
            if best.as_ref().is_some_and(|(flaws, _)| *flaws < FEW_FLAWS) {
                break;
            }
        }
        if best.as_ref().is_some_and(|(_, tiling)| tiling.quality.bent <= MOST_BENT) {
            break;
        }
    }
    Ok(best.map(|(_, tiling)| tiling))
}

/// The surface tiled with one edge length.
struct Attempt {
    edge_length: f64,
    pattern: Pattern,
    shaped: Shaped,
    /// Patches filled, and how many of them changed.
    refilled: (usize, usize),
}

impl Attempt {
    fn new(
        input: &Input,
        edge_length: f64,
        options: &SurfaceOptions,
        lap: &mut impl FnMut(usize),
        monitor: &Monitor,
    ) -> Result<Self, SurfaceError> {
        monitor.stage("triangulating", 0.0)?;
        let steps = [STEP, CURVE_STEP].map(|step| step * edge_length);
        let coarse = coarse::coarse(&input.mesh, &input.followed, options.corner_angle, steps, monitor)?;
        lap(1);
        let mut pattern = Pattern::expand(&coarse);
        let mut refilled = (0, 0);
        if let Some(patch_panels) = options.fill.refill_panels() {
            monitor.stage("filling", 0.0)?;
            refilled = fill::refill(&mut pattern, patch_panels, options.fill.seed(), monitor)?;
        }
        lap(2);
        let shaped = bars::shape_to_bars(&input.mesh, &coarse.curves, &mut pattern, options.shape, true, monitor)?;
        lap(3);
        Ok(Self { edge_length, pattern, shaped, refilled })
    }

    /// Triangles of the surface nearest to the middles of panels that are turned over, in order.
    fn below_turned(&self, surface: &TriangleMesh) -> Vec<u32> {
        let closest = ClosestPoint::new(surface);
        let tiles = self.shaped.turned.iter().map(|&t| &self.pattern.tiles[t as usize]);
        let below = tiles.map(|tile| {
            let sum: DVec3 = tile.iter().map(|&v| self.pattern.positions[v as usize]).sum();
            closest.project(sum / tile.len() as f64).triangle
        });
        below.filter(|&triangle| triangle != NONE).collect::<BTreeSet<_>>().into_iter().collect()
    }
}
