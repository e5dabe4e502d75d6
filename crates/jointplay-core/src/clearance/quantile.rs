//! Laws of one number by their quantile functions, taken at a standard normal score: `x = Q(Phi(z))`.
//!
//! With z normal, x has the law. A smooth law becomes a table of z, interpolated by cubics; means of functions of x are
//! sums over evenly spaced z by the density of z, which for smooth functions are as exact as the numbers.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use crate::clearance::draw::SIGMAS;
use crate::clearance::law::Law;

/// Scores of a table reach so far: no draw of 52 bits goes beyond.
const FARTHEST: f64 = 8.5;
/// Nodes of a table per unit of the score.
const DENSE: f64 = 32.0;
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

    /// The value at a score.
    #[must_use]
    pub fn at(&self, z: f64) -> f64 {
        match self {
            Self::Uniform { low, high } => {
                // From the nearer end, for the last digits.
                if z < 0.0 { low + (high - low) * below(z) } else { high - (high - low) * below(-z) }
            }
            Self::Ends { low, high } => if z < 0.0 { *low } else { *high },
            Self::Normal { mean, sigma } => mean + sigma * z,
            Self::Table(table) => table.at(z),
        }
    }
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
        if value > 0.0 {
            (low, at_low) = (x, value);
        } else {
            (high, at_high) = (x, value);
        }
        if value == 0.0 {
            break;
        }
        halve = high - low > 0.5 * width;
    }
    0.5 * (low + high)
}
