//! What forms depend on, and what their linear parts reach for it.
//!
//! Here forms spend their time: it is compiled for every width of vector registers. Terms are added in an order that does
//! not depend on it.

use crate::math::lanes::{Kernel, dispatch};
use crate::math::vector::norm;

/// Numbers are taken so many at once, and forms have a multiple of it.
const AT_ONCE: usize = 8;
/// Sums of forms are taken so many times as many at once.
const WIDE: usize = 4 * AT_ONCE;

/// Unknowns after each other that are bounded together besides: the length of their vector by a radius.
pub(crate) struct Group {
    pub range: std::ops::Range<usize>,
    pub radius: f64,
}

/// Numbers that are not known, but bounded; and some at the end that are zero, up to a multiple of what is taken at once.
pub(crate) struct Unknowns {
    pub sizes: Vec<f64>,
    /// Sizes of the unknowns that are bounded alone, zero for the others.
    alone: Vec<f64>,
    /// By the first unknown of every two that are bounded together, zero for the others: their sizes, and the radius.
    pairs: [Vec<f64>; 3],
    /// The first unknowns, beyond which none are bounded in twos.
    paired: usize,
    /// What more than two unknowns are bounded by together.
    groups: Vec<Group>,
}

impl Unknowns {
    /// By their sizes, in groups.
    pub fn new(mut sizes: Vec<f64>, groups: impl Iterator<Item = Group>) -> Self {
        sizes.resize(sizes.len().next_multiple_of(AT_ONCE), 0.0);
        let groups: Vec<Group> = groups.filter(|group| group.range.len() > 1 && group.radius.is_finite()).collect();
        let (mut alone, mut pairs) = (sizes.clone(), [(); 3].map(|()| vec![0.0; sizes.len()]));
        for group in &groups {
            alone[group.range.clone()].fill(0.0);
            if let &[first, second] = &sizes[group.range.clone()] {
                pairs.iter_mut().zip([first, second, group.radius]).for_each(|(of, x)| of[group.range.start] = x);
            }
        }
        let paired =
            groups.iter().filter(|group| group.range.len() == 2).map(|group| group.range.end).max().unwrap_or(0);
        let groups = groups.into_iter().filter(|group| group.range.len() > 2).collect();
        Self { sizes, alone, pairs, paired, groups }
    }

    /// What these numbers times the unknowns reach.
    pub fn reach(&self, coefficients: &[f64]) -> f64 {
        dispatch(Reach { unknowns: self, coefficients })
    }
}

/// Numbers times factors, added to others: the factors, and where the numbers of each begin.
pub(super) struct Sum<'a> {
    pub onto: &'a mut [f64],
    pub terms: &'a [(f64, usize)],
    pub numbers: &'a [f64],
}

impl Sum<'_> {
    /// The next so many numbers of it, term after term.
    #[inline(always)]
    fn take<const N: usize>(&mut self, first: usize) -> usize {
        let onto = &mut self.onto[first..first + N];
        let mut sums = [0.0; N];
        sums.copy_from_slice(onto);
        for &(factor, place) in self.terms {
            let of = &self.numbers[place + first..][..N];
            for k in 0..N {
                sums[k] += factor * of[k];
            }
        }
        onto.copy_from_slice(&sums);
        first + N
    }
}

impl Kernel for Sum<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let mut first = 0;
        while first + WIDE <= self.onto.len() {
            first = self.take::<WIDE>(first);
        }
        while first < self.onto.len() {
            first = self.take::<AT_ONCE>(first);
        }
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
        let (c, Unknowns { sizes, alone, pairs: [first, second, radius], paired, groups }) =
            (self.coefficients, self.unknowns);
        let smaller = |a: f64, b: f64| if b < a { b } else { a };
        let of_more = |group: &Group| {
            let of = &c[group.range.clone()];
            let apart: f64 = of.iter().zip(&sizes[group.range.clone()]).map(|(c, size)| c.abs() * size).sum();
            smaller(apart, norm(of) * group.radius)
        };
        let mut sums = [0.0; AT_ONCE];
        for at in (0..c.len()).step_by(AT_ONCE) {
            let [a, alone] = [block(c, at), block(alone, at)];
            if at >= *paired {
                for k in 0..AT_ONCE {
                    sums[k] += a[k].abs() * alone[k];
                }
                continue;
            }
            let [first, second, radius] = [block(first, at), block(second, at), block(radius, at)];
            // No two begin at the last number.
            let last = at + AT_ONCE == c.len();
            let b = if last {
                std::array::from_fn(|k| if k + 1 < AT_ONCE { a[k + 1] } else { 0.0 })
            } else {
                block(c, at + 1)
            };
            for k in 0..AT_ONCE {
                let apart = a[k].abs() * first[k] + b[k].abs() * second[k];
                let together = (a[k] * a[k] + b[k] * b[k]).sqrt() * radius[k];
                sums[k] += a[k].abs() * alone[k] + smaller(apart, together);
            }
        }
        sums.iter().sum::<f64>() + groups.iter().map(of_more).sum::<f64>()
    }
}

/// The numbers from a place on that are taken at once.
#[inline(always)]
fn block(numbers: &[f64], at: usize) -> [f64; AT_ONCE] {
    let numbers = &numbers[at..at + AT_ONCE];
    std::array::from_fn(|k| numbers[k])
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
