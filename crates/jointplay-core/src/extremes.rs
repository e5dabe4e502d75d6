//! The worst that the error can ever be.
//!
//! To first order by [`crate::reach`]. On the exact closure each extreme is climbed from many starts: the
//! linearised optimum, support points along a fan of directions, and random corners; on lanes where whole
//! steps settle ([`crate::batch::Climb`]), plainly ([`crate::ascent`]) where they do not.

// Kernels must be inlined into callers compiled for a width of vector registers.
#![allow(clippy::inline_always)]

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::ascent::{Measure, Objective};
use crate::batch::lanes::LANES;
use crate::batch::simd::{Kernel, dispatch};
use crate::batch::{Climb, Height, Task};
use crate::clearance::{MAX_SIZE, inner};
use crate::closure::Inputs;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::reach::{Reach, spread};
use crate::sensitivity::Output;
use crate::solver::{Solver, State};
use crate::space::{Component, Vec3};
use crate::status::Status;

/// Cases that are solved before the programs are recorded.
const HANDFUL: usize = 4;
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
    /// The parameter values that attain each extreme.
    pub offset: Vec<Vec<f64>>,
    /// Share of every source in the first-order figure of each extreme.
    pub contribution: Vec<Vec<f64>>,
    /// Starts that the batch engine handed to the plain solver.
    pub fallbacks: u64,
    /// Outcome.
    pub status: Status,
}

/// One extreme of the linearised mechanism.
struct Linear {
    value: f64,
    parameters: Vec<f64>,
    contribution: Vec<f64>,
    /// Sources without an effect to first order.
    undecided: Vec<usize>,
}

/// One extreme: what is climbed, its first order, and where to start.
struct Extreme {
    measure: Measure,
    linear: Linear,
    bound: f64,
    starts: Vec<Vec<f64>>,
}

/// The highest summits of all extremes.
struct Summits {
    heights: Vec<Height>,
    blocked: bool,
    fallbacks: u64,
}

/// Blocks of starts at one nominal pose.
struct Blocks<'b, 'm> {
    climb: &'b Climb<'m>,
    case: &'b Case<'b>,
    reference: &'b [f64],
    tasks: &'b [Task],
}

