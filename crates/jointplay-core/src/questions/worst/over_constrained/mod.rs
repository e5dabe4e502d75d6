//! The worst that the error of an over-constrained mechanism can ever be.
//!
//! Offsets of all sources count that are compatible with each other. To first order the reach along a
//! direction is the value of a cone program, and the largest error the largest reach over all directions
//! ([`crate::questions::worst::first_order`] tells how much a mesh of them can miss). On the exact closure every
//! extreme is a sequence of such programs, along the gradient of what is measured, from the first-order optima. Specimens
//! that have to be strained are searched besides ([`strained`]).

mod bound;
mod deviations;
mod linear;
mod model;
mod search;
mod strained;
mod summit;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::cone::Kind;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Source};
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::over_constrained::deviations::Deviations;
use crate::questions::worst::over_constrained::linear::{Extreme, Site};
use crate::questions::worst::over_constrained::strained::{Elastic, Found};
use crate::questions::worst::over_constrained::summit::value;
use crate::questions::worst::worker::Height;
use crate::questions::worst::{Reported, Summits, is_higher};
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::system::{Element, System};

/// Of this many starts of `worst` one is made: a sequence of programs sees all offsets at once, where an ascent
/// looks along one slope.
const STARTS_PER_CLIMB: usize = 6;
/// How often extremes start from each other at the most.
const EXCHANGES: usize = 3;

