//! A piece of the surface between fixed edges, what it is projected to, and the one measure all operations are judged by.

use super::{RemeshOptions, area_normal};
use crate::closest::{ClosestPoint, Projection};
use crate::editable::Editable;
use glam::DVec3;
use mesh::{NONE, TriangleMesh};

/// Input triangles thinner than this, height over longest edge, have no normal to speak of and carry no projection.
const THIN: f64 = 1e-7;

/// The part of the input surface that one piece may touch.
struct Side {
    closest: ClosestPoint,
    normals: Vec<DVec3>,
    sizes: Vec<[f64; 3]>,
    /// Input triangle of each of its triangles.
    input: Vec<u32>,
}

/// A piece in the making.
pub(super) struct Piece {
    pub mesh: Editable,
    side: Side,
    /// Unit normal of the surface at each vertex.
    pub normal: Vec<DVec3>,
    /// Target edge length at each vertex.
    pub size: Vec<f64>,
    /// Triangle of the side near each vertex, to start the next projection from.
    hint: Vec<u32>,
    /// Border and fixed vertices: a prefix of the vertices may be, no new vertex ever is.
    fixed: Vec<bool>,
    /// Valence that a vertex would have in a mesh of equilateral triangles.
    pub ideal_valence: Vec<usize>,
    cos_limit: f64,
}

impl Piece {
    pub fn new(
        mesh: Editable,
        fixed: Vec<bool>,
        surface: &TriangleMesh,
        size: &[f64],
        options: &RemeshOptions,
    ) -> Self {
        let is_thick = |t: &u32| {
            let p = surface.points(*t as usize);
            let longest = (0..3).map(|k| p[k].distance_squared(p[(k + 1) % 3])).fold(0.0, f64::max);
            area_normal(p).length() > THIN * longest
        };
        let mut input: Vec<u32> = mesh.source.iter().copied().filter(is_thick).collect();
        if input.is_empty() {
            input.clone_from(&mesh.source);
        }
        let triangles: Vec<[u32; 3]> = input.iter().map(|&t| surface.triangles[t as usize]).collect();
        let normals = input.iter().map(|&t| surface.area_normal(t as usize).normalize_or_zero()).collect();
        let sizes = triangles.iter().map(|t| t.map(|v| size[v as usize])).collect();
        let closest = ClosestPoint::new(&TriangleMesh { positions: surface.positions.clone(), triangles });
        let side = Side { closest, normals, sizes, input };
        let count = mesh.vertex_slots();
        let mut piece = Self {
            size: (0..count).map(|v| size[mesh.identity[v as usize] as usize]).collect(),
            normal: vec![DVec3::ZERO; count as usize],
            hint: vec![NONE; count as usize],
            ideal_valence: vec![6; count as usize],
            mesh,
            side,
            fixed,
            cos_limit: options.normal_limit.cos(),
        };
        for v in 0..count {
            piece.place_initially(v);
        }
        piece
    }

    /// Normal and ideal valence of an input vertex from the triangles around it.
    fn place_initially(&mut self, v: u32) {
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for h in self.mesh.around(v) {
            let corner = [v, self.mesh.to(h), self.mesh.apex(h)].map(|u| self.mesh.positions[u as usize]);
            let longest = (0..3).map(|k| corner[k].distance_squared(corner[(k + 1) % 3])).fold(0.0, f64::max);
            let angle = (corner[1] - corner[0]).angle_between(corner[2] - corner[0]);
            let normal = area_normal(corner);
            if angle.is_finite() {
                total += angle;
                if normal.length() > THIN * longest {
                    sum += normal.normalize() * angle;
                }
            }
        }
        let found = self.side.closest.project(self.mesh.positions[v as usize]);
        self.hint[v as usize] = found.triangle;
        self.normal[v as usize] = sum.try_normalize().unwrap_or_else(|| self.normal_at(&found));
        if self.mesh.is_border_vertex(v) {
            self.ideal_valence[v as usize] = ((total / std::f64::consts::FRAC_PI_3).round() as usize).max(1) + 1;
        }
    }

    pub fn is_fixed(&self, v: u32) -> bool {
        self.fixed.get(v as usize).copied().unwrap_or(false)
    }

    /// Fixed vertices with their input vertices.
    pub fn fixed_vertices(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        (0..self.fixed.len()).filter(|&v| self.fixed[v]).map(|v| (v as u32, self.mesh.identity[v]))
    }

    /// The input triangle nearest to the centroid of `t`.
    pub fn nearest_input(&self, t: u32) -> u32 {
        let corners = self.mesh.corners(t);
        let centroid = corners.map(|v| self.mesh.positions[v as usize]).iter().sum::<DVec3>() / 3.0;
        let found = self.side.closest.project_near(centroid, self.hint[corners[0] as usize]);
        // Only a coordinate too large to square finds nothing.
        self.side.input.get(found.triangle as usize).copied().unwrap_or(self.mesh.source[t as usize])
    }

    pub fn project(&self, p: DVec3, near: u32) -> Projection {
        self.side.closest.project_near(p, self.hint[near as usize])
    }

    pub fn normal_at(&self, found: &Projection) -> DVec3 {
        self.side.normals.get(found.triangle as usize).copied().unwrap_or(DVec3::ZERO)
    }

