//! Newton's method on the multipliers, from an answer nearby.
//!
//! With the forces `g = c + E' y` along the sets' own coordinates, the displacements are optimal where the support
//! points p(g) and what is elastic fulfil the equations,
//!
//! `sum_j t_j E_j p(g_j) + S y = f`
//!
//! with `t_j = 1`; or, where the smallest factor on the clearances is asked, with `c = 0`, `S = 0` and that factor
//! in the place of `t_j`, where the clearances' support functions `h(g)` add up to one. These are as many equations
//! as there are unknowns and, where no force vanishes, smooth. A body that no force pushes is not in a support point
//! but open: y is confined to where `g = 0` on it, and its coordinates take up what the others leave of the
//! equations, moved as little as possible. Which bodies are open is taken from the answer nearby. What is found
//! proves itself: forces hold every body where it is, everything is within its set and the equations are
//! fulfilled. Where that fails, an interior-point method decides.

use nalgebra::{DMatrix, DVector};

use crate::cone::answer::Answer;
use crate::cone::bodies::Atom;
use crate::cone::form::Form;
use crate::cone::lanes::layout::Question;
use crate::cone::{Block, Program};
use crate::interrupt;
use crate::math::decomposition::singular_values;
use crate::math::vector::norm;

const STEPS: usize = 12;
/// What may be left of an equation, as a part of what the sets reach in it.
const LEFT: f64 = 1e-14;
/// The same where no step makes it less.
const ROUNDING: f64 = 1e-11;
/// A force on an open body may be this part of the largest one.
const FORCELESS: f64 = 1e-11;
/// Directions of the multipliers in which open bodies do less than this part of the most are not held by them.
const HELD: f64 = 1e-9;

/// What the open bodies hold of the multipliers, and how they take up what is left of the equations.
struct Open {
    /// The open coordinates.
    coordinates: Vec<usize>,
    /// Directions of the multipliers that the open bodies hold, and those that are free.
    held: DMatrix<f64>,
    free: DMatrix<f64>,
    /// From a rest in the held directions to the least change of the open coordinates; transposed, from forces to
    /// multipliers.
    give: DMatrix<f64>,
}

impl Open {
    fn new(form: &Form<'_>, coordinates: Vec<usize>) -> Option<Self> {
        let s = form.right.len();
        let all = DMatrix::identity(s, s);
        if coordinates.is_empty() {
            return Some(Self { coordinates, held: DMatrix::zeros(s, 0), free: all, give: DMatrix::zeros(0, 0) });
        }
        let svd = singular_values(form.e.select_columns(&coordinates), true, true)?;
        let (u, v_t) = (svd.u?, svd.v_t?);
        let smallest = HELD * svd.singular_values.max();
        let there: Vec<usize> = (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > smallest).collect();
        let held = u.select_columns(&there);
        let mut give = v_t.select_rows(&there).transpose();
        for (column, k) in there.iter().enumerate() {
            give.column_mut(column).scale_mut(1.0 / svd.singular_values[*k]);
        }
        // Orthonormal directions at right angles to those that are held.
        let mut free = DMatrix::zeros(s, s - there.len());
        if !free.is_empty() {
            let directions = singular_values(&all - &held * held.transpose(), true, false)?;
            let mut order: Vec<usize> = (0..s).collect();
            order.sort_by(|a, b| directions.singular_values[*b].total_cmp(&directions.singular_values[*a]));
            free = directions.u?.select_columns(&order[..free.ncols()]);
        }
        Some(Self { coordinates, held, free, give })
    }
}

/// Multipliers, coordinates as parts of the sets, and the factor on those that it scales.
struct At {
    y: DVector<f64>,
    p: Vec<f64>,
    factor: f64,
}

impl Program {
    /// Whether an answer has as many multipliers and displacements as the program.
    fn has_shape_of(&self, answer: &Answer) -> bool {
        let sizes = |(block, offset): (&Block, &Vec<f64>)| block.size() == offset.len();
        self.n_equations() == answer.multipliers.len()
            && self.blocks.len() == answer.displacements.len()
            && self.blocks.iter().zip(&answer.displacements).all(sizes)
    }

