//! Load-determined poses of a block of configurations.
//!
//! One recorded program gives the statics of the nominal pose (reactions, first-order maps, nearness to a singular
//! pose). A second one takes a Newton step of the closure, a third one as well, together with the reactions at the pose it
//! starts from. Offsets that would turn a body too far for one step are approached in several. Drives that are to be elsewhere
//! than at the nominal pose are there from the first step on; the first-order error of these is left to the plain solver. A round closes for the
//! offsets, takes the reactions and moves every offset to the support point of its set, or mixes that with the rounds
//! before ([`crate::contact::mixing_on_lanes`]), or stops between the ends of a line ([`crate::contact::balance_on_lanes`]),
//! until pose, reactions and contacts have converged together. Lanes where the load decides nothing, contacts flip, the load
//! may hold the mechanism at another place or the closure is in doubt are left to the plain solver.

use crate::clearance::offset::MAX_SIZE;
use crate::clearance::{Set, Unforced};
use crate::closure::newton::Solver;
use crate::closure::recorded::SMALL_ANGLE;
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::{StaticsOutputs, record_finish, record_statics};
use crate::contact::balance_on_lanes::{Balancing, KNOWN};
use crate::contact::elsewhere::Leads;
use crate::contact::flanks::run_at_flanks;
use crate::contact::mixing_on_lanes::Mixing;
use crate::contact::off_balance::part_of;
use crate::contact::push_on_lanes::{push, unforced_of};
use crate::math::lanes::block::{Block, LANES};
use crate::math::space::Space;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Rows;
use crate::mechanism::{Mechanism, Source};
use crate::program::tape::Program;
use crate::questions::columns::{Loaded, LoadedRows};
use crate::questions::loaded::elsewhere_on_lanes::other_ends;
use crate::questions::loaded::first_order_on_lanes::share_and_reach_of;
use crate::questions::loaded::openings_on_lanes::{Openings, released};
use crate::questions::loaded::steps_on_lanes::{StepOutputs, Steps, record_close, record_contact_step};

/// Steps to the support points that a block takes at most.
const STEPS: usize = 25;
/// Steps in which contacts find their sides, or the plain solver looks for them.
const FIRST: usize = 15;
/// Steps in which lines find their balance.
const BALANCED: usize = 4;
/// A contact has changed sides where an offset changes by more than this part of its set.
const OTHER_SIDE: f64 = 0.5;
/// Steps that close it for other offsets of what is open; two tell what goes with the square of the play.
const CHORDS: usize = 2;
/// Steps in which the first offsets are approached at most.
const PARTS: f64 = 16.0;
/// Turn of the output in space (rad) up to which it is told.
const LARGEST_TURN: f64 = 0.6;

/// The recorded programs of one mechanism under its loads.
#[derive(Clone, Debug)]
pub struct Contact<'m> {
    statics: Program,
    steps: Steps<'m>,
    finish: Program,
}

/// What a block is solved in; the next one overwrites it.
pub(crate) struct Workspace {
    /// Registers of the statics.
    statics: Vec<Block>,
    /// Those of the other programs together.
    step: Vec<Block>,
    /// Where the steps begin.
    begin: Vec<Block>,
    /// Where the forces push the offsets.
    pushed: Vec<Block>,
    /// The forces at another place of the play.
    elsewhere: Vec<Block>,
    /// The share of every source in every component.
    shares: Vec<Block>,
    mixing: Mixing,
    balance: Balancing,
}

