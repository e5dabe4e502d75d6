//! Straight-line programs recorded from equations, interpreted or as machine code.

pub(crate) mod graph;
pub(crate) mod native;
pub(crate) mod schedule;
pub mod symbol;
pub mod tape;

pub use native::executable::Compiled;
