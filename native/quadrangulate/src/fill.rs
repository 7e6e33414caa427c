//! Filling an n-sided patch with quads: patterns first, then patterns after moves, then the universal ring and grid.
//!
//! Follows `QuadMixer` (Nuvoli et al. 2019), section 3.5: once the side counts are known every patch is filled on its own.
//! Deviation: instead of one learned pattern set, candidates are ranked by [`Cost`] and the best few can be had, so that a
//! judge that knows the geometry may choose; and a filling exists for every disk of even perimeter, whatever its corners.

use crate::disk::{Cost, Disk, Method, Move, Outline, PatchTopology};
use crate::pattern::PATTERNS;
use crate::{strips, universal};
use std::collections::{BTreeMap, BTreeSet};

/// Most sides a pattern has.
pub(crate) const MOST_SIDES: usize = 6;

/// Most moves before a pattern.
const MOST_MOVES: u32 = 3;

/// Outlines the search for moves looks at before it settles for what it has.
const MOST_OUTLINES: usize = 2000;

/// Corners blunter than this, in radians (135 degrees), are better served by two quads than by one.
const FLAT_FROM: f64 = 0.75 * std::f64::consts::PI;

/// Why a disk has no filling.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FillError {
    /// A side without edges.
    #[error("side {side} has no edges; give every side at least one, or leave its corner out")]
    EmptySide {
        /// Index of the side.
        side: usize,
    },
    /// Quads need an even border.
    #[error("the border has {perimeter} edges; quads need an even number: split or join one border edge")]
    OddPerimeter {
        /// Edges on the border.
        perimeter: u64,
    },
    /// Fewer than four edges, or more than 32-bit indices can name.
    #[error("the border has {perimeter} edges; 4 to 65536 are possible")]
    PerimeterOutOfRange {
        /// Edges on the border.
        perimeter: u64,
    },
    /// One angle for each corner, please.
    #[error("{angles} angles were given for {corners} corners; give one for each")]
    AngleCount {
        /// Number of angles.
        angles: usize,
        /// Number of corners.
        corners: usize,
    },
}

/// Fills disks and remembers what it found: patches of a layout repeat their side counts. Results do not depend on what
/// was filled before.
#[derive(Debug, Default)]
pub struct Filler {
    found: BTreeMap<(Vec<u32>, usize), Vec<Filling>>,
}

/// A filling of a canonical outline.
#[derive(Debug, Clone)]
struct Filling {
    disk: Disk,
    method: Method,
    irregular: u32,
    cost: Cost,
}

/// A pattern, turned, with multiplicities that fit.
struct Fit {
    pattern: usize,
    turn: Turn,
    strips: Vec<u32>,
    unevenness: f64,
}

/// A rotation of the sides, or one after reversing them: side `i` of the turned tuple is side `first + i`, or `first - i`
/// when mirrored.
#[derive(Debug, Clone, Copy)]
struct Turn {
    first: usize,
    mirrored: bool,
}

/// Fills a disk with `sides.len()` corners, side `i` having `sides[i]` edges, in counter-clockwise order: the best
/// candidate of a fresh [`Filler`].
///
/// # Errors
/// [`FillError`] for an empty side, an odd perimeter, or one below 4.
///
/// ```
/// let patch = quadrangulate::fill_disk(&[3, 4, 3, 4])?;
/// assert_eq!((patch.quads.len(), patch.irregular), (12, 0));
/// # Ok::<(), quadrangulate::FillError>(())
/// ```
pub fn fill_disk(sides: &[u32]) -> Result<PatchTopology, FillError> {
    Filler::new().fill(sides)
}

/// Fills a disk whose border of `perimeter` edges has no corner: two quads meet at every border vertex.
///
/// # Errors
/// [`FillError`] for an odd perimeter, or one below 4.
pub fn fill_loop(perimeter: u32) -> Result<PatchTopology, FillError> {
    check_perimeter(u64::from(perimeter))?;
    let outline = Outline::closed(perimeter);
    let filling = Filling::new(&outline, universal::fill(&outline).renumbered(), Method::Universal, 0, 0.0);
    Ok(filling.topology(Disk::clone))
}

