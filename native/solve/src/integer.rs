//! Integer programmes with convex separable costs, linear rows and parity rows.
//!
//! `HiGHS`, the solver behind this, has no mixed-integer quadratic programming. A convex cost f of an integer expression
//! is therefore written in unit steps: the expression is `low` and a sum of steps between 0 and 1, step k (from 0) at
//! cost f(low + k + 1) - f(low + k). These slopes never fall, so a minimum fills the steps in order and the steps need not be integer: the rewriting is exact.
//! Steps of equal slope share a column, which makes an absolute value two columns. Only a window of values gets steps;
//! beyond its ends the cost goes on with the slope of the next step, which is a lower bound. An optimum inside all
//! windows is then the optimum; one outside widens the windows it leaves and the programme is solved again.
//!
//! Determinism: `HiGHS` runs on one thread with a fixed seed, and the limit to use is the node limit. The time limit is
//! a backstop: what has been found when it strikes depends on the machine, and [`Stop::Time`] says so.

use std::ops::{Bound, RangeBounds, RangeInclusive};
use std::time::Duration;

use highs::{Col, HighsModelStatus, HighsSolutionStatus, RowProblem, Sense};

use crate::{CancelCheck, SolveError, worker};

/// An integer variable of one [`Programme`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Variable(usize);

impl Variable {
    /// Position in [`Solution::values`]: variables are counted in the order they were added.
    pub fn index(self) -> usize {
        self.0
    }
}

/// Limits of one [`Programme::solve`].
#[derive(Debug, Clone)]
pub struct Options {
    /// Branch-and-bound nodes for each solve. Default 10,000. The same limit gives the same result on any machine.
    pub max_nodes: u32,
    /// Wall-clock backstop for each solve; also the longest that a cancelled solve lives on unseen. Default 30 s.
    pub time_limit: Duration,
    /// A solution counts as optimal when its cost is proved to be within this fraction of the minimum. Default 1e-6.
    pub relative_gap: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_nodes: 10_000, time_limit: Duration::from_secs(30), relative_gap: 1e-6 }
    }
}

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The solution is proved optimal within the gap.
    Optimal,
    /// The node limit struck: not proved optimal, but the same on every run.
    Nodes,
    /// The time limit struck: another run may find another solution.
    Time,
}

/// An assignment that satisfies every row.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Value of each variable.
    pub values: Vec<i64>,
    /// Sum of the costs, evaluated by the cost functions themselves.
    pub cost: f64,
    /// Why the search ended.
    pub stop: Stop,
}

/// Integer variable and factor; a linear expression is a list of these, repeats adding up.
pub type Term = (Variable, i32);

/// A convex cost of a linear expression.
struct Cost<'a> {
    terms: Vec<Term>,
    function: Box<dyn Fn(i64) -> f64 + 'a>,
    window: RangeInclusive<i64>,
}

/// A linear row with inclusive bounds.
struct Row {
    terms: Vec<Term>,
    lower: i64,
    upper: i64,
}

/// An integer programme to minimise.
///
/// ```
/// use solve::integer::{Options, Programme};
/// // The two whole numbers next to 2.4 and 3.3 whose sum is even.
/// let mut programme = Programme::new();
/// let (a, b) = (programme.variable(1..=100), programme.variable(1..=100));
/// programme.convex_cost(&[(a, 1)], |v| (v as f64 - 2.4).powi(2), 0..=5);
/// programme.convex_cost(&[(b, 1)], |v| (v as f64 - 3.3).powi(2), 0..=5);
/// programme.even(&[(a, 1), (b, 1)]);
/// let solution = programme.solve(&Options::default(), None, &|| false)?;
/// assert_eq!(solution.values, [3, 3]);
/// # Ok::<(), solve::SolveError>(())
/// ```
#[derive(Default)]
pub struct Programme<'a> {
    bounds: Vec<RangeInclusive<i32>>,
    costs: Vec<Cost<'a>>,
    rows: Vec<Row>,
    even: Vec<Vec<Term>>,
}

impl std::fmt::Debug for Programme<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (variables, costs, rows) = (self.bounds.len(), self.costs.len(), self.rows.len() + self.even.len());
        write!(f, "Programme {{ {variables} variables, {costs} costs, {rows} rows }}")
    }
}

