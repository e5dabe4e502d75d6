//! The mechanism as it arrives: plain data in SI units and radians, not yet checked.

use serde::Deserialize;

use crate::clearance::Set;
use crate::clearance::law::{Law, ScalarLaw};
use crate::math::curve::Curve;
use crate::math::space::Space;
use crate::mechanism::kind::JointKind;

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
    /// Forces and moments.
    #[serde(default)]
    pub loads: Vec<LoadSpec>,
    /// Rigid displacements of points, which sources bring about. A point goes through its own in this order.
    #[serde(default)]
    pub displacements: Vec<DisplacementSpec>,
    /// Springs between two points, which load the mechanism by its pose.
    #[serde(default)]
    pub springs: Vec<SpringSpec>,
    /// Torsion springs about joints.
    #[serde(default)]
    pub torsions: Vec<TorsionSpec>,
    /// What can be off.
    #[serde(default)]
    pub sources: Vec<SourceSpec>,
    /// Which of them are correlated.
    #[serde(default)]
    pub correlations: Vec<CorrelationSpec>,
}

/// A point fixed to a body.
#[derive(Clone, Debug, Deserialize)]
pub struct PointSpec {
    /// Index of the body; -1 is the ground.
    pub body: i64,
    /// Position in body axes.
    pub at: [f64; 3],
}

/// What a coupling needs beside its points and axes; every kind reads its own part.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CouplingSpec {
    /// Pitch radii on the first and the second body; a rack's pinion has the first, of crossed gears the second counts.
    pub radii: [f64; 2],
    /// Tooth counts, or whole numbers in the ratio of the radii.
    pub teeth: [u32; 2],
    /// Pressure angle where the pitch circles touch.
    pub pressure_angle: f64,
    /// Whether the second wheel of a gear pair is a ring around the first.
    pub internal: bool,
    /// Whether a belt is crossed.
    pub crossed: bool,
    /// Travel of a screw's second body along the axis for a turn about it.
    pub lead: f64,
    /// Distance of the pulleys at which a belt has its slack; that of the guess if left out.
    pub distance: Option<f64>,
    /// Angles at which the two bodies see the line of centres (of crossed gears the other axis) when the wheels mesh; those
    /// of the guess if left out.
    pub marks: Option<[f64; 2]>,
    /// How two wheels touch whose axes are not parallel.
    pub contact: Option<ContactSpec>,
}

/// Two wheels of axes that are not parallel where they mesh, in any axes common to both.
#[derive(Clone, Debug, Deserialize)]
pub struct ContactSpec {
    /// Directions of both axes.
    pub axes: [[f64; 3]; 2],
    /// From the first centre to the second.
    pub apart: [f64; 3],
    /// From the first centre to the pitch point.
    pub at: [f64; 3],
    /// What both flanks push along, per unit of force at the pitch circle of the second wheel: the mean.
    pub normal: [f64; 3],
    /// What one flank pushes along more, and the other less: outwards from the first wheel.
    pub opening: [f64; 3],
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
    /// What a coupling needs more.
    #[serde(default)]
    pub coupling: Option<CouplingSpec>,
    /// What the coordinate of a follower follows.
    #[serde(default)]
    pub follows: Option<FollowerSpec>,
    /// Of a ball joint whose one body, with what hangs on it, can spin about a line without moving anything else:
    /// whether this spin is held. Axis and side are then the line and a direction off it on both bodies.
    #[serde(default)]
    pub settled: bool,
}

/// A coordinate that follows that of another joint.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FollowerSpec {
    /// The joint whose coordinate is led.
    pub of: usize,
    /// The joint that leads.
    pub leader: usize,
    /// The led coordinate over the leading one.
    pub curve: Curve,
    /// An angle that leads is taken within half a turn of this.
    #[serde(default)]
    pub middle: f64,
}

/// A driven joint coordinate.
#[derive(Clone, Debug, Deserialize)]
pub struct DriveSpec {
    /// Index of the joint.
    pub joint: usize,
    /// Which of its components; the joint's own coordinate if left out.
    #[serde(default)]
    pub component: Option<Coordinate>,
    /// The coordinate is this times the drive's value with its error.
    #[serde(default = "one")]
    pub coefficient: f64,
    /// Further coordinates that the same drive commands.
    #[serde(default)]
    pub also: Vec<DrivenSpec>,
    /// How far the coordinates give way per force or moment on them, in their order: row-major, symmetric, positive
    /// semidefinite; rigid if left out.
    #[serde(default)]
    pub compliance: Option<Vec<f64>>,
}

/// A further coordinate that a drive commands.
#[derive(Clone, Debug, Deserialize)]
pub struct DrivenSpec {
    /// Index of the joint.
    pub joint: usize,
    /// Which of its components; the joint's own coordinate if left out.
    #[serde(default)]
    pub component: Option<Coordinate>,
    /// The coordinate is this times the drive's value with its error.
    #[serde(default = "one")]
    pub coefficient: f64,
}

const fn one() -> f64 {
    1.0
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
    /// The body against which it is measured, in the axes of that body; the ground if left out.
    #[serde(default)]
    pub relative_to: Option<usize>,
}

/// A load: dead in ground axes, or a follower in those of a body.
#[derive(Clone, Debug, Deserialize)]
pub struct LoadSpec {
    /// Point where the force acts.
    pub point: usize,
    /// Force.
    pub force: [f64; 3],
    /// Moment.
    pub moment: [f64; 3],
    /// Index of the body in whose axes force and moment are given; ground axes if left out.
    #[serde(default)]
    pub axes: Option<usize>,
}

