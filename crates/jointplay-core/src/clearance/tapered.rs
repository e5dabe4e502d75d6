//! Guide and plate: polytopes that are squares tapering along an axis.
//!
//! A rectangular slider, of half length l, half width b (along side) and half height h (along normal),
//! stays inside its guide with the gap c to first order where
//!
//! `|d_side| + l |tilt_normal| + h |roll| <= c` and `|d_normal| + l |tilt_side| + b |roll| <= c`.
//!
//! For a given roll these are two diamonds, which become squares by a turn of 45 degrees: with
//! `rho = roll max(b, h) / c` the own coordinates `p, q = (d +- l tilt) / c` of each fulfil
//! `|p|, |q| <= 1 - g |rho|`, where g is 1 for the diamond with the longer lever. A plate between planes,
//! `|d_along| + a |tilt_side| + b |tilt_normal| <= c`, is the same with the translation as its axis and
//! one square. All else follows: the support function is linear in rho,
//!
//! `h(F, M) / c = max(sum m_i, |F_rho| + sum (1 - g_i) m_i)`, `m_i = max(|F_i|, |M_i| / l)`;
//!
//! a face leaves some of p and q undecided, and rho decided or not; and the nearest point of one is found
//! along rho alone.

use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::Unforced;
use crate::clearance::variance;
use crate::math::real::Real;

/// A component, and what turns its conjugate into a force: 1, or 1/lever for an angle's moment.
pub(crate) type Arm = (usize, f64);

/// Squares that taper along an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tapered {
    /// Gap on each side.
    pub gap: f64,
    /// The component along the axis.
    pub axis: Arm,
    /// Diagonals of the squares; the last one is without meaning where there is one square only.
    pub squares: [[Arm; 2]; 2],
    /// How much each square has shrunk at the end of the axis.
    pub tapers: [f64; 2],
    /// How many squares there are.
    pub n: usize,
}

impl Tapered {
    #[inline(always)]
    pub(super) fn guide(gap: f64, half_length: f64, half_width: f64, half_height: f64) -> Self {
        let lever = half_width.max(half_height);
        let tilt = 1.0 / half_length;
        Self {
            gap,
            axis: (2, 1.0 / lever),
            squares: [[(0, 1.0), (4, tilt)], [(1, 1.0), (3, tilt)]],
            tapers: [half_height / lever, half_width / lever],
            n: 2,
        }
    }

    #[inline(always)]
    pub(super) fn plate(gap: f64, half_normal: f64, half_side: f64) -> Self {
        Self {
            gap,
            axis: (0, 1.0),
            squares: [[(1, 1.0 / half_normal), (2, 1.0 / half_side)]; 2],
            tapers: [1.0; 2],
            n: 1,
        }
    }

    /// Own coordinates of numbers along the axis and along the diagonals: p and q of each square are sum
    /// and difference, times `half`.
    #[inline(always)]
    fn own<S: Real>(&self, number: impl Fn(Arm) -> S, half: f64) -> [S; MAX_SIZE] {
        let (mut own, half) = ([S::from_f64(0.0); MAX_SIZE], S::from_f64(half));
        own[0] = number(self.axis);
        for s in 0..self.n {
            let [a, b] = self.squares[s].map(&number);
            own[1 + 2 * s] = half * (a + b);
            own[2 + 2 * s] = half * (a - b);
        }
        own
    }

    #[inline(always)]
    pub(super) fn to_unit(self, offset: &[f64]) -> [f64; MAX_SIZE] {
        self.own(|(k, arm)| offset[k] / (self.gap * arm), 1.0)
    }

    /// Forces along the own coordinates.
    #[inline(always)]
    fn forces<S: Real>(&self, w: &[S]) -> [S; MAX_SIZE] {
        self.own(|(k, arm)| w[k] * S::from_f64(arm), 0.5)
    }

