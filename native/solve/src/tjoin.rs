//! Minimum-weight T-join: the cheapest set of edges that meets every terminal an odd number of times and every other
//! vertex an even number of times.
//!
//! Edmonds and Johnson, "Matching, Euler tours and the Chinese postman", 1973: pair the terminals by a minimum-weight
//! perfect matching under shortest-path distance, and take the edges that lie on an odd number of the paths. Edges that
//! cost nothing are contracted before: what they join needs one terminal at most.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::components::connected_components;
use crate::matching::{perfect_matching, weight_spread_limit};
use crate::{CancelCheck, SolveError};

/// A component with more terminals than this is matched among near ones only: 1,000 in a complete graph took minutes.
pub const EXACT: usize = 120;
/// Nearest other terminals offered to each terminal then; twice as many, and so on, where no perfect matching is among them.
pub const NEAREST: usize = 12;

/// The indices, ascending, of the edges of a minimum-weight T-join. `edges` are (vertex, vertex, weight) with weights
/// not below zero; loops and parallel edges are allowed. `terminals` lists each vertex of T once.
///
/// The matching compares distances as integers: with k terminals in a component of greatest distance D the result is
/// within 2 k² D / 10⁹ of the minimum, for up to [`EXACT`] terminals a component; where edges that cost nothing join an even number of
/// terminals these do not count, where an odd number one does. Of more, each is offered only the [`NEAREST`] to it, which a minimum
/// seldom goes beyond. Cost: k shortest-path searches that end at those, and a matching of a graph with O(k) edges.
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
    let mut is_odd = vec![false; count];
    for (index, &terminal) in terminals.iter().enumerate() {
        let Some(mark) = is_odd.get_mut(terminal as usize) else {
            return Err(SolveError::OutOfRange { what: "terminal", index: terminal as usize, count });
        };
        if std::mem::replace(mark, true) {
            return Err(SolveError::BadNumber { what: "terminal", index, expected: "listed once" });
        }
    }
    for vertices in connected_components(count, edges.iter().map(|&(a, b, _)| (a, b))) {
        let terminals: Vec<u32> = vertices.iter().copied().filter(|&vertex| is_odd[vertex as usize]).collect();
        if terminals.len() % 2 == 1 {
            return Err(SolveError::OddComponent { vertices, terminals });
        }
    }
    let free = edges.iter().filter(|(_, _, weight)| *weight <= 0.0);
    let clusters = connected_components(count, free.map(|&(a, b, _)| (a, b)));
    let mut cluster_of = vec![0; count];
    for (cluster, vertices) in (0..).zip(&clusters) {
        for &vertex in vertices {
            cluster_of[vertex as usize] = cluster;
        }
    }
    let joint: Vec<(u32, u32, f64)> =
        edges.iter().map(|&(a, b, weight)| (cluster_of[a as usize], cluster_of[b as usize], weight)).collect();
    let is_terminal: Vec<bool> = clusters
        .iter()
        .map(|vertices| vertices.iter().filter(|&&vertex| is_odd[vertex as usize]).count() % 2 == 1)
        .collect();
    let mut chosen = join_clusters(&Graph::new(clusters.len(), &joint)?, &is_terminal, cancelled)?;
    for edge in (0..edges.len()).filter(|&edge| chosen[edge]) {
        let (a, b, _) = edges[edge];
        is_odd[a as usize] ^= true;
        is_odd[b as usize] ^= true;
    }
    // Inside a cluster a tree of free edges carries what is odd from its leaves to its root, where it adds up to nothing.
    let mut parent = vec![None; count];
    for vertices in &clusters {
        let root = vertices[0];
        let mut order = vec![root];
        let mut next = 0;
        while next < order.len() {
            let vertex = order[next];
            next += 1;
            for &edge in &graph.incident[vertex as usize] {
                let (a, b, weight) = edges[edge];
                let other = if a == vertex { b } else { a };
                if weight <= 0.0 && other != root && parent[other as usize].is_none() {
                    parent[other as usize] = Some((edge, vertex));
                    order.push(other);
                }
            }
        }
        for &vertex in order.iter().rev().filter(|&&vertex| vertex != root) {
            if let Some((edge, up)) = parent[vertex as usize].filter(|_| is_odd[vertex as usize]) {
                chosen[edge] ^= true;
                is_odd[vertex as usize] = false;
                is_odd[up as usize] ^= true;
            }
        }
    }
    Ok((0..edges.len()).filter(|&edge| chosen[edge]).collect())
}

/// Which edges a join takes, each component by itself.
fn join_clusters(graph: &Graph<'_>, is_terminal: &[bool], cancelled: CancelCheck<'_>) -> Result<Vec<bool>, SolveError> {
    let mut odd = vec![false; graph.edges.len()];
    let mut search = Search::new(is_terminal.len());
    for vertices in connected_components(is_terminal.len(), graph.edges.iter().map(|&(a, b, _)| (a, b))) {
        let terminals: Vec<u32> = vertices.into_iter().filter(|&vertex| is_terminal[vertex as usize]).collect();
        for (from, to) in pair(graph, &mut search, &terminals, is_terminal, cancelled)? {
            search.run(graph, from, |vertex, _| vertex == to);
            let mut vertex = to;
            while vertex != from {
                let edge = search.arrival[vertex as usize];
                odd[edge] = !odd[edge];
                let (a, b, _) = graph.edges[edge];
                vertex = if vertex == a { b } else { a };
            }
        }
    }
    Ok(odd)
}

