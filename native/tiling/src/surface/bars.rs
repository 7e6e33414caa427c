//! Shaping until panels can be built (section 4.2.4): where edges are too unequal or quads too bent with the weights that serve most
//! surfaces, other weights are tried, and the mesh nearest to the bars is taken.
//!
//! Regularity comes first in the weights of [`ShapeOptions`], for it is what most surfaces have room for. A coarse mesh of a surface
//! that curves as a saddle has not: its squares are bent by a part of their diagonal that grows with their size. Then flatness
//! matters more, and the vertices leave the surface a little for it, for which there is room within the bar of closeness. Squares
//! along the straight lines of a saddle no weight can flatten; [`super::SurfaceTiling::flaws`] sets patch graphs with such behind others.
//!
//! Weights that the caller set are the caller's wish and stay.

use super::SurfaceError;
use super::curve::Curve;
use super::merge::merged;
use super::panels::planarity;
use super::pattern::{Pattern, Place};
use super::regular::mean_edge;
use super::shape::{ShapeOptions, Shaped, shape};
use mesh::{Aabb, DVec3, Monitor, TriangleMesh};
use std::collections::{BTreeMap, BTreeSet};

/// Patches whose panels are more unequal than this (the spread of their edges) are no patches to build: the surface is not flat enough in
/// them.
pub(super) const MOST_SPREAD: f64 = 0.2;

/// Mean planarity of quads above which they are too bent to be cut from sheets.
pub(super) const MOST_BENT: f64 = 0.02;

/// Distance of a panel from the surface, in diagonals of the mesh, above which the mesh shows another shape.
const MOST_DISTANCE: f64 = 0.03;

/// Distance of a vertex from its border or followed line, in edges, above which there is a gap or an overlap to see.
const MOST_OFF_LINE: f64 = 0.05;

/// Distance of the border along its edges from that of the surface, and back, in edges.
const MOST_OFF_BORDER: f64 = 0.05;

/// The weight of equal edges where without it they are too unequal: then they matter more than angles. More of it moves panels off the
/// surface and gains little (a torus of 500 squares: spread 20.1% without, 18.9% with 0.3, 18.7% with 1, closeness 0.6% and 0.95%).
const EVEN: f64 = 0.5;

/// The weights of planarity tried one after another where quads are too bent, and the rounds they take to have their effect: the
/// stiffer, the slower.
const FLAT: [(f64, usize); 3] = [(40.0, 60), (80.0, 120), (120.0, 160)];

/// How often vertices are merged, and the part of the panels that may be turned over for it: where more are, the surface has no room for
/// panels of that size.
const MERGINGS: usize = 6;
const MOST_TURNED: f64 = 0.05;

/// How often vertices are pinned to points of the surface that the mesh misses, how far apart at a time, and from how far, in edges.
const PINNINGS: usize = 4;
const PINS_APART: f64 = 2.0;
const PIN_FROM: f64 = 2.5;

/// How often corners are loosened for panels that are turned over.
const LOOSENINGS: usize = 2;

/// What is asked of a mesh that can be built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bar {
    /// Standard deviation of the edge lengths over their mean, at most 0.2.
    Spread,
    /// Mean planarity of the quads, at most 0.02.
    Planarity,
    /// Distance of each panel's corners and middle from the surface, and of its vertices from the panels, at most 0.03 of the mesh's
    /// diagonal.
    Closeness,
    /// Distance of each vertex of a border or followed line from it, at most 0.05 of the mean edge.
    Lines,
    /// Distance of the border's edges, along all of them, from the border of the surface, and of the vertices of that from them, at most
    /// 0.05 of the mean edge: what is smaller than a panel is cut off.
    Borders,
}

/// A bar that a mesh misses.
#[derive(Debug, Clone, PartialEq)]
pub struct MissedBar {
    /// Which.
    pub bar: Bar,
    /// What was measured, in the bar's unit.
    pub measured: f64,
    /// What is allowed.
    pub allowed: f64,
    /// What misses it by itself, the worst first: faces with an edge so far off the mean, quads so bent, faces so far from the surface;
    /// for [`Bar::Lines`] vertices so far from their line.
    pub elements: Vec<u32>,
}

