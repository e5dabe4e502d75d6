//! Rounds in which units settle.
//!
//! A unit begins where the first order at the nominal pose takes it. In every round the basis is closed and
//! linearised for all units, and their programs, which are of one structure, are solved together. A unit leaves
//! the rounds where its displacements stand still; one that does not within a few rounds, because a reaction passes
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
use crate::redundancy::system::{Give, System};

/// Rounds until a unit goes on by itself.
const MOST_ROUNDS: usize = 12;
/// A unit stands still when the next change would be below this part of all displacements.
const STILL: f64 = 1e-10;

/// One unit whose displacements stand still.
#[derive(Clone, Debug)]
pub(crate) struct Rested {
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
    /// Whether the displacements stand still and the last program was solved to the end.
    pub still: bool,
    /// Whether it took the plain solver.
    pub plainly: bool,
}

/// A unit on its way.
struct Unit {
    number: usize,
    first: Balance,
    /// What it is closed for.
    displacements: Vec<f64>,
    /// What the last program gave, how much it changed, and whether the next one would change anything.
    balance: Balance,
    change: f64,
    is_last: bool,
}

/// What a unit is asked for.
struct Asked<'r> {
    ties: Cow<'r, Ties>,
    output: Cow<'r, DMatrix<f64>>,
    right: DVector<f64>,
    /// An answer nearby.
    near: Option<Answer>,
}

