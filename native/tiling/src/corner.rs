//! What a state remembers of a corner of the remaining region: its angle and, when vertex configurations have weights,
//! enough of the tiles that already lie there.
//!
//! A corner is one byte, its symbol: the remaining angle in the low four bits, a class in the high four. Class 0 is
//! inert: nothing that happens at the corner changes the objective any more. The other classes are the distinct ways in
//! which the final configuration depends on what is still to come; they number at most two an angle, so states with
//! weights are not many more than states without.

use crate::tile::{Configuration, Kind};
use std::collections::BTreeMap;

/// Remaining angle and class of a corner.
pub(crate) type Symbol = u8;

/// A corner that no tile fits any more.
const DEAD: Symbol = u8::MAX;

/// The remaining angle, in units of 30 degrees.
pub(crate) const fn angle(symbol: Symbol) -> u8 {
    symbol & 15
}

/// Which end of a corner's remaining wedge a tile takes: where the boundary leaves the corner, or where it arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Leaving,
    Arriving,
}

/// Place of a tile's angle (1, 2, 3 or 5 units) in tables.
const SLOT: [usize; 6] = [0, 2, 0, 1, 0, 3];

/// A corner after a tile has taken an end of it, and the cost that this settled.
#[derive(Debug, Clone, Copy)]
struct Step {
    symbol: Symbol,
    cost: i64,
}

/// The symbols and what tiles do to them.
#[derive(Debug, Clone)]
pub(crate) struct Alphabet {
    /// By angle of the tile, end and symbol.
    steps: [[[Step; 64]; 2]; 4],
    /// The corner that a new vertex becomes, by angle of the one tile that lies there.
    fresh: [Step; 4],
    /// Whether a corner of 30 degrees may be left, for a rhombus.
    sharp: bool,
}

impl Alphabet {
    /// Corners without memory.
    pub(crate) fn plain() -> Self {
        Self::inert(false)
    }

    /// Corners without memory, to which rhombi come too.
    pub(crate) fn with_rhombi() -> Self {
        Self::inert(true)
    }

    fn inert(sharp: bool) -> Self {
        let mut steps = [[[Step { symbol: DEAD, cost: 0 }; 64]; 2]; 4];
        let mut fresh = [Step { symbol: DEAD, cost: 0 }; 4];
        for tile in [2, 3, 1, 5u8] {
            for symbol in tile..12 {
                let left = symbol - tile;
                if left != 1 || sharp {
                    steps[SLOT[tile as usize]].iter_mut().for_each(|ends| {
                        ends[symbol as usize] = Step { symbol: left, cost: 0 };
                    });
                }
            }
            fresh[SLOT[tile as usize]].symbol = 12 - tile;
        }
        Self { steps, fresh, sharp }
    }

