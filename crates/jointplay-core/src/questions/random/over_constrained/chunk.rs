//! One chunk of specimens: drawn block by block, solved group by group, counted.

use nalgebra::{DMatrix, DVector};

use crate::interrupt;
use crate::math::lanes::block::{Block, LANES, Mask};
use crate::math::stats::moments::Moments;
use crate::math::stats::sketch::Sketch;
use crate::math::vector::norm;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::questions::columns::Sample;
use crate::questions::random::over_constrained::directions::Directions;
use crate::questions::random::over_constrained::room::least_displacements;
use crate::questions::random::over_constrained::specimen::{Job, Specimen};
use crate::questions::random::parts::{CHUNK, Part};
use crate::questions::random::tally::{Ranges, Sums, Tally};
use crate::redundancy::specimen_batch::Together;

/// Specimens that are solved together.
const GROUP: usize = 64;
/// A sum of terms below this part of their sizes is zero.
const ROUNDING: f64 = 1e-13;

/// What is kept of a set of specimens.
#[derive(Clone)]
pub struct Count {
    pub tally: Tally,
    /// First-order error, then the parts of the sources and of the joints' deformations in it.
    pub first_order: Moments,
    pub factor: Sketch,
    /// By row of the elastic joints.
    pub forces: Vec<Sketch>,
}

impl Count {
    pub fn new(m: &Mechanism, ranges: &Ranges) -> Self {
        let n = m.size();
        Self {
            tally: Tally::new(n, m.sources.len(), ranges),
            first_order: Moments::new(n * (1 + m.sources.len() + m.n_joints()), n),
            factor: Sketch::default(),
            forces: vec![Sketch::default(); m.elastic_rows().count()],
        }
    }

    pub fn merge(&mut self, other: &Self) {
        self.tally.merge(&other.tally);
        self.first_order.merge(&other.first_order);
        self.factor.merge(&other.factor);
        self.forces.iter_mut().zip(&other.forces).for_each(|(a, b)| a.merge(b));
    }
}

/// A sum of columns, without those that are zero.
struct ColumnSum {
    places: Vec<usize>,
    columns: Directions,
    rows: usize,
}

impl ColumnSum {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let places: Vec<usize> = (0..matrix.ncols()).filter(|&j| matrix.column(j).amax() > 0.0).collect();
        Self { columns: Directions::new(&matrix.select_columns(&places)), places, rows: matrix.nrows() }
    }

    /// Of so many times each.
    fn of(&self, times: impl Iterator<Item = f64>) -> Vec<f64> {
        let times: Vec<f64> = times.collect();
        let times: Vec<f64> = self.places.iter().map(|&j| times[j]).collect();
        let mut sum = vec![0.0; self.columns.coordinates()];
        self.columns.combine(&times, &mut sum);
        sum.truncate(self.rows);
        sum
    }
}

/// The error to first order at the nominal pose, and whose part of it is how large.
pub struct Linear<'a> {
    mechanism: &'a Mechanism,
    /// What drive values and the nominal misfit do to the output, and displacements; with the sizes of all terms.
    error: ColumnSum,
    sizes: ColumnSum,
    /// What displacements must add up to.
    right: &'a DVector<f64>,
    /// What displacements add up to, and what makes those that are compatible elsewhere so at the nominal pose.
    ties: ColumnSum,
    correction: ColumnSum,
    /// What displacements do to the output where no force holds the clearances.
    loose: DMatrix<f64>,
    /// Place of every parameter among the displacements.
    places: Vec<usize>,
    /// Where the load pushes the specimen with nothing but known deviations; none where offsets scatter by themselves.
    pressed: Option<Vec<f64>>,
}

impl<'a> Linear<'a> {
    pub fn new(job: &'a Job<'a>, case: &Case<'_>) -> Self {
        let c = job.nominal.compatibility;
        let m = job.system.mechanism;
        let misfit = &c.shared * &c.misfit;
        let shift = m.drive_shift(&c.output, case, job.nominal.state);
        // What is constant comes first.
        let mut map = c.output.parameters.clone().insert_column(0, 0.0);
        map.column_mut(0).iter_mut().zip(shift.iter().zip(misfit.iter())).for_each(|(d, (s, m))| *d = s - m);
        Self {
            mechanism: m,
            sizes: ColumnSum::new(&map.abs()),
            error: ColumnSum::new(&map),
            right: &job.nominal.right,
            ties: ColumnSum::new(&c.equations),
            correction: ColumnSum::new(&least_displacements(&job.system, &c.equations, &job.tied)),
            loose: job.system.derivatives_loose(c, |element| job.spread(element)),
            places: (0..m.n_parameters()).map(|p| m.place_of(p)).collect(),
            pressed: None,
        }
    }

    /// The same where the load decides all offsets, with those of the specimen with nothing but known deviations.
    pub fn pressed(self, offsets: Vec<f64>) -> Self {
        Self { pressed: Some(offsets), ..self }
    }

    /// For compatible displacements.
    pub fn error(&self, displacements: &[f64]) -> Vec<f64> {
        let terms = || std::iter::once(1.0).chain(displacements.iter().copied());
        let (mut errors, sizes) = (self.error.of(terms()), self.sizes.of(terms().map(f64::abs)));
        for (sum, size) in errors.iter_mut().zip(&sizes) {
            // What rounding leaves of terms that cancel each other is no error.
            *sum = if sum.abs() <= ROUNDING * size { 0.0 } else { *sum };
        }
        errors
    }

