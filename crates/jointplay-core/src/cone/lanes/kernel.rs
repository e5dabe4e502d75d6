//! Mehrotra's predictor-corrector method (SIAM J. Optim. 2, 1992, 575) on eight programs at a time.
//!
//! In coordinates p of the sets and with the deformations of the springs eliminated, a program is
//!
//! minimise `c . p + 1/2 y' S y`  subject to  `E p + S y = f`,  `tau h - G p` in K
//!
//! with the multipliers y, `S` the springs' compliance as the equations see it, and `tau = 1`; or `c = 0`,
//! `S = 0` and a variable factor tau that is minimised. A step of Newton's method on the conditions for an
//! optimum, scaled as Nesterov and Todd do, is eliminated down to as many unknowns as there are equations:
//!
//! `(E H^-1 E' + S + q q' / k) dy = f - E p - S y - E z + E H^-1 r + q a / k`
//!
//! with `H = G' W^-2 G`, the residual `r = c - E' y + G' l`, the target u of the slacks and `z = -H^-1 G' W^-2 u`,
//! and for a variable factor `x = H^-1 G' W^-2 h`, `q = E x`, `k = h' W^-2 h - x' H x + l_t / tau` and
//! `a = x . r + 1 - h . l - l_t - (h - G x)' W^-2 u - (l_t / tau) u_t`. All programs do the same operations;
//! one that has come to an end keeps what it has.

use crate::cone::lanes::cones::Cone;
use crate::cone::lanes::normal::{ROWS, add_transposed, factor, products, solve, times, triangle};
use crate::cone::lanes::state::{Data, State, of};
use crate::cone::lanes::vector::{Choice, V, dot};
use crate::math::lanes::simd::Kernel;

/// Iterations at most: eight programs are rarely done after more than 16.
const ITERATIONS: usize = 32;
/// Gap, in units of energy or of the factor, at which a program has come to an end: below it rounding
/// decides how far a point is from the boundary of a round set.
const GAP: V = V::splat(1e-11);
/// Largest residual at the end, in the same units and in those of the equations.
const RESIDUAL: V = V::splat(1e-11);
/// A step that is no number any more, or on its way there.
const LOST: V = V::splat(1e30);
/// Part of the way to the boundary that a step leaves: of what the step to the boundary itself has to leave, and at
/// most.
const MARGIN_OF_REST: V = V::splat(0.3);
const MARGIN: V = V::splat(0.05);

/// Solves eight programs.
pub(super) struct Solve<'a> {
    pub cones: &'a [Cone],
    pub data: &'a Data,
    pub state: &'a mut State,
    /// Whether the factor on the clearances is minimised.
    pub variable: bool,
}

impl Kernel for Solve<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(mut self) -> usize {
        self.start();
        let mut open = Choice::ALL;
        for iteration in 0..ITERATIONS {
            open = open.and(self.judge());
            if !open.any() {
                return iteration;
            }
            self.scale();
            self.aim();
            let mut target = -self.state.factor;
            let (mut limit, mut step, mut rest) = (V::ONE, V::ZERO, V::ONE);
            // A number of passes that the compiler does not know, so that it compiles the step once.
            for pass in 0..std::hint::black_box(2) {
                if pass == 1 {
                    rest = V::ONE - V::ONE / limit.max(V::ONE);
                    target = self.aim_again(rest * self.mean(), step);
                }
                (limit, step) = self.step(target);
            }
            open = open.and(self.is_finite());
            let most = V::ONE - (MARGIN_OF_REST * rest).min(MARGIN);
            self.advance(most / limit.max(most), step, target, open);
        }
        ITERATIONS
    }
}

