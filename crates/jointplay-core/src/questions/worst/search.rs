//! The search for the extremes of some configurations on the exact closure.
//!
//! 1. All starts are climbed roughly. The first-order optimum is evaluated as it is, besides.
//! 2. From the best point of every extreme one source at a time goes elsewhere in its set, unless the gradients met
//!    so far plainly decide against it, and all are climbed again; so are, once, the best points of the other
//!    extremes. Where that raises an extreme it is repeated.
//! 3. The best points are climbed to the last digits. The highest counts, of equal ones the first.
//!
//! Climbs run on lanes ([`super::on_lanes::Climb`]), and plainly ([`super::ascent`]) where a lane is in doubt.
//! Everything ends: there are at most [`EXCHANGES`] rounds, a lane ends after a number of Newton steps of its own, and
//! all plain climbs of an extreme share its [`Work`]. An extreme whose search is ended by that keeps its highest point
//! and is counted.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Budget, Solver};
use crate::interrupt;
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::mechanism::Mechanism;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::on_lanes::{Climb, Site, Task};
use crate::questions::worst::prepared::Prepared;
use crate::questions::worst::starts::Extreme;
use crate::questions::worst::worker::{Climbed, Height, Pace};

/// Newton steps of a plain climb, the approach of its start included: of a rough one, and to the last digits.
const ROUGH_WORK: usize = 1_500;
const WORK: usize = 12_000;
/// Newton steps of all rough plain climbs of an extreme together: so many, and so many more with each of them. Those
/// that have converged take 10 to 100; at a wall every one would take all that it gets.
const ROUGH_POOL: usize = 3_000;
const EACH: usize = 100;
/// The part of what is left that one of them gets at most, so that something is left for the others.
const SHARE: usize = 4;
/// Newton steps of all plain climbs of an extreme to the last digits.
const POOL: usize = 2 * WORK;
/// Rounds in which sources are exchanged, at most.
const EXCHANGES: usize = 12;
/// Rough heights closer than this part of them may be in another order when they are fine.
const NEAR: f64 = 1e-6;
/// Points whose offsets differ by less than this part of their sets are the same.
const ELSEWHERE: f64 = 1e-2;
/// So many of them are climbed to the last digits.
const TOPS: usize = 4;
/// Two heights closer than this part of them are the same: the first start counts.
const SAME: f64 = 1e-13;

/// What has been found of one configuration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    /// The highest point of every extreme.
    pub best: Vec<Option<Height>>,
    /// Whether part of the admissible offsets could not be assembled on this branch.
    pub blocked: bool,
    /// Climbs that lanes handed to the plain solver.
    pub fallbacks: u64,
    /// Extremes whose climb was ended by its budget.
    pub unsettled: u64,
}

/// The best points of one extreme, in the order of their starts.
#[derive(Clone, Debug, Default)]
struct Peak {
    tops: Vec<Climbed>,
    /// Gradients at the starts, and the heights to which they led.
    slopes: Vec<(f64, Vec<f64>)>,
    /// Whether the last round has raised it.
    raised: bool,
}

/// The Newton steps left for the plain climbs of an extreme.
#[derive(Clone, Debug)]
struct Work {
    rough: usize,
    fine: usize,
    /// Whether a climb has been ended that would have had more steps alone.
    short: bool,
}

impl Work {
    const NEW: Self = Self { rough: ROUGH_POOL, fine: POOL, short: false };

    /// What the next climb may take.
    fn next(&mut self, fine: bool) -> usize {
        if fine {
            return self.fine.min(WORK);
        }
        self.rough += EACH;
        (self.rough / SHARE).clamp(EACH.min(self.rough), ROUGH_WORK)
    }

    /// Counts what it has taken of that.
    const fn spend(&mut self, fine: bool, given: usize, budget: &Budget) {
        let taken = given - budget.left();
        if fine {
            self.fine -= taken;
        } else {
            self.rough -= taken;
        }
        self.short |= budget.is_spent() && given < if fine { WORK } else { ROUGH_WORK };
    }
}

