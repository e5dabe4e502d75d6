//! The worst that the error can ever be.
//!
//! To first order by [`first_order`]. On the exact closure each extreme is climbed from many starts
//! ([`starts`]), and from the best point with one source elsewhere ([`search`]). The highest summit
//! counts.

mod ascent;
mod first_order;
mod flanks;
mod on_lanes;
mod over_constrained;
mod prepared;
mod projected;
mod search;
mod starts;
mod worker;

use std::ops::Range;

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::sensitivity::Output;
use crate::interrupt;
use crate::math::space::Component;
use crate::math::vector::Vec3;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::questions::columns::{Region, Worst};
use crate::questions::form::Form;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::flanks::Flanks;
use crate::questions::worst::on_lanes::{Climb, Site};
use crate::questions::worst::prepared::Prepared;
use crate::questions::worst::search::{Found, Search};
use crate::questions::worst::starts::{Extreme, Linear};
use crate::questions::worst::worker::Height;

/// Searches end with rounding of up to a tenth of this part: of many heights the highest would have the most of it.
const ALIKE: f64 = 1e-6;
/// Configurations at most that one task climbs.
const RUN: usize = 16;

/// One extreme as it is reported. Their order in a result: position, rotation, then lowest and highest of every component.
pub(crate) struct Reported {
    pub measure: Measure,
    pub first_order: f64,
    pub bound: f64,
    pub contribution: Vec<f64>,
    pub elastic: Vec<f64>,
    pub height: Height,
}

/// What has been found of one configuration: its extremes in the order of the measures.
pub(crate) struct Summits {
    pub extremes: Vec<Reported>,
    pub fallbacks: u64,
    /// Extremes whose climb was ended by its budget.
    pub unsettled: u64,
    pub status: Status,
}

/// Whether one height is above another by more than rounding.
fn is_higher(height: f64, other: f64) -> bool {
    height - other > ALIKE * height.abs()
}

