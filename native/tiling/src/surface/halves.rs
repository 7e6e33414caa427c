//! Half edges (section 4.2.2, the extension of problem 11): sides that end in the middle of an edge.
//!
//! The paper bounds patches by paths of the subdivided mesh, whose vertices are the vertices and the middles of edges. So a
//! side may have half an edge more (a 1-edge) or half a pair more (a single sqrt-3 edge, the height of one triangle), may
//! run through the middles of a row of tiles, and patches need only close in half edges: a kite of a triangular lattice has sides
//! of any multiple of 3/2 edges, not of 3. What a side cuts off a tile belongs to the patch beside it (4.2.3).
//!
//! Deviation: no tile is cut. A side ends in the middle of an edge at a *halfway node*: one that lies within a line whose
//! patches it passes straight, at no corner and with no defect, with that edge along the line. The two patches beside the ending
//! side have the halves of the same tiles, so those tiles can be given whole to either: the node goes to one end of its
//! edge, half an edge along the line, for all patches alike. A side that ran along the height of a triangle then
//! goes round it, as a pair does; a side that ran through the middles of tiles goes along their edges. Every outline is one of
//! whole edges again, which the plane solver fills, and all of a lattice stay of it; for each node the end is
//! taken that leaves the outlines simple and the certificate content.

use super::courses::{Course, fault, straightforward};
use super::patch_graph::{Patch, PatchGraph};
use crate::plane::{Direction, Point};
use solve::integer::{Programme, Variable};
use std::collections::BTreeMap;

/// A node within a line: which break of which line it is, and the sides before and after it along the line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Through {
    pub line: usize,
    pub index: usize,
    pub sides: [u32; 2],
}

/// Edges of a side in the plane before nodes go to the ends of their edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Halves {
    /// Twice the edges in its direction, and twice the pairs.
    pub straight: u32,
    pub pairs: u32,
}

/// Edges of a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Steps {
    /// Edges in the side's direction.
    pub straight: u32,
    /// Pairs of edges, one to the left and one to the right.
    pub pairs: u32,
    /// One edge more to the left (1) or to the right (-1): half a pair, round its triangle.
    pub turned: i8,
}

/// A node that may lie in the middle of an edge of its line.
#[derive(Debug)]
pub(super) struct Halfway {
    pub node: u32,
    pub through: Through,
    /// Direction in which each side leaves it, in units of 30 degrees from the way its line runs on; by side and end.
    leaving: BTreeMap<(u32, usize), Direction>,
}

/// How the edge of a halfway node lies to a side that ends there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lie {
    Along,
    Across,
    /// At 60 or 120 degrees: the side runs through the middles of a row of triangles.
    Oblique(Direction),
}

/// The nodes that may lie in the middle of an edge: regular, passed straight by their line, and met at right angles or at multiples of
/// 60 degrees.
pub(super) fn halfways(graph: &PatchGraph, through: &[Option<Through>]) -> Vec<Halfway> {
    let defects = graph.node_defects();
    let regular = through.iter().enumerate().filter(|(node, _)| defects[*node] == 0);
    let found = regular.filter_map(|(node, &through)| Halfway::new(graph, node as u32, through?));
    found.collect()
}

impl Halfway {
    fn new(graph: &PatchGraph, node: u32, through: Through) -> Option<Self> {
        // Corners of patches there: the side that leaves, the side that arrives, and the angle from the one to the other.
        let mut turns = Vec::new();
        for patch in &graph.patches {
            let n = patch.corners.len();
            for (k, corner) in patch.corners.iter().enumerate().filter(|(_, corner)| corner.node == node) {
                let before = &patch.corners[(k + n - 1) % n];
                let leaves = (corner.side, usize::from(corner.reversed));
                turns.push((leaves, (before.side, usize::from(!before.reversed)), corner.c_index));
            }
        }
        let mut leaving = BTreeMap::from([((through.sides[1], 0), 0)]);
        for _ in 0..turns.len() {
            for &(from, to, c) in &turns {
                match (leaving.get(&from).copied(), leaving.get(&to).copied()) {
                    (Some(direction), None) => leaving.insert(to, (direction + c) % 12),
                    (None, Some(direction)) => leaving.insert(from, (direction + 24 - c) % 12),
                    _ => None,
                };
            }
        }
        let closes = |&(from, to, c): &((u32, usize), (u32, usize), u8)| {
            leaving.get(&from).zip(leaving.get(&to)).is_some_and(|(a, b)| (a + c) % 12 == *b)
        };
        let is_sound = turns.iter().all(closes)
            && leaving.get(&(through.sides[0], 1)) == Some(&6)
            && leaving.values().all(|direction| lie(*direction).is_some());
        is_sound.then_some(Self { node, through, leaving })
    }

