//! The worst that the error can ever be.
//!
//! To first order by [`first_order`]. On the exact closure each extreme is climbed from many starts
//! ([`starts`]), and from the best point with one source elsewhere ([`search`]). The highest summit
//! counts.

mod ascent;
mod first_order;
mod on_lanes;
mod over_constrained;
mod prepared;
mod projected;
mod search;
mod starts;
mod worker;

use rayon::prelude::*;

use crate::closure::newton::{Solver, State};
use crate::closure::sensitivity::Output;
use crate::contact::flanks::FLANKS;
use crate::interrupt;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::questions::columns::Worst;
use crate::questions::form::Form;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::on_lanes::{Climb, Site};
use crate::questions::worst::prepared::Prepared;
use crate::questions::worst::search::{Found, Search};
use crate::questions::worst::starts::Extreme;
use crate::questions::worst::worker::Height;

/// Configurations at most that one task climbs.
const RUN: usize = 16;

/// One extreme as it is told. Their order in a result: position, rotation, then lowest and highest of every component.
pub(crate) struct Told {
    pub measure: Measure,
    pub first_order: f64,
    pub bound: f64,
    pub contribution: Vec<f64>,
    pub elastic: Vec<f64>,
    pub height: Height,
}

impl Mechanism {
    /// The worst errors of every case, each extreme climbed from `starts` starts; without `lanes` every climb is by the
    /// plain solver, which is the measure of the batch engine.
    #[must_use]
    pub fn worst(&self, cases: &[Case<'_>], starts: usize, lanes: bool) -> Answer {
        let m = self.with_largest_gaps();
        let found = match self.form(true) {
            Form::Determinate => m.worst_determinate(cases, starts, lanes),
            Form::OverConstrained => m.worst_over_constrained(cases, starts),
        };
        Answer::of_rows(found.iter(), &Wanted::all(self))
    }

    pub(crate) fn worst_determinate(&self, cases: &[Case<'_>], starts: usize, lanes: bool) -> Vec<Worst> {
        let Some(solver) = self.solver(cases) else {
            return cases.iter().map(|_| self.no_worst(Status::NotAssembled)).collect();
        };
        let climb = if lanes { Climb::record(&solver) } else { None };
        // Long enough to fill the lanes, short enough to keep all cores busy.
        let run = (cases.len() / (2 * rayon::current_num_threads())).clamp(1, RUN);
        let worst = |part| interrupt::until_stopped(|| self.worst_of(&solver, climb.as_ref(), part, starts));
        interrupt::before_the_stop(cases.par_chunks(run).map(worst).collect())
    }

    pub(crate) fn no_worst(&self, status: Status) -> Worst {
        Worst { status, ..Worst::unknown(&Wanted::all(self)) }
    }

    /// What is to be climbed at a nominal state.
    fn prepare<'a>(
        &self,
        solver: &Solver<'_>,
        case: Case<'a>,
        nominal: State,
        starts: usize,
    ) -> Result<Prepared<'a>, Status> {
        let (size, translations) = (self.size(), self.n_translations());
        let linearised = solver.linearise(&nominal).ok_or(Status::Singular)?;
        let map = self.output_sensitivity(&linearised, &nominal);
        let built = solver.follow(&nominal, &self.built(case.drives))?;
        let shift = self.drive_shift(&map, &case, &nominal);
        let told =
            |extreme: &dyn Fn(&Output, Option<&[f64]>) -> Extreme| self.at_its_flanks(solver, &nominal, &map, extreme);
        let farthest = |measure, range: std::ops::Range<usize>| {
            told(&|map, flanks| self.farthest(measure, map, &shift, range.clone(), starts, flanks))
        };
        let mut extremes = vec![farthest(Measure::Position, 0..translations)?];
        for index in 0..size {
            for lowest in [true, false] {
                extremes.push(told(&|map, _| self.end(index, lowest, map, &shift, starts))?);
            }
        }
        if self.turns_freely() {
            extremes.push(farthest(Measure::Rotation, translations..size)?);
        }
        let status = self.status_of(&linearised, &nominal);
        let reference = self.output(&nominal.coordinates, &nominal.inputs);
        Ok(Prepared { nominal, built, site: Site { case, reference }, extremes, status })
    }

    /// An extreme of the linearised mechanism by the map that belongs to the flanks which it closes itself; by the
    /// given one where no coupling has play. That one is as large the opposite way, where the opposite flanks are
    /// closed: the larger counts.
    fn at_its_flanks(
        &self,
        solver: &Solver<'_>,
        nominal: &State,
        map: &Output,
        extreme: impl Fn(&Output, Option<&[f64]>) -> Extreme,
    ) -> Result<Extreme, Status> {
        let middle = extreme(map, None);
        if self.plays().next().is_none() {
            return Ok(middle);
        }
        let settled = self.settle_flanks(solver, nominal, &middle, false, &extreme)?;
        let opposite = match middle.measure {
            Measure::Component { .. } => None,
            Measure::Position | Measure::Rotation => self.settle_flanks(solver, nominal, &middle, true, &extreme)?,
        };
        let bound =
            [&settled, &opposite].into_iter().flatten().fold(middle.bound, |bound, found| bound.max(found.bound));
        let higher = |a: Extreme, b: Extreme| if b.linear.value > a.linear.value { b } else { a };
        let found = settled.into_iter().chain(opposite).reduce(higher).unwrap_or(middle);
        Ok(Extreme { bound, ..found })
    }

