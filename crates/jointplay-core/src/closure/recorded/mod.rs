//! The batch engine: the closure solved for blocks of samples by recorded programs.
//!
//! For a mechanism the Newton iteration is recorded once, elimination included, as two programs: the
//! first step from the nominal pose, where the Jacobian is common to all samples, and a full step from
//! any pose. A configuration binds the quantities common to its samples; a block of samples then takes
//! the first step and full steps until every lane's predicted remaining error is below rounding. Lanes
//! that do not get there are handed to the plain solver, and counted.

pub(crate) mod elimination;
pub(crate) mod layout;
pub(crate) mod program;
pub(crate) mod self_stress;
pub(crate) mod statics;
pub(crate) mod step;

use crate::closure::newton::Solver;
use crate::mechanism::Mechanism;

/// What recordings of a solver's equations have in common if their mechanisms differ in numbers only: what is recorded,
/// the unknowns of every row and the order of elimination.
pub(crate) fn structure(recorded: &'static str, solver: &Solver<'_>) -> Structure {
    let order = solver.plan.as_ref().map(|plan| plan.order().collect());
    Structure { recorded, n_parameters: solver.mechanism.n_parameters(), pattern: solver.pattern.clone(), order }
}

/// See [`structure`].
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct Structure {
    recorded: &'static str,
    n_parameters: usize,
    pattern: Vec<(usize, usize)>,
    order: Option<Vec<(usize, usize)>>,
}

/// The first step from the nominal pose turns by less than this (rad), or the plain solver takes over:
/// the power series of sine and cosine are cut for it.
pub const SMALL_ANGLE: f64 = 0.35;

/// Steps after the first turn by less than this (rad), or the plain solver takes over.
pub const LATER_ANGLE: f64 = 0.05;

impl Mechanism {
    /// The largest step that recorded programs take from a nominal pose.
    pub(crate) fn small_step(&self) -> f64 {
        SMALL_ANGLE.min(self.largest_move)
    }
}
