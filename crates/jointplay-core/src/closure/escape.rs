//! Away from a singular pose, where the drives do not lead.
//!
//! Where a mechanism is drawn in a singular pose its drives cannot be linearised. What is asked for is a pose of
//! the output, and the joints together with the output's components usually decide the bodies there: they
//! are moved a little towards the target, from where the drives lead on.

use nalgebra::{DMatrix, DVector};

use crate::closure::assembly::Search;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// Parts of the way to the target that are tried, until one leads out.
const PARTS: [f64; 3] = [0.01, 0.1, 1.0];

impl Mechanism {
    /// A state from which the drives lead on, on the way from a singular one to a target of the output's
    /// components with a positive weight.
    pub(crate) fn off_singular(
        &self,
        solver: &Solver<'_>,
        from: &State,
        target: &[f64],
        weights: &[f64],
    ) -> Option<State> {
        let regular = |state: &State| {
            solver.linearise(state).is_some_and(|linearised| self.status_of(&linearised, state) == Status::Ok)
        };
        let led = |part: f64| self.led(solver, from, target, weights, part);
        PARTS.into_iter().filter_map(led).find(regular)
    }

    /// The state whose output has gone a part of the way to a target, closed without the drives.
    fn led(&self, solver: &Solver<'_>, from: &State, target: &[f64], weights: &[f64], part: f64) -> Option<State> {
        let joints = self.n_rows() - self.n_driven;
        let asked: Vec<usize> = (0..weights.len()).filter(|&k| weights[k] > 0.0).collect();
        let unit = |k: usize| self.unit(self.space.components()[k % self.size()]);
        let gap = |coordinates: &[f64]| self.output_difference(&self.output(coordinates, &from.inputs), target);
        let before = gap(&from.coordinates);
        let commands = Inputs::nominal(self, &from.inputs.drives).commands(self);
        let equations = |coordinates: &[f64]| {
            let now = gap(coordinates);
            let left = asked.iter().map(|&k| ((1.0 - part) * before[k] - now[k]) / unit(k));
            let closure = self.scaled_residual(coordinates, &commands).take(joints);
            DVector::from_iterator(joints + asked.len(), closure.chain(left))
        };
        let jacobian = |coordinates: &[f64]| {
            let poses = self.poses(coordinates);
            let mut matrix = DMatrix::zeros(joints + asked.len(), self.n_unknowns());
            matrix.rows_mut(0, joints).copy_from(&self.scaled(coordinates, &from.inputs.drives).rows(0, joints));
            for (row, &k) in (joints..).zip(&asked) {
                let twists = self.component_cost(k, &poses, &from.inputs.parameters).twists;
                for (j, along) in twists.into_iter().enumerate() {
                    matrix[(row, j)] = along * unit(j) / unit(k);
                }
            }
            matrix
        };
        let coordinates = self.close_in(from.coordinates.clone(), equations, jacobian, Search::Thorough).coordinates;
        let drives = self.drive_values(&coordinates, &from.inputs.drives);
        solver.polish(&coordinates, &Inputs::nominal(self, &drives))
    }
}
