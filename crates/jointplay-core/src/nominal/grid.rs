//! The nominal mechanism on a grid of drive values: from nodes that are known to every node that can be
//! reached from them in steps between neighbours, whatever the shape of the region.
//!
//! A wave of nodes is solved at a time, each from a neighbour that was reached before it. A node is
//! given up when no neighbour leads to it, so that what cannot be reached costs as much as the
//! boundary of the region, not as its outside.
//!
//! Ways keep to the side of the singular poses that they begin on. What can only be reached across them
//! is looked for afterwards.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Solver, State, Step};
use crate::interrupt;
use crate::math::lanes::block::{Block as Numbers, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::tasks::in_rooms;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::nominal::on_lanes::{Follow, Start};
use crate::nominal::side::{Side, Watch};
use crate::nominal::trace::Trace;

/// A step between neighbours that fails this near to its end may end in a dead centre.
const NEAR_THE_END: f64 = 1e-3;

/// A state that leads to nodes, and the side of the singular poses that it is on.
struct Place {
    state: State,
    side: Side,
}

/// Where a way to a node begins: at a node, or at a seed.
#[derive(Clone, Copy)]
enum Origin {
    Node(usize),
    Seed(usize),
}

/// A node with the states, of neighbours or from elsewhere, that may lead to it.
type Task = (usize, Vec<(Origin, Arc<Place>)>);

/// A way that did not lead to its node.
#[derive(Clone, Copy)]
struct Ended {
    origin: Origin,
    node: usize,
    /// The part of the way that was gone.
    gone: f64,
    /// The part of it at which the mechanism becomes singular, if it has ended there; else not a number.
    singular: f64,
}

/// What became of a node: its state where there is one, and ways that did not lead to it.
#[derive(Clone, Default)]
struct Outcome {
    found: Option<(Status, Arc<Place>)>,
    ended: Vec<Ended>,
}

/// A state with a node that it may lead to.
#[derive(Clone, Copy, Debug)]
pub struct Seed<'a> {
    /// Number of the node.
    pub node: usize,
    /// The state.
    pub case: Case<'a>,
    /// Whether a singular pose lies between it and the start, so that nodes that it leads to are behind it, too.
    pub beyond: bool,
}

/// A grid as far as it is reached.
#[derive(Clone, Debug, Default)]
pub struct Reached {
    /// Coordinates and outcomes of all nodes.
    pub trace: Trace,
    /// For every node and axis the part of the way to the next node along it at which the mechanism becomes singular,
    /// where one of both is reached and the other one is not.
    pub crossing: Vec<f64>,
    /// For every seed the part of the way to its node at which it does, where it does not lead there.
    pub seed_crossing: Vec<f64>,
    /// For every seed the part of the way to its node up to which it leads, where it does not lead there.
    pub seed_end: Vec<f64>,
}

impl Reached {
    /// No node of a grid.
    pub(crate) fn none(m: &Mechanism, shape: &[usize], n_seeds: usize, status: Status) -> Self {
        let n = shape.iter().product();
        Self {
            trace: Trace { coordinates: vec![f64::NAN; n * m.n_coordinates()], status: vec![status; n] },
            crossing: vec![f64::NAN; n * shape.len()],
            seed_crossing: vec![f64::NAN; n_seeds],
            seed_end: vec![f64::NAN; n_seeds],
        }
    }
}

/// Whether ways keep to the side of the singular poses that they begin on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wave {
    Strict,
    Beyond,
}

/// Up to a block of nodes.
struct Block<'t, 'm> {
    solver: &'t Solver<'m>,
    follow: Option<&'t Follow<'m>>,
    watch: &'t Watch<'m>,
    wave: Wave,
    drives: &'t [f64],
    tasks: &'t [Task],
}

/// A block with registers to work in.
struct Work<'w, 't, 'm>(&'w Block<'t, 'm>, &'w mut Vec<Numbers>);

