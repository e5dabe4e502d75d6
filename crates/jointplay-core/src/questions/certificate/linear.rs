//! Linear systems with matrices of intervals near one that is inverted.

use crate::math::affine::{Form, Forms};
use crate::math::interval::Interval;
use crate::questions::certificate::chart::Entries;
use crate::questions::certificate::inverse::Inverse;
use crate::questions::certificate::modes::Modes;

/// Rounds of an iteration that bounds the solution of a linear system.
const ROUNDS: usize = 200;
/// A bound of a solution is that of a system larger by this part, so that rounding does not hide that it holds.
const RAISED: f64 = 1e-6;
/// A bound that gains less than this part in a round has settled.
const SETTLED: f64 = 0.99;

/// `1 - C F_q` for corrections C, row by row, or the same along other coordinates of motions.
pub(super) struct Defect {
    n: usize,
    entries: Vec<Interval>,
}

/// What a correction makes of a column of the Jacobian, subtracted: the terms of the sum.
fn corrected<'f>(correction: &[f64], column: &[(usize, Form<'f>)]) -> impl Iterator<Item = (f64, Form<'f>)> {
    column.iter().map(|&(row, value)| (-correction[row], value)).filter(|(c, _)| *c != 0.0)
}

/// The derivatives of all rows that it has any of, along a motion of unit coordinates, by those along its components.
fn along_motion<'f>(
    modes: &Modes,
    forms: &'f Forms,
    columns: &[Vec<(usize, Form<'f>)>],
    motion: usize,
) -> Vec<(usize, Form<'f>)> {
    let mut terms: Vec<Vec<(f64, Form<'_>)>> = vec![Vec::new(); modes.n];
    for (component, column) in columns.iter().enumerate() {
        let moved = modes.motion(component)[motion];
        for &(row, value) in column.iter().filter(|_| moved != 0.0) {
            terms[row].push((moved, value));
        }
    }
    let rows = terms.into_iter().enumerate().filter(|(_, terms)| !terms.is_empty());
    rows.map(|(row, terms)| (row, forms.sum(terms.into_iter()))).collect()
}

impl Defect {
    pub fn of<'f>(modes: &Modes, forms: &'f Forms, along_poses: &Entries<Form<'f>>) -> Self {
        let n = modes.n;
        let mut columns: Vec<Vec<(usize, Form<'_>)>> = vec![Vec::new(); n];
        for &(row, column, value) in along_poses {
            columns[column].push((row, value));
        }
        if !modes.are_components {
            // Along the motions first: most of them move one component, so that these sums have few terms.
            columns = (0..n).map(|j| along_motion(modes, forms, &columns, j)).collect();
        }
        let unit = |i, j| if i == j { Interval::ONE } else { Interval::ZERO };
        let entry = |i: usize, j: usize| unit(i, j) + forms.reached(corrected(modes.correction(i), &columns[j]));
        let entries = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        Self { n, entries }
    }

    /// Of a Jacobian that is given as intervals.
    pub fn of_intervals(inverse: &Inverse, along_poses: &Entries<Interval>) -> Self {
        let n = inverse.n;
        let mut entries = vec![Interval::ZERO; n * n];
        (0..n).for_each(|i| entries[i * (n + 1)] = Interval::ONE);
        for &(row, column, value) in along_poses {
            for i in 0..n {
                let c = inverse.at(i, row);
                if c != 0.0 {
                    let entry = &mut entries[i * n + column];
                    *entry = *entry - value.scaled(c);
                }
            }
        }
        Self { n, entries }
    }

    pub fn times(&self, x: &[Interval]) -> Vec<Interval> {
        let row = |row: &[Interval]| row.iter().zip(x).fold(Interval::ZERO, |sum, (e, x)| sum + *e * *x);
        self.entries.chunks_exact(self.n).map(row).collect()
    }

    pub fn transposed_times(&self, y: &[Interval]) -> Vec<Interval> {
        let mut sum = vec![Interval::ZERO; self.n];
        for (row, y) in self.entries.chunks_exact(self.n).zip(y).filter(|(_, y)| !y.is_zero()) {
            sum.iter_mut().zip(row).for_each(|(sum, e)| *sum = *sum + *e * *y);
        }
        sum
    }
}

/// All solutions of `x = b + A x` for matrices with a spectral radius below one, A given by its product.
///
/// Numbers `m >= |b| + |A| m` bound |x|, which follows from the series of x. Then x is put in its own equation.
pub(super) fn fixed_point(b: &[Interval], product: impl Fn(&[Interval]) -> Vec<Interval>) -> Option<Vec<Interval>> {
    let image = |m: &[f64]| -> Vec<f64> {
        let all: Vec<Interval> = m.iter().map(|&m| Interval::of_size(m)).collect();
        product(&all).iter().zip(b).map(|(p, b)| (*p + Interval::of_size(b.size())).size()).collect()
    };
    let mut m: Vec<f64> = b.iter().map(|b| b.size()).collect();
    let mut is_bound = false;
    for _ in 0..ROUNDS {
        let next = image(&m);
        if !next.iter().all(|x| x.is_finite()) {
            return None;
        }
        is_bound = next.iter().zip(&m).all(|(next, m)| next <= m);
        if is_bound {
            break;
        }
        m = next.iter().map(|next| next * (1.0 + RAISED) + f64::MIN_POSITIVE).collect();
    }
    if !is_bound {
        return None;
    }
    let mut x: Vec<Interval> = m.iter().map(|&m| Interval::of_size(m)).collect();
    for _ in 0..ROUNDS {
        let images = product(&x);
        let next = images.iter().zip(b).zip(&x).map(|((p, b), x)| (*p + *b).common(*x));
        let next = next.collect::<Option<Vec<Interval>>>()?;
        let still = next.iter().zip(&x).all(|(next, x)| next.width() > SETTLED * x.width());
        x = next;
        if still {
            break;
        }
    }
    Some(x)
}
