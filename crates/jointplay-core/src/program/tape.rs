//! Straight-line programs recorded from the equations and replayed on many samples at a time.
//!
//! The equations are written once over [`crate::math::real::Real`]; run on symbols they leave a graph of
//! operations. Operations that depend only on quantities common to all samples of a configuration are
//! done once for it; the rest is replayed on blocks of samples.

use crate::math::lanes::block::Block;
use crate::math::lanes::simd::width;
use crate::program::graph::{Kind, Operation, operations, varying};
use crate::program::native::executable::Compiled;
use crate::program::native::{Layout, Line};
use crate::program::operation::Op;
use crate::program::schedule::schedule;
use crate::program::symbol::{Binary, Node, Recorder, Symbol};

/// A recorded program.
///
/// Registers: first the varying inputs, then the values common to all samples, then temporaries.
#[derive(Clone, Debug)]
pub struct Program {
    /// What is done once per configuration, on the nodes of the graph.
    common: Vec<(usize, Node)>,
    n_nodes: usize,
    /// Nodes whose common value goes to which register.
    broadcast: Vec<(usize, u32)>,
    operations: Vec<Op>,
    n_inputs: usize,
    /// Where its own registers begin.
    start: usize,
    /// Where they end.
    n_registers: usize,
    outputs: Vec<u32>,
    /// Inputs that the first outputs replace.
    replaced: Vec<u32>,
    compiled: Compiled,
}

impl Program {
    /// The program that computes `outputs`.
    #[must_use]
    pub fn new(recorder: &Recorder, n_inputs: usize, outputs: &[Symbol<'_>]) -> Self {
        Self::from(recorder, n_inputs, n_inputs, outputs)
    }

    /// A program that shares the inputs of another: its own registers begin where those of the other end.
    #[must_use]
    pub fn after(other: &Self, recorder: &Recorder, outputs: &[Symbol<'_>]) -> Self {
        Self::from(recorder, other.n_inputs, other.n_blocks(), outputs)
    }

    /// Lets the first outputs replace these inputs at the end of every run.
    ///
    /// # Panics
    /// When such an output is another input.
    #[must_use]
    pub fn replacing(mut self, inputs: impl Iterator<Item = usize>) -> Self {
        self.replaced = inputs.map(|i| i as u32).collect();
        for (&output, &input) in self.outputs.iter().zip(&self.replaced) {
            assert!(output == input || output as usize >= self.n_inputs, "an output is computed");
        }
        // Clones of before keep their code.
        self.compiled = Compiled::default();
        self
    }

    fn from(recorder: &Recorder, n_inputs: usize, start: usize, outputs: &[Symbol<'_>]) -> Self {
        let roots: Vec<u32> = outputs.iter().map(|&s| recorder.id(s)).collect();
        let nodes = recorder.nodes.borrow();
        let varying = varying(&nodes);
        let order = schedule(&nodes, &varying, &roots);
        let work = operations(&nodes, &varying, &order, &roots);
        let common = order.iter().filter(|&&id| !varying[id as usize]).map(|&id| (id as usize, nodes[id as usize]));
        let mut program = Self {
            common: common.collect(),
            n_nodes: nodes.len(),
            broadcast: Vec::new(),
            operations: Vec::with_capacity(work.len()),
            n_inputs,
            start,
            n_registers: start,
            outputs: Vec::new(),
            replaced: Vec::new(),
            compiled: Compiled::default(),
        };
        program.give_registers(&nodes, &varying, &work, &roots);
        program
    }

    /// Linear scan: a temporary's register is free again after its last use.
    fn give_registers(&mut self, nodes: &[Node], varying: &[bool], work: &[Operation], roots: &[u32]) {
        const NONE: u32 = u32::MAX;
        let mut last = vec![0_usize; nodes.len()];
        for (at, (_, operands, _)) in work.iter().enumerate() {
            for &o in operands {
                last[o as usize] = at;
            }
        }
        for &root in roots {
            last[root as usize] = usize::MAX;
        }
        let mut register = vec![NONE; nodes.len()];
        let needed = work.iter().flat_map(|(_, operands, _)| operands).chain(roots);
        for &o in needed {
            let o = o as usize;
            if register[o] != NONE {
                continue;
            }
            if let Node::Varying(index) = nodes[o] {
                register[o] = index;
            } else if !varying[o] {
                register[o] = self.next_register();
                self.broadcast.push((o, register[o]));
            }
        }
        let mut free: Vec<u32> = Vec::new();
        for (at, &(kind, operands, id)) in work.iter().enumerate() {
            let [a, b, c] = operands.map(|o| register[o as usize]);
            let mut released: Vec<u32> = Vec::new();
            for o in operands {
                let temporary = varying[o as usize] && !matches!(nodes[o as usize], Node::Varying(_));
                if temporary && last[o as usize] == at && !released.contains(&o) {
                    released.push(o);
                    free.push(register[o as usize]);
                }
            }
            let target = free.pop().unwrap_or_else(|| self.next_register());
            register[id as usize] = target;
            self.operations.push(Op { kind, a, b, c, target });
        }
        self.outputs = roots.iter().map(|&r| register[r as usize]).collect();
    }

    fn next_register(&mut self) -> u32 {
        self.n_registers += 1;
        self.n_registers as u32 - 1
    }

    /// Number of outputs.
    #[cfg(test)]
    #[must_use]
    pub const fn n_outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Number of operations per sample.
    #[must_use]
    pub fn n_operations(&self) -> usize {
        self.operations.len()
    }

    /// Blocks of memory up to the end of the program's own.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        Layout::new(&self.line()).n_blocks()
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
        let mut values = vec![0.0; self.n_nodes];
        for &(id, node) in &self.common {
            let value = |o: u32| values[o as usize];
            values[id] = match node {
                Node::Constant(bits) => f64::from_bits(bits),
                Node::Common(index) => common[index as usize],
                Node::Varying(_) => f64::NAN,
                Node::Neg(a) => -value(a),
                Node::Abs(a) => value(a).abs(),
                Node::Binary(Binary::Add, a, b) => value(a) + value(b),
                Node::Binary(Binary::Sub, a, b) => value(a) - value(b),
                Node::Binary(Binary::Mul, a, b) => value(a) * value(b),
                Node::Binary(Binary::Div, a, b) => value(a) / value(b),
                Node::Binary(Binary::Max, a, b) => value(a).max(value(b)),
            };
        }
        for &(id, register) in &self.broadcast {
            registers[register as usize] = Block::splat(values[id]);
        }
        Layout::new(&self.line()).put_common(registers, self.broadcast.iter().map(|&(id, _)| values[id]));
    }

    /// An output after a run.
    #[inline(always)]
    #[must_use]
    pub fn output<'b>(&self, registers: &'b [Block], index: usize) -> &'b Block {
        &registers[*self.replaced.get(index).unwrap_or(&self.outputs[index]) as usize]
    }

