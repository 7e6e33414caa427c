//! The state graph: tilings of a region by dynamic programming over what is left to tile.
//!
//! A state is a loop without forced moves, written from its lowest corner: the direction of the edge there, and the
//! corners. It has two alternatives, a triangle or a square on that edge; after the forced moves each leaves some loops,
//! which are states again and are filled independently: alternatives add, loops multiply. Each state is worked out once.
//!
//! Deviation from DESIGN 6, measured on discs of 65 to 88 edges: states are told apart by direction as well. Taking the
//! least rotation or reflection of the word would merge 1% of them and cost more than it saves.
//!
//! With thin rhombi (section 6) a state is a loop and the most rhombi that it may take, and its alternatives are four. The
//! certificate's defect of a loop is a lower bound of their number, which ends most of them at once; what one loop cannot
//! do without, the others may not have. Where rhombi must lie near the outline, the key says where the loop lies.
//!
//! Under a group of symmetries an alternative places all images of a tile at once. A loop that is mapped to itself keeps
//! the symmetries that do so; of loops that are mapped to one another, one is filled, and the others are its images.

use crate::TilingError;
use crate::certificate::Certificate;
use crate::corner::Alphabet;
use crate::fence::Fence;
use crate::piece::Piece;
use crate::plane::{Direction, Isometry, Point};
use crate::random::Random;
use crate::region::{ANY_NUMBER, Halt, Loops, Region, Sweep};
use crate::symmetry::{Mask, TRIVIAL, bit, directions, symmetries};
use crate::tile::{Kind, Tile};
use hashbrown::HashTable;
use mesh::{Cancelled, Monitor};
use std::hash::{BuildHasher, Hasher};

/// What a state is worth: a number of tilings, a least cost, or whether there is a tiling at all.
pub(crate) trait Value: Clone {
    /// Of a state without tilings.
    fn none() -> Self;
    /// Of tiles that were placed at this cost.
    fn placed(cost: i64) -> Self;
    /// True for a state without tilings.
    fn is_none(&self) -> bool;
    /// Takes in an independent loop of which there are `copies`; false when the result is too large to write.
    #[must_use]
    fn and(&mut self, part: &Self, copies: usize) -> bool;
    /// Takes in another alternative; false when the result is too large to write.
    #[must_use]
    fn or(&mut self, other: &Self) -> bool;
    /// True when further alternatives change nothing; no cost of them is below `floor`.
    fn is_final(&self, _floor: i64) -> bool {
        false
    }
    /// What is left of it when more than this many rhombi do not count.
    #[must_use]
    fn within(self, _rhombi: u16) -> Self {
        self
    }
}

/// Index of a state.
pub(crate) type State = u32;

/// A loop that an alternative leaves: a state, where its first corner lies, and the images that are filled with it.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) state: State,
    pub(crate) at: Point,
    /// Other than the loop itself; none without symmetries.
    others: Vec<Isometry>,
}

impl Part {
    /// The loop itself and the loops that are filled with it.
    pub(crate) fn images(&self) -> impl Iterator<Item = Isometry> {
        std::iter::once(Isometry::default()).chain(self.others.iter().copied())
    }

    fn copies(&self) -> usize {
        1 + self.others.len()
    }
}

/// One way to go on: tiles, what they cost, and the loops left; relative to the state's first corner.
#[derive(Debug, Clone)]
pub(crate) struct Alternative {
    pub(crate) tiles: Vec<Tile>,
    cost: i64,
    pub(crate) parts: Vec<Part>,
}

/// Why an evaluation stopped.
#[derive(Debug)]
pub(crate) enum Stop {
    /// A value is too large to write.
    Overflow,
    Error(TilingError),
}

impl From<Cancelled> for Stop {
    fn from(cancelled: Cancelled) -> Self {
        Self::Error(cancelled.into())
    }
}