    /// The answer, from another one nearby; `None` where that does not lead there.
    #[must_use]
    pub fn answer_near(&self, question: Question, near: &Answer) -> Option<Answer> {
        if !self.has_shape_of(near) {
            return None;
        }
        interrupt::check();
        let form = Form::new(self, question);
        let scaled = near.multipliers.iter().zip(&form.scales).map(|(y, scale)| y * scale);
        let (y, factor) = (DVector::from_iterator(form.scales.len(), scaled), near.factor);
        if !(factor > 0.0) {
            return None;
        }
        let mut at = At { p: form.coordinates(&near.displacements, factor), y, factor };
        let forces = form.forces(&at.y);
        let largest = forces.amax();
        let is_open = |(first, body, _): &&(usize, Atom, bool)| {
            let range = *first..first + body.size();
            norm(&forces.as_slice()[range.clone()]) < largest * body.slack(&at.p[range])
        };
        let open = form.bodies.iter().filter(is_open).flat_map(|(first, body, _)| *first..first + body.size());
        let open = Open::new(&form, open.collect())?;
        if !open.coordinates.is_empty() {
            let on_open = |y: &DVector<f64>| form.forces(y).select_rows(&open.coordinates);
            let lifted = &open.held * open.give.tr_mul(&on_open(&at.y));
            at.y -= lifted;
            if !(on_open(&at.y).amax() <= FORCELESS * form.forces(&at.y).amax()) {
                return None;
            }
        }
        form.solve(&open, &mut at).and_then(|rest| form.close(&open, at, rest))
    }
}

impl Form<'_> {
    /// Brings the multipliers to where the equations are fulfilled in the directions that open bodies do not hold;
    /// gives what is left of the equations.
    fn solve(&self, open: &Open, at: &mut At) -> Option<DVector<f64>> {
        let points = || self.bodies.iter().filter(|(first, ..)| !open.coordinates.contains(first));
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let forces = self.forces(&at.y);
            let mut rest = &self.right - &self.springs * &at.y;
            // What the factor moves, and what its multipliers lack to one.
            let (mut reach, mut lack) = (DVector::zeros(self.right.len()), 1.0);
            for (first, body, scaled) in points() {
                let range = *first..first + body.size();
                let force = &forces.as_slice()[range.clone()];
                body.support_point(force, &mut at.p[range.clone()]);
                for k in range {
                    if *scaled {
                        reach.axpy(at.p[k], &self.e.column(k), 1.0);
                        lack -= forces[k] * at.p[k];
                    } else {
                        rest.axpy(-at.p[k], &self.e.column(k), 1.0);
                    }
                }
            }
            rest.axpy(-at.factor, &reach, 1.0);
            let left = open.free.tr_mul(&rest);
            let size = if self.variable { left.amax().max(lack.abs()) } else { left.amax() };
            if size <= LEFT || size <= ROUNDING && size > 0.5 * before {
                return Some(rest);
            }
            if !(size < before) {
                return None;
            }
            before = size;
            let mut matrix = open.free.tr_mul(&self.springs) * &open.free;
            for (first, body, scaled) in points() {
                let range = *first..first + body.size();
                let Some((bend, normal)) = body.bend(&forces.as_slice()[range.clone()], &at.p[range]) else { continue };
                // The support point of a round body turns with its force.
                let across = open.free.tr_mul(&self.e.columns(*first, body.size()));
                let along = &across * DVector::from_column_slice(&normal[..body.size()]);
                let bend = if *scaled { at.factor * bend } else { bend };
                matrix += (&across * across.transpose() - &along * along.transpose()) * bend;
            }
            if self.variable {
                let reach = open.free.tr_mul(&reach);
                matrix += &reach * reach.transpose();
                let factors = matrix.cholesky()?;
                let (step, by_factor) = (factors.solve(&(left + &reach * lack)), factors.solve(&reach));
                let change = (reach.dot(&step) - lack) / reach.dot(&by_factor);
                at.y += &open.free * (step - by_factor * change);
                at.factor += change;
            } else {
                at.y += &open.free * matrix.cholesky()?.solve(&left);
            }
        }
        None
    }

    /// Lets the open bodies take up what the others leave of the equations.
    fn close(&self, open: &Open, mut at: At, mut rest: DVector<f64>) -> Option<Answer> {
        let part = |k: &usize| if self.is_scaled(*k) { at.factor } else { 1.0 };
        for k in &open.coordinates {
            rest.axpy(-part(k) * at.p[*k], &self.e.column(*k), 1.0);
        }
        if !open.coordinates.is_empty() {
            let change = &open.give * open.held.tr_mul(&rest);
            for (k, change) in open.coordinates.iter().zip(change.iter()) {
                at.p[*k] += change / part(k);
                rest.axpy(-change, &self.e.column(*k), 1.0);
            }
        }
        let inside =
            |(first, body, _): &(usize, Atom, bool)| body.slack(&at.p[*first..first + body.size()]) >= -ROUNDING;
        let proved = at.factor > 0.0 && rest.amax() <= ROUNDING && self.bodies.iter().all(inside);
        proved.then(|| self.answer(&at.y, &at.p, at.factor, rest.amax()))
    }
}
