//! Optimising the shape of quads on a surface: untangle, round, then lift the worst.
//!
//! Follows Daniels et al., "Template-based quadrilateral meshing", 2011, section 6: move in the tangent plane, reproject,
//! halve steps that would invert. Deviation: instead of a Laplacian, each vertex minimises the barrier energy of
//! [`crate::smooth_star`], and the vertices of bad quads then maximise the worst quality around them. Vertices are
//! visited in groups without a common quad, so that those of a group can move at once and the result does not depend on threads; the
//! vertices of bad quads one after another, worst first.

use crate::smooth_star::{Goal, Polyline, Reference, Star, SurfacePoint, Track, quad_quality};
use glam::DVec3;
use mesh::{Cancelled, Monitor, NONE};
use rayon::prelude::*;

/// What a vertex may do while its mesh is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// Stays exactly where it is.
    Fixed,
    /// Slides along a chain: an index into [`Patch::chains`].
    OnChain(u32),
    /// Moves on the reference surface of the quads around it.
    Free,
}

/// Quads, what their vertices may do, and the shapes they follow.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Vertex quadruples, counter-clockwise. May include fixed quads: their shape counts where they share a movable vertex.
    pub quads: &'a [[u32; 4]],
    /// Index into `surfaces` of each quad: the side of the crease or of the intersection curve that it lies on.
    pub surface_of: &'a [u32],
    /// One constraint a vertex.
    pub constraints: &'a [Constraint],
    /// The polylines that vertices slide along. Points that must stay (kinks, ends, crossings) are fixed vertices.
    pub chains: &'a [Polyline],
    /// The reference surfaces.
    pub surfaces: &'a [&'a dyn Reference],
}

/// How hard to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothOptions {
    /// Most sweeps of the shape energy over all vertices. Stops sooner when little moves. Default 12.
    pub sweeps: usize,
    /// Most sweeps over the vertices of bad quads. Default 20.
    pub worst_sweeps: usize,
    /// Quads below this quality are bad, 0 to 1. Default 0.6.
    pub target: f64,
    /// How much a quad keeps the aspect it starts with: 0 makes for squares, 1 keeps the aspect. Default 0.5.
    pub keep_aspect: f64,
}

impl Default for SmoothOptions {
    fn default() -> Self {
        Self { sweeps: 12, worst_sweeps: 20, target: 0.6, keep_aspect: 0.5 }
    }
}

/// What smoothing did. Quality is [`quad_quality`], over quads with a movable vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothReport {
    /// Worst quality before; 1 when there was nothing to move.
    pub worst_before: f64,
    /// Worst quality after.
    pub worst: f64,
    /// Mean quality after.
    pub mean: f64,
    /// Quads of quality 0 or less after.
    pub inverted: usize,
}

/// Why smoothing did not run to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SmoothError {
    /// The caller cancelled; positions are as far as they came, every vertex on its surface.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// An array does not have one entry for each quad or vertex.
    #[error("{array} has {found} entries, but {wanted} are needed")]
    Length {
        /// Field of [`Patch`], or "positions".
        array: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        wanted: usize,
    },
    /// A quad names a vertex or a surface that does not exist.
    #[error("quad {quad} names a vertex or a surface that does not exist")]
    Quad {
        /// The quad.
        quad: usize,
    },
    /// A vertex names a chain that does not exist or has fewer than two points.
    #[error("vertex {vertex} slides on a chain that does not exist or has fewer than two points")]
    Chain {
        /// The vertex.
        vertex: usize,
    },
}

impl Patch<'_> {
    fn validate(&self, vertices: usize) -> Result<(), SmoothError> {
        let length = |array, found, wanted| {
            if found == wanted { Ok(()) } else { Err(SmoothError::Length { array, found, wanted }) }
        };
        length("constraints", self.constraints.len(), vertices)?;
        length("surface_of", self.surface_of.len(), self.quads.len())?;
        for (quad, (corners, &surface)) in self.quads.iter().zip(self.surface_of).enumerate() {
            if corners.iter().any(|&v| v as usize >= vertices) || surface as usize >= self.surfaces.len() {
                return Err(SmoothError::Quad { quad });
            }
        }
        for (vertex, constraint) in self.constraints.iter().enumerate() {
            if let &Constraint::OnChain(chain) = constraint
                && self.chains.get(chain as usize).is_none_or(|line| line.length() <= 0.0)
            {
                return Err(SmoothError::Chain { vertex });
            }
        }
        Ok(())
    }
}

/// The corners of a quad, from its corner `k` on.
fn rotated(quad: [u32; 4], k: usize) -> [usize; 4] {
    [0, 1, 2, 3].map(|i| quad[(k + i) & 3] as usize)
}