/// All states met, with their values.
pub(crate) struct Graph<V> {
    region: Region,
    /// The loops read off the region last.
    loops: Loops,
    /// The keys, one after the other.
    keys: Vec<u8>,
    /// Where each key ends.
    ends: Vec<usize>,
    /// `None` while not known.
    values: Vec<Option<V>>,
    index: HashTable<State>,
    hasher: foldhash::fast::FixedState,
    /// Bytes that all of this may take.
    limit: usize,
    /// Number of states that there may be.
    most_states: usize,
    /// Whether there are rhombi.
    rhombic: bool,
    /// Whether the first filling of a state is taken for the best.
    hasty: bool,
    /// Puts alternatives in random order.
    shuffle: Option<Random>,
}

/// What tells a state from others.
#[derive(Debug, Clone, Copy)]
struct Key<'a> {
    /// Symmetries that the filling must have.
    mask: Mask,
    /// Most rhombi.
    rhombi: u16,
    /// Where the first corner lies; the origin when that does not matter.
    at: Point,
    word: &'a [u8],
}

/// A state that is being worked out.
struct Frame<V> {
    state: State,
    /// Most rhombi, when there are any at all.
    rhombi: Option<u16>,
    /// No filling costs less.
    floor: i64,
    alternatives: Vec<Alternative>,
    /// Alternative and part that come next.
    next: (usize, usize),
    /// Of the parts of this alternative so far.
    product: V,
    /// Of the alternatives so far.
    sum: V,
}

impl<V: Value> Graph<V> {
    pub(crate) fn new(alphabet: Alphabet, sweep: Sweep, limit: usize) -> Self {
        Self {
            region: Region::new(alphabet, sweep),
            loops: Loops::default(),
            keys: Vec::new(),
            ends: Vec::new(),
            values: Vec::new(),
            index: HashTable::new(),
            hasher: foldhash::fast::FixedState::with_seed(0),
            limit,
            most_states: State::MAX as usize,
            rhombic: false,
            hasty: false,
            shuffle: None,
        }
    }

    /// Alternatives are worked out in random order: for values that are final before all of them are.
    pub(crate) fn shuffled(self, random: Random) -> Self {
        Self { shuffle: Some(random), ..self }
    }

    /// For states with rhombi, inside a fence if there is one. A cost is their number; a `hasty` graph is content with any
    /// that is allowed.
    pub(crate) fn rhombic(fence: Option<Fence>, hasty: bool, sweep: Sweep, limit: usize) -> Self {
        let plain = Self::new(Alphabet::with_rhombi(), sweep, limit);
        Self { region: plain.region.fenced(fence), rhombic: true, hasty, ..plain }
    }

    /// Meets no more states than this.
    pub(crate) fn limited(self, most_states: usize) -> Self {
        Self { most_states, ..self }
    }

    /// Number of states met.
    pub(crate) fn states(&self) -> usize {
        self.ends.len()
    }

    /// Bytes taken.
    fn bytes(&self) -> usize {
        let each = size_of::<usize>() + size_of::<Option<V>>();
        self.keys.capacity() + self.ends.capacity() * each + self.index.allocation_size()
    }

    /// The value of a state that has been worked out.
    pub(crate) fn value(&self, state: State) -> Option<&V> {
        self.values[state as usize].as_ref()
    }

    /// Directions of the edges of a state's loop.
    pub(crate) fn directions(&self, state: State) -> Vec<Direction> {
        directions(split_key(self.key(state)).word)
    }

    /// The outline itself, with up to `rhombi` rhombi, after its forced moves: the one alternative that all tilings begin
    /// with. `None` when the forced moves contradict each other.
    pub(crate) fn begin(
        &mut self,
        word: &[u8],
        rhombi: u16,
        group: &[Isometry],
        monitor: &Monitor,
    ) -> Result<Option<Alternative>, Stop> {
        self.region.load(word);
        if rhombi > 0 {
            self.region.allow(rhombi, Certificate::new(&directions(word)).defect, Point::ORIGIN);
        }
        self.region.queue_all();
        let settled = self.region.settle(monitor);
        self.collect(settled, group, Point::ORIGIN, true)
    }

