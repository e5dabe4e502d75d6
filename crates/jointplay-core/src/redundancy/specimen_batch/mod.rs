//! Many specimens of one configuration, side by side.
//!
//! Specimens differ in what is known of their displacements. What becomes of one is a course ([`Rounds`]) that waits for
//! its programs and for the closure of its basis, which is done lane by lane on the recorded iteration; where a lane is
//! in doubt, or nothing has been recorded, plainly.

pub(crate) mod pressed;
pub(crate) mod sequence;

use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Bound;
use crate::closure::recorded::self_stress::Borne;
use crate::cone::scheduler::{Desk, Rounds};
use crate::interrupt;
use crate::math::lanes::block::LANES;
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::mechanism::status::Status;
use crate::redundancy::basis::Basis;
use crate::redundancy::compatibility::{Compatibility, Ties};
use crate::redundancy::system::System;

/// Specimens of one configuration.
pub(crate) struct Together<'a> {
    pub system: &'a System<'a>,
    pub solver: &'a Solver<'a>,
    pub nominal: &'a Nominal<'a>,
    /// The basis, closed for deviations that the specimens' are near to.
    pub built: &'a State,
    /// The recorded iteration of the basis.
    bound: RefCell<Option<Bound<'a>>>,
    closures: Desk<Vec<f64>, Result<Closed, Status>>,
    linearisations: Desk<Linearisation, Result<(Closed, Linearised), Status>>,
}

/// The pose where everything is perfect, which all specimens are near to.
pub(crate) struct Nominal<'a> {
    pub state: &'a State,
    pub compatibility: &'a Compatibility,
    /// What displacements must add up to there.
    pub right: DVector<f64>,
}

impl Nominal<'_> {
    /// What displacements must add up to beside the known ones.
    pub fn right_beside(&self, known: &[f64]) -> DVector<f64> {
        &self.right - self.compatibility.sum(known.iter().copied())
    }
}

/// One specimen whose basis is closed.
#[derive(Clone, Debug)]
pub(crate) struct Closed {
    /// What its redundant rows lack.
    pub misfit: DVector<f64>,
    /// Error of the output.
    pub error: Vec<f64>,
    /// Whether it took the plain solver.
    pub plainly: bool,
}

/// Displacements for which a specimen is closed and linearised, and whether the output is.
struct Linearisation {
    displacements: Vec<f64>,
    of_output: bool,
}

/// The linearisation where a specimen is closed.
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

impl<'a> Together<'a> {
    pub fn new(
        system: &'a System<'a>,
        solver: &'a Solver<'a>,
        nominal: &'a Nominal<'a>,
        built: &'a State,
        bound: Option<Bound<'a>>,
    ) -> Self {
        let bound = RefCell::new(bound);
        Self { system, solver, nominal, built, bound, closures: Desk::default(), linearisations: Desk::default() }
    }

    /// Takes a course for every specimen, all of them side by side.
    pub fn each<I, T>(&self, specimens: impl Iterator<Item = I>, course: impl AsyncFn(&Rounds, I) -> T) -> Vec<T> {
        // Specimens that only close wait for those that settle, to be closed together once more.
        Rounds::each_beside(specimens, course, || {
            self.linearisations.serve(|asked| self.linearise_all(&asked))
                || self.closures.serve(|asked| self.close_all(&asked))
        })
    }

    /// Closes the basis for the displacements of a specimen.
    pub async fn close(&self, displacements: &[f64]) -> Result<Closed, Status> {
        self.closures.ask(displacements.to_vec()).await
    }

    /// The same with the linearisation there, that of the output where it is wanted.
    async fn linearise(&self, displacements: &[f64], of_output: bool) -> Result<(Closed, Linearised), Status> {
        self.linearisations.ask(Linearisation { displacements: displacements.to_vec(), of_output }).await
    }

    fn close_all(&self, specimens: &[Vec<f64>]) -> Vec<Result<Closed, Status>> {
        let displacements: Vec<&[f64]> = specimens.iter().map(Vec::as_slice).collect();
        let closed = self.close_lanes(&displacements, false, |_, _, _| ());
        let or_plainly = |(own, closed): (&&[f64], Option<(Closed, ())>)| match closed {
            Some((closed, ())) => Ok(closed),
            None => self.close_plainly(own).map(|state| self.closed(&state)),
        };
        displacements.iter().zip(closed).map(or_plainly).collect()
    }