    /// Corners that remember what the weights of inner vertices need. Vertices of the outline stay inert.
    pub(crate) fn weighted(weights: [i64; 4]) -> Self {
        // Sequences of tiles at a corner, from where the boundary arrives to where it leaves, with their futures: the
        // cost of each way to fill what remains, less the least of these costs.
        let mut sequences: Vec<Vec<Kind>> = Kind::REGULAR.map(|kind| vec![kind]).into();
        let mut at = 0;
        while at < sequences.len() {
            for kind in Kind::REGULAR {
                let longer = [&sequences[at][..], &[kind]].concat();
                if future(&longer, &weights).is_some() {
                    sequences.push(longer);
                }
            }
            at += 1;
        }
        let mut classes: BTreeMap<(u8, Vec<i64>), Symbol> = BTreeMap::new();
        let mut members: Vec<(Symbol, Vec<Kind>)> = Vec::new();
        let mut symbol_of = |sequence: &[Kind]| {
            let Some((base, relative)) = future(sequence, &weights) else { return Step { symbol: DEAD, cost: 0 } };
            let remaining = 12 - sequence.iter().map(|kind| kind.angle()).sum::<u8>();
            if relative.iter().all(|&cost| cost == 0) {
                return Step { symbol: remaining, cost: base };
            }
            let known = classes.keys().filter(|(angle, _)| *angle == remaining).count() as u8;
            let symbol = *classes.entry((remaining, relative)).or_insert(remaining | (known + 1) << 4);
            Step { symbol, cost: base }
        };
        let mut alphabet = Self::plain();
        for sequence in &sequences {
            members.push((symbol_of(sequence).symbol, sequence.clone()));
        }
        // Sequences of one class have the same future, so any of them tells what a tile does.
        for (symbol, sequence) in &members {
            let base = symbol_of(sequence).cost;
            for kind in Kind::REGULAR {
                let leaving = [&sequence[..], &[kind]].concat();
                let arriving = [&[kind], &sequence[..]].concat();
                for (end, longer) in [(End::Leaving, leaving), (End::Arriving, arriving)] {
                    let step = symbol_of(&longer);
                    if *symbol >> 4 != 0 {
                        alphabet.steps[SLOT[kind.angle() as usize]][end as usize][*symbol as usize] =
                            Step { symbol: step.symbol, cost: step.cost - base };
                    }
                }
            }
        }
        for kind in Kind::REGULAR {
            alphabet.fresh[SLOT[kind.angle() as usize]] = symbol_of(&[kind]);
        }
        alphabet
    }

    /// The corner that is left when a tile with an angle of `tile` takes one end of it, and the cost settled; `None` when
    /// it does not fit.
    #[inline]
    pub(crate) fn take(&self, symbol: Symbol, tile: u8, end: End) -> Option<(Symbol, i64)> {
        if symbol >> 4 == 0 {
            // Nothing is remembered: the angle is all.
            let left = symbol.wrapping_sub(tile);
            return (left < 12 && (left != 1 || self.sharp)).then_some((left, 0));
        }
        let step = self.steps[SLOT[tile as usize]][end as usize][usize::from(symbol & 63)];
        (step.symbol != DEAD).then_some((step.symbol, step.cost))
    }

    /// The corner of a new vertex at which one tile lies with an angle of `tile`, and the cost settled.
    pub(crate) fn fresh(&self, tile: u8) -> (Symbol, i64) {
        let step = self.fresh[SLOT[tile as usize]];
        (step.symbol, step.cost)
    }

    /// The two corners that are left when a tile takes a wedge inside a corner: `leaving` and `arriving` are their
    /// angles. At an inner vertex one of the two is at most 120 degrees, which one set of tiles fills in one way: so its
    /// tiles are known, and only the other goes on remembering.
    pub(crate) fn split(&self, symbol: Symbol, leaving: u8, tile: u8, arriving: u8) -> Option<(Symbol, Symbol, i64)> {
        if !self.sharp && (leaving == 1 || arriving == 1) || leaving + tile + arriving != angle(symbol) {
            return None;
        }
        if symbol >> 4 == 0 {
            return Some((leaving, arriving, 0));
        }
        let (small, end) = if leaving <= 4 { (leaving, End::Leaving) } else { (arriving, End::Arriving) };
        let (mut rest, mut cost) = (symbol, 0);
        for &tile in only_filling(small).iter().chain([&tile]) {
            let (next, settled) = self.take(rest, tile, end)?;
            rest = next;
            cost += settled;
        }
        Some(if end == End::Leaving { (small, rest, cost) } else { (rest, small, cost) })
    }
}

/// The angles of the tiles of a wedge of at most 120 degrees.
fn only_filling(angle: u8) -> &'static [u8] {
    match angle {
        2 => &[2],
        3 => &[3],
        4 => &[2, 2],
        _ => &[],
    }
}

/// The least cost of a vertex with these tiles, and how much more each way to complete it costs, in the order of
/// [`fillings`]; `None` when there is no way.
fn future(sequence: &[Kind], weights: &[i64; 4]) -> Option<(i64, Vec<i64>)> {
    let used = sequence.iter().map(|kind| kind.angle()).sum::<u8>();
    let cost = |filling: Vec<Kind>| weights[Configuration::of(&[sequence, &filling].concat()) as usize];
    let costs: Vec<i64> = fillings(12u8.checked_sub(used)?).into_iter().map(cost).collect();
    let base = *costs.iter().min()?;
    Some((base, costs.iter().map(|cost| cost - base).collect()))
}

