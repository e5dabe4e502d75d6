//! What a state of a mechanism says: its error, the values of its drives, how near it is to a singular one.

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Linearised, Solver, State};
use crate::math::space::Component;
use crate::math::vector::sub;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;

/// An inverse iteration that changes the smallest singular value by less than this part nearly has it: ...
const NEARLY: f64 = 1e-2;
/// ... with a factor of this above the limit nothing more has to be known.
const PLAINLY: f64 = 1.5;

impl Mechanism {
    /// The value of a drive's coordinate, continued from a nearby value over full turns.
    pub(crate) fn drive_value(&self, drive: usize, coordinates: &[f64], near: f64) -> f64 {
        let row = self.driven_rows[drive];
        // A basis leaves out a drive that gives way where others decide its coordinate: it is commanded as it is.
        let Some(coefficient) = self.rows[row].drive.filter(|by| by.drive == drive).map(|by| by.coefficient) else {
            return near;
        };
        let value = self.joint_value(row, &self.poses(coordinates), &vec![0.0; self.n_parameters()]);
        match self.rows[row].component {
            Component::Along(_) => value / coefficient,
            Component::About(_) => {
                let turn = std::f64::consts::TAU / coefficient;
                let value = value / coefficient;
                value + turn * ((near - value) / turn).round()
            }
        }
    }

    /// The drive values of a state, those nearest to given ones over full turns.
    #[must_use]
    pub fn drive_values(&self, coordinates: &[f64], near: &[f64]) -> Vec<f64> {
        if coordinates.iter().any(|c| c.is_nan()) {
            return vec![f64::NAN; self.n_drives];
        }
        (0..self.n_drives).map(|d| self.drive_value(d, coordinates, near[d])).collect()
    }

    /// A nominal state from its coordinates; drive values are read off near the given ones.
    pub fn restore(&self, solver: &Solver<'_>, coordinates: &[f64], near: &[f64]) -> Option<State> {
        if coordinates.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let drives = self.drive_values(coordinates, near);
        let inputs = Inputs::nominal(self, &drives);
        // A singular state cannot be polished; it is judged by its Jacobian later.
        let given = || State { coordinates: coordinates.to_vec(), inputs: inputs.clone(), negative: false };
        Some(solver.polish(coordinates, &inputs).unwrap_or_else(given))
    }

    /// A solver planned at the first case that is assembled, if any.
    #[must_use]
    pub fn solver(&self, cases: &[Case<'_>]) -> Option<Solver<'_>> {
        let assembled = |case: &&Case<'_>| case.coordinates.iter().all(|c| c.is_finite());
        cases.iter().find(assembled).map(|case| Solver::new(self, case.coordinates))
    }

    /// Error of an output against that of nominal coordinates.
    pub(crate) fn error(&self, state: &State, nominal: &State) -> Vec<f64> {
        let place = |s: &State| self.output_place(&self.poses(&s.coordinates), &s.inputs.parameters);
        let turned = self.output_turn(&nominal.coordinates, &state.coordinates);
        self.pose_components(sub(place(state), place(nominal)), &turned)
    }

    /// [`Self::nominal_status`] where the Jacobian is factored already: an estimate spares the singular value where it is
    /// plainly large, a better one where it is large.
    pub(crate) fn status_of(&self, linearised: &Linearised<'_>, state: &State) -> Status {
        let is_large = self.singular_estimate(linearised) >= CLEAR * self.singular_value
            || self.inverse_iteration(&linearised.factors, NEARLY).0 >= PLAINLY * self.singular_value;
        if is_large { Status::Ok } else { self.nominal_status(state) }
    }

    /// Whether the nominal state is too near a singular one.
    pub(crate) fn nominal_status(&self, state: &State) -> Status {
        let (value, _) = self.singular_value_at(state);
        if value < self.singular_value { Status::Singular } else { Status::Ok }
    }
}

impl Solver<'_> {
    /// [`Mechanism::nominal_status`] of a state.
    pub(crate) fn status_at(&self, state: &State) -> Status {
        let m = self.mechanism;
        self.linearise(state).map_or_else(|| m.nominal_status(state), |linearised| m.status_of(&linearised, state))
    }
}