    fn lie(&self, side: u32, end: usize) -> Option<Lie> {
        self.leaving.get(&(side, end)).and_then(|&direction| lie(direction))
    }

    /// Twice the way from the middle of the edge to its end, as the side sees it when it runs along direction 0.
    fn half_way(&self, side: u32, end: usize, sign: i8) -> Point {
        let out = self.leaving[&(side, end)] + if end == 0 { 0 } else { 6 };
        let along = Point::unit((24 - out) % 12);
        if sign > 0 { along } else { -along }
    }
}

/// How an edge along direction 0 lies to a side; `None` where tiles have no path that way.
fn lie(direction: Direction) -> Option<Lie> {
    match (12 - direction) % 6 {
        0 => Some(Lie::Along),
        3 => Some(Lie::Across),
        oblique @ (2 | 4) => Some(Lie::Oblique(oblique)),
        _ => None,
    }
}

/// Halfway nodes as variables of the lengths programme.
pub(super) struct HalfwayVariables<'a> {
    pub nodes: &'a [Halfway],
    /// Whether each lies in the middle of an edge.
    pub is_half: Vec<Variable>,
    /// Of each side that may have it: half an edge more, half a pair more.
    pub of_side: Vec<[Option<Variable>; 2]>,
}

impl<'a> HalfwayVariables<'a> {
    pub fn new(programme: &mut Programme<'_>, graph: &PatchGraph, nodes: &'a [Halfway]) -> Self {
        let is_half: Vec<Variable> = nodes.iter().map(|_| programme.variable(0..=1)).collect();
        let of_side = (0..graph.sides.len() as u32)
            .map(|side| {
                let at = |end: usize| {
                    let here = |(node, is): (&Halfway, &Variable)| node.lie(side, end).map(|lie| (lie, *is));
                    nodes.iter().zip(&is_half).find_map(here)
                };
                let ends = [at(0), at(1)];
                let of = |wanted: Lie| ends.map(|end| end.filter(|(lie, _)| *lie == wanted).map(|(_, is)| is));
                let oblique = ends.map(|end| end.filter(|(lie, _)| matches!(lie, Lie::Oblique(_))));
                let along = match oblique {
                    [None, None] => exclusive(programme, of(Lie::Along)),
                    // Between the rows of vertices it stays between them.
                    [Some((a, first)), Some((b, second))] => {
                        programme.row(&[(first, 1), (second, -1)], 0..=0);
                        (a != b).then_some(first)
                    }
                    [Some((_, single)), None] | [None, Some((_, single))] => {
                        programme.row(&[(single, 1)], 0..=0);
                        exclusive(programme, of(Lie::Along))
                    }
                };
                [along, exclusive(programme, of(Lie::Across))]
            })
            .collect();
        Self { nodes, is_half, of_side }
    }

    /// The nodes at the corners of a patch, with the directions of their edges in its plane.
    pub fn edges_at(&self, patch: &Patch) -> Vec<(Variable, Direction)> {
        let mut found = Vec::new();
        for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
            let end = usize::from(corner.reversed);
            for (node, &is_half) in self.nodes.iter().zip(&self.is_half) {
                let edge = node.leaving.get(&(corner.side, end)).map(|leaving| (direction + 12 - leaving) % 12);
                found.extend(edge.map(|edge| (is_half, edge)));
            }
        }
        found
    }
}

/// A variable that is 1 when one of two is and the other is not.
fn exclusive(programme: &mut Programme<'_>, pair: [Option<Variable>; 2]) -> Option<Variable> {
    let [Some(a), Some(b)] = pair else { return pair[0].or(pair[1]) };
    let either = programme.variable(0..=1);
    programme.row(&[(either, 1), (a, -1), (b, -1)], ..=0);
    programme.row(&[(either, 1), (a, 1), (b, 1)], ..=2);
    programme.row(&[(either, 1), (a, -1), (b, 1)], 0..);
    programme.row(&[(either, 1), (a, 1), (b, -1)], 0..);
    Some(either)
}