/// What was measured of a shaped mesh.
#[derive(Debug, Clone)]
pub(super) struct Quality {
    /// Standard deviation of the edge lengths over their mean.
    pub spread: f64,
    /// Mean planarity of quads.
    pub bent: f64,
    /// How far the edges of each panel are off the mean at most, in means.
    uneven: Vec<f64>,
    /// Planarity of each panel.
    bends: Vec<f64>,
    /// Distance of each panel from the surface, in diagonals of the mesh.
    off_surface: Vec<f64>,
    /// Distance of each vertex from its line, in mean edges.
    off_line: Vec<f64>,
    /// Distance of each panel's border edges from the border of the surface, and of that from them, in mean edges.
    off_border: Vec<f64>,
}

/// Distances of a mesh from what it covers, scene units.
pub(super) struct Off {
    /// Of each tile from the surface.
    pub surface: Vec<f64>,
    /// Of each vertex from its line.
    pub line: Vec<f64>,
    /// Of each tile's border edges from the border of the surface, and of that from them.
    pub border: Vec<f64>,
}

impl Quality {
    /// Of a pattern with these edges, which is so far from what it covers. O(n).
    pub fn of(positions: &[DVec3], tiles: &[Vec<u32>], edges: &[[u32; 2]], off: Off) -> Self {
        let length = |[a, b]: [u32; 2]| positions[a as usize].distance(positions[b as usize]);
        let count = edges.len().max(1) as f64;
        let mean = (edges.iter().map(|&edge| length(edge)).sum::<f64>() / count).max(f64::MIN_POSITIVE);
        let off_mean = |edge: [u32; 2]| (length(edge) / mean - 1.0).abs();
        let variance = edges.iter().map(|&edge| off_mean(edge).powi(2)).sum::<f64>() / count;
        let worst_edge = |tile: &Vec<u32>| {
            (0..tile.len()).map(|k| off_mean([tile[k], tile[(k + 1) % tile.len()]])).fold(0.0, f64::max)
        };
        let bend = |tile: &Vec<u32>| match tile.len() {
            4 => planarity(&tile.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>()),
            _ => 0.0,
        };
        let bends: Vec<f64> = tiles.iter().map(bend).collect();
        let quads = tiles.iter().filter(|tile| tile.len() == 4).count();
        let diagonal = Aabb::of(positions.iter().copied()).diagonal().max(f64::MIN_POSITIVE);
        Self {
            spread: variance.sqrt(),
            bent: bends.iter().sum::<f64>() / quads.max(1) as f64,
            uneven: tiles.iter().map(worst_edge).collect(),
            bends,
            off_surface: off.surface.into_iter().map(|distance| distance / diagonal).collect(),
            off_line: off.line.into_iter().map(|distance| distance / mean).collect(),
            off_border: off.border.into_iter().map(|distance| distance / mean).collect(),
        }
    }

    /// The distance of the panel that is farthest from the surface, in diagonals of the mesh.
    fn distance(&self) -> f64 {
        most(&self.off_surface)
    }

    /// Every bar with what was measured, what is allowed, and what was measured of each element.
    fn measured(&self) -> [(Bar, f64, f64, &[f64]); 5] {
        [
            (Bar::Spread, self.spread, MOST_SPREAD, &self.uneven),
            (Bar::Planarity, self.bent, MOST_BENT, &self.bends),
            (Bar::Closeness, self.distance(), MOST_DISTANCE, &self.off_surface),
            (Bar::Lines, most(&self.off_line), MOST_OFF_LINE, &self.off_line),
            (Bar::Borders, most(&self.off_border), MOST_OFF_BORDER, &self.off_border),
        ]
    }

