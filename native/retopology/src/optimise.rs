//! Section 6: moving the vertices of the quads over the surface.
//!
//! The paper smooths with a Laplacian in the tangent plane. Its steps reach one neighbour a round, so that the layout's
//! corners, a dozen edges apart, hardly move, and it knows nothing of right angles. Here every quad pulls its corners towards
//! the rectangle nearest to it, all quads together in one linear system that is factored once (Bouaziz et al.,
//! "Shape-up: shaping discrete geometry with projections", 2012), with every vertex held near its foot point on the surface
//! or its rail. The barrier energy of [`surface::smooth`], which never inverts a quad and unfolds those that are, has
//! the last word; it stands in for the paper's halved steps.

use crate::error::LayoutError;
use crate::surfaces::Chart;
use mesh::{DVec3, Monitor, NONE};
use rayon::prelude::*;
use solve::cholesky::Factor;
use surface::smooth::{Constraint, Patch, SmoothOptions, smooth_quads};
use surface::smooth_star::{Polyline, Reference, quad_quality};

/// Weight of the foot point of a free vertex, and of one on a rail, beside 1 for each quad.
const HOLD: f64 = 0.1;
const HOLD_ON_RAIL: f64 = 3.0;

/// Quality below which no quad gets by the pull.
const FLOOR: f64 = 0.4;
/// No edge gets shorter than this fraction of the wanted length by the pull, or than it is.
const SHORTEST: f64 = 0.15;
/// Share of the way from a quad's area to the wanted one, in logarithms, and the most its sides are stretched for it. Without
/// such a pull quads slip off fingertips, and rows bunch up; but it shears quads: with 0.4 their angles were off by 9 to 15
/// degrees on CAD parts, with this by 7 to 13.
const AREA_PULL: f64 = 0.08;
const MOST_SCALE: f64 = 1.5;

/// Quads, and what they must keep to.
pub(crate) struct Shape<'a> {
    pub quads: &'a [[u32; 4]],
    /// Chart of each quad.
    pub chart_of: &'a [u32],
    pub constraints: &'a [Constraint],
    pub lines: &'a [Polyline],
    pub charts: &'a [Chart],
    /// Wanted edge length at each vertex, scene units.
    pub lengths: &'a [f64],
}

/// Moves `positions` in place by the barrier energy, `times` over, each time with the aspects that quads have by then.
pub(crate) fn smooth(
    shape: &Shape<'_>,
    positions: &mut [DVec3],
    times: usize,
    options: &SmoothOptions,
    monitor: &Monitor,
) -> Result<(), LayoutError> {
    let surfaces: Vec<&dyn Reference> = shape.charts.iter().map(|chart| chart as &dyn Reference).collect();
    let patch = Patch {
        quads: shape.quads,
        surface_of: shape.chart_of,
        constraints: shape.constraints,
        chains: shape.lines,
        surfaces: &surfaces,
    };
    for _ in 1..times {
        smooth_quads(patch, positions, &SmoothOptions { worst_sweeps: 0, ..*options }, monitor)?;
    }
    smooth_quads(patch, positions, options, monitor)?;
    Ok(())
}

