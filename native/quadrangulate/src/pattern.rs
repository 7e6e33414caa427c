//! The coarse patterns of quads that fill an n-sided disk, and what the strip solver has to know of each.
//!
//! `data/patterns.json` lists each pattern as its sides (vertex lists, counter-clockwise, the last vertex of a side being
//! the first of the next) and its quads. Opposite edges of a quad belong to one strip; a strip runs from border to
//! border, so the count of edges on side `i` is a sum of strip multiplicities: `B x = l`, each column of `B` being
//! `e_i + e_j`. Strips are derived from the quads here, nothing is stored twice.
//!
//! Source of the idea: Takayama, Panozzo, Sorkine-Hornung, *Pattern-based quadrangulation for N-sided patches*, 2014,
//! which `QuadMixer` (Nuvoli et al. 2019, section 3.5) calls for. The patterns themselves come from a search of ours over
//! boundary words.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// Strips that join the same two sides: only the sum of their multiplicities matters to the side counts.
#[derive(Debug, Clone)]
pub(crate) struct StripGroup {
    /// The two sides the strips end on, the lower first; equal when they return to their own side.
    pub ends: [usize; 2],
    /// Indices of the strips.
    pub strips: Vec<usize>,
}

/// A coarse pattern.
#[derive(Debug)]
pub(crate) struct Pattern {
    /// Name in the catalogue: `P5.0` is the first for five sides.
    pub name: String,
    /// Vertices of each side, corners included.
    pub sides: Vec<Vec<u32>>,
    /// Quads, counter-clockwise.
    pub quads: Vec<[u32; 4]>,
    /// Number of coarse vertices.
    pub vertex_count: usize,
    /// Strip of each edge, keyed by its vertices in rising order.
    pub strip_of_edge: BTreeMap<[u32; 2], usize>,
    /// Number of strips.
    pub strip_count: usize,
    /// Strips grouped by the sides they join, in an order that settles the sides one after the other.
    pub groups: Vec<StripGroup>,
    /// Side counts when every multiplicity is one.
    pub base: Vec<u32>,
    /// Changes of the group sums that keep every side count: at most four groups, coefficients up to two.
    pub exchanges: Vec<Vec<(usize, i64)>>,
    /// Number of irregular vertices, all of them inside.
    pub irregular: u32,
    /// Sum of |valence - 4| over them.
    pub valence_excess: u32,
}

/// A pattern as the catalogue lists it.
#[derive(serde::Deserialize)]
pub(crate) struct Entry {
    pub name: String,
    pub sides: Vec<Vec<u32>>,
    pub quads: Vec<[u32; 4]>,
}

/// The catalogue, in order of side count, then irregular vertices, then valence excess, then name order in the file.
pub(crate) static PATTERNS: LazyLock<Vec<Pattern>> = LazyLock::new(|| {
    let entries: Vec<Entry> =
        serde_json::from_str(include_str!("../data/patterns.json")).expect("the embedded catalogue is well-formed");
    let mut patterns: Vec<_> = entries.into_iter().map(Pattern::new).collect();
    patterns.sort_by_key(|p| (p.sides.len(), p.irregular, p.valence_excess));
    patterns
});

/// An edge as a key: its vertices in rising order.
pub(crate) fn edge_key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Pattern {
    pub(crate) fn new(entry: Entry) -> Self {
        let Entry { name, sides, quads } = entry;
        let strip_of_edge = strips(&quads);
        let strip_count = strip_of_edge.values().max().map_or(0, |&s| s + 1);

        let mut ends = vec![Vec::new(); strip_count];
        let mut on_border = BTreeSet::new();
        for (i, side) in sides.iter().enumerate() {
            for pair in side.windows(2) {
                ends[strip_of_edge[&edge_key(pair[0], pair[1])]].push(i);
                on_border.insert(pair[0]);
            }
        }
        let mut by_ends: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        // A strip that closes in itself adds to no side: it keeps multiplicity one.
        for (strip, ends) in ends.iter().enumerate().filter(|(_, ends)| !ends.is_empty()) {
            by_ends.entry([ends[0], ends[1]]).or_default().push(strip);
        }
        let groups = settle_sides_early(by_ends, sides.len());

        let vertex_count = quads.iter().flatten().max().map_or(0, |&v| v as usize + 1);
        let mut valence = vec![0i64; vertex_count];
        for &v in quads.iter().flatten() {
            valence[v as usize] += 1;
        }
        let off: Vec<_> = (0..vertex_count)
            .filter(|&v| !on_border.contains(&(v as u32)) && valence[v] != 4)
            .map(|v| (valence[v] - 4).unsigned_abs() as u32)
            .collect();
        Self {
            base: sides.iter().map(|side| side.len() as u32 - 1).collect(),
            exchanges: exchanges(&groups, sides.len()),
            irregular: off.len() as u32,
            valence_excess: off.iter().sum(),
            name,
            sides,
            quads,
            vertex_count,
            strip_of_edge,
            strip_count,
            groups,
        }
    }
}

