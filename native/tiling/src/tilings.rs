//! All tilings of an outline: how many, each by its index, random ones, the best one (sections 3.3.3 to 3.3.5).
//!
//! Deviation: the paper finds tilings one at a time by an integer programme, bans those it has, and prefers symmetric
//! ones through a random field. The state graph counts them all; an index is then decoded digit by digit.

use crate::TilingError;
use crate::border::Conflict;
use crate::boundary::Boundary;
use crate::certificate::Certificate;
use crate::corner::Alphabet;
use crate::graph::{Alternative, Graph, State, Stop, Value};
use crate::options::Options;
use crate::plane::Isometry;
use crate::random::Random;
use crate::region::Sweep;
use crate::symmetry::{Mask, TRIVIAL, bit, symmetries};
use crate::tile::Tiling;
use crate::value::{Cost, Number};
use mesh::Monitor;
use num_bigint::BigUint;

/// Number of tilings of an outline by unit triangles and squares, exactly.
///
/// # Errors
/// [`TilingError::Memory`] when the states do not fit, [`TilingError::Cancelled`]. Time and memory grow with the number of
/// states, which is exponential in the width of the outline, not in its length: some 10^4 states for 370 tiles in a disc.
pub fn count_tilings(boundary: &Boundary, options: &Options, monitor: &Monitor) -> Result<BigUint, TilingError> {
    Ok(Tilings::new(boundary, options, monitor)?.count().clone())
}

/// True when an outline has a tiling. Stops at the first, so often faster than counting.
///
/// # Errors
/// As [`count_tilings`].
pub fn is_tileable(boundary: &Boundary, options: &Options, monitor: &Monitor) -> Result<bool, TilingError> {
    let group = [Isometry::default()];
    let evaluated = evaluate::<bool>(boundary, &group, Alphabet::plain(), options, monitor);
    evaluated.map(|(_, _, value)| value).map_err(never_overflows)
}

