//! The filling that always exists: one ring of quads along the border, and a grid in the loop that is left.
//!
//! Every border vertex gets an inner copy, which makes two quads meet there; a regular corner instead shares one copy with
//! its two neighbours, which makes one quad meet there and saves two edges. The inner loop has even length L >= 4, so an
//! a x b grid with a + b = L / 2 closes it. The grid's four corners go where the ring already has three quads, on copies
//! of regular corners, as far as the lengths allow: with four regular corners far enough apart the result is a plain grid.

use crate::disk::{Disk, Outline, push_row};

/// Fills any outline of even perimeter at least 4. Cost: O(perimeter squared) to choose the grid.
pub(crate) fn fill(outline: &Outline) -> Disk {
    let p = outline.perimeter;
    let regular = regular_corners(outline);
    let mut is_regular = vec![false; p as usize];
    for (corner, _) in outline.corners.iter().zip(&regular).filter(|(_, r)| **r) {
        is_regular[corner.at as usize] = true;
    }
    // Inner copies in border order. The copy of a regular corner serves the vertices before and after it too.
    let near = |v: u32, step: u32| is_regular[((v + step) % p) as usize];
    let mut copy = vec![mesh::NONE; p as usize];
    let mut wants_grid_corner = Vec::new();
    for v in 0..p {
        if !near(v, 1) && !near(v, p - 1) {
            copy[v as usize] = p + wants_grid_corner.len() as u32;
            wants_grid_corner.push(near(v, 0));
        }
    }
    let inner_length = wants_grid_corner.len() as u32;
    for v in (0..p).filter(|&v| near(v, 0)) {
        for neighbour in [(v + 1) % p, (v + p - 1) % p] {
            copy[neighbour as usize] = copy[v as usize];
        }
    }
    let mut quads = Vec::new();
    for v in 0..p {
        let after = (v + 1) % p;
        if near(v, 0) {
            quads.push([(v + p - 1) % p, v, after, copy[v as usize]]);
        } else if !near(v, 1) {
            quads.push([v, after, copy[after as usize], copy[v as usize]]);
        }
    }
    let vertex_count = p + inner_length + grid(&mut quads, p, &wants_grid_corner);
    Disk { perimeter: p, vertex_count, quads }
}

/// Which corners get a single quad: as many as possible. A side of k edges has room for k - 1 of its two ends (so that
/// neighbouring shared copies stay apart), and the inner loop must keep four edges.
fn regular_corners(outline: &Outline) -> Vec<bool> {
    let (n, sides) = (outline.corners.len(), outline.sides());
    let mut regular = vec![false; n];
    // Corners joined by a side of two edges exclude each other: in a chain every other one, counted from its start, is best.
    let chain_start = (0..n).find(|&k| sides[(k + n - 1) % n] != 2).unwrap_or(0);
    let mut spare = (outline.perimeter - 4) / 2;
    for k in (0..n).map(|k| (chain_start + k) % n) {
        let (before, after) = ((k + n - 1) % n, (k + 1) % n);
        let room_before = sides[before] > 1 + u32::from(regular[before]) + u32::from(n == 1);
        let room_after = sides[k] > 1 + u32::from(regular[after]) + u32::from(n == 1);
        if spare > 0 && room_before && room_after {
            regular[k] = true;
            spare -= 1;
        }
    }
    regular
}

/// Closes the loop of the vertices `first..first + wants_corner.len()` with the grid whose corners miss the fewest wanted
/// places and hit the fewest others, the squarest among equals. Returns the number of vertices it adds.
fn grid(quads: &mut Vec<[u32; 4]>, first: u32, wants_corner: &[bool]) -> u32 {
    let length = wants_corner.len() as u32;
    let half = length / 2;
    let hits = |a: u32, offset: u32| {
        let corners = [offset, offset + a, offset + half, offset + half + a];
        corners.iter().filter(|&&c| wants_corner[(c % length) as usize]).count()
    };
    let (mut best, mut key) = ((1, 0), None);
    for a in 1..half {
        for offset in 0..half {
            let candidate = (std::cmp::Reverse(hits(a, offset)), a.abs_diff(half - a));
            if key.is_none_or(|k| candidate < k) {
                (best, key) = ((a, offset), Some(candidate));
            }
        }
    }
    let (a, offset) = best;
    let b = half - a;
    let at = |k: u32| first + (offset + k) % length;
    let mut next = first + length;
    let mut below: Vec<u32> = (0..=a).map(at).collect();
    for row in 1..=b {
        let above: Vec<u32> = (0..=a)
            .map(|column| {
                if row == b {
                    at(a + b + a - column)
                } else if column == 0 {
                    at(length - row)
                } else if column == a {
                    at(a + row)
                } else {
                    next += 1;
                    next - 1
                }
            })
            .collect();
        push_row(quads, &below, &above);
        below = above;
    }
    next - first - length
}
