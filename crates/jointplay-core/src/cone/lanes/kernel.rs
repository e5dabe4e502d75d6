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

use super::cones::Cone;
use super::normal::{factor, products, solve};
use super::state::{Data, State};
use super::vector::{Choice, V, dot};
use crate::batch::simd::Kernel;
use crate::cone::own::Atom;

/// Iterations at most: eight programs are rarely done after more than 16.
const ITERATIONS: usize = 32;
/// Gap, in units of energy or of the factor, at which a program has come to an end: below it rounding
/// decides how far a point is from the boundary of a round set.
const GAP: V = V::splat(1e-11);
/// Largest residual at the end, in the same units and in those of the equations.
const RESIDUAL: V = V::splat(1e-11);
/// A step that is no number any more, or on its way there.
const LOST: V = V::splat(1e30);
/// Part of the way to the boundary that a step goes.
const STEP: V = V::splat(0.99);

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
            let (mut limit, mut step) = (V::ONE, V::ZERO);
            // A number of passes that the compiler does not know, so that it compiles the step once.
            for pass in 0..std::hint::black_box(2) {
                if pass == 1 {
                    let rest = V::ONE - V::ONE / limit.max(V::ONE);
                    let centre = rest * rest * rest * self.mean();
                    target = self.aim_again(centre, step);
                }
                (limit, step) = self.step(target);
            }
            open = open.and(self.is_finite());
            self.advance(STEP / limit.max(STEP), step, target, open);
        }
        ITERATIONS
    }
}

/// The numbers of one cone in an array.
macro_rules! of {
    ($cone:ident, $array:expr, slots) => {
        $array[$cone.slot..$cone.slot + $cone.slots()]
    };
    ($cone:ident, $array:expr, coordinates) => {
        $array[$cone.first..$cone.first + $cone.dimension()]
    };
    ($cone:ident, $array:expr, scaling) => {
        $array[$cone.data..$cone.data + $cone.data_size()]
    };
    ($cone:ident, $array:expr, sizes) => {
        $array[$cone.size..$cone.size + $cone.sizes()]
    };
}