impl Filler {
    /// A filler that has filled nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The best filling of a disk; see [`fill_disk`].
    ///
    /// # Errors
    /// As [`fill_disk`].
    pub fn fill(&mut self, sides: &[u32]) -> Result<PatchTopology, FillError> {
        Ok(self.candidates(sides, 1)?.swap_remove(0))
    }

    /// Up to `most` different fillings (at least one), best first. Cost: tens of microseconds when a pattern fits, tens
    /// of milliseconds when moves are needed; a repeated tuple is only relabelled.
    ///
    /// # Errors
    /// As [`fill_disk`].
    pub fn candidates(&mut self, sides: &[u32], most: usize) -> Result<Vec<PatchTopology>, FillError> {
        if let Some(side) = sides.iter().position(|&s| s == 0) {
            return Err(FillError::EmptySide { side });
        }
        check_perimeter(sides.iter().map(|&s| u64::from(s)).sum())?;
        let (canonical, turn) = canonical(sides);
        let found =
            self.found.entry((canonical, most)).or_insert_with_key(|(sides, most)| search(sides, (*most).max(1)));
        Ok(found.iter().map(|filling| filling.topology(|disk| turn.undo(sides, disk))).collect())
    }

    /// As [`Filler::candidates`], for a patch whose interior corner angles are known, in radians: corners blunter than
    /// 135 degrees, reflex ones included, get two quads, since one quad there would be flat or inverted.
    ///
    /// # Errors
    /// As [`fill_disk`], and [`FillError::AngleCount`].
    pub fn candidates_with_angles(
        &mut self,
        sides: &[u32],
        angles: &[f64],
        most: usize,
    ) -> Result<Vec<PatchTopology>, FillError> {
        if angles.len() != sides.len() {
            return Err(FillError::AngleCount { angles: angles.len(), corners: sides.len() });
        }
        if angles.iter().all(|&a| a <= FLAT_FROM) {
            return self.candidates(sides, most);
        }
        if let Some(side) = sides.iter().position(|&s| s == 0) {
            return Err(FillError::EmptySide { side });
        }
        check_perimeter(sides.iter().map(|&s| u64::from(s)).sum())?;
        let outline = Outline::new(sides);
        let reduction = outline.keep(|k| angles[k] <= FLAT_FROM);
        let inner = if reduction.inner.corners.is_empty() {
            vec![fill_loop(outline.perimeter)?]
        } else {
            self.candidates(&reduction.inner.sides(), most)?
        };
        let restore = |patch: PatchTopology| {
            let PatchTopology { vertex_count, quads, cost, .. } = patch;
            let disk = Disk { perimeter: outline.perimeter, vertex_count: vertex_count as u32, quads };
            let disk = reduction.restore(&disk);
            Filling::new(&outline, disk, Method::Flattened, cost.moves, cost.unevenness).topology(Disk::clone)
        };
        Ok(inner.into_iter().map(restore).collect())
    }
}

fn check_perimeter(perimeter: u64) -> Result<(), FillError> {
    if !perimeter.is_multiple_of(2) {
        return Err(FillError::OddPerimeter { perimeter });
    }
    if !(4..=65536).contains(&perimeter) {
        return Err(FillError::PerimeterOutOfRange { perimeter });
    }
    Ok(())
}

impl Filling {
    fn new(outline: &Outline, disk: Disk, method: Method, moves: u32, strip_variance: f64) -> Self {
        let irregular = disk.irregularity(outline.corners.iter().map(|c| c.at));
        let cost = Cost {
            irregular_corners: irregular.corners,
            valence_excess: irregular.excess,
            moves,
            unevenness: strip_variance + f64::from(irregular.high),
        };
        Self { disk, method, irregular: irregular.vertices, cost }
    }

    fn topology(&self, relabel: impl Fn(&Disk) -> Disk) -> PatchTopology {
        let disk = relabel(&self.disk);
        PatchTopology {
            vertex_count: disk.vertex_count as usize,
            border: (0..disk.perimeter).collect(),
            quads: disk.quads,
            method: self.method.clone(),
            irregular: self.irregular,
            cost: self.cost,
        }
    }
}

