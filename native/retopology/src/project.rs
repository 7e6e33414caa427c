//! A surface under work: its features, its base triangulation and its quads, kept between edits of the features.
//!
//! The editing loop of Daniels et al. 2011, section 7, whose authors start over after each edit. What a first run makes, with or
//! without a plane of symmetry, is what [`crate::retopologize`] makes; see [`crate::session`] for what an edit keeps.

use crate::detect::sharp_edges;
use crate::failure::{Elements, RetopologizeError};
use crate::features::Features;
use crate::harmonic::harmonic;
use crate::inspect::{edges_of, inspect_features};
use crate::output::{BasePath, FeatureKind, Output};
use crate::pipeline::{Clock, Options, Tuning, Workpiece, at_unit_size, warnings};
use crate::quads::LayoutOptions;
use crate::session::EditReport;
use crate::symmetry::Mirror;
use crate::templates::{TemplateChoice, TemplatePlace};
use crate::{Size, build::BaseOptions};
use mesh::{Monitor, PolygonMesh, Topology, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::inspect::{inspect, inspect_vertices};
use surface::triangulate::Triangulated;

/// How many times as many quads are tried where a symmetric surface is narrow.
const GROWTHS: [f64; 5] = [1.0, 1.04, 1.15, 1.4, 2.0];

/// A surface whose features can be edited.
#[derive(Debug)]
pub struct Project {
    mesh: PolygonMesh,
    options: Options,
    marks: Marks,
    /// The half that is worked on, and the whole as triangles in the unit box; none without symmetry.
    mirror: Option<(Mirror, Triangulated)>,
    piece: Workpiece,
    /// What the last edit did; none before the first.
    edit: Option<EditReport>,
    /// Of reading the surface.
    clock: Clock,
}

/// All features of a mesh and why they are.
#[derive(Debug, Default)]
struct Marks {
    /// The caller's, as given.
    given: Features,
    /// Those and the detected ones.
    all: Features,
    kinds: BTreeMap<[u32; 2], FeatureKind>,
    detected: usize,
}

impl Project {
    /// Reads a surface and makes its base triangulation.
    ///
    /// # Errors
    /// As [`crate::retopologize`].
    pub fn new(
        mesh: PolygonMesh,
        features: &Features,
        options: &Options,
        monitor: &Monitor,
    ) -> Result<Self, RetopologizeError> {
        let mut clock = Clock::new();
        monitor.stage("checking the mesh", 0.0)?;
        inspect(&mesh)?;
        inspect_vertices(&mesh)?;
        let given = &options.layout.density;
        if !given.is_empty() && given.len() != mesh.vertex_count() {
            return Err(RetopologizeError::Option(format!(
                "density has {} values; it must have one for each of the {} vertices",
                given.len(),
                mesh.vertex_count()
            )));
        }
        clock.lap("check");
        monitor.check()?;
        let (input, placement) = at_unit_size(&mesh);
        clock.lap("triangulate");
        let marks = Marks::read(&mesh, &input, features, options)?;
        clock.lap("detect");
        let build = |mesh: PolygonMesh, unit, features: &Features, options: &Options| {
            monitor.within(0.02, 0.45, || Workpiece::new(mesh, unit, features, options, monitor))
        };
        let (mirror, piece) = if let Some(symmetry) = options.symmetry {
            let mirror = Mirror::new(&mesh, (&input, placement), &marks.given, symmetry, monitor)?;
            clock.lap("mirror");
            let options = halved(options, &mirror, &input);
            let half = mirror.mesh.clone();
            let piece = build(half, at_unit_size(&mirror.mesh), &mirror.features(&marks.all), &options)?;
            (Some((mirror, input)), piece)
        } else {
            (None, build(mesh.clone(), (input, placement), &marks.all, options)?)
        };
        Ok(Self { mesh, options: options.clone(), marks, mirror, piece, edit: None, clock })
    }

    /// The features as they were given last.
    pub fn features(&self) -> &Features {
        &self.marks.given
    }

    /// Makes these the features. Only the base triangles about what differs are made anew where that is possible: the base then
    /// depends on the order of edits, but keeps every promise. After an error nothing has changed.
    ///
    /// # Errors
    /// As [`crate::retopologize`].
    pub fn set_features(&mut self, features: &Features, monitor: &Monitor) -> Result<EditReport, RetopologizeError> {
        let marks = if let Some((mirror, input)) = &self.mirror {
            let marks = Marks::read(&self.mesh, input, features, &self.options)?;
            mirror.compare_marks(&marks.given)?;
            marks
        } else {
            Marks::read(&self.mesh, self.piece.input(), features, &self.options)?
        };
        let half = self.mirror.as_ref().map(|(mirror, _)| mirror.features(&marks.all));
        let edit = self.piece.set_features(half.as_ref().unwrap_or(&marks.all), monitor)?;
        self.marks = marks;
        if edit != EditReport::default() {
            self.edit = Some(edit.clone());
        }
        Ok(edit)
    }

    /// The base triangulation as a mesh, and its edges as they lie on the surface: of the kept half when there is a plane of
    /// symmetry.
    ///
    /// # Errors
    /// [`RetopologizeError::Internal`].
    pub fn base(&self) -> Result<(PolygonMesh, Vec<BasePath>), RetopologizeError> {
        self.piece.base()
    }

    /// Chooses templates in place of those before. The base triangulation stays.
    pub fn set_templates(&mut self, templates: Vec<(TemplatePlace, TemplateChoice)>) {
        self.options.templates = templates;
    }

    /// The quads.
    ///
    /// # Errors
    /// As [`crate::retopologize`].
    pub fn quads(&self, monitor: &Monitor) -> Result<Output, RetopologizeError> {
        self.quads_after(None, monitor)
    }

    /// The quads for a first look: patches and counts as they will be, vertices hardly moved from where the maps put them.
    ///
    /// # Errors
    /// As [`crate::retopologize`].
    pub fn draft(&self, monitor: &Monitor) -> Result<Output, RetopologizeError> {
        self.quads_after(Some(0), monitor)
    }

    fn quads_after(&self, rounds: Option<usize>, monitor: &Monitor) -> Result<Output, RetopologizeError> {
        let mut clock = self.clock.resumed();
        clock.add(self.piece.session().seconds());
        let Marks { all, kinds, detected, .. } = &self.marks;
        let mut output = if let Some((mirror, input)) = &self.mirror {
            let cut = mirror.cut(all);
            let made = self.half(mirror, &cut, rounds, &mut clock, monitor)?;
            mirror.doubled(made, input, all, &cut, kinds)?
        } else {
            self.half_or_whole(kinds, &BTreeSet::new(), Tuning { rounds, growth: 1.0 }, &mut clock, monitor)?
        };
        clock.lap("mirror");
        let report = &mut output.report;
        report.edges_detected = *detected;
        if let Size::TargetFaces(target) = self.options.layout.size {
            report.target = Some(target);
        }
        report.base_triangles_edited = self.edit.as_ref().filter(|edit| !edit.whole).map(|edit| edit.added);
        report.warnings = warnings(report);
        report.seconds = clock.seconds();
        Ok(output)
    }

    /// The harmonic field of a feature for display, at every vertex of the mesh: 1 on its edges and vertices, 0 on all other
    /// features and base vertices that are vertices of the mesh. One factorisation: 0.1 s for
    /// 25,000 vertices.
    ///
    /// # Errors
    /// [`RetopologizeError`]: what is given is no edge or vertex of the surface; cancelled.
    pub fn field(&self, feature: &Features, monitor: &Monitor) -> Result<Vec<f64>, RetopologizeError> {
        inspect_features(&self.mesh, feature)?;
        let input = self.mirror.as_ref().map_or_else(|| self.piece.input(), |(_, input)| input);
        let topology = Topology::of_triangles(&input.mesh);
        let mut values = vec![None; input.mesh.positions.len()];
        let on_whole = |v: u32| match &self.mirror {
            Some((mirror, _)) => mirror.input_vertex(v),
            None => ((v as usize) < values.len()).then_some(v),
        };
        let base: Vec<u32> = self.piece.session().base().vertices.iter().filter_map(|&v| on_whole(v)).collect();
        let borders = (0..topology.len() as u32).filter(|&h| topology.is_border(h)).map(|h| topology.from(h));
        let features = self.marks.all.edges.iter().flatten().chain(&self.marks.all.vertices).copied();
        base.into_iter().chain(borders).chain(features).for_each(|v| values[v as usize] = Some(0.0));
        feature.edges.iter().flatten().chain(&feature.vertices).for_each(|&v| values[v as usize] = Some(1.0));
        let mut field = harmonic(&input.mesh, &topology, &values, monitor)?;
        field.truncate(self.mesh.vertex_count());
        Ok(field)
    }

    /// The quads of the half; with more of them where an edge would otherwise span the surface from plane to plane, and would be
    /// one with its mirror image.
    fn half(
        &self,
        mirror: &Mirror,
        cut: &BTreeSet<[u32; 2]>,
        rounds: Option<usize>,
        clock: &mut Clock,
        monitor: &Monitor,
    ) -> Result<Output, RetopologizeError> {
        let mut spans = 0;
        for growth in GROWTHS {
            let made = self.half_or_whole(&BTreeMap::new(), cut, Tuning { rounds, growth }, clock, monitor)?;
            spans = mirror.spans(&made);
            if spans == 0 {
                return Ok(made);
            }
        }
        Err(RetopologizeError::Invalid {
            code: "too_narrow",
            sentence: format!(
                "is too narrow beside the plane of symmetry for quads of this size: {spans} edges would be one with their mirror images; ask for smaller quads"
            ),
            elements: Elements::new(),
        })
    }

    fn half_or_whole(
        &self,
        kinds: &BTreeMap<[u32; 2], FeatureKind>,
        cut: &BTreeSet<[u32; 2]>,
        tuning: Tuning,
        clock: &mut Clock,
        monitor: &Monitor,
    ) -> Result<Output, RetopologizeError> {
        let mut templates = self.options.templates.clone();
        if let Some((mirror, _)) = &self.mirror {
            for (place, _) in &mut templates {
                *place = mirror.on_kept_side(*place);
            }
        }
        monitor.within(0.45, 1.0, || self.piece.quads(kinds, cut, &templates, tuning, clock, monitor))
    }
}

impl Marks {
    /// Checks what is marked, and detects what else there is.
    fn read(
        mesh: &PolygonMesh,
        input: &Triangulated,
        features: &Features,
        options: &Options,
    ) -> Result<Self, RetopologizeError> {
        let marked = inspect_features(mesh, features)?;
        let kinds = marked.into_iter().map(|edge| (edge, FeatureKind::Marked)).collect();
        let mut marks = Self { given: features.clone(), all: features.clone(), kinds, detected: 0 };
        if let Some(detection) = &options.base.detect {
            let topology = Topology::of_triangles(&input.mesh);
            // Diagonals of bent quads may be as sharp as an edge, but are none.
            let edges = edges_of(mesh);
            for edge in sharp_edges(&input.mesh, &topology, &features.edges, detection)? {
                let edge = sorted(edge[0], edge[1]);
                if edges.binary_search(&edge).is_ok() {
                    marks.kinds.insert(edge, FeatureKind::Detected);
                    marks.all.edges.push(edge);
                    marks.detected += 1;
                }
            }
        }
        Ok(marks)
    }
}

/// Options for the kept half: half of all numbers; lengths that are relative to the whole as they were.
fn halved(options: &Options, mirror: &Mirror, input: &Triangulated) -> Options {
    let (base, layout) = (&options.base, &options.layout);
    Options {
        base: BaseOptions { vertices: base.vertices.div_ceil(2).max(4), detect: None, ..base.clone() },
        layout: LayoutOptions {
            size: if let Size::TargetFaces(faces) = layout.size {
                Size::TargetFaces(faces.div_ceil(2))
            } else {
                layout.size
            },
            density: mirror.interpolated(&input.spread(&layout.density)),
            chord_error: layout.chord_error * mirror.larger,
            ..layout.clone()
        },
        symmetry: None,
        templates: vec![],
    }
}
