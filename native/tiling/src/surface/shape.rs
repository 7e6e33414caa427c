//! Moves the vertices of a pattern so that its tiles become regular and flat, near the surface (section 4.2.4).
//!
//! One local-global solver for all aims of the paper, each a wish for vertices, met in the least-squares sense:
//! - *regularity*: each tile asks for the regular polygon nearest to it, of one size for all tiles (the Euclidean regularity);
//! - *uniformity*, the paper's global regularity: each edge asks for the mean length of all edges, each diagonal of a quad for
//!   that of all diagonals;
//! - *planarity*: each quad asks for its corners' projections onto the plane nearest to them;
//! - *closeness*: each vertex asks for the point of the surface, or of its curve, nearest to it;
//! - *fairness*, relative: each vertex asks for the discrete curvature vector that it had before it left the surface.
//!
//! The matrix of the wishes never changes in a phase, so it is factored once. Deviation: the paper runs three optimisers one
//! after another, with a general solver.
//!
//! Tiles that ask for more room than there is would buckle out of the surface. So the first rounds put every vertex back on
//! it, and only the last let it off, for planarity. Steps that turn a tile over are halved, at that tile's vertices only;
//! those that would turn it at any length are left out.

mod bent;
mod measure;
mod untangle;

use super::SurfaceError;
use super::bars::{Off, Quality};
use super::curve::Curve;
use super::pattern::{Pattern, Place};
use super::regular::{mean_edge, nearest_regular};
use super::room::{Chain, chains, rooms};
use mesh::{DVec3, Monitor, NONE, TriangleMesh};
use solve::cholesky::Factor;
use std::collections::BTreeMap;
use surface::closest::ClosestPoint;

/// Weight of a place on a curve against that of a tile, 1.
const ON_CURVE: f64 = 8.0;

/// Weight of a vertex's last place while it is put back on the surface every round.
const SLIDING: f64 = 0.01;

/// How much more the tip of four triangles or fewer is held to the surface, and what is beside it: regular ones would make a spike of it,
/// and the ring around a tip that is held alone buckles.
const TIP: f64 = 10.0;

/// How often a step is halved where it turns tiles over, before it is left out.
const HALVINGS: usize = 4;

/// Cosine of the angle between the surface at a vertex of a tile and what is under all of them, below which a look at its middle is due.
const STEEP: f64 = 0.8;

/// Distance of a vertex from its curve, in edges, above which the tiles beside it are shaped again to make room for it, and the rounds
/// that this takes.
const OFF_CURVE: f64 = 0.01;
const CURVE_ROUNDS: usize = 20;

/// How hard to shape, and for what. Weights are against regularity, whose weight is 1 for each tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeOptions {
    /// Rounds on the surface, for regularity. Default 60; 0 leaves the pattern as it was laid.
    pub rounds: usize,
    /// Rounds near the surface, for planarity. Default 15.
    pub flattening_rounds: usize,
    /// Weight of closeness to the surface in the latter, for each vertex, above 0. Default 1.
    pub closeness: f64,
    /// Weight of planarity in the latter, for each quad. Default 5.
    pub planarity: f64,
    /// Weight of relative fairness in the latter, for each vertex. Default 0.
    pub fairness: f64,
    /// Weight of one length for all edges and one for all diagonals, for each of them, in all rounds. Default 0.
    pub uniformity: f64,
    /// What vertices on borders may do.
    pub borders: Along,
    /// What vertices on marked and sharp edges may do.
    pub features: Along,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self {
            rounds: 60,
            flattening_rounds: 15,
            closeness: 1.0,
            planarity: 5.0,
            fairness: 0.0,
            uniformity: 0.0,
            borders: Along::Slide,
            features: Along::Slide,
        }
    }
}

/// How vertices keep to a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// They move along it.
    Slide,
    /// They stay where they were laid, at equal steps.
    Keep,
}

/// Weights of the wishes in one phase, regularity apart.
#[derive(Clone, Copy)]
struct Aims {
    closeness: f64,
    planarity: f64,
    fairness: f64,
    uniformity: f64,
}

/// A phase of shaping: its wishes, and the matrix of these, factored.
struct Phase {
    aims: Aims,
    factor: Factor,
    /// What vertices that cannot move add to the right-hand side.
    pinned: Vec<DVec3>,
    /// The curvature vectors that fairness asks for.
    curvature: Vec<DVec3>,
    /// Which vertices are put back where they may be, every round.
    is_held: fn(Place) -> bool,
}

