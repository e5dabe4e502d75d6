//! Laws of one number by their quantile functions, taken at a standard normal score: `x = Q(Phi(z))`.
//!
//! With z normal, x has the law. A smooth law becomes a table of z, interpolated by cubics; means of functions of x are
//! sums over evenly spaced z by the density of z, which for smooth functions are as exact as the numbers.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use crate::clearance::draw::SIGMAS;
use crate::clearance::law::{Law, ScalarLaw};

/// Scores of a table reach so far: no draw of 52 bits goes beyond.
const FARTHEST: f64 = 8.5;
/// Nodes of a table per unit of the score.
const DENSE: f64 = 32.0;
/// Scores of sums over two numbers, per unit.
const COARSE: f64 = 12.0;
/// Scores that differ by less than this part of their size follow each other.
const FOLLOWS: f64 = 1e-6;
/// Of what a process makes at least so much must be within the bounds.
const LEAST_KEPT: f64 = 1e-6;
/// A drift below this part of a standard deviation is none.
const STEADY: f64 = 1e-4;
/// Exponents of a beta law from here to there; beyond, it is a point for all purposes.
const LEAST_EXPONENT: f64 = 0.1;
const MOST_EXPONENT: f64 = 1e4;
/// Terms of a continued fraction at most; the square root of the exponents is enough.
const MOST_TERMS: u32 = 1000;
/// Steps at most in which a node is found.
const STEPS: usize = 200;

