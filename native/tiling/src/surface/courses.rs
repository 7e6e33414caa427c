//! Which way each zigzag side starts, and with that the outline of every patch (section 4.2.3: the order of edges along a
//! side is one choice for both patches).
//!
//! The choice is made for all sides together, by changing one after the other while fewer patches are without a simple
//! outline that the certificate lets pass.

use super::halves::Steps;
use super::patch_graph::{Patch, PatchGraph};
use crate::plane::Direction;
use crate::random::Random;
use crate::{Boundary, Certificate};
use mesh::{Cancelled, Monitor};

/// Directions of the edges of a side less its own: 0, 1 or -1.
pub(super) type Course = Vec<i8>;

/// Rounds of changes, and the seed of those made in spite of everything.
const ROUNDS: usize = 60;
const SEED: u64 = 5;

/// Orders drawn at random for a side of edges and pairs.
const SHUFFLES: usize = 6;

/// Ways to go along a side, the edge that turned half a pair last, first, or in the middle.
fn ways(steps: Steps) -> Vec<Course> {
    let ways = balanced(steps);
    if steps.turned == 0 {
        return ways;
    }
    let with = |way: &Course, at: usize| [&way[..at], &[steps.turned], &way[at..]].concat();
    ways.iter().flat_map(|way| [way.len(), 0, way.len() / 2].map(|at| with(way, at))).collect()
}

/// The first of the ways along a side.
pub(super) fn straightforward(steps: Steps) -> Course {
    ways(steps).swap_remove(0)
}

/// Ways to go along a side but for half a pair: pairs that start to the left, to the right, or half of them each; before, after or amid the
/// edges of its own direction.
fn balanced(steps: Steps) -> Vec<Course> {
    let (n, m) = (steps.straight as usize, steps.pairs as usize);
    if m == 0 {
        return vec![vec![0; n]];
    }
    let zigzag = |left: usize| (0..m).flat_map(move |k| if k < left { [1, -1] } else { [-1, 1] }).collect::<Course>();
    let turned = |course: Course| course.into_iter().map(|offset| -offset).collect::<Course>();
    let mut zigzags = vec![zigzag(m), zigzag(0)];
    if m > 1 {
        zigzags.extend([zigzag(m / 2), turned(zigzag(m / 2))]);
    }
    if n == 0 {
        return zigzags;
    }
    let mut ways = Vec::new();
    for zigzag in zigzags {
        // Edges before the pairs: none, all, half; pairs half before and half after the edges; and between a pair's two edges.
        for before in [0, n, n / 2] {
            ways.push([vec![0; before], zigzag.clone(), vec![0; n - before]].concat());
        }
        let middle = m / 2 * 2;
        ways.push([&zigzag[..middle], &vec![0; n], &zigzag[middle..]].concat());
        ways.push([&zigzag[..1], &vec![0; n], &zigzag[1..]].concat());
    }
    ways
}

/// Directions of all edges around a patch.
pub(super) fn edge_directions(patch: &Patch, courses: &[Course]) -> Vec<Direction> {
    let mut directions = Vec::new();
    for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
        let course = &courses[corner.side as usize];
        let step = |offset: &i8| (direction as i8 + 12 + offset) as u8 % 12;
        if corner.reversed {
            directions.extend(course.iter().rev().map(step));
        } else {
            directions.extend(course.iter().map(step));
        }
    }
    directions
}

/// The boundary code of a patch.
pub(super) fn code(patch: &Patch, courses: &[Course]) -> Vec<u8> {
    let directions = edge_directions(patch, courses);
    let n = directions.len();
    (0..n).map(|k| (18 + directions[(k + n - 1) % n] - directions[k]) % 12).collect()
}

/// How far a patch is from an outline that may have a tiling: 0 when nothing speaks against it.
pub(super) fn fault(patch: &Patch, courses: &[Course]) -> u32 {
    let code = code(patch, courses);
    let sharp = code.iter().filter(|&&angle| angle < 2).count() as u32;
    if sharp > 0 {
        return 5 + sharp;
    }
    if patch.total_interior_defect() != 0 {
        return 0;
    }
    match Boundary::new(&code) {
        Err(_) => 4,
        Ok(boundary) => {
            let certificate = Certificate::new(boundary.directions());
            if certificate.refutes() {
                2 + u32::from(certificate.refutes_rhombi())
            } else {
                u32::from(certificate.border_conflict(boundary.directions()).is_some())
            }
        }
    }
}

/// Sides that take one course, the ends of rows: all of them change together.
struct Bundle {
    /// Each side, and whether it is walked against the first.
    sides: Vec<(usize, bool)>,
    /// Patches beside them.
    beside: Vec<usize>,
    ways: Vec<Course>,
}

impl Bundle {
    fn set(&self, course: &Course, courses: &mut [Course]) {
        for &(side, is_against) in &self.sides {
            courses[side].clone_from(course);
            if is_against {
                courses[side].reverse();
            }
        }
    }
}

