//! What one lane of a climb does from round to round.
//!
//! It closes the mechanism at its start, then takes whole steps to the support points while their changes
//! shrink. Where they do not (a guide hesitates between two corners, a pin floats), it goes on by projected
//! gradient steps, and closes the mechanism at every one.

use super::lanes::Block;
use super::tape::Program;
use crate::ascent::Measure;
use crate::mechanism::Mechanism;
use crate::projected::Projected;

/// Rounds that only close the mechanism at the start.
const CLOSING: usize = 2;
/// After every so many whole steps their changes must have shrunk to this part.
const CHECKED: usize = 4;
const SHRUNK: f64 = 0.05;
/// Newton steps at most at one set of proposed offsets.
const NEWTON_STEPS: usize = 12;
/// A lane stands still when no offset wants to change by more than this part of its set, as a projected
/// ascent does: what is left changes the value by the square of it.
const STILL: f64 = 1e-11;

/// Where a lane stands still.
#[derive(Clone, Debug)]
pub struct Height {
    /// Value of its measure.
    pub value: f64,
    /// Parameter values.
    pub parameters: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
}

/// A lane at work.
#[derive(Clone, Debug)]
pub(super) struct Worker<'m> {
    mechanism: &'m Mechanism,
    measure: Measure,
    phase: Phase<'m>,
    /// Rounds in this phase, or at the offsets proposed last.
    rounds: usize,
}

#[derive(Clone, Debug)]
enum Phase<'m> {
    /// Closes the mechanism at the start.
    Closing,
    /// Takes whole steps; the largest change when it was last checked.
    Whole { change: f64 },
    /// Closes the mechanism where whole steps have led.
    Settling,
    /// Closes the mechanism at proposed offsets; what was accepted last.
    Projected(Box<(Projected<'m>, Height)>),
}

/// What a round has made of a lane: at the pose and the offsets that it began with the error and its
/// gradient, and the Newton step from there.
pub(super) struct Round<'r> {
    pub lane: usize,
    /// Squared length of the Newton step.
    pub moved: f64,
    /// Largest change, as a part of its set, that a whole step would make of an offset.
    pub change: f64,
    /// Largest force among the multipliers.
    pub force: f64,
    pub offsets: &'r [Block],
    pub errors: &'r [Block],
    pub program: &'r Program,
    pub registers: &'r [Block],
    /// First of the program's outputs that are the gradient.
    pub gradient: usize,
}

/// What a lane does next.
pub(super) enum Next {
    /// Another Newton step at the same offsets.
    Stay,
    /// A whole step.
    Push,
    /// A Newton step at other offsets.
    Try(Vec<f64>),
    /// Nothing more: it stands still, or is in doubt.
    Done(Option<Height>),
}

impl Round<'_> {
    fn offsets(&self) -> Vec<f64> {
        self.offsets.iter().map(|b| b.0[self.lane]).collect()
    }

    fn gradient(&self) -> Vec<f64> {
        (0..self.offsets.len()).map(|p| self.program.output(self.registers, self.gradient + p).0[self.lane]).collect()
    }

    fn height(&self, worker: &Worker<'_>) -> Height {
        let error: Vec<f64> = self.errors.iter().map(|b| b.0[self.lane]).collect();
        let value = worker.measure.value(&error, worker.mechanism.n_translations());
        Height { value, parameters: self.offsets(), error }
    }

    const fn is_closed(&self, m: &Mechanism) -> bool {
        self.moved <= m.step_of_rounding() * m.step_of_rounding()
    }
}

impl<'m> Worker<'m> {
    pub const fn new(mechanism: &'m Mechanism, measure: Measure) -> Self {
        Self { mechanism, measure, phase: Phase::Closing, rounds: 0 }
    }

    pub const fn measure(&self) -> Measure {
        self.measure
    }

    /// Whether the gradient of its measure depends on the error.
    pub fn turns(&self) -> bool {
        let m = self.mechanism;
        match self.measure {
            Measure::Position | Measure::Rotation => true,
            Measure::Component { index, .. } => m.turns_freely() && index >= m.n_translations(),
        }
    }

    /// Whether the next round has to tell where a whole step leads.
    pub const fn asks(&self) -> bool {
        match self.phase {
            Phase::Closing => self.rounds + 1 >= CLOSING,
            Phase::Whole { .. } => true,
            Phase::Settling | Phase::Projected(_) => false,
        }
    }

    /// Decides what to do after a round.
    pub fn after(&mut self, round: &Round<'_>) -> Next {
        self.rounds += 1;
        match &mut self.phase {
            Phase::Closing if self.rounds < CLOSING => Next::Stay,
            Phase::Closing => {
                self.goes_on(Phase::Whole { change: round.change });
                Next::Push
            }
            Phase::Whole { change } => {
                if round.is_closed(self.mechanism) && round.change <= STILL {
                    return Next::Done(Some(round.height(self)));
                }
                let shrinks = !self.rounds.is_multiple_of(CHECKED) || {
                    let before = std::mem::replace(change, round.change);
                    round.change <= SHRUNK * before
                };
                if !shrinks {
                    self.goes_on(Phase::Settling);
                    return Next::Stay;
                }
                Next::Push
            }
            _ if !round.is_closed(self.mechanism) => {
                if self.rounds < NEWTON_STEPS {
                    Next::Stay
                } else {
                    Next::Done(None)
                }
            }
            Phase::Settling => {
                let at = round.height(self);
                let noise = self.mechanism.rounding(round.force, at.value);
                let start = at.parameters.clone();
                let mut ascent = Projected::new(self.mechanism, start, at.value, noise, &round.gradient());
                let proposed = ascent.propose();
                self.goes_on(Phase::Projected(Box::new((ascent, at))));
                self.proposed(proposed)
            }
            Phase::Projected(_) => self.judge(round),
        }
    }

    /// Accepts or refuses proposed offsets.
    fn judge(&mut self, round: &Round<'_>) -> Next {
        self.rounds = 0;
        let at = round.height(self);
        let noise = self.mechanism.rounding(round.force, at.value);
        let Phase::Projected(slow) = &mut self.phase else { return Next::Stay };
        let (ascent, accepted) = slow.as_mut();
        let proposed = if ascent.accepts(at.value) {
            ascent.accept(at.value, noise, &round.gradient());
            *accepted = at;
            ascent.propose()
        } else {
            ascent.shorten()
        };
        self.proposed(proposed)
    }

    fn proposed(&mut self, proposed: Option<Vec<f64>>) -> Next {
        match (proposed, &self.phase) {
            (Some(offsets), _) => Next::Try(offsets),
            (None, Phase::Projected(slow)) if slow.0.settled() || slow.0.has_stalled() => {
                Next::Done(Some(slow.1.clone()))
            }
            (None, _) => Next::Done(None),
        }
    }

    fn goes_on(&mut self, phase: Phase<'m>) {
        self.phase = phase;
        self.rounds = 0;
    }
}
