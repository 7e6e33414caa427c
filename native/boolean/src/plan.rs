//! The plan of the lines: into how many edges the intersection curve and each crease are divided, and where.
//!
//! Not in the paper, whose border counts are all given; here the curve is a line of the layout and its count is free.
//! A quad mesh of a region needs an even border (3.4), so the free counts are adjusted by a T-join over the regions.

use crate::band::{Arc, Band};
use crate::division::Division;
use crate::intersect::{Cut, Input};
use mesh::{DVec3, Monitor, sorted};
use ordered_float::OrderedFloat;
use solve::tjoin::t_join;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// Largest distance between a planned chord and the line, as a fraction of the bounding-box diagonal.
const CHORD_ERROR: f64 = 0.0015;

/// Largest distance between a quad and a bend it spans, as a fraction of the diagonal.
const BEND_ERROR: f64 = 0.003;

/// The same as a part of the mean thickness under the band, its volume over its area: where all bends are convex this is
/// about twice the share of the volume that is lost.
const BEND_VOLUME: f64 = 0.03;

/// Bends make edges no shorter than this part of what they would be.
const SMALLEST_CAP: f64 = 0.4;

/// What edge lengths are multiplied by where an attempt failed.
const SPOT_SCALE: f64 = 0.6;

/// Growth of the edge length with the distance from where it is given.
const GRADING: f64 = 0.4;

/// Fewest edges of a closed line.
const FEWEST_ON_LOOP: usize = 4;

/// Sweeps that spread edge lengths from the border and the curve into the band.
const SIZE_SWEEPS: usize = 60;

/// Each line's division.
#[derive(Debug, Clone)]
pub struct Plan {
    /// For each arc, the arc-length parameters in (0, 1) of its inner vertices, rising.
    pub positions: Vec<Vec<f64>>,
    /// Target edge length at each band vertex, scene units.
    pub size: Vec<f64>,
}

/// The regions whose border is odd and cannot be made even by moving counts along lines they share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OddRegions(pub Vec<u32>);

/// Edges on the curve are at most this many times as long as those of the finer side.
pub const LARGEST_STEP: f64 = 2.0;

/// Edge length wanted on the curve between quads of lengths `a` and `b`.
pub fn curve_length(a: f64, b: f64) -> f64 {
    (a * b).sqrt().min(LARGEST_STEP * a.min(b))
}