/// All sequences of tiles that fill an angle.
fn fillings(angle: u8) -> Vec<Vec<Kind>> {
    if angle == 0 {
        return vec![Vec::new()];
    }
    let with_first = |kind: Kind| {
        let rest = angle.checked_sub(kind.angle()).map_or(Vec::new(), fillings);
        rest.into_iter().map(move |filling| [&[kind], &filling[..]].concat())
    };
    Kind::REGULAR.into_iter().flat_map(with_first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::random::Random;

    /// Fills a vertex tile by tile at random ends; the costs must add up to the weight of what came out.
    #[test]
    fn costs_add_up_to_the_weight_of_the_configuration() {
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let weights = std::array::from_fn(|_| random.index(9) as i64 - 4);
            let alphabet = Alphabet::weighted(weights);
            let first = Kind::REGULAR[random.index(2)];
            let (mut symbol, mut cost) = alphabet.fresh(first.angle());
            let mut tiles = vec![first];
            while angle(symbol) > 0 {
                let (kind, end) = (Kind::REGULAR[random.index(2)], [End::Leaving, End::Arriving][random.index(2)]);
                let Some((next, settled)) = alphabet.take(symbol, kind.angle(), end) else { continue };
                tiles.insert(if end == End::Leaving { tiles.len() } else { 0 }, kind);
                (symbol, cost) = (next, cost + settled);
            }
            assert_eq!(cost, weights[Configuration::of(&tiles) as usize], "{tiles:?}");
        }
    }

    #[test]
    fn a_split_corner_costs_what_it_would_unsplit() {
        for weights in [[0, 0, 0, 1], [5, 3, 2, 7], [-1, 0, 0, 0]] {
            let alphabet = Alphabet::weighted(weights);
            let mut splits = 0;
            for whole in fillings(12) {
                // Tiles 0..a lie there; b is placed between; a wedge on each side is left.
                for a in 1..whole.len() {
                    for b in a..whole.len() {
                        let (mut symbol, mut cost) = alphabet.fresh(whole[0].angle());
                        for &kind in &whole[1..a] {
                            let (next, settled) = alphabet.take(symbol, kind.angle(), End::Leaving).unwrap();
                            (symbol, cost) = (next, cost + settled);
                        }
                        let sum = |kinds: &[Kind]| kinds.iter().map(|kind| kind.angle()).sum::<u8>();
                        let (before, after) = (&whole[a..b], &whole[b + 1..]);
                        let (mut left, mut right, settled) =
                            alphabet.split(symbol, sum(before), whole[b].angle(), sum(after)).unwrap();
                        cost += settled;
                        for &kind in before {
                            let (next, settled) = alphabet.take(left, kind.angle(), End::Leaving).unwrap();
                            (left, cost) = (next, cost + settled);
                        }
                        for &kind in after {
                            let (next, settled) = alphabet.take(right, kind.angle(), End::Leaving).unwrap();
                            (right, cost) = (next, cost + settled);
                        }
                        assert_eq!(cost, weights[Configuration::of(&whole) as usize]);
                        splits += 1;
                    }
                }
            }
            assert!(splits > 100);
        }
    }

    #[test]
    fn butterflies_need_few_classes() {
        let alphabet = Alphabet::weighted([0, 0, 0, 1]);
        let mut symbols: Vec<Symbol> = alphabet.steps.iter().flatten().flatten().map(|step| step.symbol).collect();
        symbols.extend(alphabet.fresh.map(|step| step.symbol));
        symbols.retain(|&symbol| symbol != DEAD && symbol >> 4 != 0);
        symbols.sort_unstable();
        symbols.dedup();
        assert!(symbols.len() <= 8, "{symbols:?}");
    }
}
