//! The nominal path of the drives, and how near each of its configurations is to a singular one.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::math::space::Component;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row as _;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::nominal::columns::Measured;

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

    /// How near every case is to a singular state, at its nominal coordinates.
    #[must_use]
    pub fn measure(&self, cases: &[Case<'_>]) -> Answer {
        let wanted = Wanted::all(self);
        let measured = |case: &Case<'_>| {
            if case.coordinates.iter().any(|c| c.is_nan()) {
                return Measured::unknown(&wanted);
            }
            let inputs = Inputs::nominal(self, case.drives);
            let state = State { coordinates: case.coordinates.to_vec(), inputs, negative: false };
            let (singular_value, singular_motion) = self.singular_value_at(&state);
            Measured { singular_value, singular_motion: self.of_unit_size(singular_motion) }
        };
        let rows: Vec<Measured> = cases.par_iter().map(measured).collect();
        Answer::of_rows(rows.iter(), &wanted)
    }

    /// A length-scaled motion of all bodies, its largest part a radian or the characteristic length.
    fn of_unit_size(&self, mut motion: Vec<f64>) -> Vec<f64> {
        let largest = motion.iter().fold(0.0_f64, |a, v| if v.abs() > a.abs() { *v } else { a });
        for (j, v) in motion.iter_mut().enumerate() {
            *v /= largest;
            if matches!(self.space.components()[j % self.size()], Component::Along(_)) {
                *v *= self.length;
            }
        }
        motion
    }
}
