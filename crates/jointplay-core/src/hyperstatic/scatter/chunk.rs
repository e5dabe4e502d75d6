//! One chunk of units: drawn block by block, solved one by one, counted.

use nalgebra::DVector;

use super::moments::Moments;
use super::unit::{Job, Unit};
use crate::batch::draw::Stream;
use crate::batch::lanes::{Block, LANES, Mask};
use crate::hyperstatic::compatibility::Compatibility;
use crate::mechanism::Mechanism;
use crate::sampling::sketch::Sketch;
use crate::sampling::tally::{Kept, Ranges, Sums, Tally};
use crate::space::norm;

/// What is kept of a set of units.
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
            tally: Tally::new(n, ranges),
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

/// The error to first order at the nominal pose, and whose part of it is how large.
pub struct Linear<'a> {
    mechanism: &'a Mechanism,
    compatibility: &'a Compatibility,
    /// What drive values and the nominal misfit do.
    constant: Vec<f64>,
    /// Place of every parameter among the displacements.
    places: Vec<usize>,
}

impl<'a> Linear<'a> {
    pub fn new(mechanism: &'a Mechanism, c: &'a Compatibility, drive_shift: &[f64]) -> Self {
        let misfit = &c.shared * &c.misfit;
        let constant = drive_shift.iter().zip(misfit.iter()).map(|(d, m)| d - m).collect();
        let places = (0..mechanism.n_parameters()).map(|p| mechanism.place_of(p)).collect();
        Self { mechanism, compatibility: c, constant, places }
    }

    /// For displacements of the rows and parameters.
    pub fn error(&self, displacements: &[f64]) -> Vec<f64> {
        let moved = &self.compatibility.output.parameters * DVector::from_column_slice(displacements);
        self.constant.iter().zip(moved.iter()).map(|(a, b)| a + b).collect()
    }

    /// The error, the parts of the sources with the given parameters, and what is left of every joint's.
    fn parts(&self, displacements: &[f64], parameters: &[f64]) -> Vec<f64> {
        let m = self.mechanism;
        let n = m.size();
        let map = &self.compatibility.output.parameters;
        let mut parts = self.error(displacements);
        let add = |parts: &mut [f64], place: usize, d: f64| {
            (0..n).for_each(|i| parts[i] += map[(i, place)] * d);
        };
        for source in m.sources() {
            let mut part = vec![0.0; n];
            source.range().for_each(|p| add(&mut part, self.places[p], parameters[p]));
            parts.extend(part);
        }
        let first = parts.len();
        parts.resize(first + n * m.n_joints(), 0.0);
        for row in m.elastic_rows() {
            let offset = m.rows[row].parameter.map_or(0.0, |p| parameters[p]);
            let joint = first + n * m.rows[row].joint;
            add(&mut parts[joint..joint + n], row, displacements[row] - offset);
        }
        parts
    }
}

/// Draws, solves and counts a chunk.
///
/// Products are summed about `shift`, an error near the mean.
pub fn draw(job: &Job<'_>, linear: &Linear<'_>, ranges: &Ranges, shift: &[f64], number: u64, samples: usize) -> Count {
    let m = job.system.mechanism;
    let n = m.size();
    let mut count = Count::new(m, ranges);
    count.tally.kept = job.request.keep.then(Kept::default);
    let mut sums = Sums::new(n, n + 2);
    let mut stream = Stream::new(job.request.seed, number);
    let mut drawn = vec![Block::splat(0.0); m.n_parameters()];
    let mut quantities = vec![Block::splat(0.0); n + 2];
    for first in (0..samples).step_by(LANES) {
        for source in m.sources() {
            stream.draw(&source.set, Mechanism::law(source, job.request), &mut drawn[source.range()]);
            for p in source.range() {
                drawn[p] = drawn[p].add(&Block::splat(m.centre[p]));
            }
        }
        let mut good = Mask::NONE;
        for lane in 0..LANES.min(samples - first) {
            let parameters: Vec<f64> = drawn.iter().map(|block| block.0[lane]).collect();
            let unit = job.solve(number * crate::sampling::CHUNK as u64 + (first + lane) as u64, &parameters);
            let error = count.unit(job, linear, unit);
            if let Some(error) = error {
                good.0[lane] = u64::MAX;
                quantities.iter_mut().zip(&error).for_each(|(block, e)| block.0[lane] = *e);
                let (translations, rotations) = error.split_at(m.n_translations());
                let (position, rotation) = (norm(translations), norm(rotations));
                (quantities[n].0[lane], quantities[n + 1].0[lane]) = (position, rotation);
                let out = position > job.request.limit_position || rotation > job.request.limit_rotation;
                count.tally.outside += u64::from(out);
            }
        }
        sums.add(&quantities, &good, shift);
        count.tally.count_block(ranges, &quantities, &good);
    }
    count.tally.absorb(&sums, shift);
    count
}

impl Count {
    /// Counts a unit; gives its error where it has one.
    fn unit(&mut self, job: &Job<'_>, linear: &Linear<'_>, unit: Unit) -> Option<Vec<f64>> {
        let m = job.system.mechanism;
        self.tally.statuses[unit.status as usize] += 1;
        if !unit.factor.is_nan() {
            self.factor.add(unit.factor);
        }
        let error = unit.state.as_ref().map(|state| job.system.basis.kept.error(state, job.nominal));
        if let Some(kept) = &mut self.tally.kept {
            kept.parameters.extend(&unit.parameters);
            kept.errors.extend(error.clone().unwrap_or_else(|| vec![f64::NAN; m.size()]));
            kept.statuses.push(unit.status);
        }
        if error.is_some() {
            self.first_order.add(&linear.parts(&unit.displacements, &unit.parameters));
            for (sketch, row) in self.forces.iter_mut().zip(m.elastic_rows()) {
                sketch.add(unit.forces[row]);
            }
        }
        error
    }
}
