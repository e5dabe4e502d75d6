//! The batch engine: the closure solved for blocks of samples by recorded programs.
//!
//! For a mechanism the Newton iteration is recorded once, elimination included, as two programs: the
//! first step from the nominal pose, where the Jacobian is common to all samples, and a full step from
//! any pose. A configuration binds the quantities common to its samples; a block of samples then takes
//! the first step and full steps until every lane's predicted remaining error is below rounding. Lanes
//! that do not get there are handed to the plain solver, and counted.

// Kernels must be inlined into callers compiled for a width of vector registers.
#![allow(clippy::inline_always)]

mod beside;
mod climb;
mod contact;
pub mod draw;
mod faces;
mod first_order;
mod follow;
mod graph;
mod jit;
pub mod lanes;
mod layout;
mod linear;
mod on_tree;
mod program;
mod push;
mod schedule;
pub mod simd;
mod statics;
pub mod symbol;
pub mod tape;
mod tree;
mod worker;

pub(crate) use beside::{Beside, Borne};
pub use climb::{Climb, Site, Task};
pub use contact::Contact;
pub use first_order::FirstOrder;
pub use follow::{Follow, Start};
pub use program::{Bound, Newton};
pub use worker::{Climbed, Height, Pace};

/// The first step from the nominal pose turns by less than this (rad), or the plain solver takes over:
/// the power series of sine and cosine are cut for it.
pub const SMALL_ANGLE: f64 = 0.35;

impl crate::Mechanism {
    /// The largest step that recorded programs take from a nominal pose.
    fn small_step(&self) -> f64 {
        SMALL_ANGLE.min(self.largest_move)
    }
}

/// Steps after the first turn by less than this (rad), or the plain solver takes over.
pub const LATER_ANGLE: f64 = 0.05;
