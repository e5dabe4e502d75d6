//! Laws of scrambled Sobol points: one coordinate of a point for every number, by its quantile function.
//!
//! Normal numbers that are truncated together, in a ball or in tapered squares, are drawn by rejection, which takes as many
//! numbers as it needs: these are pseudo-random, and so are coordinates beyond the table of directions.

use crate::clearance::draw::SIGMAS;
use crate::clearance::draw::shapes::{Draw, Drawn};
use crate::clearance::draw::stream::{Stream, circle, inner, signs, units};
use crate::clearance::draw::truncated::Truncated;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::block::{Block, LANES, sin_cos_eighths};
use crate::math::lanes::normal::score;
use crate::math::sobol::{DIMENSIONS, Dimension, mix};

/// Keeps the pseudo-random numbers apart from those of plain sampling.
const APART: u64 = 0x2545_F491_4F6C_DD1D;

/// The points of one replicate from some block on.
#[derive(Clone)]
pub struct Points {
    scramble: u64,
    /// Points of the replicate.
    of: u64,
    block: u64,
    dimensions: Vec<Dimension>,
    /// The coordinate that is given next.
    next: usize,
    rest: Stream,
    is_rest: bool,
    truncated: Truncated,
}

impl Points {
    /// Those of a replicate of so many points, from a block on; `number` tells streams of pseudo-random numbers apart.
    #[must_use]
    pub fn new(seed: u64, replicate: u64, points: u64, block: u64, number: u64) -> Self {
        Self {
            scramble: mix(mix(seed ^ APART) ^ replicate),
            of: points,
            // The first block is gone to.
            block: block.wrapping_sub(1),
            dimensions: Vec::new(),
            next: 0,
            rest: Stream::new(seed ^ APART, number),
            is_rest: false,
            truncated: Truncated::new(1.0 / SIGMAS),
        }
    }

    /// Goes to the next block.
    #[inline(always)]
    pub fn go_on(&mut self) {
        self.block = self.block.wrapping_add(1);
        self.next = 0;
        for dimension in &mut self.dimensions {
            dimension.go_to(self.block);
        }
    }

    /// Whether a number was pseudo-random since this was asked.
    pub fn took_rest(&mut self) -> bool {
        std::mem::take(&mut self.is_rest)
    }

    /// The digits of the next coordinate.
    #[inline(always)]
    fn bits(&mut self) -> [u64; LANES] {
        let next = self.next;
        self.next += 1;
        if next == self.dimensions.len() && !self.grow() {
            self.next = next;
            return self.rest().bits();
        }
        self.dimensions[next].bits()
    }

    /// A dimension more, as long as the table has one.
    #[cold]
    #[inline(never)]
    fn grow(&mut self) -> bool {
        let next = self.dimensions.len();
        let is_there = next < DIMENSIONS;
        if is_there {
            self.dimensions.push(Dimension::new(next, self.scramble, self.of, self.block));
        }
        is_there
    }

    #[inline(always)]
    fn rest(&mut self) -> &mut Stream {
        self.is_rest = true;
        &mut self.rest
    }
}

/// Scores of uniform numbers.
#[inline(always)]
fn scores(u: &Block) -> Block {
    let mut out = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        out[i] = score(u.0[i]);
        i += 1;
    }
    Block::new(out)
}

impl Draw for Points {
    #[inline(always)]
    fn unit(&mut self) -> Block {
        units(&self.bits())
    }

    #[inline(always)]
    fn sign(&mut self) -> Block {
        signs(&self.bits())
    }

    /// The first two digits give the quarter.
    #[inline(always)]
    fn circle(&mut self) -> [Block; 2] {
        circle(&self.bits(), 62, 2)
    }

    /// The concentric map of the square, which leaves neighbours together (Shirley and Chiu, J. Graph. Tools 2, 1997, no. 3, 45): the
    /// coordinate of larger size is the radius, its quotient with the other one the angle.
    #[inline(always)]
    fn ring(&mut self) -> (Block, [Block; 2]) {
        let (p, q) = (self.symmetric(), self.symmetric());
        let (mut u, mut x, mut y) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut i = 0;
        while i < LANES {
            let is_first = p.0[i].abs() > q.0[i].abs();
            let (radius, other) = if is_first { (p.0[i], q.0[i]) } else { (q.0[i], p.0[i]) };
            // In the middle of the square any direction will do.
            let (s, c) = sin_cos_eighths(other / if radius == 0.0 { 1.0 } else { radius });
            u[i] = radius * radius;
            let sign = 1.0_f64.copysign(radius);
            let (s, c) = (sign * s, sign * c);
            (x[i], y[i]) = if is_first { (c, s) } else { (s, c) };
            i += 1;
        }
        (Block::new(u), [Block::new(x), Block::new(y)])
    }

    #[inline(always)]
    fn normal(&mut self) -> Block {
        scores(&inner(&self.bits()))
    }

    /// Of the probability within the bounds where these truncate, which is within `SIGMAS` standard deviations.
    #[inline(always)]
    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block {
        let u = inner(&self.bits());
        if law == Law::Gauss {
            return scores(&u).mul(&Block::splat(sigma));
        }
        self.truncated.with(sigma).numbers(&u)
    }

    #[inline(always)]
    fn largest_of_three(&mut self) -> Block {
        let mut u = self.unit();
        for lane in &mut u.0 {
            *lane = libm::cbrt(*lane);
        }
        u
    }

    #[inline(always)]
    fn scaled_normals(&mut self, count: usize, law: Law, gauge: impl Fn([f64; MAX_SIZE]) -> f64) -> Drawn {
        if law != Law::Gauss {
            return self.rest().scaled_normals(count, law, gauge);
        }
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        for number in drawn.iter_mut().take(count) {
            *number = self.scaled_normal(law, 1.0 / SIGMAS);
        }
        drawn
    }
}
