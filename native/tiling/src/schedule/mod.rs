//! What a builder needs of a mesh of triangles and quads: each panel's shape and how flat it is, the few types of panels that
//! will do for all, nodes and edges with their lengths; as JSON and CSV, and the panels laid flat on sheets as SVG or DXF.
//!
//! Planar panels and few types are what section 1 of Peng et al. 2018 gives as the aims of architecture; the paper measures
//! neither. Ids are the indices of faces and vertices, so that an id read on a drawing can be found in the mesh.

mod drawing;
mod panel;
mod sheets;
mod summary;
mod tables;
mod types;

pub use drawing::Format;
pub use sheets::SheetOptions;
pub use summary::Summary;
pub use tables::Table;

use mesh::{Cancelled, DVec3, Monitor, PolygonMesh, sorted};
use panel::Flat;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Layout of the JSON text; it changes when a reader has to.
const VERSION: u32 = 1;
/// Tolerance where none is given, as a part of the mean edge length.
const DEFAULT_TOLERANCE: f64 = 0.01;

/// What counts as one type of panel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScheduleOptions {
    /// No corner of a panel is further than this from where its type has it; scene units, above 0. Default a hundredth of the
    /// mean edge length.
    pub tolerance: Option<f64>,
    /// Whether a panel and its mirror image are one type, as when panels may be turned over. Default false.
    pub mirror: bool,
}

/// A mesh as a list of parts. Lengths in scene units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    version: u32,
    /// No corner of a panel is further than this from where its type has it.
    pub tolerance: f64,
    /// Whether mirror images are one type.
    pub mirror: bool,
    /// Positions of the vertices; a node's id is its place here.
    pub nodes: Vec<[f64; 3]>,
    /// One a face, in order.
    pub panels: Vec<PanelRow>,
    /// Triangles first, then quads, the frequent ones first.
    pub types: Vec<PanelType>,
    /// Edges of the panels, by their nodes.
    pub edges: Vec<EdgeRow>,
    /// From the shortest to the longest.
    pub edge_classes: Vec<EdgeClass>,
}

/// A panel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PanelRow {
    /// Its face.
    pub id: u32,
    /// Place of its type among the types.
    pub kind: u32,
    /// Whether it is the mirror image of its type.
    pub mirrored: bool,
    /// The corner that is the type's first corner.
    pub first: u32,
    /// Greatest distance of a corner from where the type has it.
    pub misfit: f64,
    /// Its corners, counter-clockwise seen from outside.
    pub nodes: Vec<u32>,
    /// The panel beyond the edge from each corner to the next; none at a border, or where more than two panels meet.
    pub neighbours: Vec<Option<u32>>,
    /// Lengths from each corner to the next.
    pub edges: Vec<f64>,
    /// Of a quad, from the first corner to the third and from the second to the fourth; none of a triangle.
    pub diagonals: Vec<f64>,
    /// A quad's is that of its projection onto its best plane; scene units squared.
    pub area: f64,
    /// Greatest distance of a corner from the plane that is nearest to all: of a quad half the distance of its diagonals.
    pub deviation: f64,
    /// Distance between the diagonals over their mean length, the measure of Liu et al. 2006; 0 for triangles.
    pub planarity: f64,
}

/// Panels that can be made alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PanelType {
    /// T1, T2, ... for triangles, Q1, Q2, ... for quads.
    pub name: String,
    /// 3 or 4.
    pub corners: u32,
    /// How many panels are of it.
    pub count: u32,
    /// How many of these are mirror images.
    pub mirrored: u32,
    /// The panel whose shape the type has.
    pub model: u32,
    /// Greatest misfit of its panels.
    pub misfit: f64,
    /// Of the model.
    pub edges: Vec<f64>,
    /// Of the model.
    pub diagonals: Vec<f64>,
    /// Of the model.
    pub area: f64,
}

