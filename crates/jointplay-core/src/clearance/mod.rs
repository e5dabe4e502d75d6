//! Admissible sets of joint offsets: support function, support point, exposed face, moments.
//!
//! | joint | set | support function h(F, M) |
//! |---|---|---|
//! | pin in hole, plane | disc, `|d| <= r` | `r |F|` |
//! | slider in guide, plane | diamond, `|d| + (L/2)|angle| <= c` | `c max(|F|, 2|M|/L)` |
//! | pin in slot, tolerance, drive error | interval | `max(low F, high F)` |
//! | ball in socket | ball, `|d| <= r` | `r |F|` |
//! | pin in bore, space | journal and sleeve, see [`pin`] | `r (|R+| + |R-|) + axial |F_along|` |
//! | slider in guide, space | guide, see [`tapered`] | `max(rolled, shifted and tilted)` |
//! | plane on plane | plate, see [`tapered`] | `c max(|F|, |M1|/a, |M2|/b)` |
//!
//! The disc is the "clearance link" of Ting, Zhu and Watkins (Mech. Mach. Theory 35, 2000, 391); the
//! diamond is the linearised condition that both corners of the slider stay inside the guide. The sets
//! of spatial joints are the linearised conditions of contact at the ends of the pin and at the corners
//! of the guide (Parenti-Castelli and Venanzi, Mech. Mach. Theory 40, 2005, 1282).

pub(crate) mod characteristic;
mod check;
mod chord;
mod convex;
pub mod draw;
mod ends;
pub(crate) mod face;
pub(crate) mod faces_on_lanes;
mod gap;
pub(crate) mod law;
mod normalized;
pub(crate) mod offset;
mod pin;
mod projection;
pub(crate) mod quantile;
#[cfg(test)]
pub(crate) mod samples;
mod tapered;
#[cfg(test)]
mod tests;
pub(crate) mod turning_on_lanes;
pub(crate) mod undecided;
mod unforced;
mod variance;

pub use check::SetError;
pub use face::Face;
pub use law::Law;
pub use undecided::Unforced;

use serde::Deserialize;

use crate::clearance::offset::{MAX_SIZE, padded};
use crate::clearance::pin::Pin;
use crate::clearance::tapered::Tapered;
use crate::math::vector::norm;

/// A convex compact set that contains zero, if [`Set::check`] finds nothing wrong.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Set {
    /// Two translations within a circle.
    Disc {
        /// Radial clearance.
        radius: f64,
    },
    /// A translation and an angle, bounded together.
    Diamond {
        /// Gap on each side.
        gap: f64,
        /// Half of the slider's length.
        half_length: f64,
    },
    /// One number.
    Interval {
        /// Lower bound, not above zero.
        low: f64,
        /// Upper bound, not below zero.
        high: f64,
    },
    /// Three translations within a sphere.
    Ball {
        /// Radial clearance.
        radius: f64,
    },
    /// Pin in a bore between shoulders. Components: along the axis, side, normal, tilt about side, tilt
    /// about normal.
    Journal {
        /// Radial clearance at both ends of the pin.
        radius: f64,
        /// Half of the length over which pin and bore engage.
        half_length: f64,
        /// Axial play on each side.
        axial: f64,
    },
    /// Pin in a bore, free to slide. Components: side, normal, tilt about side, tilt about normal.
    Sleeve {
        /// Radial clearance at both ends of the pin.
        radius: f64,
        /// Half of the length over which pin and bore engage.
        half_length: f64,
    },
    /// Rectangular slider in a guide. Components: side, normal, roll, tilt about side, tilt about
    /// normal.
    Guide {
        /// Gap on each side.
        gap: f64,
        /// Half of the slider's length.
        half_length: f64,
        /// Half of the slider's width, along side.
        half_width: f64,
        /// Half of the slider's height, along normal.
        half_height: f64,
    },
    /// Plate between planes. Components: along their normal, tilt about side, tilt about normal.
    Plate {
        /// Gap on each side.
        gap: f64,
        /// Half of the plate's size along the joint's normal, the lever of the tilt about side.
        half_normal: f64,
        /// Half of the plate's size along the joint's side, the lever of the tilt about normal.
        half_side: f64,
    },
}

