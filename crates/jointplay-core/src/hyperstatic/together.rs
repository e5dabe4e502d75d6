//! Many units of one configuration that settle together.
//!
//! Units differ in what is known of their displacements. In every round the basis is closed for all of them, lane by
//! lane on the recorded iteration, compatibility and statics are taken there, and the programs of all units,
//! which are of one structure, are solved together. A unit leaves the rounds where its displacements stand
//! still; those that do not within a few rounds, or are in doubt in any other way, are for [`System::settle`].

use nalgebra::DVector;

use super::compatibility::Ties;
use super::system::{Ask, Balance, Give, System};
use crate::batch::Bound;
use crate::batch::lanes::LANES;
use crate::batch::simd::{Kernel, dispatch};
use crate::cone::lanes::{Answers, Programs, Question};
use crate::cone::{Answer, Outcome};

/// Rounds until a unit is left to the plain solver.
const MOST_ROUNDS: usize = 12;
/// A change below this part of all displacements is the last: the next one would be smaller by as much as the
/// displacements are beside the dimensions, and the programs' rounding is not.
const LAST_CHANGE: f64 = 1e-7;

/// Units that settle together.
pub(crate) struct Together<'a, 'm> {
    pub system: &'a System<'m>,
    /// The recorded iteration of the basis.
    pub bound: Bound<'a>,
}

/// One unit whose basis is closed.
#[derive(Clone, Debug)]
pub(crate) struct Closed {
    /// What its redundant rows lack.
    pub misfit: DVector<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// Compatibility there, where that was asked.
    pub ties: Option<Ties>,
}

/// One unit whose displacements stand still.
#[derive(Clone, Debug)]
pub(crate) struct Rested {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    pub balance: Balance,
    pub error: Vec<f64>,
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
    /// What it is closed for, and then what its program asks for.
    displacements: Vec<f64>,
    /// What the last program gave, where the change was the last one.
    balance: Option<Balance>,
}

