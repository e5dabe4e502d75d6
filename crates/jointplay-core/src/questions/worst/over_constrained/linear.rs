//! First-order extremes of one configuration.
//!
//! The reach along a direction is the value of a cone program. Programs along many directions differ in their
//! forces only and are solved together; of those that count in the end each is solved by itself.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::clearance::Set;
use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::math::mesh::{cosine_of_radius, mesh, spread};
use crate::math::vector::{Vec3, dot, norm, scale};
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::flanks::Flanks;
use crate::questions::worst::starts::{self, AtExtreme};
use crate::questions::worst::worker::Height;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::system::{Element, System};

/// Directions of the plane: the bound is within a thousandth of the largest reach.
const FAN: usize = 72;
/// A source whose part in an extreme is less than this one of the largest does not act to first order.
const NOTHING: f64 = 1e-6;
/// How often what does not act is put at ends, and by which part of the forces that act.
const UNDECIDED: usize = 3;
const SLIGHT: f64 = 1e-3;
/// Alternations between direction and support point.
const ALTERNATIONS: usize = 40;
/// A climb is over when it gains less than this part: programs that are solved together are good to that.
const GAIN: f64 = 1e-9;

/// The linearised extreme along a direction of the output's components.
#[derive(Clone, Debug)]
pub(super) struct Farthest {
    pub value: f64,
    /// All displacements as the basis keeps them.
    pub displacements: Vec<f64>,
    /// Share of every source in the value.
    pub contribution: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
}

impl AtExtreme for Farthest {
    fn value(&self) -> f64 {
        self.value
    }

    fn offsets(&self) -> &[f64] {
        &self.displacements
    }
}

/// An extreme with displacements to start from.
pub(super) type Extreme = starts::Extreme<Farthest>;

/// A configuration with everything known about its linearisation.
pub(super) struct Site<'a> {
    pub system: &'a System<'a>,
    pub compatibility: Compatibility,
    pub right: DVector<f64>,
    pub known: Vec<f64>,
    pub case: &'a Case<'a>,
    pub nominal: &'a State,
}

/// A direction and how far the error reaches along it.
#[derive(Clone, Copy)]
struct Reached {
    direction: Vec3<f64>,
    value: f64,
    /// The components of its support point.
    error: Vec3<f64>,
}

