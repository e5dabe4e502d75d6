//! From the linearised answer to the exact one: sequential cone programs.
//!
//! The basis is closed for the displacements that a program asks of its rows, everything is linearised
//! there, and the next program corrects them, until they stand still. Where they do not, because a reaction
//! passes through zero on the way and the program jumps from one side of a clearance to the other, every
//! offset is drawn to where it is by a spring, the stiffer the less it comes to rest (proximal points,
//! Rockafellar, SIAM J. Control Optim. 14, 1976, 877): the spring does not move the point of rest.

use super::compatibility::Compatibility;
use super::system::{Ask, Balance, Give, System};
use crate::closure::Inputs;
use crate::solver::{Solver, State};

/// Programs in a row.
const MOST_STEPS: usize = 60;
/// A change should be below this part of the one before.
const SHRINKS: f64 = 0.7;
/// Changes that are not, until springs are drawn in or become stiffer.
const PATIENCE: usize = 2;
/// The factor by which they become so, and how stiff they are at most.
const STIFFER: f64 = 4.0;
const STIFFEST: f64 = 256.0;
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

/// Rounding of the factor on the clearances.
const FACTOR: f64 = 1e-9;

/// Whether rigid bodies that need this factor on their clearances do not go together.
pub(crate) fn is_apart(factor: f64) -> bool {
    factor > 1.0 + FACTOR
}

impl System<'_> {
    /// The smallest factor on the clearances with which rigid bodies go together, from a state closed for the known
    /// displacements.
    pub fn assembly_factor(&self, solver: &Solver<'_>, start: State, known: &[f64]) -> Result<f64, Failure> {
        match self.settle(solver, start, known, |_, _| Ask::Factor) {
            Ok(assembled) => Ok(assembled.balance.factor),
            Err(Failure::Incompatible | Failure::Unreachable) => Ok(f64::INFINITY),
            Err(Failure::Singular) => Err(Failure::Singular),
        }
    }

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
        let mut at: Vec<Vec<f64>> = self.offsets_at(&state, known);
        // Springs have the stiffness `stiffness * pull`.
        let (mut last, mut stiffness, mut pull) = (f64::INFINITY, 0.0_f64, 0.0);
        let (mut steps, mut restless) = (0, 0);
        loop {
            let c = Compatibility::at(self.basis, solver, &state).ok_or(Failure::Singular)?;
            let (right, asked) = (c.right(&state, known), ask(&state, &c));
            let balance = if pull > 0.0 {
                self.balance_near(&c, &right, &asked, &at, stiffness * pull)
            } else {
                self.balance(&c, &right, &asked)
            };
            let balance = balance.ok_or(Failure::Incompatible)?;
            let mut target = known.to_vec();
            target.iter_mut().zip(self.displacements(&balance)).for_each(|(t, d)| *t += d);
            let own = &state.inputs.parameters;
            let change = self.difference(own, &target);
            let size = self.difference(known, &target).max(self.difference(known, own));
            // Stiff springs make small changes of what would be larger ones.
            let still = change * stiffness.max(1.0) <= self.mechanism.still() * size
                || change * stiffness.max(1.0) <= NOISE * size && change > 0.5 * last;
            if still || steps == MOST_STEPS {
                return Ok(Settled { state, compatibility: c, balance, steps, still });
            }
            restless += usize::from(change > SHRINKS * last);
            last = change;
            if restless > PATIENCE {
                if pull == 0.0 && !matches!(asked, Ask::Factor) {
                    // The largest force stretches a spring as far as the largest displacement.
                    pull = self.force_scale(&balance.forces) * self.mechanism.length / size;
                    stiffness = 1.0;
                } else {
                    stiffness = (STIFFER * stiffness).min(STIFFEST);
                }
                restless = 0;
            }
            let part;
            (state, part) = step(solver, &state, &target)?;
            for (at, given) in at.iter_mut().zip(&balance.given) {
                at.iter_mut().zip(given).for_each(|(a, g)| *a += part * (g - *a));
            }
            steps += 1;
        }
    }

    /// The offsets at which a state is closed; of what is elastic none is known.
    pub(super) fn offsets_at(&self, state: &State, known: &[f64]) -> Vec<Vec<f64>> {
        let own = |&column: &usize| state.inputs.parameters[column] - known[column];
        let of = |give: &Give| match give.source {
            Some(_) => give.columns.iter().map(own).collect(),
            None => vec![0.0; give.columns.len()],
        };
        self.gives.iter().map(of).collect()
    }

    /// The largest difference of two sets of displacements, in characteristic lengths and radians.
    pub(super) fn difference(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).enumerate().map(|(k, (a, b))| (a - b).abs() / self.basis.unit(k)).fold(0.0, f64::max)
    }
}

/// Closes the basis for the target, or a part of the way where it cannot be reached; tells which part.
pub(super) fn step(solver: &Solver<'_>, from: &State, target: &[f64]) -> Result<(State, f64), Failure> {
    let mut part = 1.0;
    while part >= SHORTEST {
        let mix = |(a, b): (&f64, &f64)| if part >= 1.0 { *b } else { a + part * (b - a) };
        let parameters = from.inputs.parameters.iter().zip(target).map(mix).collect();
        let inputs = Inputs { drives: from.inputs.drives.clone(), parameters };
        if let Ok(state) = solver.follow(from, &inputs) {
            return Ok((state, part));
        }
        part *= 0.5;
    }
    Err(Failure::Unreachable)
}
