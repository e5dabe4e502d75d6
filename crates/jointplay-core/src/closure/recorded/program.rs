//! Newton's iteration recorded as programs, and its run on a block of samples.

use std::sync::Arc;

use crate::closure::newton::{Solver, State};
use crate::closure::recorded::layout::{Layout, Symbolic};
use crate::closure::recorded::self_stress::{Borne, SelfStress, Statics};
use crate::closure::recorded::statics::perfect;
use crate::closure::recorded::step::{evaluate, record_step, record_step_by};
use crate::closure::recorded::{LATER_ANGLE, SMALL_ANGLE, structure};
use crate::math::lanes::block::{Block, LANES, Mask, bits_if};
use crate::math::space::Pose;
use crate::mechanism::Mechanism;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;

/// Full steps that a block takes at most.
const STEPS: usize = 7;
/// Predicted remaining error (length-scaled) at which a sample is solved.
const SOLVED: f64 = 1e-15;
/// A step below this is rounding.
const ROUNDING: f64 = 1e-14;

/// The recorded Newton iteration of one mechanism. Its programs share their inputs: parameters, then pose
/// and how far the output's body has turned.
#[derive(Clone, Debug)]
pub struct Newton {
    /// The step from the nominal pose: puts a pose.
    first: Program,
    /// A step from any pose: replaces the pose.
    step: Program,
    /// The output's error.
    finish: Program,
    /// What an over-constrained mechanism tells beside, at the pose that is reached.
    pub(crate) statics: Option<Statics>,
    /// The largest first step.
    small_step: f64,
    n_parameters: usize,
    /// Inputs after the parameters.
    n_state: usize,
    n_outputs: usize,
}

/// The programs with the quantities of one configuration in place, and room to work.
#[derive(Clone)]
pub struct Bound<'n> {
    pub(crate) newton: &'n Newton,
    pub(crate) memory: Vec<Block>,
    /// Sign of the pivots' product at the nominal pose.
    sign: f64,
}

impl Newton {
    /// The iteration of a solver's mechanism, recorded once for every order of elimination; `None` when it has no plan.
    #[must_use]
    pub fn record(solver: &Solver<'_>) -> Option<Arc<Self>> {
        let m = solver.mechanism;
        let record = || Self::record_beside(solver, m.largest_angle(), None).map(Arc::new);
        m.memo.get(structure("iteration", solver), record)
    }

    /// Records it for parameters with angles up to one given, and beside it what is left of the redundant rows
    /// of an over-constrained mechanism of which this is the basis.
    pub(crate) fn record_beside(solver: &Solver<'_>, given: f64, beside: Option<&SelfStress<'_>>) -> Option<Self> {
        let m = solver.mechanism;
        let layout = Layout::new(m);
        let (n_u, n_pose) = (m.n_parameters(), layout.n_pose());
        let n_state = layout.n_state();
        // Angles among the parameters go through the same series as the steps.
        if given > SMALL_ANGLE {
            return None;
        }
        let recorder = Recorder::new(SMALL_ANGLE, &structure("first step", solver));
        let mut nominal = Symbolic {
            numbers: (0..n_pose).map(|i| recorder.common(i)).collect(),
            inputs: layout.inputs(m, &recorder),
        };
        let [residual, _] = evaluate(m, &nominal);
        // Derivatives of perfect parts are common to all samples, and so is their elimination. What they
        // miss is of the order of the step, as is what the step misses anyway. The play of a coupling tells the flank.
        perfect(m, &mut nominal);
        let [_, derivatives] = evaluate(m, &nominal);
        let turn = layout.nominal_turn(m, &recorder);
        let begun = record_step_by(solver, &nominal, [residual, derivatives], &turn)?;
        let mut outputs = begun.numbers;
        outputs.extend(begun.turn);
        outputs.extend([begun.size, begun.pivots]);
        let state = n_u..n_u + n_state;
        let first = Program::new(&recorder, state.end, &outputs, state.clone());

        let recorder = Recorder::new(LATER_ANGLE.max(given), &structure("step", solver));
        let any = Symbolic {
            numbers: (0..n_pose).map(|i| recorder.varying(n_u + i)).collect(),
            inputs: layout.inputs(m, &recorder),
        };
        let turn: Vec<Symbol<'_>> = (n_pose..n_state).map(|k| recorder.varying(n_u + k)).collect();
        let next = record_step(solver, &any, &turn)?;
        let mut outputs = next.numbers;
        outputs.extend(next.turn);
        outputs.extend([next.size, next.pivots]);
        let step = Program::after(&first, &recorder, &outputs, state);

        let width = m.space.n_pose_numbers();
        let poses: Vec<Pose<Symbol<'_>>> =
            any.numbers.chunks_exact(width).map(|n| m.space.pose_of_numbers(n)).collect();
        let place = m.output_place(&poses, &any.inputs.parameters);
        let mut outputs = m.pose_components(place, &m.turned(&turn, &any.numbers));
        for (k, error) in outputs.iter_mut().enumerate().take(m.n_translations()) {
            *error = *error - layout.reference(&recorder, k);
        }
        let mut statics = None;
        if let Some(beside) = beside {
            let [residual, _] = evaluate(beside.all, &any);
            outputs.extend(beside.redundant.iter().map(|&row| residual[row]));
        }
        let finish = Program::after(&step, &recorder, &outputs, 0..0);
        if let Some(beside) = beside.filter(|beside| beside.statics) {
            statics = Some(beside.record(solver, &any, &recorder, &finish)?);
        }
        Some(Self {
            first,
            step,
            finish,
            statics,
            small_step: m.small_step(),
            n_parameters: n_u,
            n_state,
            n_outputs: m.size(),
        })
    }

