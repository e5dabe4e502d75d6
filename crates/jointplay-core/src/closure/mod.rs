//! Loop closure: its equations, their solution by Newton's method, first-order maps and statics; once plainly, once recorded for lanes.

pub mod assembly;
pub mod equations;
pub(crate) mod escape;
pub mod newton;
pub mod recorded;
pub mod sensitivity;
pub(crate) mod tree;

pub use recorded::program::Bound;
pub use recorded::program::Newton;
