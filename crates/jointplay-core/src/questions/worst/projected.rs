//! Projected gradient ascent over the admissible offsets, for where whole steps do not settle.
//!
//! In the sets' own coordinates, with the step length of Barzilai and Borwein (IMA J. Numer. Anal. 8, 1988,
//! 141) and a search that lets the value fall for a while (Birgin, Martinez and Raydan, SIAM J. Optim. 10,
//! 2000, 1196). It asks for values and gradients at the offsets that it proposes, and leaves to others how
//! the mechanism is closed there: one at a time by the plain solver, or on lanes.

use std::collections::VecDeque;

use crate::clearance::offset::{MAX_SIZE, inner};
use crate::mechanism::{Mechanism, Source};

/// Steps at most.
const STEPS: usize = 1500;
/// Values that the ascent may fall back to.
const MEMORY: usize = 8;
/// It has converged when no offset wants to change by more than this part of its set; the gradient has gone
/// through more rounding than that of whole steps.
const STILL: f64 = 1e-11;
/// A part of the sets within which it counts as settled.
const SETTLED: f64 = 1e-8;
/// Steps in which a value may not rise by more than its rounding.
const PATIENCE: usize = 60;
/// A rough ascent has converged when no offset wants to change by more than this part of its set: the value is then
/// lower by about the square of it.
pub const ROUGH: f64 = 1e-4;
/// The same for steps in which the value rises by less than this part of it.
const ROUGH_RISE: f64 = 1e-8;
const ROUGH_PATIENCE: usize = 12;
/// The smallest part of a step that is tried.
const SMALLEST_PART: f64 = 1e-8;

/// An ascent under way.
#[derive(Clone, Debug)]
pub struct Projected<'m> {
    mechanism: &'m Mechanism,
    /// Whether it goes on to the last digits.
    fine: bool,
    /// Indices of the sources that give way.
    free: Vec<usize>,
    /// Parameter values accepted last.
    parameters: Vec<f64>,
    /// The free offsets accepted last, in their sets' own coordinates, one after the other.
    unit: Vec<f64>,
    slope: Vec<f64>,
    /// Step length along the slope.
    length: f64,
    step: Vec<f64>,
    part: f64,
    recent: VecDeque<f64>,
    noise: f64,
    steps: usize,
    settled: bool,
    /// The highest value, and the steps since it rose by more than its rounding.
    highest: f64,
    idle: usize,
}

impl<'m> Projected<'m> {
    /// Begins at parameter values with a value, its rounding and its gradient along the parameters.
    #[must_use]
    pub fn new(
        mechanism: &'m Mechanism,
        parameters: Vec<f64>,
        value: f64,
        noise: f64,
        gradient: &[f64],
        fine: bool,
    ) -> Self {
        let free = |s: &usize| !mechanism.sources()[*s].set.is_zero();
        let mut ascent = Self {
            mechanism,
            fine,
            free: (0..mechanism.sources().len()).filter(free).collect(),
            parameters,
            unit: Vec::new(),
            slope: Vec::new(),
            length: 0.0,
            step: Vec::new(),
            part: 1.0,
            recent: VecDeque::from([value]),
            noise,
            steps: 0,
            settled: false,
            highest: value,
            idle: 0,
        };
        ascent.unit = ascent.per_source(|source| {
            let at = |k: usize| ascent.parameters[source.first + k] - mechanism.centre[source.first + k];
            source
                .set
                .to_unit(&std::array::from_fn::<f64, MAX_SIZE, _>(|k| if k < source.set.size() { at(k) } else { 0.0 }))
        });
        ascent.slope = ascent.unit_slope(gradient);
        ascent.length = 1.0 / largest(&ascent.slope);
        ascent
    }

    /// Whether the last accepted offsets are where the ascent has converged.
    #[must_use]
    pub const fn settled(&self) -> bool {
        self.settled
    }

    /// Whether the value has stopped to rise by more than its rounding, wherever the offsets still go.
    #[must_use]
    pub const fn has_stalled(&self) -> bool {
        self.idle >= if self.fine { PATIENCE } else { ROUGH_PATIENCE }
    }

