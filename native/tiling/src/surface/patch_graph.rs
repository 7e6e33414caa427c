//! Patch graphs (section 4.1): a surface divided into disks, each of which can be laid flat with corners at multiples of 30
//! degrees.
//!
//! A patch knows its corners by c-index, the interior angle in units of 30 degrees. Its *total interior defect* is what the
//! corners leave of a full turn: 12 less the sum of 6 - c. Patches of defect zero can be flat; what curvature there is
//! then sits at the nodes, whose c-indices do not sum to a full turn. Whatever the c-indices, the defects of nodes and
//! patches sum to 12 times the Euler characteristic.

use crate::plane::Direction;
use mesh::DVec3;
use std::collections::BTreeMap;

/// A surface divided into patches.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PatchGraph {
    /// Where sides end.
    pub nodes: Vec<DVec3>,
    /// Curves between nodes.
    pub sides: Vec<Side>,
    /// Disks between sides.
    pub patches: Vec<Patch>,
}

/// A curve from node to node.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Its nodes, first and last.
    pub ends: [u32; 2],
    /// A polyline on the surface, both ends included, scene units.
    pub points: Vec<DVec3>,
}

/// A disk: its corners, counter-clockwise.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Patch {
    /// Corner k is where side k begins. A node that the border passes straight has a c-index of 6.
    pub corners: Vec<Corner>,
}

/// A corner of a patch, and the side that leaves it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    /// Index into [`PatchGraph::nodes`].
    pub node: u32,
    /// Interior angle in units of 30 degrees.
    pub c_index: u8,
    /// Index into [`PatchGraph::sides`].
    pub side: u32,
    /// Whether the patch runs along the side from its last node to its first.
    pub reversed: bool,
}

impl Side {
    /// Length of the polyline, scene units.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| w[0].distance(w[1])).sum()
    }
}

impl Patch {
    /// Twelve less the turns at the corners, in units of 30 degrees: the curvature that would be left inside.
    pub fn total_interior_defect(&self) -> i32 {
        12 - self.corners.iter().map(|corner| 6 - i32::from(corner.c_index)).sum::<i32>()
    }

    /// Direction of each side in the plane of the patch, the first along 0.
    pub fn directions(&self) -> Vec<Direction> {
        let mut direction = 0;
        let turned = |corner: &Corner| {
            direction = (direction + 18 - corner.c_index % 12) % 12;
            direction
        };
        std::iter::once(0).chain(self.corners.iter().skip(1).map(turned)).collect()
    }
}

impl Patch {
    /// Of a patch with four right angles and no others, the pairs of opposite sides without a node between: corners where they
    /// begin. Rows of tiles can run from the one to the other.
    pub(super) fn row_ends(&self) -> Vec<[usize; 2]> {
        let n = self.corners.len();
        let turns: Vec<usize> = (0..n).filter(|&k| self.corners[k].c_index != 6).collect();
        if turns.len() != 4 || turns.iter().any(|&k| self.corners[k].c_index != 3) {
            return Vec::new();
        }
        let is_single = |i: usize| (turns[i] + 1) % n == turns[(i + 1) % 4];
        (0..2).filter(|&i| is_single(i) && is_single(i + 2)).map(|i| [turns[i], turns[i + 2]]).collect()
    }
}

impl PatchGraph {
    /// Combinatorial angle defect of each node, in units of 30 degrees: 12 less its c-indices, 6 less them on the border.
    pub fn node_defects(&self) -> Vec<i32> {
        let uses = self.side_uses();
        let mut defect = vec![12; self.nodes.len()];
        for (side, &uses) in self.sides.iter().zip(&uses) {
            if uses == 1 {
                for end in side.ends {
                    defect[end as usize] = 6;
                }
            }
        }
        for corner in self.patches.iter().flat_map(|patch| &patch.corners) {
            defect[corner.node as usize] -= i32::from(corner.c_index);
        }
        defect
    }

    /// How often patches run along each side: 1 on the border of the surface, else 2.
    pub(super) fn side_uses(&self) -> Vec<u8> {
        let mut uses = vec![0; self.sides.len()];
        for corner in self.patches.iter().flat_map(|patch| &patch.corners) {
            uses[corner.side as usize] += 1;
        }
        uses
    }

    /// The graph with every point moved.
    #[must_use]
    pub fn moved(&self, to: impl Fn(DVec3) -> DVec3) -> Self {
        let mut moved = self.clone();
        for p in moved.sides.iter_mut().flat_map(|side| &mut side.points).chain(&mut moved.nodes) {
            *p = to(*p);
        }
        moved
    }

    /// Nodes less sides plus patches.
    pub fn euler_characteristic(&self) -> i64 {
        self.nodes.len() as i64 - self.sides.len() as i64 + self.patches.len() as i64
    }

