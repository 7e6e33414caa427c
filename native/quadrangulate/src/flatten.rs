//! Flat maps of disks onto one convex domain, so that a pattern and a piece of surface can be laid over one another.
//!
//! `QuadMixer` (Nuvoli et al. 2019, section 3.5) maps the border of a patch onto a regular polygon, the sides by arc length,
//! and the inside harmonically. So here, for the triangles with mean value weights (Floater, *Mean value coordinates*,
//! 2003) and for the quads with uniform weights (Tutte, *How to draw a graph*, 1963). Deviations: the sides of the polygon
//! bulge a little, because only a strictly convex domain keeps faces with all vertices on one side from collapsing; and
//! the two weights of an edge are averaged, which keeps them positive, hence the map one-to-one, and makes the system
//! symmetric.

use glam::{DVec2, DVec3};
use mesh::{Cancelled, Monitor};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// A place on the border of a patch: a side, and the fraction of it passed. A loop without corners is one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BorderPlace {
    pub side: usize,
    pub fraction: f64,
}

/// The point of the domain for a border place: the regular polygon with slightly bulging sides around the unit circle's
/// corners, or for fewer than three sides the unit circle.
pub(crate) fn domain_point(sides: usize, place: BorderPlace) -> DVec2 {
    let n = sides.max(1) as f64;
    if sides < 3 {
        return DVec2::from_angle(TAU * (place.side as f64 + place.fraction) / n);
    }
    let corner = |k: usize| DVec2::from_angle(TAU * k as f64 / n);
    let (from, to) = (corner(place.side), corner(place.side + 1));
    // A parabola that leaves the chord at half the angle the circle would: convex at the corners too.
    let bulge = 0.1 * (PI / (2.0 * n)).tan() * place.fraction * (1.0 - place.fraction);
    from.lerp(to, place.fraction) - (to - from).perp() * bulge
}

/// Places of the points of a border loop, by arc length on each side; `corners` index the loop, the first being 0, empty
/// for a loop without corners.
pub(crate) fn border_places(points: &[DVec3], corners: &[usize]) -> Vec<BorderPlace> {
    let starts = if corners.is_empty() { &[0] } else { corners };
    let mut places = Vec::with_capacity(points.len());
    for (side, &start) in starts.iter().enumerate() {
        let end = starts.get(side + 1).copied().unwrap_or(points.len());
        let mut passed = vec![0.0];
        for k in start..end {
            let length = points[k].distance(points[(k + 1) % points.len()]);
            passed.push(passed[k - start] + length);
        }
        let (count, total) = (end - start, passed[end - start]);
        places.extend((0..count).map(|k| {
            // A side of no length at all still has its vertices in order.
            let fraction = if total > 0.0 { passed[k] / total } else { k as f64 / count as f64 };
            BorderPlace { side, fraction }
        }));
    }
    places
}

/// Symmetric mean value weights of the edges of a triangle mesh, all positive and finite. O(triangles log triangles).
pub(crate) fn mean_value_weights(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<([u32; 2], f64)> {
    let mut weights: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let [at, left, right] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            let [a, b] = [left, right].map(|v| positions[v as usize] - positions[at as usize]);
            // tan(angle / 2); a needle's 180 degrees would make it infinite.
            let half_tangent = a.cross(b).length() / (a.length() * b.length() + a.dot(b)).max(f64::MIN_POSITIVE);
            for (to, edge) in [(left, a), (right, b)] {
                let weight = half_tangent.min(1e3) / edge.length().max(f64::MIN_POSITIVE);
                *weights.entry([at.min(to), at.max(to)]).or_default() += weight;
            }
        }
    }
    // Degenerate triangles must not make the system unsolvable: keep every weight within a factor of the typical one.
    let mut sorted: Vec<f64> = weights.values().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let typical = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    weights.into_iter().map(|(edge, w)| (edge, w.clamp(1e-4 * typical, 1e4 * typical))).collect()
}

/// Weight 1 for each edge of the quads.
pub(crate) fn uniform_weights(quads: &[[u32; 4]]) -> Vec<([u32; 2], f64)> {
    let edges = quads.iter().flat_map(|q| (0..4).map(|k| [q[k].min(q[(k + 1) % 4]), q[k].max(q[(k + 1) % 4])]));
    let mut edges: Vec<_> = edges.collect();
    edges.sort_unstable();
    edges.dedup();
    edges.into_iter().map(|edge| (edge, 1.0)).collect()
}

