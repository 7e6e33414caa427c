//! The paper's filler: traced patches of three to six sides, an integer programme for the counts, a pattern in each patch.
//!
//! `QuadMixer` (Nuvoli et al. 2019), sections 3.2.1, 3.3 and 3.5. The region's surface is remeshed finer than the quads, so
//! that traces have room; it is then divided along a cross field, and each trace gets the count that fits its neighbours
//! best. Vertices along a trace are shared by the patches on both sides, by index.
//!
//! Deviations: the counts of a region with many traces are rounded and repaired instead of optimal, and of the patterns
//! that fit a patch the one with the best quads is taken once it lies on the surface. Declines a region that no set of
//! traces divides, or whose patch cannot be laid flat without folding.

use super::matching::because;
use super::{Declined, Fill, Region};
use glam::DVec2;
use mesh::{DVec3, Monitor, TriangleMesh, scaled_jacobian};
use quadrangulate::layout::{LayoutOptions, PatchLayout, SubSideKind, trace_layout};
use quadrangulate::quantise::{self, quantise};
use quadrangulate::{DiskSurface, Filler, Method, place};
use std::collections::BTreeMap;
use surface::closest::ClosestPoint;
use surface::parametrize::lscm;
use surface::remesh::{RemeshOptions, remesh};
use surface::smooth_star::Reference;

/// Edge length of the triangles that are traced, in target edge lengths. The second is for regions where no trace is found
/// among the first, since it costs twice the time.
const TRIANGLE_EDGES: [f64; 2] = [0.7, 0.45];

/// Regions that need more quads are declined: tracing costs more than linear time.
const MOST_QUADS: f64 = 2000.0;

/// A fill with this many times the quads wanted, and some, is declined: opposite sides of its patches have counts so
/// different that what is between them is all transitions.
const MOST_EXCESS: f64 = 3.0;

/// Layouts with more free counts get rounded ones: a proof of the best takes longer than it is worth.
const MOST_FREE_COUNTS: usize = 8;

/// Patterns tried in a patch.
const MOST_PATTERNS: usize = 4;

/// No more patterns are tried in a patch once those tried have so many quads together.
const MOST_TRIED: usize = 500;

/// The first pattern whose worst quad has this scaled Jacobian is taken.
const GOOD_JACOBIAN: f64 = 0.6;

/// Fills a region. `alpha` is the share of even edge lengths against regular patches, between 0 and 1. Costs about
/// O(n^1.5 log n) for the tracing of n triangles.
///
/// # Errors
/// [`Declined`] with the step that failed.
pub fn fill(region: &Region, scale: f64, alpha: f64, monitor: &Monitor) -> Result<Fill, Declined> {
    let size: Vec<f64> = region.size.iter().map(|s| s * scale).collect();
    let quads = region.expected_quads() / (scale * scale);
    if quads > MOST_QUADS {
        return Err(Declined::Because(format!("about {quads:.0} quads are too many for traces")));
    }
    let (layout, vertex) = match divide(region, &size, TRIANGLE_EDGES[0], monitor) {
        Err(Declined::Because(_)) => divide(region, &size, TRIANGLE_EDGES[1], monitor)?,
        other => other?,
    };
    let counts = counts(&layout, region, &size, alpha, monitor)?;

    // Rim vertices keep their numbers.
    let number: BTreeMap<u32, u32> = (0..region.rim_count).map(|k| (vertex[k], k as u32)).collect();
    let most = (MOST_EXCESS * quads) as usize + 20;
    let mut build = Build { region, layout: &layout, number, fill: Fill::default(), filler: Filler::new(), most };
    let paths: Vec<Vec<u32>> = (0..counts.len()).map(|s| build.path(s, counts[s])).collect::<Result<_, _>>()?;
    for patch in 0..layout.patches.len() {
        build.patch(patch, &paths, monitor)?;
    }
    Ok(build.fill)
}

/// Remeshes the region and traces patches (section 3.2.1). Also the layout's vertex of each vertex of the region.
fn divide(region: &Region, size: &[f64], edge: f64, monitor: &Monitor) -> Result<(PatchLayout, Vec<u32>), Declined> {
    let fine: Vec<f64> = size.iter().map(|s| s * edge).collect();
    let made = remesh(&region.surface, &region.inner_lines, &fine, &RemeshOptions::default(), monitor)
        .map_err(|e| because(monitor, &e))?;
    let lines: Vec<[u32; 2]> = region.inner_lines.iter().map(|l| l.map(|v| made.vertex[v as usize])).collect();
    // The triangles are small enough as they are; halving them would put vertices on the lines.
    let options = LayoutOptions { refinements: 0, ..LayoutOptions::default() };
    let layout = trace_layout(&made.mesh, &lines, &options, monitor).map_err(|e| because(monitor, &e))?;
    Ok((layout, made.vertex))
}

