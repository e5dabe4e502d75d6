//! Drawing offsets for a block of samples: one random stream per lane.

mod shapes;

use crate::clearance::law::Law;
use crate::math::lanes::block::{Block, LANES, ln, sin_cos_eighths};

/// Standard deviations between the centre and the boundary of a normal law.
pub const SIGMAS: f64 = 3.0;

/// One xoshiro256++ generator per lane (Blackman and Vigna, ACM Trans. Math. Softw. 47, 2021, 36).
#[derive(Clone)]
pub struct Stream {
    state: [[u64; LANES]; 4],
    /// Normal numbers come in pairs; the second of one waits here.
    spare: Option<Block>,
}

/// The finaliser of splitmix64: a hash that leaves no pattern of its argument.
const fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
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
        Self { state, spare: None }
    }

    #[inline(always)]
    fn bits(&mut self) -> [u64; LANES] {
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

    /// Uniform from 0 to 1, 1 excluded, in steps of 2^-52.
    #[inline(always)]
    pub(crate) fn unit(&mut self) -> Block {
        let bits = self.bits();
        let mut out = [0.0; LANES];
        let mut i = 0;
        while i < LANES {
            out[i] = f64::from_bits((bits[i] >> 12) | 0x3FF0_0000_0000_0000) - 1.0;
            i += 1;
        }
        Block::new(out)
    }

    /// Uniform from -1 to 1.
    #[inline(always)]
    pub(crate) fn symmetric(&mut self) -> Block {
        self.unit().mul_add(&Block::splat(2.0), &Block::splat(-1.0))
    }

    /// -1 or 1.
    #[inline(always)]
    fn sign(&mut self) -> Block {
        let bits = self.bits();
        let mut out = [0.0; LANES];
        let mut i = 0;
        while i < LANES {
            out[i] = f64::from_bits(0x3FF0_0000_0000_0000 | (bits[i] & 0x8000_0000_0000_0000));
            i += 1;
        }
        Block::new(out)
    }

    /// A point of the unit circle: an angle within an eighth of a turn, then one of four quarters.
    #[inline(always)]
    fn circle(&mut self) -> [Block; 2] {
        let bits = self.bits();
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        let mut i = 0;
        while i < LANES {
            // The high 52 bits give the angle, the low ones the quarter.
            let eighths = f64::from_bits((bits[i] >> 12) | 0x4000_0000_0000_0000) - 3.0;
            let (s, c) = sin_cos_eighths(eighths);
            let swap = (bits[i] & 1).wrapping_neg();
            let flip = (bits[i] & 2) << 62;
            let (sb, cb) = (s.to_bits(), c.to_bits());
            // Quarters: (c, s), (-s, c), (-c, -s), (s, -c).
            x[i] = f64::from_bits((((sb ^ (1 << 63)) & swap) | (cb & !swap)) ^ flip);
            y[i] = f64::from_bits(((cb & swap) | (sb & !swap)) ^ flip);
            i += 1;
        }
        [Block::new(x), Block::new(y)]
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

    /// A standard normal number.
    #[inline(always)]
    pub(crate) fn normal(&mut self) -> Block {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let [x, y] = self.normals();
        self.spare = Some(y);
        x
    }

    /// A centred normal number. The law that truncates draws lanes outside -1 to 1 again; more than 96 of
    /// 100 draws stay inside for the two widths in use.
    #[inline(always)]
    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block {
        let mut drawn = Block::splat(f64::INFINITY);
        loop {
            let fresh = self.normal().mul(&Block::splat(sigma));
            // Masks and a sum of whole numbers: what the compiler turns into vectors.
            let mut outside = 0_u64;
            let mut i = 0;
            while i < LANES {
                let again = u64::from(drawn.0[i].abs() > 1.0).wrapping_neg();
                let chosen = (fresh.0[i].to_bits() & again) | (drawn.0[i].to_bits() & !again);
                drawn.0[i] = f64::from_bits(chosen);
                outside += u64::from(drawn.0[i].abs() > 1.0);
                i += 1;
            }
            if outside == 0 || law == Law::Gauss {
                return drawn;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::Set;
    use crate::clearance::samples::KINDS;
    use crate::math::lanes::simd::{Kernel, Width, dispatch, limit};

    struct Draws(Set, Law);

    impl Kernel for Draws {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run(self) -> Vec<u64> {
            let mut stream = Stream::new(3, 1);
            let mut drawn = vec![Block::splat(0.0); self.0.size()];
            let mut bits = Vec::new();
            for _ in 0..10 {
                stream.draw(&self.0, self.1, &mut drawn);
                bits.extend(drawn.iter().flat_map(|block| block.0.map(f64::to_bits)));
            }
            bits
        }
    }

    #[test]
    fn draws_are_the_same_on_every_width() {
        for set in KINDS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
                let [plain, avx2, avx512] = [Width::Plain, Width::Avx2, Width::Avx512].map(|width| {
                    limit(width);
                    dispatch(Draws(set, law))
                });
                assert!(plain == avx2 && plain == avx512, "{set:?} {law:?}");
            }
        }
    }
}
