//! The sheets as drawings in millimetres: SVG for laser cutters and browsers, DXF for CAD and CNC machines. Outlines, labels
//! and sheets are groups of the one and layers of the other.

use super::sheets::{SheetOptions, Sheets};
use super::{Schedule, ScheduleError};
use dxf::entities::{Entity, EntityType, LwPolyline, Text};
use dxf::enums::{AcadVersion, HorizontalTextJustification, Units, VerticalTextJustification};
use dxf::tables::Layer;
use dxf::{Color, Drawing, LwPolylineVertex, Point};
use mesh::Monitor;
use svg::Document;
use svg::node::element::{Group, Polygon, Rectangle, Text as Label};

/// The kind of drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Scalable Vector Graphics 1.1.
    Svg,
    /// Drawing Exchange Format of `AutoCAD` 2000: text.
    Dxf,
}

/// Height of the letters of a panel's id, and of its neighbours' ids, as parts of the panel's inner radius.
const ID_HEIGHT: f64 = 0.3;
const NEIGHBOUR_HEIGHT: f64 = 0.16;
/// How far from the middle towards an edge the neighbour's id stands.
const NEIGHBOUR_PLACE: f64 = 0.78;
/// Widths of lines, millimetres: a hair is what laser cutters cut.
const CUT_WIDTH: f64 = 0.1;
const CUT_LAYER: &str = "CUT";
const LABEL_LAYER: &str = "LABEL";
const SHEET_LAYER: &str = "SHEET";

/// A word in the drawing, centred.
struct Word {
    text: String,
    at: [f64; 2],
    height: f64,
}

impl Schedule {
    /// All panels laid flat on sheets: each on its best plane, as seen from outside, in millimetres. Panels of a type lie
    /// beside one another, turned alike; sheets beside one another from the left. O(n log n).
    ///
    /// # Errors
    /// [`ScheduleError::Option`], [`ScheduleError::Sheet`] naming the panels that fit on no sheet, and cancelled.
    pub fn unrolled(&self, format: Format, options: &SheetOptions, monitor: &Monitor) -> Result<String, ScheduleError> {
        let sheets = Sheets::of(self, options, monitor)?;
        let words = if options.labels { self.words(&sheets) } else { Vec::new() };
        monitor.check()?;
        match format {
            Format::Svg => Ok(to_svg(&sheets, &words)),
            Format::Dxf => to_dxf(&sheets, &words),
        }
    }

    fn words(&self, sheets: &Sheets) -> Vec<Word> {
        let mut words = Vec::new();
        for placed in &sheets.panels {
            let panel = &self.panels[placed.id as usize];
            let n = placed.outline.len();
            let middle = [0, 1].map(|k| placed.outline.iter().map(|p| p[k]).sum::<f64>() / n as f64);
            // Twice the area over the perimeter: the radius of a circle that touches all edges, where there is one.
            let (mut area, mut perimeter) = (0.0, 0.0);
            for k in 0..n {
                let [[a, b], [c, d]] = [placed.outline[k], placed.outline[(k + 1) % n]];
                area += (a * d - b * c) / 2.0;
                perimeter += f64::hypot(c - a, d - b);
            }
            let radius = 2.0 * area.abs() / perimeter;
            let text = format!("{} {}", panel.id, self.types[panel.kind as usize].name);
            words.push(Word { text, at: middle, height: ID_HEIGHT * radius });
            for (k, neighbour) in panel.neighbours.iter().enumerate() {
                let Some(neighbour) = neighbour else { continue };
                let ends = [placed.outline[k], placed.outline[(k + 1) % n]];
                let at = [0, 1].map(|axis| {
                    let edge = f64::midpoint(ends[0][axis], ends[1][axis]);
                    middle[axis] + NEIGHBOUR_PLACE * (edge - middle[axis])
                });
                words.push(Word { text: neighbour.to_string(), at, height: NEIGHBOUR_HEIGHT * radius });
            }
        }
        words
    }
}