/// A halfway node that goes to an end of its edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slide {
    pub node: u32,
    /// Break of the line, as [`Through`].
    pub line: usize,
    pub index: usize,
    /// How far along its line, scene units: half an edge forwards, or backwards when negative.
    pub by: f64,
}

/// Whole edges for sides of half edges, with the way each node in the middle of an edge goes; `None` where no way leaves
/// every side an edge.
pub(super) fn rounded(graph: &PatchGraph, halves: &[Halves], nodes: &[&Halfway]) -> Option<(Vec<Steps>, Vec<Slide>)> {
    let groups = groups(graph, halves, nodes)?;
    let mut signs: Vec<i8> = vec![1; nodes.len()];
    // Groups go one way or the other, whichever leaves fewer faults.
    let faults = |signs: &[i8]| {
        let steps = steps(graph, halves, nodes, signs)?;
        let courses: Vec<Course> = steps.iter().map(|&steps| straightforward(steps)).collect();
        Some(graph.patches.iter().map(|patch| fault(patch, &courses)).sum::<u32>())
    };
    let flipped = |signs: &[i8], group: &[(usize, i8)]| {
        let mut signs = signs.to_vec();
        for &(k, _) in group {
            signs[k] = -signs[k];
        }
        signs
    };
    for &(k, sign) in groups.iter().flatten() {
        signs[k] = sign;
    }
    let worst = u32::MAX;
    let mut least = faults(&signs).unwrap_or(worst);
    for _ in 0..2 {
        for group in &groups {
            let other = flipped(&signs, group);
            let found = faults(&other).unwrap_or(worst);
            if found < least {
                (least, signs) = (found, other);
            }
        }
    }
    let steps = steps(graph, halves, nodes, &signs)?;
    let slides = nodes.iter().zip(&signs).map(|(node, &sign)| {
        let Through { line, index, sides: [behind, ahead] } = node.through;
        let side = if sign > 0 { ahead } else { behind } as usize;
        let by = 0.5 * f64::from(sign) * graph.sides[side].length() / halves[side].length();
        Slide { node: node.node, line, index, by }
    });
    Some((steps, slides.collect()))
}

impl Halves {
    /// Edge lengths.
    pub fn length(self) -> f64 {
        f64::from(self.straight) / 2.0 + f64::from(self.pairs) * 3f64.sqrt() / 2.0
    }
}

/// Nodes that go the same way since a side between them stays in its direction, with the sign of each.
fn groups(graph: &PatchGraph, halves: &[Halves], nodes: &[&Halfway]) -> Option<Vec<Vec<(usize, i8)>>> {
    let joined: Vec<(usize, usize, i8)> = (0..graph.sides.len())
        .filter_map(|side| {
            let [a, b] = [0, 1].map(|end| nodes.iter().position(|node| node.lie(side as u32, end).is_some()));
            let (a, b) = (a?, b?);
            let is_free = [(a, 0), (b, 1)].iter().any(|&(k, end)| nodes[k].lie(side as u32, end) == Some(Lie::Along));
            let sign =
                if whole(halves[side], side, [Some((nodes[a], 1)), Some((nodes[b], 1))]).is_some() { 1 } else { -1 };
            (!is_free).then_some((a, b, sign))
        })
        .collect();
    let mut signs: Vec<Option<i8>> = vec![None; nodes.len()];
    let mut groups = Vec::new();
    for start in 0..nodes.len() {
        if signs[start].is_some() {
            continue;
        }
        signs[start] = Some(1);
        let mut group = vec![(start, 1)];
        let mut next = 0;
        while let Some(&(k, sign)) = group.get(next) {
            for &(a, b, relative) in joined.iter().filter(|(a, b, _)| *a == k || *b == k) {
                let other = if a == k { b } else { a };
                match signs[other] {
                    None => {
                        signs[other] = Some(sign * relative);
                        group.push((other, sign * relative));
                    }
                    Some(known) if known != sign * relative => return None,
                    Some(_) => {}
                }
            }
            next += 1;
        }
        groups.push(group);
    }
    Some(groups)
}

