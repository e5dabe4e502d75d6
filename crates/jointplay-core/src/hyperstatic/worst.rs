//! The worst that the error of an over-constrained mechanism can ever be, without straining it.
//!
//! Offsets of all sources count that are compatible with each other. To first order the reach along a
//! direction is the value of a cone program, and the largest error the largest reach over all directions
//! ([`crate::reach`] tells how much a mesh of them can miss). On the exact closure every extreme is a sequence
//! of such programs, along the gradient of what is measured, from the first-order optima.

use std::f64::consts::PI;

use nalgebra::DVector;

use super::compatibility::{Compatibility, FITS};
use super::system::{Ask, Give, System};
use crate::ascent::Measure;
use crate::batch::Height;
use crate::closure::Inputs;
use crate::cone::Kind;
use crate::extremes::{Told, Worst};
use crate::loaded::Case;
use crate::mechanism::{Mechanism, Source};
use crate::mesh::{cosine_of_radius, mesh, spread};
use crate::solver::{Solver, State};
use crate::space::{Component, Vec3, norm};
use crate::status::Status;

/// Directions of the plane: the bound is within a thousandth of the largest reach.
const FAN: usize = 72;
/// Alternations between direction and support point.
const ALTERNATIONS: usize = 40;
/// Of this many starts of `worst` one is made: a sequence of programs sees all offsets at once, where an ascent
/// looks along one slope.
const STARTS_PER_CLIMB: usize = 6;

/// The linearised extreme along a direction of the output's components.
#[derive(Clone, Debug)]
struct Farthest {
    value: f64,
    error: Vec<f64>,
    /// All displacements as the basis keeps them.
    displacements: Vec<f64>,
    /// Share of every source in the value.
    contribution: Vec<f64>,
}

/// An extreme: first order, what that certainly does not exceed, and where to start from.
struct Extreme {
    measure: Measure,
    linear: Farthest,
    bound: f64,
    starts: Vec<Vec<f64>>,
}

/// A configuration with everything known about its linearisation.
struct Site<'a> {
    system: &'a System<'a>,
    compatibility: Compatibility,
    right: DVector<f64>,
    known: Vec<f64>,
    case: &'a Case<'a>,
    nominal: &'a State,
}

impl Site<'_> {
    /// The farthest error along a direction; `None` where no offsets are compatible.
    fn along(&self, direction: &[f64]) -> Option<Farthest> {
        let (m, c) = (self.system.mechanism, &self.compatibility);
        let balance = self.system.balance(c, &self.right, &Ask::Along(direction.to_vec()))?;
        let error = m.first_order_error(self.system, c, &self.known, self.case, self.nominal, &balance);
        let own = self.system.displacements(&balance);
        let displacements: Vec<f64> = self.known.iter().zip(own).map(|(known, own)| known + own).collect();
        let share = |p: usize| -> f64 {
            let place = m.place_of(p);
            let moved: f64 = direction.iter().enumerate().map(|(i, u)| u * c.output.parameters[(i, place)]).sum();
            moved * displacements[place]
        };
        let contribution = m.sources.iter().map(|source| source.range().map(share).sum()).collect();
        let value = direction.iter().zip(&error).map(|(u, e)| u * e).sum();
        Some(Farthest { value, error, displacements, contribution })
    }

    /// The same along a direction of some components of one unit.
    fn reach(&self, range: &std::ops::Range<usize>, u: Vec3<f64>) -> Option<Farthest> {
        let mut direction = vec![0.0; self.system.mechanism.size()];
        direction[range.clone()].iter_mut().zip(u).for_each(|(d, u)| *d = u);
        self.along(&direction)
    }

    /// Goes from a direction to that of its support point, until nothing is gained.
    fn climb(&self, range: &std::ops::Range<usize>, mut at: Farthest) -> Option<Farthest> {
        for _ in 0..ALTERNATIONS {
            let size = norm(&at.error[range.clone()]);
            if size == 0.0 {
                break;
            }
            let mut u = [0.0; 3];
            u.iter_mut().zip(&at.error[range.clone()]).for_each(|(u, e)| *u = e / size);
            let next = self.reach(range, u)?;
            let gain = next.value - at.value;
            at = next;
            if gain.abs() <= 1e-10 * at.value {
                break;
            }
        }
        Some(at)
    }

    /// The largest size of some components: position or rotation.
    fn largest(&self, measure: Measure, range: std::ops::Range<usize>, starts: usize) -> Option<Extreme> {
        let planar = range.len() == 2;
        let corners: Vec<Vec3<f64>> =
            if planar { (0..FAN).map(|k| spread(2, k, FAN)).collect() } else { mesh().corners.clone() };
        let reached: Vec<Farthest> = corners.iter().map(|&u| self.reach(&range, u)).collect::<Option<_>>()?;
        let value = |k: usize| reached[k].value;
        let n = corners.len();
        let is_maximum = |k: &usize| {
            let lower = |other: usize| value(other) <= value(*k);
            if planar {
                lower((k + n - 1) % n) && lower((k + 1) % n)
            } else {
                mesh().neighbours[*k].iter().all(|&other| lower(other))
            }
        };
        let mut maxima: Vec<Farthest> =
            (0..n).filter(is_maximum).map(|k| self.climb(&range, reached[k].clone())).collect::<Option<_>>()?;
        maxima.sort_by(|a, b| b.value.total_cmp(&a.value));
        let bound = if planar {
            (0..n).map(value).fold(0.0, f64::max) / (PI / FAN as f64).cos()
        } else {
            let bound = |cell: &[usize; 3]| {
                cell.iter().map(|&k| value(k)).fold(0.0, f64::max) / cosine_of_radius(cell.map(|k| corners[k]))
            };
            mesh().cells.iter().map(bound).fold(0.0, f64::max)
        };
        let linear = maxima.first()?.clone();
        let starts = maxima.iter().take(starts).map(|found| found.displacements.clone()).collect();
        Some(Extreme { measure, bound: bound.max(linear.value), linear, starts })
    }

    /// One end of a component.
    fn end(&self, index: usize, lowest: bool) -> Option<Extreme> {
        let mut direction = vec![0.0; self.system.mechanism.size()];
        direction[index] = if lowest { -1.0 } else { 1.0 };
        let linear = self.along(&direction)?;
        let starts = vec![linear.displacements.clone(), self.known.clone()];
        Some(Extreme { measure: Measure::Component { index, lowest }, bound: linear.value, linear, starts })
    }

    /// All extremes: position, both ends of every component, in space rotation.
    fn extremes(&self, starts: usize) -> Option<Vec<Extreme>> {
        let m = self.system.mechanism;
        let (size, translations) = (m.size(), m.n_translations());
        let mut extremes = vec![self.largest(Measure::Position, 0..translations, starts)?];
        for index in 0..size {
            for lowest in [true, false] {
                extremes.push(self.end(index, lowest)?);
            }
        }
        if m.turns_freely() {
            extremes.push(self.largest(Measure::Rotation, translations..size, starts)?);
        }
        Some(extremes)
    }

    /// The highest exact pose that the sequences of programs from the starts of an extreme meet. All of them are
    /// admissible, and those that close count.
    fn summit(&self, solver: &Solver<'_>, built: &State, extreme: &Extreme) -> Option<Height> {
        let (m, basis) = (self.system.mechanism, self.system.basis);
        let mut best: Option<Height> = None;
        for start in &extreme.starts {
            let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: start.clone() };
            let start = solver.follow(built, &inputs).unwrap_or_else(|_| built.clone());
            let ask = |state: &State, c: &Compatibility| {
                let error = basis.kept.error(state, self.nominal);
                let [force, moment] = extreme.measure.wrench(m.space, &error);
                let weight = |component: &Component| match component {
                    Component::Along(i) => force[*i],
                    Component::About(i) => moment[*i],
                };
                let weights = m.space.components().iter().map(weight).collect();
                let value = extreme.measure.value(&error, m.n_translations());
                let closed = basis.scaled_misfit(&c.misfit) <= FITS;
                if closed && best.as_ref().is_none_or(|best| value > best.value) {
                    let of = |p: usize| state.inputs.parameters[m.place_of(p)];
                    best = Some(Height { value, error, parameters: (0..m.n_parameters()).map(of).collect() });
                }
                Ask::Along(weights)
            };
            // Where a sequence breaks off, what it met before counts all the same.
            let _ = self.system.settle(solver, start, &self.known, ask);
        }
        best
    }
}