impl<'m> Contact<'m> {
    /// Records the programs; `None` when the mechanism has no plan or turns too far.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        if m.largest_angle() > SMALL_ANGLE {
            return None;
        }
        let layout = Layout::new(m);
        let step = record_contact_step(solver, &layout)?;
        let finish = record_finish(m, &layout, &step);
        let close = record_close(solver, &layout, &finish)?;
        let statics = record_statics(solver, &layout)?;
        Some(Self { statics, steps: Steps { mechanism: m, layout, step, close }, finish })
    }

    /// Room for one block.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        let mut step = self.steps.close.registers(&[]);
        self.finish.put_common(&mut step, &[]);
        self.steps.step.put_common(&mut step, &[]);
        let m = self.steps.mechanism;
        let n_u = m.n_parameters();
        let [pushed, elsewhere, shares] = [n_u, n_u, m.sources().len() * m.size()].map(|n| vec![Block::splat(0.0); n]);
        let statics = self.statics.registers(&[]);
        Workspace {
            statics,
            step,
            begin: Vec::new(),
            pushed,
            elsewhere,
            shares,
            mixing: Mixing::new(m),
            balance: Balancing::new(m),
        }
    }

    /// Solves up to a block of cases and puts their rows, from row `first` on, by `plainly` where the
    /// batch is in doubt.
    #[inline(always)]
    #[allow(clippy::too_many_lines)] // one block from its nominal poses to its rows, in order
    pub(crate) fn solve(
        &self,
        workspace: &mut Workspace,
        cases: &[Case<'_>],
        rows: &mut LoadedRows<'_>,
        first: usize,
        mut plainly: impl FnMut(&Case<'_>, Option<Leads>) -> Loaded,
    ) {
        let m = self.steps.mechanism;
        let n_u = m.n_parameters();
        let Workspace { statics, step, begin, pushed, elsewhere, shares, mixing, balance } = workspace;
        mixing.begin();
        balance.begin();
        // Idle lanes repeat the first.
        let case = |lane: usize| cases.get(lane).unwrap_or(&cases[0]);
        self.steps.layout.load_all(m, |lane| (case(lane).coordinates, case(lane).drives), statics);
        run_at_flanks(m, &self.statics, statics);
        let at = StaticsOutputs::new(m);
        let moved = self.drives_elsewhere(&at, cases, statics);
        if !moved.is_empty() && !rows.error_first_order.is_kept() {
            // Nominal are the coordinates that were given, whatever the drives are to be.
            for &lane in &moved {
                let own = m.drive_values(cases[lane].coordinates, cases[lane].drives);
                Layout::load(m, cases[lane].coordinates, &own, statics, lane);
            }
            run_at_flanks(m, &self.statics, statics);
        }
        let out = |k: usize| self.statics.output(statics, k);
        let mut good = [false; LANES];
        for (i, case) in cases.iter().enumerate() {
            good[i] = case.coordinates.iter().all(|c| c.is_finite()) && at.is_sound(m, out, i);
        }
        let inputs = n_u + self.steps.layout.n_varying();
        step[n_u..inputs].copy_from_slice(&statics[n_u..inputs]);
        for &lane in &moved {
            Layout::load(m, cases[lane].coordinates, cases[lane].drives, step, lane);
        }
        begin.clear();
        begin.extend_from_slice(&step[n_u..inputs]);
        for (p, middle) in m.in_the_middle(&[], |s| s.is_clearance).parameters.into_iter().enumerate() {
            (step[p], pushed[p]) = (Block::splat(middle), Block::splat(middle));
        }
        let unforced = unforced_of(m, |p| out(at.gradient + p), out(at.scale));
        push(m, Some(&unforced), |p| out(at.gradient + p), out(at.scale), step, pushed);
        let map = |k: usize, p: usize| out(at.map + k * n_u + p);
        let reaches = put_shares(m, map, pushed, shares, cases.len(), rows, first);
        let mut open = Openings::none(m);
        open.add(m, |p| out(at.gradient + p), out(at.scale), &unforced, map, &reaches);
        for (p, elsewhere) in elsewhere.iter_mut().enumerate() {
            *elsewhere = *out(at.gradient + p);
        }
        let counted = vec![[Unforced::default(); LANES]; m.sources().len()];
        let released = released(m, &unforced);

        step[..n_u].copy_from_slice(pushed);
        let to = StepOutputs::new(m, &self.steps.layout);
        let sign = out(at.pivots);
        let is_round = |source: &Source| matches!(source.set, Set::Disc { .. } | Set::Ball { .. });
        let has_corners = m.sources().iter().any(|source| source.is_clearance && !is_round(source));
        let mut settled = [false; LANES];
        let mut steps = [0_u64; LANES];
        let mut balanced = [0_usize; LANES];
        let (mut undecided, mut quiet) = (Block::splat(0.0), Block::splat(0.0));
        let rounding = m.step_of_rounding();
        for round in 0..STEPS {
            self.steps.close.run(step);
            if round == 0 {
                self.approach(begin, sign, step, &mut good, &mut steps);
            }
            self.steps.stay_near(&self.steps.close, step, sign, &mut good);
            if round == 0 && has_corners {
                // Corners that compete are chosen at a closed pose, as by the plain solver.
                self.steps.close.run(step);
                self.steps.stay_near(&self.steps.close, step, sign, &mut good);
            }
            self.steps.step.run(step);
            self.steps.stay_near(&self.steps.step, step, sign, &mut good);
            let out = |k: usize| self.steps.step.output(step, k);
            let open_then = undecided;
            if round == 0 {
                for &s in &released {
                    for p in m.sources()[s].range() {
                        for i in (0..LANES).filter(|&i| !unforced[s][i].is_none()) {
                            elsewhere[p].0[i] = f64::NAN;
                        }
                    }
                }
            }
            undecided = push(m, Some(&counted), |p| out(to.gradient + p), out(to.scale), step, pushed);
            quiet = self.steps.balance(round, balance, step, pushed);
            for i in 0..LANES {
                if balanced[i] > BALANCED || balance.is_idle(i) {
                    continue;
                }
                if balanced[i] < BALANCED {
                    balance.put_back(i, &unforced, pushed);
                }
                // What leaves its middle then does so by whole steps.
                mixing.mixed[i] = false;
                balanced[i] += 1;
            }
            let out = |k: usize| self.steps.step.output(step, k);
            // Of what balances nothing changes where nothing pushes it any more.
            undecided = undecided.sub(&quiet);
            let wanted = mixing.see(step, pushed);
            let changed = &wanted.changed;
            let mut all = true;
            for i in 0..cases.len() {
                steps[i] += u64::from(!settled[i]);
                let still = if quiet.0[i] > 0.0 { KNOWN } else { m.still() };
                let is_held = (1..=BALANCED).contains(&balanced[i]);
                settled[i] |= !is_held && out(to.size).0[i] <= rounding * rounding && changed.0[i] <= still;
                // Where steps are mixed, contacts that change sides may settle elsewhere than by whole steps, and what
                // nothing pushes any more stays where it is, which may be outside its set.
                let turned = changed.0[i] > OTHER_SIDE;
                good[i] &= !mixing.mixed[i] || !turned && undecided.0[i] - open_then.0[i] == 0.0;
                good[i] &= !turned || round < FIRST;
                all &= settled[i] || !good[i];
            }
            if all {
                break;
            }
            mixing.step(step, pushed, &wanted, &settled);
        }
        self.finish.run(step);
        let out = |k: usize| self.steps.step.output(step, k);
        // Where the exact pose decides, it alone does.
        open.decided.fill([true; LANES]);
        open.add(m, |p| out(to.gradient + p), out(to.scale), &counted, map, &reaches);
        for i in 0..LANES {
            // Several lines that nothing pushes may share their play in many ways, of which the middle is looked for.
            let is_one = quiet.0[i] <= 1.0 && balance.is_told(i, out(to.scale), step);
            good[i] &= settled[i] && is_one && !open.observable[i] && !self.turns_far(step, i);
        }
        let ends = other_ends(m, |p| out(to.gradient + p), out(to.scale), elsewhere, step, &good);
        // Nothing is undetermined, as where nothing has been put, and the status is as it is there.
        let found = &good[..cases.len()];
        let nominal = |k: usize| self.statics.output(statics, at.output + k);
        let moved =
            |k: usize| if k < m.size() { self.finish.output(step, k).sub(nominal(k)) } else { Block::splat(0.0) };
        let error: [Block; 6] = std::array::from_fn(moved);
        rows.error.put_lanes(first, found, |k| &error[k].0);
        rows.decided.put_lanes(first, found, |s| &open.decided[s]);
        rows.reaction.put_lanes(first, found, |k| &self.steps.step.output(step, to.reactions + k).0);
        rows.drive_force.put_lanes(first, found, |d| &self.steps.step.output(step, to.drive_forces + d).0);
        rows.offset.put_lanes(first, found, |p| &step[p].0);
        rows.iterations.put_lanes(first, found, |_| &steps);
        rows.equilibria.put_lanes(first, found, |_| &[1; LANES]);
        let rest = step[..n_u].to_vec();
        let noticed = self.noticed(&open.decided, &good, &reaches, step);
        let leading = self.steps.leading(&ends, sign, balance, step, pushed);
        for (i, (case, ends)) in cases.iter().zip(leading).enumerate() {
            if !good[i] || noticed[i] {
                rows.put(first + i, &plainly(case, None));
            } else if !ends.is_empty() {
                let offsets = rest.iter().map(|block| block.0[i]).collect();
                rows.put(first + i, &plainly(case, Some(Leads { offsets, ends })));
            }
        }
    }

    /// The lanes whose drives are to be elsewhere than at their coordinates.
    #[inline(always)]
    fn drives_elsewhere(&self, at: &StaticsOutputs, cases: &[Case<'_>], statics: &[Block]) -> Vec<usize> {
        let m = self.steps.mechanism;
        let out = |k: usize| self.statics.output(statics, k);
        let is_known = |lane: usize| cases[lane].coordinates.iter().all(|c| c.is_finite());
        (0..cases.len()).filter(|&lane| is_known(lane) && !at.is_at_drives(m, out, lane)).collect()
    }

    /// After a first step: where it went too far, goes back and takes several, each with a part of the offsets.
    #[inline(always)]
    fn approach(
        &self,
        begin: &[Block],
        sign: &Block,
        step: &mut [Block],
        good: &mut [bool; LANES],
        steps: &mut [u64; LANES],
    ) {
        let (n_u, small) = (self.steps.mechanism.n_parameters(), self.steps.mechanism.small_step());
        let to = StepOutputs::new(self.steps.mechanism, &self.steps.layout);
        let mut parts = Block::splat(1.0);
        for i in 0..LANES {
            let length = self.steps.close.output(step, to.size).0[i].sqrt();
            if good[i] && length > small {
                // Steps of half that length: they are not alike.
                parts.0[i] = (length / (0.5 * small)).ceil();
                good[i] = parts.0[i] <= PARTS;
            }
        }
        let most = (0..LANES).filter(|&i| good[i]).fold(1.0, |most: f64, i| most.max(parts.0[i]));
        if most <= 1.0 {
            return;
        }
        let offsets = step[..n_u].to_vec();
        step[n_u..n_u + begin.len()].copy_from_slice(begin);
        let mut part = 1.0;
        while part <= most {
            for (offset, whole) in step.iter_mut().zip(&offsets) {
                for i in 0..LANES {
                    offset.0[i] = if part < parts.0[i] { whole.0[i] * (part / parts.0[i]) } else { whole.0[i] };
                }
            }
            self.steps.close.run(step);
            self.steps.stay_near(&self.steps.close, step, sign, good);
            for i in 0..LANES {
                steps[i] += u64::from(part < parts.0[i]);
            }
            part += 1.0;
        }
    }

    /// The lanes in which the output moves noticeably with what the load does not decide, by what all play could do to it to
    /// first order: there the work may have a minimum. `step` are registers at a pose with its output and forces, and stay so.
    #[inline(always)]
    fn noticed(
        &self,
        decided: &[[bool; LANES]],
        good: &[bool; LANES],
        reaches: &[Block; 6],
        step: &mut [Block],
    ) -> [bool; LANES] {
        let m = self.steps.mechanism;
        let mut noticed = [false; LANES];
        if decided.iter().all(|decided| decided.iter().zip(good).all(|(decided, good)| *decided || !good)) {
            return noticed;
        }
        let to = StepOutputs::new(m, &self.steps.layout);
        let (at, output) = (step.to_vec(), |step: &[Block], k: usize| *self.finish.output(step, k));
        let quiet = {
            let out = |k: usize| self.steps.step.output(&at, k);
            unforced_of(m, |p| out(to.gradient + p), out(to.scale))
        };
        let mut number = 0;
        for (s, source) in m.sources().iter().enumerate().filter(|(_, source)| source.is_clearance) {
            for k in 0..source.set.size() {
                let mut unit = [0.0; MAX_SIZE];
                unit[k] = part_of(number);
                let way = source.set.along(&unit);
                number += 1;
                for i in (0..LANES).filter(|&i| !decided[s][i]) {
                    // Of an edge all that its set has is taken.
                    if quiet[s][i].is_none() || source.set.is_unforced(k, quiet[s][i]) {
                        source.range().zip(way).for_each(|(p, along)| step[p].0[i] += along);
                    }
                }
            }
        }
        (0..CHORDS).for_each(|_| self.steps.close.run(step));
        self.finish.run(step);
        for (k, reach) in reaches.iter().enumerate().take(m.size()) {
            let moved = output(step, k).sub(&output(&at, k));
            for (i, noticed) in noticed.iter_mut().enumerate() {
                // Not a number is noticed, too.
                *noticed |= !(moved.0[i].abs() <= m.least_noticed(k, reach.0[i]));
            }
        }
        step.copy_from_slice(&at);
        noticed
    }

    /// Whether the output of a lane has turned so far that its rotation is not known.
    #[inline(always)]
    fn turns_far(&self, step: &[Block], lane: usize) -> bool {
        let m = self.steps.mechanism;
        let square = |k: usize| self.finish.output(step, k).0[lane].powi(2);
        m.space == Space::Spatial && (m.n_translations()..m.size()).map(square).sum::<f64>() > LARGEST_TURN.powi(2)
    }
}

/// Puts the first-order errors and the share of every source in them; gives what all play could do to every
/// component of the output.
#[inline(always)]
fn put_shares<'b>(
    m: &Mechanism,
    map: impl Fn(usize, usize) -> &'b Block,
    offsets: &[Block],
    shares: &mut [Block],
    n: usize,
    rows: &mut LoadedRows<'_>,
    first: usize,
) -> [Block; 6] {
    let size = m.size();
    let (mut error, mut reaches) = ([Block::splat(0.0); 6], [Block::splat(0.0); 6]);
    for (s, source) in m.sources().iter().enumerate() {
        for k in 0..size {
            let (share, reach) = share_and_reach_of(source, |p| map(k, source.first + p), &offsets[source.range()]);
            if source.is_clearance {
                reaches[k] = reaches[k].add(&reach);
            }
            error[k] = error[k].add(&share);
            shares[s * size + k] = share;
        }
    }
    let all = &[true; LANES][..n];
    rows.contribution.put_lanes(first, all, |k| &shares[k].0);
    rows.error_first_order.put_lanes(first, all, |k| &error[k].0);
    reaches
}
