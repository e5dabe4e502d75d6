//! Recorded programs as machine code.
//!
//! A program that has been replayed often enough to pay for it is compiled: vector registers are given
//! out ([`allocate`]), the instructions encoded ([`encode`]) and put into executable memory. The code does
//! the operations of the interpreter in [`super::tape`], in its order and with its roundings, on a few
//! lanes at a time, so results do not depend on which of the two ran. The interpreter remains for other
//! processors, for systems that refuse executable memory and for programs that run a few times only.

#![allow(unsafe_code)]

mod allocate;
mod encode;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use memmap2::{Mmap, MmapMut};

use super::lanes::{Block, LANES};
use super::simd::Width;
use allocate::{FIRST_COMMON, allocate};
use encode::{COPIES, Lanes, Memory, encode};

pub use allocate::Line;

/// Replays by the interpreter before a program is compiled: about what compiling costs.
const REPLAYS: u32 = 16;

/// The memory of a program: its registers, the table of common numbers, room to put temporaries aside.
#[derive(Clone, Copy, Debug)]
pub struct Layout(Memory, usize);

impl Layout {
    pub fn new(line: &Line<'_>) -> Self {
        let common = line.n_registers as usize;
        let n_common = (FIRST_COMMON + line.first_temporary - line.n_inputs) as usize;
        let aside = common + (COPIES * n_common).div_ceil(LANES);
        let temporaries = (line.n_registers - line.first_temporary) as usize;
        Self(Memory { common, aside }, aside + temporaries.div_ceil(LANES / 8))
    }

    /// Blocks in all.
    pub const fn n_blocks(self) -> usize {
        self.1
    }

    /// Fills the common table.
    pub fn put_common(self, blocks: &mut [Block], common: impl Iterator<Item = f64>) {
        let masks = [1 << 63, u64::MAX >> 1].map(f64::from_bits);
        let places = blocks[self.0.common..self.0.aside].iter_mut().flat_map(|b| b.0.chunks_exact_mut(COPIES));
        for (place, value) in places.zip(masks.into_iter().chain(common)) {
            place.fill(value);
        }
    }
}

/// The code of a program for each width, once it has been compiled.
#[derive(Clone, Debug, Default)]
pub struct Compiled(Arc<[Tier; 2]>);

#[derive(Debug, Default)]
struct Tier {
    replays: AtomicU32,
    /// Empty where the system refuses executable memory.
    code: OnceLock<Option<Executable>>,
}

impl Compiled {
    /// Runs the code for a width if there is any; tells whether it has. A program that has run often
    /// enough gets it.
    pub fn run(&self, width: Width, layout: Layout, line: &Line<'_>, blocks: &mut [Block]) -> bool {
        let (tier, lanes) = match width {
            Width::Plain => return false,
            Width::Avx2 => (&self.0[0], Lanes::Four),
            Width::Avx512 => (&self.0[1], Lanes::Eight),
        };
        let code = match tier.code.get() {
            Some(code) => code,
            None if tier.replays.fetch_add(1, Ordering::Relaxed) == REPLAYS => {
                tier.code.get_or_init(|| Executable::new(line, layout, lanes, lanes.n_registers()))
            }
            None => return false,
        };
        code.as_ref().is_some_and(|code| {
            code.run(blocks);
            true
        })
    }
}

/// Machine code of one program.
#[derive(Debug)]
struct Executable {
    code: Mmap,
    n_blocks: usize,
}

impl Executable {
    fn new(line: &Line<'_>, layout: Layout, lanes: Lanes, n_vector: usize) -> Option<Self> {
        let code = encode(&allocate(line, n_vector), lanes, layout.0).ok()?;
        // Never writable and executable at the same time.
        let mut memory = MmapMut::map_anon(code.len()).ok()?;
        memory.copy_from_slice(&code);
        Some(Self { code: memory.make_exec().ok()?, n_blocks: layout.n_blocks() })
    }

    fn run(&self, blocks: &mut [Block]) {
        assert_eq!(blocks.len(), self.n_blocks, "registers of another program");
        // SAFETY: the code is a function of this calling convention, made for a width that this processor
        // has. It reads and writes whole lanes of `n_blocks` blocks, which are aligned to 64 bytes.
        unsafe {
            let function: extern "sysv64" fn(*mut Block) = std::mem::transmute(self.code.as_ptr());
            function(blocks.as_mut_ptr());
        }
    }
}
