//! Marked edges and vertices become a network: chains between corners, closed curves, single points.
//!
//! Daniels et al. 2011, section 4.1, take disjoint curves that meet at end points only. Here any set of edges is such a
//! network once it is cut at its corners, so features never cross: where they meet there is a corner.

use crate::base_error::RetopologyError;
use crate::beside::curves_beside;
use crate::failure::RetopologizeError;
use mesh::{DVec3, NONE, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// What the artist marked. Borders of the surface are features without being marked.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Features {
    /// Marked edges as vertex pairs.
    pub edges: Vec<[u32; 2]>,
    /// Marked vertices: each becomes a base vertex.
    pub vertices: Vec<u32>,
}

impl Features {
    /// These and others.
    #[must_use]
    pub fn with(&self, others: &Self) -> Self {
        let mut both = self.clone();
        both.edges.extend(&others.edges);
        both.vertices.extend(&others.vertices);
        both
    }

    /// Those that are not among others, each of which must be one of these. O(n log n).
    ///
    /// # Errors
    /// [`RetopologizeError::Feature`] with the positions of those that are none.
    pub fn without(&self, others: &Self) -> Result<Self, RetopologizeError> {
        let mut edges: BTreeSet<[u32; 2]> = self.edges.iter().map(|&[a, b]| sorted(a, b)).collect();
        let mut vertices: BTreeSet<u32> = self.vertices.iter().copied().collect();
        let positions = |n: usize, gone: &mut dyn FnMut(usize) -> bool| -> Vec<u32> {
            (0..n).filter(|&k| !gone(k)).map(|k| k as u32).collect()
        };
        let strange =
            positions(others.edges.len(), &mut |k| edges.remove(&sorted(others.edges[k][0], others.edges[k][1])));
        let strange_vertices = positions(others.vertices.len(), &mut |k| vertices.remove(&others.vertices[k]));
        if strange.is_empty() && strange_vertices.is_empty() {
            let kept = self.edges.iter().copied().filter(|&[a, b]| edges.contains(&sorted(a, b))).collect();
            return Ok(Self { edges: kept, vertices: vertices.into_iter().collect() });
        }
        Err(RetopologizeError::Feature {
            code: "feature_not_marked",
            sentence: format!(
                "{} of the features to take away are not marked; take away only what was marked, and each once",
                strange.len() + strange_vertices.len()
            ),
            elements: [("features", strange), ("feature_verts", strange_vertices)].into(),
        })
    }
}

/// A curve of the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Its vertices in order. An open chain runs from corner to corner, both included, which may be the same vertex; a
    /// closed one names each vertex once and has no corner.
    pub vertices: Vec<u32>,
    /// True for a closed curve without a corner.
    pub closed: bool,
    /// True when it lies on a border of the surface.
    pub border: bool,
    /// True when it stays as it is: one base edge, none of its surface edges split.
    pub whole: bool,
}

impl Chain {
    /// Its vertices with the first repeated at the end of a closed curve.
    pub fn walk(&self) -> impl Iterator<Item = u32> + '_ {
        self.vertices.iter().copied().chain(self.closed.then(|| self.vertices[0]))
    }
}

/// The marked network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Network {
    /// Curves; every marked or border edge is in exactly one of them.
    pub chains: Vec<Chain>,
    /// Vertices where curves end or turn sharply, ascending.
    pub corners: Vec<u32>,
    /// Marked vertices off the curves, ascending.
    pub points: Vec<u32>,
    /// Marked edges left out because what they are part of is too short, ascending.
    pub dropped: Vec<[u32; 2]>,
}

/// What of the features is too little for quads.
#[derive(Debug, Clone, Copy)]
pub struct Crumbs {
    /// Connected marked edges that are together shorter than this, and branches that end nowhere and are shorter, are dropped
    /// unless they hold a marked vertex; scene units.
    pub shorter_than: f64,
    /// Where more corners are left, curves that run beside others within this length are dropped if that is enough; else it grows, by
    /// [`MOST_GROWTH`] at most, and curves between forks must be as long too.
    pub most_corners: usize,
}

impl Crumbs {
    /// Nothing is too little.
    pub const NONE: Self = Self { shorter_than: 0.0, most_corners: usize::MAX };

    /// The same in other units.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { shorter_than: self.shorter_than * factor, ..self }
    }
}

