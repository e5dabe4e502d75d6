//! Exposed faces: what a load leaves undecided.

use crate::clearance::offset::{MAX_SIZE, inner, padded};
use crate::clearance::pin::PinFace;
use crate::clearance::tapered::TaperedFace;
use crate::clearance::{Set, Shape};

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

/// A direction in which a face is open.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direction {
    /// Which of the set's own coordinates it moves.
    pub coordinate: usize,
    /// What half of the set's extent displaces.
    pub along: [f64; MAX_SIZE],
    /// Inner products with it tell how far along an offset is, as a part of that.
    pub dual: [f64; MAX_SIZE],
    /// What a force of one does over it.
    pub reach: f64,
}

impl Set {
    /// A direction as the offsets have it.
    #[inline]
    pub(crate) fn along(&self, unit: &[f64; MAX_SIZE]) -> [f64; MAX_SIZE] {
        let (at, middle) = (self.of_unit(unit), self.of_unit(&[0.0; MAX_SIZE]));
        std::array::from_fn(|k| at[k] - middle[k])
    }
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
    pub(crate) const fn is_whole(&self) -> bool {
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

    /// The directions in which the face of a set is open.
    pub(crate) fn directions(&self, set: &Set) -> Vec<Direction> {
        let one = |k: usize| {
            let mut unit = [0.0; MAX_SIZE];
            unit[k] = 1.0;
            (k, unit)
        };
        let own: Vec<(usize, [f64; MAX_SIZE])> = match &self.extent {
            Extent::Point => Vec::new(),
            // The middle of an edge lies on an axis of the set's own square.
            Extent::Segment(_) => vec![one(usize::from(self.centre[0] * self.centre[1] > 0.0))],
            Extent::Whole(_) => (0..set.size()).map(one).collect(),
            Extent::Pin(face) => face.open().map(one).collect(),
            Extent::Tapered(face) => face.directions(),
        };
        let direction = |(coordinate, unit): (usize, [f64; MAX_SIZE])| {
            let middle = set.of_unit(&[0.0; MAX_SIZE]);
            let squared = inner(&unit, &unit);
            let along_dual = |k: usize| {
                let mut offset = middle;
                offset[k] += set.half_width(k);
                inner(&unit, &set.to_unit(&offset)) / (set.half_width(k) * squared)
            };
            let moves = |k: usize| k < set.size() && set.half_width(k) > 0.0;
            Direction {
                coordinate,
                along: set.along(&unit),
                dual: std::array::from_fn(|k| if moves(k) { along_dual(k) } else { 0.0 }),
                reach: match set.shape() {
                    Shape::Round { radius, .. } => radius,
                    Shape::Diamond { gap, .. } => gap,
                    Shape::Interval { low, high } => 0.5 * (high - low),
                    Shape::Pin(pin) if coordinate < pin.across() => pin.axial.unwrap_or(0.0),
                    Shape::Pin(pin) => pin.radius,
                    Shape::Tapered(tapered) => tapered.gap,
                },
            }
        };
        own.into_iter().map(direction).collect()
    }

    /// A point of the face where `direction . offset` is largest.
    #[must_use]
    pub fn farthest(&self, direction: &[f64]) -> [f64; MAX_SIZE] {
        match &self.extent {
            Extent::Point => self.centre,
            Extent::Segment(half) => {
                let part = inner(direction, half);
                let side = if part == 0.0 { 0.0 } else { part.signum() };
                padded([self.centre[0] + side * half[0], self.centre[1] + side * half[1]])
            }
            Extent::Whole(set) => set.face(direction, 0.0).centre,
            Extent::Pin(face) => face.farthest(&self.centre, direction),
            Extent::Tapered(face) => face.farthest(direction),
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
