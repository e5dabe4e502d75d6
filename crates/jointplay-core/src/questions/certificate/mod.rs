//! What the worst errors certainly do not exceed: bounds on the exact closure, rounding included.
//!
//! The closure equations run on intervals ([`chart`]). One box holds the poses for all values that the sets allow
//! ([`enclosure`]), which proves that the mechanism can be assembled everywhere in them and stays on its branch; the
//! derivative of the error over boxes ([`errors`]) bounds the error; and what cannot be a maximum is left out of the sets
//! ([`blocks`]) until the bound is close to the value that is attained ([`search`]).
//!
//! The mechanism is the one that the core has: its sizes, sets and drive values as they are rounded in SI units.

mod atlas;
mod blocks;
mod chart;
mod directions;
mod enclosure;
mod errors;
mod fan;
mod inverse;
mod linear;
mod modes;
mod search;
mod second;
mod slabs;

use std::cell::Cell;

use rayon::prelude::*;

use crate::closure::newton::{Solver, State};
use crate::interrupt;
use crate::math::interval::Interval;
use crate::math::space::Space;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::questions::certificate::atlas::Atlas;
use crate::questions::certificate::directions::Direction;
use crate::questions::certificate::errors::{Errors, Refused};
use crate::questions::certificate::fan::fan;
use crate::questions::certificate::search::{Search, Sought};
use crate::questions::columns::Certificate;
use crate::questions::form::Form;

/// A bound this close to the value that is attained, as a part of the largest error of its kind, is not made better, in the
/// plane and in space; nor one this close to it as a part of the characteristic length, or in radians.
const CLOSE: [f64; 2] = [1e-5, GOOD];
const ROUNDING: f64 = 1e-13;

/// Into how many slabs the sets are divided along what moves most, one after the other, until every bound is this close.
const DIVISIONS: [u32; 4] = [1, 5, 9, 15];
const GOOD: f64 = 0.01;

/// The bound of a size that is above this after a quarter of its parts is left as it is.
const POOR: f64 = 0.1;

/// Parts for a single direction of a size, over one box and over cells of the sets.
const ALONE: [u64; 2] = [4, 20];

/// Drive values closer than this are the same: those of a nominal pose are read off it.
const SAME_DRIVE: f64 = 1e-12;

/// What has been attained in a configuration, as `worst` has it.
#[derive(Clone, Copy, Debug)]
pub struct Attained<'a> {
    /// The largest displacement.
    pub position: f64,
    /// The largest rotation.
    pub rotation: f64,
    /// Lowest and highest error of every component.
    pub component: &'a [f64],
}

/// A bound to be found.
struct Bound {
    sought: Sought,
    /// Of the lower end of a component it is the negative that is bounded.
    sign: f64,
    attained: f64,
    /// The largest error of its kind, and what such errors are measured in.
    of_its_kind: f64,
    unit: f64,
    /// How close is close enough.
    close: f64,
    value: f64,
    /// Parts that may still be looked at.
    left: u64,
}

impl Bound {
    fn of(
        sought: Sought,
        (sign, attained): (f64, f64),
        (of_its_kind, unit): (f64, f64),
        (close, left): (f64, u64),
    ) -> Self {
        Self { sought, sign, attained, of_its_kind, unit, close, value: f64::INFINITY, left }
    }

    /// What is this close to what is attained, as a part of the largest error of its kind.
    fn beside(&self, part: f64) -> f64 {
        self.attained + part * self.of_its_kind + ROUNDING * self.unit
    }

    fn is_within(&self, part: f64) -> bool {
        self.value <= self.beside(part)
    }

    /// Lowers it by expansions over all of the sets; how many parts were looked at.
    fn lower(&mut self, errors: &Errors<'_>, atlas: &Atlas) -> u64 {
        let (sought, enough, budget) = (&self.sought, self.beside(self.close), self.left);
        let is_size = sought.components.len() > 1;
        let (poor, least) = if is_size {
            (self.beside(POOR), 0.5 * (self.attained + enough))
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        };
        let found = Search { errors, atlas, sought, enough, poor, least, budget }.run();
        self.value = self.value.min(found.bound);
        self.left = budget.saturating_sub(found.parts);
        if is_size && !self.is_within(GOOD) && atlas.cells.len() == 1 {
            self.fan_out(errors, atlas, (enough, least));
        }
        budget - self.left
    }

