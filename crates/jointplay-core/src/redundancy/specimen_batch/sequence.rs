//! Rounds in which specimens settle.
//!
//! A specimen begins where the first order at the nominal pose takes it. In every round the basis is closed and
//! linearised for all specimens, and their programs, which are of one structure, are solved together. A specimen leaves
//! the rounds where its displacements have converged; one that does not within a few rounds, because a reaction passes
//! through zero on the way, goes on by itself ([`System::settle_in`]).

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::cone::Program;
use crate::cone::answer::{Answer, Outcome};
use crate::cone::scheduler::Rounds;
use crate::interrupt;
use crate::mechanism::status::Status;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::{Failure, NOISE};
use crate::redundancy::specimen_batch::{Linearised, Nominal, Together};
use crate::redundancy::system::{Element, System};

/// Rounds until a specimen goes on by itself.
const MOST_ROUNDS: usize = 12;
/// A specimen has converged when the next change would be below this part of all displacements.
const STILL: f64 = 1e-10;

/// One specimen whose displacements have converged.
#[derive(Clone, Debug)]
pub(crate) struct SpecimenSolution {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// To first order at the nominal pose, where there is an answer.
    pub first: Option<Balance>,
    pub balance: Balance,
    pub ties: Ties,
    /// What displacements do to the output.
    pub output: DMatrix<f64>,
    /// Whether the displacements have converged and the last program was solved to the end.
    pub still: bool,
    /// Whether it took the plain solver.
    pub plainly: bool,
}

/// A specimen on its way.
struct Specimen {
    number: usize,
    first: Balance,
    /// What it is closed for.
    displacements: Vec<f64>,
    /// What the last program gave, how much it changed, and whether the next one would change anything.
    balance: Balance,
    change: f64,
    is_last: bool,
}

/// What a specimen is asked for.
struct Asked<'r> {
    ties: Cow<'r, Ties>,
    output: Cow<'r, DMatrix<f64>>,
    right: DVector<f64>,
    /// An answer nearby.
    near: Option<Answer>,
}

impl Together<'_> {
    /// Settles specimens where what is asked has converged, each with displacements known of it.
    pub fn settle(&mut self, known: &[Vec<f64>], ask: &Ask) -> Vec<Result<SpecimenSolution, Status>> {
        let mut rested: Vec<Option<Result<SpecimenSolution, Status>>> = vec![None; known.len()];
        let mut open = self.first_order(known, ask);
        for round in 0..MOST_ROUNDS {
            if open.is_empty() {
                break;
            }
            let own: Vec<&[f64]> = open.iter().map(|specimen| specimen.displacements.as_slice()).collect();
            let closed = self.linearise(&own, |k| open[k].is_last || matches!(ask, Ask::Along(_)));
            let (mut moving, mut asked) = (Vec::with_capacity(open.len()), Vec::with_capacity(open.len()));
            for (mut specimen, closed) in open.drain(..).zip(closed) {
                // What cannot be closed on the way may be reached in smaller steps.
                let Ok((closed, Linearised { ties, output })) = closed else { continue };
                if specimen.is_last {
                    let Specimen { number, first, displacements, balance, .. } = specimen;
                    let (first, error, plainly) = (Some(first), closed.error, closed.plainly);
                    let found =
                        SpecimenSolution { displacements, error, first, balance, ties, output, still: true, plainly };
                    rested[number] = Some(Ok(found));
                } else {
                    let right = ties.right(&specimen.displacements, &known[specimen.number]);
                    // From the second round on the answer before is so near that Newton's method takes it to the last
                    // digits, which an interior point has not where the value is flat.
                    let near = if round > 0 { specimen.balance.answer.take() } else { None };
                    asked.push(Asked { ties: Cow::Owned(ties), output: Cow::Owned(output), right, near });
                    moving.push(specimen);
                }
            }
            let balances = self.system.balances(&asked, ask);
            for (mut specimen, balance) in moving.into_iter().zip(balances) {
                interrupt::check();
                let Some(balance) = balance else { continue };
                let known = &known[specimen.number];
                let target = self.target(known, &balance);
                let size = self.system.difference(known, &target);
                let change = self.system.difference(&specimen.displacements, &target);
                // Changes shrink in proportion, until what is left is the programs' rounding.
                let next = if change > 0.0 { change * (change / specimen.change) } else { 0.0 };
                specimen.is_last = next <= STILL * size || change <= NOISE * size && change > 0.5 * specimen.change;
                (specimen.displacements, specimen.balance, specimen.change) = (target, balance, change);
                open.push(specimen);
            }
        }
        let left = (0..known.len()).filter(|k| rested[*k].is_none());
        let alone = Rounds::each(left, async |rounds, k| (k, self.settle_alone(rounds, &known[k], ask).await));
        for (k, found) in alone {
            rested[k] = Some(found);
        }
        rested.into_iter().flatten().collect()
    }

    /// Specimens where the first order at the nominal pose takes them.
    fn first_order(&self, known: &[Vec<f64>], ask: &Ask) -> Vec<Specimen> {
        let Nominal { compatibility: c, .. } = self.nominal;
        let asked = |known: &Vec<f64>| Asked {
            ties: Cow::Borrowed(&c.ties),
            output: Cow::Borrowed(&c.output.parameters),
            right: self.nominal.right_beside(known),
            near: None,
        };
        let balances = self.system.balances(&known.iter().map(asked).collect::<Vec<_>>(), ask);
        let specimen = |(number, first): (usize, Option<Balance>)| {
            let first = first?;
            let displacements = self.target(&known[number], &first);
            let change = self.system.difference(&known[number], &displacements);
            Some(Specimen { number, displacements, balance: first.clone(), first, change, is_last: false })
        };
        balances.into_iter().enumerate().filter_map(specimen).collect()
    }

    /// Known displacements, and those that a balance gives.
    fn target(&self, known: &[f64], balance: &Balance) -> Vec<f64> {
        let mut target = known.to_vec();
        target.iter_mut().zip(self.system.displacements(balance)).for_each(|(t, d)| *t += d);
        target
    }

    /// Settles one specimen from where it is closed for what is known of it.
    async fn settle_alone(&self, rounds: &Rounds, known: &[f64], ask: &Ask) -> Result<SpecimenSolution, Status> {
        let (system, nominal) = (self.system, self.nominal);
        let first = system.balance_in(rounds, nominal.compatibility, &nominal.right_beside(known), ask, None).await;
        let start = self.close_plainly(known)?;
        let near = first.as_ref().and_then(|first| first.answer.clone());
        let settled = system.settle_in(rounds, self.solver, start, known, near, |_, _| ask.clone()).await;
        let settled = settled.map_err(Failure::status)?;
        if settled.state.negative != self.built.negative {
            return Err(Status::Singular);
        }
        Ok(SpecimenSolution {
            error: self.closed(&settled.state).error,
            displacements: settled.state.inputs.parameters,
            first,
            still: settled.still && settled.balance.solved,
            balance: settled.balance,
            ties: settled.compatibility.ties,
            output: settled.compatibility.output.parameters,
            plainly: true,
        })
    }
}

