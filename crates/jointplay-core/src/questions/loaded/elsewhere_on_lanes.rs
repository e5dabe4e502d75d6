//! Whether the load may hold configurations of a block at other places, too.
//!
//! From a place of rest every offset on which the force may turn goes to its other ends, as [`crate::contact`] looks for
//! more work, in all lanes at a time. Where the load presses straight back there is no other place; all other lanes are
//! left to the plain solver.

use crate::clearance::Unforced;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::turning_on_lanes::may_turn;
use crate::clearance::undecided::UNDECIDED;
use crate::contact::balance_on_lanes::Balancing;
use crate::contact::elsewhere::{LEFT, SAME};
use crate::contact::push_on_lanes::{change, push};
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;
use crate::questions::loaded::steps_on_lanes::{StepOutputs, Steps};

/// Steps in which the load has to press back.
const STEPS: usize = 12;

/// By lane, the numbers of clearances with one of their other ends.
pub(super) type Ends = Vec<Vec<(usize, [f64; MAX_SIZE])>>;

/// The ends from which another place is looked for, from the offsets `at` and the forces there and at another place of
/// the play; of the lanes that are wanted.
#[inline(always)]
pub(super) fn other_ends<'b>(
    m: &Mechanism,
    gradient: impl Fn(usize) -> &'b Block,
    scale: &Block,
    elsewhere: &'b [Block],
    at: &[Block],
    wanted: &[bool; LANES],
) -> Ends {
    let tolerance = scale.mul(&Block::splat(UNDECIDED));
    let mut ends: Ends = vec![Vec::new(); LANES];
    if !m.is_searched() {
        return ends;
    }
    for (s, source) in m.sources().iter().enumerate().filter(|(_, s)| s.is_clearance && !s.set.is_zero()) {
        let n = source.set.size();
        let now: [&Block; MAX_SIZE] = std::array::from_fn(|k| gradient(source.first + k.min(n - 1)));
        let then: [&Block; MAX_SIZE] = std::array::from_fn(|k| &elsewhere[source.first + k.min(n - 1)]);
        let tolerance = tolerance.mul(&Block::splat(source.lever));
        let found = may_turn(&source.set, &now[..n], &then[..n], &tolerance);
        for (i, ends) in ends.iter_mut().enumerate().filter(|(i, _)| wanted[*i] && found.0[*i] > 0.0) {
            let mut offset = [0.0; MAX_SIZE];
            offset.iter_mut().zip(source.range()).for_each(|(offset, p)| *offset = at[p].0[i] - m.centre[p]);
            ends.extend(source.set.other_ends(&offset[..n]).into_iter().map(|end| (s, end)));
        }
    }
    ends
}

impl Steps<'_> {
    /// The ends from which the load may lead elsewhere, of those that are given; `step` are registers at the place of rest,
    /// which are lost.
    #[inline(always)]
    pub(super) fn leading(
        &self,
        ends: &Ends,
        sign: &Block,
        balance: &Balancing,
        step: &mut [Block],
        pushed: &mut [Block],
    ) -> Ends {
        let m = self.mechanism;
        let to = StepOutputs::new(m, &self.layout);
        let n_u = m.n_parameters();
        let rest = step[..n_u + self.layout.n_varying()].to_vec();
        let all = vec![[Unforced::default(); LANES]; m.sources().len()];
        let mut leading: Ends = vec![Vec::new(); LANES];
        for number in 0..ends.iter().map(Vec::len).max().unwrap_or(0) {
            step[..rest.len()].copy_from_slice(&rest);
            let mut balance = balance.clone();
            let mut away = [false; LANES];
            for (i, ends) in ends.iter().enumerate().filter(|(_, ends)| number < ends.len()) {
                let (source, end) = ends[number];
                for (p, x) in m.sources()[source].range().zip(end) {
                    step[p].0[i] = m.centre[p] + x;
                }
                away[i] = true;
            }
            let mut near = [true; LANES];
            for round in 0..STEPS {
                self.close.run(step);
                self.stay_near(&self.close, step, sign, &mut near);
                self.step.run(step);
                self.stay_near(&self.step, step, sign, &mut near);
                let out = |k: usize| self.step.output(step, k);
                push(m, Some(&all), |p| out(to.gradient + p), out(to.scale), step, pushed);
                self.balance(round, &mut balance, step, pushed);
                let back = change(m, &rest[..n_u], pushed);
                let least = if round == 0 { LEFT } else { SAME };
                for i in 0..LANES {
                    away[i] &= !(near[i] && back.0[i] <= least);
                }
                if (0..LANES).all(|i| !(away[i] && near[i])) {
                    break;
                }
                step[..n_u].copy_from_slice(&pushed[..n_u]);
            }
            for i in (0..LANES).filter(|&i| away[i]) {
                leading[i].push(ends[i][number]);
            }
        }
        leading
    }
}
