//! Where the load pushes every joint.
//!
//! Without friction a joint's offset lies where its set supports the transmitted wrench: the pose
//! maximises the work of the load over all admissible offsets. To first order the error is
//! `E = A u` with u those support points; on the exact closure contact and reactions are brought to
//! agree by [`crate::ascent`]. Where a reaction vanishes, or two corners of a guide compete, the load
//! does not decide: the offset is put in the middle of the exposed face, and the half-width of the
//! output's error over all exposed faces is given beside it.

use rayon::prelude::*;

use crate::ascent::{Objective, UNDECIDED};
use crate::closure::Inputs;
use crate::mechanism::Mechanism;
use crate::sensitivity::Gradient;
use crate::solver::{Solver, State};
use crate::space::{Component, Pose};
use crate::status::Status;

/// The load-determined error of one configuration.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Error on the exact closure, per component.
    pub error: Vec<f64>,
    /// Its linearisation at the nominal pose.
    pub error_first_order: Vec<f64>,
    /// Half-width of what the load does not decide, per component.
    pub undetermined: Vec<f64>,
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    pub reaction: Vec<f64>,
    /// The values of all parameters.
    pub offset: Vec<f64>,
    /// Share of every source in the first-order error, source by source, per component.
    pub contribution: Vec<f64>,
    /// Steps until contact and reactions agreed.
    pub steps: usize,
    /// Outcome.
    pub status: Status,
}

/// One configuration to analyse: drive values, and the nominal coordinates that errors refer to.
#[derive(Clone, Debug)]
pub struct Case {
    /// Drive values.
    pub drives: Vec<f64>,
    /// Nominal coordinates of all bodies; not finite where the nominal mechanism is not assembled.
    pub coordinates: Vec<f64>,
}

