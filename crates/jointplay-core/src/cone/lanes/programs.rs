//! Programs of one structure.

use std::borrow::Cow;

use crate::cone::Kind;

/// Programs of one structure.
#[derive(Clone, Debug, Default)]
pub struct Programs<'a> {
    /// Number of programs.
    pub n: usize,
    /// Number of equations of each.
    pub n_equations: usize,
    /// Number of blocks of each.
    pub n_blocks: usize,
    /// The blocks' kinds, those of all programs one after the other, or the same ones for all.
    pub kinds: Vec<Kind>,
    /// Coefficients, by program, equation and component.
    pub maps: Cow<'a, [f64]>,
    /// Forces, by program and component.
    pub forces: Cow<'a, [f64]>,
    /// Right sides, by program and equation.
    pub rights: Cow<'a, [f64]>,
}
