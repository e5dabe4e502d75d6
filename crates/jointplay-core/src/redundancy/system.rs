//! What can give way in an over-constrained or elastic mechanism, and the programs that decide where it goes.

use nalgebra::{DMatrix, DVector};

use crate::clearance::Set;
use crate::clearance::face::Face;
use crate::clearance::undecided::UNDECIDED;
use crate::cone::bodies::Form;
use crate::cone::{Block, Kind, Program};
use crate::math::space::Component;
use crate::mechanism::{Mechanism, Source};
use crate::redundancy::balance::Balance;
use crate::redundancy::basis::Basis;
use crate::redundancy::compatibility::{FITS, Ties};

/// A reaction found by a cone program is zero below this part of the largest one.
pub(crate) const UNDECIDED_TOGETHER: f64 = 1e-7;

/// Displacements that give way together: the offset of a clearance, or the deformation of an elastic joint.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub kind: Kind,
    /// Where a basis keeps them.
    pub columns: Vec<usize>,
    /// The source whose clearance it is.
    pub source: Option<usize>,
    /// How it gives way where it is elastic.
    pub deforms: Vec<Form>,
}

impl Element {
    pub fn new(kind: Kind, columns: Vec<usize>, source: Option<usize>) -> Self {
        let deforms = kind.compliance();
        Self { kind, columns, source, deforms }
    }
}

/// A mechanism with its basis and what gives way in it.
#[derive(Clone, Debug)]
pub(crate) struct System<'m> {
    pub mechanism: &'m Mechanism,
    pub basis: &'m Basis,
    pub elements: Vec<Element>,
}

impl<'m> System<'m> {
    pub fn new(mechanism: &'m Mechanism, basis: &'m Basis) -> Self {
        Self::with_sets(mechanism, basis, |source| source.set)
    }

    /// That of a specimen, whose sizes are given beside all other parameters, where it differs from that of others.
    pub fn of_specimen(&self, parameters: &[f64]) -> Option<Self> {
        let m = self.mechanism;
        m.has_sizes().then(|| Self::with_sets(m, self.basis, |source| source.set_at(parameters)))
    }

    fn with_sets(mechanism: &'m Mechanism, basis: &'m Basis, set: impl Fn(&Source) -> Set) -> Self {
        let clearances = mechanism.sources.iter().enumerate().filter(|(_, s)| s.is_clearance);
        let mut elements: Vec<Element> = clearances
            .map(|(number, source)| (number, source, set(source)))
            .filter(|(_, _, set)| !set.is_zero())
            .map(|(number, source, set)| {
                let columns = source.range().map(|p| mechanism.place_of(p)).collect();
                Element::new(Kind::Clearance(set), columns, Some(number))
            })
            .collect();
        elements.extend(
            mechanism
                .elastic
                .iter()
                .map(|e| Element::new(Kind::Spring(e.compliance.clone()), e.rows.clone().collect(), None)),
        );
        Self { mechanism, basis, elements }
    }

    /// What is elastic.
    pub fn springs(&self) -> Vec<Element> {
        self.elements.iter().filter(|element| element.source.is_none()).cloned().collect()
    }

    /// Whether nothing is elastic.
    pub fn is_rigid(&self) -> bool {
        self.elements.iter().all(|element| element.source.is_some())
    }

    /// Coefficients of an element in equations, row-major.
    pub fn map(element: &Element, equations: &DMatrix<f64>) -> Vec<f64> {
        equations.row_iter().flat_map(|row| element.columns.iter().map(move |&column| row[column])).collect()
    }

    /// Whether an equation asks for it.
    pub fn is_tied(element: &Element, c: &Ties) -> bool {
        element.columns.iter().any(|&row| (0..c.equations.nrows()).any(|k| c.equations[(k, row)] != 0.0))
    }

    /// The program of the tied elements under forces; `right` is what their displacements add up to.
    pub(crate) fn program(&self, c: &Ties, right: &DVector<f64>, forces: &DVector<f64>) -> Program {
        let block = |element: &Element| Block {
            kind: element.kind.clone(),
            map: Self::map(element, &c.equations),
            force: Self::along(element, forces),
        };
        let tied = self.elements.iter().filter(|element| Self::is_tied(element, c));
        Program { right: self.cleaned(right), blocks: tied.map(block).collect() }
    }

    /// The tied elements with their coefficients in the first equation.
    pub(crate) fn on_first_equation(
        &self,
        c: &Ties,
    ) -> impl Iterator<Item = (&Kind, impl Iterator<Item = f64>)> + Clone {
        let tied = self.elements.iter().filter(|element| Self::is_tied(element, c));
        tied.map(|element| (&element.kind, element.columns.iter().map(|&column| c.equations[(0, column)])))
    }

    /// Right sides without what rounding leaves of a closed loop: that is no misfit.
    pub(crate) fn cleaned(&self, right: &DVector<f64>) -> Vec<f64> {
        let clean = |(&row, b): (&usize, &f64)| if b.abs() <= FITS * self.basis.unit(row) { 0.0 } else { *b };
        self.basis.redundant.iter().zip(right.iter()).map(clean).collect()
    }

    /// The part of forces that works on an element.
    pub(crate) fn along(element: &Element, forces: &DVector<f64>) -> Vec<f64> {
        element.columns.iter().map(|&column| forces[column]).collect()
    }

    /// The same of a clearance, filled up with zeros.
    pub(crate) fn on(element: &Element, forces: &DVector<f64>) -> Form {
        let mut force = Form::default();
        force.iter_mut().zip(&element.columns).for_each(|(f, &column)| *f = forces[column]);
        force
    }

    /// All displacements as the basis keeps them, offset and deformation together, beside the known ones.
    pub fn displacements(&self, balance: &Balance) -> Vec<f64> {
        let mut displacements = vec![0.0; self.basis.all.n_parameters()];
        for (element, given) in self.elements.iter().zip(&balance.given) {
            element.columns.iter().zip(given).for_each(|(&row, d)| displacements[row] += d);
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

    /// The faces of elements that the forces expose; of what is elastic there is none.
    pub(crate) fn faces(&self, c: &Ties, forces: &DVector<f64>) -> impl Fn(&Element) -> Option<Face> {
        let scale = self.force_scale(forces);
        move |element| {
            let (Kind::Clearance(set) | Kind::Fixed(set), Some(number)) = (&element.kind, element.source) else {
                return None;
            };
            let force = Self::on(element, forces);
            let part = if Self::is_tied(element, c) { UNDECIDED_TOGETHER } else { UNDECIDED };
            let tolerance = self.mechanism.sources[number].undecided(part * scale);
            Some(set.face(&force[..set.size()], tolerance))
        }
    }
}
