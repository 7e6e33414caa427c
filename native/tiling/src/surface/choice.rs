//! Which of its tilings a patch gets (sections 3.3.3 to 3.3.5, 4.2.2).

use super::Fill;
use crate::plane::Isometry;
use crate::random::Random;
use crate::tile::Tiling;
use crate::tilings::find_within;
use crate::{Boundary, Certificate, Options, TilingError, Tilings};
use mesh::Monitor;
use num_bigint::BigUint;

/// Memory for counting the tilings of one patch, bytes: about a quarter of a second. Larger patches get a tiling without a count.
const MEMORY: usize = 1 << 23;

/// States and memory of the plane solver for a patch without a count; one that has a tiling seldom takes a tenth.
const MOST_STATES: usize = 200_000;
const MOST_MEMORY: usize = 1 << 28;

/// Weights of vertex configurations for the fewest butterflies (Fig. 2 d), which look regular, and for the most.
const REGULAR: [i64; 4] = [0, 0, 0, 1];
const FRACTURED: [i64; 4] = [0, 0, 0, -1];

/// The tiling of an outline that a pattern asks for, and how many there are to choose from, where that could be counted.
pub(super) fn choose(
    boundary: &Boundary,
    fill: Fill,
    monitor: &Monitor,
) -> Result<(Option<Tiling>, Option<BigUint>), TilingError> {
    let seed = fill.seed();
    let memory = Options { memory: MEMORY };
    if Certificate::new(boundary.directions()).refutes() {
        return Ok((None, None));
    }
    let found = |monitor| find_within(boundary, seed, MOST_STATES, &Options { memory: MOST_MEMORY }, monitor);
    if is_lattice(boundary) {
        return Ok((found(monitor)?, Some(1u32.into())));
    }
    let counted = within(Tilings::new(boundary, &memory, monitor))?;
    let Some(mut all) = counted else { return Ok((found(monitor)?, None)) };
    let count = all.count().clone();
    let chosen = match fill {
        _ if count == BigUint::ZERO => return Ok((None, Some(count))),
        Fill::Regular => within(all.best(REGULAR, monitor))?.flatten().map(|best| best.0),
        Fill::Fractured { .. } => within(all.best(FRACTURED, monitor))?.flatten().map(|best| best.0),
        Fill::Symmetric { .. } => symmetric(boundary, seed, monitor)?,
        Fill::Random { .. } => None,
    };
    let drawn = match chosen {
        Some(tiling) => Some(tiling),
        None => all.get(&Random::new(seed).below(&count), monitor)?,
    };
    Ok((drawn, Some(count)))
}

/// A tiling with as many symmetries as the outline allows a tiling.
fn symmetric(boundary: &Boundary, seed: u64, monitor: &Monitor) -> Result<Option<Tiling>, TilingError> {
    let all = boundary.symmetries();
    let of_each = all.iter().skip(1).map(|&symmetry| vec![symmetry]);
    let groups: Vec<Vec<Isometry>> = std::iter::once(all.clone()).chain(of_each).collect();
    for group in groups.into_iter().filter(|group| group.len() > 1 || all.len() > 1) {
        let tilings = within(Tilings::symmetric(boundary, &group, &Options { memory: MEMORY }, monitor))?;
        if let Some(mut tilings) = tilings.filter(|tilings| *tilings.count() > BigUint::ZERO) {
            let index = Random::new(seed).below(tilings.count());
            return tilings.get(&index, monitor);
        }
    }
    Ok(None)
}

/// Whether all edges run in directions of one parity, or a right angle apart: then the inside is a piece of the triangular or of
/// the square lattice, and there is one tiling.
fn is_lattice(boundary: &Boundary) -> bool {
    let directions = boundary.directions();
    [2, 3].iter().any(|step| directions.iter().all(|d| d % step == directions[0] % step))
}

/// What did not fit into the memory is none.
fn within<T>(result: Result<T, TilingError>) -> Result<Option<T>, TilingError> {
    match result {
        Ok(found) => Ok(Some(found)),
        Err(TilingError::Memory { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dodecagon of unit edges has two tilings, one the other turned by 30 degrees.
    #[test]
    fn the_dodecagon_has_two_tilings_to_choose_from() {
        let boundary = Boundary::new(&[5; 12]).expect("a dodecagon");
        for fill in [Fill::Regular, Fill::Fractured { seed: 0 }, Fill::Symmetric { seed: 0 }] {
            let (tiling, count) = choose(&boundary, fill, &Monitor::new()).expect("not cancelled");
            assert_eq!(count, Some(2u32.into()), "{fill:?}");
            assert_eq!(tiling.expect("a tiling").tiles.len(), 18, "{fill:?}");
        }
    }

    #[test]
    fn a_lattice_has_one_tiling() {
        let square = Boundary::new(&[3, 6, 3, 6, 3, 6, 3, 6]).expect("a square of side 2");
        let (tiling, count) =
            choose(&square, Fill::Random { seed: 3, patch_panels: 40 }, &Monitor::new()).expect("found");
        assert_eq!((tiling.map(|tiling| tiling.tiles.len()), count), (Some(4), Some(1u32.into())));
    }
}
