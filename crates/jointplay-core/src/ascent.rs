//! Ascent of a cost over the admissible offsets on the exact closure.
//!
//! The gradient of the cost along the offsets is one transposed solve; the support point of every set
//! along it is the best admissible offset of the linearised mechanism (Frank and Wolfe). The step to
//! it is taken whole when the cost rises, which near the nominal pose it nearly always does; else the
//! cost is maximised along the step, which also settles a guide that hesitates between two corners.
//! A fixed point is where contact, reactions and pose agree.

use crate::clearance::{Face, inner};
use crate::closure::Inputs;
use crate::mechanism::{Mechanism, Source};
use crate::sensitivity::{Cost, Gradient};
use crate::solver::{Linearised, Solver, State, between};
use crate::space::{Component, norm, sub};

/// Whole or shortened steps per ascent.
const STEPS: usize = 200;
/// Bisections of one line search.
const BISECTIONS: usize = 50;
/// An ascent stands still when no offset changes by more than this part of its set.
const STILL: f64 = 1e-13;
/// Steps after which an ascent that gains nothing but rounding has settled.
const CALM: usize = 30;
/// A reaction below this part of the largest one decides nothing.
pub const UNDECIDED: f64 = 1e-9;

/// What is maximised.
#[derive(Clone, Debug)]
pub enum Objective {
    /// The work of the dead loads; only clearances give way.
    Load,
    /// The distance of the output from a nominal position; everything may vary.
    Position {
        /// Nominal position.
        from: [f64; 3],
    },
    /// One component of the output, times a sign.
    Component {
        /// Index of the component.
        index: usize,
        /// +1 for the highest, -1 for the lowest.
        sign: f64,
    },
}

/// Where an ascent ended.
#[derive(Clone, Debug)]
pub struct Summit {
    /// The state with its inputs.
    pub state: State,
    /// Value of the objective.
    pub value: f64,
    /// Gradient of the objective along the inputs, and the multipliers of the closure rows.
    pub gradient: Gradient,
    /// Steps taken.
    pub steps: usize,
    /// Whether it stands still.
    pub settled: bool,
    /// Whether part of the admissible offsets could not be assembled on this branch.
    pub blocked: bool,
}

impl Summit {
    /// What stands for a summit where no ascent could begin.
    pub(crate) fn nowhere(state: &State, mechanism: &Mechanism) -> Self {
        let nan = |n: usize| vec![f64::NAN; n];
        let mut state = state.clone();
        state.coordinates.fill(f64::NAN);
        Self {
            state,
            value: f64::NAN,
            gradient: Gradient {
                inputs: Inputs { drives: nan(mechanism.n_drives()), parameters: nan(mechanism.n_parameters()) },
                multipliers: nan(mechanism.n_rows()),
            },
            steps: 0,
            settled: false,
            blocked: true,
        }
    }
}

impl Mechanism {
    fn objective_value(&self, objective: &Objective, state: &State) -> f64 {
        match objective {
            Objective::Load => {
                let poses = self.poses(&state.coordinates);
                self.loads
                    .iter()
                    .map(|load| {
                        let at = self.place(load.point, &poses, &state.inputs.parameters).position;
                        let turned = self.points[load.point].body.map_or(0.0, |b| {
                            self.space
                                .components()
                                .iter()
                                .enumerate()
                                .map(|(k, c)| match c {
                                    Component::About(i) => load.moment[*i] * state.coordinates[b * self.size() + k],
                                    Component::Along(_) => 0.0,
                                })
                                .sum()
                        });
                        inner(&load.force, &at) + turned
                    })
                    .sum()
            }
            Objective::Position { from } => {
                let poses = self.poses(&state.coordinates);
                norm(&sub(self.place(self.output, &poses, &state.inputs.parameters).position, *from))
            }
            Objective::Component { index, sign } => sign * self.output(&state.coordinates, &state.inputs)[*index],
        }
    }

    pub(crate) fn objective_cost(
        &self,
        objective: &Objective,
        linearised: &Linearised<'_>,
        state: &State,
    ) -> Cost<f64> {
        match objective {
            Objective::Load => self.load_cost(&linearised.poses, &state.inputs.parameters),
            Objective::Position { from } => {
                let at = self.place(self.output, &linearised.poses, &state.inputs.parameters).position;
                let error = sub(at, *from);
                let size = norm(&error);
                // At the nominal position itself every direction is as good: take the first.
                let direction = if size > 0.0 { error.map(|e| e / size) } else { [1.0, 0.0, 0.0] };
                let mut cost = self.no_cost();
                self.add_wrench(
                    self.output,
                    direction,
                    [0.0; 3],
                    &linearised.poses,
                    &state.inputs.parameters,
                    &mut cost,
                );
                cost
            }
            Objective::Component { index, sign } => {
                let mut cost = self.component_cost(*index, &linearised.poses, &state.inputs.parameters);
                cost.twists.iter_mut().chain(cost.parameters.iter_mut()).for_each(|v| *v *= sign);
                cost
            }
        }
    }

    /// Whether a source gives way to an objective.
    #[must_use]
    pub fn gives_way(&self, objective: &Objective, source: &Source) -> bool {
        source.is_clearance || !matches!(objective, Objective::Load)
    }