/// What the sets are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Ball in as many dimensions as it has components.
    Round {
        /// Its radius.
        radius: f64,
        /// Its number of components.
        size: usize,
    },
    /// [`Set::Diamond`].
    Diamond {
        /// Gap on each side.
        gap: f64,
        /// Half of the slider's length.
        half_length: f64,
    },
    /// [`Set::Interval`].
    Interval {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Both ends of a pin in a disc each.
    Pin(Pin),
    /// Squares that taper along an axis.
    Tapered(Tapered),
}

impl Set {
    /// What the set is made of.
    #[inline]
    pub(crate) fn shape(&self) -> Shape {
        match *self {
            Self::Disc { radius } => Shape::Round { radius, size: 2 },
            Self::Ball { radius } => Shape::Round { radius, size: 3 },
            Self::Diamond { gap, half_length } => Shape::Diamond { gap, half_length },
            Self::Interval { low, high } => Shape::Interval { low, high },
            Self::Journal { radius, half_length, axial } => Shape::Pin(Pin { radius, half_length, axial: Some(axial) }),
            Self::Sleeve { radius, half_length } => Shape::Pin(Pin { radius, half_length, axial: None }),
            Self::Guide { gap, half_length, half_width, half_height } => {
                Shape::Tapered(Tapered::guide(gap, half_length, half_width, half_height))
            }
            Self::Plate { gap, half_normal, half_side } => Shape::Tapered(Tapered::plate(gap, half_normal, half_side)),
        }
    }

    /// Number of components.
    #[must_use]
    pub const fn size(&self) -> usize {
        match self {
            Self::Interval { .. } => 1,
            Self::Disc { .. } | Self::Diamond { .. } => 2,
            Self::Ball { .. } | Self::Plate { .. } => 3,
            Self::Sleeve { .. } => 4,
            Self::Journal { .. } | Self::Guide { .. } => 5,
        }
    }

    /// The largest absolute value of one component.
    #[inline]
    #[must_use]
    pub fn half_width(&self, component: usize) -> f64 {
        match (*self, component) {
            (Self::Disc { radius } | Self::Ball { radius }, _)
            | (Self::Journal { radius, .. }, 1 | 2)
            | (Self::Sleeve { radius, .. }, 0 | 1) => radius,
            (Self::Journal { axial, .. }, 0) => axial,
            (Self::Journal { radius, half_length, .. } | Self::Sleeve { radius, half_length }, _) => {
                radius / half_length
            }
            (Self::Diamond { gap, .. } | Self::Plate { gap, .. }, 0) | (Self::Guide { gap, .. }, 0 | 1) => gap,
            (Self::Guide { gap, half_width, half_height, .. }, 2) => gap / half_width.max(half_height),
            (Self::Diamond { gap, half_length } | Self::Guide { gap, half_length, .. }, _) => gap / half_length,
            (Self::Plate { gap, half_normal, .. }, 1) => gap / half_normal,
            (Self::Plate { gap, half_side, .. }, _) => gap / half_side,
            (Self::Interval { low, high }, _) => high.max(-low),
        }
    }

    /// The ends of the line along which the first component moves, whatever the others are.
    pub(crate) fn line(&self) -> Option<[f64; 2]> {
        let ends = match self.shape() {
            Shape::Interval { low, high } => [low, high],
            Shape::Pin(pin) => pin.axial.map(|axial| [-axial, axial])?,
            Shape::Round { .. } | Shape::Diamond { .. } | Shape::Tapered(_) => return None,
        };
        (ends[1] > ends[0]).then_some(ends)
    }

    /// What `w . offset` reaches when one component goes as far as it can alone: at most the support
    /// function, and of its order.
    #[inline]
    #[must_use]
    pub fn reach(&self, w: &[f64]) -> f64 {
        w.iter().enumerate().fold(0.0, |reach: f64, (k, w)| reach.max(w.abs() * self.half_width(k)))
    }

