//! Intervals that hold the exact result of every operation: the closure equations run on them give bounds.
//!
//! A sum, product, quotient or root is computed to the nearest number and moved outwards. The nearest number `r` is off
//! by at most half a unit in its last place, which is at most `2^-53 |r|`, or `2^-1075` where it underflows. `|r| 2^-52` is
//! at least one unit in the last place and at most two, so that `r` less that amount, itself rounded, is the next number
//! below `r` or one further on. A sum that underflows is exact.
//!
//! Sine, cosine and arc tangent are those of `libm`, which states errors below one unit in the last place; they are moved
//! by four. An exact zero stays one: adding it changes nothing, and multiplying by it gives zero.
//!
//! What is not known (a quotient by an interval around zero, the angle of a vector that may be zero) is the whole line,
//! and the whole line proves nothing.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math::curve::{Curve, polynomial};
use crate::math::real::Real;

/// All numbers between two, these included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// What a result is moved outwards by, as a part of it, and beyond that where it may have underflowed.
const PART: f64 = f64::EPSILON;
const TINY: f64 = f64::MIN_POSITIVE;
/// A function of `libm` is moved by so many times that.
const FUNCTION: f64 = 4.0;
/// Beyond this width sines are not told apart.
const WIDE: f64 = 1.0;
/// Terms of the power series of `2 atan(t) / t`, and the square of t up to which it is used: what is left out is below
/// `10^-21`.
const ARC_TERMS: i32 = 12;
const ARC_SQUARE: f64 = 0.015;

fn below(sum: f64) -> f64 {
    sum - sum.abs() * PART
}

fn above(sum: f64) -> f64 {
    sum + sum.abs() * PART
}

