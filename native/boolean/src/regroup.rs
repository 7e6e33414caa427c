//! Regrouping of the kept quads (section 3.1, Fig. 6 d): two rules that straighten the border of what is kept.

use crate::intersect::Input;
use crate::layout::Patches;
use mesh::NONE;

/// Quads that may be given up for each corner removed from the border.
const QUADS_PER_CORNER: usize = 2;

/// Shortest side of an inscribed rectangle, in quads (the authors' default).
const SHORTEST_SIDE: usize = 2;

/// Drops whole rows of quads along a side of the border while that removes corners, at most [`QUADS_PER_CORNER`] quads
/// for each corner. Not in the paper: measured, it keeps more quads with fewer corners than the rectangles.
///
/// Costs O(border) for each pass; there are as many passes as rows lie behind one another.
pub fn drop_rows(input: &Input<'_>, kept: &mut [bool]) {
    loop {
        let mut changed = false;
        for row in border_rows(input, kept) {
            // An earlier row of this pass may have taken a quad of this one.
            if row.iter().any(|&f| !kept[f as usize]) {
                continue;
            }
            let before = corners_at(input, kept, &row);
            for &f in &row {
                kept[f as usize] = false;
            }
            let after = corners_at(input, kept, &row);
            if before > after && row.len() <= QUADS_PER_CORNER * (before - after) {
                changed = true;
            } else {
                for &f in &row {
                    kept[f as usize] = true;
                }
            }
        }
        if !changed {
            return;
        }
    }
}

/// How far the border is from straight at the vertices of `faces`: the sum of |kept quads at the vertex - 2|, over
/// border vertices of valence four; other valences count against half of theirs.
fn corners_at(input: &Input<'_>, kept: &[bool], faces: &[u32]) -> usize {
    let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| input.quads.face(f as usize).iter().copied()).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
        .into_iter()
        .map(|v| {
            let (mut inside, mut all) = (0_usize, 0_usize);
            for h in input.topology.around(v) {
                all += 1;
                inside += usize::from(kept[input.topology.face[h as usize] as usize]);
            }
            if inside == 0 || inside == all { 0 } else { (2 * inside).abs_diff(all.max(4)) / 2 }
        })
        .sum()
}

/// The rows of kept quads along each side of the border, a side being a run of border edges between corners. A closed
/// border without corners has no sides.
fn border_rows(input: &Input<'_>, kept: &[bool]) -> Vec<Vec<u32>> {
    let t = &input.topology;
    let on_border = |h: u32| {
        kept[t.face[h as usize] as usize] && {
            let o = t.twin[h as usize];
            o == NONE || !kept[t.face[o as usize] as usize]
        }
    };
    // The border half-edge that follows: turn about the end vertex through kept quads.
    let next_on_border = |h: u32| {
        let mut g = t.next[h as usize];
        while !on_border(g) {
            g = t.next[t.twin[g as usize] as usize];
        }
        g
    };
    let straight = |h: u32| {
        // From h to the next border half-edge exactly one other edge is crossed: two kept quads at the vertex.
        let g = t.next[h as usize];
        !on_border(g) && on_border(t.next[t.twin[g as usize] as usize])
    };
    let mut seen = vec![false; t.len()];
    let mut rows = Vec::new();
    for start in 0..t.len() as u32 {
        if seen[start as usize] || !on_border(start) {
            continue;
        }
        let mut walk = Vec::new();
        let mut h = start;
        while !seen[h as usize] {
            seen[h as usize] = true;
            walk.push(h);
            h = next_on_border(h);
        }
        let Some(corner) = walk.iter().position(|&h| !straight(h)) else { continue };
        walk.rotate_left(corner + 1);
        let mut row: Vec<u32> = Vec::new();
        for h in walk {
            let f = t.face[h as usize];
            if row.last() != Some(&f) {
                row.push(f);
            }
            if !straight(h) {
                rows.push(std::mem::take(&mut row));
            }
        }
    }
    rows
}

/// The paper's rule: patches that lost no quad stay; in each other patch, repeatedly takes the largest inscribed
/// rectangle of kept quads (largest rectangle in a histogram, Morgan 1994, chapter 21) until what is left is too small:
/// a side below [`SHORTEST_SIDE`], or fewer quads than a quarter of the mean patch.
pub fn inscribe_rectangles(input: &Input<'_>, patches: &Patches, kept: &mut [bool]) {
    let faces = input.quads.face_count();
    let smallest = (faces / patches.grids.len().max(1) / 4).clamp(4, 16);
    for grid in &patches.grids {
        if grid.faces.iter().all(|&f| kept[f as usize]) {
            continue;
        }
        let (width, height) = (grid.width, grid.faces.len() / grid.width);
        let mut free: Vec<bool> = grid.faces.iter().map(|&f| kept[f as usize]).collect();
        for &f in &grid.faces {
            kept[f as usize] = false;
        }
        while let Some([x0, y0, x1, y1]) = largest_rectangle(&free, width, height) {
            if (x1 - x0).min(y1 - y0) < SHORTEST_SIDE || (x1 - x0) * (y1 - y0) < smallest {
                break;
            }
            for y in y0..y1 {
                for x in x0..x1 {
                    free[y * width + x] = false;
                    kept[grid.faces[y * width + x] as usize] = true;
                }
            }
        }
    }
}

/// Largest all-true rectangle `[x0, y0, x1, y1)` of a grid, whose shorter side is at least [`SHORTEST_SIDE`] where one
/// exists. O(width height) with a stack of open bars a row.
fn largest_rectangle(free: &[bool], width: usize, height: usize) -> Option<[usize; 4]> {
    let mut bar = vec![0; width + 1];
    let mut best: Option<((bool, usize), [usize; 4])> = None;
    for y in 0..height {
        for x in 0..width {
            bar[x] = if free[y * width + x] { bar[x] + 1 } else { 0 };
        }
        let mut open: Vec<(usize, usize)> = Vec::new();
        for (x, &height_here) in bar.iter().enumerate() {
            let mut left = x;
            while let Some(&(start, tall)) = open.last()
                && tall >= height_here
            {
                open.pop();
                left = start;
                let rank = ((x - start).min(tall) >= SHORTEST_SIDE, (x - start) * tall);
                if tall > 0 && best.is_none_or(|(r, _)| rank > r) {
                    best = Some((rank, [start, y + 1 - tall, x, y + 1]));
                }
            }
            open.push((left, height_here));
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

#[cfg(test)]
mod tests {
    use super::largest_rectangle;

    #[test]
    fn largest_rectangle_agrees_with_brute_force() {
        for seed in 0..200_u32 {
            let (width, height) = (5, 4);
            let free: Vec<bool> = (0..20_u32).map(|k| (seed.wrapping_mul(2_654_435_761) >> k) & 3 != 0).collect();
            let mut best = (false, 0);
            for (x0, y0) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
                for (x1, y1) in (x0 + 1..=width).flat_map(|x| (y0 + 1..=height).map(move |y| (x, y))) {
                    if (y0..y1).all(|y| (x0..x1).all(|x| free[y * width + x])) {
                        best = best.max(((x1 - x0).min(y1 - y0) >= 2, (x1 - x0) * (y1 - y0)));
                    }
                }
            }
            let found = largest_rectangle(&free, width, height)
                .map_or((false, 0), |[a, b, c, d]| ((c - a).min(d - b) >= 2, (c - a) * (d - b)));
            assert_eq!(found, best, "seed {seed}");
        }
    }
}