/// How many times as long features have to be where they would leave no room for quads: 8 edges by default.
const MOST_GROWTH: f64 = 16.0;
/// The steps there.
const GROWTH: f64 = std::f64::consts::SQRT_2;

/// Builds the network. A vertex is a corner when other than two features meet there, when it is marked, or when the curve
/// turns by more than `corner_angle` (radians) both between its two edges and between the chords over two edges on either
/// side, so that the zigzag of a curve over a triangle mesh is none. O(n log n).
///
/// # Errors
/// [`RetopologyError::FeatureOffSurface`], [`RetopologyError::FeatureRepeated`], [`RetopologyError::VertexOffSurface`].
pub fn network(
    mesh: &TriangleMesh,
    topology: &Topology,
    features: &Features,
    corner_angle: f64,
    crumbs: Crumbs,
) -> Result<Network, RetopologyError> {
    let edges = feature_edges(topology, features)?;
    let unused = |v: u32| topology.outgoing.get(v as usize).is_none_or(|&h| h == NONE);
    let lost: Vec<u32> =
        (0..features.vertices.len() as u32).filter(|&k| unused(features.vertices[k as usize])).collect();
    if !lost.is_empty() {
        return Err(RetopologyError::VertexOffSurface { features: lost });
    }
    let network = |least| network_of(mesh, &features.vertices, corner_angle, edges.clone(), least);
    let mut least = crumbs.shorter_than;
    let mut found = network([least, 0.0]);
    if found.corners.len() > crumbs.most_corners && least > 0.0 {
        let dropped = curves_beside(mesh, &edges, &features.vertices, least);
        let fewer = edges.iter().filter(|(edge, _)| !dropped.contains(*edge)).map(|(&edge, &border)| (edge, border));
        let mut fewer = network_of(mesh, &features.vertices, corner_angle, fewer.collect(), [least, 0.0]);
        if fewer.corners.len() <= crumbs.most_corners {
            fewer.dropped.extend(dropped);
            fewer.dropped.sort_unstable();
            return Ok(fewer);
        }
    }
    while found.corners.len() > crumbs.most_corners && least < 0.99 * MOST_GROWTH * crumbs.shorter_than {
        least *= GROWTH;
        found = network([least, least]);
    }
    Ok(found)
}

/// The network without crumbs shorter than the first of `least`, and without curves between forks shorter than the second.
fn network_of(
    mesh: &TriangleMesh,
    marked: &[u32],
    corner_angle: f64,
    mut edges: BTreeMap<[u32; 2], bool>,
    least: [f64; 2],
) -> Network {
    let dropped = drop_short(mesh, &mut edges, marked, least);
    let neighbours = neighbours(mesh, &edges);
    let mut is_corner: Vec<bool> = neighbours.iter().map(|around| !matches!(around.len(), 0 | 2)).collect();
    let mut points: Vec<u32> = Vec::new();
    for &v in marked {
        is_corner[v as usize] = !neighbours[v as usize].is_empty();
        if neighbours[v as usize].is_empty() {
            points.push(v);
        }
    }
    points.sort_unstable();
    points.dedup();
    let turns: Vec<u32> = (0..mesh.positions.len() as u32)
        .filter(|&v| !is_corner[v as usize] && neighbours[v as usize].len() == 2)
        .filter(|&v| turns_sharply(mesh, &neighbours, &is_corner, v, corner_angle))
        .collect();
    for &v in &turns {
        is_corner[v as usize] = true;
    }

    let mut left = edges;
    let mut chains = Vec::new();
    let starts = (0..mesh.positions.len() as u32).filter(|&v| is_corner[v as usize]);
    for start in starts {
        for &second in &neighbours[start as usize] {
            if let Some(border) = left.remove(&sorted(start, second)) {
                let vertices = walk(&neighbours, &is_corner, &mut left, start, second);
                chains.push(Chain { vertices, closed: false, border, whole: false });
            }
        }
    }
    while let Some((&[start, second], &border)) = left.first_key_value() {
        left.remove(&[start, second]);
        let mut vertices = walk(&neighbours, &is_corner, &mut left, start, second);
        vertices.pop();
        chains.push(Chain { vertices, closed: true, border, whole: false });
    }
    let corners = (0..mesh.positions.len() as u32).filter(|&v| is_corner[v as usize]).collect();
    Network { chains, corners, points, dropped }
}