impl Mechanism {
    /// The worst errors of every case, each extreme climbed from `starts` starts, to first order if there are none; without
    /// `lanes` every climb is by the plain solver, which is the measure of the batch engine.
    #[must_use]
    pub fn worst(&self, cases: &[Case<'_>], starts: usize, lanes: bool) -> Answer {
        let m = self.with_largest_gaps();
        let found = m.summits(cases, &m.measures(), starts, lanes);
        let found: Vec<Worst> = found.into_iter().map(|found| m.in_order(found)).collect();
        Answer::of_rows(found.iter(), &Wanted::all(self))
    }

    /// How far the output's point can be displaced along every one of some unit vectors, and where it is then: the
    /// hull of the region of error. Each extreme is climbed as those of [`Self::worst`].
    #[must_use]
    pub fn region(&self, cases: &[Case<'_>], directions: &[Vec3<f64>], starts: usize) -> Answer {
        let m = self.with_largest_gaps();
        let measures: Vec<Measure> = directions.iter().map(|&direction| Measure::Along(direction)).collect();
        let wanted = Wanted { directions: directions.len(), ..Wanted::all(self) };
        let row = |found: Result<Summits, Status>| match found {
            Ok(found) => {
                let of = |value: &dyn Fn(&Reported) -> f64| found.extremes.iter().map(value).collect();
                Region {
                    extent: of(&|told| told.height.value),
                    extent_first_order: of(&|told| told.first_order),
                    error: found.extremes.iter().flat_map(|told| told.height.error.clone()).collect(),
                    unsettled: found.unsettled,
                    status: found.status,
                }
            }
            Err(status) => Region { status, ..Region::unknown(&wanted) },
        };
        let found: Vec<Region> = m.summits(cases, &measures, starts, true).into_iter().map(row).collect();
        Answer::of_rows(found.iter(), &wanted)
    }

    /// The extremes of some measures for every case. No load acts: of what is determinate nothing is strained.
    fn summits(
        &self,
        cases: &[Case<'_>],
        measures: &[Measure],
        starts: usize,
        lanes: bool,
    ) -> Vec<Result<Summits, Status>> {
        let mut found = match self.form(false) {
            Form::Determinate => self.summits_determinate(cases, measures, starts, lanes),
            Form::OverConstrained => self.summits_over_constrained(cases, measures, starts),
        };
        if starts > 0 {
            for summits in found.iter_mut().flatten() {
                self.share_poses(&mut summits.extremes);
            }
        }
        found
    }

    /// Lets every extreme have the pose of another one where that is farther its way: no size is less than one of its
    /// components, and none is told to be where it goes farther elsewhere.
    fn share_poses(&self, extremes: &mut [Reported]) {
        let heights: Vec<Height> = extremes.iter().map(|told| told.height.clone()).collect();
        for told in extremes {
            for other in &heights {
                let value = told.measure.value(&other.error, self.n_translations());
                if is_higher(value, told.height.value) {
                    told.height = Height { value, ..other.clone() };
                }
            }
        }
    }

    pub(crate) fn summits_determinate(
        &self,
        cases: &[Case<'_>],
        measures: &[Measure],
        starts: usize,
        lanes: bool,
    ) -> Vec<Result<Summits, Status>> {
        let Some(solver) = self.solver(cases) else {
            return cases.iter().map(|_| Err(Status::NotAssembled)).collect();
        };
        let mut suiting = solver.suiting_each(cases);
        suiting.retain(|(_, numbers)| !numbers.is_empty());
        let climbs: Vec<Option<Climb<'_>>> =
            suiting.iter().map(|(solver, _)| if lanes && starts > 0 { Climb::record(solver) } else { None }).collect();
        // Long enough to fill the lanes, short enough to keep all cores busy.
        let run = (cases.len() / (2 * rayon::current_num_threads())).clamp(1, RUN);
        let climbed = |part: Range<usize>| {
            let mut found = Vec::with_capacity(part.len());
            for ((solver, numbers), climb) in suiting.iter().zip(&climbs) {
                let numbers: Vec<usize> = numbers.iter().copied().filter(|number| part.contains(number)).collect();
                let own: Vec<Case<'_>> = numbers.iter().map(|&number| cases[number]).collect();
                found.extend(numbers.into_iter().zip(self.climbed(solver, climb.as_ref(), &own, measures, starts)));
            }
            found.sort_unstable_by_key(|(number, _)| *number);
            found.into_iter().map(|(_, found)| found).collect::<Vec<_>>()
        };
        let parts = (0..cases.len().div_ceil(run)).into_par_iter().map(|k| k * run..cases.len().min((k + 1) * run));
        interrupt::before_the_stop(parts.map(|part| interrupt::until_stopped(|| climbed(part))).collect())
    }

    /// What `worst` asks for: position, both ends of every component and, where bodies turn freely, rotation.
    pub(crate) fn measures(&self) -> Vec<Measure> {
        let ends = (0..self.size()).flat_map(|index| [true, false].map(|lowest| Measure::Component { index, lowest }));
        let rotation = self.turns_freely().then_some(Measure::Rotation);
        std::iter::once(Measure::Position).chain(ends).chain(rotation).collect()
    }

    /// The weights of the output's components in a measure's slope.
    fn weights(&self, measure: Measure, error: &[f64]) -> Vec<f64> {
        let [force, moment] = measure.wrench(self.space, error);
        let weight = |component: &Component| match component {
            Component::Along(i) => force[*i],
            Component::About(i) => moment[*i],
        };
        self.space.components().iter().map(weight).collect()
    }

    /// What is to be climbed at a nominal state.
    fn prepare<'a>(
        &self,
        solver: &Solver<'_>,
        case: Case<'a>,
        nominal: State,
        measures: &[Measure],
        starts: usize,
    ) -> Result<Prepared<'a>, Status> {
        let (size, translations) = (self.size(), self.n_translations());
        let linearised = solver.linearise(&nominal).ok_or(Status::Singular)?;
        let map = self.output_sensitivity(&linearised, &nominal);
        let built = solver.follow(&nominal, &self.built(case.drives))?;
        let shift = self.drive_shift(&map, &case, &nominal);
        let extreme = |measure, map: &Output, flanks: Option<&[f64]>| {
            let farthest = |range| self.farthest(measure, map, &shift, range, starts, flanks);
            match measure {
                Measure::Position => farthest(0..translations),
                Measure::Rotation => farthest(translations..size),
                Measure::Component { .. } | Measure::Along(_) => self.end(measure, map, &shift, starts),
            }
        };
        let at_its_flanks =
            |&measure| self.at_its_flanks(solver, &nominal, &map, |map, flanks| extreme(measure, map, flanks));
        let extremes = measures.iter().map(at_its_flanks).collect::<Result<Vec<Extreme>, Status>>()?;
        let status = self.status_of(&linearised, &nominal);
        let reference = self.output(&nominal.coordinates, &nominal.inputs);
        Ok(Prepared { nominal, built, site: Site { case, reference }, extremes, status })
    }

    /// An extreme of the linearised mechanism by the map that belongs to the flanks which it closes itself; by the
    /// given one where no coupling has play.
    fn at_its_flanks(
        &self,
        solver: &Solver<'_>,
        nominal: &State,
        map: &Output,
        extreme: impl Fn(&Output, Option<&[f64]>) -> Extreme,
    ) -> Result<Extreme, Status> {
        let flanks = Flanks {
            nominal,
            plays: self.rows.iter().filter_map(|row| row.parameter.zip(row.play)).collect(),
            stay: |before: &Inputs<f64>, now: &Inputs<f64>| before == now,
            extreme: |_, flanks: &State| {
                let linearised = solver.linearise(flanks).ok_or(Status::Singular)?;
                Ok(extreme(&self.output_sensitivity(&linearised, flanks), Some(&flanks.inputs.parameters)))
            },
        };
        flanks.own(extreme(map, None))
    }

    /// The extremes of a few configurations.
    fn climbed<'a>(
        &self,
        solver: &Solver<'_>,
        climb: Option<&Climb<'_>>,
        cases: &[Case<'a>],
        measures: &[Measure],
        starts: usize,
    ) -> Vec<Result<Summits, Status>> {
        let prepare = |&case: &Case<'a>| {
            let nominal = self.restore(solver, case.coordinates, case.drives).ok_or(Status::NotAssembled)?;
            self.prepare(solver, case, nominal, measures, starts)
        };
        let prepared: Vec<Result<Prepared<'_>, Status>> = cases.iter().map(prepare).collect();
        if starts == 0 {
            return prepared.into_iter().map(|prepared| prepared.map(|at| self.told(at, Found::default()))).collect();
        }
        let ready: Vec<&Prepared<'_>> = prepared.iter().flatten().collect();
        let mut found = Search::new(self, solver, climb, ready).run().into_iter();
        let told = |prepared: Result<Prepared<'_>, Status>| {
            prepared.map(|prepared| self.told(prepared, found.next().unwrap_or_default()))
        };
        prepared.into_iter().map(told).collect()
    }

