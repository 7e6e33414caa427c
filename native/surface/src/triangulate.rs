//! Polygons become triangles, each of which knows the face it is part of: the papers' methods take triangles, Blender's
//! meshes have any faces.
//!
//! Quads are split along the shorter diagonal that lies inside, larger faces by cutting off their best ears. A diagonal
//! that joins two vertices which an edge joins already would give that edge more than two triangles: it gets a vertex in its
//! middle.

use mesh::{DVec3, PolygonMesh, TriangleMesh, face_normal, sorted};
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashSet};

/// A point this near to an ear's diagonal counts as in its way, as a part of the ear's area.
const IN_THE_WAY: f64 = 1e-9;

/// The triangles of a polygon mesh.
#[derive(Debug, Default)]
pub struct Triangulated {
    /// The vertices of the polygon mesh, then those added.
    pub mesh: TriangleMesh,
    /// For each triangle the face it is part of.
    pub face: Vec<u32>,
    /// For each triangle three corners of that face, as indices into `corner_verts`, whose triangle it lies in.
    pub corners: Vec<[u32; 3]>,
    /// The position of every corner of the polygon mesh.
    pub corner_positions: Vec<DVec3>,
    /// For each vertex added the two it lies half-way between.
    pub halves: Vec<[u32; 2]>,
}

/// Triangulates faces that name no vertex twice. O(n log n) for n corners, but quadratic in the corners of a single face.
pub fn triangulate(polygons: &PolygonMesh) -> Triangulated {
    let mut made = Triangulated {
        mesh: TriangleMesh { positions: polygons.positions.clone(), triangles: vec![] },
        corner_positions: polygons.corner_verts().iter().map(|&v| polygons.positions[v as usize]).collect(),
        ..Triangulated::default()
    };
    // Only asked whether it holds an edge, so its order does not matter.
    let mut edges: HashSet<[u32; 2]> = polygons.faces().flat_map(sides).collect();
    for (f, face) in polygons.faces().enumerate() {
        let points: Vec<DVec3> = polygons.face_points(f).collect();
        let first = polygons.face_corners(f).start as u32;
        let local = match face.len() {
            3 => vec![[0, 1, 2]],
            4 => split_quad(&points),
            _ => cut_ears(&points),
        };
        let from = made.mesh.triangles.len();
        for triangle in local {
            made.mesh.triangles.push(triangle.map(|k| face[k]));
            made.corners.push(triangle.map(|k| first + k as u32));
        }
        let own: HashSet<[u32; 2]> = sides(face).collect();
        let diagonals: BTreeSet<[u32; 2]> =
            made.mesh.triangles[from..].iter().flat_map(|t| sides(t)).filter(|side| !own.contains(side)).collect();
        for diagonal in diagonals {
            if !edges.insert(diagonal) {
                made.halve(diagonal, from);
            }
        }
        made.face.resize(made.mesh.triangles.len(), f as u32);
    }
    made
}

impl Triangulated {
    /// Puts a vertex into the middle of a line between triangles from the one given on.
    fn halve(&mut self, ends: [u32; 2], from: usize) {
        let middle = self.mesh.positions.len() as u32;
        let [a, b] = ends.map(|v| self.mesh.positions[v as usize]);
        self.mesh.positions.push(a.midpoint(b));
        self.halves.push(ends);
        for t in from..self.mesh.triangles.len() {
            let triangle = self.mesh.triangles[t];
            if ends.iter().all(|end| triangle.contains(end)) {
                let with = |old: u32| triangle.map(|v| if v == old { middle } else { v });
                self.mesh.triangles[t] = with(ends[0]);
                self.mesh.triangles.push(with(ends[1]));
                self.corners.push(self.corners[t]);
            }
        }
    }

    /// A value at every vertex from those of the polygon mesh: geometric means half-way.
    pub fn spread(&self, given: &[f64]) -> Vec<f64> {
        let mut values = given.to_vec();
        if !given.is_empty() {
            values
                .extend(self.halves.iter().map(|ends| ends.map(|v| given[v as usize]).iter().product::<f64>().sqrt()));
        }
        values
    }
}

fn sides(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|k| sorted(face[k], face[(k + 1) % face.len()]))
}

/// Along the shorter diagonal; of a quad that is not convex along the one inside.
fn split_quad(p: &[DVec3]) -> Vec<[usize; 3]> {
    let normal = face_normal(p);
    let upright = |t: &[usize; 3]| (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).dot(normal) > 0.0;
    let mut ways = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
    if p[0].distance(p[2]) > p[1].distance(p[3]) {
        ways.reverse();
    }
    ways.iter().find(|way| way.iter().all(upright)).unwrap_or(&ways[0]).to_vec()
}

/// Cuts off the corner whose triangle is nearest to equilateral and holds no other corner, until a triangle is left.
fn cut_ears(points: &[DVec3]) -> Vec<[usize; 3]> {
    let normal = face_normal(points);
    let n = points.len();
    let (mut before, mut after): (Vec<usize>, Vec<usize>) =
        ((0..n).map(|k| (k + n - 1) % n).collect(), (0..n).map(|k| (k + 1) % n).collect());
    let area = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(points[c] - points[a]).dot(normal);
    let quality = |t: [usize; 3]| {
        let squares: f64 = (0..3).map(|k| points[t[k]].distance_squared(points[t[(k + 1) % 3]])).sum();
        if squares > 0.0 { area(t) / squares } else { 0.0 }
    };
    // The best last; of equal ones the corner that comes first. Bits of numbers from 0 up are in the numbers' order.
    let key = |t: [usize; 3]| (quality(t).max(0.0).to_bits(), Reverse(t[1]));
    let ear = |before: &[usize], after: &[usize], k: usize| [before[k], k, after[k]];
    let mut queue: BTreeSet<(u64, Reverse<usize>)> = (0..n).map(|k| key(ear(&before, &after, k))).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    while queue.len() > 3 {
        let is_free = |k: usize| {
            let [a, b, c] = ear(&before, &after, k);
            let size = area([a, b, c]);
            let inside = |&q: &usize| {
                let parts = [area([a, b, q]), area([b, c, q]), area([c, a, q])];
                let at_corner = [a, b, c].iter().any(|&corner| points[corner] == points[q]);
                !at_corner && parts.iter().all(|&part| part >= -IN_THE_WAY * size)
            };
            let others = std::iter::successors(Some(after[c]), |&q| Some(after[q])).take_while(|&q| q != a);
            size > 0.0 && !others.into_iter().any(|q| inside(&q))
        };
        // A face that crosses itself may have no ear: then the best corner goes all the same.
        let best = queue.iter().rev().find(|(_, k)| is_free(k.0)).or_else(|| queue.last()).copied();
        let Some((_, Reverse(k))) = best else { break };
        let [a, _, c] = ear(&before, &after, k);
        for end in [a, k, c] {
            queue.remove(&key(ear(&before, &after, end)));
        }
        triangles.push([a, k, c]);
        (after[a], before[c]) = (c, a);
        for end in [a, c] {
            queue.insert(key(ear(&before, &after, end)));
        }
    }
    if let Some(&(_, Reverse(k))) = queue.first() {
        triangles.push(ear(&before, &after, k));
    }
    triangles
}

#[cfg(test)]
#[path = "triangulate_tests.rs"]
mod tests;
