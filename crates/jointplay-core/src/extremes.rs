//! The worst that the error can ever be.
//!
//! To first order the set of errors is the sum of linear images of all admissible sets, so its extent
//! along a direction u is `sum_j h_j(A_j^T u)`; the largest position error is the largest extent over
//! all directions. On the exact closure each extreme is climbed by [`crate::ascent`] from many
//! starts: the linearised optimum, support points along a fan of directions, and random corners.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

use crate::ascent::{Objective, Summit};
use crate::clearance::{MAX_SIZE, inner};
use crate::closure::Inputs;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::sensitivity::Output;
use crate::solver::{Solver, State};
use crate::space::{Component, norm};
use crate::status::Status;

/// Directions of the first-order search, besides those where a support point jumps.
const FAN: u32 = 360;
/// Alternations between direction and support point from each of them.
const ALTERNATIONS: usize = 60;

/// Extremes of one configuration. The order of the extremes: position, rotation, then lowest and
/// highest of every component.
#[derive(Clone, Debug)]
pub struct Worst {
    /// Largest distance of the output point from nominal.
    pub position: f64,
    /// To first order.
    pub position_first_order: f64,
    /// Largest rotation from nominal, absolute.
    pub rotation: f64,
    /// To first order.
    pub rotation_first_order: f64,
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

impl Mechanism {
    /// Number of extremes that [`Self::worst`] gives.
    #[must_use]
    pub fn n_extremes(&self) -> usize {
        2 + 2 * self.size()
    }

