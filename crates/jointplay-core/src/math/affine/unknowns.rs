//! What forms depend on, and what their linear parts reach for it.
//!
//! Here forms spend their time: it is compiled for every width of vector registers. Terms are added in an order that does
//! not depend on it.

use crate::math::lanes::{Kernel, dispatch};
use crate::math::vector::norm;

/// Sums are taken in so many parts, which a processor adds at once.
const AT_ONCE: usize = 8;

/// Unknowns after each other that are bounded together besides: the length of their vector by a radius.
pub(crate) struct Group {
    pub range: std::ops::Range<usize>,
    pub radius: f64,
}

/// Numbers that are not known, but bounded.
pub(crate) struct Unknowns {
    pub sizes: Vec<f64>,
    /// Sizes of the unknowns that are bounded alone, zero for the others.
    alone: Vec<f64>,
    /// By the first unknown of every two that are bounded together, zero for the others: their sizes, and the radius.
    pairs: [Vec<f64>; 3],
    /// What more than two unknowns are bounded by together.
    groups: Vec<Group>,
}

impl Unknowns {
    /// By their sizes, in groups.
    pub fn new(sizes: Vec<f64>, groups: impl Iterator<Item = Group>) -> Self {
        let groups: Vec<Group> = groups.filter(|group| group.range.len() > 1 && group.radius.is_finite()).collect();
        let (mut alone, mut pairs) = (sizes.clone(), [(); 3].map(|()| vec![0.0; sizes.len()]));
        for group in &groups {
            alone[group.range.clone()].fill(0.0);
            if let &[first, second] = &sizes[group.range.clone()] {
                pairs.iter_mut().zip([first, second, group.radius]).for_each(|(of, x)| of[group.range.start] = x);
            }
        }
        let groups = groups.into_iter().filter(|group| group.range.len() > 2).collect();
        Self { sizes, alone, pairs, groups }
    }

    /// What these numbers times the unknowns reach.
    pub fn reach(&self, coefficients: &[f64]) -> f64 {
        dispatch(Reach { unknowns: self, coefficients })
    }
}

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

/// See [`Unknowns::reach`].
struct Reach<'a> {
    unknowns: &'a Unknowns,
    coefficients: &'a [f64],
}

impl Kernel for Reach<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let (c, Unknowns { sizes, alone, pairs: [first, second, radius], groups }) = (self.coefficients, self.unknowns);
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
