//! What the layout has to know of a base triangulation: angles, sizes, and the sectors that features cut each vertex into.
//!
//! Angles are measured on the surface, as sums over its triangles: a base triangle that wraps round a limb has straight
//! chords, but no straight sides.

use crate::base::Base;
use crate::error::LayoutError;
use mesh::DVec3;
use mesh::NONE;
use solve::components::connected_components;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A corner of a base triangle as `3 * triangle + corner`; also the half-edge that leaves it.
pub(crate) type Corner = u32;

/// The half-edge after `h` in its triangle.
pub(crate) fn next(h: Corner) -> Corner {
    h - h % 3 + (h + 1) % 3
}

/// The corners between two features round a base vertex.
#[derive(Debug, Clone)]
pub(crate) struct Sector {
    /// The base vertex.
    pub vertex: u32,
    /// Its corners, ascending.
    pub corners: Vec<Corner>,
    /// Number of quads that would meet here at right angles; not a whole number between features.
    pub ideal: f64,
}

/// Measures of a base triangulation that has been checked.
#[derive(Debug)]
pub(crate) struct Measures {
    /// Angle at each corner, radians; round a vertex without features they add up to a full turn.
    pub angles: Vec<f64>,
    /// Area of each base triangle.
    pub areas: Vec<f64>,
    /// Mean unit normal of each base triangle.
    pub normals: Vec<DVec3>,
    /// The half-edge across each half-edge, [`NONE`] at borders.
    pub twins: Vec<Corner>,
    /// True for base edges that must stay: features and borders.
    pub rails: Vec<bool>,
    /// Round each base vertex its sectors; vertices in order.
    pub sectors: Vec<Sector>,
    /// Sector of each corner.
    pub sector_of: Vec<u32>,
    /// Surface triangles of each base triangle.
    pub pieces: Vec<Vec<u32>>,
}