/// Whole edges of every side when nodes go as the signs say.
fn steps(graph: &PatchGraph, halves: &[Halves], nodes: &[&Halfway], signs: &[i8]) -> Option<Vec<Steps>> {
    (0..graph.sides.len())
        .map(|side| {
            let at = |end: usize| {
                let ends_here = |(node, _): &(&&Halfway, &i8)| node.lie(side as u32, end).is_some();
                nodes.iter().zip(signs).find(ends_here).map(|(node, sign)| (*node, *sign))
            };
            whole(halves[side], side, [at(0), at(1)])
        })
        .collect()
}

/// Whole edges of a side between nodes, those in the middle of an edge with their sign.
fn whole(halves: Halves, side: usize, ends: [Option<(&Halfway, i8)>; 2]) -> Option<Steps> {
    let pair = Point::unit(1) + Point::unit(11);
    let times = |p: Point, n: u32| Point(p.0.map(|x| x * n as i32));
    let shift = |end: usize| ends[end].map_or(Point::ORIGIN, |(node, sign)| node.half_way(side as u32, end, sign));
    let doubled = times(Point::unit(0), halves.straight) + times(pair, halves.pairs) + shift(1) - shift(0);
    let pairs = halves.pairs / 2;
    let turns: &[i8] = if halves.pairs.is_multiple_of(2) { &[0] } else { &[1, -1] };
    turns.iter().find_map(|&turned| {
        let edge = match turned {
            0 => Point::ORIGIN,
            1 => Point::unit(1),
            _ => Point::unit(11),
        };
        let left = doubled - times(pair, 2 * pairs) - times(edge, 2);
        let [straight, 0, 0, 0] = left.0 else { return None };
        let steps = Steps { straight: u32::try_from(straight / 2).ok()?, pairs, turned };
        (straight % 2 == 0 && steps.count() > 0).then_some(steps)
    })
}

impl Steps {
    /// Edges in all.
    pub fn count(self) -> u32 {
        self.straight + 2 * self.pairs + u32::from(self.turned != 0)
    }

    /// Whether there are both edges and pairs, and nothing else.
    pub fn is_mixed(self) -> bool {
        self.straight > 0 && self.pairs > 0 && self.turned == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Fill;
    use crate::surface::patch_graph::{Corner, Side};
    use crate::surface::paving::{Paving, pave};
    use crate::tile::Kind;
    use mesh::{DVec3, Monitor};
    use std::collections::BTreeMap;

    /// An equilateral triangle in three kites that meet at its middle; sides 2 k and 2 k + 1 are the halves of edge k, nodes 3 + k
    /// their middles, sides 6 + k lead from these to the middle, node 6.
    fn triangle(size: f64) -> (PatchGraph, Vec<Option<Through>>) {
        let turn = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 3.0;
            DVec3::new(angle.cos(), angle.sin(), 0.0)
        };
        let corners = [0, 1, 2].map(|k| size / 3f64.sqrt() * turn(k));
        let middles = [0, 1, 2].map(|k| corners[k].midpoint(corners[(k + 1) % 3]));
        let nodes: Vec<DVec3> = corners.into_iter().chain(middles).chain([DVec3::ZERO]).collect();
        let ends = (0..3).flat_map(|k| [[k, 3 + k], [3 + k, (k + 1) % 3]]).chain((3..6).map(|m| [m, 6]));
        let side = |ends: [u32; 2]| Side { ends, points: ends.map(|v| nodes[v as usize]).to_vec() };
        let sides = ends.map(side).collect();
        let corner = |node, c_index, side, reversed| Corner { node, c_index, side, reversed };
        let patches = (0..3u32).map(|k| {
            let before = (k + 2) % 3;
            let corners = vec![
                corner(k, 2, 2 * k, false),
                corner(3 + k, 3, 6 + k, false),
                corner(6, 4, 6 + before, true),
                corner(3 + before, 3, 2 * before + 1, false),
            ];
            Patch { corners }
        });
        let graph = PatchGraph { patches: patches.collect(), sides, nodes };
        let mut through = vec![None; 7];
        for k in 0..3 {
            through[3 + k] = Some(Through { line: k, index: 1, sides: [2 * k as u32, 2 * k as u32 + 1] });
        }
        (graph, through)
    }

