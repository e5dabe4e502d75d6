//! Distributions of sums of independent numbers, and of the size of two of them, by their characteristic functions.
//!
//! With the function phi of a sum, about its mean m for one number (Davies, Biometrika 60, 1973, 415):
//!
//! ```text
//! P(L < x)   = 1/2 - sum_k Im[phi(t_k) exp(-i t_k (x - m))] / (pi (k + 1/2)),  t_k = (k + 1/2) h
//! P(|L| < q) = integral over t > 0 of q J1(q t) mean over directions n of phi(t n) dt
//! ```
//!
//! The sum is exact where nothing is further than `2 pi / h` from x, but for the terms left out; the mean over directions turns the
//! integral over a plane into one over its radius.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::clearance::characteristic::Unit;
use crate::clearance::law::Law;
use crate::math::lanes::normal::score;

/// Standard deviations beyond which nothing is.
const FARTHEST: f64 = 9.0;
/// A characteristic function that stays below is taken for zero.
const NOTHING: f64 = 1e-8;
/// So many values in a row below it are enough.
const SILENT: usize = 12;
/// Terms of a sum at most.
const MOST_TERMS: usize = 2048;
/// Of the mean over directions, which is integrated.
const LITTLE: f64 = 3e-6;
/// Panels of the integral at most, for components that vary alike.
const MOST_PANELS: f64 = 64.0;
/// Directions of a half turn, for components that vary alike.
const DIRECTIONS: f64 = 16.0;
/// Steps at most to a threshold, and how near it has to be.
const STEPS: usize = 20;
const NEAR: f64 = 0.01;
/// Gauss and Legendre's rule of eight points: positive nodes on [-1, 1] and weights.
const RULE: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
];

/// A value of a quantity to first order, and the share of all specimens below it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Threshold {
    pub value: f64,
    pub share: f64,
}

/// A sum of independent numbers about their means.
#[derive(Default)]
pub(crate) struct Sum<'l> {
    pub units: Vec<(Unit, Law, f64)>,
    /// Values and weights of others, each with its factor.
    pub numbers: Vec<(f64, &'l [(f64, f64)])>,
    /// Of what is normal.
    pub variance: f64,
    /// How far it goes at most.
    pub reach: f64,
}

impl Sum<'_> {
    /// How many values make one of its characteristic function.
    pub fn len(&self) -> usize {
        1 + self.units.len() + self.numbers.iter().map(|(_, values)| values.len()).sum::<usize>()
    }

    /// Its characteristic function.
    pub fn at(&self, t: f64) -> Complex<f64> {
        let normal = if self.variance > 0.0 { (-0.5 * self.variance * t * t).exp() } else { 1.0 };
        let real: f64 = self.units.iter().map(|(unit, law, s)| unit.at(*law, t * s)).product();
        let mean = |(factor, values): &(f64, &[(f64, f64)])| {
            values.iter().map(|(x, w)| Complex::from_polar(*w, t * factor * x)).sum::<Complex<f64>>()
        };
        self.numbers.iter().map(mean).fold(Complex::from(normal * real), |product, value| product * value)
    }
}

/// The distribution of a number.
pub(crate) struct Line {
    mean: f64,
    std: f64,
    step: f64,
    /// Its characteristic function about the mean at half steps.
    values: Vec<Complex<f64>>,
}

impl Line {
    /// Of a sum with a mean and a standard deviation; it takes from a budget of values of characteristic functions. `None` where it is
    /// spent, or where the function decays too slowly.
    pub fn of(mean: f64, std: f64, sum: &Sum<'_>, budget: &mut usize) -> Option<Self> {
        let step = PI / sum.reach.min(FARTHEST * std);
        let most = MOST_TERMS.min(*budget / sum.len());
        let (mut values, mut silent) = (Vec::new(), 0);
        while silent < SILENT {
            if values.len() >= most {
                return None;
            }
            let value = sum.at((values.len() as f64 + 0.5) * step);
            silent = if value.norm() < NOTHING { silent + 1 } else { 0 };
            values.push(value);
        }
        *budget -= values.len() * sum.len();
        Some(Self { mean, std, step, values })
    }

    /// Share below a value, and density there.
    fn below(&self, x: f64) -> (f64, f64) {
        let (mut share, mut density) = (0.5, 0.0);
        for (k, value) in self.values.iter().enumerate() {
            let half = k as f64 + 0.5;
            let turned = value * Complex::cis(-half * self.step * (x - self.mean));
            share -= turned.im / (PI * half);
            density += self.step * turned.re / PI;
        }
        (share, density)
    }

