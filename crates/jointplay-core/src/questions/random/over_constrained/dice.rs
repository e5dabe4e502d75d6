//! Random numbers of one specimen.

use crate::clearance::Set;
use crate::clearance::draw::shapes::Draw as _;
use crate::clearance::draw::stream::Stream;
use crate::clearance::law::Law;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};

/// Keeps the numbers of single specimens apart from those of chunks.
const APART: u64 = 0x5851_F42D_4C95_7F2D;

/// A stream of its own for every specimen: how many numbers one needs does not matter to the others.
pub struct Dice {
    stream: Stream,
    uniform: (Block, usize),
}

struct Draw<'a> {
    stream: &'a mut Stream,
    set: &'a Set,
    law: Law,
    out: &'a mut [Block],
}

impl Kernel for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.stream.draw_own(self.set, self.law, self.out);
    }
}

/// A block of numbers, compiled for every width.
enum Next<'a> {
    Unit(&'a mut Stream),
    Symmetric(&'a mut Stream),
}

impl Kernel for Next<'_> {
    type Output = Block;

    #[inline(always)]
    fn run(self) -> Block {
        match self {
            Self::Unit(stream) => stream.unit(),
            Self::Symmetric(stream) => stream.symmetric(),
        }
    }
}

impl Dice {
    pub fn new(seed: u64, specimen: u64) -> Self {
        Self { stream: Stream::new(seed ^ APART, specimen), uniform: (Block::splat(0.0), LANES) }
    }

    /// Own coordinates of a set by its law, one point per lane.
    pub fn draw_own(&mut self, set: &Set, law: Law, out: &mut [Block]) {
        dispatch(Draw { stream: &mut self.stream, set, law, out });
    }

    /// Uniform from 0 to 1.
    pub fn uniform(&mut self) -> Block {
        dispatch(Next::Unit(&mut self.stream))
    }

    /// Uniform from -1 to 1.
    pub fn symmetric(&mut self) -> Block {
        dispatch(Next::Symmetric(&mut self.stream))
    }

    /// One number, uniform from 0 to 1.
    pub fn next_uniform(&mut self) -> f64 {
        if self.uniform.1 == LANES {
            self.uniform = (dispatch(Next::Unit(&mut self.stream)), 0);
        }
        self.uniform.1 += 1;
        self.uniform.0.0[self.uniform.1 - 1]
    }
}
