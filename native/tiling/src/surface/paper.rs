//! The paper's own way (section 4.2): partition, lengths, filling, mapping, and then the shaping that all ways share.

use super::chart::Chart;
use super::halves::halfways;
use super::input::Input;
use super::layout::{Draft, Layout};
use super::panels::{self, Panel};
use super::partition::WARY;
use super::patch_graph::PatchGraph;
use super::pattern::{Pattern, Place};
use super::paving::{Paving, pave};
use super::shape::Shaped;
use super::zigzag::{Edit, Zigzag, zigzagged};
use super::{Fill, SurfaceError, SurfaceOptions, SurfaceTiling, bars, fill};
use crate::Kind;
use glam::DVec2;
use mesh::{DVec3, Monitor, PolygonMesh};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Half edges are worth moving nodes for when they take this part off the error of the lengths, or more.
const WORTH: f64 = 0.15;

/// A surface with the patches that it was divided into: what edits of the patch graph do not change.
pub(super) struct Ground {
    input: Arc<Input>,
    draft: Draft,
    layout: Layout,
    edge_length: f64,
    options: SurfaceOptions,
}

/// A surface tiled by its patch graph, kept with what is needed to tile it anew.
pub(super) struct Paper {
    ground: Arc<Ground>,
    paving: Paving,
    pattern: Pattern,
    kinds: Vec<Kind>,
    pub shaped: Shaped,
    /// As [`super::Attempt::refilled`].
    refilled: (usize, usize),
}

/// What a tiled surface keeps for edits of its patch graph.
#[derive(Clone)]
pub(super) struct Kept {
    ground: Arc<Ground>,
    paving: Arc<Paving>,
}

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Kept").finish_non_exhaustive()
    }
}

impl Paper {
    /// Divides what is not flat yet, and tiles: with sides of whole edges, and with half edges where these are nearer to the lengths of
    /// the sides. None when there is no patch graph, or no lengths for it, or it is one of those that were `seen`, to which it is added.
    pub fn new(
        input: &Arc<Input>,
        draft: &Draft,
        seen: &mut Vec<PatchGraph>,
        edge_length: f64,
        options: &SurfaceOptions,
        lap: &mut impl FnMut(usize),
        monitor: &Monitor,
    ) -> Result<Vec<Self>, SurfaceError> {
        let fewest = |pavings: &[(Layout, Paving)]| pavings.iter().map(|(_, paving)| paving.rhombi()).min();
        let mut best: Vec<(Layout, Paving)> = Vec::new();
        for mixed in WARY {
            let mut draft = draft.clone();
            if !draft.finish(mixed, monitor)? {
                break;
            }
            let Some(layout) = draft.layout(&[]).filter(|layout| !seen.contains(&layout.graph)) else { continue };
            seen.push(layout.graph.clone());
            lap(1);
            let found = pavings(layout, &draft, edge_length, options.fill, monitor)?;
            lap(2);
            if found.is_empty() {
                break;
            }
            if best.is_empty() || fewest(&found) < fewest(&best) {
                best = found;
            }
            if fewest(&best) == Some(0) {
                break;
            }
        }
        lap(1);
        best.into_iter()
            .map(|(layout, paving)| {
                let (input, draft) = (Arc::clone(input), draft.clone());
                let ground = Arc::new(Ground { input, draft, layout, edge_length, options: options.clone() });
                Self::shaped(ground, paving, lap, monitor)
            })
            .collect()
    }

    /// Puts the tiles on the surface.
    fn shaped(
        ground: Arc<Ground>,
        paving: Paving,
        lap: &mut impl FnMut(usize),
        monitor: &Monitor,
    ) -> Result<Self, SurfaceError> {
        let mut kinds = paving.kinds.clone();
        let mut pattern = placed(ground.draft.charts(), &ground.layout, &paving, monitor)?;
        let mut refilled = (0, 0);
        if let Fill::Random { seed, patch_panels } = ground.options.fill {
            // Across the sides of patches too.
            refilled = fill::refill(&mut pattern, patch_panels, seed, monitor)?;
            for (kind, tile) in kinds.iter_mut().zip(&pattern.tiles).filter(|(kind, _)| **kind != Kind::Rhombus) {
                *kind = if tile.len() == 3 { Kind::Triangle } else { Kind::Square };
            }
        }
        lap(2);
        let curves = &ground.layout.curves;
        let shaped =
            bars::shape_to_bars(&ground.input.mesh, curves, &mut pattern, ground.options.shape, false, monitor)?;
        lap(3);
        Ok(Self { ground, paving, pattern, kinds, shaped, refilled })
    }

