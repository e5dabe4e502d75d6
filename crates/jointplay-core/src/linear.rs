//! Sparse elimination with its order found once and replayed.
//!
//! The order of the pivots is chosen on one numerical example of the matrix (Markowitz's count among
//! the entries that are large enough in their column) and recorded as a straight list of operations
//! on a fixed array of non-zeros. Replaying the list factors any matrix of the same pattern; the
//! guard on the size of the pivots tells when the recorded order does not suit the numbers.

use nalgebra::{DMatrix, DVector};

use crate::real::Real;

/// A pivot must be at least this large relative to the largest entry of its row.
const THRESHOLD: f64 = 0.05;
/// A replayed pivot smaller than this part of the planned one fails the guard.
const GUARD: f64 = 1e-3;

#[derive(Clone, Copy, Debug)]
struct Update {
    target: u32,
    lower: u32,
    upper: u32,
}

#[derive(Clone, Debug)]
struct Pivot {
    row: usize,
    column: usize,
    slot: usize,
    planned: f64,
    /// Rows below, each with the slot of its multiplier.
    lower: Vec<(usize, usize)>,
    /// Columns to the right, each with its slot.
    upper: Vec<(usize, usize)>,
    updates: Vec<Update>,
}

/// A recorded elimination of square matrices of one sparsity pattern.
#[derive(Clone, Debug)]
pub struct Elimination {
    pivots: Vec<Pivot>,
    n_slots: usize,
    /// For each non-zero of the pattern, in the order given: its slot.
    slots: Vec<usize>,
    odd: bool,
}

/// The factors of one matrix.
#[derive(Clone, Debug)]
pub struct Factors<S> {
    values: Vec<S>,
    inverse_pivots: Vec<S>,
}

impl Elimination {
    /// Plans the elimination of an `n` by `n` matrix from its non-zeros `(row, column, value)`.
    ///
    /// Returns `None` when the example itself is singular to working precision.
    #[must_use]
    pub fn plan(n: usize, entries: &[(usize, usize, f64)]) -> Option<Self> {
        const NONE: usize = usize::MAX;
        let mut slot_of = vec![NONE; n * n];
        let mut values = Vec::new();
        let mut slots = Vec::with_capacity(entries.len());
        for &(i, j, v) in entries {
            if slot_of[i * n + j] == NONE {
                slot_of[i * n + j] = values.len();
                values.push(0.0);
            }
            let slot = slot_of[i * n + j];
            values[slot] += v;
            slots.push(slot);
        }
        let largest = values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        let (mut rows, mut columns): (Vec<usize>, Vec<usize>) = ((0..n).collect(), (0..n).collect());
        let (mut row_order, mut column_order) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let mut pivots = Vec::with_capacity(n);
        while !rows.is_empty() {
            let present = |i: usize, j: usize| slot_of[i * n + j] != NONE;
            let row_count: Vec<usize> =
                rows.iter().map(|&i| columns.iter().filter(|&&j| present(i, j)).count()).collect();
            let column_count: Vec<usize> =
                columns.iter().map(|&j| rows.iter().filter(|&&i| present(i, j)).count()).collect();
            let mut best: Option<(usize, f64, usize, usize)> = None;
            for (a, &i) in rows.iter().enumerate() {
                let entry = |j: usize| if present(i, j) { values[slot_of[i * n + j]].abs() } else { 0.0 };
                let row_largest = columns.iter().map(|&j| entry(j)).fold(0.0, f64::max);
                for (b, &j) in columns.iter().enumerate() {
                    let size = entry(j);
                    if size < THRESHOLD * row_largest || size <= 1e-13 * largest {
                        continue;
                    }
                    let cost = (row_count[a] - 1) * (column_count[b] - 1);
                    if best.is_none_or(|(c, s, ..)| cost < c || (cost == c && size > s)) {
                        best = Some((cost, size, a, b));
                    }
                }
            }
            let (_, _, a, b) = best?;
            let (p, q) = (rows.remove(a), columns.remove(b));
            row_order.push(p);
            column_order.push(q);
            let slot = slot_of[p * n + q];
            let mut pivot = Pivot {
                row: p,
                column: q,
                slot,
                planned: values[slot].abs(),
                lower: Vec::new(),
                upper: columns
                    .iter()
                    .filter(|&&j| slot_of[p * n + j] != NONE)
                    .map(|&j| (j, slot_of[p * n + j]))
                    .collect(),
                updates: Vec::new(),
            };
            for &i in &rows {
                let lower = slot_of[i * n + q];
                if lower == NONE {
                    continue;
                }
                values[lower] /= values[slot];
                pivot.lower.push((i, lower));
                for &(j, upper) in &pivot.upper {
                    if slot_of[i * n + j] == NONE {
                        slot_of[i * n + j] = values.len();
                        values.push(0.0);
                    }
                    let target = slot_of[i * n + j];
                    values[target] -= values[lower] * values[upper];
                    let index = |s: usize| u32::try_from(s).ok();
                    pivot.updates.push(Update { target: index(target)?, lower: index(lower)?, upper: index(upper)? });
                }
            }
            pivots.push(pivot);
        }
        let odd = is_odd(&row_order) != is_odd(&column_order);
        Some(Self { pivots, n_slots: values.len(), slots, odd })
    }

