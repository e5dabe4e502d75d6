//! The nominal path over many rows of drive values: each row is reached on the assembly branch of the
//! rows before it, a block of rows at a time where they lie close together.

use std::ops::Range;

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Solver, State};
use crate::interrupt;
use crate::math::lanes::block::{Block as Numbers, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::memory::{Fresh, FreshPart};
use crate::math::tasks::in_rooms;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;
use crate::nominal::on_lanes::{Follow, Start};

/// Up to so many rows are traced one after the other; ...
const ONE_RUN: usize = 32 * LANES;
/// ... of more of them, one task traces so many.
const RUN: usize = 8 * LANES;
/// Every so many rows one is traced beforehand; tasks begin from these.
const STRIDE: usize = LANES;
/// Rows before a block among which the nearest one is looked for, ...
const WINDOW: usize = 256;
/// ... for one of so many lanes; the others go on from its choice.
const LOOK: usize = 16;

/// Nominal coordinates of many configurations; NaN where there are none.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Coordinates of all bodies, configuration after configuration.
    pub coordinates: Vec<f64>,
    /// Outcomes.
    pub status: Vec<Status>,
}

impl Trace {
    /// Puts the coordinates in their place in those of all runs; gives the outcomes.
    fn put(&self, rows: FreshPart<'_, f64>) -> Vec<Status> {
        rows.copied(&self.coordinates);
        self.status.clone()
    }
}

/// Rows that are traced one after the other.
struct Run<'t, 'm> {
    solver: &'t Solver<'m>,
    follow: Option<&'t Follow<'m>>,
    from: &'t State,
    n: usize,
    drives: &'t [f64],
    done: &'t mut Traced,
}

/// What has been traced of a run, and the memory for it, which the next run takes over.
#[derive(Default)]
struct Traced {
    trace: Trace,
    /// Whether the determinant of the Jacobian is negative, row by row.
    negative: Vec<bool>,
    registers: Vec<Numbers>,
}

impl Kernel for Run<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Run { solver, follow, from, n, drives, done } = self;
        let m = solver.mechanism;
        let width = m.n_coordinates();
        // Status and determinant of a row tell that it is done; its coordinates are what they were before.
        done.trace.coordinates.resize(n * width, f64::NAN);
        done.trace.status.clear();
        done.negative.clear();
        let scaled = scaled_columns(m, n, drives);
        let rows = Rows { solver, from, drives, scaled: &scaled };
        let Some(follow) = follow else {
            (0..n).for_each(|_| rows.add_plainly(done));
            return;
        };
        let mut registers = std::mem::take(&mut done.registers);
        if registers.is_empty() {
            registers = follow.workspace();
        }
        for first in (0..n).step_by(LANES) {
            interrupt::check();
            let block = first..n.min(first + LANES);
            let nearest = rows.nearest(done, block.clone());
            let (before, found) = done.trace.coordinates.split_at_mut(first * width);
            let starts: Vec<Start<'_>> = nearest.iter().map(|&row| rows.start(before, &done.negative, row)).collect();
            let clear = follow.solve(&mut registers, &starts, rows.drives(block.clone()), found);
            for k in 0..block.len() {
                if clear[k] >= CLEAR * m.singular_value {
                    done.trace.status.push(Status::Ok);
                    done.negative.push(nearest[k].map_or(from.negative, |row| done.negative[row]));
                } else {
                    rows.add_plainly(done);
                }
            }
        }
        done.registers = registers;
    }
}

/// The rows of a run, and where it begins.
#[derive(Clone, Copy)]
struct Rows<'t, 'm> {
    solver: &'t Solver<'m>,
    from: &'t State,
    drives: &'t [f64],
    /// See [`scaled_columns`].
    scaled: &'t [f64],
}

