//! The quantile function of the standard normal law, by polynomials.
//!
//! `z(u) = (2u - 1) P(w)` with `w = -ln(4 u (1 - u))`, as in Giles (GPU Computing Gems, Jade Edition, 2012, 109). P is a polynomial
//! of w in the middle and of its square root in the tails, each fitted by least squares at Chebyshev points; what is left is below 1e-9.

use crate::math::lanes::block::{ln, polynomial};

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

/// The same for scores that stay within 3.5 standard deviations, in half the time.
#[inline(always)]
#[must_use]
pub fn score_in_middle(u: f64) -> f64 {
    let w = -ln(4.0 * u * (1.0 - u));
    (2.0 * u - 1.0) * polynomial(w.mul_add(2.0 / TAIL, -1.0), MIDDLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_those_of_the_error_function() {
        let below = |z: f64| 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let tails = (1..=53).map(|k| 0.5_f64.powi(k));
        for u in (1..5000).map(|k| f64::from(k) / 10_000.0).chain(tails) {
            let z = score(u);
            // The error of the score is that of the probability over the density.
            assert!(((below(z) - u) / density(z)).abs() < 1e-9, "{u} {z}");
            assert!(z < -3.5 || score_in_middle(u).to_bits() == z.to_bits());
            let other = score(1.0 - u);
            assert!(u < 1e-10 || (z + other).abs() < 1e-9, "{u} {z} {other}");
        }
    }
}
