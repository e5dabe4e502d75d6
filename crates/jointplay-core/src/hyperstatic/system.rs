//! What can give way in an over-constrained or elastic mechanism, and where the load holds it.
//!
//! Blocks that no equation of compatibility ties to others are decided by statics alone: an offset is the
//! support point of the reaction, a deformation the compliance times it. The others are decided together by
//! a cone program, whose multipliers are the self-stresses.

use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::compatibility::{Compatibility, FITS};
use crate::ascent::UNDECIDED;
use crate::clearance::{Face, inner};
use crate::cone::{Answer, Block, Kind, Outcome, Program, Springs};
use crate::mechanism::Mechanism;
use crate::space::Component;

/// A reaction found by a cone program is zero below this part of the largest one.
const UNDECIDED_TOGETHER: f64 = 1e-7;

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
    fn program(&self, c: &Compatibility, right: &DVector<f64>, forces: &DVector<f64>) -> Program {
        let block = |give: &Give| Block {
            kind: give.kind.clone(),
            map: Self::map(give, c),
            force: give.columns.iter().map(|&column| forces[column]).collect(),
        };
        let tied = self.gives.iter().filter(|give| Self::is_tied(give, c));
        // What rounding leaves of a closed loop is no misfit.
        let clean = |(&row, b): (&usize, &f64)| if b.abs() <= FITS * self.basis.unit(row) { 0.0 } else { *b };
        let right = self.basis.redundant.iter().zip(right.iter()).map(clean).collect();
        Program { right, blocks: tied.map(block).collect() }
    }

    /// Answers what is asked; `None` where no displacements are compatible.
    pub fn balance(&self, c: &Compatibility, right: &DVector<f64>, ask: &Ask) -> Option<Balance> {
        let forces = match ask {
            Ask::Load => c.load.clone(),
            Ask::Stress | Ask::Factor => DVector::zeros(c.load.len()),
            Ask::Along(direction) => c.output.parameters.tr_mul(&DVector::from_column_slice(direction)),
        };
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
            self.fill(c, &mut balance, &[]);
            return Some(balance);
        }
        let answer = match ask {
            Ask::Factor => program.assembly(Springs::Rigid),
            Ask::Load | Ask::Along(_) => program.pose(),
            Ask::Stress => program.unloaded(),
        };
        if answer.outcome == Outcome::Infeasible {
            return None;
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
        self.fill(c, &mut balance, middle.as_ref().unwrap_or(&answer.displacements));
        balance.answer = Some(answer);
        Some(balance)
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
    fn fill(&self, c: &Compatibility, balance: &mut Balance, tied: &[Vec<f64>]) {
        let mut tied = tied.iter();
        let tolerance = UNDECIDED * self.force_scale(&balance.forces);
        for (give, slot) in self.gives.iter().zip(&mut balance.given) {
            if Self::is_tied(give, c) {
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
    fn face(&self, give: &Give, c: &Compatibility, forces: &DVector<f64>) -> Option<Face> {
        let (Kind::Clearance(set) | Kind::Fixed(set), Some(number)) = (&give.kind, give.source) else { return None };
        let force: Vec<f64> = give.columns.iter().map(|&row| forces[row]).collect();
        let part = if Self::is_tied(give, c) { UNDECIDED_TOGETHER } else { UNDECIDED };
        let source = &self.mechanism.sources[number];
        Some(set.face(&force, self.mechanism.undecided(source, part * self.force_scale(forces))))
    }

    /// Widens what every source leaves open in the output, source by source, tells which sources the load does
    /// not decide, and gives how far all together reach from where they are; `map` is the output by displacements.
    pub fn leave_open(
        &self,
        c: &Compatibility,
        right: &DVector<f64>,
        balance: &Balance,
        open: &mut [f64],
        decided: &mut [bool],
    ) -> Vec<f64> {
        let size = self.mechanism.size();
        let map = &c.output.parameters;
        let row_of = |give: &Give, k: usize| -> Vec<f64> { give.columns.iter().map(|&row| map[(k, row)]).collect() };
        let mut widths = vec![0.0; size];
        let mut together = false;
        for give in &self.gives {
            let (Some(face), Some(source)) = (self.face(give, c, &balance.forces), give.source) else { continue };
            decided[source] &= face.is_point();
            if Self::is_tied(give, c) {
                together |= !face.is_point();
                continue;
            }
            for k in 0..size {
                let width = face.half_width(&row_of(give, k));
                open[source * size + k] = width.max(open[source * size + k]);
                widths[k] += width;
            }
        }
        if together {
            self.widen(c, right, balance, open, &mut widths);
        }
        widths
    }

    /// What the tied clearances leave open: how far they reach from where they are, together in `widths`, each
    /// by itself in `open`.
    fn widen(&self, c: &Compatibility, right: &DVector<f64>, balance: &Balance, open: &mut [f64], widths: &mut [f64]) {
        let Some(answer) = &balance.answer else { return };
        let size = widths.len();
        let program = self.program(c, right, &c.load);
        let all = self.gives.iter().zip(&balance.given);
        let tied: Vec<(&Give, &Vec<f64>)> = all.filter(|(give, _)| Self::is_tied(give, c)).collect();
        let face = |give: &Give| self.face(give, c, &balance.forces).filter(|face| !face.is_point());
        for k in 0..size {
            let row = |give: &Give| -> Vec<f64> { give.columns.iter().map(|&r| c.output.parameters[(k, r)]).collect() };
            // How far the output moves from where it is when only some of them count, the others giving way.
            let reach = |counts: &dyn Fn(usize) -> bool| {
                let end = |sign: f64| {
                    let direction = tied.iter().enumerate().map(|(g, (give, _))| {
                        row(give).iter().map(|m| if counts(g) { sign * m } else { 0.0 }).collect()
                    });
                    program.extreme(answer, &direction.collect::<Vec<Vec<f64>>>(), UNDECIDED_TOGETHER)
                };
                let (high, low) = (end(1.0), end(-1.0));
                if high.outcome == Outcome::Solved && low.outcome == Outcome::Solved {
                    let at = |(g, (give, given)): (usize, &(&Give, &Vec<f64>))| {
                        if counts(g) { inner(&row(give), given) } else { 0.0 }
                    };
                    let at: f64 = tied.iter().enumerate().map(at).sum();
                    return (high.value - at).max(low.value + at).max(0.0);
                }
                // Each face by itself leaves at least half as much open, to both sides.
                let alone = |(g, (give, _)): (usize, &(&Give, &Vec<f64>))| {
                    if counts(g) { face(give).map_or(0.0, |face| 2.0 * face.half_width(&row(give))) } else { 0.0 }
                };
                tied.iter().enumerate().map(alone).sum()
            };
            widths[k] += reach(&|_| true);
            for (g, (give, _)) in tied.iter().enumerate() {
                let (Some(source), Some(_)) = (give.source, face(give)) else { continue };
                let slot = &mut open[source * size + k];
                *slot = slot.max(reach(&|other| other == g));
            }
        }
    }

    /// The joints whose reactions nothing decides: they take part in a self-stress that no clearance and no
    /// compliance feels.
    pub fn unknown_reactions(&self, c: &Compatibility) -> Vec<bool> {
        let m = self.mechanism;
        let mut unknown = vec![false; m.n_joints()];
        let s = c.equations.nrows();
        if s == 0 {
            return unknown;
        }
        // What every give can do in the equations, both in units of the redundant rows.
        let mut felt = DMatrix::<f64>::zeros(s, m.n_rows());
        for give in &self.gives {
            for (k, &row) in give.columns.iter().enumerate() {
                let moves = match &give.kind {
                    Kind::Clearance(set) | Kind::Fixed(set) => set.half_width(k) > 0.0,
                    Kind::Spring(compliance) => compliance[k * (give.columns.len() + 1)] > 0.0,
                };
                if moves {
                    for equation in 0..s {
                        let unit = self.basis.unit(self.basis.redundant[equation]);
                        felt[(equation, row)] = c.equations[(equation, row)] * self.basis.unit(row) / unit;
                    }
                }
            }
        }
        let svd = felt.svd(true, false);
        let Some(directions) = svd.u else { return unknown };
        let smallest = UNDECIDED * svd.singular_values.max();
        // The left null space: what is orthogonal to every direction that is felt.
        let mut null = DMatrix::<f64>::identity(s, s);
        for (k, value) in svd.singular_values.iter().enumerate() {
            if *value > smallest {
                let direction = directions.column(k);
                null -= direction * direction.transpose();
            }
        }
        for (number, row) in m.rows.iter().enumerate() {
            let stress = (0..s).map(|k| {
                let along: f64 = (0..s)
                    .map(|e| null[(k, e)] * c.equations[(e, number)] / self.basis.unit(self.basis.redundant[e]))
                    .sum();
                (along * self.basis.unit(number)).abs()
            });
            unknown[row.joint] |= stress.fold(0.0, f64::max) > UNDECIDED;
        }
        unknown
    }
}
