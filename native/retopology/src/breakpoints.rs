//! Breakpoints: base vertices that divide the curves.
//!
//! In Daniels et al. 2011 the artist places them. Here every curve is divided by dynamic programming into as few pieces as its
//! turns and the wanted lengths allow. Curves that run side by side are divided abreast where that costs little: base edges
//! across a narrow strip then stand upright in it, and its base triangles pair to rectangles however long the strip is.

use crate::features::{Chain, Network};
use crate::metric::Metric;
use crate::split_mesh::SplitMesh;
use mesh::{DVec3, NONE, nearest_on_segment};
use std::collections::BTreeMap;

/// Two points of one curve, or of curves that share a corner, are neighbours along the curve and no pair of parallel
/// strands when the way along it is at most this multiple of the way across.
const DETOUR: f64 = 2.5;
/// A curve turns by at most this much between breakpoints, radians.
const LARGEST_TURN: f64 = 1.75;
/// Zigzag below this fraction of the wanted length, or of the curve's own, is no turn.
const ZIGZAG: f64 = 0.02;
/// A piece may be this many times as long as wanted.
const LONGEST: f64 = 1.6;
/// Cost of a piece, where one that is twice as long as wanted costs [`STRETCH`] more, and one of no length 1 more.
const PIECE: f64 = 0.6;
const STRETCH: f64 = 3.0;
/// What a breakpoint abreast of another saves.
const ABREAST: f64 = 0.25;
/// Breakpoints are abreast when they are off by at most this fraction of the wanted length.
const OFF: f64 = 0.12;

/// Base vertices that lie on curves, and where.
#[derive(Debug, Clone, Default)]
pub struct Breakpoints {
    /// For each chain the indices of its breakpoints into [`crate::features::Chain::walk`], ascending; the ends of an open
    /// chain are among them, and the first of a closed one stands for its last too.
    pub along: Vec<Vec<usize>>,
}

/// Two vertices of curves that face one another across the surface between.
#[derive(Debug, Clone, Copy)]
pub struct Facing {
    /// The vertices.
    pub ends: [u32; 2],
    /// About the distance between them.
    pub across: f64,
}

/// All pairs of curve vertices and points whose nearest regions touch, but for those that are neighbours along a curve or
/// about a corner. O(n log n).
pub fn faces(mesh: &SplitMesh, metric: &Metric, network: &Network) -> Vec<Facing> {
    let n = mesh.positions.len();
    // Where each curve vertex lies: its chain, and how far along.
    let mut place = vec![(NONE, 0.0); n];
    let mut total = vec![0.0; network.chains.len()];
    let mut seeds = Vec::new();
    for (c, chain) in network.chains.iter().enumerate() {
        let mut before = None;
        for v in chain.walk() {
            if let Some(u) = before {
                total[c] += distance(mesh, u, v);
            }
            before = Some(v);
            if place[v as usize].0 == NONE {
                place[v as usize] = (c as u32, total[c]);
                seeds.push((v, 0.0, v));
            }
        }
    }
    seeds.extend(network.points.iter().map(|&v| (v, 0.0, v)));
    let (mut away, mut nearest) = (vec![f64::INFINITY; n], vec![NONE; n]);
    metric.spread(&mut away, &mut nearest, &seeds, 1.0);

    let is_corner = |v: u32| network.corners.binary_search(&v).is_ok();
    let joined = |a: u32, b: u32| {
        let chain_ends = |c: u32| {
            let chain: &Chain = &network.chains[c as usize];
            (!chain.closed).then(|| [chain.vertices[0], chain.vertices[chain.vertices.len() - 1]])
        };
        let (ends_a, ends_b) = (chain_ends(a), chain_ends(b));
        ends_a.zip(ends_b).is_some_and(|(p, q)| p.iter().any(|v| q.contains(v)))
    };
    let mut facing = Vec::new();
    for h in 0..mesh.origin.len() as u32 {
        let (a, b) = (nearest[mesh.from(h) as usize], nearest[mesh.to(h) as usize]);
        if a == NONE || b == NONE || a == b || is_corner(a) || is_corner(b) {
            continue;
        }
        let across = away[mesh.from(h) as usize] + mesh.length(h) + away[mesh.to(h) as usize];
        let ((chain_a, at_a), (chain_b, at_b)) = (place[a as usize], place[b as usize]);
        let neighbours = if chain_a == NONE || chain_b == NONE {
            false
        } else if chain_a == chain_b {
            let straight = (at_a - at_b).abs();
            let chain = &network.chains[chain_a as usize];
            let along = if chain.closed { straight.min(total[chain_a as usize] - straight) } else { straight };
            along <= DETOUR * across
        } else {
            joined(chain_a, chain_b)
        };
        if !neighbours {
            facing.push(Facing { ends: [a, b], across });
        }
    }
    facing
}

