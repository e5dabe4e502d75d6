//! The linearised pose of a strained specimen.
//!
//! Of the offsets and deformations that a specimen's deviations allow those with the least energy are taken, and
//! of these, where there are several, the farthest along a direction: both in one program under a load along the
//! direction that is small beside the forces that strain a specimen, and deforms nothing by more than a small part of the
//! displacements.

use nalgebra::DVector;

use crate::cone::Kind;
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::questions::worst::over_constrained::deviations::Deviations;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::system::System;

/// What part of those the load of a direction is.
const SMALL: f64 = 1e-5;

/// A linearisation with everything that does not depend on the deviations.
pub(super) struct Model<'a> {
    /// Clearances and what is elastic.
    pub system: &'a System<'a>,
    pub deviations: &'a Deviations<'a>,
    pub compatibility: &'a Compatibility,
    /// What displacements must add up to, and the error, without deviations and displacements.
    pub right: DVector<f64>,
    pub base: Vec<f64>,
    /// The strongest force that strains a specimen ([`Self::strongest`]).
    pub strain: f64,
}

/// A specimen and where it is pulled.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    pub specimen: Vec<f64>,
    /// Weights of the output's components, or none.
    pub weights: Vec<f64>,
}

/// Where a specimen is.
#[derive(Clone, Debug)]
pub(super) struct Strained {
    pub error: Vec<f64>,
    pub balance: Balance,
}

impl Model<'_> {
    /// The strength of a load along weights: such a part of the strongest forces that strain a specimen, and of the
    /// displacements where what is elastic deforms by it alone.
    pub fn strength(&self, weights: &[f64], part: f64) -> f64 {
        let system = self.system;
        let forces = Ask::Along(weights.to_vec()).forces(self.compatibility, &self.compatibility.output.parameters);
        let unit = |column: usize| system.basis.unit(column);
        let (mut deforms, mut moves, mut size) = (0.0_f64, 0.0_f64, 0.0_f64);
        for element in &system.elements {
            for (k, &column) in element.columns.iter().enumerate() {
                size = size.max(forces[column].abs() * unit(column));
                match &element.kind {
                    Kind::Spring(compliance) => {
                        let row = &compliance[k * element.columns.len()..(k + 1) * element.columns.len()];
                        let deformation: f64 = row.iter().zip(&element.columns).map(|(f, &c)| f * forces[c]).sum();
                        deforms = deforms.max(deformation.abs() / unit(column));
                    }
                    Kind::Clearance(set) | Kind::Fixed(set) => moves = moves.max(set.half_width(k) / unit(column)),
                }
            }
        }
        let widths = self.deviations.columns().into_iter().zip(self.deviations.half_widths());
        moves = widths.fold(moves, |moves, (column, width)| moves.max(width / unit(column)));
        let redundant = system.basis.redundant.iter().zip(self.right.iter());
        moves = redundant.fold(moves, |moves, (&row, b)| moves.max(b.abs() / unit(row)));
        let ratio = |a: f64, b: f64| if b > 0.0 { part * a / b } else { f64::INFINITY };
        let strength = ratio(self.strain, size).min(ratio(moves, deforms));
        if strength.is_finite() { strength } else { 1.0 }
    }

    /// The strongest force on what is elastic where some specimens are, moments at the characteristic length.
    pub fn strongest<'s>(&self, specimens: impl Iterator<Item = &'s Strained>) -> f64 {
        let system = self.system;
        let springs =
            || system.elements.iter().filter(|element| element.source.is_none()).flat_map(|element| &element.columns);
        let of = |strained: &Strained| {
            springs().fold(0.0, |most: f64, &c| most.max(strained.balance.forces[c].abs() * system.basis.unit(c)))
        };
        specimens.map(of).fold(0.0, f64::max)
    }

    /// A specimen without any pull.
    pub fn unpulled(&self, specimen: Vec<f64>) -> Tried {
        Tried { specimen, weights: vec![0.0; self.base.len()] }
    }

    /// What the displacements of a specimen must add up to.
    pub fn right_of(&self, specimen: &[f64]) -> DVector<f64> {
        let columns = self.deviations.columns();
        let mut right = self.right.clone();
        columns.iter().zip(specimen).for_each(|(&column, d)| right -= self.compatibility.equations.column(column) * *d);
        right
    }

    /// A load along weights that is such a part as [`Self::strength`] says.
    fn load(&self, weights: &[f64], part: f64) -> DVector<f64> {
        let c = self.compatibility;
        Ask::Along(weights.to_vec()).forces(c, &c.output.parameters) * self.strength(weights, part)
    }

    /// Where some specimens are, each pulled along its weights; `None` where it cannot be assembled at all.
    pub fn poses(&self, asks: &[Tried]) -> Vec<Option<Strained>> {
        Rounds::each_in_chunks(asks, CHUNK, async |rounds, Tried { specimen, weights }| {
            let (right, load) = (self.right_of(specimen), self.load(weights, SMALL));
            let balance = self.system.pushed(rounds, self.compatibility, &right, &load).await?;
            Some(self.strained(specimen, balance))
        })
    }

    /// The same of one specimen by itself, under a load as small as is given.
    pub fn pose_alone(&self, specimen: &[f64], weights: &[f64], small: f64) -> Option<Strained> {
        let (right, load) = (self.right_of(specimen), self.load(weights, small));
        Some(self.strained(specimen, self.system.pushed_alone(self.compatibility, &right, &load)?))
    }

    fn strained(&self, specimen: &[f64], balance: Balance) -> Strained {
        let mut displacements = DVector::from_vec(self.system.displacements(&balance));
        self.deviations.columns().iter().zip(specimen).for_each(|(&column, d)| displacements[column] += d);
        let moved = &self.compatibility.output.parameters * displacements;
        Strained { error: self.base.iter().zip(&moved).map(|(a, b)| a + b).collect(), balance }
    }
}
