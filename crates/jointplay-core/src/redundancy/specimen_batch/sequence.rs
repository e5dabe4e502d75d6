//! How a specimen settles.
//!
//! It begins where the first order at the nominal pose takes it. Again and again its basis is closed and linearised and
//! its program solved there, beside those of other specimens, until its displacements have converged; one whose do not
//! after a few programs, because a reaction passes through zero on the way, goes on plainly
//! ([`System::settle_in`](crate::redundancy::system::System::settle_in)).

use nalgebra::DMatrix;

use crate::cone::scheduler::Rounds;
use crate::mechanism::status::Status;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::{Failure, NOISE};
use crate::redundancy::specimen_batch::{Linearised, Together};
use crate::redundancy::system::System;

/// Programs until a specimen goes on plainly.
const MOST_STEPS: usize = 12;
/// A specimen has converged when the next change would be below this part of all displacements.
const STILL: f64 = 1e-10;

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
    /// What displacements do to the output.
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

    /// Settles it from its first order; `None` where it does not converge soon.
    async fn settle_on_lanes(
        &self,
        rounds: &Rounds,
        system: &System<'_>,
        known: &[f64],
        ask: &Ask,
        first: &Balance,
    ) -> Option<SpecimenSolution> {
        let mut balance = first.clone();
        let mut displacements = system.target(known, first);
        let mut last = system.difference(known, &displacements);
        let mut still = false;
        for step in 0..MOST_STEPS {
            // What cannot be closed on the way may be reached in smaller steps.
            let (closed, Linearised { ties, output }) = self.linearise(&displacements, still).await.ok()?;
            if still {
                let (error, plainly) = (closed.error, closed.plainly);
                // The caller puts it in.
                let first = None;
                return Some(SpecimenSolution { displacements, error, first, balance, ties, output, still, plainly });
            }
            let (right, forces) = (ties.right(&displacements, known), ask.forces(&ties, &output));
            // From the second program on the answer before is so near that Newton's method takes it to the last digits,
            // which an interior point has not where the value is flat.
            let near = balance.answer.as_ref().filter(|_| step > 0);
            let found = system.balance_under(rounds, &ties, &right, ask, forces, near).await;
            balance = found.filter(|balance| balance.solved)?;
            let target = system.target(known, &balance);
            let size = system.difference(known, &target);
            let change = system.difference(&displacements, &target);
            // Changes shrink in proportion, until what is left is the programs' rounding.
            let next = if change > 0.0 { change * (change / last) } else { 0.0 };
            still = next <= STILL * size || change <= NOISE * size && change > 0.5 * last;
            (displacements, last) = (target, change);
        }
        None
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
