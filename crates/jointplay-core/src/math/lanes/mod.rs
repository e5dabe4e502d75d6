//! Blocks of numbers that are worked on side by side, and the widths of registers they are compiled for.

pub(crate) mod block;
pub(crate) mod normal;
pub(crate) mod simd;
pub(crate) mod trig;

pub use block::{Block, LANES};
pub use simd::{Kernel, Width, dispatch, limit, width};