/// The values of every drive one after the other, with lengths as parts of the characteristic one.
fn scaled_columns(m: &Mechanism, n: usize, drives: &[f64]) -> Vec<f64> {
    let width = m.n_drives();
    let column = |d: usize| {
        let unit = 1.0 / m.unit(m.rows[m.driven_rows[d]].component);
        drives.iter().skip(d).step_by(width).take(n).map(move |q| q * unit)
    };
    (0..width).flat_map(column).collect()
}

impl Rows<'_, '_> {
    fn drives(&self, rows: Range<usize>) -> &[f64] {
        let width = self.solver.mechanism.n_drives();
        &self.drives[rows.start * width..rows.end * width]
    }

    /// A row that is done, or where the run begins.
    fn start<'s>(&'s self, coordinates: &'s [f64], negative: &[bool], row: Option<usize>) -> Start<'s> {
        let Some(row) = row else { return Start::of(self.from) };
        let width = self.solver.mechanism.n_coordinates();
        Start {
            coordinates: &coordinates[row * width..(row + 1) * width],
            drives: self.drives(row..row + 1),
            negative: negative[row],
        }
    }

    /// The last row that is done and regular: at a singular state the path may fork.
    fn last(done: &Traced) -> Option<usize> {
        done.trace.status.iter().rposition(|s| *s == Status::Ok)
    }

    /// Squared distances of the drive values of a row from those of some earlier ones; without end from one that is not
    /// regular.
    #[inline(always)]
    fn distances(&self, done: &Traced, from: Range<usize>, to: usize, found: &mut [f64]) {
        for (distance, status) in found.iter_mut().zip(&done.trace.status[from.clone()]) {
            *distance = if *status == Status::Ok { 0.0 } else { f64::INFINITY };
        }
        // A structure has no drives, and no columns.
        let n = self.scaled.len() / self.solver.mechanism.n_drives().max(1);
        for column in self.scaled.chunks_exact(n.max(1)) {
            for (distance, q) in found.iter_mut().zip(&column[from.clone()]) {
                *distance += (q - column[to]) * (q - column[to]);
            }
        }
    }

    /// For each of the next rows the regular one that is nearest to it, as far as they have been looked at.
    #[inline(always)]
    fn nearest(&self, done: &Traced, rows: Range<usize>) -> Vec<Option<usize>> {
        let Some(last) = Self::last(done) else { return vec![None; rows.len()] };
        let distance = |from: usize, to: usize| {
            let mut found = [0.0];
            self.distances(done, from..from + 1, to, &mut found);
            found[0]
        };
        let window = last.saturating_sub(WINDOW)..last + 1;
        let mut distances = vec![0.0; window.len()];
        let mut near = last;
        let mut nearest = Vec::with_capacity(rows.len());
        for (k, to) in rows.enumerate() {
            let mut least = f64::INFINITY;
            if k % LOOK == 0 {
                self.distances(done, window.clone(), to, &mut distances);
                // Of equal ones the oldest: a line of a grid goes on beside the line before it.
                for (from, d) in window.clone().zip(&distances) {
                    if *d < least * (1.0 - 1e-9) {
                        (near, least) = (from, *d);
                    }
                }
            } else {
                least = distance(near, to);
            }
            for step in [usize::MAX, 1] {
                loop {
                    let from = near.wrapping_add(step);
                    if from > last || distance(from, to) >= least {
                        break;
                    }
                    (near, least) = (from, distance(from, to));
                }
            }
            nearest.push(Some(near));
        }
        nearest
    }

