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
    tolerance: f64,
    pub mesh: TriangleMesh,
    /// The input triangle that each triangle is part of.
    pub source: Vec<u32>,
    /// Edges of its border that lie in the plane.
    pub border_in_plane: BTreeSet<[u32; 2]>,
    /// Where such a border meets another one.
    meeting: Vec<u32>,
    topology: Topology,
    /// For each input vertex 1 before the plane, 0 on it, -1 behind it.
    side: Vec<i32>,
    /// Its vertex at an input vertex, given twice, or on an edge that the plane cuts.
    known: BTreeMap<[u32; 2], u32>,
    /// For each vertex the two input vertices it lies between, and how far from the first to the second.
    between: Vec<([u32; 2], f64)>,
}

/// Cuts a surface at a plane with a normal of length 1 and keeps what lies before it. Triangles in the plane are left out. Where
/// the kept part touches itself in a vertex of the plane, it comes apart. O(n log n).
pub(crate) fn halve(mesh: &TriangleMesh, plane: Plane, tolerance: f64) -> Half {
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
    let Cutter { mut positions, mut between, known, .. } = cutter;
    come_apart(&mut triangles, &mut positions, &mut between);
    let half = TriangleMesh { positions, triangles };
    let topology = Topology::of_triangles(&half);
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
    let meeting = (0..kinds.len() as u32).filter(|&v| kinds[v as usize] == [true; 2]).collect();
    Half { plane, tolerance, mesh: half, source, border_in_plane, meeting, topology, side, known, between }
}

impl Half {
    /// What is left of features. Where the cut meets another border there is a marked vertex.
    pub fn features(&self, features: &Features) -> Features {
        let side_of = |v: u32| self.side[v as usize];
        let own = |v: u32| self.known.get(&[v, v]).copied();
        let topology = &self.topology;
        let mut edges: Vec<[u32; 2]> = features
            .edges
            .iter()
            .filter_map(|&[a, b]| match side_of(a) * side_of(b) {
                -1 => self.known.get(&sorted(a, b)).copied().zip(own(if side_of(a) > 0 { a } else { b })),
                _ => own(a).zip(own(b)),
            })
            .map(|(a, b)| sorted(a, b))
            .collect();
        // Marks between vertices of the plane need not be edges of the half, or belong to a copy of their vertex.
        edges.retain(|&[a, b]| topology.find(a, b).or_else(|| topology.find(b, a)).is_some());
        let mut vertices: Vec<u32> = features.vertices.iter().filter_map(|&v| own(v)).collect();
        vertices.retain(|&v| topology.outgoing[v as usize] != NONE);
        vertices.extend(&self.meeting);
        vertices.sort_unstable();
        vertices.dedup();
        Features { edges, vertices }
    }

    /// True for points of the plane.
    pub fn is_on(&self, p: DVec3) -> bool {
        self.plane.distance(p).abs() <= self.tolerance
    }

    /// The input vertices that a vertex lies between, the same one twice at an input vertex; none for a vertex added later.
    pub fn between(&self, v: u32) -> Option<[u32; 2]> {
        self.between.get(v as usize).map(|between| between.0)
    }

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
