//! Cells of the surface, one for each base vertex, and their dual: Daniels et al. 2011, sections 4.1 and 4.2.
//!
//! A vertex belongs to the field that is largest there. Triangles with one label lie in a cell, with two between two cells,
//! with three where three cells meet; the last are the base triangles. This dual is homeomorphic to the surface when every
//! cell is a disk, two cells meet in at most one arc and three in at most one point. [`Cells::flaws`] names a vertex for
//! each place where that fails; making it a base vertex too and starting over must end, since at the latest the surface
//! itself is its own dual.

use crate::fields::Fields;
use crate::metric::Metric;
use crate::split_mesh::{SplitMesh, next, prev};
use mesh::{NONE, sorted};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Where two cells meet: a base edge.
#[derive(Debug, Clone)]
pub struct CellArc {
    /// The two cells, the lower first.
    pub cells: [u32; 2],
    /// Surface edges that it crosses, as half-edges, in order.
    pub crossed: Vec<u32>,
    /// It runs back into itself.
    pub closed: bool,
    /// The piece of curve that it crosses, if any.
    pub piece: Option<u32>,
}

/// The part of a curve between two base vertices that follow one another on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// The base vertices, in the direction of the curve.
    pub ends: [u32; 2],
    /// The chain.
    pub chain: u32,
    /// Its vertices, both ends included.
    pub vertices: Vec<u32>,
}

/// The cells and how they meet.
#[derive(Debug, Clone)]
pub struct Cells {
    /// Cell of each vertex; [`NONE`] for unused ones.
    pub label: Vec<u32>,
    /// Where cells meet, in a fixed order.
    pub arcs: Vec<CellArc>,
    /// Surface triangles where three cells meet.
    pub meetings: Vec<u32>,
}

/// The label of each vertex: the first field that is largest. A vertex that is cut off from its base vertex goes to the cell
/// around it that has the larger field there. `peaks` are the base vertices; `on_curve` the labels of curve vertices.
pub fn labels(mesh: &SplitMesh, fields: &Fields, peaks: &[u32], on_curve: &[u32]) -> Vec<u32> {
    let mut label: Vec<u32> = (0..mesh.positions.len())
        .into_par_iter()
        .map(|v| {
            if on_curve[v] != NONE {
                return on_curve[v];
            }
            fields.largest(v as u32)
        })
        .collect();
    let mut used = vec![false; label.len()];
    for &v in &mesh.origin {
        used[v as usize] = true;
    }
    for (k, &v) in peaks.iter().enumerate() {
        label[v as usize] = k as u32;
    }
    // What hangs together with its base vertex.
    let mut reached = vec![false; label.len()];
    let mut open: Vec<u32> = peaks.to_vec();
    for &v in &open {
        reached[v as usize] = true;
    }
    while let Some(v) = open.pop() {
        for w in neighbours(mesh, v) {
            if !reached[w as usize] && label[w as usize] == label[v as usize] {
                reached[w as usize] = true;
                open.push(w);
            }
        }
    }
    let mut stray: Vec<u32> = (0..label.len() as u32).filter(|&v| used[v as usize] && !reached[v as usize]).collect();
    while !stray.is_empty() {
        // Decide on all before changing any, so that the order does not matter.
        let moves: Vec<(u32, u32)> = stray
            .iter()
            .filter_map(|&v| {
                let value = |k: u32| fields.value(k, v);
                neighbours(mesh, v)
                    .filter(|&w| reached[w as usize])
                    .map(|w| label[w as usize])
                    .max_by(|&a, &b| value(a).total_cmp(&value(b)).then(b.cmp(&a)))
                    .map(|k| (v, k))
            })
            .collect();
        for &(v, k) in &moves {
            label[v as usize] = k;
            reached[v as usize] = true;
        }
        stray.retain(|&v| !reached[v as usize]);
        if moves.is_empty() {
            break;
        }
    }
    for (v, used) in used.iter().enumerate() {
        if !used {
            label[v] = NONE;
        }
    }
    label
}

/// Vertices that share an edge with `v`; some twice.
fn neighbours(mesh: &SplitMesh, v: u32) -> impl Iterator<Item = u32> + '_ {
    mesh.around(v).flat_map(|h| [mesh.to(h), mesh.from(prev(h))])
}

