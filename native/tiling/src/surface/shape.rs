//! Moves the vertices of a pattern so that its tiles become regular and flat, near the surface (section 4.2.4).
//!
//! One local-global solver for all aims: each tile asks for the regular polygon nearest to it, of one size for all tiles
//! (Euclidean regularity, equal edges and planarity at once); each vertex for the point of the surface, or of its curve,
//! nearest to it. The wishes are met in the least-squares sense by one linear system whose matrix never changes, so it is
//! factored once. Deviation: the paper runs three optimisers one after another, with a general solver.
//!
//! Tiles that ask for more room than there is would buckle out of the surface. So the first rounds put every vertex back on
//! it, and only the last let it off, for planarity. Steps that turn a tile over are halved, at that tile's vertices only; those that would turn it at any length are left out.

use super::SurfaceError;
use super::curve::Curve;
use super::pattern::{Pattern, Place};
use mesh::{DVec3, Monitor, NONE, TriangleMesh};
use solve::cholesky::Factor;
use surface::closest::ClosestPoint;

/// Weight of a place on a curve against that of a tile, 1.
const ON_CURVE: f64 = 8.0;

/// Weight of a vertex's last place while it is put back on the surface every round.
const SLIDING: f64 = 0.01;

/// How much more the tip of four triangles or fewer is held to the surface: regular ones would make a spike of it.
const TIP: f64 = 10.0;

/// How often a step is halved where it turns tiles over, before it is left out.
const HALVINGS: usize = 4;

/// How hard to shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeOptions {
    /// Rounds on the surface, for regularity. Default 60; 0 leaves the pattern as it was laid.
    pub rounds: usize,
    /// Rounds near the surface, for planarity. Default 15.
    pub flattening_rounds: usize,
    /// Weight of closeness to the surface against regularity in the latter, above 0. Default 1.
    pub closeness: f64,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { rounds: 60, flattening_rounds: 15, closeness: 1.0 }
    }
}

struct Shaper<'a> {
    surface: &'a TriangleMesh,
    closest: ClosestPoint,
    curves: &'a [Curve],
    pattern: &'a Pattern,
    tiles_at: Vec<Vec<u32>>,
    /// Segment of its curve that each vertex was last nearest to.
    segment: Vec<usize>,
    /// Triangle of the surface that each vertex was last nearest to.
    triangle: Vec<u32>,
}

/// Puts the pattern on the surface and shapes it; the tiles that are turned over in the end.
pub(super) fn shape(
    surface: &TriangleMesh,
    curves: &[Curve],
    pattern: &mut Pattern,
    options: ShapeOptions,
    monitor: &Monitor,
) -> Result<Vec<u32>, SurfaceError> {
    let count = pattern.positions.len();
    let mut tiles_at = vec![Vec::new(); count];
    for (t, tile) in pattern.tiles.iter().enumerate() {
        for &v in tile {
            tiles_at[v as usize].push(t as u32);
        }
    }
    let mut shaper = Shaper {
        surface,
        closest: ClosestPoint::new(surface),
        curves,
        pattern,
        tiles_at,
        segment: vec![0; count],
        triangle: vec![NONE; count],
    };
    let mut positions = shaper.placed(&pattern.positions, monitor)?;
    let phases = [(options.rounds, SLIDING, true), (options.flattening_rounds, options.closeness, false)];
    let all = (options.rounds + options.flattening_rounds) as f64;
    let mut done = 0;
    for (rounds, closeness, is_bound) in phases {
        let factor = shaper.factor(closeness)?;
        for _ in 0..rounds {
            monitor.stage("shaping", f64::from(done) / all)?;
            done += 1;
            let mut wish = shaper.step(&positions, &factor, closeness, monitor)?;
            if is_bound {
                for (v, p) in wish.iter_mut().enumerate() {
                    *p = shaper.nearest(v, *p);
                }
            }
            shaper.guarded(&mut positions, &wish);
        }
    }
    // Borders end exactly on their curves, wherever no tile turns over by it.
    let on_curves: Vec<DVec3> = (0..count)
        .map(|v| if pattern.places[v] == Place::Free { positions[v] } else { shaper.nearest(v, positions[v]) })
        .collect();
    shaper.guarded(&mut positions, &on_curves);
    let turned = shaper.turned(&positions);
    pattern.positions = positions;
    Ok(turned)
}

