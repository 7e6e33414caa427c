//! The keywords of `quadloom.tile_surface` and `quadloom.PatchDesign`, and what they mean to the crate. Errors are sentences.

use crate::arrays;
use ::tiling::schedule::ScheduleOptions;
use ::tiling::{Along, Fill, PanelSize, Partition, ShapeOptions, SurfaceOptions};
use pyo3::prelude::*;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// What is tiled, and along what.
pub struct SurfaceKeywords<'py> {
    pub edge_length: Option<f64>,
    pub feature_edges: Option<Bound<'py, PyAny>>,
    pub target_panels: i64,
    pub corners: Option<Bound<'py, PyAny>>,
    pub feature_angle: f64,
    pub corner_angle: f64,
}

/// With what pattern, how shaped, and what is one type.
pub struct PanelKeywords {
    pub pattern: String,
    pub seed: u64,
    pub patch_panels: i64,
    pub shaping_rounds: i64,
    pub flattening_rounds: i64,
    pub closeness: f64,
    pub planarity: f64,
    pub fairness: f64,
    pub uniformity: f64,
    pub borders: String,
    pub features: String,
    pub type_tolerance: Option<f64>,
    pub mirror: bool,
}

impl SurfaceKeywords<'_> {
    /// The size, and the options of a surface of so many vertices; pattern and shape are the defaults.
    pub fn options(self, vertex_count: usize) -> Result<(PanelSize, SurfaceOptions), String> {
        let corners = self.corners.map_or(Ok(vec![]), |given| arrays::pairs(&given, "corners"))?;
        if let Some([vertex, c_index]) =
            corners.iter().find(|[v, c]| *v as usize >= vertex_count || !(2..=10).contains(c))
        {
            return Err(format!(
                "corners has the vertex {vertex} with the c-index {c_index}; vertices must be below {vertex_count} and c-indices 2 to 10"
            ));
        }
        let size = match self.edge_length {
            Some(length) => PanelSize::EdgeLength(length),
            None => PanelSize::Count(within("target_panels", self.target_panels, 1..=2_000_000)? as u32),
        };
        let options = SurfaceOptions {
            marked_edges: self.feature_edges.map_or(Ok(vec![]), |given| arrays::pairs(&given, "feature_edges"))?,
            feature_angle: angle("feature_angle", self.feature_angle)?,
            corner_angle: angle("corner_angle", self.corner_angle)?,
            partition: Partition::Paper,
            corners: corners.into_iter().map(|[vertex, c_index]| (vertex, c_index as u8)).collect(),
            ..SurfaceOptions::default()
        };
        Ok((size, options))
    }
}

impl PanelKeywords {
    /// The pattern, the shaping, and what is one type.
    pub fn options(&self) -> Result<(Fill, ShapeOptions, ScheduleOptions), String> {
        let Self { seed, closeness, mirror, .. } = *self;
        if !(1e-3..=1e3).contains(&closeness) {
            return Err(format!("closeness is {closeness}, but it must lie between 0.001 and 1000"));
        }
        let fill = match self.pattern.as_str() {
            "regular" => Fill::Regular,
            "fractured" => Fill::Fractured { seed },
            "symmetric" => Fill::Symmetric { seed },
            "random" => {
                Fill::Random { seed, patch_panels: within("patch_panels", self.patch_panels, 12..=200)? as usize }
            }
            other => {
                return Err(format!(
                    "pattern is \"{other}\"; it must be one of: regular, fractured, symmetric, random"
                ));
            }
        };
        let shape = ShapeOptions {
            rounds: within("shaping_rounds", self.shaping_rounds, 0..=1000)? as usize,
            flattening_rounds: within("flattening_rounds", self.flattening_rounds, 0..=1000)? as usize,
            closeness,
            planarity: weight("planarity", self.planarity)?,
            fairness: weight("fairness", self.fairness)?,
            uniformity: weight("uniformity", self.uniformity)?,
            borders: along("borders", &self.borders)?,
            features: along("features", &self.features)?,
        };
        Ok((fill, shape, ScheduleOptions { tolerance: self.type_tolerance, mirror }))
    }
}

fn within(name: &str, value: i64, range: RangeInclusive<i64>) -> Result<i64, String> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(format!("{name} is {value}, but it must lie between {} and {}", range.start(), range.end()))
}

fn angle(name: &str, value: f64) -> Result<f64, String> {
    if (0.0..=PI).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{name} is {value}, but it must lie between 0 and pi"))
    }
}

fn weight(name: &str, value: f64) -> Result<f64, String> {
    if (0.0..=1e3).contains(&value) {
        return Ok(value);
    }
    Err(format!("{name} is {value}, but it must lie between 0 and 1000"))
}

fn along(name: &str, value: &str) -> Result<Along, String> {
    match value {
        "slide" => Ok(Along::Slide),
        "keep" => Ok(Along::Keep),
        _ => Err(format!("{name} is \"{value}\"; it must be one of: slide, keep")),
    }
}
