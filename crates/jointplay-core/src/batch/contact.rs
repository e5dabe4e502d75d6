//! Load-determined poses of a block of configurations.
//!
//! One recorded program gives the statics of the nominal pose (reactions, first-order maps, nearness
//! to a singular pose), another takes a Newton step of the closure together with the reactions at the
//! pose it starts from. Between steps every offset is moved to the support point of its set, until
//! pose, reactions and contacts stand still together. Lanes where the load decides nothing, contacts
//! flip or the closure is in doubt are left to the plain solver.

use super::SMALL_ANGLE;
use super::lanes::{Block, LANES};
use super::layout::Layout;
use super::program::record_step;
use super::push::{change, mutes, push};
use super::statics::{SAME_DRIVES, StaticsOutputs, load_statics, record_finish, record_statics};
use super::symbol::Recorder;
use super::tape::Program;
use crate::loaded::{Case, Pressing};
use crate::mechanism::Mechanism;
use crate::solver::Solver;
use crate::status::Status;
use crate::table::Table;
use crate::trace::CLEAR;

/// Steps that a block takes at most.
const STEPS: usize = 40;
/// A step below this (length-scaled) is rounding.
const ROUNDING: f64 = 1e-13;

/// The recorded programs of one mechanism under its loads.
#[derive(Clone, Debug)]
pub struct Contact<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    statics: Program,
    step: Program,
    finish: Program,
}

