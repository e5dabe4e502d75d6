//! Nesterov-Todd scaling of the bodies that sets are made of, eight programs at a time.
//!
//! A body's conditions are `s = h tau - G p` in a cone K, with the factor tau = 1 or the variable factor
//! on the clearances, and multipliers l in K. The scaling W of Nesterov and Todd (Math. Oper. Res. 22,
//! 1997, 1) takes both to the same point, `W l = W^-1 s`; for half spaces `W^2 = s / l`, for cones of
//! second order `W^-2 = (2 (J w)(J w)' - J) / eta^2` with `w' J w = 1`. Each body's part of the Newton
//! equations, `H = G' W^-2 G`, is inverted in closed form: one number for an interval, the unit matrix
//! and a dyad for a disc or a ball, an arrow for a body that tapers.

use crate::cone::bodies::Atom;
use crate::cone::lanes::round::{
    inverse_matrix, inverse_round, round_rows, scale_round, step_round, target_round, towards,
};
use crate::cone::lanes::vector::{V, dot_few};

/// Signs of an arm and of the axis in the four half spaces of an arm.
const SIDES: [[f64; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];

/// A body of all eight programs: where its numbers are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Its kind; the numbers in it are those of `sizes`.
    pub atom: Atom,
    /// First of its coordinates.
    pub first: usize,
    /// First of its conditions.
    pub slot: usize,
    /// First of its scaling's numbers.
    pub data: usize,
    /// First of its sizes.
    pub size: usize,
    /// Whether the factor on the clearances scales it.
    pub scaled: bool,
}

/// Numbers that give a body's size: high and -low; the radius; the length of the arms, and their tapers.
pub(super) const fn n_sizes(atom: Atom) -> usize {
    match atom {
        Atom::Interval { .. } => 2,
        Atom::Round { .. } => 1,
        Atom::Tapered { arms, .. } => 1 + arms,
    }
}

/// One of these numbers.
pub(super) const fn size_of(atom: Atom, at: usize) -> f64 {
    match atom {
        Atom::Interval { low, high } => {
            if at == 0 {
                high
            } else {
                -low
            }
        }
        Atom::Round { .. } => 1.0,
        Atom::Tapered { tapers, .. } => {
            if at == 0 {
                1.0
            } else {
                tapers[at - 1]
            }
        }
    }
}

impl Cone {
    /// Number of coordinates.
    #[inline(always)]
    pub const fn dimension(&self) -> usize {
        self.atom.size()
    }

    /// Number of conditions.
    pub const fn slots(&self) -> usize {
        match self.atom {
            Atom::Interval { .. } => 2,
            Atom::Round { size } => 1 + size,
            Atom::Tapered { arms, .. } => 4 * arms,
        }
    }

    /// Numbers of the scaling.
    pub const fn data_size(&self) -> usize {
        match self.atom {
            Atom::Interval { .. } => 3,
            Atom::Round { size } => size + 8 + size * (size + 1) / 2,
            Atom::Tapered { arms, .. } => 6 * arms + 1,
        }
    }

    /// Numbers that give the size.
    pub const fn sizes(&self) -> usize {
        n_sizes(self.atom)
    }

    /// The first of them, which are lengths; the others are proportions.
    pub const fn lengths(&self) -> usize {
        match self.atom {
            Atom::Interval { .. } => 2,
            Atom::Round { .. } | Atom::Tapered { .. } => 1,
        }
    }

    /// Number of inequalities or cones of second order.
    pub const fn degree(&self) -> usize {
        match self.atom {
            Atom::Round { .. } => 1,
            Atom::Interval { .. } | Atom::Tapered { .. } => self.slots(),
        }
    }

    /// What the conditions become per unit of the factor.
    #[inline(always)]
    pub fn bound(&self, sizes: &[V], slot: usize) -> V {
        match self.atom {
            Atom::Interval { .. } => sizes[slot],
            Atom::Round { .. } => {
                if slot == 0 {
                    sizes[0]
                } else {
                    V::ZERO
                }
            }
            Atom::Tapered { .. } => sizes[0],
        }
    }

