//! How a cost of the poses of an enclosure changes with the offsets.

use crate::math::affine::{Form, Forms};
use crate::math::interval::Interval;
use crate::math::real::Real;
use crate::questions::certificate::enclosure::{Encloser, Enclosure, Expanded};
use crate::questions::certificate::linear::fixed_point;

impl Encloser<'_> {
    /// The gradient along the own coordinates, over an enclosure, of a cost given by its gradients along twists and
    /// parameters: with `J^T l = c_q` it is `c_u - F_u^T l`.
    pub fn gradient<'f>(
        &self,
        forms: &'f Forms,
        (enclosure, expanded): (&Enclosure, &Expanded<'f>),
        twists: &[Form<'f>],
        parameters: &[Form<'f>],
    ) -> Option<Vec<Form<'f>>> {
        let (size, modes) = (self.chart.mechanism.size(), &enclosure.modes);
        let nonzero = |(c, form): &(f64, Form<'f>)| *c != 0.0 && !form.is_zero();
        let along_modes = |row: &[Form<'f>]| -> Vec<Form<'f>> {
            let along =
                |j: usize| forms.sum(row.iter().enumerate().map(|(i, c)| (modes.motion(i)[j], *c)).filter(nonzero));
            (0..modes.n).map(along).collect()
        };
        let bodies = twists.chunks_exact(size).zip(expanded.v.chunks_exact(size));
        let cost: Vec<Form<'_>> = bodies.flat_map(|(twist, v)| self.chart.along_body(twist, v)).collect();
        // With l = C' y:  y' = c_q' U (C F_q U)^-1 = c_q' U + y' (1 - C F_q U); with y0 in the middle of c_q' U
        //    = y0' + (c_q' - y0' C F_q) U + (y - y0)' (1 - C F_q U)
        let y0: Vec<f64> = along_modes(&cost).iter().map(|f| f.range().middle()).collect();
        let weight = |row: usize| {
            let terms = (0..modes.n).map(|j| Interval::from_point(y0[j]).scaled(modes.correction(j)[row]));
            let weight = terms.fold(Interval::ZERO, |sum, term| sum + term);
            (weight.middle(), weight - Interval::from_point(weight.middle()))
        };
        let weights: Vec<(f64, Interval)> = (0..modes.n).map(weight).collect();
        let mut terms: Vec<Vec<(f64, Form<'_>)>> = cost.iter().map(|c| vec![(1.0, *c)]).collect();
        for &(row, column, value) in &expanded.equations.along_poses {
            // A product of its own for every entry would be a form each.
            let (middle, off) = weights[row];
            terms[column].extend([(-middle, value), (-1.0, Form::Constant(off * value.range()))]);
        }
        let change: Vec<Form<'_>> = terms.into_iter().map(|terms| forms.sum(terms.into_iter())).collect();
        let change = along_modes(&change);
        let ranges: Vec<Interval> = change.iter().map(|f| f.range()).collect();
        let off = fixed_point(&ranges, |y| enclosure.defect.transposed_times(y))?;
        let rest = enclosure.defect.transposed_times(&off);
        let y = |j: usize| change[j] + Form::Constant(rest[j]) + Form::from_f64(y0[j]);
        let y: Vec<Form<'_>> = (0..modes.n).map(y).collect();
        let multiplier = |row: usize| {
            let terms = y.iter().enumerate().map(|(j, y)| (modes.correction(j)[row], *y));
            forms.sum(terms.filter(nonzero))
        };
        let multipliers: Vec<Form<'_>> = (0..modes.n).map(multiplier).collect();
        let mut gradient = parameters.to_vec();
        for &(row, p, value) in &expanded.equations.along_parameters {
            gradient[p] = gradient[p] + value * multipliers[row];
        }
        Some(self.own_gradient(&gradient))
    }
}
