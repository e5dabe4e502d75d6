//! How specimens settle of a rigid mechanism whose displacements nothing ties: the forces of a load alone decide them.
//!
//! There is no program to wait for, so that those of a block go the way of [`System::settle_by`] lane by lane. One that
//! does not come to rest soon, or whose lane is in doubt, is left to its course.

use nalgebra::{DMatrix, DVector};

use crate::clearance::undecided::UNDECIDED;
use crate::closure::recorded::program::Bound;
use crate::cone::bodies::Form;
use crate::interrupt;
use crate::math::lanes::block::LANES;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::sequence::foreseen;
use crate::redundancy::specimen_batch::{Together, error_of_lane, map_of_lane};
use crate::redundancy::system::System;

/// Closures of a block until specimens that have not come to rest are left to their courses.
const ROUNDS: usize = 6;

/// Where a load has pressed a specimen.
pub(crate) struct Pressed {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    /// The offset of every element.
    pub offsets: Vec<Form>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// Whether what the load leaves open moves the output there.
    pub observable: bool,
}

/// A specimen on its way.
struct Lane<'k> {
    known: &'k [f64],
    displacements: Vec<f64>,
    offsets: Vec<Form>,
    forces: DVector<f64>,
    /// The last change, and how slowly they shrink.
    last: f64,
    slowest: f64,
    rests: bool,
    good: bool,
}

impl Together<'_> {
    /// Presses specimens with these displacements known of them; `limits` are how far the output moves at least where that
    /// is observable.
    pub fn press(&self, known: &[&[f64]], limits: &[f64]) -> Vec<Option<Pressed>> {
        let (system, basis) = (self.system, self.system.basis);
        let mut bound = self.bound.borrow_mut();
        let Some(bound) = bound.as_mut() else { return known.iter().map(|_| None).collect() };
        let nothing = DVector::zeros(0);
        let untied = Ties {
            equations: DMatrix::zeros(0, basis.all.n_parameters()),
            misfit: nothing.clone(),
            load: nothing.clone(),
        };
        let mut pressed = Vec::with_capacity(known.len());
        for known in known.chunks(LANES) {
            interrupt::check();
            let good = Self::close_block(bound, known.len(), |lane| known[lane], false);
            let mut lanes: Vec<Lane<'_>> = Vec::with_capacity(known.len());
            for (&known, good) in known.iter().zip(good) {
                let forces = self.nominal.compatibility.load.clone();
                let (displacements, offsets) = (known.to_vec(), vec![Form::default(); system.elements.len()]);
                let mut lane =
                    Lane { known, displacements, offsets, forces, last: 0.0, slowest: 0.0, rests: false, good };
                // They begin where the first order at the nominal pose takes them.
                lane.last = system.push(&mut lane)[0];
                lanes.push(lane);
            }
            let mut round = 0;
            while round < ROUNDS && lanes.iter().any(|lane| lane.good && !lane.rests) {
                let good = Self::close_block(bound, lanes.len(), |lane| &lanes[lane].displacements, true);
                for (k, lane) in lanes.iter_mut().enumerate().filter(|(_, lane)| lane.good && !lane.rests) {
                    lane.good = good[k];
                    Ties::put_load(basis, bound, k, &mut lane.forces);
                    let [change, size] = system.push(lane);
                    let next = foreseen(&mut lane.slowest, change, lane.last, size);
                    lane.rests = system.is_still(change, lane.last, size) || next <= system.mechanism.still() * size;
                    lane.last = change;
                }
                round += 1;
            }
            let good = Self::close_block(bound, lanes.len(), |lane| &lanes[lane].displacements, true);
            pressed.extend(lanes.into_iter().enumerate().map(|(k, lane)| {
                let rests = lane.good && lane.rests && good[k];
                rests.then(|| Pressed {
                    error: error_of_lane(bound, k),
                    observable: self.leaves_observable(bound, k, &untied, &lane, limits),
                    displacements: lane.displacements,
                    offsets: lane.offsets,
                })
            }));
        }
        pressed
    }

    /// Whether what the load leaves open moves the output where a lane rests.
    fn leaves_observable(
        &self,
        bound: &Bound<'_>,
        number: usize,
        untied: &Ties,
        lane: &Lane<'_>,
        limits: &[f64],
    ) -> bool {
        let system = self.system;
        system.leaves_open(untied, &lane.forces) && {
            let balance = Balance::free(Vec::new(), lane.forces.clone());
            let output = map_of_lane(system.basis, bound, number);
            system.is_observable(untied, &output, &untied.misfit, &balance, limits)
        }
    }
}

impl System<'_> {
    /// Puts every offset of a lane where its forces push it; gives the largest change of a displacement, and the largest
    /// displacement beside the known ones.
    fn push(&self, lane: &mut Lane<'_>) -> [f64; 2] {
        let tolerance = UNDECIDED * self.force_scale(&lane.forces);
        let (mut change, mut size) = (0.0_f64, 0.0_f64);
        for (element, offset) in self.elements.iter().zip(&mut lane.offsets) {
            let Some(set) = element.kind.set() else { continue };
            *offset = set.face(&Self::on(element, &lane.forces)[..set.size()], tolerance).centre;
            for (&column, d) in element.columns.iter().zip(&*offset) {
                let (known, own, unit) = (lane.known[column], lane.displacements[column], self.basis.unit(column));
                let to = known + d;
                change = change.max((own - to).abs() / unit);
                size = size.max((known - to).abs() / unit).max((known - own).abs() / unit);
                lane.displacements[column] = to;
            }
        }
        [change, size]
    }
}