/// Sides joined by rows from end to end.
fn bundles(graph: &PatchGraph, steps: &[Steps], random: &mut Random) -> Vec<Bundle> {
    let mut across: Vec<Vec<(usize, bool)>> = vec![Vec::new(); graph.sides.len()];
    for patch in &graph.patches {
        for [a, b] in patch.row_ends().into_iter().map(|pair| pair.map(|k| &patch.corners[k])) {
            let (first, second) = (a.side as usize, b.side as usize);
            if steps[first].is_mixed() && steps[first] == steps[second] {
                // Opposite sides of a patch are walked in opposite directions.
                let is_against = a.reversed == b.reversed;
                across[first].push((second, is_against));
                across[second].push((first, is_against));
            }
        }
    }
    let mut beside = vec![Vec::new(); graph.sides.len()];
    for (p, patch) in graph.patches.iter().enumerate() {
        for corner in &patch.corners {
            beside[corner.side as usize].push(p);
        }
    }
    let mut known = vec![false; graph.sides.len()];
    let mut found = Vec::new();
    for start in 0..graph.sides.len() {
        if std::mem::replace(&mut known[start], true) {
            continue;
        }
        let mut sides = vec![(start, false)];
        let mut next = 0;
        while next < sides.len() {
            let (side, is_against) = sides[next];
            for &(other, turned) in &across[side] {
                if !std::mem::replace(&mut known[other], true) {
                    sides.push((other, is_against != turned));
                }
            }
            next += 1;
        }
        let mut of_all: Vec<usize> = sides.iter().flat_map(|&(side, _)| beside[side].iter().copied()).collect();
        of_all.sort_unstable();
        of_all.dedup();
        let mut ways = ways(steps[start]);
        if steps[start].is_mixed() {
            // Sides of both kinds are there for variety: shuffled ones first.
            let shuffled: Vec<Course> = (0..SHUFFLES).map(|_| shuffled(steps[start], random)).collect();
            ways.splice(0..0, shuffled);
        }
        found.push(Bundle { sides, beside: of_all, ways });
    }
    found
}

/// A course in any order.
fn shuffled(steps: Steps, random: &mut Random) -> Course {
    let mut pieces: Vec<Option<bool>> = vec![None; steps.straight as usize];
    pieces.extend((0..steps.pairs).map(|_| Some(random.bit() == 1)));
    for k in (1..pieces.len()).rev() {
        pieces.swap(k, random.index(k + 1));
    }
    let edges = |piece| match piece {
        None => vec![0],
        Some(true) => vec![1, -1],
        Some(false) => vec![-1, 1],
    };
    pieces.into_iter().flat_map(edges).collect()
}

/// The course of each side.
pub(super) fn courses(
    graph: &PatchGraph,
    steps: &[Steps],
    seed: u64,
    monitor: &Monitor,
) -> Result<Vec<Course>, Cancelled> {
    let mut random = Random::new(seed ^ SEED);
    let bundles = bundles(graph, steps, &mut random);
    let mut of_side = vec![0; graph.sides.len()];
    let mut courses: Vec<Course> = vec![Course::new(); graph.sides.len()];
    for (k, bundle) in bundles.iter().enumerate() {
        bundle.set(&bundle.ways[0], &mut courses);
        bundle.sides.iter().for_each(|&(side, _)| of_side[side] = k);
    }
    let mut faults: Vec<u32> = graph.patches.iter().map(|patch| fault(patch, &courses)).collect();
    let mut best = (faults.iter().sum::<u32>(), courses.clone());
    for _ in 0..ROUNDS {
        if best.0 == 0 {
            break;
        }
        let bad: Vec<usize> = (0..faults.len()).filter(|&p| faults[p] > 0).collect();
        let mut has_gained = false;
        for &p in &bad {
            for corner in &graph.patches[p].corners {
                monitor.check()?;
                let bundle = &bundles[of_side[corner.side as usize]];
                let now: u32 = bundle.beside.iter().map(|&q| faults[q]).sum();
                let before = courses[bundle.sides[0].0].clone();
                let gain = bundle.ways.iter().find_map(|way| {
                    bundle.set(way, &mut courses);
                    let after: Vec<u32> = bundle.beside.iter().map(|&q| fault(&graph.patches[q], &courses)).collect();
                    (after.iter().sum::<u32>() < now).then_some(after)
                });
                if let Some(after) = gain {
                    for (&q, fault) in bundle.beside.iter().zip(after) {
                        faults[q] = fault;
                    }
                    has_gained = true;
                } else {
                    bundle.set(&before, &mut courses);
                }
            }
        }
        let sum = faults.iter().sum();
        if sum < best.0 {
            best = (sum, courses.clone());
        }
        if !has_gained && let Some(&p) = bad.get(random.index(bad.len())) {
            // No single change helps: all sides of one faulty patch start anew.
            for corner in &graph.patches[p].corners {
                let bundle = &bundles[of_side[corner.side as usize]];
                bundle.set(&bundle.ways[random.index(bundle.ways.len())], &mut courses);
                for &q in &bundle.beside {
                    faults[q] = fault(&graph.patches[q], &courses);
                }
            }
        }
    }
    Ok(best.1)
}
