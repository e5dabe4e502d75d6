//! Slabs: parts of the sets by how far the mechanism is moved along the few motions that bend most.
//!
//! Near a singular pose small offsets make a few motions large, and what is not linear comes from them. To halve single
//! offsets makes none of these motions much smaller, because each offset is but one of many that cause it. The sets are
//! divided by the motion itself then: with m a direction of own coordinates,
//!
//! ```text
//! t = m . x in an interval
//! ```
//!
//! is one more coordinate, whose interval is known besides that of x. What is linear has two parts then,
//!
//! ```text
//! g . d = (g - l m) . d + l t      for any l
//! ```
//!
//! and with l the share of m in g, both are small over a slab: the first has little left of m, and t is short.

use nalgebra::{DMatrix, DVector};

use crate::math::affine::{Form, Forms};
use crate::math::decomposition::singular_values;
use crate::math::interval::Interval;
use crate::math::vector::inner;

/// Directions whose motions are this part of the largest, or more, are divided; so many of them at most.
const LARGE: f64 = 0.3;
const MOST: usize = 2;
/// Directions in which places are compared with what the sets reach.
const AROUND: usize = 24;
/// By how much places in a slab may be off by rounding, and slabs overlap.
pub(super) const SHARED: f64 = 1e-12;

/// Directions m of own coordinates, that have `|m . x| <= 1` on the sets.
pub(super) struct Slabs {
    /// Own coordinates.
    n: usize,
    rows: Vec<Vec<f64>>,
    /// `m / |m|^2`, whose product with a gradient is the share of m in it.
    shares: Vec<Vec<f64>>,
    /// How large the motion along each of them is, as a part of the largest.
    pub sizes: Vec<f64>,
    /// By direction, what the place of offsets is ahead of a place, along all coordinates.
    ahead: Vec<Vec<Interval>>,
}

impl Slabs {
    /// None, for so many own coordinates.
    pub fn none(n: usize) -> Self {
        Self { n, rows: Vec::new(), shares: Vec::new(), sizes: Vec::new(), ahead: Vec::new() }
    }

    /// Along the largest motions, these being given row by row for every own coordinate; `reach` is how far the sets go
    /// along a direction.
    pub fn largest(n: usize, motions: &[f64], reach: impl Fn(&[f64]) -> f64) -> Option<Self> {
        // What moves nothing has no part in it, and would only trouble the iteration.
        let moving: Vec<usize> = (0..n).filter(|&k| motions.iter().skip(k).step_by(n).any(|x| *x != 0.0)).collect();
        if moving.is_empty() {
            return None;
        }
        let matrix = DMatrix::from_fn(motions.len() / n, moving.len(), |i, j| motions[i * n + moving[j]]);
        let svd = singular_values(matrix, false, true)?;
        let v = svd.v_t?;
        let motion = |k: usize| {
            let mut m = vec![0.0; n];
            moving.iter().zip(v.row(k).iter()).for_each(|(&at, x)| m[at] = *x);
            let reach = reach(&m) * (1.0 + SHARED);
            (svd.singular_values[k] * reach, m, reach)
        };
        let mut all: Vec<(f64, Vec<f64>, f64)> = (0..svd.singular_values.len()).map(motion).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let largest = all.first()?.0;
        let mut slabs = Self::none(n);
        for (size, m, reach) in all.into_iter().take(MOST).filter(|(size, ..)| *size >= LARGE * largest) {
            let square = inner(&m, &m);
            slabs.rows.push(m.iter().map(|m| m / reach).collect());
            slabs.shares.push(m.iter().map(|m| m * reach / square).collect());
            slabs.sizes.push(size / largest);
        }
        if slabs.len() == 2 {
            let turn = |k: usize| std::f64::consts::TAU * k as f64 / AROUND as f64;
            slabs.ahead = (0..AROUND).map(|k| slabs.along(&[turn(k).cos(), turn(k).sin()])).collect();
        }
        (largest > 0.0).then_some(slabs)
    }

    /// What is linear in the places of offsets, less the same of a place.
    fn along(&self, direction: &[f64]) -> Vec<Interval> {
        let mut sum = vec![Interval::ZERO; self.n];
        for (m, &l) in self.rows.iter().zip(direction) {
            sum.iter_mut().zip(m).for_each(|(sum, m)| *sum = *sum + Interval::from_point(l).scaled(*m));
        }
        sum.extend(direction.iter().map(|&l| Interval::from_point(-l)));
        sum
    }

