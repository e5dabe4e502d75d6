//! The four questions, each with its form on lanes and its form for over-constrained mechanisms.

pub mod certificate;
pub mod columns;
mod form;
pub mod given;
pub mod jacobians;
pub mod loaded;
pub mod random;
#[cfg(test)]
mod tests;
pub mod worst;