impl Solve<'_> {
    /// The sum of slacks times multipliers.
    #[inline(always)]
    fn gap(&self) -> V {
        let gap = dot(&self.state.s, &self.state.l);
        if self.variable { self.state.factor.times_plus(self.state.factor_multiplier, gap) } else { gap }
    }

    #[inline(always)]
    fn mean(&self) -> V {
        let degree: usize = self.cones.iter().map(Cone::degree).sum();
        self.gap() * V::splat(1.0 / (degree + usize::from(self.variable)) as f64)
    }

    /// Residuals; the programs that have not come to an end.
    #[inline(always)]
    fn judge(&mut self) -> Choice {
        let (data, n) = (self.data, self.data.n);
        let st = &mut *self.state;
        for cone in self.cones {
            cone.pull(&of!(cone, data.sizes, sizes), &of!(cone, st.l, slots), &mut of!(cone, st.left, coordinates));
        }
        for ((left, cost), stress) in st.left.iter_mut().zip(&data.cost).zip(&st.stress) {
            *left = *left + *cost - *stress;
        }
        times(&data.e, n, &st.p, |i, sum| st.residual[i] = data.right[i] - sum);
        let mut worst = V::ZERO;
        for i in 0..data.s {
            if !data.springs.is_empty() {
                st.residual[i] = st.residual[i] - dot(&data.springs[i * data.s..(i + 1) * data.s], &st.y);
            }
            worst = st.residual[i].abs().max(worst);
        }
        for left in &st.left {
            worst = left.abs().max(worst);
        }
        if self.variable {
            st.factor_left = V::ONE - st.factor_multiplier;
            for cone in self.cones.iter().filter(|cone| cone.scaled) {
                let sizes = &of!(cone, data.sizes, sizes);
                for (slot, l) in of!(cone, st.l, slots).iter().enumerate() {
                    st.factor_left = cone.bound(sizes, slot).times_from(*l, st.factor_left);
                }
            }
            worst = st.factor_left.abs().max(worst);
        }
        let size = if self.variable { self.state.factor } else { dot(&data.cost, &self.state.p).abs() };
        let gap = self.gap();
        let done = gap.below(GAP * (V::ONE + size)).and(worst.below(RESIDUAL * (V::ONE + size)));
        done.not()
    }

    /// Scaling, and the factored normal equations.
    #[inline(always)]
    fn scale(&mut self) {
        let (data, s, n) = (self.data, self.data.s, self.data.n);
        let st = &mut *self.state;
        let mut stiffness = st.factor_multiplier / st.factor;
        for cone in self.cones {
            let sizes = &of!(cone, data.sizes, sizes);
            let scaling = &mut of!(cone, st.scaling, scaling);
            let at = cone.slot..cone.slot + cone.slots();
            let numbers = [&st.s[at.clone()], &st.l[at.clone()]];
            cone.scale(sizes, numbers, [&mut st.inv_s[at.clone()], &mut st.inv_l[at]], scaling);
            cone.inverse(scaling, &of!(cone, st.left, coordinates), &mut of!(cone, st.moved, coordinates));
            if self.variable && cone.scaled {
                stiffness = stiffness + cone.follow(sizes, scaling, &mut of!(cone, st.follow, coordinates));
            }
        }
        for i in (0..s).step_by(ROWS) {
            let e = &data.e[i * n..s.min(i + ROWS) * n];
            let g = &mut st.g[..e.len()];
            for cone in self.cones {
                cone.inverse_rows(&of!(cone, st.scaling, scaling), n, e, g);
            }
            products(n, g, &data.e, i, &mut st.matrix);
        }
        add_springs(s, &data.springs, &mut st.matrix);
        if self.variable {
            let per = V::ONE / stiffness;
            st.per_stiffness = per;
            for i in 0..s {
                st.q[i] = dot(&data.e[i * n..(i + 1) * n], &st.follow);
            }
            for i in 0..s {
                let part = per * st.q[i];
                for j in 0..=i {
                    let at = triangle(i) + j;
                    st.matrix[at] = part.times_plus(st.q[j], st.matrix[at]);
                }
            }
        }
        factor(s, &mut st.matrix, &mut st.columns);
    }

    /// Aims at the boundary.
    #[inline(always)]
    fn aim(&mut self) {
        let st = &mut *self.state;
        for (target, s) in st.target.iter_mut().zip(&st.s) {
            *target = -*s;
        }
    }

    /// Aims at the point on the central path that the step to the boundary suggests, with corrections of
    /// second order; gives the target of the factor.
    #[inline(always)]
    fn aim_again(&mut self, centre: V, factor_step: V) -> V {
        let multiplier_step = self.multiplier_step(factor_step, -self.state.factor);
        let st = &mut *self.state;
        for cone in self.cones {
            let at = cone.slot..cone.slot + cone.slots();
            cone.target(
                &of!(cone, st.scaling, scaling),
                [&st.s[at.clone()], &st.l[at.clone()], &st.inv_l[at.clone()], &st.ds[at.clone()], &st.dl[at.clone()]],
                centre,
                &mut st.target[at],
            );
        }
        factor_step.times_from(multiplier_step, centre) / st.factor_multiplier - st.factor
    }

    /// The step to the target: the inverse of its longest length, and the factor's.
    #[inline(always)]
    fn step(&mut self, factor_target: V) -> (V, V) {
        let (data, s, n) = (self.data, self.data.s, self.data.n);
        let st = &mut *self.state;
        let mut a = V::ZERO;
        if self.variable {
            a = st.factor_left + dot(&st.follow, &st.left);
            a = (st.factor_multiplier / st.factor).times_from(factor_target, a);
        }
        for cone in self.cones {
            let sizes = &of!(cone, data.sizes, sizes);
            let scaling = &of!(cone, st.scaling, scaling);
            let target = &of!(cone, st.target, slots);
            cone.approach(sizes, scaling, target, &mut of!(cone, st.approach, coordinates));
            if self.variable && cone.scaled {
                a = a - cone.approach_factor(sizes, scaling, &of!(cone, st.follow, coordinates), target);
            }
        }
        for ((force, approach), moved) in st.force.iter_mut().zip(&st.approach).zip(&st.moved) {
            *force = *moved - *approach;
        }
        times(&data.e, n, &st.force, |i, sum| st.dy[i] = st.residual[i] + sum);
        if self.variable {
            for i in 0..s {
                st.dy[i] = st.q[i].times_plus(a * st.per_stiffness, st.dy[i]);
            }
        }
        self.solve();
        let st = &mut *self.state;
        let factor_step = if self.variable { (dot(&st.q, &st.dy) - a) * st.per_stiffness } else { V::ZERO };
        for (force, left) in st.force.iter_mut().zip(&st.left) {
            *force = -*left;
        }
        add_transposed(&data.e, &st.dy, &mut st.force);
        let mut limit = V::ZERO;
        for cone in self.cones {
            let sizes = &of!(cone, data.sizes, sizes);
            let scaling = &of!(cone, st.scaling, scaling);
            let force = &of!(cone, st.force, coordinates);
            let factor = if self.variable && cone.scaled { factor_step } else { V::ZERO };
            let aims = [
                &of!(cone, st.target, slots),
                force,
                &of!(cone, st.approach, coordinates),
                &of!(cone, st.follow, coordinates),
            ];
            let at = [
                &of!(cone, st.s, slots),
                &of!(cone, st.inv_s, slots),
                &of!(cone, st.l, slots),
                &of!(cone, st.inv_l, slots),
            ];
            let steps =
                [&mut of!(cone, st.dp, coordinates), &mut of!(cone, st.ds, slots), &mut of!(cone, st.dl, slots)];
            limit = cone.step(sizes, scaling, aims, factor, at, steps).max(limit);
        }
        if self.variable {
            let multiplier_step = self.multiplier_step(factor_step, factor_target);
            limit = (-factor_step / self.state.factor).max(limit);
            limit = (-multiplier_step / self.state.factor_multiplier).max(limit);
        }
        (limit, factor_step)
    }

    /// Solves the normal equations for `dy`.
    ///
    /// For the factor more parts of the sets are met at the same time than there are ways to move along them, the more
    /// so the more equations there are for every coordinate. The normal equations get so bad near the optimum that
    /// their solution violates the equations; one step of refinement, by the equations themselves, mends it.
    #[inline(always)]
    fn solve(&mut self) {
        let (data, s, n) = (self.data, self.data.s, self.data.n);
        let st = &mut *self.state;
        if !self.variable || 2 * s <= n {
            solve(s, &st.matrix, &mut st.dy);
            return;
        }
        st.columns[..s].copy_from_slice(&st.dy);
        solve(s, &st.matrix, &mut st.dy);
        st.force.fill(V::ZERO);
        add_transposed(&data.e, &st.dy, &mut st.force);
        for cone in self.cones {
            let scaling = &of!(cone, st.scaling, scaling);
            cone.inverse(scaling, &of!(cone, st.force, coordinates), &mut of!(cone, st.dp, coordinates));
        }
        let part = dot(&st.q, &st.dy) * st.per_stiffness;
        times(&data.e, n, &st.dp, |i, sum| st.columns[i] = part.times_from(st.q[i], st.columns[i] - sum));
        solve(s, &st.matrix, &mut st.columns[..s]);
        for (dy, more) in st.dy.iter_mut().zip(&st.columns) {
            *dy = *dy + *more;
        }
    }

    /// Step of the multiplier of `tau >= 0`.
    #[inline(always)]
    fn multiplier_step(&self, factor_step: V, factor_target: V) -> V {
        self.state.factor_multiplier / self.state.factor * (factor_target - factor_step)
    }

    /// The programs whose step consists of numbers. The others keep what they have, which is as near to
    /// an optimum as rounding allows, or proves nothing.
    #[inline(always)]
    fn is_finite(&self) -> Choice {
        let st = &*self.state;
        let size = dot(&st.dy, &st.dy) + dot(&st.ds, &st.ds) + dot(&st.dl, &st.dl);
        size.below(LOST)
    }

    /// Goes on in the open programs.
    #[inline(always)]
    fn advance(&mut self, length: V, factor_step: V, factor_target: V, open: Choice) {
        let multiplier_step = self.multiplier_step(factor_step, factor_target);
        let st = &mut *self.state;
        for (force, left) in st.force.iter_mut().zip(&st.left) {
            *force = *force + *left;
        }
        go(&mut st.stress, &st.force, length, open);
        go(&mut st.p, &st.dp, length, open);
        go(&mut st.y, &st.dy, length, open);
        go(&mut st.s, &st.ds, length, open);
        go(&mut st.l, &st.dl, length, open);
        if self.variable {
            st.factor = length.times_plus(factor_step, st.factor).where_else(open, st.factor);
            st.factor_multiplier =
                length.times_plus(multiplier_step, st.factor_multiplier).where_else(open, st.factor_multiplier);
        }
    }
}

#[inline(always)]
fn go(x: &mut [V], dx: &[V], length: V, open: Choice) {
    for (x, dx) in x.iter_mut().zip(dx) {
        *x = length.times_plus(*dx, *x).where_else(open, *x);
    }
}

/// Adds what the springs do to the lower triangle of the normal equations.
#[inline(always)]
pub(super) fn add_springs(s: usize, springs: &[V], matrix: &mut [V]) {
    for (i, row) in springs.chunks_exact(s).enumerate() {
        for (out, spring) in matrix[triangle(i)..].iter_mut().zip(&row[..=i]) {
            *out = *out + *spring;
        }
    }
}
