//! What to draw.

use crate::clearance::law::Law;

/// What to draw.
#[derive(Clone, Debug)]
pub struct Request {
    /// Samples per configuration.
    pub samples: usize,
    /// Seed of all random streams.
    pub seed: u64,
    /// Probabilities of the quantiles asked for.
    pub probabilities: Vec<f64>,
    /// Acceptance limit of the position error; NaN for none.
    pub limit_position: f64,
    /// Acceptance limit of the rotation; NaN for none.
    pub limit_rotation: f64,
    /// A law for all clearances instead of their own.
    pub law: Option<Law>,
    /// Whether the load pushes every specimen, instead of the clearances scattering by their laws.
    pub loaded: bool,
    /// Whether the samples themselves are wanted; memory then grows with them.
    pub keep: bool,
}
