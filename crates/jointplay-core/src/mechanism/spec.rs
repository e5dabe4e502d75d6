//! The mechanism as it arrives: plain data in SI units and radians, not yet checked.

use serde::Deserialize;

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::math::space::Space;

/// A whole mechanism.
#[derive(Clone, Debug, Deserialize)]
pub struct Spec {
    /// Plane or space.
    pub space: Space,
    /// Number of moving bodies (the ground is not counted).
    pub n_bodies: usize,
    /// Rough coordinates of every body; they choose the assembly branch.
    pub guess: Vec<Vec<f64>>,
    /// Characteristic length, by which lengths are compared with angles.
    pub length: f64,
    /// Smallest acceptable singular value of the length-scaled closure Jacobian.
    pub singular_value: f64,
    /// Points fixed to bodies; everything else refers to them by index.
    pub points: Vec<PointSpec>,
    /// Joints between two points.
    pub joints: Vec<JointSpec>,
    /// Driven joints.
    pub drives: Vec<DriveSpec>,
    /// The point whose pose error is asked.
    pub output: OutputSpec,
    /// Dead loads in ground axes.
    #[serde(default)]
    pub loads: Vec<LoadSpec>,
    /// What can be off.
    #[serde(default)]
    pub sources: Vec<SourceSpec>,
}

/// A point fixed to a body.
#[derive(Clone, Debug, Deserialize)]
pub struct PointSpec {
    /// Index of the body; -1 is the ground.
    pub body: i64,
    /// Position in body axes.
    pub at: [f64; 3],
}

/// The kinds of joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    /// A pin in a hole.
    Revolute,
    /// A slider in a guide.
    Prismatic,
    /// A pin in a slot carried by the first body; in the plane only.
    PinInSlot,
    /// Two bodies locked together.
    Fixed,
    /// A pin that turns and slides in a hole; in space only.
    Cylindrical,
    /// A ball in a socket; in space only.
    Spherical,
    /// Two faces on each other, the axis their normal; in space only.
    Planar,
    /// Nothing held: a point whose ground coordinates can be commanded.
    Target,
    /// The attitude held; in space only.
    Orientation,
}

/// A joint between two points.
#[derive(Clone, Debug, Deserialize)]
pub struct JointSpec {
    /// What it lets free.
    pub kind: JointKind,
    /// Point on the first body.
    pub first: usize,
    /// Point on the second body.
    pub second: usize,
    /// Direction of the joint in the axes of the first body.
    pub axis_first: [f64; 3],
    /// The same direction in the axes of the second body.
    pub axis_second: [f64; 3],
    /// In space: a direction off the axis, in the axes of the first body.
    #[serde(default)]
    pub side_first: [f64; 3],
    /// The same direction in the axes of the second body, where the joint's angle is zero.
    #[serde(default)]
    pub side_second: [f64; 3],
    /// Displacement of the locked components, in their order, per force and moment on them: row-major,
    /// symmetric, positive semidefinite. It adds to what the clearance allows; rigid if left out.
    #[serde(default)]
    pub compliance: Option<Vec<f64>>,
}

/// A driven joint coordinate.
#[derive(Clone, Debug, Deserialize)]
pub struct DriveSpec {
    /// Index of the joint.
    pub joint: usize,
    /// Which of its components; the joint's own coordinate if left out.
    #[serde(default)]
    pub component: Option<Coordinate>,
}

/// Joint components that can be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coordinate {
    /// Distance along the joint's axis.
    Along,
    /// Angle about the joint's axis.
    Angle,
    /// Distance along the ground's x axis.
    X,
    /// Distance along the ground's y axis.
    Y,
    /// Distance along the ground's z axis.
    Z,
}

/// The output point.
#[derive(Clone, Debug, Deserialize)]
pub struct OutputSpec {
    /// Index of the point.
    pub point: usize,
}

/// A dead load in ground axes.
#[derive(Clone, Debug, Deserialize)]
pub struct LoadSpec {
    /// Point where the force acts.
    pub point: usize,
    /// Force.
    pub force: [f64; 3],
    /// Moment.
    pub moment: [f64; 3],
}

/// What a source moves.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Target {
    /// The clearance of a joint.
    Clearance {
        /// Index of the joint.
        joint: usize,
    },
    /// The distance between two points of one body; the second point moves.
    Dimension {
        /// The point that stays.
        from: usize,
        /// The point that moves.
        to: usize,
    },
    /// The value of a drive.
    Drive {
        /// Index of the drive.
        drive: usize,
    },
    /// The angle of a fixed joint.
    Angle {
        /// Index of the joint.
        joint: usize,
    },
}

/// One thing that can be off.
#[derive(Clone, Debug, Deserialize)]
pub struct SourceSpec {
    /// What it moves.
    #[serde(flatten)]
    pub target: Target,
    /// Where its offset can be, relative to the centre.
    pub set: Set,
    /// Known deviation of the built unit.
    pub centre: Vec<f64>,
    /// How it scatters.
    pub law: Law,
}
