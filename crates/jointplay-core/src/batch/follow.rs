//! Nominal poses of a block of configurations near a state.
//!
//! Every lane starts from an assembled state and takes Newton steps to drive values of its own. A lane
//! counts when its first move is small, the following ones shrink, and the determinant keeps its sign:
//! it is then on the branch of the state it came from. The others are followed plainly.

use super::SMALL_ANGLE;
use super::contact::singular_estimate;
use super::lanes::{Block, LANES};
use super::layout::Layout;
use super::program::record_step;
use super::symbol::{Recorder, Symbol};
use super::tape::Program;
use crate::mechanism::Mechanism;
use crate::solver::{Solver, State};
use crate::space::Component;

/// Steps that a block takes at most.
const STEPS: usize = 10;
/// Largest turn of a drive, radians: the step knows an angle by its sine, which has another root half a turn on.
const LARGEST_TURN: f64 = 1.0;
/// A step below this (length-scaled) is the last: the next would be its square.
const LAST: f64 = 1e-9;

/// The recorded step of one mechanism with perfect joints.
#[derive(Clone, Debug)]
pub struct Follow<'m> {
    mechanism: &'m Mechanism,
    step: Program,
}

impl<'m> Follow<'m> {
    /// Records the step; `None` when the mechanism has no plan or is too large.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        let layout = Layout::new(m);
        let recorder = Recorder::new(SMALL_ANGLE);
        let mut symbolic = layout.varying(m, &recorder);
        symbolic.inputs.parameters.fill(Symbol::Constant(0.0));
        let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
        let mut outputs = step.numbers;
        outputs.extend([step.size, step.pivots, singular_estimate(m, solver.plan.as_ref()?, &step.factors)]);
        let pose = m.n_parameters()..m.n_parameters() + layout.n_pose();
        let step = Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs)?.replacing(pose);
        Some(Self { mechanism: m, step })
    }

    /// Registers to work in.
    #[must_use]
    pub fn workspace(&self) -> Vec<Block> {
        self.step.registers(&[])
    }

    /// Solves up to a block of rows of drive values, each from a state of its own; states with as many
    /// rows of drive values, one after the other. `put` gets the row, its coordinates and an estimate
    /// of the smallest singular value of the length-scaled Jacobian, or none where the row is in doubt.
    #[inline(always)]
    pub fn solve(
        &self,
        registers: &mut [Block],
        from: &[&State],
        drives: &[f64],
        mut put: impl FnMut(usize, Option<(&[f64], f64)>),
    ) {
        let m = self.mechanism;
        let rows = from.len();
        for lane in 0..LANES {
            let row = lane.min(rows - 1);
            let drives = &drives[row * m.n_drives()..(row + 1) * m.n_drives()];
            Layout::load(m, &from[row].coordinates, drives, registers, lane);
        }
        let (n_u, n_pose) = (m.n_parameters(), m.n_bodies() * m.space.n_pose_numbers());
        let (size, pivots, clear) = (n_pose, n_pose + 1, n_pose + 2);
        let mut good = [true; LANES];
        for (row, state) in from.iter().enumerate() {
            good[row] = self.turns_little(state, &drives[row * m.n_drives()..(row + 1) * m.n_drives()]);
        }
        let mut done = [false; LANES];
        let mut last = Block::splat(SMALL_ANGLE * SMALL_ANGLE);
        let sign = |lane: usize| if from[lane.min(rows - 1)].negative { -1.0 } else { 1.0 };
        let mut parity = 0.0;
        for step in 0..STEPS {
            self.step.run(registers);
            let now = *self.step.output(registers, size);
            let product = *self.step.output(registers, pivots);
            if step == 0 {
                // The pivots' product has the determinant's sign up to the parity of their order.
                parity = if product.0[0] * sign(0) > 0.0 { 1.0 } else { -1.0 };
            }
            let mut all = true;
            for i in 0..LANES {
                let shrinks = now.0[i] <= if step == 0 { last.0[i] } else { 0.25 * last.0[i] };
                good[i] &= (shrinks || now.0[i] <= LAST * LAST) && product.0[i] * parity * sign(i) > 0.0;
                done[i] = now.0[i] <= LAST * LAST;
                all &= done[i] || !good[i];
            }
            if all {
                break;
            }
            last = now;
        }
        let mut coordinates = from[0].coordinates.clone();
        let width = m.space.n_pose_numbers();
        for row in 0..rows {
            if !good[row] || !done[row] {
                put(row, None);
                continue;
            }
            let size = m.n_body_coordinates();
            for (body, near) in from[row].coordinates.chunks_exact(size).enumerate() {
                let number = |k: usize| registers[n_u + body * width + k].0[row];
                m.space.coordinates_of_numbers(number, near, &mut coordinates[body * size..(body + 1) * size]);
            }
            put(row, Some((&coordinates, self.step.output(registers, clear).0[row])));
        }
    }
    fn turns_little(&self, from: &State, drives: &[f64]) -> bool {
        let m = self.mechanism;
        m.driven_rows.iter().zip(drives).zip(&from.inputs.drives).all(|((&row, to), from)| {
            matches!(m.rows[row].component, Component::Along(_)) || (to - from).abs() <= LARGEST_TURN
        })
    }
}
