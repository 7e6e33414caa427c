//! One vertex and the quads around it: how good they are, and where the vertex would make them better.
//!
//! Shared by the smoothing of whole patches ([`crate::smooth`]) and by the topological search, which smooths a few
//! vertices after every change. The energy is the barrier of the corner Jacobian after Escobar et al., "Simultaneous
//! untangling and smoothing of tetrahedral meshes", 2003: finite for inverted corners too, so a tangled start needs no
//! special case. Deviation: the Jacobian is measured against the normal of the reference surface, so that a quad
//! folded over on the surface counts as inverted although its own plane does not show it.

use glam::DVec3;
use mesh::{NONE, nearest_on_segment, scaled_jacobian, split_quad};

/// A foot point on a reference surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The closest point.
    pub point: DVec3,
    /// Unit outward normal there.
    pub normal: DVec3,
}

/// A surface that vertices must stay on. Implement it for a triangle mesh with a closest-point tree, or for an analytic shape.
pub trait Reference: Sync {
    /// The point of the surface closest to `point`, with the normal there. `under` may be a triangle near the answer to begin with, and is
    /// the one below it afterwards; a surface that has no triangles leaves it alone.
    fn project_near(&self, point: DVec3, under: &mut u32) -> SurfacePoint;

    /// The same on the side that faces as `facing` does, where the surface has one: the closest point of a thin part may lie on its other
    /// side.
    fn project_facing(&self, point: DVec3, _facing: DVec3, under: &mut u32) -> SurfacePoint {
        self.project_near(point, under)
    }

    /// The same, where nothing is known.
    fn project(&self, point: DVec3) -> SurfacePoint {
        self.project_near(point, &mut { NONE })
    }

    /// The same, where it is sure to be the same whatever triangle is taken to be near; else `None`. For those that ask often.
    fn project_surely(&self, _point: DVec3, _under: &mut u32) -> Option<SurfacePoint> {
        None
    }

    /// The normal under the middle of a quad, on the side where its corners are: those lie on the surface.
    fn normal_under(&self, corners: [DVec3; 4], under: &mut u32) -> DVec3 {
        self.normal_with(corners, [None; 4], under)
    }

    /// The same where the feet of some corners are known from [`Reference::project_surely`], with the triangles below them.
    fn normal_with(&self, corners: [DVec3; 4], feet: [Option<(SurfacePoint, u32)>; 4], under: &mut u32) -> DVec3 {
        let foot = |(p, known): (DVec3, Option<(SurfacePoint, u32)>)| {
            let Some((foot, below)) = known else { return self.project_near(p, under) };
            *under = below;
            foot
        };
        let facing = corners.into_iter().zip(feet).map(foot).map(|foot| foot.normal).sum();
        self.project_facing(corners.iter().sum::<DVec3>() / 4.0, facing, under).normal
    }
}

/// A polyline measured by arc length, closed when its last point equals its first.
#[derive(Debug, Clone)]
pub struct Polyline {
    points: Vec<DVec3>,
    arc: Vec<f64>,
}

impl Polyline {
    /// Takes the points in order. Costs O(n).
    pub fn new(points: Vec<DVec3>) -> Self {
        let mut arc = Vec::with_capacity(points.len());
        let mut length = 0.0;
        for (i, p) in points.iter().enumerate() {
            if i > 0 {
                length += p.distance(points[i - 1]);
            }
            arc.push(length);
        }
        Self { points, arc }
    }

    /// Whole length, scene units.
    pub fn length(&self) -> f64 {
        self.arc.last().copied().unwrap_or(0.0)
    }

    fn is_closed(&self) -> bool {
        self.points.len() > 2 && self.points.first() == self.points.last()
    }

    /// The point at arc length `t`: wrapped on a closed polyline, clamped to the ends of an open one.
    ///
    /// # Panics
    /// When the polyline has no points.
    pub fn at(&self, t: f64) -> DVec3 {
        let length = self.length();
        let t = if self.is_closed() { t.rem_euclid(length) } else { t.clamp(0.0, length) };
        let i = self.arc.partition_point(|&a| a <= t).clamp(1, self.points.len().max(2) - 1);
        if self.points.len() < 2 {
            return self.points[0];
        }
        let span = self.arc[i] - self.arc[i - 1];
        let s = if span > 0.0 { (t - self.arc[i - 1]) / span } else { 0.0 };
        self.points[i - 1].lerp(self.points[i], s)
    }

