//! Retraction (section 3.1, Fig. 6 c-e): which quads of the inputs are kept.
//!
//! A quad stays when the exact boolean left it whole and it lies beyond the retraction distance, measured in edge
//! lengths along the surface. The kept set is then regrouped so that its border is straight ([`crate::regroup`]), small
//! islands go (pruning), and vertices where it would be pinched are opened.

use crate::intersect::{Cut, Input};
use crate::{Cancelled, Options, Regroup, layout, plan, regroup};
use mesh::{Monitor, NONE};
use std::collections::BTreeMap;
use surface::geodesic::distance_field;

/// An island of fewer kept quads than this, cut off from the rest, is remade (the authors' default is 4 to 6).
const SMALLEST_ISLAND: usize = 6;

/// Kept quads of one input. `keep[q]` is true for those that come back unchanged.
pub type Kept = [Vec<bool>; 2];

/// Decides which quads are kept.
///
/// `distance` is the retraction distance in edge lengths; `curve_edge` the mean edge length planned on the curve.
///
/// # Errors
/// [`Cancelled`].
pub fn retract(
    inputs: &[Input<'_>; 2],
    cut: &Cut,
    distance: f64,
    curve_edge: f64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Kept, Cancelled> {
    let mut kept: Kept = std::array::from_fn(|m| cut.whole[m].iter().map(Option::is_some).collect());
    let sources = curve_vertices(cut);
    let longest = inputs.iter().flat_map(|i| &i.edge_length).fold(curve_edge, |a, &b| a.max(b));
    let field = distance_field(&cut.surface, &cut.topology, &sources, distance * longest, monitor)?;
    for (m, input) in inputs.iter().enumerate() {
        for (q, halves) in cut.whole[m].iter().enumerate() {
            let Some(halves) = halves else { continue };
            let nearest = halves
                .iter()
                .flat_map(|&t| cut.surface.triangles[t as usize])
                .map(|v| field[v as usize])
                .fold(f64::INFINITY, f64::min);
            // Near small quads the curve has edges shorter than its mean.
            let own = input.edge_length[q];
            let unit = own.max(curve_edge.min(plan::LARGEST_STEP * own));
            // A quad that touches the curve has no room beside it, whatever the distance.
            if nearest <= 0.0 || nearest < distance * unit {
                kept[m][q] = false;
            }
        }
    }
    for m in 0..2 {
        monitor.check()?;
        let cut_off: Vec<bool> = kept[m].iter().zip(&cut.whole[m]).map(|(&k, w)| !k && w.is_some()).collect();
        match options.regroup {
            Regroup::Rows => regroup::drop_rows(&inputs[m], &mut kept[m]),
            Regroup::Rectangles => {
                let patches = layout::trace(&inputs[m], options.layout);
                regroup::inscribe_rectangles(&inputs[m], &patches, &mut kept[m]);
            }
        }
        drop_islands(&inputs[m], &mut kept[m]);
        open_pinches(&inputs[m], &mut kept[m]);
        restore_lakes(&inputs[m], cut, m, &cut_off, &mut kept[m]);
    }
    Ok(kept)
}

/// Vertices on the intersection curve.
pub fn curve_vertices(cut: &Cut) -> Vec<u32> {
    let mut vertices: Vec<u32> =
        (0..cut.topology.len() as u32).filter(|&h| cut.on_curve(h)).map(|h| cut.topology.from(h)).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Groups faces that share an edge; `same` says which faces take part. Returns a label for each face, [`NONE`] outside.
pub fn components(input: &Input<'_>, part: impl Fn(usize) -> bool) -> (Vec<u32>, usize) {
    let topology = &input.topology;
    let faces = input.quads.face_count();
    let mut label = vec![NONE; faces];
    let mut count = 0;
    for start in 0..faces {
        if label[start] != NONE || !part(start) {
            continue;
        }
        let mut stack = vec![start];
        label[start] = count;
        while let Some(f) = stack.pop() {
            for c in input.quads.face_corners(f) {
                let t = topology.twin[c];
                if t == NONE {
                    continue;
                }
                let g = topology.face[t as usize] as usize;
                if label[g] == NONE && part(g) {
                    label[g] = count;
                    stack.push(g);
                }
            }
        }
        count += 1;
    }
    (label, count as usize)
}

/// Pruning: remakes kept components that are too small to be worth a border, unless the cut never reached them.
fn drop_islands(input: &Input<'_>, kept: &mut [bool]) {
    let (label, count) = components(input, |f| kept[f]);
    let mut size = vec![0; count];
    let mut touched = vec![false; count];
    for f in 0..kept.len() {
        if label[f] == NONE {
            continue;
        }
        size[label[f] as usize] += 1;
        for c in input.quads.face_corners(f) {
            let t = input.topology.twin[c];
            if t == NONE || !kept[input.topology.face[t as usize] as usize] {
                touched[label[f] as usize] = true;
            }
        }
    }
    for f in 0..kept.len() {
        if label[f] != NONE && touched[label[f] as usize] && size[label[f] as usize] < SMALLEST_ISLAND {
            kept[f] = false;
        }
    }
}

/// Where kept quads meet at a vertex in more than one fan, only the largest fan stays, until no such vertex is left.
fn open_pinches(input: &Input<'_>, kept: &mut [bool]) {
    loop {
        let mut dropped = false;
        for v in 0..input.quads.vertex_count() as u32 {
            let around: Vec<u32> = input.topology.around(v).map(|h| input.topology.face[h as usize]).collect();
            let n = around.len();
            if n == 0 || around.iter().all(|&f| kept[f as usize]) || around.iter().all(|&f| !kept[f as usize]) {
                continue;
            }
            // Start just after a gap, so that fans do not wrap.
            let start = (0..n).find(|&k| !kept[around[k] as usize]).expect("a gap");
            let mut fans: Vec<Vec<u32>> = vec![vec![]];
            for k in 0..n {
                let f = around[(start + k) % n];
                if kept[f as usize] {
                    fans.last_mut().expect("one fan").push(f);
                } else if !fans.last().expect("one fan").is_empty() {
                    fans.push(vec![]);
                }
            }
            fans.retain(|f| !f.is_empty());
            if fans.len() < 2 {
                continue;
            }
            let largest = (0..fans.len()).max_by_key(|&k| (fans[k].len(), usize::MAX - k)).expect("two fans");
            for (k, fan) in fans.iter().enumerate() {
                if k != largest {
                    for &f in fan {
                        kept[f as usize] = false;
                    }
                    dropped = true;
                }
            }
        }
        if !dropped {
            return;
        }
    }
}

/// Quads dropped by regrouping that form a lake of their own, away from the cut, come back.
fn restore_lakes(input: &Input<'_>, cut: &Cut, m: usize, near_curve: &[bool], kept: &mut [bool]) {
    let before = kept.to_vec();
    let (label, count) = components(input, |f| !before[f]);
    let mut reached = vec![false; count];
    for f in 0..kept.len() {
        if label[f] != NONE && (cut.whole[m][f].is_none() || near_curve[f]) {
            reached[label[f] as usize] = true;
        }
    }
    for f in 0..kept.len() {
        if label[f] != NONE && !reached[label[f] as usize] {
            kept[f] = true;
        }
    }
}

/// For each kept corner situation: number of kept quads at each vertex.
pub fn kept_valence(input: &Input<'_>, kept: &[bool]) -> BTreeMap<u32, u32> {
    let mut valence = BTreeMap::new();
    for f in (0..kept.len()).filter(|&f| kept[f]) {
        for &v in input.quads.face(f) {
            *valence.entry(v).or_default() += 1;
        }
    }
    valence
}
