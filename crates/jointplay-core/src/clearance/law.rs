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
