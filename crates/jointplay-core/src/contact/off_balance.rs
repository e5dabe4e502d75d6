//! Contacts that rest in the middle of their play where the load's work has a minimum.
//!
//! At a dead centre the forces on what is open vanish, and so does what it does to the output to first order. Where the work
//! is largest in the middle it stays there; where it is smallest, to either side of it. That is told by how forces change
//! ([`crate::contact::ties`]), but only where the output moves noticeably: mostly something turns about itself, or goes
//! across a long rod.

use crate::clearance::face::Direction;
use crate::clearance::undecided::Unforced;
use crate::closure::newton::{Linearised, Solver, State};
use crate::closure::sensitivity::Output;
use crate::contact::indeterminacy::SAME;
use crate::contact::state::Contact;
use crate::mechanism::{Mechanism, Source};

/// What the output is not sensitive to is noticed where it moves the output by more than this part of what all play could to
/// first order.
const NOTICED: f64 = 1e-4;
/// Steps of a chord: each leaves the part that the play is of the mechanism, and two of them tell what goes with its square.
const CHORDS: usize = 3;

/// The part that one of several ways is taken by: none is like another, so that they do not cancel.
pub(crate) fn part_of(number: usize) -> f64 {
    1.0 - 0.5 * (0.618_034 * number as f64).fract()
}

impl Mechanism {
    /// How far a component of the output moves at most where that is not noticed, by what all play could do to it.
    pub(crate) fn least_noticed(&self, component: usize, reach: f64) -> f64 {
        NOTICED * reach + self.rounding_of_output(component)
    }
}

impl Solver<'_> {
    /// Where a contact goes that rests at a minimum of the load's work, to which the output is not sensitive, by the `map` of
    /// it; `None` where it stays.
    pub(crate) fn off_balance(
        &self,
        at: &Contact,
        linearised: &Linearised<'_>,
        unforced: &[Unforced],
        map: &Output,
    ) -> Option<Contact> {
        let m = self.mechanism;
        let faces = m.open_faces(at, unforced);
        if faces.is_empty() || !self.is_noticed(at, linearised, &m.ways(&faces, unforced), map) {
            return None;
        }
        let bend = self.bend(at, &faces, unforced)?;
        let unstable = bend.unstable().filter(|unstable| !unstable.is_empty())?;
        [1.0, -1.0].into_iter().find_map(|side| {
            let mut inputs = at.state.inputs.clone();
            for (s, _) in &faces {
                let (source, set) = (&m.sources[*s], m.sources[*s].set);
                let mut offset = m.offset(source, &inputs);
                for ((_, way), part) in bend.ways.iter().zip(&unstable).filter(|((owner, _), _)| owner == s) {
                    offset.iter_mut().zip(way.along).for_each(|(d, along)| *d += side * part * along);
                }
                let mut unit = set.to_unit(&offset);
                set.project_unit(&mut unit[..offset.len()]);
                m.put(source, &set.of_unit(&unit[..offset.len()])[..offset.len()], &mut inputs);
            }
            let next = self.settle_from(self.contact(at, &inputs)?, unforced)?;
            let goes = next.settled && !next.blocked && m.change(&at.state.inputs, &next.state.inputs) > SAME;
            goes.then_some(next)
        })
    }

    /// Whether the output moves noticeably with all that is open. Nothing else is as cheap to tell.
    fn is_noticed(&self, at: &Contact, linearised: &Linearised<'_>, ways: &[(usize, Direction)], map: &Output) -> bool {
        let m = self.mechanism;
        let mut inputs = at.state.inputs.clone();
        for (number, (s, way)) in ways.iter().enumerate() {
            let part = part_of(number);
            m.sources[*s].range().zip(way.along).for_each(|(p, along)| inputs.parameters[p] += part * along);
        }
        let coordinates = self.chord(linearised, &at.state, &inputs, CHORDS);
        let moved = m.error(&State { coordinates, inputs, ..at.state.clone() }, &at.state);
        let reach = |k: usize| {
            let row = |source: &Source| source.range().map(|p| map.parameters[(k, p)]).collect::<Vec<f64>>();
            m.sources.iter().filter(|s| s.is_clearance).map(|source| source.set.reach(&row(source))).sum()
        };
        // Not a number is noticed, too.
        let is_little = |(k, moved): (usize, &f64)| moved.abs() <= m.least_noticed(k, reach(k));
        !moved.iter().enumerate().all(is_little)
    }
}
