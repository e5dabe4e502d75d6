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
//! where the forces balance. The derivative ds/dy is taken by differences along the coordinates that move.

use nalgebra::{DMatrix, DVector};

use crate::clearance::{MAX_SIZE, Mute};
use crate::contact::Contact;
use crate::mechanism::Source;
use crate::solver::{Linearised, Solver, State};

/// Steps at most.
const STEPS: usize = 40;
/// Parts of a set by which a coordinate is moved for a difference.
const DIFFERENCE: f64 = 1e-2;
/// Contact and reactions agree where no coordinate wants to move by more than this part of its set.
const STILL: f64 = 1e-11;
/// The same where rounding lets nothing better be reached.
const SETTLED: f64 = 1e-8;
/// Holds what no force moves, nor is held by any: such as play that the load does not push.
const NOTHING: f64 = 1e-6;
/// Ways to take a step, until one brings the conditions much nearer: parts of it, of which what leaves a set
/// is projected back, or cut off where it leaves.
const WAYS: [Way; 7] = [
    Way::Projected(1.0),
    Way::Cut,
    Way::Projected(0.5),
    Way::Projected(0.25),
    Way::Projected(0.125),
    Way::Projected(0.0625),
    Way::Projected(0.03125),
];

/// A way to take a step.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// A part of it.
    Projected(f64),
    /// Each source as far as its set goes.
    Cut,
}

/// The method with what it knows about how forces change.
pub(crate) struct Newton<'s, 'm> {
    solver: &'s Solver<'m>,
    mutes: &'s [Mute],
    /// Per source, the largest change of a force beside the move that made it.
    stiffness: Vec<f64>,
}

/// Own coordinates and the forces along them.
struct Own {
    y: Vec<f64>,
    s: Vec<f64>,
}

/// What the projection makes of a point.
struct Projected {
    /// The point.
    z: Vec<f64>,
    /// What is left to go to its projection.
    residual: Vec<f64>,
}

impl<'s, 'm> Newton<'s, 'm> {
    pub fn new(solver: &'s Solver<'m>, mutes: &'s [Mute]) -> Self {
        Self { solver, mutes, stiffness: vec![0.0; solver.mechanism.sources().len()] }
    }

    fn sources(&self) -> impl Iterator<Item = (usize, &'m Source)> + use<'m> {
        let sources = self.solver.mechanism.sources();
        sources.iter().enumerate().filter(|(_, s)| s.is_clearance && !s.set.is_zero())
    }

    fn own(&self, state: &State, force: &[f64]) -> Own {
        let m = self.solver.mechanism;
        let mut own = Own { y: Vec::new(), s: Vec::new() };
        for (k, source) in self.sources() {
            let n = source.set.size();
            let offset: Vec<f64> = source.range().map(|p| state.inputs.parameters[p] - m.centre[p]).collect();
            let heard = source.set.heard(&force[source.range()], self.mutes[k]);
            own.y.extend_from_slice(&source.set.to_unit(&offset)[..n]);
            own.s.extend_from_slice(&source.set.unit_gradient(&heard[..n])[..n]);
        }
        own
    }

    fn at(&self, contact: &Contact) -> Own {
        self.own(&contact.state, &contact.gradient.inputs.parameters)
    }

    /// Takes notice of how forces have changed along a step.
    pub fn learn(&mut self, from: &Contact, to: &Contact) {
        let (a, b) = (self.at(from), self.at(to));
        self.compare(&a, &b);
    }

    fn compare(&mut self, a: &Own, b: &Own) {
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs()));
        let moved = apart(&a.y, &b.y);
        if moved < DIFFERENCE {
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
        let mut z = own.y.clone();
        let mut first = 0;
        let mut residual = Vec::with_capacity(z.len());
        for (k, source) in self.sources() {
            let range = first..first + source.set.size();
            let t = 1.0 / self.stiffness[k].max(f64::MIN_POSITIVE.sqrt());
            z[range.clone()].iter_mut().zip(&own.s[range.clone()]).for_each(|(z, s)| *z += t * s);
            let mut point = [0.0; MAX_SIZE];
            let point = &mut point[..source.set.size()];
            point.copy_from_slice(&z[range.clone()]);
            source.set.project_unit(point);
            residual.extend(point.iter().zip(&own.y[range.clone()]).map(|(p, y)| p - y));
            first = range.end;
        }
        Projected { z, residual }
    }

