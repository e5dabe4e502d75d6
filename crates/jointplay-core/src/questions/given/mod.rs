//! The exact pose for given parameter values, and the first-order maps of every case.

mod over_constrained;

pub use over_constrained::Forced;

use nalgebra::DMatrix;

use crate::closure::equations::Inputs;
use crate::closure::sensitivity::Output;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;

/// The error of one configuration for given parameter values.
#[derive(Clone, Debug)]
pub struct Given {
    /// Error on the exact closure, per component.
    pub error: Vec<f64>,
    /// Its linearisation at the nominal pose.
    pub error_first_order: Vec<f64>,
    /// Coordinates of all bodies.
    pub coordinates: Vec<f64>,
    /// Outcome.
    pub status: Status,
}

/// First-order maps of one configuration.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The maps; NaN where the nominal state is singular or missing.
    pub output: Output,
    /// Outcome.
    pub status: Status,
}

impl Mechanism {
    /// The error of every case for its own row of parameter values.
    #[must_use]
    pub fn given(&self, cases: &[Case<'_>], parameters: &[Vec<f64>]) -> Vec<Given> {
        let missing = |status| Given {
            error: vec![f64::NAN; self.size()],
            error_first_order: vec![f64::NAN; self.size()],
            coordinates: vec![f64::NAN; self.n_coordinates()],
            status,
        };
        self.each(
            self.solver(cases).as_ref(),
            cases,
            |solver, number, case, nominal| {
                let Some(linearised) = solver.linearise(&nominal) else { return missing(Status::Singular) };
                let map = self.output_sensitivity(&linearised, &nominal);
                let shift = self.drive_shift(&map, case, &nominal);
                let u = &parameters[number];
                let linear =
                    |i: usize| shift[i] + u.iter().enumerate().map(|(p, u)| map.parameters[(i, p)] * u).sum::<f64>();
                let inputs = Inputs { drives: case.drives.to_vec(), parameters: u.clone() };
                let error_first_order = (0..self.size()).map(linear).collect();
                match solver.follow(&nominal, &inputs) {
                    Ok(state) => Given {
                        error: self.error(&state, &nominal),
                        error_first_order,
                        coordinates: state.coordinates,
                        status: self.status_of(&linearised, &nominal),
                    },
                    Err(status) => Given { error_first_order, ..missing(status) },
                }
            },
            || missing(Status::NotAssembled),
        )
    }

    /// Sensitivity of the output of every case, at its nominal coordinates.
    #[must_use]
    pub fn sensitivities(&self, cases: &[Case<'_>]) -> Vec<Sensitivity> {
        self.each(
            self.solver(cases).as_ref(),
            cases,
            |solver, _, _, nominal| {
                solver.linearise(&nominal).map_or_else(
                    || self.no_sensitivity(Status::Singular),
                    |linearised| Sensitivity {
                        output: self.output_sensitivity(&linearised, &nominal),
                        status: self.status_of(&linearised, &nominal),
                    },
                )
            },
            || self.no_sensitivity(Status::NotAssembled),
        )
    }

    /// The maps of a case that has none.
    pub(crate) fn no_sensitivity(&self, status: Status) -> Sensitivity {
        let nan = |columns| DMatrix::from_element(self.size(), columns, f64::NAN);
        Sensitivity { output: Output { parameters: nan(self.n_parameters()), drives: nan(self.n_drives()) }, status }
    }
}