    /// `h dtau - G dp`.
    #[inline(always)]
    pub fn slack(&self, sizes: &[V], p: &[V], factor: V, s: &mut [V]) {
        match self.atom {
            Atom::Interval { .. } => {
                s[0] = sizes[0].times_plus(factor, -p[0]);
                s[1] = sizes[1].times_plus(factor, p[0]);
            }
            Atom::Round { .. } => {
                s[0] = sizes[0] * factor;
                s[1..].copy_from_slice(p);
            }
            Atom::Tapered { arms, .. } => {
                let end = sizes[0] * factor;
                for arm in 0..arms {
                    let shrunk = sizes[1 + arm] * p[0];
                    for (k, [own, axis]) in SIDES.into_iter().enumerate() {
                        s[4 * arm + k] = end - V::splat(own) * p[1 + arm] - V::splat(axis) * shrunk;
                    }
                }
            }
        }
    }

    /// Support function.
    #[inline(always)]
    pub fn support(&self, sizes: &[V], force: &[V]) -> V {
        match self.atom {
            Atom::Interval { .. } => (sizes[0] * force[0]).max(-sizes[1] * force[0]),
            Atom::Round { .. } => sizes[0] * dot_few(force, force).sqrt(),
            Atom::Tapered { arms, .. } => {
                let (mut across, mut ends) = (V::ZERO, force[0].abs());
                for arm in 0..arms {
                    let size = force[1 + arm].abs();
                    across = across + size;
                    ends = (V::ONE - sizes[1 + arm]).times_plus(size, ends);
                }
                sizes[0] * across.max(ends)
            }
        }
    }

    /// `G' l`.
    #[inline(always)]
    pub fn pull(&self, sizes: &[V], l: &[V], out: &mut [V]) {
        match self.atom {
            Atom::Interval { .. } => out[0] = l[0] - l[1],
            Atom::Round { size } => {
                for k in 0..size {
                    out[k] = -l[1 + k];
                }
            }
            Atom::Tapered { arms, .. } => {
                let mut along = V::ZERO;
                for arm in 0..arms {
                    let l = &l[4 * arm..4 * arm + 4];
                    out[1 + arm] = (l[0] + l[1]) - (l[2] + l[3]);
                    along = sizes[1 + arm].times_plus((l[0] + l[2]) - (l[1] + l[3]), along);
                }
                out[0] = along;
            }
        }
    }

    /// The scaling at slacks and multipliers, and what [`Self::step`] needs of both.
    #[inline(always)]
    pub fn scale(&self, sizes: &[V], [s, l]: [&[V]; 2], [inv_s, inv_l]: [&mut [V]; 2], data: &mut [V]) {
        if let Atom::Round { size } = self.atom {
            if size == 2 {
                scale_round::<2, 3>([s, l], [inv_s, inv_l], data);
            } else {
                scale_round::<3, 4>([s, l], [inv_s, inv_l], data);
            }
            return;
        }
        for k in 0..self.slots() {
            (inv_s[k], inv_l[k]) = (V::ONE / s[k], V::ONE / l[k]);
            data[k] = l[k] * inv_s[k];
        }
        match self.atom {
            Atom::Tapered { arms, .. } => {
                let mut axis = V::ZERO;
                for arm in 0..arms {
                    let d = &data[4 * arm..4 * arm + 4];
                    let (same, opposite, taper) = (d[0] + d[3], d[1] + d[2], sizes[1 + arm]);
                    let inverse = V::ONE / (same + opposite);
                    data[4 * arms + arm] = inverse;
                    data[5 * arms + arm] = taper * (same - opposite);
                    // What the arm leaves of the axis' diagonal element, without cancellation.
                    axis = (taper * taper).times_plus(V::splat(4.0) * same * opposite * inverse, axis);
                }
                data[6 * arms] = V::ONE / axis;
            }
            Atom::Interval { .. } | Atom::Round { .. } => data[2] = V::ONE / (data[0] + data[1]),
        }
    }