fn distance(mesh: &SplitMesh, a: u32, b: u32) -> f64 {
    mesh.positions[a as usize].distance(mesh.positions[b as usize])
}

/// How a chain runs: lengths and turns along it.
#[derive(Debug)]
pub struct Course {
    /// Its vertices; a closed one returns to the first.
    pub walk: Vec<u32>,
    /// Length up to each vertex.
    reached: Vec<f64>,
    /// Turns before each vertex, radians, zigzag left out; one entry more, for the whole.
    turned: Vec<f64>,
    closed: bool,
}

impl Course {
    /// Measures a chain against a wanted length. O(n log n) for most.
    pub fn new(mesh: &SplitMesh, chain: &Chain, wanted: f64) -> Self {
        let walk: Vec<u32> = chain.walk().collect();
        let points: Vec<DVec3> = walk.iter().map(|&v| mesh.positions[v as usize]).collect();
        let mut reached = vec![0.0];
        for pair in points.windows(2) {
            reached.push(reached[reached.len() - 1] + pair[0].distance(pair[1]));
        }
        let total = reached[reached.len() - 1];
        let bends = bends(&points, ZIGZAG * wanted.min(total));
        let mut turn = vec![0.0; walk.len()];
        for triple in bends.windows(3) {
            let [a, b, c] = [triple[0], triple[1], triple[2]].map(|k| points[k]);
            turn[triple[1]] = angle(b - a, c - b);
        }
        if let (true, [_, second, .., before, last]) = (chain.closed, &bends[..]) {
            turn[*last] = angle(points[*last] - points[*before], points[*second] - points[0]);
        }
        let mut turned = vec![0.0];
        for t in turn {
            turned.push(turned[turned.len() - 1] + t);
        }
        Self { closed: chain.closed, walk, reached, turned }
    }

    fn last(&self) -> usize {
        self.walk.len() - 1
    }

    fn total(&self) -> f64 {
        self.reached[self.last()]
    }

    /// Turns between two vertices of the walk, both left out.
    fn turn_within(&self, from: usize, to: usize) -> f64 {
        self.turned[to] - self.turned[from + 1]
    }

    /// It must have this many pieces, to be no loop or double edge of the base.
    fn least_pieces(&self) -> usize {
        if self.walk[0] == self.walk[self.last()] { 3.min(self.last()) } else { 1 }
    }

    /// For each vertex of the walk the length of the shortest part through it that a piece may not exceed for its turns.
    pub fn longest_pieces(&self) -> Vec<f64> {
        let last = self.last();
        let mut longest = vec![self.total() / self.least_pieces() as f64; last + 1];
        let mut to = 0;
        for from in 0..last {
            to = to.max(from + 1);
            while to < last && self.turn_within(from, to) <= LARGEST_TURN {
                to += 1;
            }
            if self.turn_within(from, to) > LARGEST_TURN {
                let length = self.reached[to] - self.reached[from];
                for l in &mut longest[from..=to] {
                    *l = l.min(length);
                }
            }
        }
        longest
    }
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    if a.length_squared() > 0.0 && b.length_squared() > 0.0 { a.angle_between(b) } else { 0.0 }
}

/// The vertices a polyline needs to stay within `tolerance` of itself (Douglas and Peucker 1973), its ends among them.
fn bends(points: &[DVec3], tolerance: f64) -> Vec<usize> {
    let last = points.len() - 1;
    let mut kept = vec![0, last];
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (points[from], points[to]);
        let off = |k: usize| points[k].distance(a + (b - a) * nearest_on_segment(points[k], a, b));
        let far = (from + 1..to).map(|k| (off(k), k)).fold((tolerance, 0), |far, k| if k.0 > far.0 { k } else { far });
        if far.1 > 0 {
            kept.push(far.1);
            open.extend([(from, far.1), (far.1, to)]);
        }
    }
    kept.sort_unstable();
    kept
}

