//! Scatter from specimen to specimen: seeded Monte Carlo on the exact closure beside its first order.
//!
//! Samples are drawn in parts, each with numbers of its own, and merged in a fixed order:
//! the result does not depend on the number of threads, and memory does not grow with the samples.

mod chunk;
mod control;
mod decided;
mod distribution;
mod draws;
mod estimates;
mod over_constrained;
mod parts;
mod redrawn;
mod request;
mod specimens;
mod tally;

pub use request::{Request, Sampling};

use nalgebra::DMatrix;

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Newton;
use crate::closure::sensitivity::Output;
use crate::interrupt;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Source};
use crate::questions::columns::{Sample, Scatter};
use crate::questions::form::Form;
use crate::questions::random::control::Control;
use crate::questions::random::estimates::Replicates;
use crate::questions::random::parts::each_part;
use crate::questions::random::tally::{Ranges, Tally};

impl Mechanism {
    pub(crate) fn law(source: &Source, request: &Request) -> Law {
        if source.is_clearance { request.law.unwrap_or(source.law) } else { source.law }
    }

    /// How far the offsets of a source go, as a part of its largest set.
    pub(crate) fn reach_of(&self, source: &Source, request: &Request) -> f64 {
        let sizes = source.gap.iter().flat_map(|gap| &gap.sizes).map(|size| &self.sources[size.source]);
        let reach = |source: &Source| match (&source.quantile, source.set) {
            (Some(quantile), Set::Interval { low, high }) => quantile.reach(low, high),
            _ if Self::law(source, request) == Law::Gauss => 2.0,
            _ => 1.0,
        };
        std::iter::once(source).chain(sizes).map(reach).fold(1.0, f64::max)
    }

    /// Scatter of every case; when stopped, that of the samples until then. Specimens under load are settled one by one,
    /// whatever holds them.
    #[must_use]
    pub fn random(&self, cases: &[Case<'_>], request: &Request) -> Answer {
        let m = self.with_scattered_gaps();
        let wanted = self.wanted(request);
        let form = if request.loaded { Form::OverConstrained } else { self.form(false) };
        let (answer, kept): (_, Vec<Sample>) = match form {
            Form::Determinate => {
                let (found, kept): (Vec<_>, Vec<_>) = m.random_determinate(cases, request).into_iter().unzip();
                (Answer::of_rows(found.iter(), &wanted), kept.into_iter().flatten().collect())
            }
            Form::OverConstrained => {
                let (found, kept): (Vec<_>, Vec<_>) = m.random_over_constrained(cases, request).into_iter().unzip();
                (Answer::of_pairs(&found, &wanted), kept.into_iter().flatten().collect())
            }
        };
        if request.keep { answer.beside(Answer::of_rows(kept.iter(), &wanted)) } else { answer }
    }

    fn wanted(&self, request: &Request) -> Wanted<'_> {
        Wanted { probabilities: request.probabilities.len(), ..Wanted::all(self) }
    }

    /// The scatter of every case with the samples that are kept.
    fn random_determinate(&self, cases: &[Case<'_>], request: &Request) -> Vec<(Scatter, Vec<Sample>)> {
        let solver = self.solver(cases);
        // Once for all cases that it suits.
        let _ = solver.as_ref().map(Newton::record);
        self.each(
            solver.as_ref(),
            cases,
            |solver, _, case, nominal| self.scatter(solver, Newton::record(solver).as_deref(), case, &nominal, request),
            || (self.no_scatter(request, Status::NotAssembled), Vec::new()),
        )
    }

    pub(crate) fn no_scatter(&self, request: &Request, status: Status) -> Scatter {
        let mut scatter = Scatter { status, ..Scatter::unknown(&self.wanted(request)) };
        scatter.failures[status as usize] = request.samples as u64;
        scatter
    }

    fn scatter(
        &self,
        solver: &Solver<'_>,
        newton: Option<&Newton>,
        case: &Case<'_>,
        nominal: &State,
        request: &Request,
    ) -> (Scatter, Vec<Sample>) {
        let n = self.size();
        let none = |status| (self.no_scatter(request, status), Vec::new());
        let Some(linearised) = solver.linearise(nominal) else { return none(Status::Singular) };
        let map = self.output_sensitivity(&linearised, nominal);
        let built = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return none(status),
        };
        let drive_shift = self.drive_shift(&map, case, nominal);
        let mut mean_first_order = map.error(&drive_shift, &self.centre);
        let mut covariance = DMatrix::<f64>::zeros(n, n);
        let mut contribution = vec![0.0; self.sources.len() * n];
        for (s, source) in self.sources.iter().enumerate() {
            let (mean, variance) = source.moments(Self::law(source, request));
            for (k, p) in source.range().enumerate() {
                let column = map.parameters.column(p);
                covariance += column * column.transpose() * variance[k];
                for i in 0..n {
                    let part = column[i] * column[i] * variance[k];
                    source.split(s, k, part, |s, part| contribution[s * n + i] += part);
                    mean_first_order[i] += column[i] * mean[k];
                }
            }
        }

        // Of sources that scatter together every part varies with the whole.
        for (a, b, together) in self.covariances() {
            let [first, second] = [a, b].map(|s| map.parameters.column(self.sources[s].first));
            covariance += (first * second.transpose() + second * first.transpose()) * together;
            for i in 0..n {
                let part = first[i] * second[i] * together;
                contribution[a * n + i] += part;
                contribution[b * n + i] += part;
            }
        }

        let ranges = self.ranges(&map, &mean_first_order, request);
        let shift = mean_first_order.clone();
        let control = Control::of(self, &map.parameters, &drive_shift, &covariance, request);
        let bound = newton.map(|newton| newton.bind(self, nominal, case.drives));
        let draw = |request: &Request, ranges: &Ranges| {
            let (bound, built, control, shift) = (bound.clone(), &built, &control, &shift[..]);
            let job = chunk::Job { solver, bound, built, nominal, request, ranges, control, shift };
            let mut replicates = vec![Tally::new(n, self.sources.len(), ranges); request.replicates()];
            each_part(request, |part| job.draw(part), |replicate, drawn| replicates[replicate].merge(drawn));
            replicates
        };
        let (ranges, replicates) = ranges.until_found(request, self.length, draw, |tally| tally);
        let found = Replicates::new(replicates, &ranges, &control);
        let tally = &found.total;
        if tally.statuses.iter().all(|n| *n == 0) {
            interrupt::check();
        }
        let first_order = Scatter {
            mean_first_order,
            covariance_first_order: covariance.transpose().as_slice().to_vec(),
            contribution,
            status: self.status_of(&linearised, nominal),
            ..Scatter::unknown(&self.wanted(request))
        };
        let scatter = found.scatter(request, first_order);
        (scatter, found.total.kept.unwrap_or_default())
    }

    /// Ranges of the histograms: the first-order worst case with room to spare.
    fn ranges(&self, map: &Output, mean: &[f64], request: &Request) -> Ranges {
        let n = self.size();
        let mut half = vec![0.0; n];
        for (i, h) in half.iter_mut().enumerate() {
            for source in &self.sources {
                let row: Vec<f64> = source.range().map(|p| map.parameters[(i, p)]).collect();
                let opposite: Vec<f64> = row.iter().map(|r| -r).collect();
                // A law that is not truncated reaches beyond its set.
                let reach = self.reach_of(source, request);
                let set = source.largest_set();
                *h += reach * 0.5 * (set.support(&row) + set.support(&opposite));
            }
        }
        Ranges::new(mean, &half, self.n_translations())
    }
}