    /// Lowers the bound of a size by so many more parts of many cells, along single directions only: cells of the sets and
    /// cells of directions together are more than a search can go through.
    fn lower_by_cells(&mut self, errors: &Errors<'_>, atlas: &Atlas, parts: u64) -> u64 {
        self.left = parts;
        let enough = self.beside(self.close);
        self.fan_out(errors, atlas, (enough, 0.5 * (self.attained + enough)));
        parts - self.left
    }

    /// Lowers the bound of a size by single directions, which a few parts bound where a cell of them needs many.
    fn fan_out(&mut self, errors: &Errors<'_>, atlas: &Atlas, (enough, least): (f64, f64)) {
        let (left, components) = (Cell::new(self.left), &self.sought.components);
        let alone = ALONE[usize::from(atlas.cells.len() > 1)];
        let along = |direction: &[f64]| {
            let sought = &Sought::along(components.clone(), Direction::of(direction));
            let budget = left.get().min(alone);
            let (enough, poor, none) = (0.5 * (self.attained + enough), f64::INFINITY, f64::NEG_INFINITY);
            let found = Search { errors, atlas, sought, enough, poor, least: none, budget }.run();
            left.set(left.get().saturating_sub(found.parts));
            found.bound
        };
        let longer = |mut cell: Direction| cell.leave(&self.sought.within, least).then_some(cell);
        let cells: Vec<Direction> = self.sought.directions.iter().cloned().filter_map(longer).collect();
        let bound = if cells.is_empty() { least } else { fan(&cells, enough, along).max(least) };
        self.value = self.value.min(bound);
        self.left = left.get();
    }
}

impl Mechanism {
    /// Upper bounds of the worst errors of every case, from what is attained in it; each bound from so many parts of the
    /// sets at most. What it is does not depend on threads or time.
    #[must_use]
    pub fn certificate(&self, cases: &[Case<'_>], attained: &[Attained<'_>], parts: u64) -> Answer {
        let m = self.with_largest_gaps();
        let wanted = Wanted::all(self);
        let refused = |reason| Certificate { reason, ..Certificate::unknown(&wanted) };
        let all = |reason: Refused| cases.iter().map(|_| refused(reason.code())).collect();
        let rows: Vec<Certificate> = if m.form(true) == Form::OverConstrained {
            all(Refused::NotDeterminate)
        } else if let Some(solver) = m.solver(cases) {
            let row = |(case, attained): (&Case<'_>, &Attained<'_>)| {
                interrupt::until_stopped(|| {
                    let found = m.certified(&solver, case, attained, parts);
                    [found.unwrap_or_else(|reason| refused(reason.code()))]
                })
            };
            interrupt::before_the_stop(cases.par_iter().zip(attained).map(row).collect())
        } else {
            all(Refused::NotAssembled)
        };
        Answer::of_rows(rows.iter(), &wanted)
    }