    #[inline(always)]
    pub fn of_unit<S: Real>(&self, unit: &[S]) -> [S; MAX_SIZE] {
        let (mut offset, half) = ([S::from_f64(0.0); MAX_SIZE], S::from_f64(0.5));
        let mut put = |(k, arm): Arm, part: S| offset[k] = S::from_f64(self.gap * arm) * part;
        put(self.axis, unit[0]);
        for s in 0..self.n {
            let (p, q) = (unit[1 + 2 * s], unit[2 + 2 * s]);
            let [a, b] = self.squares[s];
            put(a, half * (p + q));
            put(b, half * (p - q));
        }
        offset
    }

    /// The axis, and the diagonals of the squares.
    pub(super) fn unforced(&self, w: &[f64], tolerance: f64) -> Unforced {
        let forces = self.forces(w);
        let across = |k: usize| k <= 2 * self.n && 2.0 * forces[k].abs() <= tolerance;
        Unforced::of([forces[0].abs() <= tolerance, across(1), across(2), across(3), across(4)])
    }

    pub(super) fn masked_force(&self, w: &[f64], unforced: Unforced) -> [f64; MAX_SIZE] {
        let forces = self.forces(w);
        let force = |k: usize| if unforced.has(k) { 0.0 } else { forces[k] };
        let mut masked_force = [0.0; MAX_SIZE];
        masked_force[self.axis.0] = force(0) / self.axis.1;
        for s in 0..self.n {
            let (p, q) = (force(1 + 2 * s), force(2 + 2 * s));
            let [(a, arm_a), (b, arm_b)] = self.squares[s];
            masked_force[a] = (p + q) / arm_a;
            masked_force[b] = (p - q) / arm_b;
        }
        masked_force
    }

    pub(super) fn unit_gradient<S: Real>(&self, w: &[S]) -> [S; MAX_SIZE] {
        self.forces(w).map(|f| S::from_f64(self.gap) * f)
    }

    /// The set as its own largest face.
    pub(super) const fn whole(&self) -> TaperedFace {
        TaperedFace { shape: *self, low: 0.0, high: 1.0, side: 0.0, signs: [0.0; 4] }
    }

    pub(super) fn support(&self, w: &[f64]) -> f64 {
        self.gap * self.whole().top(&self.forces(w))
    }

    /// The face that a wrench exposes. Differences of forces up to `tolerance` decide nothing.
    #[inline(always)]
    pub(super) fn face(&self, w: &[f64], tolerance: f64) -> ([f64; MAX_SIZE], TaperedFace) {
        let forces = self.forces(w);
        let mut face = self.whole();
        let mut across = 0.0;
        for s in 0..self.n {
            let (p, q) = (forces[1 + 2 * s], forces[2 + 2 * s]);
            // Of the two components of the square's diagonals the larger counts; p or q is half their
            // difference.
            let larger = p.abs() + q.abs();
            across += self.tapers[s] * larger;
            if larger > tolerance {
                for (sign, force) in face.signs[2 * s..2 * s + 2].iter_mut().zip([p, q]) {
                    if 2.0 * force.abs() > tolerance {
                        *sign = 1.0_f64.copysign(force);
                    }
                }
            }
        }
        let along = forces[0].abs();
        if along > tolerance {
            face.side = 1.0_f64.copysign(forces[0]);
        }
        if along - across > tolerance {
            face.low = 1.0;
        } else if across - along > tolerance {
            face.high = 0.0;
        }
        (self.of_unit(&face.middle()), face)
    }

    /// Where `|x_k| + g_k |x_0|` comes to one first, for the coordinates across the axis and for the axis
    /// itself. Each is convex along the step.
    pub(super) fn part_within(&self, unit: &[f64], step: &[f64]) -> f64 {
        let face = |k: usize, a: f64, b: f64| {
            let g = if k == 0 { 0.0 } else { self.tapers[(k - 1) / 2] };
            let (at, slope) = (a * unit[k] + b * g * unit[0], a * step[k] + b * g * step[0]);
            // What is on the face already, up to rounding, and goes on outwards does not count as leaving it.
            if slope > 0.0 && at + slope > 1.0 && at < 1.0 - 1e-9 { (1.0 - at) / slope } else { 1.0 }
        };
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        (0..=2 * self.n).flat_map(|k| signs.map(|(a, b)| face(k, a, b))).fold(1.0, f64::min)
    }

