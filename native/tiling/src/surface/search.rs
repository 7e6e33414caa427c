//! The search for the best recursive partition (section 4.2.1, Algorithm 1), which the paper leaves to greedy steps.

use super::partition::{Division, Ground, PART};
use super::region::Region;
use mesh::{Cancelled, Monitor};
use std::collections::VecDeque;

/// Regions looked at for each 30 degrees of defect, and at most in all; and how they are shared: about so many partitions of a region
/// are followed, each with this many times the least it needs at least. Work is counted, not timed: the same input gives the
/// same patches on any machine.
pub(super) const BUDGET: f64 = 32.0;
pub(super) const MOST_BUDGET: f64 = 200.0;
const FOLLOWED: f64 = 4.0;
const BRANCHING: f64 = 1.5;
const MOST_FOLLOWED: usize = 24;

/// Binary partitions drawn for each way to share the defect of a region.
pub(super) const DRAWN: usize = 10;

/// The search for the best recursive partition: the best few of each region are followed, and the sum of the scores along
/// the whole tree decides. Regions do not depend on each other, so each is solved for itself, with a share of the budget.
pub(super) struct Search<'a> {
    pub ground: &'a Ground<'a>,
    /// Number of the next curve.
    pub next: usize,
    /// Regions whose partitions were listed so far.
    pub looked_at: usize,
    pub monitor: &'a Monitor,
}

/// Regions that have to be looked at to divide one with this defect, at least.
fn least_budget(region: &Region) -> f64 {
    f64::from((2 * region.defect().abs() - 1).max(0))
}

impl Search<'_> {
    /// Flat patches that make up a region, and their score, if one below `bound` is found within the budget of regions.
    pub fn solve(&mut self, region: &Region, budget: f64, bound: f64) -> Result<Option<(f64, Vec<Region>)>, Cancelled> {
        let mut best: Option<(f64, Vec<Region>)> = None;
        if region.defect() == 0 {
            let score = PART + self.ground.judge(region);
            best = (score < bound).then(|| (score, vec![region.clone()]));
            if self.ground.uneven(region) == 0.0 {
                return Ok(best);
            }
        }
        if budget < 1.0 {
            return Ok(best);
        }
        let mut divisions = self.ground.divisions(region, &mut self.next, self.monitor)?;
        // Divisions that divide the defect, three for one that only cuts a flat part off: such leave the same task behind.
        let is_shaving = |d: &Division| d.parts.iter().any(|part| part.defect().abs() == region.defect().abs());
        let (mut shavings, mut halves): (VecDeque<_>, VecDeque<_>) = divisions.drain(..).partition(is_shaving);
        while !shavings.is_empty() || !halves.is_empty() {
            divisions.extend(halves.drain(..halves.len().min(3)));
            divisions.extend(shavings.pop_front());
        }
        // One into flat parts first: its score is a bound for all others, and it needs no budget.
        let is_last = |d: &Division| d.parts.iter().all(|part| part.defect() == 0);
        if let Some(last) = divisions.iter().position(is_last) {
            divisions[..=last].rotate_right(1);
        }
        let start = self.looked_at;
        self.looked_at += 1;
        for division in divisions.into_iter().take(MOST_FOLLOWED) {
            let left = budget - (self.looked_at - start) as f64;
            let least: f64 = division.parts.iter().map(least_budget).sum();
            if least > left {
                continue;
            }
            let own = division.own;
            let limit = best.as_ref().map_or(bound, |b| b.0.min(bound)) - own;
            let share = (BRANCHING * least).max(budget / FOLLOWED).min(left);
            let (mut sum, mut patches) = (0.0, Vec::new());
            // Flat parts first: they need no search to fail.
            let (flat, rest): (Vec<_>, Vec<_>) = division.parts.iter().partition(|part| part.defect() == 0);
            for part in flat.into_iter().chain(rest) {
                let of_part = if least > 0.0 { share * least_budget(part) / least } else { 0.0 };
                let Some((score, found)) = self.solve(part, of_part, limit - sum)? else {
                    sum = f64::INFINITY;
                    break;
                };
                sum += score;
                patches.extend(found);
            }
            if sum < limit {
                best = Some((own + sum, patches));
            }
        }
        Ok(best)
    }
}