    /// What is above the bars, in bars, 0 where nothing is; but for that of borders, which cannot be met where these are jagged: nothing is
    /// to get worse for it.
    pub fn excess(&self) -> f64 {
        let judged = self.measured().into_iter().filter(|(bar, ..)| *bar != Bar::Borders);
        judged.map(|(_, measured, allowed, _)| (measured / allowed - 1.0).max(0.0)).sum()
    }

    /// The bars that the mesh misses, with its elements that do.
    pub fn missed(&self) -> Vec<MissedBar> {
        let missed = self.measured().into_iter().filter(|(_, measured, allowed, _)| measured > allowed);
        missed
            .map(|(bar, measured, allowed, off)| {
                let mut elements: Vec<u32> = (0..off.len() as u32).filter(|&k| off[k as usize] > allowed).collect();
                elements.sort_by(|&a, &b| off[b as usize].total_cmp(&off[a as usize]).then(a.cmp(&b)));
                MissedBar { bar, measured, allowed, elements }
            })
            .collect()
    }
}

fn most(distances: &[f64]) -> f64 {
    distances.iter().copied().fold(0.0, f64::max)
}

/// Corners of the border at panels that are turned over, each with a curve along which it may slide instead: on a jagged border there is
/// no room for panels beside every corner, and panels that are cut off by part of an edge there are better than ones turned over, or
/// many times as many. Where more than two curves meet they stay.
fn loosened(pattern: &Pattern, turned: &[u32]) -> BTreeMap<u32, u32> {
    let is_fixed = |v: u32| pattern.places[v as usize] == Place::Fixed;
    let at_turned = turned.iter().flat_map(|&t| &pattern.tiles[t as usize]).copied();
    let wanted: BTreeSet<u32> = at_turned.filter(|&v| is_fixed(v)).collect();
    // The edges at each, with whether they are on the border.
    let mut edges: BTreeMap<[u32; 2], bool> = BTreeMap::new();
    for (&[a, b], &uses) in &pattern.edge_uses() {
        edges.extend(
            [[a, b], [b, a]].into_iter().filter(|edge| wanted.contains(&edge[0])).map(|edge| (edge, uses == 1)),
        );
    }
    let curves = |v: u32, is_border: bool| -> BTreeSet<u32> {
        let beside = edges.range([v, 0]..=[v, u32::MAX]).filter(|(_, on_border)| **on_border == is_border);
        let on = beside.filter_map(|(edge, _)| match pattern.places[edge[1] as usize] {
            Place::OnCurve(curve) => Some(curve),
            Place::Free | Place::Fixed => None,
        });
        on.collect()
    };
    let found = wanted.iter().filter_map(|&v| {
        let (border, inner) = (curves(v, true), curves(v, false));
        Some((v, *border.first()?)).filter(|_| inner.is_subset(&border))
    });
    found.collect()
}

/// Merges vertices that are too near to one another, where a bar is missed or panels are turned over, as long as that helps.
fn merge(
    surface: &TriangleMesh,
    curves: &[Curve],
    pattern: &mut Pattern,
    best: &mut Shaped,
    options: ShapeOptions,
    monitor: &Monitor,
) -> Result<bool, SurfaceError> {
    let (mut tried, mut turned, mut is_any, mut in_vain) = (pattern.clone(), best.turned.clone(), false, 0);
    for _ in 0..MERGINGS {
        if best.excess() <= 0.0 || in_vain > 1 || turned.len() as f64 > MOST_TURNED * tried.tiles.len() as f64 {
            break;
        }
        let Some(fewer) = merged(&tried, &turned) else { break };
        tried = fewer;
        let shaped = shape(surface, curves, &mut tried, options, monitor)?;
        turned.clone_from(&shaped.turned);
        in_vain += 1;
        if shaped.excess() < best.excess() {
            (*best, *pattern, is_any, in_vain) = (shaped, tried.clone(), true, 0);
        }
    }
    Ok(is_any)
}