    /// Variances of the components.
    pub(super) fn variances(&self, law: Law) -> [f64; MAX_SIZE] {
        let (along, across) = variance::tapered_variances(law, &self.tapers[..self.n]);
        let mut variances = [0.0; MAX_SIZE];
        let mut put = |(k, arm): Arm, variance: f64| variances[k] = (self.gap * arm).powi(2) * variance;
        put(self.axis, along);
        for s in 0..self.n {
            for arm in self.squares[s] {
                put(arm, across[s]);
            }
        }
        variances
    }
}

/// A face of tapered squares: a range of the axis, and the coordinates across it each on one side of its
/// square or anywhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct TaperedFace {
    shape: Tapered,
    /// Lowest and highest size of the coordinate along the axis.
    low: f64,
    high: f64,
    /// Its sign; zero for both.
    side: f64,
    /// Signs of p and q of each square; zero for anywhere between.
    signs: [f64; 4],
}

impl TaperedFace {
    #[inline(always)]
    fn taper(&self, k: usize) -> f64 {
        self.shape.tapers[k / 2]
    }

    #[inline(always)]
    pub fn is_point(&self) -> bool {
        let decided = |k: usize| self.signs[k] != 0.0 || self.taper(k) * self.low >= 1.0;
        (self.high == 0.0 || self.low >= 1.0 && self.side != 0.0) && (0..2 * self.shape.n).all(decided)
    }

    #[inline(always)]
    fn middle(&self) -> [f64; MAX_SIZE] {
        let size = if self.side == 0.0 { 0.0 } else { 0.5 * (self.low + self.high) };
        let mut unit = [0.0; MAX_SIZE];
        unit[0] = self.side * size;
        for k in 0..2 * self.shape.n {
            unit[1 + k] = self.signs[k] * (1.0 - self.taper(k) * size);
        }
        unit
    }

    /// Directions in own coordinates in which it is open, each with the coordinate that it moves first. Along the axis
    /// the sides of the squares give way.
    pub fn directions(&self) -> Vec<(usize, [f64; MAX_SIZE])> {
        let mut directions = Vec::new();
        let side = if self.side == 0.0 { 1.0 } else { self.side };
        if self.high > self.low || self.high > 0.0 && self.side == 0.0 {
            let mut unit = [0.0; MAX_SIZE];
            unit[0] = side;
            (0..2 * self.shape.n).for_each(|k| unit[1 + k] = -self.signs[k] * self.taper(k));
            directions.push((0, unit));
        }
        for k in (0..2 * self.shape.n).filter(|&k| self.signs[k] == 0.0 && self.taper(k) * self.low < 1.0) {
            let mut unit = [0.0; MAX_SIZE];
            unit[1 + k] = 1.0;
            directions.push((1 + k, unit));
        }
        directions
    }

    /// The largest value of `forces . unit` at one size of the coordinate along the axis.
    fn top_at(&self, forces: &[f64; MAX_SIZE], size: f64) -> f64 {
        let along = if self.side == 0.0 { forces[0].abs() } else { self.side * forces[0] };
        (0..2 * self.shape.n).fold(size * along, |sum, k| {
            let across = if self.signs[k] == 0.0 { forces[1 + k].abs() } else { self.signs[k] * forces[1 + k] };
            sum + (1.0 - self.taper(k) * size) * across
        })
    }

    /// The same over the face; it is linear along the axis.
    fn top(&self, forces: &[f64; MAX_SIZE]) -> f64 {
        self.top_at(forces, self.low).max(self.top_at(forces, self.high))
    }

    pub fn farthest(&self, direction: &[f64]) -> [f64; MAX_SIZE] {
        let forces = self.shape.forces(direction);
        let size = if self.top_at(&forces, self.high) > self.top_at(&forces, self.low) { self.high } else { self.low };
        let side = |decided: f64, force: f64| match decided {
            0.0 if force == 0.0 => 0.0,
            0.0 => force.signum(),
            _ => decided,
        };
        let mut unit = [0.0; MAX_SIZE];
        unit[0] = size * side(self.side, forces[0]);
        for k in 0..2 * self.shape.n {
            unit[1 + k] = (1.0 - self.taper(k) * size) * side(self.signs[k], forces[1 + k]);
        }
        self.shape.of_unit(&unit)
    }

