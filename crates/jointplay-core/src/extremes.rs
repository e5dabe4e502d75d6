//! The worst that the error can ever be.
//!
//! To first order by [`crate::reach`]. On the exact closure each extreme is climbed from many starts
//! ([`crate::starts`]), on lanes ([`crate::batch::Climb`]), and plainly ([`crate::ascent`]) where a lane is in
//! doubt. The highest summit counts.

// Kernels must be inlined into callers compiled for a width of vector registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::ascent::Measure;
use crate::batch::simd::{Kernel, dispatch};
use crate::batch::{Climb, Climbed, Height, Pace, Site, Task};
use crate::closure::Inputs;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::solver::{Budget, Solver, State};
use crate::space::Component;
use crate::starts::Extreme;
use crate::status::Status;

/// Configurations at most that one task climbs.
const RUN: usize = 16;
/// Newton steps at most of one plain climb, the approach of its start included.
const WORK: usize = 6000;
/// Rounds in which sources are exchanged, at most.
const EXCHANGES: usize = 12;
/// Two heights closer than this part of them are the same: the first start counts.
const SAME: f64 = 1e-13;

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
    /// Climbs whose work was spent before they stood still.
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

/// What has been found of one configuration.
struct Found {
    /// The highest point of every extreme, and how it was reached.
    best: Vec<Option<(Height, Pace)>>,
    /// The extremes that the last round has raised.
    raised: Vec<bool>,
    blocked: bool,
    fallbacks: u64,
    unsettled: u64,
}

/// One configuration, ready to be climbed.
struct Prepared<'a> {
    nominal: State,
    /// Known deviations in place, no play taken.
    built: State,
    site: Site<'a>,
    extremes: Vec<Extreme>,
    status: Status,
}

/// The climbs of some configurations.
struct Climbs<'b, 'm> {
    climb: &'b Climb<'m>,
    sites: &'b [Site<'b>],
    tasks: &'b [Task],
}

impl Kernel for Climbs<'_, '_> {
    type Output = Vec<Option<Climbed>>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.climb.solve(self.sites, self.tasks)
    }
}

impl Found {
    fn none(extremes: usize) -> Self {
        Self { best: vec![None; extremes], raised: vec![false; extremes], blocked: false, fallbacks: 0, unsettled: 0 }
    }
}

