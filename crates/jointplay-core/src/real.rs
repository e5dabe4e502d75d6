//! The numbers that the closure equations are written in, so that one text of the equations serves
//! a single evaluation and a batch of them.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the closure equations ask of a number.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant.
    fn from_f64(value: f64) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// A residual that vanishes with the angle of the given sine and cosine, and its derivative
    /// with respect to that angle.
    fn angle_residual(sine: Self, cosine: Self) -> (Self, Self);
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        Self::sin_cos(self)
    }
    // The angle itself: unlike its sine it does not vanish at half a turn, so that a rough start
    // cannot settle on the mirrored solution.
    fn angle_residual(sine: Self, cosine: Self) -> (Self, Self) {
        (sine.atan2(cosine), 1.0)
    }
}
