//! Scatter from specimen to specimen: seeded Monte Carlo on the exact closure beside its first order.
//!
//! Samples are drawn in chunks, each with a random stream of its own, and merged in a fixed order:
//! the result does not depend on the number of threads, and memory does not grow with the samples.

mod chunk;
mod draws;
mod over_constrained;
mod request;
mod specimens;
mod tally;

pub use over_constrained::SpecimenScatter;
pub use request::Request;
pub use specimens::SpecimenTable;
pub use tally::BINS;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::clearance::law::Law;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Newton;
use crate::closure::sensitivity::Output;
use crate::interrupt;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Source};
use crate::questions::random::tally::{Kept, Ranges, Tally};

/// Samples per random stream.
pub(crate) const CHUNK: usize = 8192;
/// Chunks in memory at once.
pub(crate) const BLOCK: usize = 64;

/// Scatter of one configuration. Quantities: the components, the size of the position error, the size
/// of the rotation.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Mean of every component.
    pub mean: Vec<f64>,
    /// Covariance of the components, row by row.
    pub covariance: Vec<f64>,
    /// Mean to first order.
    pub mean_first_order: Vec<f64>,
    /// Covariance to first order.
    pub covariance_first_order: Vec<f64>,
    /// First-order variance of every component by source, source by source.
    pub contribution: Vec<f64>,
    /// Quantiles, probability by probability, of every quantity.
    pub quantile: Vec<f64>,
    /// The width within which every quantity's quantiles are known.
    pub quantile_resolution: Vec<f64>,
    /// Histogram of every quantity.
    pub histogram: Vec<u64>,
    /// Edges of its bins.
    pub edges: Vec<f64>,
    /// Share of the solved samples beyond an acceptance limit; NaN without limits.
    pub outside: f64,
    /// Largest size of every quantity met.
    pub largest: Vec<f64>,
    /// Number of samples by status.
    pub failures: [u64; Status::ALL.len()],
    /// Samples that the batch engine handed to the plain solver.
    pub fallbacks: u64,
    /// The samples themselves, if asked for.
    pub kept: Option<Kept>,
    /// Outcome of the nominal configuration.
    pub status: Status,
}

impl Mechanism {
    /// Number of quantities of a scatter.
    #[must_use]
    pub fn n_quantities(&self) -> usize {
        self.size() + 2
    }

    pub(crate) fn law(source: &Source, request: &Request) -> Law {
        if source.is_clearance { request.law.unwrap_or(source.law) } else { source.law }
    }

