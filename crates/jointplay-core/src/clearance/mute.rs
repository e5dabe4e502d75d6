//! Forces that count as none.
//!
//! Where a load sends no force at the nominal pose, the displaced pose sends one of the order of the play. A
//! coordinate in which the set is not pushed to first order is *mute*: what pushes it to second order is
//! taken for nothing, so that it stays in the middle.

use super::{MAX_SIZE, Set, Shape};

/// The coordinates of a set, each with its own force, that are not pushed: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mute(u8);

impl Mute {
    /// Whether every coordinate is listened to.
    #[inline]
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    #[inline]
    pub(super) const fn has(self, k: usize) -> bool {
        self.0 >> k & 1 == 1
    }

    #[inline]
    pub(super) fn of<const N: usize>(mute: [bool; N]) -> Self {
        Self(mute.iter().rev().fold(0, |bits, &m| bits << 1 | u8::from(m)))
    }
}

impl Set {
    /// The coordinates that forces up to `tolerance` push, which decides nothing.
    #[inline]
    #[must_use]
    pub fn mute(&self, w: &[f64], tolerance: f64) -> Mute {
        if self.is_zero() {
            return Mute::default();
        }
        match self.shape() {
            Shape::Pin(pin) => pin.mute(w, tolerance),
            Shape::Tapered(tapered) => tapered.mute(w, tolerance),
            // The rest is pushed as a whole.
            _ => Mute::of([self.face(w, tolerance).is_whole()]),
        }
    }

    /// A force without what pushes mute coordinates.
    #[inline]
    #[must_use]
    pub fn heard(&self, w: &[f64], mute: Mute) -> [f64; MAX_SIZE] {
        let mut heard = [0.0; MAX_SIZE];
        if mute.is_none() {
            heard[..w.len()].copy_from_slice(w);
            return heard;
        }
        match self.shape() {
            Shape::Pin(pin) => pin.heard(w, mute),
            Shape::Tapered(tapered) => tapered.heard(w, mute),
            _ => heard,
        }
    }
}
