//! The room that clearances have together.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::cone::Kind;
use crate::cone::bodies::Form;
use crate::math::decomposition::pseudo_inverse;
use crate::mechanism::Mechanism;
use crate::questions::random::over_constrained::section::{Interior, Member, Section};
use crate::questions::random::request::Request;
use crate::redundancy::openings::Openings;
use crate::redundancy::system::System;

/// A clearance is loose when its force does less than this part of the largest one.
pub const LOOSE: f64 = 1e-7;
/// What is elastic takes part in a correction by the square of this, beside clearances.
const DEFORMS: f64 = 1e-3;

/// The room that clearances have together, in which they scatter.
pub struct Room<'r> {
    pub section: Cow<'r, Section>,
    /// The numbers of their elements.
    pub numbers: Cow<'r, [usize]>,
    /// Their offsets in the displacements of the specimen before they are drawn.
    pub at_rest: Vec<Form>,
    /// What the offsets have to add up to.
    pub right: DVector<f64>,
    /// The gaps of the flanks among them where all are in the middle of their sets.
    pub gaps: Vec<f64>,
    /// Offsets well within their sets, where they are known.
    pub interior: Option<Interior>,
    /// What corrects the misfit of the second order that is left, with the least displacements.
    pub correction: Cow<'r, DMatrix<f64>>,
    pub openings: Option<Cow<'r, Openings>>,
}

impl Room<'_> {
    /// Whether there are flanks, which the exact closure may take far.
    pub fn has_flanks(&self) -> bool {
        !self.gaps.is_empty()
    }

    /// What corrects a misfit of offsets, deviations and deformations.
    pub fn correct(&self, misfit: DVector<f64>, offsets: &[f64]) -> DVector<f64> {
        let change = &*self.correction * misfit;
        match &self.openings {
            Some(openings) => openings.change(offsets, change),
            None => change,
        }
    }
}

/// The section of some clearances by equations, with what opens the flanks among them.
pub fn section(
    system: &System<'_>,
    equations: &DMatrix<f64>,
    openings: Option<&Openings>,
    numbers: &[usize],
    request: &Request,
) -> Section {
    let member = |&g: &usize| {
        let element = &system.elements[g];
        let (Kind::Clearance(set), Some(source)) = (&element.kind, element.source) else { return None };
        let law = Mechanism::law(&system.mechanism.sources[source], request);
        let opens = openings.map_or(Vec::new(), |openings| System::map(element, openings.rates()));
        let is_flank = openings.is_some() && element.flank(system.mechanism).is_some();
        Some(Member { set: *set, law, map: System::map(element, equations), opens, is_flank })
    };
    Section::new(numbers.iter().filter_map(member).collect(), equations.nrows())
}

/// Displacements of all rows, of least length-scaled size, that make up for a misfit: offsets of the given
/// clearances, and deformations where these cannot.
pub fn least_displacements(system: &System<'_>, equations: &DMatrix<f64>, clearances: &[usize]) -> DMatrix<f64> {
    let rows = system.mechanism.n_rows();
    if equations.nrows() == 0 {
        return DMatrix::zeros(rows, 0);
    }
    let mut weights = vec![0.0; rows];
    for (g, element) in system.elements.iter().enumerate() {
        for (k, &row) in element.columns.iter().enumerate() {
            let (moves, weight) = match &element.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => (clearances.contains(&g) && set.half_width(k) > 0.0, 1.0),
                Kind::Spring(compliance) => (compliance[k * (element.columns.len() + 1)] > 0.0, DEFORMS),
            };
            if moves {
                weights[row] = weight * system.basis.unit(row);
            }
        }
    }
    let mut scaled = equations.columns(0, rows).into_owned();
    for (row, weight) in weights.iter().enumerate() {
        scaled.column_mut(row).scale_mut(*weight);
    }
    let mut inverse = pseudo_inverse(&scaled, LOOSE * scaled.norm()).unwrap_or_else(|| scaled.transpose());
    for row in 0..rows {
        inverse.row_mut(row).scale_mut(weights[row]);
    }
    inverse
}
