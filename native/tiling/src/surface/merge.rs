//! Merging vertices where a surface is finer than its panels.
//!
//! The pattern has three edges for each step of the coarse triangulation, and a step for each stretch between corners: a hole of the size
//! of a panel gets nine edges and a crowd of small panels around it, some of which may have no room at all. Here the two ends of edges that are
//! too short are made one vertex: triangles beside such an edge vanish, squares become triangles. What is left is a mesh of the same
//! topology, since an edge is merged only where its ends have no neighbour in common but in the faces beside it (the link condition of
//! Dey et al. 1999), and of the same corners and curves. It pays with irregular vertices, so it is for meshes that miss a bar. The paper, which
//! starts from smooth surfaces, has no need of it.

use super::pattern::{Pattern, Place};
use mesh::{DVec3, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// Edges shorter than this part of the mean are merged; at panels that are turned over, the shortest edge if it is shorter than that part.
const SHORT: f64 = 0.62;
const SHORT_AT_TURNED: f64 = 1.1;

/// Triangles and squares at a vertex that is left, inside.
const MOST_AROUND: usize = 8;
const LEAST_AROUND: usize = 4;

/// A pattern whose vertices can be merged.
struct Merging<'a> {
    pattern: &'a Pattern,
    turned: BTreeSet<u32>,
    uses: BTreeMap<[u32; 2], u8>,
    tiles_at: Vec<Vec<u32>>,
    beside: Vec<BTreeSet<u32>>,
    on_border: Vec<bool>,
}

/// The pattern with the ends of edges made one that are too short, some of them: no two that are beside one another. `None` where there are
/// none that can be. O(n log n).
pub(super) fn merged(pattern: &Pattern, turned: &[u32]) -> Option<Pattern> {
    let merging = Merging::new(pattern, turned);
    let length = |[a, b]: [u32; 2]| pattern.positions[a as usize].distance(pattern.positions[b as usize]);
    let mean = merging.uses.keys().map(|&edge| length(edge)).sum::<f64>() / merging.uses.len().max(1) as f64;
    let mut wanted: BTreeSet<[u32; 2]> =
        merging.uses.keys().copied().filter(|&edge| length(edge) < SHORT * mean).collect();
    for &t in turned {
        let tile = &pattern.tiles[t as usize];
        let edges = (0..tile.len()).map(|k| sorted(tile[k], tile[(k + 1) % tile.len()]));
        wanted.extend(edges.filter(|&edge| length(edge) < SHORT_AT_TURNED * mean));
    }
    let mut wanted: Vec<[u32; 2]> = wanted.into_iter().collect();
    wanted.sort_by(|&a, &b| length(a).total_cmp(&length(b)).then(a.cmp(&b)));
    let mut is_touched = vec![false; pattern.positions.len()];
    let mut goes_to: Vec<u32> = (0..pattern.positions.len() as u32).collect();
    let (mut positions, mut places) = (pattern.positions.clone(), pattern.places.clone());
    let mut is_any = false;
    for edge in wanted {
        let Some((kept, position, place)) = merging.outcome(edge) else { continue };
        let near: BTreeSet<u32> = edge.iter().flat_map(|&v| merging.around(v)).collect();
        if near.iter().any(|&v| is_touched[v as usize]) || !merging.keeps_sides(edge, position) {
            continue;
        }
        for v in near {
            is_touched[v as usize] = true;
        }
        let gone = if kept == edge[0] { edge[1] } else { edge[0] };
        goes_to[gone as usize] = kept;
        (positions[kept as usize], places[kept as usize]) = (position, place);
        is_any = true;
    }
    is_any.then(|| rebuilt(&pattern.tiles, &goes_to, &positions, &places))
}

impl<'a> Merging<'a> {
    fn new(pattern: &'a Pattern, turned: &[u32]) -> Self {
        let count = pattern.positions.len();
        let uses = pattern.edge_uses();
        let (mut tiles_at, mut beside) = (vec![Vec::new(); count], vec![BTreeSet::new(); count]);
        let mut on_border = vec![false; count];
        for (t, tile) in pattern.tiles.iter().enumerate() {
            for &v in tile {
                tiles_at[v as usize].push(t as u32);
            }
        }
        for (&[a, b], &uses) in &uses {
            beside[a as usize].insert(b);
            beside[b as usize].insert(a);
            for v in [a, b] {
                on_border[v as usize] |= uses == 1;
            }
        }
        Self { pattern, turned: turned.iter().copied().collect(), uses, tiles_at, beside, on_border }
    }

