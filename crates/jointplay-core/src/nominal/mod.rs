//! The nominal mechanism along a path, over a grid, and its inverse kinematics.

pub mod grid;
pub(crate) mod inverse;
pub(crate) mod on_lanes;
pub(crate) mod over_constrained;
pub mod path;
pub mod trace;

pub use on_lanes::Follow;
pub use on_lanes::Start;
