//! The worst that the error of an over-constrained mechanism can ever be, without straining it.
//!
//! Offsets of all sources count that are compatible with each other. To first order the reach along a
//! direction is the value of a cone program, and the largest error the largest reach over all directions
//! ([`crate::reach`] tells how much a mesh of them can miss). On the exact closure every extreme is a sequence
//! of such programs, along the gradient of what is measured, from the first-order optima.

mod linear;
mod summit;

use crate::batch::Height;
use crate::closure::Inputs;
use crate::cone::Kind;
use crate::extremes::{Told, Worst};
use crate::hyperstatic::compatibility::Compatibility;
use crate::hyperstatic::system::{Give, System};
use crate::loaded::Case;
use crate::mechanism::{Mechanism, Source};
use crate::solver::{Solver, State};
use crate::status::Status;
use linear::Site;

/// Of this many starts of `worst` one is made: a sequence of programs sees all offsets at once, where an ascent
/// looks along one slope.
const STARTS_PER_CLIMB: usize = 6;

impl Mechanism {
    /// The worst errors of every case of an over-constrained mechanism, as far as its offsets go together without
    /// force; what is elastic counts as rigid. Fewer sequences of programs than `starts` are begun, for
    /// each of them sees all offsets at once.
    #[must_use]
    pub fn worst_together(&self, cases: &[Case<'_>], starts: usize) -> Vec<Worst> {
        let climbs = starts.div_ceil(STARTS_PER_CLIMB).max(1);
        self.each_on_basis(
            cases,
            |system, solver, _, case, nominal| match self.worst_at(system, solver, case, &nominal, climbs) {
                Ok(worst) => worst,
                Err(status) => self.no_worst(status),
            },
            |status| self.no_worst(status),
        )
    }

    fn worst_at(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        climbs: usize,
    ) -> Result<Worst, Status> {
        let gives = self.sources.iter().enumerate().filter(|(_, source)| !source.set.is_zero());
        let give = |(number, source): (usize, &Source)| Give {
            kind: Kind::Fixed(source.set),
            columns: source.range().map(|p| self.place_of(p)).collect(),
            source: Some(number),
        };
        let system = System { gives: gives.map(give).collect(), ..system.clone() };
        let compatibility = Compatibility::at(system.basis, solver, nominal).ok_or(Status::Singular)?;
        let known = self.displacements(&self.centre);
        let right = self.first_order_right(&compatibility, &known, case, nominal);
        let site = Site { system: &system, compatibility, right, known, case, nominal };
        let extremes = site.extremes(climbs).ok_or(Status::NotAssemblable)?;
        let built = Inputs { drives: case.drives.to_vec(), parameters: site.known.clone() };
        let built = solver.follow(nominal, &built)?;
        let mut blocked = false;
        let summits = site.summits(solver, &built, &extremes);
        let told = extremes.into_iter().zip(summits).map(|(extreme, height)| Told {
            measure: extreme.measure,
            first_order: extreme.linear.value,
            bound: extreme.bound,
            contribution: extreme.linear.contribution,
            height: height.unwrap_or_else(|| {
                blocked = true;
                let nan = |n: usize| vec![f64::NAN; n];
                Height { value: f64::NAN, error: nan(self.size()), parameters: nan(self.n_parameters()) }
            }),
        });
        let told: Vec<Told> = told.collect();
        let status = match self.nominal_status(nominal) {
            Status::Ok if blocked => Status::Singular,
            status => status,
        };
        Ok(self.in_order(told, status))
    }
}
