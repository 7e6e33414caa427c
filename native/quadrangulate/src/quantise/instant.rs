//! The instant answer: round the least-squares counts, repair parity by a T-join, walk downhill in single steps.
//!
//! A patch with an odd sum is a terminal; a free sub-side between two patches is an edge that turns both; one at the
//! layout's free border is an edge to a vertex outside, whose own parity does not matter.

use solve::cholesky::Factor;
use solve::components::connected_components;
use solve::tjoin::t_join;
use solve::{CancelCheck, SolveError};

use super::energy::{Part, Penalties};
use super::{Layout, MOST, QuantiseError, users};

/// Sweeps over all sub-sides at most; a sweep that improves nothing ends the walk long before.
const SWEEPS: usize = 100;

/// An improvement must exceed this, so that rounding errors cannot make the walk circle.
const LEAST_GAIN: f64 = 1e-9;

/// Feasible counts for a layout that [`super::check`] has passed.
pub(super) fn counts(
    layout: &Layout,
    penalties: &Penalties,
    cancelled: CancelCheck<'_>,
) -> Result<Vec<u32>, QuantiseError> {
    let users = users(layout);
    let mut counts: Vec<u32> =
        relax(layout, penalties)?.iter().map(|value| value.round().clamp(1.0, f64::from(MOST)) as u32).collect();
    for (count, sub_side) in counts.iter_mut().zip(&layout.sub_sides).filter(|(_, sub_side)| sub_side.fixed.is_none()) {
        *count = sub_side.least.max(*count);
    }
    repair_parity(layout, penalties, &users, &mut counts, cancelled)?;
    lengthen_short_patches(layout, penalties, &mut counts)?;
    descend(layout, penalties, &users, &mut counts, cancelled)?;
    Ok(counts)
}

/// Real-valued counts that minimise isometry and regularity in the least-squares sense; fixed ones at their value.
pub(super) fn relax(layout: &Layout, penalties: &Penalties) -> Result<Vec<f64>, SolveError> {
    let mut values: Vec<f64> = layout.sub_sides.iter().map(|sub_side| sub_side.fixed.map_or(0.0, f64::from)).collect();
    let free: Vec<usize> = (0..values.len()).filter(|&index| layout.sub_sides[index].fixed.is_none()).collect();
    let mut unknown = vec![None; values.len()];
    for (position, &index) in free.iter().enumerate() {
        unknown[index] = Some(position);
    }
    let mut triplets = Vec::new();
    let mut right = vec![0.0; free.len()];
    for penalty in penalties.all.iter().filter(|penalty| penalty.part != Part::Pattern) {
        // The free sub-sides in this penalty, and what is left for them of the target.
        let mut known = 0.0;
        let mut row: Vec<(usize, f64)> = Vec::new();
        for &(sub_side, factor) in &penalty.terms {
            match unknown[sub_side as usize] {
                Some(position) => row.push((position, f64::from(factor))),
                None => known += f64::from(factor) * values[sub_side as usize],
            }
        }
        for &(i, a) in &row {
            right[i] += penalty.weight * a * (penalty.target - known);
            triplets.extend(row.iter().filter(|&&(j, _)| j <= i).map(|&(j, b)| (i, j, penalty.weight * a * b)));
        }
    }
    Factor::new(free.len(), &triplets)?.solve(&mut right)?;
    for (&index, value) in free.iter().zip(right) {
        values[index] = value;
    }
    Ok(values)
}

