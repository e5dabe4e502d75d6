//! The linearised closure of a recorded pose, solved by an elimination of all its rows.

use crate::math::sparse::{Elimination, Factors};
use crate::mechanism::Mechanism;
use crate::program::symbol::Symbol;

/// What solves the linearised closure, `J x = b`, and its transposed.
pub(crate) trait Linear<'r> {
    /// Twists of all bodies for a right side per row; overwrites the right side.
    fn solve(&self, right: &mut [Symbol<'r>], twists: &mut [Symbol<'r>]);
    /// Multipliers of the rows for a cost per twist component; overwrites the cost.
    fn solve_transposed(&self, cost: &mut [Symbol<'r>], multipliers: &mut [Symbol<'r>]);
    /// The elimination behind it.
    fn eliminated(&self) -> (&Elimination, &Factors<Symbol<'r>>);
    /// Vanishes and changes sign with the determinant.
    fn pivot_product(&self) -> Symbol<'r> {
        self.eliminated().1.pivot_product()
    }
    /// How many times the rounding of numbers may grow: the order of the pivots is that of another pose.
    fn growth(&self) -> Symbol<'r> {
        let (plan, factors) = self.eliminated();
        plan.growth(factors).fold(Symbol::Constant(0.0), |largest, growth| largest.max(growth.abs()))
    }
    /// An estimate of the smallest singular value of the length-scaled Jacobian from what a probe of the rows
    /// moves.
    fn singular_estimate(&self, m: &Mechanism) -> Symbol<'r>;
}

/// By a recorded elimination of all rows.
pub(crate) struct Eliminated<'e, 'r> {
    pub plan: &'e Elimination,
    pub factors: Factors<Symbol<'r>>,
}

impl<'r> Linear<'r> for Eliminated<'_, 'r> {
    fn solve(&self, right: &mut [Symbol<'r>], twists: &mut [Symbol<'r>]) {
        self.plan.solve(&self.factors, right, twists);
    }

    fn solve_transposed(&self, cost: &mut [Symbol<'r>], multipliers: &mut [Symbol<'r>]) {
        self.plan.solve_transposed(&self.factors, cost, multipliers);
    }

    fn eliminated(&self) -> (&Elimination, &Factors<Symbol<'r>>) {
        (self.plan, &self.factors)
    }

    /// As [`Mechanism::singular_estimate`].
    fn singular_estimate(&self, m: &Mechanism) -> Symbol<'r> {
        let mut right: Vec<Symbol<'r>> = m.probe().map(Symbol::Constant).collect();
        let mut x = vec![Symbol::Constant(0.0); m.n_rows()];
        self.solve(&mut right, &mut x);
        let largest = x.iter().enumerate().fold(Symbol::Constant(0.0), |largest, (j, v)| {
            largest.max((*v * Symbol::Constant(1.0 / m.unit(m.space.components()[j % m.size()]))).abs())
        });
        Symbol::Constant(1.0) / largest
    }
}
