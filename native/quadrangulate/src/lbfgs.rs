//! Limited-memory BFGS over points of the plane, with a backtracking line search.
//!
//! Source: Nocedal and Wright, *Numerical Optimization*, 2nd edition, algorithms 7.4 and 7.5. Deviation: sufficient
//! decrease only; a pair of negative curvature is left out of the memory instead.

use glam::DVec2;
use mesh::{Cancelled, Monitor};
use std::collections::VecDeque;

/// Pairs of steps and gradient changes remembered.
const MEMORY: usize = 10;

/// A step, the change of the gradient over it, and the reciprocal of their product.
type Pair = (Vec<DVec2>, Vec<DVec2>, f64);

/// Lowers `energy(points, gradient)`, which fills the gradient and returns the value, by at most `steps` steps; the first
/// moves no point further than `first_reach`. Stops early once a step gains less than a thousandth.
///
/// # Errors
/// [`Cancelled`] when the monitor says so; the points are then at the last step.
pub(crate) fn minimise(
    points: &mut [DVec2],
    steps: usize,
    first_reach: f64,
    monitor: &Monitor,
    mut energy: impl FnMut(&[DVec2], &mut [DVec2]) -> f64,
) -> Result<(), Cancelled> {
    let mut gradient = vec![DVec2::ZERO; points.len()];
    let mut value = energy(points, &mut gradient);
    let mut memory: VecDeque<Pair> = VecDeque::new();
    let mut trial = points.to_vec();
    let mut trial_gradient = gradient.clone();
    for _ in 0..steps {
        monitor.check()?;
        let steepest = gradient.iter().map(|g| g.length()).fold(0.0, f64::max);
        if steepest == 0.0 {
            return Ok(());
        }
        let mut direction = two_loop(&gradient, &memory);
        let mut slope = dot(&direction, &gradient);
        let mut step = 1.0;
        if memory.is_empty() || slope >= 0.0 {
            memory.clear();
            direction = gradient.iter().map(|g| -*g).collect();
            slope = -dot(&gradient, &gradient);
            step = first_reach / steepest;
        }
        let before = value;
        // Thirty halvings reach rounding: then nothing further can be gained.
        let mut accepted = false;
        for _ in 0..30 {
            for ((t, p), d) in trial.iter_mut().zip(points.iter()).zip(&direction) {
                *t = *p + *d * step;
            }
            value = energy(&trial, &mut trial_gradient);
            accepted = value <= before + 1e-4 * step * slope;
            if accepted {
                break;
            }
            step *= 0.5;
        }
        if !accepted {
            return Ok(());
        }
        let change: Vec<DVec2> = trial_gradient.iter().zip(&gradient).map(|(a, b)| *a - *b).collect();
        let moved: Vec<DVec2> = trial.iter().zip(points.iter()).map(|(a, b)| *a - *b).collect();
        let curvature = dot(&moved, &change);
        if curvature > 0.0 {
            if memory.len() == MEMORY {
                memory.pop_front();
            }
            memory.push_back((moved, change, 1.0 / curvature));
        }
        points.copy_from_slice(&trial);
        std::mem::swap(&mut gradient, &mut trial_gradient);
        if before - value < 1e-3 * before.abs() {
            return Ok(());
        }
    }
    Ok(())
}

/// Minus the approximate inverse Hessian times the gradient.
fn two_loop(gradient: &[DVec2], memory: &VecDeque<Pair>) -> Vec<DVec2> {
    let mut q: Vec<DVec2> = gradient.iter().map(|g| -*g).collect();
    let add = |q: &mut [DVec2], v: &[DVec2], factor: f64| q.iter_mut().zip(v).for_each(|(q, v)| *q += *v * factor);
    let mut factors = Vec::with_capacity(memory.len());
    for (moved, change, inverse) in memory.iter().rev() {
        let factor = inverse * dot(moved, &q);
        add(&mut q, change, -factor);
        factors.push(factor);
    }
    if let Some((_, change, inverse)) = memory.back() {
        let scale = 1.0 / (inverse * dot(change, change));
        for q in &mut q {
            *q *= scale;
        }
    }
    for ((moved, change, inverse), factor) in memory.iter().zip(factors.into_iter().rev()) {
        let back = inverse * dot(change, &q);
        add(&mut q, moved, factor - back);
    }
    q
}

fn dot(a: &[DVec2], b: &[DVec2]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