    /// By direction, what the place of offsets is ahead of a place, along all coordinates.
    pub fn ahead(&self) -> &[Vec<Interval>] {
        &self.ahead
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Own coordinates, with where they are in the slabs, to rounding.
    pub fn point(&self, x: &[f64]) -> Vec<f64> {
        x.iter().copied().chain(self.rows.iter().map(|m| inner(m, x))).collect()
    }

    /// A point at a place in the slabs, with where it is to rounding.
    pub fn at(&self, place: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.n];
        for (share, t) in self.shares.iter().zip(place) {
            x.iter_mut().zip(share).for_each(|(x, m)| *x += m * t);
        }
        self.point(&x)
    }

    /// Moves a point to the middle of the slabs of a part, most along the coordinates that are wide there.
    pub fn move_to_middle(&self, x: &mut [f64], part: &[Interval]) {
        let widths: Vec<f64> = part.iter().map(|x| x.width()).collect();
        let weighted = |k: usize| -> Vec<f64> { self.rows[k].iter().zip(&widths).map(|(m, w)| m * w).collect() };
        let moves: Vec<Vec<f64>> = (0..self.len()).map(weighted).collect();
        let matrix = DMatrix::from_fn(self.len(), self.len(), |i, j| inner(&self.rows[i], &moves[j]));
        let off = |k: usize| part[self.n + k].middle() - inner(&self.rows[k], x);
        let off = DVector::from_fn(self.len(), |k, _| off(k));
        if let Some(steps) = matrix.lu().solve(&off).filter(|steps| steps.iter().all(|step: &f64| step.is_finite())) {
            for (step, along) in steps.iter().zip(&moves) {
                x.iter_mut().zip(along).for_each(|(x, along)| *x += step * along);
            }
        }
    }

    /// Where a box of own coordinates is in the slabs.
    pub fn places(&self, x: &[Interval]) -> Vec<Interval> {
        let place = |m: &Vec<f64>| {
            let sum = m.iter().zip(x).fold(Interval::ZERO, |sum, (m, x)| sum + x.scaled(*m));
            sum + Interval::of_size(SHARED)
        };
        self.rows.iter().map(place).collect()
    }

    /// What is linear in own coordinates, by its numbers: what of it is along the slabs comes last.
    pub fn split(&self, row: &[f64]) -> Vec<f64> {
        let along: Vec<f64> = self.shares.iter().map(|share| inner(share, row)).collect();
        let mut rest = row.to_vec();
        for (m, l) in self.rows.iter().zip(&along) {
            rest.iter_mut().zip(m).for_each(|(rest, m)| *rest -= l * m);
        }
        rest.extend(along);
        rest
    }

    /// What the numbers of such a split may be off by together, for coordinates that are at most 2 apart.
    pub fn rounding(&self, row: &[f64], split: &[f64]) -> f64 {
        let size = |row: &[f64]| row.iter().map(|x| x.abs()).sum::<f64>();
        let along: f64 = self.rows.iter().zip(&split[self.n..]).map(|(m, l)| l.abs() * size(m)).sum();
        if self.rows.is_empty() { 0.0 } else { 1e-15 * (size(row) + along) }
    }

    /// The same of derivatives by value, derivative and rest: what they are off by is not split.
    pub fn split_parts(&self, mut rows: Vec<(f64, Vec<f64>, f64)>) -> Vec<(f64, Vec<f64>, f64)> {
        if self.rows.is_empty() || rows.is_empty() {
            return rows;
        }
        let length = rows[0].1.len();
        let size = |row: &[f64]| row.iter().map(|x| x.abs()).sum::<f64>();
        let mut alongs = Vec::new();
        for share in &self.shares {
            let (mut value, mut derivative) = (0.0, vec![0.0; length]);
            for (l, row) in share.iter().zip(&rows).filter(|(l, _)| **l != 0.0) {
                value += l * row.0;
                derivative.iter_mut().zip(&row.1).for_each(|(sum, x)| *sum += l * x);
            }
            alongs.push((value, derivative, 0.0));
        }
        for (k, (value, derivative, rest)) in rows.iter_mut().enumerate() {
            // No coordinate is farther from another than 4.
            let mut weight = value.abs() + 4.0 * size(derivative);
            for (m, along) in self.rows.iter().zip(&alongs).filter(|(m, _)| m[k] != 0.0) {
                *value -= m[k] * along.0;
                derivative.iter_mut().zip(&along.1).for_each(|(x, l)| *x -= m[k] * l);
                weight += m[k].abs() * (along.0.abs() + 4.0 * size(&along.1));
            }
            *rest += 2e-15 * weight;
        }
        rows.extend(alongs);
        rows
    }