impl<'m> Contact<'m> {
    /// Records the programs; `None` when the mechanism has no plan, turns too far or is too large.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        if m.largest_angle() > SMALL_ANGLE {
            return None;
        }
        let layout = Layout::new(m);
        let step = record_contact_step(solver, &layout)?;
        Some(Self {
            mechanism: m,
            statics: record_statics(solver, &layout)?,
            finish: record_finish(m, &layout, &step)?,
            step,
            layout,
        })
    }

    /// Registers of the statics, and of the two other programs together.
    #[must_use]
    pub fn workspace(&self) -> [Vec<Block>; 2] {
        let mut registers = self.finish.registers(&[]);
        self.step.put_common(&mut registers, &[]);
        [self.statics.registers(&[]), registers]
    }

    /// Solves up to a block of cases; appends a row for each to the table, by `plainly` where the
    /// batch is in doubt.
    #[inline(always)]
    pub fn solve(
        &self,
        workspace: &mut [Vec<Block>; 2],
        cases: &[Case<'_>],
        table: &mut Table,
        mut plainly: impl FnMut(&Case<'_>, &mut Table),
    ) {
        let m = self.mechanism;
        let (n_u, size) = (m.n_parameters(), m.size());
        let [statics, step] = workspace;
        for lane in 0..LANES {
            // Idle lanes repeat the first.
            let case = cases.get(lane).unwrap_or(&cases[0]);
            Layout::load(m, case.coordinates, case.drives, statics, lane);
        }
        self.statics.run(statics);
        let at = StaticsOutputs::new(m);
        let out = |k: usize| self.statics.output(statics, k);
        let mut good = [false; LANES];
        for (i, case) in cases.iter().enumerate() {
            good[i] = case.coordinates.iter().all(|c| c.is_finite()) && out(at.clear).0[i] >= CLEAR * m.singular_value;
            for d in 0..m.n_drives() {
                good[i] &= out(at.drives + d).0[i].abs() <= SAME_DRIVES;
            }
        }
        let mut pushed = vec![Block::splat(0.0); n_u];
        for (p, centre) in m.centre.iter().enumerate() {
            pushed[p] = Block::splat(*centre);
        }
        let mutes = mutes(m, |p| out(at.gradient + p), out(at.scale));
        let open = push(m, Some(&mutes), &[true; LANES], |p| out(at.gradient + p), out(at.scale), &mut pushed);
        let first: Vec<Block> = pushed.clone();

        let inputs = n_u + self.layout.n_varying();
        step[n_u..inputs].copy_from_slice(&statics[n_u..inputs]);
        let to = StepOutputs::new(m, &self.layout);
        let sign = *out(at.pivots);
        let mut still = [false; LANES];
        let mut undecided = [false; LANES];
        let mut steps = [0_u64; LANES];
        for _ in 0..STEPS {
            step[..n_u].copy_from_slice(&pushed);
            self.step.run(step);
            let out = |k: usize| self.step.output(step, k);
            undecided = push(m, Some(&mutes), &[true; LANES], |p| out(to.gradient + p), out(to.scale), &mut pushed);
            let changed = change(m, true, &step[..n_u], &pushed);
            let mut all = true;
            for i in 0..cases.len() {
                let moved = out(to.size).0[i];
                good[i] &= moved <= SMALL_ANGLE * SMALL_ANGLE && out(to.pivots).0[i] * sign.0[i] > 0.0;
                still[i] = moved <= ROUNDING * ROUNDING && changed.0[i] <= m.still();
                steps[i] += u64::from(!still[i]);
                all &= still[i] || !good[i];
            }
            if all {
                break;
            }
        }
        self.finish.run(step);
        let mut widths = vec![0.0; m.sources().len() * size];
        let mut decided = vec![true; m.sources().len()];
        for (i, case) in cases.iter().enumerate() {
            if !(good[i] && still[i]) {
                plainly(case, table);
                continue;
            }
            let map = |k: usize, p: usize| self.statics.output(statics, at.map + k * n_u + p).0[i];
            let (mute, mut felt) = (|s: usize| mutes[s][i], false);
            widths.fill(0.0);
            decided.fill(true);
            if open[i] {
                let force = |p: usize| self.statics.output(statics, at.gradient + p).0[i];
                let load = Pressing { force, scale: self.statics.output(statics, at.scale).0[i], mute };
                felt |= m.leave_open(&load, map, map, &mut widths, &mut decided);
            }
            if undecided[i] {
                let force = |p: usize| self.step.output(step, to.gradient + p).0[i];
                let load = Pressing { force, scale: self.step.output(step, to.scale).0[i], mute };
                felt |= m.leave_open(&load, map, map, &mut widths, &mut decided);
            }
            if felt {
                plainly(case, table);
                continue;
            }
            let lane = |b: &Block| b.0[i];
            self.tell_shares(statics, &first, i, table);
            for k in 0..size {
                let nominal = self.statics.output(statics, at.output + k);
                table.error.push(lane(self.finish.output(step, k)) - lane(nominal));
                table.undetermined.push(0.0);
            }
            table.open.extend_from_slice(&widths);
            table.decided.extend_from_slice(&decided);
            let reactions = to.reactions..to.reactions + m.n_joints() * size;
            table.reaction.extend(reactions.map(|k| lane(self.step.output(step, k))));
            table.offset.extend(step[..n_u].iter().map(lane));
            table.steps.push(steps[i]);
            table.status.push(Status::Ok);
        }
    }

    /// Appends the first-order error of one lane and the share of every source in it.
    #[inline(always)]
    fn tell_shares(&self, statics: &[Block], offsets: &[Block], lane: usize, table: &mut Table) {
        let m = self.mechanism;
        let (map, n_u, size) = (StaticsOutputs::new(m).map, m.n_parameters(), m.size());
        let mut error = [0.0; 6];
        for source in m.sources() {
            for k in 0..size {
                let part = |p: usize| self.statics.output(statics, map + k * n_u + p).0[lane] * offsets[p].0[lane];
                let share: f64 = source.range().map(part).sum();
                table.contribution.push(share);
                error[k] += share;
            }
        }
        table.error_first_order.extend_from_slice(&error[..size]);
    }
}

/// Where the outputs of the step program stand.
struct StepOutputs {
    size: usize,
    pivots: usize,
    scale: usize,
    gradient: usize,
    reactions: usize,
}

impl StepOutputs {
    #[inline(always)]
    const fn new(m: &Mechanism, layout: &Layout) -> Self {
        let size = layout.n_state();
        Self { size, pivots: size + 1, scale: size + 2, gradient: size + 3, reactions: size + 3 + m.n_parameters() }
    }
}

/// A Newton step with the reactions at the pose it starts from.
fn record_contact_step(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE);
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let statics = load_statics(m, &step.linear, &symbolic);
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots, statics.scale]);
    outputs.extend(statics.gradient);
    outputs.extend(statics.reactions);
    let program = Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs)?;
    Some(program.replacing(layout.state(m)))
}