    /// Arc length of the point closest to `p`. Costs O(n).
    pub fn locate(&self, p: DVec3) -> f64 {
        let mut best = (f64::INFINITY, 0.0);
        for i in 1..self.points.len() {
            let (a, b) = (self.points[i - 1], self.points[i]);
            let s = nearest_on_segment(p, a, b);
            let distance = p.distance_squared(a + (b - a) * s);
            if distance < best.0 {
                best = (distance, self.arc[i - 1] + s * (self.arc[i] - self.arc[i - 1]));
            }
        }
        best.1
    }
}

/// Quality of a quad against the unit normal of its reference surface: the scaled Jacobian, but at most twice the cosine between
/// that normal and either triangle of the shorter-diagonal split. Between -1 (or -2, flipped) and 1; positive means valid.
pub fn quad_quality(p: [DVec3; 4], normal: DVec3) -> f64 {
    let least_cosine = split_quad(p)
        .iter()
        .map(|t| (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).normalize_or_zero().dot(normal))
        .fold(f64::INFINITY, f64::min);
    scaled_jacobian(p).min(2.0 * least_cosine)
}

/// What a vertex may do.
#[derive(Debug, Clone, Copy)]
pub enum Track<'a> {
    /// Slide along a polyline, from arc length `at`.
    Chain(&'a Polyline, f64),
    /// Move on a surface.
    Surface(&'a dyn Reference),
}

impl std::fmt::Debug for dyn Reference + '_ {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Reference")
    }
}

/// What a move should improve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// The sum of squared corner energies: smooth everywhere, rounds the mesh as a whole.
    Shape,
    /// A soft minimum of the quality of the quads around: lifts the worst at the cost of the others.
    Worst,
}

/// The quads round one vertex. Each quad keeps its other three corners, counter-clockwise, the normal of its reference
/// surface and the aspect wanted (length of its first edge over its second).
#[derive(Debug, Clone)]
pub struct Star {
    quads: Vec<StarQuad>,
    /// Triangle of the surface below the vertex, where the search for its foot begins; [`mesh::NONE`] when it is not known.
    pub under: u32,
    /// Squared regularisation of the Jacobian, square of an area; set by [`Star::begin`].
    delta_squared: f64,
}

#[derive(Debug, Clone, Copy)]
struct StarQuad {
    others: [DVec3; 3],
    normal: DVec3,
    aspect: f64,
    /// Energy of the corner opposite, which is the same wherever the vertex stands; set by [`Star::begin`].
    opposite: f64,
}

impl StarQuad {
    /// v squared at one corner, v = (|e1|^2 / r + |e2|^2 r) / 2h, h = (J + sqrt(J^2 + 4 d^2)) / 2; e1 runs the first way, as 0-1 and 2-3
    /// do.
    fn corner_energy(&self, first: DVec3, second: DVec3, jacobian: f64, delta_squared: f64) -> f64 {
        let h = 0.5 * (jacobian + (jacobian * jacobian + 4.0 * delta_squared).sqrt());
        let lengths = first.length_squared() / self.aspect + second.length_squared() * self.aspect;
        let v = lengths / (2.0 * h.max(f64::MIN_POSITIVE));
        v * v
    }

    fn points(&self, x: DVec3) -> [DVec3; 4] {
        [x, self.others[0], self.others[1], self.others[2]]
    }
}

/// Jacobian of corner `k`: twice the signed area of the triangle it spans, seen along `normal`.
fn corner_jacobian(p: &[DVec3; 4], k: usize, normal: DVec3) -> f64 {
    (p[(k + 1) & 3] - p[k]).cross(p[(k + 3) & 3] - p[k]).dot(normal)
}

