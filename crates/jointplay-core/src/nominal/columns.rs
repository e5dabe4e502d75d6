//! The columns of nominal configurations.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::State;
use crate::math::space::Component;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::{Row, columns};
use crate::mechanism::dim::{Declared, Dim, Wanted};
use crate::mechanism::status::Status;
use crate::nominal::path::Configuration;
use crate::nominal::trace::Trace;

columns! {
    /// How near a configuration is to a singular one.
    Measured in MeasuredTable by MeasuredRows from FreshMeasured:
    /// Smallest singular value of the length-scaled closure Jacobian.
    singular_value: f64 [];
    /// The motion that belongs to it.
    singular_motion: f64 [Body, Component];
}

columns! {
    /// The drives that bring the output to a target.
    Commanded in CommandedTable by CommandedRows from FreshCommanded:
    /// Drive values.
    drives: f64 [Drive];
    /// Distance from the target.
    mismatch: f64 [];
}

columns! {
    /// A pose alone.
    Traced in TracedTable by TracedRows from FreshTraced:
    /// Coordinates of all bodies.
    poses: f64 [Body, Coordinate];
    /// Pose of the output.
    output: f64 [Component];
    /// Outcome.
    status: Status [];
}

columns! {
    /// Nearness to singularities; motions and twists are length-scaled, their largest part one.
    Nearness in NearnessTable by NearnessRows from FreshNearness:
    /// Smallest singular values.
    values: f64 [Singularity] if details;
    /// The motions that belong to them.
    motions: f64 [Singularity, Body, Component] if details;
    /// What these do to the output.
    twists: f64 [Singularity, Component] if details;
    /// Smallest singular value of the whole Jacobian.
    closure: f64 [];
    /// Sign of its determinant.
    sign: f64 [];
}

columns! {
    /// Motion of all bodies at their origins, in ground axes.
    Moving in MovingTable by MovingRows from FreshMoving:
    /// Velocities and angular velocities.
    velocity: f64 [Body, Component];
    /// Accelerations and angular accelerations.
    acceleration: f64 [Body, Component];
    /// Outcome.
    status: Status [];
}

impl Mechanism {
    /// How near every case is to a singular state, at its nominal coordinates.
    #[must_use]
    pub fn measure(&self, cases: &[Case<'_>]) -> Answer {
        let wanted = Wanted::all(self);
        let measured = |case: &Case<'_>| {
            if case.coordinates.iter().any(|c| c.is_nan()) {
                return Measured::unknown(&wanted);
            }
            let inputs = Inputs::nominal(self, case.drives);
            let state = State { coordinates: case.coordinates.to_vec(), inputs, negative: false };
            let (singular_value, singular_motion) = self.singular_value_at(&state);
            Measured { singular_value, singular_motion: self.of_unit_size(singular_motion) }
        };
        let rows: Vec<Measured> = cases.par_iter().map(measured).collect();
        Answer::of_rows(rows.iter(), &wanted)
    }

    /// A length-scaled motion of all bodies, its largest part a radian or the characteristic length.
    fn of_unit_size(&self, mut motion: Vec<f64>) -> Vec<f64> {
        let largest = motion.iter().fold(0.0_f64, |a, v| if v.abs() > a.abs() { *v } else { a });
        for (j, v) in motion.iter_mut().enumerate() {
            *v /= largest;
            if matches!(self.space.components()[j % self.size()], Component::Along(_)) {
                *v *= self.length;
            }
        }
        motion
    }

    /// Configurations of the inverse kinematics, column by column.
    #[must_use]
    pub fn reached(&self, found: &[Configuration]) -> Answer {
        let wanted = Wanted::all(self);
        let row = |c: &Configuration| {
            let (traced, reached) =
                (Traced { status: c.status, ..Traced::unknown(&wanted) }, Commanded::unknown(&wanted));
            let Some(State { coordinates, inputs, .. }) = &c.state else { return (traced, reached) };
            let output = self.output(coordinates, inputs);
            let reached = Commanded { drives: inputs.drives.clone(), mismatch: c.mismatch };
            (Traced { poses: coordinates.clone(), output, ..traced }, reached)
        };
        let (traced, reached): (Vec<Traced>, Vec<Commanded>) = found.iter().map(row).unzip();
        Answer::of_rows(traced.iter(), &wanted).beside(Answer::of_rows(reached.iter(), &wanted))
    }

    /// Poses, column by column.
    #[must_use]
    pub fn traced(&self, found: Trace) -> Answer {
        let output = self.outputs(&found.coordinates);
        let n = found.status.len();
        let table = TracedTable { n, poses: found.coordinates, output, status: found.status };
        Answer::of(table, &Wanted::all(self))
    }
}

/// The columns that a nominal question can have.
#[must_use]
pub fn declared() -> [(&'static str, Vec<Declared>); 5] {
    [
        ("trace", Traced::DECLARED.to_vec()),
        ("measure", Measured::DECLARED.to_vec()),
        ("inverse", [Traced::DECLARED, Commanded::DECLARED].concat()),
        ("nearness", Nearness::DECLARED.to_vec()),
        ("moving", Moving::DECLARED.to_vec()),
    ]
}