impl Together<'_, '_> {
    /// Closes the basis for displacements; `None` where a lane is in doubt.
    pub fn close<'d>(
        &mut self,
        displacements: impl ExactSizeIterator<Item = &'d [f64]>,
        statics: bool,
    ) -> Vec<Option<Closed>> {
        let basis = self.system.basis;
        let all: Vec<&[f64]> = displacements.collect();
        let mut closed = Vec::with_capacity(all.len());
        for block in all.chunks(LANES) {
            for lane in 0..LANES {
                // Idle lanes repeat the last unit.
                let own = block[lane.min(block.len() - 1)];
                self.bound.parameters().iter_mut().zip(own).for_each(|(block, d)| block.0[lane] = *d);
            }
            let good = dispatch(Close { bound: &mut self.bound, statics });
            let bound = &self.bound;
            let of = |lane: usize| Closed {
                misfit: DVector::from_fn(basis.redundancy(), |k, _| bound.left(k).0[lane]),
                error: (0..bound.n_outputs()).map(|k| bound.error(k).0[lane]).collect(),
                ties: statics.then(|| Ties::of_lane(basis, bound, lane)),
            };
            closed.extend((0..block.len()).map(|lane| good[lane].then(|| of(lane))));
        }
        closed
    }

    /// Settles units where what is asked stands still, each with displacements known of it; `None` where one
    /// is in doubt.
    pub fn settle(&mut self, known: &[Vec<f64>], ask: &Ask) -> Vec<Option<Rested>> {
        let mut rested: Vec<Option<Rested>> = vec![None; known.len()];
        let start = |(number, known): (usize, &Vec<f64>)| Unit { number, displacements: known.clone(), balance: None };
        let mut open: Vec<Unit> = known.iter().enumerate().map(start).collect();
        for _ in 0..MOST_ROUNDS {
            let closed = self.close(open.iter().map(|unit| unit.displacements.as_slice()), true);
            let mut moving: Vec<(Unit, Ties)> = Vec::with_capacity(open.len());
            for (unit, closed) in open.drain(..).zip(closed) {
                let Some(Closed { error, ties: Some(ties), .. }) = closed else { continue };
                let Unit { number, displacements, balance } = unit;
                match balance {
                    Some(balance) => rested[number] = Some(Rested { displacements, balance, error }),
                    None => moving.push((Unit { number, displacements, balance }, ties)),
                }
            }
            if moving.is_empty() {
                break;
            }
            let balances = self.balances(&moving, known, ask);
            for ((mut unit, _), balance) in moving.into_iter().zip(balances) {
                let Some(balance) = balance else { continue };
                let known = &known[unit.number];
                let mut target = known.clone();
                target.iter_mut().zip(self.system.displacements(&balance)).for_each(|(t, d)| *t += d);
                let own = &unit.displacements;
                let change = self.system.difference(own, &target);
                let size = self.system.difference(known, &target).max(self.system.difference(known, own));
                if change <= LAST_CHANGE * size {
                    unit.balance = Some(balance);
                }
                unit.displacements = target;
                open.push(unit);
            }
        }
        rested
    }

    /// What is asked of every unit; `None` where no program or a doubtful one gives it.
    fn balances(&self, units: &[(Unit, Ties)], known: &[Vec<f64>], ask: &Ask) -> Vec<Option<Balance>> {
        let system = self.system;
        let forces = |ties: &Ties| match ask {
            Ask::Load => ties.load.clone(),
            Ask::Stress | Ask::Factor | Ask::Along(_) => DVector::zeros(ties.load.len()),
        };
        let right = |unit: &Unit, ties: &Ties| ties.right(&unit.displacements, &known[unit.number]);
        let single = matches!(ask, Ask::Stress) && system.basis.redundancy() == 1;
        // Programs of one structure: what is tied in one unit takes part in all.
        let tied: Vec<&Give> = system.gives.iter().filter(|give| units.iter().any(|(_, t)| System::is_tied(give, t))).collect();
        let programs = if single || tied.is_empty() { Programs::default() } else {
            let mut programs = Programs {
                n: units.len(),
                n_equations: system.basis.redundancy(),
                n_blocks: tied.len(),
                kinds: tied.iter().map(|give| give.kind.clone()).collect(),
                ..Programs::default()
            };
            for (unit, ties) in units {
                for k in 0..programs.n_equations {
                    let columns = tied.iter().flat_map(|give| &give.columns);
                    programs.maps.extend(columns.map(|&c| ties.equations[(k, c)]));
                }
                let forces = forces(ties);
                programs.forces.extend(tied.iter().flat_map(|give| &give.columns).map(|&c| forces[c]));
                programs.rights.extend(system.cleaned(&right(unit, ties)));
            }
            programs
        };
        let answers = if programs.n > 0 { programs.solve(Question::Pose) } else { Answers::default() };
        let of = |(k, (unit, ties)): (usize, &(Unit, Ties))| {
            let forces = forces(ties);
            if system.basis.redundancy() == 0 {
                return Some(system.free(ties, &forces));
            }
            let program = system.program(ties, &right(unit, ties), &forces);
            let answer = if single {
                program.unloaded()
            } else {
                if tied.is_empty() || answers.outcomes[k] != Outcome::Solved {
                    return None;
                }
                // Where nothing pushes it takes more to tell whether anything is transmitted.
                let pushed = program.blocks.iter().flat_map(|block| &block.force).any(|force| *force != 0.0);
                if !pushed && matches!(ask, Ask::Load) {
                    return None;
                }
                let answer = answers.answer(&programs, k);
                let of_unit = tied.iter().zip(answer.displacements).filter(|(give, _)| System::is_tied(give, ties));
                Answer { displacements: of_unit.map(|(_, d)| d).collect(), ..answer }
            };
            (answer.outcome == Outcome::Solved).then(|| system.answered(ties, &program, &forces, ask, answer, false))
        };
        units.iter().enumerate().map(of).collect()
    }
}