/// An edge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EdgeRow {
    /// Its ends, the lower first.
    pub nodes: [u32; 2],
    /// The panels at it.
    pub panels: Vec<u32>,
    /// Its length.
    pub length: f64,
    /// Place of its class among the classes.
    pub class: u32,
}

/// Edges that can be made alike: none differs from the class's length by more than the tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EdgeClass {
    /// E1, E2, ...
    pub name: String,
    /// How many edges are of it.
    pub count: u32,
    /// Half-way between its shortest and its longest edge.
    pub length: f64,
}

/// Why there is no schedule, or no drawing of it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScheduleError {
    /// There are no panels.
    #[error("the mesh has no faces; choose an object with a surface")]
    Empty,
    /// A position is no number.
    #[error("the mesh has {} vertices with a coordinate that is not a number or infinite; delete or move them", .0.len())]
    NotFinite(Vec<u32>),
    /// Faces of more than four corners.
    #[error("the mesh has {} faces with more than four corners; triangulate them or split them into quads", .0.len())]
    Ngons(Vec<u32>),
    /// Faces that name a vertex twice.
    #[error("the mesh has {} faces that name a vertex twice; delete them and close the gap", .0.len())]
    Degenerate(Vec<u32>),
    /// Faces that have no plane, or an area past the largest number.
    #[error("the mesh has {} faces without an area; dissolve them, or scale a tiny or huge object", .0.len())]
    NoArea(Vec<u32>),
    /// An option is out of range.
    #[error("{0}")]
    Option(String),
    /// Panels that are larger than the sheet.
    #[error(
        "{} panels do not fit on a sheet of {} by {}; the largest measures {} by {}: take larger sheets, or smaller panels",
        panels.len(), sheet[0], sheet[1], largest[0], largest[1]
    )]
    Sheet {
        /// The panels.
        panels: Vec<u32>,
        /// As given.
        sheet: [f64; 2],
        /// Width and height of the largest one.
        largest: [f64; 2],
    },
    /// A text that is no schedule.
    #[error("the text is no schedule: {0}")]
    Text(String),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Schedule {
    /// Measures the panels of a mesh and sorts them into types.
    ///
    /// Types are found one after another: a panel that no earlier type fits within the tolerance founds one, and in the end
    /// each panel goes to the type that fits it best. Shapes are compared laid on their best planes, outside up, and turned to
    /// one another in the plane. O(n log n), times the types that are nearly alike.
    ///
    /// # Errors
    /// [`ScheduleError`], naming the faces or vertices.
    pub fn of(mesh: &PolygonMesh, options: &ScheduleOptions, monitor: &Monitor) -> Result<Self, ScheduleError> {
        monitor.stage("measuring", 0.0)?;
        check(mesh)?;
        let flats: Vec<Flat> =
            (0..mesh.face_count()).map(|f| Flat::of(&mesh.face_points(f).collect::<Vec<_>>())).collect();
        let flat = faces(mesh, |f| !flats[f].is_sound());
        if !flat.is_empty() {
            return Err(ScheduleError::NoArea(flat));
        }
        let corners = mesh.corner_verts().len() as f64;
        let mean_edge = flats.iter().flat_map(|flat| &flat.edges).map(|length| length / corners).sum::<f64>();
        let tolerance = options.tolerance.unwrap_or(DEFAULT_TOLERANCE * mean_edge);
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            let sentence =
                format!("the tolerance is {tolerance}; it must be a length above 0, the mean edge is {mean_edge}");
            return Err(ScheduleError::Option(sentence));
        }
        let (models, fits) = types::sort(&flats, tolerance, options.mirror, monitor)?;
        let mut edges = edge_rows(mesh);
        let edge_classes = classify(&mut edges, tolerance);
        let beyond: BTreeMap<[u32; 2], &[u32]> =
            edges.iter().map(|edge| (edge.nodes, edge.panels.as_slice())).collect();
        let (order, rank) = types::ranked(&flats, &models, &fits);
        let panels: Vec<PanelRow> = flats
            .iter()
            .zip(&fits)
            .enumerate()
            .map(|(f, (flat, fit))| {
                let nodes = mesh.face(f).to_vec();
                let neighbours = (0..nodes.len())
                    .map(|k| match beyond[&sorted(nodes[k], nodes[(k + 1) % nodes.len()])] {
                        &[a, b] => Some(if a == f as u32 { b } else { a }),
                        _ => None,
                    })
                    .collect();
                PanelRow {
                    id: f as u32,
                    kind: rank[fit.model],
                    mirrored: fit.mirrored,
                    first: fit.first as u32,
                    misfit: fit.misfit,
                    nodes,
                    neighbours,
                    edges: flat.edges.clone(),
                    diagonals: flat.diagonals.clone(),
                    area: flat.area,
                    deviation: flat.deviation,
                    planarity: flat.planarity(),
                }
            })
            .collect();
        let types = types::rows(&order, &models, &panels);
        let nodes = mesh.positions.iter().map(DVec3::to_array).collect();
        Ok(Self { version: VERSION, tolerance, mirror: options.mirror, nodes, panels, types, edges, edge_classes })
    }

    /// The corners of a panel.
    fn points(&self, panel: &PanelRow) -> Vec<DVec3> {
        panel.nodes.iter().map(|&v| self.nodes[v as usize].into()).collect()
    }
}

