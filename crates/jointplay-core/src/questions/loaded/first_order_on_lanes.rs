//! Load-determined errors of a block of configurations to first order, at their nominal poses.

use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::UNDECIDED;
use crate::closure::newton::Solver;
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::{StaticsOutputs, poses_of, record_statics, statics_outputs};
use crate::closure::recorded::step::evaluate;
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::closure::sensitivity::UNOBSERVABLE;
use crate::closure::tree::on_lanes::OnTree;
use crate::contact::flanks::run_at_flanks;
use crate::contact::push_on_lanes::exposed;
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Source};
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;
use crate::questions::columns::LoadedRows;

/// The recorded statics of one mechanism under its loads.
#[derive(Clone, Debug)]
pub struct FirstOrder<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    statics: Program,
}

/// What a block is solved in; the next one overwrites it.
pub(crate) struct Workspace {
    registers: Vec<Block>,
    /// The values of all parameters.
    offsets: Vec<Block>,
    /// The share of every source in every component.
    shares: Vec<Block>,
}

/// What the load leaves open of a source, and the half-width of that in every component of the output.
struct Opening {
    source: usize,
    open: Block,
    widths: [Block; 6],
}

impl<'m> FirstOrder<'m> {
    /// Records the program; `None` when the mechanism has no plan.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        if m.largest_angle() > SMALL_ANGLE {
            return None;
        }
        let layout = Layout::new(m);
        let statics = record_on_tree(solver, &layout).or_else(|| record_statics(solver, &layout))?;
        Some(Self { mechanism: m, statics, layout })
    }

    /// Room for one block.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        let m = self.mechanism;
        let [offsets, shares] = [m.n_parameters(), m.sources().len() * m.size()].map(|n| vec![Block::splat(0.0); n]);
        Workspace { registers: self.statics.registers(&[]), offsets, shares }
    }

    /// Solves up to a block of cases and puts their rows, from row `first` on; tells which lanes are in
    /// doubt: their rows are without meaning.
    #[inline(always)]
    pub(crate) fn solve(
        &self,
        workspace: &mut Workspace,
        cases: &[Case<'_>],
        rows: &mut LoadedRows<'_>,
        first: usize,
    ) -> [bool; LANES] {
        let m = self.mechanism;
        let Workspace { registers, offsets: all_offsets, shares } = workspace;
        let size = m.size();
        // Idle lanes repeat the last case.
        let given =
            |lane: usize| (cases[lane.min(cases.len() - 1)].coordinates, cases[lane.min(cases.len() - 1)].drives);
        self.layout.load_all(m, given, registers);
        run_at_flanks(m, &self.statics, registers);
        let at = StaticsOutputs::new(m);
        let out = |k: usize| self.statics.output(registers, k);
        let mut good = [false; LANES];
        for i in 0..LANES {
            good[i] = at.is_sound(m, out, i);
        }

        let tolerance = out(at.scale).mul(&Block::splat(UNDECIDED));
        let mut error = [Block::splat(0.0); 6];
        let mut reaches = [Block::splat(0.0); 6];
        let mut openings: Vec<Opening> = Vec::new();
        for (s, source) in m.sources().iter().enumerate() {
            let n = source.set.size();
            let mut offsets: [Block; MAX_SIZE] =
                std::array::from_fn(|k| Block::splat(if k < n { m.centre[source.first + k] } else { 0.0 }));
            let mut row = [[out(0); MAX_SIZE]; 6];
            for k in 0..size {
                for p in 0..n {
                    row[k][p] = out(at.map + k * m.n_parameters() + source.first + p);
                }
            }
            if source.is_clearance && !source.set.is_zero() {
                let faces = exposed(source, |p| out(at.gradient + p), &tolerance, None);
                for p in 0..n {
                    offsets[p] = offsets[p].add(&faces.nearest[p]);
                }
                let mut any = 0.0;
                for i in 0..LANES {
                    any += faces.open.0[i];
                }
                if any != 0.0 {
                    let mut widths = [Block::splat(0.0); 6];
                    for k in 0..size {
                        widths[k] = faces.half_width(&row[k][..n]);
                    }
                    openings.push(Opening { source: s, open: faces.open, widths });
                }
            }
            for k in 0..size {
                let (share, reach) = share_and_reach_of(source, |p| row[k][p], &offsets);
                if source.is_clearance {
                    reaches[k] = reaches[k].add(&reach);
                }
                error[k] = error[k].add(&share);
                if rows.contribution.is_kept() {
                    shares[s * size + k] = share;
                }
            }
            if rows.offset.is_kept() {
                all_offsets[source.range()].copy_from_slice(&offsets[..n]);
            }
        }
        let all = &[true; LANES][..cases.len()];
        rows.contribution.put_lanes(first, all, |k| &shares[k].0);
        rows.offset.put_lanes(first, all, |p| &all_offsets[p].0);
        rows.error.put_lanes(first, all, |k| &error[k].0);
        rows.error_first_order.put_lanes(first, all, |k| &error[k].0);
        rows.reaction.put_lanes(first, all, |k| &out(at.reactions + k).0);
        rows.drive_force.put_lanes(first, all, |d| &out(at.drive_forces + d).0);
        rows.equilibria.put_lanes(first, all, |_| &[1; LANES]);
        self.put_openings(&openings, &reaches, cases.len(), rows, first);
        good
    }

    /// As [`Mechanism::leave_open`].
    #[inline(always)]
    fn put_openings(
        &self,
        openings: &[Opening],
        reaches: &[Block; 6],
        n: usize,
        rows: &mut LoadedRows<'_>,
        first: usize,
    ) {
        let size = self.mechanism.size();
        for opening in openings {
            let mut observable = Block::splat(0.0);
            for k in 0..size {
                for i in 0..LANES {
                    let moves = opening.open.0[i] != 0.0 && opening.widths[k].0[i] > UNOBSERVABLE * reaches[k].0[i];
                    observable.0[i] += if moves { 1.0 } else { 0.0 };
                }
            }
            for i in 0..n {
                if rows.decided.is_kept() {
                    rows.decided.row(first + i)[opening.source] = opening.open.0[i] == 0.0;
                }
                if observable.0[i] != 0.0 {
                    rows.status.row(first + i)[0] = Status::Undetermined;
                    for k in 0..size {
                        let width = opening.widths[k].0[i];
                        rows.undetermined.row(first + i)[k] += width;
                        if rows.undetermined_contribution.is_kept() {
                            rows.undetermined_contribution.row(first + i)[opening.source * size + k] = width;
                        }
                    }
                }
            }
        }
    }
}

