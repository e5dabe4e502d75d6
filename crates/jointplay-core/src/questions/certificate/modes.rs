//! Coordinates of small motions.
//!
//! Motions z are enclosed by a box of their own components first. Near a singular pose a mechanism has a few motions in
//! which all of its bodies move together and which small offsets make large; a box of components forgets that they do.
//! With C the inverse of the closure Jacobian in lengths of the mechanism's own size, the box is one of the coordinates k of
//! `z = U k` then: the columns of U are the left singular vectors of C that belong to its largest singular values, and units
//! for all components but as many, so that what moves little in one body stays there.

use nalgebra::DMatrix;

use crate::math::decomposition::singular_values;
use crate::math::interval::Interval;
use crate::mechanism::Mechanism;
use crate::questions::certificate::inverse::Inverse;

/// Motions that are this part of the softest, or more, are coordinates; so many of them at most.
const LARGE: f64 = 0.1;
const MOST: usize = 6;

/// Coordinates k of motions `z = U k`.
pub(super) struct Modes {
    pub n: usize,
    /// Whether U is one.
    pub are_components: bool,
    /// U, row by row.
    motions: Vec<f64>,
    /// Near the inverse of U; what their product is off by from one: the largest sum over a row.
    back: Vec<f64>,
    off: f64,
    /// Near the inverse of U, times C: the coordinates that correct residuals.
    corrections: Vec<f64>,
}

fn times(matrix: &[f64], x: &[Interval]) -> Vec<Interval> {
    let sum = |row: &[f64]| {
        let terms = row.iter().zip(x).filter(|(c, _)| **c != 0.0);
        terms.fold(Interval::ZERO, |sum, (c, x)| sum + x.scaled(*c))
    };
    matrix.chunks_exact(x.len().max(1)).map(sum).collect()
}

/// A square matrix by its entries, row by row.
fn table(n: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..n * n).map(|k| entry(k / n, k % n)).collect()
}

/// What every component of a motion is measured in.
pub(super) fn units(m: &Mechanism) -> Vec<f64> {
    let components = m.space.components();
    (0..m.n_unknowns()).map(|i| m.unit(components[i % components.len()])).collect()
}

impl Modes {
    /// The components themselves.
    pub fn components(inverse: &Inverse) -> Self {
        let one = || table(inverse.n, |i, j| if i == j { 1.0 } else { 0.0 });
        let corrections = table(inverse.n, |i, row| inverse.at(i, row));
        Self { n: inverse.n, are_components: true, motions: one(), back: one(), off: 0.0, corrections }
    }

    /// The motions in which the closure of a mechanism is softest, and components for the others.
    pub fn soft(m: &Mechanism, inverse: &Inverse) -> Option<Self> {
        Self::along(m, inverse, |u, sizes| {
            let mut basis = DMatrix::identity(sizes.len(), sizes.len());
            for k in (0..sizes.len()).take_while(|&k| sizes[k] > LARGE * sizes[0]).take(MOST) {
                // It stands for the component that is largest in what of it the others before it do not have.
                let pivot = u.column(k).icamax();
                basis.set_column(pivot, &u.column(k));
                for later in k + 1..sizes.len() {
                    let part = u[(pivot, later)] / u[(pivot, k)];
                    let column = u.column(k) * part;
                    u.set_column(later, &(u.column(later) - column));
                }
            }
            let inverted = basis.clone().try_inverse()?;
            Some((basis, inverted))
        })
    }

    /// Along all singular directions of the closure.
    pub fn singular(m: &Mechanism, inverse: &Inverse) -> Option<Self> {
        Self::along(m, inverse, |u, _| Some((u.clone(), u.transpose())))
    }

    /// Along the columns of a basis that is made of left singular vectors, beside its inverse; by singular values.
    fn along(
        m: &Mechanism,
        inverse: &Inverse,
        basis: impl FnOnce(&mut DMatrix<f64>, &[f64]) -> Option<(DMatrix<f64>, DMatrix<f64>)>,
    ) -> Option<Self> {
        let (n, units) = (inverse.n, units(m));
        let scaled = |i: usize, row: usize| inverse.at(i, row) * m.unit(m.rows[row].component) / units[i];
        let svd = singular_values(DMatrix::from_fn(n, n, scaled), true, false)?;
        let (basis, inverted) = basis(&mut svd.u?, svd.singular_values.as_slice())?;
        let motions = table(n, |i, j| units[i] * basis[(i, j)]);
        let back = table(n, |j, i| inverted[(j, i)] / units[i]);
        let corrections = inverse.transposed_rows(&back);
        let mut off = vec![Interval::ZERO; n];
        for j in 0..n {
            let column: Vec<Interval> = (0..n).map(|i| Interval::from_point(motions[i * n + j])).collect();
            for (i, x) in times(&back, &column).into_iter().enumerate() {
                let x = if i == j { x - Interval::ONE } else { x };
                off[i] = off[i] + Interval::from_point(x.size());
            }
        }
        let off = off.iter().fold(0.0, |largest: f64, sum| largest.max(sum.high));
        (off < 0.5).then_some(Self { n, are_components: false, motions, back, off, corrections })
    }

    /// The components of a motion of unit coordinates.
    pub fn motion(&self, component: usize) -> &[f64] {
        &self.motions[component * self.n..(component + 1) * self.n]
    }

    /// What each residual is corrected by in a coordinate.
    pub fn correction(&self, coordinate: usize) -> &[f64] {
        &self.corrections[coordinate * self.n..(coordinate + 1) * self.n]
    }

    /// The coordinates that correct residuals.
    pub fn corrections_of(&self, residual: &[Interval]) -> Vec<Interval> {
        times(&self.corrections, residual)
    }

    /// The coordinates of a motion: `U^-1 z = B z + (1 - B U) U^-1 z`.
    pub fn coordinates_of(&self, z: &[Interval]) -> Vec<Interval> {
        let k = times(&self.back, z);
        let largest = k.iter().fold(0.0, |largest: f64, k| largest.max(k.size()));
        let off = Interval::from_point(self.off);
        let rest = off * Interval::from_point(largest) / (Interval::ONE - off);
        k.into_iter().map(|k| k + Interval::of_size(rest.high)).collect()
    }
}