impl Mechanism {
    /// A solver planned at the first case that is assembled, if any.
    #[must_use]
    pub fn solver(&self, cases: &[Case]) -> Option<Solver<'_>> {
        let assembled = |case: &&Case| case.coordinates.iter().all(|c| c.is_finite());
        cases.iter().find(assembled).map(|case| Solver::new(self, &case.coordinates))
    }

    /// Runs an analysis on every case that is assembled, on all cores; the others get `missing`.
    pub(crate) fn each<T: Send>(
        &self,
        cases: &[Case],
        analysis: impl Fn(&Solver<'_>, usize, &Case, State) -> T + Sync,
        missing: impl Fn() -> T + Sync,
    ) -> Vec<T> {
        let solver = self.solver(cases);
        cases
            .par_iter()
            .enumerate()
            .map(|(number, case)| {
                let state = solver.as_ref().and_then(|s| Some((s, self.restore(s, &case.coordinates, &case.drives)?)));
                state.map_or_else(&missing, |(s, state)| analysis(s, number, case, state))
            })
            .collect()
    }

    /// Error of an output against that of nominal coordinates.
    pub(crate) fn error(&self, state: &State, nominal: &State) -> Vec<f64> {
        let actual = self.output(&state.coordinates, &state.inputs);
        let reference = self.output(&nominal.coordinates, &nominal.inputs);
        actual.iter().zip(&reference).map(|(a, b)| a - b).collect()
    }

    /// The inputs at given drive values with every deviation at its known value and no play taken.
    pub(crate) fn built(&self, drives: &[f64]) -> Inputs<f64> {
        Inputs { drives: drives.to_vec(), parameters: self.centre.clone() }
    }

    /// Whether the nominal state is too near a singular one.
    pub(crate) fn nominal_status(&self, state: &State) -> Status {
        let (value, _) = self.singular_value_at(state);
        if value < self.singular_value { Status::Singular } else { Status::Ok }
    }

    /// The reactions that the multipliers of the closure rows stand for.
    fn reactions(&self, poses: &[Pose<f64>], gradient: &Gradient) -> Vec<f64> {
        let size = self.size();
        let mut reactions = vec![0.0; self.n_joints() * size];
        for (row, l) in self.rows.iter().zip(&gradient.multipliers) {
            let direction = match row.component {
                Component::Along(i) => self.axes(row.joint, poses)[i],
                Component::About(i) => std::array::from_fn(|k| f64::from(u8::from(i == k))),
            };
            for (k, component) in self.space.components().iter().enumerate() {
                let part = match (row.component, component) {
                    (Component::Along(_), Component::Along(i)) | (Component::About(_), Component::About(i)) => {
                        direction[*i]
                    }
                    _ => 0.0,
                };
                reactions[row.joint * size + k] -= l * part;
            }
        }
        reactions
    }

    /// Where the load pushes the output, for every case.
    #[must_use]
    pub fn loaded(&self, cases: &[Case]) -> Vec<Loaded> {
        self.each(
            cases,
            |solver, _, case, nominal| self.loaded_at(solver, case, &nominal),
            || self.no_load_result(Status::NotAssembled),
        )
    }

    fn no_load_result(&self, status: Status) -> Loaded {
        let nan = |n: usize| vec![f64::NAN; n];
        Loaded {
            error: nan(self.size()),
            error_first_order: nan(self.size()),
            undetermined: nan(self.size()),
            reaction: nan(self.n_joints() * self.size()),
            offset: nan(self.n_parameters()),
            contribution: nan(self.sources.len() * self.size()),
            steps: 0,
            status,
        }
    }

    fn loaded_at(&self, solver: &Solver<'_>, case: &Case, nominal: &State) -> Loaded {
        let size = self.size();
        let status = self.nominal_status(nominal);
        let Some(at_nominal) = solver.linearise(nominal) else { return self.no_load_result(Status::Singular) };
        let start = match solver.follow(nominal, &self.built(&case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_load_result(status),
        };
        let Some(summit) = solver.climb(&Objective::Load, start) else { return self.no_load_result(Status::Singular) };

        // First order, at the nominal pose. Drive values that differ from the nominal ones count too.
        let gradient = self.gradient(&at_nominal, self.objective_cost(&Objective::Load, &at_nominal, nominal));
        let offsets = self.pushed(&Objective::Load, &gradient, &self.built(&case.drives));
        let map = self.output_sensitivity(&at_nominal, nominal);
        let mut contribution = vec![0.0; self.sources.len() * size];
        let mut error_first_order = self.drive_shift(&map, case, nominal);
        for i in 0..size {
            for (s, source) in self.sources.iter().enumerate() {
                contribution[s * size + i] =
                    source.range().map(|p| map.parameters[(i, p)] * offsets.parameters[p]).sum();
                error_first_order[i] += contribution[s * size + i];
            }
        }

        let Some(at_summit) = solver.linearise(&summit.state) else { return self.no_load_result(Status::Singular) };
        let map = self.output_sensitivity(&at_summit, &summit.state);
        let tolerance = UNDECIDED * self.force_scale(&summit.gradient);
        let mut undetermined = vec![0.0; size];
        let mut decided = summit.settled;
        for source in self.sources.iter().filter(|s| s.is_clearance) {
            let face = self.exposed(source, &summit.gradient, tolerance);
            decided &= face.is_point();
            for (i, half_width) in undetermined.iter_mut().enumerate() {
                let row: Vec<f64> = source.range().map(|p| map.parameters[(i, p)]).collect();
                *half_width += face.half_width(&row);
            }
        }
        Loaded {
            error: self.error(&summit.state, nominal),
            error_first_order,
            undetermined,
            reaction: self.reactions(&at_summit.poses, &summit.gradient),
            offset: summit.state.inputs.parameters,
            contribution,
            steps: summit.steps,
            status: match status {
                Status::Ok if summit.blocked => Status::Singular,
                Status::Ok if !decided => Status::Undetermined,
                other => other,
            },
        }
    }
}
