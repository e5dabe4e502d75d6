//! Self-stresses of an over-constrained mechanism and the statics of its basis, for blocks of closed samples.
//!
//! At the pose where the basis is closed, `J_B' l = J_k'` for every redundant row k gives the self-stress that has
//! one there: `-l` on the rows of the basis. The load's multipliers are what the basis alone bears it with, and those
//! of a component of the output what the rows' displacements do to it.

use crate::closure::newton::Solver;
use crate::closure::recorded::elimination::{Eliminated, Linear};
use crate::closure::recorded::layout::Symbolic;
use crate::closure::recorded::statics::{gradient, poses_of};
use crate::closure::recorded::step::evaluate;
use crate::math::lanes::block::Block;
use crate::mechanism::Mechanism;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;

/// An over-constrained mechanism beside its basis, with the same bodies and parameters.
pub(crate) struct SelfStress<'a> {
    pub all: &'a Mechanism,
    /// The rows that the basis has not.
    pub redundant: &'a [usize],
    /// Whether self-stresses and the load's multipliers are wanted.
    pub statics: bool,
}

/// The recorded multipliers.
#[derive(Clone, Debug)]
pub(crate) struct Statics {
    pub(crate) program: Program,
    /// Rows of the basis, and redundant ones.
    pub(crate) n_rows: usize,
    pub(crate) n_redundant: usize,
    /// Components of the output.
    pub(crate) size: usize,
    /// Rows whose play counts more or less than one where the flanks have moved.
    pub(crate) plays: Vec<usize>,
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

impl SelfStress<'_> {
    /// Records the multipliers at any pose, row by row of the basis, as [`Borne`] orders them; `solver` is that of
    /// the basis.
    pub(crate) fn record(
        &self,
        solver: &Solver<'_>,
        any: &Symbolic<'_>,
        recorder: &Recorder,
        after: &Program,
    ) -> Option<Statics> {
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
                    *twist = *twist + derivatives[self.all.side(row, side) * size + c];
                }
            }
            let mut multipliers = vec![Symbol::Constant(0.0); kept.n_rows()];
            linear.solve_transposed(&mut twists, &mut multipliers);
            outputs.extend(multipliers);
        }
        for k in 0..size {
            outputs.extend(gradient(kept, &linear, &poses, at, kept.component_cost(k, &poses, at)).1);
        }
        let plays: Vec<usize> = (0..self.all.n_rows()).filter(|&row| self.all.rows[row].play.is_some()).collect();
        outputs.extend(plays.iter().map(|&row| self.all.slope(&self.all.rows[row], &poses, at)));
        let program = Program::after(after, recorder, &outputs, 0..0);
        Some(Statics { program, n_rows: kept.n_rows(), n_redundant: self.redundant.len(), size, plays })
    }
}

impl Statics {
    /// Memory with everything common to the samples of a configuration in place.
    pub fn registers(&self, common: &[f64]) -> Vec<Block> {
        self.program.registers(common)
    }
}
