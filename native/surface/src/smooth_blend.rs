//! Smoothing of the triangle surface round the intersection curve, so that the two shapes blend.
//!
//! Nuvoli et al., `QuadMixer`, 2019, section 4.2: Laplacian smoothing whose strength falls linearly with the geodesic distance to the
//! curve. Off by default in the boolean; the artist sets the radius.

use glam::DVec3;
use mesh::{Cancelled, Monitor, TriangleMesh};

/// Strength of the smoothing at each vertex from its geodesic distance to the curve: 1 on the curve, 0 at `radius` and beyond
/// (also where the distance is infinite). Both in scene units.
pub fn blend_weights(distance: &[f64], radius: f64) -> Vec<f64> {
    distance.iter().map(|&d| if radius > 0.0 { (1.0 - d / radius).clamp(0.0, 1.0) } else { 0.0 }).collect()
}

/// Moves every vertex towards the mean of its neighbours by its weight (0 to 1), `steps` times, all at once in each step.
/// A vertex of weight 0 keeps its exact coordinates. Costs O(steps * triangles).
///
/// # Errors
/// [`Cancelled`].
///
/// # Panics
/// When there are fewer weights than vertices.
pub fn laplacian_blend(
    mesh: &mut TriangleMesh,
    weight: &[f64],
    steps: usize,
    monitor: &Monitor,
) -> Result<(), Cancelled> {
    let mut edges: Vec<(u32, u32)> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    edges.sort_unstable();
    edges.dedup();
    for _ in 0..steps {
        monitor.check()?;
        let mut sum = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
        for &(a, b) in &edges {
            for (v, other) in [(a, b), (b, a)] {
                sum[v as usize].0 += mesh.positions[other as usize];
                sum[v as usize].1 += 1.0;
            }
        }
        for (v, (total, count)) in sum.into_iter().enumerate() {
            if weight[v] > 0.0 && count > 0.0 {
                let position = &mut mesh.positions[v];
                *position = position.lerp(total / count, weight[v]);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip bent by 90 degrees along the y axis, `n` cells to either side.
    fn bent_strip(n: i32) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for i in -n..=n {
            for j in 0..5 {
                let (s, y) = (f64::from(i), f64::from(j));
                mesh.positions.push(if i < 0 { DVec3::new(s, y, 0.0) } else { DVec3::new(0.0, y, s) });
            }
        }
        for i in 0..2 * n as u32 {
            for j in 0..4 {
                let a = i * 5 + j;
                mesh.triangles.extend([[a, a + 5, a + 6], [a, a + 6, a + 1]]);
            }
        }
        mesh
    }

    #[test]
    fn the_crease_is_rounded_and_nothing_outside_the_radius_moves() {
        let before = bent_strip(8);
        let distance: Vec<f64> = before.positions.iter().map(|p| p.x.abs().max(p.z.abs())).collect();
        let weight = blend_weights(&distance, 4.0);
        let mut after = before.clone();
        laplacian_blend(&mut after, &weight, 10, &Monitor::new()).unwrap();
        for (v, (p, q)) in before.positions.iter().zip(&after.positions).enumerate() {
            if distance[v] >= 4.0 {
                assert_eq!(p, q, "vertex {v} lies outside the radius");
            }
        }
        // The corner itself is cut: it moves inwards, to negative x and positive z.
        let corner = after.positions[8 * 5 + 2];
        assert!(corner.x < -0.2 && corner.z > 0.2, "{corner}");
    }

    #[test]
    fn cancelling_stops() {
        let monitor = Monitor::new();
        monitor.cancel();
        let mut mesh = bent_strip(2);
        assert_eq!(laplacian_blend(&mut mesh, &[1.0; 25], 3, &monitor), Err(Cancelled));
    }
}