impl<'a> Programme<'a> {
    /// A programme without variables.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a variable with inclusive bounds.
    pub fn variable(&mut self, bounds: RangeInclusive<i32>) -> Variable {
        self.bounds.push(bounds);
        Variable(self.bounds.len() - 1)
    }

    /// Adds `cost`(value of the expression) to what is minimised. `cost` must be convex and finite on the values that
    /// the bounds allow. `window` is a guess of the values that matter: a few around the expected optimum. A bad guess
    /// costs time, not correctness.
    pub fn convex_cost(&mut self, terms: &[Term], cost: impl Fn(i64) -> f64 + 'a, window: RangeInclusive<i64>) {
        self.costs.push(Cost { terms: merge(terms), function: Box::new(cost), window });
    }

    /// Demands that the expression lies in `range`: `3..=3` for an equality, `2..` and `..=5` for inequalities.
    pub fn row(&mut self, terms: &[Term], range: impl RangeBounds<i64>) {
        let lower = match range.start_bound() {
            Bound::Included(&value) => value,
            Bound::Excluded(&value) => value.saturating_add(1),
            Bound::Unbounded => i64::MIN,
        };
        let upper = match range.end_bound() {
            Bound::Included(&value) => value,
            Bound::Excluded(&value) => value.saturating_sub(1),
            Bound::Unbounded => i64::MAX,
        };
        self.rows.push(Row { terms: merge(terms), lower, upper });
    }

    /// Demands that the expression is an even number.
    pub fn even(&mut self, terms: &[Term]) {
        self.even.push(merge(terms));
    }

    /// The cost of an assignment, by the cost functions themselves.
    pub fn cost(&self, values: &[i64]) -> f64 {
        self.costs.iter().map(|cost| (cost.function)(evaluate(&cost.terms, values))).sum()
    }

    /// True when an assignment has the right length and satisfies the bounds and all rows.
    pub fn is_feasible(&self, values: &[i64]) -> bool {
        values.len() == self.bounds.len()
            && self
                .bounds
                .iter()
                .zip(values)
                .all(|(range, &v)| i64::from(*range.start()) <= v && v <= i64::from(*range.end()))
            && self.rows.iter().all(|row| (row.lower..=row.upper).contains(&evaluate(&row.terms, values)))
            && self.even.iter().all(|terms| evaluate(terms, values) % 2 == 0)
    }

    /// Minimises. The result is never worse than `start`, a feasible assignment to begin from; with one, a limit never
    /// costs a result.
    ///
    /// Cost: exponential in the worst case; 0.01 to 5 s for 150 variables with quadratic costs and parity rows. The root
    /// of the search is not bounded by the node limit and can take most of this.
    ///
    /// # Errors
    /// [`SolveError::Infeasible`]; [`SolveError::LimitWithoutSolution`]; [`SolveError::Cancelled`] within 50 ms of
    /// `cancelled` returning true; [`SolveError::OutOfRange`] for a variable of another programme;
    /// [`SolveError::BadNumber`] for a cost that is not convex or finite, empty bounds, or a start that breaks a row.
    pub fn solve(
        &self,
        options: &Options,
        start: Option<&[i64]>,
        cancelled: CancelCheck<'_>,
    ) -> Result<Solution, SolveError> {
        self.check()?;
        if start.is_some_and(|values| !self.is_feasible(values)) {
            return Err(SolveError::BadNumber { what: "start", index: 0, expected: "feasible" });
        }
        let mut best: Option<Vec<i64>> = start.map(<[i64]>::to_vec);
        let ranges: Vec<_> = self.costs.iter().map(|cost| self.range(&cost.terms)).collect();
        let mut windows: Vec<(i64, i64)> = (self.costs.iter().zip(&ranges))
            .map(|(cost, &(low, high))| {
                (*cost.window.start().clamp(&low, &high), *cost.window.end().clamp(&low, &high))
            })
            .map(|(low, high)| (low, high.max(low)))
            .collect();
        loop {
            let model = self.model(&windows, &ranges)?;
            let warm = best.as_ref().map(|values| model.columns_of(self, values));
            let found = run_highs(model.problem, warm, options, cancelled)?;
            if let Some(columns) = found.columns {
                let values: Vec<i64> = columns[..self.bounds.len()].iter().map(|value| value.round() as i64).collect();
                if !self.is_feasible(&values) {
                    let message = "the solution it returned breaks a row when rounded".into();
                    return Err(SolveError::Solver { solver: "HiGHS", message });
                }
                let outside = self.widen(&mut windows, &ranges, &values);
                if best.as_ref().is_none_or(|known| self.cost(&values) < self.cost(known)) {
                    best = Some(values);
                }
                if outside && found.stop == Stop::Optimal {
                    continue;
                }
            }
            return match best {
                Some(values) => Ok(Solution { cost: self.cost(&values), values, stop: found.stop }),
                None if found.stop == Stop::Optimal => {
                    Err(SolveError::Infeasible { rows: self.rows.len() + self.even.len() })
                }
                None => Err(SolveError::LimitWithoutSolution {
                    nodes: options.max_nodes,
                    seconds: options.time_limit.as_secs(),
                }),
            };
        }
    }