/// As [`record_statics`], along a spanning tree.
fn record_on_tree(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE, &structure("statics on a tree", solver));
    let mut symbolic = layout.varying(m, &recorder);
    symbolic.inputs.parameters.fill(Symbol::Constant(0.0));
    let [residual, _] = evaluate(m, &symbolic);
    let linear = OnTree::new(solver, &poses_of(m, &symbolic))?;
    let outputs = statics_outputs(m, layout, &recorder, &symbolic, &residual, &linear);
    Some(Program::new(&recorder, m.n_parameters() + layout.n_varying(), &outputs, 0..0))
}

/// See [`share_and_reach`].
#[inline(always)]
pub(super) fn share_and_reach_of<'b>(
    source: &Source,
    row: impl Fn(usize) -> &'b Block,
    offsets: &[Block],
) -> (Block, Block) {
    match source.set.size() {
        1 => share_and_reach::<1>(source, row, offsets),
        2 => share_and_reach::<2>(source, row, offsets),
        3 => share_and_reach::<3>(source, row, offsets),
        4 => share_and_reach::<4>(source, row, offsets),
        _ => share_and_reach::<MAX_SIZE>(source, row, offsets),
    }
}

/// What the offsets of a source make of one component of the output, and how far they could reach there, as
/// [`crate::clearance::Set::reach`] has it; `N` is the number of its parameters.
#[inline(always)]
fn share_and_reach<'b, const N: usize>(
    source: &Source,
    row: impl Fn(usize) -> &'b Block,
    offsets: &[Block],
) -> (Block, Block) {
    let (mut share, mut reach) = (Block::splat(0.0), Block::splat(0.0));
    let row: [&Block; N] = std::array::from_fn(row);
    let sizes: [f64; N] = std::array::from_fn(|p| source.set.half_width(p));
    for i in 0..LANES {
        let (mut sum, mut far) = (0.0, 0.0);
        for p in 0..N {
            let w = row[p].0[i];
            sum += w * offsets[p].0[i];
            let alone = w.abs() * sizes[p];
            far = if alone > far { alone } else { far };
        }
        share.0[i] = sum;
        reach.0[i] = far;
    }
    (share, reach)
}