    /// The alternatives of a state, with their tiles when asked for. Costs O(n) for each tile placed.
    pub(crate) fn alternatives(
        &mut self,
        state: State,
        with_tiles: bool,
        monitor: &Monitor,
    ) -> Result<Vec<Alternative>, Stop> {
        let key = self.key(state).to_vec();
        let Key { mask, rhombi, at, word } = split_key(&key);
        let group = symmetries(word, mask);
        let defect = if rhombi > 0 { Certificate::new(&directions(word)).defect } else { 0 };
        let pieces = if rhombi > 0 { &Piece::ALL[..] } else { &Piece::REGULAR };
        let mut alternatives = Vec::with_capacity(2);
        for &piece in pieces {
            self.region.load(word);
            if rhombi > 0 {
                self.region.allow(rhombi, defect, at);
            }
            if self.rhombic {
                // A loop that was split off may take fewer rhombi than the whole it was settled in.
                self.region.queue_all();
            }
            // The first image is the tile itself.
            let played = self.region.play(piece, &group[1..], monitor);
            alternatives.extend(self.collect(played, &group, at, with_tiles)?);
        }
        Ok(alternatives)
    }

    /// Reads the alternative off the region after its moves.
    fn collect(
        &mut self,
        outcome: Result<(), Halt>,
        group: &[Isometry],
        base: Point,
        with_tiles: bool,
    ) -> Result<Option<Alternative>, Stop> {
        match outcome {
            Ok(()) => {}
            Err(Halt::DeadEnd) => return Ok(None),
            Err(Halt::Cancelled) => return Err(Cancelled.into()),
        }
        let mut loops = std::mem::take(&mut self.loops);
        let parts = if self.region.loops(&mut loops) { self.parts(&loops, group, base) } else { Ok(None) };
        self.loops = loops;
        let tiles = if with_tiles { self.region.placed().collect() } else { Vec::new() };
        Ok(parts?.map(|parts| Alternative { tiles, cost: self.region.cost(), parts }))
    }

    /// The loops as states, one for each set of images; `None` when an image is no loop.
    fn parts(&mut self, loops: &Loops, group: &[Isometry], base: Point) -> Result<Option<Vec<Part>>, Stop> {
        let Some(rhombi) = self.shares(loops) else { return Ok(None) };
        let mut parts = Vec::with_capacity(loops.len());
        let mut taken = vec![false; if group.len() > 1 { loops.len() } else { 0 }];
        for (at, (start, word)) in loops.iter().enumerate() {
            let (mut mask, mut others) = (TRIVIAL, Vec::new());
            if group.len() > 1 {
                if taken[at] {
                    continue;
                }
                let edge = Tile { origin: start, direction: word[0], kind: Kind::Triangle };
                taken[at] = true;
                for isometry in group {
                    let image = edge.mapped(*isometry);
                    // Forced moves keep the symmetry, so the image of a loop is a loop; a crossing loop may break this.
                    let Some(other) = self.region.loop_with_edge(image.origin, image.direction) else {
                        return Ok(None);
                    };
                    if other == at {
                        mask |= bit(isometry);
                    } else if !std::mem::replace(&mut taken[other], true) {
                        others.push(*isometry);
                    }
                }
            }
            let rhombi = rhombi.get(at).copied().unwrap_or(0);
            let place = if rhombi > 0 && self.region.is_fenced() { start + base } else { Point::ORIGIN };
            let state = self.intern(Key { mask, rhombi, at: place, word })?;
            parts.push(Part { state, at: start, others });
        }
        // Small loops first: one without a filling spares the work on the others.
        parts.sort_by_key(|part| (self.key(part.state).len(), part.at));
        Ok(Some(parts))
    }