    /// The worst errors of every case, each extreme climbed from `starts` starts.
    #[must_use]
    pub fn worst(&self, cases: &[Case<'_>], starts: usize) -> Vec<Worst> {
        self.each(
            cases,
            |solver, _, case, nominal| self.worst_at(solver, case, &nominal, starts),
            || self.no_worst(Status::NotAssembled),
        )
    }

    fn no_worst(&self, status: Status) -> Worst {
        Worst {
            position: f64::NAN,
            position_first_order: f64::NAN,
            rotation: f64::NAN,
            rotation_first_order: f64::NAN,
            component: vec![[f64::NAN; 2]; self.size()],
            component_first_order: vec![[f64::NAN; 2]; self.size()],
            direction: vec![f64::NAN; self.n_translations()],
            offset: vec![vec![f64::NAN; self.n_parameters()]; self.n_extremes()],
            contribution: vec![vec![f64::NAN; self.sources.len()]; self.n_extremes()],
            status,
        }
    }

    /// Number of components of a position.
    #[must_use]
    pub fn n_translations(&self) -> usize {
        self.space.components().iter().filter(|c| matches!(c, Component::Along(_))).count()
    }

    /// `A^T u` restricted to a source's parameters.
    fn pulled(map: &Output, direction: &[f64], range: std::ops::Range<usize>) -> [f64; MAX_SIZE] {
        let mut w = [0.0; MAX_SIZE];
        for (k, p) in range.enumerate() {
            w[k] = direction.iter().enumerate().map(|(i, u)| u * map.parameters[(i, p)]).sum();
        }
        w
    }

    /// The linearised extreme along a direction of the output's components; `shift` is the error that
    /// drive values other than the nominal ones make.
    fn extent(&self, map: &Output, shift: &[f64], direction: &[f64]) -> Linear {
        let mut parameters = self.centre.clone();
        let mut contribution = Vec::with_capacity(self.sources.len());
        let mut reach = Vec::with_capacity(self.sources.len());
        for source in &self.sources {
            let w = Self::pulled(map, direction, source.range());
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

    /// Directions of the plane between which no support point of a polyhedral set jumps.
    fn fan(&self, map: &Output) -> Vec<[f64; 2]> {
        let mut angles: Vec<f64> = (0..FAN).map(|k| TAU * f64::from(k) / f64::from(FAN)).collect();
        for source in &self.sources {
            for form in source.set.break_forms() {
                // form . (A^T u) = g . u vanishes at right angles to g.
                let g: Vec<f64> =
                    (0..2).map(|i| source.range().zip(form).map(|(p, f)| f * map.parameters[(i, p)]).sum()).collect();
                let across = g[0].atan2(-g[1]);
                for k in 0..2 {
                    let angle = across + 0.5 * TAU * f64::from(k);
                    // Either side of the jump.
                    angles.extend([angle - 1e-7, angle + 1e-7]);
                }
            }
        }
        angles.into_iter().map(|a| [a.cos(), a.sin()]).collect()
    }

    /// Local maxima of the linearised mechanism's position error over all directions, largest first.
    fn position_extent(&self, map: &Output, shift: &[f64]) -> Vec<Linear> {
        let size = self.size();
        let mut maxima: Vec<(Vec<f64>, Linear)> = Vec::new();
        for start in self.fan(map) {
            let mut direction = vec![0.0; size];
            direction[..2].copy_from_slice(&start);
            let mut reached = self.extent(map, shift, &direction);
            for _ in 0..ALTERNATIONS {
                let error: Vec<f64> = (0..2)
                    .map(|i| {
                        let offsets = reached.parameters.iter().enumerate();
                        shift[i] + offsets.map(|(p, u)| map.parameters[(i, p)] * u).sum::<f64>()
                    })
                    .collect();
                let distance = norm(&error);
                if distance == 0.0 {
                    break;
                }
                direction[..2].iter_mut().zip(&error).for_each(|(d, e)| *d = e / distance);
                let next = self.extent(map, shift, &direction);
                let gain = next.value - reached.value;
                reached = next;
                if gain.abs() <= 1e-15 * reached.value {
                    break;
                }
            }
            let known = |(other, linear): &(Vec<f64>, Linear)| {
                inner(other, &direction) > 1.0 - 1e-9 && (linear.value - reached.value).abs() <= 1e-9 * reached.value
            };
            if !maxima.iter().any(known) {
                maxima.push((direction, reached));
            }
        }
        maxima.sort_by(|(_, a), (_, b)| b.value.total_cmp(&a.value));
        maxima.into_iter().map(|(_, linear)| linear).collect()
    }

    fn worst_at(&self, solver: &Solver<'_>, case: &Case<'_>, nominal: &State, starts: usize) -> Worst {
        let size = self.size();
        let Some(linearised) = solver.linearise(nominal) else { return self.no_worst(Status::Singular) };
        let map = self.output_sensitivity(&linearised, nominal);
        let built = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_worst(status),
        };
        let shift = self.drive_shift(&map, case, nominal);
        let reference = self.output(&nominal.coordinates, &nominal.inputs);

        let mut optima = self.position_extent(&map, &shift);
        optima.truncate(starts.max(1));
        for k in 0..starts.saturating_sub(optima.len()) {
            let angle = TAU * k as f64 / starts as f64;
            let mut direction = vec![0.0; size];
            (direction[1], direction[0]) = angle.sin_cos();
            optima.push(self.extent(&map, &shift, &direction));
        }
        let position_starts = self.starts(&optima, starts / 2);
        let linear_position = optima.swap_remove(0);

        let mut from = [0.0; 3];
        for (component, value) in self.space.components().iter().zip(&reference) {
            if let Component::Along(i) = component {
                from[*i] = *value;
            }
        }
        let mut blocked = false;
        let mut climb = |objective: &Objective, candidates: Vec<Vec<f64>>| {
            let summit = self.highest(solver, &built, objective, candidates, &mut blocked);
            (summit.value, summit.state.inputs.parameters.clone(), self.error(&summit.state, nominal))
        };
        let (position, position_offset, error) = climb(&Objective::Position { from }, position_starts);
        let direction = error[..self.n_translations()].iter().map(|e| e / position).collect();

        let mut component = Vec::with_capacity(size);
        let mut component_first_order = Vec::with_capacity(size);
        let mut offsets = Vec::with_capacity(2 * size);
        let mut contributions = Vec::with_capacity(2 * size);
        for i in 0..size {
            let mut exact = [0.0; 2];
            let mut first_order = [0.0; 2];
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let mut along = vec![0.0; size];
                along[i] = sign;
                let linear = self.extent(&map, &shift, &along);
                let linear = [linear];
                let candidates = self.starts(&linear, starts / 4);
                let [linear] = linear;
                let (_, offset, error) = climb(&Objective::Component { index: i, sign }, candidates);
                exact[side] = error[i];
                first_order[side] = sign * linear.value;
                offsets.push(offset);
                contributions.push(linear.contribution.iter().map(|c| sign * c).collect::<Vec<f64>>());
            }
            component.push(exact);
            component_first_order.push(first_order);
        }
        // The largest rotation is one end or the other of the angle's range.
        let angle = size - 1;
        let larger = |range: &[f64; 2]| usize::from(range[1].abs() >= range[0].abs());
        let end = larger(&component[angle]);
        let linear_end = larger(&component_first_order[angle]);
        let sign = if linear_end == 1 { 1.0 } else { -1.0 };
        let rotation_contribution = contributions[2 * angle + linear_end].iter().map(|c| sign * c).collect();
        let mut all_offsets = vec![position_offset, offsets[2 * angle + end].clone()];
        all_offsets.append(&mut offsets);
        let mut all_contributions = vec![linear_position.contribution, rotation_contribution];
        all_contributions.append(&mut contributions);
        let status = match self.nominal_status(nominal) {
            Status::Ok if blocked => Status::Singular,
            other => other,
        };
        Worst {
            position,
            position_first_order: linear_position.value,
            rotation: component[angle][end].abs(),
            rotation_first_order: component_first_order[angle][linear_end].abs(),
            component,
            component_first_order,
            direction,
            offset: all_offsets,
            contribution: all_contributions,
            status,
        }
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

    /// The highest summit over all starts; a start that cannot be assembled is approached as far as
    /// the branch goes.
    fn highest(
        &self,
        solver: &Solver<'_>,
        built: &State,
        objective: &Objective,
        candidates: Vec<Vec<f64>>,
        blocked: &mut bool,
    ) -> Summit {
        let mut best: Option<Summit> = None;
        for parameters in candidates {
            let inputs = Inputs { drives: built.inputs.drives.clone(), parameters };
            let start = solver.follow(built, &inputs).unwrap_or_else(|_| {
                *blocked = true;
                built.clone()
            });
            let Some(summit) = solver.climb(objective, start) else {
                *blocked = true;
                continue;
            };
            *blocked |= summit.blocked;
            if best.as_ref().is_none_or(|b| summit.value > b.value) {
                best = Some(summit);
            }
        }
        best.unwrap_or_else(|| {
            *blocked = true;
            Summit::nowhere(built, self)
        })
    }
}