/// A tiling of an outline, another for another seed; `None` when there is none. Not each tiling is equally likely: for that,
/// see [`Tilings::sample`]. It needs no count, so it is quick where there are too many states to count: milliseconds for
/// 1,000 tiles in a disc.
///
/// # Errors
/// As [`count_tilings`].
pub fn find_tiling(
    boundary: &Boundary,
    seed: u64,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<Tiling>, TilingError> {
    search(boundary, seed, usize::MAX, options, monitor)
}

/// As [`find_tiling`], but gives up, and says that there is none, when it has met too many states.
pub(crate) fn find_within(
    boundary: &Boundary,
    seed: u64,
    most_states: usize,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<Tiling>, TilingError> {
    match search(boundary, seed, most_states, options, monitor) {
        Err(TilingError::Memory { .. }) => Ok(None),
        found => found,
    }
}

fn search(
    boundary: &Boundary,
    seed: u64,
    most_states: usize,
    options: &Options,
    monitor: &Monitor,
) -> Result<Option<Tiling>, TilingError> {
    monitor.stage("find", 0.0)?;
    let group = [Isometry::default()];
    let graph = Graph::<bool>::new(Alphabet::plain(), sweep(boundary, &group), options.memory);
    let mut graph = graph.limited(most_states.min(State::MAX as usize)).shuffled(Random::new(seed));
    let begun = graph.begin(&boundary.word(), 0, &group, monitor).map_err(never_overflows)?;
    let Some(root) = begun else { return Ok(None) };
    if !graph.evaluate(&root, monitor).map_err(never_overflows)? {
        return Ok(None);
    }
    // One alternative of each state on the way is known to have a tiling.
    let choose = |graph: &Graph<bool>, alternatives: &[Alternative], ()| {
        let found = (0..alternatives.len()).find(|&k| graph.worth(&alternatives[k]) == Some(true))?;
        Some((found, vec![(); alternatives[found].parts.len()]))
    };
    Walk::new(graph, Some(root)).assemble((), choose, monitor)
}

/// Why an outline has no tiling.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refutation {
    /// The reason.
    pub sentence: String,
    /// Where it shows, as indices into the code; empty when it is not in one place.
    pub corners: Vec<u32>,
}

impl From<String> for Refutation {
    fn from(sentence: String) -> Self {
        Self { sentence, corners: Vec::new() }
    }
}

/// Why an outline has no tiling, when that takes no search: its [`Certificate`], or tiles along the border that do not fit its
/// corners ([`Certificate::border_conflict`]); else forced moves that contradict each other or leave a loop whose
/// certificate does. `None` says nothing: it may have tilings or not. Costs microseconds.
///
/// # Errors
/// [`TilingError::Cancelled`].
pub fn refute(boundary: &Boundary, monitor: &Monitor) -> Result<Option<Refutation>, TilingError> {
    let certificate = Certificate::new(boundary.directions());
    if certificate.refutes() {
        return Ok(Some(certificate.to_string().into()));
    }
    if let Some(conflict) = certificate.border_conflict(boundary.directions()) {
        let corners = if let Conflict::Edge(corner) = conflict { vec![corner] } else { Vec::new() };
        return Ok(Some(Refutation { sentence: conflict.to_string(), corners }));
    }
    let mut graph = Graph::<bool>::new(Alphabet::plain(), Sweep::new([1, 3]), usize::MAX);
    let begun = graph.begin(&boundary.word(), 0, &[Isometry::default()], monitor).map_err(never_overflows)?;
    let Some(begun) = begun else {
        let sentence = "no tiling exists: where the angles at both ends of an edge leave one choice, the tiles that must \
                        lie there contradict each other";
        return Ok(Some(sentence.to_owned().into()));
    };
    let left = begun.parts.iter().map(|part| Certificate::new(&graph.directions(part.state)));
    let refuted = left.into_iter().find(Certificate::refutes);
    let sentence = |left| format!("after the tiles that must lie along the outline are placed, {left}");
    Ok(refuted.map(|certificate| sentence(certificate).into()))
}

/// All tilings of an outline, or all that have certain symmetries, in a fixed order.
///
/// ```
/// use tiling::{Boundary, Options, Tilings};
/// let monitor = mesh::Monitor::new();
/// let dodecagon = Boundary::new(&[5; 12])?;
/// let mut tilings = Tilings::new(&dodecagon, &Options::default(), &monitor)?;
/// assert_eq!(tilings.count(), &2u32.into());
/// let first = tilings.get(&0u32.into(), &monitor)?.unwrap();
/// assert_eq!(first.tiles.len(), 18);
/// # Ok::<(), tiling::TilingError>(())
/// ```
pub struct Tilings {
    boundary: Boundary,
    group: Vec<Isometry>,
    options: Options,
    count: BigUint,
    counted: Counted,
}

/// The state graph with numbers that are large enough.
enum Counted {
    Fits(Walk<u128>),
    Exceeds(Walk<BigUint>),
}

impl Tilings {
    /// Counts the tilings.
    ///
    /// # Errors
    /// As [`count_tilings`].
    pub fn new(boundary: &Boundary, options: &Options, monitor: &Monitor) -> Result<Self, TilingError> {
        Self::with_group(boundary, vec![Isometry::default()], options, monitor)
    }

    /// Those of the tilings that each of the given symmetries of the outline maps to itself; see
    /// [`Boundary::symmetries`]. Any further symmetries that these generate are added.
    ///
    /// # Errors
    /// [`TilingError::Option`] when one is not a symmetry of the outline; else as [`count_tilings`].
    pub fn symmetric(
        boundary: &Boundary,
        symmetries: &[Isometry],
        options: &Options,
        monitor: &Monitor,
    ) -> Result<Self, TilingError> {
        let all = boundary.symmetries();
        if let Some(foreign) = symmetries.iter().find(|isometry| !all.contains(isometry)) {
            return Err(TilingError::Option(format!(
                "{foreign:?} is not a symmetry of the outline; it has {} symmetries, the identity among them",
                all.len()
            )));
        }
        let mut mask: Mask = TRIVIAL | symmetries.iter().map(bit).fold(0, |mask, bit| mask | bit);
        loop {
            let group: Vec<Isometry> = all.iter().filter(|isometry| mask & bit(isometry) != 0).copied().collect();
            let products = group.iter().flat_map(|f| symmetries.iter().map(|g| bit(&f.after(*g))));
            let closed = products.fold(mask, |mask, bit| mask | bit);
            if closed == mask {
                return Self::with_group(boundary, group, options, monitor);
            }
            mask = closed;
        }
    }

    fn with_group(
        boundary: &Boundary,
        group: Vec<Isometry>,
        options: &Options,
        monitor: &Monitor,
    ) -> Result<Self, TilingError> {
        let (counted, count) = match evaluate::<u128>(boundary, &group, Alphabet::plain(), options, monitor) {
            Ok((graph, root, count)) => (Counted::Fits(Walk::new(graph, root)), count.to_big()),
            Err(Stop::Overflow) => {
                let (graph, root, count) = evaluate::<BigUint>(boundary, &group, Alphabet::plain(), options, monitor)
                    .map_err(never_overflows)?;
                (Counted::Exceeds(Walk::new(graph, root)), count)
            }
            Err(Stop::Error(error)) => return Err(error),
        };
        Ok(Self { boundary: boundary.clone(), group, options: options.clone(), count, counted })
    }

    /// How many there are.
    pub fn count(&self) -> &BigUint {
        &self.count
    }

    /// The outline.
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// States of the search.
    pub fn states(&self) -> usize {
        match &self.counted {
            Counted::Fits(walk) => walk.graph.states(),
            Counted::Exceeds(walk) => walk.graph.states(),
        }
    }

    /// The tiling with this index; `None` from the count on. Costs O(n) for each tile the first time it comes by a state.
    ///
    /// # Errors
    /// [`TilingError::Memory`], [`TilingError::Cancelled`].
    pub fn get(&mut self, index: &BigUint, monitor: &Monitor) -> Result<Option<Tiling>, TilingError> {
        if *index >= self.count {
            return Ok(None);
        }
        match &mut self.counted {
            Counted::Fits(walk) => walk.get(index, monitor),
            Counted::Exceeds(walk) => walk.get(index, monitor),
        }
    }

    /// Indices of `n` tilings drawn independently, each tiling equally likely; empty when there is no tiling.
    pub fn sample(&self, n: usize, seed: u64) -> impl Iterator<Item = BigUint> + use<> {
        let mut random = Random::new(seed);
        let count = self.count.clone();
        let n = if count == BigUint::ZERO { 0 } else { n };
        (0..n).map(move |_| random.below(&count))
    }

    /// A tiling with the least sum of weights over its inner vertices, proven, and that sum; `None` when there is no
    /// tiling. Weights are given for each vertex configuration in the order of [`crate::Configuration::ALL`]; vertices of
    /// the outline have none. `[0, 0, 0, 1]` gives the fewest butterflies, `[0, 0, 0, -1]` the most.
    ///
    /// # Errors
    /// [`TilingError::Memory`], [`TilingError::Cancelled`], [`TilingError::Option`] for weights beyond 2^31. The states
    /// also tell apart what lies at open vertices: some 10 times those of counting.
    pub fn best(&self, weights: [i64; 4], monitor: &Monitor) -> Result<Option<(Tiling, i64)>, TilingError> {
        if weights.iter().any(|weight| weight.abs() > 1 << 31) {
            return Err(TilingError::Option("weights lie between -2^31 and 2^31".to_string()));
        }
        let alphabet = Alphabet::weighted(weights);
        let (graph, root, Cost(least)) =
            evaluate::<Cost>(&self.boundary, &self.group, alphabet, &self.options, monitor).map_err(never_overflows)?;
        let Some(least) = least else { return Ok(None) };
        let tiling = Walk::new(graph, root).least(monitor)?;
        Ok(tiling.map(|tiling| (tiling, least)))
    }
}

impl Boundary {
    /// The symmetries of the outline, the identity first, turns before mirrored ones. Costs O(n^2).
    pub fn symmetries(&self) -> Vec<Isometry> {
        symmetries(&self.word(), (1 << 24) - 1)
    }
}

/// A state graph and the alternatives that were read from it.
pub(crate) struct Walk<V> {
    graph: Graph<V>,
    root: Option<Alternative>,
    /// By state; read once, used by each tiling that comes by.
    known: Vec<Option<Box<[Alternative]>>>,
}

impl<V: Value> Walk<V> {
    pub(crate) fn new(graph: Graph<V>, root: Option<Alternative>) -> Self {
        Self { graph, root, known: Vec::new() }
    }

    /// Goes down from the root. `choose` picks one of a state's alternatives by what was carried to it, and says what is
    /// carried to each of that alternative's parts.
    fn assemble<C: Clone>(
        &mut self,
        carry: C,
        choose: impl Fn(&Graph<V>, &[Alternative], C) -> Option<(usize, Vec<C>)>,
        monitor: &Monitor,
    ) -> Result<Option<Tiling>, TilingError> {
        let mut tiles = Vec::new();
        let mut open: Vec<(Option<State>, Isometry, C)> = vec![(None, Isometry::default(), carry)];
        while let Some((state, place, carry)) = open.pop() {
            monitor.check()?;
            let alternatives: &[Alternative] = match state {
                None => self.root.as_slice(),
                Some(state) => {
                    let at = state as usize;
                    if self.known.len() <= at {
                        self.known.resize(at + 1, None);
                    }
                    if self.known[at].is_none() {
                        let read = self.graph.alternatives(state, true, monitor).map_err(never_overflows)?;
                        self.known[at] = Some(read.into());
                    }
                    self.known[at].as_deref().unwrap_or_default()
                }
            };
            let Some((chosen, carries)) = choose(&self.graph, alternatives, carry) else { return Ok(None) };
            let alternative = &alternatives[chosen];
            tiles.extend(alternative.tiles.iter().map(|tile| tile.mapped(place)));
            for (part, carry) in alternative.parts.iter().zip(carries) {
                for image in part.images() {
                    let place = place.after(image).after(Isometry::shift(part.at));
                    open.push((Some(part.state), place, carry.clone()));
                }
            }
        }
        Ok(Some(Tiling { tiles }))
    }
}

impl Walk<Cost> {
    /// A tiling with the least cost; `None` when there is none.
    pub(crate) fn least(mut self, monitor: &Monitor) -> Result<Option<Tiling>, TilingError> {
        let choose = |graph: &Graph<Cost>, alternatives: &[Alternative], ()| {
            let cost = |alternative: &Alternative| graph.worth(alternative).and_then(|Cost(cost)| cost);
            let best = (0..alternatives.len()).filter_map(|k| Some((cost(&alternatives[k])?, k))).min()?.1;
            Some((best, vec![(); alternatives[best].parts.len()]))
        };
        self.assemble((), choose, monitor)
    }
}

impl<V: Number> Walk<V> {
    /// The tiling with this index: alternatives take consecutive ranges, parts are digits of a mixed radix.
    fn get(&mut self, index: &BigUint, monitor: &Monitor) -> Result<Option<Tiling>, TilingError> {
        let Some(index) = V::from_big(index) else { return Ok(None) };
        let choose = |graph: &Graph<V>, alternatives: &[Alternative], mut index: V| {
            for (k, alternative) in alternatives.iter().enumerate() {
                let count = graph.worth(alternative)?;
                if index < count {
                    let digit = |part: &crate::graph::Part| {
                        let (quotient, remainder) = index.divide(graph.value(part.state)?);
                        index = quotient;
                        Some(remainder)
                    };
                    return Some((k, alternative.parts.iter().map(digit).collect::<Option<_>>()?));
                }
                index.subtract(&count);
            }
            None
        };
        self.assemble(index, choose, monitor)
    }
}

/// Builds the state graph of an outline; the value is that of the whole.
#[allow(clippy::type_complexity)] // Three things that belong together only here.
fn evaluate<V: Value>(
    boundary: &Boundary,
    group: &[Isometry],
    alphabet: Alphabet,
    options: &Options,
    monitor: &Monitor,
) -> Result<(Graph<V>, Option<Alternative>, V), Stop> {
    monitor.stage("count", 0.0)?;
    let mut graph = Graph::new(alphabet, sweep(boundary, group), options.memory);
    let root = graph.begin(&boundary.word(), 0, group, monitor)?;
    let value = match &root {
        Some(root) => graph.evaluate(root, monitor)?,
        None => V::none(),
    };
    Ok((graph, root, value))
}

/// The order in which to tile: along the direction across which the outline is narrowest, so that few corners are open
/// at a time; along a mirror when there is one, so that both sides go forward together.
pub(crate) fn sweep(boundary: &Boundary, group: &[Isometry]) -> Sweep {
    // 1000 times the cosine of k times 7.5 degrees; even multiples of 15 degrees are mirrors, odd ones tie least.
    const COSINES: [i64; 13] = [1000, 991, 966, 924, 866, 793, 707, 609, 500, 383, 259, 131, 0];
    let cosine = |k: usize| match k % 48 {
        k @ 0..=12 => COSINES[k],
        k @ 13..=24 => -COSINES[24 - k],
        k @ 25..=36 => -COSINES[k - 24],
        k => COSINES[48 - k],
    };
    let along = |k: usize| Sweep::new([cosine(k), cosine(k + 36)]);
    let mirrors: Vec<usize> = group.iter().filter(|g| g.mirror).map(|g| 2 * usize::from(g.turn)).collect();
    let candidates = if mirrors.is_empty() { (1..24).step_by(2).collect() } else { mirrors };
    // Across a direction: a quarter turn from it.
    let narrowest = candidates.into_iter().min_by_key(|&k| along(k + 12).extent(boundary.directions()));
    along(narrowest.unwrap_or(1))
}

/// For values that cannot be too large.
pub(crate) fn never_overflows(stop: Stop) -> TilingError {
    match stop {
        Stop::Error(error) => error,
        Stop::Overflow => TilingError::Option("the weights are too large for an outline of this size".to_string()),
    }
}
