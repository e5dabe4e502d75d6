//! The gap of a clearance that depends on the sizes of its parts, such as hole and pin.
//!
//! `gap = base + sum of factor * size`, each size with its known deviation; a pair with interference, whose gap is
//! below zero, has no play.

/// A size of a clearance.
#[derive(Clone, Debug)]
pub struct Size {
    /// Its source.
    pub source: usize,
    /// Its parameter.
    pub parameter: usize,
    /// How much of it the gap is.
    pub factor: f64,
    /// Its part in the offsets of the clearance as the set stands.
    pub share: f64,
}

/// The gap of a clearance with sizes.
#[derive(Clone, Debug)]
pub struct Gap {
    /// What it is with every size in its middle.
    pub base: f64,
    /// What it depends on.
    pub sizes: Vec<Size>,
    /// The largest one; laws without limits go beyond.
    pub largest: f64,
}

impl Gap {
    /// The gap for parameter values, below zero where there is interference.
    pub(crate) fn with_interference(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.sizes.iter().fold(self.base, |gap, size| gap + size.factor * value(size.parameter))
    }

    /// The gap for parameter values.
    pub(crate) fn at(&self, parameters: &[f64]) -> f64 {
        self.with_interference(|p| parameters[p]).max(0.0)
    }
}
