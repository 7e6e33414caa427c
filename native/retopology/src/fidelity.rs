//! How much of the features' length the quads' edges follow.

use crate::quads::Quads;
use mesh::{Cancelled, DVec3, Monitor};
use rayon::prelude::*;

/// A feature counts as followed within this part of the mean edge length, by an edge within this angle of its direction,
/// radians: 10 degrees.
const NEAR: f64 = 0.05;
const PARALLEL: f64 = std::f64::consts::PI / 18.0;
/// Features are looked at this often, in mean edge lengths, and at least twice an input edge.
const SAMPLING: f64 = 0.2;

/// Lengths of features.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Followed {
    /// All of it.
    pub length: f64,
    /// What edges follow.
    pub near: f64,
}

impl Followed {
    /// The share that edges follow; 1 without features.
    pub fn share(self) -> f64 {
        if self.length > 0.0 { self.near / self.length } else { 1.0 }
    }
}

/// How much of the chains, as edges between `positions`, the quads follow with edges of the same chain. O(samples of a chain · its
/// quads' edges).
///
/// # Errors
/// Cancelled.
pub(crate) fn followed(
    quads: &Quads,
    chains: &[Vec<[u32; 2]>],
    positions: &[DVec3],
    monitor: &Monitor,
) -> Result<Followed, Cancelled> {
    let at = |v: u32| quads.mesh.positions[v as usize];
    let mut made = vec![Vec::new(); chains.len()];
    for edge in &quads.feature_edges {
        if let Some(of_chain) = edge.chain.and_then(|chain| made.get_mut(chain as usize)) {
            let [p, q] = edge.ends.map(at);
            of_chain.push((p, q - p));
        }
    }
    let mean = mean_edge(quads);
    let cosine = PARALLEL.cos();
    let mut sum = Followed::default();
    for (chain, made) in chains.iter().zip(&made) {
        let parts: Vec<(f64, f64)> = chain
            .par_iter()
            .map(|ends| {
                monitor.check()?;
                let [a, b] = ends.map(|v| positions[v as usize]);
                let (length, tangent) = (a.distance(b), (b - a).normalize_or_zero());
                let count = ((length / (SAMPLING * mean)).ceil() as usize).max(2);
                let near = (0..count).filter(|&i| {
                    let point = a.lerp(b, (i as f64 + 0.5) / count as f64);
                    made.iter().any(|&(p, along)| {
                        let squared = along.length_squared();
                        let t = ((point - p).dot(along) / squared.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                        point.distance_squared(p + along * t) <= (NEAR * mean).powi(2)
                            && along.dot(tangent).powi(2) >= squared * cosine * cosine
                    })
                });
                Ok((length, length * near.count() as f64 / count as f64))
            })
            .collect::<Result<_, Cancelled>>()?;
        for (length, near) in parts {
            sum.length += length;
            sum.near += near;
        }
    }
    Ok(sum)
}

/// Mean length of the quads' sides.
fn mean_edge(quads: &Quads) -> f64 {
    let (mut total, mut sides) = (0.0, 0.0);
    for face in quads.mesh.faces() {
        for k in 0..face.len() {
            let [p, q] = [face[k], face[(k + 1) % face.len()]].map(|v| quads.mesh.positions[v as usize]);
            total += p.distance(q);
            sides += 1.0;
        }
    }
    total / f64::max(sides, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quads::FeatureEdge;
    use mesh::PolygonMesh;

    #[test]
    fn what_is_off_or_across_is_not_followed() {
        // A strip of two unit squares; the feature along its lower side rises after the first square, then turns.
        let points = [(0., 0.), (1., 0.), (2., 0.), (0., 1.), (1., 1.), (2., 1.)];
        let points: Vec<DVec3> = points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let mesh = PolygonMesh::from_polygons(points, [[0, 1, 4, 3], [1, 2, 5, 4]]).unwrap();
        let link = |a, b| FeatureEdge { ends: [a, b], chain: Some(0), base_edge: 0 };
        let quads = Quads { mesh, feature_edges: vec![link(0, 1), link(1, 2)], ..Quads::default() };
        let share = |line: &[(f64, f64)]| {
            let positions: Vec<DVec3> = line.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
            let chain = (1..line.len() as u32).map(|k| [k - 1, k]).collect();
            followed(&quads, &[chain], &positions, &Monitor::new()).unwrap().share()
        };
        assert_eq!(share(&[(0.0, 0.0), (2.0, 0.0)]), 1.0);
        assert_eq!(share(&[(0.0, 0.04), (1.0, 0.04), (1.0, 0.06), (2.0, 0.06)]), 1.0 / 2.02);
        // Near enough, but askew by more than 10 degrees.
        assert_eq!(share(&[(0.0, 0.0), (0.2, 0.04)]), 0.0);
        assert_eq!(share(&[]), 1.0);
    }
}
