//! Blocks of samples, and the elementary functions that sampling needs on them.
//!
//! Everything here is plain arithmetic on fixed arrays, inlined into functions that are compiled for
//! several widths of vector registers. The operations and their order do not depend on the width, so
//! neither do the results.

use std::mem::MaybeUninit;

/// Samples per block.
pub const LANES: usize = 64;

/// One number for every sample of a block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Block(pub [f64; LANES], Gap);

/// A line of the cache between one block and the next: machine code goes through the same lanes of many blocks,
/// which without it would compete for every eighth set of the cache.
type Gap = [MaybeUninit<f64>; 8];

/// A choice of lanes: all bits or none. As wide as the numbers, so that lanes are judged in the vector
/// registers in which they are computed.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Mask(pub [u64; LANES]);

/// All bits or none.
#[inline(always)]
#[must_use]
pub const fn bits_if(chosen: bool) -> u64 {
    (chosen as u64).wrapping_neg()
}

/// `yes` where chosen, else `no`: both are computed, and no lane branches.
#[inline(always)]
#[must_use]
pub const fn select(chosen: u64, yes: f64, no: f64) -> f64 {
    f64::from_bits(yes.to_bits() & chosen | no.to_bits() & !chosen)
}

impl Mask {
    /// No lane.
    pub const NONE: Self = Self([0; LANES]);

    /// The lanes for which something holds.
    #[inline(always)]
    #[must_use]
    pub fn of(holds: impl Fn(usize) -> bool) -> Self {
        let mut mask = Self::NONE;
        for i in 0..LANES {
            mask.0[i] = bits_if(holds(i));
        }
        mask
    }

    /// Leaves the first lanes only.
    #[inline(always)]
    pub fn limit(&mut self, lanes: usize) {
        let mut i = 0;
        while i < LANES {
            self.0[i] &= bits_if(i < lanes);
            i += 1;
        }
    }

    /// Number of lanes.
    #[inline(always)]
    #[must_use]
    pub fn count(&self) -> u64 {
        let mut count = 0;
        let mut i = 0;
        while i < LANES {
            count += self.0[i] & 1;
            i += 1;
        }
        count
    }

    /// Whether a lane is chosen.
    #[inline(always)]
    #[must_use]
    pub const fn has(&self, lane: usize) -> bool {
        self.0[lane] != 0
    }
}

macro_rules! each {
    ($i:ident, $value:expr) => {{
        let mut out = [0.0; LANES];
        let mut $i = 0;
        while $i < LANES {
            out[$i] = $value;
            $i += 1;
        }
        Block::new(out)
    }};
}

#[allow(clippy::should_implement_trait)] // inlining must be forced, which operators cannot promise
impl Block {
    /// A number for every sample.
    #[inline(always)]
    #[must_use]
    pub const fn new(lanes: [f64; LANES]) -> Self {
        Self(lanes, [MaybeUninit::uninit(); 8])
    }
    /// The same number for every sample.
    #[inline(always)]
    #[must_use]
    pub fn splat(value: f64) -> Self {
        Self::new([value; LANES])
    }
    /// Sum.
    #[inline(always)]
    #[must_use]
    pub fn add(&self, o: &Self) -> Self {
        each!(i, self.0[i] + o.0[i])
    }
    /// Difference.
    #[inline(always)]
    #[must_use]
    pub fn sub(&self, o: &Self) -> Self {
        each!(i, self.0[i] - o.0[i])
    }
    /// Product.
    #[inline(always)]
    #[must_use]
    pub fn mul(&self, o: &Self) -> Self {
        each!(i, self.0[i] * o.0[i])
    }
    /// Quotient.
    #[inline(always)]
    #[must_use]
    pub fn div(&self, o: &Self) -> Self {
        each!(i, self.0[i] / o.0[i])
    }
    /// Negative.
    #[inline(always)]
    #[must_use]
    pub fn neg(&self) -> Self {
        each!(i, -self.0[i])
    }
    /// Absolute value.
    #[inline(always)]
    #[must_use]
    pub fn abs(&self) -> Self {
        each!(i, self.0[i].abs())
    }
    /// Square root.
    #[inline(always)]
    #[must_use]
    pub fn sqrt(&self) -> Self {
        each!(i, self.0[i].sqrt())
    }
    /// The larger; not a number when either is not.
    #[inline(always)]
    #[must_use]
    pub fn max(&self, o: &Self) -> Self {
        each!(i, if self.0[i] > o.0[i] || self.0[i].is_nan() { self.0[i] } else { o.0[i] })
    }
    /// `self o + c` with one rounding.
    #[inline(always)]
    #[must_use]
    pub fn mul_add(&self, o: &Self, c: &Self) -> Self {
        each!(i, self.0[i].mul_add(o.0[i], c.0[i]))
    }
    /// `self o - c` with one rounding.
    #[inline(always)]
    #[must_use]
    pub fn mul_sub(&self, o: &Self, c: &Self) -> Self {
        each!(i, self.0[i].mul_add(o.0[i], -c.0[i]))
    }
    /// `c - self o` with one rounding.
    #[inline(always)]
    #[must_use]
    pub fn neg_mul_add(&self, o: &Self, c: &Self) -> Self {
        each!(i, (-self.0[i]).mul_add(o.0[i], c.0[i]))
    }
    /// `self` where chosen, else `o`.
    #[inline(always)]
    #[must_use]
    pub fn where_else(&self, chosen: &[bool; LANES], o: &Self) -> Self {
        each!(i, if chosen[i] { self.0[i] } else { o.0[i] })
    }
    /// Natural logarithm of positive, normal numbers.
    #[inline(always)]
    #[must_use]
    pub fn ln(&self) -> Self {
        each!(i, ln(self.0[i]))
    }
}