pub(crate) fn neighbours(mesh: &TriangleMesh, edges: &BTreeMap<[u32; 2], bool>) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); mesh.positions.len()];
    for &[a, b] in edges.keys() {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    neighbours
}

/// A triangle with three marked sides and less height than this, in least lengths, is no room for quads: its longest side follows the
/// other two closely enough.
const SLIVER: f64 = 0.1;

/// Takes out crumbs: the longest sides of marked slivers, short curves between forks, the shortest first, short branches with a loose
/// end, then short components. Borders and what holds a marked vertex stay.
fn drop_short(
    mesh: &TriangleMesh,
    edges: &mut BTreeMap<[u32; 2], bool>,
    marked: &[u32],
    [least_length, least_between]: [f64; 2],
) -> Vec<[u32; 2]> {
    let length = |&[a, b]: &[u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let mut keep = vec![false; mesh.positions.len()];
    for &v in marked {
        keep[v as usize] = true;
    }
    let mut dropped = Vec::new();
    for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let sides = [sorted(a, b), sorted(b, c), sorted(c, a)];
        let Some(longest) = sides.into_iter().max_by(|a, b| length(a).total_cmp(&length(b))) else { continue };
        let height = mesh.area_normal(t).length() / length(&longest);
        let can_go = sides.iter().all(|side| edges.contains_key(side)) && edges.get(&longest) == Some(&false);
        if can_go && height < SLIVER * least_length {
            edges.remove(&longest);
            dropped.push(longest);
        }
    }
    if least_between > 0.0 {
        let around = neighbours(mesh, edges);
        let mut degree: Vec<usize> = around.iter().map(Vec::len).collect();
        let with_length = |curve: Curve| (curve.edges.iter().map(length).sum::<f64>(), curve);
        let curves = curves_from_forks(&around, &keep, edges).into_iter().map(with_length);
        let mut between: Vec<(f64, Curve)> = curves.filter(|(total, _)| *total < least_between).collect();
        between.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, Curve { edges: curve, ends }) in between {
            if ends.iter().all(|&v| degree[v as usize] > 2) {
                for v in ends {
                    degree[v as usize] -= 1;
                }
                dropped.extend(curve.into_iter().filter(|edge| edges.remove(edge).is_some()));
            }
        }
    }
    let around = neighbours(mesh, edges);
    for tip in (0..around.len()).filter(|&v| around[v].len() == 1 && !keep[v]) {
        let (branch, at) = branch(&around, &keep, [tip as u32, around[tip][0]]);
        // One that ends loose at both ends is a component, judged below.
        if around[at as usize].len() > 2 && branch.iter().map(length).sum::<f64>() < least_length {
            dropped.extend(branch.into_iter().filter(|edge| edges.remove(edge).is_some()));
        }
    }
    let around = neighbours(mesh, edges);
    let mut seen = vec![false; around.len()];
    for start in 0..around.len() {
        if seen[start] || around[start].is_empty() {
            continue;
        }
        let (mut component, mut next) = (vec![start as u32], 0);
        seen[start] = true;
        while next < component.len() {
            for &w in &around[component[next] as usize] {
                if !std::mem::replace(&mut seen[w as usize], true) {
                    component.push(w);
                }
            }
            next += 1;
        }
        let own = component.iter().flat_map(|&v| around[v as usize].iter().map(move |&w| [v, w]));
        let own: Vec<[u32; 2]> = own.filter(|[v, w]| v < w).collect();
        let stays = component.iter().any(|&v| keep[v as usize]) || own.iter().any(|edge| edges[edge]);
        if !stays && own.iter().map(length).sum::<f64>() < least_length {
            dropped.extend(own.into_iter().filter(|edge| edges.remove(edge).is_some()));
        }
    }
    dropped.sort_unstable();
    dropped
}

/// A curve from a fork to a higher vertex, of no border edges.
pub(crate) struct Curve {
    pub edges: Vec<[u32; 2]>,
    pub ends: [u32; 2],
}

