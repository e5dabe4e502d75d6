//! Blocks of numbers that are worked on side by side, and the widths of registers they are compiled for.

pub mod block;
pub mod simd;
