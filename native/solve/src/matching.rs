//! Maximum-weight matching in general graphs, among the matchings of maximum cardinality.
//!
//! Behind it is mwmatching, an implementation of the blossom method (Edmonds 1965; Galil, "Efficient algorithms for
//! finding maximum matching in graphs", 1986), which also checks the dual certificate of what it found. Here each
//! connected component is solved by itself, since the cost grows with the cube of the vertex count.

use mwmatching::{Matching, SENTINEL};

use crate::components::connected_components;
use crate::{CancelCheck, SolveError, worker};

/// Largest spread (greatest less smallest weight) that cannot overflow the solver's 32-bit dual variables on a
/// component of `vertices` vertices.
pub fn weight_spread_limit(vertices: usize) -> i32 {
    i32::MAX / (4 * (vertices as i64 + 2)).min(i64::from(i32::MAX)) as i32
}

/// For each of `count` vertices its partner in a matching of greatest weight among those with most edges, or `None`.
/// Edges are (vertex, vertex, weight); of parallel edges the heaviest counts. Weights may be negative.
///
/// Cost: O(vertices³) a component in the worst case; 0.3 s for a sparse component of 3000 vertices.
///
/// # Errors
/// [`SolveError::OutOfRange`] for an edge to no vertex, [`SolveError::BadNumber`] for a loop or for weights whose spread
/// exceeds [`weight_spread_limit`], [`SolveError::Cancelled`].
pub fn maximum_matching(
    count: usize,
    edges: &[(u32, u32, i32)],
    cancelled: CancelCheck<'_>,
) -> Result<Vec<Option<u32>>, SolveError> {
    for (index, &(a, b, _)) in edges.iter().enumerate() {
        let largest = a.max(b) as usize;
        if largest >= count {
            return Err(SolveError::OutOfRange { what: "vertex", index: largest, count });
        }
        if a == b {
            return Err(SolveError::BadNumber {
                what: "second end",
                index,
                expected: "another vertex than the first: no loops",
            });
        }
    }
    let components = split(count, edges);
    for component in &components {
        let limit = i64::from(weight_spread_limit(component.vertices.len()));
        let smallest = component.edges.iter().map(|&index| edges[index].2).min().unwrap_or(0);
        if let Some(&index) =
            component.edges.iter().find(|&&index| i64::from(edges[index].2) - i64::from(smallest) > limit)
        {
            return Err(SolveError::BadNumber {
                what: "weight",
                index,
                expected: "within weight_spread_limit of the smallest: scale the weights down",
            });
        }
    }
    let jobs: Vec<_> =
        components.iter().filter(|component| !component.edges.is_empty()).map(|c| c.local_edges(edges)).collect();
    if jobs.is_empty() {
        return Ok(vec![None; count]);
    }
    // All components in one job: a thread each would cost more than most of them.
    let solved = worker::run("matching", cancelled, || jobs.into_iter().map(solve_component).collect::<Vec<_>>())?;
    let mut partners = vec![None; count];
    let with_edges = components.iter().filter(|component| !component.edges.is_empty());
    for (component, mates) in with_edges.zip(solved) {
        for (&vertex, mate) in component.vertices.iter().zip(mates) {
            partners[vertex as usize] = mate.map(|local| component.vertices[local]);
        }
    }
    Ok(partners)
}

/// For each of `count` vertices its partner in the perfect matching of greatest weight. See [`maximum_matching`].
///
/// # Errors
/// [`SolveError::Unmatched`] when no perfect matching exists, and those of [`maximum_matching`].
pub fn perfect_matching(
    count: usize,
    edges: &[(u32, u32, i32)],
    cancelled: CancelCheck<'_>,
) -> Result<Vec<u32>, SolveError> {
    let partners = maximum_matching(count, edges, cancelled)?;
    let vertices: Vec<u32> = (0..count as u32).filter(|&vertex| partners[vertex as usize].is_none()).collect();
    if vertices.is_empty() {
        Ok(partners.into_iter().flatten().collect())
    } else {
        Err(SolveError::Unmatched { vertices })
    }
}

/// A connected component: its vertices, ascending, and the indices of its edges.
struct Component {
    vertices: Vec<u32>,
    edges: Vec<usize>,
}

impl Component {
    /// Edges between positions in `vertices`, without parallels, the smallest weight moved to zero. Every matching of
    /// maximum cardinality loses the same by that move.
    fn local_edges(&self, edges: &[(u32, u32, i32)]) -> Vec<(usize, usize, i32)> {
        let local = |vertex: u32| self.vertices.partition_point(|&other| other < vertex);
        let smallest = self.edges.iter().map(|&index| edges[index].2).min().unwrap_or(0);
        let mut list: Vec<_> = self
            .edges
            .iter()
            .map(|&index| edges[index])
            .map(|(a, b, w)| (local(a.min(b)), local(a.max(b)), w - smallest))
            .collect();
        list.sort_unstable_by_key(|&(a, b, weight)| (a, b, std::cmp::Reverse(weight)));
        list.dedup_by_key(|&mut (a, b, _)| (a, b));
        list
    }
}