impl Solve<'_> {
    /// A point inside all sets, and multipliers near the middle of theirs.
    #[inline(always)]
    fn start(&mut self) {
        let (s, n) = (self.data.s, self.data.n);
        let slots = self.cones.iter().map(Cone::slots).sum();
        let scaling = self.cones.iter().map(Cone::data_size).sum();
        let st = &mut *self.state;
        for (array, size) in [
            (&mut st.p, n),
            (&mut st.y, s),
            (&mut st.s, slots),
            (&mut st.l, slots),
            (&mut st.per_s, slots),
            (&mut st.per_l, slots),
            (&mut st.ds, slots),
            (&mut st.dl, slots),
            (&mut st.target, slots),
            (&mut st.approach, n),
            (&mut st.scaling, scaling),
            (&mut st.g, s * n),
            (&mut st.matrix, s * s),
            (&mut st.left, n),
            (&mut st.force, n),
            (&mut st.dp, n),
            (&mut st.dy, s),
            (&mut st.follow, n),
            (&mut st.q, s),
            (&mut st.residual, s),
        ] {
            array.resize(size, V::ZERO);
        }
        st.y.fill(V::ZERO);
        st.follow.fill(V::ZERO);
        let degree: usize = self.cones.iter().map(Cone::degree).sum();
        // The multipliers of a variable factor add up to one.
        let (factor, multiplier) =
            if self.variable { (V::splat(2.0), V::splat(1.0 / (1.0 + degree as f64))) } else { (V::ONE, V::ONE) };
        st.factor = factor;
        st.factor_multiplier = multiplier;
        for cone in self.cones {
            let sizes = &of!(cone, self.data.sizes, sizes);
            let factor = if cone.scaled { factor } else { V::ONE };
            let p = &mut of!(cone, st.p, coordinates);
            cone.start(sizes, factor, p);
            cone.slack(sizes, p, factor, &mut of!(cone, st.s, slots));
            let l = &mut of!(cone, st.l, slots);
            if let Atom::Round { .. } = cone.atom {
                l.fill(V::ZERO);
                l[0] = multiplier;
            } else {
                l.fill(multiplier);
            }
        }
    }

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
        for (left, cost) in st.left.iter_mut().zip(&data.cost) {
            *left = *left + *cost;
        }
        let mut worst = V::ZERO;
        for (i, row) in data.e.chunks_exact(n).enumerate() {
            let mut sum = data.right[i] - dot(row, &st.p);
            for (left, e) in st.left.iter_mut().zip(row) {
                *left = e.times_from(st.y[i], *left);
            }
            if !data.springs.is_empty() {
                sum = sum - dot(&data.springs[i * data.s..(i + 1) * data.s], &st.y);
            }
            st.residual[i] = sum;
            worst = sum.abs().max(worst);
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
            cone.scale(sizes, numbers, [&mut st.per_s[at.clone()], &mut st.per_l[at]], scaling);
            for i in 0..s {
                let at = i * n + cone.first..i * n + cone.first + cone.dimension();
                cone.inverse(scaling, &data.e[at.clone()], &mut st.g[at]);
            }
            if self.variable && cone.scaled {
                stiffness = stiffness + cone.follow(sizes, scaling, &mut of!(cone, st.follow, coordinates));
            }
        }
        products(n, &st.g, &data.e, &data.springs, &mut st.matrix);
        if self.variable {
            let per = V::ONE / stiffness;
            st.per_stiffness = per;
            for i in 0..s {
                st.q[i] = dot(&data.e[i * n..(i + 1) * n], &st.follow);
            }
            for i in 0..s {
                let part = per * st.q[i];
                for j in 0..=i {
                    st.matrix[i * s + j] = part.times_plus(st.q[j], st.matrix[i * s + j]);
                }
            }
        }
        factor(s, &mut st.matrix);
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
                [&st.s[at.clone()], &st.l[at.clone()], &st.per_l[at.clone()], &st.ds[at.clone()], &st.dl[at.clone()]],
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
        for i in 0..s {
            let at = i * n..(i + 1) * n;
            let mut sum = st.residual[i] - dot(&data.e[at.clone()], &st.approach);
            sum = sum + dot(&st.g[at], &st.left);
            if self.variable {
                sum = st.q[i].times_plus(a * st.per_stiffness, sum);
            }
            st.dy[i] = sum;
        }
        solve(s, &st.matrix, &mut st.dy);
        let factor_step = if self.variable { (dot(&st.q, &st.dy) - a) * st.per_stiffness } else { V::ZERO };
        for (force, left) in st.force.iter_mut().zip(&st.left) {
            *force = -*left;
        }
        for (row, dy) in data.e.chunks_exact(n).zip(&st.dy) {
            for (force, e) in st.force.iter_mut().zip(row) {
                *force = e.times_plus(*dy, *force);
            }
        }
        let mut limit = V::ZERO;
        for cone in self.cones {
            let sizes = &of!(cone, data.sizes, sizes);
            let scaling = &of!(cone, st.scaling, scaling);
            let force = &of!(cone, st.force, coordinates);
            let dp = &mut of!(cone, st.dp, coordinates);
            cone.inverse(scaling, force, dp);
            let mut factor = V::ZERO;
            if self.variable && cone.scaled {
                factor = factor_step;
            }
            for (k, dp) in dp.iter_mut().enumerate() {
                let at = cone.first + k;
                *dp = st.follow[at].times_plus(factor, *dp + st.approach[at]);
            }
            let (ds, dl) = (&mut of!(cone, st.ds, slots), &mut of!(cone, st.dl, slots));
            cone.slack(sizes, dp, factor, ds);
            cone.multipliers(sizes, scaling, [&of!(cone, st.target, slots), ds, force], dl);
            limit = cone.limit([&of!(cone, st.s, slots), &of!(cone, st.per_s, slots), ds], limit);
            limit = cone.limit([&of!(cone, st.l, slots), &of!(cone, st.per_l, slots), dl], limit);
        }
        if self.variable {
            let multiplier_step = self.multiplier_step(factor_step, factor_target);
            limit = (-factor_step / self.state.factor).max(limit);
            limit = (-multiplier_step / self.state.factor_multiplier).max(limit);
        }
        (limit, factor_step)
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
