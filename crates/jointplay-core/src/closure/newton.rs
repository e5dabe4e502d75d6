//! Newton's method on the loop closure and continuation along a change of the inputs.

use std::borrow::Cow;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::closure::coupling::Mesh;
use crate::closure::equations::Inputs;
use crate::closure::train::Train;
use crate::interrupt;
use crate::math::decomposition::largest_eigenpair;
use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::math::sparse::{Elimination, Factored};
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Row};

/// The estimate of the smallest singular value must clear the limit by this factor, or it is computed.
pub(crate) const CLEAR: f64 = 4.0;

/// Newton steps per solve.
const NEWTON_STEPS: usize = 14;
/// A Newton step (length-scaled) below this is the last: the next would be its square.
const LAST_STEP: f64 = 1e-9;
/// The largest move (length-scaled; radians) taken at once, so that the branch is not left.
const LARGEST_MOVE: f64 = 0.35;
/// Continuation gives up when a step of this part of the way, or of a radian of a drive that turns farther, fails; ...
const SMALLEST_PART: f64 = 1e-6;
/// ... where it has not left a state that may be near the end of a branch, or is near its aim, this one.
const FINEST_PART: f64 = 1e-12;
/// What is left of a step that fails. Halves would meet in the middle of the way, where a singular state often is.
const SHORTER: f64 = 0.49;
/// So many steps of the last size before the aim is near.
const NEAR: f64 = 64.0;
/// A correction that is a larger part of the one before it tells that the next state is nearly singular, ...
pub(crate) const QUADRATIC: f64 = 0.3;
/// ... unless that one is below this.
const FINE: f64 = 1e3 * LAST_STEP;
/// Corrections of a step across a singular state, as a part of the move, where the branch goes straight on.
const STRAIGHT: f64 = 0.02;
/// Parts of a way across a singular state at which it is divided; none is in the middle, where that state often is.
const DIVISIONS: [f64; 3] = [0.38, 0.63, 0.45];
/// A singular state that is crossed in a move of this size (length-scaled; radians) has been enclosed: what is missing
/// there to be assembled is the square of it at most, which is rounding.
const ENCLOSED: f64 = 1e-5;
/// Inverse iterations for the smallest singular value, at most, ...
const INVERSE_ITERATIONS: usize = 100;
/// ... and after how many it is seen whether they have converged.
const CHECKED: usize = 4;
/// Continuation gives up after this many steps, or after this many for every turn of a drive, ...
const MOST_STEPS: usize = 600;
/// ... up to this many turns. ...
const MOST_TURNS: f64 = 2000.0;
/// ... A step in which something moves by this part of the largest move gets on: what a gear drives may make many turns
/// for one of the drive, and a screw go far. Of them there may be so many times as many.
const STRIDE: f64 = 0.2;
const STRIDES: usize = 100;

/// The Newton steps that a search may still take; it ends when they are spent.
#[derive(Clone, Debug)]
pub struct Budget(usize);

impl Budget {
    /// So many steps.
    #[must_use]
    pub const fn of(steps: usize) -> Self {
        Self(steps)
    }

    /// How many are left.
    #[must_use]
    pub const fn left(&self) -> usize {
        self.0
    }

    /// Whether nothing is left.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.0 == 0
    }

    /// Takes a step; `None` where nothing is left.
    fn take(&mut self) -> Option<()> {
        self.0 = self.0.checked_sub(1)?;
        Some(())
    }
}

/// An assembled mechanism.
#[derive(Clone, Debug)]
pub struct State {
    /// Coordinates of all bodies.
    pub coordinates: Vec<f64>,
    /// The inputs that it is closed for.
    pub inputs: Inputs<f64>,
    /// Sign of the determinant of the closure Jacobian: it tells assembly branches apart.
    pub negative: bool,
}

/// What becomes of a step on a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// It is a part of the way.
    Taken,
    /// It is too long.
    Shorter,
    /// The way ends here.
    End,
}

/// Where Newton's method begins.
struct Begun<'m> {
    coordinates: Vec<f64>,
    mesh: Mesh<'m>,
    /// The size of its first step, if that has been taken.
    moved: Option<f64>,
}

impl<'m> Begun<'m> {
    fn at(m: &'m Mechanism, coordinates: Vec<f64>, inputs: &Inputs<f64>) -> Self {
        Self { mesh: Mesh::new(m, &coordinates, &inputs.parameters), coordinates, moved: None }
    }
}