impl Turn {
    fn all(sides: usize) -> impl Iterator<Item = Self> {
        [false, true].into_iter().flat_map(move |mirrored| (0..sides).map(move |first| Self { first, mirrored }))
    }

    fn apply(self, sides: &[u32]) -> Vec<u32> {
        let n = sides.len();
        let index = |i: usize| if self.mirrored { (self.first + n - i) % n } else { (self.first + i) % n };
        (0..n).map(|i| sides[index(i)]).collect()
    }

    /// Relabels a disk with the sides `self.apply(sides)` as one with the sides `sides`.
    fn undo(self, sides: &[u32], disk: &Disk) -> Disk {
        let p = disk.perimeter;
        let ahead = usize::from(self.mirrored);
        let start: u32 = sides[..self.first + ahead].iter().sum();
        disk.with_border(self.mirrored, |v| if self.mirrored { (start + p - v) % p } else { (start + v) % p })
    }
}

/// The least of all turned tuples, and the turn that gives it.
fn canonical(sides: &[u32]) -> (Vec<u32>, Turn) {
    let turned = Turn::all(sides.len()).map(|turn| (turn.apply(sides), turn));
    turned.min_by(|a, b| a.0.cmp(&b.0)).unwrap_or((vec![], Turn { first: 0, mirrored: false }))
}

/// Best fillings of a canonical tuple, best first, at least one.
fn search(sides: &[u32], most: usize) -> Vec<Filling> {
    let outline = Outline::new(sides);
    let mut best = Best { most, fillings: vec![] };
    if sides.len() <= MOST_SIDES {
        for fit in pattern_fits(sides, most, u32::MAX) {
            if !best.beats(&fit.least_cost(0, 0, 0)) {
                let disk = fit.disk(sides).renumbered();
                best.offer(Filling::new(&outline, disk, Method::Pattern(fit.name()), 0, fit.unevenness));
            }
        }
        // A single pair of irregular vertices more than so many corners ask for is good enough not to look at moves, which
        // cost more time and put irregular vertices on or next to the border.
        let valence_excess = least_excess(sides.len()) + 2;
        let bound = Cost { irregular_corners: 0, valence_excess, moves: 0, unevenness: f64::INFINITY };
        if best.beats(&bound) {
            return best.fillings;
        }
    }
    let ring = universal::fill(&outline).renumbered();
    best.offer(Filling::new(&outline, ring, Method::Universal, sides.len() as u32, 0.0));
    if sides.len() <= MOST_SIDES {
        search_moves(&outline, &mut best);
    } else {
        flatten_surplus(&outline, &mut best);
    }
    best.fillings
}

/// The best few fillings so far, each once.
struct Best {
    most: usize,
    fillings: Vec<Filling>,
}

impl Best {
    fn offer(&mut self, filling: Filling) {
        if self.fillings.iter().any(|f| f.disk.quads == filling.disk.quads) {
            return;
        }
        let place = self.fillings.partition_point(|f| f.cost <= filling.cost);
        self.fillings.insert(place, filling);
        self.fillings.truncate(self.most);
    }

    /// The most excess a pattern may add to a reached outline and still enter.
    fn room(&self, reached: &Reached) -> u32 {
        match self.fillings.last() {
            Some(last)
                if self.fillings.len() == self.most && last.cost.irregular_corners <= reached.irregular_corners =>
            {
                last.cost.valence_excess.saturating_sub(reached.excess)
            }
            _ => u32::MAX,
        }
    }

    /// True when nothing of this cost or more can enter.
    fn beats(&self, cost: &Cost) -> bool {
        self.fillings.len() == self.most && self.fillings.last().is_some_and(|f| f.cost <= *cost)
    }
}

/// Least valence excess of a disk with so many regular corners: valences average out to 4 - corners in all.
fn least_excess(corners: usize) -> u32 {
    4u32.abs_diff(corners as u32)
}

