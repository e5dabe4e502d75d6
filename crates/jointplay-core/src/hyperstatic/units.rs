//! Many units of one over-constrained or elastic mechanism: the same case, each with deviations of its own.

use super::loaded::{Strain, StrainTable};
use super::system::System;
use crate::loaded::Case;
use crate::mechanism::Mechanism;

impl Mechanism {
    /// What [`Mechanism::strained`] tells of units whose parameters have their own values in the middle of their
    /// sets.
    #[must_use]
    pub fn strained_units(&self, case: Case<'_>, centres: &[Vec<f64>], exact: bool) -> StrainTable {
        let cases = vec![case; centres.len()];
        let found: Vec<Strain> = self.each_on_basis(
            &cases,
            |system, solver, number, case, nominal| {
                let unit = Self { centre: centres[number].clone(), ..self.clone() };
                unit.strain_at(&System::new(&unit, system.basis), solver, case, &nominal, exact)
            },
            |status| self.no_strain(status),
        );
        StrainTable::from_rows(found)
    }
}
