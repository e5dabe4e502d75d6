//! Recorded statics: the work of the loads along every parameter, reactions and first-order maps at a pose.

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Solver};
use crate::closure::recorded::elimination::Linear;
use crate::closure::recorded::layout::{Layout, Symbolic};
use crate::closure::recorded::step::record_step;
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::closure::sensitivity::Cost;
use crate::math::lanes::block::Block;
use crate::math::space::{Component, Pose};
use crate::mechanism::Mechanism;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;

/// Largest residual (m, rad) of a drive at the nominal pose: the case asks for its own nominal pose.
const SAME_DRIVES: f64 = 1e-12;
/// Growth of rounding up to which first-order maps are as good as by an elimination of their own.
const LARGEST_GROWTH: f64 = 1e5;

/// Reactions and gradient of the work of the loads at a pose.
pub(crate) struct Statics<'r> {
    pub gradient: Vec<Symbol<'r>>,
    pub scale: Symbol<'r>,
    pub reactions: Vec<Symbol<'r>>,
    pub drive_forces: Vec<Symbol<'r>>,
}

/// Where the outputs of the statics program stand.
pub(crate) struct StaticsOutputs {
    pub gradient: usize,
    pub scale: usize,
    pub pivots: usize,
    clear: usize,
    growth: usize,
    pub output: usize,
    pub map: usize,
    pub drives: usize,
    pub reactions: usize,
    pub drive_forces: usize,
}

impl StaticsOutputs {
    #[inline(always)]
    pub const fn new(m: &Mechanism) -> Self {
        let n_u = m.n_parameters();
        let reactions = n_u + 4 + m.size() + m.size() * n_u + m.n_drives();
        Self {
            gradient: 0,
            scale: n_u,
            pivots: n_u + 1,
            clear: n_u + 2,
            growth: n_u + 3,
            output: n_u + 4,
            map: n_u + 4 + m.size(),
            drives: n_u + 4 + m.size() + m.size() * n_u,
            reactions,
            drive_forces: reactions + m.n_joints() * m.size(),
        }
    }

    /// Whether the statics of a lane are those of its nominal pose; not where its coordinates are no numbers.
    #[inline(always)]
    pub fn is_sound<'b>(&self, m: &Mechanism, out: impl Fn(usize) -> &'b Block, lane: usize) -> bool {
        let is_clear = out(self.clear).0[lane].sqrt() >= CLEAR * m.singular_value;
        is_clear && out(self.growth).0[lane] <= LARGEST_GROWTH && self.is_at_drives(m, out, lane)
    }

    /// Whether the drive values of a lane are those of its coordinates.
    #[inline(always)]
    pub fn is_at_drives<'b>(&self, m: &Mechanism, out: impl Fn(usize) -> &'b Block, lane: usize) -> bool {
        let mut is_there = true;
        for d in 0..m.n_drives() {
            is_there &= out(self.drives + d).0[lane].abs() <= SAME_DRIVES;
        }
        is_there
    }
}

pub(crate) fn poses_of<'r>(m: &Mechanism, symbolic: &Symbolic<'r>) -> Vec<Pose<Symbol<'r>>> {
    symbolic.numbers.chunks_exact(m.space.n_pose_numbers()).map(|n| m.space.pose_of_numbers(n)).collect()
}