impl Cells {
    /// Finds the arcs and meetings of labelled cells. O(n).
    pub fn new(mesh: &SplitMesh, label: Vec<u32>, pieces: &[Piece]) -> Self {
        // Along a piece the label changes once.
        let mut across = BTreeMap::new();
        for (k, piece) in pieces.iter().enumerate() {
            for pair in piece.vertices.windows(2) {
                if label[pair[0] as usize] != label[pair[1] as usize] {
                    across.insert(sorted(pair[0], pair[1]), k as u32);
                }
            }
        }
        let of = |h: u32| label[mesh.from(h) as usize];
        let cut = |h: u32| of(h) != of(next(h));
        let meetings: Vec<u32> =
            (0..mesh.origin.len() as u32 / 3).filter(|&t| cut(3 * t) && cut(3 * t + 1) && cut(3 * t + 2)).collect();
        let is_meeting = |h: u32| {
            let t = h - h % 3;
            cut(t) && cut(t + 1) && cut(t + 2)
        };
        let mut seen = vec![false; mesh.origin.len()];
        let mut arcs = Vec::new();
        // From the ends first: whatever is left then is closed.
        for ends in [true, false] {
            for h in 0..mesh.origin.len() as u32 {
                let t = mesh.twin[h as usize];
                if !cut(h) || seen[h as usize] || (ends && t != NONE && !is_meeting(t)) {
                    continue;
                }
                // Through h into its triangle, out of that through the other cut edge, and on.
                let mut crossed = vec![h];
                let mut at = h;
                loop {
                    seen[at as usize] = true;
                    if mesh.twin[at as usize] != NONE {
                        seen[mesh.twin[at as usize] as usize] = true;
                    }
                    if is_meeting(at) {
                        break;
                    }
                    let exit = if cut(next(at)) { next(at) } else { prev(at) };
                    let beyond = mesh.twin[exit as usize];
                    if seen[exit as usize] {
                        break;
                    }
                    crossed.push(exit);
                    seen[exit as usize] = true;
                    if beyond == NONE {
                        break;
                    }
                    at = beyond;
                }
                let cells = sorted(of(h), of(next(h)));
                let piece = crossed.iter().find_map(|&h| across.get(&sorted(mesh.from(h), mesh.to(h))).copied());
                arcs.push(CellArc { cells, crossed, closed: !ends, piece });
            }
        }
        Self { label, arcs, meetings }
    }

