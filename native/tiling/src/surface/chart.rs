//! A disk of the surface, laid flat by a conformal map (section 4.2.1), in which partitions are drawn.

use super::cut::Piece;
use glam::DVec2;
use mesh::{DVec3, NONE, Topology, TriangleMesh};
use std::f64::consts::{FRAC_PI_6, TAU};
use surface::parametrize::{Flat, lscm};

/// A chart is refused when lengths in it are scaled by more than this, smallest to greatest.
const MOST_STRETCH: f64 = 12.0;

/// Most cells across, of the grid on which curvature is gathered, and the least size of a cell, in edges: bumps smaller than
/// that are noise to panels.
const CELLS: f64 = 16.0;
const GRAIN: f64 = 2.5;

/// Parts of a border that cross by less than this, as a fraction of the map's size, touch: the two sides of a cut do.
const TOUCHING: f64 = 1e-6;

/// A disk and its map.
pub(super) struct Chart {
    /// The disk in space.
    pub mesh: TriangleMesh,
    /// Vertex of the whole surface for each of the disk's.
    pub origin: Vec<u32>,
    /// The disk in the plane.
    pub flat: Flat,
    /// Border vertices of the disk, counter-clockwise.
    pub border: Vec<u32>,
    /// Interior angle in space at each of them, radians.
    pub angles: Vec<f64>,
    /// Where the curvature is, radians; filled once the charts are there.
    pub curvature: Vec<(DVec2, f64)>,
}

impl Chart {
    /// The chart of a disk; the piece itself when it is none, or its map folds, overlaps or stretches too much.
    pub fn new(piece: Piece) -> Result<Self, Piece> {
        let topology = Topology::of_triangles(&piece.mesh);
        let loops = topology.border_loops();
        let used = topology.outgoing.iter().filter(|&&h| h != NONE).count() as i64;
        let euler = used - topology.edges().count() as i64 + piece.mesh.triangles.len() as i64;
        if loops.len() != 1 || euler != 1 {
            return Err(piece);
        }
        let border: Vec<u32> = loops[0].iter().map(|&h| topology.from(h)).collect();
        let Some(flat) = flattened(&piece.mesh, &border) else { return Err(piece) };
        let mut angles = vec![0.0; piece.mesh.positions.len()];
        for t in 0..piece.mesh.triangles.len() {
            let p = piece.mesh.points(t);
            for k in 0..3 {
                let (to, from) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                angles[piece.mesh.triangles[t][k] as usize] += to.angle_between(from);
            }
        }
        let angles = border.iter().map(|&v| angles[v as usize]).collect();
        Ok(Self { mesh: piece.mesh, origin: piece.origin, flat, border, angles, curvature: Vec::new() })
    }

    /// The place in space of a point of the plane.
    pub fn lift(&self, p: DVec2) -> DVec3 {
        self.flat.locate(p).map_or(DVec3::ZERO, |location| location.point(&self.mesh))
    }

    /// Curvature inside a polygon, positive and negative, in units of 30 degrees.
    pub fn curvature_within(&self, polygon: &[DVec2]) -> [f64; 2] {
        let (low, high) = polygon.iter().fold((polygon[0], polygon[0]), |(l, h), &p| (l.min(p), h.max(p)));
        let is_inside = |p: DVec2| p.cmpge(low).all() && p.cmple(high).all() && contains(polygon, p);
        signed(self.curvature.iter().filter(|(p, _)| is_inside(*p)).map(|(_, k)| *k))
    }

    /// Curvature of the whole chart, positive and negative, in units of 30 degrees.
    pub fn whole_curvature(&self) -> [f64; 2] {
        signed(self.curvature.iter().map(|(_, k)| *k))
    }

    /// Area in space.
    pub fn area(&self) -> f64 {
        (0..self.mesh.triangles.len()).map(|t| self.mesh.area_normal(t).length() / 2.0).sum()
    }

    /// Gathers the curvature of the triangles, radians at each of their vertices, on a grid.
    pub fn gather(&mut self, of_vertex: &[f64], edge_length: f64) {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &p in &self.flat.uv {
            (low, high) = (low.min(p), high.max(p));
        }
        let flat_area: f64 = self
            .mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| self.flat.uv[v as usize]))
            .map(|[a, b, c]| (b - a).perp_dot(c - a) / 2.0)
            .sum();
        let scale = (flat_area / self.area().max(f64::MIN_POSITIVE)).sqrt();
        let cell = ((high - low).max_element() / CELLS).max(GRAIN * edge_length * scale).max(f64::MIN_POSITIVE);
        let mut cells = std::collections::BTreeMap::new();
        for corners in &self.mesh.triangles {
            let middle = corners.iter().map(|&v| self.flat.uv[v as usize]).sum::<DVec2>() / 3.0;
            let curvature: f64 = corners.iter().map(|&v| of_vertex[self.origin[v as usize] as usize]).sum();
            let key = ((middle - low) / cell).as_ivec2();
            let entry: &mut (DVec2, f64, f64) = cells.entry((key.x, key.y)).or_insert((DVec2::ZERO, 0.0, 0.0));
            entry.0 += middle;
            entry.1 += curvature;
            entry.2 += 1.0;
        }
        self.curvature = cells.into_values().map(|(sum, curvature, count)| (sum / count, curvature)).collect();
    }
}

