//! Machine code of allocated programs, for AVX2 with FMA and for AVX-512.

use iced_x86::{Code, Encoder, IcedError, Instruction, MemoryOperand, Register};

use crate::math::lanes::block::{Block, LANES};
use crate::program::native::allocate::{Binary, Form, Fused, Place, Source, Vector};
use crate::program::native::{COPIES, Layout};

/// Widths that code is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lanes {
    /// AVX2 with FMA.
    Four,
    /// AVX-512.
    Eight,
}

impl Lanes {
    const fn count(self) -> usize {
        match self {
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// Vector registers for the numbers of the program.
    pub const fn n_registers(self) -> usize {
        match self {
            // The last one serves the maximum.
            Self::Four => 15,
            Self::Eight => 32,
        }
    }

    fn register(self, index: u8) -> Register {
        match self {
            Self::Four => Register::YMM0 + u32::from(index),
            Self::Eight => Register::ZMM0 + u32::from(index),
        }
    }
}

/// Address of the memory, advanced from one part of the lanes to the next.
const BLOCKS: Register = Register::RDI;
/// Address of the common table, fixed.
const TABLE: Register = Register::RSI;
const COUNTER: Register = Register::EAX;

/// A function of the System V calling convention that runs the code on the memory at its argument.
pub fn encode(code: &[Vector], lanes: Lanes, layout: Layout) -> Result<Vec<u8>, IcedError> {
    let mut writer = Writer { encoder: Encoder::try_with_capacity(64, 16 * code.len() + 64)?, at: 0, lanes, layout };
    let bytes = (size_of::<f64>() * lanes.count()) as u32;
    writer.put(Instruction::with2(
        Code::Lea_r64_m,
        TABLE,
        displaced(BLOCKS, layout.table * size_of::<Block>(), false),
    )?)?;
    writer.put(Instruction::with2(Code::Mov_r32_imm32, COUNTER, (LANES / lanes.count()) as u32)?)?;
    let start = writer.at;
    for &vector in code {
        writer.vector(vector)?;
    }
    writer.put(Instruction::with2(Code::Add_rm64_imm8, BLOCKS, bytes)?)?;
    writer.put(Instruction::with1(Code::Dec_rm32, COUNTER)?)?;
    writer.put(Instruction::with_branch(Code::Jne_rel32_64, start)?)?;
    // Code without vectors is slow while the upper halves of the registers are in use.
    writer.put(Instruction::with(Code::VEX_Vzeroupper))?;
    writer.put(Instruction::with(Code::Retnq))?;
    Ok(writer.encoder.take_buffer())
}

#[allow(clippy::cast_possible_wrap)] // below what an instruction reaches
fn displaced(base: Register, offset: usize, spread: bool) -> MemoryOperand {
    MemoryOperand::new(base, Register::None, 1, offset as i64, 1, spread, Register::None)
}

struct Writer {
    encoder: Encoder,
    at: u64,
    lanes: Lanes,
    layout: Layout,
}

impl Writer {
    fn put(&mut self, instruction: Instruction) -> Result<(), IcedError> {
        self.at += self.encoder.encode(&instruction, self.at)? as u64;
        Ok(())
    }

    fn register(&self, index: u8) -> Register {
        self.lanes.register(index)
    }

    fn place(&self, place: Place) -> MemoryOperand {
        match place {
            Place::Block(r) => displaced(BLOCKS, r as usize * size_of::<Block>(), false),
            Place::Common(k) => {
                let (block, copies) = (k as usize * COPIES / LANES, k as usize * COPIES % LANES);
                let at = block * size_of::<Block>() + copies * size_of::<f64>();
                displaced(TABLE, at, self.lanes == Lanes::Eight)
            }
            Place::Aside(k) => {
                let start = (self.layout.aside - self.layout.table) * size_of::<Block>();
                displaced(TABLE, start + k as usize * size_of::<f64>() * self.lanes.count(), false)
            }
        }
    }

    fn vector(&mut self, vector: Vector) -> Result<(), IcedError> {
        let instruction = match vector {
            Vector::Load { to, from } => {
                let code = match (self.lanes, from) {
                    (Lanes::Four, _) => Code::VEX_Vmovapd_ymm_ymmm256,
                    (Lanes::Eight, Place::Common(_)) => Code::EVEX_Vbroadcastsd_zmm_k1z_xmmm64,
                    (Lanes::Eight, _) => Code::EVEX_Vmovapd_zmm_k1z_zmmm512,
                };
                let mut from = self.place(from);
                from.is_broadcast = false;
                Instruction::with2(code, self.register(to), from)?
            }
            Vector::Store { from, to } => {
                let code = match self.lanes {
                    Lanes::Four => Code::VEX_Vmovapd_ymmm256_ymm,
                    Lanes::Eight => Code::EVEX_Vmovapd_zmmm512_k1z_zmm,
                };
                Instruction::with2(code, self.place(to), self.register(from))?
            }
            Vector::Move { to, from } => {
                let code = match self.lanes {
                    Lanes::Four => Code::VEX_Vmovapd_ymm_ymmm256,
                    Lanes::Eight => Code::EVEX_Vmovapd_zmm_k1z_zmmm512,
                };
                Instruction::with2(code, self.register(to), self.register(from))?
            }
            Vector::Binary { kind: Binary::Max, to, a, b } => return self.max(to, a, b),
            Vector::Binary { kind: Binary::MaxUnsigned, to, a, b } if self.lanes == Lanes::Four => {
                return self.max(to, a, b);
            }
            Vector::Binary { kind, to, a, b } => self.three(binary(kind, self.lanes), to, a, b)?,
            Vector::Fused { kind, form, to, second, third } => {
                self.three(fused(kind, form, self.lanes), to, second, third)?
            }
        };
        self.put(instruction)
    }

    fn three(&self, code: Code, to: u8, a: u8, b: Source) -> Result<Instruction, IcedError> {
        let (to, a) = (self.register(to), self.register(a));
        match b {
            Source::Register(b) => Instruction::with3(code, to, a, self.register(b)),
            Source::Memory(b) => Instruction::with3(code, to, a, self.place(b)),
        }
    }

    /// The instruction gives its second operand where either is not a number: where the first is not, it
    /// is put in afterwards.
    fn max(&mut self, to: u8, a: u8, b: Source) -> Result<(), IcedError> {
        const UNORDERED: u32 = 3;
        let first = self.register(a);
        let result = self.register(to);
        match self.lanes {
            Lanes::Four => {
                let undefined = Register::YMM15;
                self.put(Instruction::with4(
                    Code::VEX_Vcmppd_ymm_ymm_ymmm256_imm8,
                    undefined,
                    first,
                    first,
                    UNORDERED,
                )?)?;
                self.put(self.three(Code::VEX_Vmaxpd_ymm_ymm_ymmm256, to, a, b)?)?;
                let blend = Code::VEX_Vblendvpd_ymm_ymm_ymmm256_ymm;
                self.put(Instruction::with4(blend, result, result, first, undefined)?)
            }
            Lanes::Eight => {
                let compare = Code::EVEX_Vcmppd_kr_k1_zmm_zmmm512b64_imm8_sae;
                self.put(Instruction::with4(compare, Register::K1, first, first, UNORDERED)?)?;
                self.put(self.three(Code::EVEX_Vmaxpd_zmm_k1z_zmm_zmmm512b64_sae, to, a, b)?)?;
                let mut put_in = Instruction::with2(Code::EVEX_Vmovapd_zmm_k1z_zmmm512, result, first)?;
                put_in.set_op_mask(Register::K1);
                self.put(put_in)
            }
        }
    }
}

const fn binary(kind: Binary, lanes: Lanes) -> Code {
    let [four, eight] = match kind {
        Binary::Add => [Code::VEX_Vaddpd_ymm_ymm_ymmm256, Code::EVEX_Vaddpd_zmm_k1z_zmm_zmmm512b64_er],
        Binary::Sub => [Code::VEX_Vsubpd_ymm_ymm_ymmm256, Code::EVEX_Vsubpd_zmm_k1z_zmm_zmmm512b64_er],
        Binary::Mul => [Code::VEX_Vmulpd_ymm_ymm_ymmm256, Code::EVEX_Vmulpd_zmm_k1z_zmm_zmmm512b64_er],
        Binary::Div => [Code::VEX_Vdivpd_ymm_ymm_ymmm256, Code::EVEX_Vdivpd_zmm_k1z_zmm_zmmm512b64_er],
        Binary::Max => [Code::VEX_Vmaxpd_ymm_ymm_ymmm256, Code::EVEX_Vmaxpd_zmm_k1z_zmm_zmmm512b64_sae],
        // Numbers without sign are ordered as their bits are, with what is not a number behind them.
        Binary::MaxUnsigned => [Code::VEX_Vmaxpd_ymm_ymm_ymmm256, Code::EVEX_Vpmaxuq_zmm_k1z_zmm_zmmm512b64],
        Binary::Xor => [Code::VEX_Vxorpd_ymm_ymm_ymmm256, Code::EVEX_Vxorpd_zmm_k1z_zmm_zmmm512b64],
        Binary::And => [Code::VEX_Vandpd_ymm_ymm_ymmm256, Code::EVEX_Vandpd_zmm_k1z_zmm_zmmm512b64],
    };
    match lanes {
        Lanes::Four => four,
        Lanes::Eight => eight,
    }
}

const fn fused(kind: Fused, form: Form, lanes: Lanes) -> Code {
    let [four, eight] = match (kind, form) {
        (Fused::MulAdd, Form::F132) => {
            [Code::VEX_Vfmadd132pd_ymm_ymm_ymmm256, Code::EVEX_Vfmadd132pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::MulAdd, Form::F213) => {
            [Code::VEX_Vfmadd213pd_ymm_ymm_ymmm256, Code::EVEX_Vfmadd213pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::MulAdd, Form::F231) => {
            [Code::VEX_Vfmadd231pd_ymm_ymm_ymmm256, Code::EVEX_Vfmadd231pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::MulSub, Form::F132) => {
            [Code::VEX_Vfmsub132pd_ymm_ymm_ymmm256, Code::EVEX_Vfmsub132pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::MulSub, Form::F213) => {
            [Code::VEX_Vfmsub213pd_ymm_ymm_ymmm256, Code::EVEX_Vfmsub213pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::MulSub, Form::F231) => {
            [Code::VEX_Vfmsub231pd_ymm_ymm_ymmm256, Code::EVEX_Vfmsub231pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::NegMulAdd, Form::F132) => {
            [Code::VEX_Vfnmadd132pd_ymm_ymm_ymmm256, Code::EVEX_Vfnmadd132pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::NegMulAdd, Form::F213) => {
            [Code::VEX_Vfnmadd213pd_ymm_ymm_ymmm256, Code::EVEX_Vfnmadd213pd_zmm_k1z_zmm_zmmm512b64_er]
        }
        (Fused::NegMulAdd, Form::F231) => {
            [Code::VEX_Vfnmadd231pd_ymm_ymm_ymmm256, Code::EVEX_Vfnmadd231pd_zmm_k1z_zmm_zmmm512b64_er]
        }
    };
    match lanes {
        Lanes::Four => four,
        Lanes::Eight => eight,
    }
}
