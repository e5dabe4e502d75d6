//! What forms spend their time on, compiled for every width of vector registers. Terms are added in an order that does not
//! depend on it.

use crate::math::affine::{Forms, Group};
use crate::math::lanes::Kernel;
use crate::math::vector::norm;

/// Sums are taken in so many parts, which a processor adds at once.
const AT_ONCE: usize = 8;

/// Numbers times a factor, added to others.
pub(super) struct Scaled<'a> {
    pub sum: &'a mut [f64],
    pub factor: f64,
    pub added: &'a [f64],
}

impl Kernel for Scaled<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.sum.iter_mut().zip(self.added).for_each(|(sum, x)| *sum += self.factor * x);
    }
}

/// Whether all numbers are finite.
pub(super) struct Finite<'a>(pub &'a [f64]);

impl Kernel for Finite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        summed(self.0.len(), |k| self.0[k].abs()).is_finite()
    }
}

/// What the linear part of a form reaches.
pub(super) struct Reach<'a> {
    pub forms: &'a Forms,
    pub coefficients: &'a [f64],
}

impl Kernel for Reach<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let (c, Forms { sizes, alone, pairs: [first, second, radius], groups, .. }) = (self.coefficients, self.forms);
        let n = c.len();
        let smaller = |a: f64, b: f64| if b < a { b } else { a };
        let of_one = |k: usize| c[k].abs() * alone[k];
        let of_two = |k: usize| {
            let (a, b) = (c[k], c[k + 1]);
            smaller(a.abs() * first[k] + b.abs() * second[k], (a * a + b * b).sqrt() * radius[k])
        };
        let of_more = |group: &Group| {
            let of = &c[group.range.clone()];
            let apart: f64 = of.iter().zip(&sizes[group.range.clone()]).map(|(c, size)| c.abs() * size).sum();
            smaller(apart, norm(of) * group.radius)
        };
        summed(n, of_one) + summed(n.saturating_sub(1), of_two) + groups.iter().map(of_more).sum::<f64>()
    }
}

/// A sum whose terms are added several at a time.
#[inline(always)]
fn summed(n: usize, term: impl Fn(usize) -> f64) -> f64 {
    let (mut sums, whole) = ([0.0; AT_ONCE], n - n % AT_ONCE);
    for first in (0..whole).step_by(AT_ONCE) {
        for k in 0..AT_ONCE {
            sums[k] += term(first + k);
        }
    }
    sums.iter().sum::<f64>() + (whole..n).map(term).sum::<f64>()
}
