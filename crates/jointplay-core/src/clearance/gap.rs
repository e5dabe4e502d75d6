//! The gap of a clearance: what hole and pin leave between them.
//!
//! Every set of a joint but the interval of a coupling is as large as its gap: an offset of the gap g is g times one of
//! the gap 1, the play along the axis of a pin apart, which shoulders bound.

use crate::clearance::Set;

impl Set {
    /// Its radius, its gap on each side, or half of an interval about zero.
    #[must_use]
    pub const fn gap(&self) -> f64 {
        match *self {
            Self::Disc { radius }
            | Self::Ball { radius }
            | Self::Journal { radius, .. }
            | Self::Sleeve { radius, .. } => radius,
            Self::Diamond { gap, .. } | Self::Guide { gap, .. } | Self::Plate { gap, .. } => gap,
            Self::Interval { high, .. } => high,
        }
    }

    /// The same set with another gap, not below zero.
    #[must_use]
    pub fn with_gap(&self, gap: f64) -> Self {
        let gap = gap.max(0.0);
        match *self {
            Self::Disc { .. } => Self::Disc { radius: gap },
            Self::Ball { .. } => Self::Ball { radius: gap },
            Self::Journal { half_length, axial, .. } => Self::Journal { radius: gap, half_length, axial },
            Self::Sleeve { half_length, .. } => Self::Sleeve { radius: gap, half_length },
            Self::Diamond { half_length, .. } => Self::Diamond { gap, half_length },
            Self::Guide { half_length, half_width, half_height, .. } => {
                Self::Guide { gap, half_length, half_width, half_height }
            }
            Self::Plate { half_normal, half_side, .. } => Self::Plate { gap, half_normal, half_side },
            Self::Interval { .. } => Self::Interval { low: -gap, high: gap },
        }
    }

    /// Whether a component is as large as the gap.
    #[must_use]
    pub const fn follows_gap(&self, component: usize) -> bool {
        !matches!((self, component), (Self::Journal { .. }, 0))
    }
}