    fn certified(
        &self,
        solver: &Solver<'_>,
        case: &Case<'_>,
        attained: &Attained<'_>,
        parts: u64,
    ) -> Result<Certificate, Refused> {
        let nominal = self.restore(solver, case.coordinates, case.drives).ok_or(Refused::NotAssembled)?;
        let middle =
            solver.follow(&nominal, &self.in_the_middle(case.drives, |_| true)).map_err(|_| Refused::NotAssembled)?;
        let mut errors = Errors::new(solver.mechanism, &nominal_of(case, nominal), &middle)?;
        let mut bounds = self.bounds_of(attained, parts);
        let (mut reason, mut assembled, mut looked_at) = (Refused::NotEnclosed, false, 0);
        for divisions in DIVISIONS {
            let atlas = match Atlas::new(&mut errors, divisions, parts) {
                Ok(Some(atlas)) => atlas,
                Ok(None) => break,
                Err(refused) => {
                    reason = refused;
                    continue;
                }
            };
            if divisions > 1 {
                looked_at += atlas.cells.len() as u64;
            }
            for k in 0..bounds.len() {
                if !bounds[k].is_within(GOOD) {
                    let end = |c: usize| Interval::new(-bounds[2 * c].value, bounds[2 * c + 1].value);
                    bounds[k].sought.within = bounds[k].sought.components.clone().map(end).collect();
                    let (is_size, in_space) = (k >= 2 * self.size(), self.space == Space::Spatial);
                    let in_cells = in_space && divisions > 1 && assembled;
                    // In one box a size is not close where a component is not.
                    let is_poor = |c: usize| !bounds[2 * c].is_within(POOR) || !bounds[2 * c + 1].is_within(POOR);
                    if is_size && in_space && divisions == 1 && bounds[k].sought.components.clone().any(is_poor) {
                        continue;
                    }
                    if in_cells {
                        bounds[k].left = parts;
                    }
                    looked_at += if is_size && in_cells {
                        bounds[k].lower_by_cells(&errors, &atlas, parts)
                    } else {
                        bounds[k].lower(&errors, &atlas)
                    };
                }
            }
            assembled = true;
            if bounds.iter().all(|bound| bound.is_within(GOOD)) {
                break;
            }
        }
        if !assembled {
            return Err(reason);
        }
        let bounded = bounds.iter().all(|bound| bound.value.is_finite());
        let reason = if bounded { 0 } else { Refused::NotBounded.code() };
        let mut values = bounds.into_iter().map(|bound| bound.sign * bound.value);
        let component: Vec<f64> = values.by_ref().take(2 * self.size()).collect();
        let [places, turns] =
            [&component[..2 * self.n_translations()], &component[2 * self.n_translations()..]].map(size_of);
        let position = values.next().map_or(places, |found| found.min(places));
        let rotation = values.next().map_or(turns, |found| found.min(turns));
        Ok(Certificate { position, rotation, component, assembled, parts: looked_at, reason })
    }

    /// The bounds to be found: both ends of every component, the displacement, and the rotation where it has more than one
    /// component.
    fn bounds_of(&self, attained: &Attained<'_>, parts: u64) -> Vec<Bound> {
        let (size, translations) = (self.size(), self.n_translations());
        let (place, turn) = ((attained.position, self.length), (attained.rotation, 1.0));
        let effort = (CLOSE[usize::from(self.space == Space::Spatial)], parts);
        let end = |k: usize| {
            let (sign, kind) =
                (if k.is_multiple_of(2) { -1.0 } else { 1.0 }, if k / 2 < translations { place } else { turn });
            Bound::of(Sought::end(k / 2, sign), (sign, sign * attained.component[k]), kind, effort)
        };
        let mut bounds: Vec<Bound> = (0..2 * size).map(end).collect();
        bounds.push(Bound::of(Sought::size(0..translations), (1.0, attained.position), place, effort));
        if self.turns_freely() {
            bounds.push(Bound::of(Sought::size(translations..size), (1.0, attained.rotation), turn, effort));
        }
        bounds
    }
}

/// The largest size of a vector with these ends of its components.
fn size_of(ends: &[f64]) -> f64 {
    let square = |ends: &[f64]| Interval::new(ends[0], ends[1]).square();
    if let [low, high] = ends {
        return high.max(-low);
    }
    ends.chunks_exact(2).fold(Interval::ZERO, |sum, ends| sum + square(ends)).root().high
}

/// The nominal state of a case: at its own drive values, where those read off the pose are the same.
fn nominal_of(case: &Case<'_>, mut nominal: State) -> State {
    let pairs = || nominal.inputs.drives.iter().zip(case.drives);
    if pairs().all(|(read, given)| (read - given).abs() <= SAME_DRIVE * (1.0 + given.abs())) {
        nominal.inputs.drives = case.drives.to_vec();
    }
    nominal
}