    fn size_at(&self, found: &Projection) -> f64 {
        let sizes = &self.side.sizes[found.triangle as usize];
        (0..3).map(|k| sizes[k] * found.barycentric[k]).sum()
    }

    /// Moves a free vertex onto the surface at `found`.
    pub fn settle(&mut self, v: u32, found: &Projection) {
        let i = v as usize;
        self.mesh.positions[i] = found.point;
        self.anchor(v, found);
    }

    /// Takes size and normal of a vertex from the surface at `found`, without moving it.
    pub fn anchor(&mut self, v: u32, found: &Projection) {
        let i = v as usize;
        self.normal[i] = self.normal_at(found);
        self.size[i] = self.size_at(found);
        self.hint[i] = found.triangle;
    }

    /// Splits an edge at its midpoint and puts that on the surface when the triangles around it allow. Does nothing, and
    /// says so, where coordinates are too large to find the surface.
    pub fn split(&mut self, h: u32) -> bool {
        let (a, b) = (self.mesh.from(h), self.mesh.to(h));
        let midpoint = (self.mesh.positions[a as usize] + self.mesh.positions[b as usize]) / 2.0;
        let found = self.project(midpoint, a);
        if found.triangle == NONE {
            return false;
        }
        let m = self.mesh.split(h, midpoint);
        let i = m as usize;
        self.normal.push(DVec3::ZERO);
        self.size.push(0.0);
        self.hint.push(NONE);
        self.ideal_valence.push(6);
        self.anchor(m, &found);
        let before = self.worst_around(m, midpoint, self.normal[i]);
        if passable(self.worst_around(m, found.point, self.normal[i]), before) {
            self.mesh.positions[i] = found.point;
        }
        true
    }

    /// Length of an edge relative to the target at its ends.
    pub fn relative_length(&self, a: u32, b: u32) -> f64 {
        let (i, j) = (a as usize, b as usize);
        2.0 * self.mesh.positions[i].distance(self.mesh.positions[j]) / (self.size[i] + self.size[j])
    }

    /// Shape of a triangle: 1 if equilateral, towards 0 for needles, negative when turned too far from the surface. A
    /// needle that stands on a tiny fixed edge cannot be helped and counts as 1: it must not outweigh its neighbours.
    pub fn shape(&self, corners: [u32; 3]) -> f64 {
        let p = corners.map(|v| self.mesh.positions[v as usize]);
        let n = corners.map(|v| self.normal[v as usize]);
        let shape = shape(p, n[0] + n[1] + n[2], self.cos_limit);
        let is_stuck = || (0..3).any(|k| self.is_tiny_and_fixed(corners[k], corners[(k + 1) % 3]));
        if shape < NEEDLE && is_stuck() { excused(shape, self.cos_limit) } else { shape }
    }

    fn is_tiny_and_fixed(&self, a: u32, b: u32) -> bool {
        self.is_fixed(a) && self.is_fixed(b) && self.relative_length(a, b) < TINY
    }

    /// Shape of the worst triangle around a free vertex `v` if it stood at `p`, where the surface has the normal `n`.
    pub fn worst_around(&self, v: u32, p: DVec3, n: DVec3) -> f64 {
        self.mesh
            .around(v)
            .map(|h| {
                let (a, b) = (self.mesh.to(h), self.mesh.apex(h));
                let (i, j) = (a as usize, b as usize);
                let at = &self.mesh.positions;
                let shape = shape([p, at[i], at[j]], n + self.normal[i] + self.normal[j], self.cos_limit);
                if shape < NEEDLE && self.is_tiny_and_fixed(a, b) { excused(shape, self.cos_limit) } else { shape }
            })
            .fold(1.0, f64::min)
    }
}

/// A fixed edge shorter than this, relative to the target, leaves nothing but needles beside it.
const TINY: f64 = 0.15;

/// The shape of an unavoidable needle: perfect unless turned over.
fn excused(shape: f64, cos_limit: f64) -> f64 {
    if shape >= -cos_limit { 1.0 } else { shape }
}

/// A triangle below this shape is a needle (an equilateral one squeezed to about a tenth of its height).
pub(super) const NEEDLE: f64 = 0.2;

/// The rule for every operation: what it leaves must be neither turned nor a needle, or else better than what was there.
pub(super) fn passable(after: f64, before: f64) -> bool {
    after >= NEEDLE || after > before
}

/// Mean-ratio shape, `2 sqrt 3` times the double area over the sum of squared edges; negative beyond the normal limit.
fn shape(p: [DVec3; 3], reference: DVec3, cos_limit: f64) -> f64 {
    let normal = area_normal(p);
    let double_area = normal.length();
    let squares: f64 = (0..3).map(|k| p[k].distance_squared(p[(k + 1) % 3])).sum();
    let ratio = 2.0 * 3_f64.sqrt() * double_area / squares;
    if ratio.is_nan() || ratio < 1e-9 {
        // Without area there is no normal: as bad as standing upright on the surface.
        return -cos_limit;
    }
    let cos = normal.dot(reference) / (double_area * reference.length());
    if cos >= cos_limit { ratio } else { (cos - cos_limit).min(-f64::MIN_POSITIVE) }
}
