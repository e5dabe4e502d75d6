//! The error of the output over parts of the sets: its value at a point, and its derivative over the part.

use std::cell::RefCell;
use std::ops::Range;

use crate::closure::newton::State;
use crate::math::affine::Form;
use crate::math::interval::Interval;
use crate::math::vector::{Vec3, sub};
use crate::mechanism::Mechanism;
use crate::questions::certificate::blocks::{Part, Product};
use crate::questions::certificate::chart::{Poses, rate_of_vector};
use crate::questions::certificate::enclosure::{At, Encloser, Enclosure};
use crate::questions::certificate::second::Second;

/// The error over a part, about a point.
pub(super) struct Expansion {
    pub enclosure: Enclosure,
    /// The point.
    pub x: Vec<f64>,
    /// The error there, by component.
    pub error: Vec<Interval>,
    /// The derivative of every component over the part, along the coordinates of the sets; of those that were asked for.
    pub along_sets: Vec<Vec<Interval>>,
    /// The same with what is along the slabs apart from the rest of it.
    gradient: Vec<Vec<Interval>>,
    /// The same with what is linear in it.
    pub second: Vec<Second>,
}

/// Errors of one configuration.
pub(super) struct Errors<'m> {
    pub encloser: Encloser<'m>,
    nominal: Nominal,
    /// For sums of what is linear in derivatives.
    pub room: RefCell<Second>,
}

/// The nominal output.
struct Nominal {
    place: Vec3<Interval>,
    poses: Poses<Interval>,
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
    /// The flanks of a coupling would have to pass through each other somewhere in the sets.
    FlanksMeet = 6,
}

impl Refused {
    /// The number that arrays carry; zero is none of these.
    pub const fn code(self) -> u64 {
        self as u64
    }
}

impl<'m> Errors<'m> {
    /// Of a nominal state and of a state in the middle of all sets.
    pub fn new(m: &'m Mechanism, nominal: &State, middle: &State) -> Result<Self, Refused> {
        let encloser = Encloser::new(m, middle, m.sources(), &m.centre);
        let nominal = Nominal::of(m, nominal).ok_or(Refused::Singular)?;
        Ok(Self { encloser, nominal, room: RefCell::default() })
    }

    /// Over a part about a point of which the pose is known.
    pub fn expansion(&self, part: &Part, at: At, components: &Range<usize>) -> Result<Expansion, Refused> {
        let (encloser, chart) = (&self.encloser, &self.encloser.chart);
        let m = chart.mechanism;
        let poses = chart.poses(&at.v);
        let moved = sub(chart.place(&poses, &at.parameters), self.nominal.place);
        let error = m.pose_components(moved, &chart.turned(&self.nominal.poses, &poses));
        let forms = encloser.forms(part, &at.x, true);
        let (enclosure, expanded) = encloser.enclose(&forms, part, &at).ok_or(Refused::NotEnclosed)?;
        let gap = |row| m.coupled_row(row, &expanded.poses.bodies, &expanded.parameters, &[]).gap.range();
        if m.flanks().any(|row| !(gap(row).low >= 0.0)) {
            return Err(Refused::FlanksMeet);
        }
        let translations = m.n_translations();
        // The rates of a rotation vector need all of the angular velocity.
        let turns = components.end > translations;
        let needed = if turns { components.start.min(translations)..m.size() } else { components.clone() };
        let of = |component: usize| {
            if !needed.contains(&component) {
                return Some(Vec::new());
            }
            let cost = m.component_cost(component, &expanded.poses.bodies, &expanded.parameters);
            encloser.gradient(&forms, (&enclosure, &expanded), &cost.twists, &cost.parameters)
        };
        let gradient: Option<Vec<_>> = (0..m.size()).map(of).collect();
        let mut gradient = gradient.ok_or(Refused::NotEnclosed)?;
        if turns {
            let nominal = self.nominal.poses.map(Form::Constant);
            let turned = chart.turned(&nominal, &expanded.poses);
            self.rates_of_vector(&turned, &mut gradient[translations..]);
        }
        let ranged = |row: &Vec<Form<'_>>| row.iter().map(|g| encloser.ranged(part, &at.x, *g)).collect();
        let along_sets: Vec<Vec<Interval>> = gradient.iter().map(ranged).collect();
        let slabs = &encloser.product.slabs;
        let (product, base) = (&encloser.product, encloser.product.base(part, &at.x));
        let parts = |row: &Vec<Form<'_>>| slabs.split_parts(row.iter().map(|g| g.parts(at.x.len())).collect());
        let second: Vec<Second> =
            gradient.iter().map(|row| Second::of(product, (&at.x, &base), parts(row).into_iter())).collect();
        let split = |row: Vec<_>| if row.is_empty() { row } else { slabs.split_forms(&forms, row) };
        let gradient = if slabs.len() > 0 {
            gradient.into_iter().map(|row| ranged(&split(row))).collect()
        } else {
            along_sets.clone()
        };
        Ok(Expansion { enclosure, x: at.x, error, along_sets, gradient, second })
    }