    /// The same, from the flanks that an extreme closes or the opposite ones.
    fn settle_flanks(
        &self,
        solver: &Solver<'_>,
        nominal: &State,
        middle: &Extreme,
        mirrored: bool,
        extreme: &impl Fn(&Output, Option<&[f64]>) -> Extreme,
    ) -> Result<Option<Extreme>, Status> {
        let mut flanks = nominal.clone();
        let mut found: Option<Extreme> = None;
        for _ in 0..FLANKS {
            let before = flanks.inputs.clone();
            let at = &found.as_ref().unwrap_or(middle).linear.parameters;
            for (p, play) in self.rows.iter().filter_map(|row| row.parameter.zip(row.play)) {
                let turned = mirrored && found.is_none();
                flanks.inputs.parameters[p] = if turned { play.mirrored(at[p]) } else { at[p] };
            }
            if before == flanks.inputs {
                break;
            }
            let linearised = solver.linearise(&flanks).ok_or(Status::Singular)?;
            found = Some(extreme(&self.output_sensitivity(&linearised, &flanks), Some(&flanks.inputs.parameters)));
        }
        Ok(found)
    }

    /// The worst errors of a few configurations.
    fn worst_of<'a>(
        &self,
        solver: &Solver<'_>,
        climb: Option<&Climb<'_>>,
        cases: &[Case<'a>],
        starts: usize,
    ) -> Vec<Worst> {
        let prepare = |&case: &Case<'a>| {
            let nominal = self.restore(solver, case.coordinates, case.drives).ok_or(Status::NotAssembled)?;
            self.prepare(solver, case, nominal, starts)
        };
        let prepared: Vec<Result<Prepared<'_>, Status>> = cases.iter().map(prepare).collect();
        let ready: Vec<&Prepared<'_>> = prepared.iter().flatten().collect();
        let mut found = Search::new(self, solver, climb, ready).run().into_iter();
        let worst = |prepared: Result<Prepared<'_>, Status>| match prepared {
            Ok(prepared) => {
                let found = found.next().unwrap_or_default();
                self.told(prepared, found)
            }
            Err(status) => self.no_worst(status),
        };
        prepared.into_iter().map(worst).collect()
    }

    /// The result of one configuration.
    fn told(&self, prepared: Prepared<'_>, found: Found) -> Worst {
        let heights = found.best.into_iter().map(|best| best.unwrap_or_else(|| self.no_height()));
        let extremes = prepared.extremes.into_iter().zip(heights);
        let extremes = extremes.map(|(extreme, height)| Told {
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
        Worst { fallbacks: found.fallbacks, unsettled: found.unsettled, ..self.in_order(extremes.collect(), status) }
    }

    /// Extremes in the order of a result: of position, of both ends of every component and, where bodies turn freely,
    /// of rotation.
    pub(crate) fn in_order(&self, mut extremes: Vec<Told>, status: Status) -> Worst {
        let (size, translations) = (self.size(), self.n_translations());
        if !self.turns_freely() {
            let larger = |of: &dyn Fn(&Told) -> f64| {
                let (low, high) = (&extremes[2 * size - 1], &extremes[2 * size]);
                if of(high).abs() >= of(low).abs() { 2 * size } else { 2 * size - 1 }
            };
            let (exact, linear) = (larger(&|told| told.height.value), larger(&|told| told.first_order));
            let (height, linear) = (extremes[exact].height.clone(), &extremes[linear]);
            extremes.push(Told {
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
        let ends = |of: &dyn Fn(&Told) -> f64| -> Vec<f64> {
            (0..size).flat_map(|i| [2 * i + 1, 2 * i + 2].map(|k| sign(k) * of(&extremes[k]))).collect()
        };
        let along = |k: usize, range: std::ops::Range<usize>| -> Vec<f64> {
            let height = &extremes[k].height;
            height.error[range].iter().map(|e| e / height.value).collect()
        };
        let parts = |of: fn(&Told) -> &Vec<f64>| -> Vec<f64> {
            order().flat_map(|k| of(&extremes[k]).iter().map(move |c| sign(k) * c)).collect()
        };
        Worst {
            position: extremes[0].height.value,
            position_first_order: extremes[0].first_order,
            position_bound: extremes[0].bound,
            rotation: extremes[rotation].height.value,
            rotation_first_order: extremes[rotation].first_order,
            rotation_bound: extremes[rotation].bound,
            component: ends(&|told| told.height.value),
            component_first_order: ends(&|told| told.first_order),
            direction: along(0, 0..translations),
            rotation_direction: if self.turns_freely() { along(rotation, translations..size) } else { Vec::new() },
            offset: order().flat_map(|k| extremes[k].height.parameters.clone()).collect(),
            contribution: parts(|told| &told.contribution),
            contribution_elastic: parts(|told| &told.elastic),
            fallbacks: 0,
            unsettled: 0,
            status,
        }
    }
}
