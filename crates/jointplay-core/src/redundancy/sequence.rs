//! From the linearised answer to the exact one: sequential cone programs.
//!
//! The basis is closed for the displacements that a program asks of its rows, everything is linearised
//! there, and the next program corrects them, until they have converged. Where they do not converge, because a reaction
//! passes through zero on the way and the program jumps from one side of a clearance to the other, every
//! offset is drawn to where it is by a spring, the stiffer the less it comes to rest (proximal points,
//! Rockafellar, SIAM J. Control Optim. 14, 1976, 877): the spring does not move the point of rest. Where steps creep on
//! one way, their ratio tells how stiff the mechanism itself is there, and springs become as soft.

use std::marker::PhantomData;

use nalgebra::DVector;

use crate::clearance::offset::inner;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::cone::answer::Answer;
use crate::cone::scheduler::Rounds;
use crate::redundancy::balance::Balance;
use crate::redundancy::basis::Basis;
use crate::redundancy::compatibility::{Compatibility, Ties};
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sprung::Sprung;
use crate::redundancy::system::{Element, System};

/// Programs in a row.
const MOST_STEPS: usize = 60;
/// A change should be below this part of the one before.
const SHRINKS: f64 = 0.7;
/// Changes that are not, until springs are drawn in or become stiffer.
const PATIENCE: usize = 2;
/// The factor by which they become so, and how stiff they are at most.
const STIFFER: f64 = 4.0;
const STIFFEST: f64 = 256.0;
/// Springs are too stiff where a step goes on by more than this part of the one before.
const CREEPS: f64 = 0.5;
/// The shortest part of a step.
const SHORTEST: f64 = 1.0 / 256.0;
/// Changes below this part of all displacements that do not shrink any more are the programs' rounding.
pub(crate) const NOISE: f64 = 1e-6;

/// Where displacements, reactions and pose agree.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    /// The basis, closed for the displacements.
    pub state: State,
    /// The linearisation there.
    pub compatibility: Compatibility,
    /// What the last program gave.
    pub balance: Balance,
    /// Whether displacements and pose have converged.
    pub still: bool,
}

/// The same without the linearisation.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    pub state: State,
    pub balance: Balance,
    /// Steps that led there.
    pub steps: usize,
    pub still: bool,
}

/// By element, the middle of a set that forces leave open as a whole.
type Middles = Vec<Option<Vec<f64>>>;

/// Where a sequence begins.
pub(super) struct Start<P> {
    pub place: P,
    /// An answer nearby.
    pub near: Option<Answer>,
    /// The change that led there, and the number of steps.
    pub last: f64,
    pub steps: usize,
}

/// Where a sequence came to rest.
#[derive(Clone)]
pub(super) struct Reached<P> {
    pub place: P,
    pub balance: Balance,
    pub steps: usize,
    pub still: bool,
}

/// The basis, closed for some displacements.
pub(super) trait Place: Clone {
    type Linear: Linear;

    fn displacements(&self) -> &[f64];

