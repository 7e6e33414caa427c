//! The stages up to the band, for tests of the stages that follow.

use crate::band::{self, Band};
use crate::intersect::{Cut, Input, intersect};
use crate::plan::mean_curve_length;
use crate::polychord::Strips;
use crate::retract::{Kept, retract};
use crate::{Operation, Options};
use mesh::{Aabb, Monitor, PolygonMesh};

/// What the stages before the plan have made of two meshes.
pub struct TestSetting<'a> {
    pub inputs: [Input<'a>; 2],
    pub cut: Cut,
    pub kept: Kept,
    pub band: Band,
    pub diagonal: f64,
}

impl<'a> TestSetting<'a> {
    /// Runs them with the default options.
    pub fn new(a: &'a PolygonMesh, b: &'a PolygonMesh, operation: Operation) -> Self {
        let (options, monitor) = (Options::default(), Monitor::new());
        let inputs = [Input::new(a), Input::new(b)];
        let cut = intersect(&inputs, operation, &monitor).expect("a result");
        let curve_edge = mean_curve_length(&inputs, &cut);
        let kept = retract(&inputs, &cut, 1.0, curve_edge, &options, &monitor).expect("not cancelled");
        let band = band::extract(&inputs, &cut, &kept, &Strips::default(), &options);
        let diagonal = Aabb::of(cut.surface.positions.iter().copied()).diagonal();
        Self { inputs, cut, kept, band, diagonal }
    }
}
