//! Where there is no machine code for the processor: programs stay with the interpreter, whose loops over the lanes the
//! compiler turns into the vectors that every processor of the kind has (on aarch64 those of NEON, two numbers each).

use crate::math::lanes::block::Block;
use crate::math::lanes::simd::Width;
use crate::program::native::{Layout, Line};

/// No code.
#[derive(Debug, Default)]
pub struct Compiled;

impl Compiled {
    /// Tells that nothing has been run.
    pub const fn run(&self, _: Width, _: Layout, _: &Line<'_>, _: &mut [Block]) -> bool {
        false
    }
}
