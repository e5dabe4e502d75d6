//! Where the load pushes every joint.
//!
//! Without friction a joint's offset lies where its set supports the transmitted wrench. To first order the
//! error is `E = A u` with u those support points; on the exact closure contact and reactions are brought to
//! agree by [`crate::contact`]. Where a reaction vanishes, or two corners of a guide compete, the load
//! does not decide: the offset is put in the middle of the exposed face, and the half-width of the
//! output's error over all exposed faces that it feels is given beside it.

// Kernels must be inlined into callers compiled for a width of vector registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::ascent::UNDECIDED;
use crate::batch::lanes::{Block, LANES};
use crate::batch::simd::{Kernel, dispatch};
use crate::batch::{Contact, FirstOrder};
use crate::clearance::{MAX_SIZE, Mute};
use crate::closure::Inputs;
use crate::interrupt;
use crate::mechanism::{Mechanism, Source};
use crate::real::Real;
use crate::sensitivity::{Gradient, Output};
use crate::solver::{Linearised, Solver, State};
use crate::space::{Component, Pose, sub};
use crate::status::Status;
use crate::table::{Keep, Rows, Table};
use crate::trace::{self, CLEAR, trace_runs};

/// What the load leaves undecided is felt by the output when it moves it, to first order, by more than this part
/// of what all play together could.
pub(crate) const UNFELT: f64 = 1e-9;
/// Times that the flanks which carry are looked for.
pub(crate) const FLANKS: usize = 4;
/// Configurations that one task solves.
const RUN: usize = 16 * LANES;

/// The load-determined error of one configuration.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Error on the exact closure, per component.
    pub error: Vec<f64>,
    /// Its linearisation at the nominal pose.
    pub error_first_order: Vec<f64>,
    /// Half-width of what the load does not decide, per component.
    pub undetermined: Vec<f64>,
    /// Share of every source in it, source by source, per component.
    pub open: Vec<f64>,
    /// Whether the load decides where every source is; no load moves what is no clearance.
    pub decided: Vec<bool>,
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    pub reaction: Vec<f64>,
    /// The values of all parameters.
    pub offset: Vec<f64>,
    /// Share of every source in the first-order error, source by source, per component.
    pub contribution: Vec<f64>,
    /// Steps until contact and reactions agreed.
    pub steps: usize,
    /// Outcome.
    pub status: Status,
}

/// One configuration to analyse: drive values, and the nominal coordinates that errors refer to.
#[derive(Clone, Copy, Debug)]
pub struct Case<'a> {
    /// Drive values.
    pub drives: &'a [f64],
    /// Nominal coordinates of all bodies; not finite where the nominal mechanism is not assembled.
    pub coordinates: &'a [f64],
}

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

/// A run of cases solved block by block into their rows; gives the number of those that were solved plainly.
struct Run<'r, 'm> {
    solver: &'r Solver<'m>,
    programs: &'r Programs<'m>,
    cases: &'r [Case<'r>],
    exact: bool,
    rows: Rows<'r>,
    workspace: &'r mut Vec<Block>,
}

impl<'r> Kernel for Run<'r, '_> {
    /// With the rows.
    type Output = (u64, Rows<'r>);

    #[inline(always)]
    fn run(mut self) -> (u64, Rows<'r>) {
        let m = self.solver.mechanism;
        let mut fallbacks = 0;
        match self.programs {
            Programs::None => {
                for (row, case) in self.cases.iter().enumerate() {
                    self.rows.put(row, &m.loaded_plainly(self.solver, case, self.exact));
                }
                fallbacks = self.cases.len() as u64;
            }
            Programs::Exact(contact) => {
                let plainly = |case: &Case<'_>, table: &mut Table| {
                    table.fallbacks += 1;
                    table.push(m.loaded_plainly(self.solver, case, true));
                };
                let (mut workspace, mut table) = (contact.workspace(), Table::default());
                for block in self.cases.chunks(LANES) {
                    interrupt::check();
                    contact.solve(&mut workspace, block, &mut table, plainly);
                }
                self.rows.put_table(&table);
                fallbacks = table.fallbacks;
            }
            Programs::FirstOrder(program) => {
                if self.workspace.is_empty() {
                    *self.workspace = program.workspace();
                }
                for (number, block) in self.cases.chunks(LANES).enumerate() {
                    interrupt::check();
                    let first = number * LANES;
                    let good = program.solve(self.workspace, block, &mut self.rows, first);
                    for (i, case) in block.iter().enumerate().filter(|(i, _)| !good[*i]) {
                        fallbacks += 1;
                        self.rows.put(first + i, &m.loaded_plainly(self.solver, case, false));
                    }
                }
            }
        }
        (fallbacks, self.rows)
    }
}

