//! Quads for all patches: section 4.3's maps and the patterns of [`quadrangulate::Filler`], joined along the base edges.
//!
//! Patches share the vertices along base edges by index; nothing is matched by position. Along an edge vertices lie
//! by arc length over the relative size there. Each patch is filled on its own, in parallel: what one thread does depends on
//! no other.

use crate::base::Base;
use crate::density::Counts;
use crate::division;
use crate::error::LayoutError;
use crate::keep::Carried;
use crate::measures::Measures;
use crate::patch::{Patch, Plan};
use crate::rails::Rails;
use crate::templates::TemplateError;
use mesh::{DVec3, Monitor, PolygonMesh};
use quadrangulate::{DiskSurface, Filler, PatchTopology, PlaceError, place};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use surface::smooth_star::Polyline;

/// What a vertex of the quads lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// A base vertex.
    Corner(u32),
    /// The inside of a base edge.
    Edge(u32),
    /// The inside of a patch.
    Patch(u32),
}

/// The filled patches in one mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct Filled {
    pub positions: Vec<DVec3>,
    pub places: Vec<Place>,
    pub quads: Vec<[u32; 4]>,
    /// Patch of each quad.
    pub patch_of: Vec<u32>,
    /// Vertices along each base edge from its first end to its second; empty for edges inside patches.
    pub along: Vec<Vec<u32>>,
    /// Vertices on bends of rails, which stay.
    pub stays: Vec<bool>,
}

/// Fills all patches with the given counts along base edges. The first ones, `carried`, are as they were.
pub(crate) fn fill(
    plan: Plan<'_>,
    counts: &Counts,
    topologies: &[PatchTopology],
    carried: &Carried,
    rails: &Rails,
    monitor: &Monitor,
) -> Result<Filled, LayoutError> {
    let Plan { base, measures, patches, size, plain, .. } = plan;
    let counts = &counts.of_edge;
    let mut filled = Filled::default();
    let arcs = |e: u32| divide_evenly(base, &base.edges[e as usize].path, counts[e as usize], size);
    let division = division::divide(base, rails, &arcs, &rails.means(base, plain));
    for (v, &at) in base.vertices.iter().enumerate() {
        filled.positions.push(division.of_vertex[v].unwrap_or(base.surface.positions[at as usize]));
        filled.stays.push(division.vertex_stays[v]);
        filled.places.push(Place::Corner(v as u32));
    }
    for (e, (edge, &count)) in base.edges.iter().zip(counts).enumerate() {
        let mut along = Vec::new();
        if count > 0 {
            along.push(edge.ends[0]);
            let inner = if rails.of_edge[e].is_some() {
                division.of_edge[e].clone()
            } else {
                let line = Polyline::new(edge.path.iter().map(|&v| base.surface.positions[v as usize]).collect());
                arcs(e as u32).into_iter().map(|arc| line.at(arc)).collect()
            };
            for (i, p) in inner.into_iter().enumerate() {
                along.push(filled.positions.len() as u32);
                filled.positions.push(p);
                filled.places.push(Place::Edge(e as u32));
                filled.stays.push(division.edge_stays[e].get(i).copied().unwrap_or(false));
            }
            along.push(edge.ends[1]);
        }
        filled.along.push(along);
    }
    let first = carried.patches.len();
    let inner: Vec<Vec<DVec3>> = patches
        .par_iter()
        .zip(topologies)
        .enumerate()
        .skip(first)
        .map(|(index, (patch, topology))| {
            let border = border(base, &filled, patch);
            let points: Vec<DVec3> = border.iter().map(|&v| filled.positions[v as usize]).collect();
            place_patch(base, measures, patch, &sides(base, patch, counts), topology, &points, monitor).map_err(
                |source| match source {
                    PlaceError::Cancelled(cancelled) => LayoutError::Cancelled(cancelled),
                    source => LayoutError::Place { patch: index, source },
                },
            )
        })
        .collect::<Result<_, _>>()?;
    let kept = carried.inner.iter().map(|inner| inner.iter().map(|vertex| vertex.0).collect());
    for (index, ((patch, topology), inner)) in patches.iter().zip(topologies).zip(kept.chain(inner)).enumerate() {
        let mut names = border(base, &filled, patch);
        names.extend((filled.positions.len() as u32..).take(inner.len()));
        filled.places.resize(filled.positions.len() + inner.len(), Place::Patch(index as u32));
        filled.positions.extend(inner);
        filled.stays.resize(filled.positions.len(), false);
        filled.quads.extend(topology.quads.iter().map(|q| q.map(|v| names[v as usize])));
        filled.patch_of.resize(filled.quads.len(), index as u32);
    }
    carried.put_back(rails, &mut filled);
    Ok(filled)
}