/// One climb of an extreme.
struct Try {
    extreme: usize,
    task: Task,
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

impl Peak {
    /// Takes a point that is as high as the best ones and elsewhere; `near` is what does not count as higher.
    fn offer(&mut self, m: &Mechanism, climbed: Climbed, near: f64) {
        let value = climbed.height.value;
        let Some(first) = self.tops.first() else {
            self.raised = true;
            self.tops.push(climbed);
            return;
        };
        if value > first.height.value + near {
            self.raised = true;
            self.tops = vec![climbed];
        } else if value >= first.height.value - near && self.tops.len() < TOPS {
            let at = &climbed.height.parameters;
            if self.tops.iter().all(|top| m.largest_change(&top.height.parameters, at) > ELSEWHERE) {
                self.tops.push(climbed);
            }
        }
    }
}

/// What is tried first: the first-order optimum as it is, and climbs from all starts.
fn first(extreme: &Extreme) -> Vec<(Pace, Vec<f64>)> {
    let optimum = extreme.starts.first().map(|start| (Pace::Stay, start.clone()));
    optimum.into_iter().chain(extreme.starts.iter().map(|start| (Pace::Whole, start.clone()))).collect()
}

/// A search under way.
pub(crate) struct Search<'b, 'm> {
    mechanism: &'m Mechanism,
    solver: &'b Solver<'m>,
    climb: Option<&'b Climb<'m>>,
    prepared: Vec<&'b Prepared<'b>>,
    sites: Vec<Site<'b>>,
    /// By configuration and extreme.
    peaks: Vec<Vec<Peak>>,
    /// The same.
    work: Vec<Vec<Work>>,
    found: Vec<Found>,
}

impl<'b, 'm> Search<'b, 'm> {
    pub fn new(
        mechanism: &'m Mechanism,
        solver: &'b Solver<'m>,
        climb: Option<&'b Climb<'m>>,
        prepared: Vec<&'b Prepared<'b>>,
    ) -> Self {
        let sites = prepared.iter().map(|prepared| prepared.site.clone()).collect();
        let peaks = prepared.iter().map(|prepared| vec![Peak::default(); prepared.extremes.len()]).collect();
        let work = prepared.iter().map(|prepared| vec![Work::NEW; prepared.extremes.len()]).collect();
        let found = vec![Found::default(); prepared.len()];
        Self { mechanism, solver, climb, prepared, sites, peaks, work, found }
    }

    pub fn run(mut self) -> Vec<Found> {
        for round in 0..=EXCHANGES {
            let tries = self.tries(|search, site, k| match round {
                0 => first(&search.prepared[site].extremes[k]),
                _ => search.next(site, k, round == 1),
            });
            if tries.is_empty() {
                break;
            }
            self.peaks.iter_mut().flatten().for_each(|peak| peak.raised = false);
            for (Try { extreme, task }, climbed) in self.climb_all(tries) {
                let Some(climbed) = climbed.filter(|climbed| climbed.height.value.is_finite()) else { continue };
                let near = NEAR * climbed.height.value.abs() + self.rounding(task.measure);
                let peak = &mut self.peaks[task.site][extreme];
                if round == 0 && !climbed.slope.is_empty() {
                    peak.slopes.push((climbed.height.value, climbed.slope.clone()));
                }
                peak.offer(self.mechanism, climbed, near);
            }
        }
        self.finish();
        self.found
    }

    /// The climbs of one round, extreme by extreme.
    fn tries(&self, of: impl Fn(&Self, usize, usize) -> Vec<(Pace, Vec<f64>)>) -> Vec<Try> {
        let mut tries = Vec::new();
        for (site, prepared) in self.prepared.iter().enumerate() {
            for (extreme, Extreme { measure, .. }) in prepared.extremes.iter().enumerate() {
                tries.extend(of(self, site, extreme).into_iter().map(|(pace, start)| {
                    interrupt::check();
                    // What only stays has to be exact: it is compared with what climbs.
                    let task = Task { site, measure: *measure, pace, fine: pace == Pace::Stay, start };
                    Try { extreme, task }
                }));
            }
        }
        tries
    }

