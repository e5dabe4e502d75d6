//! The parts in which samples are drawn, each with numbers of its own.
//!
//! Plain samples are one replicate. Sobol points are several, each with a scramble of its own, so that they are independent of one
//! another and what they differ by is an honest measure of what their mean misses.

use rayon::prelude::*;

use crate::clearance::draw::numbers::Numbers;
use crate::clearance::draw::points::Points;
use crate::clearance::draw::stream::Stream;
use crate::interrupt;
use crate::math::lanes::block::LANES;
use crate::questions::random::request::{Request, Sampling};

/// Samples per part.
pub(crate) const CHUNK: usize = 8192;
/// Parts in memory at once.
const BLOCK: usize = 64;
/// Independent sets of Sobol points.
pub(crate) const REPLICATES: usize = 16;

/// Samples that are drawn in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub replicate: u64,
    /// Among all parts.
    pub number: u64,
    /// Samples.
    pub count: usize,
    /// Samples of the replicate, and those before the part.
    of: usize,
    before: usize,
}

impl Request {
    /// Independent sets of samples.
    pub(crate) fn replicates(&self) -> usize {
        match self.sampling {
            Sampling::Plain => 1,
            Sampling::Sobol => REPLICATES.min(self.samples).max(1),
        }
    }
}

/// Number of parts; some may be empty.
pub(crate) fn parts(request: &Request) -> usize {
    let replicates = request.replicates();
    request.samples.div_ceil(replicates).div_ceil(CHUNK) * replicates
}

impl Part {
    /// A part by its number: the first of every replicate, then the second of every replicate, and so on.
    pub(crate) fn of(request: &Request, number: usize) -> Self {
        let replicates = request.replicates();
        let (replicate, before) = (number % replicates, number / replicates * CHUNK);
        let of = request.samples / replicates + usize::from(replicate < request.samples % replicates);
        let count = of.saturating_sub(before).min(CHUNK);
        Self { replicate: replicate as u64, number: number as u64, count, of, before }
    }

    /// Its numbers.
    pub(crate) fn numbers(&self, request: &Request) -> Numbers {
        let Self { replicate, number, of, before, .. } = *self;
        match request.sampling {
            Sampling::Plain => Numbers::Plain(Stream::new(request.seed, number)),
            Sampling::Sobol => {
                let (points, block) = (of.max(1) as u64, (before / LANES) as u64);
                Numbers::Sobol(Points::new(request.seed, replicate, points, block, number))
            }
        }
    }
}

/// Draws all parts on all threads and hands them over in their order, with the replicate of each; when stopped, those until then.
pub(crate) fn each_part<T: Send>(request: &Request, draw: impl Fn(&Part) -> T + Sync, mut add: impl FnMut(usize, &T)) {
    let all = parts(request);
    for first in (0..all).step_by(BLOCK) {
        let parts: Vec<Part> = (first..all.min(first + BLOCK)).map(|k| Part::of(request, k)).collect();
        let drawn: Vec<T> = parts.par_iter().map(&draw).collect();
        parts.iter().zip(&drawn).for_each(|(part, drawn)| add(part.replicate as usize, drawn));
        // Samples until then are a result, unless there are none.
        if interrupt::is_asked() {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_have_all_samples_once() {
        for samples in [1, 2, 15, 16, 17, 100, 8192, 100_000, 131_072, 131_073, 1_000_003] {
            for sampling in [Sampling::Plain, Sampling::Sobol] {
                let request = Request { samples, sampling, ..Request::default() };
                let all: Vec<Part> = (0..parts(&request)).map(|k| Part::of(&request, k)).collect();
                assert_eq!(all.iter().map(|part| part.count).sum::<usize>(), samples);
                for replicate in 0..request.replicates() as u64 {
                    let mut next = 0;
                    for part in all.iter().filter(|part| part.replicate == replicate && part.count > 0) {
                        assert_eq!(part.before, next);
                        next += part.count;
                    }
                    assert!(next.abs_diff(samples / request.replicates()) <= 1);
                }
            }
        }
    }
}