/// What a converged Newton solve did.
struct Converged {
    first_move: f64,
    later_moves: f64,
    /// The largest correction as a part of the one before it.
    slowest: f64,
    negative: bool,
}

impl Converged {
    /// Whether it is known which branch has been found. Where two of them cross, Newton's method halves what is left in
    /// every step, and rounding decides on which of them it ends.
    fn is_clear(&self) -> bool {
        self.slowest <= QUADRATIC
    }
}

/// The closure Jacobian at a state, factored.
pub struct Linearised<'a> {
    /// Poses of all bodies.
    pub poses: Vec<Pose<f64>>,
    /// The parameters that it was linearised at.
    pub parameters: Vec<f64>,
    /// The factors.
    pub factors: Factored<'a>,
}

/// Solves the closure of one mechanism with as many rows as unknowns.
#[derive(Clone, Debug)]
pub struct Solver<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism,
    pub(crate) pattern: Vec<(usize, usize)>,
    /// Where the entries of the pattern stand among the row derivatives.
    pub(crate) picks: Vec<usize>,
    pub(crate) plan: Option<Elimination>,
    /// The coordinates near which it was planned.
    pub(crate) planned_at: Vec<f64>,
    /// What turns in bearings of its own, where anything does.
    train: Option<Train>,
}

impl<'m> Solver<'m> {
    /// Plans the elimination near the given coordinates.
    #[must_use]
    pub fn new(mechanism: &'m Mechanism, coordinates: &[f64]) -> Self {
        let size = mechanism.size();
        let mut pattern = Vec::new();
        let mut picks = Vec::new();
        let sparse = structure(mechanism, coordinates);
        for row in 0..mechanism.n_rows() {
            for (side, body) in mechanism.row_bodies(row).into_iter().enumerate() {
                let Some(b) = body else { continue };
                for c in 0..size {
                    let pick = mechanism.side(row, side) * size + c;
                    if sparse[pick] {
                        pattern.push((row, b * size + c));
                        picks.push(pick);
                    }
                }
            }
        }
        let mut solver = Self {
            mechanism,
            pattern,
            picks,
            plan: None,
            planned_at: coordinates.to_vec(),
            train: Train::new(mechanism),
        };
        let inputs = Inputs::nominal(mechanism, &vec![0.0; mechanism.n_drives()]);
        let (_, derivatives) = solver.evaluate(&mechanism.poses(coordinates), &inputs);
        let entries: Vec<_> =
            solver.pattern.iter().zip(&solver.picks).map(|(&(i, j), &p)| (i, j, derivatives[p])).collect();
        solver.plan = Elimination::plan(mechanism.n_unknowns(), &entries);
        solver
    }

    fn evaluate(&self, poses: &[Pose<f64>], inputs: &Inputs<f64>) -> (Vec<f64>, Vec<f64>) {
        self.mechanism.evaluated(poses, &inputs.commands(self.mechanism))
    }