/// Probability that a standard normal number is below z.
pub(crate) fn below(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// Scores and weights of a mean over a standard normal number.
pub(crate) fn scores(per_unit: f64) -> impl Iterator<Item = (f64, f64)> {
    let n = (FARTHEST * per_unit) as i32;
    (-n..=n).map(move |k| {
        let z = f64::from(k) / per_unit;
        (z, (-0.5 * z * z).exp() / ((2.0 * PI).sqrt() * per_unit))
    })
}

/// A law of one number.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantile {
    /// Uniform between two bounds.
    Uniform {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// One bound or the other.
    Ends {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Normal, not truncated.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sigma: f64,
    },
    /// Triangular.
    Triangular {
        /// Lower bound.
        low: f64,
        /// Likeliest value.
        mode: f64,
        /// Upper bound.
        high: f64,
    },
    /// As values in ascending order that have been measured, interpolated.
    Measured(Vec<f64>),
    /// Any smooth law within bounds: values at evenly spaced scores.
    Table(Table),
}

impl Quantile {
    /// That of a law between two bounds.
    #[must_use]
    pub fn of(law: Law, low: f64, high: f64) -> Self {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        match law {
            Law::Uniform => Self::Uniform { low, high },
            Law::Boundary => Self::Ends { low, high },
            Law::Gauss => Self::Normal { mean: middle, sigma: half / SIGMAS },
            Law::Normal => {
                let score = |x: f64| SIGMAS * (x - middle) / half;
                let whole = below(SIGMAS) - below(-SIGMAS);
                let part = |z: f64| (below(z) - below(-SIGMAS)) / whole;
                Self::Table(Table::of(low, high, |x| [part(score(x)), part(-score(x))]))
            }
        }
    }

    /// That of a law of one number; `None` where its numbers make none.
    #[must_use]
    pub fn of_scalar(law: &ScalarLaw, low: f64, high: f64) -> Option<Self> {
        match *law {
            ScalarLaw::Process { mean, sigma, drift, sorted } => {
                let good = mean.is_finite() && sigma.is_finite() && sigma > 0.0 && drift.is_finite() && drift >= 0.0;
                let table = |low: f64, high: f64| {
                    let [under, over] = [process(low, mean, sigma, drift)[0], process(high, mean, sigma, drift)[1]];
                    let kept = 1.0 - under - over;
                    let part = |x: f64| {
                        let [below, above] = process(x, mean, sigma, drift);
                        [(below - under) / kept, (above - over) / kept]
                    };
                    (kept > LEAST_KEPT).then(|| Self::Table(Table::of(low, high, part)))
                };
                match (good, sorted) {
                    (false, _) => None,
                    (true, true) => table(low, high),
                    (true, false) if drift == 0.0 => Some(Self::Normal { mean, sigma }),
                    (true, false) => {
                        let reach = drift + FARTHEST * sigma;
                        table(mean - reach, mean + reach)
                    }
                }
            }
            ScalarLaw::Triangular { mode } => {
                (low <= mode && mode <= high).then_some(Self::Triangular { low, mode, high })
            }
            ScalarLaw::Beta { a, b } => {
                let good = |x: f64| (LEAST_EXPONENT..=MOST_EXPONENT).contains(&x);
                let part = |x: f64| {
                    let t = (x - low) / (high - low);
                    [beta(a, b, t), beta(b, a, (high - x) / (high - low))]
                };
                (good(a) && good(b)).then(|| Self::Table(Table::of(low, high, part)))
            }
            ScalarLaw::Measured { ref values } => {
                let good = !values.is_empty() && values.iter().all(|x| x.is_finite()) && values.is_sorted();
                good.then(|| Self::Measured(values.clone()))
            }
        }
    }

    /// Mean and variance.
    #[must_use]
    pub fn moments(&self) -> (f64, f64) {
        let square = |x: f64| x * x;
        match self {
            Self::Uniform { low, high } => (0.5 * (low + high), square(high - low) / 12.0),
            Self::Ends { low, high } => (0.5 * (low + high), square(0.5 * (high - low))),
            Self::Normal { mean, sigma } => (*mean, sigma * sigma),
            Self::Triangular { low, mode, high } => {
                let (a, b) = (mode - low, high - mode);
                (low + (2.0 * a + b) / 3.0, (a * a + a * b + b * b) / 18.0)
            }
            Self::Measured(values) => {
                if let [only] = values[..] {
                    return (only, 0.0);
                }
                let n = (values.len() - 1) as f64;
                let mean = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).sum::<f64>() / n;
                let of = |pair: &[f64]| {
                    let (a, b) = (pair[0] - mean, pair[1] - mean);
                    (a * a + a * b + b * b) / 3.0
                };
                (mean, values.windows(2).map(of).sum::<f64>() / n)
            }
            Self::Table(table) => {
                let over = |of: &dyn Fn(f64) -> f64| -> f64 {
                    scores(DENSE).map(|(z, weight)| weight * of(table.at(z))).sum()
                };
                let mean = over(&|x| x);
                (mean, over(&|x| square(x - mean)))
            }
        }
    }

    /// Covariance of two numbers whose scores have a correlation.
    #[must_use]
    pub fn covariance(&self, other: &Self, correlation: f64) -> f64 {
        let ((mean, _), (mean_other, _)) = (self.moments(), other.moments());
        let beside = (1.0 - correlation * correlation).max(0.0).sqrt();
        // Scores that follow each other need no second sum.
        let second: Vec<(f64, f64)> = if beside < FOLLOWS { vec![(0.0, 1.0)] } else { scores(COARSE).collect() };
        let of = |(z, weight): (f64, f64)| {
            let others = second.iter().map(|(y, part)| part * (other.at(correlation * z + beside * y) - mean_other));
            weight * (self.at(z) - mean) * others.sum::<f64>()
        };
        scores(COARSE).map(of).sum()
    }

    /// How far it goes from the middle of two bounds, as a part of the way to them; four standard scores count as all.
    #[must_use]
    pub fn reach(&self, low: f64, high: f64) -> f64 {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let farthest = (self.at(-4.0) - middle).abs().max((self.at(4.0) - middle).abs());
        if half > 0.0 { (farthest / half).max(1.0) } else { 1.0 }
    }

    /// The value at a score.
    #[must_use]
    pub fn at(&self, z: f64) -> f64 {
        match self {
            Self::Uniform { low, high } => {
                // From the nearer end, for the last digits.
                if z < 0.0 { low + (high - low) * below(z) } else { high - (high - low) * below(-z) }
            }
            Self::Ends { low, high } => {
                if z < 0.0 {
                    *low
                } else {
                    *high
                }
            }
            Self::Normal { mean, sigma } => mean + sigma * z,
            Self::Triangular { low, mode, high } => {
                let (whole, left) = (high - low, mode - low);
                let (u, over) = (below(z), below(-z));
                if u * whole < left {
                    low + (u * whole * left).sqrt()
                } else {
                    high - (over * whole * (high - mode)).sqrt()
                }
            }
            Self::Measured(values) => {
                let place = below(z) * (values.len() - 1) as f64;
                let k = (place as usize).min(values.len().saturating_sub(2));
                let next = values[(k + 1).min(values.len() - 1)];
                values[k] + (place - k as f64) * (next - values[k])
            }
            Self::Table(table) => table.at(z),
        }
    }
}

