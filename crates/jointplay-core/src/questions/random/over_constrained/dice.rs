//! Random numbers of one specimen.

use crate::clearance::draw::shapes::Draw as _;
use crate::clearance::draw::stream::Stream;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};

/// Keeps the numbers of single specimens apart from those of chunks.
const APART: u64 = 0x5851_F42D_4C95_7F2D;

/// A stream of its own for every specimen: how many numbers one needs does not matter to the others.
pub struct Dice {
    pub(super) stream: Stream,
    uniform: (Block, usize),
}

/// A block of numbers, uniform from 0 to 1, compiled for every width.
struct UniformBlock<'a>(&'a mut Stream);

impl Kernel for UniformBlock<'_> {
    type Output = Block;

    #[inline(always)]
    fn run(self) -> Block {
        self.0.unit()
    }
}

impl Dice {
    pub fn new(seed: u64, specimen: u64) -> Self {
        Self { stream: Stream::new(seed ^ APART, specimen), uniform: (Block::splat(0.0), LANES) }
    }

    /// One number, uniform from 0 to 1.
    pub fn next_uniform(&mut self) -> f64 {
        if self.uniform.1 == LANES {
            self.uniform = (dispatch(UniformBlock(&mut self.stream)), 0);
        }
        self.uniform.1 += 1;
        self.uniform.0.0[self.uniform.1 - 1]
    }
}
