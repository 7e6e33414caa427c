//! The integer programme of `QuadMixer` 3.3, one component of the layout at a time.

use solve::components::connected_components;
use solve::integer::{self, Programme, Stop, Term, Variable};
use solve::{CancelCheck, SolveError};

use super::energy::Penalties;
use super::instant::relax;
use super::{Layout, MOST, Norm, Options, SubSide, users};

/// Values on either side of the relaxed optimum that get unit steps at first.
const WINDOW: i64 = 2;

/// Added to the reach of the counts so that rounding errors cut off nothing.
const LEAST_REACH: f64 = 1e-6;

/// Replaces feasible counts by those of least energy; true when that was proved for every component.
pub(super) fn improve(
    layout: &Layout,
    penalties: &Penalties,
    options: &Options,
    counts: &mut [u32],
    cancelled: CancelCheck<'_>,
) -> Result<bool, SolveError> {
    let relaxed = relax(layout, penalties)?;
    let mut optimal = true;
    for component in components(layout) {
        if component.free.len() > options.most_variables {
            optimal = false;
        } else if !component.patches.is_empty() && !component.free.is_empty() {
            optimal &= solve_component(layout, penalties, options, &component, &relaxed, counts, cancelled)?;
        }
    }
    Ok(optimal)
}

/// Patches that share free sub-sides, directly or not, and these sub-sides, ascending.
struct Component {
    patches: Vec<u32>,
    free: Vec<u32>,
}

/// The components of a layout. Sub-sides are vertices 0.., patches follow.
fn components(layout: &Layout) -> Vec<Component> {
    let first_patch = layout.sub_sides.len() as u32;
    let is_free = |sub_side: u32| layout.sub_sides[sub_side as usize].fixed.is_none();
    let users = users(layout);
    let edges = (0..first_patch)
        .filter(|&sub_side| is_free(sub_side))
        .flat_map(|sub_side| users[sub_side as usize].iter().map(move |patch| (sub_side, first_patch + patch)));
    let groups = connected_components(layout.sub_sides.len() + layout.patches.len(), edges);
    groups
        .into_iter()
        .map(|group| {
            let (sub_sides, patches): (Vec<u32>, Vec<u32>) =
                group.into_iter().partition(|&vertex| vertex < first_patch);
            let free = sub_sides.into_iter().filter(|&sub_side| is_free(sub_side)).collect();
            Component { patches: patches.into_iter().map(|vertex| vertex - first_patch).collect(), free }
        })
        .collect()
}

/// Improves the counts of one component; true when they are optimal.
fn solve_component(
    layout: &Layout,
    penalties: &Penalties,
    options: &Options,
    component: &Component,
    relaxed: &[f64],
    counts: &mut [u32],
    cancelled: CancelCheck<'_>,
) -> Result<bool, SolveError> {
    let mut concerned: Vec<usize> =
        component.free.iter().flat_map(|&sub_side| penalties.of_sub_side[sub_side as usize].iter().copied()).collect();
    concerned.sort_unstable();
    concerned.dedup();
    let known: f64 = concerned.iter().map(|&index| penalties.all[index].cost(penalties.all[index].value(counts))).sum();
    // No count of a better solution costs more in isometry alone than the known solution costs altogether.
    let reach = |weight: f64| {
        let share = known / (options.alpha * weight) + LEAST_REACH;
        if options.norm == Norm::Squared { share.sqrt() } else { share }
    };

    let mut programme = Programme::new();
    let mut variables: Vec<Option<Variable>> = vec![None; counts.len()];
    for &sub_side in &component.free {
        let SubSide { ideal, weight, least, .. } = layout.sub_sides[sub_side as usize];
        let reach = reach(weight);
        // The count at hand is kept possible where rounding errors and the limits of counts meet.
        let count = counts[sub_side as usize];
        let low = ((ideal - reach).ceil().max(f64::from(least)) as i32).min(count as i32);
        let high = ((ideal + reach).floor().min(f64::from(MOST)) as i32).max(count as i32);
        variables[sub_side as usize] = Some(programme.variable(low..=high));
    }
    let one = programme.variable(1..=1);
    // A sum of counts as terms over the free ones and the sum of the fixed ones.
    let split = |terms: &mut dyn Iterator<Item = (u32, i32)>| {
        let (mut free, mut constant) = (Vec::<Term>::new(), 0_i64);
        for (sub_side, factor) in terms {
            match variables[sub_side as usize] {
                Some(variable) => free.push((variable, factor)),
                None => {
                    constant += i64::from(factor) * i64::from(layout.sub_sides[sub_side as usize].fixed.unwrap_or(0));
                }
            }
        }
        (free, constant)
    };

    for penalty in concerned.into_iter().map(|index| &penalties.all[index]) {
        let (free, constant) = split(&mut penalty.terms.iter().copied());
        let expected: f64 =
            penalty.terms.iter().map(|&(sub_side, factor)| f64::from(factor) * relaxed[sub_side as usize]).sum();
        let centre = expected.round() as i64 - constant;
        programme.convex_cost(&free, move |value| penalty.cost(value + constant), centre - WINDOW..=centre + WINDOW);
    }
    for &patch in &component.patches {
        let sides = &layout.patches[patch as usize].sides;
        let (mut free, constant) = split(&mut sides.iter().flatten().map(|&sub_side| (sub_side, 1)));
        programme.row(&free, 4 - constant..);
        free.push((one, (constant % 2) as i32));
        programme.even(&free);
    }

    let mut start: Vec<i64> = component.free.iter().map(|&sub_side| i64::from(counts[sub_side as usize])).collect();
    start.push(1);
    let limits = integer::Options {
        max_nodes: options.max_nodes,
        time_limit: options.time_limit,
        relative_gap: options.relative_gap,
    };
    let solution = programme.solve(&limits, Some(&start), cancelled)?;
    if solution.stop != Stop::Time {
        for (&sub_side, &value) in component.free.iter().zip(&solution.values) {
            counts[sub_side as usize] = value as u32;
        }
    }
    Ok(solution.stop == Stop::Optimal)
}
