//! The four questions, each with its form on lanes and its form for over-constrained mechanisms.

pub mod given;
pub mod loaded;
pub mod random;
pub mod worst;
