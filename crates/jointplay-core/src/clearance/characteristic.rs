//! Characteristic functions of the laws of scatter, `E exp(i a.x)`: of a sum of independent offsets it is the product of theirs.
//!
//! A law that is symmetric about the middle of a disc, of a ball or of an interval at unit scale has a function of one number, s. With
//! Bessel functions J it is
//!
//! | law | interval | disc | ball |
//! |---|---|---|---|
//! | uniform | `sin s / s` | `2 J1(s) / s` | `3 (sin s - s cos s) / s^3` |
//! | boundary | `cos s` | `J0(s)` | `sin s / s` |
//! | normal, not truncated | `exp(-s^2 sigma^2 / 2)` | the same | the same |
//! | normal, truncated | mean of that of the boundary over the radius, by quadrature | | |
//!
//! Each becomes a table when it is needed first.

use std::f64::consts::SQRT_2;
use std::sync::OnceLock;

use crate::clearance::draw::SIGMAS;
use crate::clearance::law::Law;
use crate::clearance::pin::Pin;
use crate::clearance::quantile::{Quantile, scores};
use crate::clearance::{Set, Shape};

/// Nodes of a table per unit, and how far it goes.
const DENSE: f64 = 16.0;
const FAR: f64 = 64.0;
/// Below this argument the limit at zero is taken, which is 1.
const NOTHING: f64 = 1e-5;
/// Scores per unit for a law of one number.
const SCORES: f64 = 8.0;
/// Pieces of an evenly distributed number, of five nodes each.
const PIECES: u32 = 8;
/// Panels of the quadrature over a radius, of five nodes each.
const PANELS: u32 = 40;
/// Gauss and Legendre's rule of five points: nodes on [-1, 1] and weights.
const RULE: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_08],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_08],
];

/// A coordinate that is distributed symmetrically, at unit scale.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Unit {
    /// Of an interval.
    Line,
    /// Of a disc.
    Disc,
    /// Of a ball.
    Ball,
    /// Along a side of the square that a diamond is when it is turned.
    Side,
}

static TABLES: [OnceLock<Box<[f64]>>; 12] = [const { OnceLock::new() }; 12];

impl Unit {
    /// Standard deviation before truncation.
    const fn sigma(self) -> f64 {
        match self {
            Self::Side => SQRT_2 / SIGMAS,
            _ => 1.0 / SIGMAS,
        }
    }

    /// Its characteristic function.
    pub(crate) fn at(self, law: Law, s: f64) -> f64 {
        let s = s.abs();
        let kind = match law {
            Law::Gauss => return (-0.5 * (self.sigma() * s).powi(2)).exp(),
            Law::Uniform => 0,
            Law::Boundary => 1,
            Law::Normal => 2,
        };
        if !(s < FAR) {
            return self.direct(law, s);
        }
        let nodes = (FAR * DENSE) as usize + 3;
        let table = TABLES[3 * self as usize + kind]
            .get_or_init(|| (0..nodes).map(|k| self.direct(law, (k as f64 - 1.0) / DENSE)).collect());
        // The cubic through four nodes.
        let place = s * DENSE;
        let (k, t) = (place as usize, place.fract());
        let [a, b, c, d] = [table[k], table[k + 1], table[k + 2], table[k + 3]];
        let (rise, before, after) = (c - b, a - 2.0 * b + c, b - 2.0 * c + d);
        b + t * (rise - (1.0 - t) / 6.0 * ((2.0 - t) * before + (1.0 + t) * after))
    }

    fn direct(self, law: Law, s: f64) -> f64 {
        let s = s.abs();
        if s < NOTHING {
            return 1.0;
        }
        match (law, self) {
            (Law::Uniform, Self::Line | Self::Side) | (Law::Boundary, Self::Ball) => s.sin() / s,
            (Law::Uniform, Self::Disc) => 2.0 * libm::j1(s) / s,
            // Near zero by its series, where the difference has no digits.
            (Law::Uniform, Self::Ball) if s < 0.1 => 1.0 - s * s / 10.0 + s.powi(4) / 280.0,
            (Law::Uniform, Self::Ball) => 3.0 * (s.sin() - s * s.cos()) / s.powi(3),
            (Law::Boundary, Self::Line | Self::Side) => s.cos(),
            (Law::Boundary, Self::Disc) => libm::j0(s),
            (Law::Normal | Law::Gauss, _) => self.truncated(s),
        }
    }

    fn truncated(self, s: f64) -> f64 {
        let dimension = match self {
            Self::Line | Self::Side => 0,
            Self::Disc => 1,
            Self::Ball => 2,
        };
        let (mut sum, mut all) = (0.0, 0.0);
        for panel in 0..PANELS {
            for [node, weight] in RULE {
                let radius = (f64::from(panel) + 0.5 * (1.0 + node)) / f64::from(PANELS);
                let density = weight * radius.powi(dimension) * (-0.5 * (radius / self.sigma()).powi(2)).exp();
                all += density;
                sum += density * self.direct(Law::Boundary, s * radius);
            }
        }
        sum / all
    }
}

