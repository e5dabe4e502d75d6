//! Scatter from specimen to specimen of over-constrained and elastic mechanisms.
//!
//! Deviations are drawn by their laws. Where the clearances take up the misfit that they cause, offsets scatter
//! by their laws as far as compatibility allows ([`section`]); where they do not, rigid bodies do not go
//! together, and elastic ones go to the pose of least energy. If the load is asked for, it decides every
//! clearance. The pose is exact; first order is the linear map of the nominal pose on the same displacements.

mod chain;
mod chunk;
mod course;
mod dice;
mod directions;
mod lines;
mod opened;
mod ranges;
mod room;
mod scatter;
mod section;
mod specimen;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Newton;
use crate::closure::recorded::self_stress::SelfStress;
use crate::interrupt;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::status::Status;
use crate::questions::columns::{Sample, Scatter, StrainScatter};
use crate::questions::random::control::Control;
use crate::questions::random::estimates::Replicates;
use crate::questions::random::over_constrained::chunk::{Count, Linear};
use crate::questions::random::over_constrained::ranges::Reach;
use crate::questions::random::over_constrained::specimen::Job;
use crate::questions::random::parts::{Part, each_part};
use crate::questions::random::request::Request;
use crate::questions::random::tally::Ranges;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::specimen_batch::{Nominal, Together};
use crate::redundancy::system::System;

/// What is found, and the samples that are kept.
type Found = ((Scatter, StrainScatter), Vec<Sample>);

impl Mechanism {
    /// The clearances that scatter together with others in any case: that compatibility ties to them, or that open flanks
    /// among these.
    #[must_use]
    pub fn tied(&self, cases: &[Case<'_>]) -> Vec<usize> {
        let m = self.with_scattered_gaps();
        let tied = m.each_on_basis(
            cases,
            |system, solver, _, _, nominal| {
                let Some(c) = Compatibility::at(system.basis, solver, &nominal) else { return Vec::new() };
                let (together, _) = system.scattering(&c, solver, &nominal);
                together.into_iter().filter_map(|g| system.elements[g].source).collect()
            },
            |_| Vec::new(),
        );
        (0..self.sources.len()).filter(|s| tied.iter().any(|tied| tied.contains(s))).collect()
    }

    /// Scatter of every case, whatever ties the displacements of its joints or pushes them; when stopped, that of the
    /// specimens until then.
    pub(crate) fn random_over_constrained(&self, cases: &[Case<'_>], request: &Request) -> Vec<Found> {
        self.each_on_basis(
            cases,
            |system, solver, _, case, nominal| {
                self.scatter_specimens(system, solver, case, &nominal, request)
                    .unwrap_or_else(|status| self.no_specimens(request, status))
            },
            |status| self.no_specimens(request, status),
        )
    }

    fn no_specimens(&self, request: &Request, status: Status) -> Found {
        ((self.no_scatter(request, status), StrainScatter::unknown(&self.wanted(request))), Vec::new())
    }

    fn scatter_specimens(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        request: &Request,
    ) -> Result<Found, Status> {
        let at_nominal = Compatibility::at(system.basis, solver, nominal).ok_or(Status::Singular)?;
        let known = Inputs { drives: case.drives.to_vec(), parameters: self.displacements(&self.centre) };
        let built = solver.follow(nominal, &known)?;
        let at_built = Compatibility::at(system.basis, solver, &built).ok_or(Status::Singular)?;
        let right = self.first_order_right(&at_nominal, &vec![0.0; at_nominal.load.len()], case, nominal);
        let nominal = Nominal { state: nominal, compatibility: &at_nominal, right };
        let job = Job::new(system, request, &nominal, (solver, &built), &at_built);
        let linear = Linear::new(&job, case);
        let beside = SelfStress { all: &system.basis.all, redundant: &system.basis.redundant, statics: true };
        let newton = Newton::record_beside(solver, self.largest_angle(), Some(&beside));
        let bound = newton.as_ref().map(|newton| newton.bind(&system.basis.kept, nominal.state, case.drives));
        let together = || Together::new(&job.system, solver, &nominal, &built, bound.clone());
        // The specimen with nothing but known deviations.
        let middle = job.solve(&together(), std::slice::from_ref(&self.centre), u64::MAX).remove(0);
        let shift = middle.error.unwrap_or_else(|| linear.error(&known.parameters));
        let linear = if request.loaded { linear.pressed(middle.parameters) } else { linear };

        let ranges = Reach { system, c: &at_nominal, request }.ranges(&linear.error(&known.parameters));
        let draw = |request: &Request, ranges: &Ranges| {
            let mut replicates = vec![Count::new(self, ranges); request.replicates()];
            let draw = |part: &Part| chunk::draw(&job, &together(), &linear, ranges, &shift, part);
            each_part(request, draw, |replicate, drawn| replicates[replicate].merge(drawn));
            replicates
        };
        let (ranges, replicates) = ranges.until_found(request, self.length, draw, |count| &count.tally);
        let mut count = replicates[0].clone();
        replicates[1..].iter().for_each(|more| count.merge(more));
        let tallies = replicates.into_iter().map(|count| count.tally).collect();
        let control = Control::default();
        let found = Replicates::new(tallies, &ranges, &control);
        if found.total.statuses.iter().all(|n| *n == 0) {
            interrupt::check();
        }
        let scatter = self.table(&count, &found, request, self.nominal_status(nominal.state));
        Ok((scatter, found.total.kept.unwrap_or_default()))
    }

    fn table(
        &self,
        count: &Count,
        found: &Replicates<'_>,
        request: &Request,
        status: Status,
    ) -> (Scatter, StrainScatter) {
        let (n, sources) = (self.size(), self.sources.len());
        let moments = &count.first_order;
        let covariances = |range: std::ops::Range<usize>| range.map(|k| moments.covariance(k));
        // Every part varies with the component that it is a part of.
        let parts = |range: std::ops::Range<usize>| moments.with_leading(range).collect();
        let first = n + sources * n;
        let quantiles = |sketch: &crate::math::stats::sketch::Sketch| -> Vec<f64> {
            request.probabilities.iter().map(|&p| sketch.quantile(p)).collect()
        };
        let first_order = Scatter {
            mean_first_order: moments.mean()[..n].to_vec(),
            covariance_first_order: covariances(0..n).flatten().collect(),
            contribution: parts(n..first),
            status,
            ..Scatter::unknown(&self.wanted(request))
        };
        let exact = found.scatter(request, first_order);
        let or_nan = |values: Vec<f64>| if found.total.count > 0 { values } else { vec![f64::NAN; values.len()] };
        (
            Scatter { mean: or_nan(exact.mean), largest: or_nan(exact.largest), ..exact },
            StrainScatter {
                clearance_factor: quantiles(&count.factor),
                force: {
                    let by_row: Vec<Vec<f64>> = count.forces.iter().map(quantiles).collect();
                    (0..request.probabilities.len()).flat_map(|p| by_row.iter().map(move |row| row[p])).collect()
                },
                contribution_elastic: parts(first..first + self.n_joints() * n),
            },
        )
    }
}
