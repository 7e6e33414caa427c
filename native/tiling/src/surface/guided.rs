//! The partition by hand (Algorithm 1, "user-guided"): what parts there are, how each can be divided, best first, and the tiling
//! of what has been chosen. A design may also begin with a patch graph that was drawn.

use super::given::{DrawnGraph, draft_of_graph};
use super::input::Input;
use super::layout::{Draft, TOLERANCES};
use super::paper::Paper;
use super::partition::Division;
use super::patch_graph::PatchGraph;
use super::{Fill, ShapeOptions, SurfaceError, SurfaceOptions, SurfaceTiling};
use mesh::{DVec3, Monitor, TriangleMesh};
use std::collections::BTreeMap;
use std::sync::Arc as Shared;
use std::time::{Duration, Instant};

/// A surface being divided into patches. Designs do not change: dividing a part gives another one, so that any step can be
/// taken back. Cloning is cheap.
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
    /// Number of the next curve, once this one is taken.
    next: usize,
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

    /// Takes a patch graph that lies near a surface as its partition. Borders and followed edges divide the surface whether
    /// the graph has them or not. C-indices stay where they are known, fit the angles and close; else the nearest that close
    /// are taken.
    ///
    /// # Errors
    /// As [`PatchDesign::new`]; [`SurfaceError::Graph`] names nodes and sides of the graph.
    pub fn of_graph(
        surface: &TriangleMesh,
        graph: &DrawnGraph,
        edge_length: f64,
        options: &SurfaceOptions,
        monitor: &Monitor,
    ) -> Result<Self, SurfaceError> {
        let input = Input::new(surface, edge_length, options, monitor)?;
        let draft = draft_of_graph(&input, graph, edge_length, options, monitor)?;
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

    /// The admissible partitions of a part: no part made has a greater defect than it. Those that divide the defect come first,
    /// then those that only cut flat parts off and leave the same task behind; each the best first. Empty for an index that is
    /// none.
    ///
    /// # Errors
    /// Cancelled. Costs milliseconds for each hundred.
    pub fn admissible_partitions(&self, part: usize, monitor: &Monitor) -> Result<Vec<Proposal>, SurfaceError> {
        if part >= self.draft.regions.len() {
            return Ok(Vec::new());
        }
        let old: Vec<usize> = self.draft.regions[part].arcs.iter().map(|arc| arc.line.id).collect();
        let mut draft = self.draft.clone();
        let mut divisions = draft.divisions(part, monitor)?;
        let whole = self.draft.regions[part].defect().abs();
        divisions.sort_by_key(|division| division.parts.iter().any(|part| part.defect().abs() == whole));
        let next = draft.next;
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
                next,
            }
        };
        Ok(divisions.into_iter().map(proposal).collect())
    }

    /// The design with a part divided by one of its proposals; the parts made come last. A proposal of another part or design
    /// changes nothing that is shared, but the result may not close: pass those of this part only.
    #[must_use]
    pub fn divided(&self, part: usize, proposal: &Proposal) -> Self {
        let mut design = self.clone();
        if part < design.draft.regions.len() {
            design.draft.regions.remove(part);
            design.draft.regions.extend(proposal.division.parts.iter().cloned());
            design.draft.next = design.draft.next.max(proposal.next);
        }
        design
    }

    /// The parts as a graph, those that are not flat among them, in their order; `None` where two corners of one fall together.
    pub fn graph(&self) -> Option<PatchGraph> {
        self.draft.layout(&[]).map(|layout| layout.graph)
    }

    /// The patch graph, once all defects are zero.
    pub fn patch_graph(&self) -> Option<PatchGraph> {
        let is_done = self.defects().iter().all(|&defect| defect == 0);
        if is_done { self.graph() } else { None }
    }

    /// The edge length it was made for.
    pub fn edge_length(&self) -> f64 {
        self.edge_length
    }

    /// Tiles the surface; parts that are not flat yet are divided automatically. The edge length may be another one than the
    /// design was made for, and so may pattern and shape.
    ///
    /// # Errors
    /// [`SurfaceError::NoLengths`] when that finds nothing, no side lengths close all patches or one has no tiling; cancelled.
    pub fn tile(
        &self,
        edge_length: f64,
        fill: Fill,
        shape: ShapeOptions,
        monitor: &Monitor,
    ) -> Result<SurfaceTiling, SurfaceError> {
        let options = SurfaceOptions { fill, shape, ..self.options.clone() };
        let mut stages: Vec<(&'static str, Duration)> =
            ["check", "partition", "fill", "shape"].map(|stage| (stage, Duration::ZERO)).to_vec();
        let mut start = Instant::now();
        let mut lap = |stage: usize| {
            stages[stage].1 += start.elapsed();
            start = Instant::now();
        };
        let papers = Paper::new(&self.input, &self.draft, &mut Vec::new(), edge_length, &options, &mut lap, monitor)?;
        let tilings = papers.into_iter().map(|paper| paper.measured(Vec::new())).collect::<Result<Vec<_>, _>>()?;
        let order = |a: &SurfaceTiling, b: &SurfaceTiling| {
            a.turned.len().cmp(&b.turned.len()).then(a.flaws().total_cmp(&b.flaws()))
        };
        let best = tilings.into_iter().min_by(order).ok_or(SurfaceError::NoLengths)?;
        Ok(SurfaceTiling { stages, ..best })
    }
}