/// Divides every chain, the longest first. Closed chains are turned to start where that suits best. O(n log n), times the
/// vertices in a piece.
pub fn divide_curves(mesh: &SplitMesh, metric: &Metric, network: &mut Network, wanted: &[f64]) -> Breakpoints {
    let n = mesh.positions.len();
    let mut facing = BTreeMap::<u32, Vec<u32>>::new();
    for pair in faces(mesh, metric, network) {
        for [v, w] in [pair.ends, [pair.ends[1], pair.ends[0]]] {
            facing.entry(v).or_default().push(w);
        }
    }
    // Distance along its curve from each vertex to the nearest breakpoint so far: at first to the ends.
    let mut to_breakpoint = vec![f64::INFINITY; n];
    let longest_wanted = wanted.iter().copied().fold(0.0, f64::max);
    let courses = |network: &Network| -> Vec<Course> {
        network.chains.iter().map(|chain| Course::new(mesh, chain, longest_wanted)).collect()
    };
    let before = courses(network);
    for course in before.iter().filter(|course| !course.closed) {
        note(&mut to_breakpoint, course, &[0, course.last()]);
    }
    let mut order: Vec<usize> = (0..network.chains.len()).collect();
    order.sort_by(|&a, &b| before[b].total().total_cmp(&before[a].total()).then(a.cmp(&b)));
    let mut along = vec![Vec::new(); network.chains.len()];
    for c in order {
        let abreast = |v: u32| {
            facing.get(&v).is_some_and(|all| all.iter().any(|&w| to_breakpoint[w as usize] <= OFF * wanted[w as usize]))
        };
        if before[c].closed {
            let vertices = &mut network.chains[c].vertices;
            let start = vertices.iter().position(|&v| abreast(v)).unwrap_or(0);
            vertices.rotate_left(start);
        }
        let course = Course::new(mesh, &network.chains[c], longest_wanted);
        along[c] = if network.chains[c].whole { vec![0, course.last()] } else { divided(&course, wanted, abreast) };
        note(&mut to_breakpoint, &course, &along[c]);
    }
    Breakpoints { along }
}

/// Lowers the distances to breakpoints along a chain.
fn note(to_breakpoint: &mut [f64], course: &Course, along: &[usize]) {
    let mut k = 0;
    for (at, &v) in course.walk.iter().enumerate() {
        while k + 1 < along.len() && along[k + 1] <= at {
            k += 1;
        }
        let nearest = [along[k], along[(k + 1).min(along.len() - 1)]]
            .map(|b| (course.reached[b] - course.reached[at]).abs())
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        to_breakpoint[v as usize] = to_breakpoint[v as usize].min(nearest);
    }
}

/// The cheapest division of a chain: indices into its walk, from the first to the last.
fn divided(course: &Course, wanted: &[f64], abreast: impl Fn(u32) -> bool) -> Vec<usize> {
    let last = course.last();
    let mut measure = vec![0.0];
    for k in 1..=last {
        let size = 0.5 * (wanted[course.walk[k - 1] as usize] + wanted[course.walk[k] as usize]);
        measure.push(measure[k - 1] + (course.reached[k] - course.reached[k - 1]) / size);
    }
    let least = course.least_pieces();
    // Enough pieces by making each shorter than its share, or by count where the chain has hardly more edges.
    if last <= 2 * least {
        return (0..=least).map(|k| k * last / least).collect();
    }
    let most = if least > 1 { LONGEST.min(measure[last] / (least as f64 - 0.5)) } else { LONGEST };
    let fits = |i: usize, j: usize| {
        j == i + 1 || (measure[j] - measure[i] <= most && course.turn_within(i, j) <= LARGEST_TURN)
    };
    let share = most / LONGEST;
    let mut best: Vec<(f64, usize)> = vec![(0.0, 0)];
    for j in 1..=last {
        let saved = if j < last && abreast(course.walk[j]) { ABREAST } else { 0.0 };
        let mut cheapest = (f64::INFINITY, j - 1);
        for i in (0..j).rev() {
            if !fits(i, j) {
                break;
            }
            let length = (measure[j] - measure[i]) / share;
            let uneven = (length - 1.0).powi(2) * if length > 1.0 { STRETCH } else { 1.0 };
            let cost = best[i].0 + PIECE + uneven - saved;
            if cost < cheapest.0 {
                cheapest = (cost, i);
            }
        }
        best.push(cheapest);
    }
    let mut along = vec![last];
    while along[along.len() - 1] > 0 {
        along.push(best[along[along.len() - 1]].1);
    }
    along.reverse();
    along
}
