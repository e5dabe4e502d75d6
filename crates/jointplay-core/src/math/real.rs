//! The numbers that the closure equations are written in, so that one text of the equations serves
//! a single evaluation and a batch of them.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math::curve::Curve;

/// What the closure equations ask of a number.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant.
    fn from_f64(value: f64) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the given sine and cosine, times one positive number near one, between minus and plus half a turn.
    fn whole_angle(sine: Self, cosine: Self) -> Self;
    /// A residual that vanishes with the angle of the given sine and cosine, and its derivative
    /// with respect to that angle.
    ///
    /// The angle itself: unlike its sine it does not vanish at half a turn, so that a rough start cannot settle on the
    /// mirrored solution.
    fn angle_residual(sine: Self, cosine: Self) -> (Self, Self) {
        (Self::whole_angle(sine, cosine), Self::from_f64(1.0))
    }
    /// The angle of the given sine and cosine, times any positive number each; at least near zero.
    fn small_angle(sine: Self, cosine: Self) -> Self {
        Self::whole_angle(sine, cosine)
    }
    /// The same of an angle that may be as large as a quarter of a turn.
    fn wide_angle(sine: Self, cosine: Self) -> Self {
        Self::whole_angle(sine, cosine)
    }
    /// A number that vanishes with the tilt whose component has the given sine, the cosine being that of
    /// the whole tilt; the sine itself near zero.
    fn tilt(sine: Self, cosine: Self) -> Self;
    /// `2 atan(t) / t` of the square of t.
    fn double_arc(square: Self) -> Self;
    /// Sine and cosine of an angle that may be as large as some turns.
    fn wide_sin_cos(self) -> (Self, Self) {
        self.sin_cos()
    }
    /// Itself between -1 and 1, else the nearer of these; and the slope of that, at least between them.
    fn within_one(self) -> (Self, Self);
    /// One over the square root, `near` being what the root is like, give or take a factor of some hundreds; zero of zero.
    fn reciprocal_root(self, near: f64) -> Self;
    /// The square root, by way of a number within a factor of three of it; zero of a rough start's negative number.
    fn root(self, near: f64) -> Self;
    /// Value and slope of a curve there; in recorded programs of a single polynomial.
    fn along(self, curve: &Curve) -> (Self, Self);
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        Self::sin_cos(self)
    }
    fn whole_angle(sine: Self, cosine: Self) -> Self {
        sine.atan2(cosine)
    }
    fn reciprocal_root(self, _: f64) -> Self {
        if self > 0.0 { 1.0 / self.sqrt() } else { 0.0 }
    }
    fn tilt(sine: Self, cosine: Self) -> Self {
        if cosine > 0.5 {
            return sine;
        }
        // The component of the rotation vector; half a turn is as far as it goes, about any axis.
        let whole = (1.0 - cosine * cosine).max(0.0).sqrt();
        let angle = whole.atan2(cosine);
        if whole < 1e-6 { angle } else { sine * angle / whole }
    }
    fn double_arc(square: Self) -> Self {
        let t = square.sqrt();
        // Below this the cubic term is lost beside 1.
        if t < 1e-8 { 2.0 } else { 2.0 * t.atan() / t }
    }
    fn within_one(self) -> (Self, Self) {
        // An end of the play is inside, rounded as it may be.
        (self.clamp(-1.0, 1.0), if self.abs() <= 1.0 + 1e-9 { 1.0 } else { 0.0 })
    }
    fn root(self, _: f64) -> Self {
        self.max(0.0).sqrt()
    }
    fn along(self, curve: &Curve) -> (Self, Self) {
        (curve.at(self, 0), curve.at(self, 1))
    }
}
