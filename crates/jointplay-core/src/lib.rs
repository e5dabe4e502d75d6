//! Accuracy of mechanisms with joint clearance: loop closure, statics, worst case, statistics.
//!
//! Bodies' poses are the unknowns and every joint gives its locked components as equations, so that
//! statics is the transposed system and its solution the joint reactions. All quantities are in SI
//! units and radians; an error is actual minus nominal.

pub mod ascent;
pub mod assembly;
pub mod batch;
mod build;
pub mod clearance;
pub mod closure;
pub mod cone;
pub mod contact;
mod coupling;
mod decomposition;
mod escape;
pub mod extremes;
pub mod flood;
pub mod given;
pub mod hyperstatic;
pub mod interrupt;
mod inverse;
mod joint;
pub mod linear;
pub mod loaded;
pub mod mechanism;
pub mod mesh;
mod open;
pub mod path;
pub mod projected;
pub mod reach;
pub mod real;
pub mod rotation;
pub mod sampling;
mod search;
mod semismooth;
pub mod sensitivity;
pub mod solver;
pub mod space;
pub mod spec;
mod starts;
pub mod status;
pub mod table;
pub mod trace;

pub use build::SpecError;
pub use mechanism::Mechanism;
pub use spec::Spec;
pub use status::Status;