/// Numbers the strips: classes of edges under "opposite in a quad".
fn strips(quads: &[[u32; 4]]) -> BTreeMap<[u32; 2], usize> {
    let mut strip: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut next = 0;
    for &q in quads {
        for k in 0..2 {
            let [one, other] = [edge_key(q[k], q[k + 1]), edge_key(q[k + 2], q[(k + 3) % 4])];
            match (strip.get(&one).copied(), strip.get(&other).copied()) {
                (Some(a), Some(b)) => strip.values_mut().filter(|s| **s == b).for_each(|s| *s = a),
                (a, b) => {
                    let s = a.or(b).unwrap_or(next);
                    next = next.max(s + 1);
                    strip.insert(one, s);
                    strip.insert(other, s);
                }
            }
        }
    }
    // Close the gaps that unions left.
    let mut dense = BTreeMap::new();
    for s in strip.values_mut() {
        let n = dense.len();
        *s = *dense.entry(*s).or_insert(n);
    }
    strip
}

/// Orders the groups so that the depth-first search completes a side as soon as it can: take the side with the fewest
/// groups left, list them, repeat.
fn settle_sides_early(mut left: BTreeMap<[usize; 2], Vec<usize>>, sides: usize) -> Vec<StripGroup> {
    let mut groups = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let remaining = |side: usize| left.keys().filter(|ends| ends.contains(&side)).count();
        let side = (0..sides).filter(|&s| remaining(s) > 0).min_by_key(|&s| remaining(s)).unwrap_or(0);
        let chosen: Vec<_> = left.keys().copied().filter(|ends| ends.contains(&side)).collect();
        for ends in chosen {
            let strips = left.remove(&ends).unwrap_or_default();
            groups.push(StripGroup { ends, strips });
        }
    }
    groups
}

/// Every change of at most four group sums by 1 or 2 that keeps all side counts, once up to sign.
fn exchanges(groups: &[StripGroup], sides: usize) -> Vec<Vec<(usize, i64)>> {
    fn extend(
        groups: &[StripGroup],
        from: usize,
        balance: &mut [i64],
        chosen: &mut Vec<(usize, i64)>,
        found: &mut Vec<Vec<(usize, i64)>>,
    ) {
        if !chosen.is_empty() && balance.iter().all(|&b| b == 0) {
            found.push(chosen.clone());
            return;
        }
        if chosen.len() == 4 {
            return;
        }
        for g in from..groups.len() {
            for step in [1, -1, 2, -2] {
                if chosen.is_empty() && step < 0 {
                    continue;
                }
                groups[g].ends.iter().for_each(|&side| balance[side] += step);
                chosen.push((g, step));
                extend(groups, g + 1, balance, chosen, found);
                chosen.pop();
                groups[g].ends.iter().for_each(|&side| balance[side] -= step);
            }
        }
    }
    let mut found = Vec::new();
    extend(groups, 0, &mut vec![0; sides], &mut Vec::new(), &mut found);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_strip_has_two_ends_and_valences_balance() {
        assert_eq!(PATTERNS.len(), 27);
        for p in PATTERNS.iter() {
            let ends: usize = p.groups.iter().map(|g| 2 * g.strips.len()).sum();
            assert_eq!(ends as u32, p.base.iter().sum::<u32>(), "{}", p.name);
            let border: usize = p.sides.iter().map(|s| s.len() - 1).sum();
            let edges = p.strip_of_edge.len();
            assert_eq!(p.vertex_count + p.quads.len(), edges + 1, "{}: Euler characteristic", p.name);
            assert_eq!(2 * edges, 4 * p.quads.len() + border, "{}: edges", p.name);
        }
    }

    #[test]
    fn side_counts_of_a_known_pattern() {
        // P3.0: l = (a + b, c + a, b + c), three quads around one vertex of valence 3.
        let p = PATTERNS.iter().find(|p| p.name == "P3.0").unwrap();
        assert_eq!((p.strip_count, p.irregular, p.valence_excess), (3, 1, 1));
        let ends: Vec<_> = p.groups.iter().map(|g| g.ends).collect();
        for pair in [[0, 1], [0, 2], [1, 2]] {
            assert!(ends.contains(&pair));
        }
    }
}