/// Pins the nearest vertices to the points of the surface that the mesh is farthest from, the tips and rims that panels cut off; whether there
/// are any.
fn pin(surface: &TriangleMesh, pattern: &mut Pattern, far: &[(f64, u32)]) -> bool {
    let uses = pattern.edge_uses();
    let mut is_by_curve = vec![false; pattern.positions.len()];
    for &[a, b] in uses.keys() {
        for (v, w) in [(a, b), (b, a)] {
            is_by_curve[v as usize] |= pattern.places[w as usize] != Place::Free;
        }
    }
    let edge = mean_edge(&pattern.tiles, &pattern.positions);
    let mut pins: Vec<DVec3> = Vec::new();
    for &(_, v) in far {
        let p = surface.positions[v as usize];
        if pins.iter().any(|pin| pin.distance(p) < PINS_APART * edge) {
            continue;
        }
        let free = (0..pattern.positions.len()).filter(|&v| pattern.places[v] == Place::Free && !is_by_curve[v]);
        let near = free.map(|v| (pattern.positions[v].distance(p), v)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, v)) = near.filter(|near| near.0 < PIN_FROM * edge) {
            (pattern.positions[v], pattern.places[v]) = (p, Place::Fixed);
            pins.push(p);
        }
    }
    !pins.is_empty()
}

