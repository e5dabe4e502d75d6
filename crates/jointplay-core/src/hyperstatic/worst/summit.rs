//! Extremes on the exact closure: from first-order optima by sequences of programs, those of all extremes side by
//! side. They go on as [`crate::hyperstatic::settle`] does.

use nalgebra::DVector;
use rayon::prelude::*;

use super::linear::{Extreme, Site};
use crate::ascent::Measure;
use crate::batch::Height;
use crate::closure::Inputs;
use crate::hyperstatic::abreast::{Near, Pull};
use crate::hyperstatic::compatibility::{Compatibility, FITS};
use crate::hyperstatic::settle::step;
use crate::hyperstatic::system::{Ask, Balance, System};
use crate::solver::{Solver, State};
use crate::space::Component;

/// Programs in a row.
const MOST_STEPS: usize = 60;
/// A sequence is at its end when the next program promises less than this part: programs that are solved together
/// are good to that.
const GAIN: f64 = 1e-9;
/// Changes that do not shrink, until offsets are drawn to where they are or more so; by what factor, and how much at
/// most ([`crate::hyperstatic::settle`] tells why).
const PATIENCE: usize = 2;
const SHRINKS: f64 = 0.7;
const STIFFER: f64 = 4.0;
const STIFFEST: f64 = 256.0;

/// A sequence of programs on its way to an extreme.
struct Sequence {
    extreme: usize,
    state: State,
    /// The offsets there.
    at: Vec<Vec<f64>>,
    /// The last change, and how many did not shrink.
    last: f64,
    restless: usize,
    /// Stiffness of the springs that hold the offsets, zero for none.
    stiffness: f64,
}

/// Where a sequence is.
struct Place {
    compatibility: Compatibility,
    right: DVector<f64>,
    forces: DVector<f64>,
    height: Height,
    /// Whether all joints close.
    closed: bool,
}

impl Site<'_> {
    /// The weights of the output's components in a measure at a state, with the pose and its value.
    fn measured(&self, measure: Measure, state: &State) -> (Vec<f64>, Height) {
        let m = self.system.mechanism;
        let error = self.system.basis.kept.error(state, self.nominal);
        let [force, moment] = measure.wrench(m.space, &error);
        let weight = |component: &Component| match component {
            Component::Along(i) => force[*i],
            Component::About(i) => moment[*i],
        };
        let weights = m.space.components().iter().map(weight).collect();
        let value = measure.value(&error, m.n_translations());
        let of = |p: usize| state.inputs.parameters[m.place_of(p)];
        let parameters = (0..m.n_parameters()).map(of).collect();
        (weights, Height { value, error, parameters })
    }

    fn place(&self, solver: &Solver<'_>, measure: Measure, state: &State) -> Option<Place> {
        let compatibility = Compatibility::at(self.system.basis, solver, state)?;
        let (direction, height) = self.measured(measure, state);
        Some(Place {
            right: compatibility.right(state, &self.known),
            forces: System::forces(&compatibility, &Ask::Along(direction)),
            closed: self.system.basis.scaled_misfit(&compatibility.misfit) <= FITS,
            compatibility,
            height,
        })
    }

    /// Goes on to what the program at a place asks for, where that promises a gain.
    fn next(&self, solver: &Solver<'_>, mut to: Sequence, place: &Place, balance: &Balance) -> Option<Sequence> {
        let system = self.system;
        let mut target = self.known.clone();
        target.iter_mut().zip(system.displacements(balance)).for_each(|(t, d)| *t += d);
        let own = &to.state.inputs.parameters;
        let change = system.difference(own, &target);
        let size = system.difference(&self.known, &target);
        let moves = target.iter().zip(own).map(|(to, from)| to - from);
        let gain: f64 = place.forces.iter().zip(moves).map(|(force, moved)| force * moved).sum();
        // What springs hold back: their forces where the program left them, over the way that is left.
        let offsets: usize = to.at.iter().map(Vec::len).sum();
        let held = to.stiffness * change * size * offsets as f64;
        if place.closed && gain + held <= GAIN * place.height.value.abs() {
            return None;
        }
        to.restless += usize::from(change > SHRINKS * to.last);
        to.last = change;
        if to.restless > PATIENCE {
            // The largest force stretches a spring as far as the largest displacement.
            let pull = system.force_scale(&balance.forces) * system.mechanism.length / size;
            to.stiffness = if to.stiffness == 0.0 { pull } else { (STIFFER * to.stiffness).min(STIFFEST * pull) };
            to.restless = 0;
        }
        let part;
        (to.state, part) = step(solver, &to.state, &target).ok()?;
        for (at, given) in to.at.iter_mut().zip(&balance.given) {
            at.iter_mut().zip(given).for_each(|(a, g)| *a += part * (g - *a));
        }
        Some(to)
    }

    /// The next programs of some sequences.
    fn balances(&self, places: &[(Place, Sequence)]) -> Vec<Option<Balance>> {
        let pulls: Vec<Pull<'_>> = places.iter().map(|(place, _)| place.pull()).collect();
        if places.first().is_none_or(|(_, sequence)| sequence.stiffness == 0.0) {
            return self.system.balances(&pulls);
        }
        let near: Vec<Near<'_>> =
            places.iter().map(|(_, sequence)| Near { at: &sequence.at, stiffness: sequence.stiffness }).collect();
        self.system.balances_near(&pulls, &near)
    }

    /// The highest exact poses that the sequences of programs from the starts of every extreme meet. All of them
    /// are admissible, and those that close count.
    pub fn summits(&self, solver: &Solver<'_>, built: &State, extremes: &[Extreme]) -> Vec<Option<Height>> {
        let mut best: Vec<Option<Height>> = vec![None; extremes.len()];
        let begin = |extreme: usize| {
            extremes[extreme].starts.iter().map(move |start| {
                let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: start.clone() };
                let state = solver.follow(built, &inputs).unwrap_or_else(|_| built.clone());
                let at = self.system.offsets_at(&state, &self.known);
                Sequence { extreme, state, at, last: f64::INFINITY, restless: 0, stiffness: 0.0 }
            })
        };
        let mut sequences: Vec<Sequence> = (0..extremes.len()).flat_map(begin).collect();
        for _ in 0..MOST_STEPS {
            // Where a sequence breaks off, what it met before counts all the same.
            let place = |at: Sequence| Some((self.place(solver, extremes[at.extreme].measure, &at.state)?, at));
            let places: Vec<(Place, Sequence)> = sequences.into_par_iter().filter_map(place).collect();
            for (place, at) in places.iter().filter(|(place, _)| place.closed) {
                higher(&mut best[at.extreme], &place.height);
            }
            let next =
                |((place, at), balance): ((Place, Sequence), Option<Balance>)| self.next(solver, at, &place, &balance?);
            let (held, free): (Vec<_>, Vec<_>) = places.into_iter().partition(|(_, at)| at.stiffness > 0.0);
            let balances = [&free, &held].map(|places| self.balances(places)).concat();
            let places: Vec<(Place, Sequence)> = free.into_iter().chain(held).collect();
            sequences = places.into_par_iter().zip(balances).filter_map(next).collect();
            if sequences.is_empty() {
                break;
            }
        }
        best
    }
}

impl Place {
    fn pull(&self) -> Pull<'_> {
        Pull { compatibility: &self.compatibility, right: &self.right, forces: self.forces.clone() }
    }
}

/// Keeps the higher one.
fn higher(best: &mut Option<Height>, found: &Height) {
    if best.as_ref().is_none_or(|best| found.value > best.value) {
        *best = Some(found.clone());
    }
}
