//! Rounds in which units settle.
//!
//! A unit begins where the first order at the nominal pose takes it. In every round the basis is closed and
//! linearised for all units, and their programs, which are of one structure, are solved together. A unit leaves
//! the rounds where its displacements stand still; one that does not within a few rounds, because a reaction passes
//! through zero on the way, goes on by itself ([`System::settle_in`]).

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::{Linearised, Nominal, Together};
use crate::cone::lanes::Programs;
use crate::cone::{Answer, Outcome, Rounds};
use crate::hyperstatic::compatibility::Ties;
use crate::hyperstatic::settle::Failure;
use crate::hyperstatic::system::{Ask, Balance, Give, System};
use crate::status::Status;

/// Rounds until a unit goes on by itself.
const MOST_ROUNDS: usize = 12;
/// A change below this part of all displacements is the last: the next one would be smaller by as much as the
/// displacements are beside the dimensions, and the programs' rounding is not.
const LAST_CHANGE: f64 = 1e-7;

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
    /// What the last program gave, where the change was the last one.
    last: Option<Balance>,
}

/// What a unit is asked for.
struct Asked<'r> {
    ties: Cow<'r, Ties>,
    output: Cow<'r, DMatrix<f64>>,
    right: DVector<f64>,
}

impl Together<'_> {
    /// Settles units where what is asked stands still, each with displacements known of it.
    pub fn settle(&mut self, known: &[Vec<f64>], ask: &Ask) -> Vec<Result<Rested, Status>> {
        let mut rested: Vec<Option<Result<Rested, Status>>> = vec![None; known.len()];
        let mut open = self.first_order(known, ask);
        for _ in 0..MOST_ROUNDS {
            if open.is_empty() {
                break;
            }
            let own: Vec<&[f64]> = open.iter().map(|unit| unit.displacements.as_slice()).collect();
            let closed = self.linearise(&own);
            let (mut moving, mut asked) = (Vec::with_capacity(open.len()), Vec::with_capacity(open.len()));
            for (unit, closed) in open.drain(..).zip(closed) {
                // What cannot be closed on the way may be reached in smaller steps.
                let Ok((closed, Linearised { ties, output })) = closed else { continue };
                let Unit { number, first, displacements, last } = unit;
                if let Some(balance) = last {
                    let (first, error, plainly) = (Some(first), closed.error, closed.plainly);
                    let found = Rested { displacements, error, first, balance, ties, output, still: true, plainly };
                    rested[number] = Some(Ok(found));
                } else {
                    let right = ties.right(&displacements, &known[number]);
                    asked.push(Asked { ties: Cow::Owned(ties), output: Cow::Owned(output), right });
                    moving.push(Unit { number, first, displacements, last });
                }
            }
            let balances = self.system.balances(&asked, ask);
            for (mut unit, balance) in moving.into_iter().zip(balances) {
                let Some(balance) = balance else { continue };
                let known = &known[unit.number];
                let target = self.target(known, &balance);
                let change = self.system.difference(&unit.displacements, &target);
                if change <= LAST_CHANGE * self.system.difference(known, &target) {
                    unit.last = Some(balance);
                }
                unit.displacements = target;
                open.push(unit);
            }
        }
        let left = (0..known.len()).filter(|k| rested[*k].is_none());
        let alone = Rounds::each(left, async |rounds, k| (k, self.settle_alone(rounds, &known[k], ask).await));
        alone.into_iter().for_each(|(k, found)| rested[k] = Some(found));
        rested.into_iter().flatten().collect()
    }

    /// Units where the first order at the nominal pose takes them.
    fn first_order(&self, known: &[Vec<f64>], ask: &Ask) -> Vec<Unit> {
        let Nominal { compatibility: c, .. } = self.nominal;
        let asked = |known: &Vec<f64>| Asked {
            ties: Cow::Borrowed(&c.ties),
            output: Cow::Borrowed(&c.output.parameters),
            right: self.nominal.right_beside(known),
        };
        let balances = self.system.balances(&known.iter().map(asked).collect::<Vec<_>>(), ask);
        let unit = |(number, first): (usize, Option<Balance>)| {
            let first = first?;
            Some(Unit { number, displacements: self.target(&known[number], &first), first, last: None })
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
    /// Answers what is asked of every unit, programs of one structure together; `None` where that takes more
    /// than one program, or gives nothing.
    fn balances(&self, units: &[Asked<'_>], ask: &Ask) -> Vec<Option<Balance>> {
        let forces: Vec<DVector<f64>> = units.iter().map(|unit| ask.forces(&unit.ties, &unit.output)).collect();
        let on_a_line = ask.is_unloaded() && self.basis.redundancy() == 1;
        // Programs of one structure: what is tied in one unit takes part in all.
        let is_tied = |give: &&Give| units.iter().any(|unit| Self::is_tied(give, &unit.ties));
        let tied: Vec<&Give> = if on_a_line { Vec::new() } else { self.gives.iter().filter(is_tied).collect() };
        let columns: Vec<usize> = tied.iter().flat_map(|give| &give.columns).copied().collect();
        let mut programs = Programs {
            n: if columns.is_empty() { 0 } else { units.len() },
            n_equations: self.basis.redundancy(),
            n_blocks: tied.len(),
            kinds: tied.iter().map(|give| give.kind.clone()).collect(),
            ..Programs::default()
        };
        for (Asked { ties, right, .. }, forces) in units.iter().zip(&forces).take(programs.n) {
            let rows = ties.equations.row_iter();
            programs.maps.extend(rows.flat_map(|row| columns.iter().map(move |&c| row[c])));
            programs.forces.extend(columns.iter().map(|&c| forces[c]));
            programs.rights.extend(self.cleaned(right));
        }
        let answers = programs.solve_here(ask.question());
        let of = |(k, (Asked { ties, right, .. }, forces)): (usize, (&Asked<'_>, &DVector<f64>))| {
            if self.basis.redundancy() == 0 {
                return Some(self.free(ties, forces));
            }
            let program = self.program(ties, right, forces);
            let answer = if on_a_line {
                program.on_a_line(ask.question())?
            } else {
                // Where nothing pushes it takes another program to tell whether anything is transmitted.
                let pushed = program.blocks.iter().flat_map(|block| &block.force).any(|force| *force != 0.0);
                if programs.n == 0 || !pushed && !ask.is_unloaded() {
                    return None;
                }
                let answer = answers.answer(&programs, k);
                let of_unit = tied.iter().zip(answer.displacements).filter(|(give, _)| Self::is_tied(give, ties));
                Answer { displacements: of_unit.map(|(_, d)| d).collect(), ..answer }
            };
            (answer.outcome == Outcome::Solved).then(|| self.answered(ties, &program, forces, ask, answer))
        };
        units.iter().zip(&forces).enumerate().map(of).collect()
    }
}