    /// `H^-1 x`.
    #[inline(always)]
    pub fn inverse(&self, data: &[V], x: &[V], out: &mut [V]) {
        match self.atom {
            Atom::Interval { .. } => out[0] = data[2] * x[0],
            Atom::Round { size: 2 } => inverse_round::<2>(&inverse_matrix::<2>(data), x, out),
            Atom::Round { .. } => inverse_round::<3>(&inverse_matrix::<3>(data), x, out),
            Atom::Tapered { arms, .. } => {
                let (inverse, coupling) = (&data[4 * arms..5 * arms], &data[5 * arms..6 * arms]);
                let mut along = x[0];
                for arm in 0..arms {
                    along = (coupling[arm] * inverse[arm]).times_from(x[1 + arm], along);
                }
                out[0] = data[6 * arms] * along;
                for arm in 0..arms {
                    out[1 + arm] = inverse[arm] * coupling[arm].times_from(out[0], x[1 + arm]);
                }
            }
        }
    }

    /// `E H^-1`, row by row of n coordinates of all bodies.
    #[inline(always)]
    pub fn inverse_rows(&self, data: &[V], n: usize, e: &[V], g: &mut [V]) {
        match self.atom {
            Atom::Round { size: 2 } => round_rows::<2>(data, n, self.first, e, g),
            Atom::Round { .. } => round_rows::<3>(data, n, self.first, e, g),
            Atom::Interval { .. } | Atom::Tapered { .. } => {
                let at = self.first..self.first + self.dimension();
                for (e, g) in e.chunks_exact(n).zip(g.chunks_exact_mut(n)) {
                    self.inverse(data, &e[at.clone()], &mut g[at.clone()]);
                }
            }
        }
    }

    /// What a change of the factor adds to the Newton equations: `x = H^-1 G' W^-2 h` and
    /// `h' W^-2 h - x' H x`.
    #[inline(always)]
    pub fn follow(&self, sizes: &[V], data: &[V], x: &mut [V]) -> V {
        if let Atom::Round { size } = self.atom {
            // Of a radius of one: W^-2 h = (2 w0^2 - 1, -2 w0 w1) / eta^2.
            towards(size, data, x);
            return data[size + 1] * data[size + 3];
        }
        let n = self.slots();
        let mut weighed = [V::ZERO; 16];
        let mut right = [V::ZERO; 5];
        for slot in 0..n {
            weighed[slot] = data[slot] * self.bound(sizes, slot);
        }
        self.pull(sizes, &weighed[..n], &mut right[..self.dimension()]);
        self.inverse(data, &right[..self.dimension()], x);
        // The smallest sum of squares of what is left, so that nothing cancels.
        let mut left = [V::ZERO; 16];
        self.slack(sizes, x, V::ONE, &mut left[..n]);
        let mut sum = V::ZERO;
        for slot in 0..n {
            sum = (data[slot] * left[slot]).times_plus(left[slot], sum);
        }
        sum
    }

    /// `W (W l \ (sigma mu e - (W^-1 ds) o (W dl))) - s`, where the slacks would go without a change of
    /// the multipliers, for the step `ds` towards the boundary and the `dl` that belongs to it.
    #[inline(always)]
    pub fn target(&self, data: &[V], [s, l, inv_l, ds, dl]: [&[V]; 5], centre: V, u: &mut [V]) {
        match self.atom {
            Atom::Round { size: 2 } => target_round::<2, 3>(data, s, l, ds, centre, u),
            Atom::Round { .. } => target_round::<3, 4>(data, s, l, ds, centre, u),
            Atom::Interval { .. } | Atom::Tapered { .. } => {
                for k in 0..self.slots() {
                    u[k] = ds[k].times_from(dl[k], centre).times_plus(inv_l[k], -s[k]);
                }
            }
        }
    }

