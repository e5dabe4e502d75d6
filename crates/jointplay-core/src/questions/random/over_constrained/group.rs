//! Groups of specimens: what has been drawn for each, where that takes it, and what becomes of it.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use crate::cone::answer::Outcome;
use crate::cone::lanes::layout::Question;
use crate::cone::lanes::programs::Programs;
use crate::mechanism::status::Status;
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::specimen::{Fit, Job, Loosest, Specimen};
use crate::redundancy::compatibility::FITS;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::specimen_batch::Together;
use crate::redundancy::system::Element;

/// Corrections that make linearly compatible displacements exactly so: each leaves a part of the misfit that is
/// of the order of the displacements over the dimensions.
const CORRECTIONS: usize = 12;

/// A factor that differs from one by less may be on the other side on the exact closure: it changes by the order of the
/// displacements over the dimensions.
const NEAR: f64 = 0.05;

/// Specimens that are solved together.
pub struct Group<'g, 'a> {
    job: &'g Job<'g>,
    together: &'g mut Together<'a>,
    specimens: Vec<Specimen>,
    dice: Vec<Dice>,
}

/// A specimen whose displacements are compatible to first order.
struct Loose {
    number: usize,
    displacements: Vec<f64>,
    /// What changes a misfit with the least displacements.
    correction: Rc<DMatrix<f64>>,
}

impl<'g, 'a> Group<'g, 'a> {
    /// Specimens with what has been drawn for them, of which the first has the given number.
    pub fn new(job: &'g Job<'g>, together: &'g mut Together<'a>, drawn: &[Vec<f64>], first: u64) -> Self {
        let dice = (0..drawn.len() as u64).map(|k| Dice::new(job.request.seed, first.wrapping_add(k)));
        Self { job, together, specimens: drawn.iter().map(|drawn| job.drawn(drawn)).collect(), dice: dice.collect() }
    }

    /// Solves all specimens.
    pub fn solve(mut self) -> Vec<Specimen> {
        let closed = self.together.close(self.specimens.iter().map(|specimen| specimen.displacements.as_slice()));
        let mut assembled = Vec::with_capacity(closed.len());
        for (k, (closed, specimen)) in closed.into_iter().zip(&mut self.specimens).enumerate() {
            match closed {
                Ok(closed) => {
                    specimen.plainly = closed.plainly;
                    assembled.push((k, closed.misfit));
                }
                Err(status) => specimen.status = status,
            }
        }
        let misfits: Vec<DVector<f64>> = assembled.iter().map(|(_, misfit)| misfit.clone()).collect();
        let correction = Rc::new(self.job.correction.clone());
        let mut loosest = factors(self.job, &misfits);
        self.refine(&assembled, &mut loosest);
        let (mut loose, mut forced) = (Vec::new(), Vec::new());
        for ((k, misfit), loosest) in assembled.into_iter().zip(loosest) {
            let specimen = &mut self.specimens[k];
            match self.job.fit(&misfit, loosest, specimen, &mut self.dice[k]) {
                Fit::Loose => loose.push(Loose {
                    number: k,
                    displacements: specimen.displacements.clone(),
                    correction: Rc::clone(&correction),
                }),
                Fit::Forced => forced.push(k),
                Fit::Apart => specimen.status = Status::NotAssemblable,
            }
        }
        self.correct(loose);
        let loose = self.settle(forced);
        self.correct(loose);
        self.specimens
    }

    /// Near one, where it decides, the factor is that of the exact closure.
    fn refine(&mut self, assembled: &[(usize, DVector<f64>)], loosest: &mut [Loosest]) {
        let near: Vec<usize> = (0..loosest.len()).filter(|k| (loosest[*k].factor - 1.0).abs() < NEAR).collect();
        let known: Vec<Vec<f64>> = near.iter().map(|k| self.specimens[assembled[*k].0].displacements.clone()).collect();
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
            let specimen = &mut self.specimens[loose.number];
            specimen.before = Some(specimen.parameters.clone());
        }
        for _ in 0..CORRECTIONS {
            if open.is_empty() {
                return;
            }
            let closed = self.together.close(open.iter().map(|specimen| specimen.displacements.as_slice()));
            let mut left = Vec::with_capacity(open.len());
            for (mut loose, closed) in open.into_iter().zip(closed) {
                let specimen = &mut self.specimens[loose.number];
                let closed = match closed {
                    Ok(closed) => closed,
                    Err(status) => {
                        (specimen.status, specimen.error) = (status, None);
                        continue;
                    }
                };
                specimen.plainly |= closed.plainly;
                if basis.scaled_misfit(&closed.misfit) <= FITS {
                    specimen.error = Some(closed.error);
                    continue;
                }
                let change = &*loose.correction * closed.misfit;
                loose.displacements.iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
                job.move_offsets(specimen, &change);
                left.push(loose);
            }
            open = left;
        }
        for loose in open {
            let specimen = &mut self.specimens[loose.number];
            (specimen.status, specimen.error) = (Status::NotAssembled, None);
        }
    }

    /// Where load or misfit strain what is elastic, or push rigid bodies; gives the specimens in which clearances
    /// that carry nothing have been drawn.
    fn settle(&mut self, forced: Vec<usize>) -> Vec<Loose> {
        let known: Vec<Vec<f64>> = forced.iter().map(|k| self.specimens[*k].displacements.clone()).collect();
        let rested = self.together.settle(&known, &self.job.ask());
        let mut loose = Vec::new();
        for (k, rested) in forced.into_iter().zip(rested) {
            let specimen = &mut self.specimens[k];
            match rested {
                Ok(rested) => {
                    if let Some(correction) = self.job.take(rested, specimen, &mut self.dice[k]) {
                        let (displacements, correction) = (specimen.displacements.clone(), Rc::new(correction));
                        loose.push(Loose { number: k, displacements, correction });
                    }
                }
                Err(status) => specimen.status = status,
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
    let elements: Vec<&Element> = job.tied.iter().map(|&g| &job.system.elements[g]).collect();
    let width: usize = elements.iter().map(|element| element.columns.len()).sum();
    let equations = 0..basis.redundancy();
    let row = |e: usize| elements.iter().flat_map(move |element| element.columns.iter().map(move |&c| (e, c)));
    let map: Vec<f64> = equations.flat_map(row).map(|at| job.compatibility.equations[at]).collect();
    let programs = Programs {
        n: misfits.len(),
        n_equations: basis.redundancy(),
        n_blocks: elements.len(),
        kinds: elements.iter().map(|element| element.kind.clone()).collect(),
        maps: map.repeat(misfits.len()).into(),
        forces: vec![0.0; width * misfits.len()].into(),
        rights: misfits.iter().flat_map(|misfit| misfit.iter().copied()).collect(),
    };
    let answers = programs.solve_here(Question::Assembly);
    let offsets = |number: usize| {
        let mut first = number * width;
        let mut offsets = Vec::with_capacity(elements.len());
        for element in &elements {
            let last = first + element.columns.len();
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
