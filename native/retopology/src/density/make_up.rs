//! The last quads to the number that was asked for: counts of single pieces of chords, or of two, are changed.

use super::{CLOSE_ENOUGH, Sides};
use crate::error::LayoutError;
use mesh::{Monitor, NONE};
use quadrangulate::Filler;

/// Changes of single pieces to make up the rest: many, for few quads may be spread over many places. Then changes in pairs, and the
/// most pieces that are changed so.
const MOST_CHANGES: usize = 400;
const MOST_PAIRS: usize = 40;
const MOST_PAIRED: usize = 80;
impl Sides<'_> {
    /// Changes single pieces, those first that are best changed, until no change brings the quads nearer to the target.
    pub(super) fn make_up(
        &self,
        counts: &mut [u32],
        target: f64,
        h: f64,
        filler: &mut Filler,
        monitor: &Monitor,
    ) -> Result<(), LayoutError> {
        let mut touched = vec![Vec::new(); counts.len()];
        for (index, patch) in self.patches.iter().enumerate() {
            for &corner in &patch.border {
                for &piece in self.parts[self.edge(corner) as usize].iter().filter(|&&piece| piece != NONE) {
                    let list: &mut Vec<usize> = &mut touched[piece as usize];
                    if list.last() != Some(&index) {
                        list.push(index);
                    }
                }
            }
        }
        let mut held = vec![false; counts.len()];
        for patch in self.patches.iter().filter(|patch| patch.template.is_some()) {
            patch.border.iter().for_each(|&c| held[self.piece(c) as usize] = true);
        }
        let mut faces = self.faces(counts, filler)?;
        for _ in 0..MOST_CHANGES {
            monitor.check()?;
            if (faces / target - 1.0).abs() < CLOSE_ENOUGH {
                break;
            }
            let mut best: Option<(f64, usize, u32, f64)> = None;
            for piece in (0..counts.len()).filter(|&piece| !held[piece]) {
                let step = if self.bound[piece] { 2 } else { 1 };
                let old = counts[piece];
                let new = if faces < target { old + step } else { old.saturating_sub(step) };
                // Two keep every pattern possible where pieces are not halves.
                let wanted = &self.ideals[piece];
                if new < step || new == old || (new < old && f64::from(new) < wanted.least - 0.5) {
                    continue;
                }
                let list = &touched[piece];
                let sum = |counts: &[u32], filler: &mut Filler| -> Result<f64, LayoutError> {
                    list.iter().map(|&p| self.faces_of(p, &self.patches[p], counts, filler)).sum()
                };
                let before = sum(counts, filler)?;
                counts[piece] = new;
                let after = sum(counts, filler)?;
                counts[piece] = old;
                let reached = faces + after - before;
                if (reached - target).abs() >= (faces - target).abs() {
                    continue;
                }
                let stretch = |n: u32| (f64::from(n) / wanted.count(h)).ln().powi(2) * wanted.area / (h * h);
                let gained = (faces - target).abs() - (reached - target).abs();
                let price = (stretch(new) - stretch(old)) / gained;
                if best.is_none_or(|b| price < b.0) {
                    best = Some((price, piece, new, reached));
                }
            }
            let Some((_, piece, new, reached)) = best else { break };
            counts[piece] = new;
            faces = reached;
        }
        Ok(())
    }

    /// Changes two whole chords at once, while that brings the quads nearer to the target by more than it stretches them: of
    /// the few chords of a coarse layout each alone may be too long to fit.
    pub(super) fn make_up_in_pairs(
        &self,
        counts: &mut [u32],
        target: f64,
        h: f64,
        filler: &mut Filler,
        monitor: &Monitor,
    ) -> Result<(), LayoutError> {
        if counts.len() > MOST_PAIRED {
            return Ok(());
        }
        let stretch = |piece: usize, n: u32| {
            let wanted = &self.ideals[piece];
            (f64::from(n) / wanted.count(h)).ln().powi(2) * wanted.area / (h * h)
        };
        let mut faces = self.faces(counts, filler)?;
        for _ in 0..MOST_PAIRS {
            if (faces / target - 1.0).abs() < CLOSE_ENOUGH {
                break;
            }
            let mut best: Option<(f64, [usize; 2], [u32; 2], f64)> = None;
            for a in 0..counts.len() {
                monitor.check()?;
                for b in a + 1..counts.len() {
                    for [da, db] in [[1, -1], [-1, 1], [1, 1], [-1, -1], [2, -1], [-1, 2], [-2, 1], [1, -2]] {
                        let old = [counts[a], counts[b]];
                        let new = [old[0].saturating_add_signed(da), old[1].saturating_add_signed(db)];
                        let too_few = |k: usize| f64::from(new[k]) < self.ideals[[a, b][k]].least - 0.5;
                        if new.contains(&0) || too_few(0) || too_few(1) {
                            continue;
                        }
                        [counts[a], counts[b]] = new;
                        let reached = self.faces(counts, filler)?;
                        [counts[a], counts[b]] = old;
                        let gained = (faces - target).abs() - (reached - target).abs();
                        if gained < CLOSE_ENOUGH * target {
                            continue;
                        }
                        let dearer = stretch(a, new[0]) - stretch(a, old[0]) + stretch(b, new[1]) - stretch(b, old[1]);
                        let price = dearer / gained;
                        if best.is_none_or(|found| price < found.0) {
                            best = Some((price, [a, b], new, reached));
                        }
                    }
                }
            }
            let Some((_, [a, b], new, reached)) = best else { break };
            [counts[a], counts[b]] = new;
            faces = reached;
        }
        Ok(())
    }
}
