//! Drawing offsets for a block of samples: one random stream per lane.

use super::lanes::{Block, LANES};
use crate::clearance::{MAX_SIZE, Set};
use crate::spec::Law;

/// Standard deviations between the centre and the boundary of a normal law.
pub const SIGMAS: f64 = 3.0;

/// One xoshiro256++ generator per lane (Blackman and Vigna, ACM Trans. Math. Softw. 47, 2021, 36).
#[derive(Clone)]
pub struct Stream {
    state: [[u64; LANES]; 4],
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
        Self { state }
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
    fn unit(&mut self) -> Block {
        let bits = self.bits();
        let mut out = [0.0; LANES];
        let mut i = 0;
        while i < LANES {
            out[i] = f64::from_bits((bits[i] >> 12) | 0x3FF0_0000_0000_0000) - 1.0;
            i += 1;
        }
        Block(out)
    }

    /// Uniform from -1 to 1.
    #[inline(always)]
    fn symmetric(&mut self) -> Block {
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
        Block(out)
    }

    /// A point of the unit circle: an angle within an eighth of a turn, then one of four quarters.
    #[inline(always)]
    fn circle(&mut self) -> [Block; 2] {
        let bits = self.bits();
        let mut eighths = [0.0; LANES];
        let mut i = 0;
        while i < LANES {
            // The high 52 bits give the angle, the low ones the quarter.
            eighths[i] = f64::from_bits((bits[i] >> 12) | 0x4000_0000_0000_0000) - 3.0;
            i += 1;
        }
        let (s, c) = Block(eighths).sin_cos_eighths();
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        let mut i = 0;
        while i < LANES {
            let swap = (bits[i] & 1).wrapping_neg();
            let flip = (bits[i] & 2) << 62;
            let (sb, cb) = (s.0[i].to_bits(), c.0[i].to_bits());
            // Quarters: (c, s), (-s, c), (-c, -s), (s, -c).
            x[i] = f64::from_bits((((sb ^ (1 << 63)) & swap) | (cb & !swap)) ^ flip);
            y[i] = f64::from_bits(((cb & swap) | (sb & !swap)) ^ flip);
            i += 1;
        }
        [Block(x), Block(y)]
    }

    /// Two independent standard normal numbers (Box and Muller).
    #[inline(always)]
    fn normals(&mut self) -> [Block; 2] {
        // 1 - u is never zero.
        let log = Block::splat(1.0).sub(&self.unit()).ln();
        let radius = log.mul(&Block::splat(-2.0)).sqrt();
        let [x, y] = self.circle();
        [x.mul(&radius), y.mul(&radius)]
    }

    /// Two independent centred normal numbers truncated to -1 and 1. Lanes that fall outside are drawn
    /// again; more than 96 of 100 draws stay inside for the two widths in use.
    #[inline(always)]
    fn truncated(&mut self, sigma: f64) -> [Block; 2] {
        // No closures: they would be compiled apart, without the vector registers of the caller.
        let sigma = Block::splat(sigma);
        let [a, b] = self.normals();
        let mut drawn = [a.mul(&sigma), b.mul(&sigma)];
        loop {
            let mut outside = 0;
            for k in 0..2 {
                for i in 0..LANES {
                    outside |= u64::from(drawn[k].0[i].abs() > 1.0);
                }
            }
            if outside == 0 {
                return drawn;
            }
            let [a, b] = self.normals();
            let fresh = [a.mul(&sigma), b.mul(&sigma)];
            for k in 0..2 {
                for i in 0..LANES {
                    if drawn[k].0[i].abs() > 1.0 {
                        drawn[k].0[i] = fresh[k].0[i];
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn disc(&mut self, law: Law) -> [Block; 2] {
        let radius = match law {
            Law::Gauss => {
                let [x, y] = self.normals();
                return [x.mul(&Block::splat(1.0 / SIGMAS)), y.mul(&Block::splat(1.0 / SIGMAS))];
            }
            Law::Boundary => return self.circle(),
            Law::Uniform => self.unit().sqrt(),
            Law::Normal => {
                // Rayleigh radius truncated at the boundary, by its inverse distribution.
                let k = 0.5 * SIGMAS * SIGMAS;
                let inside = self.unit().mul_add(&Block::splat((-k).exp_m1()), &Block::splat(1.0));
                inside.ln().mul(&Block::splat(-2.0 / (SIGMAS * SIGMAS))).sqrt()
            }
        };
        let [x, y] = self.circle();
        [x.mul(&radius), y.mul(&radius)]
    }

    /// The diamond `|a| + |b| <= 1` is the square `|p|, |q| <= 1` turned: `a = (p+q)/2, b = (p-q)/2`.
    #[inline(always)]
    fn diamond(&mut self, law: Law) -> [Block; 2] {
        let [p, q] = match law {
            Law::Gauss => return self.normals().map(|n| n.mul(&Block::splat(1.0 / SIGMAS))),
            Law::Uniform => [self.symmetric(), self.symmetric()],
            Law::Normal => self.truncated(std::f64::consts::SQRT_2 / SIGMAS),
            Law::Boundary => {
                let (side, along, which) = (self.sign(), self.symmetric(), self.sign());
                let (mut p, mut q) = (side, along);
                for i in 0..LANES {
                    if which.0[i] > 0.0 {
                        (p.0[i], q.0[i]) = (along.0[i], side.0[i]);
                    }
                }
                [p, q]
            }
        };
        let half = Block::splat(0.5);
        [p.add(&q).mul(&half), p.sub(&q).mul(&half)]
    }

    #[inline(always)]
    fn interval(&mut self, law: Law) -> Block {
        match law {
            Law::Uniform => self.symmetric(),
            Law::Boundary => self.sign(),
            Law::Normal => self.truncated(1.0 / SIGMAS)[0],
            Law::Gauss => self.normals()[0].mul(&Block::splat(1.0 / SIGMAS)),
        }
    }

    /// Draws an offset of a set for every lane.
    // Inlined into callers that are compiled for a given width of vector registers.
    #[inline(always)]
    pub fn draw(&mut self, set: &Set, law: Law) -> [Block; MAX_SIZE] {
        let zero = Block::splat(0.0);
        match *set {
            Set::Disc { radius } => self.disc(law).map(|b| b.mul(&Block::splat(radius))),
            Set::Diamond { gap, half_length } => {
                let [a, b] = self.diamond(law);
                [a.mul(&Block::splat(gap)), b.mul(&Block::splat(gap / half_length))]
            }
            Set::Interval { low, high } => {
                let half = Block::splat(0.5 * (high - low));
                [self.interval(law).mul_add(&half, &Block::splat(0.5 * (low + high))), zero]
            }
        }
    }
}
