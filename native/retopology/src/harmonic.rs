//! One harmonic field for display: Daniels et al. 2011, section 4.1, equation 2, on the surface as it is given.
//!
//! [`crate::fields`] has those that make the base triangulation, on a refined surface and with a hat for each base vertex; this is
//! the paper's own: 1 all along a feature, 0 on all others.

use crate::base_error::RetopologyError;
use mesh::{Monitor, NONE, Topology, TriangleMesh};
use solve::cholesky::Factor;
use solve::components::connected_components;
use surface::laplacian::cotangent_weights;

/// The harmonic function with these values where there are any; 0 on parts of the surface without one. One factorisation.
///
/// # Errors
/// Cancelled, or the solver's.
pub(crate) fn harmonic(
    mesh: &TriangleMesh,
    topology: &Topology,
    values: &[Option<f64>],
    monitor: &Monitor,
) -> Result<Vec<f64>, RetopologyError> {
    let weights = cotangent_weights(mesh, topology, &vec![false; topology.len()], monitor)?;
    let mut field: Vec<f64> = values.iter().map(|value| value.unwrap_or(0.0)).collect();
    let mut unknown = vec![NONE; values.len()];
    let mut count = 0;
    for part in connected_components(values.len(), weights.iter().map(|&(a, b, _)| (a, b))) {
        if part.iter().any(|&v| values[v as usize].is_some()) {
            for v in part.into_iter().filter(|&v| values[v as usize].is_none()) {
                unknown[v as usize] = count;
                count += 1;
            }
        }
    }
    let (mut triplets, mut side) = (Vec::with_capacity(3 * weights.len()), vec![0.0; count as usize]);
    for &(a, b, weight) in &weights {
        let (i, j) = (unknown[a as usize], unknown[b as usize]);
        for (i, j, other) in [(i, j, b), (j, i, a)].into_iter().filter(|way| way.0 != NONE) {
            triplets.push((i as usize, i as usize, weight));
            if j == NONE {
                side[i as usize] += weight * field[other as usize];
            } else if i > j {
                triplets.push((i as usize, j as usize, -weight));
            }
        }
    }
    monitor.check()?;
    Factor::new(count as usize, &triplets)?.solve(&mut side)?;
    for (value, &k) in field.iter_mut().zip(&unknown).filter(|(_, k)| **k != NONE) {
        *value = side[k as usize];
    }
    Ok(field)
}
