//! Groups of units: closed lane by lane on the recorded iteration of the basis, their programs solved together.

use nalgebra::DVector;

use super::dice::Dice;
use super::unit::{CORRECTIONS, Fit, Job, Loosest, Unit};
use crate::cone::Outcome;
use crate::cone::lanes::{Programs, Question};
use crate::hyperstatic::compatibility::FITS;
use crate::hyperstatic::system::Give;
use crate::hyperstatic::together::Together;
use crate::status::Status;

/// Solves groups of units.
pub struct Lanes<'a> {
    pub job: &'a Job<'a>,
    /// Without the recorded iteration every unit is solved plainly.
    pub together: Option<Together<'a, 'a>>,
    /// Units in doubt that were solved plainly.
    pub fallbacks: u64,
}

/// What becomes of a unit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lane {
    /// Its displacements are being corrected.
    Loose,
    /// Load or misfit decide it.
    Forced,
    Done,
    /// For the plain solver.
    Doubt,
}

impl Lanes<'_> {
    /// Solves units with what has been drawn for them, of which the first has the given number.
    pub fn solve(&mut self, drawn: &[Vec<f64>], first: u64) -> Vec<Unit> {
        let job = self.job;
        let mut units: Vec<Unit> = drawn.iter().map(|drawn| job.drawn(drawn)).collect();
        let mut dice: Vec<Dice> = (0..).take(units.len()).map(|k| Dice::new(job.request.seed, first + k)).collect();
        let lanes = self.together.as_mut().map(|together| Group { job, together, units: &mut units }.solve(&mut dice));
        for (k, lane) in lanes.unwrap_or_else(|| vec![Lane::Doubt; drawn.len()]).into_iter().enumerate() {
            if lane == Lane::Doubt {
                self.fallbacks += 1;
                units[k] = job.solve(first + k as u64, &drawn[k]);
            }
        }
        units
    }
}

struct Group<'g, 'a> {
    job: &'a Job<'a>,
    together: &'g mut Together<'a, 'a>,
    units: &'g mut [Unit],
}

impl Group<'_, '_> {
    fn solve(&mut self, dice: &mut [Dice]) -> Vec<Lane> {
        let closed = self.together.close(self.units.iter().map(|unit| unit.displacements.as_slice()));
        let mut lanes = vec![Lane::Doubt; self.units.len()];
        let good: Vec<usize> = (0..lanes.len()).filter(|k| closed[*k].is_some()).collect();
        let misfits: Vec<DVector<f64>> = closed.into_iter().flatten().map(|closed| closed.misfit).collect();
        let loosest = factors(self.job, &misfits);
        for ((k, misfit), loosest) in good.into_iter().zip(&misfits).zip(loosest) {
            let unit = &mut self.units[k];
            lanes[k] = match self.job.fit(misfit, loosest, unit, &mut dice[k]) {
                Fit::Loose => Lane::Loose,
                Fit::Forced => Lane::Forced,
                Fit::Apart => {
                    unit.status = Status::NotAssemblable;
                    Lane::Done
                }
            };
        }
        self.correct(&mut lanes);
        self.settle(&mut lanes, dice);
        lanes
    }

    /// Closes the mechanism for displacements that are compatible to first order, changing them by what is left.
    fn correct(&mut self, lanes: &mut [Lane]) {
        let (job, basis) = (self.job, self.job.system.basis);
        let mut open: Vec<usize> = (0..lanes.len()).filter(|k| lanes[*k] == Lane::Loose).collect();
        let mut corrected: Vec<Vec<f64>> = open.iter().map(|k| self.units[*k].displacements.clone()).collect();
        for _ in 0..CORRECTIONS {
            let closed = self.together.close(corrected.iter().map(Vec::as_slice));
            let (before, moved) = (std::mem::take(&mut open), std::mem::take(&mut corrected));
            for ((k, mut displacements), closed) in before.into_iter().zip(moved).zip(closed) {
                let Some(closed) = closed else {
                    lanes[k] = Lane::Doubt;
                    continue;
                };
                if basis.scaled_misfit(&closed.misfit) <= FITS {
                    lanes[k] = Lane::Done;
                    self.units[k].error = Some(closed.error);
                    continue;
                }
                let change = &job.correction * closed.misfit;
                displacements.iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
                job.move_offsets(&mut self.units[k], &change);
                open.push(k);
                corrected.push(displacements);
            }
        }
        open.into_iter().for_each(|k| lanes[k] = Lane::Doubt);
    }

    /// Where load or misfit strain what is elastic, or push rigid bodies.
    fn settle(&mut self, lanes: &mut [Lane], dice: &mut [Dice]) {
        let job = self.job;
        let forced: Vec<usize> = (0..lanes.len()).filter(|k| lanes[*k] == Lane::Forced).collect();
        let known: Vec<Vec<f64>> = forced.iter().map(|k| self.units[*k].displacements.clone()).collect();
        let rested = self.together.settle(&known, &job.ask());
        for (k, rested) in forced.into_iter().zip(rested) {
            lanes[k] = match rested {
                Some(rested) => {
                    job.take(rested, &mut self.units[k], &mut dice[k]);
                    Lane::Done
                }
                None => Lane::Doubt,
            };
        }
    }
}

/// The smallest factors on the clearances; where several equations decide them, by programs of one structure.
fn factors(job: &Job<'_>, misfits: &[DVector<f64>]) -> Vec<Loosest> {
    let basis = job.system.basis;
    if basis.redundancy() < 2 || job.tied.is_empty() {
        return misfits.iter().map(|misfit| job.factor(misfit)).collect();
    }
    let gives: Vec<&Give> = job.tied.iter().map(|&g| &job.system.gives[g]).collect();
    let width: usize = gives.iter().map(|give| give.columns.len()).sum();
    let equations = 0..basis.redundancy();
    let row = |e: usize| gives.iter().flat_map(move |give| give.columns.iter().map(move |&c| (e, c)));
    let map: Vec<f64> = equations.flat_map(row).map(|at| job.compatibility.equations[at]).collect();
    let programs = Programs {
        n: misfits.len(),
        n_equations: basis.redundancy(),
        n_blocks: gives.len(),
        kinds: gives.iter().map(|give| give.kind.clone()).collect(),
        maps: map.repeat(misfits.len()),
        forces: vec![0.0; width * misfits.len()],
        rights: misfits.iter().flat_map(|misfit| misfit.iter().copied()).collect(),
    };
    let answers = programs.solve_here(Question::Assembly);
    let offsets = |number: usize| {
        let mut first = number * width;
        let mut offsets = Vec::with_capacity(gives.len());
        for give in &gives {
            let last = first + give.columns.len();
            offsets.push(answers.displacements[first..last].to_vec());
            first = last;
        }
        offsets
    };
    let of = |(number, misfit): (usize, &DVector<f64>)| {
        if job.fits(misfit) {
            return Loosest { factor: 0.0, offsets: None };
        }
        let factor = answers.factors[number];
        let possible = answers.outcomes[number] != Outcome::Infeasible;
        Loosest {
            factor: if possible { factor } else { f64::INFINITY },
            offsets: if possible { Some(offsets(number)) } else { None },
        }
    };
    misfits.iter().enumerate().map(of).collect()
}
