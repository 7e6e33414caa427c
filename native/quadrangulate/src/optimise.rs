//! Moving the inner vertices of a flat quad mesh so that every quad comes close to a rectangle and none stays inverted.
//!
//! At each corner with the edges e1, e2 and the Jacobian J = e1 x e2 the distortion is (|e1|^2 / r + |e2|^2 r) / (2 h),
//! 1 for a rectangle of aspect r; the energy is the mean of its square. h = (J + sqrt(J^2 + 4 d^2)) / 2 stands in for J and
//! stays positive, so that inverted corners have a finite, steep energy and unfold (Escobar et al., *Simultaneous
//! untangling and smoothing of tetrahedral meshes*, 2003). d follows the worst corner and shrinks once none is inverted.

use crate::lbfgs;
use glam::DVec2;
use mesh::{Cancelled, Monitor};

/// Rounds, d being set anew in each, and steps of L-BFGS in each.
const ROUNDS: usize = 3;
const STEPS: usize = 40;

/// Aspects beyond this ratio are not worth keeping.
const MOST_ASPECT: f64 = 5.0;

/// The two edges at each corner of a quad as vertex slots: (from, to) of the first direction, then of the second. Both
/// corners on an edge see it running the same way, and J is positive where the quad is counter-clockwise.
const CORNERS: [[usize; 4]; 4] = [[0, 1, 0, 3], [0, 1, 1, 2], [3, 2, 1, 2], [3, 2, 0, 3]];

/// Improves `positions` in place; those with `fixed` stay. Each quad aims at the aspect (within 1:5) it has when a round
/// starts: taken anew each round, a grid ends up straight even when it came in wavy. Units do not
/// matter. Cost: at most 120 steps, each O(quads).
///
/// # Errors
/// [`Cancelled`], between steps.
pub fn optimise_flat(
    quads: &[[u32; 4]],
    positions: &mut [DVec2],
    fixed: &[bool],
    monitor: &Monitor,
) -> Result<(), Cancelled> {
    let at = |p: &[DVec2], q: &[u32; 4]| q.map(|v| p[v as usize]);
    let area = |[a, b, c, d]: [DVec2; 4]| (c - a).perp_dot(d - b).abs() / 2.0;
    let mean_area = quads.iter().map(|q| area(at(positions, q))).sum::<f64>() / quads.len() as f64;
    if fixed.iter().all(|&f| f) || mean_area.is_nan() || mean_area <= 0.0 {
        return Ok(());
    }
    for _ in 0..ROUNDS {
        let aspects: Vec<f64> = quads
            .iter()
            .map(|q| {
                let [a, b, c, d] = at(positions, q);
                let [first, second] = [a.distance(b) + c.distance(d), b.distance(c) + d.distance(a)];
                if second > 0.0 { (first / second).clamp(1.0 / MOST_ASPECT, MOST_ASPECT) } else { MOST_ASPECT }
            })
            .collect();
        let worst = quads.iter().flat_map(|q| jacobians(at(positions, q))).fold(f64::INFINITY, f64::min);
        let softness = if worst > 1e-3 * mean_area {
            1e-3 * mean_area
        } else {
            (0.01 * mean_area * mean_area + 0.04 * worst.min(0.0).powi(2)).sqrt()
        };
        lbfgs::minimise(positions, STEPS, 0.05 * mean_area.sqrt(), monitor, |points, gradient| {
            let value = energy(quads, &aspects, softness, points, gradient);
            gradient.iter_mut().zip(fixed).filter(|(_, f)| **f).for_each(|(g, _)| *g = DVec2::ZERO);
            value
        })?;
    }
    Ok(())
}

fn corner_edges(p: [DVec2; 4]) -> [(DVec2, DVec2); 4] {
    CORNERS.map(|[a, b, c, d]| (p[b] - p[a], p[d] - p[c]))
}

fn jacobians(p: [DVec2; 4]) -> [f64; 4] {
    corner_edges(p).map(|(u, v)| u.perp_dot(v))
}

