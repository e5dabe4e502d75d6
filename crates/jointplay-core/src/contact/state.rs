//! Where a load has pushed a mechanism.

use crate::closure::newton::State;
use crate::closure::sensitivity::Gradient;

/// Where the load has pushed a mechanism.
#[derive(Clone, Debug)]
pub struct Contact {
    /// The state with its inputs.
    pub state: State,
    /// Reactions at that state: forces along the inputs, and the multipliers of the closure rows.
    pub gradient: Gradient,
    /// Steps taken.
    pub steps: usize,
    /// Whether contact and reactions agree.
    pub settled: bool,
    /// Whether a pose on the way could not be assembled.
    pub blocked: bool,
}
