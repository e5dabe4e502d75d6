//! Extremes of the linearised mechanism, and where to start from on the exact closure.
//!
//! The linearised optimum of every extreme, support points along directions all around, the sources without
//! an effect to first order in corners of their sets, and corners of all sets.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::clearance::offset::{MAX_SIZE, inner};
use crate::closure::sensitivity::Output;
use crate::interrupt;
use crate::math::mesh::spread;
use crate::math::vector::Vec3;
use crate::mechanism::Mechanism;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::first_order::Reach;
use crate::questions::worst::worker::Height;

/// One extreme of the linearised mechanism.
#[derive(Clone)]
pub(crate) struct Linear {
    pub value: f64,
    pub parameters: Vec<f64>,
    pub contribution: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// Sources without an effect to first order.
    undecided: Vec<usize>,
}

/// The linearised mechanism at an extreme.
pub(super) trait AtExtreme {
    fn value(&self) -> f64;
    /// The offsets, in the order of the inputs.
    fn offsets(&self) -> &[f64];
}

impl Linear {
    pub(super) fn height(&self) -> Height {
        Height { value: self.value, parameters: self.parameters.clone(), error: self.error.clone() }
    }
}

impl AtExtreme for Linear {
    fn value(&self) -> f64 {
        self.value
    }

    fn offsets(&self) -> &[f64] {
        &self.parameters
    }
}

/// One extreme: what is climbed, its first order, and where to start.
pub(crate) struct Extreme<L = Linear> {
    pub measure: Measure,
    pub linear: L,
    pub bound: f64,
    pub starts: Vec<Vec<f64>>,
}

/// Linearised optima at most among which one that closes its flanks is looked for, where nothing is climbed.
const MOST_OPTIMA: usize = 24;
/// Fewer gradients tell nothing.
const FEW: usize = 4;
/// Losses whose mean is this many times their standard deviation are losses everywhere: gradients are nearly linear
/// in the offsets, and corners of all sets have been drawn, beyond which they go by a few standard deviations. With
/// wide clearances gradients bend, and five times has left out an exchange that leads higher.
const PLAIN: f64 = 30.0;

/// Whether losses met at some points are to be expected at all.
fn is_plain(losses: &[f64]) -> bool {
    let n = losses.len() as f64;
    let mean = losses.iter().sum::<f64>() / n;
    let square = losses.iter().map(|loss| (loss - mean) * (loss - mean)).sum::<f64>() / n;
    losses.len() >= FEW && mean > PLAIN * square.sqrt()
}

impl Mechanism {
    /// The linearised extreme along a direction of the output's components; `shift` is the error that
    /// drive values other than the nominal ones make.
    fn extent(&self, map: &Output, shift: &[f64], direction: &[f64]) -> Linear {
        interrupt::check();
        let mut parameters = self.centre.clone();
        let mut contribution = vec![0.0; self.sources.len()];
        let mut of_gaps = Vec::new();
        let mut reach = Vec::with_capacity(self.sources.len());
        for (s, source) in self.sources.iter().enumerate() {
            let mut w = [0.0; MAX_SIZE];
            for (w, p) in w.iter_mut().zip(source.range()) {
                *w = direction.iter().enumerate().map(|(i, u)| u * map.parameters[(i, p)]).sum();
            }
            let face = source.set.face(&w[..source.set.size()], 0.0);
            for (k, p) in source.range().enumerate() {
                parameters[p] += face.centre[k];
            }
            if source.gap.is_none() {
                contribution[s] = inner(&w, &parameters[source.range()]);
            }
            for (k, p) in source.range().enumerate().filter(|_| source.gap.is_some()) {
                source.split(s, k, w[k] * parameters[p], |s, part| of_gaps.push((s, part)));
            }
            reach.push(source.set.support(&w));
        }
        for (s, part) in of_gaps {
            contribution[s] += part;
        }
        let value = contribution.iter().sum::<f64>() + inner(shift, direction);
        let largest = reach.iter().copied().fold(0.0, f64::max);
        let acts = |s: &usize| reach[*s] > 1e-9 * largest || self.sources[*s].set.is_zero();
        let undecided = (0..self.sources.len()).filter(|s| !acts(s)).collect();
        let error = map.error(shift, &parameters);
        Linear { value, parameters, contribution, error, undecided }
    }

    /// The largest size of some components: position or rotation. Of the map of some flanks the largest that closes
    /// these, if one does: it is as large the opposite way, where the others are closed.
    pub(crate) fn farthest(
        &self,
        measure: Measure,
        map: &Output,
        shift: &[f64],
        range: std::ops::Range<usize>,
        starts: usize,
        flanks: Option<&[f64]>,
    ) -> Extreme {
        let found = Reach::new(self, map, shift, range.clone()).farthest();
        let along = |u: Vec3<f64>| {
            let mut direction = vec![0.0; self.size()];
            direction[range.clone()].iter_mut().zip(u).for_each(|(d, u)| *d = u);
            self.extent(map, shift, &direction)
        };
        let most = if starts == 0 { MOST_OPTIMA } else { starts };
        let mut optima: Vec<Linear> = found.directions.iter().take(most).map(|&u| along(u)).collect();
        let closes = |linear: &Linear| {
            let plays = self.rows.iter().filter_map(|row| row.parameter.zip(row.play));
            flanks.is_none_or(|at| plays.into_iter().all(|(p, play)| !play.parts(at[p], linear.parameters[p])))
        };
        let first = optima.iter().position(closes).unwrap_or(0);
        optima[..=first].rotate_right(1);
        for k in 0..starts.saturating_sub(optima.len()) {
            optima.push(along(spread(range.len(), k, starts)));
        }
        let starts = self.starts(&optima, starts / 2);
        Extreme { measure, linear: optima.swap_remove(0), bound: found.bound, starts }
    }

    /// The end of a component, or along a direction: what is linear in the error's components.
    pub(crate) fn end(&self, measure: Measure, map: &Output, shift: &[f64], starts: usize) -> Extreme {
        let linear = [self.extent(map, shift, &self.weights(measure, &vec![0.0; self.size()]))];
        let starts = self.starts(&linear, starts / 4);
        let [linear] = linear;
        Extreme { measure, bound: linear.value, linear, starts }
    }

    /// Moves the given sources of a start to corners of their sets, drawn at random.
    fn to_corners(&self, parameters: &mut [f64], sources: &[usize], rng: &mut Xoshiro256PlusPlus) {
        interrupt::check();
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

    /// An offset vector with every source in turn elsewhere on the boundary of its set: at the other corners of a
    /// polygon, at the other end of an interval, else opposite. Not where `slopes`, gradients at many points of all
    /// sets, plainly decide against it.
    pub(crate) fn exchanged(&self, parameters: &[f64], slopes: &[&[f64]]) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        for source in self.sources.iter().filter(|source| !source.set.is_zero()) {
            let centre = &self.centre[source.range()];
            let offset: Vec<f64> = parameters[source.range()].iter().zip(centre).map(|(p, c)| p - c).collect();
            for to in source.set.elsewhere(&offset) {
                interrupt::check();
                let way: Vec<f64> = offset.iter().zip(to).map(|(from, to)| from - to).collect();
                let losses: Vec<f64> = slopes.iter().map(|slope| inner(&slope[source.range()], &way)).collect();
                if is_plain(&losses) {
                    continue;
                }
                let mut exchanged = parameters.to_vec();
                source.range().enumerate().for_each(|(k, p)| exchanged[p] = self.centre[p] + to[k]);
                all.push(exchanged);
            }
        }
        all
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
