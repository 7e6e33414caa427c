//! How many edges go along each stretch of a traced layout: `QuadMixer`, section 3.3, with the needs of features.

use super::Parts;
use super::compare::MOST_OFF;
use crate::density::CHORD_ERROR;
use crate::division;
use crate::fill::Place;
use mesh::{Cancelled, DVec3, Monitor, NONE, sorted};
use quadrangulate::layout::{PatchLayout, SubSideKind};
use quadrangulate::quantise::{self, Quantisation, quantise_instantly};
use quadrangulate::{Filler, PatchTopology};
use std::collections::{BTreeMap, BTreeSet};

/// Share of even sizes against regular patches. With 0.1 a fish and a goat's head had a tenth more irregular vertices, with 0.03 theirs
/// were no fewer and angles less even.
const ALPHA: f64 = 0.05;
/// Times that counts are found with sizes nearer to the wanted number of quads, unless it is met this closely.
const ROUNDS: usize = 6;
const CLOSE: f64 = 0.01;
/// And not at all where it is missed by more than this at the second time: of 33 layouts one came within [`MOST_OFF`] after that. Logarithms.
const HOPELESS: f64 = 0.4;
/// Where it is missed by more than this, and the logarithm of the quads grows by less than that of the scale, the next scale follows what
/// it grew by, at least this.
const FAR: f64 = 0.2;
const LEAST_SLOPE: f64 = 0.3;

/// A stretch of a sub-side between base vertices.
#[derive(Clone)]
pub(super) struct Piece {
    /// Path in the layout's mesh.
    pub vertices: Vec<u32>,
    pub kind: SubSideKind,
    /// Edges wanted along it.
    pub ideal: f64,
    /// Edges that its bends need.
    pub needed: u32,
    /// The count that quads which stay ask for.
    pub fixed: Option<u32>,
}

/// Counts along all pieces and the patterns of the patches.
pub(super) struct Plan {
    /// Those of the layout, then those where it has no patch.
    pub pieces: Vec<Piece>,
    /// The pieces along each base edge on a rail, and whether they run its way.
    pub chain: Vec<Vec<(usize, bool)>>,
    /// Edges along each piece.
    pub counts: Vec<u32>,
    /// The pattern of each patch.
    pub topologies: Vec<PatchTopology>,
}

/// A layout whose sides are pieces.
pub(super) struct Traced {
    pub layout: PatchLayout,
    /// The edge length wanted at each of its vertices.
    pub sizes: Vec<f64>,
    pub pieces: Vec<Piece>,
    /// Pieces of each side of each patch, in order.
    pub sides: Vec<Vec<Vec<u32>>>,
}

/// Edges along each piece, and the pattern of each patch.
type Counted = (Vec<u32>, Vec<PatchTopology>);

impl Parts<'_, '_> {
    /// Cuts a layout's sub-sides at base vertices, which stay vertices. `sizes` are the edge lengths wanted at its vertices.
    pub fn traced(&self, layout: PatchLayout, sizes: Vec<f64>) -> Traced {
        let places = &self.work.filled.places;
        let is_base = |v: u32| matches!(places.get(v as usize), Some(Place::Corner(_)));
        let shortest = self.shortest;
        let at = |v: u32| layout.mesh.positions[v as usize];
        let mut pieces = Vec::new();
        let mut of_sub_side = Vec::new();
        for sub_side in &layout.sub_sides {
            let first = pieces.len() as u32;
            let mut from = 0;
            let path = &sub_side.vertices;
            for k in 1..path.len() {
                if k + 1 == path.len() || sub_side.kind != SubSideKind::Trace && is_base(path[k]) {
                    let vertices = path[from..=k].to_vec();
                    let step = |w: &[u32]| {
                        at(w[0]).distance(at(w[1])) / f64::midpoint(sizes[w[0] as usize], sizes[w[1] as usize])
                    };
                    let ideal = vertices.windows(2).map(step).sum();
                    let needed = if sub_side.kind == SubSideKind::Trace || shortest.is_infinite() {
                        0
                    } else {
                        let points: Vec<DVec3> = vertices.iter().map(|&v| at(v)).collect();
                        let edge = self.bend_edge * vertices.iter().map(|&v| sizes[v as usize]).sum::<f64>()
                            / vertices.len() as f64;
                        division::parts(&points, CHORD_ERROR * edge, shortest * edge).len() as u32
                    };
                    pieces.push(Piece { vertices, kind: sub_side.kind, ideal, needed, fixed: None });
                    from = k;
                }
            }
            of_sub_side.push(first..pieces.len() as u32);
        }
        let sides = layout
            .patches
            .iter()
            .map(|patch| {
                let mut from = patch.corners[0];
                let mut sides = Vec::new();
                for side in &patch.sides {
                    let mut all = Vec::new();
                    for &s in side {
                        let path = &layout.sub_sides[s as usize].vertices;
                        let own = of_sub_side[s as usize].clone();
                        if path[0] == from {
                            all.extend(own);
                            from = path[path.len() - 1];
                        } else {
                            all.extend(own.rev());
                            from = path[0];
                        }
                    }
                    sides.push(all);
                }
                sides
            })
            .collect();
        Traced { layout, sizes, pieces, sides }
    }

