//! The edge length that makes a wanted number of panels.
//!
//! The number falls as the square of the edge length, but in jumps: patches have whole numbers of edges along their sides and close at some
//! lengths only, and where panels have no room smaller ones are made. So lengths are tried, between those that make too many and those
//! that make too few, and the best result is kept: the nearest to the number that meets the bars of [`crate::MissedBar`].

use crate::surface::{Fill, Partition, ShapeOptions, SurfaceError, SurfaceOptions, SurfaceTiling, tile_in_room};
use mesh::{Monitor, TriangleMesh};

/// A number is met within this part, or as near to it as so many lengths come.
pub(crate) const NEAR_COUNT: f64 = 0.03;
/// A result so near to the number that meets the bars is taken at once.
const GOOD: f64 = 0.07;
/// Lengths tried without shaping to the end.
const ROUGH_TRIES: usize = 4;
/// Lengths tried in all, fewer where more than so many panels would be made.
pub(crate) const TRIES: usize = 6;
const MOST_PANELS: u32 = 12_000;
/// Lengths tried where the number is met and a bar is not, as logarithms over the best: near ones, then ones that make more panels than asked for.
const JITTERS: [f64; 5] = [0.02, -0.02, 0.04, -0.1, -0.25];
/// The first so many of them are tried where it is but the border that is off along its edges; that counts for so much.
const NEAR_JITTERS: usize = 3;
const A_BORDER: f64 = 0.1;
/// Two lengths nearer to one another than this part are not worth another one between them.
const SAME: f64 = 0.004;
/// So many of the tries are kept for even panels.
const EVEN_TRIES: usize = 2;
/// Even panels come instead of patches where they are nearer to the number and the bars by this much.
const PATCHES_WORTH: f64 = 0.3;
/// A bar that is missed is as bad as so much, and by how much it is missed.
const A_MISS: f64 = 0.5;
/// Rounds of shaping that turn back most of what the pattern turned over, so that only panels without room are taken for such.
const FEW_ROUNDS: usize = 8;
/// Mean area of a panel of the regular pattern with unit edges: eight triangles and three squares are a period of it.
const MEAN_PANEL_AREA: f64 = 0.587_645_601_370_716_2;

/// Lengths that were tried for a number of panels; all are logarithms.
pub(crate) struct Search {
    wanted: f64,
    /// Lengths, and by how much their number was off.
    tried: Vec<(f64, f64)>,
    /// Lengths that made nothing, or for which there was no room.
    failed: Vec<f64>,
}

impl Search {
    pub fn new(count: u32) -> Self {
        Self { wanted: f64::from(count).ln(), tried: Vec::new(), failed: Vec::new() }
    }

    /// By how much, as a logarithm, a number of panels is off.
    pub fn off(&self, panels: usize) -> f64 {
        (panels as f64).ln() - self.wanted
    }

    /// So many panels of the length `made` came of asking for `length`: less where that has no room.
    pub fn note(&mut self, length: f64, made: f64, panels: usize) {
        if made < length {
            self.fail(length);
        }
        self.tried.push((made.ln(), self.off(panels)));
    }

    /// Nothing came of a length.
    pub fn fail(&mut self, length: f64) {
        self.failed.push(length.ln());
    }

    /// The length to try next; none when all that is left is as good as tried. Then lengths beside the best are tried, so far from it, for
    /// what else may be wrong with it.
    pub fn next(&self, jitters: &[f64]) -> Option<f64> {
        let best = *self.tried.iter().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let is_new = |wish: &f64| {
            let mut all = self.tried.iter().map(|tried| tried.0).chain(self.failed.iter().copied());
            all.all(|length| (length - wish).abs() > SAME)
        };
        let mut wish = None;
        if best.1.abs() >= NEAR_COUNT {
            let other = self.tried.iter().filter(|other| other.1 * best.1 < 0.0);
            let far = match other.min_by(|a, b| (a.0 - best.0).abs().total_cmp(&(b.0 - best.0).abs())) {
                Some(other) => (other.0 - best.0) * (best.1 / (best.1 - other.1)).clamp(0.25, 0.75),
                None => best.1 / 2.0,
            };
            // Half-way to the nearest length on that side that failed.
            let between = |failed: &f64| (failed - best.0) * far > 0.0 && (failed - best.0).abs() <= far.abs() + SAME;
            let failed = self.failed.iter().copied().filter(between);
            let failed = failed.min_by(|a, b| (a - best.0).abs().total_cmp(&(b - best.0).abs()));
            wish = Some(failed.map_or(best.0 + far, |failed| best.0.midpoint(failed))).filter(is_new);
        }
        let beside = || jitters.iter().map(|step| best.0 + step).find(is_new);
        wish.or_else(beside).map(f64::exp)
    }
}