/// The curves from forks to the next fork, loose end or vertex to be kept.
pub(crate) fn curves_from_forks(around: &[Vec<u32>], keep: &[bool], edges: &BTreeMap<[u32; 2], bool>) -> Vec<Curve> {
    let mut curves = Vec::new();
    for fork in (0..around.len() as u32).filter(|&v| around[v as usize].len() > 2) {
        for &second in &around[fork as usize] {
            let (curve, end) = branch(around, keep, [fork, second]);
            // Those between forks are found from both of their ends.
            if fork < end && curve.iter().all(|edge| edges.get(edge) == Some(&false)) {
                curves.push(Curve { edges: curve, ends: [fork, end] });
            }
        }
    }
    curves
}

/// The edges from the first of two vertices over the second to the next one that is marked or where other than two edges meet, and that
/// one.
fn branch(around: &[Vec<u32>], keep: &[bool], [mut before, mut at]: [u32; 2]) -> (Vec<[u32; 2]>, u32) {
    let start = before;
    let mut branch = vec![sorted(before, at)];
    while around[at as usize].len() == 2 && !keep[at as usize] && at != start {
        let after = around[at as usize].iter().copied().find(|&w| w != before).unwrap_or(before);
        branch.push(sorted(at, after));
        (before, at) = (at, after);
    }
    (branch, at)
}

/// Marked and border edges, and whether each is a border.
fn feature_edges(topology: &Topology, features: &Features) -> Result<BTreeMap<[u32; 2], bool>, RetopologyError> {
    let (mut edges, mut off, mut repeated) = (BTreeMap::new(), Vec::new(), Vec::new());
    for (k, &[a, b]) in features.edges.iter().enumerate() {
        let on = |v: u32| (v as usize) < topology.outgoing.len();
        let found = (on(a) && on(b) && a != b).then(|| topology.find(a, b).or_else(|| topology.find(b, a))).flatten();
        match found {
            None => off.push(k as u32),
            Some(h) => {
                if edges.insert(sorted(a, b), topology.is_border(h)).is_some() {
                    repeated.push(k as u32);
                }
            }
        }
    }
    if !off.is_empty() {
        return Err(RetopologyError::FeatureOffSurface { features: off });
    }
    if !repeated.is_empty() {
        return Err(RetopologyError::FeatureRepeated { features: repeated });
    }
    for h in (0..topology.len() as u32).filter(|&h| topology.is_border(h)) {
        edges.insert(sorted(topology.from(h), topology.to(h)), true);
    }
    Ok(edges)
}

/// Follows a curve from `start` over `second` to the next corner or back to `start`.
fn walk(
    neighbours: &[Vec<u32>],
    is_corner: &[bool],
    left: &mut BTreeMap<[u32; 2], bool>,
    start: u32,
    second: u32,
) -> Vec<u32> {
    let mut vertices = vec![start, second];
    let (mut before, mut at) = (start, second);
    while !is_corner[at as usize] && at != start {
        let next =
            if neighbours[at as usize][0] == before { neighbours[at as usize][1] } else { neighbours[at as usize][0] };
        left.remove(&sorted(at, next));
        vertices.push(next);
        (before, at) = (at, next);
    }
    vertices
}

