//! Forces that count as none.
//!
//! Where a load sends no force at the nominal pose, the displaced pose sends one of the order of the play. A
//! coordinate in which the set is not pushed to first order is *mute*: what pushes it to second order is
//! taken for nothing, so that it stays in the middle.

use crate::clearance::mute::Mute;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::{Set, Shape};

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

    /// Whether one of the set's own coordinates is mute.
    #[must_use]
    pub fn is_mute(&self, coordinate: usize, mute: Mute) -> bool {
        match self.shape() {
            // An end has two coordinates.
            Shape::Pin(pin) if pin.axial.is_some() => mute.has(coordinate.div_ceil(2)),
            Shape::Pin(_) => mute.has(1 + coordinate / 2),
            Shape::Tapered(_) => mute.has(coordinate),
            _ => mute.has(0),
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

#[cfg(test)]
mod tests {
    use super::*;

    const PIN: Set = Set::Journal { radius: 0.7, half_length: 2.0, axial: 0.3 };
    const GUIDE: Set = Set::Guide { gap: 0.3, half_length: 2.5, half_width: 0.8, half_height: 0.5 };

    #[test]
    fn all_is_heard_where_everything_is_pushed() {
        for (set, w) in [(PIN, [1.0, -2.0, 0.5, 0.3, 0.7]), (GUIDE, [1.0, -2.0, 0.5, 0.3, 0.7])] {
            let mute = set.mute(&w, 1e-9);
            assert!(mute.is_none());
            assert!(set.heard(&w, mute).iter().zip(&w).all(|(h, w)| h.total_cmp(w).is_eq()));
        }
    }

    /// Two coordinates that are not pushed: along the axis, and the second end, whose reaction
    /// `(F - M x q / l) / 2` is zero.
    #[test]
    fn what_pushes_mute_parts_of_a_pin_later_is_not_heard() {
        let one_end = [0.0, -2.0, 0.5, -1.0, -4.0];
        let mute = PIN.mute(&one_end, 1e-9);
        let later = [1e-3, -2.0 + 1e-4, 0.5, -1.0, -4.0 + 3e-4];
        let heard = PIN.heard(&later, mute);
        assert!(heard[0] == 0.0);
        // All of it on the first end, at the lever of 2.
        assert!((heard[4] - 2.0 * heard[1]).abs() < 1e-15 && (heard[3] + 2.0 * heard[2]).abs() < 1e-15);
        let face = PIN.face(&heard, 1e-9);
        assert!(!face.is_point());
        let middle = face.nearest(&[0.0; 5]);
        assert!(middle[0] == 0.0);
        // The second end stays in the middle of its hole.
        assert!((middle[1] - 2.0 * middle[4]).abs() < 1e-15 && (middle[2] + 2.0 * middle[3]).abs() < 1e-15);
    }

    #[test]
    fn a_guide_that_nothing_rolls_does_not_roll_later() {
        let pressed = [1.0, 2.0, 0.0, 0.0, 0.0];
        let mute = GUIDE.mute(&pressed, 1e-9);
        let heard = GUIDE.heard(&[1.0, 2.0, 10.0, 1e-3, 0.0], mute);
        assert!(heard[2] == 0.0);
        assert!((heard[0] - 1.0).abs() < 1e-15 && (heard[3] - 1e-3).abs() < 1e-15);
        assert!(GUIDE.face(&heard, 1e-9).is_point());
    }
}
