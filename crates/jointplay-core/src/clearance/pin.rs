//! A pin in a bore: each of its two ends moves within a circle, and the pin along the axis.
//!
//! With the joint's axis q and the offset (d, th) of the pin's middle, the ends at `+-l` along the axis
//! are displaced across it by `e+- = d_perp +- l th x q`. The wrench (F, M) does on them the work
//! `R+ . e+ + R- . e-` with the reactions of the ends `R+- = (F_perp +- M x q / l) / 2`, so that
//!
//! `h(F, M) = r (|R+| + |R-|) + axial |F . q|`.

use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::projection::{onto_ball, onto_ball_along, onto_box_along};
use crate::clearance::undecided::Unforced;
use crate::clearance::variance;
use crate::math::real::Real;

/// A pin in a bore. Its components are the one along the axis, where shoulders hold it, and then side,
/// normal, tilt about side, tilt about normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pin {
    /// Radial clearance at both ends.
    pub radius: f64,
    /// Distance from the middle of the pin to its ends.
    pub half_length: f64,
    /// Axial play on each side, where shoulders hold the pin.
    pub axial: Option<f64>,
}

/// The ends of the pin, each with its two components across the axis: side and normal.
type Ends<S = f64> = [[S; 2]; 2];

impl Pin {
    /// Index of the first component across the axis.
    #[inline(always)]
    pub const fn across(&self) -> usize {
        if self.axial.is_some() { 1 } else { 0 }
    }

    /// Puts axial play (if any) and four numbers one after the other.
    #[inline(always)]
    fn join<S: Real>(&self, along: S, [a, b, c, d]: [S; 4]) -> [S; MAX_SIZE] {
        if self.axial.is_some() { [along, a, b, c, d] } else { [a, b, c, d, S::from_f64(0.0)] }
    }

    /// Displacements of the ends across the axis. With axis x side = normal, tilt x axis is
    /// (tilt about normal, -tilt about side).
    #[inline(always)]
    fn ends(&self, offset: &[f64]) -> Ends {
        let u = &offset[self.across()..];
        let (about_side, about_normal) = (self.half_length * u[2], self.half_length * u[3]);
        [[u[0] + about_normal, u[1] - about_side], [u[0] - about_normal, u[1] + about_side]]
    }

    /// The offset of the displacements of the ends and of the axial one.
    #[inline(always)]
    fn offset<S: Real>(&self, along: S, [first, second]: Ends<S>) -> [S; MAX_SIZE] {
        let [half, half_turn] = [0.5, 0.5 / self.half_length].map(S::from_f64);
        self.join(
            along,
            [
                half * (first[0] + second[0]),
                half * (first[1] + second[1]),
                half_turn * (second[1] - first[1]),
                half_turn * (first[0] - second[0]),
            ],
        )
    }

    /// Reactions of the ends.
    #[inline(always)]
    fn reactions<S: Real>(&self, w: &[S]) -> Ends<S> {
        let w = &w[self.across()..];
        let [half, per_lever] = [0.5, 1.0 / self.half_length].map(S::from_f64);
        let (about_side, about_normal) = (per_lever * w[2], per_lever * w[3]);
        [
            [half * (w[0] + about_normal), half * (w[1] - about_side)],
            [half * (w[0] - about_normal), half * (w[1] + about_side)],
        ]
    }

    pub(super) fn support(&self, w: &[f64]) -> f64 {
        let [first, second] = self.reactions(w).map(|[x, y]| (x * x + y * y).sqrt());
        self.radius * (first + second) + self.axial.map_or(0.0, |axial| axial * w[0].abs())
    }

    /// The face that a wrench exposes.
    #[inline(always)]
    pub(super) fn face(&self, w: &[f64], tolerance: f64) -> ([f64; MAX_SIZE], PinFace) {
        let push = |[x, y]: [f64; 2]| {
            let size = (x * x + y * y).sqrt();
            let decided = size > tolerance;
            let part = if decided { self.radius / size } else { 0.0 };
            ([part * x, part * y], !decided && self.radius > 0.0)
        };
        let [first, second] = self.reactions(w);
        let ((first, first_open), (second, second_open)) = (push(first), push(second));
        let mut open = PinFace { pin: *self, ends: [first_open, second_open], along: false };
        let mut along = 0.0;
        if let Some(axial) = self.axial {
            if w[0].abs() > tolerance {
                along = axial.copysign(w[0]);
            } else {
                open.along = axial > 0.0;
            }
        }
        (self.offset(along, [first, second]), open)
    }

    /// The axial play, and each end of the pin.
    pub(super) fn unforced(&self, w: &[f64], tolerance: f64) -> Unforced {
        let [first, second] = self.reactions(w).map(|[x, y]| self.radius > 0.0 && (x * x + y * y).sqrt() <= tolerance);
        Unforced::of([self.axial.is_some_and(|axial| axial > 0.0 && w[0].abs() <= tolerance), first, second])
    }

