//! Where load, prestress or clearances bring what gives way.
//!
//! Blocks that no equation of compatibility ties to others are decided by statics alone: an offset is the
//! support point of the reaction, a deformation the compliance times it. The others are decided together by
//! a cone program, whose multipliers are the self-stresses. Programs of many configurations are solved together
//! ([`Rounds`]).

use nalgebra::{DMatrix, DVector};

use crate::clearance::offset::inner;
use crate::clearance::undecided::UNDECIDED;
use crate::cone::answer::{Answer, Outcome};
use crate::cone::lanes::layout::Question;
use crate::cone::one_equation::on_a_line;
use crate::cone::scheduler::Rounds;
use crate::cone::{Block, Kind, Program};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{Compatibility, Ties};
use crate::redundancy::system::{Element, System, UNDECIDED_TOGETHER};

/// What is asked of the displacements.
#[derive(Clone, Debug)]
pub(crate) enum Ask {
    /// Where the load holds them.
    Load,
    /// Where they are without any load, by least energy.
    Stress,
    /// The smallest factor on the clearances with which rigid bodies can be assembled.
    Factor,
    /// Where they take the output farthest along a direction of its components.
    Along(Vec<f64>),
}

impl Ask {
    /// The program that answers it.
    pub(crate) const fn question(&self) -> Question {
        match self {
            Self::Factor => Question::Assembly,
            Self::Load | Self::Stress | Self::Along(_) => Question::Pose,
        }
    }

    /// Whether no load is in it.
    pub(crate) const fn is_unloaded(&self) -> bool {
        matches!(self, Self::Stress | Self::Factor)
    }

    /// What is asked, as forces on all displacements that the basis alone bears; `output` is what these do to it.
    pub(crate) fn forces(&self, c: &Ties, output: &DMatrix<f64>) -> DVector<f64> {
        match self {
            Self::Load => c.load.clone(),
            Self::Stress | Self::Factor => DVector::zeros(c.load.len()),
            Self::Along(direction) => output.tr_mul(&DVector::from_column_slice(direction)),
        }
    }
}

