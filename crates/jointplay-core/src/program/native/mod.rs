//! Recorded programs as machine code of the processor at hand.
//!
//! A program that has been replayed often enough to pay for it is compiled: vector registers are given
//! out (`allocate`), the instructions encoded (`encode`) and put into executable memory (`executable`).
//! The code does the operations of the interpreter in [`crate::program::code`], in its order and with its
//! roundings, for one vector of lanes after the other, so that results do not depend on which of the two
//! ran. The interpreter remains for other processors, for systems that refuse executable memory, and for
//! programs that run a few times only.

// What the code of other processors would need is there for them, too.
#![cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]

#[cfg(target_arch = "x86_64")]
mod allocate;
#[cfg(target_arch = "x86_64")]
mod encode;
#[cfg(target_arch = "x86_64")]
pub(crate) mod executable;
#[cfg(not(target_arch = "x86_64"))]
#[path = "interpreted.rs"]
pub(crate) mod executable;
#[cfg(all(test, target_arch = "x86_64"))]
mod tests;
#[cfg(target_arch = "x86_64")]
mod uses;

use crate::math::lanes::block::{Block, LANES};
use crate::program::operation::Op;

/// A straight line of operations on registers.
pub struct Line<'p> {
    pub(crate) operations: &'p [Op],
    /// Registers below this are inputs.
    pub n_inputs: u32,
    /// From here they are common to all samples, ...
    pub first_common: u32,
    /// ... from here temporaries, ...
    pub first_temporary: u32,
    /// ... up to here.
    pub n_registers: u32,
    /// Registers that are read afterwards.
    pub outputs: &'p [u32],
    /// Inputs that the first outputs replace at the end.
    pub replaced: &'p [u32],
}

/// Entry of the common table with the sign bit alone.
const SIGN: u32 = 0;
/// Entry of the common table with all bits but the sign's.
const MAGNITUDE: u32 = 1;
/// Entry of the first common number.
const FIRST_COMMON: u32 = 2;
/// Copies of a common number in the table: what the narrower width reads at once. The wider one spreads
/// the first copy.
const COPIES: usize = 4;
/// Numbers of the widest vector.
const WIDEST: usize = 8;

/// The memory of a program, in blocks: its registers, then for machine code a table of the common numbers
/// and room for temporaries that leave their vector registers. Both are dense: registers lie so far apart
/// that those of one vector of lanes compete for a few sets of the cache.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Where the table begins, after the registers.
    table: usize,
    /// Where the temporaries' room begins.
    aside: usize,
    n_blocks: usize,
}

impl Layout {
    pub fn new(line: &Line<'_>) -> Self {
        let table = line.n_registers as usize;
        let n_common = (FIRST_COMMON + line.first_temporary - line.first_common) as usize;
        let aside = table + (COPIES * n_common).div_ceil(LANES);
        let temporaries = (line.n_registers - line.first_temporary) as usize;
        Self { table, aside, n_blocks: aside + (WIDEST * temporaries).div_ceil(LANES) }
    }

    /// Blocks in all.
    pub const fn n_blocks(&self) -> usize {
        self.n_blocks
    }

    /// Fills the table.
    pub fn put_common(&self, blocks: &mut [Block], common: impl Iterator<Item = f64>) {
        let masks = [1 << 63, u64::MAX >> 1].map(f64::from_bits);
        let entries = blocks[self.table..self.aside].iter_mut().flat_map(|b| b.0.chunks_exact_mut(COPIES));
        for (entry, value) in entries.zip(masks.into_iter().chain(common)) {
            entry.fill(value);
        }
    }
}