impl Mechanism {
    /// The extremes of every case of an over-constrained mechanism, whatever the load: over all specimens that can be
    /// assembled without force, which deforms nothing, and over those that have to be strained. Fewer sequences of
    /// programs than `starts` are begun, for each of them sees all offsets at once; none where all is to first order.
    pub(crate) fn summits_over_constrained(
        &self,
        cases: &[Case<'_>],
        measures: &[Measure],
        starts: usize,
    ) -> Vec<Result<Summits, Status>> {
        let climbs = starts.div_ceil(STARTS_PER_CLIMB);
        self.each_on_basis(
            cases,
            |system, solver, _, case, nominal| self.summits_at(system, solver, case, &nominal, measures, climbs),
            Err,
        )
    }

    fn summits_at(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        measures: &[Measure],
        climbs: usize,
    ) -> Result<Summits, Status> {
        let rigid = self.rigid_extremes(system, solver, case, nominal, measures, climbs)?;
        let strained = if self.elastic.is_empty() {
            None
        } else {
            let deviations = Deviations::of(self);
            let elastic = Elastic { mechanism: self, system: system.clone(), deviations, solver, case, nominal };
            elastic.extremes(measures, climbs)
        };
        let is_strained = strained.is_some();
        let (rigid, reached) = rigid.map_or((None, true), |(told, reached)| (Some(told), reached));
        let extremes = match (rigid, strained) {
            (None, None) => return Err(Status::NotAssemblable),
            (Some(rigid), None) => rigid,
            (None, Some(found)) => {
                found.into_iter().zip(measures).map(|(f, &m)| self.strained_reported(f, m)).collect()
            }
            (Some(rigid), Some(found)) => {
                let found = found.into_iter().zip(measures).map(|(f, &m)| self.strained_reported(f, m));
                rigid.into_iter().zip(found).map(|(rigid, strained)| farther(rigid, strained)).collect()
            }
        };
        let blocked = !reached || extremes.iter().any(|told: &Reported| told.height.value.is_nan());
        let status = match self.nominal_status(nominal) {
            Status::Ok if blocked => Status::Singular,
            Status::Ok if is_strained => Status::Strained,
            status => status,
        };
        Ok(Summits { extremes, fallbacks: 0, unsettled: 0, status })
    }

    pub(crate) fn no_height(&self) -> Height {
        let nan = |n: usize| vec![f64::NAN; n];
        Height { value: f64::NAN, error: nan(self.size()), parameters: nan(self.n_parameters()) }
    }

    fn strained_reported(&self, found: Option<Found>, measure: Measure) -> Reported {
        let nan = |n: usize| vec![f64::NAN; n];
        let nothing = || Found {
            value: f64::NAN,
            bound: f64::NAN,
            contribution: nan(self.sources.len()),
            elastic: nan(self.n_joints()),
            height: None,
        };
        let Found { value, bound, contribution, elastic, height } = found.unwrap_or_else(nothing);
        let height = height.unwrap_or_else(|| self.no_height());
        Reported { measure, first_order: value, bound, contribution, elastic, height }
    }

    /// The extremes of all specimens that can be assembled without strain, and whether every corner could; `None` where
    /// there are none.
    fn rigid_extremes(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        measures: &[Measure],
        climbs: usize,
    ) -> Result<Option<(Vec<Reported>, bool)>, Status> {
        let elements = self.sources.iter().enumerate().filter(|(_, source)| !source.set.is_zero());
        let element = |(number, source): (usize, &Source)| {
            let columns = source.range().map(|p| self.place_of(p)).collect();
            Element::new(Kind::Fixed(source.set), columns, Some(number))
        };
        let system = System { elements: elements.map(element).collect(), ..system.clone() };
        let compatibility = Compatibility::at(system.basis, solver, nominal).ok_or(Status::Singular)?;
        let known = self.displacements(&self.centre);
        let right = self.first_order_right(&compatibility, &known, case, nominal);
        let site = Site { system: &system, compatibility, right, known, case, nominal };
        let Some(extremes) = site.extremes(measures, climbs) else { return Ok(None) };
        let extremes = extremes.into_iter().map(|extreme| site.at_its_flanks(solver, extreme, climbs));
        let mut extremes = extremes.collect::<Result<Vec<Extreme>, Status>>()?;
        let (summits, reached) = if climbs == 0 {
            (extremes.iter().map(|extreme| Some(site.height(&extreme.linear))).collect(), true)
        } else {
            let built = Inputs { drives: case.drives.to_vec(), parameters: site.known.clone() };
            let built = solver.follow(nominal, &built)?;
            let (mut summits, reached) = site.summits(solver, &built, &extremes);
            let corners = site.corners(2 * climbs).ok_or(Status::NotAssemblable)?;
            for extreme in &mut extremes {
                let undecided = site.undecided(extreme.measure, &extreme.linear).ok_or(Status::NotAssemblable)?;
                extreme.starts = corners.iter().cloned().chain(undecided).collect();
            }
            // Of what is tried besides, what cannot be assembled tells nothing of the extremes.
            let rise = |extremes: &[Extreme], summits: &mut [Option<Height>]| {
                let (found, _) = site.summits(solver, &built, extremes);
                let mut gained = false;
                for (summit, found) in summits.iter_mut().zip(found) {
                    if is_higher(value(found.as_ref()), value(summit.as_ref())) {
                        (*summit, gained) = (found, true);
                    }
                }
                gained
            };
            rise(&extremes, &mut summits);
            for _ in 0..EXCHANGES {
                site.start_from_each_other(&mut extremes, &summits);
                if !rise(&extremes, &mut summits) {
                    break;
                }
            }
            (summits, reached)
        };
        let reported = extremes.into_iter().zip(summits).map(|(extreme, height)| Reported {
            measure: extreme.measure,
            first_order: extreme.linear.value,
            bound: extreme.bound,
            contribution: extreme.linear.contribution,
            elastic: vec![0.0; self.n_joints()],
            height: height.unwrap_or_else(|| self.no_height()),
        });
        Ok(Some((reported.collect(), reached)))
    }
}

/// The farther one of two extremes, to first order and exactly; the bound of the second holds for both.
fn farther(a: Reported, b: Reported) -> Reported {
    let bound = b.bound;
    let is_higher = b.height.value.is_finite() && !(a.height.value >= b.height.value);
    let height = if is_higher { b.height } else { a.height };
    let Reported { measure, first_order, contribution, elastic, .. } = if b.first_order > a.first_order {
        Reported { height: height.clone(), ..b }
    } else {
        Reported { height: height.clone(), ..a }
    };
    Reported { measure, first_order, bound, contribution, elastic, height }
}
