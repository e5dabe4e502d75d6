//! Recorded Newton steps of the closure for a block of configurations, with the reactions at the pose they start from and
//! without.

use crate::closure::newton::Solver;
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::load_statics;
use crate::closure::recorded::step::record_step;
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::contact::FIRST;
use crate::contact::balance_on_lanes::Balancing;
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;
use crate::program::symbol::Recorder;
use crate::program::tape::Program;

/// The steps of one mechanism under its loads.
#[derive(Clone, Debug)]
pub(super) struct Steps<'m> {
    pub mechanism: &'m Mechanism,
    pub layout: Layout,
    /// With the reactions.
    pub step: Program,
    /// Without.
    pub close: Program,
}

impl Steps<'_> {
    /// Drops the lanes where a step went too far, or to another branch.
    #[inline(always)]
    pub fn stay_near(&self, program: &Program, registers: &[Block], sign: &Block, good: &mut [bool; LANES]) {
        let (small, to) = (self.mechanism.small_step(), StepOutputs::new(self.mechanism, &self.layout));
        let [size, pivots] = [to.size, to.pivots].map(|k| program.output(registers, k));
        for i in 0..LANES {
            good[i] &= size.0[i] <= small * small && pivots.0[i] * sign.0[i] > 0.0;
        }
    }

    /// Replaces whole steps to `pushed` along lines that they take from end to end, once contacts have had the rounds in which
    /// they find their sides; `step` are registers at a pose with its forces, and stay so. Gives the number of lines that
    /// nothing pushes there.
    #[inline(always)]
    pub fn balance(&self, round: usize, balance: &mut Balancing, step: &mut [Block], pushed: &mut [Block]) -> Block {
        if round < FIRST {
            return Block::splat(0.0);
        }
        let most = balance.see(step, pushed);
        if most > 0 {
            self.learn(most, balance, step);
        }
        let to = StepOutputs::new(self.mechanism, &self.layout);
        let out = |k: usize| self.step.output(step, k);
        balance.press(|p| out(to.gradient + p), out(to.scale), step, pushed)
    }

    /// Finds how forces change along these lines, as many as a lane has at most.
    fn learn(&self, most: usize, balance: &mut Balancing, step: &mut [Block]) {
        let to = StepOutputs::new(self.mechanism, &self.layout);
        let at = step.to_vec();
        let before = balance.forces(|p| self.step.output(&at, to.gradient + p));
        for number in 0..most {
            step.copy_from_slice(&at);
            balance.move_one(number, step);
            (0..2).for_each(|_| self.close.run(step));
            self.step.run(step);
            balance.learn(number, &at, &before, |p| self.step.output(step, to.gradient + p));
        }
        step.copy_from_slice(&at);
    }
}

/// Where the outputs of the step program stand.
pub(super) struct StepOutputs {
    pub size: usize,
    pub pivots: usize,
    pub scale: usize,
    pub gradient: usize,
    pub reactions: usize,
    pub drive_forces: usize,
}

impl StepOutputs {
    #[inline(always)]
    pub const fn new(m: &Mechanism, layout: &Layout) -> Self {
        let size = layout.n_state();
        let reactions = size + 3 + m.n_parameters();
        let drive_forces = reactions + m.n_joints() * m.size();
        Self { size, pivots: size + 1, scale: size + 2, gradient: size + 3, reactions, drive_forces }
    }
}

/// A Newton step with the reactions at the pose it starts from.
pub(super) fn record_contact_step(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE, &structure("contact", solver));
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let statics = load_statics(m, &step.linear, &symbolic);
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots, statics.scale]);
    outputs.extend(statics.gradient);
    outputs.extend(statics.reactions);
    outputs.extend(statics.drive_forces);
    Some(Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs, layout.state(m)))
}

/// A Newton step only, on the registers of the others.
pub(super) fn record_close(solver: &Solver<'_>, layout: &Layout, after: &Program) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE, &(structure("closing", solver), after.n_blocks()));
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots]);
    Some(Program::after(after, &recorder, &outputs, layout.state(m)))
}
