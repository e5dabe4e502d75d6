//! Boole's rule, by which work along a straight way is summed.

/// Weights of a number at five places in equal steps: exact for polynomials of degree five.
pub(crate) const WEIGHTS: [f64; 5] = [7.0 / 90.0, 32.0 / 90.0, 12.0 / 90.0, 32.0 / 90.0, 7.0 / 90.0];
