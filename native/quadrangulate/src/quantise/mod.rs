//! How many quads go along each side of each patch.
//!
//! `QuadMixer` (Nuvoli, Hernandez, Esperança, Scateni, Cignoni, Pietroni, 2019), section 3.3, equations 1 to 4: an integer
//! count e >= 1 for every sub-side, fixed where a kept quad mesh borders, with an even sum around every patch, minimising
//! a blend of isometry, sum (e - ideal)², and regularity, (S0 - S2)² + (S1 - S3)² over the four-sided patches.
//!
//! Deviations, and why:
//! - The paper does not say which of the two terms its alpha multiplies. Here alpha is the share of isometry: at 0.01
//!   four-sided patches become regular grids whatever the sizes, at 0.99 sizes rule.
//! - Three- and five-sided patches get a term too: how far their sides miss the condition under which one irregular
//!   vertex suffices ([`Options::pattern_weight`]; zero gives the paper's energy).
//! - Every perimeter is at least 4: a disk with two border edges has no quadrangulation without a degenerate quad.
//! - Layouts fall apart into components that share no free sub-side; each is solved by itself, which is exact.
//! - An instant answer ([`quantise_instantly`]: rounding, a T-join over the patches that repairs parity where it costs least,
//!   then, if asked for, whole rows of quads in or out while the energy falls) starts the search and stands when a limit strikes, so that a
//!   limit never costs a result.

mod energy;
mod instant;
mod programme;
mod walks;

use std::time::Duration;

use solve::{CancelCheck, SolveError};

pub use energy::Energy;
use energy::Penalties;

/// Greatest count a sub-side can be given.
pub const MOST: u32 = 1 << 20;

/// A piece of a patch's border between two corners or T-junctions.
#[derive(Debug, Clone, PartialEq)]
pub struct SubSide {
    /// Its length in target edge lengths; finite, from 0 to [`MOST`].
    pub ideal: f64,
    /// The count that a bordering quad mesh demands, if one does; from 1 to [`MOST`].
    pub fixed: Option<u32>,
    /// The least count that a free one may be given; from 1 to [`MOST`].
    pub least: u32,
    /// How much its deviation counts beside that of others: 1 for an ordinary one, more for one that stands for several
    /// sub-sides tied together. Finite and positive.
    pub weight: f64,
}

/// A disk with corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Patch {
    /// For every side, in order around the patch, its sub-sides as indices into [`Layout::sub_sides`].
    pub sides: Vec<Vec<u32>>,
}

/// Patches and the sub-sides they share. A sub-side is used at most twice, by one patch or two.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// All sub-sides.
    pub sub_sides: Vec<SubSide>,
    /// All patches.
    pub patches: Vec<Patch>,
}

/// How a deviation d counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Norm {
    /// d²: spreads deviations. The default.
    #[default]
    Squared,
    /// |d|: faster to solve, and may gather the deviation in one place.
    Absolute,
}

/// What to favour, and how long to search.
#[derive(Debug, Clone)]
pub struct Options {
    /// The paper's alpha: share of isometry in the energy, between 0 and 1, both excluded. Default 0.5.
    pub alpha: f64,
    /// Squared or absolute deviations.
    pub norm: Norm,
    /// Weight of the condition on three- and five-sided patches, in units of regularity; 0 or more. Default 1.
    pub pattern_weight: f64,
    /// Whether whole rows of quads are taken in or out of the instant answer while the energy falls: worth it where free layouts are
    /// large. Default: no.
    pub rows: bool,
    /// A component with more free sub-sides than this keeps its instant answer. Default 200.
    pub most_variables: usize,
    /// Counts are optimal when their energy is proved to be within this fraction of the minimum. Default 0.01.
    pub relative_gap: f64,
    /// Branch-and-bound nodes for each component. Default 10: more of them tighten the proof rather than the counts, see
    /// [`quantise`].
    pub max_nodes: u32,
    /// Backstop for each component; when it strikes, the component keeps its instant answer, because what a search has
    /// found by a given second differs between runs. Default 20 s.
    pub time_limit: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            alpha: 0.5,
            norm: Norm::Squared,
            pattern_weight: 1.0,
            rows: false,
            most_variables: 200,
            relative_gap: 0.01,
            max_nodes: 10,
            time_limit: Duration::from_secs(20),
        }
    }
}

/// Counts for all sub-sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantisation {
    /// Count of each sub-side.
    pub counts: Vec<u32>,
    /// True when the energy is proved to be within [`Options::relative_gap`] of the minimum.
    pub optimal: bool,
    /// The energy of the counts.
    pub energy: Energy,
}