/// Patches with an edge that joins two vertices joined by an edge elsewhere too: two patches that meet in two sides, as round
/// a thin finger, whose rows run side to side. Ascending.
pub(crate) fn doubled(filled: &Filled) -> Vec<u32> {
    let mut seen = BTreeMap::<[u32; 2], u32>::new();
    let mut found = BTreeSet::new();
    for (quad, &patch) in filled.quads.iter().zip(&filled.patch_of) {
        for k in 0..4 {
            if let Some(other) = seen.insert([quad[k], quad[(k + 1) % 4]], patch) {
                found.extend([other, patch]);
            }
        }
    }
    found.into_iter().collect()
}

/// The best filling of each patch for these counts.
pub(crate) fn topologies(plan: Plan<'_>, counts: &[u32], monitor: &Monitor) -> Result<Vec<PatchTopology>, LayoutError> {
    let Plan { base, patches, templates, .. } = plan;
    let mut filler = Filler::new();
    let mut all = Vec::with_capacity(patches.len());
    for (index, patch) in patches.iter().enumerate() {
        monitor.check()?;
        let sides = sides(base, patch, counts);
        if let Some(template) = patch.template.map(|index| &templates[index]) {
            let filled = template.pattern.fill(&sides);
            all.push(filled.ok_or(TemplateError::DoesNotFit { edge: template.edge })?);
            continue;
        }
        // A triangle that a line ends in is a grid, whose second corner is the line's end.
        let sides = if patch.is_grid(&sides) { vec![sides[1], sides[2], sides[1], sides[2]] } else { sides };
        all.push(filler.fill(&sides).map_err(|source| LayoutError::Fill { patch: index, source })?);
    }
    Ok(all)
}

/// The filled patches as a mesh without places: all its vertices are at the origin. `None` where an edge would have three quads.
pub(crate) fn joined(plan: Plan<'_>, counts: &[u32], topologies: &[PatchTopology]) -> Option<PolygonMesh> {
    let Plan { base, patches, .. } = plan;
    let mut filled = Filled::default();
    let mut vertices = base.vertices.len() as u32;
    for (edge, &count) in base.edges.iter().zip(counts) {
        let mut along = vec![];
        if count > 0 {
            along.push(edge.ends[0]);
            along.extend(vertices..vertices + count - 1);
            along.push(edge.ends[1]);
            vertices += count - 1;
        }
        filled.along.push(along);
    }
    for (patch, topology) in patches.iter().zip(topologies) {
        let mut names = border(base, &filled, patch);
        let inner =
            topology.quads.iter().flatten().max().map_or(0, |&last| (last + 1).saturating_sub(names.len() as u32));
        names.extend(vertices..vertices + inner);
        vertices += inner;
        filled.quads.extend(topology.quads.iter().map(|quad| quad.map(|v| names[v as usize])));
    }
    PolygonMesh::from_polygons(vec![DVec3::ZERO; vertices as usize], &filled.quads).ok()
}

/// Quads along the sides of a patch.
pub(crate) fn sides(base: &Base, patch: &Patch, counts: &[u32]) -> Vec<u32> {
    let count = |h: &u32| counts[base.triangle_edges[*h as usize / 3][*h as usize % 3] as usize];
    patch.sides().map(|side| side.iter().map(count).sum()).collect()
}

