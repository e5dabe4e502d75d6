//! Many units of one configuration that settle together.
//!
//! Units differ in what is known of their displacements. They begin where the first order at the nominal pose takes
//! them. In every round the basis is closed for all of them, lane by lane on the recorded iteration, compatibility
//! and statics are taken there, and the programs of all units, which are of one structure, are solved together. A
//! unit leaves the rounds where its displacements stand still; those that do not within a few rounds, or are in
//! doubt in any other way, are for [`System::settle`].

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::compatibility::{Compatibility, Ties};
use super::system::{Ask, Balance, Give, System};
use crate::batch::lanes::LANES;
use crate::batch::simd::{Kernel, dispatch};
use crate::batch::{Borne, Bound};
use crate::cone::lanes::{Programs, Question};
use crate::cone::{Answer, Outcome};

/// Rounds until a unit is left to the plain solver.
const MOST_ROUNDS: usize = 12;
/// A change below this part of all displacements is the last: the next one would be smaller by as much as the
/// displacements are beside the dimensions, and the programs' rounding is not.
const LAST_CHANGE: f64 = 1e-7;

/// Units that settle together.
pub(crate) struct Together<'a, 'm> {
    pub system: &'a System<'m>,
    pub nominal: &'a Nominal<'a>,
    /// The recorded iteration of the basis.
    pub bound: Bound<'a>,
}

/// The pose where everything is perfect, near which all units are.
pub(crate) struct Nominal<'a> {
    pub compatibility: &'a Compatibility,
    /// What displacements must add up to there.
    pub right: DVector<f64>,
}

impl Nominal<'_> {
    /// What displacements must add up to beside the known ones.
    pub fn right_beside(&self, known: &[f64]) -> DVector<f64> {
        &self.right - &self.compatibility.equations * DVector::from_column_slice(known)
    }
}

/// One unit whose basis is closed.
#[derive(Clone, Debug)]
pub(crate) struct Closed {
    /// What its redundant rows lack.
    pub misfit: DVector<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
}

/// One unit whose displacements stand still.
#[derive(Clone, Debug)]
pub(crate) struct Rested {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    pub error: Vec<f64>,
    /// To first order at the nominal pose.
    pub first: Balance,
    pub balance: Balance,
    pub ties: Ties,
    /// What displacements of the rows do to the output.
    pub output: DMatrix<f64>,
}

struct Close<'a, 'n> {
    bound: &'a mut Bound<'n>,
    statics: bool,
}

impl Kernel for Close<'_, '_> {
    type Output = [bool; LANES];

    #[inline(always)]
    fn run(self) -> [bool; LANES] {
        let good = self.bound.solve();
        let statics = !self.statics || self.bound.solve_statics();
        std::array::from_fn(|lane| statics && good.has(lane))
    }
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

/// What is asked of a unit.
struct Asked<'r> {
    ties: Cow<'r, Ties>,
    right: DVector<f64>,
}