    /// Operations of the first step, a full step and the output.
    #[must_use]
    pub fn n_operations(&self) -> [usize; 3] {
        [self.first.n_operations(), self.step.n_operations(), self.finish.n_operations()]
    }

    /// The programs at a nominal state, for drive values near its own.
    #[must_use]
    pub fn bind(&self, mechanism: &Mechanism, nominal: &State, drives: &[f64]) -> Bound<'_> {
        let common = Layout::values(mechanism, nominal, drives);
        let mut memory =
            self.statics.as_ref().map_or_else(|| self.finish.registers(&common), |statics| statics.registers(&common));
        self.finish.put_common(&mut memory, &common);
        self.first.put_common(&mut memory, &common);
        self.step.put_common(&mut memory, &common);
        // Perfect parameters: the inputs start at zero.
        self.first.run(&mut memory);
        let sign = self.first.output(&memory, self.n_state + 1).0[0];
        Bound { newton: self, memory, sign }
    }
}

impl Bound<'_> {
    /// Where the parameters of a block go before [`Self::solve`], which leaves them there.
    #[inline(always)]
    pub fn parameters(&mut self) -> &mut [Block] {
        &mut self.memory[..self.newton.n_parameters]
    }

    /// Solves a block; tells which lanes are solved. Their errors are then in [`Self::error`].
    #[inline(always)]
    pub fn solve(&mut self) -> Mask {
        let n = self.newton;
        let (size, pivots) = (n.n_state, n.n_state + 1);
        n.first.run(&mut self.memory);
        let mut last = *n.first.output(&self.memory, size);
        // Branch-free, so that lanes are judged as they are computed: many at once.
        let mut good = Mask::NONE;
        let mut i = 0;
        while i < LANES {
            good.0[i] = bits_if(last.0[i] <= n.small_step * n.small_step);
            i += 1;
        }
        let mut solved = Mask::NONE;
        for step in 0..STEPS {
            n.step.run(&mut self.memory);
            let now = n.step.output(&self.memory, size);
            let determinant = n.step.output(&self.memory, pivots);
            // The second step must be well below the first, or the branch is in doubt.
            let shrink = if step > 0 { 1e300 } else { 0.25 };
            let mut open = 0;
            let mut i = 0;
            while i < LANES {
                let (now, before) = (now.0[i], last.0[i]);
                let rounding = now <= ROUNDING * ROUNDING;
                let shrinks = (now <= shrink * before) | rounding;
                let same_branch = determinant.0[i] * self.sign > 0.0;
                good.0[i] &= bits_if(shrinks) & bits_if(now <= LATER_ANGLE * LATER_ANGLE) & bits_if(same_branch);
                // Newton converges quadratically: the next step is about now^3 / last^2.
                let predicted = now * now * now <= SOLVED * SOLVED * (before * before);
                solved.0[i] |= bits_if(rounding) | bits_if(predicted);
                open |= good.0[i] & !solved.0[i];
                last.0[i] = now;
                i += 1;
            }
            if open == 0 {
                break;
            }
        }
        n.finish.run(&mut self.memory);
        let mut i = 0;
        while i < LANES {
            good.0[i] &= solved.0[i];
            i += 1;
        }
        good
    }

    /// One component of the output's error for every lane.
    #[inline(always)]
    #[must_use]
    pub fn error(&self, component: usize) -> &Block {
        self.newton.finish.output(&self.memory, component)
    }

    /// What is left of a row recorded beside.
    #[inline(always)]
    pub(crate) fn left(&self, row: usize) -> &Block {
        self.newton.finish.output(&self.memory, self.newton.n_outputs + row)
    }

    /// Number of output components.
    #[must_use]
    pub const fn n_outputs(&self) -> usize {
        self.newton.n_outputs
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
        let statics = self.newton.statics.as_ref();
        let rows = statics.map_or(0..0, |statics| {
            let first = match of {
                Borne::Load => 0,
                Borne::Redundant(k) => 1 + k,
                Borne::Component(k) => 1 + statics.n_redundant + k,
            };
            first * statics.n_rows..(first + 1) * statics.n_rows
        });
        rows.filter_map(move |k| Some(statics?.program.output(&self.memory, k)))
    }

    /// The rows of all joints whose play does not count one there, with what it counts.
    #[inline(always)]
    pub(crate) fn slopes(&self) -> impl Iterator<Item = (usize, &Block)> {
        self.newton.statics.iter().flat_map(move |statics| {
            let first = (1 + statics.n_redundant + statics.size) * statics.n_rows;
            let slope = move |k: usize| statics.program.output(&self.memory, first + k);
            statics.plays.iter().enumerate().map(move |(k, &row)| (row, slope(k)))
        })
    }
}