impl Interval {
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };
    pub const ONE: Self = Self { low: 1.0, high: 1.0 };
    /// Of which nothing is known.
    pub const LINE: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// A number by itself.
    pub const fn from_point(x: f64) -> Self {
        Self { low: x, high: x }
    }

    /// The interval between two numbers.
    pub const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// All numbers of at most this size.
    pub const fn of_size(size: f64) -> Self {
        Self { low: -size, high: size }
    }

    /// A number of the interval near its middle; zero where an end is not finite.
    pub fn middle(self) -> f64 {
        if self.is_finite() { (0.5 * self.low + 0.5 * self.high).clamp(self.low, self.high) } else { 0.0 }
    }

    /// Its middle, and what covers the rest of it on both sides.
    pub fn split(self) -> (f64, f64) {
        let middle = self.middle();
        let rest = above((middle - self.low).max(self.high - middle));
        (middle, if self.is_finite() { rest } else { f64::INFINITY })
    }

    /// At least the difference of its ends.
    pub fn width(self) -> f64 {
        above(self.high - self.low)
    }

    /// The largest absolute value.
    pub fn size(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub fn is_zero(self) -> bool {
        self.low == 0.0 && self.high == 0.0
    }

    pub fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// Whether another one lies within it, its ends left out.
    pub fn surrounds(self, other: Self) -> bool {
        self.low < other.low && other.high < self.high
    }

    pub fn contains(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// What two have in common.
    pub fn common(self, other: Self) -> Option<Self> {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        (low <= high).then_some(Self { low, high })
    }

    /// The smallest one around two.
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// What a computed number is, moved outwards by a multiple of its rounding.
    fn near(x: f64, times: f64) -> Self {
        let off = times * (x.abs() * PART + TINY);
        Self { low: x - off, high: x + off }
    }

    fn times(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        let (a, b) = (self.low * other.low, self.low * other.high);
        let (c, d) = (self.high * other.low, self.high * other.high);
        if !(a + b + c + d).is_finite() {
            return Self::LINE;
        }
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        Self { low: below(low) - TINY, high: above(high) + TINY }
    }

    /// The product with a number.
    pub fn scaled(self, by: f64) -> Self {
        if by == 0.0 || self.is_zero() {
            return Self::ZERO;
        }
        let (a, b) = (self.low * by, self.high * by);
        if !(a + b).is_finite() {
            return Self::LINE;
        }
        let (low, high) = if by > 0.0 { (a, b) } else { (b, a) };
        Self { low: below(low) - TINY, high: above(high) + TINY }
    }

    /// Its square: the two factors are the same number.
    pub fn square(self) -> Self {
        let all = self.times(self);
        Self { low: if self.contains(0.0) { 0.0 } else { all.low.max(0.0) }, high: all.high }
    }

    /// The square root of what is not negative in it.
    pub fn root(self) -> Self {
        let end = |x: f64| Self::near(x.max(0.0).sqrt(), 1.0);
        if self.is_zero() { self } else { Self { low: end(self.low).low.max(0.0), high: end(self.high).high } }
    }

    /// The values of a function between its values at the ends; where its slope may vanish in between, up to the side
    /// of one on which they are.
    fn wave(ends: [Self; 2], slopes: [Self; 2]) -> Self {
        let all = ends[0].hull(ends[1]);
        let rises = slopes.iter().all(|slope| slope.low > 0.0);
        let falls = slopes.iter().all(|slope| slope.high < 0.0);
        let reached = match (rises || falls, all.middle() > 0.0) {
            (true, _) => all,
            (false, true) => Self { low: all.low, high: 1.0 },
            (false, false) => Self { low: -1.0, high: all.high },
        };
        Self { low: reached.low.max(-1.0), high: reached.high.min(1.0) }
    }

    /// `2 atan(t) / t` at one square of t: by its alternating series, of which the last term is more than what is left
    /// out, or as it stands.
    fn double_arc_at(square: f64) -> Self {
        let s = Self::new(square, square);
        if square > ARC_SQUARE {
            let t = s.root();
            return Self::whole_angle(t, Self::ONE).scaled(2.0) / t;
        }
        let mut sum = Self::of_size(2.0 * square.powi(ARC_TERMS));
        for k in (0..ARC_TERMS).rev() {
            let sign = if k % 2 == 0 { 2.0 } else { -2.0 };
            sum = sum + Self::new(sign, sign) / Self::from_f64(f64::from(2 * k + 1)) * s.power(k);
        }
        sum
    }

    fn power(self, times: i32) -> Self {
        (0..times).fold(Self::ONE, |product, _| product * self)
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        Self { low: below(self.low + other.low), high: above(self.high + other.high) }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.times(other)
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.low <= 0.0 && other.high >= 0.0 {
            return Self::LINE;
        }
        if self.is_zero() {
            return self;
        }
        let (a, b) = (self.low / other.low, self.low / other.high);
        let (c, d) = (self.high / other.low, self.high / other.high);
        if !(a + b + c + d).is_finite() {
            return Self::LINE;
        }
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        Self { low: below(low) - TINY, high: above(high) + TINY }
    }
}

impl Interval {
    /// What holds the derivative of some order of a curve there.
    pub fn of_curve(self, curve: &Curve, order: usize) -> Self {
        if !self.is_finite() {
            return Self::LINE;
        }
        if curve.is_polynomial() {
            return self.of_piece(curve, 0, order);
        }
        let (knots, last) = (curve.knots(), curve.knots().len() - 2);
        let mut found: Option<Self> = None;
        let mut add = |part: Self| found = Some(found.map_or(part, |sum| sum.hull(part)));
        for (k, ends) in knots.windows(2).enumerate() {
            if self.high >= ends[0] && self.low <= ends[1] {
                add(Self::new(self.low.max(ends[0]), self.high.min(ends[1])).of_piece(curve, k, order));
            }
        }
        for (k, end) in [(0, knots[0]), (last, knots[last + 1])] {
            let beyond = if k == 0 { (self.low, self.high.min(end)) } else { (self.low.max(end), self.high) };
            if beyond.0 < beyond.1 {
                let at = Self::from_point(end);
                let slope = at.of_piece(curve, k, 1);
                add(match order {
                    0 => at.of_piece(curve, k, 0) + slope * (Self::new(beyond.0, beyond.1) - at),
                    1 => slope,
                    _ => Self::ZERO,
                });
            }
        }
        found.unwrap_or(Self::LINE)
    }

    /// The same of the polynomial behind a knot, by the mean value theorem, which loses less than Horner's rule alone.
    fn of_piece(self, curve: &Curve, k: usize, order: usize) -> Self {
        let s = self - Self::from_point(curve.knots()[k]);
        let middle = Self::from_point(s.middle());
        let at = |s: Self, order: usize| polynomial(curve.piece(k), s, order, Self::from_point);
        let plain = at(s, order);
        plain.common(at(middle, order) + at(s, order + 1) * (s - middle)).unwrap_or(plain)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Real for Interval {
    fn from_f64(value: f64) -> Self {
        Self { low: value, high: value }
    }
    fn sin_cos(self) -> (Self, Self) {
        if self.is_zero() {
            return (Self::ZERO, Self::ONE);
        }
        // Written so that what is not a number is wide.
        if !(self.high - self.low < WIDE) {
            return (Self::of_size(1.0), Self::of_size(1.0));
        }
        let [sines, cosines] =
            [libm::sin as fn(f64) -> f64, libm::cos].map(|f| [self.low, self.high].map(|x| Self::near(f(x), FUNCTION)));
        (Self::wave(sines, cosines), Self::wave(cosines, sines))
    }
    // Of a vector whose second number is positive.
    fn whole_angle(sine: Self, cosine: Self) -> Self {
        if cosine.low <= 0.0 || !sine.is_finite() {
            return Self::LINE;
        }
        let tangent = sine / cosine;
        let end = |x: f64| Self::near(libm::atan(x), FUNCTION);
        if tangent.is_zero() { tangent } else { Self { low: end(tangent.low).low, high: end(tangent.high).high } }
    }
    fn tilt(sine: Self, cosine: Self) -> Self {
        if cosine.low > 0.5 { sine } else { Self::LINE }
    }
    fn double_arc(square: Self) -> Self {
        let ends = [square.low.max(0.0), square.high].map(Self::double_arc_at);
        if square.is_finite() { Self { low: ends[1].low, high: ends[0].high } } else { Self::LINE }
    }
    // An offset is within its set.
    fn within_one(self) -> (Self, Self) {
        (Self { low: self.low.clamp(-1.0, 1.0), high: self.high.clamp(-1.0, 1.0) }, Self::ONE)
    }
    fn reciprocal_root(self, _: f64) -> Self {
        Self::ONE / Interval::root(self)
    }
    fn root(self, _: f64) -> Self {
        Interval::root(self)
    }
    fn along(self, curve: &Curve) -> (Self, Self) {
        (self.of_curve(curve, 0), self.of_curve(curve, 1))
    }
}

#[cfg(test)]
mod tests;
