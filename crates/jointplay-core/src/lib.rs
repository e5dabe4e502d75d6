//! Accuracy of mechanisms with joint clearance: loop closure, statics, worst case, statistics.
//!
//! Bodies' poses are the unknowns and every joint gives its locked components as equations, so that
//! statics is the transposed system and its solution the joint reactions. All quantities are in SI
//! units and radians; an error is actual minus nominal.
//!
//! The layers. Each imports from those below it only (`tests/project/test_core_layers.py` holds them):
//!
//! ```text
//!    questions   given, loaded, worst and its certificate, random: plainly, on lanes, and for over-constrained mechanisms
//!    nominal     the nominal mechanism along a path, over a grid; inverse kinematics
//!    contact     where a load presses every offset against its clearance
//!    redundancy  over-constrained and elastic mechanisms: basis, compatibility, equilibrium, sequences of programs
//!    closure     closure equations, Newton's method, assembly, first-order maps, statics; recorded for lanes
//!    mechanism   bodies, points, joints as locked components, sources of error; cases and statuses
//!    cone        cone programs, one at a time and eight at a time
//!    clearance   sets of admissible offsets, their faces, laws of scatter and draws
//!    program     recorded straight-line programs, interpreted and as machine code
//!    math        numbers, intervals, vectors, rotations, poses, elimination, lanes, statistics
//!    interrupt   long work can be stopped from outside
//! ```

pub mod clearance;
pub mod closure;
pub mod cone;
mod contact;
pub mod interrupt;
pub mod math;
pub mod mechanism;
pub mod nominal;
mod program;
pub mod questions;
mod redundancy;

pub use program::kept::Kept;

pub use mechanism::{Answer, Case, Column, Declared, Dim, Keep, Mechanism, Spec, SpecError, Status, Values};
