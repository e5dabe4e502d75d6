//! Extremes of the output's error, climbed on lanes.
//!
//! One recorded program takes a Newton step of the closure and gives the gradient of the work of a wrench on
//! the output at the pose it starts from; the wrench is the gradient of what is to be maximised, lane by
//! lane. Between steps every offset is moved to the support point of its set (Frank and Wolfe), until pose
//! and offsets stand still together. Every lane has a start and a measure of its own.

use super::SMALL_ANGLE;
use super::contact::{STILL, change, gradient, poses_of, push, record_finish};
use super::lanes::{Block, LANES};
use super::program::{Layout, record_step};
use super::symbol::{Recorder, Symbol};
use super::tape::Program;
use crate::ascent::Measure;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::solver::Solver;
use crate::space::Component;

/// Steps that only close the mechanism at the start.
const CLOSING: usize = 2;
/// Steps that a block takes at most.
const STEPS: usize = 40;
/// A step below this (length-scaled) is rounding.
const ROUNDING: f64 = 1e-13;

/// What one lane is to do.
#[derive(Clone, Debug)]
pub struct Task {
    /// What it climbs.
    pub measure: Measure,
    /// Parameter values to start from.
    pub start: Vec<f64>,
}

/// Where one lane stands still.
#[derive(Clone, Debug)]
pub struct Height {
    /// Value of its measure.
    pub value: f64,
    /// Parameter values.
    pub parameters: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
}

/// The recorded programs of one mechanism.
#[derive(Clone, Debug)]
pub struct Climb<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    step: Program,
    finish: Program,
}

impl<'m> Climb<'m> {
    /// Records the programs; `None` when the mechanism has no plan, turns too far or is too large.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        if m.largest_angle() > SMALL_ANGLE {
            return None;
        }
        let layout = Layout::new(m);
        Some(Self {
            mechanism: m,
            step: record_climb_step(solver, &layout)?,
            finish: record_finish(m, &layout)?,
            layout,
        })
    }

    /// Registers of the two programs.
    #[must_use]
    pub fn workspace(&self) -> [Vec<Block>; 2] {
        [&self.step, &self.finish].map(|p| p.registers(&[]))
    }

    /// Climbs from up to a block of starts at one nominal pose whose output is given. A lane that does not
    /// stand still, or whose branch is in doubt, gives nothing.
    #[inline(always)]
    pub fn solve(
        &self,
        workspace: &mut [Vec<Block>; 2],
        case: &Case<'_>,
        reference: &[f64],
        tasks: &[Task],
    ) -> Vec<Option<Height>> {
        let m = self.mechanism;
        let (n_u, size) = (m.n_parameters(), m.size());
        let [step, finish] = workspace;
        let mut pushed = vec![Block::splat(0.0); n_u];
        for lane in 0..LANES {
            self.layout.load(m, case.coordinates, case.drives, step, lane);
            // Idle lanes repeat the first.
            let task = tasks.get(lane).unwrap_or(&tasks[0]);
            for (block, value) in pushed.iter_mut().zip(&task.start) {
                block.0[lane] = *value;
            }
        }
        let wrench = n_u + self.layout.n_varying();
        let state = self.layout.n_state();
        let (moved, pivots, scale, slope) = (state, state + 1, state + 2, state + 3);
        let mut good = [true; LANES];
        let mut still = [false; LANES];
        let mut sign = Block::splat(0.0);
        let mut errors = vec![Block::splat(0.0); size];
        for round in 0..STEPS {
            finish[n_u..wrench].copy_from_slice(&step[n_u..wrench]);
            finish[..n_u].copy_from_slice(&pushed);
            self.finish.run(finish);
            for (k, error) in errors.iter_mut().enumerate() {
                let value = self.finish.output(finish, k);
                *error = if k < m.n_translations() { value.sub(&Block::splat(reference[k])) } else { *value };
            }
            self.aim(tasks, &errors, &mut step[wrench..wrench + size]);
            step[..n_u].copy_from_slice(&pushed);
            self.step.run(step);
            let out = |k: usize| self.step.output(step, k);
            if round == 0 {
                sign = *out(pivots);
            }
            if round >= CLOSING {
                push(m, |_| true, |p| out(slope + p), out(scale), &mut pushed);
            }
            let mut all = true;
            for i in 0..tasks.len() {
                let size = out(moved).0[i];
                good[i] &= size <= SMALL_ANGLE * SMALL_ANGLE && out(pivots).0[i] * sign.0[i] > 0.0;
                still[i] = round >= CLOSING
                    && size <= ROUNDING * ROUNDING
                    && change(m, |_| true, &step[..n_u], &pushed, i) <= STILL;
                all &= still[i] || !good[i];
            }
            if all {
                break;
            }
        }
        let height = |i: usize, task: &Task| {
            let error: Vec<f64> = errors.iter().map(|e| e.0[i]).collect();
            let parameters = step[..n_u].iter().map(|u| u.0[i]).collect();
            Height { value: task.measure.value(&error, m.n_translations()), parameters, error }
        };
        tasks.iter().enumerate().map(|(i, task)| (good[i] && still[i]).then(|| height(i, task))).collect()
    }

    /// Puts the wrench of every lane.
    #[inline(always)]
    fn aim(&self, tasks: &[Task], errors: &[Block], wrench: &mut [Block]) {
        let m = self.mechanism;
        let mut error = [0.0; 6];
        for (i, task) in tasks.iter().enumerate() {
            for (e, block) in error.iter_mut().zip(errors) {
                *e = block.0[i];
            }
            let [force, moment] = task.measure.wrench(m.space, &error[..errors.len()]);
            for (slot, component) in wrench.iter_mut().zip(m.space.components()) {
                slot.0[i] = match component {
                    Component::Along(k) => force[*k],
                    Component::About(k) => moment[*k],
                };
            }
        }
    }
}

fn record_climb_step(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE);
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let first = m.n_parameters() + layout.n_varying();
    let (mut force, mut moment) = ([Symbol::Constant(0.0); 3], [Symbol::Constant(0.0); 3]);
    for (k, component) in m.space.components().iter().enumerate() {
        match component {
            Component::Along(i) => force[*i] = recorder.varying(first + k),
            Component::About(i) => moment[*i] = recorder.varying(first + k),
        }
    }
    let poses = poses_of(m, &symbolic);
    let mut cost = m.no_cost();
    m.add_wrench(m.output, force, moment, &poses, &symbolic.inputs.parameters, &mut cost);
    let (slope, multipliers) = gradient(m, solver.plan.as_ref()?, &step.factors, &poses, cost);
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots, m.largest_force(&multipliers)]);
    outputs.extend(slope);
    Some(Program::new(&recorder, first + m.size(), &outputs)?.replacing(layout.state(m)))
}
