//! Load-determined poses of a block of configurations.
//!
//! One recorded program gives the statics of the nominal pose (reactions, first-order maps, nearness
//! to a singular pose), another takes a Newton step of the closure together with the reactions at the
//! pose it starts from. Offsets that would turn a body too far for one step are approached in several. Between
//! steps every offset is moved to the support point of its set, until
//! pose, reactions and contacts have converged together. Lanes where the load decides nothing, contacts
//! flip or the closure is in doubt are left to the plain solver.

use crate::closure::newton::{CLEAR, Solver};
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::{SAME_DRIVES, StaticsOutputs, load_statics, record_finish, record_statics};
use crate::closure::recorded::step::record_step;
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::contact::flanks::run_at_flanks;
use crate::contact::push_on_lanes::{change, push, unforced_of};
use crate::math::lanes::block::{Block, LANES};
use crate::math::space::Space;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Rows;
use crate::mechanism::status::Status;
use crate::program::symbol::Recorder;
use crate::program::tape::Program;
use crate::questions::columns::{Loaded, LoadedRows};
use crate::questions::loaded::pressing::Pressing;

/// Steps that a block takes at most.
const STEPS: usize = 40;
/// Steps in which the first offsets are approached at most.
const PARTS: f64 = 16.0;
/// Turn of the output in space (rad) up to which it is told.
const LARGEST_TURN: f64 = 0.6;

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
    /// Records the programs; `None` when the mechanism has no plan or turns too far.
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
            finish: record_finish(m, &layout, &step),
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

    /// Solves up to a block of cases and puts their rows, from row `first` on, by `plainly` where the
    /// batch is in doubt.
    #[inline(always)]
    pub(crate) fn solve(
        &self,
        workspace: &mut [Vec<Block>; 2],
        cases: &[Case<'_>],
        rows: &mut LoadedRows<'_>,
        first: usize,
        mut plainly: impl FnMut(&Case<'_>) -> Loaded,
    ) {
        let m = self.mechanism;
        let (n_u, size) = (m.n_parameters(), m.size());
        let [statics, step] = workspace;
        for lane in 0..LANES {
            // Idle lanes repeat the first.
            let case = cases.get(lane).unwrap_or(&cases[0]);
            Layout::load(m, case.coordinates, case.drives, statics, lane);
        }
        run_at_flanks(m, &self.statics, statics);
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
        let unforced = unforced_of(m, |p| out(at.gradient + p), out(at.scale));
        let open = push(m, Some(&unforced), &[true; LANES], |p| out(at.gradient + p), out(at.scale), &mut pushed);
        let at_nominal: Vec<Block> = pushed.clone();

        let inputs = n_u + self.layout.n_varying();
        step[n_u..inputs].copy_from_slice(&statics[n_u..inputs]);
        let to = StepOutputs::new(m, &self.layout);
        let sign = out(at.pivots);
        let mut still = [false; LANES];
        let mut undecided = [false; LANES];
        let mut steps = [0_u64; LANES];
        let rounding = m.step_of_rounding();
        for round in 0..STEPS {
            step[..n_u].copy_from_slice(&pushed);
            self.step.run(step);
            if round == 0 {
                self.approach(&statics[n_u..inputs], sign, step, &mut good, &mut steps);
            }
            let out = |k: usize| self.step.output(step, k);
            undecided = push(m, Some(&unforced), &[true; LANES], |p| out(to.gradient + p), out(to.scale), &mut pushed);
            let changed = change(m, true, &step[..n_u], &pushed);
            let mut all = true;
            for i in 0..cases.len() {
                let moved = out(to.size).0[i];
                good[i] &= moved <= m.small_step() * m.small_step() && out(to.pivots).0[i] * sign.0[i] > 0.0;
                still[i] = moved <= rounding * rounding && changed.0[i] <= m.still();
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
            let row = first + i;
            if !(good[i] && still[i]) || self.turns_far(step, i) {
                rows.put(row, &plainly(case));
                continue;
            }
            let map = |k: usize, p: usize| self.statics.output(statics, at.map + k * n_u + p).0[i];
            let (unforced, mut observable) = (|s: usize| unforced[s][i], false);
            widths.fill(0.0);
            decided.fill(true);
            if open[i] {
                let force = |p: usize| self.statics.output(statics, at.gradient + p).0[i];
                let load = Pressing { force, scale: self.statics.output(statics, at.scale).0[i], unforced };
                observable |= m.leave_open(&load, map, map, &mut widths, &mut decided);
            }
            if undecided[i] {
                let force = |p: usize| self.step.output(step, to.gradient + p).0[i];
                let load = Pressing { force, scale: self.step.output(step, to.scale).0[i], unforced };
                observable |= m.leave_open(&load, map, map, &mut widths, &mut decided);
            }
            if observable {
                rows.put(row, &plainly(case));
                continue;
            }
            let lane = |b: &Block| b.0[i];
            self.put_shares(statics, &at_nominal, i, rows, row);
            let nominal = |k: usize| lane(self.statics.output(statics, at.output + k));
            rows.error.fill(row, |k| lane(self.finish.output(step, k)) - nominal(k));
            rows.undetermined.fill(row, |_| 0.0);
            rows.undetermined_contribution.put(row, &widths);
            rows.decided.put(row, &decided);
            rows.reaction.fill(row, |k| lane(self.step.output(step, to.reactions + k)));
            rows.offset.fill(row, |p| lane(&step[p]));
            rows.iterations.put(row, &[steps[i]]);
            rows.status.put(row, &[Status::Ok]);
        }
    }

    /// After a first step: where it went too far, goes back and takes several, each with a part of the offsets.
    #[inline(always)]
    fn approach(
        &self,
        nominal: &[Block],
        sign: &Block,
        step: &mut [Block],
        good: &mut [bool; LANES],
        steps: &mut [u64; LANES],
    ) {
        let (n_u, small) = (self.mechanism.n_parameters(), self.mechanism.small_step());
        let to = StepOutputs::new(self.mechanism, &self.layout);
        let mut parts = Block::splat(1.0);
        for i in 0..LANES {
            let length = self.step.output(step, to.size).0[i].sqrt();
            if good[i] && length > small {
                // Steps of half that length: they are not alike.
                parts.0[i] = (length / (0.5 * small)).ceil();
                good[i] = parts.0[i] <= PARTS;
            }
        }
        let most = (0..LANES).filter(|&i| good[i]).fold(1.0, |most: f64, i| most.max(parts.0[i]));
        if most <= 1.0 {
            return;
        }
        let offsets = step[..n_u].to_vec();
        step[n_u..n_u + nominal.len()].copy_from_slice(nominal);
        let mut part = 1.0;
        while part <= most {
            for (offset, whole) in step.iter_mut().zip(&offsets) {
                for i in 0..LANES {
                    offset.0[i] = if part < parts.0[i] { whole.0[i] * (part / parts.0[i]) } else { whole.0[i] };
                }
            }
            self.step.run(step);
            for i in 0..LANES {
                good[i] &= self.step.output(step, to.size).0[i] <= small * small
                    && self.step.output(step, to.pivots).0[i] * sign.0[i] > 0.0;
                steps[i] += u64::from(part < parts.0[i]);
            }
            part += 1.0;
        }
    }

    /// Whether the output of a lane has turned so far that its rotation is not known.
    #[inline(always)]
    fn turns_far(&self, step: &[Block], lane: usize) -> bool {
        let m = self.mechanism;
        let square = |k: usize| self.finish.output(step, k).0[lane].powi(2);
        m.space == Space::Spatial && (m.n_translations()..m.size()).map(square).sum::<f64>() > LARGEST_TURN.powi(2)
    }

    /// Puts the first-order error of one lane and the share of every source in it.
    #[inline(always)]
    fn put_shares(&self, statics: &[Block], offsets: &[Block], lane: usize, rows: &mut LoadedRows<'_>, row: usize) {
        if !rows.contribution.is_kept() {
            return;
        }
        let m = self.mechanism;
        let (map, n_u, size) = (StaticsOutputs::new(m).map, m.n_parameters(), m.size());
        let mut error = [0.0; 6];
        for (s, source) in m.sources().iter().enumerate() {
            for k in 0..size {
                let part = |p: usize| self.statics.output(statics, map + k * n_u + p).0[lane] * offsets[p].0[lane];
                let share: f64 = source.range().map(part).sum();
                rows.contribution.row(row)[s * size + k] = share;
                error[k] += share;
            }
        }
        rows.error_first_order.put(row, &error[..size]);
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
    let recorder = Recorder::new(SMALL_ANGLE, &structure("contact", solver));
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let statics = load_statics(m, &step.linear, &symbolic);
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots, statics.scale]);
    outputs.extend(statics.gradient);
    outputs.extend(statics.reactions);
    Some(Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs, layout.state(m)))
}