    pub fn thresholds(&self, probabilities: &[f64]) -> Vec<Threshold> {
        let of = |&p: &f64| Threshold::at(p, self.mean + self.std * score(p), self.std, |x| self.below(x));
        probabilities.iter().map(of).collect()
    }

    /// Of the size.
    pub fn thresholds_of_size(&self, probabilities: &[f64]) -> Vec<Threshold> {
        let between = |x: f64| {
            let ([share, density], [share_below, density_below]) = (self.below(x).into(), self.below(-x).into());
            (share - share_below, density + density_below)
        };
        let size = self.mean.hypot(self.std);
        let of = |&p: &f64| Threshold::at(p, size * score(0.5 * (1.0 + p)), self.std, between);
        probabilities.iter().map(of).collect()
    }
}

/// The distribution of the size of two numbers.
pub(crate) struct Plane {
    /// Root mean square.
    size: f64,
    /// Nodes of the integral, each with its weight times the mean of the characteristic function.
    nodes: Vec<(f64, f64)>,
}

impl Plane {
    /// Of two numbers with standard deviations along principal axes: the mean of every direction, and the numbers whose sum is about it.
    pub fn of<'l>(
        std: [f64; 2],
        budget: &mut usize,
        along: impl Fn(f64, f64) -> Option<(f64, Sum<'l>)>,
    ) -> Option<Self> {
        let ratio = std[0] / std[1];
        let count = (DIRECTIONS * ratio).ceil() as usize;
        let direction = |k: usize| {
            let (sin, cos) = (PI * (k as f64 + 0.5) / count as f64).sin_cos();
            along(cos, sin)
        };
        let directions = (0..count).map(direction).collect::<Option<Vec<_>>>()?;
        let cost = 2 * RULE.len() * directions.iter().map(|(_, sum)| sum.len()).sum::<usize>();
        // The squares of the means along all directions sum up to that of the mean, halved.
        let square = 2.0 * directions.iter().map(|(mean, _)| mean * mean).sum::<f64>() / count as f64;
        let half = 0.5 / std[0];
        let mut nodes = Vec::new();
        for panel in 0..(MOST_PANELS * ratio) as usize {
            *budget = budget.checked_sub(cost)?;
            let middle = (2 * panel + 1) as f64 * half;
            let mut left: f64 = 0.0;
            for [node, weight] in RULE.into_iter().flat_map(|[x, w]| [[x, w], [-x, w]]) {
                let t = half.mul_add(node, middle);
                let of = |(mean, sum): &(f64, Sum<'_>)| (sum.at(t) * Complex::cis(t * mean)).re;
                let value = directions.iter().map(of).sum::<f64>() / count as f64;
                left = left.max(value.abs());
                nodes.push((t, half * weight * value));
            }
            if left < LITTLE {
                return Some(Self { size: square.sqrt().hypot(std[0]).hypot(std[1]), nodes });
            }
        }
        None
    }

    /// Share below a value, and density there.
    fn below(&self, q: f64) -> (f64, f64) {
        let share = |(t, weight): &(f64, f64)| weight * q * libm::j1(q * t);
        let density = |(t, weight): &(f64, f64)| weight * q * t * libm::j0(q * t);
        (self.nodes.iter().map(share).sum(), self.nodes.iter().map(density).sum())
    }

    pub fn thresholds(&self, probabilities: &[f64]) -> Vec<Threshold> {
        let of = |&p: &f64| Threshold::at(p, self.size * (-(1.0 - p).ln()).sqrt(), self.size, |q| self.below(q));
        probabilities.iter().map(of).collect()
    }
}

impl Threshold {
    /// No specimen is below: nothing is known, and nothing is added.
    const NONE: Self = Self { value: f64::NEG_INFINITY, share: 0.0 };