impl Site<'_> {
    /// The error of a balance to first order.
    fn error(&self, balance: &Balance) -> Vec<f64> {
        let m = self.system.mechanism;
        m.first_order_error(self.system, &self.compatibility, &self.known, self.case, self.nominal, balance)
    }

    /// The farthest error along a direction; `None` where no offsets are compatible.
    pub fn along(&self, direction: &[f64]) -> Option<Farthest> {
        let (m, c) = (self.system.mechanism, &self.compatibility);
        let balance = self.system.balance(c, &self.right, &Ask::Along(direction.to_vec()))?;
        let error = self.error(&balance);
        let own = self.system.displacements(&balance);
        let displacements: Vec<f64> = self.known.iter().zip(own).map(|(known, own)| known + own).collect();
        // The multipliers are the derivatives along the displacements.
        let forces = self.system.least_forces(c, &balance.forces);
        let map = DMatrix::from_row_slice(1, forces.len(), forces.as_slice());
        let (contribution, _) = self.system.parts(&map, &m.centre, &balance);
        let value = direction.iter().zip(&error).map(|(u, e)| u * e).sum();
        Some(Farthest { value, displacements, contribution, error })
    }

    /// An extreme as it is told to first order.
    pub fn height(&self, at: &Farthest) -> Height {
        let m = self.system.mechanism;
        let parameters = (0..m.n_parameters()).map(|p| at.displacements[m.place_of(p)]).collect();
        Height { value: at.value, parameters, error: at.error.clone() }
    }

    /// A direction of some components of one unit (lengths or angles) among all.
    fn whole(&self, range: &Range<usize>, u: Vec3<f64>) -> Vec<f64> {
        let mut direction = vec![0.0; self.system.mechanism.size()];
        direction[range.clone()].iter_mut().zip(u).for_each(|(d, u)| *d = u);
        direction
    }

    /// How far the error reaches along a direction of some components.
    async fn reach(&self, rounds: &Rounds, range: &Range<usize>, direction: Vec3<f64>) -> Option<Reached> {
        let c = &self.compatibility;
        let forces = Ask::Along(self.whole(range, direction)).forces(c, &c.output.parameters);
        let balance = self.system.pushed(rounds, c, &self.right, &forces).await?;
        let mut error = [0.0; 3];
        error.iter_mut().zip(&self.error(&balance)[range.clone()]).for_each(|(a, b)| *a = *b);
        Some(Reached { direction, value: dot(direction, error), error })
    }

    /// Goes from a direction to that of its support point, until nothing is gained.
    async fn climb(&self, rounds: &Rounds, range: &Range<usize>, mut at: Reached) -> Option<Reached> {
        for _ in 0..ALTERNATIONS {
            let size = norm(&at.error);
            if !(size > 0.0) {
                break;
            }
            let next = self.reach(rounds, range, scale(at.error, 1.0 / size)).await?;
            // Where only rounding is gained the direction before is as good.
            if !(next.value > at.value * (1.0 + GAIN)) {
                break;
            }
            at = next;
        }
        Some(at)
    }

    /// The largest size of some components: position or rotation. Of the map of some flanks the largest that closes
    /// these, if one does: it is as large the opposite way, where the others are closed.
    fn largest(&self, measure: Measure, range: Range<usize>, starts: usize, flanks: Option<&[f64]>) -> Option<Extreme> {
        let corners = directions(range.len());
        let reached = Rounds::each_in_chunks(&corners, CHUNK, async |rounds, &u| self.reach(rounds, &range, u).await);
        let reached: Vec<Reached> = reached.into_iter().collect::<Option<_>>()?;
        let value = |k: usize| reached[k].value;
        let n = corners.len();
        let is_maximum = |k: &usize| {
            let lower = |other: usize| value(other) <= value(*k);
            if range.len() == 2 {
                lower((k + n - 1) % n) && lower((k + 1) % n)
            } else {
                mesh().neighbours[*k].iter().all(|&other| lower(other))
            }
        };
        let maxima: Vec<Reached> = (0..n).filter(is_maximum).map(|k| reached[k]).collect();
        let maxima = Rounds::each_in_chunks(&maxima, CHUNK, async |rounds, &at| self.climb(rounds, &range, at).await);
        let mut maxima: Vec<Reached> = maxima.into_iter().collect::<Option<_>>()?;
        maxima.sort_by(|a, b| b.value.total_cmp(&a.value));
        let bound = covered(range.len(), &value);
        let found = maxima.iter().take(starts.max(1)).map(|at| self.along(&self.whole(&range, at.direction)));
        let mut found: Vec<Farthest> = found.collect::<Option<_>>()?;
        found.sort_by(|a, b| b.value.total_cmp(&a.value));
        let closes = |found: &Farthest| {
            let rows = self.system.mechanism.rows.iter().enumerate();
            let mut plays = rows.filter_map(|(k, row)| Some((k, row.play?)));
            flanks.is_none_or(|at| plays.all(|(k, play)| !play.parts(at[k], found.displacements[k])))
        };
        let first = found.iter().position(closes).unwrap_or(0);
        found.get_mut(..=first)?.rotate_right(1);
        let linear = found.first()?.clone();
        let starts = found.into_iter().map(|found| found.displacements).collect();
        Some(Extreme { measure, bound: bound.max(linear.value), linear, starts })
    }

    /// The end of a component, or along a direction: what is linear in the error's components.
    fn end(&self, measure: Measure) -> Option<Extreme> {
        let m = self.system.mechanism;
        let linear = self.along(&m.weights(measure, &vec![0.0; m.size()]))?;
        let starts = vec![linear.displacements.clone()];
        Some(Extreme { measure, bound: linear.value, linear, starts })
    }

    /// Near a first-order optimum, with what has no effect there at an end of its own: what moves the
    /// output by its square only stays in the middle of the optimum, where it has no slope, and no sequence would begin.
    pub fn undecided(&self, measure: Measure, linear: &Farthest) -> Option<Vec<Vec<f64>>> {
        let largest = linear.contribution.iter().fold(0.0, |most: f64, part| most.max(part.abs()));
        let acts = |number: usize| linear.contribution[number].abs() > NOTHING * largest;
        if self.system.elements.iter().filter_map(|element| element.source).all(acts) {
            return Some(Vec::new());
        }
        let direction = Ask::Along(self.system.mechanism.weights(measure, &linear.error));
        let forces = direction.forces(&self.compatibility, &self.compatibility.output.parameters);
        let size = self.each_column().map(|(column, width)| forces[column].abs() * width).fold(0.0, f64::max);
        let part = if size > 0.0 { SLIGHT * size } else { 1.0 };
        self.at_corners(UNDECIDED, &forces, part)
    }

    /// Corners of all sets together, in directions without a pattern, the same every time.
    pub fn corners(&self, count: usize) -> Option<Vec<Vec<f64>>> {
        self.at_corners(count, &DVector::zeros(self.known.len()), 1.0)
    }

    /// The farthest displacements under forces to which others are added, so strong that each moves its set by `part`.
    fn at_corners(&self, count: usize, forces: &DVector<f64>, part: f64) -> Option<Vec<Vec<f64>>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let corner = |_| {
            let mut forces = forces.clone();
            self.each_column().for_each(|(column, width)| forces[column] += part * rng.random_range(-1.0..1.0) / width);
            let balance = self.system.pushed_alone(&self.compatibility, &self.right, &forces)?;
            let own = self.system.displacements(&balance);
            Some(self.known.iter().zip(own).map(|(known, own)| known + own).collect())
        };
        (0..count).map(corner).collect()
    }

    /// Where a basis keeps every component of a source that is not fixed, and how far it goes.
    fn each_column(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let sets = self.system.elements.iter().filter_map(|element| Some((element, element.kind.set()?)));
        let of = |(element, set): (&'_ Element, &'_ Set)| {
            let of = move |(k, &column): (usize, &usize)| (column, set.half_width(k));
            element.columns.iter().enumerate().map(of).collect::<Vec<_>>()
        };
        sets.flat_map(of).filter(|(_, width)| *width > 0.0)
    }

    /// All extremes, in the order of the measures.
    pub fn extremes(&self, measures: &[Measure], starts: usize) -> Option<Vec<Extreme>> {
        // Where nothing is compatible one program tells it as well as all of them.
        self.along(&vec![0.0; self.system.mechanism.size()])?;
        measures.iter().map(|&measure| self.extreme(measure, starts, None)).collect()
    }

    fn extreme(&self, measure: Measure, starts: usize, flanks: Option<&[f64]>) -> Option<Extreme> {
        let (size, translations) = (self.system.mechanism.size(), self.system.mechanism.n_translations());
        match measure {
            Measure::Position => self.largest(measure, 0..translations, starts, flanks),
            Measure::Rotation => self.largest(measure, translations..size, starts, flanks),
            Measure::Component { .. } | Measure::Along(_) => self.end(measure),
        }
    }

    /// An extreme by the linearisation that belongs to the flanks of couplings which it closes itself.
    pub fn at_its_flanks(&self, solver: &Solver<'_>, middle: Extreme, starts: usize) -> Result<Extreme, Status> {
        let m = self.system.mechanism;
        let by_row = m.rows.iter().enumerate();
        let flanks = Flanks {
            nominal: self.nominal,
            plays: by_row.filter_map(|(k, row)| Some((k, row.play?))).collect(),
            stay: |before: &Inputs<f64>, now: &Inputs<f64>| {
                self.system.difference(&before.parameters, &now.parameters) <= m.still()
            },
            extreme: |measure, flanks: &State| {
                let compatibility = self.compatibility.at_flanks(self.system.basis, solver, flanks);
                let compatibility = compatibility.ok_or(Status::Singular)?;
                let right = m.first_order_right(&compatibility, &self.known, self.case, self.nominal);
                let site = Site { compatibility, right, known: self.known.clone(), ..*self };
                let settled = site.extreme(measure, starts, Some(&flanks.inputs.parameters));
                settled.ok_or(Status::NotAssemblable)
            },
        };
        flanks.own(middle)
    }
}

/// Directions all around the plane or space.
pub(super) fn directions(dimensions: usize) -> Vec<Vec3<f64>> {
    if dimensions == 2 { (0..FAN).map(|k| spread(2, k, FAN)).collect() } else { mesh().corners.clone() }
}

/// What the largest reach over all directions does not exceed, when along those it is at most so much.
pub(super) fn covered(dimensions: usize, reach: &dyn Fn(usize) -> f64) -> f64 {
    if dimensions == 2 {
        return (0..FAN).map(reach).fold(0.0, f64::max) / (PI / FAN as f64).cos();
    }
    let bound = |cell: &[usize; 3]| {
        let corners = cell.map(|k| mesh().corners[k]);
        cell.iter().map(|&k| reach(k)).fold(0.0, f64::max) / cosine_of_radius(corners)
    };
    mesh().cells.iter().map(bound).fold(0.0, f64::max)
}
