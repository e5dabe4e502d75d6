//! States of the nominal mechanism: where its path begins, and where a branch of it ends.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::math::space::{Component, Space};
use crate::mechanism::status::Status;
use crate::mechanism::{Driven, Mechanism, Row};

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
        if !free.converged {
            return None;
        }
        let solver = Solver::new(self, &free.coordinates);
        let values = self.drive_values(&free.coordinates, drives);
        let state = solver.polish(&free.coordinates, &Inputs::nominal(self, &values))?;
        Some((solver, state))
    }

    /// Where wheels mesh as they start, if the first drive values are more than half a turn from there: teeth count turns, and
    /// the shortest way to these values is not the one that the drives make.
    fn begun_in_mesh(&self, drives: &[f64]) -> Option<(Solver<'_>, State)> {
        if self.largest_move == f64::INFINITY {
            return None;
        }
        let free = self.assemble(drives, false);
        let values = self.started_drives(&free.coordinates);
        let is_far = |(_, row, by): (usize, &Row, Driven)| {
            let turned = by.coefficient * (drives[by.drive] - values[by.drive]);
            matches!(row.component, Component::About(_)) && turned.abs() > std::f64::consts::PI
        };
        if !free.converged || !self.rows_of_drives().any(is_far) {
            return None;
        }
        let solver = Solver::new(self, &free.coordinates);
        let state = solver.polish(&free.coordinates, &Inputs::nominal(self, &values))?;
        Some((solver, state))
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
