//! Semismooth Newton method on the contact conditions, for where whole steps do not settle.
//!
//! In the sets' own coordinates y, with the forces s(y) along them, contact and reactions agree where
//!
//! ```text
//! y = P(y + t s(y))
//! ```
//!
//! with P the projection onto the sets and any t > 0 for each of them (Facchinei and Pang, Finite-Dimensional
//! Variational Inequalities, 2003, 1.5). P is smooth but for kinks, so that Newton's method, with the
//! derivative B of P on the side where z = y + t s lies, converges as on equations (Qi and Sun, Math. Program.
//! 58, 1993, 353):
//!
//! ```text
//! (1 - B (1 + t ds/dy)) d = P(z) - y
//! ```
//!
//! Where a force is beyond doubt, z is far outside, B is zero, and the step leads to the support point.
//! Where two corners compete, or a pin floats, z lies within a face, and the step looks for the place on it
//! where the forces balance. The derivative ds/dy is exact, along the coordinates that move.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::clearance::offset::{MAX_SIZE, inner};
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::newton::{Solver, State};
use crate::closure::second_order::Along;
use crate::contact::state::Contact;
use crate::interrupt;
use crate::mechanism::Source;

/// Steps at most.
const STEPS: usize = RENEWED * HOLDS.len();
/// What tells how stiff a force is: a move of at least this part of a set.
const MOVED: f64 = 1e-2;
/// Contact and reactions agree where no coordinate wants to move by more than this part of its set.
const STILL: f64 = 1e-11;
/// The same where nothing better is reached.
const SETTLED: f64 = 1e-6;
/// Largest hold on a step, for one set of derivatives after the other: a strong hold keeps steps off places where
/// the forces balance all the same, a weak one lets them go far where the forces hardly change.
const HOLDS: [f64; 4] = [1e-6, 1e-8, 1e-4, 1e-6];
/// Step along a force that leads to the support point.
const FAR: f64 = 1e6;
/// A step that leaves no more than this part of what was left is good.
const NEARER: f64 = 0.3;
/// Steps that one set of derivatives serves. Since the play is small they hardly change.
const RENEWED: usize = 10;

/// The method with what it knows about how forces change.
pub(crate) struct Newton<'s, 'm> {
    solver: &'s Solver<'m>,
    unforced: &'s [Unforced],
    /// Per source, the largest change of a force beside the move that made it.
    stiffness: Vec<f64>,
}

/// How forces change along the coordinates that have moved so far.
type Bends = BTreeMap<usize, Vec<f64>>;

/// Own coordinates and the forces along them.
struct Own {
    y: Vec<f64>,
    s: Vec<f64>,
}

/// What the projection makes of a point.
struct Projected {
    /// What is left to go to its projection.
    residual: Vec<f64>,
    /// Step length along the force, per coordinate.
    t: Vec<f64>,
    /// Derivative of the projection: a row per coordinate, with the first coordinate of its source; none
    /// where it is zero.
    elements: Vec<Option<(usize, [f64; MAX_SIZE])>>,
}

impl<'s, 'm> Newton<'s, 'm> {
    pub fn new(solver: &'s Solver<'m>, unforced: &'s [Unforced]) -> Self {
        Self { solver, unforced, stiffness: vec![0.0; solver.mechanism.sources().len()] }
    }

