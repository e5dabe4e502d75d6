//! One chunk of units: drawn block by block, solved one by one, counted.

use nalgebra::DVector;

use super::lanes::Lanes;
use super::moments::Moments;
use super::unit::{Job, Unit};
use crate::batch::Bound;
use crate::batch::draw::Stream;
use crate::batch::lanes::{Block, LANES, Mask};
use crate::hyperstatic::compatibility::Compatibility;
use crate::mechanism::Mechanism;
use crate::sampling::CHUNK;
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
pub fn draw(
    job: &Job<'_>,
    bound: Option<Bound<'_>>,
    linear: &Linear<'_>,
    ranges: &Ranges,
    shift: &[f64],
    number: u64,
    samples: usize,
) -> Count {
    let m = job.system.mechanism;
    let n = m.size();
    let mut count = Count::new(m, ranges);
    count.tally.kept = job.request.keep.then(Kept::default);
    let mut sums = Sums::new(n, n + 2);
    let mut solver = Lanes { job, bound, fallbacks: 0 };
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
        let units = solver.solve(&drawn, number * CHUNK as u64 + first as u64, LANES.min(samples - first));
        for (lane, unit) in units.into_iter().enumerate() {
            if let Some(error) = count.unit(m, linear, unit) {
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
    count.tally.fallbacks = solver.fallbacks;
    count
}

impl Count {
    /// Counts a unit; gives its error where it has one.
    fn unit(&mut self, m: &Mechanism, linear: &Linear<'_>, unit: Unit) -> Option<Vec<f64>> {
        self.tally.statuses[unit.status as usize] += 1;
        if !unit.factor.is_nan() {
            self.factor.add(unit.factor);
        }
        if let Some(kept) = &mut self.tally.kept {
            kept.parameters.extend(&unit.parameters);
            kept.errors.extend(unit.error.clone().unwrap_or_else(|| vec![f64::NAN; m.size()]));
            kept.statuses.push(unit.status);
        }
        if unit.error.is_some() {
            self.first_order.add(&linear.parts(&unit.displacements, &unit.parameters));
            for (sketch, row) in self.forces.iter_mut().zip(m.elastic_rows()) {
                sketch.add(unit.forces[row]);
            }
        }
        unit.error
    }
}