    /// Adds to what is linear so many times what is zero, `t - m . x`; what that may be off by.
    pub fn shift(&self, times: &[f64], row: &mut [f64]) -> f64 {
        let mut off = 0.0;
        for (k, (m, &l)) in self.rows.iter().zip(times).enumerate().filter(|(_, (_, l))| **l != 0.0) {
            off += row.iter().map(|x| 1e-15 * x.abs()).sum::<f64>()
                + l.abs() * SHARED * (4.0 + m.iter().map(|m| m.abs()).sum::<f64>());
            row.iter_mut().zip(m).for_each(|(x, m)| *x -= l * m);
            row[self.n + k] += l;
        }
        off
    }

    /// By how much the places of a point are ahead of where its coordinates are.
    pub fn ahead_of(&self, point: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(&point[self.n..]).map(|(m, t)| t - inner(m, point)).collect()
    }

    /// The same by forms.
    pub fn split_forms<'f>(&self, forms: &'f Forms, row: Vec<Form<'f>>) -> Vec<Form<'f>> {
        if self.rows.is_empty() {
            return row;
        }
        let nonzero = |(c, form): &(f64, Form<'f>)| *c != 0.0 && !form.is_zero();
        let share = |share: &Vec<f64>| forms.sum(share.iter().copied().zip(row.iter().copied()).filter(nonzero));
        let along: Vec<Form<'f>> = self.shares.iter().map(share).collect();
        let rest = |k: usize| {
            let terms = self.rows.iter().zip(&along).map(|(m, l)| (-m[k], *l));
            forms.sum([(1.0, row[k])].into_iter().chain(terms).filter(nonzero))
        };
        (0..row.len()).map(rest).chain(along.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two large motions and a small one, of five offsets.
    fn slabs() -> Slabs {
        let motions = [1.0, 0.5, 0.0, -0.7, 0.1, 0.0, 0.4, 0.9, 0.2, -0.3, 0.01, 0.0, 0.02, 0.0, 0.01];
        Slabs::largest(5, &motions, |m| m.iter().map(|m| m.abs()).sum()).unwrap()
    }

    #[test]
    fn small_motions_are_not_divided() {
        assert_eq!(slabs().len(), 2);
    }

    #[test]
    fn what_is_linear_is_the_same_when_it_is_split() {
        let (slabs, row, x) = (slabs(), [0.3, -1.2, 0.8, 0.05, 2.0], [0.2, -0.9, 1.0, 0.4, -0.3]);
        let split = slabs.split(&row);
        let point = slabs.point(&x);
        assert!((inner(&split, &point) - inner(&row, &x)).abs() <= slabs.rounding(&row, &split));
        // Nothing of the rest is along the slabs.
        slabs.shares.iter().for_each(|share| assert!(inner(share, &split[..5]).abs() < 1e-12));
    }

    #[test]
    fn points_are_at_their_places() {
        let slabs = slabs();
        let point = slabs.at(&[0.3, -0.6]);
        assert!((point[5] - 0.3).abs() < 1e-12 && (point[6] + 0.6).abs() < 1e-12);
        let mut x = [0.1, 0.0, -0.1, 0.0, 0.0];
        let part: Vec<Interval> =
            [[-1.0, 1.0]; 5].iter().chain(&[[0.1, 0.3], [-0.2, -0.1]]).map(|x| Interval::new(x[0], x[1])).collect();
        slabs.move_to_middle(&mut x, &part);
        let point = slabs.point(&x);
        assert!((point[5] - 0.2).abs() < 1e-12 && (point[6] + 0.15).abs() < 1e-12);
    }
}
