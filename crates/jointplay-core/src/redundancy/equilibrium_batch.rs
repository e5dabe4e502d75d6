//! Many balances at once: programs that differ in their numbers only, several at a time.

use nalgebra::DVector;

use crate::cone::Program;
use crate::cone::answer::{Answer, Outcome};
use crate::cone::lanes::layout::Question;
use crate::cone::lanes::programs::Programs;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::system::{Element, System};

/// What pulls at the displacements of one state.
pub(crate) struct Pull<'a> {
    pub compatibility: &'a Compatibility,
    /// What the displacements must add up to.
    pub right: &'a DVector<f64>,
    /// Forces on all displacements, as the basis alone would bear them.
    pub forces: DVector<f64>,
}

/// Springs that draw offsets to where they are.
pub(crate) struct Near<'a> {
    pub at: &'a [Vec<f64>],
    /// In energy per characteristic length and radian squared.
    pub stiffness: f64,
}

impl System<'_> {
    /// Where the displacements go under every pull; `None` where none are compatible. What a pull leaves open is
    /// somewhere, not necessarily in its middle.
    pub fn solve_many(&self, pulls: &[Pull<'_>]) -> Vec<Option<Balance>> {
        // Coefficients that symmetry makes zero in one state are not so in another.
        let is_tied = |element: &&Element| pulls.iter().any(|pull| Self::is_tied(element, pull.compatibility));
        let tied: Vec<&Element> = self.elements.iter().filter(is_tied).collect();
        let states = pulls.iter().map(|pull| (&**pull.compatibility, pull.right, &pull.forces));
        let programs = self.programs(&tied, states);
        let balance = |(answer, pull): (Answer, &Pull<'_>)| self.balance_of(pull, answer, |element| is_tied(&element));
        answers(&programs).zip(pulls).map(balance).collect()
    }

    /// The same under one pull, by a program of its own.
    pub fn balance_alone(&self, pull: &Pull<'_>) -> Option<Balance> {
        let answer = self.program(pull.compatibility, pull.right, &pull.forces).pose();
        self.balance_of(pull, answer, |element| Self::is_tied(element, pull.compatibility))
    }

    fn balance_of(&self, pull: &Pull<'_>, answer: Answer, is_tied: impl Fn(&Element) -> bool) -> Option<Balance> {
        if answer.outcome == Outcome::Infeasible {
            return None;
        }
        let mut balance = Balance {
            given: vec![Vec::new(); self.elements.len()],
            forces: pull.compatibility.with_stress(&pull.forces, &answer.multipliers),
            factor: 1.0,
            gap: answer.gap,
            solved: answer.outcome == Outcome::Solved,
            answer: None,
        };
        self.fill(&mut balance, &answer.displacements, is_tied);
        balance.answer = Some(answer);
        Some(balance)
    }

    /// The same with every offset drawn to where it is.
    pub fn solve_many_near(&self, pulls: &[Pull<'_>], near: &[Near<'_>]) -> Vec<Option<Balance>> {
        let program = |(pull, near): (&Pull<'_>, &Near<'_>)| {
            self.program_near(pull.compatibility, pull.right, &pull.forces, near.at, near.stiffness)
        };
        let programs = Programs::of(&pulls.iter().zip(near).map(program).collect::<Vec<Program>>());
        let balance =
            |(answer, pull): (Answer, &Pull<'_>)| self.balance_of_near(pull.compatibility, &pull.forces, answer);
        answers(&programs).zip(pulls).map(balance).collect()
    }
}

/// The answers to all programs.
fn answers(programs: &Programs<'_>) -> impl Iterator<Item = Answer> {
    let answers = programs.solve_all(Question::Pose);
    (0..programs.n).map(move |number| answers.answer(programs, number))
}
