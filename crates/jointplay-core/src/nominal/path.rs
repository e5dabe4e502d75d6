//! States of the nominal mechanism: where its path begins, and where a branch of it ends.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// One configuration of the nominal mechanism, brought to a target.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// The assembled state, where there is one.
    pub state: Option<State>,
    /// Outcome.
    pub status: Status,
    /// Distance left to the target.
    pub mismatch: f64,
}

impl Mechanism {
    /// The first assembled state of the nominal mechanism and the solver planned there.
    ///
    /// Tries the drive values as asked; where the guess is too far from them, closes the joints first
    /// and drives from there.
    pub(crate) fn first_state(&self, drives: &[f64]) -> Option<(Solver<'_>, State)> {
        let held = self.assemble(drives, true);
        if held.converged {
            let solver = Solver::new(self, &held.coordinates);
            let inputs = Inputs::nominal(self, drives);
            let state = solver.polish(&held.coordinates, &inputs);
            // A singular start assembles, but Newton's method cannot polish it.
            let singular = State { coordinates: held.coordinates, inputs, negative: false };
            return Some((solver, state.unwrap_or(singular)));
        }
        let free = self.assemble(drives, false);
        if !free.converged {
            return None;
        }
        let solver = Solver::new(self, &free.coordinates);
        let values = self.drive_values(&free.coordinates, drives);
        let state = solver.polish(&free.coordinates, &Inputs::nominal(self, &values))?;
        Some((solver, state))
    }

    /// The singular state at the very end of a branch (a dead centre), which continuation only comes near.
    pub(crate) fn dead_centre(&self, near: &State, drives: &[f64]) -> Option<State> {
        let assembly = self.assemble_quickly(near.coordinates.clone(), drives);
        let inputs = Inputs::nominal(self, drives);
        let state = State { coordinates: assembly.coordinates, inputs, negative: near.negative };
        (assembly.converged && self.nominal_status(&state) == Status::Singular).then_some(state)
    }

    pub(crate) fn unsolved(status: Status) -> Configuration {
        Configuration { state: None, status, mismatch: f64::NAN }
    }
}