struct Smoother<'a> {
    patch: Patch<'a>,
    positions: &'a mut [DVec3],
    /// Quads round each vertex as (quad, corner), row by row.
    around: Vec<(u32, u8)>,
    row: Vec<u32>,
    normals: Vec<DVec3>,
    aspects: Vec<f64>,
    arc: Vec<f64>,
    step: Vec<f64>,
    /// Triangle of the surface below each vertex and each quad, where it is known.
    under: Vec<u32>,
    under_quad: Vec<u32>,
}

/// Where a vertex goes: place, arc length on its chain, triangle below it; and the step it should try next.
struct Move {
    place: Option<(DVec3, f64)>,
    under: u32,
    step: f64,
}

/// Vertices that move at once, by one thread and between two looks at the monitor.
const TOGETHER: usize = 32;
const BATCH: usize = 4096;

impl<'a> Smoother<'a> {
    fn new(patch: Patch<'a>, positions: &'a mut [DVec3], options: &SmoothOptions) -> Self {
        let n = positions.len();
        let mut row = vec![0; n + 1];
        for &v in patch.quads.iter().flatten() {
            row[v as usize + 1] += 1;
        }
        for v in 0..n {
            row[v + 1] += row[v];
        }
        let mut fill = row.clone();
        let mut around = vec![(0, 0); patch.quads.len() * 4];
        for (q, quad) in patch.quads.iter().enumerate() {
            for (k, &v) in quad.iter().enumerate() {
                around[fill[v as usize] as usize] = (q as u32, k as u8);
                fill[v as usize] += 1;
            }
        }
        let arc = patch
            .constraints
            .iter()
            .zip(positions.iter())
            .map(
                |(c, &p)| {
                    if let Constraint::OnChain(chain) = c { patch.chains[*chain as usize].locate(p) } else { 0.0 }
                },
            )
            .collect();
        let mut smoother = Self {
            patch,
            positions,
            around,
            row,
            normals: vec![DVec3::ZERO; patch.quads.len()],
            aspects: Vec::new(),
            arc,
            step: vec![0.1; n],
            under: vec![NONE; n],
            under_quad: vec![NONE; patch.quads.len()],
        };
        smoother.aspects = (0..patch.quads.len())
            .map(|q| {
                let p = smoother.points(q);
                let first = p[0].distance(p[1]) + p[2].distance(p[3]);
                let second = p[1].distance(p[2]) + p[3].distance(p[0]);
                let aspect = (first / second).clamp(0.2, 5.0);
                if aspect.is_finite() { aspect.powf(options.keep_aspect) } else { 1.0 }
            })
            .collect();
        smoother
    }

    /// The feet of vertices on the surface of their first quad, and the triangles there, where those are sure.
    fn feet(&self, monitor: &Monitor) -> Result<Vec<Option<(SurfacePoint, u32)>>, Cancelled> {
        let find = |near: &mut u32, v: usize| {
            if v.is_multiple_of(1024) {
                monitor.check()?;
            }
            let Some(&(q, _)) = self.quads_around(v).first() else { return Ok(None) };
            let surface = self.patch.surfaces[self.patch.surface_of[q as usize] as usize];
            Ok(surface.project_surely(self.positions[v], near).map(|foot| (foot, *near)))
        };
        (0..self.positions.len()).into_par_iter().with_min_len(TOGETHER).map_init(|| NONE, find).collect()
    }

    /// The normals to begin with.
    fn first_normals(&mut self, feet: &[Option<(SurfacePoint, u32)>], monitor: &Monitor) -> Result<(), Cancelled> {
        let find = |q: usize| {
            if q.is_multiple_of(1024) {
                monitor.check()?;
            }
            let surface = self.patch.surface_of[q];
            let known = |v: u32| {
                let (first, _) = self.quads_around(v as usize)[0];
                feet[v as usize].filter(|_| self.patch.surface_of[first as usize] == surface)
            };
            let mut under = NONE;
            let feet = self.patch.quads[q].map(known);
            let normal = self.patch.surfaces[surface as usize].normal_with(self.points(q), feet, &mut under);
            Ok((normal, under))
        };
        let found: Vec<(DVec3, u32)> = (0..self.normals.len()).into_par_iter().map(find).collect::<Result<_, _>>()?;
        (self.normals, self.under_quad) = found.into_iter().unzip();
        Ok(())
    }

    fn refresh_normals(&mut self, monitor: &Monitor) -> Result<(), Cancelled> {
        let mut fresh = std::mem::take(&mut self.normals);
        let mut under = std::mem::take(&mut self.under_quad);
        let checked = |(q, (normal, under)): (usize, (&mut DVec3, &mut u32))| {
            if q % 1024 == 0 {
                monitor.check()?;
            }
            *normal = self.normal(q, *normal, under);
            Ok(())
        };
        let done = fresh.par_iter_mut().zip(&mut under).enumerate().try_for_each(checked);
        (self.normals, self.under_quad) = (fresh, under);
        done
    }

