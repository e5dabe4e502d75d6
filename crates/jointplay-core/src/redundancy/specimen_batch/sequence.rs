//! How a specimen settles.
//!
//! It begins where the first order at the nominal pose takes it. Again and again its basis is closed and linearised and
//! its program solved there, beside those of other specimens ([`System::settle_by`]). One that the lanes cannot close, or
//! that does not come to rest from there, and one whose forces change by springs go plainly.

use nalgebra::{DMatrix, DVector};

use crate::cone::scheduler::Rounds;
use crate::mechanism::status::Status;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::{Failure, Linear, Place, Reached, Start};
use crate::redundancy::specimen_batch::{Linearised, Together};
use crate::redundancy::sprung::Sprung;
use crate::redundancy::system::System;

/// Where a specimen is, closed beside others.
#[derive(Clone)]
struct Lane<'t, 'a> {
    together: &'t Together<'a>,
    displacements: Vec<f64>,
}

impl Linear for Linearised {
    fn ties(&self) -> &Ties {
        &self.ties
    }

    fn forces(&self, ask: &Ask) -> DVector<f64> {
        ask.forces(&self.ties, &self.output)
    }
}

impl Place for Lane<'_, '_> {
    type Linear = Linearised;

    fn displacements(&self) -> &[f64] {
        &self.displacements
    }

    async fn linearise(&self, _: &System<'_>) -> Result<Linearised, Failure> {
        // What cannot be closed on the way may be reached in smaller steps.
        let found = self.together.linearise(&self.displacements, false).await;
        found.map(|(_, linearised)| linearised).map_err(|_| Failure::Unreachable)
    }

    /// The lanes know no springs, and are not asked where there are any.
    fn sprung(&self, _: &System<'_>, _: &[f64]) -> Result<Vec<Sprung>, Failure> {
        Err(Failure::Singular)
    }

    async fn step(&self, target: &[f64], part: f64) -> Result<(Self, f64), Failure> {
        let mix = |(a, b): (&f64, &f64)| if part >= 1.0 { *b } else { a + part * (b - a) };
        let displacements = self.displacements.iter().zip(target).map(mix).collect();
        Ok((Self { together: self.together, displacements }, part))
    }
}

/// One specimen whose displacements have converged.
#[derive(Clone, Debug)]
pub(crate) struct SpecimenSolution {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// To first order at the nominal pose, where there is an answer.
    pub first: Option<Balance>,
    pub balance: Balance,
    pub ties: Ties,
    /// What displacements do to the output, where a load was asked for.
    pub output: DMatrix<f64>,
    /// Whether the displacements have converged and the last program was solved to the end.
    pub still: bool,
    /// Whether it took the plain solver.
    pub plainly: bool,
}

impl Together<'_> {
    /// Settles a specimen where what is asked has converged, with its clearances and displacements known of it.
    pub async fn settle(
        &self,
        rounds: &Rounds,
        system: &System<'_>,
        known: &[f64],
        ask: &Ask,
    ) -> Result<SpecimenSolution, Status> {
        let (c, right) = (self.nominal.compatibility, self.nominal.right_beside(known));
        let first = system.balance_in(&rounds.roughly(), c, &right, ask, None).await;
        // The lanes know no springs.
        let on_lanes = !system.is_sprung(ask);
        if let Some(begun) = first.as_ref().filter(|first| first.solved && on_lanes)
            && let Some(settled) = self.settle_on_lanes(&rounds.roughly(), system, known, ask, begun).await
        {
            return Ok(SpecimenSolution { first, ..settled });
        }
        Box::pin(self.settle_plainly(rounds, system, known, ask, first)).await
    }

    /// Settles it from its first order; `None` where the lanes cannot close it or it does not come to rest.
    async fn settle_on_lanes(
        &self,
        rounds: &Rounds,
        system: &System<'_>,
        known: &[f64],
        ask: &Ask,
        first: &Balance,
    ) -> Option<SpecimenSolution> {
        let displacements = system.target(known, first);
        let last = system.difference(known, &displacements);
        let start = Start { place: Lane { together: self, displacements }, near: None, last, steps: 1 };
        let Reached { balance, still, .. } =
            system.settle_by(rounds, start, known, true, |_, _| ask.clone()).await.ok()?;
        // Those of the last program, of which its offsets are a part.
        let displacements = system.target(known, &balance);
        let (closed, Linearised { ties, output }) = self.linearise(&displacements, !ask.is_unloaded()).await.ok()?;
        let (error, plainly) = (closed.error, closed.plainly);
        // The caller puts the first order in.
        let first = None;
        balance.solved.then_some(SpecimenSolution {
            displacements,
            error,
            first,
            balance,
            ties,
            output,
            still,
            plainly,
        })
    }

    /// Settles it from where it is closed for what is known of it.
    async fn settle_plainly(
        &self,
        rounds: &Rounds,
        system: &System<'_>,
        known: &[f64],
        ask: &Ask,
        first: Option<Balance>,
    ) -> Result<SpecimenSolution, Status> {
        let start = self.close_plainly(known)?;
        let near = first.as_ref().and_then(|first| first.answer.clone());
        let settled = system.settle_in(rounds, self.solver, start, known, near, |_, _| ask.clone()).await;
        let settled = settled.map_err(Failure::status)?;
        if settled.state.negative != self.built.negative {
            return Err(Status::Singular);
        }
        Ok(SpecimenSolution {
            error: self.closed(&settled.state).error,
            displacements: settled.state.inputs.parameters,
            first,
            still: settled.still && settled.balance.solved,
            balance: settled.balance,
            ties: settled.compatibility.ties,
            output: settled.compatibility.output.parameters,
            plainly: true,
        })
    }
}