    /// The graph of a polygon mesh: a patch for each face, its c-indices the nearest to its angles that make its defect zero.
    ///
    /// With `cones`, a face whose angles, rounded, leave a defect of 30 or 60 degrees keeps it at a point inside.
    ///
    /// # Errors
    /// [`NoCIndices`]: the faces that have none, since a corner of theirs has no angle or no angles of 60 to 300 degrees close.
    pub fn of_polygons(mesh: &mesh::PolygonMesh, cones: bool) -> Result<Self, NoCIndices> {
        let mut graph = Self { nodes: mesh.positions.clone(), ..Self::default() };
        let mut side_of = BTreeMap::new();
        let mut without = Vec::new();
        for f in 0..mesh.face_count() {
            let face = mesh.face(f);
            let points: Vec<DVec3> = mesh.face_points(f).collect();
            let n = face.len();
            let up = mesh::face_normal(&points);
            let angles: Vec<f64> = (0..n)
                .map(|k| {
                    let (before, after) = (points[(k + n - 1) % n] - points[k], points[(k + 1) % n] - points[k]);
                    let angle = before.angle_between(after).to_degrees() / 30.0;
                    if after.cross(before).dot(up) < 0.0 { 12.0 - angle } else { angle }
                })
                .collect();
            if angles.iter().any(|angle| !angle.is_finite()) {
                without.push(f as u32);
                continue;
            }
            let rounded: i32 = angles.iter().map(|angle| 6 - angle.round() as i32).sum();
            let defect = if cones && (1..=2).contains(&(12 - rounded)) { 12 - rounded } else { 0 };
            let Some(c_indices) = closing_c_indices(&angles, &vec![None; n], defect) else {
                without.push(f as u32);
                continue;
            };
            let corners = (0..n).map(|k| {
                let (a, b) = (face[k], face[(k + 1) % n]);
                let side = *side_of.entry(mesh::sorted(a, b)).or_insert_with(|| {
                    let points = [a, b].map(|v| mesh.positions[v as usize]).to_vec();
                    graph.sides.push(Side { ends: [a, b], points });
                    graph.sides.len() as u32 - 1
                });
                let reversed = graph.sides[side as usize].ends != [a, b];
                Corner { node: a, c_index: c_indices[k], side, reversed }
            });
            let patch = Patch { corners: corners.collect() };
            graph.patches.push(patch);
        }
        if without.is_empty() { Ok(graph) } else { Err(NoCIndices { faces: without }) }
    }
}

/// Faces without c-indices.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{} faces have no corner angles that close, the first is {}; merge vertices at one place there, or divide the faces",
    faces.len(), faces[0]
)]
pub struct NoCIndices {
    /// The faces.
    pub faces: Vec<u32>,
}

/// Least and greatest c-index: a corner of 30 degrees holds no tile.
const LEAST: u8 = 2;
const GREATEST: u8 = 10;

/// C-indices nearest to `angles` (units of 30 degrees), in the sum of squares, that leave a total interior defect of
/// `defect`; those that the caller has set stay. `None` when none do.
///
/// Rounding first and then taking the cheapest step of one, again and again, is optimal: the costs are convex and separate.
pub(super) fn closing_c_indices(angles: &[f64], set: &[Option<u8>], defect: i32) -> Option<Vec<u8>> {
    let mut chosen: Vec<u8> = angles
        .iter()
        .zip(set)
        .map(|(a, s)| s.unwrap_or(a.round().clamp(LEAST.into(), GREATEST.into()) as u8))
        .collect();
    loop {
        let left = 12 - chosen.iter().map(|&c| 6 - i32::from(c)).sum::<i32>();
        if left == defect {
            return Some(chosen);
        }
        let up = left < defect;
        let step = |c: u8| if up { c + 1 } else { c - 1 };
        let cost = |k: usize| {
            let distance = |c: u8| (f64::from(c) - angles[k]).powi(2);
            distance(step(chosen[k])) - distance(chosen[k])
        };
        let free = (0..chosen.len()).filter(|&k| set[k].is_none() && chosen[k] != if up { GREATEST } else { LEAST });
        let best = free.min_by(|&a, &b| cost(a).total_cmp(&cost(b)).then(a.cmp(&b)))?;
        chosen[best] = step(chosen[best]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn c_indices_are_the_nearest_that_close(angles in prop::collection::vec(0.5..11.0f64, 4), defect in -3..4i32) {
            let far = |chosen: &[u8]| -> f64 {
                chosen.iter().zip(&angles).map(|(&c, angle)| (f64::from(c) - angle).powi(2)).sum()
            };
            let closes = |chosen: &[u8]| 12 - chosen.iter().map(|&c| 6 - i32::from(c)).sum::<i32>() == defect;
            let all = (0..9u32.pow(4)).map(|code| [0, 1, 2, 3].map(|k| (code / 9u32.pow(k) % 9) as u8 + LEAST));
            let best = all.filter(|chosen| closes(chosen)).map(|chosen| far(&chosen)).reduce(f64::min);
            let found = closing_c_indices(&angles, &[None; 4], defect);
            prop_assert_eq!(found.is_some(), best.is_some());
            if let (Some(found), Some(best)) = (found, best) {
                prop_assert!(closes(&found));
                prop_assert!(far(&found) < best + 1e-9, "{:?} is {} away, not {}", found, far(&found), best);
            }
        }
    }

    #[test]
    fn what_the_caller_sets_stays() {
        let found = closing_c_indices(&[3.0; 4], &[Some(2), None, None, None], 0).expect("it closes");
        assert_eq!((found[0], found.iter().map(|&c| u32::from(c)).sum::<u32>()), (2, 12));
        assert_eq!(closing_c_indices(&[3.0], &[Some(3)], 0), None);
    }
}
