//! First assembly, the nominal path of the drives, inverse kinematics and nearness to singularity.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::closure::Inputs;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::sensitivity::Output;
use crate::solver::{Solver, State, scaled_size};
use crate::space::Component;
use crate::status::Status;

/// Damped steps of the first assembly.
const ASSEMBLY_STEPS: usize = 200;
/// Residual (in characteristic lengths and radians) of an assembled mechanism.
const ASSEMBLED: f64 = 1e-11;
/// Smallest pivot, as a part of the largest, of a mechanism that is plainly not singular.
const REGULAR: f64 = 1e-8;
/// Unknowns beyond which dense matrices are avoided.
const LARGE: usize = 240;
/// Gauss-Newton steps per target of the inverse kinematics.
const INVERSE_STEPS: usize = 200;

/// The result of a first assembly.
#[derive(Clone, Debug)]
pub struct Assembly {
    /// Coordinates of all bodies.
    pub coordinates: Vec<f64>,
    /// Largest residual, in characteristic lengths and radians.
    pub residual: f64,
    /// Whether the rows are satisfied.
    pub converged: bool,
}

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
    /// The closure Jacobian with lengths as they are: rows by unknowns.
    #[must_use]
    pub fn jacobian(&self, coordinates: &[f64]) -> DMatrix<f64> {
        self.dense(coordinates, &vec![0.0; self.n_drives()]).1
    }

    /// What joints and drives are off by at given coordinates, row by row.
    #[must_use]
    pub fn gaps(&self, coordinates: &[f64], drives: &[f64]) -> Vec<f64> {
        self.dense(coordinates, drives).0.as_slice().to_vec()
    }

    fn dense(&self, coordinates: &[f64], drives: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let size = self.size();
        let mut residual = vec![0.0; self.n_rows()];
        let mut derivatives = vec![0.0; 2 * size * self.n_rows()];
        self.evaluate(
            &self.poses(coordinates),
            &Inputs::nominal(self, drives).commands(),
            &mut residual,
            &mut derivatives,
        );
        let mut matrix = DMatrix::zeros(self.n_rows(), self.n_unknowns());
        for row in 0..self.n_rows() {
            for (side, body) in self.row_bodies(row).into_iter().enumerate() {
                let Some(b) = body else { continue };
                for c in 0..size {
                    matrix[(row, b * size + c)] += derivatives[(2 * row + side) * size + c];
                }
            }
        }
        (DVector::from_vec(residual), matrix)
    }

    /// Residual and Jacobian with every length divided by the characteristic one.
    pub(crate) fn scaled(&self, coordinates: &[f64], drives: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (mut residual, mut matrix) = self.dense(coordinates, drives);
        for (k, row) in self.rows.iter().enumerate() {
            if matches!(row.component, Component::Along(_)) {
                residual[k] /= self.length;
                matrix.row_mut(k).scale_mut(1.0 / self.length);
            }
        }
        for j in 0..self.n_unknowns() {
            if matches!(self.space.components()[j % self.size()], Component::Along(_)) {
                matrix.column_mut(j).scale_mut(self.length);
            }
        }
        (residual, matrix)
    }

    /// Brings the bodies together from the guess by damped steps of least norm; works for any number
    /// of rows. `held` rows are the joints' and, if asked, the drives'.
    #[must_use]
    pub fn assemble(&self, drives: &[f64], hold_drives: bool) -> Assembly {
        self.assemble_from(self.guess(), drives, hold_drives)
    }

    /// The same from given coordinates.
    pub(crate) fn assemble_from(&self, coordinates: Vec<f64>, drives: &[f64], hold_drives: bool) -> Assembly {
        if hold_drives && self.n_unknowns() > LARGE && self.n_rows() == self.n_unknowns() {
            return self.assemble_large(coordinates, drives);
        }
        let rows = if hold_drives { self.n_rows() } else { self.n_rows() - self.n_drives };
        self.close_in(coordinates, |c: &[f64]| {
            let (r, j) = self.scaled(c, drives);
            (r.rows(0, rows).into_owned(), j.rows(0, rows).into_owned())
        })
    }

    /// Damped Newton steps of least norm from given coordinates on length-scaled equations and their Jacobian.
    pub(crate) fn close_in(
        &self,
        mut coordinates: Vec<f64>,
        equations: impl Fn(&[f64]) -> (DVector<f64>, DMatrix<f64>),
    ) -> Assembly {
        let (mut residual, mut matrix) = equations(&coordinates);
        for _ in 0..ASSEMBLY_STEPS {
            if residual.amax() <= ASSEMBLED * 1e-3 {
                break;
            }
            let svd = matrix.clone().svd(true, true);
            let Ok(step) = svd.solve(&residual, 1e-9 * svd.singular_values.max()) else { break };
            let mut part = (0.5 / step.amax()).min(1.0);
            let improved = loop {
                let mut trial = coordinates.clone();
                let unit = |j: usize| self.unit(self.space.components()[j % self.size()]);
                let twists: Vec<f64> = step.iter().enumerate().map(|(j, s)| -part * s * unit(j)).collect();
                self.retract(&mut trial, &twists);
                let (r, j) = equations(&trial);
                if r.norm() < residual.norm() {
                    (coordinates, residual, matrix) = (trial, r, j);
                    break true;
                }
                part *= 0.5;
                if part < 1e-6 {
                    break false;
                }
            };
            if !improved {
                break;
            }
        }
        let largest = residual.amax();
        Assembly { coordinates, residual: largest, converged: largest <= ASSEMBLED }
    }

    /// Whether joints and drives decide every pose just once where the mechanism goes together at the
    /// given drive values.
    #[must_use]
    pub fn is_regular(&self, drives: &[f64]) -> bool {
        if self.n_rows() != self.n_unknowns() {
            return false;
        }
        let assembly = self.assemble(drives, true);
        let plan = Solver::new(self, &assembly.coordinates).plan;
        assembly.converged && plan.is_some_and(|plan| self.n_unknowns() == 0 || plan.smallest_pivot() > REGULAR)
    }

    /// The same for a large mechanism with as many rows as unknowns: damped Newton steps by sparse
    /// elimination.
    fn assemble_large(&self, mut coordinates: Vec<f64>, drives: &[f64]) -> Assembly {
        let solver = Solver::new(self, &coordinates);
        let inputs = Inputs::nominal(self, drives);
        let mut residual = solver.residual(&coordinates, &inputs);
        for _ in 0..ASSEMBLY_STEPS {
            if residual <= ASSEMBLED * 1e-3 {
                break;
            }
            let Some(step) = solver.newton_step(&coordinates, &inputs) else { break };
            let mut part = (0.5 / scaled_size(self, &step)).min(1.0);
            let improved = loop {
                let mut trial = coordinates.clone();
                let scaled: Vec<f64> = step.iter().map(|s| part * s).collect();
                self.retract(&mut trial, &scaled);
                let next = solver.residual(&trial, &inputs);
                if next < residual {
                    (coordinates, residual) = (trial, next);
                    break true;
                }
                part *= 0.5;
                if part < 1e-6 {
                    break false;
                }
            };
            if !improved {
                break;
            }
        }
        Assembly { coordinates, residual, converged: residual <= ASSEMBLED }
    }

    /// The value of a drive's coordinate, continued from a nearby value over full turns.
    fn drive_value(&self, drive: usize, coordinates: &[f64], near: f64) -> f64 {
        let row = self.driven_rows[drive];
        let value = self.joint_value(row, &self.poses(coordinates), &vec![0.0; self.n_parameters()]);
        match self.rows[row].component {
            Component::Along(_) => value,
            Component::About(_) => value + std::f64::consts::TAU * ((near - value) / std::f64::consts::TAU).round(),
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
        let assembly = self.assemble_from(near.coordinates.clone(), drives, true);
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

    /// Smallest singular value of the length-scaled closure Jacobian, and its motion (length-scaled).
    ///
    /// A large mechanism's is found by inverse iteration on the sparse factors.
    pub(crate) fn singular_value_at(&self, state: &State) -> (f64, Vec<f64>) {
        if self.n_unknowns() > LARGE && self.n_rows() == self.n_unknowns() {
            let solver = Solver::new(self, &state.coordinates);
            return solver.inverse_iteration(state).unwrap_or_else(|| (0.0, vec![0.0; self.n_unknowns()]));
        }
        let (_, matrix) = self.scaled(&state.coordinates, &state.inputs.drives);
        let svd = matrix.svd(false, true);
        let (index, value) = svd.singular_values.argmin();
        (value, svd.v_t.map_or_else(Vec::new, |v_t| v_t.row(index).iter().copied().collect()))
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

    /// Finds the drive values that bring the output to every target, least squares over the components
    /// with a positive weight, keeping to the assembly branch of the guess. Drives start at `start`.
    #[must_use]
    pub fn inverse(&self, targets: &[Vec<f64>], weights: &[f64], start: &[f64]) -> Vec<Configuration> {
        if self.n_rows() != self.n_unknowns() {
            return self.inverse_on_basis(targets, weights, start);
        }
        let Some((solver, mut state)) = self.first_state(start) else {
            return targets.iter().map(|_| self.unsolved(Status::NotAssembled)).collect();
        };
        targets
            .iter()
            .map(|target| match self.reach(&solver, &state, target, weights) {
                Ok((next, mismatch)) => {
                    let asked = weights.iter().filter(|w| **w > 0.0).count();
                    let missed = asked <= self.n_drives && mismatch > 1e-9 * self.length;
                    if missed {
                        return self.unsolved(Status::NotAssembled);
                    }
                    let reached = Configuration { mismatch, ..self.judge(next) };
                    // From a singular pose the branches part: the next target is reached from the last one before.
                    if let (Status::Ok, Some(regular)) = (reached.status, &reached.state) {
                        state.clone_from(regular);
                    }
                    reached
                }
                Err(status) => self.unsolved(status),
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
        for _ in 0..INVERSE_STEPS {
            let linearised = solver.linearise(&state).ok_or(Status::Singular)?;
            let Output { drives, .. } = self.output_sensitivity(&linearised, &state);
            let map =
                DMatrix::from_fn(weights.len(), self.n_drives, |i, d| weights[i] * drives[(i, d)] * drive_unit(d));
            let svd = map.svd(true, true);
            let step = svd.solve(&error, 1e-9 * svd.singular_values.max()).map_err(|_| Status::Singular)?;
            let mut part = (0.3 / step.amax()).min(1.0);
            // The last Gauss-Newton step: what is left is its square, or rounding.
            let last = step.amax() < 1e-10;
            loop {
                let values: Vec<f64> =
                    state.inputs.drives.iter().enumerate().map(|(d, q)| q + part * step[d] * drive_unit(d)).collect();
                let next = solver.follow(&state, &Inputs::nominal(self, &values)).ok();
                if let Some(next) = next {
                    let next_error = gap(&next);
                    if last || next_error.norm() < error.norm() {
                        (state, error) = (next, next_error);
                        break;
                    }
                }
                part *= 0.5;
                if part < 1e-5 {
                    return Ok((state, error.norm()));
                }
            }
            if last {
                break;
            }
        }
        Ok((state, error.norm()))
    }

    /// A nominal state from its coordinates; drive values are read off near the given ones.
    pub(crate) fn restore(&self, solver: &Solver<'_>, coordinates: &[f64], near: &[f64]) -> Option<State> {
        if coordinates.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let drives = self.drive_values(coordinates, near);
        let inputs = Inputs::nominal(self, &drives);
        // A singular state cannot be polished; it is judged by its Jacobian later.
        let given = || State { coordinates: coordinates.to_vec(), inputs: inputs.clone(), negative: false };
        Some(solver.polish(coordinates, &inputs).unwrap_or_else(given))
    }
}