    /// Factors a matrix given by its non-zeros in the order of the plan; `None` when a pivot shrinks
    /// too far below the planned one.
    #[must_use]
    pub fn factor(&self, entries: impl Iterator<Item = f64>) -> Option<Factors<f64>> {
        // Written so that NaN fails, too.
        self.replay(entries, |planned, pivot| pivot.abs() >= GUARD * planned)
    }

    /// Replays the elimination as long as `accept` likes the pivot beside the planned one.
    #[must_use]
    pub fn replay<S: Real>(
        &self,
        entries: impl Iterator<Item = S>,
        accept: impl Fn(f64, S) -> bool,
    ) -> Option<Factors<S>> {
        let mut values = vec![S::from_f64(0.0); self.n_slots];
        for (&slot, v) in self.slots.iter().zip(entries) {
            values[slot] = values[slot] + v;
        }
        let mut inverse_pivots = Vec::with_capacity(self.pivots.len());
        for pivot in &self.pivots {
            let size = values[pivot.slot];
            if !accept(pivot.planned, size) {
                return None;
            }
            let inverse = S::from_f64(1.0) / size;
            inverse_pivots.push(inverse);
            for &(_, lower) in &pivot.lower {
                values[lower] = values[lower] * inverse;
            }
            for u in &pivot.updates {
                let (target, lower, upper) = (u.target as usize, u.lower as usize, u.upper as usize);
                values[target] = values[target] - values[lower] * values[upper];
            }
        }
        Some(Factors { values, inverse_pivots })
    }

    /// Solves `A x = b`; overwrites `b`.
    pub fn solve<S: Real>(&self, f: &Factors<S>, b: &mut [S], x: &mut [S]) {
        for pivot in &self.pivots {
            let v = b[pivot.row];
            for &(i, lower) in &pivot.lower {
                b[i] = b[i] - f.values[lower] * v;
            }
        }
        for (pivot, inverse) in self.pivots.iter().zip(&f.inverse_pivots).rev() {
            let mut v = b[pivot.row];
            for &(j, upper) in &pivot.upper {
                v = v - f.values[upper] * x[j];
            }
            x[pivot.column] = v * *inverse;
        }
    }

    /// Solves `A^T x = b`; overwrites `b`.
    pub fn solve_transposed<S: Real>(&self, f: &Factors<S>, b: &mut [S], x: &mut [S]) {
        for (pivot, inverse) in self.pivots.iter().zip(&f.inverse_pivots) {
            let v = b[pivot.column] * *inverse;
            x[pivot.row] = v;
            for &(j, upper) in &pivot.upper {
                b[j] = b[j] - f.values[upper] * v;
            }
        }
        for pivot in self.pivots.iter().rev() {
            let mut v = x[pivot.row];
            for &(i, lower) in &pivot.lower {
                v = v - f.values[lower] * x[i];
            }
            x[pivot.row] = v;
        }
    }

    fn negative(&self, f: &Factors<f64>) -> bool {
        f.inverse_pivots.iter().filter(|p| **p < 0.0).count() % 2 == usize::from(!self.odd)
    }

    /// The product of the pivots: it vanishes and changes sign with the determinant.
    #[must_use]
    pub fn pivot_product<S: Real>(&self, f: &Factors<S>) -> S {
        self.pivots.iter().fold(S::from_f64(1.0), |product, pivot| product * f.values[pivot.slot])
    }
}

fn is_odd(permutation: &[usize]) -> bool {
    let mut seen = vec![false; permutation.len()];
    let mut odd = false;
    for start in 0..permutation.len() {
        let mut i = start;
        let mut length = 0;
        while !seen[i] {
            seen[i] = true;
            i = permutation[i];
            length += 1;
        }
        odd ^= length > 0 && length % 2 == 0;
    }
    odd
}

