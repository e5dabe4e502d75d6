//! Which flanks of couplings a load closes.
//!
//! The line of action of a coupling with play is that of the flank that carries, at the nominal pose, too. Since the
//! forces there tell which one that is, they are asked for again until the flanks stay as they are.

use crate::closure::newton::{Linearised, Solver, State};
use crate::closure::recorded::statics::StaticsOutputs;
use crate::closure::sensitivity::Gradient;
use crate::contact::push_on_lanes::{push, unforced_of};
use crate::math::lanes::block::Block;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::program::tape::Program;

/// Times that the flanks are looked for.
pub(crate) const FLANKS: usize = 4;

impl Mechanism {
    /// The linearisation at the nominal pose for the flanks that the load closes, the inputs that tell these, and the
    /// reactions.
    pub(crate) fn at_flanks<'s>(
        &self,
        solver: &'s Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
    ) -> Option<(Linearised<'s>, State, Gradient)> {
        let mut flanks = nominal.clone();
        let mut at = solver.linearise(&flanks)?;
        let mut gradient = self.load_gradient(&at, &flanks);
        for _ in 0..if self.plays().next().is_some() { FLANKS } else { 0 } {
            let pressed = self.support_update_loaded(&gradient, &self.built(case.drives), &self.unforced_of(&gradient));
            let before = flanks.inputs.clone();
            self.plays().for_each(|p| flanks.inputs.parameters[p] = pressed.parameters[p]);
            if before == flanks.inputs {
                break;
            }
            at = solver.linearise(&flanks)?;
            gradient = self.load_gradient(&at, &flanks);
        }
        Some((at, flanks, gradient))
    }
}

/// Runs the statics of nominal poses for the flanks of couplings that the load closes.
#[inline(always)]
pub(crate) fn run_at_flanks(m: &Mechanism, statics: &Program, registers: &mut [Block]) {
    m.plays().for_each(|p| registers[p] = Block::splat(0.0));
    statics.run(registers);
    if m.plays().next().is_none() {
        return;
    }
    let at = StaticsOutputs::new(m);
    for _ in 0..FLANKS {
        let out = |k: usize| statics.output(registers, k);
        let unforced = unforced_of(m, |p| out(at.gradient + p), out(at.scale));
        let centre: Vec<Block> = m.centre.iter().map(|centre| Block::splat(*centre)).collect();
        let mut pushed = centre.clone();
        push(m, Some(&unforced), |p| out(at.gradient + p), out(at.scale), &centre, &mut pushed);
        let moves = |p: usize| pushed[p].0.iter().zip(registers[p].0).any(|(to, from)| (to - from).abs() > 0.0);
        if !m.plays().any(moves) {
            break;
        }
        m.plays().for_each(|p| registers[p] = pushed[p]);
        statics.run(registers);
    }
}