    /// Sum of the squared differences between the lengths of sides and those drawn, over the latter; a turned edge counts as it runs along
    /// its side, and a side that ends in the middle of an edge is half of it longer or shorter.
    fn error(graph: &PatchGraph, paving: &Paving) -> f64 {
        let at = |side: usize, end: usize| paving.slides.iter().find(|slide| slide.node == graph.sides[side].ends[end]);
        let of = |side: usize| {
            let course = &paving.courses[side];
            let whole: f64 = course.iter().map(|&offset| (f64::from(offset) * std::f64::consts::FRAC_PI_6).cos()).sum();
            // The border runs on through nodes 3 to 5, along which they slide.
            let along =
                |end: usize| if side < 6 { at(side, end).map_or(0.0, |slide| 0.5 * slide.by.signum()) } else { 0.0 };
            (whole + along(0) - along(1) - graph.sides[side].length()).powi(2) / graph.sides[side].length()
        };
        (0..graph.sides.len()).map(of).sum()
    }

    #[test]
    fn kites_of_a_triangle_of_nine_edges_fit_with_half_edges_only() {
        let (graph, through) = triangle(9.0);
        let nodes = halfways(&graph, &through);
        assert_eq!(nodes.len(), 3);
        let laid = |nodes| {
            let paving = pave(&graph, nodes, 1.0, Fill::Regular, false, &Monitor::new());
            paving.expect("not cancelled").expect("lengths")
        };
        let (whole, half) = (laid(&[]), laid(&nodes));
        assert!(whole.slides.is_empty());
        assert_eq!(half.slides.len(), 3, "each middle lies in the middle of an edge");
        assert!(error(&graph, &whole) > 0.5, "whole edges err by {} only", error(&graph, &whole));
        assert!(error(&graph, &half) < 1e-9, "half edges err by {}", error(&graph, &half));
        // A triangle of nine edges holds 81, and its outline is one of whole edges.
        assert_eq!((half.tiles.len(), half.rhombi()), (81, 0));
        assert!(half.kinds.iter().all(|&kind| kind == Kind::Triangle));
        let mut uses: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
        let mut angle = vec![0; half.vertex_count];
        for tile in &half.tiles {
            for k in 0..3 {
                let (a, b) = (tile[k], tile[(k + 1) % 3]);
                uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a < b)] += 1;
                angle[a as usize] += 2;
            }
        }
        assert!(uses.values().all(|n| n[0] <= 1 && n[1] <= 1), "an edge twice in one direction");
        let border: Vec<u32> = uses.iter().filter(|(_, n)| n[0] + n[1] == 1).flat_map(|(edge, _)| *edge).collect();
        assert_eq!(border.len(), 2 * 27);
        assert_eq!(half.vertex_count + half.tiles.len() - uses.len(), 1, "Euler characteristic of a disk");
        // Corners have 60 degrees, the rest of the border 180, and everything inside a full turn.
        for (v, &angle) in angle.iter().enumerate() {
            let full = if v < 3 {
                2
            } else if border.contains(&(v as u32)) {
                6
            } else {
                12
            };
            assert_eq!(angle, full, "vertex {v}");
        }
    }

    #[test]
    fn lengths_of_half_edges_close_and_stay_near_when_nodes_go_to_ends_of_edges() {
        for size in 3..30 {
            let (graph, through) = triangle(f64::from(size));
            let nodes = halfways(&graph, &through);
            let laid = |nodes| pave(&graph, nodes, 1.0, Fill::Regular, false, &Monitor::new()).expect("not cancelled");
            let (Some(whole), Some(half)) = (laid(&[]), laid(&nodes)) else { panic!("{size}: no lengths") };
            assert!(half.cost <= whole.cost + 0.05 * whole.cost + 0.1, "{size}: {} and {}", half.cost, whole.cost);
            if size % 3 == 0 {
                assert!(error(&graph, &half) < 1e-9, "{size}: every third size fits exactly");
            }
            assert!(half.rhombi() == 0 && half.tiles.iter().all(|tile| tile.len() == 3), "{size}: one lattice");
        }
    }
}
