//! Which rows of drive values are out of reach, many at a time: to find where a way ends takes hundreds of steps, where
//! most rows are solved in three.

use crate::closure::equations::Inputs;
use crate::closure::newton::between;
use crate::closure::pace::{Moves, Parts};
use crate::closure::recorded::layout::Layout;
use crate::interrupt;
use crate::math::lanes::block::Block;
use crate::mechanism::Mechanism;
use crate::nominal::on_lanes::{Follow, Start};
use crate::nominal::path::NEAR_THE_END;

/// Steps that a block takes at most.
const STEPS: usize = 2000;

/// The way of one lane, gone by the rules of [`crate::closure::newton::Solver::follow`].
struct Way {
    from: Inputs<f64>,
    to: Inputs<f64>,
    parts: Parts,
    moves: Moves,
    /// Whether the determinant is negative at the last state that was reached.
    negative: bool,
    /// Whether the pivots' product has the other sign; known after the first step.
    differs: Option<bool>,
    is_open: bool,
    is_out_of_reach: bool,
}

impl Way {
    fn new(m: &Mechanism, start: &Start<'_>, to: &[f64]) -> Self {
        let [from, to] = [start.drives, to].map(|drives| Inputs::nominal(m, drives));
        let parts = Parts::new(m.largest_part(&from, &to));
        let negative = start.negative;
        Self {
            from,
            to,
            parts,
            moves: Moves::default(),
            negative,
            differs: None,
            is_open: true,
            is_out_of_reach: false,
        }
    }

    /// The end of the next part.
    fn next(&self) -> Inputs<f64> {
        self.parts.next().map_or_else(|| self.to.clone(), |at| between(&self.from, &self.to, at))
    }

    /// Takes notice of a Newton step; tells whether the part has been gone or cannot be, as soon as that is known.
    fn see(&mut self, size: f64, product: f64) -> Option<bool> {
        let differs = *self.differs.get_or_insert((product < 0.0) != self.negative);
        let negative = (product < 0.0) != differs;
        let gone = match self.moves.add(size) {
            Some(false) => return None,
            Some(true) => self.moves.keep_branch(negative != self.negative),
            None => false,
        };
        self.moves = Moves::default();
        if gone {
            self.negative = negative;
            self.is_open = self.parts.next().is_some();
            self.parts.reached();
        } else {
            self.is_open = self.parts.failed();
            // A way that does not begin may begin at a singular state, and the end itself may be a dead centre.
            let done = self.parts.done;
            self.is_out_of_reach = !self.is_open && done > 0.0 && 1.0 - done >= NEAR_THE_END;
        }
        Some(gone)
    }
}

impl Follow<'_> {
    /// Of up to a block of rows of drive values, each with a start of its own, those to which the plain solver finds no
    /// way from there. The others, which may have none either, are left to it.
    #[inline(always)]
    pub fn out_of_reach(&self, registers: &mut [Block], from: &[Start<'_>], drives: &[f64]) -> Vec<bool> {
        let m = self.mechanism;
        // The plain solver sees to it that no tooth of a coupling is skipped.
        if m.joints.iter().any(|joint| joint.coupling.is_some()) {
            return vec![false; from.len()];
        }
        let rows = from.iter().zip(drives.chunks_exact(m.n_drives()));
        let mut ways: Vec<Way> = rows.map(|(start, to)| Way::new(m, start, to)).collect();
        let load = |way: &Way, registers: &mut [Block], lane: usize| {
            Layout::load(m, from[lane].coordinates, &way.next().drives, registers, lane);
        };
        for (lane, way) in ways.iter().enumerate() {
            load(way, registers, lane);
        }
        let pose = m.n_parameters()..m.n_parameters() + self.layout.n_pose();
        let mut reached = registers[pose.clone()].to_vec();
        let copy = |from: &[Block], to: &mut [Block], lane: usize| {
            to.iter_mut().zip(from).for_each(|(to, from)| to.0[lane] = from.0[lane]);
        };
        for _ in 0..STEPS {
            interrupt::check();
            self.step.run(registers);
            let [size, product] = self.judged().map(|output| *self.step.output(registers, output));
            for (lane, way) in ways.iter_mut().enumerate().filter(|(_, way)| way.is_open) {
                let Some(gone) = way.see(size.0[lane].sqrt(), product.0[lane]) else { continue };
                if gone {
                    copy(&registers[pose.clone()], &mut reached, lane);
                }
                load(way, registers, lane);
                copy(&reached, &mut registers[pose.clone()], lane);
            }
            if ways.iter().all(|way| !way.is_open) {
                break;
            }
        }
        ways.iter().map(|way| way.is_out_of_reach).collect()
    }
}
