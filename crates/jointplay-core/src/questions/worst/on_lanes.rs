//! Extremes of the output's error, climbed on lanes.
//!
//! One recorded program takes a Newton step of the closure and gives the gradient of the work of a wrench on
//! the output at the pose it starts from; the wrench is the gradient of what is to be maximised, lane by
//! lane. Between steps the offsets move, to the support points of their sets (Frank and Wolfe) or where
//! [`super::worker`] leads, until pose and offsets have converged together. A lane has a start and a measure of
//! its own and takes the next start when it is done; what becomes of a start does not depend on the others.

use crate::closure::newton::Solver;
use crate::closure::recorded::layout::Layout;
use crate::closure::recorded::statics::{gradient, poses_of, record_finish};
use crate::closure::recorded::step::record_step;
use crate::closure::recorded::{SMALL_ANGLE, structure};
use crate::contact::push_on_lanes::{change, push};
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES};
use crate::math::space::Component;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::worker::{Climbed, Next, Pace, Round, Worker};

/// A nominal pose, with its output.
#[derive(Clone, Debug)]
pub struct Site<'a> {
    /// Drive values and nominal coordinates.
    pub case: Case<'a>,
    /// Output at the nominal pose.
    pub reference: Vec<f64>,
}

/// What one lane is to do.
#[derive(Clone, Debug)]
pub struct Task {
    /// Index of the site.
    pub site: usize,
    /// What it climbs, and how.
    pub measure: Measure,
    /// See [`Pace`].
    pub pace: Pace,
    /// Whether it goes on to the last digits.
    pub fine: bool,
    /// Parameter values to start from.
    pub start: Vec<f64>,
}

/// The recorded programs of one mechanism.
#[derive(Clone, Debug)]
pub struct Climb<'m> {
    mechanism: &'m Mechanism,
    layout: Layout,
    step: Program,
    finish: Program,
}

/// A lane's task.
struct Busy<'m> {
    task: usize,
    /// Sign of the pivots' product at the nominal pose; zero until it is known.
    sign: f64,
    worker: Worker<'m>,
}

impl<'m> Climb<'m> {
    /// Records the programs; `None` when the mechanism has no plan or turns too far.
    #[must_use]
    pub fn record(solver: &Solver<'m>) -> Option<Self> {
        let m = solver.mechanism;
        if m.largest_angle() > SMALL_ANGLE {
            return None;
        }
        let layout = Layout::new(m);
        let step = record_climb_step(solver, &layout)?;
        Some(Self { mechanism: m, finish: record_finish(m, &layout, &step), step, layout })
    }