    fn factor(&self, derivatives: &[f64]) -> Option<Factored<'_>> {
        let entries = self.picks.iter().map(|&p| derivatives[p]);
        Factored::new(self.plan.as_ref(), self.mechanism.n_unknowns(), &self.pattern, entries)
    }

    /// Whether the planned elimination suits the numbers at some coordinates.
    fn suits(&self, coordinates: &[f64]) -> bool {
        let m = self.mechanism;
        let (_, derivatives) = self.evaluate(&m.poses(coordinates), &Inputs::nominal(m, &vec![0.0; m.n_drives()]));
        let entries = self.picks.iter().map(|&p| derivatives[p]);
        self.plan.as_ref().is_some_and(|plan| plan.factor(entries).is_some())
    }

    /// This solver or, at coordinates that its elimination does not suit, one that is planned there, where it can be: after a
    /// quarter of a turn a pivot may vanish, and without a plan of its own every step would be planned anew.
    pub(crate) fn suiting(&self, coordinates: &[f64]) -> Cow<'_, Self> {
        if coordinates.iter().any(|c| !c.is_finite()) || self.suits(coordinates) {
            return Cow::Borrowed(self);
        }
        let own = Self::new(self.mechanism, coordinates);
        if own.plan.is_some() { Cow::Owned(own) } else { Cow::Borrowed(self) }
    }

    /// Solvers that suit the cases, this one first, each with the numbers of its cases.
    pub(crate) fn suiting_each(&self, cases: &[Case<'_>]) -> Vec<(Cow<'_, Self>, Vec<usize>)> {
        let mut all = vec![(Cow::Borrowed(self), Vec::new())];
        for (number, case) in cases.iter().enumerate() {
            let later = all[1..].iter().position(|(solver, _)| solver.suits(case.coordinates));
            let suiting = self.suiting(case.coordinates);
            match (suiting, later) {
                (Cow::Borrowed(_), _) => all[0].1.push(number),
                (_, Some(place)) => all[place + 1].1.push(number),
                (own, None) => all.push((own, vec![number])),
            }
        }
        all
    }

    /// The factored Jacobian at a state; `None` where it is singular to working precision.
    #[must_use]
    pub fn linearise(&self, state: &State) -> Option<Linearised<'_>> {
        let poses = self.mechanism.poses(&state.coordinates);
        let (_, derivatives) = self.evaluate(&poses, &state.inputs);
        Some(Linearised { factors: self.factor(&derivatives)?, parameters: state.inputs.parameters.clone(), poses })
    }

    /// Largest residual, in characteristic lengths and radians.
    pub(crate) fn residual(&self, coordinates: &[f64], inputs: &Inputs<f64>) -> f64 {
        let m = self.mechanism;
        let (residual, _) = self.evaluate(&m.poses(coordinates), inputs);
        m.rows.iter().zip(&residual).fold(0.0, |largest: f64, (row, r)| {
            let size = r.abs() / m.unit(row.component);
            if size > largest || size.is_nan() { size } else { largest }
        })
    }

    /// The coordinates of a state moved to inputs nearby by steps with the factors at that state.
    pub(crate) fn chord(
        &self,
        linearised: &Linearised<'_>,
        state: &State,
        inputs: &Inputs<f64>,
        steps: usize,
    ) -> Vec<f64> {
        let m = self.mechanism;
        let commands = inputs.commands(m);
        let (mut coordinates, mut step) = (state.coordinates.clone(), vec![0.0; m.n_unknowns()]);
        for _ in 0..steps {
            let (mut residual, _) = m.evaluated(&m.poses(&coordinates), &commands);
            for r in &mut residual {
                *r = -*r;
            }
            linearised.factors.solve(&mut residual, &mut step);
            m.retract(&mut coordinates, &step);
        }
        coordinates
    }

    /// One Newton step; `None` where the Jacobian is singular.
    pub(crate) fn newton_step(&self, coordinates: &[f64], inputs: &Inputs<f64>) -> Option<Vec<f64>> {
        let m = self.mechanism;
        let (residual, derivatives) = self.evaluate(&m.poses(coordinates), inputs);
        let mut right: Vec<f64> = residual.iter().map(|r| -r).collect();
        let mut step = vec![0.0; m.n_unknowns()];
        self.factor(&derivatives)?.solve(&mut right, &mut step);
        Some(step)
    }

    /// Steps until they vanish; given up as soon as `is_in_vain`, told the first move and the sum of the later ones.
    fn newton(
        &self,
        begun: Begun<'_>,
        inputs: &Inputs<f64>,
        mut budget: Option<&mut Budget>,
        is_in_vain: impl Fn(f64, f64) -> bool,
    ) -> Option<(Vec<f64>, Converged)> {
        let m = self.mechanism;
        interrupt::check();
        let commands = inputs.commands(m);
        let Begun { mut coordinates, mut mesh, moved } = begun;
        let (mut first_move, mut later_moves, mut slowest) = (moved.unwrap_or(0.0), 0.0, 0.0_f64);
        let mut last = moved.unwrap_or(f64::INFINITY);
        let mut step = vec![0.0; m.n_unknowns()];
        for k in usize::from(moved.is_some())..NEWTON_STEPS {
            if let Some(budget) = &mut budget {
                budget.take()?;
            }
            let (mut residual, derivatives) = m.evaluated(&m.poses(&coordinates), &commands);
            if !mesh.is_kept(&residual) {
                return None;
            }
            let factors = self.factor(&derivatives)?;
            for r in &mut residual {
                *r = -*r;
            }
            factors.solve(&mut residual, &mut step);
            let size = m.scaled_size(&step);
            // Written so that NaN fails, too.
            if !(size <= LARGEST_MOVE) {
                return None;
            }
            if size > 2.0 * last && size > LAST_STEP {
                return None;
            }
            if k >= 2 && last > FINE {
                slowest = slowest.max(size / last);
            }
            *(if k == 0 { &mut first_move } else { &mut later_moves }) += size;
            if is_in_vain(first_move, later_moves) {
                return None;
            }
            m.retract(&mut coordinates, &step);
            mesh.moves(&coordinates, &inputs.parameters);
            last = size;
            if size < LAST_STEP {
                if m.jams(&coordinates, &inputs.parameters) {
                    return None;
                }
                let converged = Converged { first_move, later_moves, slowest, negative: factors.negative() };
                return Some((coordinates, converged));
            }
        }
        None
    }

    /// A way to other inputs, with its first step where wheels may turn fast in it; `None` where it is too long.
    fn begin(&self, from: &State, inputs: &Inputs<f64>, budget: Option<&mut Budget>) -> Option<Begun<'m>> {
        let m = self.mechanism;
        let Some(train) = &self.train else { return Some(Begun::at(m, from.coordinates.clone(), inputs)) };
        if let Some(budget) = budget {
            budget.take()?;
        }
        // The rows know angles up to full turns: drives enter by how far they go.
        let held = Inputs { drives: from.inputs.drives.clone(), parameters: inputs.parameters.clone() };
        let (residual, derivatives) = self.evaluate(&m.poses(&from.coordinates), &held);
        let mut right: Vec<f64> = residual.iter().map(|r| -r).collect();
        for (row, _, by) in m.rows_of_drives() {
            right[row] += by.coefficient * (inputs.drives[by.drive] - from.inputs.drives[by.drive]);
        }
        let mut twists = vec![0.0; m.n_unknowns()];
        self.factor(&derivatives)?.solve(&mut right, &mut twists);
        let size = m.scaled_size(&twists);
        // Written so that NaN fails, too.
        if !(train.size(m, &twists) <= LARGEST_MOVE && size < f64::INFINITY) {
            return None;
        }
        let coordinates = train.moved(m, &from.coordinates, &twists);
        let mut mesh = Mesh::new(m, &from.coordinates, &inputs.parameters);
        mesh.moves_by([&from.coordinates, &coordinates], &inputs.parameters, &twists, residual);
        Some(Begun { coordinates, mesh, moved: Some(size.min(LARGEST_MOVE)) })
    }

    /// Closes the mechanism from a nearby state in one go; the branch is kept when the sign of the
    /// determinant is.
    #[must_use]
    pub fn close(&self, from: &State, inputs: &Inputs<f64>) -> Option<State> {
        self.close_within(from, inputs, None)
    }

    fn close_within(&self, from: &State, inputs: &Inputs<f64>, budget: Option<&mut Budget>) -> Option<State> {
        self.stride_within(from, inputs, budget).map(|(state, _)| state)
    }

    /// The same with the first move.
    fn stride_within(
        &self,
        from: &State,
        inputs: &Inputs<f64>,
        mut budget: Option<&mut Budget>,
    ) -> Option<(State, f64)> {
        let is_calm = |first_move: f64, later_moves: f64| later_moves <= 0.5 * first_move + LAST_STEP;
        // The sum of the moves only grows: what is not calm on the way is not at the end, and nothing is lost by giving
        // it up. A limited search goes on all the same: its work is counted in steps, and with fewer of them on what
        // is in vain it would get farther, that is, find something else.
        let is_limited = budget.is_some();
        let is_in_vain = |first_move, later_moves| !is_limited && !is_calm(first_move, later_moves);
        let begun = self.begin(from, inputs, budget.as_deref_mut())?;
        let (coordinates, converged) = self.newton(begun, inputs, budget, is_in_vain)?;
        let calm = is_calm(converged.first_move, converged.later_moves) && converged.is_clear();
        let state = State { coordinates, inputs: inputs.clone(), negative: converged.negative };
        let is_kept = calm && (state.negative == from.negative || self.goes_straight_on(from, &converged, inputs));
        is_kept.then_some((state, converged.first_move))
    }

    /// Whether a step that has changed the sign of the determinant leads across a singular state where the branch goes
    /// straight on (a change point).
    ///
    /// There corrections are small beside the move, however short the way is on which it is crossed. Where two branches
    /// only come near each other, or end on both sides of a gap, a long step gets from one to the other with small
    /// corrections, too, but a short one does not.
    fn goes_straight_on(&self, from: &State, converged: &Converged, to: &Inputs<f64>) -> bool {
        let step = |from: &State, inputs: &Inputs<f64>| {
            let (coordinates, converged) = self.newton(self.begin(from, inputs, None)?, inputs, None, |_, _| false)?;
            let straight = converged.later_moves <= STRAIGHT * converged.first_move + LAST_STEP;
            let state = State { coordinates, inputs: inputs.clone(), negative: converged.negative };
            (straight && converged.is_clear()).then_some((state, converged.first_move))
        };
        let (mut before, mut after, mut size) = (from.clone(), to.clone(), converged.first_move);
        let mut crosses = converged.later_moves <= STRAIGHT * converged.first_move;
        while crosses && size > ENCLOSED {
            let divide = |part: &f64| step(&before, &between(&before.inputs, &after, *part));
            let Some((between, moved)) = DIVISIONS.iter().find_map(divide) else { return false };
            if between.negative == from.negative {
                before = between;
                let across = step(&before, &after);
                crosses = across.as_ref().is_some_and(|(state, _)| state.negative != from.negative);
                size = across.map_or(0.0, |(_, size)| size);
            } else {
                (after, size) = (between.inputs, moved);
            }
        }
        crosses
    }

    /// Polishes a state that already closes up to rounding.
    #[must_use]
    pub fn polish(&self, coordinates: &[f64], inputs: &Inputs<f64>) -> Option<State> {
        let begun = Begun::at(self.mechanism, coordinates.to_vec(), inputs);
        let (coordinates, converged) = self.newton(begun, inputs, None, |_, _| false)?;
        Some(State { coordinates, inputs: inputs.clone(), negative: converged.negative })
    }

    /// Follows the assembly branch from a state to other inputs, in adaptive steps.
    ///
    /// # Errors
    /// `NotAssembled` where the branch ends before the inputs are reached, `Singular` where it starts
    /// at a singular state.
    pub fn follow(&self, from: &State, to: &Inputs<f64>) -> Result<State, Status> {
        self.follow_part(from, to).map_err(|(_, status)| status)
    }

    /// As [`Self::follow`], giving the last state reached with the failure.
    pub(crate) fn follow_part(&self, from: &State, to: &Inputs<f64>) -> Result<State, (State, Status)> {
        self.follow_in_parts(from, to, None, &mut |_, _| Step::Taken)
    }

    /// As [`Self::follow_part`], by steps from one state to another that are accepted.
    pub(crate) fn follow_accepted(
        &self,
        from: &State,
        to: &Inputs<f64>,
        accept: &mut dyn FnMut(&State, &State) -> Step,
    ) -> Result<State, (State, Status)> {
        self.follow_in_parts(from, to, None, accept)
    }

    /// As [`Self::follow_part`], as far as the budget reaches.
    pub(crate) fn follow_within(
        &self,
        from: &State,
        to: &Inputs<f64>,
        budget: &mut Budget,
    ) -> Result<State, (State, Status)> {
        self.follow_in_parts(from, to, Some(budget), &mut |_, _| Step::Taken)
    }

    fn follow_in_parts(
        &self,
        from: &State,
        to: &Inputs<f64>,
        mut budget: Option<&mut Budget>,
        accept: &mut dyn FnMut(&State, &State) -> Step,
    ) -> Result<State, (State, Status)> {
        let mut state = from.clone();
        if from.inputs == *to {
            return Ok(from.clone());
        }
        let most = self.largest_part(&from.inputs, to);
        let (mut done, mut part) = (0.0_f64, most);
        let enough = self.most_steps(&from.inputs, to);
        let (mut steps, mut strides) = (0_usize, 0);
        while steps < enough && strides < STRIDES * enough {
            steps += 1;
            let last = done + part >= 1.0;
            let inputs = if last { to.clone() } else { between(&from.inputs, to, done + part) };
            let next = self.stride_within(&state, &inputs, budget.as_deref_mut());
            let step = next.as_ref().map_or(Step::Shorter, |(next, _)| accept(&state, next));
            if step == Step::End {
                break;
            }
            if let Some((next, moved)) = next.filter(|_| step == Step::Taken) {
                state = next;
                if last {
                    return Ok(state);
                }
                if moved > STRIDE * LARGEST_MOVE {
                    // Neither it nor the longer one counts that was tried before it and failed.
                    strides += 1;
                    steps = steps.saturating_sub(2);
                }
                done += part;
                part = (2.0 * part).min(most);
            } else {
                part *= SHORTER;
                let is_near = done == 0.0 || 1.0 - done <= NEAR * part;
                let smallest = if is_near { FINEST_PART } else { SMALLEST_PART };
                if part < smallest * most || budget.as_ref().is_some_and(|budget| budget.is_spent()) {
                    break;
                }
            }
        }
        let status = if self.linearise(&state).is_some() { Status::NotAssembled } else { Status::Singular };
        Err((state, status))
    }

    /// Whether a row is in the bearing of a wheel.
    fn spins(&self, row: &Row) -> bool {
        self.train.as_ref().is_some_and(|train| train.is_bearing(self.mechanism, row))
    }

    /// The part of a change of the inputs in which no driven angle turns by more than a radian, but those of wheels
    /// in their bearings: beyond half a turn a joint's angle would be taken for its remainder.
    fn largest_part(&self, from: &Inputs<f64>, to: &Inputs<f64>) -> f64 {
        let turns = self.mechanism.driven().map(|(row, by)| match row.component {
            Component::Along(_) => 0.0,
            Component::About(_) if self.spins(row) => 0.0,
            Component::About(_) => (by.coefficient * (to.drives[by.drive] - from.drives[by.drive])).abs(),
        });
        1.0 / turns.fold(1.0, f64::max)
    }

    /// Steps after which a continuation between inputs gives up.
    fn most_steps(&self, from: &Inputs<f64>, to: &Inputs<f64>) -> usize {
        let turns = (self.largest_part(from, to) * TAU).recip().clamp(1.0, MOST_TURNS);
        MOST_STEPS * turns.ceil() as usize
    }
}