/// Patterns that fit: all of the least valence excess, and more while fewer than `most` were found, but none of an excess
/// above `limit`.
fn pattern_fits(sides: &[u32], most: usize, limit: u32) -> Vec<Fit> {
    let fits_limit = |p: &usize| PATTERNS[*p].sides.len() == sides.len() && PATTERNS[*p].valence_excess <= limit;
    let of_size: Vec<usize> = (0..PATTERNS.len()).filter(fits_limit).collect();
    let turns: Vec<(Turn, Vec<u32>)> = Turn::all(sides.len()).map(|t| (t, t.apply(sides))).collect();
    let mut found = Vec::new();
    for equals in of_size.chunk_by(|&a, &b| PATTERNS[a].valence_excess == PATTERNS[b].valence_excess) {
        let mut fits: Vec<Fit> = Vec::new();
        for (&pattern, (turn, turned)) in equals.iter().flat_map(|p| turns.iter().map(move |t| (p, t))) {
            if let Some(strips) = strips::solve(&PATTERNS[pattern], turned) {
                let unevenness = variance(&strips);
                fits.push(Fit { pattern, turn: *turn, strips, unevenness });
            }
        }
        let lumps =
            |f: &Fit| f.unevenness + f64::from(PATTERNS[f.pattern].valence_excess - PATTERNS[f.pattern].irregular);
        fits.sort_by(|a, b| lumps(a).total_cmp(&lumps(b)));
        // One filling is wanted: the first will do. For more, leave it to the caller to find the equal ones.
        if most == 1 {
            fits.truncate(1);
        }
        found.extend(fits);
        if found.len() >= most * 2 * sides.len() || (most == 1 && !found.is_empty()) {
            break;
        }
    }
    found
}

/// Patterns with these sides and a valence excess below `limit`: those of least excess first, and of these those first whose
/// number of quads is nearest to `quads`. None when the border is odd.
pub(crate) fn pattern_patches(sides: &[u32], limit: u32, quads: usize) -> Vec<PatchTopology> {
    if limit == 0 || !(1..=MOST_SIDES).contains(&sides.len()) || !sides.iter().sum::<u32>().is_multiple_of(2) {
        return vec![];
    }
    let outline = Outline::new(sides);
    let topology = |fit: &Fit| {
        let method = Method::Pattern(fit.name());
        Filling::new(&outline, fit.disk(sides), method, 0, fit.unevenness).topology(Disk::clone)
    };
    let mut found: Vec<PatchTopology> = pattern_fits(sides, 2, limit - 1).iter().map(topology).collect();
    found.sort_by_key(|patch| (patch.cost.valence_excess, patch.quads.len().abs_diff(quads)));
    found
}

impl Fit {
    fn name(&self) -> String {
        PATTERNS[self.pattern].name.clone()
    }

    /// The pattern unfolded, as a disk with the sides that it fits.
    fn disk(&self, sides: &[u32]) -> Disk {
        self.turn.undo(sides, &Disk::unfold(&PATTERNS[self.pattern], &self.strips))
    }

    /// What a filling costs at least that takes so many moves, irregular corners and so much excess before this pattern.
    fn least_cost(&self, moves: u32, irregular_corners: u32, excess: u32) -> Cost {
        let valence_excess = excess + PATTERNS[self.pattern].valence_excess;
        Cost { irregular_corners, valence_excess, moves, unevenness: self.unevenness }
    }
}

fn variance(strips: &[u32]) -> f64 {
    let n = strips.len() as f64;
    let mean = strips.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
    strips.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / n
}

/// An outline reached by moves: what they cost so far, and the moves.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Reached {
    irregular_corners: u32,
    /// Excess so far plus what every filling of the rest adds at least.
    least_excess: u32,
    /// Number of moves: outlines are taken in rising order of what [`Cost`] compares.
    made: u32,
    moves: Vec<Move>,
    excess: u32,
    outline: Outline,
}

