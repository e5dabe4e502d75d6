//! Inverse kinematics: the drive values that bring the output to its targets.

use nalgebra::{DMatrix, DVector};

use crate::closure::assembly::ASSEMBLED;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Budget, Solver, State};
use crate::closure::sensitivity::Output;
use crate::math::decomposition::singular_values;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;
use crate::nominal::path::Configuration;

/// Gauss-Newton steps per target.
const STEPS: usize = 200;
/// Part of the characteristic length by which the output may miss a target that it has reached.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Newton steps of the closure per target. Ordinary targets take some tens; one that cannot be reached would be
/// approached along the edge of what can be assembled, by one vain continuation after the other.
const WORK: usize = 3_000;

impl Mechanism {
    /// Finds the drive values that bring the output to every target, least squares over the components
    /// with a positive weight, keeping to the assembly branch of the guess. Drives start at `start`.
    #[must_use]
    pub fn inverse(&self, targets: &[Vec<f64>], weights: &[f64], start: &[f64]) -> Vec<Configuration> {
        if self.n_rows() != self.n_unknowns() {
            return self.inverse_on_basis(targets, weights, start);
        }
        let Some((solver, mut state)) = self.first_state(start) else {
            return targets.iter().map(|_| Self::unsolved(Status::NotAssembled)).collect();
        };
        targets
            .iter()
            .map(|target| match self.reach(&solver, &state, target, weights) {
                Ok((next, mismatch)) => {
                    let asked = weights.iter().filter(|w| **w > 0.0).count();
                    let missed = asked <= self.n_drives && mismatch > 1e-9 * self.length;
                    if missed {
                        return Self::unsolved(Status::NotAssembled);
                    }
                    let reached = Configuration { status: solver.status_at(&next), state: Some(next), mismatch };
                    // From a singular pose the branches part: the next target is reached from the last one before.
                    if let (Status::Ok, Some(regular)) = (reached.status, &reached.state) {
                        state.clone_from(regular);
                    }
                    reached
                }
                Err(status) => Self::unsolved(status),
            })
            .collect()
    }

    /// The state at a target with the distance that is left, from a state or, where that is singular, from
    /// one beside it.
    fn reach(
        &self,
        solver: &Solver<'_>,
        from: &State,
        target: &[f64],
        weights: &[f64],
    ) -> Result<(State, f64), Status> {
        if solver.linearise(from).is_some() {
            return self.approach(solver, from, target, weights);
        }
        let here = self.output_difference(&self.output(&from.coordinates, &from.inputs), target);
        let away = |(gap, weight): (&f64, &f64)| *weight > 0.0 && gap.abs() > ASSEMBLED * self.length;
        if !here.iter().zip(weights).any(away) {
            return Ok((from.clone(), 0.0));
        }
        let beside = self.off_singular(solver, from, target, weights).ok_or(Status::Singular)?;
        self.approach(solver, &beside, target, weights)
    }

    /// Gauss-Newton on the drives with the loops closed at every step.
    fn approach(
        &self,
        solver: &Solver<'_>,
        from: &State,
        target: &[f64],
        weights: &[f64],
    ) -> Result<(State, f64), Status> {
        let drive_unit = |d: usize| self.unit(self.rows[self.driven_rows[d]].component);
        let gap = |state: &State| {
            let gaps = self.output_difference(&self.output(&state.coordinates, &state.inputs), target);
            let weighed = gaps.iter().zip(weights).map(|(gap, w)| if *w > 0.0 { w * gap } else { 0.0 });
            DVector::from_iterator(weights.len(), weighed)
        };
        let mut state = from.clone();
        let mut error = gap(&state);
        if self.n_drives == 0 {
            // A structure is where it is.
            return Ok((state, error.norm()));
        }
        let mut budget = Budget::of(WORK);
        for _ in 0..STEPS {
            let linearised = solver.linearise(&state).ok_or(Status::Singular)?;
            let Output { drives, .. } = self.output_sensitivity(&linearised, &state);
            let map =
                DMatrix::from_fn(weights.len(), self.n_drives, |i, d| weights[i] * drives[(i, d)] * drive_unit(d));
            let svd = singular_values(map, true, true).ok_or(Status::Singular)?;
            let step = svd.solve(&error, 1e-9 * svd.singular_values.max()).map_err(|_| Status::Singular)?;
            let mut part = (0.3 / step.amax()).min(1.0);
            // The last Gauss-Newton step: what is left is its square, or rounding.
            let last = step.amax() < 1e-10;
            loop {
                let values: Vec<f64> =
                    state.inputs.drives.iter().enumerate().map(|(d, q)| q + part * step[d] * drive_unit(d)).collect();
                let next = solver.follow_within(&state, &Inputs::nominal(self, &values), &mut budget).ok();
                if let Some(next) = next {
                    let next_error = gap(&next);
                    if last || next_error.norm() < error.norm() {
                        (state, error) = (next, next_error);
                        break;
                    }
                }
                part *= 0.5;
                if part < 1e-5 || budget.is_spent() {
                    return Ok((state, error.norm()));
                }
            }
            if last || error.norm() <= ROUNDING * self.length {
                break;
            }
        }
        Ok((state, error.norm()))
    }
}
