//! Where the steps begin.
//!
//! For the pose: the self-stresses that make the reactions smallest, and every body on the central path of its own for
//! the reaction on it, `s o l = mu e`. Only the equations between the displacements are left to be fulfilled.

use crate::cone::bodies::Atom;
use crate::cone::lanes::cones::Cone;
use crate::cone::lanes::kernel::{Solve, add_springs};
use crate::cone::lanes::normal::{ROWS, add_transposed, factor, products, solve, times, triangle};
use crate::cone::lanes::state::of;
use crate::cone::lanes::vector::{V, dot_few};

/// The products of slacks and multipliers, in units of energy, of which the largest reaction's work is one.
const CENTRE: V = V::splat(0.3);

impl Solve<'_> {
    #[inline(always)]
    pub(super) fn start(&mut self) {
        self.make_room();
        self.state.y.fill(V::ZERO);
        self.state.stress.fill(V::ZERO);
        self.state.follow.fill(V::ZERO);
        if self.variable {
            self.start_inside();
        } else {
            self.start_balanced();
        }
    }

    #[inline(always)]
    fn make_room(&mut self) {
        let (s, n) = (self.data.s, self.data.n);
        let slots = self.cones.iter().map(Cone::slots).sum();
        let scaling = self.cones.iter().map(Cone::data_size).sum();
        let st = &mut *self.state;
        for (array, size) in [
            (&mut st.p, n),
            (&mut st.y, s),
            (&mut st.s, slots),
            (&mut st.l, slots),
            (&mut st.inv_s, slots),
            (&mut st.inv_l, slots),
            (&mut st.ds, slots),
            (&mut st.dl, slots),
            (&mut st.target, slots),
            (&mut st.approach, n),
            (&mut st.scaling, scaling),
            (&mut st.stress, n),
            (&mut st.g, ROWS * n),
            (&mut st.matrix, triangle(s)),
            (&mut st.columns, 2 * s),
            (&mut st.left, n),
            (&mut st.moved, n),
            (&mut st.force, n),
            (&mut st.dp, n),
            (&mut st.dy, s),
            (&mut st.follow, n),
            (&mut st.q, s),
            (&mut st.residual, s),
        ] {
            array.resize(size, V::ZERO);
        }
    }

    /// In the middle of all sets, made twice as large, with multipliers that add up to one.
    #[inline(always)]
    fn start_inside(&mut self) {
        let st = &mut *self.state;
        let degree: usize = self.cones.iter().map(Cone::degree).sum();
        let multiplier = V::splat(1.0 / (1.0 + degree as f64));
        (st.factor, st.factor_multiplier) = (V::splat(2.0), multiplier);
        for cone in self.cones {
            let sizes = &of!(cone, self.data.sizes, sizes);
            let factor = if cone.scaled { st.factor } else { V::ONE };
            let p = &mut of!(cone, st.p, coordinates);
            cone.middle(sizes, factor, p);
            cone.slack(sizes, p, factor, &mut of!(cone, st.s, slots));
            cone.even(multiplier, &mut of!(cone, st.l, slots));
        }
    }

    #[inline(always)]
    fn start_balanced(&mut self) {
        let (data, s, n) = (self.data, self.data.s, self.data.n);
        let st = &mut *self.state;
        (st.factor, st.factor_multiplier) = (V::ONE, V::ONE);
        for i in (0..s).step_by(ROWS) {
            products(n, &data.e[i * n..s.min(i + ROWS) * n], &data.e, i, &mut st.matrix);
        }
        add_springs(s, &data.springs, &mut st.matrix);
        factor(s, &mut st.matrix, &mut st.columns);
        times(&data.e, n, &data.cost, |i, sum| st.y[i] = sum);
        solve(s, &st.matrix, &mut st.y);
        add_transposed(&data.e, &st.y, &mut st.stress);
        for ((force, cost), stress) in st.force.iter_mut().zip(&data.cost).zip(&st.stress) {
            *force = *stress - *cost;
        }
        for cone in self.cones {
            let sizes = &of!(cone, data.sizes, sizes);
            let p = &mut of!(cone, st.p, coordinates);
            cone.rest(sizes, &of!(cone, st.force, coordinates), CENTRE, p, &mut of!(cone, st.l, slots));
            cone.slack(sizes, p, V::ONE, &mut of!(cone, st.s, slots));
        }
    }
}

impl Cone {
    /// The middle.
    #[inline(always)]
    fn middle(&self, sizes: &[V], factor: V, p: &mut [V]) {
        p.fill(V::ZERO);
        if let Atom::Interval { .. } = self.atom {
            p[0] = V::splat(0.5) * (sizes[0] - sizes[1]) * factor;
        }
    }

    /// The same multiplier for all inequalities and cones.
    #[inline(always)]
    fn even(&self, multiplier: V, l: &mut [V]) {
        l.fill(multiplier);
        if let Atom::Round { .. } = self.atom {
            l[1..].fill(V::ZERO);
        }
    }

    /// Where a force pushes it on the central path, and the multipliers there, whose products with the slacks are
    /// `centre`; a body that tapers stays in the middle.
    #[inline(always)]
    fn rest(&self, sizes: &[V], force: &[V], centre: V, p: &mut [V], l: &mut [V]) {
        let half = V::splat(0.5);
        match self.atom {
            Atom::Interval { .. } => {
                // f = centre / (high - p) - centre / (p - low).
                let (middle, half_width) = (half * (sizes[0] - sizes[1]), half * (sizes[0] + sizes[1]));
                let pull = force[0] * half_width / centre;
                let part = pull / (V::ONE + pull.times_plus(pull, V::ONE).sqrt());
                p[0] = half_width.times_plus(part, middle);
                l[0] = centre / (half_width * (V::ONE - part));
                l[1] = centre / (half_width * (V::ONE + part));
            }
            Atom::Round { size } => {
                let square = dot_few(force, force);
                l[0] = half * (centre + centre.times_plus(centre, V::splat(4.0) * square).sqrt());
                let per = V::ONE / l[0];
                for k in 0..size {
                    l[1 + k] = -force[k];
                    p[k] = force[k] * per;
                }
            }
            Atom::Tapered { .. } => {
                self.middle(sizes, V::ONE, p);
                self.even(centre, l);
            }
        }
    }
}
