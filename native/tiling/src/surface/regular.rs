//! Meshes of equilateral triangles and squares that have no surface to keep to (section 5.1): polyhedra and foldings.
//!
//! First by the nearest regular polygons, the Euclidean regularity of 4.2.4: it finds the shape from afar, but comes near
//! to regularity slowly. Then by Newton's method on the lengths of all edges and diagonals, which are those of regular
//! polygons when all panels are: quadratic, and so exact to the last digits wherever a regular mesh is near. Deviation: the
//! paper has the first step only, and reduces the freedom of foldings with a cylinder as reference surface.

use super::SurfaceError;
use mesh::{DVec3, Monitor, PolygonMesh};
use solve::SolveError;
use solve::cholesky::Factor;
use std::collections::BTreeSet;
use std::f64::consts::{PI, SQRT_2, TAU};

/// Weight of a vertex's last place while the mesh is shaped: what keeps it from drifting.
const RESTING: f64 = 0.02;

/// Edges and diagonals that differ from their length by less than this, in edges, make a regular mesh.
pub(super) const REGULAR: f64 = 1e-6;

/// Steps of Newton's method, and how near they come, in edges. Sheets that bend freely have many solutions near one another,
/// and then the error only halves with each step.
const STEPS: usize = 300;
const NEAR: f64 = 1e-12;

/// A step that lowers the squared error by less than this part of it is the last: there is no regular mesh near.
const LEAST_GAIN: f64 = 1e-4;

/// Damping of the steps: at first, at most, and how it falls and rises.
const DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e6;
const FALL: f64 = 0.2;
const RISE: f64 = 5.0;

/// Makes the tiles regular as far as their combinatorics allow, edges as long as they are in the mean; the greatest departure
/// of an edge from the mean and of a square's diagonal from sqrt 2 that is left, in edges.
///
/// `rounds` of nearest polygons come first; Newton's result is taken when it is regular, or nearer to it. Costs one
/// factorisation, and one for each step of Newton.
pub(super) fn regularise(
    tiles: &[Vec<u32>],
    positions: &mut [DVec3],
    rounds: usize,
    monitor: &Monitor,
) -> Result<f64, SurfaceError> {
    if rounds == 0 {
        return Ok(irregularity(tiles, positions));
    }
    let mut triplets: Vec<(usize, usize, f64)> = (0..positions.len()).map(|v| (v, v, RESTING)).collect();
    for tile in tiles {
        let n = tile.len() as f64;
        for &a in tile {
            for &b in tile.iter().filter(|&&b| b <= a) {
                triplets.push((a as usize, b as usize, if a == b { 1.0 - 1.0 / n } else { -1.0 / n }));
            }
        }
    }
    let factor = Factor::new(positions.len(), &triplets)?;
    for round in 0..rounds {
        monitor.stage("shaping", 0.7 * round as f64 / rounds as f64)?;
        let edge = mean_edge(tiles, positions);
        let mut right: Vec<DVec3> = positions.iter().map(|&p| RESTING * p).collect();
        for tile in tiles {
            for (&v, q) in tile.iter().zip(nearest_regular(tile, positions, edge, None)) {
                right[v as usize] += q;
            }
        }
        let mut sides: Vec<Vec<f64>> = (0..3).map(|axis| right.iter().map(|p| p[axis]).collect()).collect();
        factor.solve_many(&mut sides)?;
        for (v, p) in positions.iter_mut().enumerate() {
            *p = DVec3::new(sides[0][v], sides[1][v], sides[2][v]);
        }
    }
    let rounded = irregularity(tiles, positions);
    let mut refined = positions.to_vec();
    refine(tiles, &mut refined, monitor)?;
    let left = irregularity(tiles, &refined);
    if left < rounded {
        positions.copy_from_slice(&refined);
    }
    Ok(left.min(rounded))
}

/// Distances that are to have a length, in edges: edges, and the diagonals of squares.
fn distances(tiles: &[Vec<u32>]) -> Vec<([u32; 2], f64)> {
    let mut edges = BTreeSet::new();
    let mut diagonals = Vec::new();
    for tile in tiles {
        for k in 0..tile.len() {
            edges.insert(mesh::sorted(tile[k], tile[(k + 1) % tile.len()]));
        }
        if tile.len() == 4 {
            diagonals.extend([([tile[0], tile[2]], SQRT_2), ([tile[1], tile[3]], SQRT_2)]);
        }
    }
    edges.into_iter().map(|edge| (edge, 1.0)).chain(diagonals).collect()
}

/// The greatest departure of an edge from the mean edge and of a diagonal from sqrt 2, in edges.
pub(super) fn irregularity(tiles: &[Vec<u32>], positions: &[DVec3]) -> f64 {
    let edge = mean_edge(tiles, positions);
    let off = |(ends, length): ([u32; 2], f64)| {
        let [p, q] = ends.map(|v| positions[v as usize]);
        (p.distance(q) / edge - length).abs()
    };
    if edge > 0.0 { distances(tiles).into_iter().map(off).fold(0.0, f64::max) } else { f64::INFINITY }
}

