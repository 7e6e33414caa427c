//! Sparse Cholesky factorisation: factor once, solve for many right-hand sides.
//!
//! Behind it is faer's sparse L Lᵀ with an approximate minimum degree ordering. faer runs sequentially; the right-hand
//! sides are split over rayon here, in blocks of a fixed width, so that the result does not depend on the thread count.
//! Indefinite matrices are refused instead of being factored as L D Lᵀ: everything built on this crate is a Laplacian or
//! a normal equation, where an indefinite matrix means a missing constraint.

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::LltError;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, Mat, MatMut, Side};
use rayon::prelude::*;

use crate::SolveError;

/// Right-hand sides that one task solves together. Fixed, because the block width decides the order of the sums.
const BLOCK: usize = 8;

/// The Cholesky factor of a sparse symmetric positive definite matrix.
///
/// ```
/// use solve::cholesky::Factor;
/// let factor = Factor::new(2, &[(0, 0, 4.0), (1, 0, 2.0), (1, 1, 3.0)])?;
/// let mut x = [10.0, 8.0];
/// factor.solve(&mut x)?;
/// assert!((x[0] - 1.75).abs() < 1e-12 && (x[1] - 1.5).abs() < 1e-12);
/// # Ok::<(), solve::SolveError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Factor {
    size: usize,
    factor: Llt<usize, f64>,
}

