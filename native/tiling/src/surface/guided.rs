//! The partition by hand (Algorithm 1, "user-guided"): what parts there are, how each can be divided, best first, and the tiling
//! of what has been chosen.

use super::input::Input;
use super::layout::{Draft, TOLERANCES};
use super::paper::Paper;
use super::partition::Division;
use super::patch_graph::PatchGraph;
use super::{SurfaceError, SurfaceOptions, SurfaceTiling};
use mesh::{DVec3, Monitor, TriangleMesh};
use std::collections::BTreeMap;
use std::sync::Arc as Shared;
use std::time::{Duration, Instant};

/// A surface being divided into patches. Cloning is cheap: a copy is a way to look ahead, or back.
#[derive(Clone)]
pub struct PatchDesign {
    input: Shared<Input>,
    draft: Draft,
    edge_length: f64,
    options: SurfaceOptions,
}

/// One way to divide a part.
#[derive(Clone)]
pub struct Proposal {
    /// Lower is better: rounding errors of 30 degrees, gaps, bends, creases crossed and parts, summed.
    pub score: f64,
    /// The curves, as polylines on the surface.
    pub curves: Vec<Vec<DVec3>>,
    /// C-indices of each part made, counter-clockwise.
    pub c_indices: Vec<Vec<u8>>,
    /// Total interior defect of each part made, in units of 30 degrees.
    pub defects: Vec<i32>,
    division: Division,
}

impl PatchDesign {
    /// Cuts a surface into disks and finds their corners.
    ///
    /// # Errors
    /// [`SurfaceError`] for unusable input; [`SurfaceError::NoPartition`] when the surface cannot be cut into disks that can
    /// be laid flat.
    pub fn new(
        surface: &TriangleMesh,
        edge_length: f64,
        options: &SurfaceOptions,
        monitor: &Monitor,
    ) -> Result<Self, SurfaceError> {
        let input = Input::new(surface, edge_length, options, monitor)?;
        let draft =
            Draft::new(&input, edge_length, options, TOLERANCES[0], monitor)?.ok_or(SurfaceError::NoPartition)?;
        Ok(Self { input: Shared::new(input), draft, edge_length, options: options.clone() })
    }

    /// Total interior defect of each part, in units of 30 degrees: parts of defect zero are patches.
    pub fn defects(&self) -> Vec<i32> {
        self.draft.regions.iter().map(super::region::Region::defect).collect()
    }

    /// C-indices around each part, counter-clockwise; 6 where another part's side ends.
    pub fn c_indices(&self) -> Vec<Vec<u8>> {
        self.draft.regions.iter().map(|region| region.corners.clone()).collect()
    }

    /// The admissible partitions of a part, best first: no part made has a greater defect than it. Empty for an index that is none.
    ///
    /// # Errors
    /// Cancelled. Costs milliseconds for each hundred.
    pub fn admissible_partitions(&mut self, part: usize, monitor: &Monitor) -> Result<Vec<Proposal>, SurfaceError> {
        if part >= self.draft.regions.len() {
            return Ok(Vec::new());
        }
        let old: Vec<usize> = self.draft.regions[part].arcs.iter().map(|arc| arc.line.id).collect();
        let divisions = self.draft.divisions(part, monitor)?;
        let proposal = |division: Division| {
            let arcs = division.parts.iter().flat_map(|part| &part.arcs);
            let curves: BTreeMap<usize, Vec<DVec3>> = arcs
                .filter(|arc| !old.contains(&arc.line.id))
                .map(|arc| (arc.line.id, arc.line.points.clone()))
                .collect();
            Proposal {
                score: division.score,
                curves: curves.into_values().collect(),
                c_indices: division.parts.iter().map(|part| part.corners.clone()).collect(),
                defects: division.parts.iter().map(super::region::Region::defect).collect(),
                division,
            }
        };
        Ok(divisions.into_iter().map(proposal).collect())
    }

    /// Divides a part by one of its proposals; the parts made come last. A proposal of another part changes nothing that is
    /// shared, but the result may not close: pass those of this part only.
    pub fn divide(&mut self, part: usize, proposal: &Proposal) {
        if part < self.draft.regions.len() {
            self.draft.regions.remove(part);
            self.draft.regions.extend(proposal.division.parts.iter().cloned());
        }
    }

    /// The patch graph, once all defects are zero.
    pub fn patch_graph(&self) -> Option<PatchGraph> {
        let is_done = self.defects().iter().all(|&defect| defect == 0);
        if is_done { self.draft.layout().map(|layout| layout.graph) } else { None }
    }

    /// Tiles the surface; parts that are not flat yet are divided automatically.
    ///
    /// # Errors
    /// [`SurfaceError::NoLengths`] when that finds nothing, no side lengths close all patches or one has no tiling; cancelled.
    pub fn tile(&self, monitor: &Monitor) -> Result<SurfaceTiling, SurfaceError> {
        let mut stages: Vec<(&'static str, Duration)> =
            ["check", "partition", "fill", "shape"].map(|stage| (stage, Duration::ZERO)).to_vec();
        let mut start = Instant::now();
        let mut lap = |stage: usize| {
            stages[stage].1 += start.elapsed();
            start = Instant::now();
        };
        let tiled = Paper::new(&self.input, &self.draft, self.edge_length, &self.options, &mut lap, monitor)?;
        tiled.ok_or(SurfaceError::NoLengths)?.measured(stages)
    }
}
