//! Over-constrained and elastic mechanisms.
//!
//! Where joints hold the bodies more than once, the displacements in them (clearance offsets, deviations,
//! elastic deformations) must be compatible, and statics alone does not give the reactions. A [`Basis`] of
//! independent rows carries the closure; compatibility ties in the rest; and where load, prestress and
//! clearances bring the mechanism to is a cone program ([`crate::cone`]).

mod abreast;
mod balance;
mod basis;
mod compatibility;
mod felt;
mod given;
mod loaded;
mod open;
mod parts;
mod placed;
mod scatter;
mod settle;
mod system;
mod together;
mod trace;
mod units;
mod worst;

pub use basis::Basis;
pub use given::Forced;
pub use loaded::{Strain, StrainTable};
pub use scatter::UnitScatter;
pub use units::UnitTable;