/// Positions where every vertex that is not fixed is the weighted mean of its neighbours: Jacobi-preconditioned conjugate
/// gradients, both coordinates side by side. Cost about O(edges x square root of vertices).
pub(crate) fn harmonic(
    weights: &[([u32; 2], f64)],
    fixed: &[Option<DVec2>],
    monitor: &Monitor,
) -> Result<Vec<DVec2>, Cancelled> {
    let free = |v: usize| fixed[v].is_none();
    let mut diagonal = vec![0.0; fixed.len()];
    for &([a, b], w) in weights {
        diagonal[a as usize] += w;
        diagonal[b as usize] += w;
    }
    let apply = |x: &[DVec2]| {
        let mut y: Vec<DVec2> = x.iter().zip(&diagonal).map(|(x, d)| *x * *d).collect();
        for &([a, b], w) in weights {
            y[a as usize] -= x[b as usize] * w;
            y[b as usize] -= x[a as usize] * w;
        }
        y.iter_mut().enumerate().filter(|(v, _)| !free(*v)).for_each(|(_, y)| *y = DVec2::ZERO);
        y
    };
    let condition = |r: &[DVec2]| -> Vec<DVec2> {
        r.iter().zip(&diagonal).map(|(r, d)| if *d > 0.0 { *r / *d } else { DVec2::ZERO }).collect()
    };
    // Both systems at once: componentwise products and quotients.
    let dot = |a: &[DVec2], b: &[DVec2]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<DVec2>();
    let ratio = |a: DVec2, b: DVec2| DVec2::new(quotient(a.x, b.x), quotient(a.y, b.y));

    let mut x: Vec<DVec2> = fixed.iter().map(|p| p.unwrap_or(DVec2::ZERO)).collect();
    let mut residual: Vec<DVec2> = apply(&x).into_iter().map(|y| -y).collect();
    let mut conditioned = condition(&residual);
    let mut direction = conditioned.clone();
    let mut size = dot(&residual, &conditioned);
    let small = size * 1e-24;
    for _ in 0..2 * fixed.len() {
        monitor.check()?;
        if size.cmple(small).all() {
            break;
        }
        let image = apply(&direction);
        let step = ratio(size, dot(&direction, &image));
        for v in 0..x.len() {
            x[v] += step * direction[v];
            residual[v] -= step * image[v];
        }
        conditioned = condition(&residual);
        let next = dot(&residual, &conditioned);
        let keep = ratio(next, size);
        for v in 0..x.len() {
            direction[v] = conditioned[v] + keep * direction[v];
        }
        size = next;
    }
    Ok(x)
}

/// `a / b`, zero when the system of that coordinate is already solved.
fn quotient(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn domain_is_strictly_convex() {
        for n in 0..20 {
            let points: Vec<DVec2> = (0..n.max(1))
                .flat_map(|side| {
                    (0..5).map(move |k| domain_point(n, BorderPlace { side, fraction: f64::from(k) / 5.0 }))
                })
                .collect();
            for k in 0..points.len() {
                let [a, b, c] = [0, 1, 2].map(|j| points[(k + j) % points.len()]);
                assert!((b - a).perp_dot(c - b) > 1e-6, "{n} sides, point {k}");
            }
        }
    }

    #[test]
    fn harmonic_points_are_means_of_their_neighbours() {
        let patch = crate::fill_disk(&[5, 4, 7, 6, 4]).unwrap();
        let p = patch.border.len();
        let weights = uniform_weights(&patch.quads);
        let fixed: Vec<_> =
            (0..patch.vertex_count).map(|v| (v < p).then(|| DVec2::from_angle(TAU * v as f64 / p as f64))).collect();
        let x = harmonic(&weights, &fixed, &Monitor::new()).unwrap();
        for v in p..patch.vertex_count {
            let around: Vec<_> = weights.iter().filter(|(e, _)| e.contains(&(v as u32))).collect();
            let sum: DVec2 = around.iter().map(|(e, _)| x[(e[0] + e[1]) as usize - v]).sum();
            assert!((sum / around.len() as f64).distance(x[v]) < 1e-9);
        }
    }
}
