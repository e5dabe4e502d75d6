//! Nominal poses of a block of configurations near a state.
//!
//! Every lane starts from an assembled state and takes Newton steps to drive values of its own. A lane
//! counts when its first move is small, the following ones shrink, and the determinant keeps its sign:
//! it is then on the branch of the state it came from. The others are followed plainly.

use crate::closure::newton::{QUADRATIC, Solver, State};
use crate::closure::recorded::elimination::Linear;
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::poses_of;
use crate::closure::recorded::step::{Moved, Step, evaluate, record_step, step_by};
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::closure::tree::on_lanes::OnTree;
use crate::math::lanes::block::{Block, LANES};
use crate::math::space::{Component, Space};
use crate::mechanism::Mechanism;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;

/// Steps that a block takes at most.
const STEPS: usize = 10;
/// Largest turn of a drive, radians: the step knows an angle by its sine, which has another root half a turn on.
const LARGEST_TURN: f64 = 1.0;
/// Coordinates that are taken from the lanes at a time.
const AT_ONCE: usize = 8;
/// A step below this (length-scaled) is the last: the next would be its square, times what the inverse of
/// the Jacobian magnifies, which is bounded where a row is not in doubt.
const LAST: f64 = 1e-8;

/// A state that a lane starts from.
#[derive(Clone, Copy, Debug)]
pub struct Start<'s> {
    /// Coordinates of all bodies.
    pub coordinates: &'s [f64],
    /// Drive values.
    pub drives: &'s [f64],
    /// Whether the determinant of its Jacobian is negative.
    pub negative: bool,
}

impl<'s> Start<'s> {
    /// From a state.
    #[must_use]
    pub fn of(state: &'s State) -> Self {
        Self { coordinates: &state.coordinates, drives: &state.inputs.drives, negative: state.negative }
    }
}

/// The recorded step of one mechanism with perfect joints.
#[derive(Clone, Debug)]
pub struct Follow<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    step: Program,
    /// Registers of the coordinates of all bodies.
    coordinates: Vec<usize>,
}