    /// Refuses empty bounds and foreign variables.
    fn check(&self) -> Result<(), SolveError> {
        if let Some(index) = self.bounds.iter().position(RangeInclusive::is_empty) {
            return Err(SolveError::BadNumber { what: "bounds", index, expected: "a range that is not empty" });
        }
        let lists =
            self.costs.iter().map(|cost| &cost.terms).chain(self.rows.iter().map(|row| &row.terms)).chain(&self.even);
        match lists.flatten().find(|term| term.0.0 >= self.bounds.len()) {
            Some(&(Variable(index), _)) => {
                Err(SolveError::OutOfRange { what: "variable", index, count: self.bounds.len() })
            }
            None => Ok(()),
        }
    }

    /// Smallest and greatest value that the bounds allow an expression.
    fn range(&self, terms: &[Term]) -> (i64, i64) {
        terms.iter().fold((0, 0), |(low, high), &(Variable(index), factor)| {
            let ends =
                [*self.bounds[index].start(), *self.bounds[index].end()].map(|end| i64::from(end) * i64::from(factor));
            (low + ends[0].min(ends[1]), high + ends[0].max(ends[1]))
        })
    }

    /// Extends each window that the assignment leaves to beyond the value it takes; true when there was one.
    fn widen(&self, windows: &mut [(i64, i64)], ranges: &[(i64, i64)], values: &[i64]) -> bool {
        let mut outside = false;
        for ((cost, (low, high)), &(least, most)) in self.costs.iter().zip(windows).zip(ranges) {
            let value = evaluate(&cost.terms, values);
            let pad = *high - *low + 1;
            if value < *low {
                (*low, outside) = ((value - pad).max(least), true);
            } else if value > *high {
                (*high, outside) = ((value + pad).min(most), true);
            }
        }
        outside
    }

    /// The mixed-integer linear programme for the given windows.
    fn model(&self, windows: &[(i64, i64)], ranges: &[(i64, i64)]) -> Result<Model, SolveError> {
        let mut problem = RowProblem::new();
        let columns: Vec<Col> =
            self.bounds.iter().map(|range| problem.add_integer_column(0.0, range.clone())).collect();
        let factors =
            |terms: &[Term]| terms.iter().map(|&(v, factor)| (columns[v.0], f64::from(factor))).collect::<Vec<_>>();
        for row in &self.rows {
            let lower = if row.lower == i64::MIN { f64::NEG_INFINITY } else { row.lower as f64 };
            let upper = if row.upper == i64::MAX { f64::INFINITY } else { row.upper as f64 };
            problem.add_row(lower..=upper, factors(&row.terms));
        }
        for terms in &self.even {
            let (low, high) = self.range(terms);
            let half = problem.add_integer_column(0.0, low.div_euclid(2) as f64..=(high as f64 / 2.0).ceil());
            let mut row = factors(terms);
            row.push((half, -2.0));
            problem.add_row(0.0..=0.0, row);
        }
        let mut steps = Vec::with_capacity(self.costs.len());
        // The relative gap is relative to the whole cost, so the constant part must be in the objective.
        let mut constant = 0.0;
        for (index, cost) in self.costs.iter().enumerate() {
            let ((low, high), (least, most)) = (windows[index], ranges[index]);
            let slopes = slopes(&*cost.function, (low, high), (least, most)).ok_or(SolveError::BadNumber {
                what: "cost",
                index,
                expected: "convex and finite",
            })?;
            constant += (cost.function)(low);
            let mut row = factors(&cost.terms);
            for &(slope, length) in &slopes.above {
                row.push((problem.add_column(slope, 0.0..=length as f64), -1.0));
            }
            if let Some((slope, length)) = slopes.below {
                row.push((problem.add_column(slope, 0.0..=length as f64), 1.0));
            }
            problem.add_row(low as f64..=low as f64, row);
            steps.push((low, slopes));
        }
        problem.add_column(constant, 1.0..=1.0);
        Ok(Model { problem, steps })
    }
}

