//! Cells of unit vectors: those whose largest component is a given one, with the ratios of the others to it in intervals.
//!
//! ```text
//! n = s (sign, a_1, ..),  s = 1 / sqrt(1 + a . a)
//! ```
//!
//! A cell is in the cone of its corners v: `n = sum w v` with weights that are not negative, and with a vector m in the
//! middle `sum w <= |m| / min v . m`. What is linear in n is therefore at most that factor times the largest of its values
//! in the corners, if that is positive; the factor exceeds one by the square of the cell's width only.

use crate::math::interval::Interval;
use crate::math::vector::norm;

/// How far corners are put outside, so that their rounding does not count.
const OUTSIDE: f64 = 1e-12;

/// A cell.
#[derive(Clone, Debug)]
pub(super) struct Direction {
    axis: usize,
    sign: f64,
    /// Ratios of the other components to the size of the largest, in their order.
    ratios: Vec<Interval>,
}

impl Direction {
    /// A single vector.
    pub fn of(vector: &[f64]) -> Self {
        let axis = (0..vector.len()).max_by(|&a, &b| vector[a].abs().total_cmp(&vector[b].abs())).unwrap_or(0);
        let others = (0..vector.len()).filter(|&k| k != axis);
        let ratios = others.map(|k| Interval::from_point(vector[k] / vector[axis].abs())).collect();
        Self { axis, sign: vector[axis].signum(), ratios }
    }

    /// All unit vectors, by cells.
    pub fn all(dimensions: usize) -> Vec<Self> {
        let cell = |axis: usize, sign: f64| Self { axis, sign, ratios: vec![Interval::of_size(1.0); dimensions - 1] };
        (0..dimensions).flat_map(|axis| [cell(axis, 1.0), cell(axis, -1.0)]).collect()
    }

    /// Components with numbers for the ratios.
    fn at<T>(&self, largest: T, ratio: impl Fn(usize) -> T) -> Vec<T> {
        let mut components: Vec<T> = (0..self.ratios.len()).map(ratio).collect();
        components.insert(self.axis, largest);
        components
    }

    /// A box around the cell.
    pub fn components(&self) -> Vec<Interval> {
        let square = self.ratios.iter().fold(Interval::ONE, |sum, a| sum + a.square());
        let size = Interval::ONE / square.root();
        self.at(size.scaled(self.sign), |k| self.ratios[k] * size)
    }

    fn vector(&self, ratios: &[f64]) -> Vec<f64> {
        let plain = self.at(self.sign, |k| ratios[k]);
        let size = norm(&plain);
        plain.into_iter().map(|x| x / size).collect()
    }

    /// The direction in the middle.
    pub fn middle(&self) -> Vec<f64> {
        self.vector(&self.ratios.iter().map(|a| a.middle()).collect::<Vec<_>>())
    }

    /// The corners, and the factor.
    pub fn corners(&self) -> (Vec<Vec<f64>>, f64) {
        let corner = |number: u32| {
            let ratio =
                |(k, a): (usize, &Interval)| if number >> k & 1 == 1 { a.high + OUTSIDE } else { a.low - OUTSIDE };
            self.vector(&self.ratios.iter().enumerate().map(ratio).collect::<Vec<_>>())
        };
        let corners: Vec<Vec<f64>> = (0..1_u32 << self.ratios.len()).map(corner).collect();
        let middle = self.middle();
        let along = |corner: &Vec<f64>| corner.iter().zip(&middle).map(|(a, b)| a * b).sum::<f64>();
        let least = corners.iter().map(along).fold(f64::INFINITY, f64::min);
        (corners, norm(&middle) / least * (1.0 + OUTSIDE))
    }

    /// Leaves the directions of vectors in a box that are longer than this; false where there are none.
    pub fn leave(&mut self, vector: &[Interval], longer: f64) -> bool {
        // No component is larger than this one.
        let least = longer.max(0.0) / (vector.len() as f64).sqrt() * (1.0 - OUTSIDE);
        let largest = vector[self.axis].scaled(self.sign).common(Interval::new(least, f64::INFINITY));
        let Some(largest) = largest.filter(|largest| largest.high > 0.0) else { return false };
        let others = (0..vector.len()).filter(|&k| k != self.axis);
        let ratios: Option<Vec<Interval>> =
            self.ratios.iter().zip(others).map(|(a, k)| a.common(vector[k] / largest)).collect();
        match ratios {
            Some(ratios) => self.ratios = ratios,
            None => return false,
        }
        true
    }

    /// The largest width of a ratio.
    pub fn width(&self) -> f64 {
        self.ratios.iter().fold(0.0, |width: f64, a| width.max(a.width()))
    }

    /// Two cells of it; itself where it is a single direction.
    pub fn halves(&self) -> Vec<Self> {
        let widest = (0..self.ratios.len()).max_by(|&a, &b| self.ratios[a].width().total_cmp(&self.ratios[b].width()));
        let Some(k) = widest else { return vec![self.clone()] };
        let middle = self.ratios[k].middle();
        let (mut low, mut high) = (self.clone(), self.clone());
        low.ratios[k].high = middle;
        high.ratios[k].low = middle;
        vec![low, high]
    }
}
