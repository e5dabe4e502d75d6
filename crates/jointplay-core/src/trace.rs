//! The nominal path over many rows of drive values: each row is reached on the assembly branch of the
//! row before it, a block of rows at a time where they lie close together.

// Kernels must be inlined into callers compiled for a width of vector registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::batch::Follow;
use crate::batch::lanes::LANES;
use crate::batch::simd::{Kernel, dispatch};
use crate::closure::Inputs;
use crate::mechanism::Mechanism;
use crate::solver::{Solver, State};
use crate::status::Status;

/// The estimate of the smallest singular value must clear the limit by this factor, or it is computed.
pub(crate) const CLEAR: f64 = 30.0;
/// Blocks that are traced at once.
const RUN: usize = 512;

/// Nominal coordinates of many configurations; NaN where there are none.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Coordinates of all bodies, configuration after configuration.
    pub coordinates: Vec<f64>,
    /// Outcomes.
    pub status: Vec<Status>,
}

/// One block: the state it starts from and its rows.
struct Block<'t, 'm> {
    follow: &'t Follow<'m>,
    from: State,
    drives: &'t [f64],
}

/// A row's coordinates and estimate of the smallest singular value.
type Row = Option<(Vec<f64>, f64)>;

impl Kernel for &Block<'_, '_> {
    type Output = Vec<Row>;

    #[inline(always)]
    fn run(self) -> Vec<Row> {
        let mut rows = Vec::with_capacity(LANES);
        let mut registers = self.follow.workspace();
        let from = vec![&self.from; self.drives.len() / self.from.inputs.drives.len()];
        self.follow.solve(&mut registers, &from, self.drives, |_, row| {
            rows.push(row.map(|(coordinates, clear)| (coordinates.to_vec(), clear)));
        });
        rows
    }
}

impl Mechanism {
    /// Nominal coordinates for `n` rows of drive values, given one after the other.
    #[must_use]
    pub fn trace(&self, n: usize, drives: &[f64]) -> Trace {
        if self.n_rows() != self.n_unknowns() {
            return self.trace_on_bases(n, drives);
        }
        let width = self.n_drives();
        let rows = |from: usize, to: usize| &drives[from * width..to * width];
        let mut trace = Trace::default();
        let first = if n > 0 { self.first_state(rows(0, 1)) } else { None };
        let Some((solver, mut state)) = first else {
            trace.coordinates.resize(n * self.n_coordinates(), f64::NAN);
            trace.status.resize(n, Status::NotAssembled);
            return trace;
        };
        // A handful of rows is solved before the program is recorded; a structure has nothing to follow.
        let follow = if n >= LANES && width > 0 { Follow::record(&solver) } else { None };
        for start in (0..n).step_by(RUN * LANES) {
            let end = n.min(start + RUN * LANES);
            let found: Vec<Row> = follow.as_ref().map_or_else(
                || vec![None; end - start],
                |follow| {
                    // The first row of every block is followed plainly, the others from it.
                    let anchored: Vec<Block<'_, '_>> = (start..end)
                        .step_by(LANES)
                        .map(|first| {
                            let inputs = Inputs::nominal(self, rows(first, first + 1));
                            if let Ok(next) = solver.follow(&state, &inputs) {
                                state = next;
                            }
                            Block { follow, from: state.clone(), drives: rows(first, end.min(first + LANES)) }
                        })
                        .collect();
                    anchored.par_iter().flat_map_iter(dispatch).collect()
                },
            );
            for (k, row) in found.into_iter().enumerate() {
                self.add_row(&solver, &mut state, row, rows(start + k, start + k + 1), &mut trace);
            }
        }
        trace
    }

    /// Adds one row, followed plainly from the last one where the block is in doubt.
    fn add_row(&self, solver: &Solver<'_>, last: &mut State, row: Row, drives: &[f64], trace: &mut Trace) {
        if let Some((coordinates, clear)) = row
            && clear >= CLEAR * self.singular_value
        {
            trace.coordinates.extend(coordinates);
            trace.status.push(Status::Ok);
            return;
        }
        let followed = solver.follow(last, &Inputs::nominal(self, drives)).or_else(|status| {
            let other = match status {
                // No branch leads on from a singular state: the guess chooses one anew.
                Status::Singular => self.first_state(drives).map(|(_, state)| state),
                _ => self.dead_centre(last, drives),
            };
            other.ok_or(status)
        });
        match followed {
            Ok(next) => {
                let status = self.nominal_status(&next);
                trace.coordinates.extend(&next.coordinates);
                trace.status.push(status);
                // The path goes on from the last regular state: at a singular one it may fork.
                if status == Status::Ok {
                    *last = next;
                }
            }
            Err(status) => {
                trace.coordinates.resize(trace.coordinates.len() + self.n_coordinates(), f64::NAN);
                trace.status.push(status);
            }
        }
    }
}
