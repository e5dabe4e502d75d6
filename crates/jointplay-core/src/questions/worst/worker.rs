//! What one lane of a climb does from round to round.
//!
//! It closes the mechanism at its start, then takes whole steps to the support points while their changes
//! shrink. Where they do not (a guide hesitates between two corners, a pin floats), it goes on by projected
//! gradient steps, and closes the mechanism at every one. A lane that is to stay only closes the mechanism; one
//! that goes gently takes no whole steps.
//!
//! Every lane ends: whole steps go on while their changes shrink to a part, at the same offsets there are
//! [`NEWTON_STEPS`] at most, and after [`ROUNDS`] in all the highest point met counts.

use crate::math::lanes::block::Block;
use crate::mechanism::Mechanism;
use crate::program::tape::Program;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::projected::{Projected, ROUGH};

/// Rounds that only close the mechanism at the start: so many, and more until a Newton step (length-scaled) is smaller
/// than this. At a pose that is off a force may point elsewhere that is smaller than this part of the others, and a whole
/// step would leave the start.
const CLOSING: usize = 2;
const CLOSED: f64 = 1e-7;
/// After every so many whole steps their changes must have shrunk to this part.
const CHECKED: usize = 4;
const SHRUNK: f64 = 0.3;
/// Newton steps at most at one set of proposed offsets.
const NEWTON_STEPS: usize = 12;
/// A Newton step (length-scaled) below this is the last: the next would be its square.
const LAST_STEP: f64 = 1e-9;
/// Rounds of a lane, to the last digits and roughly.
const ROUNDS: usize = 6000;
const ROUGH_ROUNDS: usize = 600;
/// A lane has converged when no offset wants to change by more than this part of its set, as a projected
/// ascent does: what is left changes the value by the square of it.
const STILL: f64 = 1e-11;

/// Where a lane has converged.
#[derive(Clone, Debug)]
pub struct Height {
    /// Value of its measure.
    pub value: f64,
    /// Parameter values.
    pub parameters: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
}

/// Where a lane has ended.
#[derive(Clone, Debug)]
pub struct Climbed {
    /// The highest point.
    pub height: Height,
    /// Whether it has converged.
    pub settled: bool,
    /// How it came there.
    pub pace: Pace,
    /// Gradient at the start of whole steps, along the parameters.
    pub slope: Vec<f64>,
}

/// How a lane goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// It stays at its start.
    Stay,
    /// By projected gradient steps.
    Gentle,
    /// By whole steps first.
    Whole,
}

/// A lane at work.
#[derive(Clone, Debug)]
pub(crate) struct Worker<'m> {
    mechanism: &'m Mechanism,
    measure: Measure,
    pace: Pace,
    fine: bool,
    phase: Phase<'m>,
    /// Rounds in this phase, or at the offsets proposed last.
    rounds: usize,
    /// Rounds in all.
    all: usize,
    /// Squared length of the Newton step before, at the same offsets.
    before: f64,
    slope: Vec<f64>,
}

#[derive(Clone, Debug)]
enum Phase<'m> {
    /// Closes the mechanism at the start.
    Closing,
    /// Takes whole steps; the largest change when it was last checked.
    Whole { change: f64 },
    /// Closes the mechanism where whole steps have led.
    Settling,
    /// Closes the mechanism at proposed offsets; what was accepted last, and the highest.
    Projected(Box<Slow<'m>>),
}

#[derive(Clone, Debug)]
struct Slow<'m> {
    ascent: Projected<'m>,
    accepted: Height,
    highest: Height,
    noise: f64,
}

/// What a round has made of a lane: at the pose and the offsets that it began with the error and its
/// gradient, and the Newton step from there.
pub(crate) struct Round<'r> {
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
pub(crate) enum Next {
    /// Another Newton step at the same offsets.
    Stay,
    /// A whole step.
    Push,
    /// A Newton step at other offsets.
    Try(Vec<f64>),
    /// Nothing more: it has converged, or is in doubt.
    Done(Option<Climbed>),
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
}