impl Kernel for Work<'_, '_, '_> {
    type Output = Vec<Outcome>;

    #[inline(always)]
    fn run(self) -> Vec<Outcome> {
        interrupt::check();
        let Work(block, registers) = self;
        let m = block.solver.mechanism;
        let mut outcomes: Vec<Option<Outcome>> = vec![None; block.tasks.len()];
        if let Some(follow) = block.follow {
            if registers.is_empty() {
                *registers = follow.workspace();
            }
            let from: Vec<&Place> = block.tasks.iter().map(|(_, from)| from[0].1.as_ref()).collect();
            let starts: Vec<Start<'_>> = from.iter().map(|place| Start::of(&place.state)).collect();
            let rows: Vec<f64> = block.tasks.iter().flat_map(|(node, _)| block.row(*node)).copied().collect();
            let n = m.n_coordinates();
            let mut found = vec![0.0; from.len() * n];
            let clear = follow.solve(registers, &starts, &rows, &mut found);
            for (k, outcome) in outcomes.iter_mut().enumerate() {
                if clear[k] >= CLEAR * m.singular_value {
                    let inputs = Inputs::nominal(m, block.row(block.tasks[k].0));
                    let coordinates = found[k * n..(k + 1) * n].to_vec();
                    let next = block.placed(State { coordinates, inputs, negative: starts[k].negative });
                    if block.wave == Wave::Beyond || block.keeps(from[k], &next) {
                        *outcome = Some(Outcome { found: Some(block.judged(Status::Ok, next)), ended: Vec::new() });
                    }
                }
            }
        }
        let tasks = block.tasks.iter().zip(outcomes);
        tasks.map(|((node, from), outcome)| outcome.unwrap_or_else(|| block.plainly(*node, from))).collect()
    }
}

impl Block<'_, '_> {
    fn row(&self, node: usize) -> &[f64] {
        let width = self.solver.mechanism.n_drives();
        &self.drives[node * width..(node + 1) * width]
    }

    /// Whether a step keeps to the side.
    fn keeps(&self, from: &Place, to: &Place) -> bool {
        self.watch.keeps((&from.state.coordinates, &from.side), (&to.state.coordinates, &to.side))
    }

    fn placed(&self, state: State) -> Place {
        Place { side: self.watch.side(&state.coordinates), state }
    }

    /// A state with its outcome, that on the rows which are solved being known: others may hold where these do not.
    fn judged(&self, own: Status, place: Place) -> (Status, Arc<Place>) {
        let is_singular = self.watch.is_singular(&place.state.coordinates, &place.side, own == Status::Ok);
        (if is_singular { Status::Singular } else { Status::Ok }, Arc::new(place))
    }

    /// The node from the first of the states that leads to it.
    fn plainly(&self, node: usize, from: &[(Origin, Arc<Place>)]) -> Outcome {
        let m = self.solver.mechanism;
        let to = Inputs::nominal(m, self.row(node));
        let mut ended = Vec::new();
        for (origin, place) in from {
            match self.followed(place, &to) {
                Ok(next) => {
                    let found = Some(self.judged(self.solver.status_at(&next.state), next));
                    return Outcome { found, ended };
                }
                Err((last, singular_at)) => {
                    let left = left(&place.state, &last, &to);
                    if left < NEAR_THE_END {
                        let closed = || self.solver.close(&last, &to).map(|state| self.placed(state));
                        let dead = || m.dead_centre(&last, &to.drives).map(|state| self.placed(state));
                        let singular = |place: Place| {
                            let own = m.nominal_status(&place.state);
                            Some(self.judged(own, place)).filter(|(all, _)| [own, *all].contains(&Status::Singular))
                        };
                        let found = closed().and_then(singular).or_else(|| dead().and_then(singular));
                        if found.is_some() {
                            return Outcome { found, ended };
                        }
                    }
                    if self.wave == Wave::Strict {
                        let is_singular = self.watch.has_ended(&place.side, &last.coordinates);
                        let singular = if is_singular { singular_at } else { f64::NAN };
                        ended.push(Ended { origin: *origin, node, gone: 1.0 - left, singular });
                    }
                }
            }
        }
        Outcome { found: None, ended }
    }

    /// The state at some inputs, reached from another one. Where that fails, the last one on the way, and the part of it
    /// at which the determinant becomes zero if it goes on as in the last step.
    fn followed(&self, from: &Place, to: &Inputs<f64>) -> Result<Place, (State, f64)> {
        if self.wave == Wave::Beyond {
            let found = self.solver.follow_part(&from.state, to);
            return found.map(|state| self.placed(state)).map_err(|(last, _)| (last, f64::NAN));
        }
        let mut here = from.side.clone();
        let mut step = (1.0, 0.0);
        let mut accept = |at: &State, next: &State| {
            let side = self.watch.side(&next.coordinates);
            if self.watch.keeps((&at.coordinates, &here), (&next.coordinates, &side)) {
                step = (left(&from.state, at, to), Watch::ratio(&here, &side));
                here = side;
                return Step::Taken;
            }
            if self.watch.is_at_end(&here) { Step::End } else { Step::Shorter }
        };
        let found = self.solver.follow_accepted(&from.state, to, &mut accept);
        found.map(|state| Place { side: here, state }).map_err(|(last, _)| {
            let rest = left(&from.state, &last, to);
            let (before, ratio) = step;
            let further = if ratio < 1.0 { (before - rest) * ratio / (1.0 - ratio) } else { 0.0 };
            (last, (1.0 - rest + further).clamp(0.0, 1.0))
        })
    }
}

