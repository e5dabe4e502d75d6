//! Laws as functions of independent standard normal scores, so that a specimen can be moved a little: what the search for rare
//! specimens needs.
//!
//! Two scores (x, y) give a direction and, as 1 - exp(-(x^2 + y^2) / 2), a uniform number. Normal numbers that are truncated
//! together are normal numbers under the condition that they are within their bounds: beyond them they are NaN.

use crate::clearance::draw::SIGMAS;
use crate::clearance::draw::shapes::{Draw, Drawn};
use crate::clearance::draw::truncated::Truncated;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::block::{Block, LANES, exp};
use crate::math::lanes::normal::share_below;

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// The scores of a block of samples, given one after the other.
#[derive(Clone, Default)]
pub struct Given {
    scores: Vec<Block>,
    next: usize,
}

impl Given {
    /// Of one row of scores per lane.
    #[must_use]
    pub fn new(rows: &[f64], width: usize) -> Self {
        let mut scores = vec![Block::splat(0.0); width];
        for (lane, row) in rows.chunks_exact(width.max(1)).enumerate() {
            for (block, value) in scores.iter_mut().zip(row) {
                block.0[lane] = *value;
            }
        }
        Self { scores, next: 0 }
    }

    /// How many scores were taken.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.next
    }

    #[inline(always)]
    fn take(&mut self) -> Block {
        self.next += 1;
        self.scores.get(self.next - 1).copied().unwrap_or(Block::splat(0.0))
    }
}

// Loops over the lanes, because closures are not compiled for the caller's width.
impl Draw for Given {
    #[inline(always)]
    fn unit(&mut self) -> Block {
        let mut u = self.take();
        for i in 0..LANES {
            u.0[i] = share_below(u.0[i]).min(BELOW_ONE);
        }
        u
    }

    #[inline(always)]
    fn sign(&mut self) -> Block {
        let mut z = self.take();
        for i in 0..LANES {
            z.0[i] = 1.0_f64.copysign(z.0[i]);
        }
        z
    }

    #[inline(always)]
    fn circle(&mut self) -> [Block; 2] {
        self.ring().1
    }

    #[inline(always)]
    fn ring(&mut self) -> (Block, [Block; 2]) {
        let (mut x, mut y) = (self.take(), self.take());
        let mut u = Block::splat(0.0);
        for i in 0..LANES {
            let square = x.0[i].mul_add(x.0[i], y.0[i] * y.0[i]);
            u.0[i] = (1.0 - exp(-0.5 * square)).min(BELOW_ONE);
            let radius = square.sqrt();
            // In the middle any direction will do.
            let is_middle = radius == 0.0;
            x.0[i] = if is_middle { 1.0 } else { x.0[i] / radius };
            y.0[i] = if is_middle { 0.0 } else { y.0[i] / radius };
        }
        (u, [x, y])
    }

    #[inline(always)]
    fn normal(&mut self) -> Block {
        self.take()
    }

    #[inline(always)]
    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block {
        let mut z = self.take();
        if law == Law::Gauss {
            return z.mul(&Block::splat(sigma));
        }
        for i in 0..LANES {
            z.0[i] = share_below(z.0[i]);
        }
        Truncated::new(sigma).numbers(&z)
    }

    fn largest_of_three(&mut self) -> Block {
        let mut u = self.unit();
        u.0.iter_mut().for_each(|u| *u = libm::cbrt(*u));
        u
    }

    #[inline(always)]
    fn scaled_normals(&mut self, count: usize, law: Law, gauge: impl Fn([f64; MAX_SIZE]) -> f64) -> Drawn {
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        for number in drawn.iter_mut().take(count) {
            *number = self.take().mul(&Block::splat(1.0 / SIGMAS));
        }
        for i in 0..LANES {
            if law != Law::Gauss && gauge(drawn.each_ref().map(|block| block.0[i])) > 1.0 {
                for block in &mut drawn {
                    block.0[i] = f64::NAN;
                }
            }
        }
        drawn
    }
}