/// Probabilities that what a process makes is below and above a value.
fn process(x: f64, mean: f64, sigma: f64, drift: f64) -> [f64; 2] {
    let score = (x - mean) / sigma;
    let way = drift / sigma;
    if way < STEADY {
        return [below(score), below(-score)];
    }
    // The mean of Phi over the drift, by its integral z Phi(z) + phi(z).
    let integral = |z: f64| z * below(z) + (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
    let mean_below = |z: f64| (integral(z + way) - integral(z - way)) / (2.0 * way);
    [mean_below(score), mean_below(-score)]
}

/// The regularised incomplete beta function, by its continued fraction (Lentz; DLMF 8.17.22).
fn beta(a: f64, b: f64, x: f64) -> f64 {
    if !(x > 0.0) {
        return 0.0;
    }
    if !(x < 1.0) {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_below(b, a, 1.0 - x);
    }
    beta_below(a, b, x)
}

fn beta_below(a: f64, b: f64, x: f64) -> f64 {
    let front = (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p()).exp() / a;
    let kept = |v: f64| if v.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { v };
    let mut d = 1.0 / kept(1.0 - (a + b) * x / (a + 1.0));
    let (mut c, mut fraction) = (1.0, d);
    for k in 1..MOST_TERMS {
        let m = f64::from(k);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for term in [even, odd] {
            d = 1.0 / kept(1.0 + term * d);
            c = kept(1.0 + term / c);
            fraction *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

/// Values at evenly spaced scores, with their slopes.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    low: f64,
    high: f64,
    nodes: Vec<[f64; 2]>,
}

impl Table {
    /// Of the probabilities to be below and above a value between two bounds.
    pub fn of(low: f64, high: f64, probabilities: impl Fn(f64) -> [f64; 2]) -> Self {
        if !(high > low) {
            return Self { low, high, nodes: Vec::new() };
        }
        let mut from = low;
        let values: Vec<f64> = scores(DENSE)
            .map(|(z, _)| {
                // Of two that sum to one the smaller is known to all its digits.
                let lacks = |x: f64| {
                    let [under, over] = probabilities(x);
                    if z < 0.0 { below(z) - under } else { over - below(-z) }
                };
                from = root(from, high, lacks);
                from
            })
            .collect();
        let slope = |k: usize| {
            // Differences of the fourth order; at the ends, where no draw comes, of the first.
            if k < 2 || k + 2 >= values.len() {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(values.len() - 1));
                return (values[b] - values[a]) / (b - a) as f64;
            }
            (8.0 * (values[k + 1] - values[k - 1]) - (values[k + 2] - values[k - 2])) / 12.0
        };
        let nodes = (0..values.len()).map(|k| [values[k], slope(k)]).collect();
        Self { low, high, nodes }
    }

    fn at(&self, z: f64) -> f64 {
        let Some(last) = self.nodes.len().checked_sub(2) else { return self.low };
        let place = (z * DENSE + 0.5 * (last + 1) as f64).clamp(0.0, (last + 1) as f64);
        let k = (place as usize).min(last);
        let t = place - k as f64;
        let ([a, slope_a], [b, slope_b]) = (self.nodes[k], self.nodes[k + 1]);
        let (s, rise) = (1.0 - t, b - a);
        let bent = s * (slope_a - rise) + t * (rise - slope_b);
        (a + t * (rise + s * bent)).clamp(self.low, self.high)
    }
}

/// Where a function that falls is zero, by bisection that follows secants.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut at_low, mut at_high) = (f(low), f(high));
    if !(at_low > 0.0) {
        return low;
    }
    if !(at_high < 0.0) {
        return high;
    }
    let mut halve = false;
    for _ in 0..STEPS {
        let secant = (low * at_high - high * at_low) / (at_high - at_low);
        let x = if halve || !(secant > low && secant < high) { 0.5 * (low + high) } else { secant };
        if !(x > low && x < high) {
            break;
        }
        let (width, value) = (high - low, f(x));
        if value == 0.0 {
            return x;
        }
        if value > 0.0 {
            (low, at_low) = (x, value);
        } else {
            (high, at_high) = (x, value);
        }
        halve = high - low > 0.5 * width;
    }
    0.5 * (low + high)
}