/// The connected components with their edges.
fn split(count: usize, edges: &[(u32, u32, i32)]) -> Vec<Component> {
    let vertices = connected_components(count, edges.iter().map(|&(a, b, _)| (a, b)));
    let mut component_of = vec![0; count];
    for (index, component) in vertices.iter().enumerate() {
        for &vertex in component {
            component_of[vertex as usize] = index;
        }
    }
    let mut components: Vec<Component> =
        vertices.into_iter().map(|vertices| Component { vertices, edges: Vec::new() }).collect();
    for (index, &(a, _, _)) in edges.iter().enumerate() {
        components[component_of[a as usize]].edges.push(index);
    }
    components
}

/// Partner of each local vertex.
fn solve_component(edges: Vec<(usize, usize, i32)>) -> Vec<Option<usize>> {
    let mates = Matching::new(edges).max_cardinality().solve();
    mates.into_iter().map(|mate| (mate != SENTINEL).then_some(mate)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn never() -> bool {
        false
    }

    /// (edges, weight) of the best matching of the vertices from `vertex` on, by trying all.
    fn brute_force(count: u32, edges: &[(u32, u32, i32)], vertex: u32, used: u32) -> (usize, i64) {
        if vertex == count {
            return (0, 0);
        }
        let mut best = brute_force(count, edges, vertex + 1, used);
        for &(a, b, weight) in edges {
            let (low, high) = (a.min(b), a.max(b));
            if low == vertex && used & (1 << low | 1 << high) == 0 {
                let (size, total) = brute_force(count, edges, vertex + 1, used | 1 << low | 1 << high);
                best = best.max((size + 1, total + i64::from(weight)));
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn equals_brute_force(count in 2u32..10, raw in prop::collection::vec((0u32..10, 0u32..10, -50i32..50), 0..22)) {
            let edges: Vec<_> = raw.into_iter().map(|(a, b, w)| (a % count, b % count, w)).filter(|e| e.0 != e.1).collect();
            let partners = maximum_matching(count as usize, &edges, &never).unwrap();
            let (mut size, mut total) = (0, 0);
            for (vertex, &partner) in partners.iter().enumerate() {
                let Some(partner) = partner else { continue };
                prop_assert_eq!(partners[partner as usize], Some(vertex as u32));
                if vertex < partner as usize {
                    let pair = (vertex as u32, partner);
                    let weight = edges.iter().filter(|e| (e.0.min(e.1), e.0.max(e.1)) == pair).map(|e| e.2).max();
                    size += 1;
                    total += i64::from(weight.expect("partners share an edge"));
                }
            }
            prop_assert_eq!((size, total), brute_force(count, &edges, 0, 0));
            match perfect_matching(count as usize, &edges, &never) {
                Ok(_) => prop_assert_eq!(2 * size, count as usize),
                Err(SolveError::Unmatched { vertices }) => prop_assert_eq!(vertices.len(), count as usize - 2 * size),
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    #[test]
    fn the_widest_weights_allowed_do_not_overflow() {
        // A long path whose end weights force the dual variables far apart.
        let count = 400;
        let limit = weight_spread_limit(count);
        let mut edges: Vec<_> = (1..count as u32).map(|v| (v - 1, v, if v % 2 == 0 { limit } else { 0 })).collect();
        edges.extend((0..count as u32 - 3).map(|v| (v, v + 3, (v as i32 * 7919) % limit)));
        let partners = perfect_matching(count, &edges, &never).unwrap();
        assert!(partners.iter().enumerate().all(|(v, &p)| partners[p as usize] as usize == v));
        edges.push((0, 5, limit + 1));
        assert!(matches!(perfect_matching(count, &edges, &never), Err(SolveError::BadNumber { .. })));
    }

    #[test]
    fn bad_edges_are_named() {
        assert_eq!(
            maximum_matching(2, &[(0, 2, 1)], &never),
            Err(SolveError::OutOfRange { what: "vertex", index: 2, count: 2 })
        );
        assert!(matches!(maximum_matching(2, &[(1, 1, 1)], &never), Err(SolveError::BadNumber { index: 0, .. })));
        assert_eq!(maximum_matching(2, &[(0, 1, 1)], &|| true), Err(SolveError::Cancelled));
        assert_eq!(perfect_matching(3, &[(0, 2, 1)], &never), Err(SolveError::Unmatched { vertices: vec![1] }));
        assert_eq!(perfect_matching(0, &[], &never), Ok(vec![]));
    }

    /// Prints the time for the dual graph of a triangulated strip grid, the shape that triangle pairing has.
    #[test]
    #[ignore = "a measurement"]
    fn seconds_by_size() {
        for width in [55, 80, 110] {
            let count = width * width;
            let mut edges = Vec::new();
            for v in 0..count as u32 {
                if !(v as usize + 1).is_multiple_of(width) {
                    edges.push((v, v + 1, (v as i32 * 7919) % 1000));
                }
                if v as usize + width < count && v % 2 == 0 {
                    edges.push((v, v + width as u32, (v as i32 * 104_729) % 1000));
                }
            }
            let start = std::time::Instant::now();
            let partners = maximum_matching(count, &edges, &never).unwrap();
            let single = partners.iter().filter(|p| p.is_none()).count();
            println!("{count} vertices: {:?}, {single} single", start.elapsed());
        }
    }
}
