//! The error of the output over parts of the sets: its value at a point, and its derivative over the part.

use std::ops::Range;

use crate::closure::newton::{Solver, State};
use crate::math::interval::Interval;
use crate::math::vector::{Vec3, sub};
use crate::questions::certificate::blocks::Part;
use crate::questions::certificate::chart::{Poses, rate_of_vector};
use crate::questions::certificate::enclosure::{At, Enclosure, Encloser};

/// The error over a part, about a point.
pub(super) struct Expansion {
    pub enclosure: Enclosure,
    /// The point.
    pub x: Vec<f64>,
    /// The error there, by component.
    pub error: Vec<Interval>,
    /// The derivative of every component over the part, along the own coordinates; of those that were asked for.
    pub gradient: Vec<Vec<Interval>>,
}

/// Errors of one configuration.
pub(super) struct Errors<'m> {
    pub encloser: Encloser<'m>,
    nominal: Nominal,
}

/// The nominal output.
struct Nominal {
    place: Vec3<Interval>,
    poses: Poses,
}

/// Why a configuration has no bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(super) enum Refused {
    /// The mechanism is over-constrained or elastic.
    NotDeterminate = 1,
    /// There is no pose to begin with.
    NotAssembled = 2,
    /// The closure is singular to working precision.
    Singular = 3,
    /// The poses could not be enclosed over all of the sets.
    NotEnclosed = 4,
    /// The parts that were looked at did not bound it.
    NotBounded = 5,
}

impl Refused {
    /// The number that arrays carry; zero is none of these.
    pub const fn code(self) -> u64 {
        self as u64
    }
}

impl<'m> Errors<'m> {
    /// Of a nominal state and of a state in the middle of all sets, with the expansion over all of the sets.
    pub fn new(solver: &Solver<'m>, nominal: &State, middle: &State) -> Result<(Self, Expansion), Refused> {
        let m = solver.mechanism;
        let encloser = Encloser::new(solver, middle, m.sources(), &m.centre).ok_or(Refused::Singular)?;
        let nominal = Nominal::of(solver, nominal).ok_or(Refused::Singular)?;
        let enclosure = encloser.prove(&encloser.product.whole()).ok_or(Refused::NotEnclosed)?;
        let at = encloser.at(encloser.product.centre(&enclosure.part), &enclosure).ok_or(Refused::NotEnclosed)?;
        let errors = Self { encloser, nominal };
        let whole = errors.expansion(enclosure, at, &(0..m.size())).ok_or(Refused::NotEnclosed)?;
        Ok((errors, whole))
    }

    /// Over a part that belongs to the one of another expansion, and to the whole.
    pub fn expanded(
        &self,
        part: &Part,
        within: &Expansion,
        whole: &Expansion,
        components: &Range<usize>,
    ) -> Option<Expansion> {
        let x = self.encloser.product.centre(part);
        // The point may lie beside the part.
        let known = if within.enclosure.part.has(&x) { within } else { whole };
        let at = self.encloser.at(x, &known.enclosure)?;
        let enclosure = self.encloser.within(&known.enclosure, part, &at)?;
        self.expansion(enclosure, at, components)
    }

    fn expansion(&self, enclosure: Enclosure, at: At, components: &Range<usize>) -> Option<Expansion> {
        let (encloser, chart) = (&self.encloser, &self.encloser.chart);
        let m = chart.mechanism;
        let poses = chart.poses(&at.v);
        let moved = sub(chart.place(&poses, &at.parameters), self.nominal.place);
        let error = m.pose_components(moved, &chart.turned(&self.nominal.poses, &poses));
        let translations = m.n_translations();
        // The rates of a rotation vector need all of the angular velocity.
        let needed = if components.end > translations { components.start.min(translations)..m.size() } else { components.clone() };
        let of = |component: usize| {
            if !needed.contains(&component) {
                return Some(Vec::new());
            }
            let cost = m.component_cost(component, &enclosure.poses.poses, &enclosure.parameters);
            encloser.gradient(&enclosure, &cost.twists, &cost.parameters)
        };
        let mut gradient = (0..m.size()).map(of).collect::<Option<Vec<_>>>()?;
        if needed.end > translations {
            self.rates_of_vector(&enclosure, &mut gradient[translations..]);
        }
        Some(Expansion { enclosure, x: at.x, error, gradient })
    }

    /// Makes rates of the rotation components of angular velocities.
    fn rates_of_vector(&self, enclosure: &Enclosure, rows: &mut [Vec<Interval>]) {
        let m = self.encloser.chart.mechanism;
        if m.points[m.output].body.is_none() {
            rows.iter_mut().flatten().for_each(|rate| *rate = Interval::ZERO);
        }
        if let [a, b, c] = rows {
            let turned = self.encloser.chart.turned(&self.nominal.poses, &enclosure.poses);
            let vector = [turned[0], turned[1], turned[2]];
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                [*a, *b, *c] = rate_of_vector(vector, [*a, *b, *c]);
            }
        }
    }
}

impl Nominal {
    /// The exact nominal state near a computed one.
    fn of(solver: &Solver<'_>, nominal: &State) -> Option<Self> {
        let encloser = Encloser::new(solver, nominal, &[], &nominal.inputs.parameters)?;
        let part = encloser.product.whole();
        let enclosure = encloser.prove(&part)?;
        let place = encloser.chart.place(&enclosure.poses, &enclosure.parameters);
        Some(Self { place, poses: enclosure.poses })
    }
}
