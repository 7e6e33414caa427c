//! How far vertices may slide along their curves.
//!
//! Between two vertices that stay where they are, the corners of a border, the others slide to wherever their tiles become regular. At a
//! reflex corner the tiles on both sides would like them beyond it: without a bound they come to lie in the corner itself, with edges of
//! no length and triangles of no area. So a part of the step between vertices is kept free there.

use super::curve::Curve;
use super::pattern::{Pattern, Place};
use std::collections::BTreeMap;

/// The part of a step, were steps equal, that vertices keep from the ends of their stretch.
const MARGIN: f64 = 0.35;

/// For each vertex the stretch of its curve where it may be, as lengths along the curve, which run on past the end of a closed one; `None`
/// for those that are on none, and where nothing bounds them. `uses` counts the tiles at each edge.
pub(super) fn rooms(pattern: &Pattern, curves: &[Curve], uses: &BTreeMap<[u32; 2], u8>) -> Vec<Option<[f64; 2]>> {
    let place = |v: u32| pattern.places[v as usize];
    let curve_of = |[a, b]: [u32; 2]| match (place(a), place(b)) {
        (Place::OnCurve(c), Place::OnCurve(d)) if c == d => Some(c as usize),
        (Place::OnCurve(c), Place::Fixed) | (Place::Fixed, Place::OnCurve(c)) => Some(c as usize),
        _ => None,
    };
    let mut is_border = vec![false; curves.len()];
    for (&edge, _) in uses.iter().filter(|(_, uses)| **uses == 1) {
        if let Some(c) = curve_of(edge) {
            is_border[c] = true;
        }
    }
    // Vertices beside each along its curve; beside a corner, with their curves.
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (&edge, &uses) in uses {
        if curve_of(edge).is_some_and(|c| uses == 1 || !is_border[c]) {
            for [v, w] in [edge, [edge[1], edge[0]]] {
                beside.entry(v).or_default().push(w);
            }
        }
    }
    let mut rooms = vec![None; pattern.positions.len()];
    for (&corner, first) in beside.iter().filter(|(v, _)| place(**v) == Place::Fixed) {
        for &first in first {
            let Place::OnCurve(c) = place(first) else { continue };
            let curve = &curves[c as usize];
            let (mut chain, mut before, mut here) = (Vec::new(), corner, first);
            while place(here) != Place::Fixed && beside[&here].len() == 2 && chain.len() <= beside.len() {
                chain.push(here);
                let next = beside[&here].iter().copied().find(|&w| w != before).unwrap_or(corner);
                (before, here) = (here, next);
            }
            if place(here) != Place::Fixed || rooms[first as usize].is_some() {
                continue;
            }
            let at = |v: u32| pattern.positions[v as usize];
            let middle = at(chain[chain.len() / 2]);
            let Some([low, high]) = curve.stretch([at(corner), at(here)], middle) else { continue };
            let margin = MARGIN * (high - low) / (chain.len() + 1) as f64;
            for v in chain {
                rooms[v as usize] = Some([low + margin, high - margin]);
            }
        }
    }
    rooms
}
