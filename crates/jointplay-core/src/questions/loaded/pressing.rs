//! The forces that decide where a load leaves the offsets.

use crate::clearance::undecided::Unforced;

/// The forces along all parameters at a pose.
pub(crate) struct Pressing<F: Fn(usize) -> f64, M: Fn(usize) -> Unforced> {
    /// The force along a parameter.
    pub force: F,
    /// The size of all forces.
    pub scale: f64,
    /// What of a source the load does not push at the nominal pose.
    pub unforced: M,
}
