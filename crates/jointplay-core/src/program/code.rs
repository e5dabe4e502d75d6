//! Operations on numbered registers: what programs that differ in their constants only have in common.
//!
//! Operations that depend only on quantities common to all samples of a configuration are done once for it; the
//! rest is replayed on blocks of samples.

use crate::math::lanes::block::Block;
use crate::math::lanes::simd::width;
use crate::program::graph::{Binary, Kind, Node, Operation, operations, varying};
use crate::program::native::executable::Compiled;
use crate::program::native::{Layout, Line};
use crate::program::operation::Op;
use crate::program::schedule::schedule;

/// Where a program stands in memory: its inputs, where its own registers begin, and the inputs that its first
/// outputs replace at the end of every run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Frame {
    pub n_inputs: usize,
    pub start: usize,
    pub replaced: Vec<u32>,
}

/// Bytes per operation, with those of its machine code.
const BYTES: usize = size_of::<Op>() + 16;

/// The operations that compute some nodes of a graph.
///
/// Registers: first the varying inputs, then the values common to all samples, then temporaries.
#[derive(Debug)]
pub(crate) struct Code {
    frame: Frame,
    /// What is done once per configuration, on the nodes of the graph.
    common: Vec<(usize, Node)>,
    n_nodes: usize,
    /// Nodes whose common value goes to which register.
    broadcast: Vec<(usize, u32)>,
    operations: Vec<Op>,
    /// Where its registers end.
    n_registers: usize,
    outputs: Vec<u32>,
    compiled: Compiled,
}

impl Code {
    /// The operations that compute `roots`.
    ///
    /// # Panics
    /// When an output that replaces an input is another input.
    pub fn new(nodes: &[Node], roots: &[u32], frame: Frame) -> Self {
        let varying = varying(nodes);
        let order = schedule(nodes, &varying, roots);
        let work = operations(nodes, &varying, &order, roots);
        let common = order.iter().filter(|&&id| !varying[id as usize]).map(|&id| (id as usize, nodes[id as usize]));
        let mut code = Self {
            common: common.collect(),
            n_nodes: nodes.len(),
            broadcast: Vec::new(),
            operations: Vec::with_capacity(work.len()),
            n_registers: frame.start,
            frame,
            outputs: Vec::new(),
            compiled: Compiled::default(),
        };
        code.give_registers(nodes, &varying, &work, roots);
        for (&output, &input) in code.outputs.iter().zip(&code.frame.replaced) {
            assert!(output == input || output as usize >= code.frame.n_inputs, "an output is computed");
        }
        code
    }

    pub const fn frame(&self) -> &Frame {
        &self.frame
    }

    /// What it takes of memory, about.
    pub fn bytes(&self) -> usize {
        BYTES * self.operations.len() + size_of::<(usize, Node)>() * self.common.len()
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

    /// Number of operations per sample.
    pub const fn n_operations(&self) -> usize {
        self.operations.len()
    }

    /// Number of outputs.
    #[cfg(test)]
    pub const fn n_outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Blocks of memory up to the end of its own.
    pub fn n_blocks(&self) -> usize {
        Layout::new(&self.line()).n_blocks()
    }

    /// Puts what is common to the samples of one configuration.
    pub fn put_common(&self, registers: &mut [Block], constants: &[f64], common: &[f64]) {
        let mut values = vec![0.0; self.n_nodes];
        for &(id, node) in &self.common {
            let value = |o: u32| values[o as usize];
            values[id] = match node {
                Node::Constant(number) => constants[number as usize],
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
    pub fn output<'b>(&self, registers: &'b [Block], index: usize) -> &'b Block {
        &registers[*self.frame.replaced.get(index).unwrap_or(&self.outputs[index]) as usize]
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
    pub fn line(&self) -> Line<'_> {
        Line {
            operations: &self.operations,
            n_inputs: self.frame.n_inputs as u32,
            first_common: self.frame.start as u32,
            first_temporary: (self.frame.start + self.broadcast.len()) as u32,
            n_registers: self.n_registers as u32,
            outputs: &self.outputs,
            replaced: &self.frame.replaced,
        }
    }

    /// The interpreter: where there is no machine code, and the measure of it.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn interpret(&self, registers: &mut [Block]) {
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
        for (&output, &input) in self.outputs.iter().zip(&self.frame.replaced) {
            registers[input as usize] = registers[output as usize];
        }
    }
}