/// How many quads go along each sub-side (section 3.3).
fn counts(
    layout: &PatchLayout,
    region: &Region,
    size: &[f64],
    alpha: f64,
    monitor: &Monitor,
) -> Result<Vec<u32>, Declined> {
    let closest = ClosestPoint::new(&region.surface);
    let size_at = |p: DVec3| {
        let hit = closest.project(p);
        let corners = region.surface.triangles[hit.triangle as usize];
        (0..3).map(|k| hit.barycentric[k] * size[corners[k] as usize]).sum::<f64>()
    };
    let at = |v: u32| layout.mesh.positions[v as usize];
    let sub_sides = layout.sub_sides.iter().map(|sub_side| {
        let steps = sub_side.vertices.windows(2).map(|w| [at(w[0]), at(w[1])]);
        quantise::SubSide {
            ideal: steps.map(|[a, b]| a.distance(b) / size_at(a.midpoint(b))).sum(),
            // The vertices of lines are given, as those of the border are.
            fixed: (sub_side.kind != SubSideKind::Trace).then(|| sub_side.vertices.len() as u32 - 1),
            least: 1,
            weight: 1.0,
        }
    });
    let problem = quantise::Layout {
        sub_sides: sub_sides.collect(),
        patches: layout.patches.iter().map(|p| quantise::Patch { sides: p.sides.clone() }).collect(),
    };
    let options = quantise::Options { alpha, most_variables: MOST_FREE_COUNTS, ..quantise::Options::default() };
    let found = quantise(&problem, &options, &|| monitor.is_cancelled()).map_err(|e| because(monitor, &e))?;
    Ok(found.counts)
}

/// A fill in the making.
struct Build<'a> {
    region: &'a Region,
    layout: &'a PatchLayout,
    /// Output vertex of the layout's vertices that have one.
    number: BTreeMap<u32, u32>,
    fill: Fill,
    filler: Filler,
    /// Most quads.
    most: usize,
}

impl Build<'_> {
    fn position(&self, v: u32) -> DVec3 {
        match (v as usize).checked_sub(self.region.rim_count) {
            Some(new) => self.fill.positions[new],
            None => self.region.surface.positions[v as usize],
        }
    }

    fn add(&mut self, position: DVec3) -> u32 {
        self.fill.positions.push(position);
        (self.region.rim_count + self.fill.positions.len() - 1) as u32
    }

    /// The output vertices along a sub-side, both ends included: evenly spaced along a trace, given on border and lines.
    fn path(&mut self, sub_side: usize, count: u32) -> Result<Vec<u32>, Declined> {
        let layout = self.layout;
        let sub_side = &layout.sub_sides[sub_side];
        let at = |v: u32| layout.mesh.positions[v as usize];
        if sub_side.kind != SubSideKind::Trace {
            let given = sub_side.vertices.iter().map(|v| self.number.get(v).copied()).collect::<Option<Vec<u32>>>();
            return given.ok_or_else(|| Declined::Because("a line or border got a vertex that is not its own".into()));
        }
        let [first, last] = [sub_side.vertices[0], sub_side.vertices[sub_side.vertices.len() - 1]].map(|v| {
            self.number.get(&v).copied().unwrap_or_else(|| {
                let new = self.add(at(v));
                self.number.insert(v, new);
                new
            })
        });
        let mut path = vec![first];
        let step = sub_side.length / f64::from(count);
        let mut passed = 0.0;
        for w in sub_side.vertices.windows(2) {
            let [a, b] = [at(w[0]), at(w[1])];
            let length = a.distance(b);
            while path.len() < count as usize && path.len() as f64 * step <= passed + length {
                let new = self.add(a.lerp(b, (path.len() as f64 * step - passed) / length));
                path.push(new);
            }
            passed += length;
        }
        path.push(last);
        Ok(path)
    }

    /// Fills one patch between its paths (section 3.5).
    fn patch(&mut self, patch: usize, paths: &[Vec<u32>], monitor: &Monitor) -> Result<(), Declined> {
        let surface = Disk::of(self.layout, patch);
        let mut border: Vec<u32> = Vec::new();
        let mut sides: Vec<u32> = Vec::new();
        let mut from = self.layout.patches[patch].corners[0];
        for side in &self.layout.patches[patch].sides {
            let start = border.len();
            for &sub_side in side {
                let along = &self.layout.sub_sides[sub_side as usize].vertices;
                let path = &paths[sub_side as usize];
                if along[0] == from {
                    border.extend(&path[..path.len() - 1]);
                    from = along[along.len() - 1];
                } else {
                    border.extend(path[1..].iter().rev());
                    from = along[0];
                }
            }
            sides.push((border.len() - start) as u32);
        }
        let rim: Vec<DVec3> = border.iter().map(|&v| self.position(v)).collect();
        let mut candidates = self
            .filler
            .candidates_with_angles(&sides, &surface.corner_angles(), MOST_PATTERNS)
            .map_err(|e| because(monitor, &e))?;
        if candidates.iter().any(|c| c.method == Method::Flattened) {
            // One quad at a blunt corner may still be better than two: in a slanted strip, for instance.
            candidates.extend(self.filler.candidates(&sides, MOST_PATTERNS).map_err(|e| because(monitor, &e))?);
        }
        let least = candidates.iter().map(|c| c.quads.len()).min().unwrap_or(0);
        if self.fill.quads.len() + least > self.most {
            let reason = format!("the side counts {sides:?} of a patch ask for {least} quads, too many for its area");
            return Err(Declined::Because(reason));
        }
        let flat = surface.flat();
        let mut best: Option<(f64, Vec<[u32; 4]>, Vec<DVec3>)> = None;
        let mut tried = 0;
        for filling in candidates {
            let mut points = place(&filling, &sides, &rim, &surface.borrow(), flat.as_deref(), monitor)
                .map_err(|e| because(monitor, &e))?;
            for point in &mut points[rim.len()..] {
                *point = self.region.under.project(*point).point;
            }
            let jacobians = filling.quads.iter().map(|q| scaled_jacobian(q.map(|v| points[v as usize])));
            let (worst, sum) = jacobians.fold((1.0_f64, 0.0), |(worst, sum), j| (worst.min(j), sum + j));
            // Irregular vertices bend the quads round them more than the flat map shows.
            let score = worst + sum / filling.quads.len() as f64 - 0.1 * f64::from(filling.cost.valence_excess);
            tried += filling.quads.len();
            if best.as_ref().is_none_or(|(found, ..)| score > *found) {
                best = Some((score, filling.quads, points));
            }
            if worst > GOOD_JACOBIAN || tried > MOST_TRIED {
                break;
            }
        }
        let Some((_, quads, points)) = best else {
            return Err(Declined::Because(format!("no pattern fills a patch with the side counts {sides:?}")));
        };
        let mut vertex = border;
        for &point in &points[vertex.len()..] {
            vertex.push(self.add(point));
        }
        self.fill.quads.extend(quads.iter().map(|q| q.map(|v| vertex[v as usize])));
        Ok(())
    }
}

