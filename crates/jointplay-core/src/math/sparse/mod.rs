//! Sparse elimination with its order found once and replayed.
//!
//! The matrix is put in block triangular order, and only its diagonal blocks are eliminated: what one loop
//! of a chain of loops does is known before the next one. The order of the pivots is chosen on one numerical
//! example of the matrix (Markowitz's count among the entries that are large enough in their row) and recorded
//! as a straight list of operations on a fixed array of non-zeros. Replaying the list factors any matrix of the
//! same pattern; the guard on the size of the pivots tells when the recorded order does not suit the numbers.

mod active;
mod blocks;

use std::borrow::Cow;
use std::ops::Range;

use crate::math::real::Real;
use crate::math::sparse::active::{Active, Pivot};
use crate::math::sparse::blocks::diagonal_blocks;

/// Pivots whose product stays in the range of numbers.
const IN_RANGE: usize = 16;
/// A replayed pivot smaller than this part of the planned one fails the guard.
const GUARD: f64 = 1e-3;

/// A diagonal block.
#[derive(Clone, Debug)]
struct Block {
    pivots: Range<usize>,
    /// Entries of its rows in columns of earlier blocks: row, column, slot.
    before: Vec<(usize, usize, usize)>,
}

/// A recorded elimination of square matrices of one sparsity pattern.
#[derive(Clone, Debug)]
pub struct Elimination {
    pivots: Vec<Pivot>,
    blocks: Vec<Block>,
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
        Self::plan_in(&diagonal_blocks(n, entries.iter().map(|&(i, j, _)| (i, j)))?, entries)
    }

    /// Plans the elimination of another matrix of the same pattern.
    fn plan_again(&self, entries: &[(usize, usize, f64)]) -> Option<Self> {
        let pairs = |block: &Block| self.pivots[block.pivots.clone()].iter().map(|p| (p.row, p.column)).collect();
        Self::plan_in(&self.blocks.iter().map(pairs).collect::<Vec<_>>(), entries)
    }

    fn plan_in(diagonal: &[Vec<(usize, usize)>], entries: &[(usize, usize, f64)]) -> Option<Self> {
        let (mut active, slots, mut before) = Active::new(diagonal, entries);
        let mut pivots = Vec::with_capacity(before.len());
        let mut blocks = Vec::with_capacity(diagonal.len());
        for (pairs, before) in diagonal.iter().zip(&mut before) {
            active.begin(pairs);
            let first = pivots.len();
            for _ in pairs {
                let (row, column) = active.choose()?;
                pivots.push(active.eliminate(row, column));
            }
            blocks.push(Block { pivots: first..pivots.len(), before: std::mem::take(before) });
        }
        let rows: Vec<usize> = pivots.iter().map(|p| p.row).collect();
        let columns: Vec<usize> = pivots.iter().map(|p| p.column).collect();
        let odd = is_odd(&rows) != is_odd(&columns);
        Some(Self { pivots, blocks, n_slots: active.values.len(), slots, odd })
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
                values[u.target] = values[u.target] - values[u.lower] * values[u.upper];
            }
        }
        Some(Factors { values, inverse_pivots })
    }

    /// Solves `A x = b`; overwrites `b`.
    pub fn solve<S: Real>(&self, f: &Factors<S>, b: &mut [S], x: &mut [S]) {
        for block in &self.blocks {
            let pivots = &self.pivots[block.pivots.clone()];
            for &(i, j, slot) in &block.before {
                b[i] = b[i] - f.values[slot] * x[j];
            }
            for pivot in pivots {
                let v = b[pivot.row];
                for &(i, lower) in &pivot.lower {
                    b[i] = b[i] - f.values[lower] * v;
                }
            }
            for (pivot, inverse) in pivots.iter().zip(&f.inverse_pivots[block.pivots.clone()]).rev() {
                let mut v = b[pivot.row];
                for &(j, upper) in &pivot.upper {
                    v = v - f.values[upper] * x[j];
                }
                x[pivot.column] = v * *inverse;
            }
        }
    }

    /// Solves `A^T x = b`; overwrites `b`.
    pub fn solve_transposed<S: Real>(&self, f: &Factors<S>, b: &mut [S], x: &mut [S]) {
        for block in self.blocks.iter().rev() {
            let pivots = &self.pivots[block.pivots.clone()];
            for (pivot, inverse) in pivots.iter().zip(&f.inverse_pivots[block.pivots.clone()]) {
                let v = b[pivot.column] * *inverse;
                x[pivot.row] = v;
                for &(j, upper) in &pivot.upper {
                    b[j] = b[j] - f.values[upper] * v;
                }
            }
            for pivot in pivots.iter().rev() {
                let mut v = x[pivot.row];
                for &(i, lower) in &pivot.lower {
                    v = v - f.values[lower] * x[i];
                }
                x[pivot.row] = v;
            }
            for &(i, j, slot) in &block.before {
                b[j] = b[j] - f.values[slot] * x[i];
            }
        }
    }

    /// How many times smaller than planned each pivot is: as many times the rounding of numbers grows.
    pub fn growth<'f, S: Real>(&'f self, f: &'f Factors<S>) -> impl Iterator<Item = S> + 'f {
        self.pivots.iter().zip(&f.inverse_pivots).map(|(pivot, &inverse)| S::from_f64(pivot.planned) * inverse)
    }

    fn negative(&self, f: &Factors<f64>) -> bool {
        f.inverse_pivots.iter().filter(|p| **p < 0.0).count() % 2 == usize::from(!self.odd)
    }

    /// Row and column of the pivots, in their order.
    pub fn order(&self) -> impl Iterator<Item = (usize, usize)> {
        self.pivots.iter().map(|p| (p.row, p.column))
    }

    /// The smallest pivot of the plan, as a part of the largest.
    #[must_use]
    pub fn smallest_pivot(&self) -> f64 {
        let sizes = || self.pivots.iter().map(|p| p.planned);
        sizes().fold(f64::INFINITY, f64::min) / sizes().fold(0.0, f64::max)
    }
}

