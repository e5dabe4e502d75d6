//! Contact under the load: where offsets, reactions and pose agree.
//!
//! Every offset lies where its set supports the force that presses it there, `F(u) in N_C(u)`, with F the
//! reactions at the pose that belongs to the offsets u. This is a variational inequality and no maximum: a
//! moment that keeps its direction in space has no potential, so that there is no work whose value could
//! lead the way. The equations themselves do. Whole steps, each offset to its support point, nearly always
//! settle; where they do not, [`semismooth`] takes over.

pub(crate) mod balance_on_lanes;
pub(crate) mod elsewhere;
mod extent;
pub(crate) mod flanks;
pub(crate) mod indeterminacy;
pub(crate) mod mixing_on_lanes;
pub(crate) mod off_balance;
mod open_faces;
pub(crate) mod push_on_lanes;
mod semismooth;
pub(crate) mod state;
mod ties;

use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::equations::Inputs;
use crate::closure::newton::{Linearised, Solver, State, between};
use crate::closure::sensitivity::Gradient;
use crate::contact::semismooth::Newton;
use crate::contact::state::Contact;
use crate::mechanism::{Mechanism, Source};

/// Whole steps to the support points.
const WHOLE_STEPS: usize = 25;
/// Parts of a step that are tried where all of it leads to where the mechanism cannot be assembled, each half
/// of the one before.
const WALLS: i32 = 6;
/// Steps in which contacts find their sides.
pub(crate) const FIRST: usize = 5;
/// Steps converge that shrink to this part of the one before.
const SHRINKS: f64 = 0.3;
/// Four steps that leave more than this part of the change will not settle soon.
const SHRUNK: f64 = 0.05;

impl Mechanism {
    /// The inputs with every source that gives way moved to the nearest point of the face it is pushed to:
    /// what nothing pushes stays where it is. `unforced` tells what a source that gives way does not listen to.
    pub(crate) fn support_update(
        &self,
        gradient: &Gradient,
        inputs: &Inputs<f64>,
        unforced: impl Fn(usize, &Source) -> Option<Unforced>,
    ) -> Inputs<f64> {
        let scale = self.force_scale(gradient);
        let mut pushed = inputs.clone();
        for (s, source) in self.sources.iter().enumerate() {
            let Some(unforced) = unforced(s, source) else { continue };
            let offset: Vec<f64> = source.range().map(|p| inputs.parameters[p] - self.centre[p]).collect();
            let force = source.set.masked_force(&gradient.inputs.parameters[source.range()], unforced);
            let tolerance = source.undecided(UNDECIDED * scale);
            let nearest = source.set.face(&force[..offset.len()], tolerance).nearest(&offset);
            for (k, p) in source.range().enumerate() {
                pushed.parameters[p] = self.centre[p] + nearest[k];
            }
        }
        pushed
    }

    /// Gradient of the work of the load.
    pub(crate) fn load_gradient(&self, linearised: &Linearised<'_>, state: &State) -> Gradient {
        self.gradient(linearised, self.load_cost(&linearised.poses, &state.inputs.parameters))
    }

    /// What of every source the load does not push at the nominal pose.
    pub(crate) fn unforced_of(&self, nominal: &Gradient) -> Vec<Unforced> {
        let scale = self.force_scale(nominal);
        let unforced = |source: &Source| {
            let force = &nominal.inputs.parameters[source.range()];
            source.set.unforced(force, source.undecided(UNDECIDED * scale))
        };
        self.sources.iter().map(unforced).collect()
    }

    /// The inputs with every clearance moved to where the load presses it.
    pub(crate) fn support_update_loaded(
        &self,
        gradient: &Gradient,
        inputs: &Inputs<f64>,
        unforced: &[Unforced],
    ) -> Inputs<f64> {
        self.support_update(gradient, inputs, |s, source| source.is_clearance.then_some(unforced[s]))
    }
}