fn frame(origin: [f64; 2], size: [f64; 2]) -> [[f64; 2]; 4] {
    let [[x, y], [w, h]] = [origin, size];
    [[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
}

fn to_svg(sheets: &Sheets, words: &[Word]) -> String {
    let last = sheets.origins.last().map_or(0.0, |origin| origin[0]);
    let (width, height) = (last + sheets.size[0], sheets.size[1]);
    // The y axis of SVG points down.
    let short = |x: f64| format!("{x:.4}");
    let mut frames =
        Group::new().set("id", "sheets").set("fill", "none").set("stroke", "#999999").set("stroke-width", CUT_WIDTH);
    for origin in &sheets.origins {
        let frame = Rectangle::new().set("x", short(origin[0])).set("y", 0);
        frames = frames.add(frame.set("width", short(sheets.size[0])).set("height", short(sheets.size[1])));
    }
    let mut outlines =
        Group::new().set("id", "cut").set("fill", "none").set("stroke", "#ff0000").set("stroke-width", CUT_WIDTH);
    for panel in &sheets.panels {
        let points: Vec<String> = panel.outline.iter().map(|p| format!("{:.4},{:.4}", p[0], height - p[1])).collect();
        outlines =
            outlines.add(Polygon::new().set("id", format!("panel-{}", panel.id)).set("points", points.join(" ")));
    }
    let mut labels = Group::new().set("id", "labels").set("fill", "#0000ff").set("text-anchor", "middle");
    labels = labels.set("font-family", "sans-serif");
    for word in words {
        let label = Label::new(word.text.as_str()).set("x", short(word.at[0]));
        // The base line of a word is about a third of its height below its middle.
        let label = label.set("y", short(height - word.at[1] + 0.35 * word.height));
        labels = labels.add(label.set("font-size", short(word.height)));
    }
    let document = Document::new()
        .set("width", format!("{width:.4}mm"))
        .set("height", format!("{height:.4}mm"))
        .set("viewBox", format!("0 0 {width:.4} {height:.4}"))
        .add(frames)
        .add(outlines)
        .add(labels);
    document.to_string()
}

/// The crate puts the time and a random number into each file, but the same panels are to be the same bytes.
// The types are those of crates that this one does not name.
#[allow(clippy::default_trait_access)]
fn make_timeless(drawing: &mut Drawing) {
    drawing.header.creation_date = Default::default();
    drawing.header.creation_date_universal = Default::default();
    drawing.header.update_date = Default::default();
    drawing.header.update_date_universal = Default::default();
    drawing.header.fingerprint_guid = Default::default();
    drawing.header.version_guid = Default::default();
}

fn to_dxf(sheets: &Sheets, words: &[Word]) -> Result<String, ScheduleError> {
    let mut drawing = Drawing::new();
    drawing.header.version = AcadVersion::R2000;
    drawing.header.default_drawing_units = Units::Millimeters;
    make_timeless(&mut drawing);
    for (name, color) in [(CUT_LAYER, 1), (LABEL_LAYER, 5), (SHEET_LAYER, 8)] {
        drawing.add_layer(Layer { name: name.to_owned(), color: Color::from_index(color), ..Layer::default() });
    }
    let mut add = |layer: &str, specific: EntityType| {
        let mut entity = Entity::new(specific);
        layer.clone_into(&mut entity.common.layer);
        drawing.add_entity(entity);
    };
    let outline = |points: &[[f64; 2]]| {
        let vertices = points.iter().map(|&[x, y]| LwPolylineVertex { x, y, ..LwPolylineVertex::default() }).collect();
        let mut line = LwPolyline { vertices, ..LwPolyline::default() };
        line.set_is_closed(true);
        EntityType::LwPolyline(line)
    };
    for &origin in &sheets.origins {
        add(SHEET_LAYER, outline(&frame(origin, sheets.size)));
    }
    for panel in &sheets.panels {
        add(CUT_LAYER, outline(&panel.outline));
    }
    for word in words {
        let at = Point::new(word.at[0], word.at[1], 0.0);
        let text = Text {
            location: at.clone(),
            second_alignment_point: at,
            text_height: word.height,
            value: word.text.clone(),
            horizontal_text_justification: HorizontalTextJustification::Center,
            vertical_text_justification: VerticalTextJustification::Middle,
            ..Text::default()
        };
        add(LABEL_LAYER, EntityType::Text(text));
    }
    let mut bytes = Vec::new();
    drawing.save(&mut bytes).map_err(|cause| ScheduleError::Text(cause.to_string()))?;
    String::from_utf8(bytes).map_err(|cause| ScheduleError::Text(cause.to_string()))
}