/// The part of the way that is left.
fn left(from: &State, at: &State, to: &Inputs<f64>) -> f64 {
    let distance = |a: &[f64]| a.iter().zip(&to.drives).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    distance(&at.inputs.drives) / distance(&from.inputs.drives).max(f64::MIN_POSITIVE)
}

/// A grid that is being reached.
struct Grid<'t, 'm> {
    solver: Solver<'m>,
    follow: Option<Follow<'m>>,
    watch: Watch<'m>,
    shape: &'t [usize],
    drives: &'t [f64],
    places: Vec<Option<Arc<Place>>>,
    status: Vec<Status>,
    ended: Vec<Ended>,
}

impl Grid<'_, '_> {
    /// Goes from the given states on, from node to neighbour if it spreads; what is reached has an outcome.
    fn spread(&mut self, mut wave: BTreeMap<usize, Vec<(Origin, Arc<Place>)>>, of: Wave, spread: bool) {
        while !wave.is_empty() {
            let tasks: Vec<Task> = std::mem::take(&mut wave).into_iter().collect();
            let blocks: Vec<Block<'_, '_>> = tasks
                .chunks(LANES)
                .map(|tasks| Block {
                    solver: &self.solver,
                    follow: self.follow.as_ref(),
                    watch: &self.watch,
                    wave: of,
                    drives: self.drives,
                    tasks,
                })
                .collect();
            let work = |registers: &mut Vec<Numbers>, block| dispatch(Work(block, registers));
            let outcomes: Vec<Vec<Outcome>> = in_rooms(blocks.par_iter(), Vec::new, work).collect();
            let mut reached = Vec::new();
            for ((node, _), outcome) in tasks.iter().zip(outcomes.into_iter().flatten()) {
                self.ended.extend(outcome.ended);
                let Some((status, place)) = outcome.found else { continue };
                // At a singular state the branch may fork: nothing goes on from there.
                if status == Status::Ok && spread {
                    reached.push((*node, Arc::clone(&place)));
                }
                let behind = status == Status::Ok && of == Wave::Beyond;
                self.status[*node] = if behind { Status::OtherBranch } else { status };
                self.places[*node] = Some(place);
            }
            for (node, place) in &reached {
                self.offer(&mut wave, *node, place);
            }
        }
    }

    /// Offers a state to the neighbours of its node that are not reached.
    fn offer(&self, wave: &mut BTreeMap<usize, Vec<(Origin, Arc<Place>)>>, node: usize, place: &Arc<Place>) {
        for next in neighbours(self.shape, node) {
            if self.status[next] == Status::NotAssembled {
                wave.entry(next).or_default().push((Origin::Node(node), Arc::clone(place)));
            }
        }
    }

    /// Coordinates, outcomes, and where ways have ended.
    fn reached(self, n_seeds: usize) -> Reached {
        let m = self.solver.mechanism;
        let (width, axes) = (m.n_coordinates(), self.shape.len());
        let mut found = Reached::none(m, self.shape, n_seeds, Status::NotAssembled);
        for (k, place) in self.places.iter().enumerate() {
            let Some(place) = place else { continue };
            found.trace.coordinates[k * width..(k + 1) * width].copy_from_slice(&place.state.coordinates);
        }
        let lies_beyond = |node: usize| matches!(self.status[node], Status::NotAssembled | Status::OtherBranch);
        for &Ended { origin, node: to, gone, singular } in self.ended.iter().filter(|way| lies_beyond(way.node)) {
            match origin {
                Origin::Node(from) if !singular.is_nan() => {
                    let (place, part) = if from < to { (from, singular) } else { (to, 1.0 - singular) };
                    found.crossing[place * axes + axis_between(self.shape, from, to)] = part;
                }
                Origin::Node(_) => {}
                Origin::Seed(seed) => (found.seed_crossing[seed], found.seed_end[seed]) = (singular, gone),
            }
        }
        found.trace.status = self.status;
        found
    }
}