// Functions of one lane: in a loop over the lanes their intermediate values stay in registers.

/// A polynomial, highest coefficient first.
#[inline(always)]
pub(crate) fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = coefficients[0];
    let mut k = 1;
    while k < N {
        sum = sum.mul_add(x, coefficients[k]);
        k += 1;
    }
    sum
}

/// Sine and cosine of `x` eighths of a turn, for `x` from -1 to 1.
#[inline(always)]
#[must_use]
pub fn sin_cos_eighths(x: f64) -> (f64, f64) {
    sin_cos_near_zero(x * std::f64::consts::FRAC_PI_4)
}

/// Sine and cosine of an angle within an eighth of a turn (power series).
#[inline(always)]
pub(crate) fn sin_cos_near_zero(angle: f64) -> (f64, f64) {
    const SINE: [f64; 8] = [
        -1.0 / 1_307_674_368_000.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
        1.0,
    ];
    const COSINE: [f64; 9] = [
        1.0 / 20_922_789_888_000.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0,
    ];
    let square = angle * angle;
    (angle * polynomial(square, SINE), polynomial(square, COSINE))
}

/// Natural logarithm of a positive, normal number: `2 atanh((m-1)/(m+1)) + e ln 2` with the mantissa m
/// between 1/sqrt 2 and sqrt 2.
#[inline(always)]
#[must_use]
pub fn ln(x: f64) -> f64 {
    const SERIES: [f64; 10] =
        [2.0 / 19.0, 2.0 / 17.0, 2.0 / 15.0, 2.0 / 13.0, 2.0 / 11.0, 2.0 / 9.0, 2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0, 2.0];
    // 2^52 + x holds the small integer x in its low bits: a conversion that every width has.
    const MAGIC: f64 = 4_503_599_627_370_496.0;
    // Bits of 1/sqrt 2.
    const START: u64 = 0x3FE6_A09E_667F_3BCD;
    let s = x.to_bits().wrapping_sub(START);
    // Biased by 2048, so that the exponent shifted out is never negative.
    let e = s.wrapping_add(2048 << 52) >> 52;
    let mantissa = f64::from_bits((s & 0x000F_FFFF_FFFF_FFFF).wrapping_add(START));
    let exponent = f64::from_bits(e | MAGIC.to_bits()) - MAGIC - 2048.0;
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    exponent.mul_add(std::f64::consts::LN_2, z * polynomial(z * z, SERIES))
}

/// The exponential of a number that is not above 700; below -700 it is that of -700, which is nothing.
///
/// `2^k e^r` with a whole k and r within half of ln 2 (power series).
#[inline(always)]
#[must_use]
pub fn exp(x: f64) -> f64 {
    const SERIES: [f64; 14] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    // 1.5 2^52 + k holds the whole number k in its low bits, negative ones as well.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    // ln 2 in two parts, the first with so few bits that k times it is exact.
    const HIGH: f64 = 6.931_471_803_691_238e-1;
    const LOW: f64 = 1.908_214_929_270_587_7e-10;
    let x = if x < -700.0 { -700.0 } else { x };
    let held = x.mul_add(std::f64::consts::LOG2_E, MAGIC);
    let whole = held - MAGIC;
    let rest = whole.mul_add(-LOW, whole.mul_add(-HIGH, x));
    let power = held.to_bits().wrapping_sub(MAGIC.to_bits()).wrapping_add(1023) << 52;
    polynomial(rest, SERIES) * f64::from_bits(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elementary_functions_agree_with_the_library() {
        for k in 0..4000 {
            let x = f64::from(k) / 2000.0 - 1.0;
            let (s, c) = sin_cos_eighths(x);
            let angle = x * std::f64::consts::FRAC_PI_4;
            assert!((s - angle.sin()).abs() < 3e-16 && (c - angle.cos()).abs() < 3e-16);
            let y = (f64::from(k) * 0.01 - 38.0).exp();
            let l = Block::splat(y).ln().0[0];
            assert!((l - y.ln()).abs() < 1e-14 * (1.0 + y.ln().abs()), "{y} {l} {}", y.ln());
            let z = 0.35 * (f64::from(k) - 2000.0);
            assert!((exp(z) / z.exp() - 1.0).abs() < 1e-15, "{z}");
        }
    }
}