    /// The result, measured.
    pub fn measured(self, stages: Vec<(&'static str, Duration)>) -> Result<SurfaceTiling, SurfaceError> {
        let mesh = PolygonMesh::from_polygons(self.pattern.positions, &self.pattern.tiles)?;
        let (defects, interior_vertices) = panels::defects(&mesh);
        let is_whole = !matches!(self.ground.options.fill, Fill::Random { .. });
        Ok(SurfaceTiling {
            edge_length: self.ground.edge_length,
            patches: self.refilled.0,
            changed_patches: self.refilled.1,
            panels: Panel::all(&mesh, &self.kinds),
            mesh,
            turned: self.shaped.turned,
            narrow: Vec::new(),
            quality: self.shaped.quality,
            defects: defects.into_iter().collect(),
            interior_vertices,
            patch_graph: Some(self.ground.layout.graph.clone()),
            patch_tiles: is_whole.then(|| self.paving.patch_tiles()),
            tiling_counts: self.paving.counts.clone(),
            halfway_nodes: self.paving.slides.iter().map(|slide| slide.node).collect(),
            relengthened_patches: self.paving.relengthened.clone(),
            patches_with_rhombi: self.paving.with_rhombi.clone(),
            edit: Edit::default(),
            stages,
            kept: Some(Kept { ground: self.ground, paving: Arc::new(self.paving) }),
        })
    }
}

impl Kept {
    /// The surface with zigzags.
    pub fn zigzagged(&self, zigzags: &[Zigzag], monitor: &Monitor) -> Result<SurfaceTiling, SurfaceError> {
        let Ground { layout, edge_length, options, .. } = &*self.ground;
        let mut stages = ["fill", "shape"].map(|stage| (stage, Duration::ZERO)).to_vec();
        let mut start = Instant::now();
        let found = zigzagged(&layout.graph, &self.paving, zigzags, *edge_length, options.fill, monitor)?;
        let (paving, edit) = found;
        // Laps of Paper::shaped: 2 fills, 3 shapes.
        let mut lap = |stage: usize| {
            stages[stage - 2].1 += start.elapsed();
            start = Instant::now();
        };
        let tiled = Paper::shaped(Arc::clone(&self.ground), paving, &mut lap, monitor)?;
        Ok(SurfaceTiling { edit, ..tiled.measured(stages)? })
    }
}

/// Tiles with sides of whole edges, and with half edges where these gain.
fn pavings(
    layout: Layout,
    draft: &Draft,
    edge_length: f64,
    fill: Fill,
    monitor: &Monitor,
) -> Result<Vec<(Layout, Paving)>, SurfaceError> {
    let whole = pave(&layout.graph, &[], edge_length, fill, fill.mixes(), monitor)?;
    let nodes = halfways(&layout.graph, &layout.through);
    let mut half = None;
    if !nodes.is_empty() && !fill.mixes() {
        half = pave(&layout.graph, &nodes, edge_length, fill, false, monitor)?.filter(|half| {
            let gains = |whole: &Paving| half.cost < (1.0 - WORTH) * whole.cost || half.rhombi() < whole.rhombi();
            !half.slides.is_empty() && whole.as_ref().is_none_or(gains)
        });
    }
    let mut found = Vec::new();
    if let Some(paving) = half
        && let Some(slid) = draft.layout(&paving.slides)
    {
        found.push((slid, paving));
    }
    found.extend(whole.map(|paving| (layout, paving)));
    Ok(found)
}

/// Vertices along sides at equal steps, those inside patches through the chart.
fn placed(charts: &[Chart], layout: &Layout, paving: &Paving, monitor: &Monitor) -> Result<Pattern, SurfaceError> {
    let mut positions = vec![DVec3::ZERO; paving.vertex_count];
    let mut places = vec![Place::Free; paving.vertex_count];
    for (side, along) in paving.along.iter().enumerate() {
        for &v in along {
            places[v as usize] = layout.side_places[side];
        }
    }
    for (node, &place) in layout.node_places.iter().enumerate() {
        positions[node] = layout.graph.nodes[node];
        places[node] = place;
    }
    for (p, sheet) in paving.sheets.iter().enumerate() {
        monitor.check()?;
        let mut outline = Vec::new();
        for (corner, piece) in layout.graph.patches[p].corners.iter().zip(&layout.pieces[p]) {
            let along = &paving.along[corner.side as usize];
            let count = along.len() - 1;
            let ends = [piece.from, piece.to].map(|t| piece.line.length_at(t));
            for k in 0..count {
                let t = piece.line.at_length(ends[0] + (ends[1] - ends[0]) * k as f64 / count as f64);
                let v = along[if corner.reversed { count - k } else { k }];
                if k > 0 {
                    positions[v as usize] = piece.line.point(t);
                }
                outline.push(piece.at(t).extend(0.0));
            }
        }
        let chart = &charts[layout.chart_of[p]];
        let found = sheet.harmonic(&outline)?;
        for (&v, p) in sheet.vertices.iter().zip(found).skip(sheet.outline) {
            positions[v as usize] = chart.lift(DVec2::new(p.x, p.y));
        }
    }
    Ok(Pattern { positions, places, tiles: paving.tiles.clone() })
}