impl Mechanism {
    /// The worst errors of every case of an over-constrained mechanism, as far as its offsets go together without
    /// force; what is elastic counts as rigid. Fewer sequences of programs than `starts` are begun, for
    /// each of them sees all offsets at once.
    #[must_use]
    pub fn worst_together(&self, cases: &[Case<'_>], starts: usize) -> Vec<Worst> {
        let climbs = starts.div_ceil(STARTS_PER_CLIMB).max(1);
        self.each_on_basis(
            cases,
            |system, solver, _, case, nominal| match self.worst_at(system, solver, case, &nominal, climbs) {
                Ok(worst) => worst,
                Err(status) => self.no_worst(status),
            },
            |status| self.no_worst(status),
        )
    }

    fn worst_at(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        climbs: usize,
    ) -> Result<Worst, Status> {
        let gives = self.sources.iter().enumerate().filter(|(_, source)| !source.set.is_zero());
        let give = |(number, source): (usize, &Source)| Give {
            kind: Kind::Fixed(source.set),
            columns: source.range().map(|p| self.place_of(p)).collect(),
            source: Some(number),
        };
        let system = System { gives: gives.map(give).collect(), ..system.clone() };
        let compatibility = Compatibility::at(system.basis, solver, nominal).ok_or(Status::Singular)?;
        let known = self.displacements(&self.centre);
        let right = self.first_order_right(&compatibility, &known, case, nominal);
        let site = Site { system: &system, compatibility, right, known, case, nominal };
        let extremes = site.extremes(climbs).ok_or(Status::NotAssemblable)?;
        let built = Inputs { drives: case.drives.to_vec(), parameters: site.known.clone() };
        let built = solver.follow(nominal, &built)?;
        let mut blocked = false;
        let told: Vec<Told> = extremes
            .into_iter()
            .map(|extreme| {
                let height = site.summit(solver, &built, &extreme).unwrap_or_else(|| {
                    blocked = true;
                    let nan = |n: usize| vec![f64::NAN; n];
                    Height { value: f64::NAN, error: nan(self.size()), parameters: nan(self.n_parameters()) }
                });
                Told {
                    measure: extreme.measure,
                    first_order: extreme.linear.value,
                    bound: extreme.bound,
                    contribution: extreme.linear.contribution,
                    height,
                }
            })
            .collect();
        let status = match self.nominal_status(nominal) {
            Status::Ok if blocked => Status::Singular,
            status => status,
        };
        Ok(self.in_order(told, status))
    }
}
