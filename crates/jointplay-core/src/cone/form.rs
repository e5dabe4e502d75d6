//! Programs in the coordinates of their sets, deformations eliminated.

use nalgebra::{DMatrix, DVector};

use crate::clearance::offset::inner;
use crate::cone::answer::{Answer, Outcome};
use crate::cone::bodies::{Atom, Own};
use crate::cone::lanes::layout::Question;
use crate::cone::{Kind, Program};

/// A program `sum_j t_j E_j p_j + S y = f` with every equation divided by its scale.
pub(super) struct Form<'a> {
    program: &'a Program,
    /// The coordinates of the blocks that have sets, and the number of the first of each.
    owns: Vec<Option<(usize, Own)>>,
    /// The bodies with their first coordinates, and whether the factor scales them.
    pub bodies: Vec<(usize, Atom, bool)>,
    /// Coefficients of the coordinates, one column each.
    pub e: DMatrix<f64>,
    /// Forces along the coordinates without self-stress.
    pub force: DVector<f64>,
    pub right: DVector<f64>,
    pub springs: DMatrix<f64>,
    pub scales: Vec<f64>,
    /// Whether the factor on the clearances is asked.
    pub variable: bool,
}

/// What a compliance makes of forces.
fn given(compliance: &[f64], forces: &[f64]) -> Vec<f64> {
    compliance.chunks_exact(forces.len()).map(|row| inner(row, forces)).collect()
}

impl<'a> Form<'a> {
    pub fn new(program: &'a Program, question: Question) -> Self {
        let s = program.n_equations();
        let variable = question == Question::Assembly;
        let (mut owns, mut bodies) = (Vec::with_capacity(program.blocks.len()), Vec::new());
        let (mut columns, mut force) = (Vec::new(), Vec::new());
        let mut right = DVector::from_column_slice(&program.right);
        let mut springs = DMatrix::zeros(s, s);
        for block in &program.blocks {
            match &block.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => {
                    let own = Own::of(set);
                    let (first, scaled) = (force.len(), variable && matches!(block.kind, Kind::Clearance(_)));
                    bodies.extend(own.atoms().map(|(from, atom)| (first + from, atom, scaled)));
                    for column in own.columns() {
                        columns.extend((0..s).map(|i| inner(block.row(i), &column[..block.size()])));
                        force.push(if variable { 0.0 } else { inner(&block.force, &column[..block.size()]) });
                    }
                    owns.push(Some((first, own)));
                    continue;
                }
                Kind::Spring(compliance) if !variable => {
                    let loaded = given(compliance, &block.force);
                    for j in 0..s {
                        right[j] -= inner(block.row(j), &loaded);
                        let yielding = given(compliance, block.row(j));
                        (0..s).for_each(|i| springs[(i, j)] += inner(block.row(i), &yielding));
                    }
                }
                Kind::Spring(_) => {}
            }
            owns.push(None);
        }
        let mut e = DMatrix::from_column_slice(s, force.len(), &columns);
        let mut scales = vec![1.0; s];
        for (i, scale) in scales.iter_mut().enumerate() {
            let reach = e.row(i).iter().map(|e| e.abs()).sum::<f64>().max(right[i].abs());
            if reach > 0.0 {
                *scale = reach;
                e.row_mut(i).unscale_mut(reach);
                right[i] /= reach;
                springs.row_mut(i).unscale_mut(reach);
                springs.column_mut(i).unscale_mut(reach);
            }
        }
        Self { program, owns, bodies, e, force: DVector::from_vec(force), right, springs, scales, variable }
    }

    pub fn forces(&self, y: &DVector<f64>) -> DVector<f64> {
        &self.force + self.e.tr_mul(y)
    }

    /// Whether the factor scales a coordinate.
    pub fn is_scaled(&self, coordinate: usize) -> bool {
        let mut owners = self.bodies.iter().rev().filter(|(first, ..)| *first <= coordinate);
        owners.next().is_some_and(|(_, _, scaled)| *scaled)
    }

    /// The coordinates of displacements, as parts of the sets.
    pub fn coordinates(&self, displacements: &[Vec<f64>], factor: f64) -> Vec<f64> {
        let mut p = vec![0.0; self.force.len()];
        for ((own, block), offset) in self.owns.iter().zip(&self.program.blocks).zip(displacements) {
            if let (Some((first, own)), Some(set)) = (own, block.kind.set()) {
                let part = self.part(&block.kind, factor);
                own.coordinates(set, offset).zip(&mut p[*first..]).for_each(|(from, to)| *to = from / part);
            }
        }
        p
    }

    /// By how much a block's set is larger.
    const fn part(&self, kind: &Kind, factor: f64) -> f64 {
        if self.variable && matches!(kind, Kind::Clearance(_)) { factor } else { 1.0 }
    }

    /// The answer at multipliers and coordinates, measured by itself.
    pub fn answer(&self, y: &DVector<f64>, p: &[f64], factor: f64, residual: f64) -> Answer {
        let multipliers: Vec<f64> = y.iter().zip(&self.scales).map(|(y, scale)| y / scale).collect();
        let forces = self.forces(y);
        let mut dual_value = inner(&self.program.right, &multipliers);
        for (first, body, _) in self.bodies.iter().filter(|(.., scaled)| !scaled) {
            dual_value -= body.support(&forces.as_slice()[*first..first + body.size()]);
        }
        let mut value = if self.variable { factor } else { -inner(p, self.force.as_slice()) };
        let blocks = self.program.blocks.iter().zip(&self.owns);
        let displacements = blocks.map(|(block, own)| match (own, &block.kind) {
            (Some((first, own)), kind) => {
                let part = self.part(kind, factor);
                own.offset(&p[*first..])[..block.size()].iter().map(|d| part * d).collect()
            }
            (None, Kind::Spring(compliance)) if !self.variable => {
                let reaction = block.reaction(&multipliers);
                let given = given(compliance, &reaction);
                let stored = 0.5 * inner(&given, &reaction);
                value += stored - inner(&given, &block.force);
                dual_value -= stored;
                given
            }
            _ => vec![0.0; block.size()],
        });
        let displacements = displacements.collect();
        let least = if self.variable { self.right.amax().min(1.0) } else { self.force.amax() };
        let unit = value.abs().max(dual_value.abs()).max(least);
        let gap = if unit > 0.0 { (value - dual_value).abs() / unit } else { 0.0 };
        let outcome = Outcome::judged(gap, residual);
        Answer { outcome, displacements, multipliers, factor, value, dual_value, gap, unit, residual }
    }
}