    fn sources(&self) -> impl Iterator<Item = (usize, &'m Source)> + use<'m> {
        let sources = self.solver.mechanism.sources();
        sources.iter().enumerate().filter(|(_, s)| s.is_clearance && !s.set.is_zero())
    }

    /// Own coordinates and forces; forces up to a tolerance are none.
    fn own(&self, state: &State, force: &[f64], tolerance: f64) -> Own {
        let m = self.solver.mechanism;
        let mut own = Own { y: Vec::new(), s: Vec::new() };
        for (k, source) in self.sources() {
            let n = source.set.size();
            let offset: Vec<f64> = source.range().map(|p| state.inputs.parameters[p] - m.centre[p]).collect();
            let mut masked_force = source.set.masked_force(&force[source.range()], self.unforced[k]);
            if tolerance > 0.0 {
                let unforced = source.set.unforced(&masked_force[..n], source.undecided(tolerance));
                masked_force = source.set.masked_force(&masked_force[..n], unforced);
            }
            own.y.extend_from_slice(&source.set.to_unit(&offset)[..n]);
            own.s.extend_from_slice(&source.set.unit_gradient(&masked_force[..n])[..n]);
        }
        own
    }

    fn at(&self, contact: &Contact) -> Own {
        self.own(&contact.state, &contact.gradient.inputs.parameters, 0.0)
    }

    /// Whether no offset is pushed on, but by forces that decide nothing.
    fn settled(&self, contact: &Contact) -> bool {
        let tolerance = UNDECIDED * self.solver.mechanism.force_scale(&contact.gradient);
        let own = self.own(&contact.state, &contact.gradient.inputs.parameters, tolerance);
        largest(&self.projected(&own).residual) <= SETTLED
    }

    /// Takes notice of how forces have changed along a step.
    pub fn learn(&mut self, from: &Contact, to: &Contact) {
        let (a, b) = (self.at(from), self.at(to));
        self.compare(&a, &b);
    }

    fn compare(&mut self, a: &Own, b: &Own) {
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs()));
        let moved = apart(&a.y, &b.y);
        if moved < MOVED {
            return;
        }
        let mut first = 0;
        for (k, source) in self.sources() {
            let range = first..first + source.set.size();
            self.stiffness[k] = self.stiffness[k].max(apart(&a.s[range.clone()], &b.s[range]) / moved);
            first += source.set.size();
        }
    }

    fn projected(&self, own: &Own) -> Projected {
        let n = own.y.len();
        let mut projected =
            Projected { residual: Vec::with_capacity(n), t: Vec::with_capacity(n), elements: vec![None; n] };
        for (k, source) in self.sources() {
            let (first, size) = (projected.t.len(), source.set.size());
            let t = 1.0 / self.stiffness[k].max(f64::MIN_POSITIVE.sqrt());
            projected.t.resize(first + size, t);
            let z: [f64; MAX_SIZE] =
                std::array::from_fn(|i| if i < size { own.y[first + i] + t * own.s[first + i] } else { 0.0 });
            let mut point = z;
            source.set.project_unit(&mut point[..size]);
            projected.residual.extend((0..size).map(|i| point[i] - own.y[first + i]));
            for column in 0..size {
                let mut along = [0.0; MAX_SIZE];
                along[column] = 1.0;
                source.set.project_unit_along(&z[..size], &mut along[..size]);
                // What the load does not push stays, though the others might balance sooner if it gave way.
                let elements = |&(row, a): &(usize, f64)| a != 0.0 && !source.set.is_unforced(row, self.unforced[k]);
                for (row, a) in along.into_iter().enumerate().filter(elements) {
                    projected.elements[first + row].get_or_insert((first, [0.0; MAX_SIZE])).1[column] = a;
                }
            }
        }
        projected
    }

    /// Brings contact and reactions to agree.
    pub fn settle(&self, mut at: Contact) -> Contact {
        let m = self.solver.mechanism;
        let mut own = self.at(&at);
        let mut bends = BTreeMap::new();
        let mut before = f64::INFINITY;
        for number in 0..STEPS {
            interrupt::check();
            let projected = self.projected(&own);
            let left = largest(&projected.residual);
            at.settled = self.settled(&at);
            // Rounding, or a force too small to decide, lets nothing better be reached.
            if left <= STILL || at.settled && left > NEARER * before {
                break;
            }
            before = left;
            if number % RENEWED == 0 {
                bends.clear();
            }
            let residual = projected.residual.clone();
            let Some(step) = self.step(&at, &own, projected, HOLDS[number / RENEWED], &mut bends) else {
                at.blocked = true;
                break;
            };
            // The forces push away from the balance that lies behind, and lead on to another.
            if inner(&residual, &step) < 0.0 {
                let pressed = m.support_update_loaded(&at.gradient, &at.state.inputs, self.unforced);
                let Some(next) = self.solver.contact(&at, &pressed) else {
                    at.blocked = true;
                    break;
                };
                own = self.at(&next);
                at = next;
                continue;
            }
            let mut best: Option<(f64, Contact, Own)> = None;
            let cuts: &[bool] = if self.is_cut(&own, &step) { &[false, true] } else { &[false] };
            for &cut in cuts {
                let Some(next) = self.moved(&at, &own, &step, cut) else {
                    at.blocked = true;
                    continue;
                };
                let tried = self.at(&next);
                let left_then = largest(&self.projected(&tried).residual);
                if best.as_ref().is_none_or(|(least, ..)| left_then < *least) {
                    best = Some((left_then, next, tried));
                }
                if left_then < NEARER * left {
                    break;
                }
            }
            let Some((_, next, tried)) = best else { break };
            (at, own) = (next, tried);
        }
        at
    }

    /// Whether a step leaves a set that cuts it off.
    fn is_cut(&self, own: &Own, step: &[f64]) -> bool {
        let mut first = 0;
        self.sources().any(|(_, source)| {
            let range = first..first + source.set.size();
            first = range.end;
            source.set.part_within(&own.y[range.clone()], &step[range]) < 1.0
        })
    }

    /// The contact after a step; what leaves a set is projected back, or cut off where it leaves.
    fn moved(&self, at: &Contact, own: &Own, step: &[f64], cut: bool) -> Option<Contact> {
        let m = self.solver.mechanism;
        let mut inputs = at.state.inputs.clone();
        let mut first = 0;
        for (_, source) in self.sources() {
            let range = first..first + source.set.size();
            let [from, step] = [&own.y[range.clone()], &step[range.clone()]];
            let part = if cut { source.set.part_within(from, step) } else { 1.0 };
            let mut unit: Vec<f64> = from.iter().zip(step).map(|(y, d)| y + part * d).collect();
            source.set.project_unit(&mut unit);
            for (p, offset) in source.range().zip(source.set.of_unit(&unit)) {
                inputs.parameters[p] = m.centre[p] + offset;
            }
            first = range.end;
        }
        self.solver.contact(at, &inputs)
    }

    /// Newton's step.
    fn step(
        &self,
        at: &Contact,
        own: &Own,
        mut projected: Projected,
        hold: f64,
        bends: &mut Bends,
    ) -> Option<Vec<f64>> {
        let hold = largest(&projected.residual).powi(2).clamp(STILL, hold);
        loop {
            let n = own.y.len();
            let moving: Vec<usize> = (0..n)
                .filter(|&k| projected.elements[k].is_some() || projected.residual[k].abs() > 0.1 * STILL)
                .collect();
            let new: Vec<usize> = moving.iter().copied().filter(|column| !bends.contains_key(column)).collect();
            if !new.is_empty() {
                bends.extend(new.iter().copied().zip(self.bends(at, &new)?));
            }
            let mut matrix = DMatrix::<f64>::identity(moving.len(), moving.len());
            for (c, &column) in moving.iter().enumerate() {
                let bend = &bends[&column];
                for (r, &row) in moving.iter().enumerate() {
                    let Some((first, elements)) = projected.elements[row] else { continue };
                    let t = projected.t[row];
                    for ((k, bend), element) in bend.iter().enumerate().skip(first).zip(elements) {
                        matrix[(r, c)] -= element * (t * bend + f64::from(k == column));
                    }
                }
            }
            // Least squares, held: many places along which forces balance are as good as each other, and the nearest is
            // taken. Held by the square of what is left to go, steps converge as without (Yamashita and Fukushima,
            // Topics in Numerical Analysis, Springer 2001).
            let transposed = matrix.transpose();
            let mut normal = &transposed * matrix;
            (0..moving.len()).for_each(|k| normal[(k, k)] += hold);
            let factors = normal.cholesky()?;
            let solve = |residual: &dyn Fn(usize) -> f64| {
                let right = DVector::from_iterator(moving.len(), moving.iter().map(|&k| residual(k)));
                let mut step = vec![0.0; n];
                moving.iter().zip(factors.solve(&(&transposed * right)).iter()).for_each(|(&k, s)| step[k] = *s);
                step
            };
            let repelled = self.repelled(&projected, solve);
            if repelled.is_empty() {
                return Some(solve(&|k| projected.residual[k]));
            }
            for (source, range) in repelled {
                projected.elements[range.clone()].fill(None);
                let size = largest(&own.s[range.clone()]);
                let mut far = [0.0; MAX_SIZE];
                far.iter_mut().zip(range.clone()).for_each(|(far, i)| *far = own.y[i] + FAR * own.s[i] / size);
                source.set.project_unit(&mut far[..source.set.size()]);
                range.zip(far).for_each(|(i, far)| projected.residual[i] = far - own.y[i]);
            }
        }
    }

    /// The sources that are not where their forces balance, and would be pushed away from there when they
    /// came near: what they ask for alone would lead them against their force.
    fn repelled(
        &self,
        projected: &Projected,
        solve: impl Fn(&dyn Fn(usize) -> f64) -> Vec<f64>,
    ) -> Vec<(&'m Source, Range<usize>)> {
        let mut first = 0;
        let mut repelled = Vec::new();
        for (_, source) in self.sources() {
            let range = first..first + source.set.flat_sided();
            first += source.set.size();
            let residual = &projected.residual[range.clone()];
            if largest(residual) < SETTLED || projected.elements[range.clone()].iter().all(Option::is_none) {
                continue;
            }
            let step = solve(&|k| if range.contains(&k) { projected.residual[k] } else { 0.0 });
            if inner(residual, &step[range.clone()]) < 0.0 {
                repelled.push((source, range));
            }
        }
        repelled
    }

    /// How the forces change along some of the coordinates.
    fn bends(&self, at: &Contact, columns: &[usize]) -> Option<Vec<Vec<f64>>> {
        let linearised = self.solver.linearise(&at.state)?;
        let along: Vec<Along> = columns.iter().map(|&column| self.along(column)).collect();
        let changes = self.solver.gradient_along(&linearised, &at.state, &at.gradient, &along);
        let own = |force: Vec<f64>| {
            let of = |(k, source): (usize, &Source)| {
                let n = source.set.size();
                let masked_force = source.set.masked_force(&force[source.range()], self.unforced[k]);
                source.set.unit_gradient(&masked_force[..n])[..n].to_vec()
            };
            self.sources().flat_map(of).collect()
        };
        Some(changes.into_iter().map(own).collect())
    }

    /// What one coordinate does to the parameters.
    fn along(&self, column: usize) -> Along {
        let mut first = 0;
        for (_, source) in self.sources() {
            let size = source.set.size();
            if (first..first + size).contains(&column) {
                let mut unit = [0.0; MAX_SIZE];
                let from = source.set.of_unit(&unit[..size]);
                unit[column - first] = 1.0;
                let to = source.set.of_unit(&unit[..size]);
                return source.range().zip(from.iter().zip(to)).map(|(p, (from, to))| (p, to - from)).collect();
            }
            first += size;
        }
        Along::new()
    }
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0_f64, |a, x| a.max(x.abs()))
}