    /// Near a probability, from a first guess on in steps not longer than `step`: any threshold will do if its share is known.
    fn at(probability: f64, mut value: f64, step: f64, below: impl Fn(f64) -> (f64, f64)) -> Self {
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        for _ in 0..STEPS {
            let (share, density) = below(value);
            let lacks = probability - share;
            if lacks.abs() < NEAR * probability.min(1.0 - probability) {
                return Self { value, share };
            }
            if lacks > 0.0 {
                low = value;
            } else {
                high = value;
            }
            let next = value + (lacks / density).clamp(-step, step);
            let is_between = next > low && next < high;
            value = if is_between { next } else { 0.5 * (low.max(value - step) + high.min(value + step)) };
        }
        Self::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::quantile::below;

    /// Means by Simpson's rule.
    fn simpson(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        const STEPS: i32 = 2000;
        let at = |k: i32| from + (to - from) * f64::from(k) / f64::from(STEPS);
        let weight = |k: i32| if k == 0 || k == STEPS { 1.0 } else { f64::from([2, 4][k as usize % 2]) };
        (0..=STEPS).map(|k| weight(k) * f(at(k))).sum::<f64>() * (to - from) / (3.0 * f64::from(STEPS))
    }

    /// Density of a uniform number from -a to a and a normal one.
    fn density(x: f64, a: f64, sigma: f64) -> f64 {
        (below((x + a) / sigma) - below((x - a) / sigma)) / (2.0 * a)
    }

    fn share_between(low: f64, high: f64, a: f64, sigma: f64) -> f64 {
        simpson(low, high, |x| density(x, a, sigma))
    }

    #[test]
    fn shares_of_sums_are_those_by_quadrature() {
        let (a, sigma, mean) = (0.7, 0.2, 0.3);
        let sum = Sum {
            units: vec![(Unit::Line, Law::Uniform, a)],
            numbers: Vec::new(),
            variance: sigma * sigma,
            reach: f64::INFINITY,
        };
        let std = (a * a / 3.0 + sigma * sigma).sqrt();
        let line = Line::of(mean, std, &sum, &mut 10_000).expect("it decays");
        assert!(Line::of(mean, std, &sum, &mut 10).is_none());
        for x in [-0.5, 0.0, 0.3, 0.6, 1.1, 1.3] {
            let (share, at) = line.below(x);
            assert!((share - share_between(-3.0, x - mean, a, sigma)).abs() < 1e-6, "{x} {share}");
            assert!((at - density(x - mean, a, sigma)).abs() < 1e-5);
        }
        // To what the tables are known.
        // Thresholds are near to what is asked, and their shares are known.
        for (threshold, p) in line.thresholds(&[1e-6, 0.001, 0.5, 0.95]).iter().zip([1e-6, 0.001, 0.5, 0.95]) {
            assert!((threshold.share - line.below(threshold.value).0).abs() < 1e-15);
            assert!((threshold.share - p).abs() < NEAR * p.min(1.0 - p), "{p} {threshold:?}");
        }
        for threshold in line.thresholds_of_size(&[0.5, 0.999]) {
            let share = share_between(-threshold.value - mean, threshold.value - mean, a, sigma);
            assert!((threshold.share - share).abs() < 1e-6);
        }
    }

    #[test]
    fn shares_within_circles_are_those_by_quadrature() {
        // From components that vary alike to those that nearly stay on a line, away from the middle.
        for (a, b, sigma, mean) in
            [(1.0, 1.0, 0.0, [0.0; 2]), (1.0, 0.6, 0.2, [0.2, -0.4]), (1.0, 0.05, 0.1, [0.1, 0.1])]
        {
            let std = [a, b].map(|half: f64| (half * half / 3.0 + sigma * sigma).sqrt());
            let mut budget = usize::MAX;
            let plane = Plane::of(std, &mut budget, |cos, sin| {
                let units = vec![(Unit::Line, Law::Uniform, a * cos), (Unit::Line, Law::Uniform, b * sin)];
                let sum = Sum { units, numbers: Vec::new(), variance: sigma * sigma, reach: f64::INFINITY };
                Some((cos * mean[0] + sin * mean[1], sum))
            });
            if sigma == 0.0 {
                // Without anything normal, the two edges of a square decay too slowly to be integrated.
                assert!(plane.is_none());
                continue;
            }
            let plane = plane.expect("it decays");
            for q in [0.3, 0.7, 1.0, 1.3] {
                let chord = |x: f64| {
                    let half = (q * q - x * x).max(0.0).sqrt();
                    density(x - mean[0], a, sigma) * share_between(-half - mean[1], half - mean[1], b, sigma)
                };
                let share = simpson(-q, q, chord);
                let found = plane.below(q).0;
                assert!((found - share).abs() < 2e-5, "{a} {b} {q}: {found} {share}");
            }
        }
    }
}