/// Puts the pattern on the surface and shapes it with the weights asked for, and with others where these leave it above a bar. If it
/// may, it merges vertices for that: the pattern then has fewer tiles.
pub(super) fn shape_to_bars(
    surface: &TriangleMesh,
    curves: &[Curve],
    pattern: &mut Pattern,
    options: ShapeOptions,
    may_merge: bool,
    monitor: &Monitor,
) -> Result<Shaped, SurfaceError> {
    let mut laid = pattern.positions.clone();
    let mut best = shape(surface, curves, pattern, options, monitor)?;
    let may_merge = may_merge && options.rounds > 0;
    if may_merge && merge(surface, curves, pattern, &mut best, options, monitor)? {
        laid.clone_from(&pattern.positions);
    }
    for _ in 0..LOOSENINGS {
        let corners = loosened(pattern, &best.turned);
        if corners.is_empty() {
            break;
        }
        let before = pattern.clone();
        for (v, curve) in corners {
            pattern.places[v as usize] = Place::OnCurve(curve);
        }
        pattern.positions.copy_from_slice(&laid);
        let shaped = shape(surface, curves, pattern, options, monitor)?;
        if shaped.turned.len() >= best.turned.len() {
            *pattern = before;
            break;
        }
        best = shaped;
        if may_merge && merge(surface, curves, pattern, &mut best, options, monitor)? {
            laid.clone_from(&pattern.positions);
        }
    }
    if !best.turned.is_empty() || best.quality.excess() <= 0.0 {
        return Ok(best);
    }
    // Shapes once more and keeps what is nearer to the bars.
    let again = |pattern: &mut Pattern, best: &mut Shaped, from: Option<&[DVec3]>, options| {
        let before = pattern.positions.clone();
        if let Some(from) = from {
            pattern.positions.copy_from_slice(from);
        }
        let shaped = shape(surface, curves, pattern, options, monitor)?;
        let is_better = shaped.turned.is_empty() && shaped.quality.excess() < best.quality.excess();
        if is_better {
            *best = shaped;
        } else {
            pattern.positions = before;
        }
        Ok::<bool, SurfaceError>(is_better)
    };
    let default = ShapeOptions::default();
    let mut weights = options;
    if best.quality.spread > MOST_SPREAD && options.uniformity == 0.0 {
        let even = ShapeOptions { uniformity: EVEN, ..options };
        if again(pattern, &mut best, Some(&laid), even)? {
            weights = even;
        }
    }
    for _ in 0..PINNINGS {
        if best.quality.distance() <= MOST_DISTANCE {
            break;
        }
        let mut tried = pattern.clone();
        if !pin(surface, &mut tried, &best.far) {
            break;
        }
        let shaped = shape(surface, curves, &mut tried, weights, monitor)?;
        if shaped.excess() >= best.excess() {
            break;
        }
        (best, *pattern) = (shaped, tried);
    }
    let chosen = [options.planarity, options.closeness].map(f64::to_bits);
    if options.flattening_rounds > 0 && chosen == [default.planarity, default.closeness].map(f64::to_bits) {
        for (planarity, flattening_rounds) in FLAT {
            if best.quality.bent <= MOST_BENT {
                break;
            }
            let flat = ShapeOptions { rounds: 0, flattening_rounds, planarity, ..weights };
            again(pattern, &mut best, None, flat)?;
        }
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of four unit squares, bent up by `bend` at one corner of the last.
    fn row(bend: f64) -> (Vec<DVec3>, Vec<Vec<u32>>, Vec<[u32; 2]>) {
        let mut positions: Vec<DVec3> = (0..10).map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), 0.0)).collect();
        positions[9].z = bend;
        let tiles: Vec<Vec<u32>> = (0..4).map(|k| [0, 2, 3, 1].map(|corner| 2 * k + corner).to_vec()).collect();
        let mut edges: Vec<[u32; 2]> = (0..5).map(|k| [2 * k, 2 * k + 1]).collect();
        edges.extend((0..8).map(|k| [k, k + 2]));
        (positions, tiles, edges)
    }

    #[test]
    fn a_vertex_off_its_line_is_named_and_one_nearly_on_it_is_not() {
        let (positions, tiles, edges) = row(0.0);
        let mut off_line = vec![0.0; 10];
        (off_line[3], off_line[5], off_line[8]) = (0.049, 0.06, 0.2);
        let off = |line| Off { surface: vec![0.0; 4], line, border: vec![0.0; 4] };
        let quality = Quality::of(&positions, &tiles, &edges, off(off_line));
        let wanted = MissedBar { bar: Bar::Lines, measured: 0.2, allowed: MOST_OFF_LINE, elements: vec![8, 5] };
        assert_eq!(quality.missed(), [wanted]);
        assert!((quality.excess() - 3.0).abs() < 1e-12);
        let quality = Quality::of(&positions, &tiles, &edges, off(vec![0.05; 10]));
        assert_eq!((quality.missed(), quality.excess()), (vec![], 0.0), "on the bar is not above it");
    }

    #[test]
    fn panels_are_named_by_what_they_miss_themselves() {
        let (mut positions, tiles, edges) = row(0.5);
        let off = |surface| Off { surface, line: vec![0.0; 10], border: vec![0.0; 4] };
        let quality = Quality::of(&positions, &tiles, &edges, off(vec![0.0, 0.0, 0.2, 0.1]));
        // The diagonals of the last square pass one another at 0.5 / sqrt 6 and are sqrt 2 and 1.5 long.
        let bent = 0.5 / (4.0 + 2.0 * 0.25 + 0.0_f64).sqrt() / f64::midpoint(2f64.sqrt(), 1.5);
        let missed = quality.missed();
        assert_eq!(missed.iter().map(|missed| missed.bar).collect::<Vec<_>>(), [Bar::Planarity, Bar::Closeness]);
        assert_eq!((missed[0].elements.as_slice(), missed[1].elements.as_slice()), (&[3][..], &[2][..]));
        assert!((missed[0].measured - bent / 4.0).abs() < 0.01, "{} for {}", missed[0].measured, bent / 4.0);
        // One edge three times as long: each edge counts once, whichever faces it has.
        positions[9] = DVec3::new(4.0, 1.0, 0.0);
        positions[8].y = -2.0;
        let lengths = edges.iter().map(|&[a, b]| positions[a as usize].distance(positions[b as usize]));
        let lengths: Vec<f64> = lengths.collect();
        let mean = lengths.iter().sum::<f64>() / 13.0;
        let spread = (lengths.iter().map(|l| (l / mean - 1.0).powi(2)).sum::<f64>() / 13.0).sqrt();
        let quality = Quality::of(&positions, &tiles, &edges, off(vec![0.0; 4]));
        assert!((quality.spread - spread).abs() < 1e-12);
        assert_eq!(quality.missed()[0].elements[0], 3);
    }
}