impl Together<'_> {
    /// Settles units where what is asked stands still, each with displacements known of it.
    pub fn settle(&mut self, known: &[Vec<f64>], ask: &Ask) -> Vec<Result<Rested, Status>> {
        let mut rested: Vec<Option<Result<Rested, Status>>> = vec![None; known.len()];
        let mut open = self.first_order(known, ask);
        for round in 0..MOST_ROUNDS {
            if open.is_empty() {
                break;
            }
            let own: Vec<&[f64]> = open.iter().map(|unit| unit.displacements.as_slice()).collect();
            let closed = self.linearise(&own, |k| open[k].is_last || matches!(ask, Ask::Along(_)));
            let (mut moving, mut asked) = (Vec::with_capacity(open.len()), Vec::with_capacity(open.len()));
            for (mut unit, closed) in open.drain(..).zip(closed) {
                // What cannot be closed on the way may be reached in smaller steps.
                let Ok((closed, Linearised { ties, output })) = closed else { continue };
                if unit.is_last {
                    let Unit { number, first, displacements, balance, .. } = unit;
                    let (first, error, plainly) = (Some(first), closed.error, closed.plainly);
                    let found = Rested { displacements, error, first, balance, ties, output, still: true, plainly };
                    rested[number] = Some(Ok(found));
                } else {
                    let right = ties.right(&unit.displacements, &known[unit.number]);
                    // From the second round on the answer before is so near that Newton's method takes it to the last
                    // digits, which an interior point has not where the value is flat.
                    let near = if round > 0 { unit.balance.answer.take() } else { None };
                    asked.push(Asked { ties: Cow::Owned(ties), output: Cow::Owned(output), right, near });
                    moving.push(unit);
                }
            }
            let balances = self.system.balances(&asked, ask);
            for (mut unit, balance) in moving.into_iter().zip(balances) {
                interrupt::check();
                let Some(balance) = balance else { continue };
                let known = &known[unit.number];
                let target = self.target(known, &balance);
                let size = self.system.difference(known, &target);
                let change = self.system.difference(&unit.displacements, &target);
                // Changes shrink in proportion, until what is left is the programs' rounding.
                let next = if change > 0.0 { change * (change / unit.change) } else { 0.0 };
                unit.is_last = next <= STILL * size || change <= NOISE * size && change > 0.5 * unit.change;
                (unit.displacements, unit.balance, unit.change) = (target, balance, change);
                open.push(unit);
            }
        }
        let left = (0..known.len()).filter(|k| rested[*k].is_none());
        let alone = Rounds::each(left, async |rounds, k| (k, self.settle_alone(rounds, &known[k], ask).await));
        for (k, found) in alone {
            rested[k] = Some(found);
        }
        rested.into_iter().flatten().collect()
    }

    /// Units where the first order at the nominal pose takes them.
    fn first_order(&self, known: &[Vec<f64>], ask: &Ask) -> Vec<Unit> {
        let Nominal { compatibility: c, .. } = self.nominal;
        let asked = |known: &Vec<f64>| Asked {
            ties: Cow::Borrowed(&c.ties),
            output: Cow::Borrowed(&c.output.parameters),
            right: self.nominal.right_beside(known),
            near: None,
        };
        let balances = self.system.balances(&known.iter().map(asked).collect::<Vec<_>>(), ask);
        let unit = |(number, first): (usize, Option<Balance>)| {
            let first = first?;
            let displacements = self.target(&known[number], &first);
            let change = self.system.difference(&known[number], &displacements);
            Some(Unit { number, displacements, balance: first.clone(), first, change, is_last: false })
        };
        balances.into_iter().enumerate().filter_map(unit).collect()
    }

    /// Known displacements, and those that a balance gives.
    fn target(&self, known: &[f64], balance: &Balance) -> Vec<f64> {
        let mut target = known.to_vec();
        target.iter_mut().zip(self.system.displacements(balance)).for_each(|(t, d)| *t += d);
        target
    }

    /// Settles one unit from where it is closed for what is known of it.
    async fn settle_alone(&self, rounds: &Rounds, known: &[f64], ask: &Ask) -> Result<Rested, Status> {
        let (system, nominal) = (self.system, self.nominal);
        let first = system.balance_in(rounds, nominal.compatibility, &nominal.right_beside(known), ask, None).await;
        let start = self.close_plainly(known)?;
        let near = first.as_ref().and_then(|first| first.answer.clone());
        let settled = system.settle_in(rounds, self.solver, start, known, near, |_, _| ask.clone()).await;
        let settled = settled.map_err(Failure::status)?;
        if settled.state.negative != self.built.negative {
            return Err(Status::Singular);
        }
        Ok(Rested {
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
    /// Answers what is asked of every unit; `None` where that takes more than one program, or gives nothing.
    fn balances(&self, units: &[Asked<'_>], ask: &Ask) -> Vec<Option<Balance>> {
        let forces: Vec<DVector<f64>> = units.iter().map(|unit| ask.forces(&unit.ties, &unit.output)).collect();
        let each = || units.iter().zip(&forces);
        if self.basis.redundancy() == 0 {
            return each().map(|(unit, forces)| Some(self.free(&unit.ties, forces))).collect();
        }
        let programs: Vec<Program> =
            each().map(|(unit, forces)| self.program(&unit.ties, &unit.right, forces)).collect();
        // Where nothing pushes it takes another program to tell whether anything is transmitted.
        let pushed = |program: &Program| program.blocks.iter().flat_map(|block| &block.force).any(|f| *f != 0.0);
        let is_one = |program: &Program| !program.blocks.is_empty() && (ask.is_unloaded() || pushed(program));
        let directly = |(unit, program): (&Asked<'_>, &Program)| {
            interrupt::check();
            let on_a_line = if ask.is_unloaded() { program.on_a_line(ask.question()) } else { None };
            on_a_line.or_else(|| program.answer_near(ask.question(), unit.near.as_ref()?))
        };
        let mut answers: Vec<Option<Answer>> = units.iter().zip(&programs).map(directly).collect();
        let left: Vec<usize> = (0..units.len()).filter(|k| answers[*k].is_none() && is_one(&programs[*k])).collect();
        for (k, answer) in left.iter().zip(self.answers(units, &forces, &left, ask)) {
            answers[*k] = Some(answer);
        }
        let balance = |((unit, forces), (program, answer)): ((&Asked<'_>, _), (&Program, Option<Answer>))| {
            let answer = answer.filter(|answer| answer.outcome == Outcome::Solved)?;
            Some(self.answered(&unit.ties, program, forces, ask, answer))
        };
        each().zip(programs.iter().zip(answers)).map(balance).collect()
    }

    /// Answers of some units by programs of one structure: what is tied in one unit takes part in all.
    fn answers(&self, units: &[Asked<'_>], forces: &[DVector<f64>], some: &[usize], ask: &Ask) -> Vec<Answer> {
        let is_tied = |give: &&Give| some.iter().any(|k| Self::is_tied(give, &units[*k].ties));
        let tied: Vec<&Give> = self.gives.iter().filter(is_tied).collect();
        let states = some.iter().map(|&k| (&*units[k].ties, &units[k].right, &forces[k]));
        let programs = self.programs(&tied, states);
        let answers = programs.solve_here(ask.question());
        let of = |(number, k): (usize, &usize)| {
            let answer = answers.answer(&programs, number);
            let of_unit =
                tied.iter().zip(answer.displacements).filter(|(give, _)| Self::is_tied(give, &units[*k].ties));
            Answer { displacements: of_unit.map(|(_, d)| d).collect(), ..answer }
        };
        some.iter().enumerate().map(of).collect()
    }
}