/// Pairs the terminals of one component at least total distance.
fn pair(
    graph: &Graph<'_>,
    search: &mut Search,
    terminals: &[u32],
    is_terminal: &[bool],
    cancelled: CancelCheck<'_>,
) -> Result<Vec<(u32, u32)>, SolveError> {
    if let &[a, b] = terminals {
        return Ok(vec![(a, b)]);
    }
    let mut nearest = if terminals.len() <= EXACT { terminals.len() } else { NEAREST };
    loop {
        let mut distances = Vec::new();
        for (i, &from) in terminals.iter().enumerate() {
            if cancelled() {
                return Err(SolveError::Cancelled);
            }
            let mut found = 0;
            search.run(graph, from, |vertex, distance| {
                // The terminals of a component ascend.
                if vertex != from && is_terminal[vertex as usize] {
                    distances.push((i as u32, terminals.partition_point(|&other| other < vertex) as u32, distance));
                    found += 1;
                }
                found == nearest
            });
        }
        let farthest = distances.iter().map(|entry| entry.2).fold(0.0, f64::max);
        let scale = if farthest > 0.0 { f64::from(weight_spread_limit(terminals.len())) / farthest } else { 0.0 };
        let weighted: Vec<_> =
            distances.iter().map(|&(i, j, distance)| (i, j, -(distance * scale).round() as i32)).collect();
        match perfect_matching(terminals.len(), &weighted, cancelled) {
            Err(SolveError::Unmatched { .. }) if nearest < terminals.len() => nearest *= 2,
            partners => {
                let partners = partners?;
                let pairs = partners.iter().enumerate().filter(|&(i, &j)| i < j as usize);
                return Ok(pairs.map(|(i, &j)| (terminals[i], terminals[j as usize])).collect());
            }
        }
    }
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
}

/// Dijkstra's shortest paths from one vertex at a time; what one search reached is forgotten by the next.
struct Search {
    distance: Vec<f64>,
    /// The edge each vertex is reached by; `usize::MAX` for the source.
    arrival: Vec<usize>,
    reached: Vec<u32>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

impl Search {
    fn new(count: usize) -> Self {
        Self {
            distance: vec![f64::INFINITY; count],
            arrival: vec![usize::MAX; count],
            reached: Vec::new(),
            queue: BinaryHeap::new(),
        }
    }

    /// Tells `visit` each vertex and its distance from `source`, nearest first, until that says it is enough.
    fn run(&mut self, graph: &Graph<'_>, source: u32, mut visit: impl FnMut(u32, f64) -> bool) {
        for vertex in self.reached.drain(..) {
            self.distance[vertex as usize] = f64::INFINITY;
            self.arrival[vertex as usize] = usize::MAX;
        }
        self.queue.clear();
        self.distance[source as usize] = 0.0;
        self.reached.push(source);
        // The bits of floats that are not negative sort as the floats do.
        self.queue.push(Reverse((0, source)));
        while let Some(Reverse((bits, vertex))) = self.queue.pop() {
            let here = f64::from_bits(bits);
            if here > self.distance[vertex as usize] {
                continue;
            }
            if visit(vertex, here) {
                return;
            }
            for &edge in &graph.incident[vertex as usize] {
                let (a, b, weight) = graph.edges[edge];
                let other = if a == vertex { b } else { a };
                let candidate = here + weight.abs();
                if candidate < self.distance[other as usize] {
                    if self.distance[other as usize] == f64::INFINITY {
                        self.reached.push(other);
                    }
                    self.distance[other as usize] = candidate;
                    self.arrival[other as usize] = edge;
                    self.queue.push(Reverse((candidate.to_bits(), other)));
                }
            }
        }
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
            let edges: Vec<_> = raw.into_iter().map(|(a, b, w): (u32, u32, f64)| (a % count, b % count, (w - 3.0).max(0.0))).collect();
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
    fn clusters_of_odd_size_are_joined_though_their_nearest_are_their_own() {
        // Rows of 15 terminals, a step apart, with a long way from row to row.
        let (rows, length) = (10, 15);
        let index = |row: u32, k: u32| row * length + k;
        let mut edges = Vec::new();
        for row in 0..rows {
            edges.extend((1..length).map(|k| (index(row, k - 1), index(row, k), 1.0)));
            edges.extend((row > 0).then(|| (index(row - 1, 7), index(row, 7), 100.0)));
        }
        let terminals: Vec<u32> = (0..rows * length).collect();
        let chosen = t_join(terminals.len(), &edges, &terminals, &never).unwrap();
        assert!(joins(terminals.len(), &edges, &chosen, &terminals));
        let weight: f64 = chosen.iter().map(|&edge| edges[edge].2).sum();
        // Four steps on each side of the way to the next row, and every second such way.
        assert!((weight - f64::from(rows / 2 * 100 + rows * 8)).abs() < 1e-9, "{weight}");
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
