//! The half of a surface on one side of a plane, with its features. For [`crate::symmetry`].

use crate::features::Features;
use crate::symmetry::Plane;
use mesh::{DVec3, NONE, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// What lies on the side that the plane's normal points to.
#[derive(Debug)]
pub(crate) struct Half {
    pub plane: Plane,
    /// Distance from the plane up to which a vertex is on it.
    pub tolerance: f64,
    pub mesh: TriangleMesh,
    /// The input triangle that each triangle is part of.
    pub source: Vec<u32>,
    /// What is left of the features. Where the cut meets another border there is a marked vertex.
    pub features: Features,
    /// Marked edges in the plane.
    pub marked_in_plane: BTreeSet<[u32; 2]>,
    /// For each vertex the two input vertices it lies between, and how far from the first to the second.
    between: Vec<([u32; 2], f64)>,
}

/// Cuts a surface at a plane with a normal of length 1 and keeps what lies before it. Triangles in the plane are left out. Where
/// the kept part touches itself in a vertex of the plane, it comes apart. O(n log n).
pub(crate) fn halve(mesh: &TriangleMesh, features: &Features, plane: Plane, tolerance: f64) -> Half {
    let side: Vec<i32> = mesh
        .positions
        .iter()
        .map(|&p| plane.distance(p))
        .map(|d| if d > tolerance { 1 } else { -i32::from(d < -tolerance) })
        .collect();
    let side_of = |v: u32| side[v as usize];
    let mut cutter = Cutter { mesh, plane, side: &side, known: BTreeMap::new(), positions: vec![], between: vec![] };
    let (mut triangles, mut source) = (Vec::new(), Vec::new());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        if corners.iter().all(|&v| side_of(v) <= 0) {
            continue;
        }
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if side_of(a) >= 0 {
                polygon.push(cutter.vertex(a, a));
            }
            if side_of(a) * side_of(b) < 0 {
                polygon.push(cutter.vertex(a, b));
            }
        }
        let at = |k: usize| cutter.positions[polygon[k] as usize];
        if let [a, b, c, d] = polygon[..] {
            let even = at(0).distance(at(2)) <= at(1).distance(at(3));
            triangles.extend(if even { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        } else {
            triangles.push([polygon[0], polygon[1], polygon[2]]);
        }
        source.resize(triangles.len(), t as u32);
    }
    // Marks that are on this side; the part of an edge that crosses.
    let known = &cutter.known;
    let own = |v: u32| known.get(&[v, v]).copied();
    let mut edges: Vec<[u32; 2]> = features
        .edges
        .iter()
        .filter_map(|&[a, b]| match side_of(a) * side_of(b) {
            -1 => known.get(&sorted(a, b)).copied().zip(own(if side_of(a) > 0 { a } else { b })),
            _ => own(a).zip(own(b)),
        })
        .map(|(a, b)| sorted(a, b))
        .collect();
    let mut vertices: Vec<u32> = features.vertices.iter().filter_map(|&v| own(v)).collect();

    let Cutter { mut positions, mut between, .. } = cutter;
    come_apart(&mut triangles, &mut positions, &mut between);
    let half = TriangleMesh { positions, triangles };
    let topology = Topology::of_triangles(&half);
    // Marks between vertices of the plane need not be edges of the half, or belong to a copy of their vertex.
    edges.retain(|&[a, b]| topology.find(a, b).or_else(|| topology.find(b, a)).is_some());
    vertices.retain(|&v| topology.outgoing[v as usize] != NONE);
    let in_plane = |v: u32| plane.distance(half.positions[v as usize]).abs() <= tolerance;
    let mut kinds = vec![[false; 2]; half.positions.len()];
    let mut border_in_plane = BTreeSet::new();
    for h in (0..topology.len() as u32).filter(|&h| topology.is_border(h)) {
        let ends = [topology.from(h), topology.to(h)];
        let on = ends.iter().all(|&v| in_plane(v));
        for v in ends {
            kinds[v as usize][usize::from(on)] = true;
        }
        if on {
            border_in_plane.insert(sorted(ends[0], ends[1]));
        }
    }
    vertices.extend((0..kinds.len() as u32).filter(|&v| kinds[v as usize] == [true; 2]));
    vertices.sort_unstable();
    vertices.dedup();
    let marked_in_plane = edges.iter().copied().filter(|edge| border_in_plane.contains(edge)).collect();
    Half { plane, tolerance, mesh: half, source, features: Features { edges, vertices }, marked_in_plane, between }
}

impl Half {
    /// Values at the input's vertices, at those of the half.
    pub fn interpolated(&self, values: &[f64]) -> Vec<f64> {
        self.between.iter().map(|&([a, b], t)| values[a as usize] * (1.0 - t) + values[b as usize] * t).collect()
    }
}

struct Cutter<'a> {
    mesh: &'a TriangleMesh,
    plane: Plane,
    side: &'a [i32],
    /// By input vertex, given twice, or by the ends of the edge it cuts.
    known: BTreeMap<[u32; 2], u32>,
    positions: Vec<DVec3>,
    between: Vec<([u32; 2], f64)>,
}

impl Cutter<'_> {
    /// The half's vertex on the edge from `a` to `b`, or at `a` when they are one.
    fn vertex(&mut self, a: u32, b: u32) -> u32 {
        let key = sorted(a, b);
        if let Some(&v) = self.known.get(&key) {
            return v;
        }
        let [p, q] = key.map(|v| self.mesh.positions[v as usize]);
        let (from, to) = (self.plane.distance(p), self.plane.distance(q));
        let t = if a == b { 0.0 } else { from / (from - to) };
        let on_plane = a != b || self.side[a as usize] == 0;
        let v = self.positions.len() as u32;
        self.positions.push(if on_plane { self.plane.foot(p.lerp(q, t)) } else { p });
        self.between.push((key, t));
        self.known.insert(key, v);
        v
    }
}

/// Gives every fan of triangles at a vertex a vertex of its own, with a copy of what is `known` of it; the first keeps the old
/// one. O(n).
pub(crate) fn come_apart<T: Copy>(triangles: &mut [[u32; 3]], positions: &mut Vec<DVec3>, known: &mut Vec<T>) {
    let corners: Vec<u32> = triangles.iter().flatten().copied().collect();
    let topology = Topology::new(positions.len(), triangles.iter());
    let mut fan_of = vec![NONE; corners.len()];
    let mut claimed = vec![false; positions.len()];
    for start in 0..corners.len() as u32 {
        if fan_of[start as usize] != NONE {
            continue;
        }
        let old = corners[start as usize];
        let vertex = if std::mem::replace(&mut claimed[old as usize], true) {
            positions.push(positions[old as usize]);
            known.push(known[old as usize]);
            positions.len() as u32 - 1
        } else {
            old
        };
        let mut open = vec![start];
        while let Some(h) = open.pop() {
            if fan_of[h as usize] != NONE {
                continue;
            }
            fan_of[h as usize] = vertex;
            let before = topology.twin[topology.prev[h as usize] as usize];
            let after = topology.twin[h as usize];
            open.extend([before].into_iter().filter(|&g| g != NONE));
            open.extend([after].into_iter().filter(|&g| g != NONE).map(|g| topology.next[g as usize]));
        }
    }
    for (triangle, fans) in triangles.iter_mut().zip(fan_of.chunks_exact(3)) {
        triangle.copy_from_slice(fans);
    }
}