/// Moves `positions` in place by `rounds` of the rectangles' pull, about 5 ms each for 4,000 quads. Quads that are valid stay so.
pub(crate) fn pull(
    shape: &Shape<'_>,
    positions: &mut [DVec3],
    rounds: usize,
    monitor: &Monitor,
) -> Result<(), LayoutError> {
    let unknown: Vec<usize> = (0..positions.len()).filter(|&v| shape.constraints[v] != Constraint::Fixed).collect();
    if unknown.is_empty() || rounds == 0 {
        return Ok(());
    }
    let mut slot = vec![usize::MAX; positions.len()];
    for (i, &v) in unknown.iter().enumerate() {
        slot[v] = i;
    }
    let hold: Vec<f64> =
        unknown.iter().map(|&v| if shape.constraints[v] == Constraint::Free { HOLD } else { HOLD_ON_RAIL }).collect();
    let mut chart = vec![0; positions.len()];
    for (quad, &c) in shape.quads.iter().zip(shape.chart_of) {
        for &v in quad {
            chart[v as usize] = c;
        }
    }
    // |x_i - mean - target|² over the corners of a quad: 3/4 on the diagonal, -1/4 elsewhere.
    let mut triplets: Vec<(usize, usize, f64)> = hold.iter().enumerate().map(|(i, &w)| (i, i, w)).collect();
    for quad in shape.quads {
        for (i, &a) in quad.iter().enumerate() {
            for (j, &b) in quad.iter().enumerate() {
                let (row, column) = (slot[a as usize], slot[b as usize]);
                if row != usize::MAX && column != usize::MAX && row >= column {
                    triplets.push((row, column, if i == j { 0.75 } else { -0.25 }));
                }
            }
        }
    }
    let factor = Factor::new(unknown.len(), &triplets)?;
    let mut around = vec![Vec::new(); positions.len()];
    for (q, quad) in shape.quads.iter().enumerate() {
        for &v in quad {
            around[v as usize].push(q as u32);
        }
    }
    // The triangle under each vertex, where the next search begins, and its normal: thin parts have another side.
    let mut under: Vec<(u32, DVec3)> = unknown
        .par_iter()
        .map_init(
            || NONE,
            |near, &v| {
                let chart = &shape.charts[chart[v] as usize];
                if let Some(foot) = chart.project_surely(positions[v], near) {
                    return (*near, foot.normal);
                }
                let mut under = NONE;
                let normal = chart.project_near(positions[v], &mut under).normal;
                (under, normal)
            },
        )
        .collect();
    for _ in 0..rounds {
        monitor.check()?;
        let mut right: Vec<DVec3> = unknown.iter().zip(&hold).map(|(&v, &w)| positions[v] * w).collect();
        for quad in shape.quads {
            let p = quad.map(|v| positions[v as usize]);
            let wanted = quad.iter().map(|&v| shape.lengths[v as usize]).sum::<f64>() / 4.0;
            let targets = rectangle(p, wanted);
            for (i, &a) in quad.iter().enumerate() {
                if slot[a as usize] == usize::MAX {
                    continue;
                }
                let mut pull = targets[i];
                for (j, &b) in quad.iter().enumerate() {
                    if slot[b as usize] == usize::MAX {
                        pull -= p[j] * if i == j { 0.75 } else { -0.25 };
                    }
                }
                right[slot[a as usize]] += pull;
            }
        }
        let mut columns: Vec<Vec<f64>> =
            (0..3).map(|axis| right.iter().map(|p| p.to_array()[axis]).collect()).collect();
        factor.solve_many(&mut columns)?;
        let feet: Vec<DVec3> = unknown
            .par_iter()
            .zip(&mut under)
            .enumerate()
            .map(|(i, (&v, (under, facing)))| {
                let moved = DVec3::new(columns[0][i], columns[1][i], columns[2][i]);
                if let Constraint::OnChain(line) = shape.constraints[v] {
                    let line = &shape.lines[line as usize];
                    return line.at(line.locate(moved));
                }
                let found = shape.charts[chart[v] as usize].project_facing(moved, *facing, under);
                *facing = found.normal;
                found.point
            })
            .collect();
        advance(shape, &around, &unknown, &feet, positions);
    }
    Ok(())
}