/// Arc lengths at which a path is divided into `count` parts of equal arc length over relative size.
pub(crate) fn divide_evenly(base: &Base, path: &[u32], count: u32, size: &[f64]) -> Vec<f64> {
    let at = |v: u32| base.surface.positions[v as usize];
    let (mut arc, mut passed) = (vec![0.0], vec![0.0]);
    for w in path.windows(2) {
        let length = at(w[0]).distance(at(w[1]));
        arc.push(arc[arc.len() - 1] + length);
        passed.push(passed[passed.len() - 1] + length / f64::midpoint(size[w[0] as usize], size[w[1] as usize]));
    }
    let total = passed[passed.len() - 1];
    (1..count)
        .map(|i| {
            let wanted = total * f64::from(i) / f64::from(count);
            let k = passed.partition_point(|&p| p <= wanted).clamp(1, path.len() - 1);
            let span = passed[k] - passed[k - 1];
            let t = if span > 0.0 { (wanted - passed[k - 1]) / span } else { 0.0 };
            arc[k - 1] + t * (arc[k] - arc[k - 1])
        })
        .collect()
}

/// Vertices of the quads round a patch, counter-clockwise from its first corner.
fn border(base: &Base, filled: &Filled, patch: &Patch) -> Vec<u32> {
    let mut border = Vec::new();
    for &h in &patch.border {
        let along = &filled.along[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
        let start = base.triangles[h as usize / 3][h as usize % 3];
        if along.first() == Some(&start) {
            border.extend(&along[..along.len() - 1]);
        } else {
            border.extend(along.iter().rev().take(along.len().saturating_sub(1)));
        }
    }
    border
}

/// Positions of the inner vertices of a patch.
fn place_patch(
    base: &Base,
    measures: &Measures,
    patch: &Patch,
    sides: &[u32],
    topology: &PatchTopology,
    points: &[DVec3],
    monitor: &Monitor,
) -> Result<Vec<DVec3>, PlaceError> {
    let triangles: Vec<[u32; 3]> = patch
        .triangles
        .iter()
        .flat_map(|&t| measures.pieces[t as usize].iter().map(|&t| base.surface.triangles[t as usize]))
        .collect();
    let mut names: Vec<u32> = triangles.iter().flatten().copied().collect();
    names.sort_unstable();
    names.dedup();
    let local = |v: u32| names.binary_search(&v).map_or(mesh::NONE, |i| i as u32);
    let (mut rim, mut corners) = (Vec::new(), Vec::new());
    for (k, &h) in patch.border.iter().enumerate() {
        if patch.corners.contains(&k) {
            corners.push(rim.len());
        }
        let edge = &base.edges[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
        let forward = edge.ends[0] == base.triangles[h as usize / 3][h as usize % 3];
        let n = edge.path.len() - 1;
        rim.extend((0..n).map(|i| local(edge.path[if forward { i } else { n - i }])));
    }
    let surface = DiskSurface {
        positions: &names.iter().map(|&v| base.surface.positions[v as usize]).collect::<Vec<_>>(),
        triangles: &triangles.iter().map(|t| t.map(local)).collect::<Vec<_>>(),
        border: &rim,
        corners: &corners,
    };
    let mut placed = place(topology, sides, points, &surface, None, monitor)?;
    Ok(placed.split_off(points.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_join_the_same_vertices_twice_are_found() {
        // Two patches round a finger: their rows 1-4 are one edge. A third beside them is sound.
        let quads = vec![[0, 1, 4, 3], [1, 2, 5, 4], [4, 1, 0, 6], [1, 4, 7, 8], [2, 9, 10, 5]];
        let filled = Filled { quads, patch_of: vec![0, 0, 1, 1, 2], ..Filled::default() };
        assert_eq!(doubled(&filled), [0, 1]);
    }
}