impl System<'_> {
    /// Answers what is asked of one configuration; `None` where no displacements are compatible.
    pub fn balance(&self, c: &Compatibility, right: &DVector<f64>, ask: &Ask) -> Option<Balance> {
        Rounds::alone(async |rounds| self.balance_in(rounds, c, right, ask, None).await)
    }

    /// The same beside others, perhaps from an answer nearby.
    pub async fn balance_in(
        &self,
        rounds: &Rounds,
        c: &Compatibility,
        right: &DVector<f64>,
        ask: &Ask,
        near: Option<&Answer>,
    ) -> Option<Balance> {
        self.balance_under(rounds, c, right, ask, ask.forces(c, &c.output.parameters), near).await
    }

    /// The same for the forces that are what is asked.
    pub(crate) async fn balance_under(
        &self,
        rounds: &Rounds,
        c: &Ties,
        right: &DVector<f64>,
        ask: &Ask,
        forces: DVector<f64>,
        near: Option<&Answer>,
    ) -> Option<Balance> {
        let unloaded = ask.is_unloaded();
        let cleaned = self.cleaned(right);
        if unloaded && cleaned.iter().all(|b| *b == 0.0) {
            let given = self.elements.iter().map(|element| vec![0.0; element.columns.len()]).collect();
            return Some(Balance { given, forces, factor: 0.0, gap: 0.0, solved: true, answer: None });
        }
        match cleaned[..] {
            [] => return Some(self.free(c, &forces)),
            [right] if unloaded => {
                let answer = on_a_line(right, ask.question(), self.on_first_equation(c));
                let possible = answer.outcome != Outcome::Infeasible;
                return possible.then(|| self.balanced(c, c.with_stress(&forces, &answer.multipliers), answer, None));
            }
            _ => (),
        }
        let program = self.program(c, right, &forces);
        let mut answer = rounds.solve(ask.question(), &program, near).await;
        if answer.outcome == Outcome::Infeasible {
            return None;
        }
        if ask.question() == Question::Pose && Self::is_slack(rounds, &program).await {
            // What a program has for these forces is rounding, which would decide where every clearance goes.
            answer.multipliers.fill(0.0);
        }
        Some(self.answered(c, &program, &forces, ask, answer))
    }

    /// Where displacements go under forces, as good as programs solved together prove it; `None` where none are
    /// compatible. What the forces leave open is somewhere, not necessarily in its middle.
    pub async fn pushed(
        &self,
        rounds: &Rounds,
        c: &Ties,
        right: &DVector<f64>,
        forces: &DVector<f64>,
    ) -> Option<Balance> {
        let answer = rounds.roughly().ask(Question::Pose, self.program(c, right, forces)).await;
        self.pushed_by(c, forces, answer)
    }

    /// The same of one configuration, to more digits.
    pub fn pushed_alone(&self, c: &Ties, right: &DVector<f64>, forces: &DVector<f64>) -> Option<Balance> {
        self.pushed_by(c, forces, self.program(c, right, forces).pose())
    }

    fn pushed_by(&self, c: &Ties, forces: &DVector<f64>, answer: Answer) -> Option<Balance> {
        let possible = answer.outcome != Outcome::Infeasible;
        possible.then(|| self.balanced(c, c.with_stress(forces, &answer.multipliers), answer, None))
    }

    /// Where nothing ties displacements to each other, forces alone decide them.
    fn free(&self, c: &Ties, forces: &DVector<f64>) -> Balance {
        Balance::free(self.given(c, forces, &[]), forces.clone())
    }

    /// What the answer of the program of the tied elements says of all of them.
    fn answered(&self, c: &Ties, program: &Program, forces: &DVector<f64>, ask: &Ask, answer: Answer) -> Balance {
        let forces = c.with_stress(forces, &answer.multipliers);
        // What the forces leave open is put in the middle.
        let middle = if ask.is_unloaded() { None } else { self.middle(c, program, &forces, &answer) };
        self.balanced(c, forces, answer, middle.as_deref())
    }

    /// The tied elements as an answer says or in another place, and the others by the forces.
    fn balanced(&self, c: &Ties, forces: DVector<f64>, answer: Answer, tied: Option<&[Vec<f64>]>) -> Balance {
        Balance {
            given: self.given(c, &forces, tied.unwrap_or(&answer.displacements)),
            forces,
            factor: answer.factor,
            gap: answer.gap,
            solved: answer.outcome == Outcome::Solved,
            answer: Some(answer),
        }
    }

    /// Whether nothing pushes and the clearances take up all of the misfit, so that no joint transmits anything.
    async fn is_slack(rounds: &Rounds, program: &Program) -> bool {
        let pushed = program.blocks.iter().flat_map(|block| &block.force).any(|force| *force != 0.0);
        let loose = program.blocks.iter().any(|block| block.kind.set().is_some());
        if pushed || !loose {
            return false;
        }
        let assembled = match program.on_a_line(Question::Assembly) {
            Some(answer) => answer,
            None => rounds.solve(Question::Assembly, program, None).await,
        };
        assembled.outcome == Outcome::Solved && assembled.factor <= 1.0
    }

    /// The same with every offset drawn to where it is by a spring of the given stiffness, in energy per
    /// characteristic length and radian squared: a step that is long only where much is gained.
    pub async fn balance_near(
        &self,
        rounds: &Rounds,
        c: &Ties,
        right: &DVector<f64>,
        forces: &DVector<f64>,
        at: &[Vec<f64>],
        stiffness: f64,
    ) -> Option<Balance> {
        if c.equations.nrows() == 0 {
            return Some(self.free_near(c, forces, at, stiffness));
        }
        let program = self.program_near(c, right, forces, at, stiffness);
        let answer = rounds.solve(Question::Pose, &program, None).await;
        self.held(c, forces, answer)
    }

    /// The same where nothing ties displacements to each other: each goes to the point of its set that is nearest to where
    /// force and spring balance, measured in the set's own coordinates.
    fn free_near(&self, c: &Ties, forces: &DVector<f64>, at: &[Vec<f64>], stiffness: f64) -> Balance {
        let mut balance = self.free(c, forces);
        for ((element, at), given) in self.elements.iter().zip(at).zip(&mut balance.given) {
            let Some(set) = element.kind.set().filter(|set| !set.is_zero()) else { continue };
            let reach = |(k, &column): (usize, &usize)| set.half_width(k) / self.basis.unit(column);
            let size = element.columns.iter().enumerate().map(reach).fold(0.0, f64::max);
            let push = set.unit_gradient(&Self::along(element, forces));
            let mut unit = set.to_unit(at);
            unit.iter_mut().zip(push).for_each(|(u, push)| *u += push / (stiffness * size * size));
            set.project_unit(&mut unit[..at.len()]);
            given.copy_from_slice(&set.of_unit(&unit[..at.len()])[..at.len()]);
        }
        balance
    }

    /// What the answer of a program of all elements, tied or not, says; further equations and blocks of it come last.
    pub(crate) fn held(&self, c: &Ties, forces: &DVector<f64>, mut answer: Answer) -> Option<Balance> {
        if answer.outcome == Outcome::Infeasible {
            return None;
        }
        answer.multipliers.truncate(c.equations.nrows());
        let given = answer.displacements[..self.elements.len()].to_vec();
        let tied = given.iter().zip(&self.elements).filter(|(_, element)| Self::is_tied(element, c));
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

    /// The program of all elements, tied or not, and of their springs.
    pub(crate) fn program_near(
        &self,
        c: &Ties,
        right: &DVector<f64>,
        forces: &DVector<f64>,
        at: &[Vec<f64>],
        stiffness: f64,
    ) -> Program {
        let offsets = || self.elements.iter().zip(at).filter(|(element, _)| element.source.is_some());
        let ties: usize = offsets().map(|(element, _)| element.columns.len()).sum();
        let n = c.equations.nrows();
        let mut right: Vec<f64> = self.cleaned(right);
        let (mut blocks, mut springs) = (Vec::new(), Vec::new());
        for (element, at) in self.elements.iter().zip(at) {
            let (size, first) = (element.columns.len(), right.len() - n);
            let mut map = Self::map(element, &c.equations);
            map.resize(size * (n + ties), 0.0);
            if element.source.is_some() {
                // Offset minus elongation of its spring: where it is.
                let mut elongation = vec![0.0; map.len()];
                let mut compliance = vec![0.0; size * size];
                for (k, &column) in element.columns.iter().enumerate() {
                    let entry = size * (n + first + k) + k;
                    (map[entry], elongation[entry]) = (1.0, -1.0);
                    compliance[k * (size + 1)] = self.basis.unit(column).powi(2) / stiffness;
                }
                right.extend(at);
                springs.push(Block { kind: Kind::Spring(compliance), map: elongation, force: vec![0.0; size] });
            }
            blocks.push(Block { kind: element.kind.clone(), map, force: Self::along(element, forces) });
        }
        blocks.extend(springs);
        Program { right, blocks }
    }

    /// The middle of what is open among the tied elements; `None` where nothing is.
    fn middle(&self, c: &Ties, program: &Program, forces: &DVector<f64>, answer: &Answer) -> Option<Vec<Vec<f64>>> {
        let face = self.faces(c, forces);
        let open = |element: &Element| face(element).is_some_and(|face| !face.is_point());
        let any = self.elements.iter().any(|element| Self::is_tied(element, c) && open(element));
        if any { program.middle(answer, UNDECIDED_TOGETHER) } else { None }
    }

    /// Displacements of all elements: of what is tied as the program says, of the others by the forces.
    fn given(&self, c: &Ties, forces: &DVector<f64>, tied: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut tied = tied.iter();
        let tolerance = UNDECIDED * self.force_scale(forces);
        let of = |element: &Element| {
            if Self::is_tied(element, c) {
                return tied.next().cloned().unwrap_or_default();
            }
            match &element.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => {
                    let force = Self::on(element, forces);
                    set.face(&force[..set.size()], tolerance).centre[..set.size()].to_vec()
                }
                Kind::Spring(compliance) => {
                    let force = Self::along(element, forces);
                    compliance.chunks_exact(force.len()).map(|row| inner(row, &force)).collect()
                }
            }
        };
        self.elements.iter().map(of).collect()
    }
}
