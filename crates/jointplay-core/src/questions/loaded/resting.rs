//! Where a mechanism comes to rest under its load, and what stays open there.

use crate::clearance::undecided::Unforced;
use crate::closure::newton::{Linearised, Solver};
use crate::closure::sensitivity::{Gradient, Output};
use crate::contact::indeterminacy::{Left, Rest};
use crate::contact::state::Contact;
use crate::mechanism::Mechanism;
use crate::questions::loaded::pressing::Pressing;

/// A mechanism at rest under its load.
pub(super) struct AtRest<'m> {
    pub contact: Contact,
    pub displaced: Linearised<'m>,
    pub left: Left,
    /// What is open around the contact, where it moves the output.
    pub around: Option<Rest>,
    /// What does not listen to the load there.
    pub held: Vec<Unforced>,
}

impl AtRest<'_> {
    /// Where a mechanism goes that rests at a minimum of the load's work; `None` where it stays, or where that moves the output
    /// to first order. `nominal` is the map at the nominal pose.
    pub fn off_balance(&self, solver: &Solver<'_>, nominal: &Output) -> Option<Contact> {
        let rests = !self.left.observable && !self.left.decided.iter().all(|decided| *decided);
        rests.then(|| solver.off_balance(&self.contact, &self.displaced, &self.held, nominal))?
    }
}

impl Mechanism {
    /// Adds what forces leave open, with the maps at the nominal pose and at the pose of the forces.
    pub(super) fn leave_open_at(
        &self,
        gradient: &Gradient,
        unforced: &[Unforced],
        [nominal, map]: [&Output; 2],
        left: &mut Left,
    ) {
        let load = Pressing {
            force: |p: usize| gradient.inputs.parameters[p],
            scale: self.force_scale(gradient),
            unforced: |s: usize| unforced[s],
        };
        let [nominal, map] = [nominal, map].map(|map| |k: usize, p: usize| map.parameters[(k, p)]);
        left.observable |= self.leave_open(&load, nominal, map, &mut left.open, &mut left.decided);
    }
}

impl Solver<'_> {
    /// Where a contact comes to rest: `held` did not listen to the load on the way there, `nominal` is the map at the nominal
    /// pose, and `left` is what was left open there. `None` where the closure is singular.
    pub(super) fn at_rest(
        &self,
        contact: Contact,
        held: &[Unforced],
        nominal: &Output,
        mut left: Left,
    ) -> Option<AtRest<'_>> {
        let m = self.mechanism;
        let all = vec![Unforced::default(); m.sources().len()];
        let displaced = self.linearise(&contact.state)?;
        let map = m.output_sensitivity(&displaced, &contact.state);
        left.decided.fill(true);
        m.leave_open_at(&contact.gradient, held, [nominal, &map], &mut left);
        let mut at = AtRest { contact, displaced, left, around: None, held: held.to_vec() };
        if at.left.observable {
            let moves = |open: &[f64]| open.iter().any(|o| *o > 0.0);
            let left_out = |(held, open): (&Unforced, &[f64])| if moves(open) { Unforced::default() } else { *held };
            let counted: Vec<Unforced> = held.iter().zip(at.left.open.chunks_exact(m.size())).map(left_out).collect();
            let rest = self.rest(&at.contact, held, &counted);
            let rest = rest.and_then(|rest| Some((self.linearise(&rest.contact.state)?, rest)));
            if let Some((displaced, rest)) = rest {
                let map = m.output_sensitivity(&displaced, &rest.contact.state);
                at.left = m.left_open(&rest, &counted, &nominal.parameters, &map.parameters);
                (at.contact, at.displaced, at.held) = (rest.contact.clone(), displaced, counted);
                at.around = at.left.observable.then_some(rest);
            } else {
                at.around = self.as_it_is(at.contact.clone(), held);
            }
        }
        if !at.left.observable && held != all {
            // The closure has decided what moves the output: the rest goes where it is pushed, too.
            let settled = self.settle(at.contact.state.clone(), &all)?;
            at.displaced = self.linearise(&settled.state)?;
            let mut pushed = Left::nothing(m);
            m.leave_open_at(&settled.gradient, &all, [nominal, &map], &mut pushed);
            let then = held.iter().zip(pushed.decided).map(|(held, pushed)| pushed && !held.is_none());
            at.left.decided.iter_mut().zip(then).for_each(|(decided, then)| *decided |= then);
            (at.contact, at.held) = (settled, all);
        }
        Some(at)
    }
}
