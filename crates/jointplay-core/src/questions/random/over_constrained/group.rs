//! Groups of units: what has been drawn for each, where that takes it, and what becomes of it.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use crate::cone::answer::Outcome;
use crate::cone::lanes::layout::Question;
use crate::cone::lanes::programs::Programs;
use crate::mechanism::status::Status;
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::unit::{Fit, Job, Loosest, Unit};
use crate::redundancy::compatibility::FITS;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::specimen_batch::Together;
use crate::redundancy::system::Give;

/// Corrections that make linearly compatible displacements exactly so: each leaves a part of the misfit that is
/// of the order of the displacements over the dimensions.
const CORRECTIONS: usize = 12;

/// A factor that differs from one by less may be on the other side on the exact closure: it changes by the order of the
/// displacements over the dimensions.
const NEAR: f64 = 0.05;

/// Units that are solved together.
pub struct Group<'g, 'a> {
    job: &'g Job<'g>,
    together: &'g mut Together<'a>,
    units: Vec<Unit>,
    dice: Vec<Dice>,
}

/// A unit whose displacements are compatible to first order.
struct Loose {
    number: usize,
    displacements: Vec<f64>,
    /// What changes a misfit with the least displacements.
    correction: Rc<DMatrix<f64>>,
}

impl<'g, 'a> Group<'g, 'a> {
    /// Units with what has been drawn for them, of which the first has the given number.
    pub fn new(job: &'g Job<'g>, together: &'g mut Together<'a>, drawn: &[Vec<f64>], first: u64) -> Self {
        let dice = (0..drawn.len() as u64).map(|k| Dice::new(job.request.seed, first.wrapping_add(k)));
        Self { job, together, units: drawn.iter().map(|drawn| job.drawn(drawn)).collect(), dice: dice.collect() }
    }

    /// Solves all units.
    pub fn solve(mut self) -> Vec<Unit> {
        let closed = self.together.close(self.units.iter().map(|unit| unit.displacements.as_slice()));
        let mut assembled = Vec::with_capacity(closed.len());
        for (k, (closed, unit)) in closed.into_iter().zip(&mut self.units).enumerate() {
            match closed {
                Ok(closed) => {
                    unit.plainly = closed.plainly;
                    assembled.push((k, closed.misfit));
                }
                Err(status) => unit.status = status,
            }
        }
        let misfits: Vec<DVector<f64>> = assembled.iter().map(|(_, misfit)| misfit.clone()).collect();
        let correction = Rc::new(self.job.correction.clone());
        let mut loosest = factors(self.job, &misfits);
        self.refine(&assembled, &mut loosest);
        let (mut loose, mut forced) = (Vec::new(), Vec::new());
        for ((k, misfit), loosest) in assembled.into_iter().zip(loosest) {
            let unit = &mut self.units[k];
            match self.job.fit(&misfit, loosest, unit, &mut self.dice[k]) {
                Fit::Loose => loose.push(Loose {
                    number: k,
                    displacements: unit.displacements.clone(),
                    correction: Rc::clone(&correction),
                }),
                Fit::Forced => forced.push(k),
                Fit::Apart => unit.status = Status::NotAssemblable,
            }
        }
        self.correct(loose);
        let loose = self.settle(forced);
        self.correct(loose);
        self.units
    }

    /// Near one, where it decides, the factor is that of the exact closure.
    fn refine(&mut self, assembled: &[(usize, DVector<f64>)], loosest: &mut [Loosest]) {
        let near: Vec<usize> = (0..loosest.len()).filter(|k| (loosest[*k].factor - 1.0).abs() < NEAR).collect();
        let known: Vec<Vec<f64>> = near.iter().map(|k| self.units[assembled[*k].0].displacements.clone()).collect();
        for (k, rested) in near.into_iter().zip(self.together.settle(&known, &Ask::Factor)) {
            if let Ok(rested) = rested {
                loosest[k].settle_at(rested.balance.factor);
            }
        }
    }

    /// Closes the mechanism for displacements that are compatible to first order, changing them by what is left.
    fn correct(&mut self, mut open: Vec<Loose>) {
        let (job, basis) = (self.job, self.job.system.basis);
        for loose in &open {
            let unit = &mut self.units[loose.number];
            unit.before = Some(unit.parameters.clone());
        }
        for _ in 0..CORRECTIONS {
            if open.is_empty() {
                return;
            }
            let closed = self.together.close(open.iter().map(|unit| unit.displacements.as_slice()));
            let mut left = Vec::with_capacity(open.len());
            for (mut loose, closed) in open.into_iter().zip(closed) {
                let unit = &mut self.units[loose.number];
                let closed = match closed {
                    Ok(closed) => closed,
                    Err(status) => {
                        (unit.status, unit.error) = (status, None);
                        continue;
                    }
                };
                unit.plainly |= closed.plainly;
                if basis.scaled_misfit(&closed.misfit) <= FITS {
                    unit.error = Some(closed.error);
                    continue;
                }
                let change = &*loose.correction * closed.misfit;
                loose.displacements.iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
                job.move_offsets(unit, &change);
                left.push(loose);
            }
            open = left;
        }
        for loose in open {
            let unit = &mut self.units[loose.number];
            (unit.status, unit.error) = (Status::NotAssembled, None);
        }
    }

    /// Where load or misfit strain what is elastic, or push rigid bodies; gives the units in which clearances
    /// that carry nothing have been drawn.
    fn settle(&mut self, forced: Vec<usize>) -> Vec<Loose> {
        let known: Vec<Vec<f64>> = forced.iter().map(|k| self.units[*k].displacements.clone()).collect();
        let rested = self.together.settle(&known, &self.job.ask());
        let mut loose = Vec::new();
        for (k, rested) in forced.into_iter().zip(rested) {
            let unit = &mut self.units[k];
            match rested {
                Ok(rested) => {
                    if let Some(correction) = self.job.take(rested, unit, &mut self.dice[k]) {
                        let (displacements, correction) = (unit.displacements.clone(), Rc::new(correction));
                        loose.push(Loose { number: k, displacements, correction });
                    }
                }
                Err(status) => unit.status = status,
            }
        }
        loose
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
        maps: map.repeat(misfits.len()).into(),
        forces: vec![0.0; width * misfits.len()].into(),
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
            return Loosest::new(0.0, None);
        }
        let factor = answers.factors[number];
        let possible = answers.outcomes[number] != Outcome::Infeasible;
        if possible { Loosest::new(factor, Some(offsets(number))) } else { Loosest::new(f64::INFINITY, None) }
    };
    misfits.iter().enumerate().map(of).collect()
}
