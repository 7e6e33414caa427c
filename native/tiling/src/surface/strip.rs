//! A zigzag by a strip of new tiles (section 4.3), for sides of which no near lengths have a tiling.
//!
//! Cut a patch along a path of edges and move one part away by an edge u: where all edges of the path are at 60 to 120
//! degrees from u, the gap fills with squares and pairs of triangles. In a tiling by triangles and squares such a path goes
//! on from any vertex, for no angle between neighbouring edges exceeds 90 degrees. Each end of the path adds an edge u to the
//! side where it lies, which is a zigzag when u is at 30 degrees from that side, and the path goes on in the patch beyond. So
//! strips cross the surface from border to border, or close; all tiles stay, and the strip comes in between. This is the
//! editing operation of the paper with a tiling in hand: it needs no solver and cannot fail to tile, but the sides grow.

use super::cone::Filling;
use super::courses::{Course, code, edge_directions};
use super::patch_graph::PatchGraph;
use super::zigzag::{Edit, Zigzag};
use crate::Boundary;
use crate::plane::{Direction, Point};
use crate::tile::{Kind, Tile, Tiling};
use mesh::{Cancelled, Monitor};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Most crossings looked at for one strip.
const MOST_CROSSINGS: usize = 4000;

/// Courses and tilings of a patch graph.
#[derive(Clone)]
pub(super) struct Tiled<'a> {
    pub graph: &'a PatchGraph,
    pub courses: Vec<Course>,
    pub filled: Vec<Filling>,
}

/// Where a strip crosses a side: the vertex, counted as the side runs, and the new edge's direction less the side's.
#[derive(Clone, Copy, PartialEq)]
struct Crossing {
    side: u32,
    at: usize,
    offset: i8,
}

/// A strip's way through a patch: the cut, from where it enters, and the edge by which the part to its right moves.
#[derive(Clone)]
struct Passage {
    patch: u32,
    path: Vec<Point>,
    along: Direction,
    /// Outline vertices at both ends.
    ends: [usize; 2],
    exit: Crossing,
    exit_corner: usize,
}

