//! Panels sorted into types: those that lie on one another within a length.

use super::panel::{Flat, Laid};
use super::{PanelRow, PanelType};
use mesh::{Cancelled, Monitor};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The type of a panel, and how the panel lies on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// Place among the models.
    pub model: usize,
    /// The panel's corner that is the model's first.
    pub first: usize,
    pub mirrored: bool,
    pub misfit: f64,
}

/// Models by what all panels near them have in common: corners, and where their longest and shortest edges and longest
/// diagonal lie. Two shapes whose corners are within the tolerance of one another differ in these by twice that at most.
struct Cells {
    models: BTreeMap<(usize, [i64; 3]), Vec<usize>>,
    width: f64,
}

impl Cells {
    fn key(&self, flat: &Flat) -> (usize, [i64; 3]) {
        let longest = |lengths: &[f64]| lengths.iter().copied().fold(0.0, f64::max);
        let shortest = flat.edges.iter().copied().fold(f64::INFINITY, f64::min);
        // Saturates where the tolerance is beyond the precision of the lengths: then only the comparison decides.
        let cell = |length: f64| (length / self.width).floor() as i64;
        let perimeter = flat.edges.iter().sum::<f64>() / flat.edges.len() as f64;
        let third = if flat.diagonals.is_empty() { perimeter } else { longest(&flat.diagonals) };
        (flat.edges.len(), [longest(&flat.edges), shortest, third].map(cell))
    }

    /// The models that a panel may fit, in the order they were found.
    fn near(&self, flat: &Flat) -> Vec<usize> {
        let (corners, [a, b, c]) = self.key(flat);
        let mut near = Vec::new();
        for da in -1..=1 {
            for db in -1..=1 {
                // The last number is a range of keys.
                let from = (corners, [a.saturating_add(da), b.saturating_add(db), c.saturating_sub(1)]);
                let to = (corners, [from.1[0], from.1[1], c.saturating_add(1)]);
                near.extend(self.models.range(from..=to).flat_map(|(_, models)| models));
            }
        }
        near.sort_unstable();
        near.dedup();
        near
    }
}

/// The panels that are models of a type, and the type of every panel.
pub(super) fn sort(
    flats: &[Flat],
    tolerance: f64,
    mirror: bool,
    monitor: &Monitor,
) -> Result<(Vec<usize>, Vec<Fit>), Cancelled> {
    let mut cells = Cells { models: BTreeMap::new(), width: 2.0 * tolerance };
    let mut models: Vec<usize> = Vec::new();
    let mut ticks = 0_usize;
    let mut lay = |flat: &Flat, model: usize| -> Result<Laid, Cancelled> {
        ticks += 1;
        if ticks.is_multiple_of(1024) {
            monitor.check()?;
        }
        Ok(flat.best_on(&flats[model], mirror, tolerance))
    };
    for (f, flat) in flats.iter().enumerate() {
        if f % 256 == 0 {
            monitor.stage("sorting panels", 0.5 * f as f64 / flats.len() as f64)?;
        }
        let mut fits = false;
        for at in cells.near(flat) {
            if lay(flat, models[at])?.misfit <= tolerance {
                fits = true;
                break;
            }
        }
        if !fits {
            cells.models.entry(cells.key(flat)).or_default().push(models.len());
            models.push(f);
        }
    }
    let mut fits = Vec::with_capacity(flats.len());
    for (f, flat) in flats.iter().enumerate() {
        if f % 256 == 0 {
            monitor.stage("sorting panels", 0.5 + 0.5 * f as f64 / flats.len() as f64)?;
        }
        let mut best: Option<Fit> = None;
        for at in cells.near(flat) {
            let laid = lay(flat, models[at])?;
            if best.is_none_or(|best| laid.misfit < best.misfit) {
                best = Some(Fit { model: at, first: laid.first, mirrored: laid.mirrored, misfit: laid.misfit });
            }
        }
        // The model that was found for it, or made of it, is near.
        fits.extend(best);
    }
    Ok((models, fits))
}

/// The models in the order of their types, and each model's place in it.
pub(super) fn ranked(flats: &[Flat], models: &[usize], fits: &[Fit]) -> (Vec<usize>, Vec<u32>) {
    let mut counts = vec![0_usize; models.len()];
    for fit in fits {
        counts[fit.model] += 1;
    }
    let mut order: Vec<usize> = (0..models.len()).collect();
    order.sort_by_key(|&at| (flats[models[at]].edges.len(), Reverse(counts[at]), models[at]));
    let mut rank = vec![0; models.len()];
    for (place, &at) in order.iter().enumerate() {
        rank[at] = place as u32;
    }
    (order, rank)
}

/// The types in order.
pub(super) fn rows(order: &[usize], models: &[usize], panels: &[PanelRow]) -> Vec<PanelType> {
    let mut numbers = BTreeMap::new();
    let mut rows: Vec<PanelType> = order
        .iter()
        .map(|&at| {
            let model = &panels[models[at]];
            let corners = model.nodes.len();
            let number: &mut u32 = numbers.entry(corners).or_default();
            *number += 1;
            PanelType {
                name: format!("{}{number}", if corners == 3 { 'T' } else { 'Q' }),
                corners: corners as u32,
                count: 0,
                mirrored: 0,
                model: model.id,
                misfit: 0.0,
                edges: model.edges.clone(),
                diagonals: model.diagonals.clone(),
                area: model.area,
            }
        })
        .collect();
    for panel in panels {
        let row = &mut rows[panel.kind as usize];
        row.count += 1;
        row.mirrored += u32::from(panel.mirrored);
        row.misfit = row.misfit.max(panel.misfit);
    }
    rows
}
