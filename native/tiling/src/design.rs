//! Designs of patches (`PatchDesign`) on polygon meshes, as `polygons` has tilings of them: in scene units, for a count of
//! panels or an edge length.

use crate::panel_count::{Search, tries};
use crate::polygons::{PanelSize, Place, PolygonTiling, PolygonsError, Prepared, prepare};
use crate::surface::{
    DrawnGraph, Fill, PatchDesign, PatchGraph, Proposal, ShapeOptions, SurfaceError, SurfaceOptions, SurfaceTiling,
};
use mesh::{Monitor, PolygonMesh};

/// Part of the progress for the cuts, after the edge length is known.
const CUT_PART: f64 = 0.3;

/// The patches of a polygon mesh, being chosen. As [`PatchDesign`], it does not change: steps give other designs.
#[derive(Clone)]
pub struct PolygonDesign {
    design: PatchDesign,
    size: PanelSize,
    place: Place,
    taken_apart: Vec<u32>,
}

impl PolygonDesign {
    /// A surface cut into disks, with their corners; or, given a graph in scene units, the partition that it is.
    ///
    /// # Errors
    /// [`PolygonsError`] as [`crate::tile_polygons`], and those of [`PatchDesign::new`] and [`PatchDesign::of_graph`].
    pub fn new(
        mesh: &PolygonMesh,
        size: PanelSize,
        graph: Option<&DrawnGraph>,
        options: &SurfaceOptions,
        monitor: &Monitor,
    ) -> Result<Self, PolygonsError> {
        let Prepared { surface, options, place, taken_apart, guess, .. } =
            monitor.within(0.0, 1.0 - CUT_PART, || prepare(mesh, size, options, monitor))?;
        let edge_length = guess.edge_length;
        let design = monitor.within(1.0 - CUT_PART, 1.0, || {
            let Some(graph) = graph else { return PatchDesign::new(&surface, edge_length, &options, monitor) };
            let graph = graph.moved(|p| place.on_unit(p));
            PatchDesign::of_graph(&surface, &graph, edge_length, &options, monitor)
        });
        let design = design.map_err(|error| place.in_scene_units(error))?;
        Ok(Self { design, size, place, taken_apart })
    }

    /// Total interior defect of each part, as [`PatchDesign::defects`].
    pub fn defects(&self) -> Vec<i32> {
        self.design.defects()
    }

    /// The parts as a graph, as [`PatchDesign::graph`]; scene units.
    pub fn graph(&self) -> Option<PatchGraph> {
        Some(self.design.graph()?.moved(|p| self.place.in_scene(p)))
    }

    /// Length of the panels' edges, scene units.
    pub fn edge_length(&self) -> f64 {
        self.design.edge_length() * self.place.scale
    }

    /// The admissible partitions of a part, as [`PatchDesign::admissible_partitions`]; their curves in scene units.
    ///
    /// # Errors
    /// Cancelled.
    pub fn admissible_partitions(&self, part: usize, monitor: &Monitor) -> Result<Vec<Proposal>, PolygonsError> {
        let mut found = self.design.admissible_partitions(part, monitor)?;
        for p in found.iter_mut().flat_map(|proposal| proposal.curves.iter_mut().flatten()) {
            *p = self.place.in_scene(*p);
        }
        Ok(found)
    }

    /// The design with a part divided, as [`PatchDesign::divided`].
    #[must_use]
    pub fn divided(&self, part: usize, proposal: &Proposal) -> Self {
        Self { design: self.design.divided(part, proposal), ..self.clone() }
    }

    /// Tiles the surface; parts that are not flat yet are divided automatically. A count of panels is met by changing the edge
    /// length, for the same patches.
    ///
    /// # Errors
    /// As [`PatchDesign::tile`].
    pub fn tile(&self, fill: Fill, shape: ShapeOptions, monitor: &Monitor) -> Result<PolygonTiling, PolygonsError> {
        let make = |length, low, high| monitor.within(low, high, || self.design.tile(length, fill, shape, monitor));
        let mut made = make(self.design.edge_length(), 0.0, 0.6)?;
        if let PanelSize::Count(count) = self.size {
            let mut search = Search::new(count);
            search.note(made.edge_length, made.edge_length, made.mesh.face_count());
            for _ in 1..tries(count) {
                let Some(length) = search.next(&[]) else { break };
                // Patches may close at one length and not at another nearby.
                match make(length, 0.6, 1.0) {
                    Ok(other) => {
                        search.note(length, length, other.mesh.face_count());
                        let off = |made: &SurfaceTiling| search.off(made.mesh.face_count()).abs();
                        if off(&other) < off(&made) {
                            made = other;
                        }
                    }
                    Err(SurfaceError::NoLengths) => search.fail(length),
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(PolygonTiling::new(made, self.taken_apart.clone(), self.place))
    }
}
