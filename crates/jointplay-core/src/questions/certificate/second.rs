//! Functions by their derivatives: what they gain on the way from a point to another, to second order.
//!
//! Where the derivative of a function at `x0 + d` is `g + A d`, give or take r in every component, the function gains
//!
//! ```text
//! g . d + d . A d / 2        give or take sum r |d|
//! ```
//!
//! On a product of balls `|d_b - c_b| <= R_b` a quadratic function is not above its Lagrangian dual,
//!
//! ```text
//! g . d + d . A d / 2 <= g . c + c . A c / 2 + sum l_b R_b^2 / 2 + h . (L - A)^-1 h / 2       h = g + A c
//! ```
//!
//! for all l with `L - A` positive definite, L having `l_b` on the diagonal of each block. It is where
//! `l_b R_b > sum over a of |A_ba| R_a` (Gershgorin, by blocks, the coordinates in units of R). The best l has
//! `l_b R_b = |h + A s|_b` at the maximum s. Where curvature times size is small against the gradient, that is the maximum
//! itself. The inverse is not needed: for any s, with `t = h - (L - A) s`,
//!
//! ```text
//! h . (L - A)^-1 h = 2 h . s - s . (L - A) s + t . (L - A)^-1 t,     L - A >= l_b - sum over a of |A_ba| R_a / R_b
//! ```
//!
//! Where there are slabs, `t = m . x` and any multiple of `(t - t0) - m . d` is zero: the bound holds with `g + k (-m, 1)` for
//! every k and is convex in k; its derivative is what the place of the maximum is ahead of its offsets.

use crate::math::interval::Interval;
use crate::math::lanes::{Kernel, dispatch};
use crate::math::vector::{inner, norm};
use crate::questions::certificate::blocks::{Block, Part, Product};

/// What sums of non-negative numbers are raised by, and what all other sums may be off by as a part of their terms.
const RAISED: f64 = 1.0 + 1e-12;
const ROUNDING: f64 = 1e-12;
/// Steps to the maximum.
const STEPS: usize = 5;
/// How far multipliers are kept from where the quadratic function has no maximum.
const APART: f64 = 1.25;
/// Rounds through the multipliers of slabs, and how often each is changed in one.
const SWEEPS: usize = 2;
const TRIED: usize = 5;
/// A multiplier is not changed where its derivative, a part of the sets' extent, is smaller.
const SETTLED: f64 = 0.003;
/// Blocks are not taken for smaller than this.
const SMALLEST: f64 = 1e-12;

/// Numbers that are summed while they are in registers.
const AT_ONCE: usize = 32;

/// A sum of lists times factors.
struct Weighted<'a> {
    onto: &'a mut [f64],
    lists: &'a [&'a [f64]],
    factors: &'a [f64],
}

impl Kernel for Weighted<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (at, onto) in self.onto.chunks_mut(AT_ONCE).enumerate() {
            onto.fill(0.0);
            for (list, factor) in self.lists.iter().zip(self.factors) {
                let list = &list[at * AT_ONCE..][..onto.len()];
                onto.iter_mut().zip(list).for_each(|(sum, x)| *sum += factor * x);
            }
        }
    }
}

/// A symmetric matrix times a vector.
struct Times<'a> {
    onto: &'a mut [f64],
    matrix: &'a [f64],
    by: &'a [f64],
}

impl Kernel for Times<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (row, by) in self.matrix.chunks_exact(self.by.len().max(1)).zip(self.by).filter(|(_, by)| **by != 0.0) {
            self.onto.iter_mut().zip(row).for_each(|(sum, x)| *sum += by * x);
        }
    }
}

/// A function's derivative: its value at the point, its own derivative, and what it is off by.
#[derive(Clone, Debug, Default)]
pub(super) struct Second {
    gradient: Vec<f64>,
    /// The symmetric part of the derivative, row by row; how much every two blocks of it bend at most; and what every row
    /// comes to.
    curvature: Vec<f64>,
    blocks: Vec<f64>,
    rows: Vec<f64>,
    rest: Vec<f64>,
}

impl Second {
    /// By value, derivative and rest of every component of the derivative, written about a base: as they are at a point.
    /// Nothing of none.
    pub fn of(
        product: &Product,
        (point, base): (&[f64], &[f64]),
        derivative: impl Iterator<Item = (f64, Vec<f64>, f64)>,
    ) -> Self {
        let mut second = Self::default();
        let mut curvature = Vec::new();
        let moved: Vec<f64> = point.iter().zip(base).map(|(point, base)| point - base).collect();
        let is_moved = moved.iter().any(|x| *x != 0.0);
        for (mut centre, row, mut rest) in derivative {
            if is_moved {
                let size: f64 = row.iter().zip(&moved).map(|(a, x)| (a * x).abs()).sum();
                rest += ROUNDING * (centre.abs() + size);
                centre += inner(&row, &moved);
            }
            second.gradient.push(centre);
            curvature.extend(row);
            second.rest.push(rest);
        }
        let n = second.gradient.len();
        if n == 0 {
            return second;
        }
        for k in 0..n {
            for l in 0..k {
                let mean = 0.5 * (curvature[k * n + l] + curvature[l * n + k]);
                (curvature[k * n + l], curvature[l * n + k]) = (mean, mean);
            }
        }
        second.rows = curvature.chunks_exact(n).map(|row| row.iter().map(|a| a.abs()).sum()).collect();
        for a in &product.blocks {
            for b in &product.blocks {
                let rows = a.range().map(|k| &curvature[k * n..(k + 1) * n][b.range()]);
                let square: f64 = rows.map(|row| inner(row, row)).sum();
                second.blocks.push(square.sqrt() * RAISED);
            }
        }
        second.curvature = curvature;
        second
    }

