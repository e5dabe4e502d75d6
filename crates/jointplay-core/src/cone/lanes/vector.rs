//! One number of each of eight programs.
//!
//! Plain arithmetic on a fixed array, inlined into functions that are compiled for several widths of
//! vector registers; the operations and their order do not depend on the width.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math::lanes::block::bits_if;

/// Programs at a time.
pub(super) const LANES: usize = 8;

/// One number for every program.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct V(pub [f64; LANES]);

/// A choice of programs: all bits or none.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Choice(pub [u64; LANES]);

/// Nothing, at no cost, that the compiler must not repeat: loops over numbers of eight programs would
/// otherwise be turned around, into vectors of one program's numbers, gathered one by one.
#[inline(always)]
#[allow(unsafe_code)]
fn together() {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    // SAFETY: there is no instruction.
    unsafe {
        std::arch::asm!("", options(nomem, nostack, preserves_flags));
    }
}

macro_rules! each {
    ($i:ident, $value:expr) => {{
        together();
        let mut out = [0.0; LANES];
        let mut $i = 0;
        while $i < LANES {
            out[$i] = $value;
            $i += 1;
        }
        V(out)
    }};
}

macro_rules! choose {
    ($i:ident, $value:expr) => {{
        let mut out = [0; LANES];
        let mut $i = 0;
        while $i < LANES {
            out[$i] = bits_if($value);
            $i += 1;
        }
        Choice(out)
    }};
}

impl V {
    pub const ZERO: Self = Self([0.0; LANES]);
    pub const ONE: Self = Self([1.0; LANES]);

    #[inline(always)]
    pub const fn splat(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    pub fn abs(self) -> Self {
        each!(i, self.0[i].abs())
    }
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        each!(i, self.0[i].sqrt())
    }
    /// The larger; the other one where one is not a number.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        each!(i, if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] })
    }
    /// The smaller; the other one where one is not a number.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        each!(i, if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] })
    }
    /// `self o + c` with one rounding.
    #[inline(always)]
    pub fn times_plus(self, o: Self, c: Self) -> Self {
        each!(i, self.0[i].mul_add(o.0[i], c.0[i]))
    }
    /// `c - self o` with one rounding.
    #[inline(always)]
    pub fn times_from(self, o: Self, c: Self) -> Self {
        each!(i, (-self.0[i]).mul_add(o.0[i], c.0[i]))
    }
    #[inline(always)]
    pub fn below(self, o: Self) -> Choice {
        choose!(i, self.0[i] < o.0[i])
    }
    /// `self` where chosen, else `o`.
    #[inline(always)]
    pub fn where_else(self, choice: Choice, o: Self) -> Self {
        each!(i, f64::from_bits(self.0[i].to_bits() & choice.0[i] | o.0[i].to_bits() & !choice.0[i]))
    }
}

impl Default for V {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Choice {
    pub const ALL: Self = Self([u64::MAX; LANES]);

    #[inline(always)]
    pub fn and(self, o: Self) -> Self {
        choose!(i, self.0[i] & o.0[i] != 0)
    }
    #[inline(always)]
    pub fn not(self) -> Self {
        choose!(i, self.0[i] == 0)
    }
    #[inline(always)]
    pub fn any(self) -> bool {
        let mut any = 0;
        let mut i = 0;
        while i < LANES {
            any |= self.0[i];
            i += 1;
        }
        any != 0
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $op:tt) => {
        impl $trait for V {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                each!(i, self.0[i] $op o.0[i])
            }
        }
    };
}

operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Neg for V {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(i, -self.0[i])
    }
}

/// `sum a b`, in four sums, so that none waits for another.
#[inline(always)]
pub(super) fn dot(a: &[V], b: &[V]) -> V {
    let mut sums = [V::ZERO; 4];
    let (many_a, many_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let (rest_a, rest_b) = (many_a.remainder(), many_b.remainder());
    for (a, b) in many_a.zip(many_b) {
        sums[0] = a[0].times_plus(b[0], sums[0]);
        sums[1] = a[1].times_plus(b[1], sums[1]);
        sums[2] = a[2].times_plus(b[2], sums[2]);
        sums[3] = a[3].times_plus(b[3], sums[3]);
    }
    let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (a, b) in rest_a.iter().zip(rest_b) {
        sum = a.times_plus(*b, sum);
    }
    sum
}

/// The same of a few numbers.
#[inline(always)]
pub(super) fn dot_few(a: &[V], b: &[V]) -> V {
    let mut sum = V::ZERO;
    for (a, b) in a.iter().zip(b) {
        sum = a.times_plus(*b, sum);
    }
    sum
}