impl<'m> Worker<'m> {
    pub const fn new(mechanism: &'m Mechanism, measure: Measure, pace: Pace, fine: bool) -> Self {
        Self {
            mechanism,
            measure,
            pace,
            fine,
            phase: Phase::Closing,
            rounds: 0,
            all: 0,
            before: f64::INFINITY,
            slope: Vec::new(),
        }
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
            Measure::Along(_) => false,
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
        self.all += 1;
        if self.all > if self.fine { ROUNDS } else { ROUGH_ROUNDS } {
            return self.end(true);
        }
        let next = self.decide(round);
        self.before = if matches!(next, Next::Stay) { round.moved } else { f64::INFINITY };
        next
    }

    /// Whether the pose that the round began with closes the mechanism.
    fn is_closed(&self, round: &Round<'_>) -> bool {
        // Projected steps compare values to the last digits.
        let rough = !self.fine && matches!(self.phase, Phase::Whole { .. });
        let enough = if rough { LAST_STEP } else { self.mechanism.step_of_rounding() };
        round.moved <= enough * enough || self.before <= LAST_STEP * LAST_STEP
    }

    fn decide(&mut self, round: &Round<'_>) -> Next {
        self.rounds += 1;
        let is_closed = self.is_closed(round);
        match &mut self.phase {
            Phase::Closing if self.rounds < CLOSING => Next::Stay,
            Phase::Closing
                if self.pace == Pace::Whole && round.moved > CLOSED * CLOSED && self.rounds < NEWTON_STEPS =>
            {
                Next::Stay
            }
            Phase::Closing if self.pace != Pace::Whole => {
                self.goes_on(Phase::Settling);
                Next::Stay
            }
            Phase::Closing => {
                self.slope = round.gradient();
                self.goes_on(Phase::Whole { change: round.change });
                Next::Push
            }
            Phase::Whole { .. } if round.change <= if self.fine { STILL } else { ROUGH } => {
                if is_closed {
                    return self.stands(round, Pace::Whole);
                }
                // Only the closure is left.
                self.goes_on(Phase::Settling);
                Next::Stay
            }
            Phase::Whole { change } => {
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
            _ if !is_closed => {
                if self.rounds < NEWTON_STEPS {
                    Next::Stay
                } else {
                    Next::Done(None)
                }
            }
            Phase::Settling if self.pace == Pace::Stay => self.stands(round, Pace::Stay),
            Phase::Settling => {
                let at = round.height(self);
                let noise = self.mechanism.rounding(round.force, at.value);
                let start = at.parameters.clone();
                let mut ascent = Projected::new(self.mechanism, start, at.value, noise, &round.gradient(), self.fine);
                let proposed = ascent.propose();
                let slow = Slow { ascent, accepted: at.clone(), highest: at, noise };
                self.goes_on(Phase::Projected(Box::new(slow)));
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
        let proposed = if slow.ascent.accepts(at.value) {
            slow.ascent.accept(at.value, noise, &round.gradient());
            if at.value > slow.highest.value {
                slow.highest = at.clone();
            }
            (slow.accepted, slow.noise) = (at, noise);
            slow.ascent.propose()
        } else {
            slow.ascent.shorten()
        };
        self.proposed(proposed)
    }

    fn proposed(&mut self, proposed: Option<Vec<f64>>) -> Next {
        proposed.map_or_else(|| self.end(false), Next::Try)
    }

    fn stands(&self, round: &Round<'_>, pace: Pace) -> Next {
        Next::Done(Some(Climbed { height: round.height(self), settled: true, pace, slope: self.slope.clone() }))
    }

    /// The end of a projected ascent: where it has converged, or where its work is spent. Without an end of either
    /// kind a lane that is to be fine is in doubt.
    fn end(&self, spent: bool) -> Next {
        let Phase::Projected(slow) = &self.phase else { return Next::Done(None) };
        let settled = slow.ascent.settled() || slow.ascent.has_stalled();
        if self.fine && !settled && !spent && !slow.ascent.is_spent() {
            return Next::Done(None);
        }
        // The value may have fallen for a while.
        let fallen = slow.highest.value > slow.accepted.value + slow.noise;
        let height = if fallen { &slow.highest } else { &slow.accepted };
        Next::Done(Some(Climbed { height: height.clone(), settled, pace: Pace::Gentle, slope: self.slope.clone() }))
    }

    fn goes_on(&mut self, phase: Phase<'m>) {
        self.phase = phase;
        self.rounds = 0;
    }
}
