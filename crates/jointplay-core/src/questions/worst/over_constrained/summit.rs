//! Extremes on the exact closure: from first-order optima by sequences of programs, those of all extremes side by
//! side.
//!
//! A step is made when it keeps enough of what its program promised, misfits counted at the largest self-stress met.
//! Otherwise springs hold the offsets where they are (proximal points, [`crate::redundancy::sequence`]), the stiffer
//! the more often that happens, and the softer the more steps are made.

use nalgebra::DVector;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::over_constrained::linear::{Extreme, Site};
use crate::questions::worst::worker::Height;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{Compatibility, FITS};
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::step;

/// Ends of other extremes at the most from which one starts.
const OTHERS: usize = 4;
/// Programs in a row.
const MOST_STEPS: usize = 24;
/// A sequence is at its end when the next program promises less than this part: programs that are solved together
/// are good to that.
const GAIN: f64 = 1e-10;
/// A step counts when it keeps this part of what its program promised.
const KEPT: f64 = 0.1;
/// The factor by which springs become stiffer where it does not, and softer where it does; how stiff they are first.
const STIFFER: f64 = 8.0;
const SOFTER: f64 = 4.0;
const FIRST: f64 = 1.0 / 16.0;

/// A sequence of programs on its way to an extreme.
struct Sequence {
    state: State,
    place: Place,
    /// Stiffness of the springs that hold the offsets, zero for none.
    stiffness: f64,
    /// The largest self-stresses met: what a misfit costs.
    stresses: Vec<f64>,
}

/// What is known of a state.
struct Place {
    compatibility: Compatibility,
    right: DVector<f64>,
    forces: DVector<f64>,
    height: Height,
    /// Whether all joints close.
    closed: bool,
    /// The offsets there.
    at: Vec<Vec<f64>>,
}

