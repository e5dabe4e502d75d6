//! The random specimens by themselves, for analyses that solve them in another way.

use rayon::prelude::*;

use crate::clearance::draw::Stream;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;
use crate::mechanism::scores::Scores;
use crate::questions::random::CHUNK;
use crate::questions::random::request::Request;

impl Mechanism {
    /// Draws the values of all parameters for every lane: those of the sources one by one, an offset of a clearance whose
    /// sizes scatter within the gap of the sizes drawn.
    // Inlined into callers that are compiled for a given width of vector registers.
    #[inline(always)]
    pub(crate) fn draw(&self, stream: &mut Stream, request: &Request, parameters: &mut [Block]) {
        let mut sized = false;
        for source in self.sources() {
            let law = Self::law(source, request);
            if source.quantile.is_some() {
                continue;
            }
            if source.gap.is_some() {
                sized = true;
                stream.draw(&source.set.with_gap(1.0), law, &mut parameters[source.range()]);
                continue;
            }
            stream.draw(&source.set, law, &mut parameters[source.range()]);
            for p in source.range() {
                parameters[p] = parameters[p].add(&Block::splat(self.centre[p]));
            }
        }
        for group in &self.scores {
            let scores: Vec<Block> = (0..group.independent()).map(|_| stream.normal()).collect();
            self.score(group, &scores, parameters);
        }
        if sized {
            self.fill_gaps(parameters);
        }
    }

    /// The values of a group of sources, of independent scores.
    #[inline(never)]
    fn score(&self, group: &Scores, scores: &[Block], parameters: &mut [Block]) {
        for (i, &source) in group.sources.iter().enumerate() {
            let source = &self.sources[source];
            let Some(quantile) = &source.quantile else { continue };
            for lane in 0..LANES {
                let z = group.score(i, |j| scores[j].0[lane]);
                parameters[source.first].0[lane] = quantile.at(z) + self.centre[source.first];
            }
        }
    }

    /// Makes offsets within the gap 1 ones within the gaps of the sizes drawn.
    #[inline(never)]
    fn fill_gaps(&self, parameters: &mut [Block]) {
        for source in self.sources() {
            let Some(gap) = &source.gap else { continue };
            for lane in 0..LANES {
                let size = gap.with_interference(|p| parameters[p].0[lane]).max(0.0);
                for (k, p) in source.range().enumerate() {
                    let part = if source.set.follows_gap(k) { size } else { 1.0 };
                    parameters[p].0[lane] = part * parameters[p].0[lane] + self.centre[p];
                }
            }
        }
    }

    /// Counts for every source the specimens whose sizes leave an interference instead of a gap.
    pub(crate) fn count_interference(&self, parameters: &[Block], lanes: usize, counts: &mut [u64]) {
        for (source, count) in self.sources().iter().zip(counts) {
            if let Some(gap) = &source.gap {
                let pressed = |lane: &usize| gap.with_interference(|p| parameters[p].0[*lane]) < 0.0;
                *count += (0..lanes).filter(pressed).count() as u64;
            }
        }
    }

    /// Parameter values of random specimens, specimen after specimen: those that [`Mechanism::random`] solves.
    #[must_use]
    pub fn specimens(&self, request: &Request) -> Vec<f64> {
        let chunks = request.samples.div_ceil(CHUNK);
        let drawn: Vec<Vec<f64>> = (0..chunks)
            .into_par_iter()
            .map(|chunk| self.specimens_of(request, chunk as u64, CHUNK.min(request.samples - chunk * CHUNK)))
            .collect();
        drawn.concat()
    }

    fn specimens_of(&self, request: &Request, chunk: u64, count: usize) -> Vec<f64> {
        let mut stream = Stream::new(request.seed, chunk);
        let mut parameters = vec![Block::splat(0.0); self.n_parameters()];
        let mut specimens = Vec::with_capacity(count * parameters.len());
        let mut left = count;
        while left > 0 {
            interrupt::check();
            let lanes = left.min(LANES);
            left -= lanes;
            self.draw(&mut stream, request, &mut parameters);
            for lane in 0..lanes {
                specimens.extend(parameters.iter().map(|drawn| drawn.0[lane]));
            }
        }
        specimens
    }
}