/// A mixed-integer linear programme and what its step columns stand for.
struct Model {
    problem: RowProblem,
    /// Of each cost the window's low end and its slopes.
    steps: Vec<(i64, Slopes)>,
}

impl Model {
    /// The values of all columns that an assignment implies, in the order [`Programme::model`] adds them.
    fn columns_of(&self, programme: &Programme<'_>, values: &[i64]) -> Vec<f64> {
        let mut columns: Vec<f64> = values.iter().map(|&value| value as f64).collect();
        columns.extend(programme.even.iter().map(|terms| (evaluate(terms, values) / 2) as f64));
        for (cost, (low, slopes)) in programme.costs.iter().zip(&self.steps) {
            let mut rest = evaluate(&cost.terms, values) - low;
            for &(_, length) in &slopes.above {
                let filled = rest.clamp(0, length);
                columns.push(filled as f64);
                rest -= filled;
            }
            if slopes.below.is_some() {
                columns.push((-rest).max(0) as f64);
            }
        }
        columns.push(1.0);
        columns
    }
}

/// The steps of one cost: (cost for each unit, number of units).
struct Slopes {
    /// From the window's low end upwards.
    above: Vec<(f64, i64)>,
    /// From the window's low end downwards, when the range goes on there.
    below: Option<(f64, i64)>,
}

/// Slopes of `cost` for a window inside the range of possible values; `None` unless they are finite and never fall.
fn slopes(cost: &dyn Fn(i64) -> f64, (low, high): (i64, i64), (least, most): (i64, i64)) -> Option<Slopes> {
    // Rounding in the cost function may bend a straight line down by this much of its size.
    const TOLERANCE: f64 = 1e-12;
    let mut above: Vec<(f64, i64)> = Vec::new();
    let mut previous = cost(low);
    let below = (low > least).then(|| (cost(low - 1) - previous, low - least));
    let mut last = below.map_or(f64::NEG_INFINITY, |(slope, _)| -slope);
    for value in low..=high.min(most - 1) {
        let next = cost(value + 1);
        let slope = next - previous;
        if !slope.is_finite() || slope < last - TOLERANCE * (next.abs() + previous.abs() + last.abs()) {
            return None;
        }
        let units = if value == high { most - high } else { 1 };
        match above.last_mut() {
            Some((equal, length)) if *equal >= slope => *length += units,
            _ => above.push((slope, units)),
        }
        (previous, last) = (next, slope);
    }
    (previous.is_finite() && below.is_none_or(|(slope, _)| slope.is_finite())).then_some(Slopes { above, below })
}

/// What `HiGHS` ended with.
struct Found {
    /// Column values; `None` when no feasible point is known. With [`Stop::Optimal`] this means that there is none.
    columns: Option<Vec<f64>>,
    stop: Stop,
}