impl Solver<'_> {
    /// Brings contact and reactions to agree, from a state on; `None` where the closure is singular.
    #[must_use]
    pub fn settle(&self, from: State, unforced: &[Unforced]) -> Option<Contact> {
        self.settle_from(self.at(from)?, unforced)
    }

    /// The same from a contact on.
    pub(crate) fn settle_from(&self, from: Contact, unforced: &[Unforced]) -> Option<Contact> {
        self.settle_unless(from, unforced, &|_| false)
    }

    /// The forces at a state.
    fn at(&self, state: State) -> Option<Contact> {
        let gradient = self.mechanism.load_gradient(&self.linearise(&state)?, &state);
        Some(Contact { state, gradient, steps: 0, settled: false, blocked: false })
    }

    /// The same from a state that is pressed for the first time: `nominal` are the forces at the nominal pose, `unforced` what
    /// they do not push, `held` what of that does not count. Gives forces at another place of the play, too: those at the
    /// nominal pose, NaN where they vanish. There the output is moved by the square of the play only, whichever end it is.
    pub(crate) fn settle_first(
        &self,
        from: State,
        nominal: &Gradient,
        unforced: &[Unforced],
        held: &[Unforced],
    ) -> Option<(Contact, Vec<f64>)> {
        let m = self.mechanism;
        let mut elsewhere = nominal.inputs.parameters.clone();
        let released = |(s, source): &(usize, &Source)| source.is_clearance && unforced[*s] != held[*s];
        let released: Vec<&Source> = m.sources.iter().enumerate().filter(released).map(|(_, source)| source).collect();
        if released.is_empty() {
            return Some((self.settle(from, held)?, elsewhere));
        }
        let at = self.at(from)?;
        let first = self.towards(&at, &m.support_update_loaded(nominal, &at.state.inputs, unforced))?;
        for source in released {
            elsewhere[source.range()].fill(f64::NAN);
        }
        Some((self.settle_from(first, held)?, elsewhere))
    }

    /// Brings contact and reactions to agree, from a contact on; `None` as soon as whole steps converge to offsets that are
    /// `known`.
    fn settle_unless(
        &self,
        from: Contact,
        unforced: &[Unforced],
        known: &dyn Fn(&Inputs<f64>) -> bool,
    ) -> Option<Contact> {
        let m = self.mechanism;
        let mut at = Contact { settled: false, blocked: false, ..from };
        let mut newton = Newton::new(self, unforced);
        let (mut changes, mut last) = ([f64::INFINITY; 4], 0.0);
        for step in 0..WHOLE_STEPS {
            let pressed = m.support_update_loaded(&at.gradient, &at.state.inputs, unforced);
            let change = m.change(&at.state.inputs, &pressed);
            if change <= m.still() {
                at.settled = true;
                return Some(at);
            }
            // Near a place that repels, steps grow.
            if change <= SHRINKS * last && known(&at.state.inputs) && known(&pressed) {
                return None;
            }
            last = change;
            let before = std::mem::replace(&mut changes[step % 4], change);
            if step >= FIRST && !at.blocked && change > SHRUNK * before {
                break;
            }
            let Some(next) = self.towards(&at, &pressed) else { break };
            newton.learn(&at, &next);
            at = next;
        }
        Some(newton.settle(at))
    }

    /// The contact after a step, or as much of it as can be assembled.
    fn towards(&self, at: &Contact, to: &Inputs<f64>) -> Option<Contact> {
        let part = |k: i32| {
            let next = self.contact(at, &between(&at.state.inputs, to, 0.5_f64.powi(k)))?;
            Some(Contact { blocked: true, ..next })
        };
        self.contact(at, to).or_else(|| (1..WALLS).find_map(part))
    }

    /// The contact at other offsets; none where the mechanism cannot be assembled there or is singular.
    pub(crate) fn contact(&self, at: &Contact, inputs: &Inputs<f64>) -> Option<Contact> {
        let state = self.follow(&at.state, inputs).ok()?;
        let gradient = self.mechanism.load_gradient(&self.linearise(&state)?, &state);
        Some(Contact { state, gradient, steps: at.steps + 1, ..*at })
    }
}
