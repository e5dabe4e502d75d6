//! The nominal mechanism along a path, over a grid, and its inverse kinematics.

pub mod columns;
mod grid;
mod inverse;
mod motion;
mod nearness;
mod on_lanes;
mod over_constrained;
mod path;
mod side;
pub(crate) mod trace;

pub use grid::{Reached, Seed};
pub use motion::DriveRates;
pub use path::Configuration;
pub use trace::Trace;
