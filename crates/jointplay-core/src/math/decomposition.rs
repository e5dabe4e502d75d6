//! Decompositions of dense matrices, in bounded time.
//!
//! The iterations of [`nalgebra`] have no end where a number is not finite, as a ratio of forces is not where there
//! are none.

use nalgebra::{DMatrix, DVector, Dyn, SVD, SymmetricEigen};

/// Iterations at most for every row or column; a singular value takes a few.
const ITERATIONS: usize = 100;
/// What is zero beside the largest singular value, in the iteration.
const SMALLEST: f64 = 5.0 * f64::EPSILON;

fn iterations(matrix: &DMatrix<f64>) -> usize {
    ITERATIONS * (matrix.nrows() + matrix.ncols())
}

fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

/// Singular values, the largest first, with the vectors that are asked for; `None` where a number is not finite, also one
/// that the iteration comes to.
pub(crate) fn singular_values(matrix: DMatrix<f64>, left: bool, right: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    let most = iterations(&matrix);
    let svd = is_finite(&matrix).then(|| SVD::try_new_unordered(matrix, left, right, SMALLEST, most))?;
    let mut svd = svd.filter(|svd| svd.singular_values.iter().all(|x| x.is_finite()))?;
    // nalgebra panics where it orders what is not a number.
    svd.sort_by_singular_values();
    Some(svd)
}

/// The pseudo-inverse, singular values below `smallest` taken for zero; `None` where a number is not finite.
pub(crate) fn pseudo_inverse(matrix: &DMatrix<f64>, smallest: f64) -> Option<DMatrix<f64>> {
    let most = iterations(matrix);
    let svd = is_finite(matrix).then(|| SVD::try_new_unordered(matrix.clone(), true, true, SMALLEST, most))?;
    svd?.pseudo_inverse(smallest).ok()
}

/// The largest eigenvalue of a symmetric matrix that is not empty, with its vector; `None` where a number is not finite.
pub(crate) fn largest_eigenpair(matrix: DMatrix<f64>) -> Option<(f64, DVector<f64>)> {
    let most = iterations(&matrix);
    let decomposed = is_finite(&matrix).then(|| SymmetricEigen::try_new(matrix, f64::EPSILON, most))?;
    decomposed.map(|d| {
        let (index, value) = d.eigenvalues.argmax();
        (value, d.eigenvectors.column(index).into_owned())
    })
}

/// The determinant of a square matrix given row by row, which is overwritten: for many small ones, each of which would be
/// memory of its own in [`nalgebra`].
pub(crate) fn determinant(n: usize, matrix: &mut [f64]) -> f64 {
    let mut product = 1.0;
    for k in 0..n {
        let size = |row: &usize| matrix[row * n + k].abs();
        let pivot = (k..n).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(k);
        if pivot != k {
            (k..n).for_each(|j| matrix.swap(k * n + j, pivot * n + j));
            product = -product;
        }
        let (done, rest) = matrix.split_at_mut((k + 1) * n);
        let row = &done[k * n..];
        product *= row[k];
        if row[k] == 0.0 {
            return 0.0;
        }
        for below in rest.chunks_exact_mut(n) {
            let factor = below[k] / row[k];
            below[k + 1..].iter_mut().zip(&row[k + 1..]).for_each(|(b, a)| *b -= factor * a);
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_has_none() {
        for x in [f64::NAN, f64::INFINITY] {
            let matrix = DMatrix::from_element(3, 3, x);
            assert!(singular_values(matrix.clone(), true, true).is_none());
            assert!(pseudo_inverse(&matrix, 1e-12).is_none());
            assert!(largest_eigenpair(matrix).is_none());
        }
    }

    #[test]
    fn they_are_those_of_nalgebra() {
        let matrix = DMatrix::from_fn(4, 7, |i, j| ((3 * i + 5 * j) as f64).sin());
        let [ours, theirs] =
            [singular_values(matrix.clone(), true, true).expect("finite"), matrix.clone().svd(true, true)];
        assert_eq!((ours.u, ours.singular_values, ours.v_t), (theirs.u, theirs.singular_values, theirs.v_t));
        assert_eq!(pseudo_inverse(&matrix, 1e-12), matrix.clone().pseudo_inverse(1e-12).ok());
        let square = &matrix * matrix.transpose();
        let largest = largest_eigenpair(square.clone()).expect("finite").0;
        assert!(largest.total_cmp(&square.symmetric_eigenvalues().max()).is_eq());
    }

    #[test]
    fn determinants_are_those_of_nalgebra() {
        for n in 0..9 {
            let entry = |i: usize, j: usize| if i + j == 2 { 0.0 } else { ((3 * i * i + 5 * j + n) as f64).sin() };
            let matrix = DMatrix::from_fn(n, n, entry);
            let ours = determinant(n, &mut matrix.transpose().as_slice().to_vec());
            assert!((ours - matrix.determinant()).abs() < 1e-14, "{n}: {ours}");
            // Twice the same row.
            let mut twice = matrix.clone();
            if n > 1 {
                twice.set_row(0, &matrix.row(n - 1));
                assert!(determinant(n, &mut twice.transpose().as_slice().to_vec()).abs() < 1e-14);
            }
        }
    }
}