/// A factored closure Jacobian: by the recorded elimination, or with full pivoting where that fails.
#[derive(Clone, Debug)]
pub enum Factored<'a> {
    /// The recorded order suited the numbers.
    Recorded(&'a Elimination, Factors<f64>),
    /// Full pivoting.
    Full(Box<nalgebra::linalg::FullPivLU<f64, nalgebra::Dyn, nalgebra::Dyn>>, Box<DMatrix<f64>>),
}

impl<'a> Factored<'a> {
    /// Factors the matrix with the non-zeros `entries`; `None` when it is singular to working precision.
    #[must_use]
    pub fn new(
        plan: Option<&'a Elimination>,
        n: usize,
        pattern: &[(usize, usize)],
        entries: impl Iterator<Item = f64> + Clone,
    ) -> Option<Self> {
        if let Some(plan) = plan {
            if let Some(factors) = plan.factor(entries.clone()) {
                return Some(Self::Recorded(plan, factors));
            }
        }
        let mut matrix = DMatrix::<f64>::zeros(n, n);
        for (&(i, j), v) in pattern.iter().zip(entries) {
            matrix[(i, j)] += v;
        }
        if matrix.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let lu = matrix.clone().full_piv_lu();
        let diagonal = lu.u().diagonal();
        let (largest, smallest) = (diagonal.amax(), diagonal.amin());
        // Smaller pivots are rounding noise.
        if n > 0 && smallest <= 1e-14 * largest {
            return None;
        }
        Some(Self::Full(Box::new(lu), Box::new(matrix)))
    }

    /// Solves `A x = b`; overwrites `b`.
    pub fn solve(&self, b: &mut [f64], x: &mut [f64]) {
        match self {
            Self::Recorded(plan, f) => plan.solve(f, b, x),
            Self::Full(lu, _) => write(lu.solve(&DVector::from_column_slice(b)), x),
        }
    }

    /// Solves `A^T x = b`; overwrites `b`.
    pub fn solve_transposed(&self, b: &mut [f64], x: &mut [f64]) {
        match self {
            Self::Recorded(plan, f) => plan.solve_transposed(f, b, x),
            Self::Full(_, matrix) => write(matrix.transpose().full_piv_lu().solve(&DVector::from_column_slice(b)), x),
        }
    }

    /// Whether the determinant is negative: it tells assembly branches apart.
    #[must_use]
    pub fn negative(&self) -> bool {
        match self {
            Self::Recorded(plan, f) => plan.negative(f),
            Self::Full(lu, _) => lu.determinant() < 0.0,
        }
    }
}

fn write(solution: Option<DVector<f64>>, x: &mut [f64]) {
    match solution {
        Some(s) => x.copy_from_slice(s.as_slice()),
        None => x.fill(f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn replay_solves_matrices_of_the_same_pattern() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        for n in 1..14 {
            let mut pattern: Vec<(usize, usize)> = (0..n).map(|i| (i, (i + 3) % n)).collect();
            for i in 0..n {
                for j in 0..n {
                    if rng.random::<f64>() < 0.25 {
                        pattern.push((i, j)); // now and then a second time: entries add up
                    }
                }
            }
            let mut draw = || -> Vec<f64> { pattern.iter().map(|_| rng.random_range(-1.0..1.0)).collect() };
            let example = draw();
            let entries: Vec<_> = pattern.iter().zip(&example).map(|(&(i, j), &v)| (i, j, v)).collect();
            let Some(plan) = Elimination::plan(n, &entries) else { continue };
            for _ in 0..20 {
                let values = draw();
                let mut matrix = DMatrix::zeros(n, n);
                for (&(i, j), v) in pattern.iter().zip(&values) {
                    matrix[(i, j)] += v;
                }
                let Some(f) = Factored::new(Some(&plan), n, &pattern, values.iter().copied()) else { continue };
                assert_eq!(f.negative(), matrix.determinant() < 0.0);
                let b = DVector::from_fn(n, |i, _| f64::from(u32::try_from(i).unwrap()) - 1.5);
                let mut x = vec![0.0; n];
                f.solve(&mut b.as_slice().to_vec(), &mut x);
                let x = DVector::from_vec(x);
                // Pivots may be as small as GUARD allows, so the growth of rounding is bounded by its inverse squared.
                assert!((&matrix * &x - &b).amax() < 1e-9 * (1.0 + x.amax()));
                let mut y = vec![0.0; n];
                f.solve_transposed(&mut b.as_slice().to_vec(), &mut y);
                let y = DVector::from_vec(y);
                assert!((matrix.transpose() * &y - &b).amax() < 1e-9 * (1.0 + y.amax()));
            }
        }
    }
}
