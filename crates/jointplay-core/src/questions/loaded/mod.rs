//! Where the load pushes every joint.
//!
//! Without friction a joint's offset lies where its set supports the transmitted wrench. To first order the
//! error is `E = A u` with u those support points; on the exact closure contact and reactions are brought to
//! agree by [`crate::contact`]. Where a reaction vanishes, or two corners of a guide compete, the load
//! does not decide: the offset is put in the middle of the exposed face, and the half-width of the
//! output's error over all exposed faces that move it is given beside it. Of several places at which the load may hold the
//! mechanism the one with the most work is given.

mod elsewhere_on_lanes;
mod first_order_on_lanes;
mod on_lanes;
mod openings_on_lanes;
mod over_constrained;
mod pressing;
mod resting;
mod steps_on_lanes;

use rayon::prelude::*;

use crate::clearance::undecided::Unforced;
use crate::closure::newton::{Solver, State};
use crate::contact::elsewhere::Leads;
use crate::contact::indeterminacy::Left;
use crate::interrupt;
use crate::math::lanes::block::LANES;
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::tasks::in_rooms;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::{FreshRows, Row, Rows, Table};
use crate::mechanism::dim::{Keep, Wanted};
use crate::mechanism::status::Status;
use crate::questions::columns::{FreshLoaded, Loaded, LoadedRows, LoadedTable};
use crate::questions::form::Form;
use crate::questions::loaded::first_order_on_lanes::FirstOrder;
use crate::questions::loaded::on_lanes::Contact;
use crate::questions::loaded::resting::AtRest;

/// Counts configurations that the batch engine handed to the plain solver; of over-constrained mechanisms, cone programs
/// that were solved by themselves.
const FALLBACKS: &str = "fallbacks";
/// Numbers of a force and a moment.
const WRENCH: usize = 6;
/// Configurations that one task solves.
const RUN: usize = 16 * LANES;

/// Poses closer than this, in characteristic lengths and radians, are the same.
const SAME_POSE: f64 = 1e-6;

/// The recorded programs of a question.
enum Programs<'m> {
    /// A handful of configurations is solved without.
    None,
    Exact(Box<Contact<'m>>),
    FirstOrder(Box<FirstOrder<'m>>),
}

impl<'m> Programs<'m> {
    fn record(solver: &Solver<'m>, exact: bool) -> Self {
        if exact {
            Contact::record(solver).map_or(Self::None, |programs| Self::Exact(Box::new(programs)))
        } else {
            FirstOrder::record(solver).map_or(Self::None, |program| Self::FirstOrder(Box::new(program)))
        }
    }
}

/// What the programs of a question work in; made for the first block.
#[derive(Default)]
struct Workspace {
    exact: Option<on_lanes::Workspace>,
    first_order: Option<first_order_on_lanes::Workspace>,
}

/// A run of cases solved block by block into their rows; gives the number of those that were solved plainly.
struct Run<'r, 'm> {
    solver: &'r Solver<'m>,
    programs: &'r Programs<'m>,
    cases: &'r [Case<'r>],
    exact: bool,
    rows: LoadedRows<'r>,
    workspace: &'r mut Workspace,
}

impl<'r> Kernel for Run<'r, '_> {
    /// With the rows.
    type Output = (u64, LoadedRows<'r>);

    #[inline(always)]
    fn run(mut self) -> (u64, LoadedRows<'r>) {
        let m = self.solver.mechanism;
        let mut fallbacks = 0;
        match self.programs {
            Programs::None => {
                for (row, case) in self.cases.iter().enumerate() {
                    self.rows.put(row, &m.loaded_plainly(self.solver, case, self.exact, None));
                }
                fallbacks = self.cases.len() as u64;
            }
            Programs::Exact(contact) => {
                let workspace = self.workspace.exact.get_or_insert_with(|| contact.workspace());
                let mut plainly = |case: &Case<'_>, leads: Option<Leads>| {
                    fallbacks += 1;
                    m.loaded_plainly(self.solver, case, true, leads)
                };
                for (number, block) in self.cases.chunks(LANES).enumerate() {
                    interrupt::check();
                    contact.solve(workspace, block, &mut self.rows, number * LANES, &mut plainly);
                }
            }
            Programs::FirstOrder(program) => {
                let workspace = self.workspace.first_order.get_or_insert_with(|| program.workspace());
                for (number, block) in self.cases.chunks(LANES).enumerate() {
                    interrupt::check();
                    let first = number * LANES;
                    let good = program.solve(workspace, block, &mut self.rows, first);
                    for (i, case) in block.iter().enumerate().filter(|(i, _)| !good[*i]) {
                        fallbacks += 1;
                        self.rows.put(first + i, &m.loaded_plainly(self.solver, case, false, None));
                    }
                }
            }
        }
        (fallbacks, self.rows)
    }
}

