//! Ascent of a measure of the output's error over the admissible offsets on the exact closure.
//!
//! The gradient of the measure along the offsets is one transposed solve; the support point of every set
//! along it is the best admissible offset of the linearised mechanism (Frank and Wolfe). Whole steps to
//! it nearly always settle at once. Where they do not (a guide hesitates between two corners, an offset
//! acts in second order only) a projected gradient ascent ([`super::projected`]) takes over.

use crate::clearance::offset::inner;
use crate::clearance::undecided::Unforced;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Budget, Linearised, Solver, State};
use crate::closure::sensitivity::{Cost, Gradient};
use crate::math::rotation::inverse_left_jacobian;
use crate::math::space::{Component, Space};
use crate::math::vector::{Vec3, norm, scale};
use crate::mechanism::Mechanism;
use crate::questions::worst::projected::{Projected, ROUGH};

/// Whole steps to the support points.
const WHOLE_STEPS: usize = 25;
/// Steps of a projected ascent that may lead to where the mechanism cannot be assembled.
const MOST_WALLS: usize = 12;

/// A number that measures an error of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// The distance of the output's point from its nominal place.
    Position,
    /// The angle by which the output's body is turned; in space.
    Rotation,
    /// A component, or its negative.
    Component {
        /// Index of the component.
        index: usize,
        /// Whether the lowest value is meant.
        lowest: bool,
    },
    /// The displacement of the output's point along a unit vector; two components in the plane.
    Along(Vec3<f64>),
}

impl Measure {
    /// Its value for an error, the translations first.
    #[inline]
    #[must_use]
    pub fn value(self, error: &[f64], translations: usize) -> f64 {
        match self {
            Self::Position => norm(&error[..translations]),
            Self::Rotation => norm(&error[translations..]),
            Self::Component { index, lowest } => {
                if lowest {
                    -error[index]
                } else {
                    error[index]
                }
            }
            Self::Along(direction) => inner(&direction[..translations], &error[..translations]),
        }
    }

    /// Its gradient along a displacement and a rotation of the output, as a force and a moment.
    #[inline]
    #[must_use]
    pub fn wrench(self, space: Space, error: &[f64]) -> [Vec3<f64>; 2] {
        let translations = if matches!(space, Space::Planar) { 2 } else { 3 };
        let mut wrench = [[0.0; 3]; 2];
        match self {
            Self::Position => wrench[0] = towards(&error[..translations]),
            Self::Rotation => wrench[1] = towards(&error[translations..]),
            Self::Component { index, lowest } => {
                let sign = if lowest { -1.0 } else { 1.0 };
                match (space.components()[index], space) {
                    (Component::Along(i), _) => wrench[0][i] = sign,
                    (Component::About(i), Space::Planar) => wrench[1][i] = sign,
                    (Component::About(i), Space::Spatial) => {
                        wrench[1] = scale(inverse_left_jacobian([error[3], error[4], error[5]])[i], sign);
                    }
                }
            }
            Self::Along(direction) => wrench[0] = direction,
        }
        wrench
    }
}

/// The unit vector of some components. Any direction leads away from zero.
#[inline]
fn towards(components: &[f64]) -> Vec3<f64> {
    let size = norm(components);
    if size == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let mut unit = [0.0; 3];
    unit.iter_mut().zip(components).for_each(|(u, e)| *u = e / size);
    unit
}

/// Where an ascent ended.
#[derive(Clone, Debug)]
pub struct Summit {
    /// The state with its inputs.
    pub state: State,
    /// Value of the measure.
    pub value: f64,
    /// Gradient of the measure along the inputs, and the multipliers of the closure rows.
    pub gradient: Gradient,
    /// Steps taken.
    pub steps: usize,
    /// Whether it has converged.
    pub settled: bool,
    /// Whether part of the admissible offsets could not be assembled on this branch.
    pub blocked: bool,
}

impl Mechanism {
    fn measured(&self, measure: Measure, nominal: &State, state: &State) -> f64 {
        measure.value(&self.error(state, nominal), self.n_translations())
    }

    fn measure_cost(&self, measure: Measure, nominal: &State, linearised: &Linearised<'_>, state: &State) -> Cost<f64> {
        let [force, moment] = measure.wrench(self.space, &self.error(state, nominal));
        let mut cost = self.no_cost();
        let parameters = &state.inputs.parameters;
        self.add_output_wrench(force, moment, &linearised.poses, parameters, &mut cost);
        cost
    }
}

