//! Exposed faces: what a load leaves undecided.

use super::pin::PinFace;
use super::tapered::TaperedFace;
use super::{MAX_SIZE, Set, inner, padded};

/// The part of a set where a linear function is largest: a centre and how far it reaches.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// The middle of the face.
    pub centre: [f64; MAX_SIZE],
    pub(super) extent: Extent,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Extent {
    Point,
    /// Half of an edge of a diamond.
    Segment([f64; 2]),
    Whole(Set),
    Pin(PinFace),
    Tapered(TaperedFace),
}

impl Face {
    /// Whether the linear function decides a single point.
    #[inline]
    #[must_use]
    pub const fn is_point(&self) -> bool {
        matches!(self.extent, Extent::Point)
    }

    /// Whether it decides nothing at all.
    #[inline]
    pub(super) const fn is_whole(&self) -> bool {
        matches!(self.extent, Extent::Whole(_))
    }

    /// The point of the face nearest to an offset of the set, each part of it measured in its own
    /// proportions.
    #[must_use]
    pub fn nearest(&self, offset: &[f64]) -> [f64; MAX_SIZE] {
        match &self.extent {
            Extent::Point => self.centre,
            Extent::Whole(_) => {
                let mut nearest = [0.0; MAX_SIZE];
                nearest[..offset.len()].copy_from_slice(offset);
                nearest
            }
            Extent::Segment(half) => {
                // Along the segment in its own proportions, since its components differ in unit.
                let along = (0..2).map(|k| (offset[k] - self.centre[k]) / half[k]).sum::<f64>();
                let t = (0.5 * along).clamp(-1.0, 1.0);
                padded([self.centre[0] + t * half[0], self.centre[1] + t * half[1]])
            }
            Extent::Pin(face) => face.nearest(&self.centre, offset),
            Extent::Tapered(face) => face.nearest(offset),
        }
    }

    /// Half of the range of `direction . offset` over the face.
    #[must_use]
    pub fn half_width(&self, direction: &[f64]) -> f64 {
        match &self.extent {
            Extent::Point => 0.0,
            Extent::Segment(half) => inner(direction, half).abs(),
            Extent::Whole(set) => {
                let mut opposite = [0.0; MAX_SIZE];
                opposite.iter_mut().zip(direction).for_each(|(o, d)| *o = -d);
                0.5 * (set.support(direction) + set.support(&opposite))
            }
            Extent::Pin(face) => face.half_width(direction),
            Extent::Tapered(face) => face.half_width(direction),
        }
    }
}