    /// Whether it has taken all its steps.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.steps >= STEPS
    }

    /// Steps accepted.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.steps
    }

    /// The next parameter values to try; none when the ascent is over.
    pub fn propose(&mut self) -> Option<Vec<f64>> {
        let steepest = largest(&self.slope);
        let still = if steepest > 0.0 { largest(&self.moved(1.0 / steepest)) } else { 0.0 };
        self.settled = still <= if self.fine { SETTLED } else { ROUGH };
        if still <= STILL || (self.settled && !self.fine) || self.is_spent() || self.has_stalled() {
            return None;
        }
        self.step = self.moved(self.length);
        self.part = 1.0;
        Some(self.parameters_of(&self.tried()))
    }

    /// Whether the value at the parameter values proposed last is high enough.
    #[must_use]
    pub fn accepts(&self, value: f64) -> bool {
        let lowest = self.recent.iter().copied().fold(f64::INFINITY, f64::min);
        value >= lowest + 1e-4 * self.part * inner(&self.step, &self.slope) - self.noise
    }

    /// Goes to the parameter values proposed last.
    pub fn accept(&mut self, value: f64, noise: f64, gradient: &[f64]) {
        let to = self.tried();
        let next = self.unit_slope(gradient);
        let bend: f64 = (0..to.len()).map(|k| (to[k] - self.unit[k]) * (self.slope[k] - next[k])).sum();
        let squared = self.part * self.part * inner(&self.step, &self.step);
        let steepest = largest(&next).max(f64::MIN_POSITIVE);
        // Where the value bends upwards the longest step is the best.
        let length = if bend > 0.0 { squared / bend } else { 1e6 / steepest };
        self.length = length.clamp(1e-4 / steepest, 1e12 / steepest);
        self.parameters = self.parameters_of(&to);
        (self.unit, self.slope, self.noise) = (to, next, noise);
        self.steps += 1;
        self.idle += 1;
        let rise = if self.fine { noise } else { noise.max(ROUGH_RISE * value.abs()) };
        if value > self.highest + rise {
            (self.highest, self.idle) = (value, 0);
        }
        self.recent.push_back(value);
        if self.recent.len() > MEMORY {
            self.recent.pop_front();
        }
    }

    /// Parameter values nearer to the last accepted ones; none when there is no point in it any more.
    pub fn shorten(&mut self) -> Option<Vec<f64>> {
        self.part *= 0.25;
        (self.part >= SMALLEST_PART).then(|| self.parameters_of(&self.tried()))
    }

    fn tried(&self) -> Vec<f64> {
        self.unit.iter().zip(&self.step).map(|(u, s)| u + self.part * s).collect()
    }

    /// Where a step along the slope leads within the sets.
    fn moved(&self, length: f64) -> Vec<f64> {
        let mut step: Vec<f64> = self.unit.iter().zip(&self.slope).map(|(u, g)| u + length * g).collect();
        let mut at = 0;
        for source in self.sources() {
            source.set.project_unit(&mut step[at..at + source.set.size()]);
            at += source.set.size();
        }
        step.iter_mut().zip(&self.unit).for_each(|(s, u)| *s -= u);
        step
    }

    fn sources(&self) -> impl Iterator<Item = &'m Source> + '_ {
        self.free.iter().map(|&s| &self.mechanism.sources()[s])
    }

    fn per_source(&self, of: impl Fn(&Source) -> [f64; MAX_SIZE]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.parameters.len());
        for source in self.sources() {
            all.extend_from_slice(&of(source)[..source.set.size()]);
        }
        all
    }

    fn unit_slope(&self, gradient: &[f64]) -> Vec<f64> {
        self.per_source(|source| source.set.unit_gradient(&gradient[source.range()]))
    }

    fn parameters_of(&self, unit: &[f64]) -> Vec<f64> {
        let mut parameters = self.parameters.clone();
        let mut at = 0;
        for source in self.sources() {
            let offset = source.set.of_unit(&unit[at..at + source.set.size()]);
            for (k, p) in source.range().enumerate() {
                parameters[p] = self.mechanism.centre[p] + offset[k];
            }
            at += source.set.size();
        }
        parameters
    }
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0_f64, |a, x| a.max(x.abs()))
}