/// How many lengths may be tried.
pub(crate) fn tries(count: u32) -> usize {
    ((MOST_PANELS / count.max(1)) as usize).clamp(2, TRIES)
}

/// A first guess at the edge length for a number of panels.
pub(crate) struct Guess {
    pub edge_length: f64,
    /// As [`SurfaceTiling::narrow`], of the longer lengths that were tried.
    pub narrow: Vec<u32>,
}

/// Tiles a surface by about so many panels, from a guess for even ones.
pub(crate) fn tile_to_count(
    count: u32,
    surface: &TriangleMesh,
    guess: Guess,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<SurfaceTiling, SurfaceError> {
    let [mut of_patches, mut of_even] = [Search::new(count), Search::new(count)];
    let wants_patches = options.partition == Partition::Paper;
    let mut best: Option<(f64, SurfaceTiling)> = None;
    let Guess { edge_length, mut narrow } = guess;
    let (mut asked, mut length, mut done) = (options.clone(), edge_length, 0.0);
    let tries = tries(count);
    // The largest edges that had room.
    let mut room = 0.0;
    for tried in 1..=tries {
        let until = done + 0.6 * (1.0 - done);
        let made = monitor.within(done, until, || tile_in_room(surface, length, &asked, room, monitor))?;
        done = until;
        if asked.partition == Partition::Paper && made.as_ref().is_none_or(|made| made.patch_graph.is_none()) {
            of_patches.fail(length);
        }
        if let Some(made) = made {
            let is_even = made.patch_graph.is_none();
            let panels = made.mesh.face_count();
            if is_even {
                of_even.note(length, made.edge_length, panels);
                room = made.edge_length.max(room);
            } else {
                of_patches.note(length, made.edge_length, panels);
            }
            if !made.narrow.is_empty() {
                narrow.clone_from(&made.narrow);
            }
            let missed = made.excess();
            let wrong = of_even.off(panels).abs()
                + missed
                + if missed > 0.0 { A_MISS } else { 0.0 }
                + if made.is_off_border() { A_BORDER } else { 0.0 }
                + if is_even && wants_patches { PATCHES_WORTH } else { 0.0 };
            let has_no_room = is_even && !made.turned.is_empty();
            if best.as_ref().is_none_or(|(least, _)| wrong < *least) {
                best = Some((wrong, made));
            }
            if has_no_room {
                break;
            }
        } else {
            of_even.fail(length);
        }
        let least = best.as_ref().map_or(f64::INFINITY, |(least, _)| *least);
        if least < GOOD {
            break;
        }
        // The last tries are for even panels, where those of patches are worse than what patches are worth.
        let jitters = match least {
            _ if least >= A_MISS => &JITTERS[..],
            _ if best.as_ref().is_some_and(|(_, best)| best.is_off_border()) => &JITTERS[..NEAR_JITTERS],
            _ => &[],
        };
        if asked.partition == Partition::Paper {
            if let Some(next) =
                of_patches.next(jitters).filter(|_| least <= PATCHES_WORTH || tried + EVEN_TRIES < tries)
            {
                length = next;
                continue;
            }
            asked.partition = Partition::Expansion;
        }
        if wants_patches && least <= PATCHES_WORTH + GOOD {
            break;
        }
        let first = Some(edge_length).filter(|_| of_even.tried.is_empty());
        let Some(next) = first.or_else(|| of_even.next(jitters)) else { break };
        length = next;
    }
    let (_, mut made) = best.ok_or(SurfaceError::Empty)?;
    if of_even.off(made.mesh.face_count()) > NEAR_COUNT {
        made.narrow = narrow;
    }
    Ok(made)
}

/// The edge length of so many panels, were they regular.
pub(crate) fn edge_length_by_area(count: u32, surface: &TriangleMesh) -> f64 {
    let area: f64 = (0..surface.triangles.len()).map(|t| surface.area_normal(t).length() / 2.0).sum();
    (area / (MEAN_PANEL_AREA * f64::from(count))).sqrt()
}

/// The edge length that makes about so many even panels, from the first one to try. How many there are is seen without shaping them to the end,
/// which takes most of the time.
pub(crate) fn edge_length_of(
    count: u32,
    first: f64,
    surface: &TriangleMesh,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<Guess, SurfaceError> {
    let shape = ShapeOptions { rounds: FEW_ROUNDS, flattening_rounds: 0, ..options.shape };
    // A partition into patches would take long, and makes about as many.
    let quick = SurfaceOptions { fill: Fill::Regular, shape, partition: Partition::Expansion, ..options.clone() };
    let mut search = Search::new(count);
    let (mut length, mut best, mut narrow) = (first, (f64::INFINITY, first), Vec::new());
    let mut room = 0.0;
    for step in 0..ROUGH_TRIES {
        let [low, high] = [step, step + 1].map(|step| step as f64 / ROUGH_TRIES as f64);
        let made = monitor.within(low, high, || tile_in_room(surface, length, &quick, room, monitor))?;
        if let Some(made) = made {
            if !made.turned.is_empty() {
                // However small they are: shaped to the end some may have room.
                narrow = made.narrow;
                break;
            }
            let panels = made.mesh.face_count();
            search.note(length, made.edge_length, panels);
            room = made.edge_length.max(room);
            let off = search.off(panels).abs();
            if off < best.0 {
                best = (off, made.edge_length);
            }
            if !made.narrow.is_empty() {
                narrow = made.narrow;
            }
        } else {
            search.fail(length);
        }
        let Some(next) = search.next(&[]) else { break };
        length = next;
    }
    Ok(Guess { edge_length: best.1, narrow })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tries lengths of a surface with so many panels at each until the search ends.
    fn tried(wanted: u32, first: f64, panels: impl Fn(f64) -> Option<usize>) -> Vec<(f64, Option<usize>)> {
        let mut search = Search::new(wanted);
        let (mut found, mut length) = (Vec::new(), first);
        for _ in 0..20 {
            let made = panels(length);
            match made {
                Some(panels) => search.note(length, length, panels),
                None => search.fail(length),
            }
            found.push((length, made));
            let Some(next) = search.next(&[]) else { break };
            length = next;
        }
        found
    }

    #[test]
    fn a_number_that_falls_in_jumps_is_met_as_nearly_as_it_can_be() {
        // Squares on a square of side 10: whole numbers of them along it.
        let squares = |length: f64| Some(((10.0 / length).round() as usize).pow(2));
        let found = tried(300, 0.4, squares);
        assert!(found.iter().any(|(_, made)| *made == Some(289)), "{found:?}");
        assert!(found.len() < 8, "{found:?}");
    }

    #[test]
    fn lengths_at_which_nothing_closes_are_gone_round() {
        let some = |length: f64| (!(0.9..1.1).contains(&length)).then(|| (400.0 / (length * length)) as usize);
        let found = tried(470, 1.5, some);
        assert!(found.iter().any(|(_, made)| made.is_none()), "{found:?}");
        let (_, nearest) = *found.iter().min_by_key(|(_, made)| made.map_or(usize::MAX, |n| n.abs_diff(470))).unwrap();
        assert!(nearest.unwrap().abs_diff(470) < 160, "{found:?}");
    }

    #[test]
    fn between_what_had_room_and_what_had_none_lengths_are_halved() {
        let mut search = Search::new(100);
        let mut room = vec![];
        for asked in [1.0, 0.0, 0.0, 0.0] {
            let asked = if asked > 0.0 { asked } else { search.next(&[]).unwrap() };
            room.push(asked);
            // Panels longer than 0.6 turn over, and ones of 0.5 are made.
            let made = if asked > 0.6 { 0.5 } else { asked };
            search.note(asked, made, (100.0 / (made * made)) as usize);
        }
        assert!(room[0] > room[1] && room[1] > 0.6 && room[2] < 0.6, "{room:?}");
        assert!(room[3] > room[2] && room[3] < room[1], "{room:?}");
    }

    #[test]
    fn where_the_number_is_met_and_something_else_is_wrong_lengths_near_by_are_tried() {
        let mut search = Search::new(100);
        search.note(1.0, 1.0, 101);
        assert_eq!(search.next(&[]), None);
        for wanted in [1.02, 0.98, 1.04] {
            let length = search.next(&JITTERS).unwrap();
            assert!((length / wanted - 1.0).abs() < 0.002, "{length} for {wanted}");
            search.fail(length);
        }
    }
}
