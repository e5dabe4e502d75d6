//! One chunk of samples: drawn, solved and counted block by block.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Bound;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES, Mask};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::vector::norm;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;
use crate::questions::columns::Sample;
use crate::questions::random::control::Control;
use crate::questions::random::parts::Part;
use crate::questions::random::request::Request;
use crate::questions::random::tally::{Ranges, Tally};

/// What all chunks of one configuration share.
pub struct Job<'a> {
    pub solver: &'a Solver<'a>,
    /// The recorded programs at this configuration; without them every sample is solved plainly.
    pub bound: Option<Bound<'a>>,
    pub built: &'a State,
    pub nominal: &'a State,
    pub request: &'a Request,
    pub ranges: &'a Ranges,
    /// First-order errors of which shares are known.
    pub control: &'a Control,
    /// A value near the mean, about which products are summed.
    pub shift: &'a [f64],
}

impl Job<'_> {
    /// Draws and solves a chunk; when stopped, part of it.
    pub fn draw(&self, part: &Part) -> Tally {
        dispatch(Chunk { job: self, part })
    }

    const fn mechanism(&self) -> &Mechanism {
        self.solver.mechanism
    }

    /// One sample by the plain solver; gives its error and status.
    #[inline(never)]
    fn solve_plainly(&self, tally: &mut Tally, parameters: &[Block], lane: usize) -> (Vec<f64>, Status) {
        let m = self.mechanism();
        let inputs = Inputs {
            drives: self.built.inputs.drives.clone(),
            parameters: parameters.iter().map(|b| b.0[lane]).collect(),
        };
        tally.fallbacks += 1;
        let solver = self.solver;
        let solved = solver.close(self.built, &inputs).map_or_else(|| solver.follow(self.built, &inputs), Ok);
        let status = match solved {
            Ok(state) if state.negative == self.built.negative => {
                let error = m.error(&state, self.nominal);
                let (translations, rotations) = error.split_at(m.n_translations());
                let sizes = [norm(translations), norm(rotations)];
                let mut quantities = error.clone();
                quantities.extend(sizes);
                tally.add(self.ranges, self.shift, &quantities, &self.request.limits);
                return (error, Status::Ok);
            }
            Ok(_) => Status::Singular,
            Err(status) => status,
        };
        tally.statuses[status as usize] += 1;
        (vec![f64::NAN; m.size()], status)
    }
}

/// The errors that were solved, component by component, and behind them the sizes of position and rotation.
#[inline(always)]
pub(crate) fn put_quantities(bound: &Bound<'_>, translations: usize, quantities: &mut [Block]) {
    let n = quantities.len() - 2;
    let (mut position, mut rotation) = (Block::splat(0.0), Block::splat(0.0));
    for k in 0..n {
        let error = bound.error(k);
        quantities[k] = *error;
        let size = if k < translations { &mut position } else { &mut rotation };
        *size = error.mul_add(error, size);
    }
    quantities[n] = position.sqrt();
    quantities[n + 1] = rotation.sqrt();
}

struct Chunk<'j, 'a> {
    job: &'j Job<'a>,
    part: &'j Part,
}

impl Kernel for Chunk<'_, '_> {
    type Output = Tally;

    #[inline(always)]
    fn run(self) -> Tally {
        let job = self.job;
        let m = job.mechanism();
        let n = m.size();
        let translations = m.n_translations();
        let mut tally = Tally::new(n, m.sources().len(), job.ranges);
        tally.kept = job.request.keep.then(Vec::new);
        tally.below = vec![0; job.control.len()];
        let mut first_order = job.control.scratch();
        let mut sums = crate::questions::random::tally::Sums::new(n, n + 2);
        let mut numbers = self.part.numbers(job.request);
        let mut bound = job.bound.clone();
        let mut unsolved = vec![Block::splat(0.0); m.n_parameters()];
        let mut quantities = vec![Block::splat(0.0); n + 2];
        let mut left = self.part.count;
        'blocks: while left > 0 && !interrupt::is_asked() {
            let lanes = left.min(LANES);
            left -= lanes;
            let parameters = bound.as_mut().map_or(&mut unsolved[..], Bound::parameters);
            m.draw(&mut numbers, job.request, parameters);
            m.count_interference(parameters, lanes, &mut tally.interference);
            let mut good = Mask::NONE;
            if let Some(bound) = &mut bound {
                good = bound.solve();
                put_quantities(bound, translations, &mut quantities);
            }
            good.limit(lanes);
            let used = good.count();
            let parameters = bound.as_mut().map_or(&unsolved[..], |b| b.parameters());
            for i in if used == lanes as u64 && tally.kept.is_none() { 0..0 } else { 0..lanes } {
                let mut plainly = || job.solve_plainly(&mut tally, parameters, i);
                let plain = if good.has(i) {
                    None
                } else if let Some(solved) = interrupt::until_stopped(&mut plainly) {
                    Some(solved)
                } else {
                    break 'blocks;
                };
                if let Some(kept) = &mut tally.kept {
                    let solved = || (quantities[..n].iter().map(|b| b.0[i]).collect(), Status::Ok);
                    let (kept_errors, kept_status) = plain.unwrap_or_else(solved);
                    let kept_parameters = parameters.iter().map(|b| b.0[i]).collect();
                    kept.push(Sample { kept_parameters, kept_errors, kept_status });
                }
            }
            job.control.count(parameters, lanes, &mut first_order, &mut tally.below);
            tally.compared += lanes as u64;
            sums.add(&quantities, &good, job.shift);
            tally.count_block(job.ranges, &quantities, &good);
            tally.statuses[Status::Ok as usize] += used;
            tally.count_outside(&job.request.limits, &quantities, &good);
        }
        tally.absorb(&sums, job.shift);
        tally
    }
}
