//! Laws by which offsets scatter over their sets.

use serde::Deserialize;

/// How offsets scatter from specimen to specimen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Uniform in the set; both ends of a pin, and its axial play, each on its own.
    Uniform,
    /// Uniform on the boundary of the set: always in contact. On a polytope, uniform in the set and then
    /// pushed out from the middle to the boundary: every facet gets the share of the cone above it. Both
    /// ends of a pin, and its axial play, each on its own boundary.
    Boundary,
    /// Normal with three standard deviations to the largest value of every component, truncated to the
    /// set; both ends of a pin, and its axial play, each on its own.
    Normal,
    /// Normal and not truncated; the set holds three standard deviations.
    Gauss,
}

/// How one number scatters between two bounds, beyond the laws for all sets.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ScalarLaw {
    /// What a process makes: normal about a mean, which drifts evenly by so much to either side.
    Process {
        /// Mean.
        mean: f64,
        /// Standard deviation at any time, above zero.
        sigma: f64,
        /// How far the mean drifts.
        drift: f64,
        /// Whether what is beyond the bounds is sorted out.
        sorted: bool,
    },
    /// Triangular.
    Triangular {
        /// The likeliest value, between the bounds.
        mode: f64,
    },
    /// Beta.
    Beta {
        /// Exponent at the lower bound, above zero.
        a: f64,
        /// Exponent at the upper bound, above zero.
        b: f64,
    },
    /// Measured values in ascending order; between them the quantiles are interpolated.
    Measured {
        /// The values.
        values: Vec<f64>,
    },
}
