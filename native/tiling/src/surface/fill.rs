//! Other tilings of the same surface: patches without irregular vertices are filled anew by the plane solver (section
//! 4.2.2).
//!
//! A patch is grown around a vertex, one star after another, while it unfolds into the exact plane without overlap and stays
//! a disk; so no irregular vertex lies inside. Its outline is a boundary code that has a tiling, namely the present one.
//! The plane solver counts all of them and draws one, each equally likely. All tilings of an outline have as many triangles
//! and squares, hence as many vertices inside, and the angles along it do not change: what was regular stays so. The new
//! vertices find their place through the unfolded tiles, linear in each half of them.

use super::SurfaceError;
use super::pattern::{Pattern, Place};
use crate::plane::Point;
use crate::random::Random;
use crate::{Boundary, Options, TilingError, Tilings};
use mesh::{DVec3, Monitor};
use std::collections::{BTreeMap, BTreeSet};

/// Sweeps over the surface: the seams between the patches of one lie inside those of the next.
const SWEEPS: usize = 2;

/// Memory for the tilings of one patch, bytes.
const MEMORY: usize = 1 << 28;

/// A part of the pattern unfolded into the plane.
#[derive(Clone, Default)]
struct Patch {
    tiles: BTreeSet<u32>,
    at: BTreeMap<u32, Point>,
}

/// Draws the tiles of patches of about `patch_panels` anew; how many patches there were, and how many changed.
pub(super) fn refill(
    pattern: &mut Pattern,
    patch_panels: usize,
    seed: u64,
    monitor: &Monitor,
) -> Result<(usize, usize), SurfaceError> {
    let mut random = Random::new(seed);
    let (mut patches, mut changed) = (0, 0);
    for _ in 0..SWEEPS {
        let mut tiles_at = vec![Vec::new(); pattern.positions.len()];
        for (t, tile) in pattern.tiles.iter().enumerate() {
            for &v in tile {
                tiles_at[v as usize].push(t as u32);
            }
        }
        let mut used: Vec<bool> = pattern
            .tiles
            .iter()
            .map(|tile| tile.iter().filter(|&&v| pattern.places[v as usize] != Place::Free).count() > 1)
            .collect();
        let mut seeds: Vec<u32> = (0..pattern.positions.len() as u32).collect();
        for k in (1..seeds.len()).rev() {
            seeds.swap(k, random.index(k + 1));
        }
        for v in seeds {
            monitor.check()?;
            let patch = grow(pattern, &tiles_at, &used, v, patch_panels);
            if patch.tiles.is_empty() {
                continue;
            }
            for &t in &patch.tiles {
                used[t as usize] = true;
            }
            patches += 1;
            changed += usize::from(draw(pattern, &patch, &mut random, monitor)?);
        }
    }
    Ok((patches, changed))
}

/// The patch around a vertex; empty where there is none.
fn grow(pattern: &Pattern, tiles_at: &[Vec<u32>], used: &[bool], seed: u32, most: usize) -> Patch {
    let mut patch = Patch::default();
    let mut waiting = std::collections::VecDeque::from([seed]);
    let mut tried = BTreeSet::from([seed]);
    while let Some(v) = waiting.pop_front() {
        let star = &tiles_at[v as usize];
        let is_open = pattern.places[v as usize] == Place::Free && star.iter().all(|t| !used[*t as usize]);
        let grown = if is_open { patch.with_star(pattern, star) } else { None };
        if let Some(grown) = grown.filter(|grown| grown.tiles.len() <= most && grown.outline(pattern).is_some()) {
            for &w in grown.at.keys() {
                if tried.insert(w) {
                    waiting.push_back(w);
                }
            }
            patch = grown;
        } else if patch.tiles.is_empty() {
            break;
        }
    }
    patch
}

impl Patch {
    /// The patch and the tiles of a star, unfolded; `None` where they do not close or lie on other vertices.
    fn with_star(&self, pattern: &Pattern, star: &[u32]) -> Option<Self> {
        let mut grown = self.clone();
        let mut missing: Vec<u32> = star.iter().copied().filter(|t| !self.tiles.contains(t)).collect();
        if grown.tiles.is_empty() {
            let first = &pattern.tiles[*missing.first()? as usize];
            grown.at.extend([(first[0], Point::ORIGIN), (first[1], Point::unit(0))]);
        }
        while !missing.is_empty() {
            let (index, start) = missing.iter().enumerate().find_map(|(index, &t)| {
                let tile = &pattern.tiles[t as usize];
                let known = |k: usize| grown.at.contains_key(&tile[k % tile.len()]);
                (0..tile.len()).find(|&k| known(k) && known(k + 1)).map(|k| (index, k))
            })?;
            let t = missing.remove(index);
            let tile = &pattern.tiles[t as usize];
            let n = tile.len();
            let mut here = grown.at[&tile[start]];
            let along = grown.at[&tile[(start + 1) % n]] - here;
            let mut direction = (0..12).find(|&d| Point::unit(d) == along)?;
            for k in 0..n {
                if *grown.at.entry(tile[(start + k) % n]).or_insert(here) != here {
                    return None;
                }
                here = here + Point::unit(direction);
                direction = (direction + if n == 3 { 4 } else { 3 }) % 12;
            }
            grown.tiles.insert(t);
        }
        let places: BTreeSet<Point> = grown.at.values().copied().collect();
        (places.len() == grown.at.len()).then_some(grown)
    }