/// Mean squared distortion over all corners; fills its gradient.
fn energy(quads: &[[u32; 4]], aspects: &[f64], softness: f64, points: &[DVec2], gradient: &mut [DVec2]) -> f64 {
    gradient.fill(DVec2::ZERO);
    let weight = 1.0 / (4.0 * quads.len() as f64);
    let mut sum = 0.0;
    for (q, &aspect) in quads.iter().zip(aspects) {
        let p = q.map(|v| points[v as usize]);
        for ([a, b, c, d], (first, second)) in CORNERS.into_iter().zip(corner_edges(p)) {
            let jacobian = first.perp_dot(second);
            let root = jacobian.hypot(2.0 * softness);
            // The second form avoids cancellation where J is negative.
            let height = if jacobian >= 0.0 {
                f64::midpoint(jacobian, root)
            } else {
                2.0 * softness * softness / (root - jacobian)
            };
            let size = first.length_squared() / aspect + second.length_squared() * aspect;
            let distortion = size / (2.0 * height);
            sum += distortion * distortion;

            // d(distortion^2) = 2 distortion (d size / (2 height) - distortion d height / height),
            // and d height = height / root dJ.
            let outer = 2.0 * weight * distortion;
            let by_jacobian = distortion / root;
            let by_first = outer * (first / (aspect * height) + second.perp() * by_jacobian);
            let by_second = outer * (second * (aspect / height) - first.perp() * by_jacobian);
            gradient[q[a] as usize] -= by_first;
            gradient[q[b] as usize] += by_first;
            gradient[q[c] as usize] -= by_second;
            gradient[q[d] as usize] += by_second;
        }
    }
    sum * weight
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_matches_finite_differences() {
        let quads = [[0, 1, 4, 3], [1, 2, 5, 4]];
        // The second quad is inverted at vertex 4.
        let points = [(0.0, 0.0), (1.0, -0.2), (2.1, 0.1), (0.1, 0.9), (1.9, 0.6), (1.9, 1.2)].map(DVec2::from);
        let aspects = [1.3, 0.7];
        let mut gradient = [DVec2::ZERO; 6];
        let mut unused = [DVec2::ZERO; 6];
        energy(&quads, &aspects, 0.2, &points, &mut gradient);
        for v in 0..6 {
            for axis in [DVec2::X, DVec2::Y] {
                let mut value = |step: f64| {
                    let mut moved = points;
                    moved[v] += axis * step;
                    energy(&quads, &aspects, 0.2, &moved, &mut unused)
                };
                let slope = (value(1e-6) - value(-1e-6)) / 2e-6;
                assert!((slope - gradient[v].dot(axis)).abs() < 1e-5 * slope.abs().max(1.0), "{v} {axis}");
            }
        }
    }

    #[test]
    fn a_tangled_grid_becomes_regular() {
        let n = 6u32;
        let at = |x: u32, y: u32| y * n + x;
        let quads: Vec<_> = (0..n - 1)
            .flat_map(|y| (0..n - 1).map(move |x| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]))
            .collect();
        let grid: Vec<DVec2> = (0..n * n).map(|v| DVec2::new(f64::from(v % n), f64::from(v / n))).collect();
        let on_border = |p: DVec2| p.min_element() == 0.0 || p.max_element() == f64::from(n - 1);
        let fixed: Vec<bool> = grid.iter().map(|&p| on_border(p)).collect();
        let mut moved = grid.clone();
        for (v, p) in moved.iter_mut().enumerate().filter(|(v, _)| !fixed[*v]) {
            *p += DVec2::new((v as f64 * 2.3).sin(), (v as f64 * 3.7).cos()) * 0.9;
        }
        let worst = |p: &[DVec2]| quads.iter().flat_map(|q| jacobians(q.map(|v| p[v as usize]))).fold(1.0, f64::min);
        assert!(worst(&moved) < 0.0);
        optimise_flat(&quads, &mut moved, &fixed, &Monitor::new()).unwrap();
        assert!(worst(&moved) > 0.4, "{}", worst(&moved));
    }
}