/// Solves on a thread of its own: the safe interface of `HiGHS` has no interrupt, and its scheduler is kept for each
/// thread, so that a fresh thread also is what makes "one thread" hold whatever else uses `HiGHS`.
fn run_highs(
    problem: RowProblem,
    start: Option<Vec<f64>>,
    options: &Options,
    cancelled: CancelCheck<'_>,
) -> Result<Found, SolveError> {
    let options = options.clone();
    let outcome = worker::run("HiGHS", cancelled, move || {
        let text = |what: &'static str| move |_| what.to_string();
        let mut model =
            problem.try_optimise(Sense::Minimise).map_err(|status| format!("it refused the model: {status:?}"))?;
        model.make_quiet();
        let refused = text("it refused an option");
        model.try_set_option("threads", 1).map_err(&refused)?;
        model.try_set_option("parallel", "off").map_err(&refused)?;
        model.try_set_option("random_seed", 1).map_err(&refused)?;
        // Restarts at the root, which no node limit counts, took up to 40% of the time and found nothing better.
        model.try_set_option("mip_allow_restart", false).map_err(&refused)?;
        model.try_set_option("mip_heuristic_run_feasibility_jump", false).map_err(&refused)?;
        model.try_set_option("mip_rel_gap", options.relative_gap).map_err(&refused)?;
        model
            .try_set_option("mip_max_nodes", i32::try_from(options.max_nodes).unwrap_or(i32::MAX))
            .map_err(&refused)?;
        model.try_set_option("time_limit", options.time_limit.as_secs_f64()).map_err(&refused)?;
        if let Some(columns) = start {
            model
                .try_set_solution(Some(&columns), None, None, None)
                .map_err(|status| format!("it refused the start: {status:?}"))?;
        }
        let solved = model.try_solve().map_err(|status| format!("it gave up: {status:?}"))?;
        let feasible = solved.primal_solution_status() == HighsSolutionStatus::Feasible;
        let columns = feasible.then(|| solved.get_solution().columns().to_vec());
        Ok((solved.status(), columns))
    })?;
    let failed = |message: String| SolveError::Solver { solver: "HiGHS", message };
    let (status, columns) = outcome.map_err(failed)?;
    let stop = match status {
        HighsModelStatus::Optimal if columns.is_some() => Stop::Optimal,
        HighsModelStatus::Infeasible | HighsModelStatus::UnboundedOrInfeasible => {
            return Ok(Found { columns: None, stop: Stop::Optimal });
        }
        HighsModelStatus::ReachedSolutionLimit | HighsModelStatus::ReachedIterationLimit => Stop::Nodes,
        HighsModelStatus::ReachedTimeLimit => Stop::Time,
        other => return Err(failed(format!("it ended with status {other:?}"))),
    };
    Ok(Found { columns, stop })
}

/// Sorted by variable, repeats added up, zeros dropped.
fn merge(terms: &[Term]) -> Vec<Term> {
    let mut sorted = terms.to_vec();
    sorted.sort_by_key(|term| term.0);
    let mut merged: Vec<Term> = Vec::with_capacity(sorted.len());
    for (variable, factor) in sorted {
        match merged.last_mut() {
            Some(last) if last.0 == variable => last.1 += factor,
            _ => merged.push((variable, factor)),
        }
    }
    merged.retain(|term| term.1 != 0);
    merged
}