    /// What is tried next at an extreme that the last round has raised: from its best point every source elsewhere
    /// and, once, the best points of the other extremes.
    fn next(&self, site: usize, k: usize, once: bool) -> Vec<(Pace, Vec<f64>)> {
        let peaks = &self.peaks[site];
        let Some(best) = peaks[k].tops.first().filter(|_| peaks[k].raised) else { return Vec::new() };
        // Away from zero in another direction gradients are others.
        let least = match self.prepared[site].extremes[k].measure {
            Measure::Component { .. } | Measure::Along(_) => f64::NEG_INFINITY,
            Measure::Position | Measure::Rotation => best.height.value * (1.0 - NEAR),
        };
        let slopes = peaks[k].slopes.iter().filter(|(value, _)| *value >= least);
        let slopes: Vec<&[f64]> = slopes.map(|(_, slope)| slope.as_slice()).collect();
        let exchanged = self.mechanism.exchanged(&best.height.parameters, &slopes);
        let in_doubt = !exchanged.is_empty();
        let mut tried: Vec<_> = exchanged.into_iter().map(|start| (Pace::Whole, start)).collect();
        if once && in_doubt {
            let others = peaks.iter().enumerate().filter(|&(other, _)| other != k);
            let others = others.filter_map(|(_, other)| other.tops.first());
            tried.extend(others.map(|top| (Pace::Whole, top.height.parameters.clone())));
        }
        if best.pace == Pace::Stay {
            // Whole steps have led from the first-order optimum to somewhere lower.
            tried.push((Pace::Gentle, best.height.parameters.clone()));
        }
        tried
    }

    /// Climbs the best points to the last digits.
    fn finish(&mut self) {
        let mut tries = Vec::new();
        for (site, peaks) in self.peaks.iter().enumerate() {
            for (extreme, peak) in peaks.iter().enumerate() {
                let measure = self.prepared[site].extremes[extreme].measure;
                tries.extend(peak.tops.iter().map(|top| {
                    let pace = if top.pace == Pace::Whole { Pace::Whole } else { Pace::Gentle };
                    let start = top.height.parameters.clone();
                    let least = top.height.value;
                    (least, Try { extreme, task: Task { site, measure, pace, fine: true, start } })
                }));
            }
        }
        let (least, tries): (Vec<f64>, Vec<Try>) = tries.into_iter().unzip();
        let mut climbed = self.climb_all(tries);
        // Where whole steps have led elsewhere.
        let near = |search: &Self, task: &Task, least: f64| NEAR * least.abs() + search.rounding(task.measure);
        let has_fallen = |search: &Self, k: usize, (Try { task, .. }, climbed): &(Try, Option<Climbed>)| {
            let reached = climbed.as_ref().is_some_and(|c| c.height.value >= least[k] - near(search, task, least[k]));
            !reached && task.pace == Pace::Whole
        };
        let fallen: Vec<usize> = (0..climbed.len()).filter(|&k| has_fallen(self, k, &climbed[k])).collect();
        let gently = |&k: &usize| {
            let Try { extreme, task } = &climbed[k].0;
            Try { extreme: *extreme, task: Task { pace: Pace::Gentle, ..task.clone() } }
        };
        let again = self.climb_all(fallen.iter().map(gently).collect());
        for (k, again) in fallen.into_iter().zip(again) {
            climbed[k] = again;
        }
        let mut best: Vec<Vec<Option<Climbed>>> = self.peaks.iter().map(|peaks| vec![None; peaks.len()]).collect();
        for (Try { extreme, task }, climbed) in climbed {
            let Some(climbed) = climbed else { continue };
            let slot = &mut best[task.site][extreme];
            let (value, rounding) = (climbed.height.value, self.rounding(task.measure));
            let higher = |b: &Climbed| value > b.height.value + SAME * b.height.value.abs() + rounding;
            if slot.as_ref().is_none_or(higher) {
                *slot = Some(climbed);
            }
        }
        for ((found, best), work) in self.found.iter_mut().zip(best).zip(&self.work) {
            found.blocked |= best.iter().any(Option::is_none);
            let unsettled =
                |(best, work): &(&Option<Climbed>, &Work)| work.short || best.as_ref().is_some_and(|b| !b.settled);
            found.unsettled = best.iter().zip(work).filter(unsettled).count() as u64;
            found.best = best.into_iter().map(|best| best.map(|climbed| climbed.height)).collect();
        }
    }

