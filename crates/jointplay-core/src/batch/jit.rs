//! Recorded programs as machine code of the processor at hand.
//!
//! The interpreter of [`super::tape`] moves every operand through memory. Here a program becomes straight
//! code for one vector of samples, in a loop over the vectors of a block, with values kept in vector registers
//! as long as they are needed soon: where one is wanted, the value whose next use is farthest away goes
//! back to its place among the block's registers (Belady). Every operation is the interpreter's, rounding
//! for rounding, so that results do not depend on the way.

use std::collections::BTreeSet;
use std::sync::Arc;

use iced_x86::code_asm::{CodeAssembler, ecx, rdi};
use iced_x86::{Code, IcedError, Instruction, MemoryOperand, Register};
use memmap2::{Mmap, MmapMut};

use super::lanes::{Block, LANES};
use super::tape::{Kind, Op};

/// The vector registers to compile for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vector {
    /// AVX2 with fused multiply-add: 16 registers of 4 numbers.
    Ymm,
    /// AVX-512: 32 registers of 8 numbers.
    Zmm,
}

/// Instruction codes of one width.
struct Codes {
    load: Code,
    store: Code,
    copy: Code,
    add: Code,
    sub: Code,
    mul: Code,
    div: Code,
    max: Code,
    xor: Code,
    and_not: Code,
    /// Multiply-add, -subtract and negated multiply-add, each as 132, 213 and 231.
    fused: [[Code; 3]; 3],
}

const YMM: Codes = Codes {
    load: Code::VEX_Vmovupd_ymm_ymmm256,
    store: Code::VEX_Vmovupd_ymmm256_ymm,
    copy: Code::VEX_Vmovapd_ymm_ymmm256,
    add: Code::VEX_Vaddpd_ymm_ymm_ymmm256,
    sub: Code::VEX_Vsubpd_ymm_ymm_ymmm256,
    mul: Code::VEX_Vmulpd_ymm_ymm_ymmm256,
    div: Code::VEX_Vdivpd_ymm_ymm_ymmm256,
    max: Code::VEX_Vmaxpd_ymm_ymm_ymmm256,
    xor: Code::VEX_Vxorpd_ymm_ymm_ymmm256,
    and_not: Code::VEX_Vandnpd_ymm_ymm_ymmm256,
    fused: [
        [
            Code::VEX_Vfmadd132pd_ymm_ymm_ymmm256,
            Code::VEX_Vfmadd213pd_ymm_ymm_ymmm256,
            Code::VEX_Vfmadd231pd_ymm_ymm_ymmm256,
        ],
        [
            Code::VEX_Vfmsub132pd_ymm_ymm_ymmm256,
            Code::VEX_Vfmsub213pd_ymm_ymm_ymmm256,
            Code::VEX_Vfmsub231pd_ymm_ymm_ymmm256,
        ],
        [
            Code::VEX_Vfnmadd132pd_ymm_ymm_ymmm256,
            Code::VEX_Vfnmadd213pd_ymm_ymm_ymmm256,
            Code::VEX_Vfnmadd231pd_ymm_ymm_ymmm256,
        ],
    ],
};