/// Moves vertices to their feet where no quad gets worse than [`FLOOR`] or, where it is worse, than it is; what would make one worse
/// goes part of the way, one vertex after another.
fn advance(shape: &Shape<'_>, around: &[Vec<u32>], unknown: &[usize], feet: &[DVec3], positions: &mut [DVec3]) {
    let points = |q: usize, at: &[DVec3]| shape.quads[q].map(|v| at[v as usize]);
    let all: Vec<usize> = (0..shape.quads.len()).collect();
    let normal_of = |&q: &usize| {
        let p = points(q, positions);
        (p[2] - p[0]).cross(p[3] - p[1]).normalize_or_zero()
    };
    let normals: Vec<DVec3> = all.par_iter().map(normal_of).collect();
    let start = positions.to_vec();
    let allowed: Vec<(f64, f64)> = all
        .par_iter()
        .map(|&q| {
            let p = points(q, &start);
            let wanted = shape.quads[q].map(|v| shape.lengths[v as usize]).into_iter().fold(f64::INFINITY, f64::min);
            (quad_quality(p, normals[q]).min(FLOOR), shortest_side(p).min(SHORTEST * wanted))
        })
        .collect();
    for (&v, &foot) in unknown.iter().zip(feet) {
        positions[v] = foot;
    }
    // All at once as far as that does no harm.
    let mut back = vec![false; positions.len()];
    let mut suspects = all;
    while !suspects.is_empty() {
        let harmed = |&q: &usize| {
            let p = points(q, positions);
            quad_quality(p, normals[q]) < allowed[q].0 || shortest_side(p) < allowed[q].1
        };
        let bad: Vec<usize> = suspects.into_par_iter().filter(harmed).collect();
        let mut touched = Vec::new();
        for v in bad.into_iter().flat_map(|q| shape.quads[q]) {
            let v = v as usize;
            if !back[v] {
                back[v] = true;
                positions[v] = start[v];
                touched.extend(around[v].iter().map(|&q| q as usize));
            }
        }
        touched.sort_unstable();
        touched.dedup();
        suspects = touched;
    }
    for (&v, &foot) in unknown.iter().zip(feet).filter(|(v, _)| back[**v]) {
        let worst = |positions: &[DVec3]| {
            let quality = |&q: &u32| quad_quality(points(q as usize, positions), normals[q as usize]);
            around[v].iter().map(quality).fold(f64::INFINITY, f64::min)
        };
        let shortest = |positions: &[DVec3]| {
            let beside = |&q: &u32| {
                let quad = shape.quads[q as usize];
                let k = quad.iter().position(|&corner| corner as usize == v).unwrap_or(0);
                [quad[(k + 1) % 4], quad[(k + 3) % 4]].map(|w| positions[w as usize].distance(positions[v]))
            };
            around[v].iter().flat_map(beside).fold(f64::INFINITY, f64::min)
        };
        let bound = worst(positions).min(FLOOR);
        let room = shortest(positions).min(SHORTEST * shape.lengths[v]);
        for part in [1.0, 0.5, 0.25] {
            positions[v] = start[v].lerp(foot, part);
            if worst(positions) >= bound && shortest(positions) >= room {
                break;
            }
            positions[v] = start[v];
        }
    }
}

fn shortest_side(p: [DVec3; 4]) -> f64 {
    (0..4).map(|k| p[k].distance_squared(p[(k + 1) % 4])).fold(f64::INFINITY, f64::min).sqrt()
}

/// The corners, relative to their mean, of the rectangle nearest to a quad: its mean edges, turned until they are square,
/// and brought nearer to the area of a square of the wanted edge length.
fn rectangle(p: [DVec3; 4], wanted: f64) -> [DVec3; 4] {
    let u = (p[1] - p[0] + p[2] - p[3]) / 2.0;
    let v = (p[3] - p[0] + p[2] - p[1]) / 2.0;
    let (a, b) = (u.normalize_or_zero(), v.normalize_or_zero());
    // The bisectors of two directions are square to one another; the sides lie halfway between them.
    let (sum, difference) = ((a + b).normalize_or_zero(), (a - b).normalize_or_zero());
    let scale = (wanted * wanted / (u.length() * v.length()).max(f64::MIN_POSITIVE)).powf(AREA_PULL / 2.0);
    let scale = scale.clamp(1.0 / MOST_SCALE, MOST_SCALE) * 0.5_f64.sqrt();
    let (a, b) = ((sum + difference) * (scale * u.length()), (sum - difference) * (scale * v.length()));
    [(-a - b) / 2.0, (a - b) / 2.0, (a + b) / 2.0, (b - a) / 2.0]
}
