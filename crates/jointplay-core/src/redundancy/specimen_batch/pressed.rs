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
pub(crate) struct PressedSpecimen {
    /// Displacements of the rows and values of the parameters, as the basis takes them.
    pub displacements: Vec<f64>,
    /// The offset of every element.
    pub offsets: Vec<Form>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// The sources that the load leaves open there.
    pub open: Vec<usize>,
    /// Whether these move the output.
    pub observable: bool,
}

/// A specimen on its way.
struct OnItsWay<'k> {
    system: &'k System<'k>,
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
    /// Presses specimens, each with what gives way in it and the displacements that are known of it; `limits` are how far
    /// the output moves at least where that is observable.
    pub fn press(&self, specimens: &[(&System<'_>, &[f64])], limits: &[f64]) -> Vec<Option<PressedSpecimen>> {
        let basis = self.system.basis;
        let mut bound = self.bound.borrow_mut();
        let Some(bound) = bound.as_mut() else { return specimens.iter().map(|_| None).collect() };
        let nothing = DVector::zeros(0);
        let untied = Ties {
            equations: DMatrix::zeros(0, basis.all.n_parameters()),
            misfit: nothing.clone(),
            load: nothing.clone(),
        };
        let still = self.system.mechanism.still();
        let mut pressed = Vec::with_capacity(specimens.len());
        for block in specimens.chunks(LANES) {
            interrupt::check();
            let good = Self::close_block(bound, block.len(), |lane| block[lane].1, false);
            let mut lanes: Vec<OnItsWay<'_>> = Vec::with_capacity(block.len());
            for (&(system, known), good) in block.iter().zip(good) {
                let forces = self.nominal.compatibility.load.clone();
                let (displacements, offsets) = (known.to_vec(), vec![Form::default(); system.elements.len()]);
                let mut lane = OnItsWay {
                    system,
                    known,
                    displacements,
                    offsets,
                    forces,
                    last: 0.0,
                    slowest: 0.0,
                    rests: false,
                    good,
                };
                // They begin where the first order at the nominal pose takes them.
                lane.last = lane.push()[0];
                lanes.push(lane);
            }
            let mut round = 0;
            while round < ROUNDS && lanes.iter().any(|lane| lane.good && !lane.rests) {
                let good = Self::close_block(bound, lanes.len(), |lane| &lanes[lane].displacements, true);
                for (k, lane) in lanes.iter_mut().enumerate().filter(|(_, lane)| lane.good && !lane.rests) {
                    lane.good = good[k];
                    Ties::put_load(basis, bound, k, &mut lane.forces);
                    let [change, size] = lane.push();
                    let next = foreseen(&mut lane.slowest, change, lane.last, size);
                    lane.rests = lane.system.is_still(change, lane.last, size) || next <= still * size;
                    lane.last = change;
                }
                round += 1;
            }
            let good = Self::close_block(bound, lanes.len(), |lane| &lanes[lane].displacements, true);
            pressed.extend(lanes.into_iter().enumerate().map(|(k, lane)| {
                let rests = lane.good && lane.rests && good[k];
                rests.then(|| {
                    let open = lane.system.open_sources(&untied, &lane.forces);
                    PressedSpecimen {
                        error: error_of_lane(bound, k),
                        observable: !open.is_empty() && lane.is_observable(bound, k, &untied, limits),
                        open,
                        displacements: lane.displacements,
                        offsets: lane.offsets,
                    }
                })
            }));
        }
        pressed
    }
}

impl OnItsWay<'_> {
    /// Puts every offset where the forces push it; gives the largest change of a displacement, and the largest one beside the
    /// known ones.
    fn push(&mut self) -> [f64; 2] {
        let Self { system, known, displacements, offsets, forces, .. } = self;
        let tolerance = UNDECIDED * system.force_scale(forces);
        let (mut change, mut size) = (0.0_f64, 0.0_f64);
        for (element, offset) in system.elements.iter().zip(offsets) {
            let Some(set) = element.kind.set() else { continue };
            *offset = set.face(&System::on(element, forces)[..set.size()], tolerance).centre;
            for (&column, d) in element.columns.iter().zip(&*offset) {
                let (known, own, unit) = (known[column], displacements[column], system.basis.unit(column));
                let to = known + d;
                change = change.max((own - to).abs() / unit);
                size = size.max((known - to).abs() / unit).max((known - own).abs() / unit);
                displacements[column] = to;
            }
        }
        [change, size]
    }

    /// Whether what the load leaves open moves the output where the specimen rests at a lane.
    fn is_observable(&self, bound: &Bound<'_>, number: usize, untied: &Ties, limits: &[f64]) -> bool {
        let balance = Balance::free(Vec::new(), self.forces.clone());
        let output = map_of_lane(self.system.basis, bound, number);
        self.system.is_observable(untied, &output, &untied.misfit, &balance, limits)
    }
}
