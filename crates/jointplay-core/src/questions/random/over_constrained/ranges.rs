//! Ranges of the histograms: what clearances, tolerances and springs can do to first order.

use nalgebra::{DMatrix, DVector};

use crate::math::decomposition::pseudo_inverse;
use crate::mechanism::Source;
use crate::questions::random::request::Request;
use crate::questions::random::tally::Ranges;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::system::System;

/// What specimens can reach.
pub struct Reach<'a> {
    pub system: &'a System<'a>,
    pub c: &'a Compatibility,
    pub request: &'a Request,
}

impl Reach<'_> {
    /// Ranges about an error in their middle.
    pub fn ranges(&self, middle: &[f64]) -> Ranges {
        let m = self.system.mechanism;
        let map = &self.c.output.parameters;
        let mut half: Vec<f64> = (0..m.size()).map(|i| self.of_sets(|place| map[(i, place)])).collect();
        for (row, size) in self.deformations().into_iter().enumerate() {
            half.iter_mut().enumerate().for_each(|(i, h)| *h += map[(i, row)].abs() * size);
        }
        Ranges::new(middle, &half, m.n_translations())
    }

    /// What the sets of all sources reach in a linear form of the displacements.
    fn of_sets(&self, form: impl Fn(usize) -> f64) -> f64 {
        let m = self.system.mechanism;
        let of = |source: &Source| {
            let row: Vec<f64> = source.range().map(|p| form(m.place_of(p))).collect();
            let opposite: Vec<f64> = row.iter().map(|r| -r).collect();
            // An untruncated law reaches beyond its set of three standard deviations.
            let (factor, set) = (m.reach_of(source, self.request), source.largest_set());
            factor * 0.5 * (set.support(&row) + set.support(&opposite))
        };
        m.sources().iter().map(of).sum()
    }

    /// How far every row may deform: by the load, and by the largest misfit if no clearance took up any of it.
    fn deformations(&self) -> Vec<f64> {
        let (m, c) = (self.system.mechanism, self.c);
        let (s, rows) = (c.equations.nrows(), m.n_rows());
        let by_load = self.system.balance(c, &c.misfit, &Ask::Load);
        let by_load = by_load.map_or_else(|| vec![0.0; rows], |balance| self.system.displacements(&balance));
        // Specimens differ in where the load finds them: twice is room enough.
        let most = by_load.iter().take(rows).map(|size| 2.0 * size.abs());
        if s == 0 {
            return most.collect();
        }
        let mut compliance = DMatrix::zeros(rows, rows);
        for e in &m.elastic {
            let size = e.rows.len();
            let block = DMatrix::from_row_slice(size, size, &e.compliance);
            compliance.view_mut((e.rows.start, e.rows.start), (size, size)).copy_from(&block);
        }
        let lack = DVector::from_fn(s, |k, _| c.misfit[k].abs() + self.of_sets(|place| c.equations[(k, place)]));
        let of_rows = c.equations.columns(0, rows);
        let along = &compliance * of_rows.transpose();
        // Equations in different units are compared each with its own flexibility.
        let flexibility = of_rows * &along;
        let scale = flexibility.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let scales = &scale * scale.transpose();
        let scaled = pseudo_inverse(&flexibility.component_mul(&scales), 1e-12);
        let inverse = scaled.unwrap_or_else(|| DMatrix::zeros(s, s)).component_mul(&scales);
        let by_misfit = (along * inverse).map(f64::abs) * lack;
        most.zip(by_misfit.iter()).map(|(load, misfit)| load + misfit).collect()
    }
}
