//! First assembly from a rough guess, and the dense length-scaled Jacobian that it steps by.

use nalgebra::{DMatrix, DVector};

use crate::closure::equations::{Command, Inputs};
use crate::closure::newton::{Solver, State};
use crate::interrupt;
use crate::math::decomposition::singular_values;
use crate::math::space::{Component, Pose};
use crate::mechanism::Mechanism;

/// Damped steps of the first assembly.
const ASSEMBLY_STEPS: usize = 200;
/// The largest of these steps, in characteristic lengths and radians.
const ASSEMBLY_MOVE: f64 = 0.5;
/// Residual (in characteristic lengths and radians) of an assembled mechanism.
pub(crate) const ASSEMBLED: f64 = 1e-11;
/// A singular value is taken for zero below this part of the largest.
const NEGLIGIBLE: f64 = 1e-9;
/// Condition number up to which elimination is as good as singular values.
const PLAINLY_REGULAR: f64 = 1e6;
/// A step that lowers the residual by less than this part may be in vain, ...
const SMALL_GAIN: f64 = 0.01;
/// ... where the residual is above this. Below, the drives may be beyond a dead centre by their rounding only.
const FAR_FROM_ASSEMBLED: f64 = 1e3 * ASSEMBLED;
/// Unknowns beyond which dense matrices are avoided.
const LARGE: usize = 240;
/// Unknowns up to which all singular values of the dense matrix take no longer than the smallest alone.
const DENSE: usize = 60;
/// An inverse iteration that leaves less than this part of it has it.
const CONVERGED: f64 = 1e-10;

/// When a search for an assembled pose is given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Search {
    /// Where no part of a step lowers the residual.
    Thorough,
    /// For many searches that nearly all end in vain: where two steps gain little, too, the later one less.
    ///
    /// Where there is nothing to be found, the steps become longer and longer and smaller and smaller parts of them are
    /// taken, until they end in another mode of motion far away, or nowhere. At a singular state each step takes away
    /// more than half of the residual, and on the way to it gains grow.
    Quick,
}

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

impl Mechanism {
    /// The closure Jacobian with lengths as they are: rows by unknowns.
    #[must_use]
    pub fn jacobian(&self, coordinates: &[f64]) -> DMatrix<f64> {
        self.dense(coordinates, &vec![0.0; self.n_drives()]).1
    }

    /// The same for many configurations, coordinates given one after the other; row by row.
    #[must_use]
    pub fn jacobians(&self, coordinates: &[f64]) -> Vec<f64> {
        let by_rows = |at: &[f64]| self.jacobian(at).transpose().as_slice().to_vec();
        coordinates.chunks_exact(self.n_coordinates().max(1)).flat_map(by_rows).collect()
    }

    /// What joints and drives are off by at given coordinates, row by row.
    #[must_use]
    pub fn gaps(&self, coordinates: &[f64], drives: &[f64]) -> Vec<f64> {
        self.dense(coordinates, drives).0.as_slice().to_vec()
    }

    fn dense(&self, coordinates: &[f64], drives: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        self.dense_at(&self.poses(coordinates), &Inputs::nominal(self, drives))
    }

    /// Residual and closure Jacobian with lengths as they are.
    pub(crate) fn dense_at(&self, poses: &[Pose<f64>], inputs: &Inputs<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let size = self.size();
        let (residual, derivatives) = self.evaluated(poses, &inputs.commands(self));
        let mut matrix = DMatrix::zeros(self.n_rows(), self.n_unknowns());
        for row in 0..self.n_rows() {
            for (side, body) in self.row_bodies(row).into_iter().enumerate() {
                let Some(b) = body else { continue };
                for c in 0..size {
                    matrix[(row, b * size + c)] += derivatives[self.side(row, side) * size + c];
                }
            }
        }
        (DVector::from_vec(residual), matrix)
    }

    /// Residual with every length divided by the characteristic one.
    pub(crate) fn scaled_residual(
        &self,
        coordinates: &[f64],
        commands: &Inputs<Command<f64>, f64>,
    ) -> impl Iterator<Item = f64> {
        let (residual, _) = self.evaluated(&self.poses(coordinates), commands);
        residual.into_iter().zip(&self.rows).map(|(r, row)| r / self.unit(row.component))
    }

