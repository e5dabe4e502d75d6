//! Over-constrained and elastic mechanisms.
//!
//! Where joints hold the bodies more than once, the displacements in them (clearance offsets, deviations,
//! elastic deformations) must be compatible, and statics alone does not give the reactions. A [`Basis`] of
//! independent rows carries the closure; compatibility ties in the rest; and where load, prestress and
//! clearances bring the mechanism to is a cone program ([`crate::cone`]).

pub(crate) mod balance;
pub(crate) mod basis;
pub(crate) mod compatibility;
mod elsewhere;
pub(crate) mod equilibrium;
mod indeterminacy;
mod observable;
pub(crate) mod openings;
pub(crate) mod parts;
pub(crate) mod placed;
pub(crate) mod sequence;
pub(crate) mod specimen_batch;
pub(crate) mod sprung;
pub(crate) mod system;
