//! What can give way in an over-constrained or elastic mechanism, and where the load holds it.
//!
//! Blocks that no equation of compatibility ties to others are decided by statics alone: an offset is the
//! support point of the reaction, a deformation the compliance times it. The others are decided together by
//! a cone program, whose multipliers are the self-stresses.

use nalgebra::DVector;

use super::basis::Basis;
use super::compatibility::{Compatibility, FITS};
use crate::ascent::UNDECIDED;
use crate::clearance::Face;
use crate::cone::{Answer, Block, Kind, Outcome, Program, Springs};
use crate::mechanism::Mechanism;
use crate::space::Component;

/// A reaction found by a cone program is zero below this part of the largest one.
pub(super) const UNDECIDED_TOGETHER: f64 = 1e-7;

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

/// Where the displacements are, and the forces on them.
#[derive(Clone, Debug)]
pub(crate) struct Balance {
    /// Displacement of every give, clearances and deformations apart from each other.
    pub given: Vec<Vec<f64>>,
    /// Force on every displacement.
    pub forces: DVector<f64>,
    /// Factor on the clearances, where that was asked.
    pub factor: f64,
    /// Relative duality gap of the program; zero where statics sufficed.
    pub gap: f64,
    /// Whether the program was solved to the end.
    pub solved: bool,
    /// What the program answered.
    pub answer: Option<Answer>,
}

/// What is asked of the displacements.
#[derive(Clone, Debug)]
pub(crate) enum Ask {
    /// Where the load holds them.
    Load,
    /// Where they are without any load, by least energy.
    Stress,
    /// The smallest factor on the clearances with which rigid bodies go together.
    Factor,
    /// Where they take the output farthest along a direction of its components.
    Along(Vec<f64>),
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

    /// Coefficients of a give in the equations, row-major.
    pub fn map(give: &Give, c: &Compatibility) -> Vec<f64> {
        let equations = 0..c.equations.nrows();
        equations.flat_map(|k| give.columns.iter().map(move |&row| c.equations[(k, row)])).collect()
    }

    /// Whether an equation asks for it.
    pub fn is_tied(give: &Give, c: &Compatibility) -> bool {
        give.columns.iter().any(|&row| c.equations.column(row).iter().any(|a| *a != 0.0))
    }

    /// The program of the tied gives under forces; `right` is what their displacements add up to.
    pub(super) fn program(&self, c: &Compatibility, right: &DVector<f64>, forces: &DVector<f64>) -> Program {
        let block =
            |give: &Give| Block { kind: give.kind.clone(), map: Self::map(give, c), force: Self::along(give, forces) };
        let tied = self.gives.iter().filter(|give| Self::is_tied(give, c));
        Program { right: self.cleaned(right), blocks: tied.map(block).collect() }
    }

    /// Right sides without what rounding leaves of a closed loop: that is no misfit.
    pub(super) fn cleaned(&self, right: &DVector<f64>) -> Vec<f64> {
        let clean = |(&row, b): (&usize, &f64)| if b.abs() <= FITS * self.basis.unit(row) { 0.0 } else { *b };
        self.basis.redundant.iter().zip(right.iter()).map(clean).collect()
    }

    /// What is asked, as forces on all displacements that the basis alone bears.
    pub(super) fn forces(c: &Compatibility, ask: &Ask) -> DVector<f64> {
        match ask {
            Ask::Load => c.load.clone(),
            Ask::Stress | Ask::Factor => DVector::zeros(c.load.len()),
            Ask::Along(direction) => c.output.parameters.tr_mul(&DVector::from_column_slice(direction)),
        }
    }

    /// The part of forces that works on a give.
    pub(super) fn along(give: &Give, forces: &DVector<f64>) -> Vec<f64> {
        give.columns.iter().map(|&column| forces[column]).collect()
    }

    /// Answers what is asked; `None` where no displacements are compatible.
    pub fn balance(&self, c: &Compatibility, right: &DVector<f64>, ask: &Ask) -> Option<Balance> {
        let forces = Self::forces(c, ask);
        let program = self.program(c, right, &forces);
        let none = |factor| Balance {
            given: self.gives.iter().map(|give| vec![0.0; give.columns.len()]).collect(),
            forces: forces.clone(),
            factor,
            gap: 0.0,
            solved: true,
            answer: None,
        };
        if matches!(ask, Ask::Stress | Ask::Factor) && program.right.iter().all(|b| *b == 0.0) {
            return Some(none(0.0));
        }
        if program.n_equations() == 0 {
            let mut balance = none(1.0);
            self.fill(&mut balance, &[], |give| Self::is_tied(give, c));
            return Some(balance);
        }
        let mut answer = match ask {
            Ask::Factor => program.assembly(Springs::Rigid),
            Ask::Load | Ask::Along(_) => program.pose(),
            Ask::Stress => program.unloaded(),
        };
        if answer.outcome == Outcome::Infeasible {
            return None;
        }
        if !matches!(ask, Ask::Factor) && Self::is_slack(&program) {
            // What a program has for these forces is rounding, which would decide where every clearance goes.
            answer.multipliers.fill(0.0);
        }
        let mut balance = Balance {
            forces: c.with_stress(&forces, &answer.multipliers),
            factor: answer.factor,
            gap: answer.gap,
            solved: answer.outcome == Outcome::Solved,
            ..none(1.0)
        };
        // What the forces leave open is put in the middle.
        let middle = match ask {
            Ask::Load | Ask::Along(_) => self.middle(c, &program, &balance.forces, &answer),
            Ask::Stress | Ask::Factor => None,
        };
        let tied = middle.as_ref().unwrap_or(&answer.displacements);
        self.fill(&mut balance, tied, |give| Self::is_tied(give, c));
        balance.answer = Some(answer);
        Some(balance)
    }