    /// Climbs from all starts. One that does not converge, or whose branch is in doubt, gives
    /// nothing.
    #[inline(always)]
    pub fn solve(&self, sites: &[Site<'_>], tasks: &[Task]) -> Vec<Option<Climbed>> {
        let m = self.mechanism;
        let n_u = m.n_parameters();
        let mut heights = vec![None; tasks.len()];
        let Some(first) = tasks.first() else { return heights };
        // Of both programs; the offsets come first.
        let mut registers = self.finish.registers(&[]);
        self.step.put_common(&mut registers, &[]);
        // Where whole steps lead.
        let mut pushed = vec![Block::splat(0.0); n_u];
        let mut errors = vec![Block::splat(0.0); m.size()];
        let mut lanes: [Option<Busy<'_>>; LANES] = std::array::from_fn(|_| None);
        // Lanes that never get a task repeat the first.
        (0..LANES).for_each(|lane| self.load(sites, first, lane, &mut registers));
        let mut next = 0;

        let inputs = n_u + self.layout.n_varying();
        let state = self.layout.n_state();
        let (moved, pivots, force, gradient) = (state, state + 1, state + 2, state + 3);
        loop {
            interrupt::check();
            for lane in 0..LANES {
                if lanes[lane].is_none() && next < tasks.len() {
                    let worker = Worker::new(m, tasks[next].measure, tasks[next].pace, tasks[next].fine);
                    lanes[lane] = Some(Busy { task: next, sign: 0.0, worker });
                    self.load(sites, &tasks[next], lane, &mut registers);
                    self.aim(tasks[next].measure, lane, &errors, &mut registers[inputs..]);
                    next += 1;
                }
            }
            if lanes.iter().all(Option::is_none) {
                return heights;
            }
            self.finish.run(&mut registers);
            for (k, error) in errors.iter_mut().enumerate() {
                *error = *self.finish.output(&registers, k);
            }
            for (lane, busy) in lanes.iter().enumerate() {
                let Some(busy) = busy else { continue };
                let reference = &sites[tasks[busy.task].site].reference[..m.n_translations()];
                errors.iter_mut().zip(reference).for_each(|(e, r)| e.0[lane] -= r);
                if busy.worker.turns() {
                    self.aim(busy.worker.measure(), lane, &errors, &mut registers[inputs..]);
                }
            }
            self.step.run(&mut registers);
            let out = |k: usize| self.step.output(&registers, k);
            let asking: [bool; LANES] = std::array::from_fn(|i| lanes[i].as_ref().is_some_and(|b| b.worker.asks()));
            let mut changed = Block::splat(0.0);
            if asking.contains(&true) {
                pushed.copy_from_slice(&registers[..n_u]);
                push(m, None, |p| out(gradient + p), out(force), &registers, &mut pushed);
                changed = change(m, &registers[..n_u], &pushed);
            }
            let mut follows = [false; LANES];
            let mut tried = Vec::new();
            for (lane, slot) in lanes.iter_mut().enumerate() {
                let Some(busy) = slot else { continue };
                let at = |b: &Block| b.0[lane];
                if busy.sign == 0.0 {
                    busy.sign = at(out(pivots));
                }
                let sure = at(out(moved)) <= m.small_step() * m.small_step() && at(out(pivots)) * busy.sign > 0.0;
                let round = Round {
                    lane,
                    moved: at(out(moved)),
                    change: at(&changed),
                    force: at(out(force)),
                    offsets: &registers[..n_u],
                    errors: &errors,
                    program: &self.step,
                    registers: &registers,
                    gradient,
                };
                match if sure { busy.worker.after(&round) } else { Next::Done(None) } {
                    Next::Stay => {}
                    Next::Push => follows[lane] = true,
                    Next::Try(to) => tried.push((lane, to)),
                    Next::Done(climbed) => {
                        heights[busy.task] = climbed;
                        *slot = None;
                    }
                }
            }
            for (offset, to) in registers.iter_mut().zip(&pushed) {
                *offset = to.where_else(&follows, offset);
            }
            for (lane, to) in tried {
                registers.iter_mut().zip(to).for_each(|(o, t)| o.0[lane] = t);
            }
        }
    }

    /// Puts a task's nominal pose and start into a lane.
    #[inline(always)]
    fn load(&self, sites: &[Site<'_>], task: &Task, lane: usize, registers: &mut [Block]) {
        let case = &sites[task.site].case;
        Layout::load(self.mechanism, case.coordinates, case.drives, registers, lane);
        registers.iter_mut().zip(&task.start).for_each(|(o, s)| o.0[lane] = *s);
    }

    /// Puts the wrench of one lane.
    #[inline(always)]
    fn aim(&self, measure: Measure, lane: usize, errors: &[Block], wrench: &mut [Block]) {
        let m = self.mechanism;
        let mut error = [0.0; 6];
        error.iter_mut().zip(errors).for_each(|(e, block)| *e = block.0[lane]);
        let [force, moment] = measure.wrench(m.space, &error[..errors.len()]);
        for (slot, component) in wrench.iter_mut().zip(m.space.components()) {
            slot.0[lane] = match component {
                Component::Along(k) => force[*k],
                Component::About(k) => moment[*k],
            };
        }
    }
}

fn record_climb_step(solver: &Solver<'_>, layout: &Layout) -> Option<Program> {
    let m = solver.mechanism;
    let recorder = Recorder::new(SMALL_ANGLE, &structure("climb", solver));
    let symbolic = layout.varying(m, &recorder);
    let step = record_step(solver, &symbolic, &layout.turn(m, &recorder))?;
    let first = m.n_parameters() + layout.n_varying();
    let (mut force, mut moment) = ([Symbol::Constant(0.0); 3], [Symbol::Constant(0.0); 3]);
    for (k, component) in m.space.components().iter().enumerate() {
        match component {
            Component::Along(i) => force[*i] = recorder.varying(first + k),
            Component::About(i) => moment[*i] = recorder.varying(first + k),
        }
    }
    let poses = poses_of(m, &symbolic);
    let mut cost = m.no_cost();
    m.add_output_wrench(force, moment, &poses, &symbolic.inputs.parameters, &mut cost);
    let (slope, multipliers) = gradient(m, &step.linear, &poses, &symbolic.inputs.parameters, cost);
    let mut outputs = step.numbers;
    outputs.extend(step.turn);
    outputs.extend([step.size, step.pivots, m.largest_force(&multipliers)]);
    outputs.extend(slope);
    Some(Program::new(&recorder, first + m.size(), &outputs, layout.state(m)))
}