impl Mechanism {
    /// Nominal coordinates on a grid: its `shape`, the drive values of its nodes (the last axis runs
    /// fastest), and `seeds`: states with a node each that they may lead to. If it does not spread, only those
    /// nodes are solved.
    ///
    /// A node is `Ok` that is reached along a way on which neither this mechanism nor `real`, which has the same bodies
    /// and stands with its own drives held, becomes singular; one that is reached across singular poses only is on the
    /// `OtherBranch`.
    #[must_use]
    pub fn trace_grid(
        &self,
        shape: &[usize],
        drives: &[f64],
        seeds: &[Seed<'_>],
        spread: bool,
        real: Option<&Self>,
    ) -> Reached {
        let basis = if self.n_rows() == self.n_unknowns() { None } else { Some(self.basis()) };
        let solved = match &basis {
            None => self,
            Some(Ok(basis)) => &basis.kept,
            Some(Err(status)) => return Reached::none(self, shape, seeds.len(), *status),
        };
        let watched: Vec<&Self> = std::iter::once(self).chain(real).collect();
        let n = shape.iter().product();
        let cases: Vec<Case<'_>> = seeds.iter().map(|seed| seed.case).collect();
        let Some(solver) = solved.solver(&cases) else {
            return Reached::none(self, shape, seeds.len(), Status::NotAssembled);
        };
        // A handful of nodes is solved before the program is recorded.
        let follow = if n >= LANES && solved.n_drives() > 0 { Follow::record(&solver) } else { None };
        let watch = Watch::new(&watched, &solver.planned_at);
        let (mut strict, mut beyond) = (BTreeMap::new(), BTreeMap::new());
        for (k, seed) in seeds.iter().enumerate() {
            if let Some(state) = solved.restore(&solver, seed.case.coordinates, seed.case.drives) {
                let place = Arc::new(Place { side: watch.side(&state.coordinates), state });
                let wave: &mut BTreeMap<usize, Vec<_>> = if seed.beyond { &mut beyond } else { &mut strict };
                wave.entry(seed.node).or_default().push((Origin::Seed(k), place));
            }
        }
        let (places, status) = (vec![None; n], vec![Status::NotAssembled; n]);
        let mut grid = Grid { solver, follow, watch, shape, drives, places, status, ended: Vec::new() };
        grid.spread(strict.clone(), Wave::Strict, spread);
        for (node, from) in strict {
            beyond.entry(node).or_insert_with(Vec::new).extend(from);
        }
        beyond.retain(|&node, _| grid.status[node] == Status::NotAssembled);
        if spread {
            for (node, place) in grid.places.iter().enumerate() {
                let Some(place) = place.as_ref().filter(|_| grid.status[node] == Status::Ok) else { continue };
                grid.offer(&mut beyond, node, place);
            }
        }
        grid.spread(beyond, Wave::Beyond, spread);
        grid.reached(seeds.len())
    }
}

/// The axis along which neighbours lie.
fn axis_between(shape: &[usize], some: usize, other: usize) -> usize {
    let mut stride = 1;
    for (axis, &size) in shape.iter().enumerate().rev() {
        if some / stride % size != other / stride % size {
            return axis;
        }
        stride *= size;
    }
    0
}

/// The nodes one step away along an axis of the grid.
fn neighbours(shape: &[usize], node: usize) -> Vec<usize> {
    let mut found = Vec::with_capacity(2 * shape.len());
    let mut stride = 1;
    for &size in shape.iter().rev() {
        let place = node / stride % size;
        if place > 0 {
            found.push(node - stride);
        }
        if place + 1 < size {
            found.push(node + stride);
        }
        stride *= size;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{axis_between, neighbours};

    #[test]
    fn neighbours_lie_one_step_away_along_one_axis() {
        assert_eq!(neighbours(&[2, 3], 0), [1, 3]);
        assert_eq!(neighbours(&[2, 3], 4), [3, 5, 1]);
        assert_eq!(neighbours(&[3, 2, 2], 11), [10, 9, 7]);
        assert_eq!(neighbours(&[1], 0), [] as [usize; 0]);
        let axes: Vec<usize> =
            neighbours(&[3, 1, 2], 2).into_iter().map(|other| axis_between(&[3, 1, 2], 2, other)).collect();
        assert_eq!(axes, [2, 0, 0]);
    }
}