impl Mechanism {
    /// Smallest singular value of the length-scaled Jacobian S with its motion (length-scaled), by Lanczos' iteration on
    /// `(S^T S)^-1` until what is left of an eigenvector is no more than a part of it; never too small.
    pub(crate) fn inverse_iteration(&self, factors: &Factored<'_>, still: f64) -> (f64, Vec<f64>) {
        let n = self.n_unknowns();
        let row_unit = |k: usize| self.unit(self.rows[k].component);
        let column_unit = |j: usize| self.unit(self.space.components()[j % self.size()]);
        let mut x = vec![0.0; n];
        let mut applied = |motion: &DVector<f64>| {
            // The scaled matrix is R^-1 J C: first its transposed inverse, then its inverse.
            let mut right: Vec<f64> = motion.iter().enumerate().map(|(j, v)| v / column_unit(j)).collect();
            factors.solve_transposed(&mut right, &mut x);
            let mut right: Vec<f64> = x.iter().enumerate().map(|(k, v)| v * row_unit(k) * row_unit(k)).collect();
            factors.solve(&mut right, &mut x);
            DVector::from_iterator(n, x.iter().enumerate().map(|(j, v)| v / column_unit(j)))
        };
        let most = n.min(INVERSE_ITERATIONS);
        let mut basis = vec![DVector::from_fn(n, |j, _| (j as f64 * 0.618_034).fract() - 0.5).normalize()];
        let mut projected = DMatrix::zeros(most, most);
        for k in 0..most {
            let mut next = applied(&basis[k]);
            projected[(k, k)] = next.dot(&basis[k]);
            // Twice, so that rounding leaves nothing of the others.
            for known in basis.iter().chain(&basis) {
                next.axpy(-known.dot(&next), known, 1.0);
            }
            let left = next.norm();
            let is_last = k + 1 == most || left == 0.0;
            if is_last || k % CHECKED == CHECKED - 1 {
                let Some((value, part)) = largest_eigenpair(projected.view((0, 0), (k + 1, k + 1)).into_owned()) else {
                    break;
                };
                if is_last || left * part[k].abs() <= still * value {
                    let motion =
                        basis.iter().zip(part.iter()).fold(DVector::zeros(n), |sum, (v, part)| sum + v * *part);
                    return (1.0 / value.sqrt(), motion.as_slice().to_vec());
                }
            }
            (projected[(k + 1, k)], projected[(k, k + 1)]) = (left, left);
            basis.push(next / left);
        }
        (0.0, vec![0.0; n])
    }

