//! The charts of a surface: its parts between features, each with its own closest points.
//!
//! A vertex is put back on the chart it belongs to, never on the other side of a thin plate or of a crease.

use crate::base::Base;
use crate::error::LayoutError;
use crate::measures::Measures;
use mesh::DVec3;
use mesh::{NONE, TriangleMesh};
use rayon::prelude::*;
use solve::components::connected_components;
use surface::closest::{ClosestPoint, Projection};
use surface::smooth_star::{Reference, SurfacePoint};

/// Connected base triangles that no feature separates.
#[derive(Debug)]
pub(crate) struct Chart {
    closest: ClosestPoint,
    normals: Vec<DVec3>,
    /// Triangle of the whole surface for each one here.
    triangles: Vec<u32>,
}

/// What quads are laid over: a base triangulation with all that follows from it.
#[derive(Debug)]
pub(crate) struct Ground<'a> {
    pub base: &'a Base,
    pub measures: Measures,
    pub charts: Vec<Chart>,
    /// The chart of each base triangle.
    pub chart_of: Vec<u32>,
}

impl<'a> Ground<'a> {
    /// O(n log n) in the surface's triangles.
    ///
    /// # Errors
    /// [`LayoutError::BadBase`].
    pub fn new(base: &'a Base) -> Result<Self, LayoutError> {
        let measures = Measures::new(base)?;
        let (charts, chart_of) = charts(base, &measures);
        Ok(Self { base, measures, charts, chart_of })
    }
}

/// All charts, and the chart of each base triangle.
fn charts(base: &Base, measures: &Measures) -> (Vec<Chart>, Vec<u32>) {
    let joined = (0..measures.twins.len()).filter_map(|h| {
        let rail = measures.rails[base.triangle_edges[h / 3][h % 3] as usize];
        (!rail && measures.twins[h] != NONE).then(|| (h as u32 / 3, measures.twins[h] / 3))
    });
    let groups = connected_components(base.triangles.len(), joined);
    let mut chart_of = vec![0; base.triangles.len()];
    for (chart, group) in groups.iter().enumerate() {
        for &t in group {
            chart_of[t as usize] = chart as u32;
        }
    }
    let charts = groups
        .into_par_iter()
        .map(|group| {
            let triangles: Vec<u32> = group.iter().flat_map(|&t| measures.pieces[t as usize].iter().copied()).collect();
            // Only the corners of its triangles matter to the tree.
            let mut piece = TriangleMesh::default();
            for &t in &triangles {
                let first = piece.positions.len() as u32;
                piece.positions.extend(base.surface.points(t as usize));
                piece.triangles.push([first, first + 1, first + 2]);
            }
            let normals = triangles.iter().map(|&t| base.surface.area_normal(t as usize).normalize_or_zero()).collect();
            Chart { closest: ClosestPoint::new(&piece), normals, triangles }
        })
        .collect();
    (charts, chart_of)
}

impl Chart {
    /// The nearest point of the chart, its triangle as one of the whole surface.
    pub fn find(&self, point: DVec3) -> Projection {
        let found = self.closest.project(point);
        Projection { triangle: self.triangles.get(found.triangle as usize).copied().unwrap_or(NONE), ..found }
    }

    fn found(&self, found: Projection, under: &mut u32) -> SurfacePoint {
        *under = found.triangle;
        let normal = self.normals.get(found.triangle as usize).copied().unwrap_or(DVec3::Z);
        SurfacePoint { point: found.point, normal }
    }
}

impl Reference for Chart {
    fn project_near(&self, point: DVec3, under: &mut u32) -> SurfacePoint {
        self.found(self.closest.project_near(point, *under), under)
    }

    fn project_surely(&self, point: DVec3, under: &mut u32) -> Option<SurfacePoint> {
        let found = self.closest.project_surely(point, *under)?;
        Some(self.found(found, under))
    }

    fn project_facing(&self, point: DVec3, facing: DVec3, under: &mut u32) -> SurfacePoint {
        match self.closest.project_facing(point, facing, *under) {
            Some(found) => self.found(found, under),
            None => self.project_near(point, under),
        }
    }
}