impl Site<'_> {
    /// The weights of the output's components in a measure at a state, with the pose and its value.
    fn measured(&self, measure: Measure, state: &State) -> (Vec<f64>, Height) {
        let m = self.system.mechanism;
        let error = self.system.basis.kept.error(state, self.nominal);
        let weights = m.weights(measure, &error);
        let value = measure.value(&error, m.n_translations());
        let of = |p: usize| state.inputs.parameters[m.place_of(p)];
        let parameters = (0..m.n_parameters()).map(of).collect();
        (weights, Height { value, parameters, error })
    }

    fn place(&self, solver: &Solver<'_>, measure: Measure, state: &State) -> Option<Place> {
        let compatibility = Compatibility::at(self.system.basis, solver, state)?;
        let (direction, height) = self.measured(measure, state);
        Some(Place {
            right: compatibility.right(&state.inputs.parameters, &self.known),
            forces: Ask::Along(direction).forces(&compatibility, &compatibility.output.parameters),
            closed: self.system.basis.scaled_misfit(&compatibility.misfit) <= FITS,
            at: self.system.offsets_at(&state.inputs.parameters, &self.known),
            compatibility,
            height,
        })
    }

    /// Goes on to what the program of a sequence asks for, where that promises a gain. A step that does not keep
    /// the promise is not made, and springs hold the offsets more tightly.
    fn next(&self, solver: &Solver<'_>, measure: Measure, mut to: Sequence, balance: &Balance) -> Option<Sequence> {
        let (system, own) = (self.system, &to.state.inputs.parameters);
        let mut target = self.known.clone();
        target.iter_mut().zip(system.displacements(balance)).for_each(|(t, d)| *t += d);
        let moves = target.iter().zip(own).map(|(to, from)| to - from);
        let gain: f64 = to.place.forces.iter().zip(moves).map(|(force, moved)| force * moved).sum();
        if to.place.closed && gain <= GAIN * to.place.height.value.abs() {
            return None;
        }
        if let Some(answer) = &balance.answer {
            to.stresses.iter_mut().zip(&answer.multipliers).for_each(|(s, y)| *s = s.max(2.0 * y.abs()));
        }
        let cost = |place: &Place| -> f64 {
            to.stresses.iter().zip(&place.compatibility.misfit).map(|(stress, gap)| stress * gap.abs()).sum()
        };
        let trial = step(solver, &to.state, &target, 1.0).ok().and_then(|(state, _)| {
            let place = self.place(solver, measure, &state)?;
            Some((state, place))
        });
        let promised = gain + cost(&to.place);
        let gained = |place: &Place| place.height.value - cost(place) - to.place.height.value + cost(&to.place);
        match trial {
            Some((state, place)) if gained(&place) >= KEPT * promised => {
                (to.state, to.place) = (state, place);
                to.stiffness /= SOFTER;
            }
            _ => {
                // The largest force stretches a spring as far as the largest displacement.
                let pull = system.force_scale(&balance.forces) * system.mechanism.length
                    / system.difference(&self.known, &target);
                to.stiffness = if to.stiffness == 0.0 { FIRST * pull } else { STIFFER * to.stiffness };
                if !to.stiffness.is_finite() {
                    return None;
                }
            }
        }
        Some(to)
    }

    /// What the next program of a sequence gives.
    async fn balance(&self, rounds: &Rounds, at: &Sequence) -> Option<Balance> {
        let (system, Place { compatibility: c, right, forces, at: offsets, .. }) = (self.system, &at.place);
        if at.stiffness == 0.0 {
            return system.pushed(rounds, c, right, forces).await;
        }
        system.balance_near(&rounds.roughly(), c, right, forces, offsets, at.stiffness).await
    }

    /// The highest exact poses that the sequences of programs from the starts of every extreme meet. All of them
    /// are admissible, and those that close count. Tells besides whether all starts could be assembled; a sequence begins
    /// as near to its own as that goes.
    pub fn summits(&self, solver: &Solver<'_>, built: &State, extremes: &[Extreme]) -> (Vec<Option<Height>>, bool) {
        let starts = extremes.iter().enumerate().flat_map(|(number, e)| e.starts.iter().map(move |s| (number, s)));
        let starts: Vec<(usize, &Vec<f64>)> = starts.collect();
        let met = Rounds::each_in_chunks(&starts, CHUNK, async |rounds, &(extreme, start)| {
            (extreme, self.summit(rounds, solver, built, extremes[extreme].measure, start).await)
        });
        let (mut best, mut all_reached) = (vec![None; extremes.len()], true);
        for (extreme, (height, reached)) in met {
            best[extreme] = higher(best[extreme].take(), height);
            all_reached &= reached;
        }
        (best, all_reached)
    }

    /// Lets every extreme start where some of the others have ended, those first that are farthest its way, so that a size
    /// is at least as large as each of its components.
    pub fn start_from_each_other(&self, extremes: &mut [Extreme], summits: &[Option<Height>]) {
        let m = self.system.mechanism;
        for (k, extreme) in extremes.iter_mut().enumerate() {
            let own = |at: &Height| extreme.measure.value(&at.error, m.n_translations());
            let others = summits.iter().enumerate().filter(|(other, _)| *other != k);
            let mut others: Vec<&Height> = others.filter_map(|(_, summit)| summit.as_ref()).collect();
            others.sort_by(|a, b| own(b).total_cmp(&own(a)));
            extreme.starts = others.iter().take(OTHERS).map(|at| m.displacements(&at.parameters)).collect();
        }
    }

    /// The highest one that the sequence from a start meets, and whether that could be assembled.
    async fn summit(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        built: &State,
        measure: Measure,
        start: &[f64],
    ) -> (Option<Height>, bool) {
        let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: start.to_vec() };
        let followed = solver.follow_part(built, &inputs);
        let reached = followed.is_ok();
        let state = followed.unwrap_or_else(|(last, _)| last);
        let Some(place) = self.place(solver, measure, &state) else { return (None, reached) };
        let mut at = Sequence { state, place, stiffness: 0.0, stresses: vec![0.0; self.system.basis.redundancy()] };
        let mut best = at.place.closed();
        for _ in 0..MOST_STEPS {
            // Where a sequence breaks off, what it met before counts all the same.
            let Some(balance) = self.balance(rounds, &at).await else { break };
            let Some(next) = self.next(solver, measure, at, &balance) else { break };
            at = next;
            best = higher(best, at.place.closed());
        }
        (best, reached)
    }
}

impl Place {
    /// The pose, where all joints close.
    fn closed(&self) -> Option<Height> {
        self.closed.then(|| self.height.clone())
    }
}

/// How high a pose is; below all others where there is none.
pub(super) fn value(at: Option<&Height>) -> f64 {
    at.map_or(f64::NEG_INFINITY, |at| at.value)
}

/// The higher one of two poses.
fn higher(a: Option<Height>, b: Option<Height>) -> Option<Height> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.value > a.value { b } else { a }),
        (a, b) => a.or(b),
    }
}
