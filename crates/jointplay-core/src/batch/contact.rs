//! Load-determined poses of a block of configurations.
//!
//! One recorded program gives the statics of the nominal pose (reactions, first-order maps, nearness
//! to a singular pose), another takes a Newton step of the closure together with the reactions at the
//! pose it starts from. Between steps every offset is moved to the support point of its set, until
//! pose, reactions and contacts stand still together. Lanes where the load decides nothing, contacts
//! flip or the closure is in doubt are left to the plain solver.

use super::SMALL_ANGLE;
use super::lanes::{Block, LANES};
use super::layout::{Layout, Symbolic};
use super::program::record_step;
use super::symbol::{Recorder, Symbol};
use super::tape::Program;
use super::tree::Linear;
use crate::ascent::UNDECIDED;
use crate::clearance::{MAX_SIZE, Mute, Set};
use crate::closure::Inputs;
use crate::loaded::{Case, Pressing};
use crate::mechanism::{Mechanism, Source};
use crate::sensitivity::Cost;
use crate::solver::Solver;
use crate::space::{Component, Pose};
use crate::status::Status;
use crate::table::Table;
use crate::trace::CLEAR;

/// Steps that a block takes at most.
const STEPS: usize = 40;
/// A step below this (length-scaled) is rounding.
const ROUNDING: f64 = 1e-13;
/// Largest residual (m, rad) of a drive at the nominal pose: the case asks for its own nominal pose.
pub(super) const SAME_DRIVES: f64 = 1e-12;

/// The recorded programs of one mechanism under its loads.
#[derive(Clone, Debug)]
pub struct Contact<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    statics: Program,
    step: Program,
    finish: Program,
}

/// Reactions and gradient of the work of the loads at a pose.
struct Statics<'r> {
    gradient: Vec<Symbol<'r>>,
    scale: Symbol<'r>,
    reactions: Vec<Symbol<'r>>,
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

    /// Appends the first-order error of one lane and the share of every source in it; gives the error.
    #[inline(always)]
    fn tell_shares(&self, statics: &[Block], offsets: &[Block], lane: usize, table: &mut Table) -> [f64; 6] {
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
        error
    }
}

/// Where the outputs of the statics program stand.
pub(super) struct StaticsOutputs {
    pub gradient: usize,
    pub scale: usize,
    pub pivots: usize,
    pub clear: usize,
    pub output: usize,
    pub map: usize,
    pub drives: usize,
    pub reactions: usize,
}

impl StaticsOutputs {
    #[inline(always)]
    pub const fn new(m: &Mechanism) -> Self {
        let n_u = m.n_parameters();
        Self {
            gradient: 0,
            scale: n_u,
            pivots: n_u + 1,
            clear: n_u + 2,
            output: n_u + 3,
            map: n_u + 3 + m.size(),
            drives: n_u + 3 + m.size() + m.size() * n_u,
            reactions: n_u + 3 + m.size() + m.size() * n_u + m.n_drives(),
        }
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

pub(super) fn poses_of<'r>(m: &Mechanism, symbolic: &Symbolic<'r>) -> Vec<Pose<Symbol<'r>>> {
    symbolic.numbers.chunks_exact(m.space.n_pose_numbers()).map(|n| m.space.pose_of_numbers(n)).collect()
}

/// Gradient of a cost along the parameters, and the multipliers.
pub(super) fn gradient<'r>(
    m: &Mechanism,
    linear: &impl Linear<'r>,
    poses: &[Pose<Symbol<'r>>],
    cost: Cost<Symbol<'r>>,
) -> (Vec<Symbol<'r>>, Vec<Symbol<'r>>) {
    let zero = Symbol::Constant(0.0);
    let Cost { mut twists, parameters } = cost;
    let mut multipliers = vec![zero; m.n_rows()];
    linear.solve_transposed(&mut twists, &mut multipliers);
    let mut inputs = Inputs { drives: vec![zero; m.n_drives()], parameters };
    m.pull_back(poses, &multipliers, &mut inputs);
    (inputs.parameters, multipliers)
}

impl Mechanism {
    /// Size of the multipliers as forces.
    pub(super) fn largest_force<'r>(&self, multipliers: &[Symbol<'r>]) -> Symbol<'r> {
        self.rows.iter().zip(multipliers).fold(Symbol::Constant(0.0), |scale, (row, l)| {
            scale.max(match row.component {
                Component::Along(_) => l.abs(),
                Component::About(_) => l.abs() * Symbol::Constant(1.0 / self.length),
            })
        })
    }
}

fn load_statics<'r>(m: &Mechanism, linear: &impl Linear<'r>, symbolic: &Symbolic<'r>) -> Statics<'r> {
    let poses = poses_of(m, symbolic);
    let cost = m.load_cost(&poses, &symbolic.inputs.parameters);
    let (gradient, multipliers) = gradient(m, linear, &poses, cost);
    let scale = m.largest_force(&multipliers);
    Statics { gradient, scale, reactions: m.reactions(&poses, &multipliers) }
}

/// Statics and first-order maps of the nominal pose, outputs as [`StaticsOutputs`] has them.
pub(super) fn record_statics(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE);
    let mut symbolic = layout.varying(m, &recorder);
    symbolic.inputs.parameters.fill(Symbol::Constant(0.0));
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let outputs = statics_outputs(m, layout, &recorder, &symbolic, &step.residual, &step.linear);
    Some(Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs))
}

