//! From the linearised answer to the exact one: sequential cone programs.
//!
//! The basis is closed for the displacements that a program asks of its rows, everything is linearised
//! there, and the next program corrects them, until they stand still. Steps are shortened where they do
//! not: where a reaction passes through zero on the way, the program jumps from one side of a clearance
//! to the other, and the pose lies between.

use super::compatibility::Compatibility;
use super::system::{Ask, Balance, System};
use crate::closure::Inputs;
use crate::solver::{Solver, State};

/// Programs in a row.
const MOST_STEPS: usize = 60;
/// Steps that take away less than this part of what they could are shortened.
const LITTLE: f64 = 0.3;
/// Steps that take away more than this part of what they could are lengthened.
const MUCH: f64 = 0.6;
/// The shortest part of a step.
const SHORTEST: f64 = 1.0 / 256.0;
/// Changes below this part of all displacements that do not shrink any more are the programs' rounding.
const NOISE: f64 = 1e-6;

/// Where displacements, reactions and pose agree.
#[derive(Clone, Debug)]
pub(crate) struct Settled {
    /// The basis, closed for the displacements.
    pub state: State,
    /// The linearisation there.
    pub compatibility: Compatibility,
    /// What the last program gave.
    pub balance: Balance,
    /// Programs solved.
    pub steps: usize,
    /// Whether displacements and pose stand still.
    pub still: bool,
}

/// Why there is no such place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// No displacements are compatible.
    Incompatible,
    /// The basis is singular.
    Singular,
    /// The basis cannot be closed for the displacements.
    Unreachable,
}

impl System<'_> {
    /// Goes from a state closed for the known displacements to where what is asked at every state stands
    /// still.
    pub fn settle(
        &self,
        solver: &Solver<'_>,
        start: State,
        known: &[f64],
        mut ask: impl FnMut(&State, &Compatibility) -> Ask,
    ) -> Result<Settled, Failure> {
        let mut state = start;
        let (mut part, mut last) = (1.0_f64, f64::INFINITY);
        let (mut longest, mut lengthened) = (1.0_f64, false);
        let mut steps = 0;
        loop {
            let c = Compatibility::at(self.basis, solver, &state).ok_or(Failure::Singular)?;
            let balance = self.balance(&c, &c.right(&state, known), &ask(&state, &c)).ok_or(Failure::Incompatible)?;
            let mut target = known.to_vec();
            target.iter_mut().zip(self.displacements(&balance)).for_each(|(t, d)| *t += d);
            let own = &state.inputs.parameters;
            let change = self.difference(own, &target);
            let size = self.difference(known, &target).max(self.difference(known, own));
            let still = change <= self.mechanism.still() * size || change <= NOISE * size && change > 0.5 * last;
            if still || steps == MOST_STEPS {
                return Ok(Settled { state, compatibility: c, balance, steps, still });
            }
            // A part of a step can take away that part of the change.
            if change > (1.0 - LITTLE * part) * last {
                if lengthened {
                    longest = 0.5 * part;
                }
                part = (0.5 * part).max(SHORTEST);
                lengthened = false;
            } else {
                lengthened = change < (1.0 - MUCH * part) * last && part < longest;
                part = if lengthened { 2.0 * part } else { part };
            }
            last = change;
            state = step(solver, &state, &target, &mut part)?;
            steps += 1;
        }
    }

    /// The largest difference of two sets of displacements, in characteristic lengths and radians.
    fn difference(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).enumerate().map(|(k, (a, b))| (a - b).abs() / self.basis.unit(k)).fold(0.0, f64::max)
    }
}

/// Closes the basis a part of the way to the target, a smaller one where it cannot be reached.
fn step(solver: &Solver<'_>, from: &State, target: &[f64], part: &mut f64) -> Result<State, Failure> {
    loop {
        let mix = |(a, b): (&f64, &f64)| a + *part * (b - a);
        let parameters =
            if *part < 1.0 { from.inputs.parameters.iter().zip(target).map(mix).collect() } else { target.to_vec() };
        let inputs = Inputs { drives: from.inputs.drives.clone(), parameters };
        match solver.follow(from, &inputs) {
            Ok(state) => return Ok(state),
            Err(_) if *part > SHORTEST => *part *= 0.5,
            Err(_) => return Err(Failure::Unreachable),
        }
    }
}