/// Uniform-cost search over up to [`MOST_MOVES`] moves; every outline on the way that a pattern fills is an offer.
fn search_moves(outline: &Outline, best: &mut Best) {
    let root =
        Reached { irregular_corners: 0, least_excess: 0, made: 0, moves: vec![], excess: 0, outline: outline.clone() };
    let mut queue = BTreeSet::from([root]);
    let mut seen = BTreeSet::new();
    while let Some(reached) = queue.pop_first() {
        let made = reached.made;
        let bound = Cost {
            irregular_corners: reached.irregular_corners,
            valence_excess: reached.least_excess,
            moves: made,
            unevenness: 0.0,
        };
        if best.beats(&bound) || seen.len() > MOST_OUTLINES {
            return;
        }
        if !seen.insert(corner_code(&reached.outline)) {
            continue;
        }
        if made > 0 {
            offer_reached(outline, &reached, best);
        }
        if made == MOST_MOVES {
            continue;
        }
        for step in reached.outline.moves() {
            let Some(reduction) = reached.outline.reduce(step) else { continue };
            let (corner, excess) = match step {
                Move::Merge { .. } => (1, 0),
                Move::Peel { flatten, .. } => (0, flatten.map(u32::from).iter().sum()),
            };
            let excess = reached.excess + excess;
            let mut moves = reached.moves.clone();
            moves.push(step);
            queue.insert(Reached {
                irregular_corners: reached.irregular_corners + corner,
                least_excess: excess + least_excess(reduction.inner.corners.len()),
                made: made + 1,
                moves,
                excess,
                outline: reduction.inner,
            });
        }
    }
}

/// Offers the filling of a reached outline, put back together, if it has one that may be among the best.
fn offer_reached(outline: &Outline, reached: &Reached, best: &mut Best) {
    let Reached { irregular_corners, excess, made, .. } = *reached;
    let (mut disk, unevenness) = if reached.outline.corners.is_empty() {
        (universal::fill(&reached.outline), 0.0)
    } else {
        let sides = reached.outline.sides();
        let Some(fit) = pattern_fits(&sides, 1, best.room(reached)).pop() else { return };
        if best.beats(&fit.least_cost(made, irregular_corners, excess)) {
            return;
        }
        (fit.disk(&sides), fit.unevenness)
    };
    let mut reductions = Vec::new();
    let mut current = outline.clone();
    for &step in &reached.moves {
        let Some(reduction) = current.reduce(step) else { return };
        current = reduction.inner.clone();
        reductions.push(reduction);
    }
    for reduction in reductions.iter().rev() {
        disk = reduction.restore(&disk);
    }
    best.offer(Filling::new(outline, disk.renumbered(), Method::Moves, made, unevenness));
}

/// Equal for outlines that are rotations or reflections of one another.
fn corner_code(outline: &Outline) -> Vec<(u32, bool, bool)> {
    let (n, sides) = (outline.corners.len(), outline.sides());
    if n == 0 {
        return vec![(outline.perimeter, false, false)];
    }
    // Each side with its two corners; read backwards the corners swap.
    let code = |turn: Turn| -> Vec<_> {
        let side = |i: usize| {
            let k = if turn.mirrored { (turn.first + n - i) % n } else { (turn.first + i) % n };
            let ends = [outline.corners[k].real, outline.corners[(k + 1) % n].real];
            let [from, to] = if turn.mirrored { [ends[1], ends[0]] } else { ends };
            (sides[k], from, to)
        };
        (0..n).map(side).collect()
    };
    Turn::all(n).map(code).min().unwrap_or_default()
}

/// Too many corners for a pattern: makes those flat that lie between the shortest sides, then fills the rest.
fn flatten_surplus(outline: &Outline, best: &mut Best) {
    let mut kept: Vec<usize> = (0..outline.corners.len()).collect();
    while kept.len() > MOST_SIDES {
        let sides = outline.keep(|k| kept.contains(&k)).inner.sides();
        let n = sides.len();
        let cramped = (0..n).min_by_key(|&k| sides[k] + sides[(k + n - 1) % n]).unwrap_or(0);
        kept.remove(cramped);
    }
    let reduction = outline.keep(|k| kept.contains(&k));
    for filling in search(&reduction.inner.sides(), best.most) {
        let disk = reduction.restore(&filling.disk).renumbered();
        best.offer(Filling::new(outline, disk, Method::Flattened, filling.cost.moves, filling.cost.unevenness));
    }
}