    /// The face of a source's set that a gradient exposes.
    #[must_use]
    pub fn exposed(&self, source: &Source, gradient: &Gradient, tolerance: f64) -> Face {
        let w = &gradient.inputs.parameters[source.range()];
        // An angle's conjugate is a moment: compare it as a force at the characteristic length.
        let angle = source.components == ["angle"];
        source.set.face(w, if angle { tolerance * self.length } else { tolerance })
    }

    /// Size of the multipliers as forces.
    pub(crate) fn force_scale(&self, gradient: &Gradient) -> f64 {
        self.rows.iter().zip(&gradient.multipliers).fold(0.0, |largest: f64, (row, l)| {
            largest.max(match row.component {
                Component::Along(_) => l.abs(),
                Component::About(_) => l.abs() / self.length,
            })
        })
    }

    /// The inputs with every source that gives way at the middle of the face it is pushed to.
    pub(crate) fn pushed(&self, objective: &Objective, gradient: &Gradient, inputs: &Inputs<f64>) -> Inputs<f64> {
        let tolerance = match objective {
            Objective::Load => UNDECIDED * self.force_scale(gradient),
            Objective::Position { .. } | Objective::Component { .. } => 0.0,
        };
        let mut pushed = inputs.clone();
        for source in self.sources.iter().filter(|s| self.gives_way(objective, s)) {
            let face = self.exposed(source, gradient, tolerance);
            for (k, p) in source.range().enumerate() {
                pushed.parameters[p] = self.centre[p] + face.centre[k];
            }
        }
        pushed
    }

    /// Largest change of an offset, as a part of its set.
    fn change(&self, from: &Inputs<f64>, to: &Inputs<f64>) -> f64 {
        self.sources.iter().filter(|s| !s.set.is_zero()).fold(0.0, |largest: f64, source| {
            source.range().enumerate().fold(largest, |largest, (k, p)| {
                largest.max((to.parameters[p] - from.parameters[p]).abs() / source.set.half_width(k))
            })
        })
    }
}

impl Solver<'_> {
    fn slope(&self, objective: &Objective, state: &State) -> Option<Gradient> {
        let linearised = self.linearise(state)?;
        let cost = self.mechanism.objective_cost(objective, &linearised, state);
        Some(self.mechanism.gradient(&linearised, cost))
    }

    /// Climbs from a state to where the objective stands still on the admissible offsets; `None` where
    /// the closure is singular.
    #[must_use]
    pub fn climb(&self, objective: &Objective, from: State) -> Option<Summit> {
        let m = self.mechanism;
        let mut state = from;
        let mut value = m.objective_value(objective, &state);
        let mut gradient = self.slope(objective, &state)?;
        let (mut blocked, mut searched) = (false, false);
        for step in 0..STEPS {
            let pushed = m.pushed(objective, &gradient, &state.inputs);
            if m.change(&state.inputs, &pushed) <= STILL {
                return Some(Summit { state, value, gradient, steps: step, settled: true, blocked });
            }
            let rise = |g: &Gradient| {
                g.inputs
                    .parameters
                    .iter()
                    .zip(pushed.parameters.iter().zip(&state.inputs.parameters))
                    .fold((0.0_f64, 0.0_f64), |(sum, size), (g, (p, u))| {
                        (sum + g * (p - u), size + (g * p).abs() + (g * u).abs())
                    })
            };
            let (gain, size) = rise(&gradient);
            // Searches along a step, and reactions near zero, end in rounding before the offsets stand still.
            if gain <= 1e-15 * size && (searched || step >= CALM) {
                return Some(Summit { state, value, gradient, steps: step, settled: true, blocked });
            }
            // Try the whole step, then ever shorter ones until one can be assembled.
            let mut part = 1.0;
            let reached = loop {
                let inputs = if part < 1.0 { between(&state.inputs, &pushed, part) } else { pushed.clone() };
                if let Ok(next) = self.follow(&state, &inputs) {
                    break Some(next);
                }
                blocked = true;
                part *= 0.5;
                if part < 1e-3 {
                    break None;
                }
            };
            let Some(mut next) = reached else {
                return Some(Summit { state, value, gradient, steps: step, settled: false, blocked });
            };
            let mut next_gradient = self.slope(objective, &next)?;
            let mut next_value = m.objective_value(objective, &next);
            // A slope at the end that rounding made does not count.
            if next_value < value && rise(&next_gradient).0 < -1e-12 * size {
                searched = true;
                // The cost turns down on the way: find where its slope along the step vanishes.
                let (mut low, mut high) = (0.0, part);
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (low + high);
                    let Ok(trial) = self.follow(&state, &between(&state.inputs, &pushed, middle)) else { break };
                    let trial_gradient = self.slope(objective, &trial)?;
                    if rise(&trial_gradient).0 > 0.0 {
                        low = middle;
                    } else {
                        high = middle;
                    }
                    (next, next_gradient) = (trial, trial_gradient);
                }
                next_value = m.objective_value(objective, &next);
            }
            (state, gradient, value) = (next, next_gradient, next_value);
        }
        Some(Summit { state, value, gradient, steps: STEPS, settled: false, blocked })
    }
}
