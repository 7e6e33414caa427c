//! How many edges go along each stretch of a traced layout: `QuadMixer`, section 3.3, with the needs of features.

use super::Remaking;
use crate::density::CHORD_ERROR;
use crate::division;
use crate::fill::Place;
use mesh::{Cancelled, DVec3, Monitor, sorted};
use quadrangulate::layout::{PatchLayout, SubSideKind};
use quadrangulate::quantise::{self, Quantisation, quantise};
use quadrangulate::{Filler, PatchTopology};
use std::collections::{BTreeMap, BTreeSet};

/// Share of even sizes against regular patches. With 0.3 a goat's head had 154 instead of 122 irregular vertices.
const ALPHA: f64 = 0.1;
/// Layouts with more free counts get rounded ones: a proof of the best takes longer than it is worth.
const MOST_VARIABLES: usize = 60;
/// Times that counts are found with sizes nearer to the wanted number of quads, unless it is met this closely.
const ROUNDS: usize = 6;
const CLOSE: f64 = 0.01;
/// How much more the length of a stretch counts each time that it has fewer edges than its bends need, and what that costs beside the
/// logarithm of the number of quads.
const INSIST: f64 = 4.0;
const SHORT: f64 = 0.01;

/// A stretch of a sub-side between base vertices.
#[derive(Clone)]
pub(super) struct Piece {
    /// Path in the layout's mesh.
    pub vertices: Vec<u32>,
    pub kind: SubSideKind,
    /// Edges wanted along it.
    pub ideal: f64,
    /// Edges that its bends need.
    pub needed: f64,
    /// The count that quads which are kept ask for.
    pub fixed: Option<u32>,
}

/// Counts along all pieces and the patterns of the patches that are laid.
pub(super) struct Plan {
    /// Those of the layout, then those where it has no patch.
    pub pieces: Vec<Piece>,
    /// The pieces along each base edge on a rail, and whether they run its way.
    pub chain: Vec<Vec<(usize, bool)>>,
    /// The patches that are laid.
    pub active: Vec<usize>,
    /// Edges along each piece.
    pub counts: Vec<u32>,
    /// The pattern of each patch that is laid.
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

/// Edges along each piece, and the pattern of each patch that is laid.
type Counted = (Vec<u32>, Vec<PatchTopology>);

impl Remaking<'_, '_> {
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
                        0.0
                    } else {
                        let points: Vec<DVec3> = vertices.iter().map(|&v| at(v)).collect();
                        let edge = vertices.iter().map(|&v| sizes[v as usize]).sum::<f64>() / vertices.len() as f64;
                        division::parts(&points, CHORD_ERROR * edge, shortest * edge).len() as f64
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

    /// Counts and patterns with the parts that are kept as they are; `None` where there are none.
    pub fn plan(&self, traced: &Traced, monitor: &Monitor) -> Result<Option<Plan>, Cancelled> {
        let Self { work, part_of, kept, .. } = self;
        // Edges of quads that are kept.
        let mut given = BTreeSet::new();
        for (quad, _) in work.filled.quads.iter().zip(part_of).filter(|(_, part)| kept[**part as usize]) {
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
                    needed: 0.0,
                    fixed: Some(n),
                });
                i = to;
            }
        }
        let active: Vec<usize> =
            (0..traced.sides.len()).filter(|&p| !kept[traced.layout.patches[p].part as usize]).collect();
        let quads = part_of.iter().filter(|&&part| !kept[part as usize]).count();
        let Some((counts, topologies)) = traced.counts(&pieces, &active, quads, monitor)? else { return Ok(None) };
        Ok(Some(Plan { pieces, chain, active, counts, topologies }))
    }
}

impl Traced {
    /// Counts for about so many quads, and the pattern of each patch.
    fn counts(
        &self,
        pieces: &[Piece],
        active: &[usize],
        target: usize,
        monitor: &Monitor,
    ) -> Result<Option<Counted>, Cancelled> {
        let options = quantise::Options {
            alpha: ALPHA,
            most_variables: MOST_VARIABLES,
            max_nodes: 1,
            ..quantise::Options::default()
        };
        let mut filler = Filler::new();
        let mut scale = 1.0;
        let mut weights = vec![1.0; pieces.len()];
        let mut best: Option<(f64, Vec<u32>, Vec<PatchTopology>)> = None;
        for _ in 0..ROUNDS {
            let problem = quantise::Layout {
                sub_sides: pieces
                    .iter()
                    .zip(&weights)
                    .map(|(piece, &weight)| quantise::SubSide {
                        ideal: (piece.ideal * scale).max(piece.needed),
                        fixed: piece.fixed,
                        weight,
                    })
                    .collect(),
                patches: active.iter().map(|&p| quantise::Patch { sides: self.sides[p].clone() }).collect(),
            };
            let found = quantise(&problem, &options, &|| monitor.is_cancelled());
            monitor.check()?;
            // A patch between parts that are kept may have no room.
            let Ok(Quantisation { counts, .. }) = found else { return Ok(None) };
            let mut topologies = vec![];
            for sides in active.iter().map(|&p| &self.sides[p]) {
                monitor.check()?;
                let sides: Vec<u32> = sides.iter().map(|side| side.iter().map(|&p| counts[p as usize]).sum()).collect();
                let Ok(found) = filler.fill(&sides) else { return Ok(None) };
                topologies.push(found);
            }
            let quads: usize = topologies.iter().map(|t| t.quads.len()).sum();
            let miss = (quads as f64 / target as f64).ln();
            let mut short = 0_u32;
            for ((piece, &count), weight) in pieces.iter().zip(&counts).zip(&mut weights) {
                if piece.fixed.is_none() && f64::from(count) < piece.needed {
                    *weight *= INSIST;
                    short += 1;
                }
            }
            let off = miss.abs() + SHORT * f64::from(short);
            if best.as_ref().is_none_or(|(found, ..)| off < *found) {
                best = Some((off, counts, topologies));
            }
            if off < CLOSE {
                break;
            }
            scale *= (-miss / 2.0).exp();
        }
        Ok(best.map(|(_, counts, topologies)| (counts, topologies)))
    }
}