    /// The linearisation there.
    async fn linearise(&self, system: &System<'_>) -> Result<Self::Linear, Failure>;

    /// The springs there, where forces change by springs.
    fn sprung(&self, system: &System<'_>, known: &[f64]) -> Result<Vec<Sprung>, Failure>;

    /// Closed for a part of the way to the target, or for less of it where that cannot be reached; tells which part.
    async fn step(&self, target: &[f64], part: f64) -> Result<(Self, f64), Failure>;
}

/// A place where a solver has closed the basis, linearised as far as `C` is.
struct Solved<'s, 'm, C> {
    solver: &'s Solver<'m>,
    state: State,
    linear: PhantomData<C>,
}

impl<'s, 'm, C> Solved<'s, 'm, C> {
    const fn at(solver: &'s Solver<'m>, state: State) -> Self {
        Self { solver, state, linear: PhantomData }
    }
}

impl<C> Clone for Solved<'_, '_, C> {
    fn clone(&self) -> Self {
        Self::at(self.solver, self.state.clone())
    }
}

impl<C: Linear + AtState> Place for Solved<'_, '_, C> {
    type Linear = C;

    fn displacements(&self) -> &[f64] {
        &self.state.inputs.parameters
    }

    async fn linearise(&self, system: &System<'_>) -> Result<C, Failure> {
        C::at_state(system.basis, self.solver, &self.state).ok_or(Failure::Singular)
    }

    fn sprung(&self, system: &System<'_>, known: &[f64]) -> Result<Vec<Sprung>, Failure> {
        system.sprung(self.solver, &self.state, known).ok_or(Failure::Singular)
    }

    async fn step(&self, target: &[f64], part: f64) -> Result<(Self, f64), Failure> {
        let (state, part) = step(self.solver, &self.state, target, part)?;
        Ok((Self::at(self.solver, state), part))
    }
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

/// Whether rigid bodies that need this factor on their clearances cannot be assembled.
pub(crate) fn is_apart(factor: f64) -> bool {
    factor > 1.0 + FACTOR
}

impl System<'_> {
    /// The smallest factor on the clearances with which rigid bodies can be assembled, from a state closed for the known
    /// displacements.
    pub async fn assembly_factor_in(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        start: State,
        known: &[f64],
        first: Option<&Balance>,
    ) -> Result<f64, Failure> {
        match self.rest_in(rounds, solver, start, known, first, Ask::Factor).await {
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
        ask: impl FnMut(&State, &Compatibility) -> Ask,
    ) -> Result<Solution, Failure> {
        Rounds::alone(async |rounds| self.settle_in(rounds, solver, start, known, None, ask).await)
    }

    /// The same beside others, perhaps from an answer nearby.
    pub async fn settle_in(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        start: State,
        known: &[f64],
        near: Option<Answer>,
        mut ask: impl FnMut(&State, &Compatibility) -> Ask,
    ) -> Result<Solution, Failure> {
        let place = Solved::at(solver, start);
        let start = Start { place, near, last: f64::INFINITY, steps: 0 };
        let asked = |place: &Solved<'_, '_, _>, c: &_| ask(&place.state, c);
        let Reached { place: Solved { state, .. }, balance, still, .. } =
            self.settle_by(rounds, start, known, false, asked).await?;
        let compatibility = Compatibility::at(self.basis, solver, &state).ok_or(Failure::Singular)?;
        Ok(Solution { state, compatibility, balance, still })
    }

    /// The same where one thing is asked at every state, which does not depend on the output, perhaps from what it
    /// gives to first order.
    pub async fn rest_in(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        start: State,
        known: &[f64],
        first: Option<&Balance>,
        ask: Ask,
    ) -> Result<Rest, Failure> {
        let place = Solved::<Ties>::at(solver, start);
        let mut start = Start { place, near: None, last: f64::INFINITY, steps: 0 };
        // Springs may be far from what they are to first order.
        if let Some(first) = first.filter(|_| !self.is_sprung(&ask)) {
            start.near.clone_from(&first.answer);
            let target = self.target(known, first);
            if let Ok((place, 1.0)) = start.place.step(&target, 1.0).await {
                (start.place, start.last, start.steps) = (place, self.difference(known, &target), 1);
            }
        }
        let Reached { place: Solved { state, .. }, balance, steps, still } =
            self.settle_by(rounds, start, known, true, |_, _| ask.clone()).await?;
        Ok(Rest { state, balance, steps, still })
    }

    /// Known displacements, and those that a balance gives.
    pub(crate) fn target(&self, known: &[f64], balance: &Balance) -> Vec<f64> {
        let mut target = known.to_vec();
        target.iter_mut().zip(self.displacements(balance)).for_each(|(t, d)| *t += d);
        target
    }

    /// Goes on from a start; `foresees` tells whether a step counts as the last one when the changes so far tell that
    /// the next one would not be any more.
    pub(super) async fn settle_by<P: Place>(
        &self,
        rounds: &Rounds,
        Start { mut place, mut near, mut last, mut steps }: Start<P>,
        known: &[f64],
        foresees: bool,
        mut ask: impl FnMut(&P, &P::Linear) -> Ask,
    ) -> Result<Reached<P>, Failure> {
        let mut at: Vec<Vec<f64>> = self.offsets_at(place.displacements(), known);
        let (mut slowest, mut restless) = (0.0_f64, 0);
        let mut rested: Option<(Reached<P>, Middles)> = None;
        // Springs have the stiffness `stiffness * pull`.
        let (mut stiffness, mut pull) = (0.0_f64, 0.0);
        let mut before: Vec<f64> = Vec::new();
        loop {
            let c = place.linearise(self).await?;
            let (right, asked) = (c.ties().right(place.displacements(), known), ask(&place, &c));
            let forces = c.forces(&asked);
            let springs = if self.is_sprung(&asked) { place.sprung(self, known)? } else { Vec::new() };
            let balance = if !springs.is_empty() {
                let drawn = (pull > 0.0).then_some((at.as_slice(), stiffness * pull));
                self.balance_sprung(rounds, c.ties(), &right, &forces, &springs, drawn).await
            } else if pull > 0.0 {
                self.balance_near(rounds, c.ties(), &right, &forces, &at, stiffness * pull).await
            } else {
                self.balance_under(rounds, c.ties(), &right, &asked, forces, near.as_ref()).await
            };
            let mut balance = balance.ok_or(Failure::Incompatible)?;
            if let Some((_, middles)) = &rested {
                let held = balance.given.iter_mut().zip(middles);
                held.for_each(|(given, middle)| middle.iter().for_each(|middle| given.clone_from(middle)));
            }
            let target = self.target(known, &balance);
            let own = place.displacements();
            let change = self.difference(own, &target);
            let size = self.difference(known, &target).max(self.difference(known, own));
            // Stiff springs make small changes of what would be larger ones.
            let still = self.is_still(change * stiffness.max(1.0), last * stiffness.max(1.0), size);
            if still && pull > 0.0 && rested.is_none() {
                // Springs leave what nothing pushes where it is. It is put in the middle of its play, if that is a place of rest,
                // too.
                let middles = self.middles_of_open(c.ties(), &balance.forces);
                let is_left = middles.iter().any(Option::is_some);
                let rest = Reached { place: place.clone(), balance, steps, still };
                if !is_left {
                    return Ok(rest);
                }
                rested = Some((rest, middles));
                (pull, last, slowest, restless, near) = (0.0, f64::INFINITY, 0.0, 0, None);
                continue;
            }
            if still || steps >= MOST_STEPS {
                let rest = Reached { place, balance, steps, still };
                return Ok(match rested {
                    Some((rested, middles)) if !still || !self.are_open(c.ties(), &rest.balance.forces, &middles) => {
                        rested
                    }
                    _ => rest,
                });
            }
            let next = foreseen(&mut slowest, change, last, size);
            if foresees && pull == 0.0 && rested.is_none() && next <= self.mechanism.still() * size {
                let (place, part) = place.step(&target, 1.0).await?;
                return Ok(Reached { place, balance, steps: steps + 1, still: part >= 1.0 });
            }
            restless += usize::from(change > SHRINKS * last);
            last = change;
            let way = if pull > 0.0 { self.way(own, &target) } else { Vec::new() };
            let goes_on = inner(&way, &before) / inner(&before, &before);
            before = way;
            let mut reach = 1.0;
            if restless > PATIENCE {
                if let Some((rested, _)) = rested {
                    return Ok(rested);
                }
                if pull == 0.0 && !matches!(asked, Ask::Factor) {
                    // The largest force stretches a spring as far as the largest displacement.
                    pull = self.force_scale(&balance.forces) * self.mechanism.length / size;
                    stiffness = 1.0;
                    // What has gone from one side to the other again and again is drawn to between them.
                    reach = 0.5;
                } else if goes_on > CREEPS && goes_on < 1.0 {
                    stiffness *= 1.0 - goes_on;
                } else {
                    stiffness = (STIFFER * stiffness).min(STIFFEST);
                }
                restless = 0;
            }
            let part;
            (place, part) = place.step(&target, reach).await?;
            for (at, given) in at.iter_mut().zip(&balance.given) {
                at.iter_mut().zip(given).for_each(|(a, g)| *a += part * (g - *a));
            }
            near = balance.answer;
            steps += 1;
        }
    }

    /// Whether a change after another one is none, beside displacements of a size.
    pub(super) fn is_still(&self, change: f64, last: f64, size: f64) -> bool {
        change <= self.mechanism.still() * size || change <= NOISE * size && change >= last
    }

    /// The middle of every set that no equation ties and that forces leave open as a whole.
    fn middles_of_open(&self, c: &Ties, forces: &DVector<f64>) -> Middles {
        let face = self.faces(c, forces);
        let middle = |element: &Element| {
            let open = face(element).filter(|face| face.is_whole() && !Self::is_tied(element, c));
            open.map(|face| face.centre[..element.columns.len()].to_vec())
        };
        self.elements.iter().map(middle).collect()
    }

    /// Whether forces leave open what has been put in its middle.
    fn are_open(&self, c: &Ties, forces: &DVector<f64>, middles: &[Option<Vec<f64>>]) -> bool {
        self.middles_of_open(c, forces).iter().zip(middles).all(|(now, then)| now.is_some() || then.is_none())
    }

    /// The offsets at which a state is closed; of what is elastic none is known.
    pub(crate) fn offsets_at(&self, displacements: &[f64], known: &[f64]) -> Vec<Vec<f64>> {
        let own = |&column: &usize| displacements[column] - known[column];
        let of = |element: &Element| match element.source {
            Some(_) => element.columns.iter().map(own).collect(),
            None => vec![0.0; element.columns.len()],
        };
        self.elements.iter().map(of).collect()
    }

    /// From one set of displacements to another, in characteristic lengths and radians.
    fn way(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        from.iter().zip(to).enumerate().map(|(k, (from, to))| (to - from) / self.basis.unit(k)).collect()
    }

    /// The largest difference of two sets of displacements, in characteristic lengths and radians.
    pub(crate) fn difference(&self, a: &[f64], b: &[f64]) -> f64 {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).enumerate().filter(|(_, apart)| *apart > 0.0);
        apart.map(|(k, apart)| apart / self.basis.unit(k)).fold(0.0, f64::max)
    }
}

/// What the next change will be after this one: changes shrink by as much as the displacements are beside the dimensions,
/// one like the other.
pub(super) fn foreseen(slowest: &mut f64, change: f64, last: f64, size: f64) -> f64 {
    *slowest = slowest.max(change / last).max(size);
    if *slowest < SHRINKS { change * *slowest } else { change }
}

/// A linearisation, as much of it as is needed.
pub(super) trait Linear {
    fn ties(&self) -> &Ties;

    /// What is asked, as forces.
    fn forces(&self, ask: &Ask) -> DVector<f64>;
}

/// A linearisation that is made at a state of the basis.
trait AtState: Sized {
    /// `None` where the basis is singular.
    fn at_state(basis: &Basis, solver: &Solver<'_>, state: &State) -> Option<Self>;
}

impl AtState for Compatibility {
    fn at_state(basis: &Basis, solver: &Solver<'_>, state: &State) -> Option<Self> {
        Self::at(basis, solver, state)
    }
}

impl AtState for Ties {
    fn at_state(basis: &Basis, solver: &Solver<'_>, state: &State) -> Option<Self> {
        Self::at(basis, solver, state)
    }
}

impl Linear for Compatibility {
    fn ties(&self) -> &Ties {
        self
    }

    fn forces(&self, ask: &Ask) -> DVector<f64> {
        ask.forces(self, &self.output.parameters)
    }
}

impl Linear for Ties {
    fn ties(&self) -> &Ties {
        self
    }

    fn forces(&self, ask: &Ask) -> DVector<f64> {
        if matches!(ask, Ask::Load) { self.load.clone() } else { DVector::zeros(self.load.len()) }
    }
}

/// Closes the basis for a part of the way to the target, or for less of it where that cannot be reached; tells which part.
pub(crate) fn step(solver: &Solver<'_>, from: &State, target: &[f64], mut part: f64) -> Result<(State, f64), Failure> {
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