/// What is tried first: the first-order optimum as it is, and climbs from all starts.
fn first(extreme: &Extreme) -> Vec<(Pace, Vec<f64>)> {
    let optimum = extreme.starts.first().map(|start| (Pace::Stay, start.clone()));
    optimum.into_iter().chain(extreme.starts.iter().map(|start| (Pace::Whole, start.clone()))).collect()
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
        let run = (cases.len() / (4 * rayon::current_num_threads())).clamp(1, RUN);
        let parts = cases.par_chunks(run).flat_map_iter(|part| self.worst_of(&solver, climb.as_ref(), part, starts));
        parts.collect()
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

    /// Number of components of a position.
    #[must_use]
    pub fn n_translations(&self) -> usize {
        self.space.components().iter().filter(|c| matches!(c, Component::Along(_))).count()
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
        let mut extremes = vec![self.farthest(Measure::Position, &map, &shift, 0..translations, starts)];
        for index in 0..size {
            extremes.extend([true, false].map(|lowest| self.end(index, lowest, &map, &shift, starts)));
        }
        if self.turns_freely() {
            extremes.push(self.farthest(Measure::Rotation, &map, &shift, translations..size, starts));
        }
        let status = self.status_of(&linearised, &nominal);
        let reference = self.output(&nominal.coordinates, &nominal.inputs);
        Ok(Prepared { nominal, built, site: Site { case, reference }, extremes, status })
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
        let sites: Vec<Site<'_>> = prepared.iter().flatten().map(|prepared| prepared.site.clone()).collect();
        let mut found: Vec<Found> = prepared.iter().flatten().map(|p| Found::none(p.extremes.len())).collect();
        for round in 0..=EXCHANGES {
            let mut tasks = Vec::new();
            for (site, (prepared, found)) in prepared.iter().flatten().zip(&found).enumerate() {
                for k in 0..prepared.extremes.len() {
                    let measure = prepared.extremes[k].measure;
                    let tried =
                        if round == 0 { first(&prepared.extremes[k]) } else { self.next(prepared, found, k, round) };
                    let task = |(pace, start)| (k, Task { site, measure, pace, start });
                    tasks.extend(tried.into_iter().map(task));
                }
            }
            if tasks.is_empty() {
                break;
            }
            self.climb_all(solver, climb, &prepared, &sites, &tasks, &mut found);
        }
        let mut found = found.into_iter();
        let worst = |prepared: Result<Prepared<'_>, Status>| match prepared {
            Ok(prepared) => {
                let found = found.next().unwrap_or_else(|| Found::none(prepared.extremes.len()));
                self.told(prepared, found)
            }
            Err(status) => self.no_worst(status),
        };
        prepared.into_iter().map(worst).collect()
    }

    /// What is tried next at an extreme that the last round has raised: from its best point every source elsewhere,
    /// and after the first round the best points of the other extremes.
    fn next(&self, prepared: &Prepared<'_>, found: &Found, k: usize, round: usize) -> Vec<(Pace, Vec<f64>)> {
        let Some((best, pace)) = found.best[k].as_ref().filter(|_| found.raised[k]) else { return Vec::new() };
        let mut tried: Vec<_> =
            self.exchanged(&best.parameters).into_iter().map(|start| (Pace::Whole, start)).collect();
        if round == 1 {
            let others = (0..prepared.extremes.len()).filter(|&other| other != k);
            let others = others.filter_map(|other| found.best[other].as_ref());
            tried.extend(others.map(|(height, _)| (Pace::Whole, height.parameters.clone())));
        }
        // Whole steps have led from the first-order optimum to somewhere lower.
        if *pace == Pace::Stay {
            tried.push((Pace::Gentle, best.parameters.clone()));
        }
        tried
    }

    /// Runs all tasks, on lanes and, where these leave them in doubt, plainly; the highest points are kept.
    fn climb_all(
        &self,
        solver: &Solver<'_>,
        climb: Option<&Climb<'_>>,
        prepared: &[Result<Prepared<'_>, Status>],
        sites: &[Site<'_>],
        numbered: &[(usize, Task)],
        found: &mut [Found],
    ) {
        let prepared: Vec<&Prepared<'_>> = prepared.iter().flatten().collect();
        let tasks: Vec<Task> = numbered.iter().map(|(_, task)| task.clone()).collect();
        let climbed = match climb {
            Some(climb) => dispatch(Climbs { climb, sites, tasks: &tasks }),
            None => vec![None; tasks.len()],
        };
        found.iter_mut().for_each(|found| found.raised.fill(false));
        for ((k, task), climbed) in numbered.iter().zip(climbed) {
            let found = &mut found[task.site];
            let climbed = climbed.or_else(|| {
                found.fallbacks += 1;
                self.climb_plainly(solver, prepared[task.site], task, &mut found.blocked)
            });
            let Some(Climbed { height, settled }) = climbed else { continue };
            found.unsettled += u64::from(!settled);
            // Errors are differences of places and angles: twins differ by the rounding of these.
            let rounding = 64.0 * f64::EPSILON * self.measured_in(task.measure);
            if found.best[*k].as_ref().is_none_or(|(b, _)| height.value > b.value + SAME * b.value.abs() + rounding) {
                found.best[*k] = Some((height, task.pace));
                found.raised[*k] = true;
            }
        }
    }

    /// The size of what a measure is a difference of.
    fn measured_in(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Position => self.length,
            Measure::Rotation => 1.0,
            Measure::Component { index, .. } => self.unit(self.space.components()[index]),
        }
    }

    /// One climb by the plain solver; a start that cannot be assembled is approached as far as the branch
    /// goes.
    fn climb_plainly(
        &self,
        solver: &Solver<'_>,
        prepared: &Prepared<'_>,
        task: &Task,
        blocked: &mut bool,
    ) -> Option<Climbed> {
        let Prepared { nominal, built, .. } = prepared;
        let mut budget = Budget::of(WORK);
        let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: task.start.clone() };
        let start = solver.follow_within(built, &inputs, &mut budget).unwrap_or_else(|_| {
            *blocked = true;
            built.clone()
        });
        let Some(summit) = solver.climb(task.measure, nominal, start, &mut budget) else {
            *blocked = true;
            return None;
        };
        *blocked |= summit.blocked;
        let error = self.error(&summit.state, nominal);
        let height = Height { value: summit.value, parameters: summit.state.inputs.parameters, error };
        Some(Climbed { height, settled: summit.settled || summit.blocked })
    }

    /// The result of one configuration.
    fn told(&self, prepared: Prepared<'_>, found: Found) -> Worst {
        let heights = found.best.into_iter().map(|best| best.map_or_else(|| self.no_height(), |(height, _)| height));
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