impl Solver<'_> {
    fn slope(&self, measure: Measure, nominal: &State, state: &State) -> Option<Gradient> {
        let linearised = self.linearise(state)?;
        let cost = self.mechanism.measure_cost(measure, nominal, &linearised, state);
        Some(self.mechanism.gradient(&linearised, cost))
    }

    /// Climbs from a state to where a measure is stationary on the admissible offsets, to the last digits or roughly,
    /// or as far as the budget reaches; `None` where the closure is singular. Errors are told from the nominal state.
    #[must_use]
    pub fn climb(
        &self,
        measure: Measure,
        nominal: &State,
        from: State,
        fine: bool,
        budget: &mut Budget,
    ) -> Option<Summit> {
        let m = self.mechanism;
        let value = m.measured(measure, nominal, &from);
        let gradient = self.slope(measure, nominal, &from)?;
        let mut at = Summit { state: from, value, gradient, steps: 0, settled: false, blocked: false };
        for _ in 0..WHOLE_STEPS {
            let pushed = m.support_update(&at.gradient, &at.state.inputs, |_, _| Some(Unforced::default()));
            if m.change(&at.state.inputs, &pushed) <= if fine { m.still() } else { ROUGH } {
                at.settled = true;
                return Some(at);
            }
            let Ok(next) = self.follow_within(&at.state, &pushed, budget) else { break };
            let value = m.measured(measure, nominal, &next);
            // A guide that hesitates between two corners: the projected ascent settles it.
            if value < at.value - m.noise(&at) {
                break;
            }
            let gradient = self.slope(measure, nominal, &next)?;
            at = Summit { state: next, value, gradient, steps: at.steps + 1, ..at };
        }
        self.go_on(measure, nominal, at, fine, budget)
    }

    /// Climbs by projected gradient steps only.
    #[must_use]
    pub fn climb_gently(
        &self,
        measure: Measure,
        nominal: &State,
        from: State,
        fine: bool,
        budget: &mut Budget,
    ) -> Option<Summit> {
        let value = self.mechanism.measured(measure, nominal, &from);
        let gradient = self.slope(measure, nominal, &from)?;
        let at = Summit { state: from, value, gradient, steps: 0, settled: false, blocked: false };
        self.go_on(measure, nominal, at, fine, budget)
    }

    /// Goes on by projected gradient steps.
    fn go_on(
        &self,
        measure: Measure,
        nominal: &State,
        mut at: Summit,
        fine: bool,
        budget: &mut Budget,
    ) -> Option<Summit> {
        let m = self.mechanism;
        let (parameters, slope) = (at.state.inputs.parameters.clone(), &at.gradient.inputs.parameters);
        let mut ascent = Projected::new(m, parameters, at.value, m.noise(&at), slope, fine);
        let mut proposed = ascent.propose();
        let mut walls = 0;
        let mut highest = at.clone();
        while let Some(parameters) = proposed {
            let inputs = Inputs { drives: at.state.inputs.drives.clone(), parameters };
            let Ok(state) = self.follow_within(&at.state, &inputs, budget) else {
                if budget.is_spent() {
                    break;
                }
                walls += 1;
                // The summit lies beyond what can be assembled: every further step would end at the same wall,
                // after many steps of continuation each.
                proposed = if walls < MOST_WALLS { ascent.shorten() } else { None };
                continue;
            };
            let value = m.measured(measure, nominal, &state);
            if !ascent.accepts(value) {
                proposed = ascent.shorten();
                continue;
            }
            let gradient = self.slope(measure, nominal, &state)?;
            at = Summit { state, value, gradient, ..at };
            ascent.accept(value, m.noise(&at), &at.gradient.inputs.parameters);
            if value > highest.value {
                highest = at.clone();
            }
            proposed = ascent.propose();
        }
        let settled = !budget.is_spent() && (ascent.settled() || ascent.has_stalled());
        // The value may have fallen for a while.
        let end = if highest.value > at.value + m.noise(&at) { highest } else { at };
        Some(Summit { steps: end.steps + ascent.steps(), settled, blocked: walls > 0, ..end })
    }
}

impl Mechanism {
    fn noise(&self, at: &Summit) -> f64 {
        self.rounding(self.force_scale(&at.gradient), at.value)
    }

    /// Rounding of a measure's value: poses are good to some units of the last place of the length,
    /// and the largest force among the multipliers tells what a shift of a joint makes of the value.
    #[inline]
    pub(crate) fn rounding(&self, force: f64, value: f64) -> f64 {
        64.0 * f64::EPSILON * (force * self.length + value.abs())
    }
}
