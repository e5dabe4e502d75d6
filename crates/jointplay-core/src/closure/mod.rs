//! Loop closure: its equations, their solution by Newton's method, first-order maps and statics; once plainly, once
//! recorded for lanes.

pub(crate) mod assembly;
mod carried;
pub(crate) mod coupling;
pub(crate) mod equations;
mod escape;
pub(crate) mod follower;
pub(crate) mod newton;
mod output;
pub(crate) mod recorded;
pub(crate) mod second_order;
pub(crate) mod sensitivity;
mod springs;
mod state;
mod statics;
mod tolerance;
mod train;
pub(crate) mod tree;

pub use newton::{Solver, State};
pub use recorded::program::{Bound, Newton};
pub use statics::EquilibriumTerms;
