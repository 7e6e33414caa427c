//! Minimum-weight T-join: the cheapest set of edges that meets every terminal an odd number of times and every other
//! vertex an even number of times.
//!
//! Edmonds and Johnson, "Matching, Euler tours and the Chinese postman", 1973: pair the terminals by a minimum-weight
//! perfect matching under shortest-path distance, and take the edges that lie on an odd number of the paths.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::components::connected_components;
use crate::matching::{perfect_matching, weight_spread_limit};
use crate::{CancelCheck, SolveError};

/// A component with more terminals than this is matched among near ones only: 1,000 in a complete graph took minutes.
pub const EXACT: usize = 120;
/// Nearest other terminals offered to each terminal then.
pub const NEAREST: usize = 12;

/// The indices, ascending, of the edges of a minimum-weight T-join. `edges` are (vertex, vertex, weight) with weights
/// not below zero; loops and parallel edges are allowed. `terminals` lists each vertex of T once.
///
/// The matching compares distances as integers: with k terminals in a component of greatest distance D the result is
/// within 2 k² D / 10⁹ of the minimum, for up to [`EXACT`] terminals a component. Of more, each is offered only the [`NEAREST`]
/// to it, which a minimum seldom goes beyond. Cost: k shortest-path searches and a matching of a graph with O(k) edges.
///
/// # Errors
/// [`SolveError::OddComponent`] when a component has an odd number of terminals; [`SolveError::OutOfRange`] and
/// [`SolveError::BadNumber`] for bad edges or terminals; [`SolveError::Cancelled`].
pub fn t_join(
    count: usize,
    edges: &[(u32, u32, f64)],
    terminals: &[u32],
    cancelled: CancelCheck<'_>,
) -> Result<Vec<usize>, SolveError> {
    let graph = Graph::new(count, edges)?;
    let mut is_terminal = vec![false; count];
    for (index, &terminal) in terminals.iter().enumerate() {
        let Some(mark) = is_terminal.get_mut(terminal as usize) else {
            return Err(SolveError::OutOfRange { what: "terminal", index: terminal as usize, count });
        };
        if std::mem::replace(mark, true) {
            return Err(SolveError::BadNumber { what: "terminal", index, expected: "listed once" });
        }
    }
    let mut odd = vec![false; edges.len()];
    for vertices in connected_components(count, edges.iter().map(|&(a, b, _)| (a, b))) {
        let terminals: Vec<u32> = vertices.iter().copied().filter(|&vertex| is_terminal[vertex as usize]).collect();
        if terminals.len() % 2 == 1 {
            return Err(SolveError::OddComponent { vertices, terminals });
        }
        for (from, to) in pair(&graph, &terminals, cancelled)? {
            let (_, arrival) = graph.shortest_paths(from);
            let mut vertex = to;
            while vertex != from {
                let edge = arrival[vertex as usize];
                odd[edge] = !odd[edge];
                let (a, b, _) = edges[edge];
                vertex = if vertex == a { b } else { a };
            }
        }
    }
    Ok((0..edges.len()).filter(|&edge| odd[edge]).collect())
}

/// Pairs the terminals of one component at least total distance.
fn pair(graph: &Graph<'_>, terminals: &[u32], cancelled: CancelCheck<'_>) -> Result<Vec<(u32, u32)>, SolveError> {
    if let &[a, b] = terminals {
        return Ok(vec![(a, b)]);
    }
    let mut distances = Vec::new();
    for (i, &from) in terminals.iter().enumerate() {
        if cancelled() {
            return Err(SolveError::Cancelled);
        }
        let (distance, _) = graph.shortest_paths(from);
        let to = |j: usize| distance[terminals[j] as usize];
        if terminals.len() <= EXACT {
            distances.extend((i + 1..terminals.len()).map(|j| (i as u32, j as u32, to(j))));
            continue;
        }
        let mut others: Vec<usize> = (0..terminals.len()).filter(|&j| j != i).collect();
        others.select_nth_unstable_by(NEAREST, |&a, &b| to(a).total_cmp(&to(b)).then(a.cmp(&b)));
        others.truncate(NEAREST);
        // First with second, third with fourth and so on: there is always a perfect matching.
        others.extend((i % 2 == 0).then_some(i + 1));
        others.sort_unstable();
        distances.extend(others.into_iter().map(|j| (i as u32, j as u32, to(j))));
    }
    let farthest = distances.iter().map(|entry| entry.2).fold(0.0, f64::max);
    let scale = if farthest > 0.0 { f64::from(weight_spread_limit(terminals.len())) / farthest } else { 0.0 };
    let weighted: Vec<_> =
        distances.iter().map(|&(i, j, distance)| (i, j, -(distance * scale).round() as i32)).collect();
    let partners = perfect_matching(terminals.len(), &weighted, cancelled)?;
    let pairs = partners.iter().enumerate().filter(|&(i, &j)| i < j as usize);
    Ok(pairs.map(|(i, &j)| (terminals[i], terminals[j as usize])).collect())
}

/// A graph with the edges around each vertex.
struct Graph<'a> {
    edges: &'a [(u32, u32, f64)],
    incident: Vec<Vec<usize>>,
}

