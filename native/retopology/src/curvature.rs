//! How long edges may be for the surface to be kept: section 5's even sampling, bounded by curvature.
//!
//! Not in the paper, which samples alike everywhere. An edge of length l on curvature k leaves the surface by k l² / 8, so
//! that fingertips and fillets need shorter edges than the flats beside them. The number of quads stays as asked: the edge
//! length elsewhere grows until the areas add up.

use crate::base::Base;
use crate::density::{CHORD_ERROR, SHORTEST, Size};
use crate::division::parts;
use crate::measures::Measures;
use crate::quads::LEAST_CHORD_ERROR;
use mesh::Topology;

/// Curvature never makes edges shorter than this fraction of the length elsewhere: their rows would run on over the flats. What
/// is painted outranks it: with a contrast of c the fraction is the c-th root of this.
const LEAST_SIZE: f64 = 0.4;
/// How fast the relative edge length may grow, per edge length of way.
const GROWTH: f64 = 0.25;
/// Rounds of averaging, which take out the noise of scans.
const AVERAGING: usize = 3;
/// Halvings of the twelve decades that edge lengths are looked for in: to a billionth.
const BISECTIONS: usize = 35;
const GROWING_SWEEPS: usize = 60;

/// Lowers the relative edge lengths at the vertices of the surface where it is bent, so that edges stay within `error`, scene
/// units, or [`LEAST_CHORD_ERROR`] of it; and on features that bend, to the chords that follow them. `plain` has the edge length wanted
/// at each vertex otherwise, scene units. O(surface triangles).
pub(crate) fn bound(base: &Base, measures: &Measures, error: f64, plain: &[f64], wanted: Size, size: &mut [f64]) {
    let cap = |(k, plain): (f64, &f64)| (8.0 * error.max(LEAST_CHORD_ERROR * plain) / k.max(f64::MIN_POSITIVE)).sqrt();
    let mut caps: Vec<f64> = bend(base, measures).into_iter().zip(plain).map(cap).collect();
    for (edge, _) in base.edges.iter().zip(&measures.rails).filter(|(_, rail)| **rail) {
        let points: Vec<_> = edge.path.iter().map(|&v| base.surface.positions[v as usize]).collect();
        let edge_length = mean_along(&edge.path, plain);
        let ends = parts(&points, CHORD_ERROR * edge_length, SHORTEST * edge_length);
        // The last chord ends with the edge, not for a bend.
        let mut from = 0;
        for &to in &ends[..ends.len() - 1] {
            let chord = points[from].distance(points[to]);
            for &v in &edge.path[from..=to] {
                caps[v as usize] = caps[v as usize].min(chord);
            }
            from = to;
        }
    }
    let [least, most] = [f64::min, f64::max].map(|pick| size.iter().copied().reduce(pick).unwrap_or(1.0));
    let least_size = LEAST_SIZE.powf(least / most);
    let bounds = |h: f64| -> Vec<f64> {
        size.iter().zip(&caps).map(|(size, cap)| size.min((cap / h).max(least_size * size))).collect()
    };
    let triangles = &base.surface.triangles;
    let areas: Vec<f64> = (0..triangles.len()).map(|t| base.surface.area_normal(t).length() / 2.0).collect();
    let quads = |h: f64| -> f64 {
        let bounds = bounds(h);
        let mean = |t: &[u32; 3]| t.iter().map(|&v| bounds[v as usize]).sum::<f64>() / 3.0 * h;
        triangles.iter().zip(&areas).map(|(t, area)| area / mean(t).powi(2)).sum()
    };
    let h = match wanted {
        Size::EdgeLength(h) => h,
        Size::TargetFaces(faces) => {
            let h = quads(1.0).max(f64::MIN_POSITIVE).sqrt();
            let (mut fine, mut coarse) = (h * 1e-6, h * 1e6);
            for _ in 0..BISECTIONS {
                let middle = (fine * coarse).sqrt();
                if quads(middle) > faces as f64 { fine = middle } else { coarse = middle }
            }
            coarse
        }
    };
    let mut lower = bounds(h);
    // Rows of quads cannot end at once: sizes grow slowly away from what is bent.
    let at = |v: u32| base.surface.positions[v as usize];
    let ways: Vec<[f64; 3]> = triangles
        .iter()
        .map(|&[a, b, c]| [(a, b), (b, c), (c, a)].map(|(v, w)| GROWTH * at(v).distance(at(w)) / h))
        .collect();
    let sides = |t: usize| {
        let ([a, b, c], [ab, bc, ca]) = (triangles[t], ways[t]);
        [(a, b, ab), (b, c, bc), (c, a, ca), (b, a, ab), (c, b, bc), (a, c, ca)]
    };
    for sweep in 0..GROWING_SWEEPS {
        let mut changed = false;
        for t in 0..triangles.len() {
            // There and back, so that no direction takes a sweep for each triangle.
            let t = if sweep % 2 == 0 { t } else { triangles.len() - 1 - t };
            for (v, w, way) in sides(t) {
                let most = lower[v as usize] + way;
                if lower[w as usize] > most * (1.0 + 1e-9) {
                    lower[w as usize] = most;
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
    size.copy_from_slice(&lower);
}

/// Mean of the values at the vertices of a path.
pub(crate) fn mean_along(path: &[u32], values: &[f64]) -> f64 {
    path.iter().map(|&v| values[v as usize]).sum::<f64>() / path.len() as f64
}

/// Twice the mean curvature at each vertex of the surface, absolute, 1 / scene units: signed dihedral angles times edge lengths
/// over area, features left out, averaged over neighbours.
fn bend(base: &Base, measures: &Measures) -> Vec<f64> {
    let surface = &base.surface;
    let topology = Topology::of_triangles(surface);
    let mut on_rail = vec![false; topology.len()];
    for (edge, _) in base.edges.iter().zip(&measures.rails).filter(|(_, rail)| **rail) {
        for pair in edge.path.windows(2) {
            let sides = [topology.find(pair[0], pair[1]), topology.find(pair[1], pair[0])];
            sides.into_iter().flatten().for_each(|h| on_rail[h as usize] = true);
        }
    }
    let normals: Vec<mesh::DVec3> = (0..surface.triangles.len()).map(|t| surface.area_normal(t)).collect();
    let mut area = vec![0.0; surface.positions.len()];
    let mut turn = vec![0.0; surface.positions.len()];
    for (t, normal) in surface.triangles.iter().zip(&normals) {
        let third = normal.length() / 6.0;
        for &v in t {
            area[v as usize] += third;
        }
    }
    for h in topology.edges().filter(|&h| topology.twin[h as usize] != mesh::NONE) {
        let (v, w) = (topology.from(h), topology.to(h));
        if on_rail[h as usize] {
            continue;
        }
        let [a, b] = [h, topology.twin[h as usize]].map(|h| normals[h as usize / 3].normalize_or_zero());
        let side = surface.positions[w as usize] - surface.positions[v as usize];
        let angle = a.cross(b).dot(side.normalize_or_zero()).atan2(a.dot(b));
        for v in [v, w] {
            turn[v as usize] += angle * side.length() / 2.0;
        }
    }
    for _ in 0..AVERAGING {
        let (mut areas, mut turns) = (area.clone(), turn.clone());
        for t in &surface.triangles {
            for k in 0..3 {
                let (v, w) = (t[k] as usize, t[(k + 1) % 3] as usize);
                // An inner edge is seen from both sides, so that each end gives half of itself in all.
                for (v, w) in [(v, w), (w, v)] {
                    areas[v] += 0.25 * area[w];
                    turns[v] += 0.25 * turn[w];
                }
            }
        }
        (area, turn) = (areas, turns);
    }
    turn.iter().zip(&area).map(|(t, a)| if *a > 0.0 { (t / a).abs() } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bases::base;
    use mesh::DVec3;
    use testkit::shapes;

    #[test]
    fn a_ball_bends_by_two_over_its_radius_and_a_plane_not() {
        for radius in [1.0, 3.0] {
            let ball = base(&shapes::cuboid(DVec3::splat(2.0), 2), 12, 4.0, &|p| p.normalize() * radius);
            let measures = Measures::new(&ball).unwrap();
            let found = bend(&ball, &measures);
            assert!(found.iter().all(|k| (k * radius / 2.0 - 1.0).abs() < 0.25), "{found:?}");
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            assert!((mean * radius / 2.0 - 1.0).abs() < 0.05, "{mean}");
        }
        let sheet = base(&shapes::sheet(3, 2), 4, 4.0, &|p| p);
        assert!(bend(&sheet, &Measures::new(&sheet).unwrap()).iter().all(|k| *k < 1e-9));
    }

    #[test]
    fn bent_parts_get_shorter_edges_and_the_rest_makes_up_for_them() {
        // A sheet with a narrow ridge.
        let ridge = base(&shapes::sheet(8, 2), 8, 4.0, &|p| p + DVec3::Z * (0.4 * (-p.x * p.x * 8.0).exp()));
        let measures = Measures::new(&ridge).unwrap();
        let mut size = vec![1.0; ridge.surface.positions.len()];
        bound(&ridge, &measures, 0.002, &vec![0.01; size.len()], Size::TargetFaces(400), &mut size);
        let at = |x: f64| {
            let near = ridge.surface.positions.iter().zip(&size).filter(|(p, _)| (p.x - x).abs() < 0.1);
            near.map(|(_, s)| *s).fold(f64::INFINITY, f64::min)
        };
        assert!(at(0.0) < 0.7 && (at(3.5) - 1.0).abs() < 1e-9, "{} {}", at(0.0), at(3.5));
    }
}