/// A patch's surface by itself.
struct Disk {
    mesh: TriangleMesh,
    border: Vec<u32>,
    corners: Vec<usize>,
}

impl Disk {
    fn of(layout: &PatchLayout, patch: usize) -> Self {
        let mut local: BTreeMap<u32, u32> = BTreeMap::new();
        let mut mesh = TriangleMesh::default();
        for &t in &layout.patches[patch].triangles {
            mesh.triangles.push(layout.mesh.triangles[t as usize].map(|v| {
                *local.entry(v).or_insert_with(|| {
                    mesh.positions.push(layout.mesh.positions[v as usize]);
                    mesh.positions.len() as u32 - 1
                })
            }));
        }
        let (mut border, mut corners) = (Vec::new(), Vec::new());
        for side in 0..layout.patches[patch].sides.len() {
            corners.push(border.len());
            let path = layout.side_path(patch, side);
            border.extend(path[..path.len() - 1].iter().map(|v| local[v]));
        }
        Self { mesh, border, corners }
    }

    fn borrow(&self) -> DiskSurface<'_> {
        DiskSurface {
            positions: &self.mesh.positions,
            triangles: &self.mesh.triangles,
            border: &self.border,
            corners: &self.corners,
        }
    }

    /// Interior angle at each corner, measured on the surface, radians.
    fn corner_angles(&self) -> Vec<f64> {
        let mut angle = vec![0.0; self.mesh.positions.len()];
        for (t, triangle) in self.mesh.triangles.iter().enumerate() {
            let p = self.mesh.points(t);
            for k in 0..3 {
                angle[triangle[k] as usize] += (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
            }
        }
        self.corners.iter().map(|&k| angle[self.border[k] as usize]).collect()
    }

    /// A conformal map, pinned at corner 0 and the border vertex farthest from it. `None` when it folds: the quads are then
    /// left as the polygon places them, and smoothing gets them square.
    fn flat(&self) -> Option<Vec<DVec2>> {
        let at = |v: u32| self.mesh.positions[v as usize];
        let first = self.border[0];
        let away = |v: u32| at(v).distance(at(first));
        let far = self.border.iter().copied().max_by(|&a, &b| away(a).total_cmp(&away(b)))?;
        let map = lscm(&self.mesh, &[(first, DVec2::ZERO), (far, DVec2::new(away(far), 0.0))]).ok()?;
        map.flipped().is_empty().then_some(map.uv)
    }
}

#[cfg(test)]
#[path = "patches_tests.rs"]
mod tests;