    fn linearise_all(&self, specimens: &[Linearisation]) -> Vec<Result<(Closed, Linearised), Status>> {
        let basis = self.system.basis;
        let displacements: Vec<&[f64]> = specimens.iter().map(|one| one.displacements.as_slice()).collect();
        let closed = self.close_lanes(&displacements, true, |specimen, bound, lane| Linearised {
            ties: Ties::of_lane(basis, bound, lane),
            output: if specimens[specimen].of_output { map_of_lane(basis, bound, lane) } else { DMatrix::zeros(0, 0) },
        });
        let or_plainly = |(own, closed): (&&[f64], Option<_>)| {
            if let Some(found) = closed {
                return Ok(found);
            }
            let state = self.close_plainly(own)?;
            let c = Compatibility::at(basis, self.solver, &state).ok_or(Status::Singular)?;
            Ok((self.closed(&state), Linearised { ties: c.ties, output: c.output.parameters }))
        };
        displacements.iter().zip(closed).map(or_plainly).collect()
    }

    /// Closes lane by lane and takes something of every specimen from its lane; `None` where one is in doubt.
    fn close_lanes<T>(
        &self,
        displacements: &[&[f64]],
        statics: bool,
        take: impl Fn(usize, &Bound<'_>, usize) -> T,
    ) -> Vec<Option<(Closed, T)>> {
        let basis = self.system.basis;
        let mut bound = self.bound.borrow_mut();
        let Some(bound) = bound.as_mut() else { return displacements.iter().map(|_| None).collect() };
        let mut taken = Vec::with_capacity(displacements.len());
        for block in displacements.chunks(LANES) {
            interrupt::check();
            let good = Self::close_block(bound, block.len(), |lane| block[lane], statics);
            let first = taken.len();
            let of = |lane: usize| {
                let closed = Closed {
                    misfit: DVector::from_fn(basis.redundancy(), |k, _| bound.left(k).0[lane]),
                    error: error_of_lane(bound, lane),
                    plainly: false,
                };
                (closed, take(first + lane, bound, lane))
            };
            taken.extend((0..block.len()).map(|lane| good[lane].then(|| of(lane))));
        }
        taken
    }

    /// Closes a block of so many specimens by their displacements; tells which lanes are closed.
    fn close_block<'s>(
        bound: &mut Bound<'_>,
        specimens: usize,
        displacements: impl Fn(usize) -> &'s [f64],
        statics: bool,
    ) -> [bool; LANES] {
        for lane in 0..LANES {
            // Idle lanes repeat the last specimen.
            let own = displacements(lane.min(specimens - 1));
            bound.parameters().iter_mut().zip(own).for_each(|(block, d)| block.0[lane] = *d);
        }
        dispatch(Close { bound, statics })
    }

