//! Executable memory, and when it pays to fill it.

#![allow(unsafe_code)]

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use memmap2::{Mmap, MmapMut};

use crate::math::lanes::block::Block;
use crate::math::lanes::simd::Width;
use crate::program::native::allocate::allocate;
use crate::program::native::encode::{Lanes, encode};
use crate::program::native::{Layout, Line};

/// Replays by the interpreter before a program is compiled: compiling costs about ten.
const REPLAYS: u32 = 4;

/// The code of a program for each width, once it has been compiled.
#[derive(Debug, Default)]
pub struct Compiled([Tier; 2]);

#[derive(Debug, Default)]
struct Tier {
    replays: AtomicU32,
    /// Empty where the system refuses executable memory.
    code: OnceLock<Option<Executable>>,
}

impl Compiled {
    /// Runs the code for a width if there is any; tells whether it has. A program that has been replayed
    /// often enough gets it; other threads go on with the interpreter meanwhile.
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
        let Some(code) = code else { return false };
        // SAFETY: the width in use is one that this processor has.
        unsafe { code.run(blocks) };
        true
    }
}

/// Machine code of one program for one width.
#[derive(Debug)]
pub struct Executable {
    code: Mmap,
    n_blocks: usize,
}

impl Executable {
    /// Compiles for so many vector registers; `None` where memory cannot be made executable, or a program needs
    /// more than 2 GiB.
    pub fn new(line: &Line<'_>, layout: Layout, lanes: Lanes, n_vector: usize) -> Option<Self> {
        if layout.n_blocks() * size_of::<Block>() > i32::MAX as usize {
            // Farther than an instruction reaches.
            return None;
        }
        let code = encode(&allocate(line, n_vector), lanes, layout).ok()?;
        // Never writable and executable at the same time.
        let mut memory = MmapMut::map_anon(code.len()).ok()?;
        memory.copy_from_slice(&code);
        Some(Self { code: memory.make_exec().ok()?, n_blocks: layout.n_blocks() })
    }

    /// Runs the code on a program's memory.
    ///
    /// # Safety
    /// The processor must have the vector registers that this was compiled for.
    pub unsafe fn run(&self, blocks: &mut [Block]) {
        assert!(blocks.len() >= self.n_blocks, "registers of another program");
        // SAFETY: the memory holds a function of this calling convention, which reads and writes whole
        // vectors of these blocks only; they are aligned to the widest.
        unsafe {
            let function: extern "sysv64" fn(*mut Block) = std::mem::transmute(self.code.as_ptr());
            function(blocks.as_mut_ptr());
        }
    }
}