    /// Runs all climbs, on lanes and, where these leave them in doubt, plainly.
    fn climb_all(&mut self, tries: Vec<Try>) -> Vec<(Try, Option<Climbed>)> {
        let (extremes, tasks): (Vec<usize>, Vec<Task>) =
            tries.into_iter().map(|Try { extreme, task }| (extreme, task)).unzip();
        let climbed = match self.climb {
            Some(climb) => dispatch(Climbs { climb, sites: &self.sites, tasks: &tasks }),
            None => vec![None; tasks.len()],
        };
        let plainly = |(tried, climbed): (Try, Option<Climbed>)| {
            let climbed = climbed.or_else(|| self.climb_plainly(&tried));
            (tried, climbed)
        };
        let tries = extremes.into_iter().zip(tasks).map(|(extreme, task)| Try { extreme, task });
        tries.zip(climbed).map(plainly).collect()
    }

    /// One climb by the plain solver, within what is left of the work of its extreme.
    fn climb_plainly(&mut self, Try { extreme, task }: &Try) -> Option<Climbed> {
        self.found[task.site].fallbacks += 1;
        let given = self.work[task.site][*extreme].next(task.fine);
        let mut budget = Budget::of(given);
        let climbed = self.climb_within(task, &mut budget);
        self.work[task.site][*extreme].spend(task.fine, given, &budget);
        climbed
    }

    /// From where no play is taken if the start cannot be assembled.
    fn climb_within(&mut self, task: &Task, budget: &mut Budget) -> Option<Climbed> {
        let (m, found) = (self.mechanism, &mut self.found[task.site]);
        let Prepared { nominal, built, .. } = self.prepared[task.site];
        let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: task.start.clone() };
        let start = match (self.solver.follow_within(built, &inputs, budget), task.pace) {
            (Ok(start), Pace::Stay) => {
                let error = m.error(&start, nominal);
                let value = task.measure.value(&error, m.n_translations());
                let height = Height { value, parameters: task.start.clone(), error };
                return Some(Climbed { height, settled: true, pace: Pace::Stay, slope: Vec::new() });
            }
            (Err(_), Pace::Stay) => return None,
            (Ok(start), _) => start,
            (Err(_), _) => {
                found.blocked = true;
                built.clone()
            }
        };
        let summit = match task.pace {
            Pace::Gentle => self.solver.climb_gently(task.measure, nominal, start, task.fine, budget),
            _ => self.solver.climb(task.measure, nominal, start, task.fine, budget),
        };
        let Some(summit) = summit else {
            found.blocked = true;
            return None;
        };
        found.blocked |= summit.blocked;
        let error = m.error(&summit.state, nominal);
        let height = Height { value: summit.value, parameters: summit.state.inputs.parameters, error };
        // Beyond a wall nothing is to be climbed.
        Some(Climbed { height, settled: summit.settled || summit.blocked, pace: Pace::Gentle, slope: Vec::new() })
    }

    /// Errors are differences of places and angles: twins differ by the rounding of these.
    fn rounding(&self, measure: Measure) -> f64 {
        let m = self.mechanism;
        let size = match measure {
            Measure::Position | Measure::Along(_) => m.length,
            Measure::Rotation => 1.0,
            Measure::Component { index, .. } => m.unit(m.space.components()[index]),
        };
        64.0 * f64::EPSILON * size
    }
}
