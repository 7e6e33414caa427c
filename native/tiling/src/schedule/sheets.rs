//! Panels laid flat on sheets, each as seen from outside, those of a type beside one another and turned alike.

use super::panel::{Flat, turned};
use super::{Schedule, ScheduleError};
use mesh::{DVec3, Monitor};

/// Free space between panels where none is asked for, as a part of the mean edge length.
const DEFAULT_GAP: f64 = 0.1;
/// One sheet for all is this much wider than a square of the panels' boxes: rows do not fill up.
const SLACK: f64 = 1.05;

/// How panels are laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetOptions {
    /// Width and height of a sheet, scene units, above 0. Default one sheet that is large enough.
    pub sheet: Option<[f64; 2]>,
    /// Free space round panels, scene units, 0 or more. Default a tenth of the mean edge length.
    pub gap: Option<f64>,
    /// Millimetres that a scene unit is, above 0. Default 1000, for scenes in metres.
    pub millimetres: f64,
    /// Whether panels carry their id and type, and along their edges the ids of their neighbours. Default true.
    pub labels: bool,
}

impl Default for SheetOptions {
    fn default() -> Self {
        Self { sheet: None, gap: None, millimetres: 1000.0, labels: true }
    }
}

/// All panels in the plane of one drawing, millimetres, y upwards.
pub(super) struct Sheets {
    /// Lower left corner of each sheet.
    pub origins: Vec<[f64; 2]>,
    /// Width and height of a sheet.
    pub size: [f64; 2],
    /// In the order of types, then ids.
    pub panels: Vec<Placed>,
}

/// A panel on its sheet.
pub(super) struct Placed {
    pub id: u32,
    pub outline: Vec<[f64; 2]>,
}

/// A panel before it has a place, its box at the origin.
struct Cut {
    id: u32,
    outline: Vec<[f64; 2]>,
    size: [f64; 2],
}

impl Sheets {
    /// Lays out all panels of a schedule, in rows from the lower left. O(n log n).
    pub fn of(schedule: &Schedule, options: &SheetOptions, monitor: &Monitor) -> Result<Self, ScheduleError> {
        let SheetOptions { sheet, gap, millimetres, .. } = *options;
        let is_length = |x: f64| x > 0.0 && x.is_finite();
        if !is_length(millimetres) {
            return Err(ScheduleError::Option(format!("millimetres is {millimetres}; it must be a number above 0")));
        }
        if let Some([width, height]) = sheet
            && !(is_length(width) && is_length(height))
        {
            return Err(ScheduleError::Option(format!(
                "the sheet is {width} by {height}; both must be lengths above 0"
            )));
        }
        let corners: usize = schedule.panels.iter().map(|panel| panel.edges.len()).sum();
        let mean = schedule.panels.iter().flat_map(|panel| &panel.edges).map(|x| x / corners as f64).sum::<f64>();
        let gap = gap.unwrap_or(DEFAULT_GAP * mean);
        if !(gap >= 0.0 && gap.is_finite()) {
            return Err(ScheduleError::Option(format!("the gap is {gap}; it must be a length of 0 or more")));
        }
        let cuts = cut(schedule, monitor)?;
        let size = sheet.unwrap_or_else(|| {
            let boxes: f64 = cuts.iter().map(|cut| (cut.size[0] + gap) * (cut.size[1] + gap)).sum();
            let widest = cuts.iter().map(|cut| cut.size[0] + 2.0 * gap).fold(0.0, f64::max);
            [widest.max(SLACK * boxes.sqrt()), f64::INFINITY]
        });
        let wide = |cut: &&Cut| cut.size[0] + 2.0 * gap > size[0] || cut.size[1] + 2.0 * gap > size[1];
        let too_large: Vec<&Cut> = cuts.iter().filter(wide).collect();
        if let Some(largest) = too_large.iter().max_by(|a, b| a.size[0].total_cmp(&b.size[0])) {
            let panels = too_large.iter().map(|cut| cut.id).collect();
            return Err(ScheduleError::Sheet { panels, sheet: size, largest: largest.size });
        }
        Ok(placed(&cuts, size, gap, millimetres))
    }
}

/// The outlines, turned as their types are, those of a type after one another.
fn cut(schedule: &Schedule, monitor: &Monitor) -> Result<Vec<Cut>, ScheduleError> {
    let flat = |id: u32| Flat::of(&schedule.points(&schedule.panels[id as usize]));
    let models: Vec<Flat> = schedule.types.iter().map(|row| flat(row.model)).collect();
    let mut order: Vec<u32> = (0..schedule.panels.len() as u32).collect();
    order.sort_by_key(|&id| (schedule.panels[id as usize].kind, id));
    let mut cuts = Vec::with_capacity(order.len());
    for (done, &id) in order.iter().enumerate() {
        if done % 256 == 0 {
            monitor.stage("laying out", done as f64 / order.len() as f64)?;
        }
        let panel = &schedule.panels[id as usize];
        let own = flat(id);
        if !own.is_sound() {
            return Err(ScheduleError::NoArea(vec![id]));
        }
        // A mirror image is reflected onto its type and back: what is cut is the panel itself.
        let laid = own.laid_on(&models[panel.kind as usize], panel.first as usize, panel.mirrored);
        let angle = if panel.mirrored { -laid.angle } else { laid.angle };
        let points: Vec<DVec3> = own.corners.iter().map(|&p| turned(p, angle)).collect();
        let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = points.iter().copied().reduce(DVec3::max).unwrap_or_default();
        let outline = points.iter().map(|&p| [p.x - low.x, p.y - low.y]).collect();
        cuts.push(Cut { id, outline, size: [high.x - low.x, high.y - low.y] });
    }
    Ok(cuts)
}

/// Rows from the left, upwards; a new sheet where the height is used up. Sheets lie beside one another.
fn placed(cuts: &[Cut], size: [f64; 2], gap: f64, millimetres: f64) -> Sheets {
    let [width, height] = size;
    let (mut sheet, mut x, mut y, mut row) = (0_usize, gap, gap, 0.0_f64);
    let mut places = Vec::with_capacity(cuts.len());
    let mut top = 0.0_f64;
    for cut in cuts {
        if x + cut.size[0] + gap > width {
            (x, y, row) = (gap, y + row + gap, 0.0);
        }
        if y + cut.size[1] + gap > height {
            (sheet, x, y, row) = (sheet + 1, gap, gap, 0.0);
        }
        places.push((sheet, [x, y]));
        x += cut.size[0] + gap;
        row = row.max(cut.size[1]);
        top = top.max(y + cut.size[1] + gap);
    }
    let height = if height.is_finite() { height } else { top };
    let step = width + 2.0 * gap;
    let origins: Vec<[f64; 2]> = (0..=sheet).map(|s| [s as f64 * step * millimetres, 0.0]).collect();
    let panels = cuts
        .iter()
        .zip(&places)
        .map(|(cut, &(sheet, at))| {
            let move_to = |p: &[f64; 2]| [0, 1].map(|k| origins[sheet][k] + (at[k] + p[k]) * millimetres);
            Placed { id: cut.id, outline: cut.outline.iter().map(move_to).collect() }
        })
        .collect();
    Sheets { origins, size: [width * millimetres, height * millimetres], panels }
}
