//! Which way each zigzag side starts, and with that the outline of every patch (section 4.2.3: the order of edges along a
//! side is one choice for both patches).
//!
//! The choice is made for all sides together, by changing one after the other while fewer patches are without a simple
//! outline that the certificate lets pass.

use super::lengths::Steps;
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

/// Ways to go along a side: pairs that start to the left, to the right, or half of them each; before, after or amid the
/// edges of its own direction.
fn ways(steps: Steps) -> Vec<Course> {
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
        return 4 + sharp;
    }
    if patch.total_interior_defect() != 0 {
        return 0;
    }
    match Boundary::new(&code) {
        Err(_) => 3,
        Ok(boundary) => {
            let certificate = Certificate::new(boundary.directions());
            if certificate.refutes() { 1 + u32::from(certificate.refutes_rhombi()) } else { 0 }
        }
    }
}

/// The course of each side.
pub(super) fn courses(graph: &PatchGraph, steps: &[Steps], monitor: &Monitor) -> Result<Vec<Course>, Cancelled> {
    let ways: Vec<Vec<Course>> = steps.iter().map(|&steps| ways(steps)).collect();
    let mut courses: Vec<Course> = ways.iter().map(|ways| ways[0].clone()).collect();
    let mut beside = vec![Vec::new(); graph.sides.len()];
    for (p, patch) in graph.patches.iter().enumerate() {
        for corner in &patch.corners {
            beside[corner.side as usize].push(p);
        }
    }
    let mut faults: Vec<u32> = graph.patches.iter().map(|patch| fault(patch, &courses)).collect();
    let mut random = Random::new(SEED);
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
                let s = corner.side as usize;
                let now: u32 = beside[s].iter().map(|&q| faults[q]).sum();
                for way in &ways[s] {
                    let before = std::mem::replace(&mut courses[s], way.clone());
                    let after: Vec<u32> = beside[s].iter().map(|&q| fault(&graph.patches[q], &courses)).collect();
                    if after.iter().sum::<u32>() < now {
                        for (&q, fault) in beside[s].iter().zip(after) {
                            faults[q] = fault;
                        }
                        has_gained = true;
                        break;
                    }
                    courses[s] = before;
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
                let s = corner.side as usize;
                courses[s].clone_from(&ways[s][random.index(ways[s].len())]);
                for &q in &beside[s] {
                    faults[q] = fault(&graph.patches[q], &courses);
                }
            }
        }
    }
    Ok(best.1)
}