impl Set {
    /// Symmetric numbers of which `a . offset`, about its mean, is the sum: the characteristic function of the offset is the product
    /// of theirs. `None` where it is no such product. Of a law that is not truncated the sum is normal, with the variances of the
    /// components.
    pub(crate) fn factors(&self, law: Law, a: &[f64]) -> Option<Vec<(Unit, f64)>> {
        Some(match self.shape() {
            Shape::Round { radius, size } => {
                let s = radius * a.iter().map(|x| x * x).sum::<f64>().sqrt();
                vec![(if size == 2 { Unit::Disc } else { Unit::Ball }, s)]
            }
            Shape::Interval { low, high } => vec![(Unit::Line, 0.5 * (high - low) * a[0])],
            // On the boundary the two sides of the turned square are not independent.
            Shape::Diamond { .. } if law == Law::Boundary => return None,
            Shape::Diamond { gap, half_length } => {
                let (shift, turn) = (0.5 * gap * a[0], 0.5 * gap / half_length * a[1]);
                vec![(Unit::Side, shift + turn), (Unit::Side, shift - turn)]
            }
            Shape::Pin(Pin { radius, half_length, axial }) => {
                let across = &a[usize::from(axial.is_some())..];
                let end = |side: f64| {
                    let arm = side / half_length;
                    (Unit::Disc, 0.5 * radius * (across[0] + arm * across[3]).hypot(across[1] - arm * across[2]))
                };
                let mut found = vec![end(1.0), end(-1.0)];
                found.extend(axial.map(|axial| (Unit::Line, axial * a[0])));
                found
            }
            Shape::Tapered(_) => return None,
        })
    }
}

impl Quantile {
    /// Values about a mean, with weights of which sums are means over the law.
    pub(crate) fn weighted(&self, mean: f64) -> Vec<(f64, f64)> {
        let mut found = match self {
            Self::Ends { low, high } => vec![(*low, 0.5), (*high, 0.5)],
            Self::Uniform { low, high } => even(*low, *high, PIECES, |_| 1.0),
            Self::Triangular { low, mode, high } => {
                let (rising, falling) = ((mode - low) / (high - low), (high - mode) / (high - low));
                let mut nodes = even(*low, *mode, PIECES, |part| 2.0 * part * rising);
                nodes.extend(even(*mode, *high, PIECES, |part| 2.0 * (1.0 - part) * falling));
                nodes
            }
            Self::Measured(values) if values.len() > 1 => {
                let share = 1.0 / (values.len() - 1) as f64;
                values.windows(2).flat_map(|pair| even(pair[0], pair[1], 1, |_| share)).collect()
            }
            Self::Measured(values) => values.iter().map(|x| (*x, 1.0)).collect(),
            // Smooth in the score.
            Self::Normal { .. } | Self::Table(_) => scores(SCORES).map(|(z, weight)| (self.at(z), weight)).collect(),
        };
        for (x, _) in &mut found {
            *x -= mean;
        }
        found
    }
}

/// Nodes of evenly distributed numbers, with weights times a density over the part of the way from `low` to `high`.
fn even(low: f64, high: f64, pieces: u32, density: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let of = |piece: u32, [node, weight]: [f64; 2]| {
        let part = (f64::from(piece) + 0.5 * (1.0 + node)) / f64::from(pieces);
        (low + part * (high - low), 0.5 * weight / f64::from(pieces) * density(part))
    };
    (0..pieces).flat_map(|piece| RULE.map(|rule| of(piece, rule))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::draw::Draw;
    use crate::clearance::draw::stream::Stream;
    use crate::clearance::samples::KINDS;
    use crate::math::lanes::block::{Block, LANES};

    #[test]
    fn they_are_the_means_over_draws() {
        const BLOCKS: usize = 40_000;
        for set in KINDS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
                let mut stream = Stream::new(11, 0);
                let (mean, variance) = set.moments(law);
                // Up to where little is left.
                let directions: Vec<Vec<f64>> = [0.5, 1.0, 2.0, 4.0]
                    .iter()
                    .map(|scale| {
                        let weight = |k: usize| (1.0 + k as f64).sin() / variance[k].sqrt().max(1e-12);
                        (0..set.size()).map(|k| scale * weight(k)).collect()
                    })
                    .collect();
                let of = |a: &Vec<f64>| {
                    let factors = set.factors(law, a)?;
                    Some(factors.iter().map(|(unit, s)| unit.at(law, *s)).product::<f64>())
                };
                let Some(known) = directions.iter().map(of).collect::<Option<Vec<f64>>>() else {
                    let is_diamond = matches!(set.shape(), Shape::Diamond { .. });
                    assert!(matches!(set.shape(), Shape::Tapered(_)) || is_diamond && law == Law::Boundary);
                    continue;
                };
                let mut sums = vec![0.0; directions.len()];
                let mut drawn = vec![Block::splat(0.0); set.size()];
                for _ in 0..BLOCKS {
                    stream.draw(&set, law, &mut drawn);
                    for (a, sum) in directions.iter().zip(&mut sums) {
                        for lane in 0..LANES {
                            let phase: f64 = (0..set.size()).map(|k| a[k] * (drawn[k].0[lane] - mean[k])).sum();
                            *sum += phase.cos();
                        }
                    }
                }
                let count = (BLOCKS * LANES) as f64;
                for (sum, value) in sums.iter().zip(known) {
                    // Five standard errors of a mean of cosines.
                    assert!(
                        (sum / count - value).abs() < 5.0 / count.sqrt(),
                        "{set:?} {law:?} {} {value}",
                        sum / count
                    );
                }
            }
        }
    }

    #[test]
    fn tables_are_the_functions() {
        for unit in [Unit::Line, Unit::Disc, Unit::Ball, Unit::Side] {
            for law in [Law::Uniform, Law::Boundary, Law::Normal] {
                for k in 0..2000 {
                    let s = 0.0353 * f64::from(k);
                    let (value, direct) = (unit.at(law, s), unit.direct(law, s));
                    assert!((value - direct).abs() < 1e-6, "{unit:?} {law:?} {s} {value} {direct}");
                }
            }
        }
    }
}
