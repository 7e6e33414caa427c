//! The planned lines put into the band's surface: afterwards its rim consists of output vertices only.

use crate::band::{self, Band};
use crate::fill::{DividedBand, Region, Under};
use crate::intersect::Input;
use crate::plan::Plan;
use crate::retract::{Kept, kept_valence};
use crate::{BooleanError, Operation};
use mesh::{Monitor, NONE, Topology, TriangleMesh};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use surface::resample::{Chain, resample_chains};

/// The band with its lines divided as planned.
#[derive(Debug)]
pub struct Resampled {
    /// The surface.
    pub surface: TriangleMesh,
    /// Input mesh and vertex of each border vertex.
    pub border_vertex: Vec<Option<(u8, u32)>>,
    /// Vertices of each arc.
    pub arcs: Vec<Vec<u32>>,
    /// Region of the band triangle that each triangle comes from.
    region: Vec<u32>,
    /// Target edge length at each vertex.
    pub size: Vec<f64>,
}

/// Divides the lines.
///
/// # Errors
/// [`BooleanError::Infeasible`] when a line cannot be divided without breaking the surface's topology.
pub fn resample(
    inputs: &[Input<'_>; 2],
    band: &Band,
    plan: &Plan,
    monitor: &Monitor,
) -> Result<Resampled, BooleanError> {
    let chains: Vec<Chain> = band
        .arcs
        .iter()
        .zip(&plan.positions)
        .map(|(arc, positions)| Chain { vertices: arc.vertices.clone(), positions: positions.clone() })
        .collect();
    let done = resample_chains(&band.surface, &chains, &[], monitor).map_err(|error| {
        if let Err(cancelled) = monitor.check() {
            return cancelled.into();
        }
        let line: BTreeSet<u32> =
            error.chain().map_or_else(BTreeSet::new, |k| band.arcs[k].vertices.iter().copied().collect());
        let touches = |t: usize| band.surface.triangles[t].iter().any(|v| line.contains(v));
        BooleanError::Infeasible {
            code: "line",
            sentence: format!("a line along the cut could not be divided ({error})"),
            elements: band.input_faces(inputs, touches),
        }
    })?;
    let mut border_vertex = vec![None; done.mesh.positions.len()];
    for (old, &new) in done.vertex.iter().enumerate() {
        if new != NONE {
            border_vertex[new as usize] = band.border_vertex[old];
        }
    }
    let region: Vec<u32> = done.source.iter().map(|&t| band.region[t as usize]).collect();
    let size = sizes(band, plan, &done.mesh, &done.vertex, &done.source);
    Ok(Resampled { surface: done.mesh, border_vertex, arcs: done.chains, region, size })
}

/// Target sizes on the new surface: kept at kept vertices, the mean of the source triangle at new ones.
fn sizes(band: &Band, plan: &Plan, mesh: &TriangleMesh, vertex: &[u32], source: &[u32]) -> Vec<f64> {
    let mut size = vec![0.0; mesh.positions.len()];
    for (triangle, &old) in mesh.triangles.iter().zip(source) {
        let corners = band.surface.triangles[old as usize];
        let mean = corners.iter().map(|&v| plan.size[v as usize]).sum::<f64>() / 3.0;
        for &v in triangle {
            if size[v as usize] == 0.0 {
                size[v as usize] = mean;
            }
        }
    }
    for (old, &new) in vertex.iter().enumerate() {
        if new != NONE {
            size[new as usize] = plan.size[old];
        }
    }
    size
}

impl Resampled {
    /// The regions, each on its own, in the band's order.
    ///
    /// # Errors
    /// [`BooleanError::Infeasible`] when dividing a line joined or split regions.
    pub fn regions(
        &self,
        inputs: &[Input<'_>; 2],
        operation: Operation,
        kept: &Kept,
        band: &Band,
    ) -> Result<Vec<Region>, BooleanError> {
        let topology = Topology::of_triangles(&self.surface);
        let mut is_line = vec![false; topology.len()];
        for path in &self.arcs {
            for pair in path.windows(2) {
                for h in [topology.find(pair[0], pair[1]), topology.find(pair[1], pair[0])].into_iter().flatten() {
                    is_line[h as usize] = true;
                }
            }
        }
        // Flips near a line may have moved single triangles to a neighbour: a region is what lies between lines, and
        // is named by most of its triangles.
        let (piece, pieces) = band::flood(&topology, |h| is_line[h as usize], self.surface.triangles.len());
        let mut votes = vec![BTreeMap::<u32, usize>::new(); pieces];
        for (&p, &r) in piece.iter().zip(&self.region) {
            *votes[p as usize].entry(r).or_default() += 1;
        }
        let name: Vec<u32> =
            votes.iter().map(|v| *v.iter().max_by_key(|&(&r, &n)| (n, u32::MAX - r)).expect("a triangle").0).collect();
        let mut names = name.clone();
        names.sort_unstable();
        let count = |r: u32| names.partition_point(|&n| n <= r) - names.partition_point(|&n| n < r);
        let merged: Vec<u32> = (0..band.region_count as u32).filter(|&r| count(r) != 1).collect();
        if !merged.is_empty() {
            return Err(BooleanError::Infeasible {
                code: "line",
                sentence: "the lines along the cut are too close together to be divided separately".into(),
                elements: band.faces_under(inputs, &merged),
            });
        }
        let valence: [_; 2] = std::array::from_fn(|m| kept_valence(&inputs[m], &kept[m]));
        // The middle vertices of split strips, counted on past the input's own, have two quads.
        let outside: Vec<u32> = self
            .border_vertex
            .iter()
            .map(|b| b.map_or(0, |(m, v)| valence[m as usize].get(&v).copied().unwrap_or(2)))
            .collect();
        let divided = DividedBand {
            surface: &self.surface,
            topology: &topology,
            is_line: &is_line,
            piece: &piece,
            size: &self.size,
            outside: &outside,
        };
        let mut regions: Vec<(u32, Region)> = (0..pieces)
            .into_par_iter()
            .map(|p| {
                let members = |labels: &[u32], label: u32| -> Vec<u32> {
                    (0..labels.len() as u32).filter(|&t| labels[t as usize] == label).collect()
                };
                let under = Under::new(inputs, operation, band, &members(&band.region, name[p]));
                let triangles = members(&piece, p as u32);
                (name[p], Region::cut_out(&divided, &triangles, under))
            })
            .collect();
        regions.sort_by_key(|r| r.0);
        Ok(regions.into_iter().map(|r| r.1).collect())
    }
}
