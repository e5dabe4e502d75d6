//! Load-determined pose and assemblability of over-constrained and elastic mechanisms, as cone programs.
//!
//! A mechanism that is over-constrained s times leaves s equations between the displacements in its
//! joints: offsets `delta_j` within their clearances, deformations `v_j` of what is elastic,
//!
//! `sum_j A_j (delta_j or v_j) = b`,  `delta_j` in `C_j`,  `v_j` in the range of the compliance `F_j`.
//!
//! | question | program |
//! |---|---|
//! | where does the load hold it? | minimise `1/2 v' F^+ v - sum_j w_j . (delta_j or v_j)` |
//! | can it be assembled? | minimise `t` with `delta_j` in `t C_j` |
//!
//! Every `C_j` is the intersection of half spaces and of cones of second order ([`bodies`]), so both are
//! second-order cone programs. The multipliers y of the equations are the self-stresses: `w_j + A_j' y`
//! are the reactions, in equilibrium with the load whatever y is, and the dual value
//! `b . y - sum_j h_j(w_j + A_j' y) - 1/2 sum_j (w_j + A_j' y)' F_j (w_j + A_j' y)`, with the support
//! functions h of the sets, is a bound from below that proves how near an answer is to the optimum.
//!
//! Where the load does not decide all offsets, the optimal ones are a face of the product of the sets
//! cut by the equations; [`OptimalFace`] goes to its ends and to its middle.

pub(crate) mod answer;
pub(crate) mod bodies;
mod clarabel;
mod form;
pub mod lanes;
mod newton;
pub(crate) mod one_equation;
pub(crate) mod optimal_face;
pub(crate) mod scheduler;
mod sets;
pub(crate) mod springs;
mod standard;
#[cfg(test)]
mod tests;
pub(crate) mod way;

pub use answer::{Answer, Outcome};
pub use lanes::layout::Question;

use serde::Deserialize;

use crate::clearance::Set;

/// What a block of displacements may be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Within a clearance, which the question of assemblability makes larger or smaller.
    Clearance(Set),
    /// Within bounds that stay as they are: tolerances, errors of drives.
    Fixed(Set),
    /// Elastic: the displacement is this compliance times the force; row-major, symmetric, positive
    /// semidefinite.
    Spring(Vec<f64>),
}

impl Kind {
    /// Number of components.
    #[must_use]
    pub fn size(&self) -> usize {
        match self {
            Self::Clearance(set) | Self::Fixed(set) => set.size(),
            Self::Spring(compliance) => compliance.len().isqrt(),
        }
    }

    /// The set of offsets, where there is one.
    #[must_use]
    pub const fn set(&self) -> Option<&Set> {
        match self {
            Self::Clearance(set) | Self::Fixed(set) => Some(set),
            Self::Spring(_) => None,
        }
    }
}

/// Displacements of one joint, or of one elastic part.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// What they may be.
    pub kind: Kind,
    /// Their coefficients in the equations: row-major, as many rows as there are equations.
    pub map: Vec<f64>,
    /// The force that works on each of them.
    pub force: Vec<f64>,
}

impl Block {
    /// Number of components.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.force.len()
    }

    /// Its coefficients in one equation.
    #[must_use]
    pub fn row(&self, equation: usize) -> &[f64] {
        let size = self.size();
        &self.map[equation * size..(equation + 1) * size]
    }

    /// What a self-stress does in the block.
    #[must_use]
    pub fn stress(&self, multipliers: &[f64]) -> Vec<f64> {
        let mut stress = vec![0.0; self.size()];
        for (i, y) in multipliers.iter().enumerate() {
            stress.iter_mut().zip(self.row(i)).for_each(|(r, a)| *r += a * y);
        }
        stress
    }

    /// Reaction: the load's force and what the self-stress adds.
    #[must_use]
    pub fn reaction(&self, multipliers: &[f64]) -> Vec<f64> {
        self.stress(multipliers).iter().zip(&self.force).map(|(stress, force)| force + stress).collect()
    }
}

/// Whether elastic parts deform while the smallest clearances are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Springs {
    /// They are rigid.
    Rigid,
    /// They take any deformation that their compliance has, whatever force it needs.
    Free,
}

/// Displacements, the equations between them and the load on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// What every equation has to add up to.
    pub right: Vec<f64>,
    /// The displacements.
    pub blocks: Vec<Block>,
}

impl Program {
    /// Number of equations.
    #[must_use]
    pub const fn n_equations(&self) -> usize {
        self.right.len()
    }
}
