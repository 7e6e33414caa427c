//! The smallest generalised eigenvector of a sparse symmetric matrix, by inverse iteration, and the greatest ones of a
//! small dense matrix.
//!
//! The first is used for cross fields without constraints: the smoothest field is the smallest eigenvector of the connection
//! Laplacian (Knöppel, Crane, Pinkall and Schröder, "Globally optimal direction fields", 2013, section 5), written with
//! 2 x 2 real blocks. Its eigenvalues then come in equal pairs; the iteration converges to the one vector of that plane
//! which the start vector projects to, so the result is still a function of the input alone.

use crate::SolveError;
use crate::cholesky::Factor;
use faer::{Mat, Side};

/// Added to the matrix as this multiple of trace(A) / trace(M) times M, so that a semidefinite matrix factors.
/// Eigenvectors stay; the shift is taken off the eigenvalue again.
const SHIFT: f64 = 1e-9;

/// An approximate eigenpair of A x = value M x.
#[derive(Debug, Clone)]
pub struct Eigenpair {
    /// The vector x, scaled to xᵀ M x = 1.
    pub vector: Vec<f64>,
    /// The Rayleigh quotient xᵀ A x.
    pub value: f64,
    /// Length of M⁻¹ A x - value x in the norm of M: how far x is from an eigenvector, in units of `value`.
    pub residual: f64,
}

/// The eigenvector of A x = value M x with the smallest eigenvalue. A is symmetric positive semidefinite and given by
/// the `lower` triangle as for [`Factor::new`]; M is diagonal and positive.
///
/// Runs exactly `iterations` solves from a fixed start vector: no test of convergence, so that equal input gives equal
/// bytes. The error falls by (smallest eigenvalue / next larger one) each time; 20 to 40 iterations do for cross fields.
/// Read `residual` when it matters. Cost: one factorisation and `iterations` solves.
///
/// # Errors
/// [`SolveError::BadNumber`] for a mass that is not positive, [`SolveError::OutOfRange`] for an empty problem, and those
/// of [`Factor::new`].
pub fn smallest_eigenvector(
    lower: &[(usize, usize, f64)],
    mass: &[f64],
    iterations: u32,
) -> Result<Eigenpair, SolveError> {
    let size = mass.len();
    if size == 0 {
        return Err(SolveError::OutOfRange { what: "eigenvector", index: 0, count: 0 });
    }
    if let Some(index) = mass.iter().position(|&value| !(value.is_finite() && value > 0.0)) {
        return Err(SolveError::BadNumber { what: "mass", index, expected: "finite and positive" });
    }
    let trace: f64 = lower.iter().filter(|entry| entry.0 == entry.1).map(|entry| entry.2).sum();
    let total_mass: f64 = mass.iter().sum();
    let shift = if trace > 0.0 { SHIFT * trace / total_mass } else { 1.0 };
    let mut shifted = lower.to_vec();
    shifted.extend(mass.iter().enumerate().map(|(i, &value)| (i, i, shift * value)));
    let factor = Factor::new(size, &shifted)?;

    let mut vector: Vec<f64> = (0..size).map(scatter).collect();
    normalize(&mut vector, mass);
    for _ in 0..iterations {
        for (value, &weight) in vector.iter_mut().zip(mass) {
            *value *= weight;
        }
        factor.solve(&mut vector)?;
        normalize(&mut vector, mass);
    }

    let mut image = vec![0.0; size];
    for &(row, column, value) in lower {
        image[row] += value * vector[column];
        if row != column {
            image[column] += value * vector[row];
        }
    }
    let value: f64 = vector.iter().zip(&image).map(|(x, y)| x * y).sum();
    let squared: f64 = (0..size).map(|i| mass[i] * (image[i] / mass[i] - value * vector[i]).powi(2)).sum();
    Ok(Eigenpair { vector, value, residual: squared.sqrt() })
}

/// Scales to xᵀ M x = 1.
fn normalize(vector: &mut [f64], mass: &[f64]) {
    let squared: f64 = vector.iter().zip(mass).map(|(value, weight)| weight * value * value).sum();
    let scale = squared.sqrt().recip();
    for value in vector {
        *value *= scale;
    }
}