impl Mechanism {
    /// A solver planned at the first case that is assembled, if any.
    #[must_use]
    pub fn solver(&self, cases: &[Case<'_>]) -> Option<Solver<'_>> {
        let assembled = |case: &&Case<'_>| case.coordinates.iter().all(|c| c.is_finite());
        cases.iter().find(assembled).map(|case| Solver::new(self, case.coordinates))
    }

    /// Runs an analysis on every case that is assembled, on all cores; the others get `missing`.
    pub(crate) fn each<T: Send>(
        &self,
        cases: &[Case<'_>],
        analysis: impl Fn(&Solver<'_>, usize, &Case<'_>, State) -> T + Sync,
        missing: impl Fn() -> T + Sync,
    ) -> Vec<T> {
        let solver = self.solver(cases);
        let found = cases
            .par_iter()
            .enumerate()
            .map(|(number, case)| {
                let state = solver.as_ref().and_then(|s| Some((s, self.restore(s, case.coordinates, case.drives)?)));
                let found = || state.map_or_else(&missing, |(s, state)| analysis(s, number, case, state));
                interrupt::until_stopped(found).map(|found| [found])
            })
            .collect();
        interrupt::before_the_stop(found)
    }

    /// Error of an output against that of nominal coordinates.
    pub(crate) fn error(&self, state: &State, nominal: &State) -> Vec<f64> {
        let place = |s: &State| self.place(self.output, &self.poses(&s.coordinates), &s.inputs.parameters).position;
        let width = self.n_body_coordinates();
        let turned = self.points[self.output].body.map_or_else(
            || vec![0.0; self.size() - self.n_translations()],
            |b| {
                let body = b * width..(b + 1) * width;
                self.space.turn_of_body(&nominal.coordinates[body.clone()], &state.coordinates[body])
            },
        );
        self.pose_components(sub(place(state), place(nominal)), &turned)
    }

    /// The inputs at given drive values with every deviation at its known value and no play taken.
    pub(crate) fn built(&self, drives: &[f64]) -> Inputs<f64> {
        Inputs { drives: drives.to_vec(), parameters: self.centre.clone() }
    }

    /// The same where the Jacobian is factored already: an estimate spares the singular value where it is
    /// plainly large.
    pub(crate) fn status_of(&self, linearised: &Linearised<'_>, state: &State) -> Status {
        if self.singular_estimate(linearised) >= CLEAR * self.singular_value {
            return Status::Ok;
        }
        self.nominal_status(state)
    }

    /// Whether the nominal state is too near a singular one.
    pub(crate) fn nominal_status(&self, state: &State) -> Status {
        let (value, _) = self.singular_value_at(state);
        if value < self.singular_value { Status::Singular } else { Status::Ok }
    }

    /// The reactions that the multipliers of the closure rows stand for.
    pub(crate) fn reactions<S: Real>(&self, poses: &[Pose<S>], parameters: &[S], multipliers: &[S]) -> Vec<S> {
        let size = self.size();
        let mut reactions = vec![S::from_f64(0.0); self.n_joints() * size];
        for (row, &l) in self.rows.iter().zip(multipliers) {
            let [force, moment] = self.row_wrench(row, poses, parameters);
            for (k, component) in self.space.components().iter().enumerate() {
                let part = match component {
                    Component::Along(i) => force.map(|force| force[*i]),
                    Component::About(i) => moment.map(|moment| moment[*i]),
                };
                if let Some(part) = part {
                    let slot = &mut reactions[row.joint * size + k];
                    *slot = *slot - l * part;
                }
            }
        }
        reactions
    }

    /// Where the load pushes the output, for every case, in blocks on all cores; if not `exact`, everything
    /// is told to first order at the nominal pose, and the closure is not solved again.
    #[must_use]
    pub fn loaded(&self, cases: &[Case<'_>], exact: bool, keep: Keep) -> Table {
        let mut table = Table::sized(self, cases.len(), keep);
        let Some(solver) = self.solver(cases) else { return self.none_assembled(table) };
        let programs = if cases.len() >= LANES { Programs::record(&solver, exact) } else { Programs::None };
        let runs = table.rows().runs(RUN).into_par_iter().zip(cases.par_chunks(RUN));
        let run = |workspace: &mut Vec<Block>, (rows, cases)| {
            let run = Run { solver: &solver, programs: &programs, cases, exact, rows, workspace };
            interrupt::until_stopped(|| [dispatch(run).0])
        };
        let fallbacks = interrupt::before_the_stop(runs.map_init(Vec::new, run).collect());
        table.keep_first(RUN * fallbacks.len());
        table.fallbacks = fallbacks.into_iter().sum();
        table
    }

    /// The same for `n` rows of drive values, each on the assembly branch of those before it, as
    /// [`Self::trace`] finds them, without the memory that the nominal coordinates of all rows would take.
    #[must_use]
    pub fn loaded_along(&self, n: usize, drives: &[f64], exact: bool, keep: Keep) -> Table {
        let mut table = Table::sized(self, n, keep);
        let first = if n > 0 { self.first_state(&drives[..self.n_drives()]) } else { None };
        let Some((solver, from)) = first else { return self.none_assembled(table) };
        let programs = if n >= LANES { Programs::record(&solver, exact) } else { Programs::None };
        let runs = table.rows().runs(trace::RUN);
        let fallbacks = trace_runs(&solver, &from, n, drives, runs, Vec::new, |workspace, rows, drives, trace| {
            let width = self.n_drives();
            let case = |(row, coordinates)| Case { drives: &drives[row * width..(row + 1) * width], coordinates };
            let coordinates = trace.coordinates.chunks_exact(self.n_coordinates());
            let cases: Vec<Case<'_>> = coordinates.enumerate().map(case).collect();
            let run = Run { solver: &solver, programs: &programs, cases: &cases, exact, rows, workspace };
            let (fallbacks, mut rows) = dispatch(run);
            for (row, status) in trace.status.iter().enumerate().filter(|(_, status)| **status != Status::Ok) {
                rows.status.row(row)[0] = *status;
            }
            fallbacks
        });
        table.fallbacks = fallbacks.into_iter().sum();
        table
    }

    fn none_assembled(&self, mut table: Table) -> Table {
        let missing = self.no_load_result(Status::NotAssembled);
        let mut rows = table.rows();
        (0..rows.n).for_each(|row| rows.put(row, &missing));
        table
    }

    fn loaded_plainly(&self, solver: &Solver<'_>, case: &Case<'_>, exact: bool) -> Loaded {
        self.restore(solver, case.coordinates, case.drives).map_or_else(
            || self.no_load_result(Status::NotAssembled),
            |nominal| self.loaded_at(solver, case, &nominal, exact),
        )
    }

    pub(crate) fn no_load_result(&self, status: Status) -> Loaded {
        let nan = |n: usize| vec![f64::NAN; n];
        Loaded {
            error: nan(self.size()),
            error_first_order: nan(self.size()),
            undetermined: nan(self.size()),
            open: nan(self.sources.len() * self.size()),
            decided: vec![false; self.sources.len()],
            reaction: nan(self.n_joints() * self.size()),
            offset: nan(self.n_parameters()),
            contribution: nan(self.sources.len() * self.size()),
            steps: 0,
            status,
        }
    }

    /// The linearisation at the nominal pose for the flanks of couplings that the load closes, the inputs that tell
    /// these, and the reactions.
    fn at_flanks<'s>(
        &self,
        solver: &'s Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
    ) -> Option<(Linearised<'s>, State, Gradient)> {
        let mut flanks = nominal.clone();
        let mut at = solver.linearise(&flanks)?;
        let mut gradient = self.load_gradient(&at, &flanks);
        for _ in 0..if self.plays().next().is_some() { FLANKS } else { 0 } {
            let pressed = self.pressed(&gradient, &self.built(case.drives), &self.mutes(&gradient));
            let before = flanks.inputs.clone();
            self.plays().for_each(|p| flanks.inputs.parameters[p] = pressed.parameters[p]);
            if before == flanks.inputs {
                break;
            }
            at = solver.linearise(&flanks)?;
            gradient = self.load_gradient(&at, &flanks);
        }
        Some((at, flanks, gradient))
    }

    fn loaded_at(&self, solver: &Solver<'_>, case: &Case<'_>, nominal: &State, exact: bool) -> Loaded {
        let size = self.size();
        let Some((at_nominal, flanks, gradient)) = self.at_flanks(solver, case, nominal) else {
            return self.no_load_result(Status::Singular);
        };
        let status = self.status_of(&at_nominal, nominal);
        // First order, at the nominal pose. Drive values that differ from the nominal ones count too.
        let mutes = self.mutes(&gradient);
        let offsets = self.pressed(&gradient, &self.built(case.drives), &mutes);
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

        // What is undecided at the nominal pose is so at any size of the play, even where the exact pose then
        // falls to one side.
        let mut open = vec![0.0; self.sources.len() * size];
        let mut decided = vec![true; self.sources.len()];
        let first_order = &map;
        let leave_open = |gradient: &Gradient, map: &Output, open: &mut [f64], decided: &mut [bool]| {
            let load = Pressing {
                force: |p: usize| gradient.inputs.parameters[p],
                scale: self.force_scale(gradient),
                mute: |s: usize| mutes[s],
            };
            let first_order = |k: usize, p: usize| first_order.parameters[(k, p)];
            self.leave_open(&load, first_order, |k, p| map.parameters[(k, p)], open, decided)
        };
        let mut felt = leave_open(&gradient, &map, &mut open, &mut decided);
        let sum = |open: &[f64]| (0..size).map(|i| open.iter().skip(i).step_by(size).sum()).collect();
        if !exact {
            return Loaded {
                error: error_first_order.clone(),
                error_first_order,
                undetermined: sum(&open),
                open,
                decided,
                reaction: self.reactions(&at_nominal.poses, &at_nominal.parameters, &gradient.multipliers),
                offset: offsets.parameters,
                contribution,
                steps: 0,
                status: if felt && status == Status::Ok { Status::Undetermined } else { status },
            };
        }
        let start = match solver.follow(nominal, &self.built(case.drives)) {
            Ok(state) => state,
            Err(status) => return self.no_load_result(status),
        };
        let Some(mut contact) = solver.settle(start, &mutes) else {
            return self.no_load_result(Status::Singular);
        };
        let Some(mut displaced) = solver.linearise(&contact.state) else {
            return self.no_load_result(Status::Singular);
        };
        let map = self.output_sensitivity(&displaced, &contact.state);
        felt |= leave_open(&contact.gradient, &map, &mut open, &mut decided);
        if felt {
            // What the output feels is listened to: the closure may decide it.
            let unheard = |(mute, open): (&Mute, &[f64])| {
                if open.iter().any(|o| *o > 0.0) { Mute::default() } else { *mute }
            };
            let listened: Vec<Mute> = mutes.iter().zip(open.chunks_exact(size)).map(unheard).collect();
            let rest = solver.rest(&contact, &mutes, &listened);
            let rest = rest.and_then(|rest| Some((solver.linearise(&rest.contact.state)?, rest)));
            if let Some((at, rest)) = rest {
                let map = self.output_sensitivity(&at, &rest.contact.state);
                let left = self.left_open(&rest, &listened, &first_order.parameters, &map.parameters);
                (open, decided, felt) = (left.open, left.decided, left.felt);
                (contact, displaced) = (rest.contact, at);
            }
        }
        Loaded {
            error: self.error(&contact.state, nominal),
            error_first_order,
            undetermined: sum(&open),
            open,
            decided,
            reaction: self.reactions(&displaced.poses, &displaced.parameters, &contact.gradient.multipliers),
            offset: contact.state.inputs.parameters,
            contribution,
            steps: contact.steps,
            status: match status {
                Status::Ok if contact.blocked && !contact.settled => Status::Singular,
                Status::Ok if felt || !contact.settled => Status::Undetermined,
                other => other,
            },
        }
    }

    /// Widens what every source leaves open in the output, tells which sources the load does not decide, and
    /// whether the output feels it.
    ///
    /// What is left open is felt where it moves the output to first order, both at the nominal pose, by the
    /// map `first_order`, and at the pose in question, by `map`, which tells the half-width; where one of
    /// them is zero the output moves in proportion to the square of the play. The maps take a component of
    /// the output and a parameter.
    pub(crate) fn leave_open<F: Fn(usize) -> f64, M: Fn(usize) -> Mute>(
        &self,
        load: &Pressing<F, M>,
        first_order: impl Fn(usize, usize) -> f64,
        map: impl Fn(usize, usize) -> f64,
        open: &mut [f64],
        decided: &mut [bool],
    ) -> bool {
        let size = self.size();
        let row = |source: &Source, map: &dyn Fn(usize) -> f64| {
            let mut row = [0.0; MAX_SIZE];
            row.iter_mut().zip(source.range()).for_each(|(r, p)| *r = map(p));
            row
        };
        let mut reaches = [0.0; 6];
        for source in self.sources.iter().filter(|s| s.is_clearance) {
            for k in 0..size {
                reaches[k] += source.set.reach(&row(source, &|p| first_order(k, p))[..source.set.size()]);
            }
        }
        let mut felt = false;
        for (s, source) in self.sources.iter().enumerate().filter(|(_, s)| s.is_clearance) {
            let n = source.set.size();
            let force = source.set.heard(&row(source, &|p| (load.force)(p))[..n], (load.mute)(s));
            let face = source.set.face(&force[..n], self.undecided(source, UNDECIDED * load.scale));
            decided[s] &= face.is_point();
            if face.is_point() {
                continue;
            }
            let width = |map: &dyn Fn(usize) -> f64| face.half_width(&row(source, map)[..n]);
            let widths: [f64; 6] = std::array::from_fn(|k| if k < size { width(&|p| map(k, p)) } else { 0.0 });
            let moves = |k: usize| widths[k].min(width(&|p| first_order(k, p))) > UNFELT * reaches[k];
            if (0..size).any(moves) {
                felt = true;
                open[s * size..(s + 1) * size].iter_mut().zip(widths).for_each(|(o, w)| *o = w.max(*o));
            }
        }
        felt
    }
}

/// The forces along all parameters at a pose.
pub(crate) struct Pressing<F: Fn(usize) -> f64, M: Fn(usize) -> Mute> {
    /// The force along a parameter.
    pub force: F,
    /// The size of all forces.
    pub scale: f64,
    /// What of a source the load does not push at the nominal pose.
    pub mute: M,
}
