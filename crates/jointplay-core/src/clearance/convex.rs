//! Support functions and the faces where they are attained.

use crate::clearance::face::{Extent, Face};
use crate::clearance::offset::{MAX_SIZE, padded};
use crate::clearance::{Set, Shape};
use crate::math::vector::norm;

impl Set {
    /// Support function: the largest `w . offset` over the set.
    #[must_use]
    pub fn support(&self, w: &[f64]) -> f64 {
        match self.shape() {
            Shape::Round { radius, size } => radius * norm(&w[..size]),
            Shape::Diamond { gap, half_length } => gap * w[0].abs().max(w[1].abs() / half_length),
            Shape::Interval { low, high } => (w[0] * low).max(w[0] * high),
            Shape::Pin(pin) => pin.support(w),
            Shape::Tapered(tapered) => tapered.support(w),
        }
    }

    /// The face of the set where `w . offset` is largest.
    ///
    /// `tolerance` (a force; in the units of `w[0]` where the set is a single angle) is the size below
    /// which a reaction, or the difference between two competing ones, counts as zero, so that rounding
    /// noise decides nothing. Moments are compared as forces on the set's own levers.
    #[inline]
    #[must_use]
    pub fn face(&self, w: &[f64], tolerance: f64) -> Face {
        let point = |centre| Face { centre, extent: Extent::Point };
        let whole = |centre| Face { centre, extent: Extent::Whole(*self) };
        if self.is_zero() {
            return point([0.0; MAX_SIZE]);
        }
        match self.shape() {
            Shape::Round { radius, size } => {
                let length = w[..size].iter().map(|x| x * x).sum::<f64>().sqrt();
                if length <= tolerance {
                    return whole([0.0; MAX_SIZE]);
                }
                point(std::array::from_fn(|k| if k < size { radius * w[k] / length } else { 0.0 }))
            }
            Shape::Diamond { gap, half_length } => {
                let (shift, tilt) = (w[0].abs(), w[1].abs() / half_length);
                if shift.max(tilt) <= tolerance {
                    return whole([0.0; MAX_SIZE]);
                }
                let corners = [gap.copysign(w[0]), (gap / half_length).copysign(w[1])];
                if (shift - tilt).abs() <= tolerance {
                    let half = [0.5 * corners[0], -0.5 * corners[1]];
                    return Face {
                        centre: padded([0.5 * corners[0], 0.5 * corners[1]]),
                        extent: Extent::Segment(half),
                    };
                }
                point(if shift > tilt { padded([corners[0]]) } else { padded([0.0, corners[1]]) })
            }
            Shape::Interval { low, high } => {
                if w[0].abs() <= tolerance {
                    return whole(padded([0.5 * (low + high)]));
                }
                point(padded([if w[0] > 0.0 { high } else { low }]))
            }
            Shape::Pin(pin) => {
                let (centre, face) = pin.face(w, tolerance);
                Face { centre, extent: if face.is_point() { Extent::Point } else { Extent::Pin(face) } }
            }
            Shape::Tapered(tapered) => {
                let (centre, face) = tapered.face(w, tolerance);
                Face { centre, extent: if face.is_point() { Extent::Point } else { Extent::Tapered(face) } }
            }
        }
    }
}