/// The outputs that [`StaticsOutputs`] has.
pub(super) fn statics_outputs<'r>(
    m: &Mechanism,
    layout: &Layout,
    recorder: &'r Recorder,
    symbolic: &Symbolic<'r>,
    residual: &[Symbol<'r>],
    linear: &impl Linear<'r>,
) -> Vec<Symbol<'r>> {
    let statics = load_statics(m, linear, symbolic);
    let poses = poses_of(m, symbolic);
    let mut outputs = statics.gradient;
    outputs.extend([statics.scale, linear.pivot_product(), linear.singular_estimate(m)]);
    outputs.extend(output_of(m, layout, recorder, &poses, symbolic));
    for k in 0..m.size() {
        let cost = m.component_cost(k, &poses, &symbolic.inputs.parameters);
        outputs.extend(gradient(m, linear, &poses, cost).0);
    }
    outputs.extend(m.driven_rows.iter().map(|&r| residual[r]));
    outputs.extend(statics.reactions);
    outputs
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
    let program = Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs);
    Some(program.replacing(layout.state(m)))
}

fn output_of<'r>(
    m: &Mechanism,
    layout: &Layout,
    recorder: &'r Recorder,
    poses: &[Pose<Symbol<'r>>],
    symbolic: &Symbolic<'r>,
) -> Vec<Symbol<'r>> {
    let place = m.place(m.output, poses, &symbolic.inputs.parameters).position;
    m.pose_components(place, &m.turned(&layout.turn(m, recorder), &symbolic.numbers))
}

/// The output's place and what its body has turned, by a program that runs on the registers of another.
pub(super) fn record_finish(m: &Mechanism, layout: &Layout, step: &Program) -> Program {
    let recorder = Recorder::new(SMALL_ANGLE);
    let symbolic = layout.varying(m, &recorder);
    let outputs = output_of(m, layout, &recorder, &poses_of(m, &symbolic), &symbolic);
    Program::after(step, &recorder, &outputs)
}

/// What of every source the load does not push at the nominal pose.
#[inline(always)]
fn mutes<'b>(m: &Mechanism, gradient: impl Fn(usize) -> &'b Block, scale: &Block) -> Vec<[Mute; LANES]> {
    let mute = |source: &Source| {
        std::array::from_fn(|i| {
            let mut w = [0.0; MAX_SIZE];
            w.iter_mut().zip(source.range()).for_each(|(w, p)| *w = gradient(p).0[i]);
            source.set.mute(&w[..source.set.size()], m.undecided(source, UNDECIDED * scale.0[i]))
        })
    };
    m.sources().iter().map(mute).collect()
}

/// Whether a source is moved: by a load, a clearance.
#[inline(always)]
fn gives_way(source: &Source, loaded: bool) -> bool {
    !source.set.is_zero() && (source.is_clearance || !loaded)
}

/// Moves every source that gives way to the support point of its set along the gradient; what a tie or a
/// vanishing force leaves undecided stays where nothing pushes it. Tells the lanes where something is. Of
/// lanes that do not ask nothing can be relied on. A load gives with `mutes` what it does not push.
#[inline(always)]
pub(super) fn push<'b>(
    m: &Mechanism,
    mutes: Option<&[[Mute; LANES]]>,
    asking: &[bool; LANES],
    gradient: impl Fn(usize) -> &'b Block,
    scale: &Block,
    pushed: &mut [Block],
) -> [bool; LANES] {
    let mut undecided = [false; LANES];
    for (s, source) in m.sources().iter().enumerate().filter(|(_, s)| gives_way(s, mutes.is_some())) {
        let mute = |i: usize| mutes.map_or_else(Mute::default, |mutes| mutes[s][i]);
        let p = source.first;
        if let Set::Disc { radius } = source.set {
            let (x, y) = (gradient(p), gradient(p + 1));
            let size = x.mul(x).add(&y.mul(y)).sqrt();
            let mut decided = [false; LANES];
            for i in 0..LANES {
                decided[i] = size.0[i] > UNDECIDED * scale.0[i] && mute(i).is_none();
                undecided[i] |= !decided[i];
            }
            let part = Block::splat(radius).div(&size);
            for (p, w) in [(p, x), (p + 1, y)] {
                pushed[p] = Block::splat(m.centre[p]).add(&part.mul(w)).where_else(&decided, &pushed[p]);
            }
            continue;
        }
        let n = source.set.size();
        for i in (0..LANES).filter(|&i| asking[i]) {
            let mut w = [0.0; MAX_SIZE];
            let mut offset = [0.0; MAX_SIZE];
            for k in 0..n {
                w[k] = gradient(p + k).0[i];
                offset[k] = pushed[p + k].0[i] - m.centre[p + k];
            }
            let w = source.set.heard(&w[..n], mute(i));
            let face = source.set.face(&w[..n], m.undecided(source, UNDECIDED * scale.0[i]));
            let to = if face.is_point() { face.centre } else { face.nearest(&offset[..n]) };
            undecided[i] |= !face.is_point();
            for k in 0..n {
                pushed[p + k].0[i] = m.centre[p + k] + to[k];
            }
        }
    }
    undecided
}

/// Largest change of an offset, as a part of its set.
#[inline(always)]
pub(super) fn change(m: &Mechanism, loaded: bool, from: &[Block], to: &[Block]) -> Block {
    let mut largest = Block::splat(0.0);
    for source in m.sources().iter().filter(|s| gives_way(s, loaded)) {
        for p in source.range() {
            let size = Block::splat(source.set.half_width(p - source.first));
            largest = to[p].sub(&from[p]).abs().div(&size).max(&largest);
        }
    }
    largest
}