fn check(mesh: &PolygonMesh) -> Result<(), ScheduleError> {
    if mesh.face_count() == 0 {
        return Err(ScheduleError::Empty);
    }
    let bad: Vec<u32> = (0..mesh.vertex_count() as u32).filter(|&v| !mesh.positions[v as usize].is_finite()).collect();
    if !bad.is_empty() {
        return Err(ScheduleError::NotFinite(bad));
    }
    let ngons = faces(mesh, |f| mesh.face(f).len() > 4);
    if !ngons.is_empty() {
        return Err(ScheduleError::Ngons(ngons));
    }
    let degenerate = faces(mesh, |f| mesh.face(f).iter().collect::<BTreeSet<_>>().len() < mesh.face(f).len());
    if degenerate.is_empty() { Ok(()) } else { Err(ScheduleError::Degenerate(degenerate)) }
}

fn faces(mesh: &PolygonMesh, is_one: impl Fn(usize) -> bool) -> Vec<u32> {
    (0..mesh.face_count()).filter(|&f| is_one(f)).map(|f| f as u32).collect()
}

/// Every edge once, with the panels at it.
fn edge_rows(mesh: &PolygonMesh) -> Vec<EdgeRow> {
    let mut panels: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for (f, face) in mesh.faces().enumerate() {
        for k in 0..face.len() {
            panels.entry(sorted(face[k], face[(k + 1) % face.len()])).or_default().push(f as u32);
        }
    }
    let length = |nodes: [u32; 2]| mesh.positions[nodes[0] as usize].distance(mesh.positions[nodes[1] as usize]);
    panels.into_iter().map(|(nodes, panels)| EdgeRow { nodes, panels, length: length(nodes), class: 0 }).collect()
}

/// The fewest classes: each reaches from its shortest edge as far as two tolerances go.
fn classify(edges: &mut [EdgeRow], tolerance: f64) -> Vec<EdgeClass> {
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by(|&a, &b| edges[a].length.total_cmp(&edges[b].length).then(a.cmp(&b)));
    let mut classes: Vec<EdgeClass> = Vec::new();
    let mut shortest = f64::NEG_INFINITY;
    for e in order {
        let length = edges[e].length;
        if length > shortest + 2.0 * tolerance {
            shortest = length;
            classes.push(EdgeClass { name: format!("E{}", classes.len() + 1), count: 0, length });
        }
        edges[e].class = classes.len() as u32 - 1;
        if let Some(class) = classes.last_mut() {
            class.count += 1;
            class.length = f64::midpoint(shortest, length);
        }
    }
    classes
}