    /// Vertices that must become base vertices before the dual is a triangulation of the surface; none when it is one.
    pub fn flaws(&self, mesh: &SplitMesh, metric: &Metric, peaks: &[u32], pieces: &[Piece]) -> Vec<u32> {
        let mut euler = vec![0_i64; peaks.len()];
        for &k in self.label.iter().filter(|&&k| k != NONE) {
            euler[k as usize] += 1;
        }
        for h in 0..mesh.origin.len() as u32 {
            let k = self.label[mesh.from(h) as usize];
            let t = mesh.twin[h as usize];
            if k == self.label[mesh.to(h) as usize] && (t == NONE || h < t) {
                euler[k as usize] -= 1;
            }
            if h % 3 == 0 && [h, h + 1, h + 2].iter().all(|&g| self.label[mesh.from(g) as usize] == k) {
                euler[k as usize] += 1;
            }
        }
        // A connected piece of surface with a rim is a disk exactly when its Euler characteristic is 1.
        let bad_cell: Vec<bool> = euler.iter().map(|&e| e != 1).collect();
        let mut found: Vec<u32> = self.farthest(mesh, metric, peaks, &bad_cell);
        let sound = |cells: &[u32]| cells.iter().all(|&k| !bad_cell[k as usize]);

        // Two pieces of curve between the same base vertices.
        let mut joined = BTreeMap::<[u32; 2], &Piece>::new();
        for piece in pieces {
            let [a, b] = piece.ends;
            let other = joined.insert(sorted(a, b), piece).unwrap_or(piece);
            if a == b || other != piece {
                let longer = if other.vertices.len() > piece.vertices.len() { other } else { piece };
                found.extend((longer.vertices.len() > 2).then(|| longer.vertices[longer.vertices.len() / 2]));
            }
        }
        let mut by_pair = BTreeMap::<[u32; 2], Vec<usize>>::new();
        for (k, arc) in self.arcs.iter().enumerate() {
            by_pair.entry(arc.cells).or_default().push(k);
        }
        for (cells, mut arcs) in by_pair {
            if !sound(&cells) {
                continue;
            }
            // The arc across a curve stays, else the longest: it is the least likely to be an accident.
            arcs.sort_by_key(|&k| (self.arcs[k].piece.is_none(), usize::MAX - self.arcs[k].crossed.len()));
            let keep = usize::from(!self.arcs[arcs[0]].closed);
            let before = found.len();
            found.extend(arcs[keep..].iter().filter_map(|&k| self.middle(mesh, peaks, &self.arcs[k])));
            if keep < arcs.len() && found.len() == before {
                // All along the extra arcs base vertices meet: then the cells reach on elsewhere.
                found.extend(self.around(mesh, peaks, &cells));
            }
        }
        let mut triples = BTreeMap::<[u32; 3], u32>::new();
        let mut in_triangle = BTreeSet::new();
        for &t in &self.meetings {
            let mut cells = [0, 1, 2].map(|k| self.label[mesh.from(3 * t + k) as usize]);
            cells.sort_unstable();
            for [a, b] in [[0, 1], [1, 2], [0, 2]] {
                in_triangle.insert([cells[a], cells[b]]);
            }
            if triples.insert(cells, t).is_some() && sound(&cells) {
                found.extend(self.around(mesh, peaks, &cells));
            }
        }
        for arc in &self.arcs {
            if !in_triangle.contains(&arc.cells) && sound(&arc.cells) && !arc.closed {
                found.extend(self.middle(mesh, peaks, arc).or_else(|| self.around(mesh, peaks, &arc.cells)));
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// In each marked cell, the vertex farthest from the base vertex.
    fn farthest(&self, mesh: &SplitMesh, metric: &Metric, peaks: &[u32], marked: &[bool]) -> Vec<u32> {
        let n = mesh.positions.len();
        let (mut away, mut mark) = (vec![f64::INFINITY; n], vec![NONE; n]);
        let mut far = vec![(-1.0, NONE); peaks.len()];
        for (k, &peak) in peaks.iter().enumerate().filter(|(k, _)| marked[*k]) {
            metric.spread_within(&mut away, &mut mark, &[(peak, 0.0, k as u32)], 1.0, |v| {
                self.label[v as usize] == k as u32
            });
        }
        for (v, (&k, &away)) in self.label.iter().zip(&away).enumerate() {
            if k != NONE && marked[k as usize] && v as u32 != peaks[k as usize] {
                // What the steps do not reach is farthest of all.
                let distance = if away.is_finite() { away } else { f64::MAX };
                if distance > far[k as usize].0 {
                    far[k as usize] = (distance, v as u32);
                }
            }
        }
        far.into_iter().map(|(_, v)| v).filter(|&v| v != NONE).collect()
    }

    /// The end nearest to the middle of an arc, of the surface edges it crosses, that is no base vertex yet.
    fn middle(&self, mesh: &SplitMesh, peaks: &[u32], arc: &CellArc) -> Option<u32> {
        let free = |&v: &u32| peaks[self.label[v as usize] as usize] != v;
        let half = arc.crossed.len() / 2;
        let mut order: Vec<usize> = (0..arc.crossed.len()).collect();
        order.sort_by_key(|&k| (k.abs_diff(half), k));
        order.iter().find_map(|&k| [mesh.from(arc.crossed[k]), mesh.to(arc.crossed[k])].into_iter().find(free))
    }

    /// For cells that meet in several points: the farthest vertex of the first that has another than its base vertex.
    fn around(&self, mesh: &SplitMesh, peaks: &[u32], cells: &[u32]) -> Option<u32> {
        let mut best = None;
        for v in 0..mesh.positions.len() as u32 {
            let k = self.label[v as usize];
            if cells.contains(&k) && peaks[k as usize] != v {
                let distance = mesh.positions[v as usize].distance_squared(mesh.positions[peaks[k as usize] as usize]);
                if best.is_none_or(|(d, _)| distance > d) {
                    best = Some((distance, v));
                }
            }
        }
        best.map(|(_, v)| v)
    }
}
