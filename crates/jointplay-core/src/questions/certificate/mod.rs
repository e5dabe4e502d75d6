//! What the worst errors certainly do not exceed: bounds on the exact closure, rounding included.
//!
//! The closure equations run on intervals ([`chart`]). One box holds the poses for all values that the sets allow
//! ([`enclosure`]), which proves that the mechanism can be assembled everywhere in them and stays on its branch; the
//! derivative of the error over boxes ([`errors`]) bounds the error; and what cannot be a maximum is left out of the sets
//! ([`blocks`]) until the bound is close to the value that is attained ([`search`]).
//!
//! The mechanism is the one that the core has: its sizes, sets and drive values as they are rounded in SI units.

mod blocks;
mod chart;
mod directions;
mod enclosure;
mod errors;
mod inverse;
mod linear;
mod modes;
mod search;
mod second;

use std::rc::Rc;

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::interrupt;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::questions::certificate::errors::{Errors, Refused};
use crate::questions::certificate::search::{Search, Sought};
use crate::questions::columns::Certificate;
use crate::questions::form::Form;

/// A bound this close to the value that is attained, as a part of the largest error of its kind, is not made better; nor one
/// this close to it as a part of the characteristic length, or in radians.
const CLOSE: f64 = 1e-5;
const ROUNDING: f64 = 1e-13;

/// Drive values closer than this are the same: those of a nominal pose are read off it.
const SAME_DRIVE: f64 = 1e-12;

/// What has been attained in a configuration, as `worst` has it.
#[derive(Clone, Copy, Debug)]
pub struct Attained<'a> {
    /// The largest displacement.
    pub position: f64,
    /// The largest rotation.
    pub rotation: f64,
    /// Lowest and highest error of every component.
    pub component: &'a [f64],
}

impl Mechanism {
    /// Upper bounds of the worst errors of every case, from what is attained in it; each bound from so many parts of the
    /// sets at most. What it is does not depend on threads or time.
    #[must_use]
    pub fn certificate(&self, cases: &[Case<'_>], attained: &[Attained<'_>], parts: u64) -> Answer {
        let m = self.with_largest_gaps();
        let wanted = Wanted::all(self);
        let refused = |reason| Certificate { reason, ..Certificate::unknown(&wanted) };
        let all = |reason: Refused| cases.iter().map(|_| refused(reason.code())).collect();
        let rows: Vec<Certificate> = if m.form(true) == Form::OverConstrained {
            all(Refused::NotDeterminate)
        } else if let Some(solver) = m.solver(cases) {
            let row = |(case, attained): (&Case<'_>, &Attained<'_>)| {
                interrupt::until_stopped(|| {
                    let found = m.certified(&solver, case, attained, parts);
                    [found.unwrap_or_else(|reason| refused(reason.code()))]
                })
            };
            interrupt::before_the_stop(cases.par_iter().zip(attained).map(row).collect())
        } else {
            all(Refused::NotAssembled)
        };
        Answer::of_rows(rows.iter(), &wanted)
    }

    fn certified(
        &self,
        solver: &Solver<'_>,
        case: &Case<'_>,
        attained: &Attained<'_>,
        parts: u64,
    ) -> Result<Certificate, Refused> {
        let nominal = self.restore(solver, case.coordinates, case.drives).ok_or(Refused::NotAssembled)?;
        let middle = solver.follow(&nominal, &self.in_the_middle(case)).map_err(|_| Refused::NotAssembled)?;
        let (errors, whole) = Errors::new(solver, &nominal_of(case, nominal), &middle)?;
        let (whole, mut looked_at) = (Rc::new(whole), 0);
        let (size, translations) = (self.size(), self.n_translations());
        let mut bound = |sought: Sought, attained: f64, of_its_kind: f64, unit: f64| {
            let enough = attained + CLOSE * of_its_kind + ROUNDING * unit;
            let found = Search { errors: &errors, whole: &whole, sought, enough, budget: parts }.run();
            looked_at += found.parts;
            found.bound
        };
        let mut component = vec![0.0; 2 * size];
        for (k, end) in component.iter_mut().enumerate() {
            let (sign, is_place) = (if k % 2 == 0 { -1.0 } else { 1.0 }, k / 2 < translations);
            let (kind, unit) = if is_place { (attained.position, self.length) } else { (attained.rotation, 1.0) };
            *end = sign * bound(Sought::end(k / 2, sign), sign * attained.component[k], kind, unit);
        }
        let position = bound(Sought::size(0..translations), attained.position, attained.position, self.length);
        let rotation = if self.turns_freely() {
            bound(Sought::size(translations..size), attained.rotation, attained.rotation, 1.0)
        } else {
            component[2 * translations..].iter().fold(0.0, |largest: f64, end| largest.max(end.abs()))
        };
        let bounded = [position, rotation].iter().chain(&component).all(|bound| bound.is_finite());
        let reason = if bounded { 0 } else { Refused::NotBounded.code() };
        Ok(Certificate { position, rotation, component, assembled: true, parts: looked_at, reason })
    }

    /// The inputs with every offset in the middle of its set.
    fn in_the_middle(&self, case: &Case<'_>) -> Inputs<f64> {
        let mut inputs = self.built(case.drives);
        for source in self.sources() {
            let offset = source.set.of_own(&vec![0.0; source.set.size()]);
            inputs.parameters[source.range()].iter_mut().zip(offset).for_each(|(p, offset)| *p += offset);
        }
        inputs
    }
}

/// The nominal state of a case: at its own drive values, where those read off the pose are the same.
fn nominal_of(case: &Case<'_>, mut nominal: State) -> State {
    let pairs = || nominal.inputs.drives.iter().zip(case.drives);
    if pairs().all(|(read, given)| (read - given).abs() <= SAME_DRIVE * (1.0 + given.abs())) {
        nominal.inputs.drives = case.drives.to_vec();
    }
    nominal
}