impl<'m> Follow<'m> {
    /// Records the step; `None` when the mechanism has no plan.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        let layout = Layout::new(m);
        let recorder = Recorder::new(SMALL_ANGLE, &structure("follow", solver));
        let mut symbolic = layout.varying(m, &recorder);
        symbolic.inputs.parameters.fill(Symbol::Constant(0.0));
        let turn = layout.turn(m, &recorder);
        // With perfect joints the rows are those of a tree and its loops.
        let (mut outputs, twists, judged) = if let Some(linear) = OnTree::new(solver, &poses_of(m, &symbolic)) {
            let [residual, _] = evaluate(m, &symbolic);
            let Moved { numbers, size, twists, .. } = step_by(m, &symbolic, &residual, &linear, &turn);
            (numbers, twists, [size, linear.pivot_product(), linear.singular_square(m)])
        } else {
            let Step { numbers, size, twists, pivots, linear, .. } = record_step(solver, &symbolic, &turn)?;
            (numbers, twists, [size, pivots, linear.singular_square(m)])
        };
        let (first, end) = (m.n_parameters(), m.n_parameters() + layout.n_varying());
        let angles = end..end + Self::n_angles(m);
        let turned = angles.clone().zip(twists.iter().skip(2).step_by(m.size()));
        outputs.extend(turned.map(|(angle, twist)| recorder.varying(angle) + *twist));
        outputs.extend(judged);
        let state = (first..first + layout.n_pose()).chain(angles.clone());
        let step = Program::new(&recorder, angles.end, &outputs, state);
        let coordinates = match m.space {
            Space::Planar => {
                angles.enumerate().flat_map(|(b, angle)| [first + 4 * b, first + 4 * b + 1, angle]).collect()
            }
            Space::Spatial => (first..first + layout.n_pose()).collect(),
        };
        Some(Self { mechanism: m, layout, step, coordinates })
    }

    /// Angles of bodies, which their pose numbers do not tell over full turns.
    fn n_angles(m: &Mechanism) -> usize {
        if m.space == Space::Planar { m.n_bodies() } else { 0 }
    }

    /// Registers to work in.
    #[must_use]
    pub fn workspace(&self) -> Vec<Block> {
        self.step.registers(&[])
    }

    /// Solves up to a block of rows of drive values, each from a start of its own; as many rows of drive
    /// values and of coordinates to be found, one after the other. Gives an estimate of the smallest
    /// singular value of the length-scaled Jacobian for every row, not a number where the row is in doubt:
    /// its coordinates are then left as they were.
    #[inline(always)]
    pub fn solve(
        &self,
        registers: &mut [Block],
        from: &[Start<'_>],
        drives: &[f64],
        found: &mut [f64],
    ) -> [f64; LANES] {
        let m = self.mechanism;
        let rows = from.len();
        let drives_of = |row: usize| &drives[row * m.n_drives()..(row + 1) * m.n_drives()];
        // Idle lanes repeat the last row.
        let given = |lane: usize| (from[lane.min(rows - 1)].coordinates, drives_of(lane.min(rows - 1)));
        self.layout.load_all(m, given, registers);
        let (n_pose, n_angles) = (self.layout.n_pose(), Self::n_angles(m));
        let angles = &mut registers[m.n_parameters() + self.layout.n_varying()..][..n_angles];
        for (b, angle) in angles.iter_mut().enumerate() {
            for lane in 0..LANES {
                angle.0[lane] = given(lane).0[3 * b + 2];
            }
        }
        let [size, pivots, clear] = [0, 1, 2].map(|k| n_pose + n_angles + k);
        let mut good = [true; LANES];
        for (row, start) in from.iter().enumerate() {
            good[row] = self.turns_little(start, drives_of(row));
        }
        let mut done = [false; LANES];
        let mut last = Block::splat(m.small_step() * m.small_step());
        let signs: [f64; LANES] = std::array::from_fn(|i| if from[i.min(rows - 1)].negative { -1.0 } else { 1.0 });
        let mut parity = 0.0;
        for step in 0..STEPS {
            self.step.run(registers);
            let now = *self.step.output(registers, size);
            let product = *self.step.output(registers, pivots);
            if step == 0 {
                // The pivots' product has the determinant's sign up to the parity of their order.
                parity = if product.0[0] * signs[0] > 0.0 { 1.0 } else { -1.0 };
            }
            // Squares. Where two branches cross, every step leaves a half, and either of them may be found.
            let most = [1.0, 0.25, QUADRATIC * QUADRATIC][step.min(2)];
            let mut all = true;
            for i in 0..LANES {
                let shrinks = now.0[i] <= most * last.0[i];
                good[i] &= (shrinks || now.0[i] <= LAST * LAST) && product.0[i] * parity * signs[i] > 0.0;
                done[i] = now.0[i] <= LAST * LAST;
                all &= done[i] || !good[i];
            }
            if all {
                break;
            }
            last = now;
        }
        let mut clear = self.step.output(registers, clear).0;
        for i in 0..LANES {
            clear[i] = if good[i] && done[i] { clear[i].sqrt() } else { f64::NAN };
        }
        if m.space == Space::Spatial {
            for numbers in registers[m.n_parameters()..][..n_pose].chunks_exact_mut(m.space.n_pose_numbers()) {
                normalise(&mut numbers[3..]);
            }
        }
        // Some at a time: blocks lie far from each other in memory.
        let n = self.coordinates.len();
        for (first, coordinates) in self.coordinates.chunks(AT_ONCE).enumerate() {
            let mut blocks = [&registers[0]; AT_ONCE];
            for (block, &register) in blocks.iter_mut().zip(coordinates) {
                *block = &registers[register];
            }
            for row in 0..rows {
                if !clear[row].is_finite() {
                    continue;
                }
                let found = &mut found[row * n + first * AT_ONCE..][..coordinates.len()];
                for (found, block) in found.iter_mut().zip(&blocks) {
                    *found = block.0[row];
                }
            }
        }
        clear
    }

    fn turns_little(&self, from: &Start<'_>, drives: &[f64]) -> bool {
        let m = self.mechanism;
        m.driven().all(|(row, by)| {
            let turn = by.coefficient * (drives[by.drive] - from.drives[by.drive]);
            matches!(row.component, Component::Along(_)) || turn.abs() <= LARGEST_TURN
        })
    }
}

/// Gives quaternions unit size.
#[inline(always)]
fn normalise(quaternions: &mut [Block]) {
    let mut sum = Block::splat(0.0);
    for number in &*quaternions {
        sum = sum.add(&number.mul(number));
    }
    let scale = Block::splat(1.0).div(&sum.sqrt());
    for number in quaternions {
        *number = number.mul(&scale);
    }
}
