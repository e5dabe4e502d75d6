//! Blocks of units that go together rigidly: closed lane by lane, on the recorded iteration of the basis.

use nalgebra::DVector;

use super::dice::Dice;
use super::unit::{CORRECTIONS, Fit, Job, Loosest, Unit};
use crate::batch::Bound;
use crate::batch::lanes::{Block, LANES, Mask};
use crate::batch::simd::{Kernel, dispatch};
use crate::cone::Outcome;
use crate::cone::lanes::{Programs, Question};
use crate::hyperstatic::compatibility::FITS;
use crate::hyperstatic::system::Give;
use crate::status::Status;

/// Solves blocks of units.
pub struct Lanes<'a> {
    pub job: &'a Job<'a>,
    /// The recorded iteration; without it every unit is solved plainly.
    pub bound: Option<Bound<'a>>,
    /// Units in doubt that were solved plainly.
    pub fallbacks: u64,
}

struct Close<'a, 'n>(&'a mut Bound<'n>);

impl Kernel for Close<'_, '_> {
    type Output = Mask;

    #[inline(always)]
    fn run(self) -> Mask {
        self.0.solve()
    }
}

/// What becomes of a lane.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lane {
    /// Its displacements are being corrected.
    Open,
    Done,
    /// Load or misfit decide it.
    Forced,
    /// For the plain solver.
    Doubt,
}

impl Lanes<'_> {
    /// Solves the units of a block, of which the first has the given number.
    pub fn solve(&mut self, drawn: &[Block], first: u64, count: usize) -> Vec<Unit> {
        let job = self.job;
        let of = |lane: usize| -> Vec<f64> { drawn.iter().map(|block| block.0[lane]).collect() };
        let mut units: Vec<Unit> = (0..count).map(|lane| job.drawn(&of(lane))).collect();
        let lanes = match &mut self.bound {
            Some(bound) => together(job, bound, &mut units, first),
            None => vec![Lane::Doubt; count],
        };
        for (k, lane) in lanes.into_iter().enumerate() {
            if matches!(lane, Lane::Forced | Lane::Doubt) {
                self.fallbacks += u64::from(lane == Lane::Doubt);
                units[k] = job.solve(first + k as u64, &of(k));
            }
        }
        units
    }
}

fn together(job: &Job<'_>, bound: &mut Bound<'_>, units: &mut [Unit], first: u64) -> Vec<Lane> {
    let put = |bound: &mut Bound<'_>, lane: usize, displacements: &[f64]| {
        bound.parameters().iter_mut().zip(displacements).for_each(|(block, d)| block.0[lane] = *d);
    };
    for lane in 0..LANES {
        // What is left over at the end of a chunk repeats its last unit.
        put(bound, lane, &units[lane.min(units.len() - 1)].displacements);
    }
    let good = dispatch(Close(bound));
    let basis = job.system.basis;
    let left = |bound: &Bound<'_>, lane: usize| {
        DVector::from_iterator(basis.redundancy(), (0..basis.redundancy()).map(|k| bound.left(k).0[lane]))
    };
    let mut lanes = vec![Lane::Doubt; units.len()];
    let misfits: Vec<DVector<f64>> = (0..units.len()).map(|lane| left(bound, lane)).collect();
    let loosest = factors(job, &misfits);
    for (lane, loosest) in loosest.into_iter().enumerate().filter(|(lane, _)| good.has(*lane)) {
        let mut dice = Dice::new(job.request.seed, first + lane as u64);
        let unit = &mut units[lane];
        lanes[lane] = match job.fit(&misfits[lane], loosest, unit, &mut dice) {
            Fit::Loose => Lane::Open,
            Fit::Forced => Lane::Forced,
            Fit::Apart => {
                unit.status = Status::NotAssemblable;
                Lane::Done
            }
        };
    }
    let mut corrected: Vec<Vec<f64>> = units.iter().map(|unit| unit.displacements.clone()).collect();
    for _ in 0..CORRECTIONS {
        if !lanes.contains(&Lane::Open) {
            break;
        }
        for (lane, displacements) in corrected.iter().enumerate() {
            put(bound, lane, displacements);
        }
        let good = dispatch(Close(bound));
        for lane in (0..units.len()).filter(|lane| lanes[*lane] == Lane::Open).collect::<Vec<_>>() {
            let misfit = left(bound, lane);
            if !good.has(lane) {
                lanes[lane] = Lane::Doubt;
            } else if basis.scaled_misfit(&misfit) <= FITS {
                lanes[lane] = Lane::Done;
                units[lane].error = Some((0..bound.n_outputs()).map(|k| bound.error(k).0[lane]).collect());
            } else {
                let change = &job.correction * misfit;
                corrected[lane].iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
                job.move_offsets(&mut units[lane], &change);
            }
        }
    }
    lanes
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
    // A lane in doubt may hold anything.
    let clean = |b: f64| if b.is_finite() { b } else { 0.0 };
    let programs = Programs {
        n: misfits.len(),
        n_equations: basis.redundancy(),
        n_blocks: gives.len(),
        kinds: gives.iter().map(|give| give.kind.clone()).collect(),
        maps: map.repeat(misfits.len()),
        forces: vec![0.0; width * misfits.len()],
        rights: misfits.iter().flat_map(|misfit| misfit.iter().map(|b| clean(*b))).collect(),
    };
    let answers = programs.solve(Question::Assembly);
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