/// Gradient of a cost along the parameters, where they are so, and the multipliers.
pub(crate) fn gradient<'r>(
    m: &Mechanism,
    linear: &impl Linear<'r>,
    poses: &[Pose<Symbol<'r>>],
    at: &[Symbol<'r>],
    cost: Cost<Symbol<'r>>,
) -> (Vec<Symbol<'r>>, Vec<Symbol<'r>>) {
    let zero = Symbol::Constant(0.0);
    let Cost { mut twists, parameters } = cost;
    let mut multipliers = vec![zero; m.n_rows()];
    linear.solve_transposed(&mut twists, &mut multipliers);
    let mut inputs = Inputs { drives: vec![zero; m.n_drives()], parameters };
    m.pull_back(poses, at, &multipliers, &mut inputs);
    (inputs.parameters, multipliers)
}

impl Mechanism {
    /// Size of the multipliers as forces.
    pub(crate) fn largest_force<'r>(&self, multipliers: &[Symbol<'r>]) -> Symbol<'r> {
        self.rows.iter().zip(multipliers).fold(Symbol::Constant(0.0), |scale, (row, l)| {
            scale.max(match row.component {
                Component::Along(_) => l.abs(),
                Component::About(_) => (*l * Symbol::Constant(1.0 / self.length)).abs(),
            })
        })
    }
}

/// At a pose with its linearised closure.
pub(crate) fn load_statics<'r>(m: &Mechanism, linear: &impl Linear<'r>, symbolic: &Symbolic<'r>) -> Statics<'r> {
    let poses = poses_of(m, symbolic);
    let cost = m.load_cost(&poses, &symbolic.inputs.parameters);
    let (gradient, multipliers) = gradient(m, linear, &poses, &symbolic.inputs.parameters, cost);
    let scale = m.largest_force(&multipliers);
    let reactions = m.reactions(&poses, &symbolic.inputs.parameters, &multipliers);
    Statics { gradient, scale, reactions, drive_forces: m.drive_forces(&multipliers) }
}

/// Leaves of the parameters only the plays, which tell the flanks that carry.
pub(crate) fn perfect(m: &Mechanism, symbolic: &mut Symbolic<'_>) {
    let plays: Vec<usize> = m.plays().collect();
    for (p, parameter) in symbolic.inputs.parameters.iter_mut().enumerate() {
        if !plays.contains(&p) {
            *parameter = Symbol::Constant(0.0);
        }
    }
}

/// Statics and first-order maps of the nominal pose, outputs as [`StaticsOutputs`] has them.
pub(crate) fn record_statics(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE, &structure("statics", solver));
    let mut symbolic = layout.varying(m, &recorder);
    perfect(m, &mut symbolic);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let outputs = statics_outputs(m, layout, &recorder, &symbolic, &step.residual, &step.linear);
    Some(Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs, 0..0))
}

/// The outputs that [`StaticsOutputs`] has.
pub(crate) fn statics_outputs<'r>(
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
    outputs.extend([statics.scale, linear.pivot_product(), linear.singular_square(m), linear.growth()]);
    outputs.extend(output_of(m, layout, recorder, &poses, symbolic));
    for k in 0..m.size() {
        let cost = m.component_cost(k, &poses, &symbolic.inputs.parameters);
        outputs.extend(gradient(m, linear, &poses, &symbolic.inputs.parameters, cost).0);
    }
    outputs.extend(m.driven_rows.iter().map(|&r| residual[r]));
    outputs.extend(statics.reactions);
    outputs.extend(statics.drive_forces);
    outputs
}

fn output_of<'r>(
    m: &Mechanism,
    layout: &Layout,
    recorder: &'r Recorder,
    poses: &[Pose<Symbol<'r>>],
    symbolic: &Symbolic<'r>,
) -> Vec<Symbol<'r>> {
    let place = m.output_place(poses, &symbolic.inputs.parameters);
    m.pose_components(place, &m.turned(&layout.turn(m, recorder), &symbolic.numbers))
}

/// The output's place and what its body has turned, by a program that runs on the registers of another.
pub(crate) fn record_finish(m: &Mechanism, layout: &Layout, step: &Program) -> Program {
    let recorder = Recorder::new(SMALL_ANGLE, &("finish", m.n_parameters(), step.n_blocks()));
    let symbolic = layout.varying(m, &recorder);
    let outputs = output_of(m, layout, &recorder, &poses_of(m, &symbolic), &symbolic);
    Program::after(step, &recorder, &outputs, 0..0)
}