    /// Makes it a sum of functions times numbers.
    pub fn set_to_sum(&mut self, functions: &[Self], factors: &[f64]) {
        let sizes: Vec<f64> = factors.iter().map(|factor| factor.abs() * RAISED).collect();
        let add = |sum: &mut Vec<f64>, list: fn(&Self) -> &Vec<f64>, factors: &[f64]| {
            let lists: Vec<&[f64]> = functions.iter().map(|f| &list(f)[..]).collect();
            sum.resize(lists[0].len(), 0.0);
            dispatch(Weighted { onto: sum, lists: &lists, factors });
        };
        add(&mut self.gradient, |f| &f.gradient, factors);
        add(&mut self.curvature, |f| &f.curvature, factors);
        add(&mut self.blocks, |f| &f.blocks, &sizes);
        add(&mut self.rows, |f| &f.rows, &sizes);
        add(&mut self.rest, |f| &f.rest, &sizes);
        for (f, size) in functions.iter().zip(&sizes) {
            for (k, rest) in self.rest.iter_mut().enumerate() {
                // No coordinate of a unit ball is farther from another than 2.
                *rest += size * ROUNDING * (f.gradient[k].abs() + 4.0 * f.rows[k]);
            }
        }
    }

    /// The curvature times a vector.
    fn bend(&self, d: &[f64]) -> Vec<f64> {
        let mut bent = vec![0.0; d.len()];
        dispatch(Times { onto: &mut bent, matrix: &self.curvature, by: d });
        bent
    }

    /// What the rests come to on a part: by coordinate, or by block where that is less.
    fn rests(&self, product: &Product, part: &Part, from: &[f64]) -> f64 {
        let far = |k: usize| (part.x[k].hull(Interval::from_point(from[k])) - Interval::from_point(from[k])).size();
        let of = |block: &Block| {
            let apart: f64 = block.range().map(|k| self.rest[k] * far(k)).sum();
            apart.min(norm(&self.rest[block.range()]) * block.reach(part, from))
        };
        product.blocks.iter().map(of).sum::<f64>() * RAISED
    }

    /// By coordinate, how much the derivative changes along it on a part, times what the coordinates go: what is left of a
    /// bound comes from these changes.
    pub fn costs(&self, part: &Part) -> Vec<f64> {
        let widths: Vec<f64> = part.x.iter().map(|x| x.width()).collect();
        let cost = |(k, row): (usize, &[f64])| {
            let bent: f64 = row.iter().zip(&widths).map(|(a, width)| a.abs() * width).sum();
            widths[k] * (bent + self.rest[k])
        };
        self.curvature.chunks_exact(widths.len().max(1)).enumerate().map(cost).collect()
    }

    /// What the function does not change by on a part, and on the lines to it from the point.
    pub fn reach(&self, product: &Product, part: &Part, from: &[f64]) -> f64 {
        let radii: Vec<f64> = product.blocks.iter().map(|block| block.reach(part, from)).collect();
        let bent: f64 =
            self.blocks.chunks_exact(radii.len().max(1)).zip(&radii).map(|(row, r)| r * inner(row, &radii)).sum();
        let along = |(block, r): (&Block, &f64)| r * norm(&self.gradient[block.range()]);
        let straight: f64 = product.blocks.iter().zip(&radii).map(along).sum();
        (straight + 0.5 * bent + self.rests(product, part, from)) * RAISED
    }

    /// What the function does not gain more than on a part: in its balls as a whole, or in balls around what is left of them.
    /// In whole balls what is linear is exact; in smaller ones there is less curvature. Below `enough` no closer bound is
    /// sought.
    pub fn most(&self, product: &Product, part: &Part, from: &[f64], enough: f64) -> f64 {
        let rests = self.rests(product, part, from);
        let most_in = |is_left| {
            let balls = Balls::of(product, part, from, is_left);
            let steps = &self.gradient[product.n..];
            least(steps, enough - rests, |l| self.most_in(product, part, from, &balls, l))
        };
        let bent = if product.is_smaller(part) { most_in(false).min(most_in(true)) } else { most_in(false) };
        bent + rests
    }