    /// Whether the set is the single point zero.
    #[inline]
    #[must_use]
    pub fn is_zero(&self) -> bool {
        match *self {
            Self::Disc { radius } | Self::Ball { radius } | Self::Sleeve { radius, .. } => radius == 0.0,
            Self::Diamond { gap, .. } | Self::Guide { gap, .. } | Self::Plate { gap, .. } => gap == 0.0,
            Self::Interval { low, high } => low == 0.0 && high == 0.0,
            Self::Journal { radius, axial, .. } => radius == 0.0 && axial == 0.0,
        }
    }

    /// Whether the offset is admissible, to a relative `tolerance`.
    #[must_use]
    pub fn contains(&self, offset: &[f64], tolerance: f64) -> bool {
        let slack = 1.0 + tolerance;
        let ends_inside = |radius: f64, half_length: f64, u: &[f64]| {
            [half_length, -half_length].iter().all(|arm| (u[0] + arm * u[3]).hypot(u[1] - arm * u[2]) <= radius * slack)
        };
        match *self {
            Self::Disc { radius } | Self::Ball { radius } => norm(offset) <= radius * slack,
            Self::Diamond { gap, half_length } => offset[0].abs() + half_length * offset[1].abs() <= gap * slack,
            Self::Interval { low, high } => {
                let margin = tolerance * (high - low);
                low - margin <= offset[0] && offset[0] <= high + margin
            }
            Self::Journal { radius, half_length, axial } => {
                offset[0].abs() <= axial * slack && ends_inside(radius, half_length, &offset[1..])
            }
            Self::Sleeve { radius, half_length } => ends_inside(radius, half_length, offset),
            Self::Guide { gap, half_length, half_width, half_height } => {
                let [side, normal, roll, tilt_side, tilt_normal] = std::array::from_fn(|k| offset[k].abs());
                side + half_length * tilt_normal + half_height * roll <= gap * slack
                    && normal + half_length * tilt_side + half_width * roll <= gap * slack
            }
            Self::Plate { gap, half_normal, half_side } => {
                offset[0].abs() + half_normal * offset[1].abs() + half_side * offset[2].abs() <= gap * slack
            }
        }
    }

    /// Directions (angles of `w` in the plane of two rows of a linear map) at which the support
    /// point of a polyhedral set of a planar joint jumps are where these linear forms of `w` vanish.
    #[must_use]
    pub fn break_forms(&self) -> Vec<[f64; 2]> {
        match *self {
            Self::Diamond { half_length, .. } => {
                let l = 1.0 / half_length;
                vec![[1.0, l], [1.0, -l], [1.0, 0.0], [0.0, 1.0]]
            }
            Self::Interval { .. } => vec![[1.0, 0.0]],
            _ => Vec::new(),
        }
    }

    /// Mean and variance of each component under a law.
    ///
    /// The components are uncorrelated: a law is symmetric in each of the set's own coordinates, and
    /// where a component is the half sum of two of those another is their half difference, with equal
    /// variances of the two.
    #[must_use]
    pub fn moments(&self, law: Law) -> ([f64; MAX_SIZE], [f64; MAX_SIZE]) {
        let mut mean = [0.0; MAX_SIZE];
        let variance = match self.shape() {
            Shape::Round { radius, size } => {
                let one = radius * radius * variance::round_variance(law, size);
                std::array::from_fn(|k| if k < size { one } else { 0.0 })
            }
            Shape::Diamond { gap, half_length } => {
                let variance = gap * gap * variance::diamond_variance(law);
                padded([variance, variance / (half_length * half_length)])
            }
            Shape::Interval { low, high } => {
                let half = 0.5 * (high - low);
                mean[0] = 0.5 * (low + high);
                padded([half * half * variance::interval_variance(law)])
            }
            Shape::Pin(pin) => pin.variances(law),
            Shape::Tapered(tapered) => tapered.variances(law),
        };
        (mean, variance)
    }
}