/// Value of an expression.
fn evaluate(terms: &[Term], values: &[i64]) -> i64 {
    terms.iter().map(|&(variable, factor)| i64::from(factor) * values[variable.0]).sum()
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use proptest::prelude::*;

    use super::*;

    fn never() -> bool {
        false
    }

    /// All assignments within 0..=3 for each of `count` variables.
    fn assignments(count: usize) -> impl Iterator<Item = Vec<i64>> {
        (0..1usize << (2 * count)).map(move |bits| (0..count).map(|i| (bits >> (2 * i) & 3) as i64).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn equals_brute_force(
            count in 1usize..5,
            costs in prop::collection::vec((prop::array::uniform4(-2i32..3), -8.0..14.0f64, any::<bool>(), -9i64..9), 1..6),
            rows in prop::collection::vec((prop::array::uniform4(-2i32..3), -2i64..8), 0..3),
            parities in prop::collection::vec(prop::array::uniform4(0i32..2), 0..3),
        ) {
            let mut programme = Programme::new();
            let variables: Vec<_> = (0..count).map(|_| programme.variable(0..=3)).collect();
            let terms = |factors: &[i32; 4]| variables.iter().zip(factors).map(|(&v, &f)| (v, f)).collect::<Vec<_>>();
            // Half the windows are far from the values they should hold.
            for &(factors, ideal, squared, window) in &costs {
                let cost = move |v: i64| { let d = v as f64 - ideal; if squared { d * d } else { d.abs() } };
                programme.convex_cost(&terms(&factors), cost, window..=window + 2);
            }
            for (factors, upper) in &rows { programme.row(&terms(factors), ..=*upper); }
            for factors in &parities { programme.even(&terms(factors)); }

            let dot = |factors: &[i32; 4], x: &[i64]| x.iter().zip(factors).map(|(x, &f)| x * i64::from(f)).sum::<i64>();
            let allowed = |x: &Vec<i64>| rows.iter().all(|(f, upper)| dot(f, x) <= *upper) && parities.iter().all(|f| dot(f, x) % 2 == 0);
            let energy = |x: &[i64]| costs.iter().map(|(f, ideal, squared, _)| {
                let d = dot(f, x) as f64 - ideal;
                if *squared { d * d } else { d.abs() }
            }).sum::<f64>();
            let best = assignments(count).filter(allowed).map(|x| energy(&x)).reduce(f64::min);
            let start = assignments(count).find(allowed);

            match (programme.solve(&Options::default(), None, &never), best) {
                (Ok(solution), Some(best)) => {
                    prop_assert_eq!(solution.stop, Stop::Optimal);
                    prop_assert!(allowed(&solution.values));
                    prop_assert!((energy(&solution.values) - solution.cost).abs() < 1e-9);
                    prop_assert!(solution.cost <= best + 1e-5, "{} > {}", solution.cost, best);
                    let warm = programme.solve(&Options::default(), start.as_deref(), &never).unwrap();
                    prop_assert!((warm.cost - solution.cost).abs() < 1e-5);
                }
                (Err(SolveError::Infeasible { .. }), None) => {}
                (result, best) => prop_assert!(false, "{:?} but brute force says {:?}", result, best),
            }
        }
    }

    /// Closest point of a parity lattice with many equal sums: hard enough to outlast the limits below.
    fn hard(programme: &mut Programme<'_>, count: usize) -> Vec<i64> {
        let variables: Vec<_> = (0..count).map(|_| programme.variable(0..=1)).collect();
        for k in 0..6 {
            let terms: Vec<Term> = variables
                .iter()
                .enumerate()
                .map(|(i, &v)| (v, ((i * i * 7919 + i * k * 104_729 + k) % 97) as i32))
                .collect();
            let target = (97 * count / 4) as f64 + 0.3;
            programme.convex_cost(&terms, move |v| (v as f64 - target).abs(), 0..=1);
        }
        vec![0; count]
    }

    #[test]
    fn a_node_limit_keeps_the_start_and_repeats() {
        let mut programme = Programme::new();
        let start = hard(&mut programme, 80);
        let options = Options { max_nodes: 20, ..Options::default() };
        let first = programme.solve(&options, Some(&start), &never).unwrap();
        assert_eq!(first.stop, Stop::Nodes);
        assert!(first.cost <= programme.cost(&start));
        for _ in 0..3 {
            assert_eq!(programme.solve(&options, Some(&start), &never).unwrap(), first);
        }
    }

    #[test]
    fn cancel_is_heard_while_highs_runs() {
        let mut programme = Programme::new();
        hard(&mut programme, 240);
        let options = Options { max_nodes: u32::MAX, time_limit: Duration::from_secs(3), ..Options::default() };
        let begin = Instant::now();
        let cancel = Duration::from_millis(150);
        let result = programme.solve(&options, None, &|| begin.elapsed() > cancel);
        assert_eq!(result, Err(SolveError::Cancelled));
        assert!(begin.elapsed() < cancel + Duration::from_millis(200), "{:?}", begin.elapsed());
    }

    #[test]
    fn a_time_limit_is_reported() {
        let mut programme = Programme::new();
        let start = hard(&mut programme, 240);
        let options = Options { max_nodes: u32::MAX, time_limit: Duration::from_millis(100), ..Options::default() };
        assert_eq!(programme.solve(&options, Some(&start), &never).unwrap().stop, Stop::Time);
    }

    #[test]
    fn bad_programmes_are_named() {
        let mut concave = Programme::new();
        let v = concave.variable(0..=9);
        concave.convex_cost(&[(v, 1)], |x| -(x * x) as f64, 0..=4);
        let error = |programme: &Programme<'_>| programme.solve(&Options::default(), None, &never).unwrap_err();
        assert!(matches!(error(&concave), SolveError::BadNumber { what: "cost", index: 0, .. }));

        let mut foreign = Programme::new();
        foreign.row(&[(v, 1)], 0..);
        assert!(matches!(error(&foreign), SolveError::OutOfRange { what: "variable", index: 0, count: 0 }));

        let mut contradictory = Programme::new();
        let v = contradictory.variable(0..=9);
        contradictory.row(&[(v, 2)], 5..=5);
        assert_eq!(error(&contradictory), SolveError::Infeasible { rows: 1 });
        assert!(contradictory.solve(&Options::default(), Some(&[3]), &never).is_err());
    }

    #[test]
    fn a_programme_without_variables_has_one_solution() {
        let solution = Programme::new().solve(&Options::default(), None, &never).unwrap();
        assert_eq!(solution, Solution { values: vec![], cost: 0.0, stop: Stop::Optimal });
    }
}