const ZMM: Codes = Codes {
    load: Code::EVEX_Vmovupd_zmm_k1z_zmmm512,
    store: Code::EVEX_Vmovupd_zmmm512_k1z_zmm,
    copy: Code::EVEX_Vmovapd_zmm_k1z_zmmm512,
    add: Code::EVEX_Vaddpd_zmm_k1z_zmm_zmmm512b64_er,
    sub: Code::EVEX_Vsubpd_zmm_k1z_zmm_zmmm512b64_er,
    mul: Code::EVEX_Vmulpd_zmm_k1z_zmm_zmmm512b64_er,
    div: Code::EVEX_Vdivpd_zmm_k1z_zmm_zmmm512b64_er,
    max: Code::EVEX_Vmaxpd_zmm_k1z_zmm_zmmm512b64_sae,
    xor: Code::EVEX_Vpxorq_zmm_k1z_zmm_zmmm512b64,
    and_not: Code::EVEX_Vpandnq_zmm_k1z_zmm_zmmm512b64,
    fused: [
        [
            Code::EVEX_Vfmadd132pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfmadd213pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfmadd231pd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        [
            Code::EVEX_Vfmsub132pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfmsub213pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfmsub231pd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        [
            Code::EVEX_Vfnmadd132pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfnmadd213pd_zmm_k1z_zmm_zmmm512b64_er,
            Code::EVEX_Vfnmadd231pd_zmm_k1z_zmm_zmmm512b64_er,
        ],
    ],
};

impl Vector {
    const fn codes(self) -> &'static Codes {
        match self {
            Self::Ymm => &YMM,
            Self::Zmm => &ZMM,
        }
    }

    const fn bytes(self) -> u32 {
        match self {
            Self::Ymm => 32,
            Self::Zmm => 64,
        }
    }

    /// Registers to give out; of the last two one holds the signs and one serves within an operation.
    const fn registers(self) -> u32 {
        match self {
            Self::Ymm => 14,
            Self::Zmm => 30,
        }
    }

    fn register(self, number: u32) -> Register {
        match self {
            Self::Ymm => Register::YMM0 + number,
            Self::Zmm => Register::ZMM0 + number,
        }
    }
}

/// Machine code of one program.
#[derive(Clone, Debug)]
pub struct Compiled {
    code: Arc<Mmap>,
    n_registers: usize,
}

impl Compiled {
    /// Compiles operations on numbered registers of a block, of which the outputs are wanted afterwards;
    /// `None` where memory cannot be made executable.
    #[must_use]
    pub fn new(operations: &[Op], outputs: &[u16], n_registers: usize, vector: Vector) -> Option<Self> {
        let bytes = Writer::new(operations, outputs, n_registers, vector).ok()?.write().ok()?;
        let mut memory = MmapMut::map_anon(bytes.len()).ok()?;
        memory.copy_from_slice(&bytes);
        Some(Self { code: Arc::new(memory.make_exec().ok()?), n_registers })
    }

    /// Runs it on the registers of a block.
    ///
    /// # Panics
    /// When the registers are not the program's.
    ///
    /// # Safety
    /// The processor must have the vector registers that this was compiled for.
    #[allow(unsafe_code)]
    pub unsafe fn run(&self, registers: &mut [Block]) {
        assert_eq!(registers.len(), self.n_registers, "registers of another program");
        // SAFETY: the code was written by `Writer`, follows this calling convention, and touches the given
        // number of blocks only.
        unsafe {
            let entry: extern "sysv64" fn(*mut Block) = std::mem::transmute(self.code.as_ptr());
            entry(registers.as_mut_ptr());
        }
    }
}

/// A value: what one operation wrote, or what stood in a register at the beginning.
#[derive(Clone, Debug)]
struct Value {
    /// Its place among the block's registers.
    home: u16,
    /// The operations that read it, the next one last.
    uses: Vec<usize>,
    /// Where it is now.
    register: Option<u32>,
    /// Whether it stands in its place.
    is_home: bool,
    /// Whether it is wanted afterwards.
    is_output: bool,
}

struct Writer {
    vector: Vector,
    asm: CodeAssembler,
    /// Operands and result of every operation, as values.
    operations: Vec<(Kind, [usize; 3], usize)>,
    values: Vec<Value>,
    free: Vec<u32>,
    /// Values in registers by their next use.
    held: BTreeSet<(usize, usize)>,
}

impl Writer {
    fn new(operations: &[Op], outputs: &[u16], n_registers: usize, vector: Vector) -> Result<Self, IcedError> {
        let value = |home: usize, is_home| Value {
            home: home as u16,
            uses: Vec::new(),
            register: None,
            is_home,
            is_output: false,
        };
        let mut values: Vec<Value> = (0..n_registers).map(|home| value(home, true)).collect();
        let mut current: Vec<usize> = (0..n_registers).collect();
        let mut numbered = Vec::with_capacity(operations.len());
        for (at, op) in operations.iter().enumerate() {
            let operands = [op.a, op.b, op.c].map(|r| current[r as usize]);
            for &o in &operands[..op.kind.arity()] {
                values[o].uses.push(at);
            }
            current[op.target as usize] = values.len();
            numbered.push((op.kind, operands, values.len()));
            values.push(value(op.target as usize, false));
        }
        for value in &mut values {
            value.uses.reverse();
            value.uses.dedup();
        }
        for &output in outputs {
            values[current[output as usize]].is_output = true;
        }
        Ok(Self {
            vector,
            asm: CodeAssembler::new(64)?,
            operations: numbered,
            values,
            free: (0..vector.registers()).rev().collect(),
            held: BTreeSet::new(),
        })
    }

    fn write(mut self) -> Result<Vec<u8>, IcedError> {
        let codes = self.vector.codes();
        let signs = self.signs();
        if self.operations.iter().any(|(kind, ..)| matches!(kind, Kind::Neg | Kind::Abs)) {
            self.write_signs(signs)?;
        }
        let vectors = (LANES * 8) as u32 / self.vector.bytes();
        self.asm.mov(ecx, vectors)?;
        let mut top = self.asm.create_label();
        self.asm.set_label(&mut top)?;
        for at in 0..self.operations.len() {
            self.operation(at)?;
        }
        let dirty =
            self.values.iter().filter(|v| v.is_output && !v.is_home).filter_map(|v| Some((v.home, v.register?)));
        for (home, register) in dirty.collect::<Vec<_>>() {
            let (to, from) = (self.place(home), self.vector.register(register));
            self.asm.add_instruction(Instruction::with2(codes.store, to, from)?)?;
        }
        self.asm.add(rdi, self.vector.bytes() as i32)?;
        self.asm.dec(ecx)?;
        self.asm.jnz(top)?;
        self.asm.vzeroupper()?;
        self.asm.ret()?;
        self.asm.assemble(0)
    }

    /// The register that holds the sign bits.
    fn signs(&self) -> Register {
        self.vector.register(self.vector.registers())
    }

    /// The register that serves within an operation.
    fn scratch(&self) -> Register {
        self.vector.register(self.vector.registers() + 1)
    }

    fn write_signs(&mut self, signs: Register) -> Result<(), IcedError> {
        let shift = match self.vector {
            Vector::Ymm => {
                self.asm.add_instruction(Instruction::with3(
                    Code::VEX_Vpcmpeqq_ymm_ymm_ymmm256,
                    signs,
                    signs,
                    signs,
                )?)?;
                Code::VEX_Vpsllq_ymm_ymm_imm8
            }
            Vector::Zmm => {
                let ones = Code::EVEX_Vpternlogd_zmm_k1z_zmm_zmmm512b32_imm8;
                self.asm.add_instruction(Instruction::with4(ones, signs, signs, signs, 0xFF_u32)?)?;
                Code::EVEX_Vpsllq_zmm_k1z_zmmm512b64_imm8
            }
        };
        self.asm.add_instruction(Instruction::with3(shift, signs, signs, 63_u32)?)
    }

    /// A block register in memory, at the vector that the loop is at.
    fn place(&self, home: u16) -> MemoryOperand {
        MemoryOperand::with_base_displ(Register::RDI, i64::from(home) * (LANES * 8) as i64)
    }

    fn next_use(&self, value: usize) -> usize {
        let after = if self.values[value].is_output { usize::MAX - 1 } else { usize::MAX };
        self.values[value].uses.last().copied().unwrap_or(after)
    }

    /// A free register; where there is none, the one whose value is wanted last, which goes home. Values
    /// of the operation at hand have been taken out of `held` before.
    fn take(&mut self) -> Result<u32, IcedError> {
        if let Some(register) = self.free.pop() {
            return Ok(register);
        }
        let Some((next, value)) = self.held.pop_last() else { unreachable!("an operation has fewer operands") };
        let Some(register) = self.values[value].register.take() else { unreachable!("held values are in registers") };
        if !self.values[value].is_home && next != usize::MAX {
            let (to, from) = (self.place(self.values[value].home), self.vector.register(register));
            self.asm.add_instruction(Instruction::with2(self.vector.codes().store, to, from)?)?;
            self.values[value].is_home = true;
        }
        Ok(register)
    }

    /// Brings a value into a register.
    fn fetch(&mut self, value: usize) -> Result<u32, IcedError> {
        if let Some(register) = self.values[value].register {
            return Ok(register);
        }
        let register = self.take()?;
        let from = self.place(self.values[value].home);
        let load = Instruction::with2(self.vector.codes().load, self.vector.register(register), from)?;
        self.asm.add_instruction(load)?;
        self.values[value].register = Some(register);
        Ok(register)
    }

    /// `code target, first, last`, the last operand in a register or in memory.
    fn emit(&mut self, code: Code, target: u32, first: u32, last: usize) -> Result<(), IcedError> {
        let (target, first) = (self.vector.register(target), self.vector.register(first));
        let instruction = match self.values[last].register {
            Some(register) => Instruction::with3(code, target, first, self.vector.register(register))?,
            None => Instruction::with3(code, target, first, self.place(self.values[last].home))?,
        };
        self.asm.add_instruction(instruction)
    }

    fn operation(&mut self, at: usize) -> Result<(), IcedError> {
        let (kind, operands, result) = self.operations[at];
        let operands = &operands[..kind.arity()];
        for &o in operands {
            self.held.remove(&(self.next_use(o), o));
        }
        for &o in operands {
            if self.values[o].uses.last() == Some(&at) {
                self.values[o].uses.pop();
            }
        }
        let target = match kind {
            Kind::Add | Kind::Sub | Kind::Mul | Kind::Div => self.binary(kind, operands[0], operands[1])?,
            Kind::Max => self.larger(operands[0], operands[1])?,
            Kind::Neg | Kind::Abs => self.sign(kind, operands[0])?,
            Kind::MulAdd | Kind::MulSub | Kind::NegMulAdd => self.fused(kind, operands)?,
        };
        self.values[result].register = Some(target);
        for &o in operands {
            // The target may have taken an operand's register over.
            let Some(register) = self.values[o].register else { continue };
            if register == target {
                self.values[o].register = None;
            } else if self.next_use(o) == usize::MAX {
                self.values[o].register = None;
                self.free.push(register);
            } else {
                self.held.insert((self.next_use(o), o));
            }
        }
        if self.next_use(result) == usize::MAX {
            self.values[result].register = None;
            self.free.push(target);
        } else {
            self.held.insert((self.next_use(result), result));
        }
        Ok(())
    }

    /// Whether nothing needs a value's register after the operation at hand.
    fn dies(&self, value: usize) -> bool {
        self.values[value].register.is_some()
            && (self.next_use(value) == usize::MAX
                || (self.values[value].is_home && self.values[value].uses.is_empty()))
    }

    /// Whether a value is better read straight from memory: it is there, and this is its last use.
    fn from_memory(&self, value: usize) -> bool {
        self.values[value].register.is_none() && self.values[value].uses.is_empty()
    }

    fn binary(&mut self, kind: Kind, a: usize, b: usize) -> Result<u32, IcedError> {
        let codes = self.vector.codes();
        let code = match kind {
            Kind::Add => codes.add,
            Kind::Sub => codes.sub,
            Kind::Mul => codes.mul,
            _ => codes.div,
        };
        let commutes = matches!(kind, Kind::Add | Kind::Mul);
        let (a, b) = if commutes && a != b && self.from_memory(a) { (b, a) } else { (a, b) };
        let first = self.fetch(a)?;
        if !self.from_memory(b) {
            self.fetch(b)?;
        }
        let target = self.target(&[a, b])?;
        self.emit(code, target, first, b)?;
        Ok(target)
    }

    /// An operand's register that nothing needs any longer, or another one.
    fn target(&mut self, operands: &[usize]) -> Result<u32, IcedError> {
        match operands.iter().find(|&&o| self.dies(o)).and_then(|&o| self.values[o].register) {
            Some(register) => Ok(register),
            None => self.take(),
        }
    }

    /// `a > b or a is not a number ? a : b`. The instruction gives b when either is not a number.
    fn larger(&mut self, a: usize, b: usize) -> Result<u32, IcedError> {
        let (first, _) = (self.fetch(a)?, self.fetch(b)?);
        let target = self.take()?;
        self.emit(self.vector.codes().max, target, first, b)?;
        let (to, from, scratch) = (self.vector.register(target), self.vector.register(first), self.scratch());
        // 3: unordered.
        match self.vector {
            Vector::Ymm => {
                let compare = Code::VEX_Vcmppd_ymm_ymm_ymmm256_imm8;
                self.asm.add_instruction(Instruction::with4(compare, scratch, from, from, 3_u32)?)?;
                let blend = Code::VEX_Vblendvpd_ymm_ymm_ymmm256_ymm;
                self.asm.add_instruction(Instruction::with4(blend, to, to, from, scratch)?)?;
            }
            Vector::Zmm => {
                let compare = Code::EVEX_Vcmppd_kr_k1_zmm_zmmm512b64_imm8_sae;
                self.asm.add_instruction(Instruction::with4(compare, Register::K1, from, from, 3_u32)?)?;
                let mut copy = Instruction::with2(self.vector.codes().copy, to, from)?;
                copy.set_op_mask(Register::K1);
                self.asm.add_instruction(copy)?;
            }
        }
        Ok(target)
    }

    fn sign(&mut self, kind: Kind, a: usize) -> Result<u32, IcedError> {
        let codes = self.vector.codes();
        let code = if matches!(kind, Kind::Neg) { codes.xor } else { codes.and_not };
        if !self.from_memory(a) {
            self.fetch(a)?;
        }
        let target = self.target(&[a])?;
        self.emit(code, target, self.vector.registers(), a)?;
        Ok(target)
    }

    /// `a b + c` and its kin, in the form that overwrites an operand which is not needed any longer.
    fn fused(&mut self, kind: Kind, operands: &[usize]) -> Result<u32, IcedError> {
        let [a, b, c] = [operands[0], operands[1], operands[2]];
        let [multiply, _, add] = match kind {
            Kind::MulAdd => self.vector.codes().fused[0],
            Kind::MulSub => self.vector.codes().fused[1],
            _ => self.vector.codes().fused[2],
        };
        let product_and = multiply;
        // One operand at most is read from memory; the others come into registers first.
        let memory =
            [c, b, a].into_iter().find(|&o| self.from_memory(o) && operands.iter().filter(|&&p| p == o).count() == 1);
        for o in [a, b, c] {
            if Some(o) != memory {
                self.fetch(o)?;
            }
        }
        let register = |w: &Self, o: usize| w.values[o].register.unwrap_or_else(|| unreachable!("fetched above"));
        if memory == Some(c) || (memory.is_none() && !self.dies(c) && (self.dies(a) || self.dies(b))) {
            // target = target * factor + c, the target one of the factors.
            let (over, factor) = if self.dies(a) || !self.dies(b) { (a, b) } else { (b, a) };
            let target = self.overwritten(over)?;
            let code = match kind {
                Kind::MulAdd => self.vector.codes().fused[0][1],
                Kind::MulSub => self.vector.codes().fused[1][1],
                _ => self.vector.codes().fused[2][1],
            };
            let factor = if factor == over { target } else { register(self, factor) };
            self.emit(code, target, factor, c)?;
            return Ok(target);
        }
        let (factor, last) = if memory == Some(a) { (b, a) } else { (a, b) };
        if self.dies(c) || memory.is_none() {
            // target = factor * last + target, the target being c.
            let target = self.overwritten(c)?;
            let factor = register(self, factor);
            self.emit(add, target, factor, last)?;
            return Ok(target);
        }
        // target = target * last + c, the last in memory.
        let target = self.overwritten(factor)?;
        let c = register(self, c);
        self.emit(product_and, target, c, last)?;
        Ok(target)
    }

    /// The register of an operand if nothing needs it any longer, or a copy.
    fn overwritten(&mut self, value: usize) -> Result<u32, IcedError> {
        let Some(from) = self.values[value].register else { unreachable!("fetched before") };
        if self.dies(value) {
            return Ok(from);
        }
        let to = self.take()?;
        let copy = Instruction::with2(self.vector.codes().copy, self.vector.register(to), self.vector.register(from))?;
        self.asm.add_instruction(copy)?;
        Ok(to)
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::batch::symbol::{Recorder, Symbol};
    use crate::batch::tape::Program;

    const INPUTS: usize = 9;

    /// A program of random operations on random earlier results, of which `alive` are kept for the end.
    fn program(rng: &mut Xoshiro256PlusPlus, operations: usize, alive: usize) -> Option<Program> {
        let recorder = Recorder::new(0.1);
        let mut symbols: Vec<Symbol<'_>> = (0..INPUTS).map(|k| recorder.varying(k)).collect();
        symbols.extend([recorder.common(0), Symbol::Constant(1.7), Symbol::Constant(-0.0)]);
        for _ in 0..operations {
            let recent = |rng: &mut Xoshiro256PlusPlus| {
                let reach = if rng.random_bool(0.2) { symbols.len() } else { symbols.len().min(8) };
                symbols[symbols.len() - 1 - rng.random_range(0..reach)]
            };
            let (a, b, c) = (recent(rng), recent(rng), recent(rng));
            symbols.push(match rng.random_range(0..9) {
                0 => a + b,
                1 => a - b,
                2 => a * b,
                3 => a / b,
                4 => a.max(b),
                5 => -a,
                6 => a.abs(),
                7 => a * b + c,
                _ => c - a * b,
            });
        }
        let outputs: Vec<Symbol<'_>> = (0..alive).map(|k| symbols[symbols.len() - 1 - 3 * k % symbols.len()]).collect();
        Program::new(&recorder, INPUTS, &outputs)
    }

    #[test]
    fn machine_code_gives_the_bits_of_the_interpreter() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let widths = [
            (Vector::Ymm, std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")),
            (Vector::Zmm, std::is_x86_feature_detected!("avx512f")),
        ];
        let special = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-310];
        for round in 0..300 {
            let Some(program) = program(&mut rng, 1 + 3 * round, 1 + round % 70) else { continue };
            let mut registers = program.registers(&[0.3]);
            for block in &mut registers[..INPUTS] {
                for lane in &mut block.0 {
                    let odd = rng.random_bool(0.1);
                    *lane = if odd { special[rng.random_range(0..6)] } else { rng.random_range(-2.0..2.0) };
                }
            }
            let mut expected = registers.clone();
            program.interpret(&mut expected);
            for (vector, _) in widths.into_iter().filter(|(_, available)| *available) {
                let mut found = registers.clone();
                let compiled = program.compile(vector).expect("memory that can be made executable");
                #[allow(unsafe_code)]
                // SAFETY: only widths that this processor has.
                unsafe {
                    compiled.run(&mut found);
                }
                for k in 0..program.n_outputs() {
                    let bits = |registers: &[Block]| program.output(registers, k).0.map(f64::to_bits);
                    let same =
                        |(a, b): (u64, u64)| a == b || (f64::from_bits(a).is_nan() && f64::from_bits(b).is_nan());
                    assert!(bits(&found).into_iter().zip(bits(&expected)).all(same), "{vector:?}, round {round}");
                }
            }
        }
    }
}
