//! Whether the numbers of a set leave it bounded and not empty.

use crate::clearance::Set;

/// A number of a set that leaves it unbounded or empty.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} of the {set} is {value}: {valid}")]
pub struct SetError {
    set: &'static str,
    key: &'static str,
    value: f64,
    valid: &'static str,
}

/// What is asked of one number.
struct Rule {
    key: &'static str,
    value: f64,
    good: bool,
    valid: &'static str,
}

fn size(key: &'static str, value: f64) -> Rule {
    Rule { key, value, good: value.is_finite() && value >= 0.0, valid: "it must be finite and not negative" }
}

/// Without a lever no angle is bounded, whatever the gap.
fn lever(key: &'static str, value: f64) -> Rule {
    Rule { key, value, good: value.is_finite() && value > 0.0, valid: "it must be finite and above zero" }
}

impl Set {
    /// # Errors
    /// The first number that leaves the set unbounded or empty.
    pub fn check(&self) -> Result<(), SetError> {
        let (set, rules) = match *self {
            Self::Disc { radius } => ("disc", vec![size("radius", radius)]),
            Self::Diamond { gap, half_length } => {
                ("diamond", vec![size("gap", gap), lever("half_length", half_length)])
            }
            Self::Interval { low, high } => {
                let (below, above) = (low.is_finite() && low <= 0.0, high.is_finite() && high >= 0.0);
                let low = Rule { key: "low", value: low, good: below, valid: "it must not be above zero" };
                let high = Rule { key: "high", value: high, good: above, valid: "it must not be below zero" };
                ("interval", vec![low, high])
            }
            Self::Ball { radius } => ("ball", vec![size("radius", radius)]),
            Self::Journal { radius, half_length, axial } => {
                ("journal", vec![size("radius", radius), lever("half_length", half_length), size("axial", axial)])
            }
            Self::Sleeve { radius, half_length } => {
                ("sleeve", vec![size("radius", radius), lever("half_length", half_length)])
            }
            Self::Guide { gap, half_length, half_width, half_height } => {
                let (width, height) = (size("half_width", half_width), size("half_height", half_height));
                // One of the two bounds the roll.
                let roll = lever("half_width", half_width.max(half_height));
                ("guide", vec![width, height, roll, size("gap", gap), lever("half_length", half_length)])
            }
            Self::Plate { gap, half_normal, half_side } => {
                ("plate", vec![size("gap", gap), lever("half_normal", half_normal), lever("half_side", half_side)])
            }
        };
        match rules.into_iter().find(|rule| !rule.good) {
            None => Ok(()),
            Some(Rule { key, value, valid, .. }) => Err(SetError { set, key, value, valid }),
        }
    }
}
