//! Straight-line programs recorded from the equations and replayed on many samples at a time.
//!
//! The equations are written once over [`crate::math::real::Real`]; run on symbols they leave a graph of
//! operations ([`crate::program::recording`]), of which [`crate::program::code`] makes operations on registers.

use std::sync::Arc;

use crate::math::lanes::block::Block;
use crate::program::code::{Code, Frame};
use crate::program::symbol::{Recorder, Symbol};

#[cfg(test)]
use crate::program::native::Line;

/// A recorded program: operations, and the constants that they use.
#[derive(Clone, Debug)]
pub struct Program {
    code: Arc<Code>,
    constants: Vec<f64>,
}

impl Program {
    /// The program that computes `outputs`. The first of them replace the inputs `replaced` at the end of every run.
    ///
    /// # Panics
    /// When such an output is another input.
    #[must_use]
    pub fn new(
        recorder: &Recorder,
        n_inputs: usize,
        outputs: &[Symbol<'_>],
        replaced: impl Iterator<Item = usize>,
    ) -> Self {
        Self::from(recorder, n_inputs, n_inputs, outputs, replaced)
    }

    /// A program that shares the inputs of another: its own registers begin where those of the other end.
    #[must_use]
    pub fn after(
        other: &Self,
        recorder: &Recorder,
        outputs: &[Symbol<'_>],
        replaced: impl Iterator<Item = usize>,
    ) -> Self {
        Self::from(recorder, other.code.frame().n_inputs, other.n_blocks(), outputs, replaced)
    }

    fn from(
        recorder: &Recorder,
        n_inputs: usize,
        start: usize,
        outputs: &[Symbol<'_>],
        replaced: impl Iterator<Item = usize>,
    ) -> Self {
        let frame = Frame { n_inputs, start, replaced: replaced.map(|i| i as u32).collect() };
        let (code, constants) = recorder.code(outputs, frame);
        Self { code, constants }
    }

    /// Number of outputs.
    #[cfg(test)]
    #[must_use]
    pub fn n_outputs(&self) -> usize {
        self.code.n_outputs()
    }

    /// Number of operations per sample.
    #[must_use]
    pub fn n_operations(&self) -> usize {
        self.code.n_operations()
    }

    /// Blocks of memory up to the end of the program's own.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.code.n_blocks()
    }

    /// Memory with everything common to the samples of one configuration in place.
    #[must_use]
    pub fn registers(&self, common: &[f64]) -> Vec<Block> {
        let mut registers = vec![Block::splat(0.0); self.n_blocks()];
        self.put_common(&mut registers, common);
        registers
    }

    /// Puts what is common to the samples of one configuration.
    pub fn put_common(&self, registers: &mut [Block], common: &[f64]) {
        self.code.put_common(registers, &self.constants, common);
    }

    /// An output after a run.
    #[inline(always)]
    #[must_use]
    pub fn output<'b>(&self, registers: &'b [Block], index: usize) -> &'b Block {
        self.code.output(registers, index)
    }

    /// Replays the program; the varying inputs stand in the first registers.
    ///
    /// # Panics
    /// When the registers are not this program's.
    // Inlined into callers that are compiled for a given width of vector registers.
    #[inline(always)]
    pub fn run(&self, registers: &mut [Block]) {
        self.code.run(registers);
    }

    /// Whether both were recorded together.
    #[cfg(test)]
    pub(crate) fn shares_code(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.code, &other.code)
    }

    #[cfg(test)]
    pub(crate) fn line(&self) -> Line<'_> {
        self.code.line()
    }

    #[cfg(test)]
    pub(crate) fn interpret(&self, registers: &mut [Block]) {
        self.code.interpret(registers);
    }
}