impl System<'_> {
    /// Answers what is asked of every specimen; `None` where that takes more than one program, or gives nothing.
    fn balances(&self, specimens: &[Asked<'_>], ask: &Ask) -> Vec<Option<Balance>> {
        let forces: Vec<DVector<f64>> =
            specimens.iter().map(|specimen| ask.forces(&specimen.ties, &specimen.output)).collect();
        let each = || specimens.iter().zip(&forces);
        if self.basis.redundancy() == 0 {
            return each().map(|(specimen, forces)| Some(self.free(&specimen.ties, forces))).collect();
        }
        let programs: Vec<Program> =
            each().map(|(specimen, forces)| self.program(&specimen.ties, &specimen.right, forces)).collect();
        // Where nothing pushes it takes another program to tell whether anything is transmitted.
        let pushed = |program: &Program| program.blocks.iter().flat_map(|block| &block.force).any(|f| *f != 0.0);
        let is_one = |program: &Program| !program.blocks.is_empty() && (ask.is_unloaded() || pushed(program));
        let directly = |(specimen, program): (&Asked<'_>, &Program)| {
            interrupt::check();
            let on_a_line = if ask.is_unloaded() { program.on_a_line(ask.question()) } else { None };
            on_a_line.or_else(|| program.answer_near(ask.question(), specimen.near.as_ref()?))
        };
        let mut answers: Vec<Option<Answer>> = specimens.iter().zip(&programs).map(directly).collect();
        let left: Vec<usize> =
            (0..specimens.len()).filter(|k| answers[*k].is_none() && is_one(&programs[*k])).collect();
        for (k, answer) in left.iter().zip(self.answers(specimens, &forces, &left, ask)) {
            answers[*k] = Some(answer);
        }
        let balance = |((specimen, forces), (program, answer)): ((&Asked<'_>, _), (&Program, Option<Answer>))| {
            let answer = answer.filter(|answer| answer.outcome == Outcome::Solved)?;
            Some(self.answered(&specimen.ties, program, forces, ask, answer))
        };
        each().zip(programs.iter().zip(answers)).map(balance).collect()
    }

    /// Answers of some specimens by programs of one structure: what is tied in one specimen takes part in all.
    fn answers(&self, specimens: &[Asked<'_>], forces: &[DVector<f64>], some: &[usize], ask: &Ask) -> Vec<Answer> {
        let is_tied = |element: &&Element| some.iter().any(|k| Self::is_tied(element, &specimens[*k].ties));
        let tied: Vec<&Element> = self.elements.iter().filter(is_tied).collect();
        let states = some.iter().map(|&k| (&*specimens[k].ties, &specimens[k].right, &forces[k]));
        let programs = self.programs(&tied, states);
        let answers = programs.solve_here(ask.question());
        let of = |(number, k): (usize, &usize)| {
            let answer = answers.answer(&programs, number);
            let of_unit = tied
                .iter()
                .zip(answer.displacements)
                .filter(|(element, _)| Self::is_tied(element, &specimens[*k].ties));
            Answer { displacements: of_unit.map(|(_, d)| d).collect(), ..answer }
        };
        some.iter().enumerate().map(of).collect()
    }
}