/// Makes the sum around every patch even by steps of one, where they cost least.
fn repair_parity(
    layout: &Layout,
    penalties: &Penalties,
    users: &[Vec<u32>],
    counts: &mut [u32],
    cancelled: CancelCheck<'_>,
) -> Result<(), QuantiseError> {
    let outside = layout.patches.len() as u32;
    let mut edges = Vec::new();
    let mut sub_side_of_edge = Vec::new();
    for (sub_side, uses) in (0..).zip(users) {
        let ends = match uses[..] {
            [a, b] if a != b => (a, b),
            [a] => (a, outside),
            _ => continue,
        };
        if layout.sub_sides[sub_side as usize].fixed.is_none() {
            // A step may even lower the energy; a T-join wants weights that are not negative.
            edges.push((ends.0, ends.1, cheapest_step(layout, penalties, counts, sub_side).1.max(0.0)));
            sub_side_of_edge.push(sub_side);
        }
    }
    let mut terminals: Vec<u32> = (0..outside).filter(|&patch| perimeter(layout, counts, patch) % 2 == 1).collect();
    for component in connected_components(outside as usize + 1, edges.iter().map(|&(a, b, _)| (a, b))) {
        if component.iter().filter(|vertex| terminals.binary_search(vertex).is_ok()).count() % 2 == 1 {
            if component.last() != Some(&outside) {
                return Err(QuantiseError::OddComponent { patches: component });
            }
            terminals.push(outside);
        }
    }
    for edge in t_join(outside as usize + 1, &edges, &terminals, cancelled)? {
        let sub_side = sub_side_of_edge[edge];
        let (step, _) = cheapest_step(layout, penalties, counts, sub_side);
        change(counts, sub_side, step);
    }
    Ok(())
}

/// The step of one, up or down, that raises the energy least, and by how much.
fn cheapest_step(layout: &Layout, penalties: &Penalties, counts: &[u32], sub_side: u32) -> (i64, f64) {
    let up = penalties.rise(counts, sub_side, 1);
    let shrinks = counts[sub_side as usize] > layout.sub_sides[sub_side as usize].least;
    let down = if shrinks { penalties.rise(counts, sub_side, -1) } else { f64::INFINITY };
    if down < up { (-1, down) } else { (1, up) }
}

/// Adds two to the cheapest free sub-side of every patch with two border edges.
fn lengthen_short_patches(layout: &Layout, penalties: &Penalties, counts: &mut [u32]) -> Result<(), QuantiseError> {
    for (patch, given) in (0..).zip(&layout.patches) {
        let perimeter = perimeter(layout, counts, patch);
        if perimeter >= 4 {
            continue;
        }
        let free = given
            .sides
            .iter()
            .flatten()
            .copied()
            .filter(|&sub_side| layout.sub_sides[sub_side as usize].fixed.is_none());
        let cheapest = free.min_by(|&a, &b| penalties.rise(counts, a, 2).total_cmp(&penalties.rise(counts, b, 2)));
        change(counts, cheapest.ok_or(QuantiseError::TooShort { patch, perimeter: perimeter as u32 })?, 2);
    }
    Ok(())
}

/// Steps that keep every parity, as long as the energy falls: one where no patch or one patch twice is concerned, else two.
fn descend(
    layout: &Layout,
    penalties: &Penalties,
    users: &[Vec<u32>],
    counts: &mut [u32],
    cancelled: CancelCheck<'_>,
) -> Result<(), SolveError> {
    for _ in 0..SWEEPS {
        if cancelled() {
            return Err(SolveError::Cancelled);
        }
        let mut improved = false;
        for (sub_side, uses) in (0..).zip(users) {
            if layout.sub_sides[sub_side as usize].fixed.is_some() {
                continue;
            }
            let size = match uses[..] {
                [] => 1,
                [a, b] if a == b => 1,
                _ => 2,
            };
            for step in [size, -size] {
                let allowed = |counts: &[u32]| {
                    let next = i64::from(counts[sub_side as usize]) + step;
                    // Both uses by one patch change its perimeter.
                    let change = |patch| uses.iter().filter(|&&user| user == patch).count() as i64 * step;
                    (i64::from(layout.sub_sides[sub_side as usize].least)..=i64::from(MOST)).contains(&next)
                        && uses.iter().all(|&patch| perimeter(layout, counts, patch) as i64 + change(patch) >= 4)
                };
                while allowed(counts) && penalties.rise(counts, sub_side, step) < -LEAST_GAIN {
                    change(counts, sub_side, step);
                    improved = true;
                }
            }
        }
        if !improved {
            break;
        }
    }
    Ok(())
}

fn change(counts: &mut [u32], sub_side: u32, step: i64) {
    counts[sub_side as usize] = (i64::from(counts[sub_side as usize]) + step) as u32;
}

/// Sum of the counts around a patch.
fn perimeter(layout: &Layout, counts: &[u32], patch: u32) -> u64 {
    layout.patches[patch as usize].sides.iter().flatten().map(|&sub_side| u64::from(counts[sub_side as usize])).sum()
}