    /// The bound without the rests for given multipliers of the places in slabs, and by how much the place of the maximum is
    /// ahead of where its offsets are: the derivative along each multiplier.
    fn most_in(&self, product: &Product, part: &Part, from: &[f64], balls: &Balls, l: &[f64]) -> (f64, Vec<f64>) {
        let (n_blocks, slabs) = (product.blocks.len(), &product.slabs);
        let Balls { centre: c, radii, are_polytopes } = balls;
        let (mut g, mut beside) = (self.gradient.clone(), 0.0);
        let off = slabs.shift(l, &mut g);
        for number in (0..n_blocks).filter(|&number| are_polytopes[number]) {
            // A polytope: what is linear in it, exactly; what bends, in a ball.
            let (block, straight) = (&product.blocks[number], g.iter().map(|&g| Interval::from_point(g)));
            beside += block.support(part, number, &straight.collect::<Vec<_>>(), from);
            g[block.range()].fill(0.0);
        }
        let bent_c = self.bend(c);
        let h: Vec<f64> = g.iter().zip(&bent_c).map(|(g, b)| g + b).collect();
        let sizes = &self.blocks;
        let least: Vec<f64> =
            (0..n_blocks).map(|b| inner(&sizes[b * n_blocks..(b + 1) * n_blocks], radii) / radii[b] * RAISED).collect();
        let (mut s, mut t, mut l) = (vec![0.0; from.len()], h.clone(), vec![0.0; n_blocks]);
        for _ in 0..STEPS {
            for (b, block) in product.blocks.iter().enumerate() {
                l[b] = (norm(&t[block.range()]) / radii[b]).max(APART * least[b]) + f64::MIN_POSITIVE;
                block.range().for_each(|k| s[k] = t[k] / l[b]);
            }
            t = self.bend(&s).iter().zip(&h).map(|(b, h)| h + b).collect();
        }
        let (mut sum, mut weight) = (inner(&g, c) + 0.5 * inner(c, &bent_c), 0.0);
        for (b, block) in product.blocks.iter().enumerate() {
            for k in block.range() {
                let left = t[k] - l[b] * s[k];
                sum += 0.5 * (h[k] + left) * s[k] + 0.5 * left * left / (l[b] - least[b]);
                weight += g[k].abs() * c[k].abs() + 4.0 * h[k].abs() * s[k].abs();
            }
            sum += 0.5 * l[b] * radii[b].powi(2);
            weight += (l[b] + 4.0 * least[b]) * radii[b].powi(2);
        }
        s.iter_mut().zip(c).for_each(|(s, c)| *s += c);
        (sum + ROUNDING * (weight + inner(c, &bent_c).abs()) + beside * RAISED + off, slabs.ahead_of(&s))
    }
}

/// Balls around the blocks of a part: their middles as seen from a point, and their radii. What is linear in a polytope is
/// bounded apart.
struct Balls {
    centre: Vec<f64>,
    radii: Vec<f64>,
    are_polytopes: Vec<bool>,
}

impl Balls {
    fn of(product: &Product, part: &Part, from: &[f64], is_left: bool) -> Self {
        let mut balls = Self { centre: vec![0.0; from.len()], radii: Vec::new(), are_polytopes: Vec::new() };
        for block in &product.blocks {
            let ball = block.ball(part, from, is_left);
            balls.are_polytopes.push(ball.is_none());
            let (centre, radius) = ball.unwrap_or_else(|| (vec![0.0; block.size], block.reach(part, from)));
            balls.centre[block.range()].copy_from_slice(&centre);
            balls.radii.push(radius.max(SMALLEST));
        }
        balls
    }
}

/// The least of the bounds for some multipliers of the places in slabs, by these and their derivatives: a convex function,
/// one multiplier after the other by false position, with these first steps.
fn least(steps: &[f64], enough: f64, bound: impl Fn(&[f64]) -> (f64, Vec<f64>)) -> f64 {
    let mut l = vec![0.0; steps.len()];
    let (mut best, mut slope) = bound(&l);
    for k in (0..steps.len()).cycle().take(SWEEPS * steps.len()) {
        // Where it falls and where it rises.
        let mut ends = [(l[k], slope[k]), (f64::NAN, 0.0)];
        let mut step = -slope[k].signum() * steps[k].abs();
        for _ in 0..TRIED {
            if best <= enough || slope[k].abs() < SETTLED || step == 0.0 {
                break;
            }
            let [(a, fa), (b, fb)] = ends;
            let next = if b.is_nan() { a + step } else { a - fa * (b - a) / (fb - fa) };
            step *= 2.0;
            let mut tried = l.clone();
            tried[k] = next;
            let (found, derivatives) = bound(&tried);
            if found < best {
                (best, l, slope) = (found, tried, derivatives.clone());
            }
            let f = derivatives[k];
            // An end that stays counts half, so that it moves, too.
            ends = [(next, f), if f * fa > 0.0 { (b, 0.5 * fb) } else { (a, fa) }];
        }
    }
    best
}
