//! A joint of two bodies: its points, its axes, and the components of their relative displacement that it holds.
//!
//! Axis 0 of the joint's axes is the joint's direction. In the plane axis 1 is its normal (90 degrees
//! on) and axis 2 completes them; a revolute joint in the plane has no direction of its own, so that its
//! offsets are given in ground axes. In space axis 1 is the side and axis 2 the normal.

use crate::math::space::{Component, Space};
use crate::math::vector::{Mat3, Vec3, cross, dot, norm, scale, sub};
use crate::mechanism::coupling::Coupling;
use crate::mechanism::follower::Follower;
use crate::mechanism::kind::JointKind;
use crate::mechanism::spec::{Coordinate, JointSpec};

/// The axes in which a joint's displacement is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Ground axes.
    Ground,
    /// The joint axes that the first body carries.
    First,
}

/// A joint as the closure equations see it.
#[derive(Clone, Debug)]
pub struct Joint {
    /// The space it works in.
    pub space: Space,
    /// Point on the first body.
    pub first: usize,
    /// Point on the second body.
    pub second: usize,
    /// Axes of the displacement.
    pub frame: Frame,
    /// Joint axes on the first body, rows in body axes.
    pub axes_first: Mat3<f64>,
    /// Joint axes on the second body, rows in body axes.
    pub axes_second: Mat3<f64>,
    /// Components that the joint holds.
    pub locked: Vec<Component>,
    /// How many of them, from the first on, a clearance can loosen.
    pub loosened: usize,
    /// Whether the last of them is a spin that moves nothing: held, and never with a reaction.
    pub settled: bool,
    /// The component that a drive commands.
    pub coordinate: Option<Component>,
    /// What its first row couples.
    pub(crate) coupling: Option<Coupling>,
    /// What its row follows.
    pub(crate) follows: Option<Follower>,
}

/// The rotation about axis 0.
const SPIN: Component = Component::About(0);
const IDENTITY: Mat3<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Joint {
    /// Builds a joint.
    pub(crate) fn new(space: Space, spec: &JointSpec) -> Result<Self, &'static str> {
        let form = spec.kind.form(space).ok_or("is of a kind that does not exist in this space")?;
        if spec.settled && (space, spec.kind) != (Space::Spatial, JointKind::Spherical) {
            return Err("has no spin to settle");
        }
        let axes = |axis, side| {
            if form.ground && !spec.settled {
                return Ok(IDENTITY);
            }
            let axes = match space {
                Space::Planar => planar_axes(axis),
                Space::Spatial => spatial_axes(axis, side),
            };
            axes.ok_or("has no direction, or its side lies along its axis")
        };
        let (axes_first, axes_second) =
            (axes(spec.axis_first, spec.side_first)?, axes(spec.axis_second, spec.side_second)?);
        let coupling = match (form.couples, &spec.coupling) {
            (true, Some(coupling)) => Some(Coupling::new(spec.kind, coupling)?),
            (true, None) => return Err("needs its coupling"),
            (false, _) => None,
        };
        Ok(Self {
            space,
            first: spec.first,
            second: spec.second,
            frame: if form.ground { Frame::Ground } else { Frame::First },
            axes_first,
            axes_second,
            locked: form.locked.iter().copied().chain(spec.settled.then_some(SPIN)).collect(),
            loosened: form.loosened,
            settled: spec.settled,
            coordinate: form.coordinate,
            coupling,
            follows: None,
        })
    }

    /// Whether a component is the settled spin.
    pub(crate) fn is_spin(&self, component: Component) -> bool {
        self.settled && component == SPIN
    }

    /// Whether a component is no displacement of the joint along its axes.
    pub(crate) fn is_apart(&self, component: Component) -> bool {
        self.follows.is_some() || self.is_spin(component)
    }

    /// Whether it is an angle that follows.
    pub(crate) fn follows_by_angle(&self) -> bool {
        self.follows.is_some() && matches!(self.locked[..], [Component::About(_)])
    }

    /// Makes it one of the coordinates that follow a joint.
    pub(crate) fn follow(&mut self, component: Component, follower: Follower) {
        self.locked = vec![component];
        self.follows = Some(follower);
    }

    /// The component of a name; `None` where the joint cannot be driven along it.
    pub(crate) fn component_of(&self, coordinate: Coordinate) -> Option<Component> {
        let ground = self.frame == Frame::Ground;
        let component = match (coordinate, self.space) {
            (Coordinate::X, _) if ground => Component::Along(0),
            (Coordinate::Y, _) if ground => Component::Along(1),
            (Coordinate::Z, Space::Spatial) if ground => Component::Along(2),
            (Coordinate::Angle, Space::Planar) => Component::About(2),
            (Coordinate::Angle, Space::Spatial) if !ground => Component::About(0),
            (Coordinate::Along, _) if !ground => Component::Along(0),
            _ => return None,
        };
        (!self.locked.contains(&component)).then_some(component)
    }

    /// Name of a component in the joint's axes.
    #[must_use]
    pub fn name_of(&self, component: Component) -> &'static str {
        if let (Some(coupling), Component::Along(0)) = (&self.coupling, component) {
            return coupling.name;
        }
        match (self.space, &self.frame, component) {
            (Space::Planar, _, Component::About(_)) => "angle",
            (Space::Planar, Frame::First, Component::Along(1)) => "normal",
            (_, Frame::Ground, Component::Along(i)) => ["x", "y", "z"][i],
            (_, Frame::First, Component::Along(i)) => ["along", "side", "normal"][i],
            (Space::Spatial, _, Component::About(0)) if self.coordinate == Some(component) => "angle",
            (Space::Spatial, _, Component::About(i)) => ["roll", "tilt_side", "tilt_normal"][i],
        }
    }

    /// The rotation component about the joint's axis.
    pub(crate) const fn roll(&self) -> Component {
        Component::About(self.plane()[2])
    }

    /// The axes of the plane that it turns in, and the one that it turns about.
    pub(crate) const fn plane(&self) -> [usize; 3] {
        match self.space {
            Space::Planar => [0, 1, 2],
            Space::Spatial => [1, 2, 0],
        }
    }
}

/// Axis, normal and the direction out of the plane.
fn planar_axes(axis: Vec3<f64>) -> Option<Mat3<f64>> {
    let along = unit(axis).filter(|_| axis[2] == 0.0)?;
    let out = [0.0, 0.0, 1.0];
    Some([along, cross(out, along), out])
}

/// Axis, side at right angles to it, normal.
fn spatial_axes(axis: Vec3<f64>, side: Vec3<f64>) -> Option<Mat3<f64>> {
    let along = unit(axis)?;
    let across = sub(unit(side)?, scale(along, dot(along, unit(side)?)));
    // A side within a thousandth of a radian of the axis is a slip of the keyboard.
    let side = unit(across).filter(|_| norm(&across) > 1e-3)?;
    Some([along, side, cross(along, side)])
}

fn unit(v: Vec3<f64>) -> Option<Vec3<f64>> {
    let size = norm(&v);
    (size.is_finite() && size > 0.0).then(|| scale(v, 1.0 / size))
}
