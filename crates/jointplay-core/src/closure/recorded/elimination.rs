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
    /// Whether no pose is singular.
    fn is_regular_everywhere(&self) -> bool {
        false
    }
    /// As [`Mechanism::singular_square`].
    fn singular_square(&self, m: &Mechanism) -> Symbol<'r> {
        if self.is_regular_everywhere() {
            return Symbol::Constant(1.0);
        }
        m.singular_square(|b, x| self.solve(b, x), |b, x| self.solve_transposed(b, x))
    }
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
}
