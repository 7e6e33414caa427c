//! The keywords of `quadloom.retopologize` and `quadloom.RetopologySession`, and what they mean to the crate.

use crate::arrays;
use ::retopology::build::BaseOptions;
use ::retopology::detect::DetectOptions;
use ::retopology::features::Features;
use ::retopology::symmetry::{Plane, Symmetry};
use ::retopology::{Catalogue, LayoutOptions, Options, Pairing, Size, TemplateChoice, TemplatePlace};
use mesh::DVec3;
use pyo3::prelude::*;

/// The features given, none for None.
pub fn to_features(edges: Option<Bound<'_, PyAny>>, vertices: Option<Bound<'_, PyAny>>) -> Result<Features, String> {
    Ok(Features {
        edges: edges.map_or(Ok(vec![]), |given| arrays::pairs(&given, "feature_edges"))?,
        vertices: vertices.map_or(Ok(vec![]), |given| arrays::indices(&given, "feature_verts"))?,
    })
}

/// The options by their Python names.
pub struct Keywords<'py> {
    pub target_faces: i64,
    pub edge_length: Option<f64>,
    pub density: Option<Bound<'py, PyAny>>,
    pub detect: bool,
    pub detect_angle: f64,
    pub detect_continue_angle: f64,
    pub detect_length: f64,
    pub corner_angle: f64,
    pub base_vertices: i64,
    pub coarseness: f64,
    pub pairing: String,
    pub improve: bool,
    pub symmetry: Option<Bound<'py, PyAny>>,
    pub symmetry_tolerance: f64,
    pub templates: Option<Bound<'py, PyAny>>,
    pub catalogue: Option<String>,
}

impl Keywords<'_> {
    /// The options of the crate.
    pub fn options(self) -> Result<Options, String> {
        let density = self.density.map_or(Ok(vec![]), |given| arrays::numbers(&given, "density"))?;
        if density.iter().any(|d| !(*d > 0.0 && d.is_finite())) {
            return Err("density must be a positive number at every vertex".into());
        }
        if !(0.0..=1.0).contains(&self.coarseness) {
            return Err(format!("coarseness is {}, but it must lie between 0 and 1", self.coarseness));
        }
        let pairing = match self.pairing.as_str() {
            "valence" => Pairing::default(),
            "matching" => Pairing::PAPER,
            other => return Err(format!("pairing is \"{other}\"; it must be one of: valence, matching")),
        };
        let detection = DetectOptions {
            start_angle: self.detect_angle,
            continue_angle: self.detect_continue_angle,
            min_length: self.detect_length,
        };
        let mut catalogue = Catalogue::default();
        if let Some(text) = &self.catalogue {
            let own = Catalogue::from_json(text).map_err(|error| error.to_string())?;
            // A file may begin as a copy of the built-in one.
            let fresh = own.templates.into_iter().filter(|template| !catalogue.templates.contains(template)).collect();
            catalogue.extend(Catalogue { templates: fresh }).map_err(|error| error.to_string())?;
        }
        let tolerance = self.symmetry_tolerance;
        let symmetry = self.symmetry.map(|given| plane(&given)).transpose()?;
        Ok(Options {
            base: BaseOptions {
                vertices: whole(self.base_vertices),
                corner_angle: self.corner_angle,
                detect: self.detect.then_some(detection),
                ..BaseOptions::default()
            },
            layout: LayoutOptions {
                size: self.edge_length.map_or(Size::TargetFaces(whole(self.target_faces) as usize), Size::EdgeLength),
                density: density.iter().map(|d| d.recip()).collect(),
                pairing,
                irregularity: irregularity(self.coarseness),
                catalogue,
                improve: self.improve,
                ..LayoutOptions::default()
            },
            symmetry: symmetry.map(|plane| Symmetry { plane, tolerance }),
            templates: self.templates.map_or(Ok(vec![]), |given| places(&given))?,
        })
    }
}

/// "x", "y", "z", or a point and a normal.
fn plane(given: &Bound<'_, PyAny>) -> Result<Plane, String> {
    let bad = || "symmetry must be \"x\", \"y\", \"z\" or a pair (point, normal) of three numbers each".to_owned();
    if let Ok(axis) = given.extract::<String>() {
        let axes = [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)];
        let found = axes.iter().find(|(name, _)| axis.eq_ignore_ascii_case(name));
        return found.map(|&(_, normal)| Plane { point: DVec3::ZERO, normal }).ok_or_else(bad);
    }
    let [point, normal]: [[f64; 3]; 2] = given.extract().map_err(|_| bad())?;
    Ok(Plane { point: point.into(), normal: normal.into() })
}

/// Templates and where they go.
pub fn places(given: &Bound<'_, PyAny>) -> Result<Vec<(TemplatePlace, TemplateChoice)>, String> {
    let bad = |_| {
        "templates must be pairs (place, name) or triples (place, name, turn); a place is a base edge or a point (x, y, z)".to_owned()
    };
    let one = |entry: PyResult<Bound<'_, PyAny>>| {
        let entry = entry.map_err(bad)?;
        let (place, template, turn): (Bound<'_, PyAny>, String, usize) =
            entry.extract().or_else(|_| entry.extract().map(|(place, name)| (place, name, 0))).map_err(bad)?;
        let place = match place.extract::<u32>() {
            Ok(edge) => TemplatePlace::Edge(edge),
            Err(_) => TemplatePlace::Point(place.extract::<[f64; 3]>().map_err(bad)?.into()),
        };
        Ok((place, TemplateChoice { template, turn }))
    };
    given.try_iter().map_err(bad)?.map(one).collect()
}

/// Out of range is out of range: the crate says so.
fn whole(number: i64) -> u32 {
    u32::try_from(number.max(0)).unwrap_or(u32::MAX)
}

/// What a patch of unequal sides costs: 0.2 stretched quads for even lengths, 20 in the middle, any number for the coarsest.
fn irregularity(coarseness: f64) -> f64 {
    if coarseness < 1.0 { 20.0 * 10_f64.powf(4.0 * (coarseness - 0.5)) } else { f64::INFINITY }
}