impl Tiled<'_> {
    /// Takes a zigzag, an edge at a time; the sides and patches that became others, or `None` where there is no strip.
    pub fn take(&mut self, zigzag: &Zigzag, monitor: &Monitor) -> Result<Option<Edit>, Cancelled> {
        let (mut sides, mut patches): (BTreeSet<u32>, BTreeSet<u32>) = Default::default();
        let count = zigzag.edges.abs();
        let lead: i8 = if zigzag.edges > 0 { 1 } else { -1 };
        let letters: &[i8] = if zigzag.pair { &[lead, -lead] } else { &[lead] };
        for k in 0..count {
            for &offset in letters {
                let aside = if !zigzag.pair {
                    0.0
                } else if offset == lead {
                    -0.17
                } else {
                    0.17
                };
                let position = if zigzag.spread {
                    (f64::from(k) + 0.5 + 1.5 * aside) / f64::from(count)
                } else {
                    zigzag.position + aside
                };
                let Some(edit) = self.strip(zigzag.side, offset, position, monitor)? else {
                    return Ok(None);
                };
                sides.extend(edit.sides);
                patches.extend(edit.patches);
            }
        }
        Ok(Some(Edit { sides: sides.into_iter().collect(), patches: patches.into_iter().collect() }))
    }

    /// Lays one strip across a side, as near to a position as there is one; what it crossed and passed.
    fn strip(&mut self, side: u32, offset: i8, position: f64, monitor: &Monitor) -> Result<Option<Edit>, Cancelled> {
        let length = self.courses[side as usize].len();
        let mut places: Vec<usize> = (1..length).collect();
        let off = |at: usize| (at as f64 / length as f64 - position).abs();
        places.sort_by(|&a, &b| off(a).total_cmp(&off(b)).then(a.cmp(&b)));
        for at in places {
            let start = Crossing { side, at, offset };
            let Some(passages) = self.way(start, monitor)? else { continue };
            if let Some(changed) = self.inserted(start, &passages) {
                let crossed = passages.iter().map(|passage| passage.exit.side);
                let sides = std::iter::once(side).chain(crossed).collect();
                let patches = passages.iter().map(|passage| passage.patch).collect();
                *self = changed;
                return Ok(Some(Edit { sides, patches }));
            }
        }
        Ok(None)
    }

    /// Patches along a side, with the corner that it leaves.
    fn uses(&self, side: u32) -> Vec<(u32, usize)> {
        let of = |(p, patch): (u32, &super::patch_graph::Patch)| -> Vec<(u32, usize)> {
            let corners = (0..patch.corners.len()).filter(|&k| patch.corners[k].side == side);
            corners.map(|k| (p, k)).collect()
        };
        (0..).zip(&self.graph.patches).flat_map(of).collect()
    }

    /// The passages of a strip from a crossing, both ways: border to border, or round.
    fn way(&self, start: Crossing, monitor: &Monitor) -> Result<Option<Vec<Passage>>, Cancelled> {
        let uses = self.uses(start.side);
        let Some((first, closes)) = self.leg(start, uses[0], &BTreeSet::new(), uses.get(1).copied(), monitor)? else {
            return Ok(None);
        };
        let Some(&second) = uses.get(1).filter(|_| !closes) else { return Ok(Some(first)) };
        let passed: BTreeSet<u32> = first.iter().map(|passage| passage.patch).collect();
        let rest = self.leg(start, second, &passed, None, monitor)?;
        Ok(rest.map(|(rest, _)| [first, rest].concat()))
    }

    /// The fewest passages from a crossing into a patch and on to the border, or back to where it started through the patch
    /// beyond (`home`); whether it came back.
    fn leg(
        &self,
        start: Crossing,
        into: (u32, usize),
        closed: &BTreeSet<u32>,
        home: Option<(u32, usize)>,
        monitor: &Monitor,
    ) -> Result<Option<(Vec<Passage>, bool)>, Cancelled> {
        // Each found passage with the one before it.
        let mut found: Vec<(Passage, Option<usize>)> = Vec::new();
        let mut waiting: VecDeque<(Crossing, (u32, usize), Option<usize>)> = VecDeque::from([(start, into, None)]);
        let trace = |found: &[(Passage, Option<usize>)], last: usize| {
            let mut way = vec![found[last].0.clone()];
            let mut at = found[last].1;
            while let Some(k) = at {
                way.push(found[k].0.clone());
                at = found[k].1;
            }
            way.reverse();
            way
        };
        while let Some((crossing, (patch, corner), before)) = waiting.pop_front() {
            monitor.check()?;
            let mut at = before;
            let mut is_passed = closed.contains(&patch);
            while let Some(k) = at {
                is_passed |= found[k].0.patch == patch;
                at = found[k].1;
            }
            if is_passed || found.len() > MOST_CROSSINGS {
                continue;
            }
            for passage in self.passages(crossing, patch, corner) {
                let exit = passage.exit;
                let of = (passage.patch, passage.exit_corner);
                found.push((passage, before));
                let here = found.len() - 1;
                if exit.side == start.side {
                    if exit == start && home == Some(of) {
                        return Ok(Some((trace(&found, here), true)));
                    }
                    continue;
                }
                match self.uses(exit.side).into_iter().find(|&other| other != of) {
                    Some(beyond) => waiting.push_back((exit, beyond, Some(here))),
                    None => return Ok(Some((trace(&found, here), false))),
                }
            }
        }
        Ok(None)
    }

    /// All ways through a patch from a crossing, one for each place where they can leave.
    fn passages(&self, crossing: Crossing, patch: u32, corner: usize) -> Vec<Passage> {
        let filling = &self.filled[patch as usize];
        let of = &self.graph.patches[patch as usize];
        if filling.slit > 0 || of.total_interior_defect() != 0 {
            return Vec::new();
        }
        let points = filling.boundary.points();
        let directions = of.directions();
        // The tiling lies with its first edge along the x axis, the patch with its first side.
        let turn = edge_directions(of, &self.courses)[0];
        let mut first = vec![0];
        for corner in &of.corners {
            first.push(first[first.len() - 1] + self.courses[corner.side as usize].len());
        }
        // From the number of a vertex along a side to that along the patch, and back.
        let flipped = |k: usize, at: usize| if of.corners[k].reversed { first[k + 1] - first[k] - at } else { at };
        let entry = first[corner] + flipped(corner, crossing.at);
        let along = (directions[corner] + 24 - turn + (12 + crossing.offset) as u8) % 12;
        let number: BTreeMap<Point, usize> = points.iter().copied().zip(0..).collect();
        let mut edges: BTreeSet<(Point, Direction)> = BTreeSet::new();
        for tile in &filling.tiling.tiles {
            for k in 0..tile.kind.corners() {
                let (a, d) = (tile.corners().nth(k).unwrap_or(tile.origin), tile.leaving(k));
                edges.extend([(a, d), (a + Point::unit(d), (d + 6) % 12)]);
            }
        }
        let n = points.len();
        let mut before: BTreeMap<Point, Point> = BTreeMap::new();
        let mut waiting = VecDeque::from([points[entry]]);
        let mut exits = Vec::new();
        while let Some(here) = waiting.pop_front() {
            for step in [3, 2, 4] {
                let direction = (along + step) % 12;
                let next = here + Point::unit(direction);
                if !edges.contains(&(here, direction)) || before.contains_key(&next) {
                    continue;
                }
                let Some(&exit) = number.get(&next) else {
                    before.insert(next, here);
                    waiting.push_back(next);
                    continue;
                };
                let is_outline = number.get(&here).is_some_and(|&k| (k + 1) % n == exit || (exit + 1) % n == k);
                if !is_outline {
                    before.insert(next, here);
                    exits.push(exit);
                }
            }
        }
        let passage = |exit: usize| {
            let exit_corner = (0..of.corners.len()).find(|&k| first[k] < exit && exit < first[k + 1])?;
            let offset = match (along + 6 + 12 + turn - directions[exit_corner]) % 12 {
                0 => 0,
                1 => 1,
                11 => -1,
                _ => return None,
            };
            let mut path = vec![points[exit]];
            while let Some(&p) = before.get(&path[path.len() - 1]).filter(|_| path[path.len() - 1] != points[entry]) {
                path.push(p);
            }
            path.reverse();
            let at = flipped(exit_corner, exit - first[exit_corner]);
            let exit_crossing = Crossing { side: of.corners[exit_corner].side, at, offset };
            Some(Passage { patch, path, along, ends: [entry, exit], exit: exit_crossing, exit_corner })
        };
        exits.into_iter().filter_map(passage).collect()
    }

    /// With the strip laid; `None` where an outline would meet itself.
    fn inserted(&self, start: Crossing, passages: &[Passage]) -> Option<Self> {
        let mut changed = self.clone();
        let mut crossings = vec![start];
        for passage in passages {
            if !crossings.contains(&passage.exit) {
                crossings.push(passage.exit);
            }
        }
        for crossing in crossings {
            changed.courses[crossing.side as usize].insert(crossing.at, crossing.offset);
        }
        for passage in passages {
            let boundary = Boundary::new(&code(&self.graph.patches[passage.patch as usize], &changed.courses)).ok()?;
            let filling = &mut changed.filled[passage.patch as usize];
            filling.tiling = opened(&filling.tiling, passage);
            filling.boundary = boundary;
        }
        Some(changed)
    }
}