    pub fn half_width(&self, direction: &[f64]) -> f64 {
        let forces = self.shape.forces(direction);
        0.5 * self.shape.gap * (self.top(&forces) + self.top(&forces.map(|f| -f)))
    }

    pub fn nearest(&self, offset: &[f64]) -> [f64; MAX_SIZE] {
        let unit = self.shape.to_unit(offset);
        let nearest = self.nearest_unit(&unit);
        // What does not move keeps its value to the last bit.
        let moves: [f64; MAX_SIZE] = std::array::from_fn(|k| nearest[k] - unit[k]);
        let moved = self.shape.of_unit(&moves);
        std::array::from_fn(|k| if k < offset.len() { offset[k] + moved[k] } else { 0.0 })
    }

    /// The nearest point of the face in own coordinates: where the derivative of half the squared
    /// distance along the size of the first coordinate, which is increasing, convex and piecewise
    /// linear, vanishes. Newton's method from above meets every piece at most once.
    pub fn nearest_unit(&self, unit: &[f64]) -> [f64; MAX_SIZE] {
        let side = if self.side == 0.0 { 1.0_f64.copysign(unit[0]) } else { self.side };
        let along = side * unit[0];
        let n = 2 * self.shape.n;
        // How far a coordinate is beyond its square's side, and whether that counts.
        let beyond = |k: usize, size: f64| {
            let decided = self.signs[k] != 0.0;
            let x = if decided { self.signs[k] * unit[1 + k] } else { unit[1 + k].abs() };
            let beyond = x - 1.0 + self.taper(k) * size;
            if decided || beyond > 0.0 { Some(beyond) } else { None }
        };
        let derivative = |size: f64| {
            (0..n)
                .filter_map(|k| Some((self.taper(k), beyond(k, size)?)))
                .fold((size - along, 1.0), |(slope, bend), (g, beyond)| (slope + g * beyond, bend + g * g))
        };
        let mut size = self.high;
        for _ in 0..=n {
            let (slope, bend) = derivative(size);
            if slope <= 0.0 || size <= self.low {
                break;
            }
            size = (size - slope / bend).max(self.low);
        }
        let mut nearest = [0.0; MAX_SIZE];
        nearest[0] = side * size;
        for k in 0..n {
            let reach = 1.0 - self.taper(k) * size;
            nearest[1 + k] =
                if self.signs[k] == 0.0 { unit[1 + k].clamp(-reach, reach) } else { self.signs[k] * reach };
        }
        nearest
    }
    /// How that point moves where the point that it is nearest to moves along a direction.
    pub fn nearest_unit_along(&self, unit: &[f64], direction: &mut [f64]) {
        let nearest = self.nearest_unit(unit);
        let (size, n) = (nearest[0].abs(), 2 * self.shape.n);
        let side = if self.side == 0.0 { 1.0_f64.copysign(unit[0]) } else { self.side };
        // What holds a coordinate: the side of its square, which gives way as the axis goes out.
        let held = |k: usize| {
            let sign = if self.signs[k] == 0.0 { 1.0_f64.copysign(unit[1 + k]) } else { self.signs[k] };
            let beyond = sign * unit[1 + k] - 1.0 + self.taper(k) * size;
            (self.signs[k] != 0.0 || beyond > 0.0).then_some((sign, beyond))
        };
        let mut along = side * direction[0];
        let (mut slope, mut bend) = (size - side * unit[0], 1.0);
        for k in 0..n {
            if let Some((sign, beyond)) = held(k) {
                let g = self.taper(k);
                along -= g * sign * direction[1 + k];
                slope += g * beyond;
                bend += g * g;
            }
        }
        // At either end of its range the axis stays where it is pushed beyond it.
        let stays = size >= self.high && slope < 0.0 || size <= self.low && slope > 0.0;
        let turn = if stays { 0.0 } else { along / bend };
        direction[0] = side * turn;
        for k in 0..n {
            if let Some((sign, _)) = held(k) {
                direction[1 + k] = -sign * self.taper(k) * turn;
            }
        }
    }
}
