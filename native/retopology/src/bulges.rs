//! Base triangles that hide more surface than they show: a finger tip or a knob within three base edges.
//!
//! Beyond Daniels et al. 2011, whose artist puts a site on every tip. Such a triangle is a disk like any other, but no map of
//! it onto a flat triangle is any good, so its highest or farthest vertex becomes a base vertex. A horn shared by several triangles
//! adds little to the area of each; its height tells. Spot's horns had a few quads in all without that.

use crate::dual::Dual;
use crate::stars::Drawing;
use mesh::NONE;

/// Surface per area of the flat triangle with the same sides, from which a base triangle bulges.
const BULGE: f64 = 2.5;
/// Height over the flat triangle, in its longest sides, from which it does too. An arc of 100 degrees, the longest that features have
/// between base vertices, rises to 0.23 of its chord.
const HIGH: f64 = 0.3;
/// Triangles flatter than this (twice the area over the longest side squared) tell nothing.
const NEEDLE: f64 = 0.2;

/// In every base triangle that bulges the vertex highest above it, or farthest from its corners where none is high, among the
/// first `count` vertices of the drawing and off all paths; ascending. `lengths` are those of the base edges. O(n).
pub fn tips(drawing: &Drawing, dual: &Dual, peaks: &[u32], lengths: &[f64], count: usize) -> Vec<u32> {
    let mesh = &drawing.mesh;
    let faces = mesh.origin.len() / 3;
    let (mut wall, mut on_path) = (vec![false; 3 * faces], vec![false; mesh.positions.len()]);
    let mut along = Vec::with_capacity(drawing.paths.len());
    for path in &drawing.paths {
        let mut first = NONE;
        for pair in path.windows(2).rev() {
            let Some(h) = mesh.find(pair[0], pair[1]) else { continue };
            for g in [h, mesh.twin[h as usize]].into_iter().filter(|&g| g != NONE) {
                wall[g as usize] = true;
            }
            first = h;
        }
        for &v in path {
            on_path[v as usize] = true;
        }
        along.push(first);
    }
    let at = |v: u32| mesh.positions[v as usize];
    let mut seen = vec![false; faces];
    let mut found = Vec::new();
    for (corners, sides) in dual.triangles.iter().zip(&dual.sides) {
        // The triangle left of its first side.
        let h = along[sides[0] as usize];
        let path = &drawing.paths[sides[0] as usize];
        let forward = dual.ends[sides[0] as usize] == [corners[0], corners[1]];
        let runs_along = h != NONE && mesh.from(h) == path[0];
        let start = if h == NONE || forward == runs_along { h } else { mesh.twin[h as usize] };
        if start == NONE {
            continue;
        }
        let tips = corners.map(|k| at(peaks[k as usize]));
        let up = (tips[1] - tips[0]).cross(tips[2] - tips[0]).normalize_or_zero();
        let (mut area, mut farthest, mut highest) = (0.0, (0.0, NONE), (0.0, NONE));
        let mut open = vec![start / 3];
        while let Some(t) = open.pop() {
            if std::mem::replace(&mut seen[t as usize], true) {
                continue;
            }
            let [a, b, c] = [0, 1, 2].map(|k| at(mesh.origin[(3 * t + k) as usize]));
            area += (b - a).cross(c - a).length();
            for h in 3 * t..3 * t + 3 {
                let v = mesh.from(h);
                let distance = tips.iter().map(|tip| tip.distance(at(v))).fold(f64::INFINITY, f64::min);
                if (v as usize) < count && !on_path[v as usize] {
                    let height = (at(v) - tips[0]).dot(up).abs();
                    farthest = if distance > farthest.0 { (distance, v) } else { farthest };
                    highest = if height > highest.0 { (height, v) } else { highest };
                }
                if !wall[h as usize] && mesh.twin[h as usize] != NONE {
                    open.push(mesh.twin[h as usize] / 3);
                }
            }
        }
        let [a, b, c] = sides.map(|e| lengths[e as usize]);
        let half = (a + b + c) / 2.0;
        let flat = 2.0 * (half * (half - a) * (half - b) * (half - c)).max(0.0).sqrt();
        let longest = a.max(b).max(c);
        if flat <= NEEDLE * longest.powi(2) {
            continue;
        }
        let tip = if highest.0 > HIGH * longest { highest.1 } else { farthest.1 };
        if (area > BULGE * flat || highest.0 > HIGH * longest) && tip != NONE {
            found.push(tip);
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}