    fn points(&self, q: usize) -> [DVec3; 4] {
        self.patch.quads[q].map(|v| self.positions[v as usize])
    }

    /// The normal of the surface below a quad that had another `before`, or none.
    fn normal(&self, q: usize, before: DVec3, under: &mut u32) -> DVec3 {
        let p = self.points(q);
        let surface = self.patch.surfaces[self.patch.surface_of[q] as usize];
        if before == DVec3::ZERO {
            return surface.normal_under(p, under);
        }
        surface.project_facing((p[0] + p[1] + p[2] + p[3]) / 4.0, before, under).normal
    }

    fn quality(&self, q: usize) -> f64 {
        quad_quality(self.points(q), self.normals[q])
    }

    fn is_movable(&self, v: usize) -> bool {
        self.patch.constraints[v] != Constraint::Fixed && self.row[v] < self.row[v + 1]
    }

    fn quads_around(&self, v: usize) -> &[(u32, u8)] {
        &self.around[self.row[v] as usize..self.row[v + 1] as usize]
    }

    /// Where one vertex would go.
    fn find(&self, v: usize, goal: Goal, star: &mut Star) -> Move {
        let patch = self.patch;
        let mut step = self.step[v];
        star.clear();
        star.under = self.under[v];
        for &(q, k) in self.quads_around(v) {
            let [_, a, b, c] = rotated(patch.quads[q as usize], k as usize);
            let aspect = self.aspects[q as usize];
            let others = [self.positions[a], self.positions[b], self.positions[c]];
            star.push(others, self.normals[q as usize], if k & 1 == 0 { aspect } else { 1.0 / aspect });
        }
        let track = match patch.constraints[v] {
            Constraint::Fixed => return Move { place: None, under: star.under, step },
            Constraint::OnChain(chain) => Track::Chain(&patch.chains[chain as usize], self.arc[v]),
            Constraint::Free => {
                let quad = self.around[self.row[v] as usize].0;
                Track::Surface(patch.surfaces[patch.surface_of[quad as usize] as usize])
            }
        };
        let place = star.relax(self.positions[v], &track, goal, &mut step);
        Move { place, under: star.under, step }
    }

    /// Moves one vertex; true when it moved by a hundredth of an edge or so.
    fn put(&mut self, v: usize, found: &Move) -> bool {
        (self.under[v], self.step[v]) = (found.under, found.step);
        if let Some((place, arc)) = found.place {
            (self.positions[v], self.arc[v]) = (place, arc);
        }
        found.place.is_some() && found.step > 8e-3
    }

    /// The vertices that may move, in groups of which no two share a quad: each goes to the first that has room.
    fn groups(&self) -> Vec<Vec<usize>> {
        let mut group_of = vec![usize::MAX; self.positions.len()];
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for v in (0..self.positions.len()).filter(|&v| self.is_movable(v)) {
            let beside = self.quads_around(v).iter().flat_map(|&(q, _)| self.patch.quads[q as usize]);
            let taken: Vec<usize> = beside.map(|w| group_of[w as usize]).collect();
            let group = (0..groups.len()).find(|group| !taken.contains(group)).unwrap_or(groups.len());
            group_of[v] = group;
            if group == groups.len() {
                groups.push(Vec::new());
            }
            groups[group].push(v);
        }
        groups
    }

    /// Sweeps the shape energy, visiting only vertices that moved, or whose neighbours did, in the sweep before.
    fn sweep_shape(&mut self, most: usize, monitor: &Monitor) -> Result<(), Cancelled> {
        let groups = self.groups();
        let mut awake = vec![true; self.positions.len()];
        for sweep in 0..most {
            let mut next = vec![false; self.positions.len()];
            for part in groups.iter().flat_map(|group| group.chunks(BATCH)) {
                monitor.check()?;
                let open: Vec<usize> = part.iter().copied().filter(|&v| awake[v]).collect();
                let find = |star: &mut Star, &v: &usize| self.find(v, Goal::Shape, star);
                let moves: Vec<Move> = open.par_iter().with_min_len(TOGETHER).map_init(Star::default, find).collect();
                for (v, found) in open.into_iter().zip(&moves) {
                    // A fruitless search at a long step says little: try again with the shorter one.
                    let could_shrink = self.step[v] > 0.02;
                    if self.put(v, found) {
                        for &(q, _) in self.quads_around(v) {
                            self.patch.quads[q as usize].iter().for_each(|&w| next[w as usize] = true);
                        }
                    } else if could_shrink {
                        next[v] = true;
                    }
                }
            }
            // Directions settle soon; the normals follow while things still move far.
            if sweep < 4 {
                self.refresh_normals(monitor)?;
            }
            if !next.contains(&true) {
                break;
            }
            awake = next;
        }
        Ok(())
    }

