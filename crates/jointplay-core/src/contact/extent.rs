//! How far the output goes over what the load leaves open.
//!
//! With the offsets u that are open, and the others where the load presses them at the pose in question,
//!
//! ```text
//! low = min e(u),   high = max e(u),   half-width = (high - low) / 2
//! ```
//!
//! for each component e of the output's error on the exact closure. The pose in question has the offsets in the middle
//! of the play, which is the middle of the range but for the square of the play. An end is approached in rounds:
//! towards the offsets that are farthest by the linear map at the pose of the last round, where the closure is solved
//! anew, the load presses what it decides, and the equations that tie open offsets are found anew. Near a singular pose
//! the range is curved: the linear map at its middle alone would be off by much of it, and an end may be found only
//! from the end of another component.

use crate::clearance::face::Face;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State, between};
use crate::contact::indeterminacy::{Open, Rest};
use crate::contact::open_faces::Faces;
use crate::contact::state::Contact;

/// Rounds in which an end is approached at most; each leaves the part that the play is of the mechanism.
const ROUNDS: usize = 25;
/// An end is reached where a round moves it by less than this part of its distance from the middle.
const REACHED: f64 = 1e-9;
/// Another end has more of a component where it is by more than this part.
const MORE: f64 = 1e-6;
/// Parts of a round that are tried where all of it leads back, each half of the one before.
const PARTS: i32 = 6;
/// Steps in which the load presses anew what it decides, and where that is done: what is left of it moves the output by
/// this part of the play at most.
const PRESSES: usize = 10;
const PRESSED: f64 = 1e-8;

/// What is open, and how errors are measured.
struct Around<'r> {
    rest: &'r Rest,
    open: &'r Faces,
    nominal: &'r State,
}

/// An end of a range, or where it is looked for.
#[derive(Clone)]
struct End {
    at: Contact,
    error: Vec<f64>,
}

impl Solver<'_> {
    /// Makes of what every source leaves open by the linear map (`open`, source by source, per component) its share in
    /// the half-width around the error of a rest. Gives whether both ends of all components can be reached.
    pub(crate) fn spread(&self, rest: &Rest, nominal: &State, error: &[f64], open: &mut [f64]) -> bool {
        let size = error.len();
        let Open::Faces(faces) = &rest.open else { return true };
        let around = Around { rest, open: faces, nominal };
        let linear: Vec<f64> = (0..size).map(|k| open.iter().skip(k).step_by(size).sum()).collect();
        let sides: Vec<(usize, f64)> =
            (0..size).filter(|&k| linear[k] > 0.0).flat_map(|k| [(k, -1.0), (k, 1.0)]).collect();
        let middle = End { at: rest.contact.clone(), error: error.to_vec() };
        let first = |&(k, sign): &(usize, f64)| self.climb_to_end(&around, middle.clone(), k, sign);
        let Some(ends) = sides.iter().map(first).collect::<Option<Vec<End>>>() else { return false };
        // From where another end has more of a component, by more than rounding and rounds that were left out.
        let last = |own: usize| {
            let (k, sign) = sides[own];
            let value = |end: usize| sign * (ends[end].error[k] - error[k]);
            let most = |best: usize, end: usize| if value(end) > value(best) * (1.0 + MORE) { end } else { best };
            let best = (0..ends.len()).fold(own, most);
            let known = ends[best].error[k];
            if best == own {
                return known;
            }
            self.climb_to_end(&around, ends[best].clone(), k, sign).map_or(known, |end| end.error[k])
        };
        for own in (0..sides.len()).step_by(2) {
            let k = sides[own].0;
            let (low, high) = (last(own), last(own + 1));
            let part = 0.5 * (high - low) / linear[k];
            open.iter_mut().skip(k).step_by(size).for_each(|share| *share *= part);
        }
        true
    }

    /// Goes on to where a component of the error has no larger value nearby; `None` where the mechanism cannot be
    /// assembled on the way, or is singular.
    fn climb_to_end(&self, around: &Around<'_>, from: End, k: usize, sign: f64) -> Option<End> {
        let m = self.mechanism;
        let mut faces = around.open.sources().to_vec();
        let mut end = from;
        let mut gone = 0.0;
        for _ in 0..ROUNDS {
            let anew = self.tied_anew(around, &end.at, &mut faces);
            let open = match &anew {
                Some(Open::Faces(open)) => open,
                _ => around.open,
            };
            let map = m.output_sensitivity(&self.linearise(&end.at.state)?, &end.at.state);
            let Some(offsets) = open.farthest(m, &map.parameters, k, sign) else { break };
            let gain = open.gain(m, &map.parameters, k, sign, &offsets, &end.at.state.inputs);
            if gain <= REACHED * gone {
                break;
            }
            let to = open.placed(m, &end.at, &around.rest.quiet, &offsets);
            let mut next = self.pressed_at(around, open, &end.at, &to)?;
            for part in 1..=PARTS {
                if sign * next.error[k] > sign * end.error[k] {
                    break;
                }
                let part = between(&end.at.state.inputs, &to, 0.5_f64.powi(part));
                next = self.pressed_at(around, open, &end.at, &part)?;
            }
            let step = sign * (next.error[k] - end.error[k]);
            if step > 0.0 {
                end = next;
                gone += step;
            }
            if step <= REACHED * gone {
                break;
            }
        }
        Some(end)
    }

    /// What is open, found anew around a contact if equations tie it.
    fn tied_anew(&self, around: &Around<'_>, at: &Contact, faces: &mut [(usize, Face)]) -> Option<Open> {
        let Rest { quiet, unforced, .. } = around.rest;
        if around.open.is_tied() { self.open_around(at, faces, quiet, unforced) } else { None }
    }

    /// The pose at given offsets of the open sources, the others where the load presses them there.
    fn pressed_at(&self, around: &Around<'_>, open: &Faces, from: &Contact, to: &Inputs<f64>) -> Option<End> {
        let m = self.mechanism;
        let offsets = open.offsets(m, to);
        let mut at = self.contact(from, to)?;
        for _ in 0..PRESSES {
            let inputs = open.placed(m, &at, &around.rest.quiet, &offsets);
            if m.change(&at.state.inputs, &inputs) <= PRESSED {
                break;
            }
            at = self.contact(&at, &inputs)?;
        }
        let error = m.error(&at.state, around.nominal);
        Some(End { at, error })
    }
}