/// Sharpness of the soft minimum of [`Goal::Worst`].
const SOFT_MINIMUM: f64 = 14.0;
/// A move may not push the worst quad round a vertex below this, or further down when it is there already.
const FLOOR: f64 = 0.3;
/// Nor may it bring the vertex nearer to a neighbour than this fraction of the mean edge: in a star that is inverted anyway, a
/// vertex slid to the end of its chain would fall on the vertex there.
const LEAST_EDGE: f64 = 0.15;

impl Default for Star {
    fn default() -> Self {
        Self { quads: Vec::new(), under: NONE, delta_squared: 0.0 }
    }
}

impl Star {
    /// Forgets the quads of the last vertex, and what is below it.
    pub fn clear(&mut self) {
        self.quads.clear();
        self.under = NONE;
    }

    /// Adds a quad whose corner 0 is the vertex; `aspect` is the wanted length of edge 0-1 over that of edge 0-3.
    pub fn push(&mut self, others: [DVec3; 3], normal: DVec3, aspect: f64) {
        self.quads.push(StarQuad { others, normal, aspect, opposite: 0.0 });
    }

    /// Worst quality round the vertex when it stands at `x`.
    pub fn quality(&self, x: DVec3) -> f64 {
        self.quads.iter().map(|q| quad_quality(q.points(x), q.normal)).fold(f64::INFINITY, f64::min)
    }

    /// Mean length of the edges at the vertex.
    fn edge_length(&self, x: DVec3) -> f64 {
        self.quads.iter().map(|q| x.distance(q.others[0]) + x.distance(q.others[2])).sum::<f64>()
            / (2.0 * self.quads.len() as f64)
    }

    /// Length of the shortest edge at the vertex.
    fn shortest_edge(&self, x: DVec3) -> f64 {
        self.quads.iter().map(|q| x.distance(q.others[0]).min(x.distance(q.others[2]))).fold(f64::INFINITY, f64::min)
    }

    /// Fixes the regularisation for the candidates of one move: small where all is well, else grown with the worst corner.
    fn begin(&mut self, x: DVec3) {
        let (mut least, mut area) = (f64::INFINITY, 0.0);
        for q in &self.quads {
            let p = q.points(x);
            area += (p[2] - p[0]).cross(p[3] - p[1]).length() / 2.0;
            for k in 0..4 {
                least = least.min(corner_jacobian(&p, k, q.normal));
            }
        }
        area /= self.quads.len() as f64;
        self.delta_squared = if least > 1e-3 * area {
            (1e-3 * area).powi(2)
        } else {
            (0.1 * area).powi(2) + 0.04 * least.min(0.0).powi(2)
        };
        self.delta_squared = self.delta_squared.max(f64::MIN_POSITIVE);
        for q in &mut self.quads {
            let (ab, bc) = (q.others[1] - q.others[0], q.others[2] - q.others[1]);
            q.opposite = q.corner_energy(bc, ab, ab.cross(bc).dot(q.normal), self.delta_squared);
        }
    }

    fn value(&self, x: DVec3, goal: Goal) -> f64 {
        match goal {
            Goal::Shape => self.quads.iter().map(|q| self.quad_energy(q, x)).sum(),
            Goal::Worst => self.quads.iter().map(|q| (-SOFT_MINIMUM * quad_quality(q.points(x), q.normal)).exp()).sum(),
        }
    }

    /// Sum over the corners.
    fn quad_energy(&self, q: &StarQuad, x: DVec3) -> f64 {
        let [a, b, c] = q.others;
        let (xa, ab, bc, cx) = (a - x, b - a, c - b, x - c);
        let corner =
            |first: DVec3, second: DVec3, jacobian: f64| q.corner_energy(first, second, jacobian, self.delta_squared);
        corner(xa, cx, cx.cross(xa).dot(q.normal))
            + corner(xa, ab, xa.cross(ab).dot(q.normal))
            + q.opposite
            + corner(bc, cx, bc.cross(cx).dot(q.normal))
    }

