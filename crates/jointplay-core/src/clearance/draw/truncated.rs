//! Normal numbers that are truncated at -1 and 1, by their quantile function.

use crate::clearance::draw::SIGMAS;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::normal::{score_within_three, share_below};

/// The law with one standard deviation, which is at least 1 / [`SIGMAS`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Truncated {
    sigma: f64,
    /// The probability that a normal number is beyond 1.
    beyond: f64,
}

impl Truncated {
    pub fn new(sigma: f64) -> Self {
        debug_assert!(sigma * SIGMAS > 1.0 - f64::EPSILON);
        Self { sigma, beyond: share_below(-1.0 / sigma) }
    }

    /// This law, or another one where the standard deviation is another.
    #[inline(always)]
    pub fn with(&mut self, sigma: f64) -> &Self {
        if self.sigma.to_bits() != sigma.to_bits() {
            *self = Self::new(sigma);
        }
        self
    }

    /// The numbers below which these are with given probabilities.
    #[inline(always)]
    pub fn numbers(&self, u: &Block) -> Block {
        let mut drawn = u.mul_add(&Block::splat(1.0 - 2.0 * self.beyond), &Block::splat(self.beyond));
        let mut i = 0;
        while i < LANES {
            drawn.0[i] = (score_within_three(drawn.0[i]) * self.sigma).clamp(-1.0, 1.0);
            i += 1;
        }
        drawn
    }
}
