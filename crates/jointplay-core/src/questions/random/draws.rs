//! The random specimens by themselves, for analyses that solve them in another way.

use rayon::prelude::*;

use crate::clearance::draw::Stream;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;
use crate::questions::random::CHUNK;
use crate::questions::random::request::Request;

impl Mechanism {
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
            for source in self.sources() {
                stream.draw(&source.set, Self::law(source, request), &mut parameters[source.range()]);
            }
            for lane in 0..lanes {
                specimens.extend(parameters.iter().zip(&self.centre).map(|(drawn, centre)| drawn.0[lane] + centre));
            }
        }
        specimens
    }
}