    /// Looks for a better place for a vertex at `x`: a pattern search of radius `step` (a fraction of the mean edge, adapted) with a
    /// parabola fitted along each direction. Returns the new place and, on a chain, its arc length; `None` when nothing better was
    /// found. A move never makes a valid star invalid. Costs about eight evaluations of the star and one or two projections.
    pub fn relax(&mut self, x: DVec3, track: &Track<'_>, goal: Goal, step: &mut f64) -> Option<(DVec3, f64)> {
        if self.quads.is_empty() {
            return None;
        }
        self.begin(x);
        let scale = self.edge_length(x);
        let radius = *step * scale;
        let before = self.value(x, goal);
        let found = match *track {
            Track::Chain(line, at) => {
                let along = |s: f64| self.value(line.at(at + s), goal);
                let s = best_offset(before, along(-radius), along(radius), radius);
                // A vertex of a chain is on it already: the only question is how far to slide.
                self.first_better(before, x, goal, [s, s * 0.4].into_iter().map(|s| (line.at(at + s), at + s)))
            }
            Track::Surface(surface) => {
                let normal = self.quads.iter().map(|q| q.normal).sum::<DVec3>().normalize_or_zero();
                if normal == DVec3::ZERO {
                    return None;
                }
                let (u, v) = normal.any_orthonormal_pair();
                let along = |axis: DVec3| {
                    let (back, forth) = (self.value(x - axis * radius, goal), self.value(x + axis * radius, goal));
                    (best_offset(before, back, forth, radius), back.min(forth))
                };
                let ((a, best_a), (b, best_b)) = (along(u), along(v));
                let diagonal = u * a + v * b;
                let axis = if best_a < best_b { u * a } else { v * b };
                // Between its neighbours a vertex escapes from a fold that no short step opens.
                let middle = self.quads.iter().map(|q| q.others[0]).sum::<DVec3>() / self.quads.len() as f64 - x;
                let candidates = [diagonal, axis, middle].map(|offset| (self.value(x + offset, goal), offset));
                let (_, planar) = candidates.into_iter().min_by(|p, q| p.0.total_cmp(&q.0))?;
                let mut under = self.under;
                let places = [planar, planar * 0.4].into_iter().filter_map(|offset| {
                    let foot = surface.project_near(x + offset, &mut under);
                    // The closest point of a thin part may lie on its other side. Going on to the nearest on this side, round the rim, was
                    // worse: it overtook its neighbours.
                    (foot.normal.dot(normal) > 0.0).then_some((foot.point, 0.0))
                });
                let found = self.first_better(before, x, goal, places);
                self.under = under;
                found
            }
        };
        *step = if let Some((place, _)) = found {
            (0.5 * (*step + place.distance(x) / scale.max(f64::MIN_POSITIVE))).clamp(1e-3, 0.3)
        } else {
            (*step * 0.5).max(1e-3)
        };
        found
    }

    fn first_better(
        &self,
        before: f64,
        x: DVec3,
        goal: Goal,
        mut places: impl Iterator<Item = (DVec3, f64)>,
    ) -> Option<(DVec3, f64)> {
        // Most places are good enough whatever there was at `x`.
        let is_no_worse = |quality: f64| quality >= FLOOR - 1e-12 || quality >= self.quality(x).min(FLOOR) - 1e-12;
        let room = LEAST_EDGE * self.edge_length(x);
        let has_room = |shortest: f64| shortest >= room || shortest >= self.shortest_edge(x).min(room);
        places.find(|&(place, _)| {
            self.value(place, goal) < before * (1.0 - 1e-9)
                && is_no_worse(self.quality(place))
                && has_room(self.shortest_edge(place))
        })
    }
}

/// Minimum of the parabola through (-radius, back), (0, here), (radius, forth), at most two radii away; the better end where it has none.
fn best_offset(here: f64, back: f64, forth: f64, radius: f64) -> f64 {
    let curvature = back + forth - 2.0 * here;
    if curvature > 0.0 && curvature.is_finite() {
        (0.5 * radius * (back - forth) / curvature).clamp(-2.0 * radius, 2.0 * radius)
    } else if back < forth {
        -radius
    } else {
        radius
    }
}