    /// Most rhombi for each loop: what the others must leave it; none at all when the region takes none. `None` when
    /// the loops need more than there are.
    fn shares(&self, loops: &Loops) -> Option<Vec<u16>> {
        let total = i32::from(self.region.rhombi());
        if total == 0 {
            return Some(Vec::new());
        }
        let certificates: Vec<Certificate> =
            loops.iter().map(|(_, word)| Certificate::new(&directions(word))).collect();
        if self.region.rhombi() == ANY_NUMBER {
            let is_possible = !certificates.iter().any(Certificate::refutes_rhombi);
            return is_possible.then(|| vec![ANY_NUMBER; loops.len()]);
        }
        let spare = total - certificates.iter().map(|certificate| certificate.defect.abs()).sum::<i32>();
        let share = |certificate: &Certificate| {
            let share = certificate.defect.abs() + spare / 2 * 2;
            (spare >= 0 && !certificate.refutes_with_rhombi(share)).then_some(share as u16)
        };
        certificates.iter().map(share).collect()
    }

    fn key(&self, state: State) -> &[u8] {
        key_of(&self.keys, &self.ends, state)
    }

    /// The state with this key, new or known.
    fn intern(&mut self, key: Key<'_>) -> Result<State, Stop> {
        let begin = self.keys.len();
        push_key(&mut self.keys, key);
        let (known, key) = self.keys.split_at(begin);
        let (ends, hasher) = (&self.ends, &self.hasher);
        let old = |state: State| key_of(known, ends, state);
        let hash = |key: &[u8]| {
            let mut hasher = hasher.build_hasher();
            hasher.write(key);
            hasher.finish()
        };
        let hashed = hash(key);
        if let Some(&state) = self.index.find(hashed, |&state| old(state) == key) {
            self.keys.truncate(begin);
            return Ok(state);
        }
        let state = self.ends.len() as State;
        self.index.insert_unique(hashed, state, |&state| hash(old(state)));
        self.ends.push(self.keys.len());
        self.values.push(None);
        if self.bytes() > self.limit || self.states() > self.most_states {
            return Err(Stop::Error(TilingError::Memory { states: self.states(), bytes: self.limit }));
        }
        Ok(state)
    }

    /// The value of an alternative whose parts have been worked out; parts after one without tilings do not matter.
    pub(crate) fn worth(&self, alternative: &Alternative) -> Option<V> {
        let mut product = V::placed(alternative.cost);
        for part in &alternative.parts {
            let value = self.value(part.state)?;
            if value.is_none() {
                return Some(V::none());
            }
            if !product.and(value, part.copies()) {
                return None;
            }
        }
        Some(product)
    }

    /// Works out the parts of an alternative, and returns what it is worth.
    ///
    /// # Errors
    /// [`Stop`]: cancelled, out of memory, or a value too large.
    pub(crate) fn evaluate(&mut self, root: &Alternative, monitor: &Monitor) -> Result<V, Stop> {
        for part in &root.parts {
            if self.value(part.state).is_none() {
                self.work_out(part.state, monitor)?;
            }
            if self.value(part.state).is_some_and(V::is_none) {
                break;
            }
        }
        self.worth(root).ok_or(Stop::Overflow)
    }

    /// Depth first, with a stack of its own: large regions go deeper than a thread's stack.
    fn work_out(&mut self, root: State, monitor: &Monitor) -> Result<(), Stop> {
        let mut stack = vec![self.frame(root, monitor)?];
        let mut steps = 0u32;
        while let Some(frame) = stack.last_mut() {
            let (alternative, part) = frame.next;
            let Some(current) = frame.alternatives.get(alternative) else {
                self.values[frame.state as usize] = Some(match frame.rhombi {
                    Some(rhombi) => frame.sum.clone().within(rhombi),
                    None => frame.sum.clone(),
                });
                stack.pop();
                continue;
            };
            if part == 0 {
                frame.product = V::placed(current.cost);
            }
            let done = match current.parts.get(part) {
                None => {
                    if !frame.sum.or(&frame.product) {
                        return Err(Stop::Overflow);
                    }
                    if frame.sum.is_final(frame.floor) {
                        frame.alternatives.truncate(alternative + 1);
                    }
                    true
                }
                Some(next) => match &self.values[next.state as usize] {
                    Some(value) if value.is_none() => true,
                    Some(value) => {
                        if !frame.product.and(value, next.copies()) {
                            return Err(Stop::Overflow);
                        }
                        false
                    }
                    None => {
                        let state = next.state;
                        let below = self.frame(state, monitor)?;
                        stack.push(below);
                        steps += 1;
                        if steps.is_multiple_of(1024) {
                            monitor.stage("count", progress(&stack))?;
                        }
                        monitor.check()?;
                        continue;
                    }
                },
            };
            frame.next = if done { (alternative + 1, 0) } else { (alternative, part + 1) };
        }
        Ok(())
    }