impl Shaper<'_> {
    /// The nearest allowed place of a vertex.
    fn nearest(&mut self, v: usize, p: DVec3) -> DVec3 {
        match self.pattern.places[v] {
            Place::Fixed => self.pattern.positions[v],
            Place::OnCurve(curve) => {
                let (q, segment) = self.curves[curve as usize].project_near(p, self.segment[v]);
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

    fn weight(&self, v: usize, closeness: f64) -> f64 {
        match self.pattern.places[v] {
            Place::Free if self.tiles_at[v].len() <= 4 && self.is_tip(v) => TIP * closeness,
            Place::Free => closeness,
            _ => ON_CURVE,
        }
    }

    fn is_tip(&self, v: usize) -> bool {
        self.tiles_at[v].iter().all(|&t| self.pattern.tiles[t as usize].len() == 3)
    }

    /// Fixed vertices are no unknowns but rows of their own: x = place.
    fn factor(&self, closeness: f64) -> Result<Factor, SurfaceError> {
        let mut triplets = Vec::new();
        for v in 0..self.pattern.positions.len() {
            let weight = if self.is_fixed(v) { 1.0 } else { self.weight(v, closeness) };
            triplets.push((v, v, weight));
        }
        for tile in &self.pattern.tiles {
            let n = tile.len() as f64;
            for &a in tile {
                for &b in tile {
                    let (a, b) = (a as usize, b as usize);
                    if a >= b && !self.is_fixed(a) && !self.is_fixed(b) {
                        triplets.push((a, b, if a == b { 1.0 - 1.0 / n } else { -1.0 / n }));
                    }
                }
            }
        }
        Ok(Factor::new(self.pattern.positions.len(), &triplets)?)
    }

    fn is_fixed(&self, v: usize) -> bool {
        self.pattern.places[v] == Place::Fixed
    }

    /// Where all wishes taken together would have the vertices.
    fn step(
        &mut self,
        positions: &[DVec3],
        factor: &Factor,
        closeness: f64,
        monitor: &Monitor,
    ) -> Result<Vec<DVec3>, SurfaceError> {
        let count = positions.len();
        let edge = mean_edge(&self.pattern.tiles, positions);
        let mut right = vec![DVec3::ZERO; count];
        for (v, &p) in positions.iter().enumerate() {
            if v % 4096 == 0 {
                monitor.check()?;
            }
            let weight = self.weight(v, closeness);
            right[v] = if self.is_fixed(v) { self.pattern.positions[v] } else { weight * self.nearest(v, p) };
        }
        for tile in &self.pattern.tiles {
            let up = self.up(tile, positions);
            let wanted = regular(tile, positions, edge, is_turned(tile, positions, up).then_some(up));
            let n = tile.len() as f64;
            let pinned: DVec3 =
                tile.iter().filter(|&&v| self.is_fixed(v as usize)).map(|&v| self.pattern.positions[v as usize]).sum();
            for (&v, &q) in tile.iter().zip(&wanted) {
                if !self.is_fixed(v as usize) {
                    right[v as usize] += q + pinned / n;
                }
            }
        }
        let mut sides: Vec<Vec<f64>> = (0..3).map(|axis| right.iter().map(|p| p[axis]).collect()).collect();
        factor.solve_many(&mut sides)?;
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

    fn is_turned(&self, tile: &[u32], positions: &[DVec3]) -> bool {
        is_turned(tile, positions, self.up(tile, positions))
    }

    /// Tiles with a corner that faces away from the surface below their middle.
    fn turned(&self, positions: &[DVec3]) -> Vec<u32> {
        (0..self.pattern.tiles.len() as u32)
            .filter(|&t| {
                let tile = &self.pattern.tiles[t as usize];
                let middle = tile.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / tile.len() as f64;
                let below = self.closest.project(middle).triangle;
                below == NONE || is_turned(tile, positions, self.surface.area_normal(below as usize))
            })
            .collect()
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

/// Weight of a vertex's last place while a mesh without a surface is shaped: what keeps it from drifting.
const RESTING: f64 = 0.02;

/// Shapes a mesh that has no surface to keep to, for regularity alone: equilateral triangles and squares of one edge length
/// where its combinatorics allow them.
pub(super) fn regularise(
    tiles: &[Vec<u32>],
    positions: &mut [DVec3],
    rounds: usize,
    monitor: &Monitor,
) -> Result<(), SurfaceError> {
    let mut triplets: Vec<(usize, usize, f64)> = (0..positions.len()).map(|v| (v, v, RESTING)).collect();
    for tile in tiles {
        let n = tile.len() as f64;
        for &a in tile {
            for &b in tile.iter().filter(|&&b| b <= a) {
                triplets.push((a as usize, b as usize, if a == b { 1.0 - 1.0 / n } else { -1.0 / n }));
            }
        }
    }
    let factor = Factor::new(positions.len(), &triplets)?;
    for round in 0..rounds {
        monitor.stage("shaping", round as f64 / rounds as f64)?;
        let edge = mean_edge(tiles, positions);
        let mut right: Vec<DVec3> = positions.iter().map(|&p| RESTING * p).collect();
        for tile in tiles {
            for (&v, q) in tile.iter().zip(regular(tile, positions, edge, None)) {
                right[v as usize] += q;
            }
        }
        let mut sides: Vec<Vec<f64>> = (0..3).map(|axis| right.iter().map(|p| p[axis]).collect()).collect();
        factor.solve_many(&mut sides)?;
        for (v, p) in positions.iter_mut().enumerate() {
            *p = DVec3::new(sides[0][v], sides[1][v], sides[2][v]);
        }
    }
    Ok(())
}

/// Whether a corner of a tile faces away from `up`.
fn is_turned(tile: &[u32], positions: &[DVec3], up: DVec3) -> bool {
    let at = |k: usize| positions[tile[k % tile.len()] as usize];
    (0..tile.len()).any(|k| (at(k + 1) - at(k)).cross(at(k + tile.len() - 1) - at(k)).dot(up) <= 0.0)
}

/// The mean of the edges' lengths; inner edges count twice.
pub(super) fn mean_edge(tiles: &[Vec<u32>], positions: &[DVec3]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for tile in tiles {
        for k in 0..tile.len() {
            let ends = [tile[k], tile[(k + 1) % tile.len()]].map(|v| positions[v as usize]);
            sum += ends[0].distance(ends[1]);
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Corners, relative to their centre, of the regular polygon with this edge that is nearest to a tile.
///
/// With A and B the sums of the corners times cosine and sine of their place on the circle, the best plane directions are
/// the orthonormal pair nearest to (A, B): its polar factor.
/// For a tile that is turned over, `up` says where it ought to face; the nearest polygon is then sought in that plane.
fn regular(tile: &[u32], positions: &[DVec3], edge: f64, up: Option<DVec3>) -> Vec<DVec3> {
    let n = tile.len() as f64;
    let turn = |k: usize| std::f64::consts::TAU * k as f64 / n;
    let (mut a, mut b) = (DVec3::ZERO, DVec3::ZERO);
    for (k, &v) in tile.iter().enumerate() {
        a += turn(k).cos() * positions[v as usize];
        b += turn(k).sin() * positions[v as usize];
    }
    let radius = edge / (2.0 * (std::f64::consts::PI / n).sin());
    let polygon =
        |u: DVec3, w: DVec3| (0..tile.len()).map(|k| radius * (turn(k).cos() * u + turn(k).sin() * w)).collect();
    if let Some(up) = up {
        let along = a + b.cross(up);
        let u = (along - along.dot(up) * up).try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
        return polygon(u, up.cross(u));
    }
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    // The inverse square root of [[aa, ab], [ab, bb]], by its closed form.
    let root = (aa * bb - ab * ab).max(0.0).sqrt();
    let trace = (aa + bb + 2.0 * root).sqrt();
    if root <= 1e-12 * (aa + bb) {
        let centre = tile.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / n;
        return tile.iter().map(|&v| positions[v as usize] - centre).collect();
    }
    let scale = 1.0 / (root * trace);
    let u = scale * ((bb + root) * a - ab * b);
    let w = scale * ((aa + root) * b - ab * a);
    polygon(u, w)
}