    /// Makes rates of the rotation components of angular velocities.
    fn rates_of_vector<'f>(&self, turned: &[Form<'f>], rows: &mut [Vec<Form<'f>>]) {
        let m = self.encloser.chart.mechanism;
        if m.points[m.output].body.is_none() {
            rows.iter_mut().flatten().for_each(|rate| *rate = Form::Constant(Interval::ZERO));
        }
        if let [a, b, c] = rows {
            let vector = [turned[0], turned[1], turned[2]];
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                [*a, *b, *c] = rate_of_vector(vector, [*a, *b, *c]);
            }
        }
    }
}

impl Expansion {
    /// What some components do not exceed along a direction on a part: what is quadratic is bounded as such. Below `enough`
    /// no closer bound is sought.
    pub fn along(
        &self,
        product: &Product,
        part: &Part,
        components: &Range<usize>,
        (direction, enough): (&[f64], f64),
        room: &mut Second,
    ) -> f64 {
        let n: Vec<Interval> = direction.iter().map(|&x| Interval::from_point(x)).collect();
        let error = self.error[components.clone()].iter().zip(&n);
        let value = error.fold(Interval::ZERO, |sum, (e, n)| sum + *e * *n).high;
        room.set_to_sum(&self.second[components.clone()], direction);
        let quadratic =
            Interval::from_point(value) + Interval::from_point(room.most(product, part, &self.x, enough - value));
        let g = self.gradient(components, &n);
        let bound = quadratic.high.min(self.gained(product, part, &g, value));
        if bound.is_nan() { f64::INFINITY } else { bound }
    }

    /// The gradient of some components along a box of directions.
    pub fn gradient(&self, components: &Range<usize>, direction: &[Interval]) -> Vec<Interval> {
        weighted(&self.gradient[components.clone()], direction)
    }

    /// What is reached from a value at the point on a part, with a box of gradients.
    pub fn gained(&self, product: &Product, part: &Part, g: &[Interval], value: f64) -> f64 {
        let supports = product.supports(part, g, &self.x);
        supports.fold(Interval::from_point(value), |sum, s| sum + Interval::from_point(s)).high
    }
}

/// The sum of rows times factors.
pub(super) fn weighted(rows: &[Vec<Interval>], factors: &[Interval]) -> Vec<Interval> {
    let along = |k: usize| rows.iter().zip(factors).fold(Interval::ZERO, |sum, (row, n)| sum + row[k] * *n);
    (0..rows[0].len()).map(along).collect()
}

impl Nominal {
    /// The exact nominal state near a computed one.
    fn of(m: &Mechanism, nominal: &State) -> Option<Self> {
        let encloser = Encloser::new(m, nominal, &[], &nominal.inputs.parameters);
        let at = encloser.middle()?;
        let poses = encloser.chart.poses(&at.v);
        Some(Self { place: encloser.chart.place(&poses, &at.parameters), poses })
    }
}