    /// The error of a specimen, the parts of the sources, and what is left of every joint's.
    fn parts(&self, specimen: &Specimen) -> Vec<f64> {
        let Specimen { displacements, held, .. } = specimen;
        let m = self.mechanism;
        let n = m.size();
        let mut own = displacements.clone();
        if !self.right.is_empty() {
            let sum = self.ties.of(displacements.iter().copied());
            let change = self.correction.of(self.right.iter().zip(sum).map(|(right, sum)| right - sum));
            own.iter_mut().zip(change).for_each(|(own, d)| *own += d);
        }
        let mut offsets = specimen.before.as_ref().unwrap_or(&specimen.parameters).clone();
        for source in m.sources().iter().filter(|source| source.is_clearance) {
            source.range().for_each(|p| offsets[p] += own[self.places[p]] - displacements[self.places[p]]);
        }
        let map = held.as_ref().unwrap_or(&self.loose).as_slice();
        let mut parts = self.error(&own);
        let first = n * (1 + m.sources.len());
        parts.resize(first + n * m.n_joints(), 0.0);
        let add = |parts: &mut [f64], place: usize, d: f64| {
            parts.iter_mut().zip(&map[n * place..n * (place + 1)]).for_each(|(part, m)| *part += m * d);
        };
        for (s, source) in m.sources().iter().enumerate() {
            for (k, p) in source.range().enumerate() {
                let place = self.places[p];
                let to = |s: usize, part: f64| add(&mut parts[n * (1 + s)..n * (2 + s)], place, part);
                match &self.pressed {
                    Some(pressed) => m.split_pressed(s, k, offsets[p], pressed, &specimen.parameters, to),
                    None => source.split(s, k, offsets[p], to),
                }
            }
        }
        for row in m.elastic_rows() {
            let offset = m.rows[row].parameter.map_or(0.0, |p| offsets[p]);
            let joint = first + n * m.rows[row].joint;
            add(&mut parts[joint..joint + n], row, own[row] - offset);
        }
        parts
    }
}

/// Draws, solves and counts a chunk; when stopped, part of it.
///
/// Products are summed about `shift`, an error near the mean.
pub fn draw(
    job: &Job<'_>,
    together: &Together<'_>,
    linear: &Linear<'_>,
    ranges: &Ranges,
    shift: &[f64],
    part: &Part,
) -> Count {
    let m = job.system.mechanism;
    let n = m.size();
    let mut count = Count::new(m, ranges);
    count.tally.kept = job.request.keep.then(Vec::new);
    let mut sums = Sums::new(n, n + 2);
    let mut numbers = part.numbers(job.request);
    let mut drawn = vec![Block::splat(0.0); m.n_parameters()];
    let mut quantities = vec![Block::splat(0.0); n + 2];
    for first in (0..part.count).step_by(GROUP) {
        let n_specimens = GROUP.min(part.count - first);
        let mut specimens_drawn = Vec::with_capacity(n_specimens);
        for at in (0..n_specimens).step_by(LANES) {
            m.draw(&mut numbers, job.request, &mut drawn);
            let lanes = 0..LANES.min(n_specimens - at);
            m.count_interference(&drawn, lanes.len(), &mut count.tally.interference);
            specimens_drawn.extend(lanes.map(|lane| drawn.iter().map(|block| block.0[lane]).collect::<Vec<f64>>()));
        }
        let first = part.number * CHUNK as u64 + first as u64;
        let Some(solved) = interrupt::until_stopped(|| job.solve(together, &specimens_drawn, first)) else { break };
        let mut specimens = solved.into_iter();
        for _ in (0..n_specimens).step_by(LANES) {
            let mut good = Mask::NONE;
            for (lane, specimen) in specimens.by_ref().take(LANES).enumerate() {
                if let Some(error) = count.add(m, linear, specimen) {
                    good.0[lane] = u64::MAX;
                    quantities.iter_mut().zip(&error).for_each(|(block, e)| block.0[lane] = *e);
                    let (translations, rotations) = error.split_at(m.n_translations());
                    let (position, rotation) = (norm(translations), norm(rotations));
                    (quantities[n].0[lane], quantities[n + 1].0[lane]) = (position, rotation);
                }
            }
            sums.add(&quantities, &good, shift);
            count.tally.count_block(ranges, &quantities, &good);
            count.tally.count_outside(&job.request.limits, &quantities, &good);
        }
    }
    count.tally.absorb(&sums, shift);
    count
}

impl Count {
    /// Counts a specimen; gives its error where it has one.
    fn add(&mut self, m: &Mechanism, linear: &Linear<'_>, specimen: Specimen) -> Option<Vec<f64>> {
        self.tally.statuses[specimen.status as usize] += 1;
        self.tally.fallbacks += u64::from(specimen.plainly);
        if !specimen.factor.is_nan() {
            self.factor.add(specimen.factor);
        }
        if let Some(kept) = &mut self.tally.kept {
            kept.push(Sample {
                kept_parameters: specimen.parameters.clone(),
                kept_errors: specimen.error.clone().unwrap_or_else(|| vec![f64::NAN; m.size()]),
                kept_status: specimen.status,
            });
        }
        if specimen.error.is_some() {
            self.first_order.add(&linear.parts(&specimen));
            for (sketch, row) in self.forces.iter_mut().zip(m.elastic_rows()) {
                sketch.add(specimen.forces[row]);
            }
        }
        specimen.error
    }
}