/// Why a layout has no counts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuantiseError {
    /// The fixed counts around a component of patches have an odd sum, so that no counts inside can make every patch even
    /// (`QuadMixer` 3.4).
    #[error("the fixed border of {} connected patches has an odd number of edges: refine one polychord that ends on it", .patches.len())]
    OddComponent {
        /// The patches of the component, ascending.
        patches: Vec<u32>,
    },
    /// All sub-sides of a patch are fixed and have fewer than four edges together.
    #[error("patch {patch} has {perimeter} border edges, all of them fixed: a quadrangulation needs 4")]
    TooShort {
        /// The patch.
        patch: u32,
        /// Sum of its counts.
        perimeter: u32,
    },
    /// A sub-side has an ideal or fixed count out of range, or is used more than twice.
    #[error("sub-side {sub_side}: {reason}")]
    BadSubSide {
        /// The sub-side.
        sub_side: u32,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A patch has no sides, an empty side, or names a sub-side that does not exist.
    #[error("patch {patch}: {reason}")]
    BadPatch {
        /// The patch.
        patch: u32,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An option is out of its range.
    #[error("the option {option} must be {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// Its range.
        expected: &'static str,
    },
    /// The caller cancelled, or a solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Counts of least energy.
///
/// Cost, summed over components: grids of 8 x 8 patches with uneven ideal counts and hardly a fixed border, the hard
/// case (134 to 170 free sub-sides in one component), took 0.3 to 5 s of processor time. The instant answer (1 ms) was
/// 1 to 5% above the best energy known with squared deviations, 6 to 11% with absolute ones; ten nodes were enough to
/// find the counts that a thousand nodes found.
///
/// ```
/// use quadrangulate::quantise::{Layout, Options, Patch, SubSide, quantise};
/// // A rectangle of 3.2 x 2.1 edges whose first side must have 5 edges.
/// let side = |ideal, fixed| SubSide { ideal, fixed, least: 1, weight: 1.0 };
/// let layout = Layout {
///     sub_sides: vec![side(3.2, Some(5)), side(2.1, None), side(3.2, None), side(2.1, None)],
///     patches: vec![Patch { sides: vec![vec![0], vec![1], vec![2], vec![3]] }],
/// };
/// let result = quantise(&layout, &Options { alpha: 0.1, ..Options::default() }, &|| false)?;
/// assert_eq!(result.counts, [5, 2, 5, 2]);
/// # Ok::<(), quadrangulate::quantise::QuantiseError>(())
/// ```
///
/// # Errors
/// Every variant of [`QuantiseError`]; cancelled within 50 ms of `cancelled` returning true.
pub fn quantise(layout: &Layout, options: &Options, cancelled: CancelCheck<'_>) -> Result<Quantisation, QuantiseError> {
    let mut start = quantise_instantly(layout, options, cancelled)?;
    let penalties = Penalties::new(layout, options);
    start.optimal = programme::improve(layout, &penalties, options, &mut start.counts, cancelled)?;
    start.energy = penalties.energy(&start.counts);
    Ok(start)
}

/// Feasible counts at once: the least-squares solution rounded, parity repaired by a T-join, then single steps downhill, and
/// whole rows with [`Options::rows`].
///
/// Cost: one sparse factorisation, the T-join's matching over the patches that rounding left odd, and for each row taken in or out
/// a search over the layout; 10 to 50 ms for 100 to 200 patches.
///
/// # Errors
/// Every variant of [`QuantiseError`].
pub fn quantise_instantly(
    layout: &Layout,
    options: &Options,
    cancelled: CancelCheck<'_>,
) -> Result<Quantisation, QuantiseError> {
    check(layout, options)?;
    let penalties = Penalties::new(layout, options);
    let mut counts = instant::counts(layout, &penalties, cancelled)?;
    if options.rows {
        walks::descend(layout, &penalties, options, &mut counts, cancelled)?;
    }
    let optimal = layout.sub_sides.iter().all(|sub_side| sub_side.fixed.is_some());
    Ok(Quantisation { energy: penalties.energy(&counts), counts, optimal })
}

/// Refuses bad layouts and options.
fn check(layout: &Layout, options: &Options) -> Result<(), QuantiseError> {
    if !(options.alpha > 0.0 && options.alpha < 1.0) {
        return Err(QuantiseError::BadOption { option: "alpha", expected: "between 0 and 1, both excluded" });
    }
    if !(options.pattern_weight.is_finite() && options.pattern_weight >= 0.0) {
        return Err(QuantiseError::BadOption { option: "pattern_weight", expected: "finite and not negative" });
    }
    for (sub_side, given) in (0..).zip(&layout.sub_sides) {
        if !(0.0..=f64::from(MOST)).contains(&given.ideal) {
            return Err(QuantiseError::BadSubSide {
                sub_side,
                reason: "its ideal count must be finite and from 0 to 2^20",
            });
        }
        if !(given.weight > 0.0 && given.weight.is_finite()) {
            return Err(QuantiseError::BadSubSide { sub_side, reason: "its weight must be finite and positive" });
        }
        if !(1..=MOST).contains(&given.least) {
            return Err(QuantiseError::BadSubSide { sub_side, reason: "its least count must be from 1 to 2^20" });
        }
        if given.fixed.is_some_and(|count| count == 0 || count > MOST) {
            return Err(QuantiseError::BadSubSide { sub_side, reason: "its fixed count must be from 1 to 2^20" });
        }
    }
    let mut uses = vec![0; layout.sub_sides.len()];
    for (patch, given) in (0..).zip(&layout.patches) {
        if given.sides.is_empty() || given.sides.iter().any(Vec::is_empty) {
            return Err(QuantiseError::BadPatch { patch, reason: "it needs sides, and every side needs a sub-side" });
        }
        for &sub_side in given.sides.iter().flatten() {
            let Some(count) = uses.get_mut(sub_side as usize) else {
                return Err(QuantiseError::BadPatch { patch, reason: "it names a sub-side that does not exist" });
            };
            *count += 1;
            if *count > 2 {
                return Err(QuantiseError::BadSubSide { sub_side, reason: "it is used more than twice" });
            }
        }
    }
    Ok(())
}

/// For each sub-side the patches that use it, a patch twice when it uses it twice.
fn users(layout: &Layout) -> Vec<Vec<u32>> {
    let mut users = vec![Vec::new(); layout.sub_sides.len()];
    for (patch, given) in (0..).zip(&layout.patches) {
        for &sub_side in given.sides.iter().flatten() {
            users[sub_side as usize].push(patch);
        }
    }
    users
}

#[cfg(test)]
mod tests;
