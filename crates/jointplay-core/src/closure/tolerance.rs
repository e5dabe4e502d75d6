//! What forces, offsets and steps are compared by.

use crate::closure::equations::Inputs;
use crate::closure::sensitivity::Gradient;
use crate::math::space::Component;
use crate::mechanism::{Mechanism, Source};

impl Source {
    /// A tolerance for forces as one for what is conjugate to the first component: an angle's moment is compared as a
    /// force at the characteristic length.
    #[inline]
    #[must_use]
    pub fn undecided(&self, tolerance: f64) -> f64 {
        tolerance * self.lever
    }
}

impl Mechanism {
    /// Size of the multipliers as forces.
    pub(crate) fn force_scale(&self, gradient: &Gradient) -> f64 {
        self.rows.iter().zip(&gradient.multipliers).fold(0.0, |largest: f64, (row, l)| {
            largest.max(match row.component {
                Component::Along(_) => l.abs(),
                Component::About(_) => l.abs() / self.length,
            })
        })
    }

    /// Largest change of an offset, as a part of its set.
    pub(crate) fn change(&self, from: &Inputs<f64>, to: &Inputs<f64>) -> f64 {
        self.largest_change(&from.parameters, &to.parameters)
    }

    /// The same of parameter values.
    pub(crate) fn largest_change(&self, from: &[f64], to: &[f64]) -> f64 {
        self.sources.iter().filter(|s| !s.set.is_zero()).fold(0.0, |largest: f64, source| {
            source
                .range()
                .enumerate()
                .fold(largest, |largest, (k, p)| largest.max((to[p] - from[p]).abs() / source.set.half_width(k)))
        })
    }

    /// An ascent has converged when no offset wants to change by more than this part of its set. Forces go
    /// through more rounding the more bodies hand them on.
    pub(crate) const fn still(&self) -> f64 {
        1e-13 * self.hands()
    }

    /// A Newton step below this (length-scaled) is rounding: places are sums over the bodies that lead to them.
    pub(crate) const fn step_of_rounding(&self) -> f64 {
        1e-13 * self.hands()
    }

    /// A component of the output that moves by no more is moved by rounding.
    pub(crate) fn rounding_of_output(&self, component: usize) -> f64 {
        self.step_of_rounding() * self.unit(self.space.components()[component])
    }

    /// How much more rounding there is than in a small mechanism.
    pub(crate) const fn hands(&self) -> f64 {
        let hands = self.n_unknowns() as f64 / 64.0;
        if hands > 1.0 { hands } else { 1.0 }
    }
}