impl Mechanism {
    /// Runs an analysis on every case that is assembled, on all cores, with the solver of these cases or one that suits the
    /// case; the others get `missing`.
    pub(crate) fn each<T: Send>(
        &self,
        solver: Option<&Solver<'_>>,
        cases: &[Case<'_>],
        analysis: impl Fn(&Solver<'_>, usize, &Case<'_>, State) -> T + Sync,
        missing: impl Fn() -> T + Sync,
    ) -> Vec<T> {
        let found = cases
            .par_iter()
            .enumerate()
            .map(|(number, case)| {
                let solver = solver.map(|solver| solver.suiting(case.coordinates));
                let state =
                    solver.and_then(|s| self.restore(&s, case.coordinates, case.drives).map(|state| (s, state)));
                let found = || state.map_or_else(&missing, |(s, state)| analysis(&s, number, case, state));
                interrupt::until_stopped(found).map(|found| [found])
            })
            .collect();
        interrupt::before_the_stop(found)
    }

    /// Where the load pushes the output, for every case; if not `exact`, everything is told to first order at the nominal
    /// pose, and the closure is not solved again.
    #[must_use]
    pub fn loaded(&self, cases: &[Case<'_>], exact: bool, keep: Keep) -> Answer {
        match self.form(true) {
            Form::Determinate => self.loaded_determinate(cases, exact, keep),
            Form::OverConstrained => self.loaded_over_constrained(cases, exact, keep),
        }
    }

    /// The same where every case has loads of its own: force and moment of each load of the mechanism, six numbers, one
    /// case after the other.
    #[must_use]
    pub fn loaded_by(&self, cases: &[Case<'_>], wrenches: &[f64], exact: bool, keep: Keep) -> Answer {
        let width = WRENCH * self.loads.len();
        let under = |(k, case): (usize, &Case<'_>)| {
            let own = &wrenches[k * width..(k + 1) * width];
            interrupt::until_stopped(|| [self.under(own).loaded(std::slice::from_ref(case), exact, keep)])
        };
        let found = interrupt::before_the_stop(cases.par_iter().enumerate().map(under).collect());
        Answer::joined(found).unwrap_or_else(|| self.loaded(&[], exact, keep))
    }

    /// The mechanism under other loads in the places of its own.
    fn under(&self, wrenches: &[f64]) -> Self {
        let mut m = self.clone();
        for (load, wrench) in m.loads.iter_mut().zip(wrenches.chunks_exact(WRENCH)) {
            load.force.copy_from_slice(&wrench[..3]);
            load.moment.copy_from_slice(&wrench[3..]);
        }
        m
    }

    /// Where the load pushes a specimen with the deviations and sizes that have been drawn for it; `None` where the mechanism
    /// needs compatibility or is not assembled.
    pub(crate) fn loaded_specimen(&self, drawn: &[f64], case: &Case<'_>) -> Option<Loaded> {
        if self.form(true) != Form::Determinate {
            return None;
        }
        let m = self.of_specimen(drawn);
        let solver = m.solver(std::slice::from_ref(case))?;
        Some(m.loaded_plainly(&solver, case, true, None))
    }

    /// The mechanism with the deviations and sizes of a specimen as known ones.
    fn of_specimen(&self, drawn: &[f64]) -> Self {
        let mut m = self.clone();
        for (own, source) in m.sources.iter_mut().zip(&self.sources) {
            if source.is_clearance {
                (own.set, own.gap) = (source.set_at(drawn), None);
            } else {
                m.centre[source.range()].copy_from_slice(&drawn[source.range()]);
            }
        }
        m
    }

    /// In blocks on all cores.
    pub(crate) fn loaded_determinate(&self, cases: &[Case<'_>], exact: bool, keep: Keep) -> Answer {
        let wanted = Wanted { keep, ..Wanted::all(self) };
        let (mut table, by_run) = LoadedTable::filled(&wanted, cases.len(), |rows| {
            let Some(solver) = self.solver(cases) else { return self.put_none_assembled(rows) };
            let programs = if cases.len() >= LANES { Programs::record(&solver, exact) } else { Programs::None };
            let runs = rows.runs(RUN).into_par_iter().zip(cases.par_chunks(RUN));
            let run = |workspace: &mut Workspace, (rows, cases): (FreshLoaded<'_>, _)| {
                interrupt::until_stopped(|| {
                    let rows = rows.begin();
                    [dispatch(Run { solver: &solver, programs: &programs, cases, exact, rows, workspace }).0]
                })
            };
            interrupt::before_the_stop(in_rooms(runs, Workspace::default, run).collect())
        });
        table.keep_first(RUN * by_run.len());
        Answer::of(table, &wanted).total(FALLBACKS, by_run.into_iter().sum())
    }

    /// Gives the number of rows that were left to the plain solver by run: each a run of its own, none left.
    fn put_none_assembled(&self, rows: FreshLoaded<'_>) -> Vec<u64> {
        let missing = self.no_load_result(Status::NotAssembled);
        let (n, mut rows) = (rows.n(), rows.begin());
        (0..n).for_each(|row| rows.put(row, &missing));
        vec![0; n]
    }

    fn loaded_plainly(&self, solver: &Solver<'_>, case: &Case<'_>, exact: bool, leads: Option<Leads>) -> Loaded {
        let solver = solver.suiting(case.coordinates);
        self.restore(&solver, case.coordinates, case.drives).map_or_else(
            || self.no_load_result(Status::NotAssembled),
            |nominal| self.loaded_at(&solver, case, &nominal, exact, leads),
        )
    }

    pub(crate) fn no_load_result(&self, status: Status) -> Loaded {
        Loaded { status, ..Loaded::unknown(&Wanted::all(self)) }
    }

    #[allow(clippy::too_many_lines)] // the way from the nominal pose to the displaced one, in order
    fn loaded_at(
        &self,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        exact: bool,
        leads: Option<Leads>,
    ) -> Loaded {
        let size = self.size();
        let Some((at_nominal, flanks, gradient)) = self.at_flanks(solver, case, nominal) else {
            return self.no_load_result(Status::Singular);
        };
        let status = self.status_of(&at_nominal, nominal);
        // First order, at the nominal pose. Drive values that differ from the nominal ones count too.
        let unforced = self.unforced_of(&gradient);
        // What nothing pushes is in the middle of its clearance.
        let middle = self.in_the_middle(case.drives, |source| source.is_clearance);
        let offsets = self.support_update_loaded(&gradient, &middle, &unforced);
        let map = self.output_sensitivity(&at_nominal, &flanks);
        let mut contribution = vec![0.0; self.sources.len() * size];
        let mut error_first_order = self.drive_shift(&map, case, nominal);
        for i in 0..size {
            for (s, source) in self.sources.iter().enumerate() {
                contribution[s * size + i] =
                    source.range().map(|p| map.parameters[(i, p)] * offsets.parameters[p]).sum();
                error_first_order[i] += contribution[s * size + i];
            }
        }

        // What is undecided at the nominal pose and moves the output is so at any size of the play, even where the exact
        // pose then falls to one side.
        let mut left = Left::nothing(self);
        self.leave_open_at(&gradient, &unforced, [&map, &map], &mut left);
        let sum = |open: &[f64]| (0..size).map(|i| open.iter().skip(i).step_by(size).sum()).collect();
        if !exact {
            return Loaded {
                error: error_first_order.clone(),
                error_first_order,
                undetermined: sum(&left.open),
                undetermined_contribution: left.open,
                decided: left.decided,
                reaction: self.reactions(&at_nominal.poses, &at_nominal.parameters, &gradient.multipliers),
                drive_force: self.drive_forces(&gradient.multipliers),
                offset: offsets.parameters,
                contribution,
                iterations: 0,
                equilibria: 1,
                status: if left.observable && status == Status::Ok { Status::Undetermined } else { status },
            };
        }
        let start = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_load_result(status),
        };
        // Where nothing that moves the output is open, the forces of the displaced pose push what those of the nominal one do
        // not. Where something is, that alone counts until it is known whether the closure decides it.
        let held = if left.observable { unforced.clone() } else { vec![Unforced::default(); self.sources.len()] };
        let rest = solver.settle_first(start, &gradient, &unforced, &held);
        let rest = rest.and_then(|(contact, mut elsewhere)| {
            let mut rest = solver.at_rest(contact, &held, &map, left)?;
            // One after the other, what rests where the work has a minimum leaves it.
            for _ in 0..self.sources.len() {
                let Some(contact) = rest.off_balance(solver, &map) else { break };
                for (p, elsewhere) in elsewhere.iter_mut().enumerate() {
                    // Whichever side it goes to, the other one is a place, too.
                    let [from, to] = [&rest.contact, &contact].map(|at| at.state.inputs.parameters[p]);
                    if (to - from).abs() > 0.0 {
                        *elsewhere = gradient.inputs.parameters[p];
                    }
                }
                rest = solver.at_rest(contact, &rest.held, &map, rest.left)?;
            }
            let on_branch = |state: &State| self.is_on_branch(solver, nominal, state);
            let places = solver.most_work(rest.contact.clone(), &elsewhere, &rest.held, leads, on_branch);
            let seen = places.seen;
            let best =
                if places.is_elsewhere { solver.at_rest(places.best, &rest.held, &map, rest.left)? } else { rest };
            Some((best, seen))
        });
        let Some((AtRest { contact, displaced, mut left, around, .. }, equilibria)) = rest else {
            return self.no_load_result(Status::Singular);
        };
        let error = self.error(&contact.state, nominal);
        let mut reached = true;
        if let Some(rest) = around {
            reached = solver.spread(&rest, nominal, &error, &mut left.open);
        }
        let is_on_branch = self.is_on_branch(solver, nominal, &contact.state);
        Loaded {
            error,
            error_first_order,
            undetermined: sum(&left.open),
            undetermined_contribution: left.open,
            decided: left.decided,
            reaction: self.reactions(&displaced.poses, &displaced.parameters, &contact.gradient.multipliers),
            drive_force: self.drive_forces(&contact.gradient.multipliers),
            offset: contact.state.inputs.parameters,
            contribution,
            iterations: contact.steps as u64,
            equilibria: equilibria as u64,
            status: match status {
                Status::Ok if !is_on_branch => Status::Singular,
                Status::Ok if !reached || contact.blocked && !contact.settled => Status::Singular,
                Status::Ok if left.observable || !contact.settled => Status::Undetermined,
                other => other,
            },
        }
    }

    /// Whether a state is the one that its offsets lead to straight from the nominal pose. The steps to the load's contacts
    /// go round by other offsets: with a singular pose in between they can end on another branch.
    fn is_on_branch(&self, solver: &Solver<'_>, nominal: &State, state: &State) -> bool {
        let Ok(straight) = solver.follow(nominal, &state.inputs) else { return false };
        let width = self.n_body_coordinates();
        straight.coordinates.iter().zip(&state.coordinates).enumerate().all(|(k, (a, b))| {
            let unit = if k % width < self.n_translations() { self.length } else { 1.0 };
            (a - b).abs() <= SAME_POSE * unit
        })
    }
}