impl Measures {
    /// Checks that a base triangulation is consistent and measures it. O(surface triangles).
    pub fn new(base: &Base) -> Result<Self, LayoutError> {
        check(base)?;
        let twins = twins(base)?;
        let count = base.triangles.len();
        let mut rails: Vec<bool> = base.edges.iter().map(|edge| edge.feature.is_some()).collect();
        for (h, &twin) in twins.iter().enumerate() {
            if twin == NONE {
                rails[base.triangle_edges[h / 3][h % 3] as usize] = true;
            }
        }
        let mut pieces = vec![Vec::new(); count];
        let (mut areas, mut normals) = (vec![0.0; count], vec![DVec3::ZERO; count]);
        let mut angles = vec![0.0; 3 * count];
        for (t, &owner) in base.owner.iter().enumerate() {
            let owner = owner as usize;
            pieces[owner].push(t as u32);
            let area_normal = base.surface.area_normal(t);
            areas[owner] += area_normal.length() / 2.0;
            normals[owner] += area_normal;
            for (k, &v) in base.surface.triangles[t].iter().enumerate() {
                for c in 0..3 {
                    if base.vertices[base.triangles[owner][c] as usize] == v {
                        let p = base.surface.points(t);
                        angles[3 * owner + c] += (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
                    }
                }
            }
        }
        if let Some(index) = pieces.iter().position(Vec::is_empty) {
            return Err(bad("triangle", index, "no surface triangle belongs to it"));
        }
        for n in &mut normals {
            *n = n.normalize_or_zero();
        }

        // Corners on both sides of an edge that may go belong to one sector.
        let joined = (0..twins.len() as u32).filter(|&h| twins[h as usize] != NONE).filter_map(|h| {
            let rail = rails[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
            (!rail).then(|| (h, next(twins[h as usize])))
        });
        let groups = connected_components(3 * count, joined);
        let vertex = |c: Corner| base.triangles[c as usize / 3][c as usize % 3];
        let mut ends = vec![0; base.vertices.len()];
        for (edge, _) in base.edges.iter().zip(&rails).filter(|(_, rail)| **rail) {
            for &v in &edge.ends {
                ends[v as usize] += 1;
            }
        }
        let mut sectors: Vec<Sector> = Vec::with_capacity(groups.len());
        for corners in groups {
            let vertex = vertex(corners[0]);
            let total: f64 = corners.iter().map(|&c| angles[c as usize]).sum();
            // One feature that ends here, or none, leaves a full turn, however pointed the surface.
            if ends[vertex as usize] < 2 && total > 0.0 {
                for &c in &corners {
                    angles[c as usize] *= TAU / total;
                }
            }
            let total: f64 = corners.iter().map(|&c| angles[c as usize]).sum();
            sectors.push(Sector { vertex, corners, ideal: (total / FRAC_PI_2).max(1.0) });
        }
        sectors.sort_by_key(|sector| (sector.vertex, sector.corners[0]));
        let mut sector_of = vec![0; 3 * count];
        for (index, sector) in sectors.iter().enumerate() {
            for &c in &sector.corners {
                sector_of[c as usize] = index as u32;
            }
        }
        Ok(Self { angles, areas, normals, twins, rails, sectors, sector_of, pieces })
    }
}

fn bad(element: &'static str, index: usize, reason: &'static str) -> LayoutError {
    LayoutError::BadBase { element, index, reason }
}

/// Refuses indices out of range and edges that do not join what they should.
fn check(base: &Base) -> Result<(), LayoutError> {
    let (points, vertices) = (base.surface.positions.len(), base.vertices.len());
    let find = |mut bad: &mut dyn Iterator<Item = bool>| Iterator::position(&mut bad, |bad| bad);
    if let Some(i) = find(&mut base.surface.triangles.iter().map(|t| t.iter().any(|&v| v as usize >= points))) {
        return Err(bad("surface triangle", i, "it names a vertex that does not exist"));
    }
    for (array, name) in [
        (&base.owner, "every surface triangle needs an owner"),
        (&base.source, "every surface triangle needs a source"),
    ] {
        if array.len() != base.surface.triangles.len() {
            return Err(bad("surface triangle", array.len().min(base.surface.triangles.len()), name));
        }
    }
    if let Some(i) = find(&mut base.owner.iter().map(|&o| o as usize >= base.triangles.len())) {
        return Err(bad("surface triangle", i, "its owner does not exist"));
    }
    if let Some(i) = find(&mut base.vertices.iter().map(|&v| v as usize >= points)) {
        return Err(bad("vertex", i, "its surface vertex does not exist"));
    }
    if base.triangle_edges.len() != base.triangles.len() {
        return Err(bad(
            "triangle",
            base.triangle_edges.len().min(base.triangles.len()),
            "every triangle needs its edges",
        ));
    }
    for (i, edge) in base.edges.iter().enumerate() {
        if edge.ends.iter().any(|&v| v as usize >= vertices) || edge.path.iter().any(|&v| v as usize >= points) {
            return Err(bad("edge", i, "it names a vertex that does not exist"));
        }
        let path = [edge.path.first(), edge.path.last()].map(Option::<&u32>::copied);
        if edge.path.len() < 2 || path != edge.ends.map(|v| Some(base.vertices[v as usize])) {
            return Err(bad("edge", i, "its path does not join its ends"));
        }
    }
    for (i, (triangle, edges)) in base.triangles.iter().zip(&base.triangle_edges).enumerate() {
        if triangle.iter().any(|&v| v as usize >= vertices) {
            return Err(bad("triangle", i, "it names a vertex that does not exist"));
        }
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            let joins = base.edges.get(edges[k] as usize).is_some_and(|e| e.ends == [a, b] || e.ends == [b, a]);
            if a == b || !joins {
                return Err(bad("triangle", i, "an edge does not join the corners it should"));
            }
        }
    }
    Ok(())
}

/// The half-edge across each one.
fn twins(base: &Base) -> Result<Vec<Corner>, LayoutError> {
    let mut first = vec![NONE; base.edges.len()];
    let mut twins = vec![NONE; 3 * base.triangles.len()];
    for h in 0..twins.len() {
        let edge = base.triangle_edges[h / 3][h % 3] as usize;
        let other = first[edge];
        if other == NONE {
            first[edge] = h as u32;
        } else if twins[other as usize] == NONE
            && base.triangles[other as usize / 3][other as usize % 3] != base.triangles[h / 3][h % 3]
        {
            twins[other as usize] = h as u32;
            twins[h] = other;
        } else {
            return Err(bad("edge", edge, "it has more than two triangles, or two that run along it the same way"));
        }
    }
    if let Some(edge) = first.iter().position(|&h| h == NONE) {
        return Err(bad("edge", edge, "it belongs to no triangle"));
    }
    Ok(twins)
}