/// A fixed pseudo-random number in (-1, 1) for each index (the splitmix64 finaliser): no symmetric mesh makes the
/// start vector orthogonal to the eigenvector, as constant or periodic ones would be.
fn scatter(index: usize) -> f64 {
    let mut bits = (index as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The eigenvectors of the `count` greatest eigenvalues of a dense symmetric matrix, greatest first, each with its
/// eigenvalue and of unit length. The entry at (row, column) is `entry(row, column)`, asked of the lower triangle only.
///
/// Cost: cubic; 100 rows take 5 ms.
///
/// # Errors
/// [`SolveError::OutOfRange`] when `count` exceeds `size`, [`SolveError::BadNumber`] for an entry that is not finite.
pub fn greatest_eigenvectors(
    size: usize,
    entry: impl Fn(usize, usize) -> f64,
    count: usize,
) -> Result<Vec<(f64, Vec<f64>)>, SolveError> {
    if count > size {
        return Err(SolveError::OutOfRange { what: "eigenvector", index: count, count: size });
    }
    let matrix = Mat::from_fn(size, size, |row, column| entry(row.max(column), row.min(column)));
    let bad = SolveError::BadNumber { what: "entry", index: 0, expected: "finite" };
    if let Some(index) = (0..size * size).find(|&k| !matrix[(k / size, k % size)].is_finite()) {
        return Err(SolveError::BadNumber { what: "entry", index, expected: "finite" });
    }
    let decomposed = matrix.self_adjoint_eigen(Side::Lower).map_err(|_| bad)?;
    let (values, vectors) = (decomposed.S().column_vector(), decomposed.U());
    // Ascending.
    Ok((0..count)
        .map(|k| size - 1 - k)
        .map(|column| (values[column], (0..size).map(|row| vectors[(row, column)]).collect()))
        .collect())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// A path with both ends pinned has the eigenvalues 2 - 2 cos(k pi / (n + 1)).
    #[test]
    fn pinned_path_gives_the_sine() {
        let size = 30;
        let mut lower: Vec<_> = (0..size).map(|i| (i, i, 2.0)).collect();
        lower.extend((1..size).map(|i| (i, i - 1, -1.0)));
        let pair = smallest_eigenvector(&lower, &vec![1.0; size], 30).unwrap();
        assert!((pair.value - (2.0 - 2.0 * (PI / 31.0).cos())).abs() < 1e-12, "{}", pair.value);
        assert!(pair.residual < 1e-9);
        let scale = (2.0 / 31.0_f64).sqrt() * pair.vector[0].signum();
        for (i, &value) in pair.vector.iter().enumerate() {
            assert!((value - scale * (PI * (i + 1) as f64 / 31.0).sin()).abs() < 1e-9);
        }
    }

    /// A free path is singular: the constant vector is its kernel, whatever the masses.
    #[test]
    fn singular_matrix_gives_its_kernel() {
        let mut lower = vec![(0, 0, 1.0), (1, 1, 2.0), (2, 2, 1.0)];
        lower.extend([(1, 0, -1.0), (2, 1, -1.0)]);
        let pair = smallest_eigenvector(&lower, &[1.0, 2.0, 5.0], 10).unwrap();
        assert!(pair.value.abs() < 1e-12);
        assert!(pair.vector.iter().all(|&value| (value - pair.vector[0]).abs() < 1e-9));
        let norm: f64 = [1.0, 2.0, 5.0].iter().zip(&pair.vector).map(|(m, x)| m * x * x).sum();
        assert!((norm - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bad_masses_are_named() {
        assert!(matches!(smallest_eigenvector(&[(0, 0, 1.0)], &[0.0], 5), Err(SolveError::BadNumber { index: 0, .. })));
        assert!(smallest_eigenvector(&[], &[], 5).is_err());
    }

    #[test]
    fn the_greatest_eigenvectors_of_a_small_matrix() {
        // Eigenvalues 3 and 1 on (1, 1) and (1, -1), and 2.
        let matrix = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
        let found = greatest_eigenvectors(3, |row, column| matrix[row][column], 2).expect("finite");
        assert!((found[0].0 - 3.0).abs() < 1e-12 && (found[1].0 - 2.0).abs() < 1e-12);
        assert!((found[0].1[0] - found[0].1[1]).abs() < 1e-12 && found[1].1[2].abs() > 1.0 - 1e-12);
        assert!(
            greatest_eigenvectors(1, |_, _| f64::NAN, 1).is_err() && greatest_eigenvectors(1, |_, _| 1.0, 2).is_err()
        );
    }
}