    fn frame(&mut self, state: State, monitor: &Monitor) -> Result<Frame<V>, Stop> {
        let mut alternatives = self.alternatives(state, false, monitor)?;
        if let Some(random) = &mut self.shuffle {
            // Rhombi stay last: without them a contradiction shows sooner. Not in haste, where chance does better.
            let mixed = if self.hasty { alternatives.len() } else { alternatives.len().min(2) };
            for k in (1..mixed).rev() {
                alternatives.swap(k, random.index(k + 1));
            }
        }
        let Key { rhombi, word, .. } = split_key(self.key(state));
        let (rhombi, floor) = match rhombi {
            _ if !self.rhombic => (None, i64::MIN),
            most if self.hasty => (Some(most), i64::MAX),
            0 => (Some(0), 0),
            most => (Some(most), i64::from(Certificate::new(&directions(word)).defect.abs())),
        };
        Ok(Frame { state, rhombi, floor, alternatives, next: (0, 0), product: V::none(), sum: V::none() })
    }
}

/// How much of the search tree lies behind, if every subtree were as large as its neighbour: a lower bound in practice,
/// because states that are met again cost nothing.
fn progress<V>(stack: &[Frame<V>]) -> f64 {
    let (mut done, mut weight) = (0.0, 1.0);
    for frame in stack {
        let share = weight / frame.alternatives.len().max(1) as f64;
        let (alternative, part) = frame.next;
        let parts = frame.alternatives.get(alternative).map_or(1, |current| current.parts.len().max(1)) as f64;
        done += share * (alternative as f64 + part as f64 / parts);
        weight = share / parts;
    }
    done
}

/// The key of a state, where each key ends being known.
fn key_of<'a>(keys: &'a [u8], ends: &[usize], state: State) -> &'a [u8] {
    let at = state as usize;
    &keys[if at == 0 { 0 } else { ends[at - 1] }..ends[at]]
}

/// Marks that begin keys of more than a word.
const SYMMETRIC: u8 = u8::MAX;
const WITH_RHOMBI: u8 = u8::MAX - 1;

/// A key is the word; after a mark and the mask when there are symmetries, or a mark, the number of rhombi and the place.
fn push_key(keys: &mut Vec<u8>, Key { mask, rhombi, at: Point(at), word }: Key<'_>) {
    if mask != TRIVIAL {
        keys.push(SYMMETRIC);
        keys.extend_from_slice(&mask.to_le_bytes());
    } else if rhombi > 0 {
        keys.push(WITH_RHOMBI);
        keys.extend_from_slice(&rhombi.to_le_bytes());
        // Outlines have less than 2^15 edges.
        keys.extend(at.into_iter().flat_map(|x| (x as i16).to_le_bytes()));
    }
    keys.extend_from_slice(word);
}

fn split_key(key: &[u8]) -> Key<'_> {
    let plain = |word| Key { mask: TRIVIAL, rhombi: 0, at: Point::ORIGIN, word };
    match key {
        [SYMMETRIC, a, b, c, d, word @ ..] => Key { mask: Mask::from_le_bytes([*a, *b, *c, *d]), ..plain(word) },
        [WITH_RHOMBI, low, high, rest @ ..] => {
            let (at, word) = rest.split_at(8);
            let coordinate = |k: usize| i32::from(i16::from_le_bytes([at[2 * k], at[2 * k + 1]]));
            Key { rhombi: u16::from_le_bytes([*low, *high]), at: Point(std::array::from_fn(coordinate)), ..plain(word) }
        }
        word => plain(word),
    }
}