    /// Jacobian with every length divided by the characteristic one.
    pub(crate) fn scaled(&self, coordinates: &[f64], drives: &[f64]) -> DMatrix<f64> {
        let (_, mut matrix) = self.dense(coordinates, drives);
        self.scale(&mut matrix, self.length);
        matrix
    }

    /// The closure Jacobian with every length divided by a given one.
    pub(crate) fn scaled_jacobian(&self, coordinates: &[f64], length: f64) -> DMatrix<f64> {
        let mut matrix = self.jacobian(coordinates);
        self.scale(&mut matrix, length);
        matrix
    }

    fn scale(&self, matrix: &mut DMatrix<f64>, length: f64) {
        for (k, row) in self.rows.iter().enumerate() {
            if matches!(row.component, Component::Along(_)) {
                matrix.row_mut(k).scale_mut(1.0 / length);
            }
        }
        for j in 0..self.n_unknowns() {
            if matches!(self.space.components()[j % self.size()], Component::Along(_)) {
                matrix.column_mut(j).scale_mut(length);
            }
        }
    }

    /// Brings the bodies together from the guess by damped steps of least norm; works for any number
    /// of rows. `held` rows are the joints' and, if asked, the drives'.
    #[must_use]
    pub fn assemble(&self, drives: &[f64], hold_drives: bool) -> Assembly {
        self.assemble_from(self.guess(), drives, hold_drives)
    }

    /// The same from given coordinates.
    pub(crate) fn assemble_from(&self, coordinates: Vec<f64>, drives: &[f64], hold_drives: bool) -> Assembly {
        self.assemble_by(coordinates, drives, hold_drives, Search::Thorough)
    }

    /// The same with the drives held, by a quick search.
    pub(crate) fn assemble_quickly(&self, coordinates: Vec<f64>, drives: &[f64]) -> Assembly {
        self.assemble_by(coordinates, drives, true, Search::Quick)
    }

    fn assemble_by(&self, coordinates: Vec<f64>, drives: &[f64], hold_drives: bool, search: Search) -> Assembly {
        if hold_drives && self.n_unknowns() > LARGE && self.n_rows() == self.n_unknowns() {
            return self.assemble_large(coordinates, drives);
        }
        let rows = if hold_drives { self.n_rows() } else { self.n_rows() - self.n_driven };
        let commands = Inputs::nominal(self, drives).commands(self);
        self.close_in(
            coordinates,
            |c: &[f64]| DVector::from_iterator(rows, self.scaled_residual(c, &commands).take(rows)),
            |c: &[f64]| self.scaled(c, drives).rows(0, rows).into_owned(),
            search,
        )
    }

    /// Damped Newton steps of least norm from given coordinates on length-scaled equations and their Jacobian.
    pub(crate) fn close_in(
        &self,
        mut coordinates: Vec<f64>,
        equations: impl Fn(&[f64]) -> DVector<f64>,
        jacobian: impl Fn(&[f64]) -> DMatrix<f64>,
        search: Search,
    ) -> Assembly {
        let mut residual = equations(&coordinates);
        let mut last_gain = f64::INFINITY;
        for _ in 0..ASSEMBLY_STEPS {
            interrupt::check();
            if residual.amax() <= ASSEMBLED * 1e-3 {
                break;
            }
            let Some(step) = least_norm_by_elimination(jacobian(&coordinates), &residual) else { break };
            let mut part = (ASSEMBLY_MOVE.min(self.largest_move) / step.amax()).min(1.0);
            let size = residual.norm();
            let improved = loop {
                let mut trial = coordinates.clone();
                let unit = |j: usize| self.unit(self.space.components()[j % self.size()]);
                let twists: Vec<f64> = step.iter().enumerate().map(|(j, s)| -part * s * unit(j)).collect();
                self.retract(&mut trial, &twists);
                let r = equations(&trial);
                if r.norm() < size {
                    (coordinates, residual) = (trial, r);
                    break true;
                }
                part *= 0.5;
                if part < 1e-6 {
                    break false;
                }
            };
            let left = residual.norm();
            let gain = 1.0 - left / size;
            let is_in_vain = gain < last_gain && last_gain < SMALL_GAIN && left > FAR_FROM_ASSEMBLED;
            if !improved || search == Search::Quick && is_in_vain {
                break;
            }
            last_gain = gain;
        }
        let largest = residual.amax();
        Assembly { coordinates, residual: largest, converged: largest <= ASSEMBLED }
    }

