//! The columns of nominal configurations.

use crate::closure::newton::State;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::columns::{Row, columns};
use crate::mechanism::dim::{Declared, Dim, Wanted};
use crate::mechanism::status::Status;
use crate::nominal::path::Configuration;
use crate::nominal::trace::Trace;

columns! {
    /// A configuration with its nearness to a singular one.
    Solved in SolvedTable by SolvedRows from FreshSolved:
    /// Coordinates of all bodies.
    poses: f64 [Body, Coordinate];
    /// Pose of the output.
    output: f64 [Component];
    /// Drive values.
    drives: f64 [Drive];
    /// Smallest singular value of the length-scaled closure Jacobian.
    singular_value: f64 [];
    /// The motion that belongs to it.
    singular_motion: f64 [Body, Component];
    /// Outcome.
    status: Status [];
}

columns! {
    /// What is left to a target.
    Missed in MissedTable by MissedRows from FreshMissed:
    /// Distance from it.
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

impl Mechanism {
    /// Configurations, column by column.
    #[must_use]
    pub fn solved(&self, found: &[Configuration]) -> Answer {
        let wanted = Wanted::all(self);
        let solved = |c: &Configuration| {
            let rest = Solved {
                singular_value: c.singular_value,
                singular_motion: c.singular_motion.clone(),
                status: c.status,
                ..Solved::unknown(&wanted)
            };
            let Some(State { coordinates, inputs, .. }) = &c.state else { return rest };
            let output = self.output(coordinates, inputs);
            Solved { poses: coordinates.clone(), output, drives: inputs.drives.clone(), ..rest }
        };
        let rows: Vec<Solved> = found.iter().map(solved).collect();
        Answer::of_rows(rows.iter(), &wanted)
    }

    /// Configurations of the inverse kinematics, column by column.
    #[must_use]
    pub fn reached(&self, found: &[Configuration]) -> Answer {
        let missed: Vec<Missed> = found.iter().map(|c| Missed { mismatch: c.mismatch }).collect();
        self.solved(found).beside(Answer::of_rows(missed.iter(), &Wanted::all(self)))
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
pub fn declared() -> [(&'static str, Vec<Declared>); 4] {
    [
        ("solve", Solved::DECLARED.to_vec()),
        ("inverse", [Solved::DECLARED, Missed::DECLARED].concat()),
        ("trace", Traced::DECLARED.to_vec()),
        ("nearness", Nearness::DECLARED.to_vec()),
    ]
}