    /// An estimate of the smallest singular value of the length-scaled Jacobian J, never too small: with x the motion `J^-1 b`
    /// for a vector b without a pattern, `|x| / |J^-T x|`. Near a singular pose x is mostly its motion, so that the estimate
    /// is too large by a few per cent only.
    pub(crate) fn singular_estimate(&self, linearised: &Linearised<'_>) -> f64 {
        let factors = &linearised.factors;
        self.singular_square(|b, x| factors.solve(b, x), |b, x| factors.solve_transposed(b, x)).sqrt()
    }

    /// The square of [`Self::singular_estimate`], with what solves `J x = b` and its transposed.
    pub(crate) fn singular_square<S: Real>(
        &self,
        solve: impl Fn(&mut [S], &mut [S]),
        solve_transposed: impl Fn(&mut [S], &mut [S]),
    ) -> S {
        let number = S::from_f64;
        let zero = || vec![number(0.0); self.n_unknowns()];
        let unit = |j: usize| self.unit(self.space.components()[j % self.size()]);
        let square = |sum: S, v: S| sum + v * v;
        let (mut motion, mut multipliers) = (zero(), zero());
        let mut probe: Vec<S> = self.probe().map(number).collect();
        solve(&mut probe, &mut motion);
        let scaled: Vec<S> = motion.iter().enumerate().map(|(j, v)| *v * number(1.0 / unit(j))).collect();
        let mut cost: Vec<S> = scaled.iter().enumerate().map(|(j, v)| *v * number(1.0 / unit(j))).collect();
        solve_transposed(&mut cost, &mut multipliers);
        let forces = multipliers.iter().zip(&self.rows).map(|(l, row)| *l * number(self.unit(row.component)));
        scaled.into_iter().fold(number(0.0), square) / forces.fold(number(0.0), square)
    }

