//! What to draw.

use crate::clearance::law::Law;

/// Which points the parameters are drawn by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Pseudo-random numbers.
    Plain,
    /// Independent replicates of scrambled Sobol points.
    Sobol,
}

/// What to draw.
#[derive(Clone, Debug)]
pub struct Request {
    /// Samples per configuration.
    pub samples: usize,
    /// Seed of all random streams.
    pub seed: u64,
    /// Which points.
    pub sampling: Sampling,
    /// Probabilities of the quantiles asked for.
    pub probabilities: Vec<f64>,
    /// Lowest and highest acceptable value of every quantity, infinite where there is none; empty without any limit.
    pub limits: Vec<[f64; 2]>,
    /// A law for all clearances instead of their own.
    pub law: Option<Law>,
    /// Whether the load pushes every specimen, instead of the clearances scattering by their laws.
    pub loaded: bool,
    /// Whether the samples themselves are wanted; memory then grows with them.
    pub keep: bool,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            samples: 0,
            seed: 0,
            sampling: Sampling::Sobol,
            probabilities: Vec::new(),
            limits: Vec::new(),
            law: None,
            loaded: false,
            keep: false,
        }
    }
}
