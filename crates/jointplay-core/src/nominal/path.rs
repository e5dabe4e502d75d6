//! The nominal path of the drives, and how near each of its configurations is to a singular one.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::math::space::Component;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;

/// One configuration of the nominal mechanism.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// The assembled state, where there is one.
    pub state: Option<State>,
    /// Outcome.
    pub status: Status,
    /// Smallest singular value of the length-scaled closure Jacobian.
    pub singular_value: f64,
    /// The motion that belongs to it: a twist of every body, the largest part of unit size.
    pub singular_motion: Vec<f64>,
    /// Distance left to the target (inverse kinematics).
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

    pub(crate) fn unsolved(&self, status: Status) -> Configuration {
        Configuration {
            state: None,
            status,
            singular_value: f64::NAN,
            singular_motion: vec![f64::NAN; self.n_unknowns()],
            mismatch: f64::NAN,
        }
    }

    pub(crate) fn judge(&self, state: State) -> Configuration {
        let (value, mut motion) = self.singular_value_at(&state);
        let largest = motion.iter().fold(0.0_f64, |a, v| if v.abs() > a.abs() { *v } else { a });
        for (j, v) in motion.iter_mut().enumerate() {
            *v /= largest;
            if matches!(self.space.components()[j % self.size()], Component::Along(_)) {
                *v *= self.length;
            }
        }
        let status = if value < self.singular_value { Status::Singular } else { Status::Ok };
        Configuration { state: Some(state), status, singular_value: value, singular_motion: motion, mismatch: f64::NAN }
    }

    /// Measures how near every case is to a singular state, at its nominal coordinates.
    #[must_use]
    pub fn measure(&self, cases: &[Case<'_>]) -> Vec<Configuration> {
        let measured = |case: &Case<'_>| {
            if case.coordinates.iter().any(|c| c.is_nan()) {
                return self.unsolved(Status::NotAssembled);
            }
            let inputs = Inputs::nominal(self, case.drives);
            self.judge(State { coordinates: case.coordinates.to_vec(), inputs, negative: false })
        };
        cases.par_iter().map(measured).collect()
    }

    /// Solves the nominal mechanism for `n` rows of drive values given one after the other, keeping to
    /// the assembly branch, and measures how near each is to a singular state.
    #[must_use]
    pub fn solve(&self, n: usize, drives: &[f64]) -> Vec<Configuration> {
        let trace = self.trace(n, drives);
        let (width, numbers) = (self.n_drives, self.n_coordinates());
        let judged = |k: usize| {
            let coordinates = &trace.coordinates[k * numbers..(k + 1) * numbers];
            if coordinates.iter().any(|c| c.is_nan()) {
                return self.unsolved(trace.status[k]);
            }
            let inputs = Inputs::nominal(self, &drives[k * width..(k + 1) * width]);
            self.judge(State { coordinates: coordinates.to_vec(), inputs, negative: false })
        };
        (0..n).into_par_iter().map(judged).collect()
    }
}
