//! Sobol points, scrambled at random.
//!
//! In the dimension d, digit by digit in base 2 (a number of 64 bits, the first digit highest),
//!
//! ```text
//! x_n = s + L (V n) = s + sum over the binary digits of n of L v_k
//! ```
//!
//! with the direction numbers `v_k` of Joe and Kuo (SIAM J. Sci. Comput. 30, 2008, 2635; `new-joe-kuo-6.21201`), a random lower
//! triangular matrix L and a random shift s. A point by itself is uniform, and what a mean over the points misses has the
//! variance that Owen's scrambling gives it (Matousek, J. Complexity 14, 1998, 527; Owen, ACM Trans. Model. Comput. Simul. 13,
//! 2003, 363). Points of other scrambles are independent of these.

use std::sync::LazyLock;

use crate::math::lanes::block::LANES;

/// Dimensions of the table.
pub const DIMENSIONS: usize = 1024;
/// Digits of a point's number.
const DIGITS: usize = 48;
/// Digits that tell the lanes of a block apart.
const WITHIN: usize = LANES.trailing_zeros() as usize;

/// A line for every dimension but the first, in hexadecimal digits: the coefficients of the primitive polynomial, lowest last, then
/// the numbers `m_k` with which its recurrence starts.
const TABLE: &str = include_str!("directions.txt");

static DIRECTIONS: LazyLock<Vec<[u64; DIGITS]>> = LazyLock::new(|| {
    let first = std::array::from_fn(|k| 1 << (63 - k));
    std::iter::once(first).chain(TABLE.lines().map(directions)).collect()
});

/// The direction numbers of a line of the table.
fn directions(line: &str) -> [u64; DIGITS] {
    let number = |word: &str| u64::from_str_radix(word, 16).expect("the table has hexadecimal numbers");
    let mut words = line.split(' ').map(number);
    let polynomial = words.next().expect("a line has a polynomial");
    let degree = polynomial.ilog2() as usize;
    let mut v = [0; DIGITS];
    for (k, m) in words.enumerate() {
        v[k] = m << (63 - k);
    }
    for k in degree..DIGITS {
        v[k] = v[k - degree] >> degree;
        for back in 1..=degree {
            // The coefficient of x^(degree - back); the last is always one.
            if polynomial >> (degree - back) & 1 == 1 {
                v[k] ^= v[k - back];
            }
        }
    }
    v
}

/// The finaliser of splitmix64: a hash that leaves no pattern of its argument.
#[inline]
pub const fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// One dimension of a scrambled set of points, block by block.
#[derive(Clone)]
pub struct Dimension {
    /// What the lanes add to the block's digits, the shift included.
    lanes: [u64; LANES],
    /// The digits of the block.
    block: u64,
    /// What the step to the next block adds, by how many of its last digits it turns to zero.
    steps: [u64; DIGITS - WITHIN],
}

impl Dimension {
    /// A dimension of the table at a block of so many points; a scramble is a seed.
    #[must_use]
    pub fn new(dimension: usize, scramble: u64, points: u64, block: u64) -> Self {
        // v_k has no more than k + 1 digits, so that no further columns of L are needed.
        let digits = (points.ilog2() as usize + 1).clamp(WITHIN, DIGITS);
        let own = mix(scramble ^ mix(dimension as u64));
        let (mut columns, mut directions) = ([0; DIGITS], [0; DIGITS]);
        for k in 0..digits {
            let one = 1_u64 << (63 - k);
            columns[k] = one | (mix(own.wrapping_add(k as u64)) & (one - 1));
            let mut left = DIRECTIONS[dimension][k];
            while left != 0 {
                let digit = left.leading_zeros();
                directions[k] ^= columns[digit as usize];
                left &= !(1 << (63 - digit));
            }
        }
        let of = |n: u64, directions: &[u64]| {
            directions.iter().enumerate().filter(|(k, _)| n >> k & 1 == 1).fold(0, |x, (_, v)| x ^ v)
        };
        let shift = mix(own.wrapping_add(DIGITS as u64));
        let (within, beyond) = directions.split_at(WITHIN);
        let mut steps = [0; DIGITS - WITHIN];
        let mut sum = 0;
        for (step, v) in steps.iter_mut().zip(beyond) {
            sum ^= v;
            *step = sum;
        }
        Self { lanes: std::array::from_fn(|lane| shift ^ of(lane as u64, within)), block: of(block, beyond), steps }
    }

    /// Goes on to a block from the one before it.
    #[inline(always)]
    pub fn go_to(&mut self, block: u64) {
        self.block ^= self.steps[block.trailing_zeros() as usize];
    }

    /// The digits of every lane.
    #[inline(always)]
    #[must_use]
    pub fn bits(&self) -> [u64; LANES] {
        let mut out = [0; LANES];
        let mut i = 0;
        while i < LANES {
            out[i] = self.lanes[i] ^ self.block;
            i += 1;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(dimension: usize, scramble: u64, blocks: u64) -> Vec<u64> {
        let mut own = Dimension::new(dimension, scramble, blocks * LANES as u64, 0);
        let next = |block: u64| {
            if block > 0 {
                own.go_to(block);
            }
            own.bits()
        };
        (0..blocks).flat_map(next).collect()
    }

    #[test]
    fn every_dimension_puts_one_point_into_every_interval() {
        for dimension in 0..DIMENSIONS {
            let bits = points(dimension, 7, 8);
            for digits in 0..=9 {
                let mut seen: Vec<u64> = bits.iter().take(1 << digits).map(|x| (x >> 1) >> (63 - digits)).collect();
                seen.sort_unstable();
                assert!(seen.iter().copied().eq(0..1 << digits), "{dimension} {digits}");
            }
        }
    }

    /// Property A, which Joe and Kuo's numbers have: the halves of the cube in d dimensions get one of the first 2^d points each.
    #[test]
    fn the_first_points_share_out_the_halves_of_the_cube() {
        for dimensions in 1..=9 {
            let all: Vec<Vec<u64>> = (0..dimensions).map(|d| points(d, 3, 8)).collect();
            let corner = |n: usize| all.iter().fold(0, |corner, x| 2 * corner + (x[n] >> 63));
            let mut corners: Vec<u64> = (0..1 << dimensions).map(corner).collect();
            corners.sort_unstable();
            assert!(corners.iter().copied().eq(0..1 << dimensions));
        }
    }

    #[test]
    fn a_chunk_may_begin_at_any_block() {
        let all = points(5, 11, 40);
        for block in [1, 7, 32, 39] {
            let own = Dimension::new(5, 11, 40 * LANES as u64, block);
            assert_eq!(own.bits()[..], all[block as usize * LANES..][..LANES]);
        }
    }
}
