//! The pose of an over-constrained or elastic mechanism for given offsets and deviations.
//!
//! Rigid bodies either close for the offsets or do not. What is elastic takes up the misfit with the least
//! energy.

use crate::closure::equations::Inputs;
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::questions::columns::{Forced, Given, Sensitivity};
use crate::questions::given::of_maps;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::placed::Placed;
use crate::redundancy::sequence::Failure;
use crate::redundancy::system::System;

impl Mechanism {
    /// The error of every case of an over-constrained or elastic mechanism for its own row of parameter
    /// values, and what it strains.
    pub(crate) fn given_over_constrained(&self, cases: &[Case<'_>], parameters: &[Vec<f64>]) -> Vec<(Given, Forced)> {
        let wanted = Wanted::all(self);
        let missing = |status| (Given { status, ..Given::unknown(&wanted) }, Forced::unknown(&wanted));
        self.chunks_on_basis(
            cases,
            CHUNK,
            |placed| {
                Rounds::each(placed.iter(), async |rounds, at| {
                    self.forced_at(rounds, at, &parameters[at.number], missing(Status::NotAssembled)).await
                })
            },
            missing,
        )
    }

    /// One case; `found` is what is told of those that are not assembled.
    async fn forced_at(
        &self,
        rounds: &Rounds,
        at: &Placed<'_>,
        parameters: &[f64],
        (mut given, mut forced): (Given, Forced),
    ) -> (Given, Forced) {
        let Placed { solver, case, nominal, .. } = at;
        let u = self.displacements(parameters);
        let system = System { elements: at.system.springs(), ..at.system.clone() };
        let Some(c) = Compatibility::at(system.basis, solver, nominal) else {
            given.status = Status::Singular;
            return (given, forced);
        };
        // First order at the nominal pose.
        let right = self.first_order_right(&c, &u, case, nominal);
        let first = system.balance_in(rounds, &c, &right, &Ask::Stress, None).await;
        if let Some(balance) = &first {
            given.error_first_order = self.first_order_error(&system, &c, &u, case, nominal, balance);
        }
        let start = Inputs { drives: case.drives.to_vec(), parameters: u.clone() };
        let Ok(start) = solver.follow(nominal, &start) else { return (given, forced) };
        forced.lack_of_fit = self.length * system.basis.scaled_misfit(&system.basis.misfit(&start));
        let settled = match system.rest_in(rounds, solver, start, &u, first.as_ref(), Ask::Stress).await {
            Ok(settled) => settled,
            Err(failure) => {
                given.status = failure.status();
                return (given, forced);
            }
        };
        let balance = &settled.balance;
        let unknown = system.unknown_reactions(&c);
        forced.prestress = self.bearable(system.basis, &settled.state, &balance.forces, &unknown);
        forced.deformation = self.deformation(&system, balance);
        given.error = system.basis.kept.error(&settled.state, nominal);
        given.residual = solver.residual(&settled.state.coordinates, &settled.state.inputs);
        given.poses = settled.state.coordinates;
        let strained = balance.given.iter().flatten().any(|v| *v != 0.0);
        given.status = match at.nominal_status() {
            Status::Ok if strained => Status::Strained,
            status => status,
        };
        (given, forced)
    }

    /// Sensitivity of the output of every case to displacements that keep compatible, others giving way.
    pub(crate) fn sensitivity_over_constrained(&self, cases: &[Case<'_>]) -> Vec<Sensitivity> {
        self.each_on_basis(
            cases,
            |system, solver, _, _, nominal| {
                let Some(c) = Compatibility::at(system.basis, solver, &nominal) else {
                    return self.no_sensitivity(Status::Singular);
                };
                let columns: Vec<usize> = (0..self.n_parameters()).map(|p| self.place_of(p)).collect();
                let parameters = system.derivatives_given(&c).select_columns(&columns);
                of_maps(&parameters, &c.output.drives, self.nominal_status(&nominal))
            },
            |status| self.no_sensitivity(status),
        )
    }
}

impl Failure {
    /// The outcome that it is.
    pub(crate) const fn status(self) -> Status {
        match self {
            Self::Incompatible => Status::NotAssemblable,
            Self::Singular => Status::Singular,
            Self::Unreachable => Status::NotAssembled,
        }
    }
}