struct Shaper<'a> {
    surface: &'a TriangleMesh,
    closest: ClosestPoint,
    curves: &'a [Curve],
    pattern: &'a Pattern,
    tiles_at: Vec<Vec<u32>>,
    edges: Vec<[u32; 2]>,
    /// Vertices an edge away from each.
    beside: Vec<Vec<u32>>,
    /// Vertices of four triangles or fewer and nothing else, and those an edge away from one.
    is_by_tip: Vec<bool>,
    /// Vertices along curves.
    chains: Vec<Chain>,
    /// Stretch of its curve where each vertex may be.
    rooms: Vec<Option<[f64; 2]>>,
    /// Segment of its curve that each vertex was last nearest to.
    segment: Vec<usize>,
    /// Triangle of the surface that each vertex was last nearest to.
    triangle: Vec<u32>,
    /// Sum of the normals around each vertex of the surface.
    normals: Vec<DVec3>,
}

/// Vertices of the surface with their distances from a mesh.
pub(super) type Far = Vec<(f64, u32)>;

/// What came of shaping.
pub(super) struct Shaped {
    /// Tiles that are turned over.
    pub turned: Vec<u32>,
    pub quality: Quality,
    /// Vertices of the surface with their distance from the tiles, those that are off by most first, and none that is off by less than half of
    /// that.
    pub far: Far,
}

impl Shaped {
    /// By how much the bars are missed, in bars; each panel that is turned over is one.
    pub fn excess(&self) -> f64 {
        self.quality.excess() + self.turned.len() as f64
    }
}