    /// Brings contact and reactions to agree.
    pub fn settle(self, mut at: Contact) -> Option<Contact> {
        let mut own = self.at(&at);
        for _ in 0..STEPS {
            let projected = self.projected(&own);
            let left = largest(&projected.residual);
            at.settled = left <= SETTLED;
            if std::env::var("DBG").is_ok() {
                eprintln!("newton {} left {left:e}", at.steps);
            }
            if left <= STILL {
                return Some(at);
            }
            let step = self.step(&at, &own, &projected)?;
            let mut best: Option<(f64, Contact, Own)> = None;
            for way in WAYS {
                let Some(next) = self.moved(&at, &own, &step, way) else {
                    at.blocked = true;
                    continue;
                };
                let tried = self.at(&next);
                let left_then = largest(&self.projected(&tried).residual);
                if best.as_ref().is_none_or(|(least, ..)| left_then < *least) {
                    best = Some((left_then, next, tried));
                }
                if left_then < 0.5 * left {
                    break;
                }
            }
            let Some((least, next, tried)) = best else { break };
            if at.settled && least >= left {
                break;
            }
            (at, own) = (next, tried);
        }
        Some(at)
    }

    /// The contact after a part of a step.
    fn moved(&self, at: &Contact, own: &Own, step: &[f64], way: Way) -> Option<Contact> {
        let m = self.solver.mechanism;
        let mut inputs = at.state.inputs.clone();
        let mut first = 0;
        for (_, source) in self.sources() {
            let range = first..first + source.set.size();
            let part = match way {
                Way::Projected(part) => part,
                Way::Cut => source.set.part_within(&own.y[range.clone()], &step[range.clone()]),
            };
            let mut unit: Vec<f64> = range.clone().map(|k| own.y[k] + part * step[k]).collect();
            source.set.project_unit(&mut unit);
            for (p, offset) in source.range().zip(source.set.of_unit(&unit)) {
                inputs.parameters[p] = m.centre[p] + offset;
            }
            first = range.end;
        }
        let state = self.solver.follow(&at.state, &inputs).ok()?;
        let gradient = m.load_gradient(&self.solver.linearise(&state)?, &state);
        Some(Contact { state, gradient, steps: at.steps + 1, ..*at })
    }

    /// Newton's step.
    fn step(&self, at: &Contact, own: &Own, projected: &Projected) -> Option<Vec<f64>> {
        let n = own.y.len();
        let moves: Vec<bool> = {
            let mut moves = vec![false; n];
            let mut first = 0;
            for (_, source) in self.sources() {
                let range = first..first + source.set.size();
                let z = &projected.z[range.clone()];
                for k in 0..source.set.size() {
                    let mut unit = [0.0; MAX_SIZE];
                    unit[k] = 1.0;
                    source.set.project_unit_along(z, &mut unit[..source.set.size()]);
                    for (j, u) in unit[..source.set.size()].iter().enumerate() {
                        moves[first + j] |= *u != 0.0;
                    }
                }
                first = range.end;
            }
            moves.iter().zip(&projected.residual).map(|(m, r)| *m || *r != 0.0).collect()
        };
        let linearised = self.solver.linearise(&at.state)?;
        let moving: Vec<usize> = (0..n).filter(|&k| moves[k]).collect();
        let mut matrix = DMatrix::identity(moving.len(), moving.len());
        for (c, &column) in moving.iter().enumerate() {
            let bend = self.bend(&linearised, at, own, column)?;
            let mut along = Vec::with_capacity(n);
            for (k, source) in self.sources() {
                let range = along.len()..along.len() + source.set.size();
                let t = 1.0 / self.stiffness[k].max(f64::MIN_POSITIVE.sqrt());
                along.extend(range.clone().map(|i| t * bend[i] + f64::from(u8::from(i == column))));
                source.set.project_unit_along(&projected.z[range.clone()], &mut along[range]);
            }
            for (r, &row) in moving.iter().enumerate() {
                matrix[(r, c)] -= along[row];
            }
        }
        let right = DVector::from_iterator(moving.len(), moving.iter().map(|&k| projected.residual[k]));
        let solved = matrix.svd(true, true).solve(&right, NOTHING).ok()?;
        let mut step = vec![0.0; n];
        moving.iter().zip(solved.iter()).for_each(|(&k, s)| step[k] = *s);
        Some(step)
    }

    /// How the forces change along one coordinate.
    fn bend(&self, linearised: &Linearised<'_>, at: &Contact, own: &Own, column: usize) -> Option<Vec<f64>> {
        let m = self.solver.mechanism;
        let mut inputs = at.state.inputs.clone();
        let mut first = 0;
        // Inwards.
        let h = DIFFERENCE * if own.y[column] > 0.0 { -1.0 } else { 1.0 };
        for (_, source) in self.sources() {
            let range = first..first + source.set.size();
            if range.contains(&column) {
                let mut unit = own.y[range.clone()].to_vec();
                unit[column - first] += h;
                for (p, offset) in source.range().zip(source.set.of_unit(&unit)) {
                    inputs.parameters[p] = m.centre[p] + offset;
                }
            }
            first = range.end;
        }
        let state = self.solver.nudged(linearised, &at.state, inputs);
        let gradient = m.load_gradient(&self.solver.linearise(&state)?, &state);
        let there = self.own(&state, &gradient.inputs.parameters);
        Some(there.s.iter().zip(&own.s).map(|(a, b)| (a - b) / h).collect())
    }
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0_f64, |a, x| a.max(x.abs()))
}
