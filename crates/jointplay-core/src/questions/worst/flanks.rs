//! Extremes of the linearised mechanism by the flanks of couplings that they close themselves.
//!
//! The line of action of a coupling with play is that of the flank that carries. An extreme says which one that is, so that
//! extremes are looked for again until the flanks stay as they are. That of a size is as large the opposite way, where the
//! opposite flanks are closed: the larger counts.

use crate::closure::equations::Inputs;
use crate::closure::newton::State;
use crate::contact::flanks::FLANKS;
use crate::mechanism::coupling::Play;
use crate::mechanism::status::Status;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::starts::{AtExtreme, Extreme};

/// Where flanks are looked for.
pub(super) struct Flanks<'a, S, F> {
    pub nominal: &'a State,
    /// The plays between flanks, with their places among the inputs.
    pub plays: Vec<(usize, Play)>,
    /// Whether inputs are the same as those before.
    pub stay: S,
    /// The extreme by the linearisation for given flanks.
    pub extreme: F,
}

impl<S, F> Flanks<'_, S, F>
where
    S: Fn(&Inputs<f64>, &Inputs<f64>) -> bool,
{
    /// The extreme that belongs to its flanks, from that with all flanks in the middle of their play.
    pub fn own<L: AtExtreme>(&self, middle: Extreme<L>) -> Result<Extreme<L>, Status>
    where
        F: Fn(Measure, &State) -> Result<Extreme<L>, Status>,
    {
        if self.plays.is_empty() {
            return Ok(middle);
        }
        let settled = self.settle(&middle, false)?;
        let opposite = match middle.measure {
            Measure::Component { .. } | Measure::Along(_) => None,
            Measure::Position | Measure::Rotation => self.settle(&middle, true)?,
        };
        let bound =
            [&settled, &opposite].into_iter().flatten().fold(middle.bound, |bound, found| bound.max(found.bound));
        let higher = |a: Extreme<L>, b: Extreme<L>| if b.linear.value() > a.linear.value() { b } else { a };
        let found = settled.into_iter().chain(opposite).reduce(higher).unwrap_or(middle);
        Ok(Extreme { bound, ..found })
    }

    /// The same, from the flanks that an extreme closes or the opposite ones.
    fn settle<L: AtExtreme>(&self, middle: &Extreme<L>, mirrored: bool) -> Result<Option<Extreme<L>>, Status>
    where
        F: Fn(Measure, &State) -> Result<Extreme<L>, Status>,
    {
        let mut flanks = self.nominal.clone();
        let mut found: Option<Extreme<L>> = None;
        for _ in 0..FLANKS {
            let before = flanks.inputs.clone();
            let at = found.as_ref().unwrap_or(middle).linear.offsets();
            for &(place, play) in &self.plays {
                let turned = mirrored && found.is_none();
                flanks.inputs.parameters[place] = if turned { play.mirrored(at[place]) } else { at[place] };
            }
            if (self.stay)(&before, &flanks.inputs) {
                break;
            }
            found = Some((self.extreme)(middle.measure, &flanks)?);
        }
        Ok(found)
    }
}