/// Puts the pattern on the surface and shapes it.
pub(super) fn shape(
    surface: &TriangleMesh,
    curves: &[Curve],
    pattern: &mut Pattern,
    options: ShapeOptions,
    monitor: &Monitor,
) -> Result<Shaped, SurfaceError> {
    let count = pattern.positions.len();
    let mut tiles_at = vec![Vec::new(); count];
    for (t, tile) in pattern.tiles.iter().enumerate() {
        for &v in tile {
            tiles_at[v as usize].push(t as u32);
        }
    }
    let uses = pattern.edge_uses();
    keep(pattern, curves, &uses, options);
    let mut beside = vec![Vec::new(); count];
    for &[a, b] in uses.keys() {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    let is_triangle = |t: &u32| pattern.tiles[*t as usize].len() == 3;
    let is_tip: Vec<bool> = tiles_at.iter().map(|tiles| tiles.len() <= 4 && tiles.iter().all(is_triangle)).collect();
    let is_by_tip = (0..count).map(|v| is_tip[v] || beside[v].iter().any(|&w| is_tip[w as usize])).collect();
    let mut normals = vec![DVec3::ZERO; surface.positions.len()];
    for (t, triangle) in surface.triangles.iter().enumerate() {
        for &v in triangle {
            normals[v as usize] += surface.area_normal(t);
        }
    }
    let chains = chains(pattern, curves, &uses);
    let mut shaper = Shaper {
        surface,
        closest: ClosestPoint::new(surface),
        curves,
        pattern,
        tiles_at,
        is_by_tip,
        rooms: rooms(&chains, count),
        chains,
        edges: uses.into_keys().collect(),
        beside,
        segment: vec![0; count],
        triangle: vec![NONE; count],
        normals,
    };
    let mut positions = shaper.placed(&pattern.positions, monitor)?;
    let ShapeOptions { closeness, planarity, fairness, uniformity, .. } = options;
    let bound = Aims { closeness: SLIDING, planarity: 0.0, fairness: 0.0, uniformity };
    let free = Aims { closeness, planarity, fairness, uniformity };
    let part = options.rounds as f64 / (options.rounds + options.flattening_rounds).max(1) as f64;
    if options.rounds > 0 {
        let phase = shaper.phase(bound, &positions, |_| true)?;
        monitor.within(0.0, part, || shaper.run(&phase, options.rounds, &mut positions, monitor))?;
        shaper.untangle(&phase, &mut positions, monitor)?;
    }
    monitor.within(part, 1.0, || shaper.flatten(free, options.flattening_rounds, &mut positions, monitor))?;
    if options.flattening_rounds > 0 && options.rounds > 0 {
        shaper.follow_bends([bound, free], options.flattening_rounds, &mut positions, monitor)?;
    }
    let turned = shaper.turned(&positions);
    let (off_surface, far) = shaper.off_surface(&positions, monitor)?;
    let off = Off { surface: off_surface, line: shaper.off_curves(&positions), border: shaper.off_border(&positions) };
    let quality = Quality::of(&positions, &pattern.tiles, &shaper.edges, off);
    pattern.positions = positions;
    Ok(Shaped { turned, quality, far })
}

impl Shaper<'_> {
    /// Lets the vertices off the surface for flat quads, and puts those of curves back on them: exactly, wherever no tile turns over by it;
    /// where one would, all give way first.
    fn flatten(
        &mut self,
        aims: Aims,
        rounds: usize,
        positions: &mut Vec<DVec3>,
        monitor: &Monitor,
    ) -> Result<(), SurfaceError> {
        if rounds > 0 {
            let phase = self.phase(aims, positions, |_| false)?;
            self.run(&phase, rounds, positions, monitor)?;
        }
        self.put_on_curves(positions);
        let most_off = OFF_CURVE * mean_edge(&self.pattern.tiles, positions);
        if rounds > 0 && self.off_curves(positions).iter().any(|&off| off > most_off) {
            let before = (positions.clone(), self.turned(positions).len());
            let phase = self.phase(aims, positions, |place| place != Place::Free)?;
            self.run(&phase, CURVE_ROUNDS, positions, monitor)?;
            self.put_on_curves(positions);
            if self.turned(positions).len() > before.1 {
                *positions = before.0;
            }
        }
        Ok(())
    }

    /// Shapes for so many rounds.
    fn run(
        &mut self,
        phase: &Phase,
        rounds: usize,
        positions: &mut [DVec3],
        monitor: &Monitor,
    ) -> Result<(), SurfaceError> {
        for round in 0..rounds {
            monitor.stage("shaping", round as f64 / rounds as f64)?;
            let mut wish = self.step(phase, positions, monitor)?;
            for (v, p) in wish.iter_mut().enumerate().filter(|(v, _)| (phase.is_held)(self.pattern.places[*v])) {
                *p = self.nearest(v, *p);
            }
            self.guarded(positions, &wish);
        }
        Ok(())
    }

    /// Moves the vertices of curves to them, as far as no tile turns over.
    fn put_on_curves(&mut self, positions: &mut [DVec3]) {
        let wish: Vec<DVec3> = (0..positions.len())
            .map(|v| if self.pattern.places[v] == Place::Free { positions[v] } else { self.nearest(v, positions[v]) })
            .collect();
        self.guarded(positions, &wish);
    }

    /// The nearest allowed place of a vertex.
    fn nearest(&mut self, v: usize, p: DVec3) -> DVec3 {
        match self.pattern.places[v] {
            Place::Fixed => self.pattern.positions[v],
            Place::OnCurve(curve) => {
                let curve = &self.curves[curve as usize];
                let found = curve.project_near(p, self.segment[v]);
                let (q, segment) = self.rooms[v].map_or(found, |room| curve.within(found, room));
                self.segment[v] = segment;
                q
            }
            Place::Free => {
                let found = self.closest.project_near(p, self.triangle[v]);
                self.triangle[v] = found.triangle;
                found.point
            }
        }
    }

    /// Every vertex at its nearest place, searched from scratch.
    fn placed(&mut self, positions: &[DVec3], monitor: &Monitor) -> Result<Vec<DVec3>, SurfaceError> {
        let mut placed = Vec::with_capacity(positions.len());
        for (v, &p) in positions.iter().enumerate() {
            if v % 1024 == 0 {
                monitor.check()?;
            }
            if let Place::OnCurve(curve) = self.pattern.places[v] {
                self.segment[v] = self.curves[curve as usize].project(p).1;
            }
            placed.push(self.nearest(v, p));
        }
        Ok(placed)
    }

    fn weight(&self, v: usize, aims: Aims) -> f64 {
        match self.pattern.places[v] {
            Place::Free if self.is_by_tip[v] => TIP * aims.closeness,
            Place::Free => aims.closeness,
            // Flat quads do not pull borders off their curves, however much they are asked for.
            _ => ON_CURVE.max(aims.planarity),
        }
    }

    /// Fixed vertices are no unknowns but rows of their own: x = place.
    fn phase(&self, aims: Aims, positions: &[DVec3], is_held: fn(Place) -> bool) -> Result<Phase, SurfaceError> {
        let count = self.pattern.positions.len();
        let mut triplets = Vec::new();
        let mut pinned = vec![DVec3::ZERO; count];
        // An entry of the matrix; both halves of it are given.
        let mut add = |row: u32, column: u32, value: f64| match [row, column].map(|v| self.is_fixed(v as usize)) {
            [false, false] if row >= column => triplets.push((row as usize, column as usize, value)),
            [false, true] => pinned[row as usize] -= value * self.pattern.positions[column as usize],
            _ => {}
        };
        for tile in &self.pattern.tiles {
            let n = tile.len() as f64;
            let weight = if tile.len() == 4 { 1.0 + aims.planarity } else { 1.0 };
            for &a in tile {
                for &b in tile {
                    add(a, b, weight * if a == b { 1.0 - 1.0 / n } else { -1.0 / n });
                }
            }
        }
        if aims.uniformity > 0.0 {
            for &[a, b] in self.edges.iter().chain(&self.diagonals()) {
                for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                    add(row, column, sign * aims.uniformity);
                }
            }
        }
        if aims.fairness > 0.0 {
            for v in (0..count).filter(|&v| self.pattern.places[v] == Place::Free) {
                let star = self.star(v);
                for &(a, p) in &star {
                    for &(b, q) in &star {
                        add(a, b, aims.fairness * p * q);
                    }
                }
            }
        }
        for v in 0..count {
            triplets.push((v, v, if self.is_fixed(v) { 1.0 } else { self.weight(v, aims) }));
        }
        let factor = Factor::new(count, &triplets)?;
        Ok(Phase { aims, factor, pinned, curvature: self.curvature(positions), is_held })
    }

    /// The discrete curvature vector at a vertex, as a sum over these: the vertex less the mean of its neighbours.
    fn star(&self, v: usize) -> Vec<(u32, f64)> {
        let beside = &self.beside[v];
        let share = -1.0 / beside.len().max(1) as f64;
        std::iter::once((v as u32, 1.0)).chain(beside.iter().map(|&w| (w, share))).collect()
    }

    fn curvature(&self, positions: &[DVec3]) -> Vec<DVec3> {
        (0..positions.len())
            .map(|v| self.star(v).iter().map(|&(w, share)| share * positions[w as usize]).sum())
            .collect()
    }

    fn diagonals(&self) -> Vec<[u32; 2]> {
        let quads = self.pattern.tiles.iter().filter(|tile| tile.len() == 4);
        quads.flat_map(|tile| [[tile[0], tile[2]], [tile[1], tile[3]]]).collect()
    }

    fn is_fixed(&self, v: usize) -> bool {
        self.pattern.places[v] == Place::Fixed
    }

    /// Where all wishes taken together would have the vertices.
    fn step(&mut self, phase: &Phase, positions: &[DVec3], monitor: &Monitor) -> Result<Vec<DVec3>, SurfaceError> {
        let aims = phase.aims;
        let count = positions.len();
        let edge = mean_edge(&self.pattern.tiles, positions);
        let mut right = phase.pinned.clone();
        for (v, &p) in positions.iter().enumerate() {
            if v % 4096 == 0 {
                monitor.check()?;
            }
            right[v] += self.weight(v, aims) * self.nearest(v, p);
        }
        for tile in &self.pattern.tiles {
            let up = self.up(tile, positions);
            let wanted = nearest_regular(tile, positions, edge, is_turned(tile, positions, up).then_some(up));
            for (&v, &q) in tile.iter().zip(&wanted) {
                right[v as usize] += q;
            }
            if aims.planarity > 0.0 && tile.len() == 4 {
                for (&v, q) in tile.iter().zip(flattened(tile, positions)) {
                    right[v as usize] += aims.planarity * q;
                }
            }
        }
        if aims.uniformity > 0.0 {
            for lines in [self.edges.as_slice(), &self.diagonals()] {
                let length = |&[a, b]: &[u32; 2]| positions[a as usize].distance(positions[b as usize]);
                let mean = lines.iter().map(length).sum::<f64>() / lines.len().max(1) as f64;
                for &[a, b] in lines {
                    let along = (positions[a as usize] - positions[b as usize]).normalize_or_zero();
                    right[a as usize] += aims.uniformity * mean * along;
                    right[b as usize] -= aims.uniformity * mean * along;
                }
            }
        }
        if aims.fairness > 0.0 {
            for v in (0..count).filter(|&v| self.pattern.places[v] == Place::Free) {
                for (w, share) in self.star(v) {
                    right[w as usize] += aims.fairness * share * phase.curvature[v];
                }
            }
        }
        for v in (0..count).filter(|&v| self.is_fixed(v)) {
            right[v] = self.pattern.positions[v];
        }
        let mut sides: Vec<Vec<f64>> = (0..3).map(|axis| right.iter().map(|p| p[axis]).collect()).collect();
        phase.factor.solve_many(&mut sides)?;
        Ok((0..count).map(|v| DVec3::new(sides[0][v], sides[1][v], sides[2][v])).collect())
    }

    /// Moves towards the wish, less where tiles would turn over that have not.
    fn guarded(&self, positions: &mut [DVec3], wish: &[DVec3]) {
        let was_bad: Vec<bool> = self.pattern.tiles.iter().map(|tile| self.is_turned(tile, positions)).collect();
        let mut fraction = vec![1.0; positions.len()];
        let mut moved = wish.to_vec();
        let mut suspects: Vec<u32> = (0..self.pattern.tiles.len() as u32).collect();
        for halving in 0.. {
            suspects.retain(|&t| !was_bad[t as usize] && self.is_turned(&self.pattern.tiles[t as usize], &moved));
            if suspects.is_empty() {
                break;
            }
            let mut touched = Vec::new();
            for &t in &suspects {
                for &v in &self.pattern.tiles[t as usize] {
                    let v = v as usize;
                    fraction[v] = if halving < HALVINGS { 0.5 * fraction[v] } else { 0.0 };
                    moved[v] = positions[v].lerp(wish[v], fraction[v]);
                    touched.extend_from_slice(&self.tiles_at[v]);
                }
            }
            touched.sort_unstable();
            touched.dedup();
            suspects = touched;
        }
        positions.copy_from_slice(&moved);
    }

    /// Whether a tile is turned over: against the surface at its vertices or, where that turns much from one to the other, below its middle.
    fn is_turned(&self, tile: &[u32], positions: &[DVec3]) -> bool {
        let up = self.up(tile, positions);
        let near = tile.iter().map(|&v| self.triangle[v as usize]).filter(|&t| t != NONE);
        let is_steep = |t: u32| self.surface.area_normal(t as usize).normalize_or_zero().dot(up) < STEEP;
        is_turned(tile, positions, up) || near.clone().any(is_steep) && self.is_over(tile, positions)
    }

    /// The normal of the surface under a tile; its own where no vertex is known to be near the surface.
    fn up(&self, tile: &[u32], positions: &[DVec3]) -> DVec3 {
        let near = tile.iter().map(|&v| self.triangle[v as usize]).filter(|&t| t != NONE);
        let up =
            near.map(|t| self.surface.area_normal(t as usize).normalize_or_zero()).sum::<DVec3>().normalize_or_zero();
        if up != DVec3::ZERO {
            return up;
        }
        mesh::face_normal(&tile.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>())
    }
}

