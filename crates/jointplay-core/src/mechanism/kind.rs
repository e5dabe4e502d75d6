//! Joint kinds as locked and free components of the relative displacement of two bodies.
//!
//! | joint | axes | locked in the plane | locked in space | coordinate |
//! |---|---|---|---|---|
//! | revolute | ground; first body's in space | x, y | along, side, normal, tilts | angle |
//! | prismatic | first body's | normal, angle | side, normal, roll, tilts | along |
//! | pin in slot | first body's | normal | | along |
//! | cylindrical | first body's | | side, normal, tilts | along |
//! | spherical | ground | | x, y, z | none |
//! | planar | first body's | | along, tilts | none |
//! | fixed | first body's | along, normal, angle | along, side, normal, roll, tilts | none |
//! | target | ground | nothing | nothing | none of its own |
//! | orientation | first body's | | roll, tilts | none |
//! | gear, rack, belt | first body's | coupling | coupling | none |
//! | crossed gear | first body's | | coupling | none |
//! | follower | first body's | the coordinate | the coordinate | none |
//! | screw | first body's | | coupling, side, normal, tilts | angle |
//!
//! A spherical joint can hold a settled spin besides (see `closure/equations.rs`).
//! A coupling (see [`crate::mechanism::coupling`]) is given as a displacement along axis 0.

use serde::Deserialize;

use crate::math::space::Component::{self, About, Along};
use crate::math::space::Space;

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
    /// Two toothed wheels that mesh, of parallel axes.
    Gear,
    /// Two toothed wheels that mesh, of axes that cross or intersect; in space only.
    CrossedGear,
    /// A rack on the first body, along the joint's axis (in space: its side), and a pinion on the second.
    Rack,
    /// A belt or chain around two pulleys of parallel axes.
    Belt,
    /// A screw in a nut; in space only.
    Screw,
    /// A coordinate that follows another joint's.
    Follower,
}

/// A kind of joint in the plane or in space.
pub(crate) struct Form {
    /// The components that it holds, those that a clearance can loosen first.
    pub locked: &'static [Component],
    /// How many these are.
    pub loosened: usize,
    /// The component that a drive commands.
    pub coordinate: Option<Component>,
    /// Whether its displacement is given in ground axes: it has no direction of its own.
    pub ground: bool,
    /// Whether its first row couples the motions of its bodies.
    pub couples: bool,
}

impl Form {
    const fn new(locked: &'static [Component], coordinate: Option<Component>) -> Self {
        Self { locked, loosened: locked.len(), coordinate, ground: false, couples: false }
    }

    const fn in_ground_axes(self) -> Self {
        Self { ground: true, ..self }
    }

    const fn loosened(self, loosened: usize) -> Self {
        Self { loosened, ..self }
    }

    const fn coupling(self) -> Self {
        Self { couples: true, ..self }
    }
}

impl JointKind {
    /// What it is in a space; `None` where it does not exist.
    pub(crate) const fn form(self, space: Space) -> Option<Form> {
        use JointKind as Kind;
        Some(match (space, self) {
            // The joint's angle is the second body's relative to the first's, whatever its axes.
            (Space::Planar, Kind::Revolute) => Form::new(&[Along(0), Along(1)], Some(About(2))).in_ground_axes(),
            (Space::Planar, Kind::Prismatic) => Form::new(&[Along(1), About(2)], Some(Along(0))),
            (Space::Planar, Kind::PinInSlot) => Form::new(&[Along(1)], Some(Along(0))),
            // The pin of a locked hinge keeps its play, its angle is held.
            (Space::Planar, Kind::Fixed) => Form::new(&[Along(0), Along(1), About(2)], None).loosened(2),
            // What it holds is the coordinate of another joint.
            (_, Kind::Follower) => Form::new(&[Along(0)], None),
            (_, Kind::Target) => Form::new(&[], None).in_ground_axes(),
            (Space::Spatial, Kind::Revolute) => {
                Form::new(&[Along(0), Along(1), Along(2), About(1), About(2)], Some(About(0)))
            }
            (Space::Spatial, Kind::Cylindrical) => Form::new(&[Along(1), Along(2), About(1), About(2)], Some(Along(0))),
            (Space::Spatial, Kind::Prismatic) => {
                Form::new(&[Along(1), Along(2), About(0), About(1), About(2)], Some(Along(0)))
            }
            (Space::Spatial, Kind::Spherical) => Form::new(&[Along(0), Along(1), Along(2)], None).in_ground_axes(),
            (Space::Spatial, Kind::Planar) => Form::new(&[Along(0), About(1), About(2)], None),
            (Space::Spatial, Kind::Fixed) => {
                Form::new(&[Along(0), Along(1), Along(2), About(0), About(1), About(2)], None).loosened(0)
            }
            (Space::Spatial, Kind::Orientation) => Form::new(&[About(0), About(1), About(2)], None).loosened(0),
            (_, Kind::Gear | Kind::Rack | Kind::Belt) | (Space::Spatial, Kind::CrossedGear) => {
                Form::new(&[Along(0)], None).coupling()
            }
            // The order of a revolute's, whose pin set fits it.
            (Space::Spatial, Kind::Screw) => {
                Form::new(&[Along(0), Along(1), Along(2), About(1), About(2)], Some(About(0))).coupling()
            }
            (
                Space::Planar,
                Kind::Cylindrical
                | Kind::Spherical
                | Kind::Planar
                | Kind::Orientation
                | Kind::CrossedGear
                | Kind::Screw,
            )
            | (Space::Spatial, Kind::PinInSlot) => return None,
        })
    }
}
