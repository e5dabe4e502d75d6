//! Other places where the load may hold a mechanism, of which the one with the most work counts.
//!
//! Contact and reactions agree at more than one place where a reaction is so small that the play turns it: a pin is held
//! at either side of its slot, a guide on one corner or another. From a place of rest every offset on which the force may
//! turn goes to the other ends of its set, one after the other, and the load presses on from there. The work from one place
//! to another is that of the forces along the straight way, `W = integral of F(u) . du`, by Boole's rule; that of constant
//! forces and springs does not depend on the way.

use crate::clearance::offset::{MAX_SIZE, inner};
use crate::clearance::turning_on_lanes::may_turn;
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State, between};
use crate::contact::state::Contact;
use crate::interrupt;
use crate::math::boole::WEIGHTS;
use crate::math::lanes::block::Block;
use crate::mechanism::{Mechanism, Source};

/// Times that a better place is looked for from the best one.
const ROUNDS: usize = 6;
/// Places that are looked at, at most.
const PLACES: usize = 16;
/// Whether an offset has left its end is told by half of its set.
pub(crate) const LEFT: f64 = 0.5;
/// Two places are one where no offset differs by more than this part of its set.
pub(crate) const SAME: f64 = 1e-4;
/// Work that is less than this part of what the load does within the play is none.
const MORE: f64 = 1e-9;

/// What is known of the places to which the load may lead from the other ends of the play.
pub(crate) struct Leads {
    /// The place of rest.
    pub offsets: Vec<f64>,
    /// The numbers of clearances with those of their other ends from which it does not lead back there.
    pub ends: Vec<(usize, [f64; MAX_SIZE])>,
}

/// Places where contact and reactions agree, the one with the most work first.
pub(crate) struct Places {
    pub best: Contact,
    /// Whether that is not the place from which they were looked for.
    pub is_elsewhere: bool,
    /// How many have been seen.
    pub seen: usize,
}

impl Mechanism {
    /// The clearances on which the force may turn within the play, by the forces elsewhere in it.
    fn turning<'m>(
        &'m self,
        at: &'m Contact,
        elsewhere: &'m [f64],
        unforced: &'m [Unforced],
    ) -> impl Iterator<Item = &'m Source> + 'm {
        let tolerance = UNDECIDED * self.force_scale(&at.gradient);
        let turns = move |s: usize, source: &Source| {
            let own = |forces: &[f64]| -> Vec<Block> {
                let force = source.set.masked_force(&forces[source.range()], unforced[s]);
                force[..source.set.size()].iter().map(|f| Block::splat(*f)).collect()
            };
            let [now, then] = [own(&at.gradient.inputs.parameters), own(elsewhere)];
            let [now, then]: [Vec<&Block>; 2] = [now.iter().collect(), then.iter().collect()];
            may_turn(&source.set, &now, &then, &Block::splat(source.undecided(tolerance))).0[0] > 0.0
        };
        let is_searched = self.is_searched();
        let clearances =
            self.sources.iter().enumerate().filter(move |(_, s)| is_searched && s.is_clearance && !s.set.is_zero());
        clearances.filter(move |(s, source)| turns(*s, source)).map(|(_, source)| source)
    }
}

impl Solver<'_> {
    /// The place with the most work among those that are found from a place of rest, or any where contact and reactions
    /// did not agree there; `elsewhere` are the forces at another place of the play, `unforced` what does not listen to
    /// them, `leads` what is known of the ends at a place, and only places count that are `accepted`.
    pub(crate) fn most_work(
        &self,
        from: Contact,
        elsewhere: &[f64],
        unforced: &[Unforced],
        leads: Option<Leads>,
        accepted: impl Fn(&State) -> bool,
    ) -> Places {
        let m = self.mechanism;
        let mut seen = vec![from.state.inputs.clone()];
        let mut best = from;
        let mut is_elsewhere = false;
        let is_there = |leads: &Leads| {
            let there = Inputs { parameters: leads.offsets.clone(), ..best.state.inputs.clone() };
            m.change(&there, &best.state.inputs) <= SAME
        };
        let mut leads = leads.filter(is_there);
        for _ in 0..ROUNDS {
            let mut more: Option<(f64, Contact)> = None;
            let least = if best.settled { MORE * m.work_of_play(&best) } else { f64::NEG_INFINITY };
            let all = || {
                let ends = m.turning(&best, elsewhere, unforced).flat_map(|source| {
                    let offset = m.offset(source, &best.state.inputs);
                    source.set.other_ends(&offset).into_iter().map(move |end| (source, end))
                });
                ends.collect::<Vec<_>>()
            };
            let known = leads.take().map(|leads| leads.ends.into_iter().map(|(s, end)| (&m.sources[s], end)).collect());
            for (source, end) in known.unwrap_or_else(all) {
                interrupt::check();
                let mut inputs = best.state.inputs.clone();
                m.put(source, &end[..source.set.size()], &mut inputs);
                let Some(there) = self.contact(&best, &inputs) else { continue };
                let pressed = m.support_update_loaded(&there.gradient, &inputs, unforced);
                if m.change(&best.state.inputs, &pressed) <= LEFT {
                    continue;
                }
                let is_known = |inputs: &Inputs<f64>| seen.iter().any(|other| m.change(other, inputs) <= SAME);
                // Most ends lead back, and nothing is new there.
                let Some(next) = self.settle_unless(there, unforced, &is_known) else { continue };
                if !next.settled || next.blocked || is_known(&next.state.inputs) || !accepted(&next.state) {
                    continue;
                }
                seen.push(next.state.inputs.clone());
                let Some(gain) = self.work_between(&best, &next) else { continue };
                if gain > more.as_ref().map_or(least, |(most, _)| *most) {
                    more = Some((gain, next));
                }
            }
            match more {
                Some((_, next)) => (best, is_elsewhere) = (next, true),
                None => break,
            }
            if seen.len() > PLACES {
                break;
            }
        }
        Places { best, is_elsewhere, seen: seen.len() }
    }

    /// What the load does on the straight way from one place to another; `None` where the mechanism cannot be assembled there.
    fn work_between(&self, from: &Contact, to: &Contact) -> Option<f64> {
        let ends = [from, to].map(|contact| &contact.state.inputs);
        let way: Vec<f64> = ends[1].parameters.iter().zip(&ends[0].parameters).map(|(to, from)| to - from).collect();
        let mut at = from.clone();
        let mut work = 0.0;
        for (k, weight) in WEIGHTS.iter().enumerate() {
            if k == WEIGHTS.len() - 1 {
                at = to.clone();
            } else if k > 0 {
                at = self.contact(&at, &between(ends[0], ends[1], k as f64 / (WEIGHTS.len() - 1) as f64))?;
            }
            work += weight * inner(&at.gradient.inputs.parameters, &way);
        }
        Some(work)
    }
}

impl Mechanism {
    /// What the forces at a contact do within the play.
    fn work_of_play(&self, at: &Contact) -> f64 {
        let clearances = self.sources.iter().filter(|source| source.is_clearance);
        clearances.map(|source| source.set.support(&at.gradient.inputs.parameters[source.range()])).sum()
    }
}
