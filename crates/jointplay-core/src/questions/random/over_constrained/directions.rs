//! Directions within a section, as chains of steps add them up.

use nalgebra::DMatrix;

/// Coordinates of a direction that are summed side by side.
const RUN: usize = 8;

/// Orthonormal directions within a section, run by run of the coordinates, which are filled up with zeros.
#[derive(Clone, Debug)]
pub(crate) struct Directions {
    runs: Vec<Vec<[f64; RUN]>>,
    /// How many there are.
    pub dimensions: usize,
}

impl Directions {
    /// Of those in the columns of a matrix.
    pub fn new(columns: &DMatrix<f64>) -> Self {
        let of = |first: usize, column: usize| {
            std::array::from_fn(|k| columns.get((first + k, column)).copied().unwrap_or_default())
        };
        let dimensions = columns.ncols();
        let run = |first: usize| (0..dimensions).map(|column| of(first, column)).collect();
        Self { runs: (0..columns.nrows()).step_by(RUN).map(run).collect(), dimensions }
    }

    /// How many coordinates a sum of them has, with those that fill up the last run.
    pub fn coordinates(&self) -> usize {
        self.runs.len() * RUN
    }

    /// The sum of parts of them.
    #[inline(always)]
    pub fn combine(&self, parts: &[f64], sum: &mut [f64]) {
        for (run, sum) in self.runs.iter().zip(sum.chunks_exact_mut(RUN)) {
            let mut own = [0.0; RUN];
            for (part, column) in parts.iter().zip(run) {
                for k in 0..RUN {
                    own[k] += part * column[k];
                }
            }
            sum.copy_from_slice(&own);
        }
    }
}
