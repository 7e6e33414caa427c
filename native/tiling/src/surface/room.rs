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

/// Vertices one after another along a curve, between corners or all round.
pub(super) struct Chain {
    /// Index of the curve.
    pub curve: usize,
    /// Without the corners.
    pub vertices: Vec<u32>,
    /// From one corner to the other, as lengths along the curve, which run on past the end of a closed one; `None` all round.
    pub stretch: Option<[f64; 2]>,
}

/// The chains of a pattern. `uses` counts the tiles at each edge. O(n log n).
pub(super) fn chains(pattern: &Pattern, curves: &[Curve], uses: &BTreeMap<[u32; 2], u8>) -> Vec<Chain> {
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
    let mut chains = Vec::new();
    let mut is_in_chain = vec![false; pattern.positions.len()];
    let at = |v: u32| pattern.positions[v as usize];
    // From a vertex by way of one beside it, as far as a chain goes, and what ends it.
    let walk = |start: u32, first: u32| {
        let (mut chain, mut before, mut here) = (Vec::new(), start, first);
        while place(here) != Place::Fixed && beside[&here].len() == 2 && here != start {
            chain.push(here);
            let next = beside[&here].iter().copied().find(|&w| w != before).unwrap_or(start);
            (before, here) = (here, next);
        }
        (chain, here)
    };
    for (&corner, first) in beside.iter().filter(|(v, _)| place(**v) == Place::Fixed) {
        for &first in first {
            let Place::OnCurve(c) = place(first) else { continue };
            if is_in_chain[first as usize] {
                continue;
            }
            let (vertices, last) = walk(corner, first);
            if place(last) != Place::Fixed || vertices.is_empty() {
                continue;
            }
            let ends = [at(corner), at(last)];
            let Some(stretch) = curves[c as usize].stretch(ends, at(vertices[vertices.len() / 2])) else { continue };
            for &v in &vertices {
                is_in_chain[v as usize] = true;
            }
            chains.push(Chain { curve: c as usize, vertices, stretch: Some(stretch) });
        }
    }
    for (&start, first) in &beside {
        let Place::OnCurve(c) = place(start) else { continue };
        if is_in_chain[start as usize] || first.len() != 2 {
            continue;
        }
        let (rest, last) = walk(start, first[0]);
        if last == start && curves[c as usize].is_closed() {
            let vertices: Vec<u32> = std::iter::once(start).chain(rest).collect();
            for &v in &vertices {
                is_in_chain[v as usize] = true;
            }
            chains.push(Chain { curve: c as usize, vertices, stretch: None });
        }
    }
    chains
}

/// For each vertex the stretch of its curve where it may be, as lengths along the curve, which run on past the end of a closed one; `None`
/// for those that are on none, and where nothing bounds them.
pub(super) fn rooms(chains: &[Chain], count: usize) -> Vec<Option<[f64; 2]>> {
    let mut rooms = vec![None; count];
    for chain in chains {
        let Some([low, high]) = chain.stretch else { continue };
        let margin = MARGIN * (high - low) / (chain.vertices.len() + 1) as f64;
        for &v in &chain.vertices {
            rooms[v as usize] = Some([low + margin, high - margin]);
        }
    }
    rooms
}
