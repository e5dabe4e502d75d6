//! Joint kinds as locked and free components of the relative displacement of two bodies.
//!
//! | joint | axes | locked | coordinate |
//! |---|---|---|---|
//! | revolute | ground | x, y | angle |
//! | prismatic | first body's | normal, angle | along |
//! | pin in slot | first body's | normal | along |
//! | fixed | first body's | along, normal, angle | none |
//!
//! Axis 0 of the joint's axes is the joint's direction, axis 1 its normal (90 degrees on), axis 2
//! completes them. A revolute joint in the plane has no direction of its own, so that its offsets
//! are told in ground axes.

use crate::space::{Component, Mat3, Space, Vec3, cross, norm, scale};
use crate::spec::{JointKind, JointSpec};

/// The axes in which a joint's displacement is told.
#[derive(Clone, Debug)]
pub enum Frame {
    /// Ground axes.
    Ground,
    /// Axes fixed to the first body (rows are the axes in body axes).
    First(Mat3<f64>),
}

/// A joint as the closure equations see it.
#[derive(Clone, Debug)]
pub struct Joint {
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
    /// Indices into `locked` of the components that a clearance loosens.
    pub play: Vec<usize>,
    /// The component that a drive commands.
    pub coordinate: Option<Component>,
}

impl Joint {
    /// Builds a joint; `None` when a direction is missing.
    pub(crate) fn new(space: Space, spec: &JointSpec) -> Option<Self> {
        use Component::{About, Along};
        let Space::Planar = space;
        let axes_first = planar_axes(spec.axis_first)?;
        let axes_second = planar_axes(spec.axis_second)?;
        let (ground, locked, play, coordinate) = match spec.kind {
            JointKind::Revolute => (true, vec![Along(0), Along(1)], vec![0, 1], Some(About(2))),
            JointKind::Prismatic => (false, vec![Along(1), About(2)], vec![0, 1], Some(Along(0))),
            JointKind::PinInSlot => (false, vec![Along(1)], vec![0], Some(Along(0))),
            JointKind::Fixed => (false, vec![Along(0), Along(1), About(2)], vec![], None),
        };
        // A revolute joint's angle is the second body's relative to the first's, whatever its axes.
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let (axes_first, axes_second) = if ground { (identity, identity) } else { (axes_first, axes_second) };
        let frame = if ground { Frame::Ground } else { Frame::First(axes_first) };
        Some(Self { first: spec.first, second: spec.second, frame, axes_first, axes_second, locked, play, coordinate })
    }

    /// Name of a component in the joint's axes.
    #[must_use]
    pub const fn name_of(&self, component: Component) -> &'static str {
        match (&self.frame, component) {
            (_, Component::About(_)) => "angle",
            (Frame::Ground, Component::Along(0)) => "x",
            (Frame::Ground, Component::Along(_)) => "y",
            (Frame::First(_), Component::Along(0)) => "along",
            (Frame::First(_), Component::Along(_)) => "normal",
        }
    }

    pub(crate) fn component_name(&self, locked: usize) -> &'static str {
        self.name_of(self.locked[locked])
    }
}

/// Axis, normal and the direction out of the plane.
fn planar_axes(axis: Vec3<f64>) -> Option<Mat3<f64>> {
    let size = norm(&axis);
    if !(size.is_finite() && size > 0.0) || axis[2] != 0.0 {
        return None;
    }
    let along = scale(axis, 1.0 / size);
    let out = [0.0, 0.0, 1.0];
    Some([along, cross(out, along), out])
}