impl<S: Real> Factors<S> {
    /// A number of the sign of the pivots' product, which changes with that of the determinant. It has nothing of the
    /// example that was planned for.
    #[must_use]
    pub fn pivot_product(&self) -> S {
        let mut product = S::from_f64(1.0);
        for (k, &inverse) in self.inverse_pivots.iter().enumerate() {
            // Of many pivots the product would leave the range of numbers.
            if k > 0 && k % IN_RANGE == 0 {
                product = (product * S::from_f64(f64::MAX)).within_one().0;
            }
            product = product * inverse;
        }
        product
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

/// A factored matrix, by a recorded order of elimination or, where that does not suit its numbers, by
/// one of its own.
#[derive(Clone, Debug)]
pub struct Factored<'a> {
    plan: Cow<'a, Elimination>,
    factors: Factors<f64>,
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
        if let Some((plan, factors)) = plan.and_then(|p| Some((p, p.factor(entries.clone())?))) {
            return Some(Self { plan: Cow::Borrowed(plan), factors });
        }
        let placed: Vec<(usize, usize, f64)> =
            pattern.iter().zip(entries.clone()).map(|(&(i, j), v)| (i, j, v)).collect();
        if placed.iter().any(|(_, _, v)| !v.is_finite()) {
            return None;
        }
        let own = plan.map_or_else(|| Elimination::plan(n, &placed), |plan| plan.plan_again(&placed))?;
        let factors = own.factor(entries)?;
        Some(Self { plan: Cow::Owned(own), factors })
    }

    /// Solves `A x = b`; overwrites `b`.
    pub fn solve(&self, b: &mut [f64], x: &mut [f64]) {
        self.plan.solve(&self.factors, b, x);
    }

    /// Solves `A^T x = b`; overwrites `b`.
    pub fn solve_transposed(&self, b: &mut [f64], x: &mut [f64]) {
        self.plan.solve_transposed(&self.factors, b, x);
    }

    /// Whether the determinant is negative: it tells assembly branches apart.
    #[must_use]
    pub fn negative(&self) -> bool {
        self.plan.negative(&self.factors)
    }

    /// The logarithm of its size, which itself may leave the range of numbers.
    #[must_use]
    pub fn log_size(&self) -> f64 {
        -self.factors.inverse_pivots.iter().map(|inverse| inverse.abs().ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// The product of the pivots of a large structure would be no number any more.
    #[test]
    fn the_sign_of_many_pivots_is_known_in_any_unit() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for n in [1, 3, 15, 16, 17, 40, 600] {
            for unit in [1e-12, 1.0, 1e12] {
                let entries: Vec<_> = (0..n)
                    .flat_map(|i| [(i, i), (i, (i + 1) % n)])
                    .map(|(i, j)| (i, j, unit * (rng.random_range(-1.0..1.0) + if i == j { 0.0 } else { 0.1 })))
                    .collect();
                let Some(plan) = Elimination::plan(n, &entries) else { continue };
                let f = plan.factor(entries.iter().map(|e| e.2)).expect("the planned matrix");
                let odd = f.inverse_pivots.iter().filter(|p| **p < 0.0).count() % 2 == 1;
                assert!(if odd { f.pivot_product() < 0.0 } else { f.pivot_product() > 0.0 }, "{n} {unit}");
            }
        }
    }

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