impl Together<'_, '_> {
    /// Closes the basis for displacements; `None` where a lane is in doubt.
    pub fn close<'d>(&mut self, displacements: impl ExactSizeIterator<Item = &'d [f64]>) -> Vec<Option<Closed>> {
        self.close_and_take(displacements, false, |closed, _, _| closed)
    }

    /// The same, with what is taken from every lane.
    fn close_and_take<'d, T>(
        &mut self,
        displacements: impl ExactSizeIterator<Item = &'d [f64]>,
        statics: bool,
        take: impl Fn(Closed, &Bound<'_>, usize) -> T,
    ) -> Vec<Option<T>> {
        let all: Vec<&[f64]> = displacements.collect();
        let redundancy = self.system.basis.redundancy();
        let mut taken = Vec::with_capacity(all.len());
        for block in all.chunks(LANES) {
            for lane in 0..LANES {
                // Idle lanes repeat the last unit.
                let own = block[lane.min(block.len() - 1)];
                self.bound.parameters().iter_mut().zip(own).for_each(|(block, d)| block.0[lane] = *d);
            }
            let good = dispatch(Close { bound: &mut self.bound, statics });
            let bound = &self.bound;
            let of = |lane: usize| {
                let closed = Closed {
                    misfit: DVector::from_fn(redundancy, |k, _| bound.left(k).0[lane]),
                    error: (0..bound.n_outputs()).map(|k| bound.error(k).0[lane]).collect(),
                };
                take(closed, bound, lane)
            };
            taken.extend((0..block.len()).map(|lane| good[lane].then(|| of(lane))));
        }
        taken
    }

    /// Settles units where what is asked stands still, each with displacements known of it; `None` where one
    /// is in doubt.
    pub fn settle(&mut self, known: &[Vec<f64>], ask: &Ask) -> Vec<Option<Rested>> {
        let basis = self.system.basis;
        let mut rested: Vec<Option<Rested>> = vec![None; known.len()];
        let mut open = self.first_order(known, ask);
        for _ in 0..MOST_ROUNDS {
            if open.is_empty() {
                break;
            }
            let take = |closed: Closed, bound: &Bound<'_>, lane: usize| {
                (closed.error, Ties::of_lane(basis, bound, lane), map_of_lane(basis, bound, lane))
            };
            let closed = self.close_and_take(open.iter().map(|unit| unit.displacements.as_slice()), true, take);
            let (mut moving, mut asked) = (Vec::with_capacity(open.len()), Vec::with_capacity(open.len()));
            for (unit, closed) in open.drain(..).zip(closed) {
                let Some((error, ties, output)) = closed else { continue };
                let Unit { number, first, displacements, last } = unit;
                if let Some(balance) = last {
                    rested[number] = Some(Rested { displacements, error, first, balance, ties, output });
                } else {
                    let right = ties.right(&displacements, &known[number]);
                    asked.push(Asked { ties: Cow::Owned(ties), right });
                    moving.push(Unit { number, first, displacements, last });
                }
            }
            let balances = self.balances(&asked, ask);
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
        rested
    }

    /// Units where the first order at the nominal pose takes them.
    fn first_order(&self, known: &[Vec<f64>], ask: &Ask) -> Vec<Unit> {
        let nominal = self.nominal;
        let asked = |known: &Vec<f64>| Asked {
            ties: Cow::Borrowed(&nominal.compatibility.ties),
            right: nominal.right_beside(known),
        };
        let balances = self.balances(&known.iter().map(asked).collect::<Vec<_>>(), ask);
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

    /// What is asked of every unit; `None` where no program or a doubtful one gives it.
    fn balances(&self, units: &[Asked<'_>], ask: &Ask) -> Vec<Option<Balance>> {
        let system = self.system;
        let forces = |ties: &Ties| match ask {
            Ask::Load => ties.load.clone(),
            Ask::Stress | Ask::Factor | Ask::Along(_) => DVector::zeros(ties.load.len()),
        };
        let single = matches!(ask, Ask::Stress) && system.basis.redundancy() == 1;
        // Programs of one structure: what is tied in one unit takes part in all.
        let is_tied = |give: &&Give| units.iter().any(|unit| System::is_tied(give, &unit.ties));
        let tied: Vec<&Give> = if single { Vec::new() } else { system.gives.iter().filter(is_tied).collect() };
        let columns: Vec<usize> = tied.iter().flat_map(|give| &give.columns).copied().collect();
        let mut programs = Programs {
            n: if columns.is_empty() { 0 } else { units.len() },
            n_equations: system.basis.redundancy(),
            n_blocks: tied.len(),
            kinds: tied.iter().map(|give| give.kind.clone()).collect(),
            ..Programs::default()
        };
        for Asked { ties, right } in units.iter().take(programs.n) {
            let rows = ties.equations.row_iter();
            programs.maps.extend(rows.flat_map(|row| columns.iter().map(move |&c| row[c])));
            let forces = forces(ties);
            programs.forces.extend(columns.iter().map(|&c| forces[c]));
            programs.rights.extend(system.cleaned(right));
        }
        let answers = programs.solve_here(Question::Pose);
        let of = |(k, Asked { ties, right }): (usize, &Asked<'_>)| {
            let forces = forces(ties);
            if system.basis.redundancy() == 0 {
                return Some(system.free(ties, &forces));
            }
            let program = system.program(ties, right, &forces);
            let answer = if single {
                program.on_a_line(Question::Pose)?
            } else {
                // Where nothing pushes it takes more to tell whether anything is transmitted.
                let pushed = program.blocks.iter().flat_map(|block| &block.force).any(|force| *force != 0.0);
                if programs.n == 0 || !pushed && matches!(ask, Ask::Load) {
                    return None;
                }
                let answer = answers.answer(&programs, k);
                let of_unit = tied.iter().zip(answer.displacements).filter(|(give, _)| System::is_tied(give, ties));
                Answer { displacements: of_unit.map(|(_, d)| d).collect(), ..answer }
            };
            (answer.outcome == Outcome::Solved).then(|| system.answered(ties, &program, &forces, ask, answer))
        };
        units.iter().enumerate().map(of).collect()
    }
}

/// What displacements of the rows do to the output, at one lane.
fn map_of_lane(basis: &Basis, bound: &Bound<'_>, lane: usize) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(basis.all.size(), basis.all.n_rows());
    for k in 0..map.nrows() {
        let multipliers = bound.multipliers(Borne::Component(k));
        basis.rows.iter().zip(multipliers).for_each(|(&row, block)| map[(k, row)] = block.0[lane]);
    }
    map
}
