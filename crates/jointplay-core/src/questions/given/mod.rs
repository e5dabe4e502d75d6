//! The exact pose for given parameter values, and the first-order maps of every case.

mod over_constrained;
mod specimens;

pub(crate) use specimens::Place;

use nalgebra::DMatrix;

use crate::closure::equations::Inputs;
use crate::closure::sensitivity::Output;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::questions::columns::{Given, Sensitivity};
use crate::questions::form::Form;

impl Mechanism {
    /// The error of every case for its own row of parameter values.
    #[must_use]
    pub fn given(&self, cases: &[Case<'_>], parameters: &[Vec<f64>]) -> Answer {
        let wanted = Wanted::all(self);
        match self.form(true) {
            Form::Determinate => Answer::of_rows(self.given_determinate(cases, parameters).iter(), &wanted),
            Form::OverConstrained => Answer::of_pairs(&self.given_over_constrained(cases, parameters), &wanted),
        }
    }

    /// Sensitivity of the output of every case, at its nominal coordinates.
    #[must_use]
    pub fn sensitivity(&self, cases: &[Case<'_>]) -> Answer {
        let found = match self.form(true) {
            Form::Determinate => self.sensitivity_determinate(cases),
            Form::OverConstrained => self.sensitivity_over_constrained(cases),
        };
        Answer::of_rows(found.iter(), &Wanted::all(self))
    }

    pub(crate) fn given_determinate(&self, cases: &[Case<'_>], parameters: &[Vec<f64>]) -> Vec<Given> {
        let missing = |status| Given { status, ..Given::unknown(&Wanted::all(self)) };
        self.each(
            self.solver(cases).as_ref(),
            cases,
            |solver, number, case, nominal| {
                let Some(linearised) = solver.linearise(&nominal) else { return missing(Status::Singular) };
                let map = self.output_sensitivity(&linearised, &nominal);
                let shift = self.drive_shift(&map, case, &nominal);
                let u = &parameters[number];
                let inputs = Inputs { drives: case.drives.to_vec(), parameters: u.clone() };
                let error_first_order = map.error(&shift, u);
                match solver.follow(&nominal, &inputs) {
                    Ok(state) => Given {
                        error: self.error(&state, &nominal),
                        error_first_order,
                        residual: solver.residual(&state.coordinates, &state.inputs),
                        poses: state.coordinates,
                        status: self.status_of(&linearised, &nominal),
                    },
                    Err(status) => Given { error_first_order, ..missing(status) },
                }
            },
            || missing(Status::NotAssembled),
        )
    }

    fn sensitivity_determinate(&self, cases: &[Case<'_>]) -> Vec<Sensitivity> {
        self.each(
            self.solver(cases).as_ref(),
            cases,
            |solver, _, _, nominal| {
                solver.linearise(&nominal).map_or_else(
                    || self.no_sensitivity(Status::Singular),
                    |linearised| {
                        let Output { parameters, drives } = self.output_sensitivity(&linearised, &nominal);
                        of_maps(&parameters, &drives, self.status_of(&linearised, &nominal))
                    },
                )
            },
            || self.no_sensitivity(Status::NotAssembled),
        )
    }

    /// The maps of a case that has none.
    pub(crate) fn no_sensitivity(&self, status: Status) -> Sensitivity {
        Sensitivity { status, ..Sensitivity::unknown(&Wanted::all(self)) }
    }
}

/// The maps row by row; nalgebra stores columns.
pub(crate) fn of_maps(parameters: &DMatrix<f64>, drives: &DMatrix<f64>, status: Status) -> Sensitivity {
    let by_rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
    Sensitivity { source: by_rows(parameters), drive: by_rows(drives), status }
}