/// Sums of what is positive and what is negative, radians into units of 30 degrees.
pub(super) fn signed(curvatures: impl Iterator<Item = f64>) -> [f64; 2] {
    curvatures.fold([0.0, 0.0], |[plus, minus], k| [plus + k.max(0.0) / FRAC_PI_6, minus + k.min(0.0) / FRAC_PI_6])
}

/// Angle defect of each vertex inside, radians, over the triangles at it: what each of them holds.
pub(super) fn vertex_curvature(mesh: &TriangleMesh) -> Vec<f64> {
    let topology = Topology::of_triangles(mesh);
    let mut defect = vec![TAU; mesh.positions.len()];
    let mut count = vec![0.0; mesh.positions.len()];
    for t in 0..mesh.triangles.len() {
        let p = mesh.points(t);
        for k in 0..3 {
            let v = mesh.triangles[t][k] as usize;
            defect[v] -= (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
            count[v] += 1.0;
        }
    }
    (0..defect.len())
        .map(|v| if topology.is_border_vertex(v as u32) || count[v] == 0.0 { 0.0 } else { defect[v] / count[v] })
        .collect()
}

/// A one-to-one conformal map; `None` when it folds, overlaps or stretches too much.
fn flattened(mesh: &TriangleMesh, border: &[u32]) -> Option<Flat> {
    // Pins: a border vertex and the one farthest from it in space.
    let from = |v: u32| {
        let p = mesh.positions[v as usize];
        border.iter().copied().max_by(|&a, &b| {
            let distance = |w: u32| mesh.positions[w as usize].distance(p);
            distance(a).total_cmp(&distance(b))
        })
    };
    let a = from(border[0])?;
    let b = from(a)?;
    let apart = mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let flat = lscm(mesh, &[(a, DVec2::ZERO), (b, DVec2::new(apart, 0.0))]).ok()?;
    if !flat.flipped().is_empty() || !is_simple(&border.iter().map(|&v| flat.uv[v as usize]).collect::<Vec<_>>()) {
        return None;
    }
    let mut scales: Vec<f64> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.triangles[t].map(|v| flat.uv[v as usize]);
            ((b - a).perp_dot(c - a) / mesh.area_normal(t).length()).abs().sqrt()
        })
        .collect();
    scales.sort_by(f64::total_cmp);
    let at = |fraction: f64| scales[(fraction * (scales.len() - 1) as f64) as usize];
    (at(0.99) <= MOST_STRETCH * at(0.01)).then_some(flat)
}

/// Whether a closed polygon does not cross itself; parts that touch do not cross.
fn is_simple(polygon: &[DVec2]) -> bool {
    let n = polygon.len();
    let (low, high) = polygon.iter().fold((polygon[0], polygon[0]), |(l, h), &p| (l.min(p), h.max(p)));
    let touching = TOUCHING * (high - low).max_element();
    // By their lowest x, so that each is compared with those beside it only.
    let segment = |k: usize| [polygon[k], polygon[(k + 1) % n]];
    let left = |k: usize| segment(k)[0].x.min(segment(k)[1].x);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| left(a).total_cmp(&left(b)).then(a.cmp(&b)));
    order.iter().enumerate().all(|(k, &i)| {
        let [a, b] = segment(i);
        let right = a.x.max(b.x);
        order[k + 1..].iter().take_while(|&&j| left(j) <= right).all(|&j| {
            let [c, d] = segment(j);
            let along = (b - a).normalize_or_zero();
            let off = [c, d].map(|p| along.perp_dot(p - a));
            let is_neighbour = (i + 1) % n == j || (j + 1) % n == i;
            is_neighbour || off[0].abs().min(off[1].abs()) <= touching || !cross([a, b], [c, d])
        })
    })
}

/// Whether two segments cross.
pub(super) fn cross([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// Whether a point lies inside a polygon.
pub(super) fn contains(polygon: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    let mut before = polygon[polygon.len() - 1];
    for &here in polygon {
        if (here.y > p.y) != (before.y > p.y) {
            let x = here.x + (p.y - here.y) / (before.y - here.y) * (before.x - here.x);
            inside ^= p.x < x;
        }
        before = here;
    }
    inside
}