fn turns_sharply(mesh: &TriangleMesh, neighbours: &[Vec<u32>], is_corner: &[bool], v: u32, limit: f64) -> bool {
    let at = |v: u32| mesh.positions[v as usize];
    let &[a, b] = &neighbours[v as usize][..] else { return false };
    let beyond = |first: u32| {
        if is_corner[first as usize] {
            return first;
        }
        neighbours[first as usize].iter().copied().find(|&w| w != v).unwrap_or(first)
    };
    let turn = |p: DVec3, q: DVec3| (at(v) - p).angle_between(q - at(v));
    let sharp = |angle: f64| angle > limit;
    sharp(turn(at(a), at(b))) && sharp(turn(at(beyond(a)), at(beyond(b))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat grid of `n` by `n` squares; vertex (i, j) is `i * (n + 1) + j`.
    fn grid(n: u32) -> (TriangleMesh, Topology) {
        let (mesh, _) = TriangleMesh::from_polygons(&testkit::shapes::sheet(n, n));
        let topology = Topology::of_triangles(&mesh);
        (mesh, topology)
    }

    fn marked(path: &[u32]) -> Features {
        Features { edges: path.windows(2).map(|p| [p[0], p[1]]).collect(), vertices: vec![] }
    }

    fn of(n: u32, features: &Features) -> Result<Network, RetopologyError> {
        let (mesh, topology) = grid(n);
        network(&mesh, &topology, features, 50_f64.to_radians(), Crumbs::NONE)
    }

    #[test]
    fn a_border_has_chains_between_its_corners() {
        let found = of(3, &Features::default()).unwrap();
        assert_eq!(found.corners, [0, 3, 12, 15]);
        assert!(found.chains.iter().all(|chain| chain.border && !chain.closed && chain.vertices.len() == 4));
        assert_eq!(found.chains.len(), 4);
    }

    #[test]
    fn a_path_from_border_to_inside_has_corners_where_it_starts_ends_and_turns() {
        // From the border vertex (0, 2) three steps in, then three along, on a grid of 7.
        let at = |i: u32, j: u32| i * 8 + j;
        let path = [at(0, 2), at(1, 2), at(2, 2), at(3, 2), at(3, 3), at(3, 4), at(3, 5)];
        let found = of(7, &marked(&path)).unwrap();
        let inner: Vec<u32> = found.corners.iter().copied().filter(|v| path.contains(v)).collect();
        assert_eq!(inner, [at(0, 2), at(3, 2), at(3, 5)]);
        let inner: Vec<&Chain> = found.chains.iter().filter(|chain| !chain.border).collect();
        assert_eq!(inner.len(), 2);
        assert_eq!(inner[0].vertices, path[..4]);
        assert_eq!(inner[1].vertices, path[3..]);
    }

    #[test]
    fn a_zigzag_has_no_corners_and_a_ring_is_closed() {
        let at = |i: u32, j: u32| i * 10 + j;
        let zigzag: Vec<u32> = (2..6).flat_map(|k| [at(k, k), at(k, k + 1)]).collect();
        let found = of(9, &marked(&zigzag)).unwrap();
        assert_eq!(found.corners.iter().filter(|v| zigzag.contains(v)).count(), 2, "its ends");
        // An octagon, its corners cut by the diagonals of the grid's squares or by two of its edges.
        let (mesh, topology) = grid(9);
        let ring = [at(3, 2), at(4, 2), at(5, 3), at(5, 4), at(4, 4), at(3, 3), at(3, 2)];
        let found = network(&mesh, &topology, &marked(&ring), 3.0, Crumbs::NONE).unwrap();
        let closed: Vec<&Chain> = found.chains.iter().filter(|chain| chain.closed && !chain.border).collect();
        assert_eq!(closed.len(), 1);
        assert_eq!(closed[0].vertices.iter().collect::<std::collections::BTreeSet<_>>().len(), 6);
        assert_eq!(closed[0].walk().count(), 7);
    }

    #[test]
    fn crumbs_and_short_branches_are_dropped_unless_marked() {
        // A line of six edges with a branch of one, and a crumb of two edges; edges of the sheet have length 1 / 9 of it.
        let at = |i: u32, j: u32| i * 10 + j;
        let line: Vec<u32> = (1..8).map(|j| at(2, j)).collect();
        let mut features = marked(&line);
        features.edges.extend([[at(2, 4), at(3, 4)], [at(6, 2), at(6, 3)], [at(6, 3), at(6, 4)]]);
        let (mesh, topology) = grid(9);
        let edge = mesh.positions[0].distance(mesh.positions[1]);
        let found = |features: &Features, edges: f64| {
            network(&mesh, &topology, features, 0.9, Crumbs { shorter_than: edges * edge, ..Crumbs::NONE }).unwrap()
        };
        assert!(found(&features, 0.9).dropped.is_empty());
        let some = found(&features, 1.5);
        assert_eq!(some.dropped, [[at(2, 4), at(3, 4)]]);
        assert_eq!(some.chains.iter().filter(|chain| !chain.border).count(), 2);
        assert_eq!(found(&features, 2.5).dropped.len(), 3);
        assert_eq!(found(&features, 100.0).dropped.len(), 9, "borders stay");
        features.vertices = vec![at(6, 3), at(3, 4)];
        assert!(found(&features, 2.5).dropped.is_empty());
    }

    #[test]
    fn features_without_room_leave_their_short_curves_out() {
        // A ladder: two lines of six edges with five rungs of one edge between, and a crumb beside it.
        let at = |i: u32, j: u32| i * 10 + j;
        let mut features = marked(&(1..8).map(|j| at(2, j)).collect::<Vec<_>>());
        features.edges.extend(marked(&(1..8).map(|j| at(3, j)).collect::<Vec<_>>()).edges);
        features.edges.extend((2..7).map(|j| [at(2, j), at(3, j)]));
        features.edges.push([at(6, 2), at(6, 3)]);
        let (mesh, topology) = grid(9);
        let edge = mesh.positions[0].distance(mesh.positions[1]);
        let found = |most_corners: usize| {
            let crumbs = Crumbs { shorter_than: 0.5 * edge, most_corners };
            network(&mesh, &topology, &features, 0.9, crumbs).unwrap()
        };
        // The sheet's corners, the ladder's ends and forks, and the crumb's ends.
        assert_eq!((found(20).corners.len(), found(20).dropped.len()), (20, 0));
        let some = found(19);
        assert!(some.corners.len() < 20 && some.dropped.contains(&[at(6, 2), at(6, 3)]), "{some:?}");
        assert!(some.dropped.len() < 14, "its long lines stay: {:?}", some.dropped);
        assert_eq!(found(0).corners.len(), 4, "borders stay");
    }

    #[test]
    fn lines_beside_others_go_first_where_that_makes_room() {
        // Two lines of seven edges, four apart, with three lines across: six forks, four ends and the sheet's corners.
        let at = |i: u32, j: u32| i * 10 + j;
        let mut features = marked(&(1..9).map(|j| at(2, j)).collect::<Vec<_>>());
        features.edges.extend(marked(&(1..9).map(|j| at(6, j)).collect::<Vec<_>>()).edges);
        for j in 3..6 {
            features.edges.extend(marked(&(2..7).map(|i| at(i, j)).collect::<Vec<_>>()).edges);
        }
        let (mesh, topology) = grid(9);
        let edge = mesh.positions[0].distance(mesh.positions[1]);
        let found = |most_corners: usize| {
            let crumbs = Crumbs { shorter_than: 1.1 * edge, most_corners };
            network(&mesh, &topology, &features, 0.9, crumbs).unwrap()
        };
        assert!(found(14).dropped.is_empty());
        let some = found(10);
        assert_eq!(some.dropped.iter().map(|[a, _]| a % 10).collect::<BTreeSet<_>>(), BTreeSet::from([3, 4]));
        assert_eq!((some.corners.len(), some.dropped.len()), (10, 8));
    }

    #[test]
    fn the_longest_side_of_a_marked_sliver_is_dropped() {
        // A flat triangle on a base of length 2, and one on each of its sides.
        let positions = [(0., 0.), (2., 0.), (1., 0.01), (1., -1.), (0., 1.), (2., 1.)];
        let positions = positions.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 4], [2, 1, 5]] };
        let features = Features { edges: vec![[0, 1], [1, 2], [2, 0]], vertices: vec![] };
        let dropped = |least: f64| {
            let crumbs = Crumbs { shorter_than: least, ..Crumbs::NONE };
            network(&mesh, &Topology::of_triangles(&mesh), &features, 0.9, crumbs).unwrap().dropped
        };
        assert_eq!(dropped(0.2), [[0, 1]]);
        assert!(dropped(0.05).is_empty());
    }

    #[test]
    fn marked_vertices_are_corners_or_points() {
        let features = Features { edges: vec![], vertices: vec![1, 5, 5] };
        let found = of(3, &features).unwrap();
        assert_eq!(found.points, [5]);
        assert_eq!(found.corners, [0, 1, 3, 12, 15]);
    }

    #[test]
    fn what_is_no_feature_is_named() {
        let refused = |edges: &[[u32; 2]], vertices: &[u32]| {
            of(3, &Features { edges: edges.to_vec(), vertices: vertices.to_vec() }).unwrap_err()
        };
        let off = RetopologyError::FeatureOffSurface { features: vec![1, 2, 3] };
        assert_eq!(refused(&[[0, 1], [0, 10], [4, 4], [99, 0]], &[]), off);
        assert_eq!(refused(&[[0, 1], [1, 2], [1, 0]], &[]), RetopologyError::FeatureRepeated { features: vec![2] });
        assert_eq!(refused(&[], &[3, 16]), RetopologyError::VertexOffSurface { features: vec![1] });
    }
}
