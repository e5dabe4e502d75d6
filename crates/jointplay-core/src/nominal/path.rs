//! States of the nominal mechanism: where its path begins, and where a branch of it ends.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::math::space::Space;
use crate::math::sparse::Elimination;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// Smallest pivot, as a part of the largest, of a mechanism that is plainly not singular.
const REGULAR: f64 = 1e-8;

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
    /// Tries the drive values as asked; where the guess is too far from them, closes the joints first. The state then is not
    /// at these values, and to be followed to them.
    pub(crate) fn first_state(&self, drives: &[f64]) -> Option<(Solver<'_>, State)> {
        if let Some(begun) = self.begun_in_mesh(drives) {
            return Some(begun);
        }
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
        let values = free.converged.then(|| self.drive_values(&free.coordinates, drives))?;
        self.closed_at(&free.coordinates, &values)
    }

    /// Where wheels mesh as they start. From there drives turn them to the first values, as they do later: teeth count turns,
    /// which the shortest way to these values may not make, and are skipped by long steps of an assembly.
    fn begun_in_mesh(&self, drives: &[f64]) -> Option<(Solver<'_>, State)> {
        if self.largest_move == f64::INFINITY {
            return None;
        }
        let free = self.assemble(drives, false);
        let values = free.converged.then(|| self.started_drives(&free.coordinates))?;
        let (solver, state) = self.closed_at(&free.coordinates, &values)?;
        let to = Inputs::nominal(self, drives);
        let state = solver.follow(&state, &to).unwrap_or(state);
        Some((solver, state))
    }

    fn closed_at(&self, coordinates: &[f64], drives: &[f64]) -> Option<(Solver<'_>, State)> {
        let solver = Solver::new(self, coordinates);
        let state = solver.polish(coordinates, &Inputs::nominal(self, drives))?;
        Some((solver, state))
    }

    /// The state that is reached first, at these drive values.
    pub(crate) fn first_state_at(&self, drives: &[f64]) -> Option<State> {
        let (solver, state) = self.first_state(drives)?;
        solver.follow(&state, &Inputs::nominal(self, drives)).ok()
    }

    /// Whether joints and drives decide every pose just once where the mechanism can be assembled at the
    /// given drive values.
    #[must_use]
    pub fn is_regular(&self, drives: &[f64]) -> bool {
        if self.n_rows() != self.n_unknowns() {
            return false;
        }
        let is_clear = |plan: Elimination| self.n_unknowns() == 0 || plan.smallest_pivot() > REGULAR;
        let planned = |state: &State| Solver::new(self, &state.coordinates).plan;
        self.first_state_at(drives).as_ref().and_then(planned).is_some_and(is_clear)
    }

    /// The drive values of a start: in the plane as its angles are given, in space within half a turn.
    fn started_drives(&self, coordinates: &[f64]) -> Vec<f64> {
        let angle = |point: usize| self.points[point].body.map_or(0.0, |b| coordinates[3 * b + 2]);
        let value = |drive: usize| {
            let row = &self.rows[self.driven_rows[drive]];
            let joint = &self.joints[row.joint];
            let coefficient = row.drive.map_or(1.0, |by| by.coefficient);
            let near = match self.space {
                Space::Planar => (angle(joint.second) - angle(joint.first)) / coefficient,
                Space::Spatial => 0.0,
            };
            self.drive_value(drive, coordinates, near)
        };
        (0..self.n_drives).map(value).collect()
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
