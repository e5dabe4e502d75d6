//! What eight programs are, and where their solution stands.

use crate::cone::lanes::vector::V;

/// The numbers of eight programs.
#[derive(Clone, Debug, Default)]
pub(super) struct Data {
    /// Number of equations.
    pub s: usize,
    /// Number of coordinates.
    pub n: usize,
    /// Coefficients of the coordinates in the equations, equation by equation.
    pub e: Vec<V>,
    /// What the springs add to the normal equations; empty without springs.
    pub springs: Vec<V>,
    pub right: Vec<V>,
    pub cost: Vec<V>,
    pub sizes: Vec<V>,
}

/// Iterates and intermediate results, kept between calls for their memory.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    pub p: Vec<V>,
    pub y: Vec<V>,
    /// The factor on the clearances and the multiplier of `tau >= 0`.
    pub factor: V,
    pub factor_multiplier: V,
    /// `1 / k`.
    pub per_stiffness: V,
    pub s: Vec<V>,
    pub l: Vec<V>,
    /// What the longest step inside the cones needs of both.
    pub inv_s: Vec<V>,
    pub inv_l: Vec<V>,
    pub ds: Vec<V>,
    pub dl: Vec<V>,
    /// Where the slacks would go.
    pub target: Vec<V>,
    pub approach: Vec<V>,
    pub scaling: Vec<V>,
    /// `E' y`.
    pub stress: Vec<V>,
    /// Some rows of `E H^-1`.
    pub g: Vec<V>,
    /// Lower triangle of the normal equations, and memory for their factors.
    pub matrix: Vec<V>,
    pub columns: Vec<V>,
    /// `c - E' y + G' l`, and the force that a step adds.
    pub left: Vec<V>,
    /// `H^-1` of what is left.
    pub moved: Vec<V>,
    pub force: Vec<V>,
    /// Residuals of the equations, and of the factor's own condition.
    pub residual: Vec<V>,
    pub factor_left: V,
    pub dp: Vec<V>,
    pub dy: Vec<V>,
    /// `x` and `q` of a variable factor.
    pub follow: Vec<V>,
    pub q: Vec<V>,
}

/// The numbers of one cone in an array.
macro_rules! of {
    ($cone:ident, $array:expr, slots) => {
        $array[$cone.slot..$cone.slot + $cone.slots()]
    };
    ($cone:ident, $array:expr, coordinates) => {
        $array[$cone.first..$cone.first + $cone.dimension()]
    };
    ($cone:ident, $array:expr, scaling) => {
        $array[$cone.data..$cone.data + $cone.data_size()]
    };
    ($cone:ident, $array:expr, sizes) => {
        $array[$cone.size..$cone.size + $cone.sizes()]
    };
}
pub(super) use of;
