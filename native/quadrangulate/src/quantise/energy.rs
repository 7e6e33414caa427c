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

impl Part {
    /// How a deviation counts, before weights.
    pub fn measure(self, deviation: f64, norm: Norm) -> f64 {
        let counted = if self == Self::Pattern { deviation.max(0.0) } else { deviation };
        if norm == Norm::Squared { counted * counted } else { counted.abs() }
    }
}

/// What the sides of a patch should fulfil: a weighted sum of their counts, and how it is counted.
pub(super) struct Condition {
    pub part: Part,
    /// A factor for each side.
    pub factors: &'static [i32],
    pub target: f64,
}

/// One irregular vertex is enough for a three-sided patch exactly when the triangle inequality is strict: l0 <= l1 + l2 - 2, since the
/// perimeter is even.
const TRIANGLE: [[i32; 3]; 3] = [[1, -1, -1], [-1, 1, -1], [-1, -1, 1]];
/// None is needed for a four-sided one when opposite sides are equal.
const QUAD: [[i32; 4]; 2] = [[1, 0, -1, 0], [0, 1, 0, -1]];
/// One is enough for a five-sided one when l0 + l1 - l2 - l3 + l4 >= 2 for all rotations.
const PENTAGON: [[i32; 5]; 5] =
    [[-1, -1, 1, 1, -1], [-1, -1, -1, 1, 1], [1, -1, -1, -1, 1], [1, 1, -1, -1, -1], [-1, 1, 1, -1, -1]];

/// The conditions on a patch of so many sides, and their weights.
pub(super) fn conditions(sides: usize, options: &Options) -> impl Iterator<Item = (Condition, f64)> {
    let regularity = 1.0 - options.alpha;
    let (part, target, weight) =
        if sides == 4 { (Part::Regularity, 0.0, 1.0) } else { (Part::Pattern, -2.0, options.pattern_weight) };
    let all: Vec<&'static [i32]> = match sides {
        3 => TRIANGLE.iter().map(|f| &f[..]).collect(),
        4 => QUAD.iter().map(|f| &f[..]).collect(),
        5 => PENTAGON.iter().map(|f| &f[..]).collect(),
        _ => vec![],
    };
    all.into_iter().map(move |factors| (Condition { part, factors, target }, weight * regularity))
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
        self.weight * self.part.measure(value as f64 - self.target, self.norm)
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
        for patch in &layout.patches {
            for (condition, weight) in conditions(patch.sides.len(), options) {
                let signed = patch.sides.iter().zip(condition.factors).filter(|(_, factor)| **factor != 0);
                let terms = signed.flat_map(|(side, &factor)| side.iter().map(move |&sub_side| (sub_side, factor)));
                all.push(penalty(condition.part, weight, terms.collect(), condition.target));
            }
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
