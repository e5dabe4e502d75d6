//! Numbers near the inverse of the closure Jacobian.

use nalgebra::DMatrix;

use crate::math::interval::Interval;
use crate::math::vector::inner;
use crate::questions::certificate::chart::Entries;

/// Entries smaller than this part of the largest of their row and of their column are rounding.
const NEGLIGIBLE: f64 = 1e-14;

/// Numbers near the inverse of the closure Jacobian.
pub(super) struct Inverse {
    pub n: usize,
    /// Column by column.
    columns: Vec<f64>,
}

impl Inverse {
    /// Of a Jacobian by its entries; `None` where it is singular to working precision.
    pub fn of(n: usize, entries: &Entries<Interval>) -> Option<Self> {
        let mut matrix = DMatrix::<f64>::zeros(n, n);
        for &(row, column, value) in entries {
            matrix[(row, column)] += value.middle();
        }
        let inverse = matrix.try_inverse()?;
        if !inverse.iter().all(|c| c.is_finite()) {
            return None;
        }
        // What would be zero but for rounding is zero, so that it is left out of sums.
        let [rows, columns]: [Vec<f64>; 2] = [
            inverse.row_iter().map(|row| row.amax()).collect(),
            inverse.column_iter().map(|column| column.amax()).collect(),
        ];
        let kept = |(k, &c): (usize, &f64)| {
            if c.abs() <= NEGLIGIBLE * rows[k % n].min(columns[k / n]) { 0.0 } else { c }
        };
        Some(Self { n, columns: inverse.as_slice().iter().enumerate().map(kept).collect() })
    }

    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.columns[column * self.n + row]
    }

    pub fn times(&self, residual: &[Interval]) -> Vec<Interval> {
        let mut product = vec![Interval::ZERO; self.n];
        for (column, r) in self.columns.chunks_exact(self.n).zip(residual).filter(|(_, r)| !r.is_zero()) {
            product.iter_mut().zip(column).for_each(|(sum, c)| *sum = *sum + r.scaled(*c));
        }
        product
    }

    /// The product with a matrix of numbers, row by row, which has so many columns.
    pub fn times_rows(&self, matrix: &[f64], n_columns: usize) -> Vec<f64> {
        let mut product = vec![0.0; self.n * n_columns];
        for (r, row) in matrix.chunks_exact(n_columns.max(1)).enumerate() {
            for i in 0..self.n {
                let c = self.at(i, r);
                if c != 0.0 {
                    product[i * n_columns..(i + 1) * n_columns].iter_mut().zip(row).for_each(|(p, x)| *p += c * x);
                }
            }
        }
        product
    }

    /// The product of another square matrix, row by row, with it.
    pub fn transposed_rows(&self, matrix: &[f64]) -> Vec<f64> {
        let rows = matrix.chunks_exact(self.n);
        rows.flat_map(|row| self.columns.chunks_exact(self.n).map(move |column| inner(row, column))).collect()
    }
}
