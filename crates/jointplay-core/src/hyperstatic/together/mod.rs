//! Many units of one configuration, side by side.
//!
//! Units differ in what is known of their displacements. The basis is closed for all of them lane by lane, on the
//! recorded iteration; where a lane is in doubt, or nothing has been recorded, plainly. Units [settle](Together::settle)
//! in rounds of closures and programs.

mod settle;

use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::compatibility::{Compatibility, Ties};
use super::system::System;
use crate::batch::lanes::LANES;
use crate::batch::simd::{Kernel, dispatch};
use crate::batch::{Borne, Bound};
use crate::closure::Inputs;
use crate::solver::{Solver, State};
use crate::status::Status;
pub(crate) use settle::Rested;

/// Units of one configuration.
pub(crate) struct Together<'a> {
    pub system: &'a System<'a>,
    pub solver: &'a Solver<'a>,
    pub nominal: &'a Nominal<'a>,
    /// The basis, closed for deviations that the units' are near to.
    pub built: &'a State,
    /// The recorded iteration of the basis.
    pub bound: Option<Bound<'a>>,
}

/// The pose where everything is perfect, which all units are near to.
pub(crate) struct Nominal<'a> {
    pub state: &'a State,
    pub compatibility: &'a Compatibility,
    /// What displacements must add up to there.
    pub right: DVector<f64>,
}

impl Nominal<'_> {
    /// What displacements must add up to beside the known ones.
    pub fn right_beside(&self, known: &[f64]) -> DVector<f64> {
        &self.right - &self.compatibility.equations * DVector::from_column_slice(known)
    }
}

/// One unit whose basis is closed.
#[derive(Clone, Debug)]
pub(crate) struct Closed {
    /// What its redundant rows lack.
    pub misfit: DVector<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// Whether it took the plain solver.
    pub plainly: bool,
}

/// The linearisation where a unit is closed.
struct Linearised {
    ties: Ties,
    /// What displacements do to the output.
    output: DMatrix<f64>,
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

impl Together<'_> {
    /// Closes the basis for the displacements of every unit.
    pub fn close<'d>(&mut self, displacements: impl Iterator<Item = &'d [f64]>) -> Vec<Result<Closed, Status>> {
        let displacements: Vec<&[f64]> = displacements.collect();
        let closed = self.close_lanes(&displacements, false, |_, _, _| ());
        let or_plainly = |(own, closed): (&&[f64], Option<(Closed, ())>)| match closed {
            Some((closed, ())) => Ok(closed),
            None => self.close_plainly(own).map(|state| self.closed(&state)),
        };
        displacements.iter().zip(closed).map(or_plainly).collect()
    }

    /// The same with the linearisation there.
    fn linearise(&mut self, displacements: &[&[f64]]) -> Vec<Result<(Closed, Linearised), Status>> {
        let closed = self.close_lanes(displacements, true, |basis, bound, lane| Linearised {
            ties: Ties::of_lane(basis, bound, lane),
            output: map_of_lane(basis, bound, lane),
        });
        let or_plainly = |(own, closed): (&&[f64], Option<(Closed, Linearised)>)| match closed {
            Some(found) => Ok(found),
            None => {
                let state = self.close_plainly(own)?;
                let c = Compatibility::at(self.system.basis, self.solver, &state).ok_or(Status::Singular)?;
                Ok((self.closed(&state), Linearised { ties: c.ties, output: c.output.parameters }))
            }
        };
        displacements.iter().zip(closed).map(or_plainly).collect()
    }

    /// Closes lane by lane and takes something from every lane; `None` where one is in doubt.
    fn close_lanes<T>(
        &mut self,
        displacements: &[&[f64]],
        statics: bool,
        take: impl Fn(&Basis, &Bound<'_>, usize) -> T,
    ) -> Vec<Option<(Closed, T)>> {
        let basis = self.system.basis;
        let Some(bound) = &mut self.bound else { return displacements.iter().map(|_| None).collect() };
        let mut taken = Vec::with_capacity(displacements.len());
        for block in displacements.chunks(LANES) {
            for lane in 0..LANES {
                // Idle lanes repeat the last unit.
                let own = block[lane.min(block.len() - 1)];
                bound.parameters().iter_mut().zip(own).for_each(|(block, d)| block.0[lane] = *d);
            }
            let good = dispatch(Close { bound: &mut *bound, statics });
            let of = |lane: usize| {
                let closed = Closed {
                    misfit: DVector::from_fn(basis.redundancy(), |k, _| bound.left(k).0[lane]),
                    error: (0..bound.n_outputs()).map(|k| bound.error(k).0[lane]).collect(),
                    plainly: false,
                };
                (closed, take(basis, bound, lane))
            };
            taken.extend((0..block.len()).map(|lane| good[lane].then(|| of(lane))));
        }
        taken
    }

    /// Closes the basis for the displacements of one unit, on the branch of all.
    pub fn close_plainly(&self, displacements: &[f64]) -> Result<State, Status> {
        let inputs = Inputs { drives: self.built.inputs.drives.clone(), parameters: displacements.to_vec() };
        let close = self.solver.close(self.built, &inputs);
        let state = close.map_or_else(|| self.solver.follow(self.built, &inputs), Ok)?;
        if state.negative == self.built.negative { Ok(state) } else { Err(Status::Singular) }
    }

    fn closed(&self, state: &State) -> Closed {
        let basis = self.system.basis;
        Closed { misfit: basis.misfit(state), error: basis.kept.error(state, self.nominal.state), plainly: true }
    }
}

/// What displacements do to the output, at one lane.
fn map_of_lane(basis: &Basis, bound: &Bound<'_>, lane: usize) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(basis.all.size(), basis.all.n_parameters());
    for k in 0..map.nrows() {
        let multipliers = bound.multipliers(Borne::Component(k));
        basis.rows.iter().zip(multipliers).for_each(|(&row, block)| map[(k, row)] = block.0[lane]);
    }
    map
}