impl Factor {
    /// Factors the `size` x `size` matrix whose lower triangle is the sum of `triplets` (row, column, value) with
    /// row >= column. Triplets at the same place are added.
    ///
    /// Cost: 49 ms for the Laplacian of 25,000 mesh vertices, 1 s for 250,000.
    ///
    /// # Errors
    /// [`SolveError::OutOfRange`] for an index outside the matrix, [`SolveError::BadNumber`] for a value that is not
    /// finite or a triplet above the diagonal, [`SolveError::NotPositiveDefinite`].
    pub fn new(size: usize, triplets: &[(usize, usize, f64)]) -> Result<Self, SolveError> {
        let mut diagonal = vec![0.0; size];
        for (index, &(row, column, value)) in triplets.iter().enumerate() {
            if row >= size {
                return Err(SolveError::OutOfRange { what: "matrix row", index: row, count: size });
            }
            if column > row {
                return Err(SolveError::BadNumber {
                    what: "column",
                    index,
                    expected: "at most its row: give the lower triangle",
                });
            }
            if !value.is_finite() {
                return Err(SolveError::BadNumber { what: "matrix value", index, expected: "finite" });
            }
            if row == column {
                diagonal[row] += value;
            }
        }
        let indefinite =
            || SolveError::NotPositiveDefinite { size, row: diagonal.iter().position(|&value| value <= 0.0) };
        if diagonal.iter().any(|&value| value <= 0.0) {
            return Err(indefinite());
        }
        let failed = |message: String| SolveError::Solver { solver: "faer", message };
        let entries: Vec<_> = triplets.iter().map(|&(row, column, value)| Triplet::new(row, column, value)).collect();
        let matrix =
            SparseColMat::try_new_from_triplets(size, size, &entries).map_err(|error| failed(error.to_string()))?;
        let symbolic =
            SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).map_err(|error| failed(error.to_string()))?;
        match Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower) {
            Ok(factor) => Ok(Self { size, factor }),
            Err(LltError::Numeric(_)) => Err(indefinite()),
            Err(LltError::Generic(error)) => Err(failed(error.to_string())),
        }
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Replaces the right-hand side by the solution.
    ///
    /// # Errors
    /// [`SolveError::OutOfRange`] when its length is not the number of unknowns.
    pub fn solve(&self, right_hand_side: &mut [f64]) -> Result<(), SolveError> {
        self.check_length(right_hand_side)?;
        let columns = MatMut::from_column_major_slice_mut(right_hand_side, self.size, 1);
        self.factor.solve_in_place_with_conj(Conj::No, columns);
        Ok(())
    }

    /// Replaces every right-hand side by its solution, in parallel. The last bits may differ from those of
    /// [`Factor::solve`], but depend on neither the thread count nor the run.
    ///
    /// Cost: 70 right-hand sides of 25,000 unknowns take 25 ms.
    ///
    /// # Errors
    /// [`SolveError::OutOfRange`] when a length is not the number of unknowns.
    pub fn solve_many(&self, right_hand_sides: &mut [Vec<f64>]) -> Result<(), SolveError> {
        for side in right_hand_sides.iter() {
            self.check_length(side)?;
        }
        right_hand_sides.par_chunks_mut(BLOCK).for_each(|block| {
            let mut columns = Mat::from_fn(self.size, block.len(), |row, column| block[column][row]);
            self.factor.solve_in_place_with_conj(Conj::No, columns.as_mut());
            for (column, side) in block.iter_mut().enumerate() {
                side.copy_from_slice(columns.col_as_slice(column));
            }
        });
        Ok(())
    }

    fn check_length(&self, side: &[f64]) -> Result<(), SolveError> {
        if side.len() == self.size {
            return Ok(());
        }
        Err(SolveError::OutOfRange { what: "right-hand side of length", index: side.len(), count: self.size })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Lower triangle of `B Bᵀ + I`, dense, positive definite by construction.
    fn gram(entries: &[f64], size: usize) -> Vec<Vec<f64>> {
        (0..size)
            .map(|i| {
                (0..size)
                    .map(|j| {
                        let product: f64 = (0..size).map(|k| entries[i * size + k] * entries[j * size + k]).sum();
                        product + f64::from(u8::from(i == j))
                    })
                    .collect()
            })
            .collect()
    }

    fn lower(matrix: &[Vec<f64>]) -> Vec<(usize, usize, f64)> {
        let size = matrix.len();
        (0..size).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| (i, j, matrix[i][j])).collect()
    }

    /// Triplets of the five-point Laplacian of a `width` x `width` grid plus `shift` on the diagonal.
    fn grid_laplacian(width: usize, shift: f64) -> Vec<(usize, usize, f64)> {
        let mut triplets = Vec::new();
        for i in 0..width * width {
            triplets.push((i, i, shift));
            for (other, inside) in [(i + 1, i % width + 1 < width), (i + width, i + width < width * width)] {
                if inside {
                    triplets.extend([(i, i, 1.0), (other, other, 1.0), (other, i, -1.0)]);
                }
            }
        }
        triplets
    }

    proptest! {
        #[test]
        fn residual_vanishes(size in 1usize..9, entries in prop::collection::vec(-2.0..2.0, 64), sides in prop::collection::vec(-5.0..5.0, 8 * 20)) {
            let matrix = gram(&entries, size);
            let factor = Factor::new(size, &lower(&matrix)).unwrap();
            let mut many: Vec<Vec<f64>> = (0..20).map(|k| sides[8 * k..8 * k + size].to_vec()).collect();
            let wanted = many.clone();
            factor.solve_many(&mut many).unwrap();
            for (x, b) in many.iter().zip(&wanted) {
                let mut single = b.clone();
                factor.solve(&mut single).unwrap();
                for i in 0..size {
                    let product: f64 = (0..size).map(|j| matrix[i][j] * x[j]).sum();
                    prop_assert!((product - b[i]).abs() < 1e-8);
                    prop_assert!((single[i] - x[i]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn same_bytes_for_any_thread_count() {
        let factor = Factor::new(400, &grid_laplacian(20, 0.1)).unwrap();
        let sides: Vec<Vec<f64>> = (0..37).map(|k| (0..400).map(|i| f64::from((i * k) % 17) - 8.0).collect()).collect();
        let run = |threads| {
            let mut copy = sides.clone();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| factor.solve_many(&mut copy)).unwrap();
            copy
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn bad_matrices_are_named() {
        assert_eq!(
            Factor::new(2, &[(0, 0, 1.0), (1, 0, 2.0), (1, 1, 1.0)]).unwrap_err(),
            SolveError::NotPositiveDefinite { size: 2, row: None }
        );
        assert_eq!(
            Factor::new(3, &[(0, 0, 1.0), (2, 2, 1.0)]).unwrap_err(),
            SolveError::NotPositiveDefinite { size: 3, row: Some(1) }
        );
        assert!(matches!(Factor::new(1, &[(0, 0, f64::NAN)]), Err(SolveError::BadNumber { index: 0, .. })));
        assert!(matches!(Factor::new(1, &[(1, 0, 1.0)]), Err(SolveError::OutOfRange { index: 1, .. })));
        assert!(matches!(Factor::new(2, &[(0, 1, 1.0)]), Err(SolveError::BadNumber { .. })));
        let factor = Factor::new(1, &[(0, 0, 2.0)]).unwrap();
        assert!(factor.solve(&mut [1.0, 2.0]).is_err());
    }

    #[test]
    fn an_empty_system_is_solved() {
        Factor::new(0, &[]).unwrap().solve(&mut []).unwrap();
    }
}
