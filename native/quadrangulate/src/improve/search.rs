//! The search: look a few operators ahead in the connectivity, try the promising sequences on the surface, keep or undo.

use super::ImproveOptions;
use super::editable::Editable;
use super::operators::Operator;
use mesh::{Cancelled, DVec3, Monitor, NONE};
use rayon::prelude::*;
use std::ops::Range;
use surface::smooth::Constraint;
use surface::smooth_star::{Goal, Reference, Star, Track, quad_quality};

/// Sequences tried on the surface for one vertex and depth.
const TRIALS: usize = 4;
/// The same at a bad quad.
const TRIALS_AT_BAD: usize = 12;
/// How much worse the valences may get on the way to something better.
const SLACK: i32 = 1;
/// The same at a bad quad: its cure may take two new irregular vertices.
const SLACK_AT_BAD: i32 = 2;
/// A quad below this quality adds to the cost, so that shape counts beside valence.
const GOOD: f64 = 0.5;
/// Weight of a quad's shortfall below [`GOOD`], in units of one irregular vertex.
const SHAPE_WEIGHT: f64 = 3.0;
/// Weight of a quad's shortfall below 1: the strain by which irregular vertices of opposite kind attract each other.
const STRAIN_WEIGHT: f64 = 0.5;
/// Operators looked ahead while irregular vertices drift.
const DRIFT_DEPTH: usize = 2;
/// Weight of the squared logarithm of a quad's area over the area wanted.
const SIZE_WEIGHT: f64 = 0.1;

/// Sweeps of smoothing after a change, and those after which it is looked at first.
const SWEEPS: usize = 6;
const FIRST_SWEEPS: usize = 2;
/// How far a vertex looks at first, in edge lengths, and below what it has found its place.
pub(super) const FIRST_STEP: f64 = 0.15;
const SETTLED: f64 = 0.02;
/// A change whose cost has grown by more than this after the first sweeps is not worth the others: one that takes
/// irregular vertices out, and one that does not. Of 14,000 changes tried, these bounds gave up 9,000 after the first
/// sweeps, 180 of them among the 1,670 that would have been kept, most with little to gain.
const HOPELESS: [f64; 2] = [1.0, 0.2];

/// Normals that are looked up by one thread.
const TOGETHER: usize = 128;

struct Plan {
    gain: i32,
    operators: Vec<Operator>,
}

pub(super) struct Search<'a> {
    pub(super) mesh: Editable,
    pub(super) surfaces: &'a [&'a dyn Reference],
    options: &'a ImproveOptions,
    /// Valence cost of each vertex in the present connectivity.
    pub(super) cost: Vec<i32>,
    /// Normal of the reference surface at each quad; quads under trial are appended.
    pub(super) normals: Vec<DVec3>,
    /// When the surroundings of each vertex last changed.
    pub(super) changed: Vec<u32>,
    pub(super) clock: u32,
    budget: usize,
    pub(super) trials: usize,
    pub(super) changes: usize,
}

