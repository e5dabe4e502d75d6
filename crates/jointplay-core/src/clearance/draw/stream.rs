//! Pseudo-random numbers, one stream per lane.

use std::sync::LazyLock;

use crate::clearance::draw::SIGMAS;
use crate::clearance::draw::shapes::{Draw, Drawn};
use crate::clearance::draw::truncated::Truncated;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::block::{Block, LANES, ln, sin_cos_eighths};
use crate::math::sobol::mix;

/// The law that most sets have.
static THREE_SIGMAS: LazyLock<Truncated> = LazyLock::new(|| Truncated::new(1.0 / SIGMAS));

/// One xoshiro256++ generator per lane (Blackman and Vigna, ACM Trans. Math. Softw. 47, 2021, 36).
#[derive(Clone)]
pub struct Stream {
    state: [[u64; LANES]; 4],
    /// Normal numbers come in pairs; the second of one waits here.
    spare: Option<Block>,
    truncated: Truncated,
}

impl Stream {
    /// The streams of one chunk of samples. Every configuration gets the same numbers, so that what
    /// differs between configurations is not noise.
    #[must_use]
    pub fn new(seed: u64, chunk: u64) -> Self {
        let mut word = mix(mix(seed) ^ chunk);
        let mut state = [[0; LANES]; 4];
        for lane in 0..LANES {
            for part in &mut state {
                word = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
                part[lane] = mix(word);
            }
        }
        Self { state, spare: None, truncated: *THREE_SIGMAS }
    }

    #[inline(always)]
    pub(super) fn bits(&mut self) -> [u64; LANES] {
        let [s0, s1, s2, s3] = &mut self.state;
        let mut out = [0; LANES];
        let mut i = 0;
        while i < LANES {
            out[i] = s0[i].wrapping_add(s3[i]).rotate_left(23).wrapping_add(s0[i]);
            let t = s1[i] << 17;
            s2[i] ^= s0[i];
            s3[i] ^= s1[i];
            s1[i] ^= s2[i];
            s0[i] ^= s3[i];
            s2[i] ^= t;
            s3[i] = s3[i].rotate_left(45);
            i += 1;
        }
        out
    }

    /// Two independent standard normal numbers (Box and Muller).
    #[inline(always)]
    fn normals(&mut self) -> [Block; 2] {
        let mut radius = self.unit();
        let mut i = 0;
        while i < LANES {
            // 1 - u is never zero.
            radius.0[i] = (ln(1.0 - radius.0[i]) * -2.0).sqrt();
            i += 1;
        }
        let [x, y] = self.circle();
        [x.mul(&radius), y.mul(&radius)]
    }
}

impl Draw for Stream {
    #[inline(always)]
    fn unit(&mut self) -> Block {
        units(&self.bits())
    }

    #[inline(always)]
    fn sign(&mut self) -> Block {
        signs(&self.bits())
    }

    #[inline(always)]
    fn circle(&mut self) -> [Block; 2] {
        let bits = self.bits();
        // The high 52 bits give the angle, the low ones the quarter.
        circle(&bits, 0, 0)
    }

    #[inline(always)]
    fn ring(&mut self) -> (Block, [Block; 2]) {
        let u = self.unit();
        (u, self.circle())
    }

    #[inline(always)]
    fn normal(&mut self) -> Block {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let [x, y] = self.normals();
        self.spare = Some(y);
        x
    }

    #[inline(always)]
    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block {
        if law == Law::Gauss {
            return self.normal().mul(&Block::splat(sigma));
        }
        let u = inner(&self.bits());
        self.truncated.with(sigma).numbers(&u)
    }

    #[inline(always)]
    fn largest_of_three(&mut self) -> Block {
        let first = self.unit();
        let largest = first.max(&self.unit());
        largest.max(&self.unit())
    }

    /// Blocks are drawn until enough of their lanes are inside, more than half of them for every set in use.
    #[inline(always)]
    fn scaled_normals(&mut self, count: usize, law: Law, gauge: impl Fn([f64; MAX_SIZE]) -> f64) -> Drawn {
        let mut kept = [Block::splat(0.0); MAX_SIZE];
        let mut filled = 0;
        while filled < LANES {
            let mut drawn = [Block::splat(0.0); MAX_SIZE];
            for number in drawn.iter_mut().take(count) {
                *number = self.normal().mul(&Block::splat(1.0 / SIGMAS));
            }
            for i in 0..LANES {
                let point = drawn.each_ref().map(|b| b.0[i]);
                if filled < LANES && (law == Law::Gauss || gauge(point) <= 1.0) {
                    for (to, value) in kept.iter_mut().zip(point) {
                        to.0[filled] = value;
                    }
                    filled += 1;
                }
            }
        }
        kept
    }
}

/// A point of the unit circle: one of four quarters by two bits from some place on, then an angle within an eighth of a turn
/// by the high 52 of the bits, the first of which are left out.
#[inline(always)]
pub(super) fn circle(bits: &[u64; LANES], quarter: u32, left_out: u32) -> [Block; 2] {
    let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
    let mut i = 0;
    while i < LANES {
        let eighths = f64::from_bits(((bits[i] << left_out) >> 12) | 0x4000_0000_0000_0000) - 3.0;
        let (s, c) = sin_cos_eighths(eighths);
        let which = bits[i] >> quarter;
        let swap = (which & 1).wrapping_neg();
        let flip = (which & 2) << 62;
        let (sb, cb) = (s.to_bits(), c.to_bits());
        // Quarters: (c, s), (-s, c), (-c, -s), (s, -c).
        x[i] = f64::from_bits((((sb ^ (1 << 63)) & swap) | (cb & !swap)) ^ flip);
        y[i] = f64::from_bits(((cb & swap) | (sb & !swap)) ^ flip);
        i += 1;
    }
    [Block::new(x), Block::new(y)]
}

/// Uniform from 0 to 1, 1 excluded, in steps of 2^-52, by the high bits.
#[inline(always)]
pub(super) fn units(bits: &[u64; LANES]) -> Block {
    let mut out = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        out[i] = f64::from_bits((bits[i] >> 12) | 0x3FF0_0000_0000_0000) - 1.0;
        i += 1;
    }
    Block::new(out)
}

/// The same between two steps, so that neither 0 nor 1 is among them.
#[inline(always)]
pub(super) fn inner(bits: &[u64; LANES]) -> Block {
    units(bits).add(&Block::splat(0.5 * f64::EPSILON))
}

/// -1 or 1, by the highest bit.
#[inline(always)]
pub(super) fn signs(bits: &[u64; LANES]) -> Block {
    let mut out = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        out[i] = f64::from_bits(0x3FF0_0000_0000_0000 | (bits[i] & 0x8000_0000_0000_0000));
        i += 1;
    }
    Block::new(out)
}