    /// Whether nothing pushes and the clearances take up all of the misfit, so that no joint transmits anything.
    fn is_slack(program: &Program) -> bool {
        let pushed = program.blocks.iter().flat_map(|block| &block.force).any(|force| *force != 0.0);
        !pushed && {
            let assembled = program.assembly(Springs::Rigid);
            assembled.outcome == Outcome::Solved && assembled.factor <= 1.0
        }
    }

    /// The same with every offset drawn to where it is by a spring of the given stiffness, in energy per
    /// characteristic length and radian squared: a step that is long only where much is gained.
    pub fn balance_near(
        &self,
        c: &Compatibility,
        right: &DVector<f64>,
        ask: &Ask,
        at: &[Vec<f64>],
        stiffness: f64,
    ) -> Option<Balance> {
        let forces = Self::forces(c, ask);
        let answer = self.program_near(c, right, &forces, at, stiffness).pose();
        self.balance_of_near(c, &forces, answer)
    }

    /// The program of all gives, tied or not, and of their springs.
    pub(super) fn program_near(
        &self,
        c: &Compatibility,
        right: &DVector<f64>,
        forces: &DVector<f64>,
        at: &[Vec<f64>],
        stiffness: f64,
    ) -> Program {
        let offsets = || self.gives.iter().zip(at).filter(|(give, _)| give.source.is_some());
        let ties: usize = offsets().map(|(give, _)| give.columns.len()).sum();
        let n = c.equations.nrows();
        let mut right: Vec<f64> = self.cleaned(right);
        let (mut blocks, mut springs) = (Vec::new(), Vec::new());
        for (give, at) in self.gives.iter().zip(at) {
            let (size, first) = (give.columns.len(), right.len() - n);
            let mut map = Self::map(give, c);
            map.resize(size * (n + ties), 0.0);
            if give.source.is_some() {
                // Offset minus elongation of its spring: where it is.
                let mut elongation = vec![0.0; map.len()];
                let mut compliance = vec![0.0; size * size];
                for (k, &column) in give.columns.iter().enumerate() {
                    let entry = size * (n + first + k) + k;
                    (map[entry], elongation[entry]) = (1.0, -1.0);
                    compliance[k * (size + 1)] = self.basis.unit(column).powi(2) / stiffness;
                }
                right.extend(at);
                springs.push(Block { kind: Kind::Spring(compliance), map: elongation, force: vec![0.0; size] });
            }
            blocks.push(Block { kind: give.kind.clone(), map, force: Self::along(give, forces) });
        }
        blocks.extend(springs);
        Program { right, blocks }
    }

    /// What the answer to [`Self::program_near`] says of the gives and the forces on them.
    pub(super) fn balance_of_near(
        &self,
        c: &Compatibility,
        forces: &DVector<f64>,
        mut answer: Answer,
    ) -> Option<Balance> {
        if answer.outcome == Outcome::Infeasible {
            return None;
        }
        answer.multipliers.truncate(c.equations.nrows());
        let given = answer.displacements[..self.gives.len()].to_vec();
        let tied = given.iter().zip(&self.gives).filter(|(_, give)| Self::is_tied(give, c));
        answer.displacements = tied.map(|(given, _)| given.clone()).collect();
        Some(Balance {
            given,
            forces: c.with_stress(forces, &answer.multipliers),
            factor: 1.0,
            gap: answer.gap,
            solved: answer.outcome == Outcome::Solved,
            answer: Some(answer),
        })
    }

    /// The middle of what is open among the tied gives; `None` where nothing is.
    fn middle(
        &self,
        c: &Compatibility,
        program: &Program,
        forces: &DVector<f64>,
        answer: &Answer,
    ) -> Option<Vec<Vec<f64>>> {
        let open = |give: &Give| self.face(give, c, forces).is_some_and(|face| !face.is_point());
        let any = self.gives.iter().any(|give| Self::is_tied(give, c) && open(give));
        if any { program.middle(answer, UNDECIDED_TOGETHER) } else { None }
    }

    /// Puts the displacements: of what is tied as the program says, of the others by the forces.
    pub(super) fn fill(&self, balance: &mut Balance, tied: &[Vec<f64>], is_tied: impl Fn(&Give) -> bool) {
        let mut tied = tied.iter();
        let tolerance = UNDECIDED * self.force_scale(&balance.forces);
        for (give, slot) in self.gives.iter().zip(&mut balance.given) {
            if is_tied(give) {
                *slot = tied.next().cloned().unwrap_or_default();
                continue;
            }
            let force: Vec<f64> = give.columns.iter().map(|&column| balance.forces[column]).collect();
            *slot = match &give.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => set.face(&force, tolerance).centre[..force.len()].to_vec(),
                Kind::Spring(compliance) => compliance
                    .chunks_exact(force.len())
                    .map(|row| row.iter().zip(&force).map(|(c, f)| c * f).sum())
                    .collect(),
            };
        }
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
    pub(super) fn face(&self, give: &Give, c: &Compatibility, forces: &DVector<f64>) -> Option<Face> {
        let (Kind::Clearance(set) | Kind::Fixed(set), Some(number)) = (&give.kind, give.source) else { return None };
        let force: Vec<f64> = give.columns.iter().map(|&row| forces[row]).collect();
        let part = if Self::is_tied(give, c) { UNDECIDED_TOGETHER } else { UNDECIDED };
        let source = &self.mechanism.sources[number];
        Some(set.face(&force, self.mechanism.undecided(source, part * self.force_scale(forces))))
    }
}