    /// All vertices of the tiles at a vertex.
    fn around(&self, v: u32) -> impl Iterator<Item = u32> {
        self.tiles_at[v as usize].iter().flat_map(|&t| self.pattern.tiles[t as usize].iter().copied())
    }

    /// Which end of an edge stays, where, and where it may go from there; `None` where they cannot be one.
    fn outcome(&self, [a, b]: [u32; 2]) -> Option<(u32, DVec3, Place)> {
        let at = |v: u32| self.pattern.positions[v as usize];
        let place = |v: u32| self.pattern.places[v as usize];
        let is_border_edge = self.uses[&[a, b]] == 1;
        if !is_border_edge && self.on_border[a as usize] && self.on_border[b as usize] {
            return None;
        }
        let kept = match (place(a), place(b)) {
            (Place::Free, Place::Free) => (a, at(a).midpoint(at(b)), Place::Free),
            (Place::OnCurve(c), Place::OnCurve(d)) if c == d => (a, at(a).midpoint(at(b)), place(a)),
            (Place::Fixed, Place::OnCurve(_)) | (Place::Fixed | Place::OnCurve(_), Place::Free) => (a, at(a), place(a)),
            (Place::OnCurve(_), Place::Fixed) | (Place::Free, Place::Fixed | Place::OnCurve(_)) => (b, at(b), place(b)),
            _ => return None,
        };
        self.can_be_one([a, b]).then_some(kept)
    }

    /// Whether the mesh stays one of triangles and squares with the same topology.
    fn can_be_one(&self, [a, b]: [u32; 2]) -> bool {
        let tiles = |v: u32| self.tiles_at[v as usize].iter().copied().collect::<BTreeSet<u32>>();
        let (of_a, of_b) = (tiles(a), tiles(b));
        let shared: Vec<u32> = of_a.intersection(&of_b).copied().collect();
        if shared.len() != usize::from(self.uses[&[a, b]]) {
            return false;
        }
        let triangles: Vec<&Vec<u32>> =
            shared.iter().map(|&t| &self.pattern.tiles[t as usize]).filter(|tile| tile.len() == 3).collect();
        let thirds: BTreeSet<u32> =
            triangles.iter().flat_map(|t| t.iter().copied()).filter(|v| ![a, b].contains(v)).collect();
        // Whatever tile of one has a vertex in common with a tile of the other but beside the edge would come to meet it there.
        let met = |v: u32, but: u32| -> BTreeSet<u32> { self.around(v).filter(|&w| w != v && w != but).collect() };
        let shared_rims: BTreeSet<u32> =
            shared.iter().flat_map(|&t| self.pattern.tiles[t as usize].iter().copied()).collect();
        if met(a, b).intersection(&met(b, a)).any(|v| !shared_rims.contains(v))
            || self.beside[a as usize].intersection(&self.beside[b as usize]).any(|v| !thirds.contains(v))
        {
            return false;
        }
        let left = of_a.len() + of_b.len() - shared.len() - triangles.len();
        let is_inside = |v: u32| !self.on_border[v as usize];
        let thins = |v: u32| {
            is_inside(v) && self.tiles_at[v as usize].len() <= LEAST_AROUND || self.tiles_at[v as usize].len() <= 1
        };
        left <= MOST_AROUND
            && left >= if is_inside(a) && is_inside(b) { LEAST_AROUND } else { 1 }
            && !thirds.into_iter().any(thins)
    }

    /// Whether no tile around turns over by it that has not.
    fn keeps_sides(&self, [a, b]: [u32; 2], position: DVec3) -> bool {
        let around: BTreeSet<u32> = [a, b].iter().flat_map(|&v| self.tiles_at[v as usize].iter().copied()).collect();
        around.into_iter().filter(|t| !self.turned.contains(t)).all(|t| {
            let tile = &self.pattern.tiles[t as usize];
            let old: Vec<DVec3> = tile.iter().map(|&v| self.pattern.positions[v as usize]).collect();
            let ends = tile.iter().filter(|v| [a, b].contains(v)).count();
            let moved = |v: u32| if v == a || v == b { position } else { self.pattern.positions[v as usize] };
            let new: Vec<DVec3> = tile.iter().map(|&v| moved(v)).collect();
            tile.len() - (ends - 1).min(1) < 3 || mesh::face_normal(&old).dot(mesh::face_normal(&new)) > 0.0
        })
    }
}

