//! Offsets as numbers, those of smaller sets followed by zeros.

use crate::math::real::Real;

/// The most components that one set has.
pub const MAX_SIZE: usize = 5;

/// Numbers followed by zeros.
#[inline(always)]
pub(crate) fn padded<const N: usize>(numbers: [f64; N]) -> [f64; MAX_SIZE] {
    std::array::from_fn(|k| if k < N { numbers[k] } else { 0.0 })
}

/// So many numbers followed by zeros.
#[inline(always)]
pub(crate) fn padded_with<S: Real>(size: usize, number: impl Fn(usize) -> S) -> [S; MAX_SIZE] {
    std::array::from_fn(|k| if k < size { number(k) } else { S::from_f64(0.0) })
}

pub(crate) fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
