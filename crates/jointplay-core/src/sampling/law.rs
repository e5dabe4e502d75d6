//! Laws of scatter on the unit disc, the unit diamond and the unit interval.
//!
//! The diamond `|a| + |b| <= 1` is the square `|p|, |q| <= 1` turned by 45 degrees (`a = (p+q)/2`,
//! `b = (p-q)/2`), on which uniform and truncated normal laws factor into independent numbers.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, SQRT_2, TAU};

use crate::spec::Law;

/// Standard deviations between the centre and the boundary of a normal law.
const SIGMAS: f64 = 3.0;

/// Variance of one coordinate on the unit disc.
#[must_use]
pub fn disc_variance(law: Law) -> f64 {
    match law {
        Law::Uniform => 0.25,
        Law::Boundary => 0.5,
        // Rayleigh radius truncated at `SIGMAS`: E[R^2] = 2 s^2 (1 - k e^-k / (1 - e^-k)), k = SIGMAS^2 / 2.
        Law::Normal => {
            let k = 0.5 * SIGMAS * SIGMAS;
            (1.0 - k * (-k).exp() / -(-k).exp_m1()) / (SIGMAS * SIGMAS)
        }
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance of one coordinate on the unit diamond.
#[must_use]
pub fn diamond_variance(law: Law) -> f64 {
    match law {
        Law::Uniform => 1.0 / 6.0,
        Law::Boundary => 1.0 / 3.0,
        Law::Normal => 0.5 * truncated_variance(SQRT_2 / SIGMAS),
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance on the interval from -1 to 1.
#[must_use]
pub fn interval_variance(law: Law) -> f64 {
    match law {
        Law::Uniform => 1.0 / 3.0,
        Law::Boundary => 1.0,
        Law::Normal => truncated_variance(1.0 / SIGMAS),
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance of a centred normal number of standard deviation `sigma` truncated to [-1, 1].
fn truncated_variance(sigma: f64) -> f64 {
    let k = 1.0 / sigma;
    let density = (-0.5 * k * k).exp() / (2.0 * PI).sqrt();
    sigma * sigma * (1.0 - 2.0 * k * density / inside(k))
}

/// Probability that a standard normal number lies within +-k, by its everywhere convergent series
/// (A&S 26.2.11: 2 phi(k) (k + k^3/3 + k^5/15 + ...)).
fn inside(k: f64) -> f64 {
    let (mut term, mut sum, mut odd) = (k, k, 1.0);
    while term > 1e-18 * sum {
        odd += 2.0;
        term *= k * k / odd;
        sum += term;
    }
    2.0 * sum * (-0.5 * k * k).exp() / (2.0 * PI).sqrt()
}

/// A point of the unit disc.
pub fn disc<R: Rng + ?Sized>(law: Law, rng: &mut R) -> [f64; 2] {
    if law == Law::Gauss {
        return [normal(rng) / SIGMAS, normal(rng) / SIGMAS];
    }
    let (sine, cosine) = (TAU * rng.random::<f64>()).sin_cos();
    let radius = match law {
        Law::Boundary => 1.0,
        Law::Uniform | Law::Gauss => rng.random::<f64>().sqrt(),
        Law::Normal => {
            let k = 0.5 * SIGMAS * SIGMAS;
            (-(rng.random::<f64>() * (-k).exp_m1()).ln_1p()).sqrt() * SQRT_2 / SIGMAS
        }
    };
    [radius * cosine, radius * sine]
}

/// A point of the unit diamond.
pub fn diamond<R: Rng + ?Sized>(law: Law, rng: &mut R) -> [f64; 2] {
    let (p, q) = match law {
        Law::Gauss => return [normal(rng) / SIGMAS, normal(rng) / SIGMAS],
        Law::Uniform => (symmetric(rng), symmetric(rng)),
        Law::Normal => (truncated(SQRT_2 / SIGMAS, rng), truncated(SQRT_2 / SIGMAS, rng)),
        Law::Boundary => {
            let (side, along) = (if rng.random::<bool>() { 1.0 } else { -1.0 }, symmetric(rng));
            if rng.random::<bool>() { (side, along) } else { (along, side) }
        }
    };
    [0.5 * (p + q), 0.5 * (p - q)]
}

/// A number from -1 to 1.
pub fn interval<R: Rng + ?Sized>(law: Law, rng: &mut R) -> f64 {
    match law {
        Law::Uniform => symmetric(rng),
        Law::Boundary => {
            if rng.random::<bool>() {
                1.0
            } else {
                -1.0
            }
        }
        Law::Normal => truncated(1.0 / SIGMAS, rng),
        Law::Gauss => normal(rng) / SIGMAS,
    }
}

fn symmetric<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    2.0 * rng.random::<f64>() - 1.0
}

fn normal<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    StandardNormal.sample(rng)
}

/// Rejection: at least 96 of 100 draws are accepted for the two widths used here.
fn truncated<R: Rng + ?Sized>(sigma: f64, rng: &mut R) -> f64 {
    loop {
        let x = sigma * normal(rng);
        if x.abs() <= 1.0 {
            return x;
        }
    }
}
