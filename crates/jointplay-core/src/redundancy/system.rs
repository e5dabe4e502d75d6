//! What can give way in an over-constrained or elastic mechanism, and the programs that decide where it goes.

use nalgebra::DVector;

use crate::clearance::face::Face;
use crate::clearance::mute::UNDECIDED;
use crate::cone::lanes::programs::Programs;
use crate::cone::{Block, Kind, Program};
use crate::math::space::Component;
use crate::mechanism::{Basis, Mechanism};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{FITS, Ties};

/// A reaction found by a cone program is zero below this part of the largest one.
pub(crate) const UNDECIDED_TOGETHER: f64 = 1e-7;

/// Displacements that give way together: the offset of a clearance, or the deformation of an elastic joint.
#[derive(Clone, Debug)]
pub(crate) struct Give {
    pub kind: Kind,
    /// Where a basis keeps them.
    pub columns: Vec<usize>,
    /// The source whose clearance it is.
    pub source: Option<usize>,
}

/// A mechanism with its basis and what gives way in it.
#[derive(Clone, Debug)]
pub(crate) struct System<'m> {
    pub mechanism: &'m Mechanism,
    pub basis: &'m Basis,
    pub gives: Vec<Give>,
}

impl<'m> System<'m> {
    pub fn new(mechanism: &'m Mechanism, basis: &'m Basis) -> Self {
        let clearances = mechanism.sources.iter().enumerate().filter(|(_, s)| s.is_clearance && !s.set.is_zero());
        let mut gives: Vec<Give> = clearances
            .map(|(number, source)| Give {
                kind: Kind::Clearance(source.set),
                columns: source.range().map(|p| mechanism.place_of(p)).collect(),
                source: Some(number),
            })
            .collect();
        gives.extend(mechanism.elastic.iter().map(|e| Give {
            kind: Kind::Spring(e.compliance.clone()),
            columns: e.rows.clone().collect(),
            source: None,
        }));
        Self { mechanism, basis, gives }
    }

    /// What is elastic.
    pub fn springs(&self) -> Vec<Give> {
        self.gives.iter().filter(|give| give.source.is_none()).cloned().collect()
    }

    /// Whether nothing is elastic.
    pub fn is_rigid(&self) -> bool {
        self.gives.iter().all(|give| give.source.is_some())
    }

    /// Coefficients of a give in the equations, row-major.
    pub fn map(give: &Give, c: &Ties) -> Vec<f64> {
        let equations = 0..c.equations.nrows();
        equations.flat_map(|k| give.columns.iter().map(move |&row| c.equations[(k, row)])).collect()
    }

    /// Whether an equation asks for it.
    pub fn is_tied(give: &Give, c: &Ties) -> bool {
        give.columns.iter().any(|&row| c.equations.column(row).iter().any(|a| *a != 0.0))
    }

    /// The program of the tied gives under forces; `right` is what their displacements add up to.
    pub(crate) fn program(&self, c: &Ties, right: &DVector<f64>, forces: &DVector<f64>) -> Program {
        let block =
            |give: &Give| Block { kind: give.kind.clone(), map: Self::map(give, c), force: Self::along(give, forces) };
        let tied = self.gives.iter().filter(|give| Self::is_tied(give, c));
        Program { right: self.cleaned(right), blocks: tied.map(block).collect() }
    }

    /// The programs of these gives in several states, of one structure: for what ties the gives there, what their
    /// displacements add up to, and the forces.
    pub(crate) fn programs<'a>(
        &self,
        tied: &[&Give],
        states: impl Iterator<Item = (&'a Ties, &'a DVector<f64>, &'a DVector<f64>)>,
    ) -> Programs<'static> {
        let columns: Vec<usize> = tied.iter().flat_map(|give| &give.columns).copied().collect();
        let (mut maps, mut pushes, mut rights) = (Vec::new(), Vec::new(), Vec::new());
        let mut n = 0;
        for (ties, right, forces) in states {
            n += 1;
            maps.extend(ties.equations.row_iter().flat_map(|row| columns.iter().map(move |&c| row[c])));
            pushes.extend(columns.iter().map(|&c| forces[c]));
            rights.extend(self.cleaned(right));
        }
        Programs {
            n,
            n_equations: self.basis.redundancy(),
            n_blocks: tied.len(),
            kinds: tied.iter().map(|give| give.kind.clone()).collect(),
            maps: maps.into(),
            forces: pushes.into(),
            rights: rights.into(),
        }
    }

    /// Right sides without what rounding leaves of a closed loop: that is no misfit.
    pub(crate) fn cleaned(&self, right: &DVector<f64>) -> Vec<f64> {
        let clean = |(&row, b): (&usize, &f64)| if b.abs() <= FITS * self.basis.unit(row) { 0.0 } else { *b };
        self.basis.redundant.iter().zip(right.iter()).map(clean).collect()
    }

    /// The part of forces that works on a give.
    pub(crate) fn along(give: &Give, forces: &DVector<f64>) -> Vec<f64> {
        give.columns.iter().map(|&column| forces[column]).collect()
    }

    /// All displacements as the basis keeps them, offset and deformation together, beside the known ones.
    pub fn displacements(&self, balance: &Balance) -> Vec<f64> {
        let mut displacements = vec![0.0; self.basis.all.n_parameters()];
        for (give, given) in self.gives.iter().zip(&balance.given) {
            give.columns.iter().zip(given).for_each(|(&row, d)| displacements[row] += d);
        }
        displacements
    }

    /// Size of the forces, moments at the characteristic length.
    pub fn force_scale(&self, forces: &DVector<f64>) -> f64 {
        let m = self.mechanism;
        m.rows.iter().zip(forces.iter()).fold(0.0, |largest: f64, (row, f)| {
            largest.max(match row.component {
                Component::Along(_) => f.abs(),
                Component::About(_) => f.abs() / m.length,
            })
        })
    }

    /// The face of a clearance that the forces expose.
    pub(crate) fn face(&self, give: &Give, c: &Ties, forces: &DVector<f64>) -> Option<Face> {
        let (Kind::Clearance(set) | Kind::Fixed(set), Some(number)) = (&give.kind, give.source) else { return None };
        let force: Vec<f64> = give.columns.iter().map(|&row| forces[row]).collect();
        let part = if Self::is_tied(give, c) { UNDECIDED_TOGETHER } else { UNDECIDED };
        let source = &self.mechanism.sources[number];
        Some(set.face(&force, self.mechanism.undecided(source, part * self.force_scale(forces))))
    }
}