impl<'a> Search<'a> {
    pub(super) fn new(mesh: Editable, surfaces: &'a [&'a dyn Reference], options: &'a ImproveOptions) -> Self {
        let n = mesh.positions.len();
        let cost = (0..n as u32).map(|v| mesh.vertex_cost(v)).collect();
        let mut search = Self {
            mesh,
            surfaces,
            options,
            cost,
            normals: Vec::new(),
            changed: vec![0; n],
            clock: 0,
            budget: 0,
            trials: 0,
            changes: 0,
        };
        search.extend_normals();
        search
    }

    pub(super) fn finish(self) -> (Editable, usize, usize) {
        (self.mesh, self.changes, self.trials)
    }

    /// Depth by depth and pass by pass over the irregular vertices and those of bad quads.
    pub(super) fn run(&mut self, monitor: &Monitor) -> Result<(), Cancelled> {
        let most = self.options.depth;
        let cancel = |from: usize| (from..=most).map(|depth| (depth, false));
        // Cancel what is near, let the rest drift to where the strain is less, and cancel again.
        let drift = (most > 0).then_some((DRIFT_DEPTH.min(most), true));
        for (depth, drift) in cancel(1).chain(drift).chain(cancel(2)) {
            let mut tried_at = vec![None; self.mesh.positions.len()];
            for _ in 0..self.options.passes {
                let mut progress = false;
                let mut v = 0;
                while v < self.mesh.positions.len() {
                    monitor.check()?;
                    tried_at.resize(self.mesh.positions.len(), None);
                    let bad = self.worst_at(v as u32) < self.options.floor;
                    if (self.cost[v] != 0 || bad) && tried_at[v].is_none_or(|t| t < self.changed[v]) {
                        tried_at[v] = Some(self.clock);
                        progress |= self.improve_at(v as u32, depth, bad, drift);
                    }
                    v += 1;
                }
                if !progress {
                    break;
                }
            }
        }
        Ok(())
    }

    fn improve_at(&mut self, v: u32, depth: usize, bad: bool, drift: bool) -> bool {
        let mut plans = Vec::new();
        // A bad quad may be worth an irregular vertex.
        let limit = if bad {
            1
        } else if drift {
            0
        } else {
            -1
        };
        self.explore(v, depth, 0, limit, &mut Vec::new(), &mut plans);
        plans.sort_by_key(|plan| (plan.gain, plan.operators.len()));
        plans.iter().take(if bad { TRIALS_AT_BAD } else { TRIALS }).any(|plan| self.attempt(plan))
    }

    /// Collects the sequences of up to `depth` operators from `v` that bring the valence cost to `limit` or below.
    fn explore(
        &mut self,
        v: u32,
        depth: usize,
        so_far: i32,
        limit: i32,
        path: &mut Vec<Operator>,
        plans: &mut Vec<Plan>,
    ) {
        let operators = self.mesh.operators_at(v);
        let share = self.options.budget / operators.len().max(1);
        for operator in operators {
            if path.is_empty() {
                // Every first operator gets the same share, so that the first does not use up all.
                self.budget = share;
            } else if self.budget == 0 {
                return;
            }
            let slack = if limit > 0 { SLACK_AT_BAD } else { SLACK };
            let bound = if depth > 1 { slack } else { limit };
            if self.mesh.predicted_cost(operator).is_some_and(|cost| so_far + cost > bound) {
                continue;
            }
            self.budget = self.budget.saturating_sub(1);
            let Some(mark) = self.mesh.apply(operator) else { continue };
            let touched = self.mesh.touched(mark);
            self.cost.resize(self.mesh.positions.len(), 0);
            let old: Vec<i32> = touched.iter().map(|&w| self.cost[w as usize]).collect();
            for &w in &touched {
                self.cost[w as usize] = self.mesh.vertex_cost(w);
            }
            let total = so_far + touched.iter().zip(&old).map(|(&w, o)| self.cost[w as usize] - o).sum::<i32>();
            path.push(operator);
            if total <= limit {
                plans.push(Plan { gain: total, operators: path.clone() });
            } else if depth > 1 && total <= slack {
                for &w in &touched {
                    if self.cost[w as usize] != 0 {
                        self.explore(w, depth - 1, total, limit, path, plans);
                    }
                }
            }
            path.pop();
            for (&w, o) in touched.iter().zip(old) {
                self.cost[w as usize] = o;
            }
            self.mesh.undo(mark);
            self.cost.truncate(self.mesh.positions.len());
        }
    }

    /// Applies a plan, smooths around it, and keeps it when valence, shape and size together are better.
    fn attempt(&mut self, plan: &Plan) -> bool {
        self.trials += 1;
        let mark = self.mesh.mark();
        if plan.operators.iter().any(|&operator| self.mesh.apply(operator).is_none()) {
            self.mesh.undo(mark);
            return false;
        }
        let touched = self.mesh.touched(mark);
        let region = self.ring(&touched);
        self.mesh.undo(mark);
        let known: Vec<u32> = region.iter().copied().filter(|&v| (v as usize) < self.mesh.positions.len()).collect();
        let (badness_before, worst_before) = self.judge(&known);
        let saved: Vec<DVec3> = known.iter().map(|&v| self.mesh.positions[v as usize]).collect();
        let saved_normals: Vec<(u32, DVec3)> =
            self.quads_at(&known).into_iter().map(|q| (q, self.normals[q as usize])).collect();

        // The same operators on the same mesh: they apply again.
        for &operator in &plan.operators {
            self.mesh.apply(operator);
        }
        self.extend_normals();
        let gain = f64::from(plan.gain) - badness_before;
        let mut steps = vec![FIRST_STEP; region.len()];
        self.relax(&region, &mut steps, 0..FIRST_SWEEPS);
        let is_hopeless = gain + self.judge(&region).0 > HOPELESS[usize::from(plan.gain >= 0)];
        if !is_hopeless {
            self.relax(&region, &mut steps, FIRST_SWEEPS..SWEEPS);
        }
        let (badness, worst) = self.judge(&region);
        if !is_hopeless && gain + badness < -0.05 && worst >= worst_before.min(self.options.floor) {
            self.changes += 1;
            self.clock += 1;
            self.cost.resize(self.mesh.positions.len(), 0);
            self.changed.resize(self.mesh.positions.len(), 0);
            for &v in &region {
                self.cost[v as usize] = self.mesh.vertex_cost(v);
                self.changed[v as usize] = self.clock;
            }
            return true;
        }
        self.mesh.undo(mark);
        self.normals.truncate(self.mesh.quads.len());
        for (&v, position) in known.iter().zip(saved) {
            self.mesh.positions[v as usize] = position;
        }
        for (q, normal) in saved_normals {
            self.normals[q as usize] = normal;
        }
        false
    }

    /// The given vertices and all that share a quad with them, ascending.
    fn ring(&self, vertices: &[u32]) -> Vec<u32> {
        let mut ring = vertices.to_vec();
        for q in self.quads_at(vertices) {
            ring.extend(self.mesh.quads[q as usize].iter().flatten());
        }
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    fn quads_at(&self, vertices: &[u32]) -> Vec<u32> {
        let mut quads: Vec<u32> = vertices.iter().flat_map(|&v| self.mesh.around[v as usize].iter().copied()).collect();
        quads.sort_unstable();
        quads.dedup();
        quads
    }

    fn points(&self, q: u32) -> Option<[DVec3; 4]> {
        Some(self.mesh.quads[q as usize]?.map(|v| self.mesh.positions[v as usize]))
    }

    fn normal(&self, q: u32) -> Option<DVec3> {
        let surface = self.surfaces[self.mesh.surface_of[q as usize] as usize];
        Some(surface.normal_under(self.points(q)?, &mut { NONE }))
    }

    pub(super) fn extend_normals(&mut self) {
        let new = self.normals.len() as u32..self.mesh.quads.len() as u32;
        let normal = |q: u32| self.normal(q).unwrap_or(DVec3::ZERO);
        let normals: Vec<DVec3> = new.into_par_iter().with_min_len(TOGETHER).map(normal).collect();
        self.normals.extend(normals);
    }

    fn worst_at(&self, v: u32) -> f64 {
        let quality = |&q: &u32| self.points(q).map_or(1.0, |p| quad_quality(p, self.normals[q as usize]));
        self.mesh.around[v as usize].iter().map(quality).fold(1.0, f64::min)
    }

    /// Cost of shape and size over the quads at the vertices, and the worst quality among them.
    fn judge(&self, vertices: &[u32]) -> (f64, f64) {
        self.judge_quads(&self.quads_at(vertices))
    }

    /// The same over some quads.
    pub(super) fn judge_quads(&self, quads: &[u32]) -> (f64, f64) {
        let (mut cost, mut worst) = (0.0, 1.0_f64);
        for &q in quads {
            let (Some(p), Some(quad)) = (self.points(q), self.mesh.quads[q as usize]) else { continue };
            let quality = quad_quality(p, self.normals[q as usize]);
            worst = worst.min(quality);
            cost += SHAPE_WEIGHT * (GOOD - quality).max(0.0) + STRAIN_WEIGHT * (1.0 - quality);
            cost += SIZE_WEIGHT * area_ratio(p, quad, &self.mesh.size).max(1e-6).ln().powi(2);
        }
        (cost, worst)
    }

    /// The largest of some quads, in areas wanted there.
    pub(super) fn largest(&self, quads: &[u32]) -> f64 {
        let ratio = |&q: &u32| Some(area_ratio(self.points(q)?, self.mesh.quads[q as usize]?, &self.mesh.size));
        quads.iter().filter_map(ratio).fold(0.0, f64::max)
    }

    /// Smooths the free vertices among the given ones: shape first, then the worst quads. `steps` says how far each looks.
    pub(super) fn relax(&mut self, vertices: &[u32], steps: &mut [f64], sweeps: Range<usize>) {
        let mut star = Star::default();
        let mut under = vec![NONE; vertices.len()];
        for sweep in sweeps {
            let goal = if sweep < 4 { Goal::Shape } else { Goal::Worst };
            for ((&v, step), under) in vertices.iter().zip(steps.iter_mut()).zip(&mut under) {
                // Chain vertices slide when the whole patch is smoothed.
                if *step < SETTLED
                    || self.mesh.constraints[v as usize] != Constraint::Free
                    || self.mesh.anchored[v as usize]
                    || self.mesh.around[v as usize].is_empty()
                {
                    continue;
                }
                star.clear();
                star.under = *under;
                for &q in &self.mesh.around[v as usize] {
                    let Some(quad) = self.mesh.quads[q as usize] else { continue };
                    let k = quad.iter().position(|&w| w == v).unwrap_or(0);
                    let others = [1, 2, 3].map(|i| self.mesh.positions[quad[(k + i) & 3] as usize]);
                    star.push(others, self.normals[q as usize], 1.0);
                }
                let quad = self.mesh.around[v as usize][0];
                let track = Track::Surface(self.surfaces[self.mesh.surface_of[quad as usize] as usize]);
                if let Some((place, _)) = star.relax(self.mesh.positions[v as usize], &track, goal, step) {
                    self.mesh.positions[v as usize] = place;
                }
                *under = star.under;
            }
        }
        for q in self.quads_at(vertices) {
            if let Some(normal) = self.normal(q) {
                self.normals[q as usize] = normal;
            }
        }
    }
}

/// Area of a quad over the area wanted, of which `size` has the edge length at each vertex.
fn area_ratio(p: [DVec3; 4], quad: [u32; 4], size: &[f64]) -> f64 {
    let size = quad.iter().map(|&v| size[v as usize]).sum::<f64>() / 4.0;
    0.5 * (p[2] - p[0]).cross(p[3] - p[1]).length() / (size * size)
}
