//! The nominal mechanism on a grid of drive values: from nodes that are known to every node that can be
//! reached from them in steps between neighbours, whatever the shape of the region.
//!
//! A wave of nodes is solved at a time, each from a neighbour that was reached before it. A node is
//! given up when no neighbour leads to it, so that what cannot be reached costs as much as the
//! boundary of the region, not as its outside.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Solver, State};
use crate::interrupt;
use crate::math::lanes::block::{Block as Numbers, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::tasks::in_rooms;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::nominal::on_lanes::{Follow, Start};
use crate::nominal::trace::Trace;

/// A step between neighbours that fails this near to its end may end in a dead centre.
const NEAR_THE_END: f64 = 1e-3;

/// A node with the states, of neighbours or from elsewhere, that may lead to it.
type Task = (usize, Vec<Arc<State>>);

/// What became of a node: its state where there is one.
type Outcome = (Status, Option<Arc<State>>);

/// Up to a block of nodes.
struct Block<'t, 'm> {
    solver: &'t Solver<'m>,
    follow: Option<&'t Follow<'m>>,
    drives: &'t [f64],
    tasks: &'t [Task],
}

/// A block with registers to work in.
struct Work<'w, 't, 'm>(&'w Block<'t, 'm>, &'w mut Vec<Numbers>);

impl Kernel for Work<'_, '_, '_> {
    type Output = Vec<Outcome>;

    #[inline(always)]
    fn run(self) -> Vec<Outcome> {
        interrupt::check();
        let Work(block, registers) = self;
        let m = block.solver.mechanism;
        let mut outcomes: Vec<Option<Outcome>> = vec![None; block.tasks.len()];
        if let Some(follow) = block.follow {
            if registers.is_empty() {
                *registers = follow.workspace();
            }
            let from: Vec<Start<'_>> = block.tasks.iter().map(|(_, from)| Start::of(&from[0])).collect();
            let rows: Vec<f64> = block.tasks.iter().flat_map(|(node, _)| block.row(*node)).copied().collect();
            let n = m.n_coordinates();
            let mut found = vec![0.0; from.len() * n];
            let clear = follow.solve(registers, &from, &rows, &mut found);
            for (k, outcome) in outcomes.iter_mut().enumerate() {
                *outcome = (clear[k] >= CLEAR * m.singular_value).then(|| {
                    let inputs = Inputs::nominal(m, block.row(block.tasks[k].0));
                    let coordinates = found[k * n..(k + 1) * n].to_vec();
                    (Status::Ok, Some(Arc::new(State { coordinates, inputs, negative: from[k].negative })))
                });
            }
        }
        let tasks = block.tasks.iter().zip(outcomes);
        tasks.map(|((node, from), outcome)| outcome.unwrap_or_else(|| block.plainly(*node, from))).collect()
    }
}

impl Block<'_, '_> {
    fn row(&self, node: usize) -> &[f64] {
        let width = self.solver.mechanism.n_drives();
        &self.drives[node * width..(node + 1) * width]
    }

    /// The node from the first of the states that leads to it.
    fn plainly(&self, node: usize, from: &[Arc<State>]) -> Outcome {
        let m = self.solver.mechanism;
        let to = Inputs::nominal(m, self.row(node));
        for state in from {
            match self.solver.follow_part(state, &to) {
                Ok(next) => return (m.nominal_status(&next), Some(Arc::new(next))),
                Err((last, _)) if left(state, &last, &to) < NEAR_THE_END => {
                    if let Some(next) = m.dead_centre(&last, &to.drives) {
                        return (Status::Singular, Some(Arc::new(next)));
                    }
                }
                Err(_) => {}
            }
        }
        (Status::NotAssembled, None)
    }
}

/// The part of the way that is left.
fn left(from: &State, at: &State, to: &Inputs<f64>) -> f64 {
    let distance = |a: &[f64]| a.iter().zip(&to.drives).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    distance(&at.inputs.drives) / distance(&from.inputs.drives).max(f64::MIN_POSITIVE)
}

impl Mechanism {
    /// Nominal coordinates on a grid: its `shape`, the drive values of its nodes (the last axis runs
    /// fastest), and `seeds`: states with a node each that they may lead to. If it does not spread, only those
    /// nodes are solved.
    #[must_use]
    pub fn trace_grid(&self, shape: &[usize], drives: &[f64], seeds: &[(usize, Case<'_>)], spread: bool) -> Trace {
        if self.n_rows() != self.n_unknowns() {
            return self.trace_grid_on_basis(shape, drives, seeds, spread);
        }
        let n = shape.iter().product();
        let width = self.n_coordinates();
        let mut trace = Trace { coordinates: vec![f64::NAN; n * width], status: vec![Status::NotAssembled; n] };
        let cases: Vec<Case<'_>> = seeds.iter().map(|&(_, case)| case).collect();
        let Some(solver) = self.solver(&cases) else { return trace };
        // A handful of nodes is solved before the program is recorded.
        let follow = if n >= LANES && self.n_drives() > 0 { Follow::record(&solver) } else { None };
        let mut wave: BTreeMap<usize, Vec<Arc<State>>> = BTreeMap::new();
        for (node, case) in seeds {
            if let Some(state) = self.restore(&solver, case.coordinates, case.drives) {
                wave.entry(*node).or_default().push(Arc::new(state));
            }
        }
        while !wave.is_empty() {
            let tasks: Vec<Task> = std::mem::take(&mut wave).into_iter().collect();
            let blocks: Vec<Block<'_, '_>> = tasks
                .chunks(LANES)
                .map(|tasks| Block { solver: &solver, follow: follow.as_ref(), drives, tasks })
                .collect();
            let work = |registers: &mut Vec<Numbers>, block| dispatch(Work(block, registers));
            let outcomes: Vec<Vec<Outcome>> = in_rooms(blocks.par_iter(), Vec::new, work).collect();
            let mut reached = Vec::new();
            for ((node, _), (status, state)) in tasks.iter().zip(outcomes.into_iter().flatten()) {
                trace.status[*node] = status;
                let Some(state) = state else { continue };
                trace.coordinates[node * width..(node + 1) * width].copy_from_slice(&state.coordinates);
                // At a singular state the branch may fork: nothing goes on from there.
                if status == Status::Ok && spread {
                    reached.push((*node, state));
                }
            }
            for (node, state) in &reached {
                for next in neighbours(shape, *node) {
                    if trace.status[next] == Status::NotAssembled {
                        wave.entry(next).or_default().push(Arc::clone(state));
                    }
                }
            }
        }
        trace
    }
}

/// The nodes one step away along an axis of the grid.
fn neighbours(shape: &[usize], node: usize) -> Vec<usize> {
    let mut found = Vec::with_capacity(2 * shape.len());
    let mut stride = 1;
    for &size in shape.iter().rev() {
        let place = node / stride % size;
        if place > 0 {
            found.push(node - stride);
        }
        if place + 1 < size {
            found.push(node + stride);
        }
        stride *= size;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::neighbours;

    #[test]
    fn neighbours_lie_one_step_away_along_one_axis() {
        assert_eq!(neighbours(&[2, 3], 0), [1, 3]);
        assert_eq!(neighbours(&[2, 3], 4), [3, 5, 1]);
        assert_eq!(neighbours(&[3, 2, 2], 11), [10, 9, 7]);
        assert_eq!(neighbours(&[1], 0), [] as [usize; 0]);
    }
}