    /// What the coordinates do on the way to that target while their forces stay: `-H^-1 G' W^-2 u`.
    #[inline(always)]
    pub fn approach(&self, sizes: &[V], data: &[V], u: &[V], out: &mut [V]) {
        if let Atom::Round { size } = self.atom {
            towards(size, data, out);
            for k in 0..size {
                out[k] = out[k].times_from(u[0], u[1 + k]);
            }
            return;
        }
        let n = self.slots();
        let mut weighed = [V::ZERO; 16];
        let mut right = [V::ZERO; 5];
        for slot in 0..n {
            weighed[slot] = -data[slot] * u[slot];
        }
        self.pull(sizes, &weighed[..n], &mut right[..self.dimension()]);
        self.inverse(data, &right[..self.dimension()], out);
    }

    /// What the factor's multipliers do then: `(h - G x)' W^-2 u`.
    #[inline(always)]
    pub fn approach_factor(&self, sizes: &[V], data: &[V], x: &[V], u: &[V]) -> V {
        if let Atom::Round { size } = self.atom {
            return data[size + 1] * data[size + 3] * u[0];
        }
        let n = self.slots();
        let mut left = [V::ZERO; 16];
        self.slack(sizes, x, V::ONE, &mut left[..n]);
        let mut sum = V::ZERO;
        for slot in 0..n {
            sum = (data[slot] * left[slot]).times_plus(u[slot], sum);
        }
        sum
    }

    /// The multipliers' step `W^-2 (u - ds)` of half spaces, which fulfils `G' dl = force`.
    #[inline(always)]
    fn multipliers(&self, sizes: &[V], data: &[V], [u, ds, force]: [&[V]; 3], dl: &mut [V]) {
        let n = self.slots();
        for slot in 0..n {
            dl[slot] = data[slot] * (u[slot] - ds[slot]);
        }
        if let Atom::Tapered { .. } = self.atom {
            // The rounding of a difference of large numbers near the boundary, taken out by one step of refinement.
            let mut left = [V::ZERO; 5];
            let mut move_back = [V::ZERO; 5];
            let mut slack = [V::ZERO; 16];
            let dimension = self.dimension();
            self.pull(sizes, dl, &mut left[..dimension]);
            for (left, force) in left.iter_mut().zip(force) {
                *left = *force - *left;
            }
            self.inverse(data, &left[..dimension], &mut move_back[..dimension]);
            self.slack(sizes, &move_back[..dimension], V::ZERO, &mut slack[..n]);
            for slot in 0..n {
                dl[slot] = data[slot].times_from(slack[slot], dl[slot]);
            }
        }
    }

    /// The steps of coordinates, slacks and multipliers towards a target, for the force that they add and the
    /// factor's step; gives the inverse of the longest step inside the cone.
    #[inline(always)]
    pub fn step(
        &self,
        sizes: &[V],
        data: &[V],
        [target, force, approach, follow]: [&[V]; 4],
        factor: V,
        [s, inv_s, l, inv_l]: [&[V]; 4],
        [dp, ds, dl]: [&mut [V]; 3],
    ) -> V {
        if let Atom::Round { size } = self.atom {
            let (aims, at, steps) = ([target, force, approach, follow], [s, inv_s, l, inv_l], [dp, ds, dl]);
            return if size == 2 {
                step_round::<2, 3>(sizes[0], data, aims, factor, at, steps)
            } else {
                step_round::<3, 4>(sizes[0], data, aims, factor, at, steps)
            };
        }
        self.inverse(data, force, dp);
        for ((dp, approach), follow) in dp.iter_mut().zip(approach).zip(follow) {
            *dp = follow.times_plus(factor, *dp + *approach);
        }
        self.slack(sizes, dp, factor, ds);
        self.multipliers(sizes, data, [target, ds, force], dl);
        let mut most = V::ZERO;
        for k in 0..self.slots() {
            most = (-ds[k] * inv_s[k]).max(most);
            most = (-dl[k] * inv_l[k]).max(most);
        }
        most
    }
}
