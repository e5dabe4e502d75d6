//! Self-stresses of an over-constrained mechanism and the statics of its basis, for blocks of closed samples.
//!
//! At the pose where the basis is closed, `J_B' l = J_k'` for every redundant row k gives the self-stress that has
//! one there: `-l` on the rows of the basis. The load's multipliers are what the basis alone bears it with, and those
//! of a component of the output what the rows' displacements do to it.

use super::lanes::Block;
use super::layout::Symbolic;
use super::linear::{Eliminated, Linear};
use super::program::{Bound, evaluate};
use super::statics::{gradient, poses_of};
use super::symbol::{Recorder, Symbol};
use super::tape::Program;
use crate::mechanism::Mechanism;
use crate::solver::Solver;

/// An over-constrained mechanism beside its basis, with the same bodies and parameters.
pub(crate) struct Beside<'a> {
    pub all: &'a Mechanism,
    /// The rows that the basis has not.
    pub redundant: &'a [usize],
    /// Whether self-stresses and the load's multipliers are wanted.
    pub statics: bool,
}

/// The recorded multipliers.
#[derive(Clone, Debug)]
pub(super) struct Statics {
    program: Program,
    /// Rows of the basis, and redundant ones.
    n_rows: usize,
    n_redundant: usize,
}

/// What the rows of the basis bear.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Borne {
    Load,
    /// The redundant row of the given number.
    Redundant(usize),
    /// One component of the output.
    Component(usize),
}

impl Beside<'_> {
    /// Records the multipliers at any pose, row by row of the basis, as [`Borne`] orders them; `solver` is that of
    /// the basis.
    pub(super) fn record(
        &self,
        solver: &Solver<'_>,
        any: &Symbolic<'_>,
        recorder: &Recorder,
        after: &Program,
    ) -> Option<Statics> {
        // What play counts changes from pose to pose where flanks move apart; here it counts one.
        if self.all.plays().next().is_some() {
            return None;
        }
        let (kept, size) = (solver.mechanism, solver.mechanism.size());
        let [_, derivatives] = evaluate(kept, any);
        let plan = solver.plan.as_ref()?;
        let factors = plan.replay(solver.picks.iter().map(|&p| derivatives[p]), |_, _| true)?;
        let linear = Eliminated { plan, factors };
        let (poses, at) = (poses_of(kept, any), &any.inputs.parameters[..]);
        let (_, mut outputs) = gradient(kept, &linear, &poses, at, kept.load_cost(&poses, at));
        let [_, derivatives] = evaluate(self.all, any);
        for &row in self.redundant {
            let mut twists = vec![Symbol::Constant(0.0); kept.n_unknowns()];
            for (side, body) in self.all.row_bodies(row).into_iter().enumerate() {
                let Some(b) = body else { continue };
                for c in 0..size {
                    let twist = &mut twists[b * size + c];
                    *twist = *twist + derivatives[(2 * row + side) * size + c];
                }
            }
            let mut multipliers = vec![Symbol::Constant(0.0); kept.n_rows()];
            linear.solve_transposed(&mut twists, &mut multipliers);
            outputs.extend(multipliers);
        }
        for k in 0..size {
            outputs.extend(gradient(kept, &linear, &poses, at, kept.component_cost(k, &poses, at)).1);
        }
        let program = Program::after(after, recorder, &outputs);
        Some(Statics { program, n_rows: kept.n_rows(), n_redundant: self.redundant.len() })
    }
}

impl Statics {
    /// Memory with everything common to the samples of a configuration in place.
    pub fn registers(&self, common: &[f64]) -> Vec<Block> {
        self.program.registers(common)
    }
}

impl Bound<'_> {
    /// Finds the multipliers at the pose where [`Self::solve`] has closed the block; tells whether they were
    /// recorded.
    #[inline(always)]
    pub(crate) fn solve_statics(&mut self) -> bool {
        let Some(statics) = &self.newton.statics else { return false };
        statics.program.run(&mut self.memory);
        true
    }

    /// The multipliers, row by row of the basis.
    #[inline(always)]
    pub(crate) fn multipliers(&self, of: Borne) -> impl Iterator<Item = &Block> + Clone {
        self.newton.statics.iter().flat_map(move |statics| {
            let first = match of {
                Borne::Load => 0,
                Borne::Redundant(k) => 1 + k,
                Borne::Component(k) => 1 + statics.n_redundant + k,
            };
            let rows = first * statics.n_rows..(first + 1) * statics.n_rows;
            rows.map(|k| statics.program.output(&self.memory, k))
        })
    }
}