/// A tiling cut along a path, its part to the right of it moved by an edge, and the gap filled. The outline's first vertex stays.
fn opened(tiling: &Tiling, passage: &Passage) -> Tiling {
    let Passage { path, along, ends, .. } = passage;
    let shift = Point::unit(*along);
    let mut at: BTreeMap<(Point, Point), usize> = BTreeMap::new();
    let corners: Vec<Vec<Point>> = tiling.tiles.iter().map(|tile| tile.corners().collect()).collect();
    for (t, corners) in corners.iter().enumerate() {
        for k in 0..corners.len() {
            at.insert((corners[k], corners[(k + 1) % corners.len()]), t);
        }
    }
    let cut: BTreeSet<(Point, Point)> = path.windows(2).flat_map(|w| [(w[0], w[1]), (w[1], w[0])]).collect();
    let mut is_right = vec![false; tiling.tiles.len()];
    let mut waiting: Vec<usize> = path.windows(2).filter_map(|w| at.get(&(w[1], w[0])).copied()).collect();
    for &t in &waiting {
        is_right[t] = true;
    }
    while let Some(t) = waiting.pop() {
        let n = corners[t].len();
        for k in 0..n {
            let edge = (corners[t][(k + 1) % n], corners[t][k]);
            if !cut.contains(&edge)
                && let Some(&other) = at.get(&edge)
                && !std::mem::replace(&mut is_right[other], true)
            {
                waiting.push(other);
            }
        }
    }
    // The outline runs from the entry round the part to the right to the exit.
    let first_is_right = ends[1] < ends[0];
    let moves = if first_is_right { [Point::ORIGIN - shift, Point::ORIGIN] } else { [Point::ORIGIN, shift] };
    let mut tiles: Vec<Tile> = tiling
        .tiles
        .iter()
        .zip(is_right)
        .map(|(tile, right)| Tile { origin: tile.origin + moves[usize::from(right)], ..*tile })
        .collect();
    for w in path.windows(2) {
        let [a, b] = [w[0] + moves[0], w[1] + moves[0]];
        let u = *along;
        let triangle =
            |origin: Point, direction: Direction| Tile { origin, direction: direction % 12, kind: Kind::Triangle };
        if w[1] - w[0] == Point::unit(u + 3) {
            tiles.push(Tile { origin: a, direction: u, kind: Kind::Square });
        } else if w[1] - w[0] == Point::unit(u + 2) {
            tiles.extend([triangle(a, u), triangle(b, u + 10)]);
        } else {
            tiles.extend([triangle(a, u), triangle(a, u + 2)]);
        }
    }
    Tiling { tiles }
}