/// The tiles with each vertex where it goes to, without what has no area any more and without vertices that are in no tile.
fn rebuilt(tiles: &[Vec<u32>], goes_to: &[u32], positions: &[DVec3], places: &[Place]) -> Pattern {
    let mut made = Pattern { positions: Vec::new(), places: Vec::new(), tiles: Vec::new() };
    let mut index: BTreeMap<u32, u32> = BTreeMap::new();
    for tile in tiles {
        let mut corners: Vec<u32> = tile.iter().map(|&v| goes_to[v as usize]).collect();
        corners.dedup();
        if corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            continue;
        }
        for v in &mut corners {
            let old = *v as usize;
            *v = *index.entry(*v).or_insert_with(|| {
                made.positions.push(positions[old]);
                made.places.push(places[old]);
                made.positions.len() as u32 - 1
            });
        }
        made.tiles.push(corners);
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows of `n` unit squares over one another, the upper row cut into triangles; `x` are the places of the columns.
    fn rows(x: &[f64]) -> Pattern {
        let at = |row: u32| x.iter().map(move |&x| DVec3::new(x, f64::from(row), 0.0));
        let n = x.len() as u32;
        let mut tiles = Vec::new();
        for k in 0..n - 1 {
            tiles.push(vec![k, k + 1, n + k + 1, n + k]);
            tiles.push(vec![n + k, n + k + 1, 2 * n + k]);
            tiles.push(vec![n + k + 1, 2 * n + k + 1, 2 * n + k]);
        }
        let mut places = vec![Place::OnCurve(0); 3 * x.len()];
        for k in n + 1..2 * n - 1 {
            places[k as usize] = Place::Free;
        }
        for k in [0, n - 1, 2 * n, 3 * n - 1] {
            places[k as usize] = Place::Fixed;
        }
        Pattern { positions: (0..3).flat_map(at).collect(), places, tiles }
    }

    fn euler(pattern: &Pattern) -> i64 {
        (pattern.positions.len() + pattern.tiles.len()) as i64 - pattern.edge_uses().len() as i64
    }

    #[test]
    fn a_column_that_is_too_narrow_is_merged_and_corners_stay() {
        let pattern = rows(&[0.0, 1.0, 2.0, 2.3, 3.3, 4.3, 5.3]);
        assert!(merged(&rows(&[0.0, 1.0, 2.0, 3.0, 4.0]), &[]).is_none(), "nothing is too short");
        let mut last = pattern.clone();
        while let Some(fewer) = merged(&last, &[]) {
            assert!(fewer.positions.len() < last.positions.len());
            assert_eq!(euler(&fewer), euler(&pattern));
            assert!(fewer.edge_uses().values().all(|uses| *uses <= 2));
            assert!(fewer.tiles.iter().all(|tile| matches!(tile.len(), 3 | 4)));
            last = fewer;
        }
        let fixed = |pattern: &Pattern| -> Vec<DVec3> {
            let all = pattern.positions.iter().zip(&pattern.places);
            let mut fixed: Vec<DVec3> = all.filter(|(_, place)| **place == Place::Fixed).map(|(&p, _)| p).collect();
            fixed.sort_by(|a, b| (a.x, a.y).partial_cmp(&(b.x, b.y)).unwrap());
            fixed
        };
        assert_eq!(fixed(&last), fixed(&pattern));
        let shortest = |pattern: &Pattern| {
            let lengths = pattern
                .edge_uses()
                .into_keys()
                .map(|[a, b]| pattern.positions[a as usize].distance(pattern.positions[b as usize]));
            lengths.fold(f64::INFINITY, f64::min)
        };
        assert!(shortest(&last) > 0.6, "{}", shortest(&last));
    }

    #[test]
    fn a_ring_of_three_edges_stays_one() {
        // A tube of three squares round: to merge any edge round it would close it.
        let ring = |z: f64| [0.0, 1.0, 2.0].map(|k: f64| DVec3::new((2.0 * k).cos() / 4.0, (2.0 * k).sin() / 4.0, z));
        let positions: Vec<DVec3> = [0.0, 1.0, 2.0].into_iter().flat_map(ring).collect();
        let tile =
            |k: u32, row: u32| vec![3 * row + k, 3 * row + (k + 1) % 3, 3 * row + 3 + (k + 1) % 3, 3 * row + 3 + k];
        let tiles = (0..6).map(|k| tile(k % 3, k / 3)).collect();
        let pattern = Pattern { places: vec![Place::Free; positions.len()], positions, tiles };
        assert!(merged(&pattern, &[]).is_none());
    }
}