impl<'a> Graph<'a> {
    fn new(count: usize, edges: &'a [(u32, u32, f64)]) -> Result<Self, SolveError> {
        let mut incident = vec![Vec::new(); count];
        for (index, &(a, b, weight)) in edges.iter().enumerate() {
            let largest = a.max(b) as usize;
            if largest >= count {
                return Err(SolveError::OutOfRange { what: "vertex", index: largest, count });
            }
            if !(weight.is_finite() && weight >= 0.0) {
                return Err(SolveError::BadNumber { what: "edge weight", index, expected: "finite and not negative" });
            }
            if a != b {
                incident[a as usize].push(index);
                incident[b as usize].push(index);
            }
        }
        Ok(Self { edges, incident })
    }

    /// Dijkstra: for every vertex the distance from `source` and the edge it is reached by (no edge: `usize::MAX`).
    fn shortest_paths(&self, source: u32) -> (Vec<f64>, Vec<usize>) {
        let mut distance = vec![f64::INFINITY; self.incident.len()];
        let mut arrival = vec![usize::MAX; self.incident.len()];
        distance[source as usize] = 0.0;
        // The bits of floats that are not negative sort as the floats do.
        let mut queue = BinaryHeap::from([Reverse((0, source))]);
        while let Some(Reverse((bits, vertex))) = queue.pop() {
            let reached = f64::from_bits(bits);
            if reached > distance[vertex as usize] {
                continue;
            }
            for &edge in &self.incident[vertex as usize] {
                let (a, b, weight) = self.edges[edge];
                let other = if a == vertex { b } else { a };
                let candidate = reached + weight.abs();
                if candidate < distance[other as usize] {
                    distance[other as usize] = candidate;
                    arrival[other as usize] = edge;
                    queue.push(Reverse((candidate.to_bits(), other)));
                }
            }
        }
        (distance, arrival)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn never() -> bool {
        false
    }

    /// True when exactly the terminals have odd degree.
    fn joins(count: usize, edges: &[(u32, u32, f64)], chosen: &[usize], terminals: &[u32]) -> bool {
        let mut odd = vec![false; count];
        for &edge in chosen {
            for vertex in [edges[edge].0, edges[edge].1] {
                odd[vertex as usize] ^= true;
            }
        }
        (0..count as u32).all(|vertex| odd[vertex as usize] == terminals.contains(&vertex))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn equals_brute_force(
            count in 2u32..8,
            raw in prop::collection::vec((0u32..8, 0u32..8, 0.0..9.0), 0..11),
            marks in prop::collection::vec(any::<bool>(), 8),
        ) {
            let edges: Vec<_> = raw.into_iter().map(|(a, b, w): (u32, u32, f64)| (a % count, b % count, w)).collect();
            let terminals: Vec<u32> = (0..count).filter(|&v| marks[v as usize]).collect();
            let weight = |chosen: &[usize]| chosen.iter().map(|&e| edges[e].2).sum::<f64>();
            let subsets = (0..1usize << edges.len()).map(|bits| (0..edges.len()).filter(|e| bits >> e & 1 == 1).collect::<Vec<_>>());
            let best = subsets.filter(|s| joins(count as usize, &edges, s, &terminals)).map(|s| weight(&s)).reduce(f64::min);
            match t_join(count as usize, &edges, &terminals, &never) {
                Ok(chosen) => {
                    prop_assert!(joins(count as usize, &edges, &chosen, &terminals));
                    prop_assert!(weight(&chosen) <= best.unwrap() + 1e-5);
                }
                Err(SolveError::OddComponent { vertices, terminals: odd }) => {
                    prop_assert!(best.is_none());
                    prop_assert!(odd.len() % 2 == 1 && odd.iter().all(|t| vertices.contains(t) && terminals.contains(t)));
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    #[test]
    fn many_terminals_are_matched_in_little_time() {
        // A grid of 40 by 40 with random weights, every third vertex a terminal.
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let n = 40;
        let mut edges = Vec::new();
        for v in 0..n * n {
            if v % n + 1 < n {
                edges.push((v, v + 1, random()));
            }
            if v + n < n * n {
                edges.push((v, v + n, random()));
            }
        }
        let terminals: Vec<u32> = (0..n * n).filter(|v| v % 3 == 0).collect();
        let chosen = t_join(1600, &edges, &terminals, &never).unwrap();
        assert!(joins(1600, &edges, &chosen, &terminals));
        // No cycle is left whose other edges would be cheaper: try the squares of the grid.
        let index = |a: u32, b: u32| edges.iter().position(|e| (e.0, e.1) == (a, b)).unwrap();
        for v in (0..n * (n - 1)).filter(|v| v % n + 1 < n) {
            let square = [index(v, v + 1), index(v + 1, v + n + 1), index(v + n, v + n + 1), index(v, v + n)];
            let change: f64 = square.iter().map(|e| if chosen.contains(e) { -edges[*e].2 } else { edges[*e].2 }).sum();
            assert!(change >= -1e-6, "{square:?}");
        }
    }

    #[test]
    fn bad_input_is_named() {
        assert!(matches!(t_join(2, &[(0, 1, -1.0)], &[], &never), Err(SolveError::BadNumber { index: 0, .. })));
        assert!(matches!(t_join(2, &[(0, 1, f64::NAN)], &[], &never), Err(SolveError::BadNumber { .. })));
        assert!(matches!(t_join(2, &[(0, 1, 1.0)], &[0, 0], &never), Err(SolveError::BadNumber { index: 1, .. })));
        assert!(matches!(t_join(2, &[(0, 1, 1.0)], &[7], &never), Err(SolveError::OutOfRange { index: 7, .. })));
        assert_eq!(
            t_join(3, &[(0, 1, 1.0)], &[2], &never),
            Err(SolveError::OddComponent { vertices: vec![2], terminals: vec![2] })
        );
    }
}