#[cfg(test)]
mod tests {
    use super::super::Fill;
    use super::super::paving::pave;
    use super::*;
    use mesh::{DVec3, PolygonMesh};

    /// The outline that tiles leave: edges with a tile on their left and none on their right.
    fn outline(tiling: &Tiling) -> BTreeSet<(Point, Point)> {
        let mut edges = BTreeSet::new();
        for tile in &tiling.tiles {
            let corners: Vec<Point> = tile.corners().collect();
            for k in 0..corners.len() {
                assert!(
                    edges.insert((corners[k], corners[(k + 1) % corners.len()])),
                    "two tiles on one hand of an edge"
                );
            }
        }
        edges.iter().copied().filter(|&(a, b)| !edges.contains(&(b, a))).collect()
    }

    #[test]
    fn strips_of_both_hands_cross_a_sheet_of_patches() {
        // Three by three faces, the middle row of parallelograms, so that there are squares and triangles.
        let rows = [(0.0, 0.0), (0.0, 1.0), (0.5, 1.0 + 0.75f64.sqrt()), (0.5, 2.0 + 0.75f64.sqrt())];
        let positions = rows.iter().flat_map(|&(x, y)| (0..4).map(move |i| DVec3::new(x + f64::from(i), y, 0.0)));
        let faces = (0..9u32).map(|k| {
            let v = k / 3 * 4 + k % 3;
            [v, v + 1, v + 5, v + 4]
        });
        let grid = PolygonMesh::from_polygons(positions.collect(), faces).expect("a grid");
        let graph = PatchGraph::of_polygons(&grid, false).expect("c-indices");
        let paving =
            pave(&graph, &[], 0.2, Fill::Regular, false, &Monitor::new()).expect("not cancelled").expect("lengths");
        let mut tiled = Tiled { graph: &graph, courses: paving.courses.clone(), filled: paving.filled };
        let mut taken = 0;
        for side in 0..graph.sides.len() as u32 {
            for edges in [1, -2] {
                let before = tiled.courses[side as usize].clone();
                let Some(edit) = tiled.take(&Zigzag::new(side, edges), &Monitor::new()).expect("not cancelled") else {
                    continue;
                };
                taken += 1;
                assert!(edit.sides.contains(&side) && !edit.patches.is_empty());
                let letter = edges.signum() as i8;
                let count = |course: &Course| course.iter().filter(|&&o| o == letter).count() as i32;
                assert!(count(&tiled.courses[side as usize]) >= count(&before) + edges.abs());
            }
        }
        assert!(taken > graph.sides.len(), "{taken} strips");
        for (patch, filling) in graph.patches.iter().zip(&tiled.filled) {
            assert_eq!(filling.boundary.code(), code(patch, &tiled.courses));
            let points = filling.boundary.points();
            let around: BTreeSet<_> = (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()])).collect();
            assert_eq!(outline(&filling.tiling), around);
        }
    }
}