    pub(super) fn masked_force(&self, w: &[f64], unforced: Unforced) -> [f64; MAX_SIZE] {
        let [first, second] = self.reactions(w);
        let [first, second] = [(1, first), (2, second)].map(|(k, end)| if unforced.has(k) { [0.0; 2] } else { end });
        let across = [
            first[0] + second[0],
            first[1] + second[1],
            self.half_length * (second[1] - first[1]),
            self.half_length * (first[0] - second[0]),
        ];
        self.join(if unforced.has(0) { 0.0 } else { w[0] }, across)
    }

    pub(super) fn to_unit(self, offset: &[f64]) -> [f64; MAX_SIZE] {
        let part = |x: f64, size: f64| if size > 0.0 { x / size } else { 0.0 };
        let [first, second] = self.ends(offset).map(|end| end.map(|e| part(e, self.radius)));
        let along = self.axial.map_or(0.0, |axial| part(offset[0], axial));
        self.join(along, [first[0], first[1], second[0], second[1]])
    }

    pub(super) fn of_unit<S: Real>(&self, unit: &[S]) -> [S; MAX_SIZE] {
        let e = &unit[self.across()..];
        let r = S::from_f64(self.radius);
        let along = self.axial.map_or(S::from_f64(0.0), |axial| S::from_f64(axial) * unit[0]);
        self.offset(along, [[r * e[0], r * e[1]], [r * e[2], r * e[3]]])
    }

    pub(super) fn unit_gradient<S: Real>(&self, w: &[S]) -> [S; MAX_SIZE] {
        let [first, second] = self.reactions(w).map(|end| end.map(|f| S::from_f64(self.radius) * f));
        let along = self.axial.map_or(S::from_f64(0.0), |axial| S::from_f64(axial) * w[0]);
        self.join(along, [first[0], first[1], second[0], second[1]])
    }

    pub(super) fn project_unit(&self, unit: &mut [f64]) {
        let (along, ends) = unit.split_at_mut(self.across());
        for u in along {
            *u = u.clamp(-1.0, 1.0);
        }
        ends.chunks_exact_mut(2).for_each(onto_ball);
    }

    pub(super) fn project_unit_along(&self, unit: &[f64], direction: &mut [f64]) {
        let (along, ends) = unit.split_at(self.across());
        let (d_along, d_ends) = direction.split_at_mut(self.across());
        onto_box_along(along, d_along);
        ends.chunks_exact(2).zip(d_ends.chunks_exact_mut(2)).for_each(|(end, d)| onto_ball_along(end, d));
    }

    /// Variances of the components, each end independent of the other: of their half sum and of their
    /// half difference.
    pub(super) fn variances(&self, law: Law) -> [f64; MAX_SIZE] {
        let shift = 0.5 * self.radius * self.radius * variance::round_variance(law, 2);
        let tilt = shift / (self.half_length * self.half_length);
        let along = self.axial.map_or(0.0, |axial| axial * axial * variance::interval_variance(law));
        self.join(along, [shift, shift, tilt, tilt])
    }
}

/// A face of a pin's set: some of its factors whole, the others points.
#[derive(Clone, Copy, Debug)]
pub(super) struct PinFace {
    pin: Pin,
    ends: [bool; 2],
    along: bool,
}

impl PinFace {
    #[inline(always)]
    pub const fn is_point(&self) -> bool {
        !(self.ends[0] || self.ends[1] || self.along)
    }

    /// The set's own coordinates that are open.
    pub fn open(&self) -> impl Iterator<Item = usize> {
        let across = self.pin.across();
        let ends = [0, 0, 1, 1].map(|end| self.ends[end]);
        let ends = (across..).zip(ends).filter_map(|(k, open)| open.then_some(k));
        self.along.then_some(0).into_iter().chain(ends)
    }

    /// What is open stays as the offset has it.
    pub fn nearest(&self, centre: &[f64; MAX_SIZE], offset: &[f64]) -> [f64; MAX_SIZE] {
        let (mut ends, from) = (self.pin.ends(centre), self.pin.ends(offset));
        for end in 0..2 {
            if self.ends[end] {
                ends[end] = from[end];
            }
        }
        self.pin.offset(if self.along { offset[0] } else { centre[0] }, ends)
    }

    /// What is decided stays as the centre has it.
    pub fn farthest(&self, centre: &[f64; MAX_SIZE], direction: &[f64]) -> [f64; MAX_SIZE] {
        let (farthest, _) = self.pin.face(direction, 0.0);
        let (mut ends, to) = (self.pin.ends(centre), self.pin.ends(&farthest));
        for end in 0..2 {
            if self.ends[end] {
                ends[end] = to[end];
            }
        }
        self.pin.offset(if self.along { farthest[0] } else { centre[0] }, ends)
    }

    pub fn half_width(&self, direction: &[f64]) -> f64 {
        let reach = |open: bool, size: f64| if open { size } else { 0.0 };
        let [first, second] = self.pin.reactions(direction).map(|[x, y]| self.pin.radius * (x * x + y * y).sqrt());
        let along = self.pin.axial.map_or(0.0, |axial| axial * direction[0].abs());
        reach(self.ends[0], first) + reach(self.ends[1], second) + reach(self.along, along)
    }
}
