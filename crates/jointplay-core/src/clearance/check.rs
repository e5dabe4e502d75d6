//! Sets from their specification, checked: every one bounded and not empty.

use super::Set;
use crate::spec::SetSpec;

/// A number of a set that leaves it unbounded or empty.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} of the {set} is {value}: {valid}")]
pub struct SetError {
    set: &'static str,
    key: &'static str,
    value: f64,
    valid: &'static str,
}

impl TryFrom<SetSpec> for Set {
    type Error = SetError;

    fn try_from(spec: SetSpec) -> Result<Self, SetError> {
        let check = |good: bool, set, key, value, valid| {
            if good { Ok(value) } else { Err(SetError { set, key, value, valid }) }
        };
        let size = |set, key, value: f64| {
            check(value.is_finite() && value >= 0.0, set, key, value, "it must be finite and not negative")
        };
        // Without a lever no angle is bounded, whatever the gap.
        let lever = |set, key, value: f64| {
            check(value.is_finite() && value > 0.0, set, key, value, "it must be finite and above zero")
        };
        Ok(match spec {
            SetSpec::Disc { radius } => Self::Disc { radius: size("disc", "radius", radius)? },
            SetSpec::Diamond { gap, half_length } => Self::Diamond {
                gap: size("diamond", "gap", gap)?,
                half_length: lever("diamond", "half_length", half_length)?,
            },
            SetSpec::Interval { low, high } => Self::Interval {
                low: check(low.is_finite() && low <= 0.0, "interval", "low", low, "it must not be above zero")?,
                high: check(high.is_finite() && high >= 0.0, "interval", "high", high, "it must not be below zero")?,
            },
            SetSpec::Ball { radius } => Self::Ball { radius: size("ball", "radius", radius)? },
            SetSpec::Journal { radius, half_length, axial } => Self::Journal {
                radius: size("journal", "radius", radius)?,
                half_length: lever("journal", "half_length", half_length)?,
                axial: size("journal", "axial", axial)?,
            },
            SetSpec::Sleeve { radius, half_length } => Self::Sleeve {
                radius: size("sleeve", "radius", radius)?,
                half_length: lever("sleeve", "half_length", half_length)?,
            },
            SetSpec::Guide { gap, half_length, half_width, half_height } => {
                let half_width = size("guide", "half_width", half_width)?;
                let half_height = size("guide", "half_height", half_height)?;
                // One of the two bounds the roll.
                lever("guide", "half_width", half_width.max(half_height))?;
                Self::Guide {
                    gap: size("guide", "gap", gap)?,
                    half_length: lever("guide", "half_length", half_length)?,
                    half_width,
                    half_height,
                }
            }
            SetSpec::Plate { gap, half_normal, half_side } => Self::Plate {
                gap: size("plate", "gap", gap)?,
                half_normal: lever("plate", "half_normal", half_normal)?,
                half_side: lever("plate", "half_side", half_side)?,
            },
        })
    }
}
