//! Forces that count as none.
//!
//! Where a load sends no force at the nominal pose, the displaced pose sends one of the order of the play. A
//! coordinate in which the set is not pushed to first order is *unforced*. What pushes it to second order does not count to
//! first order: there it stays in the middle. On the exact closure it counts like any other.

use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::Unforced;
use crate::clearance::{Set, Shape};

impl Set {
    /// The coordinates that forces up to `tolerance` push, which decides nothing.
    #[inline]
    #[must_use]
    pub fn unforced(&self, w: &[f64], tolerance: f64) -> Unforced {
        if self.is_zero() {
            return Unforced::default();
        }
        match self.shape() {
            Shape::Pin(pin) => pin.unforced(w, tolerance),
            Shape::Tapered(tapered) => tapered.unforced(w, tolerance),
            // The rest is pushed as a whole.
            _ => Unforced::of([self.face(w, tolerance).is_whole()]),
        }
    }

    /// Whether one of the set's own coordinates is unforced.
    #[must_use]
    pub fn is_unforced(&self, coordinate: usize, unforced: Unforced) -> bool {
        match self.shape() {
            // An end has two coordinates.
            Shape::Pin(pin) if pin.axial.is_some() => unforced.has(coordinate.div_ceil(2)),
            Shape::Pin(_) => unforced.has(1 + coordinate / 2),
            Shape::Tapered(_) => unforced.has(coordinate),
            _ => unforced.has(0),
        }
    }

    /// A force without what pushes unforced coordinates.
    #[inline]
    #[must_use]
    pub fn masked_force(&self, w: &[f64], unforced: Unforced) -> [f64; MAX_SIZE] {
        let mut masked_force = [0.0; MAX_SIZE];
        if unforced.is_none() {
            masked_force[..w.len()].copy_from_slice(w);
            return masked_force;
        }
        match self.shape() {
            Shape::Pin(pin) => pin.masked_force(w, unforced),
            Shape::Tapered(tapered) => tapered.masked_force(w, unforced),
            _ => masked_force,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIN: Set = Set::Journal { radius: 0.7, half_length: 2.0, axial: 0.3 };
    const GUIDE: Set = Set::Guide { gap: 0.3, half_length: 2.5, half_width: 0.8, half_height: 0.5 };

    #[test]
    fn all_counts_where_everything_is_pushed() {
        for (set, w) in [(PIN, [1.0, -2.0, 0.5, 0.3, 0.7]), (GUIDE, [1.0, -2.0, 0.5, 0.3, 0.7])] {
            let unforced = set.unforced(&w, 1e-9);
            assert!(unforced.is_none());
            assert!(set.masked_force(&w, unforced).iter().zip(&w).all(|(h, w)| h.total_cmp(w).is_eq()));
        }
    }

    /// Two coordinates that are not pushed: along the axis, and the second end, whose reaction
    /// `(F - M x q / l) / 2` is zero.
    #[test]
    fn what_pushes_unforced_parts_of_a_pin_later_is_masked() {
        let one_end = [0.0, -2.0, 0.5, -1.0, -4.0];
        let unforced = PIN.unforced(&one_end, 1e-9);
        let later = [1e-3, -2.0 + 1e-4, 0.5, -1.0, -4.0 + 3e-4];
        let masked_force = PIN.masked_force(&later, unforced);
        assert!(masked_force[0] == 0.0);
        // All of it on the first end, at the lever of 2.
        assert!(
            (masked_force[4] - 2.0 * masked_force[1]).abs() < 1e-15
                && (masked_force[3] + 2.0 * masked_force[2]).abs() < 1e-15
        );
        let face = PIN.face(&masked_force, 1e-9);
        assert!(!face.is_point());
        let middle = face.nearest(&[0.0; 5]);
        assert!(middle[0] == 0.0);
        // The second end stays in the middle of its hole.
        assert!((middle[1] - 2.0 * middle[4]).abs() < 1e-15 && (middle[2] + 2.0 * middle[3]).abs() < 1e-15);
    }

    #[test]
    fn a_guide_that_nothing_rolls_does_not_roll_later() {
        let pressed = [1.0, 2.0, 0.0, 0.0, 0.0];
        let unforced = GUIDE.unforced(&pressed, 1e-9);
        let masked_force = GUIDE.masked_force(&[1.0, 2.0, 10.0, 1e-3, 0.0], unforced);
        assert!(masked_force[2] == 0.0);
        assert!((masked_force[0] - 1.0).abs() < 1e-15 && (masked_force[3] - 1e-3).abs() < 1e-15);
        assert!(GUIDE.face(&masked_force, 1e-9).is_point());
    }
}
