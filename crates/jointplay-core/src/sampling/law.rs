//! Variances of the laws of scatter on the unit disc, the unit diamond and the unit interval.

use std::f64::consts::{PI, SQRT_2};

use crate::batch::draw::SIGMAS;
use crate::spec::Law;

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