    /// Scatter of every case; when stopped, that of the samples until then.
    #[must_use]
    pub fn random(&self, cases: &[Case<'_>], request: &Request) -> Vec<Scatter> {
        let solver = self.solver(cases);
        let newton = solver.as_ref().and_then(Newton::record);
        self.each(
            solver.as_ref(),
            cases,
            |solver, _, case, nominal| self.scatter(solver, newton.as_deref(), case, &nominal, request),
            || self.no_scatter(request, Status::NotAssembled),
        )
    }

    pub(crate) fn no_scatter(&self, request: &Request, status: Status) -> Scatter {
        let n = self.size();
        let nan = |n: usize| vec![f64::NAN; n];
        let mut failures = [0; Status::ALL.len()];
        failures[status as usize] = request.samples as u64;
        Scatter {
            mean: nan(n),
            covariance: nan(n * n),
            mean_first_order: nan(n),
            covariance_first_order: nan(n * n),
            contribution: nan(self.sources.len() * n),
            quantile: nan(request.probabilities.len() * self.n_quantities()),
            quantile_resolution: nan(self.n_quantities()),
            histogram: vec![0; self.n_quantities() * BINS],
            edges: nan(self.n_quantities() * (BINS + 1)),
            outside: f64::NAN,
            largest: nan(self.n_quantities()),
            failures,
            fallbacks: 0,
            kept: None,
            status,
        }
    }

    fn scatter(
        &self,
        solver: &Solver<'_>,
        newton: Option<&Newton>,
        case: &Case<'_>,
        nominal: &State,
        request: &Request,
    ) -> Scatter {
        let n = self.size();
        let Some(linearised) = solver.linearise(nominal) else { return self.no_scatter(request, Status::Singular) };
        let map = self.output_sensitivity(&linearised, nominal);
        let built = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_scatter(request, status),
        };
        let mut mean_first_order = self.drive_shift(&map, case, nominal);
        for (i, mean) in mean_first_order.iter_mut().enumerate() {
            *mean += self.centre.iter().enumerate().map(|(p, u)| map.parameters[(i, p)] * u).sum::<f64>();
        }
        let mut covariance = DMatrix::<f64>::zeros(n, n);
        let mut contribution = vec![0.0; self.sources.len() * n];
        for (s, source) in self.sources.iter().enumerate() {
            let (mean, variance) = source.set.moments(Self::law(source, request));
            for (k, p) in source.range().enumerate() {
                let column = map.parameters.column(p);
                covariance += column * column.transpose() * variance[k];
                for i in 0..n {
                    contribution[s * n + i] += column[i] * column[i] * variance[k];
                    mean_first_order[i] += column[i] * mean[k];
                }
            }
        }

        let ranges = self.ranges(&map, &mean_first_order, request);
        let job = crate::questions::random::chunk::Job {
            solver,
            bound: newton.map(|newton| newton.bind(self, nominal, case.drives)),
            built: &built,
            nominal,
            request,
            ranges: &ranges,
            shift: &mean_first_order,
        };
        let mut tally = Tally::new(n, &ranges);
        let chunks = request.samples.div_ceil(CHUNK);
        for block in 0..chunks.div_ceil(BLOCK) {
            let parts: Vec<Tally> = (block * BLOCK..((block + 1) * BLOCK).min(chunks))
                .into_par_iter()
                .map(|chunk| job.draw(chunk as u64, CHUNK.min(request.samples - chunk * CHUNK)))
                .collect();
            for part in &parts {
                tally.merge(part);
            }
            // Samples until then are a result, unless there are none.
            if interrupt::is_asked() {
                break;
            }
        }
        if tally.statuses.iter().all(|n| *n == 0) {
            interrupt::check();
        }
        Scatter {
            mean: tally.mean.clone(),
            covariance: tally.covariance(),
            mean_first_order,
            covariance_first_order: covariance.transpose().as_slice().to_vec(),
            contribution,
            quantile: request.probabilities.iter().flat_map(|&p| tally.quantiles(&ranges, p)).collect(),
            quantile_resolution: ranges.resolution(),
            histogram: tally.histogram(),
            edges: ranges.edges(),
            outside: if request.limit_position.is_nan() && request.limit_rotation.is_nan() {
                f64::NAN
            } else {
                tally.outside as f64 / tally.count as f64
            },
            largest: tally.largest,
            failures: tally.statuses,
            fallbacks: tally.fallbacks,
            kept: tally.kept,
            status: self.status_of(&linearised, nominal),
        }
    }

    /// Ranges of the histograms: the first-order worst case with room to spare.
    fn ranges(&self, map: &Output, mean: &[f64], request: &Request) -> Ranges {
        let n = self.size();
        let mut half = vec![0.0; n];
        for (i, h) in half.iter_mut().enumerate() {
            for source in &self.sources {
                let row: Vec<f64> = source.range().map(|p| map.parameters[(i, p)]).collect();
                let opposite: Vec<f64> = row.iter().map(|r| -r).collect();
                // An untruncated law reaches beyond its set of three standard deviations.
                let reach = if Self::law(source, request) == Law::Gauss { 2.0 } else { 1.0 };
                *h += reach * 0.5 * (source.set.support(&row) + source.set.support(&opposite));
            }
        }
        Ranges::new(mean, &half, self.n_translations())
    }
}