/// Newton's method on the squared distances, damped (Levenberg and Marquardt): there are more places than lengths or fewer,
/// and the least step is wanted.
fn refine(tiles: &[Vec<u32>], positions: &mut [DVec3], monitor: &Monitor) -> Result<(), SurfaceError> {
    let edge = mean_edge(tiles, positions);
    if !(edge.is_finite() && edge > 0.0) {
        return Ok(());
    }
    let wanted = distances(tiles);
    let mut now: Vec<DVec3> = positions.iter().map(|&p| p / edge).collect();
    let error = |at: &[DVec3]| -> Vec<f64> {
        let of = |(ends, length): &([u32; 2], f64)| {
            let [p, q] = ends.map(|v| at[v as usize]);
            0.5 * (p.distance_squared(q) - length * length)
        };
        wanted.iter().map(of).collect()
    };
    let square = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
    let mut errors = error(&now);
    let mut damping = DAMPING;
    for step in 0..STEPS {
        monitor.stage("shaping", 0.7 + 0.3 * step as f64 / STEPS as f64)?;
        if errors.iter().all(|e| e.abs() < NEAR) || damping > MOST_DAMPING {
            break;
        }
        // No less than the squared error, so that the matrix is sound where many solutions are near one another.
        let diagonal = damping.max(square(&errors));
        let mut triplets: Vec<(usize, usize, f64)> = (0..3 * now.len()).map(|i| (i, i, diagonal)).collect();
        let mut right = vec![0.0; 3 * now.len()];
        for ((ends, _), e) in wanted.iter().zip(&errors) {
            let [a, b] = ends.map(|v| v as usize);
            let along = now[a] - now[b];
            for i in 0..3 {
                right[3 * a + i] -= e * along[i];
                right[3 * b + i] += e * along[i];
                for j in 0..3 {
                    let product = along[i] * along[j];
                    if i >= j {
                        triplets.extend([(3 * a + i, 3 * a + j, product), (3 * b + i, 3 * b + j, product)]);
                    }
                    let (low, high) = (a.min(b), a.max(b));
                    triplets.push((3 * high + i, 3 * low + j, -product));
                }
            }
        }
        match Factor::new(right.len(), &triplets) {
            Ok(factor) => factor.solve(&mut right)?,
            Err(SolveError::NotPositiveDefinite { .. }) => {
                damping *= RISE;
                continue;
            }
            Err(error) => return Err(error.into()),
        }
        let moved: Vec<DVec3> = now.iter().zip(right.chunks_exact(3)).map(|(&p, d)| p + DVec3::from_slice(d)).collect();
        let after = error(&moved);
        if square(&after) < square(&errors) {
            let is_last = damping <= DAMPING && square(&after) > (1.0 - LEAST_GAIN) * square(&errors);
            (now, errors) = (moved, after);
            if is_last {
                break;
            }
            damping *= FALL;
        } else {
            damping *= RISE;
        }
    }
    for (p, q) in positions.iter_mut().zip(now) {
        *p = edge * q;
    }
    Ok(())
}

/// The mean of the edges' lengths; inner edges count twice.
pub(super) fn mean_edge(tiles: &[Vec<u32>], positions: &[DVec3]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for tile in tiles {
        for k in 0..tile.len() {
            let ends = [tile[k], tile[(k + 1) % tile.len()]].map(|v| positions[v as usize]);
            sum += ends[0].distance(ends[1]);
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Corners, relative to their centre, of the regular polygon with this edge that is nearest to a tile.
///
/// With A and B the sums of the corners times cosine and sine of their place on the circle, the best plane directions are
/// the orthonormal pair nearest to (A, B): its polar factor.
/// For a tile that is turned over, `up` says where it ought to face; the nearest polygon is then sought in that plane.
pub(super) fn nearest_regular(tile: &[u32], positions: &[DVec3], edge: f64, up: Option<DVec3>) -> Vec<DVec3> {
    let n = tile.len() as f64;
    let turn = |k: usize| TAU * k as f64 / n;
    let (mut a, mut b) = (DVec3::ZERO, DVec3::ZERO);
    for (k, &v) in tile.iter().enumerate() {
        a += turn(k).cos() * positions[v as usize];
        b += turn(k).sin() * positions[v as usize];
    }
    let radius = edge / (2.0 * (PI / n).sin());
    let polygon =
        |u: DVec3, w: DVec3| (0..tile.len()).map(|k| radius * (turn(k).cos() * u + turn(k).sin() * w)).collect();
    if let Some(up) = up {
        let along = a + b.cross(up);
        let u = (along - along.dot(up) * up).try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
        return polygon(u, up.cross(u));
    }
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    // The inverse square root of [[aa, ab], [ab, bb]], by its closed form.
    let root = (aa * bb - ab * ab).max(0.0).sqrt();
    let trace = (aa + bb + 2.0 * root).sqrt();
    if root <= 1e-12 * (aa + bb) {
        let centre = tile.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / n;
        return tile.iter().map(|&v| positions[v as usize] - centre).collect();
    }
    let scale = 1.0 / (root * trace);
    let u = scale * ((bb + root) * a - ab * b);
    let w = scale * ((aa + root) * b - ab * a);
    polygon(u, w)
}

/// The faces of a mesh, as tiles.
pub(super) fn tiles_of(mesh: &PolygonMesh) -> Vec<Vec<u32>> {
    mesh.faces().map(<[u32]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube's faces about eight places that are off it.
    #[test]
    fn a_crooked_cube_becomes_one() {
        let tiles: Vec<Vec<u32>> = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(Vec::from)
            .to_vec();
        let mut positions: Vec<DVec3> = (0..8u32)
            .map(|k| {
                let p = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
                2.0 * p + 0.3 * DVec3::new((f64::from(k) * 1.7).sin(), (f64::from(k) * 2.9).cos(), (f64::from(k)).sin())
            })
            .collect();
        assert!(irregularity(&tiles, &positions) > 0.1);
        let left = regularise(&tiles, &mut positions, 30, &Monitor::new()).expect("not cancelled");
        assert!(left < 1e-9 && irregularity(&tiles, &positions) < 1e-9, "off by {left} edges");
        // The distances of a cube, by Pythagoras: sqrt 3 edges from corner to corner.
        let edge = positions[0].distance(positions[1]);
        assert!((positions[0].distance(positions[7]) / edge - 3f64.sqrt()).abs() < 1e-9);
    }
}
