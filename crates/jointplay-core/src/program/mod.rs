//! Straight-line programs recorded from equations, interpreted or as machine code.

mod graph;
mod native;
mod operation;
mod schedule;
pub(crate) mod symbol;
pub(crate) mod tape;