    /// The same for a large mechanism with as many rows as unknowns: damped Newton steps by sparse
    /// elimination.
    fn assemble_large(&self, mut coordinates: Vec<f64>, drives: &[f64]) -> Assembly {
        let solver = Solver::new(self, &coordinates);
        let inputs = Inputs::nominal(self, drives);
        let mut residual = solver.residual(&coordinates, &inputs);
        for _ in 0..ASSEMBLY_STEPS {
            interrupt::check();
            if residual <= ASSEMBLED * 1e-3 {
                break;
            }
            let Some(step) = solver.newton_step(&coordinates, &inputs) else { break };
            let mut part = (ASSEMBLY_MOVE.min(self.largest_move) / self.scaled_size(&step)).min(1.0);
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

    /// Smallest singular value of the length-scaled closure Jacobian, and its motion (length-scaled).
    ///
    /// That of more than a few bodies is found by inverse iteration on the sparse factors.
    pub(crate) fn singular_value_at(&self, state: &State) -> (f64, Vec<f64>) {
        interrupt::check();
        if self.n_unknowns() > DENSE && self.n_rows() == self.n_unknowns() {
            let solver = Solver::new(self, &state.coordinates);
            let linearised = solver.linearise(state);
            let found = linearised.map(|linearised| self.inverse_iteration(&linearised.factors, CONVERGED));
            if found.is_some() || self.n_unknowns() > LARGE {
                return found.unwrap_or_else(|| (0.0, vec![0.0; self.n_unknowns()]));
            }
        }
        let matrix = self.scaled(&state.coordinates, &state.inputs.drives);
        let Some(svd) = singular_values(matrix, false, true) else { return (0.0, vec![0.0; self.n_unknowns()]) };
        let (index, value) = svd.singular_values.argmin();
        (value, svd.v_t.map_or_else(Vec::new, |v_t| v_t.row(index).iter().copied().collect()))
    }
}

/// The vector of least norm that a matrix takes nearest to `right`; `None` where a number is not finite.
fn least_norm(matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let svd = singular_values(matrix, true, true)?;
    svd.solve(right, NEGLIGIBLE * svd.singular_values.max()).ok()
}

/// The same up to rounding, and much cheaper where the matrix has no more rows than columns and is plainly regular: no
/// singular value is negligible then. The norms bound the ratio of the singular values from above.
fn least_norm_by_elimination(matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    if matrix.nrows() <= matrix.ncols() {
        // What is square needs no product, which squares the ratio.
        let (square, most) = if matrix.is_square() {
            (matrix.clone(), PLAINLY_REGULAR)
        } else {
            (&matrix * matrix.transpose(), 100.0 * PLAINLY_REGULAR)
        };
        let size = square.norm();
        // Written so that NaN fails, too.
        if let Some(inverse) = square.try_inverse().filter(|inverse| inverse.norm() * size <= most) {
            let solved = inverse * right;
            return Some(if matrix.is_square() { solved } else { matrix.tr_mul(&solved) });
        }
    }
    least_norm(matrix, right)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        (a - b).amax() / b.amax()
    }

    #[test]
    fn elimination_gives_the_vector_of_least_norm() {
        let regular = DMatrix::from_fn(6, 6, |i, j| ((7 * i * i + 3 * j + i * j) as f64).sin());
        let right = DVector::from_fn(6, |i, _| 1.0 - i as f64);
        let step = |of: &DMatrix<f64>| least_norm_by_elimination(of.clone(), &right).expect("finite");
        let exact = least_norm(regular.clone(), &right).expect("finite");
        assert!(distance(&step(&regular), &exact) < 1e-12);
        // Of a singular matrix the very same.
        let mut singular = regular.clone();
        singular.set_column(5, &regular.column(4).into_owned());
        assert_eq!(step(&singular), least_norm(singular.clone(), &right).expect("finite"));
        let wide = DMatrix::from_fn(6, 8, |i, j| ((5 * i + 3 * j * j) as f64).cos());
        assert!(distance(&step(&wide), &least_norm(wide.clone(), &right).expect("finite")) < 1e-12);
        let tall = wide.transpose();
        let right_of_tall = DVector::from_fn(8, |i, _| i as f64);
        let found = least_norm_by_elimination(tall.clone(), &right_of_tall).expect("finite");
        assert_eq!(found, least_norm(tall, &right_of_tall).expect("finite"));
        assert!(least_norm_by_elimination(DMatrix::from_element(6, 6, f64::NAN), &right).is_none());
    }
}