    /// Adds the next row, followed plainly from the last one.
    fn add_plainly(&self, done: &mut Traced) {
        let m = self.solver.mechanism;
        let row = done.trace.status.len();
        let Start { coordinates, drives, negative } =
            self.start(&done.trace.coordinates, &done.negative, Self::last(done));
        let inputs = Inputs::nominal(m, drives);
        let last = State { coordinates: coordinates.to_vec(), inputs, negative };
        let drives = self.drives(row..row + 1);
        let followed = self.solver.follow(&last, &Inputs::nominal(m, drives)).or_else(|status| {
            let other = match status {
                // No branch leads on from a singular state: the guess chooses one anew.
                Status::Singular => m.first_state_at(drives),
                _ => m.dead_centre(&last, drives),
            };
            other.ok_or(status)
        });
        let (trace, status) =
            (&mut done.trace, followed.as_ref().map_or_else(|s| *s, |next| self.solver.status_at(next)));
        let own = row * m.n_coordinates()..(row + 1) * m.n_coordinates();
        match &followed {
            Ok(next) => trace.coordinates[own].copy_from_slice(&next.coordinates),
            Err(_) => trace.coordinates[own].fill(f64::NAN),
        }
        trace.status.push(status);
        done.negative.push(followed.is_ok_and(|next| next.negative));
    }
}

impl Mechanism {
    /// Nominal coordinates for `n` rows of drive values, given one after the other.
    #[must_use]
    pub fn trace(&self, n: usize, drives: &[f64]) -> Trace {
        if self.n_rows() != self.n_unknowns() {
            return self.trace_on_bases(n, drives);
        }
        let first = if n > 0 { self.first_state(&drives[..self.n_drives()]) } else { None };
        let Some((solver, from)) = first else {
            return Trace {
                coordinates: vec![f64::NAN; n * self.n_coordinates()],
                status: vec![Status::NotAssembled; n],
            };
        };
        let mut coordinates = Fresh::new(n * self.n_coordinates());
        let run = if n <= ONE_RUN { ONE_RUN } else { RUN };
        let rows = coordinates.part().runs(run * self.n_coordinates());
        let status = trace_runs(&solver, &from, n, drives, rows).concat();
        Trace { coordinates: coordinates.into_vec(), status }
    }
}

/// Traces runs of rows of drive values on all cores, from a state near the first; gives their statuses.
fn trace_runs(
    solver: &Solver<'_>,
    from: &State,
    n: usize,
    drives: &[f64],
    rows: Vec<FreshPart<'_, f64>>,
) -> Vec<Vec<Status>> {
    let m = solver.mechanism;
    let width = m.n_drives();
    // A handful of rows is solved before the program is recorded; a structure has nothing to follow.
    let follow = if n >= LANES && width > 0 { Follow::record(solver) } else { None };
    let run = |from: &State, n: usize, drives: &[f64], done: &mut Traced| {
        dispatch(Run { solver, follow: follow.as_ref(), from, n, drives, done });
    };
    let drives_of = |rows: Range<usize>| &drives[rows.start * width..rows.end * width];
    let mut ahead = Traced::default();
    if n <= ONE_RUN {
        run(from, n, drives, &mut ahead);
        return rows.into_iter().map(|rows| ahead.trace.put(rows)).collect();
    }
    let sparse: Vec<f64> = (0..n).step_by(STRIDE).flat_map(|row| drives_of(row..row + 1)).copied().collect();
    run(from, n.div_ceil(STRIDE), &sparse, &mut ahead);
    let begin = |task: usize| {
        let row = ahead.trace.status[..=task * RUN / STRIDE].iter().rposition(|s| *s == Status::Ok);
        let Some(row) = row else { return from.clone() };
        let size = m.n_coordinates();
        State {
            coordinates: ahead.trace.coordinates[row * size..(row + 1) * size].to_vec(),
            inputs: Inputs::nominal(m, &sparse[row * width..(row + 1) * width]),
            negative: ahead.negative[row],
        }
    };
    let tasks = rows.into_par_iter().enumerate();
    // Memory of a run is as large as the caches: it is taken over from run to run.
    let task = |done: &mut Traced, (task, put): (usize, FreshPart<'_, f64>)| {
        let rows = task * RUN..n.min((task + 1) * RUN);
        run(&begin(task), rows.len(), drives_of(rows), done);
        done.trace.put(put)
    };
    in_rooms(tasks, Traced::default, task).collect()
}