    /// Replays the program; the varying inputs stand in the first registers.
    ///
    /// # Panics
    /// When the registers are not this program's.
    // Inlined into callers that are compiled for a given width of vector registers.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn run(&self, registers: &mut [Block]) {
        let line = self.line();
        let layout = Layout::new(&line);
        assert!(registers.len() >= layout.n_blocks(), "registers of another program");
        if !self.compiled.run(width(), layout, &line, registers) {
            self.interpret(registers);
        }
    }

    /// What there is to compile.
    pub(crate) fn line(&self) -> Line<'_> {
        Line {
            operations: &self.operations,
            n_inputs: self.n_inputs as u32,
            first_common: self.start as u32,
            first_temporary: (self.start + self.broadcast.len()) as u32,
            n_registers: self.n_registers as u32,
            outputs: &self.outputs,
            replaced: &self.replaced,
        }
    }

    /// The interpreter: where there is no machine code, and the measure of it.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub(crate) fn interpret(&self, registers: &mut [Block]) {
        assert!(registers.len() >= self.n_registers, "registers of another program");
        for op in &self.operations {
            // SAFETY: `give_registers` numbers every operand and target below `n_registers`.
            let (a, b, c) = unsafe {
                (
                    registers.get_unchecked(op.a as usize),
                    registers.get_unchecked(op.b as usize),
                    registers.get_unchecked(op.c as usize),
                )
            };
            let value = match op.kind {
                Kind::Add => a.add(b),
                Kind::Sub => a.sub(b),
                Kind::Mul => a.mul(b),
                Kind::Div => a.div(b),
                Kind::Max | Kind::MaxUnsigned => a.max(b),
                Kind::Neg => a.neg(),
                Kind::Abs => a.abs(),
                Kind::MulAdd => a.mul_add(b, c),
                Kind::MulSub => a.mul_sub(b, c),
                Kind::NegMulAdd => a.neg_mul_add(b, c),
            };
            // SAFETY: as above.
            unsafe { *registers.get_unchecked_mut(op.target as usize) = value };
        }
        for (&output, &input) in self.outputs.iter().zip(&self.replaced) {
            registers[input as usize] = registers[output as usize];
        }
    }
}
