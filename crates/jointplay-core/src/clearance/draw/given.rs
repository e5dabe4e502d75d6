//! Laws as functions of independent standard normal scores, so that a specimen can be moved a little: what the search for rare
//! specimens needs.
//!
//! Two scores (x, y) give a direction and, as 1 - exp(-(x^2 + y^2) / 2), a uniform number. Normal numbers that are truncated
//! together are normal numbers under the condition that they are within their bounds: beyond them they are NaN.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::clearance::draw::SIGMAS;
use crate::clearance::draw::shapes::{Draw, Drawn};
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::normal::score_in_middle;

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

    fn take(&mut self) -> Block {
        self.next += 1;
        self.scores.get(self.next - 1).copied().unwrap_or(Block::splat(0.0))
    }
}

fn each(block: &Block, of: impl Fn(f64) -> f64) -> Block {
    Block::new(block.0.map(of))
}

/// The probability that a normal number is below a score.
fn share_below(z: f64) -> f64 {
    (0.5 * libm::erfc(-z * FRAC_1_SQRT_2)).min(BELOW_ONE)
}

impl Draw for Given {
    fn unit(&mut self) -> Block {
        each(&self.take(), share_below)
    }

    fn sign(&mut self) -> Block {
        each(&self.take(), |z| 1.0_f64.copysign(z))
    }

    fn circle(&mut self) -> [Block; 2] {
        self.ring().1
    }

    fn ring(&mut self) -> (Block, [Block; 2]) {
        let (mut x, mut y) = (self.take(), self.take());
        let mut u = Block::splat(0.0);
        for i in 0..LANES {
            let radius = libm::hypot(x.0[i], y.0[i]);
            u.0[i] = (-libm::expm1(-0.5 * radius * radius)).min(BELOW_ONE);
            // In the middle any direction will do.
            (x.0[i], y.0[i]) = if radius == 0.0 { (1.0, 0.0) } else { (x.0[i] / radius, y.0[i] / radius) };
        }
        (u, [x, y])
    }

    fn normal(&mut self) -> Block {
        self.take()
    }

    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block {
        let z = self.take();
        if law == Law::Gauss {
            return z.mul(&Block::splat(sigma));
        }
        let beyond = share_below(-1.0 / sigma);
        let between = |z| score_in_middle((1.0 - 2.0 * beyond) * share_below(z) + beyond);
        each(&z, |z| (between(z) * sigma).clamp(-1.0, 1.0))
    }

    fn largest_of_three(&mut self) -> Block {
        each(&self.unit(), libm::cbrt)
    }

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