    /// Counts and patterns beside the quads that stay; `None` where there are none.
    pub fn plan(&self, traced: &Traced, monitor: &Monitor) -> Result<Option<Plan>, Cancelled> {
        let Self { work, part_of, .. } = self;
        // Edges of quads that stay.
        let mut given = BTreeSet::new();
        for (quad, _) in work.filled.quads.iter().zip(part_of).filter(|(_, part)| **part == NONE) {
            given.extend((0..4).map(|k| sorted(quad[k], quad[(k + 1) % 4])));
        }
        let mut pieces = traced.pieces.clone();
        for piece in &mut pieces {
            if piece.kind != SubSideKind::Trace && given.contains(&sorted(piece.vertices[0], piece.vertices[1])) {
                piece.fixed = Some(piece.vertices.len() as u32 - 1);
            }
        }
        // Pieces by the directed edge that they start with.
        let mut starts = BTreeMap::new();
        for (p, piece) in pieces.iter().enumerate() {
            let n = piece.vertices.len();
            starts.insert([piece.vertices[0], piece.vertices[1]], (p, true));
            starts.insert([piece.vertices[n - 1], piece.vertices[n - 2]], (p, false));
        }
        // The pieces along each rail's base edges, with new ones where no patch is.
        let mut chain = vec![vec![]; work.filled.along.len()];
        let rails = work.rails();
        for (e, along) in work.filled.along.iter().enumerate().filter(|(e, _)| rails.of_edge[*e].is_some()) {
            let mut i = 0;
            while i + 1 < along.len() {
                if let Some(&(p, forward)) = starts.get(&[along[i], along[i + 1]]) {
                    chain[e].push((p, forward));
                    i += pieces[p].vertices.len() - 1;
                    continue;
                }
                let mut to = i + 1;
                while to + 1 < along.len() && !starts.contains_key(&[along[to], along[to + 1]]) {
                    to += 1;
                }
                let n = (to - i) as u32;
                chain[e].push((pieces.len(), true));
                pieces.push(Piece {
                    vertices: along[i..=to].to_vec(),
                    kind: SubSideKind::Feature,
                    ideal: f64::from(n),
                    needed: 0,
                    fixed: Some(n),
                });
                i = to;
            }
        }
        let Some((counts, topologies)) = traced.counts(&pieces, self.target, monitor)? else { return Ok(None) };
        Ok(Some(Plan { pieces, chain, counts, topologies }))
    }
}

impl Traced {
    /// Counts for about so many quads, and the pattern of each patch; `None` where bends or quads that stay leave no choice.
    fn counts(&self, pieces: &[Piece], target: f64, monitor: &Monitor) -> Result<Option<Counted>, Cancelled> {
        let options = quantise::Options { alpha: ALPHA, rows: true, ..quantise::Options::default() };
        let mut filler = Filler::new();
        let mut scale = 1.0;
        // Scales with too few quads and with too many.
        let mut between: [f64; 2] = [0.0, f64::INFINITY];
        let mut last = None;
        let mut best: Option<(f64, Vec<u32>, Vec<PatchTopology>)> = None;
        for round in 0..ROUNDS {
            let problem = quantise::Layout {
                sub_sides: pieces
                    .iter()
                    .map(|piece| quantise::SubSide {
                        ideal: piece.ideal * scale,
                        fixed: piece.fixed,
                        least: piece.needed.max(1),
                        weight: 1.0,
                    })
                    .collect(),
                patches: self.sides.iter().map(|sides| quantise::Patch { sides: sides.clone() }).collect(),
            };
            let found = quantise_instantly(&problem, &options, &|| monitor.is_cancelled());
            monitor.check()?;
            // A patch between quads that stay may have no room.
            let Ok(Quantisation { counts, .. }) = found else { return Ok(None) };
            let mut topologies = vec![];
            for sides in &self.sides {
                monitor.check()?;
                let sides: Vec<u32> = sides.iter().map(|side| side.iter().map(|&p| counts[p as usize]).sum()).collect();
                let Ok(found) = filler.fill(&sides) else { return Ok(None) };
                topologies.push(found);
            }
            let quads: usize = topologies.iter().map(|t| t.quads.len()).sum();
            let miss = (quads as f64 / target).ln();
            let off = miss.abs();
            if best.as_ref().is_none_or(|(found, ..)| off < *found) {
                best = Some((off, counts, topologies));
            }
            if off < CLOSE {
                break;
            }
            // Where bends need most of the edges, larger counts elsewhere change little.
            let reached = [scale.ln(), miss];
            let slope = last.map_or(2.0, |last: [f64; 2]| (reached[1] - last[1]) / (reached[0] - last[0]));
            let slope = if off < FAR || slope > 1.0 { 2.0 } else { slope.max(LEAST_SLOPE) };
            last = Some(reached);
            if round == 1 && off > HOPELESS && slope > 1.0 {
                return Ok(None);
            }
            between[usize::from(miss > 0.0)] = scale;
            if between[1] < (1.0 + CLOSE) * between[0] {
                break;
            }
            scale *= (-miss / slope).exp();
            if !(between[0] < scale && scale < between[1]) {
                scale = (between[0] * between[1]).sqrt();
            }
        }
        Ok(best.filter(|(off, ..)| *off <= MOST_OFF).map(|(_, counts, topologies)| (counts, topologies)))
    }
}