    /// A vector without a pattern, with the rows' units. Its entries differ in size, too: where legs are alike, entries of
    /// one size cancel in what a singular pose leaves without force.
    fn probe(&self) -> impl Iterator<Item = f64> + '_ {
        self.rows.iter().enumerate().map(move |(k, row)| {
            let sign = if (k as f64 * 0.618_034).fract() < 0.5 { 1.0 } else { -1.0 };
            sign * (0.5 + (k as f64 * 0.754_878).fract()) * self.unit(row.component)
        })
    }

    /// Moves all bodies by small twists.
    pub(crate) fn retract(&self, coordinates: &mut [f64], twists: &[f64]) {
        let bodies = coordinates.chunks_exact_mut(self.space.n_coordinates());
        for (c, t) in bodies.zip(twists.chunks_exact(self.size())) {
            self.space.retract(c, t);
        }
    }
}

/// Which row derivatives are not zero by structure: evaluated at generic poses, so that no accidental
/// zero of one configuration is taken for a structural one.
fn structure(mechanism: &Mechanism, coordinates: &[f64]) -> Vec<bool> {
    let inputs = Inputs {
        drives: vec![0.1; mechanism.n_drives()],
        parameters: vec![1e-3 * mechanism.length; mechanism.n_parameters()],
    };
    let mut residual = vec![0.0; mechanism.n_rows()];
    let mut derivatives = vec![0.0; mechanism.n_derivatives()];
    let mut found = vec![false; derivatives.len()];
    for k in 1..=3_u32 {
        let mut moved = coordinates.to_vec();
        for (i, c) in (0_u32..).zip(moved.iter_mut()) {
            // Irrational strides: any numbers without a pattern would do.
            *c += (f64::from(k) * 0.754_877 + f64::from(i) * 0.569_840).fract() * mechanism.length.max(1.0);
        }
        mechanism.evaluate(&mechanism.poses(&moved), &inputs.commands(mechanism), &mut residual, &mut derivatives);
        found.iter_mut().zip(&derivatives).for_each(|(f, d)| *f |= *d != 0.0);
    }
    // A curve may be level wherever it was tried.
    let width = mechanism.n_sides * mechanism.size();
    for (row, found) in mechanism.rows.iter().zip(found.chunks_exact_mut(width.max(1))) {
        if mechanism.joints[row.joint].follows.is_some() {
            found.fill(true);
        }
    }
    found
}

/// Inputs a part of the way from some to others.
pub(crate) fn between(from: &Inputs<f64>, to: &Inputs<f64>, t: f64) -> Inputs<f64> {
    let mix = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect();
    Inputs { drives: mix(&from.drives, &to.drives), parameters: mix(&from.parameters, &to.parameters) }
}

#[cfg(test)]
mod tests;
