//! The standard normal law by polynomials: its quantile function, and the probability that a number is below a score.
//!
//! `z(u) = (2u - 1) P(w)` with `w = -ln(4 u (1 - u))`, as in Giles (GPU Computing Gems, Jade Edition, 2012, 109). P is a polynomial
//! of w in the middle and of its square root in the tails, each fitted by least squares at Chebyshev points; what is left is below 1e-9.
//!
//! Within three standard deviations `z(u) = (u - 1/2) N(y) / D(y)` with `y = u (1 - u)`, N and D of degree ten, fitted by weighted least
//! squares in forty digits; what is left is below 5e-11. Their zeros are all on the negative axis, where the function has its cut, so
//! that all coefficients are positive and nothing cancels.
//!
//! `erfc(x) = t R(2t - 1) exp(-x^2)` with `t = 2 / (2 + x)` for x >= 0, R a polynomial fitted in the same way. What is left is below
//! 1e-12 of the value, far out in the tail, too.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::math::lanes::block::{exp, ln, polynomial};

/// Where the tails begin: beyond 3.5 standard deviations.
const TAIL: f64 = 7.0;
/// The tails' variable is `FACTOR sqrt w - SHIFT`, which goes from -1 to 1 for u down to 2^-54.
const FACTOR: f64 = 0.595_519_210_463_051_3;
const SHIFT: f64 = 2.575_595_731_846_768;
/// Highest coefficient first.
#[rustfmt::skip]
#[allow(clippy::unreadable_literal)] // digits of a fit
const MIDDLE: [f64; 15] = [
    -2.889525952787267e-06,
    2.037041396096509e-05,
    -2.049015663597186e-05,
    -0.0001018280193019971,
    0.0002980036519891736,
    -9.048259480571594e-05,
    -0.0011769077321054878,
    0.0029317211391428153,
    -0.0009935576848641029,
    -0.011735598198305145,
    0.03365012282177483,
    -0.02918225262614354,
    -0.11636724080571237,
    1.1649646879722682,
    2.4647337126954234,
];
#[rustfmt::skip]
#[allow(clippy::unreadable_literal)] // digits of a fit
const TAILS: [f64; 15] = [
    -4.912753999782196e-05,
    9.51110774934995e-05,
    6.76754473851711e-05,
    -0.00029385109973238156,
    0.000297421575030065,
    -0.0002620470703191219,
    0.0003431237689165579,
    -0.00041559673440113074,
    0.0005568674516102361,
    -0.0010448370893754808,
    0.0021330159710117036,
    -0.003668092843752615,
    0.0023246294640267527,
    2.398683488668718,
    5.894347940110084,
];

#[rustfmt::skip]
#[allow(clippy::unreadable_literal)] // digits of a fit
const NUMERATOR: [f64; 11] = [
    0.6098929658730465,
    4.286976871168054,
    3.805490714927938,
    0.9386857872965109,
    0.08219493419001042,
    0.0028256564023094385,
    3.939813839165496e-05,
    2.189980329681949e-07,
    4.4997763554043395e-10,
    2.847418583994018e-13,
    3.38708386637935e-17,
];
#[rustfmt::skip]
#[allow(clippy::unreadable_literal)] // digits of a fit
const DENOMINATOR: [f64; 11] = [
    1.0,
    2.8216670636641417,
    1.648961194254975,
    0.31053495866217246,
    0.022297360656106043,
    0.0006549771626664725,
    8.004147390061492e-06,
    3.958971170720561e-08,
    7.283573968554106e-11,
    4.103140488922621e-14,
    4.181011370837109e-18,
];
#[rustfmt::skip]
#[allow(clippy::unreadable_literal)] // digits of a fit
const SCALED_ERFC: [f64; 19] = [
    -1.1255615390837197e-07,
    2.3405809770338246e-07,
    5.740413980393416e-07,
    -2.0040637615349057e-06,
    -4.66860624392993e-08,
    8.125500454304951e-06,
    -1.1215688166708561e-05,
    -1.707047085739231e-05,
    7.239632414842792e-05,
    -1.7198264862111922e-05,
    -0.0003315795859165827,
    0.000418652599505601,
    0.0015453125764285493,
    -0.0032395932518757293,
    -0.010755331453088518,
    0.01822111580038821,
    0.13973604629334474,
    0.3435803422060449,
    0.5107913526209353,
];

/// The score below which a normal number is with probability `u`, between 0 and 1 exclusively.
#[inline(always)]
#[must_use]
pub fn score(u: f64) -> f64 {
    let w = -ln(4.0 * u * (1.0 - u));
    // Both polynomials, so that all lanes do the same. Rounding may leave w just below zero at u = 1/2, where its root is not
    // needed.
    let middle = polynomial(w.mul_add(2.0 / TAIL, -1.0), MIDDLE);
    let tails = polynomial(w.abs().sqrt().mul_add(FACTOR, -SHIFT), TAILS);
    (2.0 * u - 1.0) * if w < TAIL { middle } else { tails }
}

/// The same for scores that stay within three standard deviations, in less time and to more digits.
#[inline(always)]
#[must_use]
pub fn score_within_three(u: f64) -> f64 {
    let y = u * (1.0 - u);
    (u - 0.5) * polynomial(y, NUMERATOR) / polynomial(y, DENOMINATOR)
}

/// The probability that a normal number is below a score.
#[inline(always)]
#[must_use]
pub fn share_below(z: f64) -> f64 {
    let x = z.abs() * FRAC_1_SQRT_2;
    let t = 2.0 / (2.0 + x);
    let tail = 0.5 * t * polynomial(2.0 * t - 1.0, SCALED_ERFC) * exp(-0.5 * z * z);
    if z < 0.0 { tail } else { 1.0 - tail }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_error_function() {
        for k in -3700..=3700 {
            let z = f64::from(k) * 0.01;
            let expected = 0.5 * libm::erfc(-z * FRAC_1_SQRT_2);
            assert!((share_below(z) / expected - 1.0).abs() < 1e-12, "{z}");
        }
        assert!(share_below(-60.0).abs() < 1e-300);
        assert!((share_below(60.0) - 1.0).abs() < f64::EPSILON);
        assert!(share_below(f64::NAN).is_nan());
    }

    #[test]
    fn scores_are_those_of_the_error_function() {
        let below = |z: f64| 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let tails = (1..=53).map(|k| 0.5_f64.powi(k));
        for u in (1..5000).map(|k| f64::from(k) / 10_000.0).chain(tails) {
            let z = score(u);
            // The error of the score is that of the probability over the density.
            assert!(((below(z) - u) / density(z)).abs() < 1e-9, "{u} {z}");
            let within = score_within_three(u);
            assert!(z.abs() > 3.0 || ((below(within) - u) / density(within)).abs() < 5e-11, "{u} {within}");
            let other = score(1.0 - u);
            assert!(u < 1e-10 || (z + other).abs() < 1e-9, "{u} {z} {other}");
        }
    }
}
