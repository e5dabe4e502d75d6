//! The nominal path of an over-constrained mechanism: that of its basis, and of another one where the basis
//! becomes singular while all rows together do not.

use std::sync::Arc;

use crate::closure::equations::Inputs;
use crate::closure::newton::State;
use crate::mechanism::Mechanism;
use crate::nominal::path::Configuration;
use crate::nominal::trace::Trace;
use crate::redundancy::basis::Basis;

impl Mechanism {
    /// Nominal coordinates for `n` rows of drive values, given one after the other.
    pub(crate) fn trace_on_bases(&self, n: usize, drives: &[f64]) -> Trace {
        let width = self.n_drives();
        let mut trace = Trace::default();
        let mut basis = match self.basis() {
            Ok(basis) => basis,
            Err(status) => {
                trace.coordinates.resize(n * self.n_coordinates(), f64::NAN);
                trace.status.resize(n, status);
                return trace;
            }
        };
        while trace.status.len() < n {
            let start = trace.status.len();
            let rest = basis.kept.trace(n - start, &drives[start * width..]);
            basis = self.keep(&basis, &rest, &drives[start * width..], &mut trace);
        }
        trace
    }

    /// Keeps the rows of a basis' path up to where another basis is better; gives that one.
    fn keep(&self, basis: &Arc<Basis>, rest: &Trace, drives: &[f64], trace: &mut Trace) -> Arc<Basis> {
        let (width, numbers) = (self.n_drives(), self.n_coordinates());
        let mut solver = None;
        for (k, (coordinates, status)) in rest.coordinates.chunks_exact(numbers).zip(&rest.status).enumerate() {
            let state = coordinates.iter().all(|c| c.is_finite()).then(|| State {
                coordinates: coordinates.to_vec(),
                inputs: Inputs::nominal(&basis.kept, &drives[k * width..(k + 1) * width]),
                negative: false,
            });
            let doubtful = match &state {
                None => true,
                Some(state) => {
                    let solver = solver.get_or_insert_with(|| basis.solver(coordinates));
                    !self.plainly_regular(basis, solver, state) && self.outgrown(basis, state)
                }
            };
            // The first row was begun with this basis because no other is better there.
            if doubtful && k > 0 {
                let last = &rest.coordinates[(k - 1) * numbers..k * numbers];
                let at = state.as_ref().map_or(last, |state| &state.coordinates);
                if let Ok(other) = self.basis_at(at)
                    && other.rows != basis.rows
                {
                    return Arc::new(other);
                }
            }
            trace.coordinates.extend_from_slice(coordinates);
            trace.status.push(match &state {
                Some(state) => self.nominal_status(state),
                None => *status,
            });
        }
        Arc::clone(basis)
    }

    /// The inverse kinematics on the basis, judged by all rows.
    pub(crate) fn inverse_on_basis(&self, targets: &[Vec<f64>], weights: &[f64], start: &[f64]) -> Vec<Configuration> {
        match self.basis() {
            Ok(basis) => {
                let found = basis.kept.inverse(targets, weights, start);
                found.into_iter().map(|c| self.judged_anew(c)).collect()
            }
            Err(status) => targets.iter().map(|_| Self::unsolved(status)).collect(),
        }
    }

    fn judged_anew(&self, found: Configuration) -> Configuration {
        let Some(State { coordinates, inputs, negative }) = found.state else { return found };
        // Those of drives that the basis leaves out, too.
        let inputs = Inputs::nominal(self, &self.drive_values(&coordinates, &inputs.drives));
        let state = State { coordinates, inputs, negative };
        Configuration { status: self.nominal_status(&state), state: Some(state), mismatch: found.mismatch }
    }
}
