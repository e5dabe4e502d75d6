//! The random specimens by themselves, for analyses that solve them in another way.

use rayon::prelude::*;

use crate::clearance::draw::given::Given;
use crate::clearance::draw::numbers::Numbers;
use crate::clearance::draw::points::Points;
use crate::clearance::draw::shapes::Draw;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::mechanism::Mechanism;
use crate::mechanism::scores::Scores;
use crate::questions::random::parts::{Part, parts};
use crate::questions::random::request::Request;

/// Compiled once for every width.
struct Draws<'d> {
    mechanism: &'d Mechanism,
    numbers: &'d mut Numbers,
    request: &'d Request,
    parameters: &'d mut [Block],
}

impl Kernel for Draws<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { mechanism, numbers, request, parameters } = self;
        match numbers {
            Numbers::Plain(stream) => mechanism.draw_by(stream, request, parameters),
            Numbers::Given(given) => mechanism.draw_by(given, request, parameters),
            Numbers::Sobol(points) => {
                points.go_on();
                mechanism.draw_by(points, request, parameters);
            }
        }
    }
}

/// What is found for every part, given the number of its first sample, on all threads; replicate after replicate.
pub(crate) fn in_order<T: Clone + Send>(request: &Request, found: impl Fn(&Part, usize) -> Vec<T> + Sync) -> Vec<T> {
    let mut parts: Vec<Part> = (0..parts(request)).map(|k| Part::of(request, k)).collect();
    parts.sort_by_key(|part| part.replicate);
    let firsts = parts.iter().scan(0, |next, part| Some(std::mem::replace(next, *next + part.count)));
    let parts: Vec<(&Part, usize)> = parts.iter().zip(firsts).collect();
    parts.par_iter().map(|(part, first)| found(part, *first)).collect::<Vec<_>>().concat()
}

impl Mechanism {
    /// Draws the values of all parameters for every lane: those of the sources one by one, an offset of a clearance whose
    /// sizes scatter within the gap of the sizes drawn.
    pub(crate) fn draw(&self, numbers: &mut Numbers, request: &Request, parameters: &mut [Block]) {
        dispatch(Draws { mechanism: self, numbers, request, parameters });
    }

    #[inline(always)]
    fn draw_by(&self, numbers: &mut impl Draw, request: &Request, parameters: &mut [Block]) {
        let mut sized = false;
        for source in self.sources() {
            if source.quantile.is_some() {
                continue;
            }
            let is_sized = source.gap.is_some();
            sized |= is_sized;
            let set = if is_sized { source.set.with_gap(1.0) } else { source.set };
            numbers.draw(&set, Self::law(source, request), &mut parameters[source.range()]);
            // Offsets within a gap get their middle with it.
            for p in source.range().filter(|_| !is_sized) {
                parameters[p] = parameters[p].add(&Block::splat(self.centre[p]));
            }
        }
        for group in &self.scores {
            let scores: Vec<Block> = (0..group.independent()).map(|_| numbers.normal()).collect();
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

    /// Parameter values of random specimens, specimen after specimen: those that [`Mechanism::random`] solves, in the order in which
    /// it keeps them.
    #[must_use]
    pub fn specimens(&self, request: &Request) -> Vec<f64> {
        in_order(request, |part, _| self.specimens_of(request, part))
    }

    fn specimens_of(&self, request: &Request, part: &Part) -> Vec<f64> {
        let mut numbers = part.numbers(request);
        let mut parameters = vec![Block::splat(0.0); self.n_parameters()];
        let mut specimens = Vec::with_capacity(part.count * parameters.len());
        let mut left = part.count;
        while left > 0 {
            interrupt::check();
            let lanes = left.min(LANES);
            left -= lanes;
            self.draw(&mut numbers, request, &mut parameters);
            for lane in 0..lanes {
                specimens.extend(parameters.iter().map(|drawn| drawn.0[lane]));
            }
        }
        specimens
    }

    /// How many independent standard normal scores make a specimen.
    #[must_use]
    pub fn count_scores(&self, law: Option<Law>) -> usize {
        let mut given = Given::default();
        let request = Request { law, ..Request::default() };
        self.draw_by(&mut given, &request, &mut vec![Block::splat(0.0); self.n_parameters()]);
        given.taken()
    }

    /// Parameter values of the specimens of given scores, as many for each as [`Mechanism::count_scores`] says: with independent
    /// normal scores they are random specimens. Where scores are beyond the bounds of normal numbers that are truncated together
    /// the values are NaN.
    #[must_use]
    pub fn specimens_of_scores(&self, scores: &[f64], law: Option<Law>) -> Vec<f64> {
        let width = self.count_scores(law);
        if width == 0 {
            return Vec::new();
        }
        let request = Request { law, ..Request::default() };
        let chunk = |rows: &[f64]| {
            let mut numbers = Numbers::Given(Given::new(rows, width));
            let mut parameters = vec![Block::splat(0.0); self.n_parameters()];
            self.draw(&mut numbers, &request, &mut parameters);
            let mut specimens = Vec::with_capacity(rows.len() / width * parameters.len());
            for lane in 0..rows.len() / width {
                specimens.extend(parameters.iter().map(|drawn| drawn.0[lane]));
            }
            specimens
        };
        scores.par_chunks(LANES * width).map(chunk).collect::<Vec<_>>().concat()
    }

    /// The sources of whose values some are pseudo-random, although Sobol points are asked for.
    #[must_use]
    pub fn pseudo_random(&self, request: &Request) -> Vec<usize> {
        let mut points = Points::new(request.seed, 0, 1, 0, 0);
        points.go_on();
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        let mut found = Vec::new();
        for (s, source) in self.sources().iter().enumerate().filter(|(_, source)| source.quantile.is_none()) {
            points.draw(&source.set.with_gap(1.0), Self::law(source, request), &mut drawn[..source.set.size()]);
            if points.took_rest() {
                found.push(s);
            }
        }
        for group in &self.scores {
            for _ in 0..group.independent() {
                let _ = points.normal();
            }
            if points.took_rest() {
                found.extend(&group.sources);
            }
        }
        found
    }
}
