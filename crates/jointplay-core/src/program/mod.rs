//! Straight-line programs recorded from equations, interpreted or as machine code.

mod code;
mod graph;
pub mod kept;
pub(crate) mod memo;
mod native;
mod operation;
mod patient;
mod recording;
mod schedule;
pub(crate) mod symbol;
pub(crate) mod tape;