/// Mean planned edge length on all curves, from the exact boolean alone.
pub fn mean_curve_length(inputs: &[Input<'_>; 2], cut: &Cut) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for h in cut.topology.edges().filter(|&h| cut.on_curve(h)) {
        let o = cut.topology.twin[h as usize];
        let [a, b] = [h, o].map(|h| {
            let s = cut.source[(h / 3) as usize];
            let input = &inputs[s.mesh as usize];
            input.edge_length[input.quad_of[s.triangle as usize] as usize]
        });
        let length = cut.surface.positions[cut.topology.from(h) as usize]
            .distance(cut.surface.positions[cut.topology.to(h) as usize]);
        sum += length * curve_length(a, b);
        weight += length;
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}

/// Plans all lines; `scale` multiplies the edge lengths (retries use less than one), and around each of the `spots` they
/// are smaller still. `volume` is that of the exact boolean, in cubed scene units.
///
/// # Errors
/// [`OddRegions`] when the borders of a group of regions that share lines sum to an odd number.
pub fn plan(
    inputs: &[Input<'_>; 2],
    band: &Band,
    diagonal: f64,
    volume: f64,
    scale: f64,
    spots: &[DVec3],
    monitor: &Monitor,
) -> Result<Plan, OddRegions> {
    let area = (0..band.surface.triangles.len()).map(|t| 0.5 * band.surface.area_normal(t).length()).sum::<f64>();
    let bend_error = scale * (BEND_ERROR * diagonal).min(BEND_VOLUME * volume.abs() / area);
    let mut size = size_field(inputs, band, diagonal, bend_error, scale);
    for &spot in spots {
        refine_at(band, spot, &mut size);
    }
    let mut divisions: Vec<Division> = band
        .arcs
        .iter()
        .map(|arc| {
            let sizes: Vec<f64> = arc.vertices.iter().map(|&v| size[v as usize]).collect();
            let fewest = if arc.is_closed() { FEWEST_ON_LOOP } else { 1 };
            Division::new(arc.points(&band.surface).collect(), &sizes, CHORD_ERROR * diagonal, fewest)
        })
        .collect();
    let ideal: Vec<f64> = divisions.iter().map(|d| d.wanted().max(d.count() as f64 - 0.5)).collect();
    let mut counts: Vec<usize> = divisions.iter().map(Division::count).collect();
    make_borders_long_enough(band, &mut counts);
    make_borders_even(band, &ideal, &mut counts, monitor)?;
    for (division, &count) in divisions.iter_mut().zip(&counts) {
        while division.count() < count {
            division.add_edge();
        }
    }
    let positions = divisions.iter().map(Division::positions).collect();
    Ok(Plan { positions, size })
}

/// Target edge length at each band vertex: given at the border (its own edges) and on the curve, spread between.
fn size_field(inputs: &[Input<'_>; 2], band: &Band, diagonal: f64, bend_error: f64, scale: f64) -> Vec<f64> {
    let (surface, topology) = (&band.surface, &band.topology);
    let count = surface.positions.len();
    let at = |v: u32| surface.positions[v as usize];
    let own = |t: u32| {
        let s = band.source[t as usize];
        let input = &inputs[s.mesh as usize];
        input.edge_length[input.quad_of[s.triangle as usize] as usize]
    };
    let mut sum = vec![0.0; count];
    let mut weight = vec![0.0; count];
    let mut fixed = vec![false; count];
    for h in topology.edges() {
        let (a, b, o) = (topology.from(h), topology.to(h), topology.twin[h as usize]);
        let length = at(a).distance(at(b));
        let wanted = if o == mesh::NONE {
            length
        } else if band.source[(h / 3) as usize].mesh != band.source[(o / 3) as usize].mesh {
            scale * curve_length(own(h / 3), own(o / 3))
        } else {
            continue;
        };
        for v in [a, b] {
            fixed[v as usize] = true;
            sum[v as usize] += wanted * length.max(1e-300);
            weight[v as usize] += length.max(1e-300);
        }
    }
    let mean = inputs.iter().map(|i| i.edge_length.iter().sum::<f64>() / i.edge_length.len() as f64).sum::<f64>() / 2.0;
    let known = (0..count).filter(|&v| fixed[v]).map(|v| sum[v] / weight[v]);
    let start = known.clone().sum::<f64>() / (known.count().max(1) as f64);
    let start = if start > 0.0 { start } else { mean };
    let mut size: Vec<f64> = (0..count).map(|v| if fixed[v] { sum[v] / weight[v] } else { start }).collect();
    for _ in 0..SIZE_SWEEPS {
        for v in 0..count as u32 {
            if fixed[v as usize] {
                continue;
            }
            let (mut total, mut weights) = (0.0, 0.0);
            for u in topology.neighbours(v) {
                let w = 1.0 / at(u).distance(at(v)).max(1e-9 * diagonal);
                total += w * size[u as usize];
                weights += w;
            }
            if weights > 0.0 {
                size[v as usize] = total / weights;
            }
        }
    }
    let mut own_size = vec![0.0_f64; count];
    for t in 0..surface.triangles.len() as u32 {
        for v in surface.triangles[t as usize] {
            own_size[v as usize] = own_size[v as usize].max(own(t));
        }
    }
    // A wide region need not be as fine as its rim: edges grow towards the input's own.
    let mut grown: Vec<f64> = (0..count).map(|v| if fixed[v] { size[v] } else { own_size[v] }).collect();
    let start: Vec<u32> = (0..count as u32).filter(|&v| fixed[v as usize]).collect();
    grade(band, &start, &fixed, &mut grown);
    for v in 0..count {
        size[v] = size[v].max(grown[v]);
    }
    // The lines follow: no filler makes a region finer than its rim.
    let given: Vec<bool> = (0..count as u32).map(|v| topology.is_border_vertex(v)).collect();
    cap_at_bends(inputs, band, bend_error, scale, &given, &mut size);
    size
}

/// Limits the growth of the edge length with the distance from the vertices `start`.
fn grade(band: &Band, start: &[u32], fixed: &[bool], size: &mut [f64]) {
    let positions = &band.surface.positions;
    let mut queue: BinaryHeap<_> = start.iter().map(|&v| (Reverse(OrderedFloat(size[v as usize])), v)).collect();
    while let Some((Reverse(OrderedFloat(s)), v)) = queue.pop() {
        if s > size[v as usize] {
            continue;
        }
        for u in band.topology.neighbours(v) {
            let graded = s + GRADING * positions[v as usize].distance(positions[u as usize]);
            if graded < size[u as usize] && !fixed[u as usize] {
                size[u as usize] = graded;
                queue.push((Reverse(OrderedFloat(graded)), u));
            }
        }
    }
}

/// Where the surface bends without a line, quads must be small to follow it: a chord of length h over a bend of angle a
/// is off by h/4 tan(a/2). Smaller sizes then grade into their surroundings.
fn cap_at_bends(inputs: &[Input<'_>; 2], band: &Band, bend_error: f64, scale: f64, fixed: &[bool], size: &mut [f64]) {
    let topology = &band.topology;
    let on_line: BTreeSet<[u32; 2]> =
        band.arcs.iter().flat_map(|arc| arc.vertices.windows(2).map(|w| sorted(w[0], w[1]))).collect();
    let normal = |h: u32| {
        let s = band.source[(h / 3) as usize];
        inputs[s.mesh as usize].triangles.area_normal(s.triangle as usize).normalize_or_zero()
    };
    let mut bent = Vec::new();
    for h in topology.edges() {
        let (a, b, o) = (topology.from(h), topology.to(h), topology.twin[h as usize]);
        if o == mesh::NONE || on_line.contains(&sorted(a, b)) {
            continue;
        }
        let angle = normal(h).dot(normal(o)).clamp(-1.0, 1.0).acos();
        let most = 4.0 * bend_error / (0.5 * angle).tan().max(1e-9);
        for v in [a, b] {
            let least = scale * SMALLEST_CAP * size[v as usize];
            if most < size[v as usize] && !fixed[v as usize] {
                size[v as usize] = most.max(least);
                bent.push(v);
            }
        }
    }
    grade(band, &bent, fixed, size);
}

/// Makes edges smaller about a point in space, on every sheet that passes there: one may be the cause of what is wrong
/// with another. Further away than a few edges nothing changes. Costs O(n).
fn refine_at(band: &Band, spot: DVec3, size: &mut [f64]) {
    let away: Vec<f64> = band.surface.positions.iter().map(|p| p.distance(spot)).collect();
    let Some(nearest) = (0..away.len()).min_by(|&a, &b| away[a].total_cmp(&away[b])) else { return };
    let wanted = SPOT_SCALE * size[nearest];
    for (v, size) in size.iter_mut().enumerate() {
        if !band.topology.is_border_vertex(v as u32) {
            *size = size.min(wanted + GRADING * away[v]);
        }
    }
}

/// Border length of each region in edges: fixed edges to kept quads, plus lines, twice where both sides are the region.
fn border_counts(band: &Band, counts: &[usize]) -> Vec<usize> {
    let mut border = vec![0; band.region_count];
    for h in 0..band.topology.len() as u32 {
        if band.topology.is_border(h) {
            border[band.region[(h / 3) as usize] as usize] += 1;
        }
    }
    for (arc, &count) in band.arcs.iter().zip(counts) {
        for r in arc.regions {
            border[r as usize] += count;
        }
    }
    border
}

/// A quad mesh needs four border edges: regions between short lines get them.
fn make_borders_long_enough(band: &Band, counts: &mut [usize]) {
    loop {
        let border = border_counts(band, counts);
        let short = |arc: &Arc| arc.regions.iter().any(|&r| border[r as usize] < 4);
        let Some(k) = (0..band.arcs.len()).filter(|&k| short(&band.arcs[k])).min_by_key(|&k| counts[k]) else {
            return;
        };
        counts[k] += 1;
    }
}

fn make_borders_even(band: &Band, ideal: &[f64], counts: &mut [usize], monitor: &Monitor) -> Result<(), OddRegions> {
    let border = border_counts(band, counts);
    let odd: Vec<u32> = (0..band.region_count as u32).filter(|&r| border[r as usize] % 2 == 1).collect();
    if odd.is_empty() {
        return Ok(());
    }
    // One edge more on a line is always possible; the relative change of its edge length is what it costs.
    let edges: Vec<(u32, u32, f64)> = band
        .arcs
        .iter()
        .zip(ideal)
        .zip(counts.iter())
        .map(|((arc, &ideal), &n)| (arc.regions[0], arc.regions[1], ((n + 1) as f64 / ideal).ln().abs()))
        .collect();
    let join = t_join(band.region_count, &edges, &odd, &|| monitor.is_cancelled()).map_err(|_| OddRegions(odd))?;
    for k in join {
        counts[k] += 1;
    }
    Ok(())
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
