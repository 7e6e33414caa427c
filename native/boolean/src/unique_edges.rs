//! Two vertices of the result may be joined by one edge only. Fills know nothing of each other: two may join the same two
//! rim vertices, one may join two that a kept quad joins, and a region that touches itself at a vertex may join an inner
//! vertex to it from both sides. Every such edge but the first gets a vertex on it and three quads in place of its two.

use crate::fill::{Fill, Region};
use crate::intersect::Input;
use crate::polychord::Strips;
use crate::resample::Resampled;
use crate::retract::Kept;
use mesh::{DVec3, scaled_jacobian, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::smooth_star::Reference;

/// A vertex of the result: of the band, or new in the region at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Vertex {
    Band(u32),
    New(u32),
}

type Edge = [Vertex; 2];

/// Takes the repeated edges out of all fills; returns the regions that changed, ascending. Costs O(n log n), and O(n log n)
/// again for each repeated edge of a region.
pub fn make_edges_unique(
    inputs: &[Input<'_>; 2],
    kept: &Kept,
    strips: &Strips,
    band: &Resampled,
    regions: &[Region],
    fills: &mut [Fill],
) -> Vec<usize> {
    let mut taken = edges_before(inputs, kept, strips, band);
    let mut changed = Vec::new();
    for (r, (region, fill)) in regions.iter().zip(fills).enumerate() {
        let quads = fill.quads.len();
        // Each round takes one repeated edge away and makes three of a new vertex, which only itself can repeat.
        for _ in 0..quads {
            let Some(edge) = first_repeated(region, fill, &taken) else { break };
            if !divide(region, fill, edge) {
                break;
            }
        }
        if fill.quads.len() != quads {
            changed.push(r);
        }
        taken.extend(inner_edges(region, fill).into_keys().map(|e| named(region, e)).filter(|e| !is_new(e)));
    }
    changed
}

fn is_new(edge: &Edge) -> bool {
    edge.iter().any(|v| matches!(v, Vertex::New(_)))
}

/// An edge of a fill as one of the result.
fn named(region: &Region, edge: [u32; 2]) -> Edge {
    let mut edge = edge.map(|v| region.rim.get(v as usize).map_or(Vertex::New(v), |&b| Vertex::Band(b)));
    edge.sort_unstable();
    edge
}

/// Edges that the lines, the border, and the kept quads have between band vertices.
fn edges_before(inputs: &[Input<'_>; 2], kept: &Kept, strips: &Strips, band: &Resampled) -> BTreeSet<Edge> {
    let mut taken = BTreeSet::new();
    let mut add = |a: u32, b: u32| taken.insert(sorted(a, b).map(Vertex::Band));
    for w in band.arcs.iter().flat_map(|path| path.windows(2)) {
        add(w[0], w[1]);
    }
    let mut at: BTreeMap<(u8, u32), u32> = BTreeMap::new();
    for (b, vertex) in band.border_vertex.iter().enumerate() {
        if let &Some(key) = vertex {
            at.insert(key, b as u32);
        }
    }
    let mut strips = strips.clone();
    for (m, input) in inputs.iter().enumerate() {
        let mut faces: Vec<[u32; 4]> = Vec::new();
        for f in (0..kept[m].len()).filter(|&f| kept[m][f]) {
            if strips.split[m].contains_key(&(f as u32)) {
                faces.extend(strips.pieces(input, m, f as u32).iter().map(|piece| piece.map(|(v, _)| v)));
            } else {
                faces.push(std::array::from_fn(|k| input.quads.face(f)[k]));
            }
        }
        let find = |v: u32| at.get(&(m as u8, v)).copied();
        for face in faces {
            let on_band = face.map(find);
            for k in 0..4 {
                if let (Some(a), Some(b)) = (on_band[k], on_band[(k + 1) % 4]) {
                    add(a, b);
                }
            }
        }
    }
    taken
}

/// Edges between two quads of a fill, sorted, with the half-edges (quad, corner) of both directions; without lines.
fn inner_edges(region: &Region, fill: &Fill) -> BTreeMap<[u32; 2], [(usize, usize); 2]> {
    let mut sides: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (q, quad) in fill.quads.iter().enumerate() {
        for k in 0..4 {
            sides.entry(sorted(quad[k], quad[(k + 1) % 4])).or_default().push((q, k));
        }
    }
    for line in &region.inner_lines {
        sides.remove(&sorted(line[0], line[1]));
    }
    sides.into_iter().filter_map(|(edge, at)| Some((edge, at.try_into().ok()?))).collect()
}

/// The first inner edge of a fill that the result has already.
fn first_repeated(region: &Region, fill: &Fill, taken: &BTreeSet<Edge>) -> Option<[(usize, usize); 2]> {
    let mut own = BTreeSet::new();
    let mut is_repeated = |edge: [u32; 2]| {
        let edge = named(region, edge);
        edge[0] == edge[1] || taken.contains(&edge) || !own.insert(edge)
    };
    inner_edges(region, fill).into_iter().find_map(|(edge, at)| is_repeated(edge).then_some(at))
}

/// Replaces the two quads at an edge by three round a new vertex, joined to every other corner of their hexagon: of the
/// two ways the one with the better worst quad. False when both would repeat an edge or leave a doublet.
fn divide(region: &Region, fill: &mut Fill, [(first, k), (second, l)]: [(usize, usize); 2]) -> bool {
    let [p, q] = [fill.quads[first], fill.quads[second]];
    let (u, v) = (p[k], p[(k + 1) % 4]);
    let hexagon = [u, q[(l + 2) % 4], q[(l + 3) % 4], v, p[(k + 2) % 4], p[(k + 3) % 4]];
    let points = region.points(fill);
    let at = hexagon.map(|v| points[v as usize]);
    let centre = region.under.project(at.iter().sum::<DVec3>() / 6.0).point;
    let x = points.len() as u32;
    let valence = |v: u32| fill.quads.iter().flatten().filter(|&&w| w == v).count();
    let ways = [0, 1].into_iter().filter_map(|start| {
        let spokes = [0, 2, 4].map(|j| hexagon[(start + j) % 6]);
        let mut ends = spokes.map(|v| named(region, [v, v])[0]);
        ends.sort_unstable();
        // The corner that gives up its edge: inside, it has to keep three.
        let loser = if start == 0 { v } else { u };
        let is_sound =
            ends[0] != ends[1] && ends[1] != ends[2] && ((loser as usize) < region.rim_count || valence(loser) > 3);
        let corner = |j: usize| (start + j) % 6;
        let made = [0, 2, 4].map(|j| [corner(j), corner(j + 1), corner(j + 2)]);
        let worst =
            made.iter().map(|c| scaled_jacobian([centre, at[c[0]], at[c[1]], at[c[2]]])).fold(f64::INFINITY, f64::min);
        is_sound.then(|| (worst, made.map(|c| [x, hexagon[c[0]], hexagon[c[1]], hexagon[c[2]]])))
    });
    let Some((_, made)) = ways.max_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
    fill.positions.push(centre);
    fill.quads[first] = made[0];
    fill.quads[second] = made[1];
    fill.quads.push(made[2]);
    true
}

#[cfg(test)]
#[path = "unique_edges_tests.rs"]
mod tests;