    /// Closes the basis for the displacements of one specimen, on the branch of all.
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

/// Error of the output, at one lane.
fn error_of_lane(bound: &Bound<'_>, lane: usize) -> Vec<f64> {
    (0..bound.n_outputs()).map(|k| bound.error(k).0[lane]).collect()
}

/// What displacements do to the output, at one lane.
fn map_of_lane(basis: &Basis, bound: &Bound<'_>, lane: usize) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(basis.all.size(), basis.all.n_parameters());
    for k in 0..map.nrows() {
        let multipliers = bound.multipliers(Borne::Component(k));
        basis.rows.iter().zip(multipliers).for_each(|(&row, block)| map[(k, row)] = block.0[lane]);
    }
    bound.slopes().for_each(|(row, slope)| map.column_mut(row).scale_mut(slope.0[lane]));
    map
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::closure::recorded::program::Newton;
    use crate::closure::recorded::self_stress::SelfStress;
    use crate::mechanism::Mechanism;
    use crate::mechanism::case::Case;

    /// Three cranks on one coupler, a load on it, and a dimension of the coupler.
    fn three_cranks() -> Mechanism {
        let (mut points, mut joints) = (Vec::new(), Vec::new());
        let feet = [[0.0, 0.0], [0.1, 0.0], [0.04, 0.03]];
        for (crank, [x, y]) in (0_i32..).zip(feet) {
            let places = [(-1, x, y), (crank, 0.0, 0.0), (crank, 0.05, 0.0), (3, x, y)];
            for first in [points.len(), points.len() + 2] {
                let axes = ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
                joints.push(json!({"kind": "revolute", "first": first, "second": first + 1,
                                   "axis_first": axes.0, "axis_second": axes.1}));
            }
            points.extend(places.map(|(body, x, y)| json!({"body": body, "at": [x, y, 0.0]})));
        }
        points.push(json!({"body": 3, "at": [0.05, 0.05, 0.0]}));
        let (s, c) = 1.0_f64.sin_cos();
        let guess = feet.map(|[x, y]| [x, y, 1.0]).into_iter().chain([[0.05 * c, 0.05 * s, 0.0]]);
        let disc = |joint: usize| {
            json!({"kind": "clearance", "joint": joint, "set": {"disc": {"radius": 1e-4}},
                                         "centre": [0.0, 0.0], "law": "uniform"})
        };
        let long = json!({"kind": "dimension", "from": 3, "to": 7, "centre": [0.0], "law": "uniform",
                          "set": {"interval": {"low": -1e-4, "high": 1e-4}}});
        let spec = json!({
            "space": "planar", "n_bodies": 4, "length": 0.1, "singular_value": 1e-3,
            "guess": guess.collect::<Vec<_>>(), "points": points, "joints": joints, "drives": [{"joint": 0}],
            "output": {"point": 12}, "loads": [{"point": 12, "force": [3.0, -20.0, 0.0], "moment": [0.0, 0.0, 0.2]}],
            "sources": (0..6).map(disc).chain([long]).collect::<Vec<_>>(),
        });
        Mechanism::new(&serde_json::from_value(spec).unwrap()).unwrap()
    }

    #[test]
    fn lanes_are_linearised_as_the_plain_solver_does() {
        let m = three_cranks();
        let trace = m.trace(1, &[1.0]);
        let cases = [Case { drives: &[1.0], coordinates: &trace.coordinates }];
        let compared = m.each_on_basis(
            &cases,
            |system, solver, _, case, state| {
                let c = Compatibility::at(system.basis, solver, &state).unwrap();
                let right = m.first_order_right(&c, &vec![0.0; c.load.len()], case, &state);
                let nominal = Nominal { state: &state, compatibility: &c, right };
                let beside = SelfStress { all: &system.basis.all, redundant: &system.basis.redundant, statics: true };
                let newton = Newton::record_beside(solver, m.largest_angle(), Some(&beside)).unwrap();
                let bound = Some(newton.bind(&system.basis.kept, &state, case.drives));
                let lanes = Together::new(system, solver, &nominal, &state, bound);
                // More specimens than lanes, the offsets and the length without a pattern.
                let number = |specimen: usize, p: usize| 2e-4 * ((0.618 * (7 * specimen + p) as f64).fract() - 0.5);
                let of = |specimen: usize| (0..m.n_parameters()).map(|p| number(specimen, p)).collect::<Vec<f64>>();
                let specimens: Vec<Vec<f64>> = (0..LANES + 3).map(|specimen| m.displacements(&of(specimen))).collect();
                let linearised = || {
                    lanes.each(specimens.iter(), async |_, displacements| lanes.linearise(displacements, true).await)
                };
                let found = linearised();
                lanes.bound.replace(None);
                for (found, plain) in found.into_iter().zip(linearised()) {
                    let ((closed, at), (closed_plainly, plainly)) = (found.unwrap(), plain.unwrap());
                    assert!(!closed.plainly && closed_plainly.plainly);
                    let near = |a: &[f64], b: &[f64], size: f64| {
                        assert_eq!(a.len(), b.len());
                        a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() <= 1e-11 * size, "{a} {b}"));
                    };
                    near(closed.misfit.as_slice(), closed_plainly.misfit.as_slice(), 0.1);
                    near(&closed.error, &closed_plainly.error, 1.0);
                    let rows = 0..m.n_rows();
                    near(at.ties.misfit.as_slice(), plainly.ties.misfit.as_slice(), 0.1);
                    near(&at.ties.load.as_slice()[rows.clone()], &plainly.ties.load.as_slice()[rows.clone()], 100.0);
                    let columns =
                        |matrix: &DMatrix<f64>| matrix.columns(0, m.n_rows()).iter().copied().collect::<Vec<f64>>();
                    near(&columns(&at.ties.equations), &columns(&plainly.ties.equations), 10.0);
                    // Both do the same for displacements that keep compatible.
                    let shared = &plainly.output - &at.output;
                    let (shared, ties) = (shared.columns(0, m.n_rows()), at.ties.equations.columns(0, m.n_rows()));
                    let redundant = system.basis.redundant[0];
                    for k in 0..m.size() {
                        let part = shared[(k, redundant)] / ties[(0, redundant)];
                        (0..m.n_rows())
                            .for_each(|row| assert!((shared[(k, row)] - part * ties[(0, row)]).abs() < 1e-9));
                    }
                }
                specimens.len()
            },
            |status| panic!("{status:?}"),
        );
        assert_eq!(compared, [LANES + 3]);
    }
}
