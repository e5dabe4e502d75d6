//! Cases on bases that are regular there, in chunks that one task analyses.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::closure::newton::{CLEAR, Solver, State};
use crate::interrupt;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::redundancy::basis::Basis;
use crate::redundancy::system::System;

/// A basis whose smallest singular value is below this part of that of all rows is left for another one.
const OUTGROWN: f64 = 0.1;

/// A case that is assembled.
pub(crate) struct Placed<'a> {
    pub system: &'a System<'a>,
    pub solver: &'a Solver<'a>,
    /// Its number among all cases.
    pub number: usize,
    pub case: &'a Case<'a>,
    pub nominal: State,
    /// Whether the basis is plainly regular there, and all rows with it.
    pub regular: bool,
}

impl Placed<'_> {
    /// Whether the nominal state is too near a singular one.
    pub fn nominal_status(&self) -> Status {
        if self.regular { Status::Ok } else { self.system.mechanism.nominal_status(&self.nominal) }
    }
}

impl Mechanism {
    /// Runs an analysis on every case that is assembled, on a basis that is regular there; the others
    /// get `missing`.
    pub(crate) fn each_on_basis<T: Send>(
        &self,
        cases: &[Case<'_>],
        analysis: impl Fn(&System<'_>, &Solver<'_>, usize, &Case<'_>, State) -> T + Sync,
        missing: impl Fn(Status) -> T + Sync,
    ) -> Vec<T> {
        let one = |at: &Placed<'_>| analysis(at.system, at.solver, at.number, at.case, at.nominal.clone());
        self.chunks_on_basis(cases, 1, |placed| placed.iter().map(one).collect(), missing)
    }

    /// The same for chunks of cases: the analysis tells as many results as it gets cases.
    pub(crate) fn chunks_on_basis<T: Send>(
        &self,
        cases: &[Case<'_>],
        size: usize,
        analysis: impl Fn(&[Placed<'_>]) -> Vec<T> + Sync,
        missing: impl Fn(Status) -> T + Sync,
    ) -> Vec<T> {
        let basis = match self.basis() {
            Ok(basis) => basis,
            Err(status) => return cases.iter().map(|_| missing(status)).collect(),
        };
        let common = basis.kept.solver(cases);
        let Some(common) = &common else { return cases.iter().map(|_| missing(Status::NotAssembled)).collect() };
        let system = System::new(self, &basis);
        let of_chunk = |(number, chunk): (usize, &[Case<'_>])| {
            let suited: Vec<Result<Suited, Status>> =
                chunk.iter().map(|case| self.suited(&basis, common, case)).collect();
            let others: Vec<Option<(Solver<'_>, System<'_>)>> = suited
                .iter()
                .map(|suited| {
                    let Ok(Suited { nominal, other: Some(other), .. }) = suited else { return None };
                    Some((other.solver(&nominal.coordinates), System::new(self, other)))
                })
                .collect();
            let own: Vec<Cow<'_, Solver<'_>>> = chunk.iter().map(|case| common.suiting(case.coordinates)).collect();
            let place = |k: usize| {
                let (case, number) = (&chunk[k], number * size + k);
                let suited = suited[k].as_ref().map_err(|status| *status)?;
                match &others[k] {
                    None => {
                        let (nominal, regular) = (suited.nominal.clone(), suited.regular);
                        Ok(Placed { system: &system, solver: &own[k], number, case, nominal, regular })
                    }
                    Some((solver, system)) => {
                        let nominal = system.basis.kept.restore(solver, case.coordinates, case.drives);
                        let nominal = nominal.ok_or(Status::NotAssembled)?;
                        Ok(Placed { system, solver, number, case, nominal, regular: false })
                    }
                }
            };
            let (mut placed, mut statuses) = (Vec::with_capacity(chunk.len()), Vec::with_capacity(chunk.len()));
            for k in 0..chunk.len() {
                statuses.push(place(k).map(|at| placed.push(at)));
            }
            let found = analysis(&placed);
            assert_eq!(found.len(), placed.len(), "as many results as cases");
            let mut found = found.into_iter();
            let each = |status| match status {
                Ok(()) => found.next(),
                Err(status) => Some(missing(status)),
            };
            statuses.into_iter().filter_map(each).collect::<Vec<T>>()
        };
        let done = |chunk| interrupt::until_stopped(|| of_chunk(chunk));
        interrupt::before_the_stop(cases.par_chunks(size).enumerate().map(done).collect())
    }

    /// The nominal state of a case, and another basis where that one is better.
    fn suited(&self, basis: &Basis, solver: &Solver<'_>, case: &Case<'_>) -> Result<Suited, Status> {
        let nominal = basis.kept.restore(solver, case.coordinates, case.drives).ok_or(Status::NotAssembled)?;
        let regular = self.plainly_regular(basis, solver, &nominal);
        let outgrown = !regular && self.outgrown(basis, &nominal);
        let other = if outgrown { Some(self.basis_at(&nominal.coordinates)?) } else { None };
        Ok(Suited { nominal, regular, other })
    }

    /// Whether a basis is far from a singular state; all rows are farther.
    pub(crate) fn plainly_regular(&self, basis: &Basis, solver: &Solver<'_>, state: &State) -> bool {
        let estimate = solver.linearise(state).map_or(0.0, |l| basis.kept.singular_estimate(&l));
        estimate >= CLEAR * self.singular_value
    }

    /// Whether a basis that is not is so near to a singular state that another one is better, where the rows together
    /// are not.
    pub(crate) fn outgrown(&self, basis: &Basis, state: &State) -> bool {
        basis.redundancy() > 0 && basis.kept.singular_value_at(state).0 < OUTGROWN * self.singular_value_at(state).0
    }
}

/// A case on the common basis, whether that is plainly regular there, and the basis that suits it better.
struct Suited {
    nominal: State,
    regular: bool,
    other: Option<Basis>,
}