/// A spring along the line between two points, with the tension `preload + stiffness * (distance - free_length)`.
#[derive(Clone, Debug, Deserialize)]
pub struct SpringSpec {
    /// Index of the point at one end.
    pub first: usize,
    /// Index of the point at the other end.
    pub second: usize,
    /// Force per length.
    pub stiffness: f64,
    /// Length at which the tension is the preload.
    pub free_length: f64,
    /// Tension at the free length; a negative one pushes.
    pub preload: f64,
}

/// A torsion spring: the moment on the second body of a joint, about its axis, is
/// `-(preload + stiffness * (angle - free_angle))`. The difference of angles is within half a turn.
#[derive(Clone, Debug, Deserialize)]
pub struct TorsionSpec {
    /// Index of the joint.
    pub joint: usize,
    /// Moment per angle.
    pub stiffness: f64,
    /// Angle at which the moment is the preload.
    pub free_angle: f64,
    /// Moment at the free angle.
    pub preload: f64,
}

/// A point that a source moves.
#[derive(Clone, Debug, Deserialize)]
pub struct MoveSpec {
    /// Index of the point.
    pub point: usize,
    /// How far it moves per unit of the source's value, in the axes of its body.
    pub rate: [f64; 3],
}

/// A rigid displacement of points of one body and of the axes of the joints that sit there.
#[derive(Clone, Debug, Deserialize)]
pub struct DisplacementSpec {
    /// Indices of the points.
    pub points: Vec<usize>,
    /// What it turns about, in body axes.
    pub about: [f64; 3],
}

/// What a component of a displacement is called.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlaceComponent {
    /// Along the body's x axis.
    X,
    /// Along the body's y axis.
    Y,
    /// Along the body's z axis.
    Z,
    /// Along the joint's side.
    Side,
    /// Along the joint's normal.
    Normal,
    /// About the joint's side.
    TiltSide,
    /// About the joint's normal.
    TiltNormal,
    /// The only component, a translation.
    Length,
    /// The only component, a rotation.
    Angle,
}

impl PlaceComponent {
    /// Its name in results.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Side => "side",
            Self::Normal => "normal",
            Self::TiltSide => "tilt_side",
            Self::TiltNormal => "tilt_normal",
            Self::Length => "length",
            Self::Angle => "angle",
        }
    }
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
    /// Where points of a body are, and how the axes of the joints there lie: a part of a displacement.
    Place {
        /// Index of the displacement.
        displacement: usize,
        /// What its components are called.
        components: Vec<PlaceComponent>,
        /// Translation and rotation vector per unit of every component, in body axes.
        ways: Vec<[[f64; 3]; 2]>,
    },
    /// The distance between two points of one body; the second point moves.
    Dimension {
        /// The point that stays.
        from: usize,
        /// The point that moves.
        to: usize,
        /// Points of that body at the same place, which move with it.
        #[serde(default)]
        together: Vec<usize>,
    },
    /// A size of the parts of a clearance (the diameter of a hole, of a pin), on which its gap depends.
    Size {
        /// Index of the joint.
        joint: usize,
        /// How much the gap grows with it.
        factor: f64,
        /// Further joints whose gap depends on it: several bodies on one pin.
        #[serde(default)]
        also: Vec<GapSpec>,
    },
    /// The value of a drive.
    Drive {
        /// Index of the drive.
        drive: usize,
    },
    /// The lost motion of a drive, in which the load decides.
    Backlash {
        /// Index of the drive.
        drive: usize,
        /// Index of the joint that it moves with this lost motion.
        joint: usize,
    },
    /// Points that move together, such as those of bodies that grow with the temperature.
    Growth {
        /// The points.
        moves: Vec<MoveSpec>,
    },
    /// The angle of a fixed joint.
    Angle {
        /// Index of the joint.
        joint: usize,
    },
    /// The transmission error of a coupling, a length at the pitch circle or along the axis.
    Ratio {
        /// Index of the joint.
        joint: usize,
    },
}

/// A further joint whose gap depends on a size.
#[derive(Clone, Debug, Deserialize)]
pub struct GapSpec {
    /// Index of the joint.
    pub joint: usize,
    /// How much the gap grows with the size.
    pub factor: f64,
}

/// One thing that can be off.
#[derive(Clone, Debug, Deserialize)]
pub struct SourceSpec {
    /// What it moves.
    #[serde(flatten)]
    pub target: Target,
    /// Where its offset can be, relative to the centre. That of a clearance with sizes has the gap at the middle of all
    /// sizes, which may be below zero.
    pub set: Set,
    /// Known deviation of the built unit.
    pub centre: Vec<f64>,
    /// How it scatters.
    pub law: LawSpec,
}

/// How a source scatters.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum LawSpec {
    /// Over its set, by name.
    Plain(Law),
    /// By a law of one number.
    Scalar(ScalarLaw),
}

/// Sources of one number that do not scatter one by one: a Gaussian copula.
#[derive(Clone, Debug, Deserialize)]
pub struct CorrelationSpec {
    /// Indices of the sources.
    pub sources: Vec<usize>,
    /// What makes their scores of independent ones, a row of length 1 for each source.
    pub factor: Vec<Vec<f64>>,
}
