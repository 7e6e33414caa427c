//! Where the attributes of the result come from: for each corner of a quad a point of an input face, for each feature edge an
//! input edge.
//!
//! A corner looks on its own side of the features only, so that a seam or a border of materials stays as sharp as it was.

use crate::base::Base;
use crate::quads::Quads;
use crate::surfaces::Ground;
use mesh::{Cancelled, DVec3, Monitor, NONE, Topology, nearest_on_segment};
use rayon::prelude::*;
use solve::components::connected_components;
use std::collections::BTreeMap;
use surface::triangulate::Triangulated;

/// How far inside its quad a corner on a feature looks for its side, as a part of the way to the quad's middle.
pub(crate) const INWARDS: f64 = 1e-3;

/// A point of an input face that a corner of the result takes its attributes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerSource {
    /// The face.
    pub face: u32,
    /// Three corners of it, as indices into the input's `corner_verts`.
    pub corners: [u32; 3],
    /// Their weights; none negative, sum 1.
    pub weights: [f64; 3],
}

/// One source for each corner of the quads. `input` lies where the base's surface does. Costs a closest point for each
/// corner on a feature.
pub(crate) fn corner_sources(input: &Triangulated, ground: &Ground<'_>, quads: &Quads) -> Vec<CornerSource> {
    let Ground { base, charts, chart_of, .. } = ground;
    let chart_of_quad = charts_of_quads(base, quads, chart_of);
    let mut on_feature = vec![false; quads.mesh.vertex_count()];
    quads.feature_edges.iter().flat_map(|edge| edge.ends).for_each(|v| on_feature[v as usize] = true);
    (0..quads.mesh.corner_verts().len())
        .into_par_iter()
        .map(|corner| {
            let v = quads.mesh.corner_verts()[corner] as usize;
            let (triangle, point) = if on_feature[v] {
                // A feature that ends inside a chart has the chart on both sides: the quad's side is a bit inwards.
                let own = quads.mesh.positions[v];
                let middle = quads.mesh.face_points(corner / 4).sum::<DVec3>() / 4.0;
                let found = charts[chart_of_quad[corner / 4] as usize].find(own.lerp(middle, INWARDS));
                (base.source[found.triangle as usize], own)
            } else {
                let source = quads.source[v];
                let [a, b, c] = base.surface.points(source.surface_triangle as usize);
                let [u, v, w] = source.barycentric;
                (source.triangle, a * u + b * v + c * w)
            };
            source_at(input, triangle, point)
        })
        .collect()
}

/// A point of one of the triangles as weights of the face's corners round it.
pub(crate) fn source_at(input: &Triangulated, triangle: u32, point: DVec3) -> CornerSource {
    let corners = input.corners[triangle as usize];
    let weights = barycentric(point, corners.map(|c| input.corner_positions[c as usize]));
    CornerSource { face: input.face[triangle as usize], corners, weights }
}

/// Weights of a triangle's corners at the point of it nearest to `point`'s projection, none negative; on a triangle without
/// area along its longest side.
fn barycentric(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let part = |from: DVec3, to: DVec3| (from - point).cross(to - point).dot(normal).max(0.0);
    let weights = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = weights.iter().sum();
    if sum > 0.0 {
        return weights.map(|w| w / sum);
    }
    let corners = [a, b, c];
    let side = |k: usize| corners[(k + 1) % 3] - corners[k];
    let longest =
        (0..3).fold(0, |best, k| if side(k).length_squared() > side(best).length_squared() { k } else { best });
    let at = nearest_on_segment(point, corners[longest], corners[(longest + 1) % 3]);
    let mut weights = [0.0; 3];
    (weights[longest], weights[(longest + 1) % 3]) = (1.0 - at, at);
    weights
}

/// The chart each quad lies on: that of the base triangle beside it where it borders on a feature, and so for all quads that
/// no feature separates from it.
fn charts_of_quads(base: &Base, quads: &Quads, chart_of: &[u32]) -> Vec<u32> {
    // The base triangles on the left and on the right of each base edge.
    let mut beside = vec![[NONE; 2]; base.edges.len()];
    for (t, (corners, edges)) in base.triangles.iter().zip(&base.triangle_edges).enumerate() {
        for k in 0..3 {
            let along = base.edges[edges[k] as usize].ends == [corners[k], corners[(k + 1) % 3]];
            beside[edges[k] as usize][usize::from(!along)] = t as u32;
        }
    }
    let features: BTreeMap<[u32; 2], u32> = quads
        .feature_edges
        .iter()
        .flat_map(|edge| {
            let [left, right] = beside[edge.base_edge as usize];
            let [a, b] = edge.ends;
            [([a, b], left), ([b, a], right)]
        })
        .collect();
    let topology = Topology::of(&quads.mesh);
    let is_feature = |h: u32| features.contains_key(&[topology.from(h), topology.to(h)]);
    let joined = topology
        .edges()
        .filter(|&h| !topology.is_border(h) && !is_feature(h))
        .map(|h| (h / 4, topology.twin[h as usize] / 4));
    let mut chart_of_quad = vec![NONE; quads.mesh.face_count()];
    for group in connected_components(quads.mesh.face_count(), joined) {
        let beside_feature = group
            .iter()
            .flat_map(|&q| 4 * q..4 * q + 4)
            .find_map(|h| features.get(&[topology.from(h), topology.to(h)]))
            .copied();
        let triangle = beside_feature.unwrap_or_else(|| {
            let v = quads.mesh.face(group[0] as usize)[0];
            base.owner[quads.source[v as usize].surface_triangle as usize]
        });
        for q in group {
            chart_of_quad[q as usize] = chart_of[triangle as usize];
        }
    }
    chart_of_quad
}

/// For each feature edge of the quads the input edge under its middle, as an index into the input edges of its chain.
///
/// # Errors
/// Cancelled.
pub(crate) fn nearest_edges(
    quads: &Quads,
    chains: &[Vec<[u32; 2]>],
    positions: &[DVec3],
    monitor: &Monitor,
) -> Result<Vec<[u32; 2]>, Cancelled> {
    let find = |edge: &crate::quads::FeatureEdge| {
        monitor.check()?;
        let [p, q] = edge.ends.map(|v| quads.mesh.positions[v as usize]);
        let middle = p.midpoint(q);
        let chain = edge.chain.and_then(|chain| chains.get(chain as usize)).map_or(&[][..], Vec::as_slice);
        let away = |&[a, b]: &[u32; 2]| distance_to_segment(middle, positions[a as usize], positions[b as usize]);
        let nearest = chain.iter().map(|ends| (away(ends), *ends)).min_by(|a, b| a.0.total_cmp(&b.0));
        Ok(nearest.map_or([NONE; 2], |(_, ends)| ends))
    };
    quads.feature_edges.par_iter().map(find).collect()
}

/// Distance from a point to a segment.
pub(crate) fn distance_to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    point.distance(a + (b - a) * nearest_on_segment(point, a, b))
}
