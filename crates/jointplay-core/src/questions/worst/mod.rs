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
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::on_lanes::{Climb, Site};
use crate::questions::worst::prepared::Prepared;
use crate::questions::worst::search::{Found, Search};
use crate::questions::worst::starts::Extreme;
use crate::questions::worst::worker::Height;

/// Configurations at most that one task climbs.
const RUN: usize = 16;

/// Extremes of one configuration. The order of the extremes: position, rotation, then lowest and
/// highest of every component.
#[derive(Clone, Debug)]
pub struct Worst {
    /// Largest distance of the output point from nominal.
    pub position: f64,
    /// To first order.
    pub position_first_order: f64,
    /// What the first-order figure certainly does not exceed.
    pub position_bound: f64,
    /// Largest rotation from nominal, absolute.
    pub rotation: f64,
    /// To first order.
    pub rotation_first_order: f64,
    /// What the first-order figure certainly does not exceed.
    pub rotation_bound: f64,
    /// Lowest and highest error of every component.
    pub component: Vec<[f64; 2]>,
    /// To first order.
    pub component_first_order: Vec<[f64; 2]>,
    /// Direction of the largest position error.
    pub direction: Vec<f64>,
    /// Axis of the largest rotation; empty in the plane.
    pub rotation_direction: Vec<f64>,
    /// The parameter values that attain each extreme.
    pub offset: Vec<Vec<f64>>,
    /// Share of every source in the first-order figure of each extreme.
    pub contribution: Vec<Vec<f64>>,
    /// Share of every joint's deformation in it.
    pub elastic: Vec<Vec<f64>>,
    /// Starts that the batch engine handed to the plain solver.
    pub fallbacks: u64,
    /// Extremes whose climb was ended by its budget of work before it stood still.
    pub unsettled: u64,
    /// Outcome.
    pub status: Status,
}

/// One extreme as it is told.
pub(crate) struct Told {
    pub measure: Measure,
    pub first_order: f64,
    pub bound: f64,
    pub contribution: Vec<f64>,
    pub elastic: Vec<f64>,
    pub height: Height,
}

impl Mechanism {
    /// Number of extremes that [`Self::worst`] gives.
    #[must_use]
    pub fn n_extremes(&self) -> usize {
        2 + 2 * self.size()
    }

    /// The worst errors of every case, each extreme climbed from `starts` starts.
    #[must_use]
    pub fn worst(&self, cases: &[Case<'_>], starts: usize) -> Vec<Worst> {
        self.worst_by(cases, starts, true)
    }

    /// As [`Self::worst`], every climb by the plain solver: the measure of the batch engine.
    #[must_use]
    pub fn worst_plainly(&self, cases: &[Case<'_>], starts: usize) -> Vec<Worst> {
        self.worst_by(cases, starts, false)
    }

    fn worst_by(&self, cases: &[Case<'_>], starts: usize, lanes: bool) -> Vec<Worst> {
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
        Worst {
            position: f64::NAN,
            position_first_order: f64::NAN,
            position_bound: f64::NAN,
            rotation: f64::NAN,
            rotation_first_order: f64::NAN,
            rotation_bound: f64::NAN,
            component: vec![[f64::NAN; 2]; self.size()],
            component_first_order: vec![[f64::NAN; 2]; self.size()],
            direction: vec![f64::NAN; self.n_translations()],
            rotation_direction: vec![
                f64::NAN;
                if self.turns_freely() { self.size() - self.n_translations() } else { 0 }
            ],
            offset: vec![vec![f64::NAN; self.n_parameters()]; self.n_extremes()],
            contribution: vec![vec![f64::NAN; self.sources.len()]; self.n_extremes()],
            elastic: vec![vec![f64::NAN; self.n_joints()]; self.n_extremes()],
            fallbacks: 0,
            unsettled: 0,
            status,
        }
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

    /// Whether bodies turn about more than one axis. In the plane the largest rotation is one end or the
    /// other of the angle's range.
    pub(crate) fn turns_freely(&self) -> bool {
        self.size() - self.n_translations() > 1
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
        let ends = |of: &dyn Fn(&Told) -> f64| -> Vec<[f64; 2]> {
            (0..size).map(|i| [2 * i + 1, 2 * i + 2].map(|k| sign(k) * of(&extremes[k]))).collect()
        };
        let along = |k: usize, range: std::ops::Range<usize>| -> Vec<f64> {
            let height = &extremes[k].height;
            height.error[range].iter().map(|e| e / height.value).collect()
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
            offset: order().map(|k| extremes[k].height.parameters.clone()).collect(),
            contribution: order().map(|k| extremes[k].contribution.iter().map(|c| sign(k) * c).collect()).collect(),
            elastic: order().map(|k| extremes[k].elastic.iter().map(|c| sign(k) * c).collect()).collect(),
            fallbacks: 0,
            unsettled: 0,
            status,
        }
    }
}