impl Kernel for Blocks<'_, '_> {
    type Output = Vec<Option<Height>>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut workspace = self.climb.workspace();
        let mut heights = Vec::with_capacity(self.tasks.len());
        for block in self.tasks.chunks(LANES) {
            heights.extend(self.climb.solve(&mut workspace, self.case, self.reference, block));
        }
        heights
    }
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
        let climb = if cases.len() >= HANDFUL { self.solver(cases).and_then(|s| Climb::record(&s)) } else { None };
        self.each(
            cases,
            |solver, _, case, nominal| self.worst_at(solver, climb.as_ref(), case, &nominal, starts),
            || self.no_worst(Status::NotAssembled),
        )
    }

    fn no_worst(&self, status: Status) -> Worst {
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
            offset: vec![vec![f64::NAN; self.n_parameters()]; self.n_extremes()],
            contribution: vec![vec![f64::NAN; self.sources.len()]; self.n_extremes()],
            fallbacks: 0,
            status,
        }
    }

    /// Number of components of a position.
    #[must_use]
    pub fn n_translations(&self) -> usize {
        self.space.components().iter().filter(|c| matches!(c, Component::Along(_))).count()
    }

    /// The linearised extreme along a direction of the output's components; `shift` is the error that
    /// drive values other than the nominal ones make.
    fn extent(&self, map: &Output, shift: &[f64], direction: &[f64]) -> Linear {
        let mut parameters = self.centre.clone();
        let mut contribution = Vec::with_capacity(self.sources.len());
        let mut reach = Vec::with_capacity(self.sources.len());
        for source in &self.sources {
            let mut w = [0.0; MAX_SIZE];
            for (w, p) in w.iter_mut().zip(source.range()) {
                *w = direction.iter().enumerate().map(|(i, u)| u * map.parameters[(i, p)]).sum();
            }
            let face = source.set.face(&w[..source.set.size()], 0.0);
            for (k, p) in source.range().enumerate() {
                parameters[p] += face.centre[k];
            }
            contribution.push(inner(&w, &parameters[source.range()]));
            reach.push(source.set.support(&w));
        }
        let value = contribution.iter().sum::<f64>() + inner(shift, direction);
        let largest = reach.iter().copied().fold(0.0, f64::max);
        let acts = |s: &usize| reach[*s] > 1e-9 * largest || self.sources[*s].set.is_zero();
        let undecided = (0..self.sources.len()).filter(|s| !acts(s)).collect();
        Linear { value, parameters, contribution, undecided }
    }

    /// The largest size of some components: position or rotation.
    fn farthest(
        &self,
        measure: Measure,
        map: &Output,
        shift: &[f64],
        range: std::ops::Range<usize>,
        starts: usize,
    ) -> Extreme {
        let found = Reach::new(self, map, shift, range.clone()).farthest();
        let along = |u: Vec3<f64>| {
            let mut direction = vec![0.0; self.size()];
            direction[range.clone()].iter_mut().zip(u).for_each(|(d, u)| *d = u);
            self.extent(map, shift, &direction)
        };
        let mut optima: Vec<Linear> = found.directions.iter().take(starts.max(1)).map(|&u| along(u)).collect();
        for k in 0..starts.saturating_sub(optima.len()) {
            optima.push(along(spread(range.len(), k, starts)));
        }
        let starts = self.starts(&optima, starts / 2);
        Extreme { measure, linear: optima.swap_remove(0), bound: found.bound, starts }
    }

    /// The lowest or the highest value of a component.
    fn end(&self, index: usize, lowest: bool, map: &Output, shift: &[f64], starts: usize) -> Extreme {
        let mut along = vec![0.0; self.size()];
        along[index] = if lowest { -1.0 } else { 1.0 };
        let linear = [self.extent(map, shift, &along)];
        let starts = self.starts(&linear, starts / 4);
        let [linear] = linear;
        Extreme { measure: Measure::Component { index, lowest }, bound: linear.value, linear, starts }
    }

    fn worst_at(
        &self,
        solver: &Solver<'_>,
        climb: Option<&Climb<'_>>,
        case: &Case<'_>,
        nominal: &State,
        starts: usize,
    ) -> Worst {
        let (size, translations) = (self.size(), self.n_translations());
        let Some(linearised) = solver.linearise(nominal) else { return self.no_worst(Status::Singular) };
        let map = self.output_sensitivity(&linearised, nominal);
        let built = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_worst(status),
        };
        let shift = self.drive_shift(&map, case, nominal);
        let mut extremes = vec![self.farthest(Measure::Position, &map, &shift, 0..translations, starts)];
        for index in 0..size {
            extremes.extend([true, false].map(|lowest| self.end(index, lowest, &map, &shift, starts)));
        }
        // In the plane the largest rotation is one end or the other of the angle's range.
        let in_space = size - translations > 1;
        if in_space {
            extremes.push(self.farthest(Measure::Rotation, &map, &shift, translations..size, starts));
        }
        let reference = self.output(&nominal.coordinates, &nominal.inputs);
        let mut found = self.summits(solver, climb, case, nominal, &built, &reference, &extremes);
        if !in_space {
            let larger = |of: &dyn Fn(usize) -> f64| {
                if of(2 * size).abs() >= of(2 * size - 1).abs() { 2 * size } else { 2 * size - 1 }
            };
            let (exact, linear) = (larger(&|k| found.heights[k].value), larger(&|k| extremes[k].linear.value));
            found.heights.push(found.heights[exact].clone());
            let Linear { value, parameters, contribution, undecided } = &extremes[linear].linear;
            let copy = Linear {
                value: *value,
                parameters: parameters.clone(),
                contribution: contribution.clone(),
                undecided: undecided.clone(),
            };
            extremes.push(Extreme { measure: Measure::Rotation, linear: copy, bound: *value, starts: Vec::new() });
        }
        let rotation = extremes.len() - 1;
        let order = || [0, rotation].into_iter().chain(1..=2 * size);
        let sign =
            |k: usize| if matches!(extremes[k].measure, Measure::Component { lowest: true, .. }) { -1.0 } else { 1.0 };
        let ends = |of: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            (0..size).map(|i| [2 * i + 1, 2 * i + 2].map(|k| sign(k) * of(k))).collect()
        };
        let heights = &found.heights;
        let status = match self.status_of(&linearised, nominal) {
            Status::Ok if found.blocked => Status::Singular,
            other => other,
        };
        Worst {
            position: heights[0].value,
            position_first_order: extremes[0].linear.value,
            position_bound: extremes[0].bound,
            rotation: heights[rotation].value,
            rotation_first_order: extremes[rotation].linear.value,
            rotation_bound: extremes[rotation].bound,
            component: ends(&|k| heights[k].value),
            component_first_order: ends(&|k| extremes[k].linear.value),
            direction: heights[0].error[..translations].iter().map(|e| e / heights[0].value).collect(),
            offset: order().map(|k| heights[k].parameters.clone()).collect(),
            contribution: order()
                .map(|k| extremes[k].linear.contribution.iter().map(|c| sign(k) * c).collect())
                .collect(),
            fallbacks: found.fallbacks,
            status,
        }
    }

    /// The highest summit of every extreme over all its starts.
    #[allow(clippy::too_many_arguments)] // all of them describe one configuration
    fn summits(
        &self,
        solver: &Solver<'_>,
        climb: Option<&Climb<'_>>,
        case: &Case<'_>,
        nominal: &State,
        built: &State,
        reference: &[f64],
        extremes: &[Extreme],
    ) -> Summits {
        let each =
            |e: &Extreme| e.starts.iter().map(|s| Task { measure: e.measure, start: s.clone() }).collect::<Vec<_>>();
        let tasks: Vec<Task> = extremes.iter().flat_map(each).collect();
        let mut heights = match climb {
            Some(climb) => dispatch(Blocks { climb, case, reference, tasks: &tasks }),
            None => vec![None; tasks.len()],
        };
        let mut summits = Summits { heights: Vec::with_capacity(extremes.len()), blocked: false, fallbacks: 0 };
        let mut at = 0;
        for extreme in extremes {
            let mut best: Option<Height> = None;
            for k in at..at + extreme.starts.len() {
                let height = heights[k].take().or_else(|| {
                    summits.fallbacks += 1;
                    self.climb_plainly(solver, nominal, built, &tasks[k], &mut summits.blocked)
                });
                let Some(height) = height else { continue };
                if best.as_ref().is_none_or(|b| height.value > b.value + SAME * b.value.abs()) {
                    best = Some(height);
                }
            }
            at += extreme.starts.len();
            summits.blocked |= best.is_none();
            summits.heights.push(best.unwrap_or_else(|| Height {
                value: f64::NAN,
                parameters: vec![f64::NAN; self.n_parameters()],
                error: vec![f64::NAN; self.size()],
            }));
        }
        summits
    }

    /// One climb by the plain solver; a start that cannot be assembled is approached as far as the branch
    /// goes.
    fn climb_plainly(
        &self,
        solver: &Solver<'_>,
        nominal: &State,
        built: &State,
        task: &Task,
        blocked: &mut bool,
    ) -> Option<Height> {
        let inputs = Inputs { drives: built.inputs.drives.clone(), parameters: task.start.clone() };
        let start = solver.follow(built, &inputs).unwrap_or_else(|_| {
            *blocked = true;
            built.clone()
        });
        let Some(summit) = solver.climb(Objective::Error(task.measure), nominal, start) else {
            *blocked = true;
            return None;
        };
        *blocked |= summit.blocked;
        let error = self.error(&summit.state, nominal);
        Some(Height { value: summit.value, parameters: summit.state.inputs.parameters, error })
    }

    /// Moves the given sources of a start to corners of their sets, drawn at random.
    fn to_corners(&self, parameters: &mut [f64], sources: &[usize], rng: &mut Xoshiro256PlusPlus) {
        for source in sources.iter().map(|&s| &self.sources[s]) {
            let mut w = [0.0; MAX_SIZE];
            // Every component weighs the same at the set's own proportions.
            for k in 0..source.set.size() {
                let half_width = source.set.half_width(k);
                w[k] = if half_width > 0.0 { rng.random_range(-1.0..1.0) / half_width } else { 0.0 };
            }
            let face = source.set.face(&w[..source.set.size()], 0.0);
            for (k, p) in source.range().enumerate() {
                parameters[p] = self.centre[p] + face.centre[k];
            }
        }
    }

    /// Adds starts: linearised optima, those without a first-order effect in corners, and corners of
    /// all sets. The draws are always the same ones.
    fn starts(&self, optima: &[Linear], corners: usize) -> Vec<Vec<f64>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut starts = Vec::with_capacity(optima.len() + corners);
        for optimum in optima {
            starts.push(optimum.parameters.clone());
            for _ in 0..if optimum.undecided.is_empty() { 0 } else { 3 } {
                let mut start = optimum.parameters.clone();
                self.to_corners(&mut start, &optimum.undecided, &mut rng);
                starts.push(start);
            }
        }
        let all: Vec<usize> = (0..self.sources.len()).collect();
        for _ in 0..corners {
            let mut start = self.centre.clone();
            self.to_corners(&mut start, &all, &mut rng);
            starts.push(start);
        }
        starts
    }
}
