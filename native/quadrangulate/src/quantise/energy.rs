//! The energy of `QuadMixer` 3.3, equations 1 and 4, as a list of penalties on integer expressions.

use super::{Layout, Norm, Options};

/// The energy of counts, by parts. Each part carries its weight already.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// alpha times the weighted deviations of the free sub-sides from their ideal (equation 1; fixed ones cannot deviate less).
    pub isometry: f64,
    /// 1 - alpha times the deviations between opposite sides of four-sided patches (equation 4).
    pub regularity: f64,
    /// `pattern_weight` (1 - alpha) times the misses of three- and five-sided patches.
    pub pattern: f64,
}

impl Energy {
    /// The sum that is minimised.
    pub fn total(&self) -> f64 {
        self.isometry + self.regularity + self.pattern
    }
}

/// Which part of the energy a penalty belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Isometry,
    Regularity,
    /// Only an excess over the target counts.
    Pattern,
}

/// A convex cost of a sum of counts.
#[derive(Debug, Clone)]
pub(super) struct Penalty {
    pub part: Part,
    pub weight: f64,
    /// Sub-sides and their factors. A sub-side may occur twice.
    pub terms: Vec<(u32, i32)>,
    pub target: f64,
    pub norm: Norm,
}

impl Penalty {
    /// The cost when the sum has a given value.
    pub fn cost(&self, value: i64) -> f64 {
        let deviation = value as f64 - self.target;
        let counted = if self.part == Part::Pattern { deviation.max(0.0) } else { deviation };
        self.weight * if self.norm == Norm::Squared { counted * counted } else { counted.abs() }
    }

    /// The sum for given counts.
    pub fn value(&self, counts: &[u32]) -> i64 {
        self.terms.iter().map(|&(sub_side, factor)| i64::from(factor) * i64::from(counts[sub_side as usize])).sum()
    }
}

/// All penalties of a layout.
#[derive(Debug)]
pub(super) struct Penalties {
    pub all: Vec<Penalty>,
    /// For each sub-side the indices of the penalties it occurs in.
    pub of_sub_side: Vec<Vec<usize>>,
}

impl Penalties {
    pub fn new(layout: &Layout, options: &Options) -> Self {
        let penalty = |part, weight, terms, target| Penalty { part, weight, terms, target, norm: options.norm };
        let free = (0..).zip(&layout.sub_sides).filter(|(_, sub_side)| sub_side.fixed.is_none());
        let mut all: Vec<Penalty> = free
            .map(|(index, sub_side)| {
                penalty(Part::Isometry, options.alpha * sub_side.weight, vec![(index, 1)], sub_side.ideal)
            })
            .collect();
        let regularity = 1.0 - options.alpha;
        for patch in &layout.patches {
            let sides = patch.sides.len();
            // The factor of each side, counted from side `first` on.
            let combine = |first: usize, factors: &[i32]| -> Vec<(u32, i32)> {
                let signed = factors.iter().enumerate().map(|(k, &factor)| (&patch.sides[(first + k) % sides], factor));
                signed.flat_map(|(side, factor)| side.iter().map(move |&sub_side| (sub_side, factor))).collect()
            };
            match sides {
                // A three-sided patch needs one irregular vertex exactly when the triangle inequality is strict:
                // l0 <= l1 + l2 - 2, since the perimeter is even.
                3 => all.extend((0..3).map(|i| {
                    penalty(Part::Pattern, options.pattern_weight * regularity, combine(i, &[1, -1, -1]), -2.0)
                })),
                4 => all.extend((0..2).map(|i| penalty(Part::Regularity, regularity, combine(i, &[1, 0, -1, 0]), 0.0))),
                // A five-sided one when l0 + l1 - l2 - l3 + l4 >= 2 for all rotations.
                5 => all.extend((0..5).map(|i| {
                    penalty(Part::Pattern, options.pattern_weight * regularity, combine(i, &[-1, -1, 1, 1, -1]), -2.0)
                })),
                _ => {}
            }
        }
        for penalty in &mut all {
            penalty.terms.retain(|term| term.1 != 0);
        }
        all.retain(|penalty| penalty.weight > 0.0);
        let mut of_sub_side = vec![Vec::new(); layout.sub_sides.len()];
        for (index, penalty) in all.iter().enumerate() {
            for &(sub_side, _) in &penalty.terms {
                let list: &mut Vec<usize> = &mut of_sub_side[sub_side as usize];
                if list.last() != Some(&index) {
                    list.push(index);
                }
            }
        }
        Self { all, of_sub_side }
    }

    /// The energy of counts.
    pub fn energy(&self, counts: &[u32]) -> Energy {
        let mut energy = Energy::default();
        for penalty in &self.all {
            let part = match penalty.part {
                Part::Isometry => &mut energy.isometry,
                Part::Regularity => &mut energy.regularity,
                Part::Pattern => &mut energy.pattern,
            };
            *part += penalty.cost(penalty.value(counts));
        }
        energy
    }

    /// By how much the energy rises when the count of one sub-side changes by `step`.
    pub fn rise(&self, counts: &[u32], sub_side: u32, step: i64) -> f64 {
        let changes = self.of_sub_side[sub_side as usize].iter().map(|&index| {
            let penalty = &self.all[index];
            let factor: i64 =
                penalty.terms.iter().filter(|term| term.0 == sub_side).map(|term| i64::from(term.1)).sum();
            let value = penalty.value(counts);
            penalty.cost(value + factor * step) - penalty.cost(value)
        });
        changes.sum()
    }
}
