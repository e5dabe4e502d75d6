//! Where poses would be if the closure Jacobian did not change: what is of second order along the straight line to a part.

use crate::math::affine::{Form, Forms};
use crate::math::interval::Interval;
use crate::questions::certificate::blocks::Part;
use crate::questions::certificate::enclosure::{At, Encloser, points};
use crate::questions::certificate::modes::Modes;
use crate::questions::certificate::second::Second;

impl Encloser<'_> {
    /// The derivatives of all rows of the closure along the own coordinates, where poses are on the line: rows, and the
    /// coordinates of each.
    pub(super) fn derivatives<'f>(
        &self,
        forms: &'f Forms,
        (part, at): (&Part, &At),
        slopes: &[f64],
    ) -> Vec<Vec<Form<'f>>> {
        let straight = self.expand(forms, (part, at), slopes, None).equations;
        let (n, rows) = (self.product.n, at.near.len());
        let mut along_poses = vec![Vec::new(); rows];
        for &(row, column, value) in &straight.along_poses {
            along_poses[row].push((column, value));
        }
        let mut along_parameters = vec![vec![Form::Constant(Interval::ZERO); self.centre.len()]; rows];
        for &(row, p, value) in &straight.along_parameters {
            along_parameters[row][p] = value;
        }
        let of_row = |row: usize| -> Vec<Form<'_>> {
            let own = self.own_gradient(&along_parameters[row]);
            let along = |k: usize| {
                let moved = along_poses[row].iter().map(|&(column, value)| (slopes[column * n + k], value));
                forms.sum(moved.chain([(-1.0, own[k])]).filter(|(c, form)| *c != 0.0 && !form.is_zero()))
            };
            self.product.slabs.split_forms(forms, (0..n).map(along).collect())
        };
        (0..rows).map(of_row).collect()
    }

    /// The operator without its second term: what z is where the Jacobian does not change. On the way from the point,
    ///
    /// ```text
    /// F(q0 + S d, u(x)) = F(q0, u0) + sum over k of d_k times the mean of (F_q S + F_u)_k on the way
    /// ```
    ///
    /// so that what is of second order is known from what these derivatives are in first order. It is summed over all rows
    /// before it is bounded, because most of it cancels.
    pub(super) fn bent(
        &self,
        modes: &Modes,
        part: &Part,
        at: &At,
        forms: &Forms,
        derivatives: &[Vec<Form<'_>>],
    ) -> Vec<Interval> {
        let (rows, base) = (at.near.len(), self.product.base(part, &at.x));
        let there = modes.corrections_of(&self.chart.residual(&self.chart.poses(&points(&at.near)), &at.parameters));
        // By own coordinate first: the derivatives along one stay in the nearest cache for all corrections.
        let along = |k: usize| {
            let coordinate = move |i: usize| {
                let terms = modes.correction(i).iter().zip(derivatives).map(|(c, of)| (*c, of[k]));
                forms.parts_of_sum(terms.filter(|(c, form)| *c != 0.0 && !form.is_zero()), at.x.len())
            };
            (0..rows).map(coordinate).collect::<Vec<_>>().into_iter()
        };
        let mut parts: Vec<_> = (0..at.x.len()).map(along).collect();
        let coordinate = |there: &Interval| {
            let second = Second::of(&self.product, (&at.x, &base), parts.iter_mut().filter_map(Iterator::next));
            Interval::of_size(second.reach(&self.product, part, &at.x)) - *there
        };
        there.iter().map(coordinate).collect()
    }
}