    /// The vertices along its border, counter-clockwise, where that is one simple loop.
    fn outline(&self, pattern: &Pattern) -> Option<Vec<u32>> {
        let mut next = BTreeMap::new();
        let mut sides = BTreeSet::new();
        for &t in &self.tiles {
            let tile = &pattern.tiles[t as usize];
            for k in 0..tile.len() {
                sides.insert((tile[k], tile[(k + 1) % tile.len()]));
            }
        }
        for &(a, b) in sides.iter().filter(|&&(a, b)| !sides.contains(&(b, a))) {
            if next.insert(a, b).is_some() {
                return None;
            }
        }
        let (&start, _) = next.first_key_value()?;
        let mut outline = vec![start];
        while let Some(&v) = next.get(&outline[outline.len() - 1]).filter(|&&v| v != start) {
            outline.push(v);
        }
        (outline.len() == next.len()).then_some(outline)
    }
}

/// Replaces the tiles of a patch by those of a tiling drawn at random; whether there was another one.
fn draw(pattern: &mut Pattern, patch: &Patch, random: &mut Random, monitor: &Monitor) -> Result<bool, SurfaceError> {
    let outline = patch.outline(pattern).expect("patches are grown as disks");
    let mut angle: BTreeMap<u32, u8> = BTreeMap::new();
    for &t in &patch.tiles {
        let tile = &pattern.tiles[t as usize];
        for &v in tile {
            *angle.entry(v).or_default() += if tile.len() == 3 { 2 } else { 3 };
        }
    }
    let code: Vec<u8> = outline.iter().map(|v| angle[v]).collect();
    // An unfolded patch may still cross itself between its corners.
    let Ok(boundary) = Boundary::new(&code) else { return Ok(false) };
    let tilings = Tilings::new(&boundary, &Options { memory: MEMORY }, monitor);
    let mut tilings = match tilings {
        Ok(tilings) => tilings,
        Err(TilingError::Cancelled(cancelled)) => return Err(cancelled.into()),
        // Too many tilings to count in the memory: the patch stays as it is.
        Err(_) => return Ok(false),
    };
    let index = random.below(tilings.count());
    let Ok(Some(tiling)) = tilings.get(&index, monitor) else { return Ok(false) };
    // From the code's plane to that of the patch: turn its first edge onto the patch's.
    let (origin, along) = (patch.at[&outline[0]], patch.at[&outline[1]] - patch.at[&outline[0]]);
    let turn = (0..12).find(|&d| Point::unit(d) == along).expect("neighbours on the outline are an edge apart");
    let turn = (turn + 12 - boundary.directions()[0]) % 12;
    let to_patch = |p: Point| origin + (p - boundary.points()[0]).turned(turn);
    let mut vertex: BTreeMap<Point, u32> = outline.iter().map(|v| (patch.at[v], *v)).collect();
    let mut free = patch.at.keys().copied().filter(|v| !outline.contains(v));
    let mut moved = Vec::new();
    let mut tiles: Vec<Vec<u32>> = Vec::new();
    for tile in &tiling.tiles {
        let mut corners = Vec::new();
        for corner in tile.corners().map(to_patch) {
            let v = *vertex.entry(corner).or_insert_with(|| {
                let v = free.next().expect("all tilings of an outline have as many vertices");
                moved.push((v, lift(pattern, patch, corner)));
                v
            });
            corners.push(v);
        }
        tiles.push(corners);
    }
    let is_other = tiles.iter().any(|tile| !patch.tiles.iter().any(|&t| same_loop(&pattern.tiles[t as usize], tile)));
    for (v, position) in moved {
        pattern.positions[v as usize] = position;
    }
    for (&t, tile) in patch.tiles.iter().zip(tiles) {
        pattern.tiles[t as usize] = tile;
    }
    Ok(is_other)
}

fn same_loop(a: &[u32], b: &[u32]) -> bool {
    a.len() == b.len() && a.iter().all(|v| b.contains(v))
}

/// The place in space of a point of the plane that a patch covers.
fn lift(pattern: &Pattern, patch: &Patch, p: Point) -> DVec3 {
    let [x, y] = p.position();
    let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
    for &t in &patch.tiles {
        let tile = &pattern.tiles[t as usize];
        for k in 1..tile.len() - 1 {
            let corners = [tile[0], tile[k], tile[k + 1]];
            let [a, b, c] = corners.map(|v| patch.at[&v].position());
            let cross =
                |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            let whole = cross(a, b, c);
            let weights = [cross([x, y], b, c), cross(a, [x, y], c), cross(a, b, [x, y])].map(|w| w / whole);
            let least = weights.iter().copied().fold(f64::INFINITY, f64::min);
            if least > best.0 {
                best = (least, corners.iter().zip(weights).map(|(&v, w)| w * pattern.positions[v as usize]).sum());
            }
        }
    }
    best.1
}