    /// The result of one configuration.
    fn told(&self, prepared: Prepared<'_>, found: Found) -> Summits {
        // Nothing has been climbed to first order.
        let mut heights = found.best.into_iter().map(|best| best.unwrap_or_else(|| self.no_height()));
        let mut height = |linear: &Linear| heights.next().unwrap_or_else(|| linear.height());
        let extremes = prepared.extremes.into_iter().map(|extreme| (height(&extreme.linear), extreme));
        let extremes = extremes.map(|(height, extreme)| Reported {
            measure: extreme.measure,
            first_order: extreme.linear.value,
            bound: extreme.bound,
            contribution: extreme.linear.contribution,
            elastic: vec![0.0; self.n_joints()],
            height,
        });
        let status = match prepared.status {
            Status::Ok if found.blocked => Status::Singular,
            other => other,
        };
        Summits { extremes: extremes.collect(), fallbacks: found.fallbacks, unsettled: found.unsettled, status }
    }

    /// Extremes of [`Self::measures`] in the order of a result, where rotation follows position.
    pub(crate) fn in_order(&self, found: Result<Summits, Status>) -> Worst {
        let Summits { mut extremes, fallbacks, unsettled, status } = match found {
            Ok(found) => found,
            Err(status) => return Worst { status, ..Worst::unknown(&Wanted::all(self)) },
        };
        let (size, translations) = (self.size(), self.n_translations());
        if !self.turns_freely() {
            let larger = |of: &dyn Fn(&Reported) -> f64| {
                let (low, high) = (&extremes[2 * size - 1], &extremes[2 * size]);
                if of(high).abs() >= of(low).abs() { 2 * size } else { 2 * size - 1 }
            };
            let (exact, linear) = (larger(&|one| one.height.value), larger(&|one| one.first_order));
            let (height, linear) = (extremes[exact].height.clone(), &extremes[linear]);
            extremes.push(Reported {
                measure: Measure::Rotation,
                first_order: linear.first_order,
                bound: linear.first_order,
                contribution: linear.contribution.clone(),
                elastic: linear.elastic.clone(),
                height,
            });
        }
        let rotation = extremes.len() - 1;
        let order = || [0, rotation].into_iter().chain(1..=2 * size);
        let sign =
            |k: usize| if matches!(extremes[k].measure, Measure::Component { lowest: true, .. }) { -1.0 } else { 1.0 };
        let ends = |of: &dyn Fn(&Reported) -> f64| -> Vec<f64> {
            (0..size).flat_map(|i| [2 * i + 1, 2 * i + 2].map(|k| sign(k) * of(&extremes[k]))).collect()
        };
        let along = |k: usize, range: std::ops::Range<usize>| -> Vec<f64> {
            let height = &extremes[k].height;
            height.error[range].iter().map(|e| e / height.value).collect()
        };
        let parts = |of: fn(&Reported) -> &Vec<f64>| -> Vec<f64> {
            order().flat_map(|k| of(&extremes[k]).iter().map(move |c| sign(k) * c)).collect()
        };
        Worst {
            position: extremes[0].height.value,
            position_first_order: extremes[0].first_order,
            position_bound: extremes[0].bound,
            rotation: extremes[rotation].height.value,
            rotation_first_order: extremes[rotation].first_order,
            rotation_bound: extremes[rotation].bound,
            component: ends(&|one| one.height.value),
            component_first_order: ends(&|one| one.first_order),
            direction: along(0, 0..translations),
            rotation_direction: if self.turns_freely() { along(rotation, translations..size) } else { Vec::new() },
            offset: order().flat_map(|k| extremes[k].height.parameters.clone()).collect(),
            contribution: parts(|told| &told.contribution),
            contribution_elastic: parts(|told| &told.elastic),
            fallbacks,
            unsettled,
            status,
        }
    }
}
