//! Velocities and accelerations of all bodies while the drives move.
//!
//! On the closed mechanism the twists v of all bodies follow the speeds q' of the drives. What a drive commands enters
//! its rows by a constant coefficient c, so that with the closure Jacobian J
//!
//! ```text
//! J v = c q',    J a = c q'' - (D_v J) v
//! ```
//!
//! where `D_v J` is the derivative of J while the bodies move along v: the equations themselves give it, in numbers that
//! carry derivatives. Twists are velocities of the origins and angular velocities in ground axes, so that in space, too, a
//! holds the true angular accelerations. Of over-constrained mechanisms the rows of the basis decide; the others hold
//! where it is closed.

use crate::closure::newton::{Solver, State};
use crate::math::dual::{DIRECTIONS, Dual};
use crate::math::real::Real;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row as _;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Row};
use crate::nominal::columns::Moving;

/// Speeds and accelerations of the drives in a configuration.
#[derive(Clone, Copy, Debug)]
pub struct DriveRates<'a> {
    /// First derivatives of the drive values by time.
    pub speeds: &'a [f64],
    /// Second derivatives.
    pub accelerations: &'a [f64],
}

impl Mechanism {
    /// How all bodies move in every case, at its nominal coordinates.
    #[must_use]
    pub fn moving(&self, cases: &[Case<'_>], rates: &[DriveRates<'_>]) -> Answer {
        let wanted = Wanted::all(self);
        let missing = |status| Moving { status, ..Moving::unknown(&wanted) };
        let moving = |solver: &Solver<'_>, number: usize, nominal: &State, status| {
            solver.moving_at(nominal, rates[number]).map_or_else(
                || missing(Status::Singular),
                |[velocity, acceleration]| Moving { velocity, acceleration, status },
            )
        };
        let found = self.each_on_basis(
            cases,
            |_, solver, number, _, nominal| moving(solver, number, &nominal, self.nominal_status(&nominal)),
            missing,
        );
        Answer::of_rows(found.iter(), &wanted)
    }
}

impl Solver<'_> {
    /// Twists of all bodies and their derivatives by time; `None` where the state is singular.
    fn moving_at(&self, state: &State, rates: DriveRates<'_>) -> Option<[Vec<f64>; 2]> {
        let m = self.mechanism;
        let linearised = self.linearise(state)?;
        let commanded = |rates: &[f64]| -> Vec<f64> {
            let of_row = |row: &Row| row.drive.map_or(0.0, |by| by.coefficient * rates[by.drive]);
            m.rows.iter().map(of_row).collect()
        };
        let solved = |mut right: Vec<f64>| {
            let mut motion = vec![0.0; m.n_unknowns()];
            linearised.factors.solve(&mut right, &mut motion);
            motion
        };
        let velocity = solved(commanded(rates.speeds));
        let mut right = commanded(rates.accelerations);
        let along = |value: f64, slope: f64| {
            let mut slopes = [0.0; DIRECTIONS];
            slopes[0] = slope;
            Dual { value, slopes }
        };
        let drives: Vec<Dual> = state.inputs.drives.iter().zip(rates.speeds).map(|(q, s)| along(*q, *s)).collect();
        let parameters: Vec<Dual> = state.inputs.parameters.iter().map(|&p| Dual::from_f64(p)).collect();
        let poses = m.moving_poses(state, std::slice::from_ref(&velocity));
        let (_, derivatives) = m.evaluated(&poses, &m.commands(&drives, parameters));
        for (&(row, column), &pick) in self.pattern.iter().zip(&self.picks) {
            right[row] -= derivatives[pick].slopes[0] * velocity[column];
        }
        let acceleration = solved(right);
        Some([velocity, acceleration])
    }
}