    /// Visits the movable vertices of bad quads, worst quad first, and lets each lift the worst quality around it.
    fn sweep_worst(&mut self, options: &SmoothOptions, monitor: &Monitor) -> Result<(), Cancelled> {
        self.step.fill(0.1);
        let mut star = Star::default();
        // What found no better place is left alone until something near it has moved.
        let mut awake = vec![true; self.positions.len()];
        for _ in 0..options.worst_sweeps {
            let mut bad: Vec<(f64, usize)> = (0..self.patch.quads.len())
                .filter(|&q| self.patch.quads[q].iter().any(|&v| awake[v as usize] && self.is_movable(v as usize)))
                .map(|q| (self.quality(q), q))
                .filter(|&(quality, _)| quality < options.target)
                .collect();
            bad.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut done = vec![false; self.positions.len()];
            let mut moved = false;
            for &(_, q) in &bad {
                monitor.check()?;
                for v in self.patch.quads[q].map(|v| v as usize) {
                    if !done[v] && awake[v] && self.is_movable(v) {
                        done[v] = true;
                        let found = self.find(v, Goal::Worst, &mut star);
                        if self.put(v, &found) {
                            for &(q, _) in self.quads_around(v) {
                                self.patch.quads[q as usize].iter().for_each(|&w| awake[w as usize] = true);
                            }
                            moved = true;
                        } else {
                            awake[v] = self.step[v] > 0.02;
                            moved |= awake[v];
                        }
                    }
                }
                let mut under = self.under_quad[q];
                self.normals[q] = self.normal(q, self.normals[q], &mut under);
                self.under_quad[q] = under;
            }
            if !moved {
                break;
            }
        }
        Ok(())
    }

    fn report(&self, worst_before: f64) -> SmoothReport {
        let (mut worst, mut sum, mut count, mut inverted) = (1.0_f64, 0.0, 0, 0);
        for q in self.movable_quads() {
            let quality = self.quality(q);
            worst = worst.min(quality);
            sum += quality;
            count += 1;
            inverted += usize::from(quality <= 0.0);
        }
        SmoothReport { worst_before, worst, mean: if count > 0 { sum / f64::from(count) } else { 1.0 }, inverted }
    }

    fn movable_quads(&self) -> impl Iterator<Item = usize> + '_ {
        let is_movable = |&v: &u32| self.patch.constraints[v as usize] != Constraint::Fixed;
        (0..self.patch.quads.len()).filter(move |&q| self.patch.quads[q].iter().any(is_movable))
    }
}

/// Smooths `positions` in place: free vertices on their surface, chain vertices along their chain, fixed ones not at all.
/// Untangles where the start has inverted quads; never makes a valid quad invalid. Movable vertices are put on their surface or
/// chain first. About 10 microseconds a vertex and sweep with a closest-point tree.
///
/// # Errors
/// [`SmoothError`] when the arrays do not fit together, or the caller cancels.
pub fn smooth_quads(
    patch: Patch<'_>,
    positions: &mut [DVec3],
    options: &SmoothOptions,
    monitor: &Monitor,
) -> Result<SmoothReport, SmoothError> {
    patch.validate(positions.len())?;
    let mut smoother = Smoother::new(patch, positions, options);
    let feet = smoother.feet(monitor)?;
    smoother.first_normals(&feet, monitor)?;
    let worst_before = smoother.report(1.0).worst;
    for (v, foot) in feet.into_iter().enumerate() {
        if v % 1024 == 0 {
            monitor.check()?;
        }
        if !smoother.is_movable(v) {
            continue;
        }
        smoother.positions[v] = if let Constraint::OnChain(chain) = patch.constraints[v] {
            patch.chains[chain as usize].at(smoother.arc[v])
        } else if let Some((foot, under)) = foot {
            smoother.under[v] = under;
            foot.point
        } else {
            let quad = smoother.quads_around(v)[0].0;
            let surface = patch.surfaces[patch.surface_of[quad as usize] as usize];
            surface.project_near(smoother.positions[v], &mut smoother.under[v]).point
        };
    }
    smoother.sweep_shape(options.sweeps, monitor)?;
    smoother.sweep_worst(options, monitor)?;
    smoother.refresh_normals(monitor)?;
    Ok(smoother.report(worst_before))
}

#[cfg(test)]
#[path = "smooth_tests.rs"]
mod tests;