/// Whether a corner of a tile faces away from `up`.
fn is_turned(tile: &[u32], positions: &[DVec3], up: DVec3) -> bool {
    let at = |k: usize| positions[tile[k % tile.len()] as usize];
    (0..tile.len()).any(|k| (at(k + 1) - at(k)).cross(at(k + tile.len() - 1) - at(k)).dot(up) <= 0.0)
}

/// Corners of a quad, relative to their centre, on the plane nearest to them.
fn flattened(tile: &[u32], positions: &[DVec3]) -> [DVec3; 4] {
    let p: [DVec3; 4] = std::array::from_fn(|k| positions[tile[k] as usize]);
    let centre = p.iter().sum::<DVec3>() / 4.0;
    let normal = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or_zero();
    p.map(|p| (p - centre) - (p - centre).dot(normal) * normal)
}

/// Fixes the vertices on borders and on features where these are to be kept.
fn keep(pattern: &mut Pattern, curves: &[Curve], uses: &BTreeMap<[u32; 2], u8>, options: ShapeOptions) {
    let mut on_border = vec![false; pattern.positions.len()];
    for (edge, _) in uses.iter().filter(|(_, uses)| **uses == 1) {
        for &v in edge {
            on_border[v as usize] = true;
        }
    }
    for (v, is_border) in on_border.into_iter().enumerate() {
        let along = if is_border { options.borders } else { options.features };
        if let (Place::OnCurve(curve), Along::Keep) = (pattern.places[v], along) {
            pattern.positions[v] = curves[curve as usize].project(pattern.positions[v]).0;
            pattern.places[v] = Place::Fixed;
        }
    }
}
